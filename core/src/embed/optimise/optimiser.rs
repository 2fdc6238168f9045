//! The state of an optimisation: topology, field and map, and the solves for them (Campen, sections 6.3 to 6.5).
//!
//! An optimiser works in one of two phases. In the least-squares phase maps may flip triangles; in the injective phase,
//! with [`DistortionWeights`], every state is an injective map. The other files of the module are operations on it:
//! [`descent`](super::descent) moves the nodes, [`finalise`](super::finalise) ends the phase.

use glam::{DVec2, DVec3};

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::relocation::{NodeConstraint, SurfaceProjection};
use crate::embed::optimise::setup::{PreparedTopology, mean_edge_length, surface_projection};
use crate::embed::parameterise::chord_lengths::{ChordLengths, chord_lengths};
use crate::embed::parameterise::injective::{Flipped, InitialMap};
use crate::embed::parameterise::solve::{FeatureConstraint, MapKind, Solver, Systems};
use crate::embed::parameterise::state::State;
use crate::embed::problem::{Problem, Settings};
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::{HalfArc, ThroughArcs};
use crate::layout::QuadLayout;
use crate::param::{DistortionWeights, gradients};
use crate::progress::Progress;
use crate::surface::{Metric, PrincipalCurvature};

/// Newton steps of an injective map after the nodes have moved. The first ones correct the guess; more would be spent
/// on a map that the next node step changes again.
const NEWTON_STEPS: usize = 4;
/// Number of rings of triangles around a vertex, from or to which a node has moved, in which the field turns markedly.
const TURNING_RINGS: usize = 2;

/// An embedding under optimisation.
pub struct Optimiser<'a> {
    pub(super) projection: SurfaceProjection<'a>,
    pub(super) settings: Settings,
    /// Principal curvatures at the vertices of the working mesh.
    pub(in crate::embed) curvature: Vec<PrincipalCurvature>,
    /// Whether each edge of the working mesh is sharp.
    pub(in crate::embed) sharp: Vec<bool>,
    pub(super) through_arcs: ThroughArcs,
    pub(super) chord_lengths: ChordLengths,
    /// The chord of each arc.
    pub(super) chord_of: Vec<u32>,
    /// Least length of a chord in the map.
    pub(super) min_length: f64,
    /// Fewest quads across each chord.
    pub(super) min_quads: Vec<u32>,
    /// The half-arcs at each node.
    pub(super) half_arcs: Vec<Vec<HalfArc>>,
    pub(super) systems: Systems,
    /// Energy weights of the injective phase; `None` in the least-squares phase.
    pub(super) distortion: Option<DistortionWeights>,
    pub(super) features: FeatureConstraint,
    /// Feature edges that have a unit penalty even if others have a hard constraint; empty: none.
    pub(super) relaxed: Vec<bool>,
    pub(super) state: State,
    /// Factor of the step size of each node.
    pub(super) step_factor: Vec<f64>,
    /// Unit direction of each node's last step in space; zero before the first.
    pub(super) last_direction: Vec<DVec3>,
    /// Failed node steps since the last successful one.
    pub(super) failed: usize,
    /// Successive node steps that lowered the energy too little; see [`super::descent`].
    pub(super) idle: usize,
    /// Node steps of this phase.
    pub(super) steps: usize,
}

impl<'a> Optimiser<'a> {
    /// Sets up the least-squares phase from an initial embedding and solves for the first field and map.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub fn new(problem: &Problem<'a>, progress: &Progress) -> Result<Self, EmbeddingError> {
        let prepared = PreparedTopology::new(problem)?;
        progress.check()?;
        Self::with_map(problem, prepared, (MapKind::LeastSquares, FeatureConstraint::Hard), progress)?
            .map_err(|_| EmbeddingError::NoInjectiveMap)
    }

    /// Sets up a phase on a prepared topology and solves for its first field and map. The result is [`Flipped`] if an
    /// injective map was asked for and none was found.
    pub(in crate::embed) fn with_map(
        problem: &Problem<'a>,
        PreparedTopology { topology, sharp, curvature }: PreparedTopology,
        (kind, features): (MapKind<'_>, FeatureConstraint),
        progress: &Progress,
    ) -> Result<Result<Self, Flipped>, EmbeddingError> {
        let Problem { surface, layout, settings, .. } = *problem;
        let pinned = problem.pinned();
        let mut through_arcs = ThroughArcs::new(layout, |i| pinned[i]);
        let distortion = match kind {
            MapKind::LeastSquares => None,
            MapKind::Injective { distortion, .. } => {
                through_arcs.constrain_all();
                Some(distortion)
            }
        };
        let projection = surface_projection(&surface, &topology, &sharp, |i| pinned[i], settings);
        let chord_lengths = ChordLengths::free(layout.chords);
        let mut systems = Systems::new(&topology.mesh)?;
        let metric = Metric::new(&topology.mesh);
        let mut solver = Solver {
            curvature: &curvature,
            sharp: &sharp,
            through_arcs: &through_arcs,
            chord_lengths: &chord_lengths,
            systems: &mut systems,
            settings,
            features,
            relaxed: &[],
        };
        let solved = solver.solve(topology, metric, None, kind, progress)?;
        Ok(solved.map(|state| Self {
            projection,
            settings,
            curvature,
            sharp,
            through_arcs,
            chord_lengths,
            chord_of: layout.arcs.iter().map(|a| a.chord).collect(),
            min_length: settings.spacing * mean_edge_length(surface.mesh),
            min_quads: layout.min_quads_per_chord(),
            half_arcs: half_arcs(layout),
            systems,
            distortion,
            features,
            relaxed: Vec::new(),
            state,
            step_factor: vec![1.0; layout.nodes.len()],
            last_direction: vec![DVec3::ZERO; layout.nodes.len()],
            failed: 0,
            idle: 0,
            steps: 0,
        }))
    }

    /// Removes the constraints of regular nodes, which then move to the crossings of their isolines. [`Self::finalise`]
    /// restores them.
    pub(in crate::embed) fn release_regular_nodes(&mut self, problem: &Problem<'_>) {
        let pinned = problem.pinned();
        self.through_arcs = ThroughArcs::new(problem.layout, |i| pinned[i]);
    }

    /// The present state. A node step that does not lower the energy leaves it unchanged.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Begins the descent anew: usual step sizes, and as many steps as at first.
    pub(super) fn restart(&mut self) {
        self.step_factor.fill(1.0);
        (self.failed, self.idle, self.steps) = (0, 0, 0);
    }

    /// Returns to an earlier state of the phase and begins the descent anew, with all nodes constrained to their
    /// isolines.
    pub(in crate::embed) fn restart_constrained(&mut self, state: State) {
        self.through_arcs.constrain_all();
        if self.distortion.is_some() {
            self.relax_all_features();
        }
        for (constraint, node) in self.projection.node_constraint.iter_mut().zip(&state.topology.nodes) {
            // Nodes that were attached to features since are back where they were.
            if *constraint == NodeConstraint::Curve && !self.projection.on_curve[node.vertex.index()] {
                *constraint = NodeConstraint::Free;
            }
        }
        self.state = state;
        self.restart();
    }

    /// For each node whether it cannot move: pinned nodes, and those at corners of features or of the boundary.
    pub fn fixed_nodes(&self) -> Vec<bool> {
        self.projection.node_constraint.iter().map(|&c| c == NodeConstraint::Fixed).collect()
    }

    /// The chords that are shorter than `least` in the map, or fixed at a length, each with its length in the map.
    pub fn short_chords(&self, least: f64) -> Vec<(u32, f64)> {
        let (topology, map) = (&self.state.topology, &self.state.solution.map);
        let fixed = &self.chord_lengths.fixed;
        let found = chord_lengths(topology, &self.through_arcs, &self.chord_of, map, fixed.len());
        let short = |chord: u32, length: f64| fixed[chord as usize].is_some() || length < least;
        (0..).zip(found).filter_map(|(c, l)| Some((c, l?.1))).filter(|&(c, l)| short(c, l)).collect()
    }

    /// Solves for field and map of a topology, starting from the present ones.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`]; [`EmbeddingError::NoInjectiveMap`] if no injective map was found in the injective phase.
    pub(super) fn solve(&mut self, topology: EmbeddingTopology, progress: &Progress) -> Result<State, EmbeddingError> {
        self.try_solve(topology, progress)?.map_err(|_| EmbeddingError::NoInjectiveMap)
    }

    /// As [`Self::solve`]; the result is [`Flipped`] if no injective map was found.
    pub(super) fn try_solve(
        &mut self,
        topology: EmbeddingTopology,
        progress: &Progress,
    ) -> Result<Result<State, Flipped>, EmbeddingError> {
        let State { metric: before, field, solution, .. } = &self.state;
        let (uv, list, turning) = match self.distortion {
            Some(_) => {
                let uv = &solution.map.uv;
                (uv.clone(), gradients(before, &field.angle, uv), self.turning_triangles(&topology))
            }
            None => Default::default(),
        };
        let initial = InitialMap::BeforeStep { uv: &uv, gradients: &list, turning: &turning };
        self.solve_from(topology, initial, NEWTON_STEPS, progress)
    }

    /// As [`Self::try_solve`] with all nodes in place, after constraints have changed.
    pub(super) fn try_solve_in_place(&mut self, progress: &Progress) -> Result<Result<State, Flipped>, EmbeddingError> {
        let uv = self.state.solution.map.uv.clone();
        let topology = self.state.topology.clone();
        self.solve_from(topology, InitialMap::InPlace(&uv), NEWTON_STEPS, progress)
    }

    /// As [`Self::try_solve`], with the injective map nearest to the coordinates `uv`, not optimised further.
    pub(super) fn try_solve_near(
        &mut self,
        topology: EmbeddingTopology,
        uv: &[[DVec2; 3]],
        progress: &Progress,
    ) -> Result<Result<State, Flipped>, EmbeddingError> {
        self.solve_from(topology, InitialMap::Injective(uv), 0, progress)
    }

    fn solve_from(
        &mut self,
        topology: EmbeddingTopology,
        initial: InitialMap<'_>,
        steps: usize,
        progress: &Progress,
    ) -> Result<Result<State, Flipped>, EmbeddingError> {
        let kind = match self.distortion {
            None => MapKind::LeastSquares,
            Some(distortion) => MapKind::Injective { distortion, initial, steps },
        };
        let metric = Metric::new(&topology.mesh);
        let mut solver = Solver {
            curvature: &self.curvature,
            sharp: &self.sharp,
            through_arcs: &self.through_arcs,
            chord_lengths: &self.chord_lengths,
            systems: &mut self.systems,
            settings: self.settings,
            features: self.features,
            relaxed: &self.relaxed,
        };
        solver.solve(topology, metric, Some(&self.state.field.angle), kind, progress)
    }

    /// For each triangle of `topology` whether it lies near a vertex that a node has left or come to, where the field
    /// turns. The field does not turn with an unconstrained regular node, but its isolines do: there it suffices that
    /// the node has changed position.
    fn turning_triangles(&self, topology: &EmbeddingTopology) -> Vec<bool> {
        let mesh = &topology.mesh;
        let mut near = vec![false; mesh.n_vertices()];
        let nodes = self.state.topology.nodes.iter().zip(&topology.nodes);
        for ((old, new), constrained) in nodes.zip(&self.through_arcs.constrained) {
            let stays = self.state.topology.mesh.position(old.vertex) == topology.mesh.position(new.vertex);
            if old.vertex == new.vertex && (stays || *constrained) {
                continue;
            }
            for v in [old.vertex, new.vertex] {
                near[v.index()] = true;
            }
        }
        mesh.dilate_vertices(&mut near, TURNING_RINGS - 1);
        mesh.faces_touching(&near)
    }
}

/// The half-arcs at each node of a layout.
fn half_arcs(layout: &QuadLayout) -> Vec<Vec<HalfArc>> {
    let mut at = vec![Vec::new(); layout.nodes.len()];
    for (a, arc) in (0..).zip(&layout.arcs) {
        at[arc.nodes[0] as usize].push((a, false));
        at[arc.nodes[1] as usize].push((a, true));
    }
    at
}

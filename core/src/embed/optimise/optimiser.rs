//! Optimising an embedding: field, map and nodes in turn (Campen, sections 6.3 to 6.5).
//!
//! With the nodes where they are, the guiding field and the seamless map in which all arcs are isolines are linear
//! solves. What remains of the energy tells every node where to go. If the step made the energy less it stands, and
//! another follows; if not, it is taken back and tried at half the length.

use glam::{DVec2, DVec3};

use crate::embed::EmbeddingError;
use crate::embed::optimise::relocation::{NodeConstraint, SurfaceProjection};
use crate::embed::optimise::setup::{ground, mean_edge, sharp_edges};
use crate::embed::parameterise::chord_lengths::{Spacing, lengths};
use crate::embed::parameterise::solve::{Aim, Features, Folded, Solver, Start};
use crate::embed::parameterise::state::State;
use crate::embed::problem::{Problem, Settings};
use crate::embed::topology::corner_nodes::move_nodes_to_corners;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::{HalfArc, ThroughArcs};
use crate::field::GuidingFieldSystem;
use crate::mesh::{FaceId, VertexId};
use crate::param::{DistortionWeights, SeamlessSystem, gradients};
use crate::progress::Progress;
use crate::solve::SpdSymbolic;
use crate::surface::Metric;
use crate::surface::PrincipalCurvature;

/// Share of the energy that a step without folds has to gain to be worth another, and how many may gain less in a row: the
/// energy cannot fall below its ideal, so that this is a share of what matters, unlike with least squares.
const LITTLE: f64 = 3e-3;
const IDLE: usize = 2;
/// Halvings of such a step at most: what does not help at a quarter of its length is more than a matter of length.
const HALVINGS: usize = 2;
/// Steps after which least squares are to have led to a map with few folds, and how many folds are few: from more on the
/// map as a whole does not fit its constraints, and another start is quicker and finds one that does.
const TRIAL: usize = 4;
pub(in crate::embed) const HOPELESS: usize = 50;
/// Cosine between two steps of a node above which it keeps its direction, and below whose negative it turns back.
const ALIKE: f64 = 0.3;
/// By what a step is then lengthened, and how far at most.
const LONGER: f64 = 1.4;
const LONGEST: f64 = 6.0;
/// Steps of Newton's method from one place of the nodes to the next: the first few make up for the move.
const NEWTON_STEPS: usize = 4;
/// Rings of triangles around a node that has changed its vertex in which the field turns markedly with it.
const TURNED_RINGS: usize = 2;

/// A net with what is known of its mesh: sharp edges, and curvature at the vertices.
pub(in crate::embed) type Known = (EmbeddingTopology, Vec<bool>, Vec<PrincipalCurvature>);

/// An embedding under optimisation.
pub struct Optimiser<'a> {
    pub(in crate::embed) ground: SurfaceProjection<'a>,
    pub(in crate::embed) settings: Settings,
    pub(in crate::embed) curvature: Vec<PrincipalCurvature>,
    pub(in crate::embed) sharp: Vec<bool>,
    pub(in crate::embed) through_arcs: ThroughArcs,
    /// Chords held at lengths, the chord of every arc, the least length and the fewest quads across every chord.
    pub(in crate::embed) spacing: Spacing,
    pub(in crate::embed) chord_of: Vec<u32>,
    pub(in crate::embed) least: f64,
    pub(in crate::embed) fewest: Vec<u32>,
    /// The ends of arcs at each node.
    pub(in crate::embed) ends: Vec<Vec<HalfArc>>,
    pub(in crate::embed) guided: GuidingFieldSystem,
    pub(in crate::embed) seamless: Option<SeamlessSystem>,
    pub(in crate::embed) sizes: Option<SpdSymbolic>,
    /// What maps are to be like that must not fold; `None` for those of least squares.
    pub(in crate::embed) shape: Option<DistortionWeights>,
    /// What is done about features.
    pub(in crate::embed) features: Features,
    /// Edges of features that are only pulled even where others are held; empty: none.
    pub(in crate::embed) loose: Vec<bool>,
    pub(in crate::embed) state: State,
    /// Factor of the steps of every node.
    pub(in crate::embed) pace: Vec<f64>,
    /// Where every node was headed when it last moved.
    heading: Vec<DVec3>,
    /// Steps taken back since one was made.
    halved: usize,
    /// Steps in a row that gained next to nothing.
    idle: usize,
    steps: usize,
}

impl<'a> Optimiser<'a> {
    /// Sets up the optimisation of a drawn layout and solves for its first field and map.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub fn new(job: &Problem<'a>, progress: &Progress) -> Result<Self, EmbeddingError> {
        let ready = Self::net(job)?;
        progress.check()?;
        Self::on(job, ready, (Aim::LeastSquares, Features::Held), progress)?.map_err(|_| EmbeddingError::Folded)
    }

    /// The net of a drawn layout with what is known of its mesh: sharp edges, and curvature at the vertices.
    pub(in crate::embed) fn net(job: &Problem<'_>) -> Result<Known, EmbeddingError> {
        let Problem { surface, layout, .. } = *job;
        let mut net = EmbeddingTopology::new(surface.mesh, job.initial_embedding, layout, job.arc_headings)?;
        let sharp = sharp_edges(&surface, &net);
        let held = pinned(job);
        move_nodes_to_corners(&mut net, &sharp, |i| held[i]);
        let nearest = |v: usize| {
            if v < surface.mesh.n_vertices() {
                return surface.curvature[v];
            }
            let at = surface.index.nearest(net.mesh.position(VertexId::new(v)));
            surface.curvature[at.nearest_vertex(surface.mesh).index()]
        };
        let curvature: Vec<PrincipalCurvature> = (0..net.mesh.n_vertices()).map(nearest).collect();
        Ok((net, sharp, curvature))
    }

    /// Sets up the optimisation on a net with what is known of its mesh: sharp edges, and curvature at the vertices.
    pub(in crate::embed) fn on(
        job: &Problem<'a>,
        (net, sharp, curvature): Known,
        (aim, features): (Aim<'_>, Features),
        progress: &Progress,
    ) -> Result<Result<Self, Folded>, EmbeddingError> {
        let Problem { surface, layout, settings, .. } = *job;
        let held = pinned(job);
        let mut through_arcs = ThroughArcs::new(layout, |i| held[i]);
        let shape = match aim {
            Aim::LeastSquares => None,
            Aim::InjectiveMap { shape, .. } => {
                through_arcs.constrain_all();
                Some(shape)
            }
        };
        let mut ends = vec![Vec::new(); layout.nodes.len()];
        for (a, arc) in (0..).zip(&layout.arcs) {
            ends[arc.nodes[0] as usize].push((a, false));
            ends[arc.nodes[1] as usize].push((a, true));
        }
        let ground = ground(&surface, &net, &sharp, |i| held[i], settings);
        let spacing = Spacing::none(layout.chords);
        let least = settings.spacing * mean_edge(surface.mesh);
        let guided = GuidingFieldSystem::new(&net.mesh)?;
        let metric = Metric::new(&net.mesh);
        let mut solver = Solver {
            curvature: &curvature,
            sharp: &sharp,
            through_arcs: &through_arcs,
            spacing: &spacing,
            guided: &guided,
            seamless: None,
            sizes: None,
            settings,
            features,
            loose: &[],
        };
        let state = match solver.solve(net, metric, None, aim, progress)? {
            Ok(state) => state,
            Err(folded) => return Ok(Err(folded)),
        };
        let (seamless, sizes) = (solver.seamless, solver.sizes);
        Ok(Ok(Self {
            ground,
            settings,
            curvature,
            sharp,
            through_arcs,
            spacing,
            chord_of: layout.arcs.iter().map(|a| a.chord).collect(),
            least,
            fewest: layout.min_quads_per_chord(),
            ends,
            guided,
            seamless,
            sizes,
            shape,
            features,
            loose: Vec::new(),
            state,
            pace: vec![1.0; layout.nodes.len()],
            heading: vec![DVec3::ZERO; layout.nodes.len()],
            halved: 0,
            idle: 0,
            steps: 0,
        }))
    }

    /// Lets regular nodes go where the isolines through them cross; see [`Self::finish`].
    pub(in crate::embed) fn release(&mut self, job: &Problem<'_>) {
        let held = pinned(job);
        self.through_arcs = ThroughArcs::new(job.layout, |i| held[i]);
    }

    /// Whether least squares lead nowhere: after some steps many triangles are still folded.
    pub(in crate::embed) fn is_hopeless(&self) -> bool {
        self.shape.is_none() && self.steps >= TRIAL && self.state.flipped() > HOPELESS
    }

    /// The best so far.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Whether no further step is to be made.
    pub fn is_done(&self) -> bool {
        let halvings = if self.shape.is_some() { self.settings.halvings.min(HALVINGS) } else { self.settings.halvings };
        self.steps >= self.settings.steps || self.halved > halvings || self.idle >= IDLE
    }

    /// The share of the steps at most that are made.
    pub(in crate::embed) fn share_done(&self) -> f64 {
        self.steps as f64 / self.settings.steps.max(1) as f64
    }

    /// Begins anew with steps of usual length, as many as at first.
    pub(in crate::embed) fn restart(&mut self) {
        self.pace.fill(1.0);
        (self.halved, self.idle, self.steps) = (0, 0, 0);
    }

    /// Begins anew where it once was, with all nodes held on their isolines.
    pub(in crate::embed) fn begin_held(&mut self, state: State) {
        self.through_arcs.constrain_all();
        if self.shape.is_some() {
            self.release_features();
        }
        for (hold, node) in self.ground.hold.iter_mut().zip(&state.net.nodes) {
            // Nodes that have since been brought onto features are where they were.
            if *hold == NodeConstraint::Curve && !self.ground.on_curve[node.vertex.index()] {
                *hold = NodeConstraint::Free;
            }
        }
        self.state = state;
        self.restart();
    }

    /// For each node whether it stays where it is.
    pub fn stays(&self) -> Vec<bool> {
        self.ground.hold.iter().map(|&hold| hold == NodeConstraint::Fixed).collect()
    }

    /// The chords that are shorter than `least`, or would be shorter than triangles resolve, with their lengths.
    pub fn short_chords(&self, least: f64) -> Vec<(u32, f64)> {
        let (net, map) = (&self.state.net, &self.state.solution.map);
        let found = lengths(net, &self.through_arcs, &self.chord_of, map, self.spacing.held.len());
        let short = |chord: u32, length: f64| self.spacing.held[chord as usize].is_some() || length < least;
        (0..).zip(found).filter_map(|(c, l)| Some((c, l?.1))).filter(|&(c, l)| short(c, l)).collect()
    }

    /// Moves the nodes once; tells whether that made the energy less. If not, they are where they were, and the next
    /// step is shorter.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`]; the state is then as before.
    pub fn step(&mut self, progress: &Progress) -> Result<bool, EmbeddingError> {
        self.steps += 1;
        let State { net, solution, .. } = &self.state;
        // A map without folds keeps chords from vanishing by itself.
        let extend =
            |spacing: &mut Spacing| spacing.extend(net, &self.through_arcs, &self.chord_of, &solution.map, self.least);
        let held = if self.shape.is_none() { extend(&mut self.spacing) } else { 0 };
        if held > 0 {
            tracing::debug!(held, "chords held apart");
            self.state = self.solve(self.state.net.clone(), progress)?;
        }
        let next = self.next(progress)?.filter(|next| next.solution.energy < self.state.solution.energy);
        let better = next.is_some();
        tracing::debug!(step = self.steps, energy = next.as_ref().map(|n| n.solution.energy), "nodes moved");
        if let Some(next) = next {
            let gain = self.state.solution.energy - next.solution.energy;
            self.idle = if self.shape.is_some() && gain < LITTLE * next.solution.energy { self.idle + 1 } else { 0 };
            self.state = next;
            self.halved = 0;
            self.adapt();
        } else {
            self.pace.iter_mut().for_each(|p| *p *= 0.5);
            self.halved += 1;
        }
        Ok(better)
    }

    /// Field and map with all nodes moved that can without folding the map; `None` if too few can. Where that makes the
    /// energy more, the nodes stay around which it does.
    fn next(&mut self, progress: &Progress) -> Result<Option<State>, EmbeddingError> {
        let none = vec![false; self.pace.len()];
        let (mut next, mut stays) = self.as_far_as_possible(Self::moved, none, progress)?;
        // Least squares only lead to where maps without folds begin: there it was no better for it.
        let dearer = next.as_ref().filter(|n| self.shape.is_some() && n.solution.energy >= self.state.solution.energy);
        if let Some(dearer) = dearer.map(|n| self.dearer(n)) {
            let with: Vec<bool> = stays.iter().zip(&dearer).map(|(a, b)| *a || *b).collect();
            let moving = with.iter().filter(|&&s| !s).count();
            if with != stays && moving > 0 {
                tracing::debug!(moving, "nodes stay where the energy would be more");
                (next, stays) = self.as_far_as_possible(Self::moved, with, progress)?;
            }
        }
        for (pace, _) in self.pace.iter_mut().zip(stays).filter(|(_, stays)| *stays) {
            *pace *= 0.5;
        }
        Ok(next)
    }

    /// For each node whether the energy around it is more than it was.
    fn dearer(&self, next: &State) -> Vec<bool> {
        let cell = self.cells();
        let (before, after) = (self.state.energies(self.shape), next.energies(self.shape));
        let mut change = vec![0.0; self.pace.len()];
        for (f, d) in before.iter().zip(&after).map(|(a, b)| b - a).enumerate() {
            for v in self.state.net.mesh.face_vertices(FaceId::new(f)) {
                change.get_mut(cell[v.index()] as usize).into_iter().for_each(|c| *c += d / 3.0);
            }
        }
        change.iter().map(|&c| c > 0.0).collect()
    }

    /// Field and map of a net with nodes moved but for those that stay and those in whose cells the map would fold: the net
    /// is asked for with the cells and for each node whether it stays. `None` if too few can move.
    pub(in crate::embed) fn as_far_as_possible(
        &mut self,
        moved: impl Fn(&Self, &[u32], &[bool]) -> EmbeddingTopology,
        mut stays: Vec<bool>,
        progress: &Progress,
    ) -> Result<(Option<State>, Vec<bool>), EmbeddingError> {
        let cell = self.cells();
        let count = |stays: &[bool]| stays.iter().filter(|&&s| s).count();
        let most = count(&stays).max(stays.len() / 2);
        loop {
            let net = moved(self, &cell, &stays);
            let folded = match self.attempt(net, progress)? {
                Ok(next) => return Ok((Some(next), stays)),
                Err(Folded(list)) => list,
            };
            let before = count(&stays);
            for v in folded.iter().flat_map(|&f| self.state.net.mesh.face_vertices(f)) {
                stays.get_mut(cell[v.index()] as usize).into_iter().for_each(|s| *s = true);
            }
            let after = count(&stays);
            if after == before || after > most {
                return Ok((None, stays));
            }
            tracing::debug!(nodes = after, "nodes stay where the map would fold");
        }
    }

    /// Lengthens the steps of nodes that keep their direction and shortens those of nodes that turn back.
    fn adapt(&mut self) {
        for i in 0..self.pace.len() {
            let heading = self.heading_of(i);
            let turn = heading.dot(self.heading[i]);
            if turn > ALIKE {
                self.pace[i] = (self.pace[i] * LONGER).min(LONGEST);
            } else if turn < -ALIKE {
                self.pace[i] *= 0.5;
            }
            self.heading[i] = heading;
        }
    }

    /// Field and map of a net, with the field at hand as the one before.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`]; [`EmbeddingError::Folded`] if there is to be a map without folds and none was found.
    pub(in crate::embed) fn solve(
        &mut self,
        net: EmbeddingTopology,
        progress: &Progress,
    ) -> Result<State, EmbeddingError> {
        self.attempt(net, progress)?.map_err(|_| EmbeddingError::Folded)
    }

    /// As [`Self::solve`], [`Folded`] where no map without folds was found.
    pub(in crate::embed) fn attempt(
        &mut self,
        net: EmbeddingTopology,
        progress: &Progress,
    ) -> Result<Result<State, Folded>, EmbeddingError> {
        let State { metric: before, field, solution, .. } = &self.state;
        let (uv, list, turned) = match self.shape {
            Some(_) => {
                let uv = &solution.map.uv;
                (uv.clone(), gradients(before, &field.angle, uv), self.turned(&net))
            }
            None => Default::default(),
        };
        let start = Start::Moved { uv: &uv, gradients: &list, turned: &turned };
        let aim = self.shape.map_or(Aim::LeastSquares, |shape| Aim::InjectiveMap { shape, start, steps: NEWTON_STEPS });
        self.solve_for(net, aim, progress)
    }

    /// As [`Self::attempt`], with the nodes where they are and from the map at hand.
    pub(in crate::embed) fn attempt_here(
        &mut self,
        progress: &Progress,
    ) -> Result<Result<State, Folded>, EmbeddingError> {
        let uv = self.state.solution.map.uv.clone();
        let start = Start::Here(&uv);
        let aim = self.shape.map_or(Aim::LeastSquares, |shape| Aim::InjectiveMap { shape, start, steps: NEWTON_STEPS });
        self.solve_for(self.state.net.clone(), aim, progress)
    }

    /// As [`Self::attempt`], with the map without folds nearest to one of these coordinates, which is left as it is.
    pub(in crate::embed) fn attempt_at(
        &mut self,
        net: EmbeddingTopology,
        uv: &[[DVec2; 3]],
        progress: &Progress,
    ) -> Result<Result<State, Folded>, EmbeddingError> {
        let start = Start::Map(uv);
        let aim = self.shape.map_or(Aim::LeastSquares, |shape| Aim::InjectiveMap { shape, start, steps: 0 });
        self.solve_for(net, aim, progress)
    }

    fn solve_for(
        &mut self,
        net: EmbeddingTopology,
        aim: Aim<'_>,
        progress: &Progress,
    ) -> Result<Result<State, Folded>, EmbeddingError> {
        let metric = Metric::new(&net.mesh);
        let mut solver = Solver {
            curvature: &self.curvature,
            sharp: &self.sharp,
            through_arcs: &self.through_arcs,
            spacing: &self.spacing,
            guided: &self.guided,
            seamless: self.seamless.take(),
            sizes: self.sizes.take(),
            settings: self.settings,
            features: self.features,
            loose: &self.loose,
        };
        let next = solver.solve(net, metric, Some(&self.state.field.angle), aim, progress);
        (self.seamless, self.sizes) = (solver.seamless, solver.sizes);
        next
    }

    /// The triangles around nodes that are at another vertex in `net` than before, and around those vertices. Nodes that
    /// are not held move through the map, not with it: around these it is enough that they have moved at all.
    fn turned(&self, net: &EmbeddingTopology) -> Vec<bool> {
        let mesh = &net.mesh;
        let mut near = vec![false; mesh.n_vertices()];
        for ((old, new), held) in self.state.net.nodes.iter().zip(&net.nodes).zip(&self.through_arcs.constrained) {
            let stays = self.state.net.mesh.position(old.vertex) == net.mesh.position(new.vertex);
            if old.vertex == new.vertex && (stays || *held) {
                continue;
            }
            for v in [old.vertex, new.vertex] {
                near[v.index()] = true;
            }
        }
        let mut turned = vec![false; mesh.n_faces()];
        for _ in 0..TURNED_RINGS {
            for f in mesh.faces() {
                turned[f.index()] |= mesh.face_vertices(f).iter().any(|v| near[v.index()]);
            }
            for f in mesh.faces().filter(|f| turned[f.index()]) {
                mesh.face_vertices(f).iter().for_each(|v| near[v.index()] = true);
            }
        }
        turned
    }
}

/// For each node whether it is pinned, itself or as the end of an arc.
fn pinned(job: &Problem<'_>) -> Vec<bool> {
    let mut held = job.pinned_nodes.to_vec();
    held.resize(job.layout.nodes.len(), false);
    for (arc, _) in job.layout.arcs.iter().zip(job.pinned_arcs).filter(|pair| *pair.1) {
        arc.nodes.iter().for_each(|&n| held[n as usize] = true);
    }
    held
}

//! Features become isolines: penalty continuation up to hard constraints.
//!
//! Constraining all features at once flips triangles; a penalty brings them only near isolines. So the penalty weight
//! is raised step by step, each map starting from the one before, which is injective and stays so. What cannot follow
//! becomes visible: between a feature and a node that belongs on it triangles are squeezed, and the node is moved there
//! ([`attachment`](super::attachment)); edges that keep slanting against their isoline contradict the layout and are
//! relaxed to the unit penalty. The other edges then lie on isolines up to rounding, and hard constraints do not change
//! the map.

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::parameterise::constraints::{self, IsolineEdge, NO_SLANT_LIMIT};
use crate::embed::parameterise::feature_axes;
use crate::embed::parameterise::injective::Flipped;
use crate::embed::parameterise::solve::FeatureConstraint;
use crate::embed::parameterise::state::State;
use crate::mesh::{FaceId, HalfedgeId};
use crate::param::{InjectiveEnergy, SeamlessSystem, Solution};
use crate::progress::Progress;

/// Fraction of the whole optimisation at which the continuation is reported to begin, 0 to 1.
const REPORTED_FRACTION: f64 = 0.85;
/// Penalty weights of the first part of the continuation, in which nodes that belong on features are found; as
/// multiples of the unit penalty.
const FIRST_WEIGHTS: [f64; 3] = [10.0, 100.0, 1e3];
/// Largest number of rounds of the first part. Chosen by hand.
const ATTACHMENT_ROUNDS: usize = 3;
/// Penalty weights of the second part, and after each the largest slope of an edge against its isoline (difference of
/// the constant coordinate over the length in the map, 0 to 1) that is not relaxed. Slopes of edges that can follow
/// fall with the weight. Chosen by hand.
const LAST_WEIGHTS: [(f64, f64); 3] = [(1e3, 0.2), (1e4, 0.1), (1e6, 0.02)];
/// Largest number of Newton steps for each weight.
const NEWTON_STEPS: usize = 15;
/// Share of the length of a feature line, 0 to 1, above which relaxed edges relax the whole line: constraining the
/// pieces that remain costs distortion, and they do not make a line.
const BROKEN_SHARE: f64 = 0.2;
/// Attempts to solve with hard constraints, each with features relaxed one ring farther around the flipped triangles.
/// Chosen by hand.
const RELAXATIONS: usize = 6;

impl Optimiser<'_> {
    /// Replaces the penalties of features by hard constraints, where the layout allows it.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(super) fn constrain_features(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let FeatureConstraint::Penalty(mut reached) = self.features else { return Ok(()) };
        if !self.sharp.contains(&true) {
            return Ok(());
        }
        progress.report("Constraining features to isolines", REPORTED_FRACTION);
        self.synchronise(progress)?;
        for _ in 0..ATTACHMENT_ROUNDS {
            for weight in FIRST_WEIGHTS.into_iter().filter(|&weight| weight >= reached) {
                self.converge_with_penalty(weight, progress)?;
            }
            self.features = FeatureConstraint::Penalty(FIRST_WEIGHTS[0]);
            if self.attach_nodes(progress)? == 0 {
                break;
            }
            // Only the features of the nodes just attached are not near isolines yet: the largest weight suffices.
            reached = FIRST_WEIGHTS[FIRST_WEIGHTS.len() - 1];
        }
        let mut relaxed = self.raise_penalty(progress)?;
        // A relaxed edge may be due to a node beside its line: attach such nodes as long as that leaves fewer relaxed
        // edges.
        while relaxed > 0 {
            let before = (self.state.clone(), self.projection.node_constraint.clone(), self.relaxed.clone());
            let attached = self.attach_nodes_at_steps(progress)?;
            if attached > 0 {
                self.relaxed.clear();
                let now = self.raise_penalty(progress)?;
                tracing::debug!(before = relaxed, now, "relaxed feature edges");
                if now < relaxed {
                    relaxed = now;
                    continue;
                }
            }
            (self.state, self.projection.node_constraint, self.relaxed) = before;
            break;
        }
        self.features = FeatureConstraint::Hard;
        self.solve_relaxing_features(progress)
    }

    /// The second part of the continuation; returns the number of relaxed edges.
    fn raise_penalty(&mut self, progress: &Progress) -> Result<usize, EmbeddingError> {
        for (weight, slope) in LAST_WEIGHTS {
            self.converge_with_penalty(weight, progress)?;
            self.relax_slanting_edges(slope);
        }
        Ok(self.relaxed.iter().filter(|&&l| l).count())
    }

    /// Solves for field and map with all nodes in place. Features near flipped triangles are relaxed, then those
    /// farther around, and in the end all.
    ///
    /// # Errors
    ///
    /// [`EmbeddingError::NoInjectiveMap`] if there is no injective map even with all features relaxed; the state is
    /// then as before.
    pub(super) fn solve_relaxing_features(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        for round in 1..=RELAXATIONS {
            match self.try_solve_in_place(progress)? {
                Ok(state) => {
                    self.state = state;
                    return Ok(());
                }
                Err(Flipped(list)) if self.features == FeatureConstraint::Hard && self.distortion.is_some() => {
                    self.relax_near_flips(&list, round);
                }
                Err(_) => return Err(EmbeddingError::NoInjectiveMap),
            }
        }
        tracing::debug!("features keep a penalty: no injective map with hard constraints");
        self.relax_all_features();
        self.state = self.try_solve_in_place(progress)?.map_err(|_| EmbeddingError::NoInjectiveMap)?;
        Ok(())
    }

    /// Replaces all hard constraints of features by the unit penalty.
    pub(super) fn relax_all_features(&mut self) {
        self.features = FeatureConstraint::Penalty(1.0);
        self.relaxed.clear();
    }

    /// Solves again if the system of the map is not that of the state: failed attempts leave the system of another
    /// topology.
    pub(super) fn synchronise(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let Solution { map, free, .. } = &self.state.solution;
        let is_own = |system: &SeamlessSystem| system.n_free() == free.len() && system.map(free).uv == map.uv;
        if !self.systems.map.as_ref().is_some_and(is_own) {
            self.state = self.try_solve_in_place(progress)?.map_err(|_| EmbeddingError::NoInjectiveMap)?;
        }
        Ok(())
    }

    /// Descends the map with the given penalty weight of features.
    fn converge_with_penalty(&mut self, weight: f64, progress: &Progress) -> Result<(), EmbeddingError> {
        self.features = FeatureConstraint::Penalty(weight);
        tracing::debug!(weight, "penalty of features");
        self.converge_map(progress)
    }

    /// Descends the energy of the injective map with nodes and field frozen. The few Newton steps between node steps do
    /// not converge.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub(super) fn converge_map(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let penalised = self.penalised_edges();
        let (Some(system), Some(distortion)) = (&mut self.systems.map, self.distortion) else { return Ok(()) };
        let newton = system.newton_system()?;
        let State { metric, field, objective, anisotropy_share, solution, .. } = &self.state;
        let energy = InjectiveEnergy::new(metric, &field.angle, objective, (distortion, anisotropy_share))
            .with_isoline_penalties(&penalised);
        let Some(mut at) = system.injective_map(&energy, solution.free.clone()) else { return Ok(()) };
        system.descend(&newton, &energy, &mut at, NEWTON_STEPS, progress)?;
        self.state.solution = Solution { map: at.map, free: at.free, energy: at.energy };
        Ok(())
    }

    /// The feature edges that have a penalty: half-edge, constant coordinate, penalty weight.
    fn penalised_edges(&self) -> Vec<(HalfedgeId, u8, f64)> {
        let penalty = |(h, axis): IsolineEdge| Some((h, axis, self.features.penalty(self.is_relaxed(h))?));
        self.feature_edges().into_iter().filter_map(penalty).collect()
    }

    /// All feature edges with the coordinate that is to be constant, relaxed ones as well.
    pub(super) fn feature_edges(&self) -> Vec<IsolineEdge> {
        let State { topology, metric, field, .. } = &self.state;
        constraints::feature_edges(topology, metric, &field.angle, &self.sharp, NO_SLANT_LIMIT)
    }

    fn is_relaxed(&self, h: HalfedgeId) -> bool {
        self.relaxed.get(self.state.topology.mesh.edge(h).index()).copied().unwrap_or(false)
    }

    /// Relaxes edges whose slope against their isoline exceeds `slope`. Along a line that cannot keep to one isoline
    /// the penalty spreads the difference evenly from vertex to vertex, so that its shortest edges have the largest
    /// slope; without one or two of these the rest can follow.
    fn relax_slanting_edges(&mut self, slope: f64) {
        let mut list = self.feature_edges();
        list.retain(|&(h, _)| !self.is_relaxed(h));
        let State { topology, solution, .. } = &self.state;
        self.relaxed.resize(topology.mesh.n_edges(), false);
        let mut count = 0;
        for (h, axis) in list {
            let [p, q] = [h.index() % 3, (h.index() + 1) % 3].map(|k| solution.map.uv[h.index() / 3][k]);
            let d = q - p;
            if d[usize::from(axis)].abs() > slope * d.length() {
                self.relaxed[topology.mesh.edge(h).index()] = true;
                count += 1;
            }
        }
        tracing::debug!(count, "slanting feature edges relaxed");
        self.relax_broken_lines();
    }

    /// Relaxes feature lines of which more than [`BROKEN_SHARE`] is relaxed.
    fn relax_broken_lines(&mut self) {
        let State { topology, .. } = &self.state;
        for line in feature_axes::lines(topology, &self.sharp) {
            let edges = || line.iter().map(|&h| topology.mesh.edge(h));
            let all: f64 = edges().map(|e| topology.mesh.edge_length(e)).sum();
            let gone: f64 = edges().filter(|e| self.relaxed[e.index()]).map(|e| topology.mesh.edge_length(e)).sum();
            if gone > BROKEN_SHARE * all {
                edges().for_each(|e| self.relaxed[e.index()] = true);
            }
        }
    }

    /// Relaxes feature edges with an end within `rings` rings of flipped triangles, at least one.
    fn relax_near_flips(&mut self, flipped: &[FaceId], rings: usize) {
        let mesh = &self.state.topology.mesh;
        let mut near = vec![false; mesh.n_vertices()];
        flipped.iter().flat_map(|&f| mesh.face_vertices(f)).for_each(|v| near[v.index()] = true);
        mesh.dilate_vertices(&mut near, rings - 1);
        self.relaxed.resize(mesh.n_edges(), false);
        for e in mesh.edges().filter(|e| self.sharp[e.index()]) {
            self.relaxed[e.index()] |= mesh.edge_vertices(e).iter().any(|v| near[v.index()]);
        }
        self.relax_broken_lines();
        tracing::debug!(
            relaxed = self.relaxed.iter().filter(|&&l| l).count(),
            "features near flipped triangles relaxed"
        );
    }
}

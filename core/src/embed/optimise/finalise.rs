//! The end of an optimisation: all nodes on their isolines, and no folds.

use crate::embed::EmbeddingError;
use crate::embed::optimise::optimiser::{HOPELESS, Optimiser};
use crate::embed::parameterise::state::State;
use crate::field::GuidingFieldSystem;
use crate::mesh::TriMesh;
use crate::param::{Effort, FlippedTriangle};
use crate::progress::Progress;
use crate::surface::PrincipalCurvature;

/// Rounds of stiffening; by what a folded triangle's weight grows in each, and up to what; over how many rings of
/// triangles that fades out, and by what factor in each.
const STIFFENINGS: usize = 15;
const STIFFER: f64 = 1.5;
const STIFFEST: f64 = 1e4;
const FADING: usize = 5;
const FADE: f64 = 0.7;
/// Rounds of bringing regular nodes to their crossings with least squares before they are held there: every round is a
/// Newton step.
const SETTLING: usize = 3;
/// By what share the energy changes when they have come there.
const SETTLED: f64 = 3e-3;

impl Optimiser<'_> {
    /// Ends the optimisation: brings regular nodes onto their isolines and holds them there, and removes folds. Returned
    /// are the folds that remain.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub fn finish(&mut self, progress: &Progress) -> Result<Vec<FlippedTriangle>, EmbeddingError> {
        if self.shape.is_some() {
            self.finish_without_folds(progress)?;
            return Ok(Vec::new());
        }
        self.settle(progress)?;
        self.refine(progress)?;
        self.through_arcs.constrain_all();
        loop {
            self.solve_loosening(progress)?;
            let State { net, solution, .. } = &self.state;
            if self.spacing.extend(net, &self.through_arcs, &self.chord_of, &solution.map, self.least) == 0 {
                break;
            }
        }
        if let Some(edge) = self.settings.integer {
            self.round(edge, progress)?;
        }
        self.stiffen(progress)?;
        if self.state.flipped() > HOPELESS {
            return Err(EmbeddingError::Folded);
        }
        let State { net, metric, field, objective, solution, .. } = &mut self.state;
        let Some(system) = &self.seamless else { return Ok(Vec::new()) };
        objective.stiffness.clear();
        let quarters = net.quarters();
        let at = (&solution.free[..], &quarters[..]);
        let triangles = system.triangles(&net.mesh, metric, field, objective)?;
        let unfolded = system.unfold(&triangles, at, Effort::Thorough, progress)?;
        tracing::debug!(before = unfolded.folds_before, after = unfolded.folds.len(), "folds removed");
        solution.map = system.map(&unfolded.y);
        solution.energy = unfolded.energy;
        solution.free = unfolded.y;
        Ok(unfolded.folds)
    }

    /// As [`Self::finish`] in a map that cannot fold.
    fn finish_without_folds(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        self.hold_features(progress)?;
        self.settle_exactly(progress)?;
        self.through_arcs.constrain_all();
        self.solve_loosening(progress)?;
        if let Some(edge) = self.settings.integer {
            self.round(edge, progress)?;
        }
        self.come_to_rest(progress)
    }

    /// Brings regular nodes towards their crossings by steps in a map of least squares.
    fn settle(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        for _ in 0..SETTLING {
            let before = self.state.solution.energy;
            let (Some(state), _) = self.as_far_as_possible(Self::settled, vec![false; self.pace.len()], progress)?
            else {
                break;
            };
            self.state = state;
            if (self.state.solution.energy - before).abs() < SETTLED * before {
                break;
            }
        }
        Ok(())
    }

    /// The state, and what is known of its mesh: sharp edges, and curvature at the vertices.
    pub(in crate::embed) fn into_parts(self) -> (State, Vec<bool>, Vec<PrincipalCurvature>) {
        (self.state, self.sharp, self.curvature)
    }

    /// Makes the triangles around irregular nodes finer.
    fn refine(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let State { net, field, .. } = &self.state;
        let Some((net, carried)) = net.refine_at_irregular_nodes(&field.angle, &self.sharp, &self.curvature)? else {
            return Ok(());
        };
        self.guided = GuidingFieldSystem::new(&net.mesh)?;
        (self.seamless, self.sizes) = (None, None);
        (self.sharp, self.curvature) = (carried.sharp, carried.at_vertex);
        self.state.field.angle = net.angle.clone();
        self.state = self.solve(net, progress)?;
        Ok(())
    }

    /// Makes triangles at folds count more, and again, until none is left or it helps no more (Bommes, Zimmer and Kobbelt,
    /// Mixed-Integer Quadrangulation, section 5.4): what that leaves is few and local.
    fn stiffen(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let Some(mut system) = self.seamless.take() else { return Ok(()) };
        let mut weight = vec![1.0; self.state.net.mesh.n_faces()];
        let mut work = self.state.clone();
        let mut least = work.flipped();
        for _ in 0..STIFFENINGS {
            if least == 0 {
                break;
            }
            raise(&work.net.mesh, &work.folded(), STIFFER, &mut weight);
            work.objective.stiffness = weight.clone();
            work.solution = system.solve(&work.metric, &work.field, &work.objective, progress)?;
            let now = work.flipped();
            tracing::debug!(folds = now, "stiffened");
            if now < least {
                least = now;
                self.state = work.clone();
            }
        }
        self.seamless = Some(system);
        Ok(())
    }
}

/// Raises the weights of folded triangles, less in the rings around them.
pub(in crate::embed) fn raise(mesh: &TriMesh, folded: &[bool], by: f64, weight: &mut [f64]) {
    let mut share: Vec<f64> = folded.iter().map(|&f| if f { 1.0 } else { 0.0 }).collect();
    for _ in 0..FADING {
        let wider = |f: crate::mesh::FaceId| {
            let sides = mesh.face_halfedges(f).into_iter().filter_map(|h| mesh.twin(h));
            let around = sides.map(|t| share[t.index() / 3]).fold(0.0, f64::max);
            share[f.index()].max(FADE * around)
        };
        share = mesh.faces().map(wider).collect();
    }
    for (w, s) in weight.iter_mut().zip(share) {
        *w = (*w * (1.0 + by * s)).min(STIFFEST);
    }
}

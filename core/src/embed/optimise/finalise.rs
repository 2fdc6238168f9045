//! The end of a phase: all nodes are constrained to their isolines, chord lengths are rounded, flipped triangles
//! removed.

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::descent::MAX_FLIPPED;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::parameterise::solve::Systems;
use crate::embed::parameterise::state::State;
use crate::embed::parameterise::stiffen::stiffening;
use crate::param::{Effort, FlippedTriangle};
use crate::progress::Progress;

/// Rounds of stiffening, and the growth of the weights of flipped triangles in each; see [`stiffen`]. Chosen by hand.
const STIFFENING_ROUNDS: usize = 15;
const STIFFENING_GROWTH: f64 = 1.5;
/// Largest number of steps of regular nodes to their crossings in the least-squares map. Every one is a Newton step.
const CROSSING_STEPS: usize = 3;
/// Relative change of the energy below which regular nodes have reached their crossings. Chosen by hand.
const CROSSINGS_REACHED: f64 = 3e-3;

impl Optimiser<'_> {
    /// Ends the phase: moves regular nodes to the crossings of their isolines, constrains them there, rounds chord
    /// lengths if asked for, and removes flipped triangles. Returns the flipped triangles that remain.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub fn finalise(&mut self, progress: &Progress) -> Result<Vec<FlippedTriangle>, EmbeddingError> {
        if self.distortion.is_some() {
            self.finalise_injective(progress)?;
            return Ok(Vec::new());
        }
        self.move_to_crossings(progress)?;
        self.refine(progress)?;
        self.through_arcs.constrain_all();
        // Every chord fixed at the least length may make others shorter than that.
        loop {
            self.solve_relaxing_features(progress)?;
            if self.fix_short_chords() == 0 {
                break;
            }
        }
        if let Some(edge) = self.settings.integer {
            self.round_chord_lengths(edge, progress)?;
        }
        self.stiffen(progress)?;
        if self.state.flipped() > MAX_FLIPPED {
            return Err(EmbeddingError::NoInjectiveMap);
        }
        let State { topology, metric, field, objective, solution, .. } = &mut self.state;
        let Some(system) = &self.systems.map else { return Ok(Vec::new()) };
        objective.stiffness.clear();
        let quarters = topology.quarters();
        let at = (&solution.free[..], &quarters[..]);
        let triangles = system.triangles(&topology.mesh, metric, field, objective)?;
        let repaired = system.remove_flips(&triangles, at, Effort::Thorough, progress)?;
        tracing::debug!(before = repaired.flipped_before, after = repaired.flipped.len(), "flipped triangles removed");
        solution.map = system.map(&repaired.y);
        solution.energy = repaired.energy;
        solution.free = repaired.y;
        Ok(repaired.flipped)
    }

    /// As [`Self::finalise`] in the injective phase, where no triangle is flipped. Features come first: regular nodes
    /// are then placed on features where they cross them.
    fn finalise_injective(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        self.constrain_features(progress)?;
        self.place_regular_nodes(progress)?;
        self.through_arcs.constrain_all();
        self.solve_relaxing_features(progress)?;
        if let Some(edge) = self.settings.integer {
            self.round_chord_lengths(edge, progress)?;
        }
        self.converge_map(progress)
    }

    /// Moves regular nodes towards their crossings in the least-squares map.
    fn move_to_crossings(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        for _ in 0..CROSSING_STEPS {
            let before = self.state.solution.energy;
            let none = vec![false; self.step_factor.len()];
            let (Some(state), _) = self.solve_moved(Self::with_regular_nodes_moved, none, progress)? else { break };
            self.state = state;
            if (self.state.solution.energy - before).abs() < CROSSINGS_REACHED * before {
                break;
            }
        }
        Ok(())
    }

    /// Refines the triangles around irregular nodes: with few triangles a node of high valence has no injective map.
    fn refine(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let State { topology, field, .. } = &self.state;
        let refined = topology.refine_at_irregular_nodes(&field.angle, &self.sharp, &self.curvature)?;
        let Some((topology, carried)) = refined else { return Ok(()) };
        self.systems = Systems::new(&topology.mesh)?;
        (self.sharp, self.curvature) = (carried.sharp, carried.at_vertex);
        self.state.field.angle = topology.angle.clone();
        self.state = self.solve(topology, progress)?;
        Ok(())
    }

    /// Stiffens flipped triangles until none is left or the rounds are over, and keeps the map with the fewest (Bommes,
    /// Zimmer and Kobbelt, Mixed-Integer Quadrangulation, section 5.4). Those that remain are few and local.
    fn stiffen(&mut self, progress: &Progress) -> Result<(), EmbeddingError> {
        let Some(mut system) = self.systems.map.take() else { return Ok(()) };
        let mut weight = vec![1.0; self.state.topology.mesh.n_faces()];
        let mut work = self.state.clone();
        let mut least = work.flipped();
        for _ in 0..STIFFENING_ROUNDS {
            if least == 0 {
                break;
            }
            stiffening(STIFFENING_GROWTH).raise_around(&work.topology.mesh, &work.flipped_triangles(), &mut weight);
            work.objective.stiffness = weight.clone();
            work.solution = system.solve(&work.metric, &work.field, &work.objective, progress)?;
            let now = work.flipped();
            tracing::debug!(flipped = now, "stiffened");
            if now < least {
                least = now;
                self.state = work.clone();
            }
        }
        self.systems.map = Some(system);
        Ok(())
    }
}

//! Descent of the energy over node positions (Campen, sections 6.5.1 to 6.5.3).
//!
//! A step moves all nodes and solves for field and map. It is kept if the energy has fallen; otherwise it is undone,
//! and the next step is half as long. Beyond the thesis, every node has a step size of its own, and a step that fails
//! because of a few nodes is repeated without these.

use crate::embed::error::EmbeddingError;
use crate::embed::optimise::nearest_node::nearest_nodes;
use crate::embed::optimise::optimiser::Optimiser;
use crate::embed::parameterise::injective::Flipped;
use crate::embed::parameterise::state::State;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::mesh::FaceId;
use crate::progress::Progress;

/// Relative decrease of the energy below which a step of the injective phase is idle. That energy has a positive lower
/// bound, so a relative decrease is meaningful; the least-squares energy has none. Chosen by hand.
const MIN_GAIN: f64 = 3e-3;
/// Number of idle steps in a row after which the descent ends. Chosen by hand.
const MAX_IDLE: usize = 2;
/// Largest number of halvings of a step of the injective phase: measured, a step that fails at a quarter of its length
/// fails at any length, for another reason.
const INJECTIVE_HALVINGS: usize = 2;
/// Number of steps after which the flipped triangles of the least-squares map are counted; see [`MAX_FLIPPED`].
const TRIAL_STEPS: usize = 4;
/// Largest number of flipped triangles of a least-squares map that is used further. With more, the map as a whole
/// contradicts its constraints; starting the injective phase from the initial embedding is faster then, and finds a
/// map.
pub(super) const MAX_FLIPPED: usize = 50;
/// Cosine between successive steps of a node above which its step size grows, and below whose negative it is halved.
const SAME_DIRECTION: f64 = 0.3;
/// Growth of the step size of a node that keeps its direction, per step.
const GROWTH: f64 = 1.4;
/// Upper bound of the factor of a node's step size.
const MAX_FACTOR: f64 = 6.0;

impl Optimiser<'_> {
    /// Whether the least-squares phase has failed: too many triangles are flipped after the first steps.
    pub(in crate::embed) fn least_squares_failed(&self) -> bool {
        self.distortion.is_none() && self.steps >= TRIAL_STEPS && self.state.flipped() > MAX_FLIPPED
    }

    /// Whether the descent has ended.
    pub fn is_done(&self) -> bool {
        let most = self.settings.halvings;
        let halvings = if self.distortion.is_some() { most.min(INJECTIVE_HALVINGS) } else { most };
        self.steps >= self.settings.steps || self.failed > halvings || self.idle >= MAX_IDLE
    }

    /// The share of the largest number of steps that has been made, 0 to 1.
    pub(in crate::embed) fn share_done(&self) -> f64 {
        self.steps as f64 / self.settings.steps.max(1) as f64
    }

    /// Moves all nodes by one step. Returns whether the energy has fallen; if not, the state is as before and the next
    /// step half as long.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`]; the state is then as before.
    pub fn step(&mut self, progress: &Progress) -> Result<bool, EmbeddingError> {
        self.steps += 1;
        // In an injective map a chord cannot have a length of zero.
        if self.distortion.is_none() {
            let fixed = self.fix_short_chords();
            if fixed > 0 {
                tracing::debug!(fixed, "chords fixed at the least length");
                self.state = self.solve(self.state.topology.clone(), progress)?;
            }
        }
        let next = self.next_state(progress)?.filter(|next| next.solution.energy < self.state.solution.energy);
        let better = next.is_some();
        tracing::debug!(step = self.steps, energy = next.as_ref().map(|n| n.solution.energy), "nodes moved");
        if let Some(next) = next {
            let gain = self.state.solution.energy - next.solution.energy;
            let idle = self.distortion.is_some() && gain < MIN_GAIN * next.solution.energy;
            self.idle = if idle { self.idle + 1 } else { 0 };
            self.state = next;
            self.failed = 0;
            self.adapt_step_sizes();
        } else {
            self.step_factor.iter_mut().for_each(|factor| *factor *= 0.5);
            self.failed += 1;
        }
        Ok(better)
    }

    /// Fixes chords that are shorter than the least length at that length; returns their number.
    pub(super) fn fix_short_chords(&mut self) -> usize {
        let State { topology, solution, .. } = &self.state;
        self.chord_lengths.fix_short(topology, &self.through_arcs, &self.chord_of, &solution.map, self.min_length)
    }

    /// The state with all nodes moved that can move without flipping triangles; `None` if too few can. Where the energy
    /// would rise, it is solved for once more without the nodes around which it rises. The step sizes of all nodes left
    /// behind are halved.
    fn next_state(&mut self, progress: &Progress) -> Result<Option<State>, EmbeddingError> {
        let none = vec![false; self.step_factor.len()];
        let (mut next, mut stays) = self.solve_moved(Self::moved, none, progress)?;
        // Only in the injective phase: measured, the least-squares phase does not gain by it.
        let energy = self.state.solution.energy;
        let rising = next.as_ref().filter(|n| self.distortion.is_some() && n.solution.energy >= energy);
        if let Some(rising) = rising.map(|n| self.energy_rises_around(n)) {
            let with: Vec<bool> = stays.iter().zip(&rising).map(|(a, b)| *a || *b).collect();
            let moving = with.iter().filter(|&&s| !s).count();
            if with != stays && moving > 0 {
                tracing::debug!(moving, "step repeated without nodes around which the energy rises");
                (next, stays) = self.solve_moved(Self::moved, with, progress)?;
            }
        }
        for (step_factor, _) in self.step_factor.iter_mut().zip(stays).filter(|(_, stays)| *stays) {
            *step_factor *= 0.5;
        }
        Ok(next)
    }

    /// For each node whether the energy in its cell is larger in `next`.
    fn energy_rises_around(&self, next: &State) -> Vec<bool> {
        let cell = self.cells();
        let (before, after) = (self.state.energies(self.distortion), next.energies(self.distortion));
        let mut change = vec![0.0; self.step_factor.len()];
        for (f, d) in before.iter().zip(&after).map(|(a, b)| b - a).enumerate() {
            for v in self.state.topology.mesh.face_vertices(FaceId::new(f)) {
                change.get_mut(cell[v.index()] as usize).into_iter().for_each(|c| *c += d / 3.0);
            }
        }
        change.iter().map(|&c| c > 0.0).collect()
    }

    /// The state with all nodes moved except those that `stays` marks. While no injective map is found, nodes in whose
    /// cells triangles flip are marked as well; `None` once more than half of all are marked. `moved` makes the
    /// topology, given the cells and the marks. The marks are returned as well.
    pub(super) fn solve_moved(
        &mut self,
        moved: impl Fn(&Self, &[u32], &[bool]) -> EmbeddingTopology,
        mut stays: Vec<bool>,
        progress: &Progress,
    ) -> Result<(Option<State>, Vec<bool>), EmbeddingError> {
        let cell = self.cells();
        let count = |stays: &[bool]| stays.iter().filter(|&&s| s).count();
        let most = count(&stays).max(stays.len() / 2);
        loop {
            let topology = moved(self, &cell, &stays);
            let flipped = match self.try_solve(topology, progress)? {
                Ok(next) => return Ok((Some(next), stays)),
                Err(flipped) => flipped,
            };
            let before = count(&stays);
            self.mark_nodes_near(&flipped, &cell, &mut stays);
            let after = count(&stays);
            if after == before || after > most {
                return Ok((None, stays));
            }
            tracing::debug!(nodes = after, "step repeated without nodes around which triangles flip");
        }
    }

    /// Marks the nodes in whose cells there are flipped triangles.
    pub(super) fn mark_nodes_near(&self, Flipped(list): &Flipped, cell: &[u32], stays: &mut [bool]) {
        for v in list.iter().flat_map(|&f| self.state.topology.mesh.face_vertices(f)) {
            // A vertex of a component without nodes has no cell.
            stays.get_mut(cell[v.index()] as usize).into_iter().for_each(|s| *s = true);
        }
    }

    /// Increases the step sizes of nodes that keep their direction and halves those of nodes that turn back.
    fn adapt_step_sizes(&mut self) {
        for i in 0..self.step_factor.len() {
            let direction = self.descent_direction(i);
            let turn = direction.dot(self.last_direction[i]);
            if turn > SAME_DIRECTION {
                self.step_factor[i] = (self.step_factor[i] * GROWTH).min(MAX_FACTOR);
            } else if turn < -SAME_DIRECTION {
                self.step_factor[i] *= 0.5;
            }
            self.last_direction[i] = direction;
        }
    }

    /// For each vertex the index of the nearest node.
    pub(super) fn cells(&self) -> Vec<u32> {
        nearest_nodes(&self.state.topology.mesh, &self.state.vertices())
    }
}

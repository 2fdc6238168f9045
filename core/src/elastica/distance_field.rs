//! Tentative and final distances of one Dijkstra or A* search over the states, with its queue.

use super::bucket_queue::BucketQueue;
use super::graph::{ElasticaGraph, NO_STATE, State};

/// How a state was reached.
#[derive(Debug, Clone, Copy, Default)]
struct Predecessor {
    parent: State,
    tag: u16,
}

/// Distances of one search, with its queue. It can be restarted without being cleared.
///
/// A label holds the number of its search in the upper half and the bits of the distance, which order like the distance, in
/// the lower half. The numbers of searches decrease by two. A final label has the number of its search minus one. So labels
/// of earlier searches are larger than tentative ones and final ones are smaller, and one comparison tells whether a label
/// is to be replaced.
#[derive(Debug, Default)]
pub(super) struct DistanceField {
    labels: Vec<u64>,
    predecessors: Vec<Predecessor>,
    /// Number of the current search, in tentative labels.
    number: u32,
    queue: BucketQueue,
}

impl DistanceField {
    /// Starts a new search: no state has a distance, and the queue is empty.
    pub(super) fn restart(&mut self, n_states: usize) {
        self.queue.clear();
        if self.labels.len() != n_states || self.number <= 2 {
            self.labels.clear();
            self.labels.resize(n_states, u64::MAX);
            self.predecessors.clear();
            self.predecessors.resize(n_states, Predecessor::default());
            self.number = u32::MAX - 1;
        }
        self.number -= 2;
    }

    /// Tentative or final distance; infinite without one.
    #[inline]
    pub(super) fn distance(&self, e: State) -> f32 {
        let label = self.labels[e as usize];
        if (label >> 32) as u32 <= self.number { f32::from_bits(label as u32) } else { f32::INFINITY }
    }

    /// Final distance; infinite without one.
    #[inline]
    pub(super) fn settled_distance(&self, e: State) -> f32 {
        let label = self.labels[e as usize];
        if (label >> 32) as u32 == self.number - 1 { f32::from_bits(label as u32) } else { f32::INFINITY }
    }

    /// Whether the distance is final.
    #[inline]
    pub(super) fn is_settled(&self, e: State) -> bool {
        (self.labels[e as usize] >> 32) as u32 == self.number - 1
    }

    #[inline]
    fn label(&self, distance: f32) -> u64 {
        u64::from(self.number) << 32 | u64::from(distance.to_bits())
    }

    /// Whether a distance would replace the one of `e`. A final distance is never replaced: the same costs summed in another
    /// order may be smaller in the last bit.
    #[inline]
    pub(super) fn improves(&self, e: State, distance: f32) -> bool {
        self.label(distance) < self.labels[e as usize]
    }

    /// Sets the tentative distance of `e`, its parent, and a tag, whose meaning is the search's own.
    #[inline]
    pub(super) fn set(&mut self, e: State, distance: f32, parent: State, tag: u16) {
        self.labels[e as usize] = self.label(distance);
        self.predecessors[e as usize] = Predecessor { parent, tag };
    }

    /// Adds a state to the queue.
    #[inline]
    pub(super) fn push(&mut self, key: f32, e: State) {
        self.queue.push(key, e);
    }

    /// Sets the distance of a source of the search, and adds it to the queue.
    #[inline]
    pub(super) fn add_source(&mut self, e: State, distance: f32) {
        self.set(e, distance, NO_STATE, 0);
        self.push(distance, e);
    }

    /// Lowers the distance of `e` to `distance`, if that is smaller, and adds it to the queue.
    #[inline]
    pub(super) fn relax(&mut self, e: State, distance: f32, parent: State) {
        if self.improves(e, distance) {
            self.set(e, distance, parent, 0);
            self.push(distance, e);
        }
    }

    /// Removes the next unsettled state from the queue, marks it as settled and returns it with its key.
    #[inline]
    pub(super) fn settle(&mut self, graph: &ElasticaGraph) -> Option<(f32, State)> {
        loop {
            self.prefetch(graph);
            let (key, e) = self.queue.pop()?;
            if !self.is_settled(e) {
                self.labels[e as usize] -= 1 << 32;
                return Some((key, e));
            }
        }
    }

    /// Reads the memory that settling the states of the next bucket reads, so that these cache misses overlap: the tables
    /// exceed the caches, and a search accesses them in no order.
    #[inline]
    fn prefetch(&mut self, graph: &ElasticaGraph) {
        let Some(states) = self.queue.take_opened() else { return };
        let (labels, predecessors) = (&self.labels, &self.predecessors);
        let read = |e: State| {
            let (next, cost) = graph.touch_steps(e);
            let [e, back, next] = [e, graph.reversed(e), next].map(|s| s as usize);
            let label = labels[e] ^ labels[back] ^ labels[next];
            label as u32 ^ cost ^ predecessors[e].parent ^ predecessors[next].parent
        };
        std::hint::black_box(states.map(read).fold(0, |all, read| all ^ read));
    }

    /// Settles all states that the sources reach, by plain Dijkstra; calls `each` with the distance of each of them, in
    /// order.
    pub(super) fn settle_all<E>(
        &mut self,
        graph: &ElasticaGraph,
        mut each: impl FnMut(f32) -> Result<(), E>,
    ) -> Result<(), E> {
        while let Some((d, e)) = self.settle(graph) {
            each(d)?;
            graph.expand(e, |f, step| self.relax(f, d + step, e));
        }
        Ok(())
    }

    /// The key of the state that is settled next; infinite if there is none.
    ///
    /// A state that was reached more than once has older entries in the queue. Those of settled states are removed here:
    /// their keys are smaller than that of the next state, and a search over several fields would take the wrong one.
    #[inline]
    pub(super) fn min_key(&mut self) -> f32 {
        loop {
            match self.queue.peek() {
                Some((_, e)) if self.is_settled(e) => self.queue.pop(),
                Some((key, _)) => return key,
                None => return f32::INFINITY,
            };
        }
    }

    /// Exchanges the queue with another one.
    pub(super) fn swap_queue(&mut self, other: &mut BucketQueue) {
        std::mem::swap(&mut self.queue, other);
    }

    /// Empties the queue.
    pub(super) fn clear_queue(&mut self) {
        self.queue.clear();
    }

    /// The state before `e`, and the tag that `e` was set with.
    pub(super) fn parent(&self, e: State) -> (State, u16) {
        let predecessor = &self.predecessors[e as usize];
        (predecessor.parent, predecessor.tag)
    }

    /// The states from the source to `e`.
    pub(super) fn path_to(&self, e: State) -> Vec<State> {
        let mut path: Vec<State> =
            std::iter::successors(Some(e), |&s| Some(self.parent(s).0).filter(|&p| p != NO_STATE)).collect();
        path.reverse();
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A field over some states without a graph.
    fn field() -> DistanceField {
        let mut field = DistanceField::default();
        field.restart(4);
        field
    }

    #[test]
    fn a_restart_forgets_distances() {
        let mut field = field();
        field.add_source(2, 1.5);
        assert_eq!((field.distance(2), field.min_key()), (1.5, 1.5));
        field.restart(4);
        assert_eq!((field.distance(2), field.min_key()), (f32::INFINITY, f32::INFINITY));
        assert!(field.improves(2, 7.0));
    }

    #[test]
    fn a_restart_clears_labels_when_search_numbers_run_out() {
        let mut field = field();
        field.add_source(1, 0.5);
        field.number = 2;
        field.restart(4);
        assert_eq!(field.distance(1), f32::INFINITY);
        assert!(field.improves(1, 1.0) && field.number > 2);
    }

    #[test]
    fn the_smallest_key_is_not_that_of_a_settled_state() {
        let mut field = field();
        field.add_source(0, 3.0);
        field.relax(0, 1.0, 3);
        field.add_source(1, 4.0);
        assert_eq!(field.min_key(), 1.0);
        // As `settle` does, without a graph.
        field.queue.pop();
        field.labels[0] -= 1 << 32;
        assert_eq!(field.min_key(), 4.0);
    }

    #[test]
    fn only_a_smaller_distance_replaces_a_tentative_one() {
        let mut field = field();
        field.add_source(0, 2.0);
        field.relax(0, 2.0, 3);
        assert_eq!(field.parent(0), (NO_STATE, 0));
        field.relax(0, 1.0, 3);
        assert_eq!((field.distance(0), field.parent(0)), (1.0, (3, 0)));
        assert!(!field.is_settled(0) && field.settled_distance(0) == f32::INFINITY);
    }
}

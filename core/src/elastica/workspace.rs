//! Memory that searches reuse.

use std::sync::Mutex;

use super::bucket_queue::BucketQueue;
use super::curve_neighbourhood::CurveNeighbourhood;
use super::distance_field::DistanceField;
use super::graph::State;
use super::open_curves::BoundarySearchMemory;
use super::sectors::SectorMemory;

/// Memory of searches, to be kept between them. One search uses it at a time; the next may be on another graph, and nothing
/// needs to be cleared.
#[derive(Debug, Default)]
pub struct SearchWorkspace {
    /// Distances from the vertex of the query; also the forward front of a bidirectional search.
    pub(super) root: DistanceField,
    /// The states settled in the ball.
    pub(super) ball: Vec<State>,
    /// The states settled in the corridor.
    pub(super) corridor: Vec<State>,
    /// The queue of the ball, while the queue of `root` is used for the corridor.
    pub(super) ball_queue: BucketQueue,
    /// The backward front of a bidirectional search.
    pub(super) backward: DistanceField,
    /// Per thread, for sectors of start directions that are searched in parallel.
    pub(super) sectors: Vec<Mutex<SectorMemory>>,
    pub(super) neighbourhood: CurveNeighbourhood,
    /// Per leg between anchors: distances from its first anchor.
    pub(super) leg_starts: Vec<DistanceField>,
    /// Per leg: costs of the remaining round.
    pub(super) cost_to_go: Vec<DistanceField>,
    /// Per leg: distances of an A* search, or of the backward front on one leg.
    pub(super) forward: Vec<DistanceField>,
    pub(super) boundary: BoundarySearchMemory,
}

impl SearchWorkspace {
    /// An empty workspace; the first search allocates its memory.
    pub fn new() -> Self {
        Self::default()
    }
}

//! Separatrix matching: the assignment of isolines to arcs.
//!
//! As many isolines leave a node as it has arcs, in the same cyclic order, so that a cyclic shift, the rotation,
//! assigns all of them. All isolines are traced from all nodes to the next node. Each node is then rotated such that as
//! many of its arcs as possible end at the right node, after the right length, as the isoline that the other node
//! assigns to the arc. Among equal rotations, the one wins that agrees with the headings of the chains.

use crate::embed::trace::error::TraceError;
use crate::embed::trace::isolines::{Isolines, OutgoingIsoline, Step, Stop, TracedIsoline, corner_uv};
use crate::layout::QuadLayout;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{SeamlessMap, Transition, turn};

/// Largest relative difference between the length of an isoline and that of its arc's chain which counts as rounding.
pub(super) const LENGTH_TOLERANCE: f64 = 1e-6;
/// Largest number of rounds in which nodes are rotated to fit their neighbours. Agreement spreads from nodes with a
/// unique best rotation, mostly in one round.
const ROUNDS: usize = 8;

/// The homotopy class of an arc, as a chain of triangles, and its direction in the map.
#[derive(Debug, Clone, Copy)]
pub struct ArcChain<'a> {
    /// A corner at the first node, as outgoing half-edge.
    pub start: HalfedgeId,
    /// The half-edges crossed from the first triangle to the last, each of the triangle that is left.
    pub crossed: &'a [HalfedgeId],
    /// A corner at the second node in the last triangle, as outgoing half-edge.
    pub end: HalfedgeId,
    /// The direction of the arc in the chart of the first triangle: 0 is +u, 1 is +v, 2 is −u, 3 is −v.
    pub heading: u8,
}

/// The end of an arc as its chain determines it.
pub(super) struct ChainEnd {
    /// Length of the arc in the map, negative if the second node lies behind the first.
    pub length: f64,
    /// The reversed heading of the arc, in the chart of the last triangle.
    pub back: u8,
}

impl ChainEnd {
    /// `None` if the chain is not connected.
    pub fn new(mesh: &TriMesh, map: &SeamlessMap, chain: &ArcChain) -> Option<Self> {
        let mut change = Transition::IDENTITY;
        let mut face = mesh.face(chain.start);
        for &h in chain.crossed {
            if mesh.face(h) != face {
                return None;
            }
            change = change.then(&map.transition(mesh, h)?);
            face = mesh.face(mesh.twin(h)?);
        }
        let end = change.inverse().apply(corner_uv(map, chain.end)) - corner_uv(map, chain.start);
        let length = turn(end, -i32::from(chain.heading)).x;
        (face == mesh.face(chain.end)).then_some(Self { length, back: (chain.heading + change.turns + 2) % 4 })
    }

    /// The ends of all arcs.
    fn all(isolines: &Isolines, layout: &QuadLayout, chains: &[ArcChain]) -> Result<Vec<Self>, TraceError> {
        let end = |(arc, chain): (usize, &ArcChain)| {
            let end = Self::new(isolines.mesh, isolines.map, chain).ok_or(TraceError::Chain { arc })?;
            let nodes = [chain.start, chain.end].map(|h| isolines.node[isolines.mesh.origin(h).index()]);
            if nodes != layout.arcs[arc].nodes {
                return Err(TraceError::Chain { arc });
            }
            if end.length <= isolines.rounding {
                return Err(TraceError::Length { arc, length: end.length });
            }
            Ok(end)
        };
        chains.iter().enumerate().map(end).collect()
    }
}

/// The trace of an isoline, the node at its end, and which of the isolines of that node is the reversed trace.
type Trace = Result<(TracedIsoline, usize, usize), Stop>;

/// The isolines of all nodes, to be matched with the arcs. A half-arc is a number: twice its arc, plus one if it starts
/// at the second node.
pub(super) struct SeparatrixMatching<'a> {
    layout: &'a QuadLayout,
    mesh: &'a TriMesh,
    chain_ends: Vec<ChainEnd>,
    rounding: f64,
    /// The half-arcs around each node, counter-clockwise.
    half_arcs: Vec<Vec<u32>>,
    /// Position of each half-arc among those of its node.
    position: Vec<usize>,
    /// The traces of each node's isolines.
    traces: Vec<Vec<Trace>>,
    /// For each half-arc the isoline that agrees with its chain.
    chain_isoline: Vec<Option<usize>>,
    /// For each node, its first half-arc is the isoline with this number.
    rotation: Vec<usize>,
}

impl<'a> SeparatrixMatching<'a> {
    /// Traces all isolines of the nodes, which are the vertices `node_vertex`.
    ///
    /// # Errors
    ///
    /// [`TraceError::Chain`], [`TraceError::Length`], [`TraceError::Order`] and [`TraceError::Node`].
    pub fn new(
        isolines: &Isolines<'a>,
        layout: &'a QuadLayout,
        node_vertex: &[VertexId],
        chains: &[ArcChain],
    ) -> Result<Self, TraceError> {
        let mesh = isolines.mesh;
        let chain_ends = ChainEnd::all(isolines, layout, chains)?;
        let half_arcs = half_arcs_around(layout)?;
        let mut position = vec![0; 2 * layout.arcs.len()];
        for around in &half_arcs {
            for (i, &e) in around.iter().enumerate() {
                position[e as usize] = i;
            }
        }
        let outgoing: Vec<Vec<OutgoingIsoline>> = node_vertex.iter().map(|&v| isolines.outgoing(v)).collect();
        for (node, (found, expected)) in outgoing.iter().zip(&half_arcs).enumerate() {
            if found.len() != expected.len() {
                return Err(TraceError::Node { node, found: found.len(), expected: expected.len() });
            }
        }
        // No arc of a node is longer than the longest of its chains.
        let limit = |n: usize| half_arcs[n].iter().map(|&e| chain_ends[e as usize / 2].length).fold(0.0, f64::max);
        let trace = |isoline: OutgoingIsoline, limit: f64| -> Trace {
            let traced = isolines.trace(isoline, limit * (1.0 + LENGTH_TOLERANCE) + isolines.rounding)?;
            let Some(&Step::Vertex(end, _)) = traced.steps.last() else { return Err(Stop::Length(FaceId(0))) };
            let to = isolines.node[mesh.origin(end).index()] as usize;
            let at = isolines.arrival(&traced.steps, &outgoing[to]).ok_or(Stop::Vertex(mesh.origin(end)))?;
            Ok((traced, to, at))
        };
        let traces =
            outgoing.iter().enumerate().map(|(n, s)| s.iter().map(|&s| trace(s, limit(n))).collect()).collect();
        let agreeing =
            |n: u32, corner, heading| isolines.with_heading(&outgoing[n as usize], corner, heading).first().copied();
        let chain_isoline = chains.iter().zip(&chain_ends).zip(&layout.arcs).flat_map(|((chain, end), arc)| {
            [agreeing(arc.nodes[0], chain.start, chain.heading), agreeing(arc.nodes[1], chain.end, end.back)]
        });
        let chain_isoline = chain_isoline.collect();
        let (rounding, rotation) = (isolines.rounding, vec![0; layout.nodes.len()]);
        Ok(Self { layout, mesh, chain_ends, rounding, half_arcs, position, traces, chain_isoline, rotation })
    }

    /// The node that a half-arc starts at.
    fn node(&self, end: u32) -> usize {
        self.layout.arcs[end as usize / 2].nodes[end as usize % 2] as usize
    }

    /// The isoline assigned to a half-arc if its node has the given rotation.
    fn isoline(&self, end: u32, rotation: usize) -> usize {
        let n = self.node(end);
        (self.position[end as usize] + rotation) % self.half_arcs[n].len()
    }

    /// If an isoline ends where the given half-arc should, the number of the reversed isoline there.
    fn matched_end(&self, end: u32, isoline: usize) -> Option<usize> {
        let (traced, to, at) = self.traces[self.node(end)][isoline].as_ref().ok()?;
        let length = self.chain_ends[end as usize / 2].length;
        let right =
            *to == self.node(end ^ 1) && (traced.length - length).abs() <= LENGTH_TOLERANCE * length + self.rounding;
        right.then_some(*at)
    }

    /// How well a rotation of node `n` fits, compared lexicographically: the numbers of half-arcs whose isoline is also
    /// that of the opposite half-arc (counted if `others` is set), whose isoline ends where it should, and which agree
    /// with their chain.
    fn score(&self, n: usize, rotation: usize, others: bool) -> [usize; 3] {
        let mut score = [0; 3];
        for &end in &self.half_arcs[n] {
            let isoline = self.isoline(end, rotation);
            let other = self.node(end ^ 1);
            let there = self.isoline(end ^ 1, if other == n { rotation } else { self.rotation[other] });
            let (to, back) = (self.matched_end(end, isoline), self.matched_end(end ^ 1, there));
            score[0] += usize::from(others && (to == Some(there) || back == Some(isoline)));
            score[1] += usize::from(to.is_some());
            score[2] += usize::from(self.chain_isoline[end as usize] == Some(isoline));
        }
        score
    }

    /// The isoline of each arc, and whether it was traced from the second node to the first.
    ///
    /// # Errors
    ///
    /// [`TraceError::FlippedTriangle`], [`TraceError::Lost`] or [`TraceError::WrongEnd`] for the first arc without an
    /// isoline.
    pub fn arcs(mut self) -> Result<Vec<(TracedIsoline, bool)>, TraceError> {
        // The first round does not look at the other nodes, whose rotations are still arbitrary.
        for round in 0..ROUNDS {
            let before = self.rotation.clone();
            for n in 0..self.half_arcs.len() {
                // On the boundary the first isoline is the first half-arc.
                if self.layout.nodes[n].boundary {
                    continue;
                }
                let now = self.rotation[n];
                let best = (0..self.half_arcs[n].len())
                    .max_by_key(|&t| (self.score(n, t, round > 0), t == now, std::cmp::Reverse(t)));
                self.rotation[n] = best.unwrap_or(now);
            }
            if round > 0 && before == self.rotation {
                break;
            }
        }
        let mut isolines = Vec::with_capacity(self.chain_ends.len());
        for arc in 0..self.chain_ends.len() {
            let ends = [2 * arc as u32, 2 * arc as u32 + 1];
            let assigned = ends.map(|e| self.isoline(e, self.rotation[self.node(e)]));
            let fits = |i: usize| self.matched_end(ends[i], assigned[i]) == Some(assigned[1 - i]);
            let Some(i) = [0, 1].into_iter().find(|&i| fits(i)) else {
                return Err(self.failure(arc, ends[0], assigned[0]));
            };
            if let Ok((traced, ..)) = &self.traces[self.node(ends[i])][assigned[i]] {
                isolines.push((traced.clone(), i == 1));
            }
        }
        Ok(isolines)
    }

    /// Why the isoline assigned to a half-arc is not its arc.
    fn failure(&self, arc: usize, end: u32, isoline: usize) -> TraceError {
        match &self.traces[self.node(end)][isoline] {
            Err(Stop::FlippedTriangle(face)) => TraceError::FlippedTriangle { arc, face: *face },
            Err(Stop::Boundary(face) | Stop::Length(face)) => TraceError::Lost { arc, face: *face },
            Err(Stop::Vertex(v)) => TraceError::Lost { arc, face: self.mesh.face(self.mesh.vertex_halfedge(*v)) },
            Ok((traced, node, _)) => TraceError::WrongEnd {
                arc,
                node: *node,
                length: traced.length,
                expected_node: self.node(end ^ 1),
                expected: self.chain_ends[arc].length,
            },
        }
    }
}

/// The half-arcs around each node, counter-clockwise; at the boundary from the one that has the surface on its left
/// only.
fn half_arcs_around(layout: &QuadLayout) -> Result<Vec<Vec<u32>>, TraceError> {
    let mut next = vec![u32::MAX; 2 * layout.arcs.len()];
    let mut has_previous = vec![false; next.len()];
    for patch in &layout.patches {
        for i in 0..4 {
            let (leaving, arriving) = (patch.sides[i], patch.sides[(i + 3) % 4]);
            let after = 2 * arriving.0 + u32::from(arriving.1);
            next[(2 * leaving.0 + u32::from(!leaving.1)) as usize] = after;
            has_previous[after as usize] = true;
        }
    }
    let mut half_arcs: Vec<Vec<u32>> = vec![Vec::new(); layout.nodes.len()];
    let mut count = vec![0; layout.nodes.len()];
    let node = |e: u32| layout.arcs[e as usize / 2].nodes[e as usize % 2] as usize;
    for e in 0..next.len() as u32 {
        count[node(e)] += 1;
    }
    // First from half-arcs without a predecessor, which begin a fan at the boundary; a closed fan may begin with any.
    for begins in [true, false] {
        for first in (0..next.len() as u32).filter(|&e| !begins || !has_previous[e as usize]) {
            let around = &mut half_arcs[node(first)];
            if !around.is_empty() {
                continue;
            }
            let mut e = first;
            while e != u32::MAX && around.len() < next.len() && (around.is_empty() || e != first) {
                around.push(e);
                e = next[e as usize];
            }
        }
    }
    match (0..half_arcs.len()).find(|&n| half_arcs[n].len() != count[n]) {
        Some(node) => Err(TraceError::Order { node }),
        None => Ok(half_arcs),
    }
}

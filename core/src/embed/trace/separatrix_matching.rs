//! Which isoline of its nodes each arc is.
//!
//! From a node as many isolines go out as it has arcs, in the same cyclic order; so a node's arcs are known as soon
//! as one of them is. All isolines from all nodes are marched to the next node. A node is then turned such that
//! most of its arcs end at the node they should, after the length they should have, as the isoline of the other
//! end; what the arcs' chains say about their headings decides where that leaves a choice.

use crate::embed::trace::arcs::{ArcChain, TraceError};
use crate::embed::trace::isolines::{Isolines, Marched, Slot, Step, Stop};
use crate::layout::QuadLayout;
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{SeamlessMap, Transition, turn};

/// Relative difference between the length of an arc and that its chain says which is rounding.
pub(in crate::embed) const LENGTH: f64 = 1e-6;
/// Rounds of turning nodes to fit their neighbours; agreement spreads from nodes without choice, mostly in one.
const ROUNDS: usize = 8;

/// What the chain of an arc says.
pub(in crate::embed) struct Run {
    /// Length of the arc in the map.
    pub length: f64,
    /// Heading from the second node back, in the chart of the last triangle.
    pub back: u8,
}

impl Run {
    /// `None` if the chain is none.
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
        let at = |h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
        let end = change.inverse().apply(at(chain.end)) - at(chain.start);
        let length = turn(end, -i32::from(chain.heading)).x;
        (face == mesh.face(chain.end)).then_some(Self { length, back: (chain.heading + change.turns + 2) % 4 })
    }
}

/// Where the isoline of a slot leads.
type Spoke = Result<(Marched, usize, usize), Stop>;

/// The isolines of all nodes, to be matched with the arcs.
pub(in crate::embed) struct SeparatrixMatching<'a> {
    layout: &'a QuadLayout,
    mesh: &'a TriMesh,
    runs: Vec<Run>,
    exact: f64,
    /// Ends of arcs (twice the arc, plus one at the second node) around each node, counter-clockwise.
    ends: Vec<Vec<u32>>,
    /// Place of each end of an arc among those of its node.
    place: Vec<usize>,
    /// For each node and slot the line, and the node and slot it comes to.
    spokes: Vec<Vec<Spoke>>,
    /// The slot that the chain says for each end of an arc.
    hints: Vec<Option<usize>>,
    /// By how many slots each node's arcs are turned.
    turned: Vec<usize>,
}

impl<'a> SeparatrixMatching<'a> {
    pub fn new(
        lines: &Isolines<'a>,
        layout: &'a QuadLayout,
        node_vertex: &[VertexId],
        chains: &[ArcChain],
    ) -> Result<Self, TraceError> {
        let (mesh, map) = (lines.mesh, lines.map);
        let mut runs = Vec::with_capacity(chains.len());
        for (arc, chain) in chains.iter().enumerate() {
            let run = Run::new(mesh, map, chain).ok_or(TraceError::Chain { arc })?;
            let ends = [chain.start, chain.end].map(|h| lines.node[mesh.origin(h).index()]);
            if ends != layout.arcs[arc].nodes {
                return Err(TraceError::Chain { arc });
            }
            if run.length <= lines.exact {
                return Err(TraceError::Length { arc, length: run.length });
            }
            runs.push(run);
        }
        let ends = ends_around(layout)?;
        let mut place = vec![0; 2 * layout.arcs.len()];
        for around in &ends {
            for (i, &e) in around.iter().enumerate() {
                place[e as usize] = i;
            }
        }
        let slots: Vec<Vec<Slot>> = node_vertex.iter().map(|&v| lines.slots(v)).collect();
        for (node, (found, expected)) in slots.iter().zip(&ends).enumerate() {
            if found.len() != expected.len() {
                return Err(TraceError::Node { node, found: found.len(), expected: expected.len() });
            }
        }
        let limit = |n: usize| ends[n].iter().map(|&e| runs[e as usize / 2].length).fold(0.0, f64::max);
        let spoke = |slot: Slot, limit: f64| -> Spoke {
            let marched = lines.march(slot, limit * (1.0 + LENGTH) + lines.exact)?;
            let Some(&Step::Vertex(end, _)) = marched.steps.last() else { return Err(Stop::Length(FaceId(0))) };
            let to = lines.node[mesh.origin(end).index()] as usize;
            let at = lines.arrival(&marched.steps, &slots[to]).ok_or(Stop::Vertex(mesh.origin(end)))?;
            Ok((marched, to, at))
        };
        let spokes = slots.iter().enumerate().map(|(n, s)| s.iter().map(|&s| spoke(s, limit(n))).collect()).collect();
        let hint = |n: u32, corner, heading| lines.matching(&slots[n as usize], corner, heading).first().copied();
        let hints = chains.iter().zip(&runs).zip(&layout.arcs).flat_map(|((chain, run), arc)| {
            [hint(arc.nodes[0], chain.start, chain.heading), hint(arc.nodes[1], chain.end, run.back)]
        });
        let hints = hints.collect();
        let turned = vec![0; layout.nodes.len()];
        Ok(Self { layout, mesh, runs, exact: lines.exact, ends, place, spokes, hints, turned })
    }

    fn node(&self, end: u32) -> usize {
        self.layout.arcs[end as usize / 2].nodes[end as usize % 2] as usize
    }

    /// The slot of an end of an arc if its node is turned by `turned`.
    fn slot(&self, end: u32, turned: usize) -> usize {
        let n = self.node(end);
        (self.place[end as usize] + turned) % self.ends[n].len()
    }

    /// Where the line of a slot leads if that is where the arc of this end should lead: the slot there.
    fn leads(&self, end: u32, slot: usize) -> Option<usize> {
        let (marched, to, at) = self.spokes[self.node(end)][slot].as_ref().ok()?;
        let length = self.runs[end as usize / 2].length;
        let right = *to == self.node(end ^ 1) && (marched.length - length).abs() <= LENGTH * length + self.exact;
        right.then_some(*at)
    }

    /// How good it is to turn a node by `turned`: ends whose line is also that of the other end, ends whose line leads
    /// where it should, ends that agree with their chain.
    fn score(&self, n: usize, turned: usize, others: bool) -> [usize; 3] {
        let mut score = [0; 3];
        for &end in &self.ends[n] {
            let slot = self.slot(end, turned);
            let other = self.node(end ^ 1);
            let there = self.slot(end ^ 1, if other == n { turned } else { self.turned[other] });
            let (to, back) = (self.leads(end, slot), self.leads(end ^ 1, there));
            score[0] += usize::from(others && (to == Some(there) || back == Some(slot)));
            score[1] += usize::from(to.is_some());
            score[2] += usize::from(self.hints[end as usize] == Some(slot));
        }
        score
    }

    /// The line of each arc, and whether it runs from the second node to the first.
    pub fn arcs(mut self) -> Result<Vec<(Marched, bool)>, TraceError> {
        for round in 0..ROUNDS {
            let before = self.turned.clone();
            for n in 0..self.ends.len() {
                if self.layout.nodes[n].boundary {
                    continue;
                }
                let now = self.turned[n];
                let best = (0..self.ends[n].len())
                    .max_by_key(|&t| (self.score(n, t, round > 0), t == now, std::cmp::Reverse(t)));
                self.turned[n] = best.unwrap_or(now);
            }
            if round > 0 && before == self.turned {
                break;
            }
        }
        let mut lines = Vec::with_capacity(self.runs.len());
        for arc in 0..self.runs.len() {
            let ends = [2 * arc as u32, 2 * arc as u32 + 1];
            let slots = ends.map(|e| self.slot(e, self.turned[self.node(e)]));
            let fits = |i: usize| self.leads(ends[i], slots[i]) == Some(slots[1 - i]);
            let Some(i) = [0, 1].into_iter().find(|&i| fits(i)) else {
                return Err(self.failure(arc, ends[0], slots[0]));
            };
            if let Ok((marched, ..)) = &self.spokes[self.node(ends[i])][slots[i]] {
                lines.push((marched.clone(), i == 1));
            }
        }
        Ok(lines)
    }

    fn failure(&self, arc: usize, end: u32, slot: usize) -> TraceError {
        match &self.spokes[self.node(end)][slot] {
            Err(Stop::Fold(face)) => TraceError::Fold { arc, face: *face },
            Err(Stop::Boundary(face) | Stop::Length(face)) => TraceError::Lost { arc, face: *face },
            Err(Stop::Vertex(v)) => TraceError::Lost { arc, face: self.mesh.face(self.mesh.vertex_halfedge(*v)) },
            Ok((marched, node, _)) => TraceError::Strayed {
                arc,
                node: *node,
                length: marched.length,
                expected_node: self.node(end ^ 1),
                expected: self.runs[arc].length,
            },
        }
    }
}

/// The ends of arcs around each node counter-clockwise, as twice the arc plus one at its second node; at the boundary
/// beginning with the one that has the surface on its left only.
fn ends_around(layout: &QuadLayout) -> Result<Vec<Vec<u32>>, TraceError> {
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
    let mut ends: Vec<Vec<u32>> = vec![Vec::new(); layout.nodes.len()];
    let mut count = vec![0; layout.nodes.len()];
    let node = |e: u32| layout.arcs[e as usize / 2].nodes[e as usize % 2] as usize;
    for e in 0..next.len() as u32 {
        count[node(e)] += 1;
    }
    // First the ends that begin a fan, then any: a closed fan may begin anywhere.
    for begins in [true, false] {
        for first in (0..next.len() as u32).filter(|&e| !begins || !has_previous[e as usize]) {
            let around = &mut ends[node(first)];
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
    match (0..ends.len()).find(|&n| ends[n].len() != count[n]) {
        Some(node) => Err(TraceError::Order { node }),
        None => Ok(ends),
    }
}

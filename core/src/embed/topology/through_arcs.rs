//! Through-arcs: chains of opposite arcs through regular nodes (Campen, section 6.9).
//!
//! A regular node is the crossing of two isolines and need not be constrained itself. Its four arcs are joined to two
//! opposite pairs, so that only chains from one irregular node to another must be isolines; the position of a regular
//! node follows as the crossing of its two chains. A chain that closes on itself must be a closed isoline.
//!
//! The position of a node on the chain may come out in another order than in the layout: the structure has to be
//! verified afterwards.

use crate::embed::topology::embedding_topology::{EmbeddingTopology, TopologyArc};
use crate::layout::QuadLayout;
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::surface::SurfacePoint;

/// A half-arc: an arc, and whether the half-arc starts at its second node rather than at its first.
pub(in crate::embed) type HalfArc = (u32, bool);

/// The half-arcs around each node, and which of them are joined through regular nodes.
#[derive(Debug, Clone)]
pub(in crate::embed) struct ThroughArcs {
    /// For each half-arc the next one counter-clockwise around its node; `None` at the boundary.
    next: Vec<[Option<HalfArc>; 2]>,
    /// For each half-arc the opposite one at its node; `None` where chains end.
    opposite: Vec<[Option<HalfArc>; 2]>,
    /// For each node whether its arcs are constrained to end in it.
    pub constrained: Vec<bool>,
}

/// A chain of triangles between corners of its first and its last triangle.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::embed) struct TriangleChain {
    /// The first corner, as outgoing half-edge.
    pub start: HalfedgeId,
    /// The half-edges crossed, each of the triangle that is left.
    pub crossed: Vec<HalfedgeId>,
    /// The last corner, as outgoing half-edge.
    pub end: HalfedgeId,
    /// The direction (0 to 3) of the first triangle's cross in which it runs.
    pub heading: u8,
}

impl ThroughArcs {
    /// Joins the arcs at all regular nodes of a layout inside the surface that are not `pinned`. At a regular node on
    /// the boundary chains end without a constraint, for every isoline that ends there does so at a right angle.
    pub(in crate::embed) fn new(layout: &QuadLayout, pinned: impl Fn(usize) -> bool) -> Self {
        let mut next: Vec<[Option<HalfArc>; 2]> = vec![[None; 2]; layout.arcs.len()];
        for p in &layout.patches {
            for i in 0..4 {
                // Counter-clockwise at corner `i`, the side that arrives there follows the side that leaves.
                let (out, forward) = p.sides[i];
                let (into, came) = p.sides[(i + 3) % 4];
                next[out as usize][usize::from(!forward)] = Some((into, came));
            }
        }
        let constrained: Vec<bool> =
            layout.nodes.iter().enumerate().map(|(i, n)| !n.is_regular() || pinned(i)).collect();
        let opposite_end = |a: usize, second: bool| {
            let node = layout.arcs[a].nodes[usize::from(second)] as usize;
            if constrained[node] || layout.nodes[node].boundary {
                return None;
            }
            let (b, e) = next[a][usize::from(second)]?;
            next[b as usize][usize::from(e)]
        };
        let opposite = (0..layout.arcs.len()).map(|a| [false, true].map(|e| opposite_end(a, e))).collect();
        Self { next, opposite, constrained }
    }

    /// The chains that must be isolines, each once: from one constrained node to another, or closed. A closed one ends
    /// at the corner it starts at.
    pub(in crate::embed) fn chains(&self, topology: &EmbeddingTopology) -> Vec<TriangleChain> {
        let mut done = vec![false; topology.arcs.len()];
        let mut chains = Vec::new();
        // First from half-arcs without an opposite one, where chains begin; the arcs left after that are in closed
        // chains.
        let ends = (0..topology.arcs.len() as u32).flat_map(|a| [(a, false), (a, true)]);
        let open = |&(a, e): &HalfArc| self.opposite[a as usize][usize::from(e)].is_none();
        for first in ends.clone().filter(open).chain(ends) {
            if done[first.0 as usize] || topology.arcs[first.0 as usize].boundary {
                continue;
            }
            let (list, closed) = self.walk(first);
            for &(a, _) in &list {
                done[a as usize] = true;
            }
            let node = |(a, e): HalfArc| topology.arcs[a as usize].nodes[usize::from(e)] as usize;
            let (Some(&head), Some(&tail)) = (list.first(), list.last()) else { continue };
            let far = (tail.0, !tail.1);
            if closed || (self.constrained[node(head)] && self.constrained[node(far)]) {
                chains.extend(join(topology, &list).and_then(|mut c| {
                    if closed {
                        c.crossed.extend(fan_crossings(&topology.mesh, c.end, c.start)?);
                        c.end = c.start;
                    }
                    Some(c)
                }));
            }
        }
        chains
    }

    /// The half-arcs from `first` on to the end of the chain, and whether it is closed.
    fn walk(&self, first: HalfArc) -> (Vec<HalfArc>, bool) {
        let mut list = vec![first];
        let mut at = first;
        while let Some(on) = self.opposite[at.0 as usize][usize::from(!at.1)] {
            // The bound on the length only matters for inconsistent layouts, where a chain need not return to `first`.
            if on == first || list.len() > 2 * self.opposite.len() {
                return (list, true);
            }
            list.push(on);
            at = on;
        }
        (list, false)
    }

    /// The chains from the start of a half-arc to each node on its through-arc, with these nodes, up to the end of the
    /// through-arc or once around it.
    pub(in crate::embed) fn continuations(
        &self,
        topology: &EmbeddingTopology,
        end: HalfArc,
    ) -> Vec<(TriangleChain, usize)> {
        let (list, _) = self.walk(end);
        let mut continuations: Vec<(TriangleChain, usize)> = Vec::new();
        for &at in &list {
            let next = match continuations.last() {
                None => Some(half_arc_chain(topology, at)),
                Some((before, _)) => extend(topology, before.clone(), at),
            };
            let Some(chain) = next else { break };
            continuations.push((chain, topology.arcs[at.0 as usize].nodes[usize::from(!at.1)] as usize));
        }
        continuations
    }

    /// The chain that gives the length of an arc in the map even where its nodes are not constrained: from a
    /// constrained node on the isoline that crosses its first node, along the arc, to a constrained node on the isoline
    /// that crosses its second. The heading is that of the arc in the chain's first triangle. `None` if there is no
    /// such node.
    pub(in crate::embed) fn length_chain(&self, topology: &EmbeddingTopology, a: u32) -> Option<TriangleChain> {
        let mut list: Vec<HalfArc> = self.crossing_separatrix(topology, (a, false))?;
        list.reverse();
        for end in &mut list {
            end.1 = !end.1;
        }
        let before = join(topology, &list);
        list.push((a, false));
        list.extend(self.crossing_separatrix(topology, (a, true))?);
        let whole = join(topology, &list)?;
        let arc = &topology.arcs[a as usize];
        let mut crossed: Vec<HalfedgeId> = Vec::new();
        if let Some(before) = before {
            crossed.extend(before.crossed);
            crossed.extend(fan_crossings(&topology.mesh, before.end, arc.start)?);
        }
        let turns = topology.turns_along(&crossed);
        Some(TriangleChain { heading: (i32::from(arc.heading) + turns).rem_euclid(4) as u8, ..whole })
    }

    /// The half-arcs from the node of a half-arc, across it, to a constrained node; empty if the node itself is
    /// constrained.
    fn crossing_separatrix(&self, topology: &EmbeddingTopology, end: HalfArc) -> Option<Vec<HalfArc>> {
        let node = |(a, e): HalfArc| topology.arcs[a as usize].nodes[usize::from(e)] as usize;
        if self.constrained[node(end)] {
            return Some(Vec::new());
        }
        let mut at = end;
        // The other three half-arcs of a regular node; the opposite one does not cross.
        for _ in 0..3 {
            at = self.next[at.0 as usize][usize::from(at.1)]?;
            let (list, closed) = self.walk(at);
            let tail = list.last()?;
            let across = Some(at) != self.opposite[end.0 as usize][usize::from(end.1)];
            if across && !closed && self.constrained[node((tail.0, !tail.1))] {
                return Some(list);
            }
        }
        None
    }

    /// The corner at which a half-arc starts.
    pub(in crate::embed) fn corner(&self, topology: &EmbeddingTopology, (a, second): HalfArc) -> HalfedgeId {
        let arc = &topology.arcs[a as usize];
        if second { arc.end } else { arc.start }
    }

    /// Constrains the arcs of all nodes to end in them, so that no arcs are joined.
    pub(in crate::embed) fn constrain_all(&mut self) {
        self.constrained.fill(true);
        self.opposite.fill([None; 2]);
    }
}

/// The chain of a half-arc.
fn half_arc_chain(topology: &EmbeddingTopology, (a, second): HalfArc) -> TriangleChain {
    let TopologyArc { start, crossed, end, heading, .. } = &topology.arcs[a as usize];
    if !second {
        return TriangleChain { start: *start, crossed: crossed.clone(), end: *end, heading: *heading };
    }
    // In the frame of the last triangle the arc arrives with heading `heading − turns`, and leaves it in the opposite
    // one.
    let turns = topology.turns_along(crossed);
    let back = crossed.iter().rev().filter_map(|&h| topology.mesh.twin(h)).collect();
    TriangleChain {
        start: *end,
        crossed: back,
        end: *start,
        heading: (i32::from(*heading) - turns + 2).rem_euclid(4) as u8,
    }
}

/// The chain of half-arcs one after the other.
fn join(topology: &EmbeddingTopology, list: &[HalfArc]) -> Option<TriangleChain> {
    let (&first, rest) = list.split_first()?;
    rest.iter().try_fold(half_arc_chain(topology, first), |chain, &at| extend(topology, chain, at))
}

/// A chain continued by a half-arc that starts at its end.
fn extend(topology: &EmbeddingTopology, mut chain: TriangleChain, at: HalfArc) -> Option<TriangleChain> {
    let part = half_arc_chain(topology, at);
    chain.crossed.extend(fan_crossings(&topology.mesh, chain.end, part.start)?);
    chain.crossed.extend(part.crossed);
    chain.end = part.end;
    Some(chain)
}

/// The half-edges crossed counter-clockwise around a vertex from the triangle of one corner to that of another; `None`
/// at the boundary. At a regular vertex the other way around is homotopic.
pub(in crate::embed) fn fan_crossings(mesh: &TriMesh, from: HalfedgeId, to: HalfedgeId) -> Option<Vec<HalfedgeId>> {
    let mut crossed = Vec::new();
    let mut at = from;
    while mesh.face(at) != mesh.face(to) {
        let across = mesh.prev(at);
        crossed.push(across);
        at = mesh.twin(across)?;
        if at == from {
            return None;
        }
    }
    Some(crossed)
}

/// The corner at the origin of a half-edge as a point of the surface.
pub(in crate::embed) fn corner_point(h: HalfedgeId) -> SurfacePoint {
    let mut weights = [0.0; 3];
    weights[h.index() % 3] = 1.0;
    SurfacePoint { face: FaceId::new(h.index() / 3), weights }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embed::topology::testing::{is_chain, regular_topology};
    use crate::mesh::VertexId;

    /// The half-edges of a chain follow one another.
    fn is_connected(mesh: &TriMesh, chain: &TriangleChain) -> bool {
        let mut face = mesh.face(chain.start);
        chain.crossed.iter().all(|&h| std::mem::replace(&mut face, mesh.face(mesh.twin(h).unwrap())) == mesh.face(h))
            && face == mesh.face(chain.end)
    }

    #[test]
    fn chains_through_regular_nodes_only_are_closed() {
        let (layout, topology) = regular_topology();
        let chains = ThroughArcs::new(&layout, |_| false).chains(&topology);
        // Two along the rows and two along the columns.
        assert_eq!(chains.len(), 4);
        for chain in &chains {
            assert_eq!(chain.start, chain.end);
            assert!(is_connected(&topology.mesh, chain));
            assert_eq!(topology.turns_along(&chain.crossed).rem_euclid(4), 0, "a closed isoline keeps its direction");
        }
    }

    #[test]
    fn chains_between_pinned_nodes_are_the_arcs() {
        let (layout, topology) = regular_topology();
        let mut through = ThroughArcs::new(&layout, |_| true);
        let chains = through.chains(&topology);
        assert_eq!(chains.len(), topology.arcs.len());
        for (a, arc) in topology.arcs.iter().enumerate() {
            assert!(is_chain(&topology, a));
            let is_arc = |c: &TriangleChain| c.crossed == arc.crossed && c.heading == arc.heading;
            assert!(chains.iter().any(is_arc), "arc {a}");
            assert!(is_arc(&through.length_chain(&topology, a as u32).unwrap()));
        }
        through.constrain_all();
        assert_eq!(through.chains(&topology), chains);
    }

    #[test]
    fn a_pinned_node_opens_the_chains_through_it() {
        let (layout, topology) = regular_topology();
        let through = ThroughArcs::new(&layout, |n| n == 0);
        let at_node = |h: HalfedgeId| topology.mesh.origin(h) == topology.nodes[0].vertex;
        let chains = through.chains(&topology);
        assert_eq!(chains.len(), 4);
        // One row and one column pass through the node, and begin and end there.
        assert_eq!(chains.iter().filter(|c| at_node(c.start) && at_node(c.end)).count(), 2);
    }

    #[test]
    fn an_arc_has_no_length_without_constrained_nodes() {
        let (layout, topology) = regular_topology();
        let through = ThroughArcs::new(&layout, |_| false);
        assert!((0..topology.arcs.len() as u32).all(|a| through.length_chain(&topology, a).is_none()));
    }

    #[test]
    fn continuations_end_at_the_first_constrained_node() {
        let (layout, topology) = regular_topology();
        for (pinned, nodes) in [(true, 1), (false, 2)] {
            let through = ThroughArcs::new(&layout, |_| pinned);
            for half_arc in (0..topology.arcs.len() as u32).flat_map(|a| [(a, false), (a, true)]) {
                let found = through.continuations(&topology, half_arc);
                assert_eq!(found.len(), nodes);
                for (chain, node) in &found {
                    assert_eq!(chain.start, through.corner(&topology, half_arc));
                    assert_eq!(topology.mesh.origin(chain.end), topology.nodes[*node].vertex);
                    assert!(is_connected(&topology.mesh, chain));
                }
            }
        }
    }

    #[test]
    fn a_half_arc_backward_has_the_opposite_heading() {
        let (_, topology) = regular_topology();
        for a in 0..topology.arcs.len() as u32 {
            let [there, back] = [false, true].map(|second| half_arc_chain(&topology, (a, second)));
            let at_end = i32::from(there.heading) - topology.turns_along(&there.crossed);
            assert_eq!((i32::from(back.heading) - at_end).rem_euclid(4), 2);
        }
    }

    #[test]
    fn fan_crossings_go_once_around_a_vertex_at_most() {
        let (_, topology) = regular_topology();
        let corners: Vec<HalfedgeId> = topology.mesh.outgoing(VertexId(20)).collect();
        for (i, &to) in corners.iter().enumerate() {
            let crossed = fan_crossings(&topology.mesh, corners[0], to).unwrap();
            assert_eq!(crossed.len(), i);
        }
        let elsewhere = topology.mesh.next(corners[0]);
        let far = topology.mesh.twin(elsewhere).unwrap();
        assert!(fan_crossings(&topology.mesh, corners[0], far).is_none(), "not a triangle at the vertex");
    }

    #[test]
    fn a_corner_is_a_surface_point_of_weight_one() {
        let (_, topology) = regular_topology();
        let mesh = &topology.mesh;
        for h in mesh.halfedges().take(9) {
            assert_eq!(corner_point(h).position(mesh), mesh.position(mesh.origin(h)));
            assert_eq!(corner_point(h).face, mesh.face(h));
        }
    }
}

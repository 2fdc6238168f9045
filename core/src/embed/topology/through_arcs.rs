//! Straight chains of arcs through regular nodes (Campen, section 6.9).
//!
//! Four patches meet at a regular node, and two isolines cross there. Nothing singles it out but these: it need not be
//! held. Its four arcs are joined to two, so that only chains from irregular node to irregular node are asked to be
//! isolines, and its place follows as their crossing. A chain that closes on itself asks just for that.

use crate::layout::QuadLayout;
use crate::mesh::{HalfedgeId, TriMesh};
use crate::surface::SurfacePoint;

use crate::embed::topology::embedding_topology::{EmbeddingTopology, TopologyArc, jump_across};

/// An end of an arc: at its first node or at its second.
pub(in crate::embed) type HalfArc = (u32, bool);

/// Opposite ends at regular nodes.
#[derive(Debug, Clone)]
pub(in crate::embed) struct ThroughArcs {
    /// For each end of an arc (first, second) the next one counter-clockwise around the node.
    next: Vec<[Option<HalfArc>; 2]>,
    /// For each end of an arc the end that goes straight on.
    opposite: Vec<[Option<HalfArc>; 2]>,
    /// For each node whether it is held to its arcs.
    pub constrained: Vec<bool>,
}

/// A chain of triangles from corner to corner.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::embed) struct TriangleChain {
    pub start: HalfedgeId,
    pub crossed: Vec<HalfedgeId>,
    pub end: HalfedgeId,
    /// Direction of the first triangle's cross along which it runs.
    pub heading: u8,
}

impl ThroughArcs {
    /// The crossroads of a layout: regular nodes inside the surface that are not `pinned`. On the boundary a regular node
    /// holds nothing, for every isoline that ends there does so at a right angle.
    pub(in crate::embed) fn new(layout: &QuadLayout, pinned: impl Fn(usize) -> bool) -> Self {
        let mut next: Vec<[Option<HalfArc>; 2]> = vec![[None; 2]; layout.arcs.len()];
        for p in &layout.patches {
            for i in 0..4 {
                // Counter-clockwise at corner `i` comes after the side that leaves it the one that ends there.
                let (out, forward) = p.sides[i];
                let (into, came) = p.sides[(i + 3) % 4];
                next[out as usize][usize::from(!forward)] = Some((into, came));
            }
        }
        let constrained: Vec<bool> =
            layout.nodes.iter().enumerate().map(|(i, n)| !n.is_regular() || pinned(i)).collect();
        let straight = |a: usize, second: bool| {
            let node = layout.arcs[a].nodes[usize::from(second)] as usize;
            if constrained[node] || layout.nodes[node].boundary {
                return None;
            }
            let (b, e) = next[a][usize::from(second)]?;
            next[b as usize][usize::from(e)]
        };
        let opposite = (0..layout.arcs.len()).map(|a| [false, true].map(|e| straight(a, e))).collect();
        Self { next, opposite, constrained }
    }

    /// The chains that must be isolines, each once; a closed one ends at the corner it starts at.
    pub(in crate::embed) fn chains(&self, net: &EmbeddingTopology) -> Vec<TriangleChain> {
        let mut done = vec![false; net.arcs.len()];
        let mut chains = Vec::new();
        // From ends that do not go on first; what is left then are closed chains.
        let ends = (0..net.arcs.len() as u32).flat_map(|a| [(a, false), (a, true)]);
        let open = |&(a, e): &HalfArc| self.opposite[a as usize][usize::from(e)].is_none();
        for first in ends.clone().filter(open).chain(ends) {
            if done[first.0 as usize] || net.arcs[first.0 as usize].boundary {
                continue;
            }
            let (list, closed) = self.walk(first);
            for &(a, _) in &list {
                done[a as usize] = true;
            }
            let node = |(a, e): HalfArc| net.arcs[a as usize].nodes[usize::from(e)] as usize;
            let (Some(&head), Some(&tail)) = (list.first(), list.last()) else { continue };
            let far = (tail.0, !tail.1);
            if closed || (self.constrained[node(head)] && self.constrained[node(far)]) {
                chains.extend(join(net, &list).and_then(|mut c| {
                    if closed {
                        c.crossed.extend(around(&net.mesh, c.end, c.start)?);
                        c.end = c.start;
                    }
                    Some(c)
                }));
            }
        }
        chains
    }

    /// From an end of an arc straight on to the next node that holds; each arc by the end it is entered through.
    fn walk(&self, first: HalfArc) -> (Vec<HalfArc>, bool) {
        let mut list = vec![first];
        let mut at = first;
        while let Some(on) = self.opposite[at.0 as usize][usize::from(!at.1)] {
            if on == first || list.len() > 2 * self.opposite.len() {
                return (list, true);
            }
            list.push(on);
            at = on;
        }
        (list, false)
    }

    /// From the end of an arc straight on: the chains to all nodes on the way up to the first that is held, or until
    /// the way ends or closes.
    pub(in crate::embed) fn continuations(&self, net: &EmbeddingTopology, end: HalfArc) -> Vec<(TriangleChain, usize)> {
        let (list, _) = self.walk(end);
        let mut continuations: Vec<(TriangleChain, usize)> = Vec::new();
        for &at in &list {
            let next = match continuations.last() {
                None => Some(directed(net, at)),
                Some((before, _)) => extend(net, before.clone(), at),
            };
            let Some(chain) = next else { break };
            continuations.push((chain, net.arcs[at.0 as usize].nodes[usize::from(!at.1)] as usize));
        }
        continuations
    }

    /// An arc with what tells its length in the map: from a held node on the isoline across its first end to one on the
    /// isoline across its second. The heading is that of the arc. `None` if an isoline has no held node.
    pub(in crate::embed) fn length_chain(&self, net: &EmbeddingTopology, a: u32) -> Option<TriangleChain> {
        let mut list: Vec<HalfArc> = self.sideways(net, (a, false))?;
        list.reverse();
        for end in &mut list {
            end.1 = !end.1;
        }
        let before = join(net, &list);
        list.push((a, false));
        list.extend(self.sideways(net, (a, true))?);
        let whole = join(net, &list)?;
        let arc = &net.arcs[a as usize];
        let mut crossed: Vec<HalfedgeId> = Vec::new();
        if let Some(before) = before {
            crossed.extend(before.crossed);
            crossed.extend(around(&net.mesh, before.end, arc.start)?);
        }
        let turns: i32 = crossed.iter().map(|&h| jump_across(&net.mesh, &net.jump, h)).sum();
        Some(TriangleChain { heading: (i32::from(arc.heading) + turns).rem_euclid(4) as u8, ..whole })
    }

    /// From the node at an end of an arc across the arc to a held node: none if it is held itself.
    fn sideways(&self, net: &EmbeddingTopology, end: HalfArc) -> Option<Vec<HalfArc>> {
        let node = |(a, e): HalfArc| net.arcs[a as usize].nodes[usize::from(e)] as usize;
        if self.constrained[node(end)] {
            return Some(Vec::new());
        }
        let mut at = end;
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

    /// The corner of the end of an arc.
    pub(in crate::embed) fn corner(&self, net: &EmbeddingTopology, (a, second): HalfArc) -> HalfedgeId {
        let arc = &net.arcs[a as usize];
        if second { arc.end } else { arc.start }
    }

    /// Holds all nodes to their arcs.
    pub(in crate::embed) fn constrain_all(&mut self) {
        self.constrained.fill(true);
        self.opposite.fill([None; 2]);
    }
}

/// The arc from the end given to the other.
fn directed(net: &EmbeddingTopology, (a, second): HalfArc) -> TriangleChain {
    let TopologyArc { start, crossed, end, heading, .. } = &net.arcs[a as usize];
    if !second {
        return TriangleChain { start: *start, crossed: crossed.clone(), end: *end, heading: *heading };
    }
    // Seen from the last triangle the arc comes along its heading there, and goes back against it.
    let turns: i32 = crossed.iter().map(|&h| jump_across(&net.mesh, &net.jump, h)).sum();
    let back = crossed.iter().rev().filter_map(|&h| net.mesh.twin(h)).collect();
    TriangleChain {
        start: *end,
        crossed: back,
        end: *start,
        heading: (i32::from(*heading) - turns + 2).rem_euclid(4) as u8,
    }
}

/// The arcs given by the ends they are entered through, as one chain.
fn join(net: &EmbeddingTopology, list: &[HalfArc]) -> Option<TriangleChain> {
    let (&first, rest) = list.split_first()?;
    rest.iter().try_fold(directed(net, first), |chain, &at| extend(net, chain, at))
}

/// A chain and the arc that goes on from it.
fn extend(net: &EmbeddingTopology, mut chain: TriangleChain, at: HalfArc) -> Option<TriangleChain> {
    let part = directed(net, at);
    chain.crossed.extend(around(&net.mesh, chain.end, part.start)?);
    chain.crossed.extend(part.crossed);
    chain.end = part.end;
    Some(chain)
}

/// The half-edges crossed from the triangle of one corner to that of another at the same vertex, which is regular, so
/// that any way around will do.
pub(in crate::embed) fn around(mesh: &TriMesh, from: HalfedgeId, to: HalfedgeId) -> Option<Vec<HalfedgeId>> {
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
    SurfacePoint { face: crate::mesh::FaceId::new(h.index() / 3), weights }
}

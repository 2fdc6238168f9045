//! Moving a node of a net along an edge.
//!
//! The singularity goes with it: the period jump of the edge changes by the node's index, so that the vertex left
//! becomes regular (Campen, section 6.5.1). Arcs are dragged along. They all start to the left of the edge at its new
//! end and first turn counter-clockwise around the old one, to where they started before; clockwise would
//! be the same, the old vertex being regular now.
//!
//! Other arcs that cross the edge are pushed ahead by the node: they are led around the far side of its new vertex.
//!
//! A node on the boundary moves along it. There no jump changes, but the edge now belongs to the arc behind the node.

use crate::embed::topology::embedding_topology::{EmbeddingTopology, TopologyArc};
use crate::embed::topology::period_jumps;
use crate::mesh::{HalfedgeId, TriMesh, VertexId};

/// A way from a triangle at a vertex to the corner that an arc had there.
struct Fan {
    /// The corner at the node's new vertex, in the triangle the fan starts in.
    corner: HalfedgeId,
    /// The first half-edge to be crossed, or the outgoing one of the first triangle, by sense.
    first: HalfedgeId,
    counter_clockwise: bool,
}

impl Fan {
    /// The half-edges crossed on the way to the triangle of `to`.
    fn crossed(&self, mesh: &TriMesh, to: HalfedgeId) -> Vec<HalfedgeId> {
        let mut crossed = Vec::new();
        let mut at = self.first;
        while mesh.face(at) != mesh.face(to) {
            let across = if self.counter_clockwise { mesh.prev(at) } else { at };
            let Some(t) = mesh.twin(across) else { break };
            crossed.push(across);
            at = if self.counter_clockwise { t } else { mesh.next(t) };
        }
        crossed
    }
}

impl EmbeddingTopology {
    /// Moves a node along the edge of `h`, which leaves its vertex or, on the boundary, may also lead to it.
    pub(in crate::embed) fn move_node(&mut self, node: usize, h: HalfedgeId) {
        let from = self.nodes[node].vertex;
        let forward = self.mesh.origin(h) == from;
        let to = if forward { self.mesh.target(h) } else { self.mesh.origin(h) };
        let fan = if forward {
            Fan { corner: self.mesh.next(h), first: h, counter_clockwise: true }
        } else {
            Fan { corner: h, first: self.mesh.next(h), counter_clockwise: false }
        };
        if self.nodes[node].boundary {
            self.move_border(from, h, forward);
        } else {
            self.make_way(h);
            period_jumps::shift(&self.mesh, &mut self.jump, h, self.nodes[node].index());
        }
        let Self { mesh, jump, arcs, .. } = self;
        for arc in arcs {
            if arc.nodes[0] as usize == node && mesh.origin(arc.start) == from {
                drag_start(mesh, jump, arc, &fan);
            }
            if arc.nodes[1] as usize == node && mesh.origin(arc.end) == from {
                let mut back = fan.crossed(mesh, arc.end);
                back.reverse();
                arc.crossed.extend(back.iter().filter_map(|&h| mesh.twin(h)));
                arc.end = fan.corner;
            }
            cancel(mesh, &mut arc.crossed);
        }
        self.nodes[node].vertex = to;
    }

    /// Leads arcs that cross the edge around its target, which is regular: the node would push them there.
    fn make_way(&mut self, h: HalfedgeId) {
        let Self { mesh, arcs, .. } = self;
        let Some(twin) = mesh.twin(h) else { return };
        let fan = Fan { corner: h, first: mesh.next(h), counter_clockwise: false };
        let around = fan.crossed(mesh, twin);
        let back: Vec<HalfedgeId> = around.iter().rev().filter_map(|&g| mesh.twin(g)).collect();
        for arc in arcs {
            if !arc.crossed.iter().any(|&g| g == h || g == twin) {
                continue;
            }
            let lead = |&g: &HalfedgeId| match g {
                g if g == h => around.clone(),
                g if g == twin => back.clone(),
                g => vec![g],
            };
            arc.crossed = arc.crossed.iter().flat_map(lead).collect();
            cancel(mesh, &mut arc.crossed);
        }
    }

    /// Gives the boundary edge a node moves along to the arc behind it.
    fn move_border(&mut self, node: VertexId, h: HalfedgeId, forward: bool) {
        let mesh = &self.mesh;
        let after = mesh.vertex_halfedge(node);
        let before = mesh.incoming_boundary(node);
        // From the triangle before the node clockwise around it to the one after it.
        let fan = Fan { corner: before, first: mesh.next(before), counter_clockwise: false };
        let turns: i32 = fan.crossed(mesh, after).into_iter().map(|h| self.jump_across(h)).sum();
        let behind = if forward {
            self.boundary.get(&before).map(|&(k, arc)| (i32::from(k) - turns, arc))
        } else {
            self.boundary.get(&after).map(|&(k, arc)| (i32::from(k) + turns, arc))
        };
        if let Some((k, arc)) = behind {
            self.boundary.insert(h, (k.rem_euclid(4) as u8, arc));
        }
    }
}

fn drag_start(mesh: &TriMesh, jump: &[i32], arc: &mut TopologyArc, fan: &Fan) {
    let mut crossed = fan.crossed(mesh, arc.start);
    let turns: i32 =
        crossed.iter().map(|&h| crate::embed::topology::embedding_topology::jump_across(mesh, jump, h)).sum();
    crossed.append(&mut arc.crossed);
    arc.crossed = crossed;
    arc.start = fan.corner;
    arc.heading = (i32::from(arc.heading) + turns).rem_euclid(4) as u8;
}

/// Removes steps that are taken back at once.
fn cancel(mesh: &TriMesh, crossed: &mut Vec<HalfedgeId>) {
    let mut kept: Vec<HalfedgeId> = Vec::with_capacity(crossed.len());
    for &h in crossed.iter() {
        if kept.last().is_some_and(|&l| mesh.twin(l) == Some(h)) {
            kept.pop();
        } else {
            kept.push(h);
        }
    }
    *crossed = kept;
}

#[cfg(test)]
mod tests {
    use crate::embed::topology::testing::{indices, is_chain, net};
    use crate::mesh::HalfedgeId;

    #[test]
    fn a_node_takes_its_index_and_its_arcs_along() {
        let mut net = net();
        let before = indices(&net.mesh, &net.jump);
        for step in 0..40usize {
            let node = 0;
            let v = net.nodes[node].vertex;
            let spokes: Vec<HalfedgeId> = net.mesh.outgoing(v).collect();
            let h = spokes[(step * 7 + step / 3) % spokes.len()];
            let w = net.mesh.target(h);
            if net.nodes.iter().any(|n| n.vertex == w) {
                continue;
            }
            let old = indices(&net.mesh, &net.jump);
            net.move_node(node, h);
            let new = indices(&net.mesh, &net.jump);
            assert_eq!(new[w.index()], old[w.index()] + 1);
            assert_eq!(new[v.index()], old[v.index()] - 1);
            assert_eq!(new.iter().sum::<i32>(), before.iter().sum::<i32>());
            assert!((0..net.arcs.len()).all(|a| is_chain(&net, a)));
        }
    }

    #[test]
    fn there_and_back_changes_nothing() {
        let mut net = net();
        let before = net.clone();
        let h = net.mesh.outgoing(net.nodes[0].vertex).nth(2).unwrap();
        net.move_node(0, h);
        net.move_node(0, net.mesh.twin(h).unwrap());
        assert_eq!((&net.jump, &net.nodes), (&before.jump, &before.nodes));
        for (a, b) in net.arcs.iter().zip(&before.arcs) {
            // A chain may start in another triangle of the node; what it says of the end is the same.
            let end = |net: &crate::embed::EmbeddingTopology, arc: &crate::embed::TopologyArc| {
                let turns: i32 = arc.crossed.iter().map(|&h| net.jump_across(h)).sum();
                (i32::from(arc.heading) - turns).rem_euclid(4)
            };
            if net.mesh.face(a.end) == before.mesh.face(b.end) {
                assert_eq!(end(&net, a), end(&before, b));
            }
        }
    }
}

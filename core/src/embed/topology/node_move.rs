//! Moving a node along an edge of the mesh (Campen, section 6.5.1).
//!
//! The singularity moves with the node: the period jump of the edge changes by the node's index, so that the old vertex
//! becomes regular. All arcs of the node now start in the triangle to the left of the edge, turn counter-clockwise
//! around the old vertex, and go on from where they started before. Turning clockwise would be homotopic, for the old
//! vertex is regular.
//!
//! Other arcs that cross the edge keep their side of the node: they are rerouted around its new vertex on the far side.
//!
//! A node on the boundary moves along it. No jump changes; the edge passes to the boundary arc behind the node.

use crate::embed::topology::embedding_topology::{EmbeddingTopology, TopologyArc};
use crate::embed::topology::period_jumps::{move_index, turns_along};
use crate::mesh::{HalfedgeId, TriMesh, VertexId};

/// A sequence of triangles around the vertex that a node leaves.
struct Fan {
    /// The corner at the node's new vertex in the first triangle.
    corner: HalfedgeId,
    /// The corner at the old vertex in the first triangle.
    first: HalfedgeId,
    counter_clockwise: bool,
}

impl Fan {
    /// The half-edges crossed from the first triangle to that of `to`.
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
    /// Moves a node along the edge of `h` to its other end, which must not be a node. `h` starts at the node's vertex;
    /// on the boundary, where an edge has one half-edge only, it may also end there.
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
            self.extend_boundary_arc(from, h, forward);
        } else {
            self.reroute_arcs_across(h);
            move_index(&self.mesh, &mut self.jump, h, self.nodes[node].index());
        }
        let Self { mesh, jump, arcs, .. } = self;
        for arc in arcs {
            if arc.nodes[0] as usize == node && mesh.origin(arc.start) == from {
                prepend_fan(mesh, jump, arc, &fan);
            }
            if arc.nodes[1] as usize == node && mesh.origin(arc.end) == from {
                let mut back = fan.crossed(mesh, arc.end);
                back.reverse();
                arc.crossed.extend(back.iter().filter_map(|&h| mesh.twin(h)));
                arc.end = fan.corner;
            }
            cancel_backtracking(mesh, &mut arc.crossed);
        }
        self.nodes[node].vertex = to;
    }

    /// Reroutes the arcs that cross `h` around its target, which is a regular vertex.
    fn reroute_arcs_across(&mut self, h: HalfedgeId) {
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
            cancel_backtracking(mesh, &mut arc.crossed);
        }
    }

    /// Assigns the boundary edge that a node moves along to the arc behind it.
    fn extend_boundary_arc(&mut self, node: VertexId, h: HalfedgeId, forward: bool) {
        let mesh = &self.mesh;
        let after = mesh.vertex_halfedge(node);
        let before = mesh.incoming_boundary(node);
        // Clockwise around the node, from the triangle of the boundary edge before it to that of the edge after it.
        let fan = Fan { corner: before, first: mesh.next(before), counter_clockwise: false };
        let turns = self.turns_along(&fan.crossed(mesh, after));
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

/// Lets an arc start at the corner of the fan and run through the fan to its former start.
fn prepend_fan(mesh: &TriMesh, jump: &[i32], arc: &mut TopologyArc, fan: &Fan) {
    let mut crossed = fan.crossed(mesh, arc.start);
    let turns = turns_along(mesh, jump, &crossed);
    crossed.append(&mut arc.crossed);
    arc.crossed = crossed;
    arc.start = fan.corner;
    arc.heading = (i32::from(arc.heading) + turns).rem_euclid(4) as u8;
}

/// Removes pairs of crossings of which the second takes back the first.
fn cancel_backtracking(mesh: &TriMesh, crossed: &mut Vec<HalfedgeId>) {
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
    use proptest::prelude::*;

    use crate::embed::topology::embedding_topology::{EmbeddingTopology, TopologyArc, node_indices};
    use crate::embed::topology::testing::{indices, is_chain, sample_topology, torus_topology};
    use crate::mesh::HalfedgeId;

    /// Moves a node along one of the half-edges that leave it, unless another node is at the other end.
    fn try_move(topology: &mut EmbeddingTopology, node: usize, choice: usize) {
        let spokes: Vec<HalfedgeId> = topology.mesh.outgoing(topology.nodes[node].vertex).collect();
        let h = spokes[choice % spokes.len()];
        let target = topology.mesh.target(h);
        if topology.nodes.iter().all(|n| n.vertex != target) {
            topology.move_node(node, h);
        }
    }

    #[test]
    fn moving_a_node_moves_its_index_and_keeps_arcs_chains() {
        let mut topology = sample_topology();
        for step in 0..40usize {
            try_move(&mut topology, 0, step * 7 + step / 3);
            assert_eq!(indices(&topology.mesh, &topology.jump), node_indices(&topology.mesh, &topology.nodes));
            assert!((0..topology.arcs.len()).all(|a| is_chain(&topology, a)));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]

        #[test]
        fn random_moves_keep_every_vertex_index_and_chain(
            cells in [6u32..14, 6u32..14],
            gaps in [2u32..4, 2u32..4],
            moves in prop::collection::vec((0usize..4, 0usize..64), 1..24),
        ) {
            let mut topology = torus_topology(cells, [1, 1 + gaps[1]], [0, gaps[0]]);
            for (node, choice) in moves {
                try_move(&mut topology, node, choice);
                let index = indices(&topology.mesh, &topology.jump);
                prop_assert_eq!(index.iter().sum::<i32>(), 0, "Poincaré–Hopf on a torus");
                prop_assert_eq!(index, node_indices(&topology.mesh, &topology.nodes));
                prop_assert!((0..topology.arcs.len()).all(|a| is_chain(&topology, a)));
            }
        }
    }

    #[test]
    fn moving_a_node_back_restores_jumps_and_headings() {
        let mut topology = sample_topology();
        let before = topology.clone();
        let h = topology.mesh.outgoing(topology.nodes[0].vertex).nth(2).unwrap();
        topology.move_node(0, h);
        topology.move_node(0, topology.mesh.twin(h).unwrap());
        assert_eq!((&topology.jump, &topology.nodes), (&before.jump, &before.nodes));
        for (a, b) in topology.arcs.iter().zip(&before.arcs) {
            // A chain may start in another triangle of the node; its heading in the last triangle is the same.
            let last_heading = |t: &EmbeddingTopology, arc: &TopologyArc| {
                (i32::from(arc.heading) - t.turns_along(&arc.crossed)).rem_euclid(4)
            };
            if topology.mesh.face(a.end) == before.mesh.face(b.end) {
                assert_eq!(last_heading(&topology, a), last_heading(&before, b));
            }
        }
    }
}

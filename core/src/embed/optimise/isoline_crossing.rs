//! Where regular nodes belong: at the crossing of their two isolines.
//!
//! The map tells on which isolines the irregular nodes at both ends of a regular node's chains lie. By how much its own
//! coordinates miss these is a step in the map, and the map's gradients turn it into a step on the surface. On a chain
//! without irregular nodes all nodes come to the mean of their isolines.

use glam::DVec2;

use crate::embed::parameterise::chord_lengths::transition;
use crate::embed::topology::embedding_topology::{EmbeddingTopology, jump_across};
use crate::embed::topology::through_arcs::{ThroughArcs, around};
use crate::mesh::HalfedgeId;
use crate::param::SeamlessMap;
use crate::surface::Metric;

/// The step, as a vector in the plane of the layout of the triangle of the half-edge returned, that brings a regular
/// node to the crossing of its isolines; `None` where the map does not tell.
pub(in crate::embed) fn step_to_crossing(
    net: &EmbeddingTopology,
    through_arcs: &ThroughArcs,
    metric: &Metric,
    map: &SeamlessMap,
    ends: &[(u32, bool)],
) -> Option<(HalfedgeId, DVec2)> {
    let (corner, crossing) = crossing(net, through_arcs, map, ends)?;
    let off = crossing - at(map, corner);
    let [u, v] = map.gradients(metric, net.mesh.face(corner));
    let area = u.perp_dot(v);
    // Where the map is folded or flat its gradients tell nothing.
    (area > FLAT * 0.5 * (u.length_squared() + v.length_squared()))
        .then(|| (corner, (off.y * u.perp() - off.x * v.perp()) / area))
}

/// The crossing of the isolines of a regular node, in the coordinates of the triangle of the half-edge returned, a corner
/// at the node; `None` where the map does not tell.
pub(in crate::embed) fn crossing(
    net: &EmbeddingTopology,
    through_arcs: &ThroughArcs,
    map: &SeamlessMap,
    ends: &[(u32, bool)],
) -> Option<(HalfedgeId, DVec2)> {
    let mesh = &net.mesh;
    let corner = through_arcs.corner(net, *ends.first()?);
    // For each coordinate what a held node says, the one by the shortest chain, and the sum of what others say.
    let mut held: [Option<(usize, f64)>; 2] = [None; 2];
    let mut others = [(0.0, 1.0); 2];
    for &end in ends {
        for (chain, node) in through_arcs.continuations(net, end) {
            let mut crossed = around(mesh, corner, chain.start)?;
            let turns: i32 = crossed.iter().map(|&h| jump_across(mesh, &net.jump, h)).sum();
            let heading = (i32::from(chain.heading) + turns).rem_euclid(4);
            crossed.extend(&chain.crossed);
            let there = transition(mesh, map, &crossed)?.inverse().apply(at(map, chain.end));
            let axis = if heading % 2 == 0 { 1 } else { 0 };
            let off = (there - at(map, corner))[axis];
            if !through_arcs.constrained[node] {
                others[axis] = (others[axis].0 + off, others[axis].1 + 1.0);
            } else if held[axis].is_none_or(|(n, _)| crossed.len() < n) {
                held[axis] = Some((crossed.len(), off));
            }
        }
    }
    let off = [0, 1].map(|axis| held[axis].map_or(others[axis].0 / others[axis].1, |m| m.1));
    Some((corner, at(map, corner) + DVec2::from_array(off)))
}

/// How much less area than a square of its size a map's image may have before it is too flat to follow.
const FLAT: f64 = 0.05;

fn at(map: &SeamlessMap, corner: HalfedgeId) -> DVec2 {
    map.uv[corner.index() / 3][corner.index() % 3]
}

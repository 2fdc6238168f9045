//! The crossing of the two isolines of a regular node, and the step there.
//!
//! The through-arcs of a regular node lead to constrained nodes, whose coordinates determine its two isolines. The
//! differences to its own coordinates are a step in the map; the gradients of the map turn it into a step on the
//! surface. On a through-arc without constrained nodes all nodes take the mean of their coordinates.

use std::collections::HashMap;

use glam::DVec2;

use crate::embed::parameterise::chord_lengths::transition;
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::{HalfArc, ThroughArcs, fan_crossings};
use crate::mesh::{BreadthFirst, FaceId, HalfedgeId};
use crate::param::SeamlessMap;
use crate::surface::Metric;

/// Ratio of the Jacobian determinant of a map to half the sum of its squared gradients, 1 for similarities, up to which
/// the map is too flat to be inverted. Chosen by hand.
const FLAT: f64 = 0.05;
/// Largest number of triangles between a node and its crossing or its feature. Chosen by hand.
const MAX_RINGS: u32 = 24;

/// The step from a regular node with the given half-arcs to the crossing of its isolines, as a vector in the plane of
/// the triangle of the returned corner; `None` where the map does not determine it.
pub(super) fn step_to_crossing(
    topology: &EmbeddingTopology,
    through_arcs: &ThroughArcs,
    metric: &Metric,
    map: &SeamlessMap,
    half_arcs: &[HalfArc],
) -> Option<(HalfedgeId, DVec2)> {
    let (corner, crossing) = crossing(topology, through_arcs, map, half_arcs)?;
    let off = crossing - at(map, corner);
    let [u, v] = map.gradients(metric, topology.mesh.face(corner));
    let area = u.perp_dot(v);
    // A flipped or flat map cannot be inverted.
    (area > FLAT * 0.5 * (u.length_squared() + v.length_squared()))
        .then(|| (corner, (off.y * u.perp() - off.x * v.perp()) / area))
}

/// The coordinates of the crossing of the isolines of a regular node, in the chart of the triangle of the returned
/// corner; `None` where the map does not determine it.
pub(super) fn crossing(
    topology: &EmbeddingTopology,
    through_arcs: &ThroughArcs,
    map: &SeamlessMap,
    half_arcs: &[HalfArc],
) -> Option<(HalfedgeId, DVec2)> {
    let mesh = &topology.mesh;
    let corner = through_arcs.corner(topology, *half_arcs.first()?);
    // For each coordinate the difference to the constrained node at the end of the shortest chain, with its length; and
    // the sum of the differences to unconstrained nodes, with their number and the node itself.
    let mut constrained: [Option<(usize, f64)>; 2] = [None; 2];
    let mut free = [(0.0, 1.0); 2];
    for &end in half_arcs {
        for (chain, node) in through_arcs.continuations(topology, end) {
            let mut crossed = fan_crossings(mesh, corner, chain.start)?;
            let turns = topology.turns_along(&crossed);
            let heading = (i32::from(chain.heading) + turns).rem_euclid(4);
            crossed.extend(&chain.crossed);
            let there = transition(mesh, map, &crossed)?.inverse().apply(at(map, chain.end));
            let axis = if heading % 2 == 0 { 1 } else { 0 };
            let off = (there - at(map, corner))[axis];
            if !through_arcs.constrained[node] {
                free[axis] = (free[axis].0 + off, free[axis].1 + 1.0);
            } else if constrained[axis].is_none_or(|(n, _)| crossed.len() < n) {
                constrained[axis] = Some((crossed.len(), off));
            }
        }
    }
    let off = [0, 1].map(|axis| constrained[axis].map_or(free[axis].0 / free[axis].1, |m| m.1));
    Some((corner, at(map, corner) + DVec2::from_array(off)))
}

/// The coordinates of a corner.
fn at(map: &SeamlessMap, corner: HalfedgeId) -> DVec2 {
    map.uv[corner.index() / 3][corner.index() % 3]
}

/// Breadth-first search over triangles for a point of the map. It starts from triangles given with the coordinates of
/// the point in their charts; every triangle is shown to `found` with the point in its own chart. Returned are the
/// result of `found` and the triangles from there back to the start.
pub(super) fn search_outward<T>(
    topology: &EmbeddingTopology,
    map: &SeamlessMap,
    first: impl IntoIterator<Item = (FaceId, DVec2)>,
    mut found: impl FnMut(FaceId, DVec2) -> Option<T>,
) -> Option<(T, Vec<FaceId>)> {
    let mesh = &topology.mesh;
    let mut search = BreadthFirst::sparse();
    let mut point: HashMap<FaceId, DVec2> = HashMap::new();
    for (f, at) in first {
        search.start(f);
        point.insert(f, at);
    }
    while let Some(f) = search.visit() {
        let at = point[&f];
        if let Some(found) = found(f, at) {
            return Some((found, std::iter::successors(Some(f), |&f| search.via(f)).collect()));
        }
        let within = search.depth(f).is_some_and(|rings| rings < MAX_RINGS);
        for (h, g) in mesh.adjacent_faces(f).filter(|_| within) {
            let Some(change) = map.transition(mesh, h) else { continue };
            if search.reach(g, f) {
                point.insert(g, change.apply(at));
            }
        }
    }
    None
}

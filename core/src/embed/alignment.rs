//! What is to be an isoline of the map: arcs, the boundary, features (Campen, sections 6.4.1 and 6.5.2).
//!
//! Arcs are isolines from node to node, whatever way they take between. Boundary and features are isolines edge by edge.
//! The layout tells which coordinate stays constant along an arc and along the boundary; along a feature it is the one
//! whose isolines the field runs along it. A feature that the field crosses at a slant contradicts the layout: there it is
//! left alone rather than torn.

use std::f64::consts::FRAC_PI_2;

use super::net::{Net, jump_across};
use super::straight::{Crossroads, corner};
use crate::field::Metric;
use crate::mesh::{EdgeId, HalfedgeId};
use crate::param::Relation;

/// Largest angle, in quarter turns, between a feature and the field along it: half of what would make it ambiguous.
const SLANT: f64 = 0.25;

/// What the layout demands to be isolines.
pub(super) fn demanded(net: &Net, roads: &Crossroads) -> Vec<Relation> {
    let chain = |c: super::straight::Chain| Relation {
        from: corner(c.start),
        crossed: c.crossed,
        to: corner(c.end),
        axis: across(i32::from(c.heading)),
        difference: 0.0,
    };
    let mut relations: Vec<Relation> = roads.chains(net).into_iter().map(chain).collect();
    let border = net.mesh.edges().map(|e| net.mesh.halfedge(e));
    let bordering = border.filter_map(|h| net.boundary.get(&h).map(|&(k, _)| on_edge(net, (h, across(i32::from(k))))));
    relations.extend(bordering);
    relations
}

/// That an edge is an isoline of a coordinate.
pub(super) fn on_edge(net: &Net, (h, axis): (HalfedgeId, u8)) -> Relation {
    Relation { from: corner(h), crossed: Vec::new(), to: corner(net.mesh.next(h)), axis, difference: 0.0 }
}

/// The coordinate that is constant along a heading.
fn across(heading: i32) -> u8 {
    if heading % 2 == 0 { 1 } else { 0 }
}

/// The half-edges of features that can be isolines where the field has these angles, and of which coordinate; those first
/// that the field follows best.
pub(super) fn features(net: &Net, metric: &Metric, angle: &[f64], sharp: &[bool]) -> Vec<(HalfedgeId, u8)> {
    let mesh = &net.mesh;
    let mut found: Vec<Option<(i32, f64)>> = vec![None; mesh.n_edges()];
    for e in mesh.edges().filter(|&e| sharp[e.index()] && !mesh.is_boundary_edge(e)) {
        let h = mesh.halfedge(e);
        let turns = (metric.direction(h) - angle[mesh.face(h).index()]) / FRAC_PI_2;
        let off = (turns - turns.round()).abs();
        if off < SLANT {
            found[e.index()] = Some(((turns.round() as i32).rem_euclid(4), off));
        }
    }
    for f in mesh.faces() {
        // Two sides of a triangle on one isoline would flatten it: the one that fits less gives way.
        let sides = mesh.face_halfedges(f);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (mesh.edge(sides[i]), mesh.edge(sides[j]));
            let axis = |k: usize| heading_in(net, sides[k], found[mesh.edge(sides[k]).index()]?.0).map(across);
            if let (Some(p), Some(q)) = (axis(i), axis(j))
                && p == q
            {
                let off = |e: EdgeId| found[e.index()].map_or(0.0, |x| x.1);
                let worse = if off(a) > off(b) { a } else { b };
                found[worse.index()] = None;
            }
        }
    }
    let mut list: Vec<(f64, HalfedgeId, i32)> =
        mesh.edges().filter_map(|e| found[e.index()].map(|(k, off)| (off, mesh.halfedge(e), k))).collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    list.into_iter().map(|(_, h, k)| (h, across(k))).collect()
}

/// The heading along a side in its own triangle, from that of its edge's half-edge in that one's triangle.
fn heading_in(net: &Net, side: HalfedgeId, heading: i32) -> Option<i32> {
    let h = net.mesh.halfedge(net.mesh.edge(side));
    if h == side {
        return Some(heading);
    }
    // Only whether it is even matters here, and against the half-edge that is the same.
    Some((heading - jump_across(&net.mesh, &net.jump, h)).rem_euclid(4))
}

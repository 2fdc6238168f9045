//! What is to be an isoline of the map: arcs, the boundary, features (Campen, sections 6.4.1 and 6.5.2).
//!
//! Arcs are isolines from node to node, whatever way they take between. Boundary and features are isolines edge by edge.
//! The layout tells which coordinate stays constant along an arc and along the boundary; along a feature it is the one
//! whose isolines the field runs along it. A feature that the field crosses at a slant contradicts the layout: there it is
//! left alone rather than torn.

use crate::embed::parameterise::feature_axes::{self, Headed, heading_in};
use crate::embed::topology::embedding_topology::EmbeddingTopology;
use crate::embed::topology::through_arcs::{ThroughArcs, corner_point};
use crate::mesh::HalfedgeId;
use crate::param::CoordinateConstraint;
use crate::surface::Metric;

/// What the layout demands to be isolines.
pub(in crate::embed) fn demanded(net: &EmbeddingTopology, through_arcs: &ThroughArcs) -> Vec<CoordinateConstraint> {
    let chain = |c: crate::embed::topology::through_arcs::TriangleChain| CoordinateConstraint {
        from: corner_point(c.start),
        crossed: c.crossed,
        to: corner_point(c.end),
        axis: across(i32::from(c.heading)),
        difference: 0.0,
    };
    let mut relations: Vec<CoordinateConstraint> = through_arcs.chains(net).into_iter().map(chain).collect();
    let border = net.mesh.edges().map(|e| net.mesh.halfedge(e));
    let bordering = border.filter_map(|h| net.boundary.get(&h).map(|&(k, _)| on_edge(net, (h, across(i32::from(k))))));
    relations.extend(bordering);
    relations
}

/// That an edge is an isoline of a coordinate.
pub(in crate::embed) fn on_edge(net: &EmbeddingTopology, (h, axis): (HalfedgeId, u8)) -> CoordinateConstraint {
    CoordinateConstraint {
        from: corner_point(h),
        crossed: Vec::new(),
        to: corner_point(net.mesh.next(h)),
        axis,
        difference: 0.0,
    }
}

/// The coordinate that is constant along a heading.
fn across(heading: i32) -> u8 {
    if heading % 2 == 0 { 1 } else { 0 }
}

/// Largest angle, in quarter turns, between an edge of a feature and the field along it where the field decides: half of
/// what would make it ambiguous.
pub(in crate::embed) const SLANT: f64 = 0.25;
/// As much as there is: the whole line decides.
pub(in crate::embed) const WHOLE: f64 = 4.0;

/// The half-edges of features that can be isolines where the field has these angles, and of which coordinate; those first
/// that the field follows best. Left out are those that deviate by more than `slant` quarter turns from the field.
pub(in crate::embed) fn features(
    net: &EmbeddingTopology,
    metric: &Metric,
    angle: &[f64],
    sharp: &[bool],
    slant: f64,
) -> Vec<(HalfedgeId, u8)> {
    let mesh = &net.mesh;
    let mut found: Vec<Option<Headed>> = vec![None; mesh.n_edges()];
    for headed in feature_axes::arc_headings(net, metric, angle, sharp).into_iter().filter(|h| h.off < slant) {
        found[mesh.edge(headed.halfedge).index()] = Some(headed);
    }
    for f in mesh.faces() {
        // Two sides of a triangle on one isoline would flatten it: the one that fits less gives way.
        let sides = mesh.face_halfedges(f);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let of = |k: usize| found[mesh.edge(sides[k]).index()];
            let axis = |k: usize| of(k).map(|headed| across(heading_in(net, sides[k], &headed)));
            if let (Some(a), Some(b)) = (of(i), of(j))
                && axis(i) == axis(j)
            {
                let worse = if a.off > b.off { a } else { b };
                found[mesh.edge(worse.halfedge).index()] = None;
            }
        }
    }
    let mut list: Vec<Headed> = found.into_iter().flatten().collect();
    list.sort_by(|a, b| a.off.total_cmp(&b.off).then(a.halfedge.cmp(&b.halfedge)));
    list.into_iter().map(|headed| (headed.halfedge, across(headed.heading))).collect()
}

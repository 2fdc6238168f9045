//! The alignment cost `q` of a direction (Campen, sections 8.1.3 and 8.1.7).
//!
//! On a smooth part of the surface, with principal directions `d_min`, `d_max` and curvatures κ₁, κ₂:
//! `q(t) = (|κ₁| − |κ₂|)² dev(t)` and `dev(t) = 1 / max(|⟨t, d_min⟩|, |⟨t, d_max⟩|) − 1`. At a sharp edge the deviation is
//! `1 / sin θ − 1`, θ being the angle to the edge: crossing at a right angle costs nothing.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::options::ElasticaOptions;
use super::unfold::{EdgeCrossing, UnfoldedGeodesic, direction_in_face};
use crate::mesh::{EdgeId, TriMesh, VertexId};
use crate::surface::PrincipalCurvature;

/// Upper bound of the alignment cost of a geodesic per unit length, so that sums stay finite where triangles are
/// degenerate. Ordinary surfaces of model size 1 stay below 2000.
const MAX_ALIGNMENT: f64 = 1e6;

/// The alignment cost on a mesh.
pub(super) struct AlignmentCost<'a> {
    mesh: &'a TriMesh,
    curvature: &'a [PrincipalCurvature],
    /// Per edge: whether it is sharp, so that curves should cross it at a right angle.
    sharp: Vec<bool>,
    /// Per vertex: whether it is an end of a sharp edge.
    at_sharp_edge: Vec<bool>,
    options: &'a ElasticaOptions,
}

impl<'a> AlignmentCost<'a> {
    pub(super) fn new(
        mesh: &'a TriMesh,
        curvature: &'a [PrincipalCurvature],
        sharp: &[bool],
        options: &'a ElasticaOptions,
    ) -> Self {
        let is_sharp = |e: EdgeId| sharp[e.index()] || (options.aligned_boundary && mesh.is_boundary_edge(e));
        let sharp: Vec<bool> = mesh.edges().map(is_sharp).collect();
        let mut at_sharp_edge = vec![false; mesh.n_vertices()];
        for e in mesh.edges().filter(|e| sharp[e.index()]) {
            for v in mesh.edge_vertices(e) {
                at_sharp_edge[v.index()] = true;
            }
        }
        Self { mesh, curvature, sharp, at_sharp_edge, options }
    }

    /// Alignment cost `q` of the unit direction `t` at `v`.
    fn at_vertex(&self, v: VertexId, t: DVec3) -> f64 {
        if self.at_sharp_edge[v.index()] {
            return self.at_feature(self.crossing_sine(v, t));
        }
        let c = &self.curvature[v.index()];
        let (x, y) = (t.dot(c.d_min), t.dot(c.d_max));
        let longer = x.abs().max(y.abs());
        let deviation = if longer > 0.0 { x.hypot(y) / longer - 1.0 } else { 0.0 };
        deviation * (c.k_min.abs() - c.k_max.abs()).powi(2)
    }

    /// Sine of the angle from `t` to the sharp edges at `v`: zero along them, one at a right angle. Between the two nearest
    /// sharp edges the angle is scaled so that the bisector counts as a right angle, also where they form a corner.
    fn crossing_sine(&self, v: VertexId, t: DVec3) -> f64 {
        let (mut nearest, mut second) = (PI, PI);
        for s in self.sharp_directions(v) {
            let angle = s.cross(t).length().atan2(s.dot(t));
            (nearest, second) = (nearest.min(angle), second.min(angle.max(nearest)));
        }
        let sum = nearest + second;
        if sum > 0.0 { (PI * nearest / sum).min(FRAC_PI_2).sin() } else { 0.0 }
    }

    /// Cost of crossing a sharp edge at an angle of the given sine.
    fn at_feature(&self, sine: f64) -> f64 {
        let cap = self.options.feature_cap;
        let deviation = if sine * (1.0 + cap) > 1.0 { 1.0 / sine - 1.0 } else { cap };
        self.options.feature_weight * deviation
    }

    /// Unit vectors from `v` along its sharp edges.
    fn sharp_directions(&self, v: VertexId) -> impl Iterator<Item = DVec3> + '_ {
        let mesh = self.mesh;
        let last = mesh.outgoing(v).map(move |h| mesh.prev(h)).find(move |&h| mesh.twin(h).is_none());
        let spokes = mesh.outgoing(v).map(move |h| (h, mesh.vector(h)));
        spokes
            .chain(last.map(|h| (h, -mesh.vector(h))))
            .filter(|(h, _)| self.sharp[mesh.edge(*h).index()])
            .map(|(_, vector)| vector.normalize_or_zero())
    }

    /// Alignment cost of a geodesic from `v`, per unit length: the mean of the costs at its ends, plus the largest cost of a
    /// sharp edge that it crosses.
    pub(super) fn of_geodesic(&self, v: VertexId, g: &UnfoldedGeodesic, crossings: &[EdgeCrossing]) -> f64 {
        let departure = direction_in_face(self.mesh, g.start, g.start_angle());
        let arrival = direction_in_face(self.mesh, g.end, g.end_angle());
        let ends = 0.5 * (self.at_vertex(v, departure) + self.at_vertex(g.target, arrival));
        let crossed = crossings
            .iter()
            .filter(|c| self.sharp[self.mesh.edge(c.halfedge).index()])
            .map(|c| self.at_feature(c.angle.sin().abs()))
            .fold(0.0, f64::max);
        (ends + crossed).min(MAX_ALIGNMENT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::square;

    fn curvature(k_min: f64, k_max: f64, n: usize) -> Vec<PrincipalCurvature> {
        vec![PrincipalCurvature { k_min, k_max, d_min: DVec3::X, d_max: DVec3::Y }; n]
    }

    #[test]
    fn the_cost_is_zero_along_principal_directions_and_largest_between_them() {
        let mesh = square(4);
        let options = ElasticaOptions { aligned_boundary: false, ..ElasticaOptions::default() };
        let curvature = curvature(-1.0, 3.0, mesh.n_vertices());
        let cost = AlignmentCost::new(&mesh, &curvature, &vec![false; mesh.n_edges()], &options);
        let v = VertexId(12);
        assert_eq!([DVec3::X, -DVec3::X, DVec3::Y].map(|t| cost.at_vertex(v, t)), [0.0; 3]);
        let diagonal = cost.at_vertex(v, (DVec3::X + DVec3::Y).normalize());
        assert!((diagonal - (2f64.sqrt() - 1.0) * 4.0).abs() < 1e-12, "{diagonal}");
        assert!(cost.at_vertex(v, DVec3::new(0.8, 0.6, 0.0)) < diagonal);
    }

    #[test]
    fn curvatures_of_equal_size_have_no_preferred_direction() {
        let mesh = square(4);
        let curvature = curvature(-2.0, 2.0, mesh.n_vertices());
        let options = ElasticaOptions::default();
        let cost = AlignmentCost::new(&mesh, &curvature, &vec![false; mesh.n_edges()], &options);
        assert_eq!(cost.at_vertex(VertexId(12), DVec3::new(0.8, 0.6, 0.0)), 0.0);
    }

    #[test]
    fn boundaries_are_crossed_at_a_right_angle_if_aligned() {
        let mesh = square(4);
        let curvature = curvature(0.0, 0.0, mesh.n_vertices());
        let (sharp, v) = (vec![false; mesh.n_edges()], VertexId(2));
        let mut options = ElasticaOptions::default();
        let aligned = AlignmentCost::new(&mesh, &curvature, &sharp, &options);
        assert!(aligned.at_vertex(v, DVec3::Y).abs() < 1e-9);
        let along = aligned.at_vertex(v, DVec3::X);
        assert_eq!(along, options.feature_weight * options.feature_cap);
        let oblique = aligned.at_vertex(v, DVec3::new(0.5, 0.75f64.sqrt(), 0.0));
        assert!(oblique > 0.0 && oblique < along);
        options.aligned_boundary = false;
        assert_eq!(AlignmentCost::new(&mesh, &curvature, &sharp, &options).at_vertex(v, DVec3::X), 0.0);
    }
}

//! What it costs a curve to run in a direction: deviation from the principal directions, and from crossing creases
//! at a right angle (Campen, chapter 8).

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;

use super::graph::ElasticaOptions;
use super::unfold::{EdgeCrossing, Geodesic, direction_in_face};
use crate::mesh::{EdgeId, TriMesh, VertexId};
use crate::surface::PrincipalCurvature;

/// Largest alignment cost of one geodesic, so that degenerate triangles cannot overflow the sums. Ordinary surfaces
/// of diagonal 1 stay below 2000.
const MAX_ALIGNMENT: f64 = 1e6;

/// Alignment cost of directions: deviation times anisotropy, and creases apart.
pub(super) struct Weights<'a> {
    mesh: &'a TriMesh,
    curvature: &'a [PrincipalCurvature],
    /// Per edge: whether curves should cross it at a right angle.
    crease: Vec<bool>,
    /// Per vertex: whether a crease ends or passes there.
    on_crease: Vec<bool>,
    options: &'a ElasticaOptions,
}

impl<'a> Weights<'a> {
    pub(super) fn new(
        mesh: &'a TriMesh,
        curvature: &'a [PrincipalCurvature],
        sharp: &[bool],
        options: &'a ElasticaOptions,
    ) -> Self {
        let is_crease = |e: EdgeId| sharp[e.index()] || (options.aligned_boundary && mesh.is_boundary_edge(e));
        let crease: Vec<bool> = mesh.edges().map(is_crease).collect();
        let mut on_crease = vec![false; mesh.n_vertices()];
        for e in mesh.edges().filter(|e| crease[e.index()]) {
            for v in mesh.edge_vertices(e) {
                on_crease[v.index()] = true;
            }
        }
        Self { mesh, curvature, crease, on_crease, options }
    }

    /// Alignment cost of leaving `v` in the unit direction `t`.
    fn at_vertex(&self, v: VertexId, t: DVec3) -> f64 {
        if self.on_crease[v.index()] {
            return self.feature(self.crossing_sine(v, t));
        }
        let c = &self.curvature[v.index()];
        let (x, y) = (t.dot(c.d_min), t.dot(c.d_max));
        let longer = x.abs().max(y.abs());
        let deviation = if longer > 0.0 { x.hypot(y) / longer - 1.0 } else { 0.0 };
        deviation * (c.k_min.abs() - c.k_max.abs()).powi(2)
    }

    /// Sine of the angle at which `t` leaves the creases at `v`: zero along them, one across. At a corner halfway
    /// between two creases is as good as across.
    fn crossing_sine(&self, v: VertexId, t: DVec3) -> f64 {
        let (mut nearest, mut second) = (PI, PI);
        for s in self.crease_directions(v) {
            let angle = s.cross(t).length().atan2(s.dot(t));
            (nearest, second) = (nearest.min(angle), second.min(angle.max(nearest)));
        }
        let sum = nearest + second;
        if sum > 0.0 { (PI * nearest / sum).min(FRAC_PI_2).sin() } else { 0.0 }
    }

    /// Cost of meeting a crease at an angle of the given sine.
    fn feature(&self, sine: f64) -> f64 {
        let cap = self.options.feature_cap;
        let deviation = if sine * (1.0 + cap) > 1.0 { 1.0 / sine - 1.0 } else { cap };
        self.options.feature_weight * deviation
    }

    /// Unit vectors from `v` along its creases.
    fn crease_directions(&self, v: VertexId) -> impl Iterator<Item = DVec3> + '_ {
        let mesh = self.mesh;
        let last = mesh.outgoing(v).map(move |h| mesh.prev(h)).find(move |&h| mesh.twin(h).is_none());
        let spokes = mesh.outgoing(v).map(move |h| (h, mesh.vector(h)));
        spokes
            .chain(last.map(|h| (h, -mesh.vector(h))))
            .filter(|(h, _)| self.crease[mesh.edge(*h).index()])
            .map(|(_, vector)| vector.normalize_or_zero())
    }

    /// Alignment cost of a geodesic: the mean of its ends, and what the creases it crosses on its way add.
    pub(super) fn of_geodesic(&self, v: VertexId, g: &Geodesic, crossings: &[EdgeCrossing]) -> f64 {
        let departure = direction_in_face(self.mesh, g.start, g.start_angle());
        let arrival = direction_in_face(self.mesh, g.end, g.end_angle());
        let ends = 0.5 * (self.at_vertex(v, departure) + self.at_vertex(g.target, arrival));
        let crossed = crossings
            .iter()
            .filter(|c| self.crease[self.mesh.edge(c.halfedge).index()])
            .map(|c| self.feature(c.angle.sin().abs()))
            .fold(0.0, f64::max);
        (ends + crossed).min(MAX_ALIGNMENT)
    }
}

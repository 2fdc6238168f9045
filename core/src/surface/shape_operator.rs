//! Principal curvatures of triangles, from those of their corners.
//!
//! The shape operator of each corner, a symmetric tensor in its tangent plane, is rotated into the plane of the
//! triangle. The shape operator of the triangle is the mean of its corners'.

use glam::{DMat3, DQuat, DVec3};

use super::curvature::PrincipalCurvature;
use super::tangent_tensor::{outer, plane_eigen};
use crate::mesh::{FaceId, TriMesh, VertexId};

/// Principal curvatures of every triangle, with directions in its plane.
///
/// `curvature` has one entry per vertex. The result is the mean over those corners for which `counts` is true; both
/// curvatures are 0 where there are none. Each corner's tensor is turned by the smallest rotation that takes its normal
/// to the triangle's, so that curvatures keep their size however large the angle between the normals is.
pub fn face_curvature(
    mesh: &TriMesh,
    curvature: &[PrincipalCurvature],
    counts: impl Fn(VertexId) -> bool,
) -> Vec<PrincipalCurvature> {
    let average = |f: FaceId| {
        let normal = mesh.face_normal(f);
        let corners = mesh.face_vertices(f).into_iter().filter(|&v| counts(v));
        let (sum, n) =
            corners.fold((DMat3::ZERO, 0.0), |(sum, n), v| (sum + rotated(&curvature[v.index()], normal), n + 1.0));
        of_shape_operator(if n > 0.0 { sum * (1.0 / n) } else { sum }, normal)
    };
    mesh.faces().map(average).collect()
}

/// The second fundamental form `II(a, b)`, for vectors tangent to the surface.
pub fn second_fundamental_form(c: &PrincipalCurvature, a: DVec3, b: DVec3) -> f64 {
    c.k_min * a.dot(c.d_min) * b.dot(c.d_min) + c.k_max * a.dot(c.d_max) * b.dot(c.d_max)
}

/// The shape operator after the smallest rotation that takes its normal to `normal`.
fn rotated(c: &PrincipalCurvature, normal: DVec3) -> DMat3 {
    let own = c.d_min.cross(c.d_max);
    let side = if own.dot(normal) < 0.0 { -own } else { own };
    // A degenerate triangle has no normal.
    let turn = if normal == DVec3::ZERO { DQuat::IDENTITY } else { DQuat::from_rotation_arc(side, normal) };
    let (a, b) = (turn * c.d_min, turn * c.d_max);
    outer(a) * c.k_min + outer(b) * c.k_max
}

/// Principal curvatures of a shape operator in the plane with normal `n`; in an arbitrary plane if `n` is zero.
fn of_shape_operator(tensor: DMat3, n: DVec3) -> PrincipalCurvature {
    let n = if n == DVec3::ZERO { DVec3::Z } else { n };
    let eigen = plane_eigen(tensor, n);
    PrincipalCurvature { k_min: eigen.low, k_max: eigen.high, d_min: n.cross(eigen.axis), d_max: eigen.axis }
}

#[cfg(test)]
mod tests {
    use super::super::curvature::principal_curvature;
    use super::*;
    use crate::testing::torus;

    #[test]
    fn triangles_of_a_torus_have_the_curvatures_of_the_torus() {
        let mesh = torus(120, 60);
        let at = principal_curvature(&mesh, 0.03, &vec![false; mesh.n_edges()]);
        for (f, c) in mesh.faces().zip(face_curvature(&mesh, &at, |_| true)) {
            let p: DVec3 = mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>() / 3.0;
            let rho = p.x.hypot(p.y);
            assert!((c.k_max - 10.0).abs() < 0.6 && (c.k_min - (rho - 0.3) / 0.1 / rho).abs() < 0.6, "{c:?}");
            let n = mesh.face_normal(f);
            assert!(c.d_min.dot(n).abs() < 1e-9 && c.d_max.dot(n).abs() < 1e-9 && c.d_min.is_normalized());
            assert!(c.d_min.dot(DVec3::Z.cross(p).normalize()).abs() > 0.98);
            let (a, b) = (c.d_min + c.d_max, c.d_min - c.d_max);
            assert!((second_fundamental_form(&c, a, b) - (c.k_min - c.k_max)).abs() < 1e-9);
        }
        let none = face_curvature(&mesh, &at, |_| false);
        assert!(none.iter().all(|c| c.k_min == 0.0 && c.k_max == 0.0));
    }
}

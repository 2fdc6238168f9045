//! How each triangle's surroundings bend: the shape tensors of its corners, turned into its plane and averaged.

use glam::{DMat3, DQuat, DVec3};

use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::surface::PrincipalCurvature;

/// Principal curvatures of every triangle, with directions in its plane: the average over those of its corners that
/// `counts` accepts, without bend where there are none. `curvature` has an entry per vertex.
///
/// Each tensor is turned with its normal onto the triangle's, so that curvatures are kept however steep the turn.
pub fn face_curvature(
    mesh: &TriMesh,
    curvature: &[PrincipalCurvature],
    counts: impl Fn(VertexId) -> bool,
) -> Vec<PrincipalCurvature> {
    let average = |f: FaceId| {
        let normal = mesh.face_normal(f);
        let corners = mesh.face_vertices(f).into_iter().filter(|&v| counts(v));
        let (sum, n) =
            corners.fold((DMat3::ZERO, 0.0), |(sum, n), v| (sum + turned(&curvature[v.index()], normal), n + 1.0));
        principal(if n > 0.0 { sum * (1.0 / n) } else { sum }, normal)
    };
    mesh.faces().map(average).collect()
}

/// The second fundamental form `II(a, b)`, for vectors tangent to the surface.
pub fn second_fundamental_form(c: &PrincipalCurvature, a: DVec3, b: DVec3) -> f64 {
    c.k_min * a.dot(c.d_min) * b.dot(c.d_min) + c.k_max * a.dot(c.d_max) * b.dot(c.d_max)
}

/// The shape tensor after the smallest turn that takes its normal to `normal`.
fn turned(c: &PrincipalCurvature, normal: DVec3) -> DMat3 {
    let own = c.d_min.cross(c.d_max);
    let side = if own.dot(normal) < 0.0 { -own } else { own };
    let turn = if normal == DVec3::ZERO { DQuat::IDENTITY } else { DQuat::from_rotation_arc(side, normal) };
    let (a, b) = (turn * c.d_min, turn * c.d_max);
    outer(a) * c.k_min + outer(b) * c.k_max
}

fn outer(e: DVec3) -> DMat3 {
    DMat3::from_cols(e * e.x, e * e.y, e * e.z)
}

/// Eigenvalues and directions of a tensor in the plane with normal `n`; any plane where the triangle has none.
fn principal(tensor: DMat3, n: DVec3) -> PrincipalCurvature {
    let n = if n == DVec3::ZERO { DVec3::Z } else { n };
    let (x, y) = n.any_orthonormal_pair();
    let (a, b, c) = (x.dot(tensor * x), x.dot(tensor * y), y.dot(tensor * y));
    let (mean, difference) = (0.5 * (a + c), 0.5 * (a - c));
    let root = difference.hypot(b);
    let angle = 0.5 * b.atan2(difference);
    let along = x * angle.cos() + y * angle.sin();
    PrincipalCurvature { k_min: mean - root, k_max: mean + root, d_min: n.cross(along), d_max: along }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::principal_curvature;
    use crate::testing::torus;

    #[test]
    fn a_torus_bends_in_its_triangles_as_at_its_vertices() {
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

//! Quality of quads: the scaled Jacobian.

use glam::DVec3;

use super::quad_mesh::QuadMesh;

/// Scaled Jacobian of every quad: the least sine of its corner angles, negative where it is folded.
pub fn scaled_jacobians(mesh: &QuadMesh) -> Vec<f64> {
    mesh.quads.iter().map(|q| scaled_jacobian(mesh, q)).collect()
}

/// The least sine of a quad's corner angles, signed by the normal of its diagonals; negative where it is folded.
pub(super) fn scaled_jacobian(mesh: &QuadMesh, quad: &[u32; 4]) -> f64 {
    let [a, b, c, d] = quad.map(|v| mesh.positions[v as usize]);
    let n = (c - a).cross(d - b).normalize_or_zero();
    let corner = |[o, x, y]: [DVec3; 3]| {
        let (x, y) = (x - o, y - o);
        x.cross(y).dot(n) / (x.length() * y.length()).max(f64::MIN_POSITIVE)
    };
    [[a, b, d], [b, c, a], [c, d, b], [d, a, c]].map(corner).into_iter().fold(f64::INFINITY, f64::min)
}

/// Number of folded quads and mean scaled Jacobian.
pub fn quality(mesh: &QuadMesh) -> (usize, f64) {
    let all = scaled_jacobians(mesh);
    let folded = all.iter().filter(|&&s| s <= 0.0).count();
    (folded, all.iter().sum::<f64>() / all.len().max(1) as f64)
}

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

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(corners: [[f64; 2]; 4]) -> QuadMesh {
        QuadMesh {
            positions: corners.map(|[x, y]| DVec3::new(x, y, 0.0)).to_vec(),
            quads: vec![[0, 1, 2, 3]],
            patch: vec![0],
            base_face: vec![0; 4],
            boundary: vec![true; 4],
            n_nodes: 4,
            arcs: Vec::new(),
        }
    }

    #[test]
    fn a_rectangle_has_scaled_jacobian_one_and_a_rhombus_the_sine_of_its_angle() {
        let [rectangle] = scaled_jacobians(&quad([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]]))[..] else {
            panic!()
        };
        assert!((rectangle - 1.0).abs() < 1e-15);
        let (s, c) = std::f64::consts::FRAC_PI_6.sin_cos();
        let [rhombus] = scaled_jacobians(&quad([[0.0, 0.0], [1.0, 0.0], [1.0 + c, s], [c, s]]))[..] else { panic!() };
        assert!((rhombus - 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_quad_with_a_reflex_corner_counts_as_folded_and_a_flat_one_too() {
        assert_eq!(quality(&quad([[0.0, 0.0], [2.0, 0.0], [0.5, 0.5], [0.0, 2.0]])).0, 1);
        // Three corners on a line.
        let (folded, mean) = quality(&quad([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.0, 1.0]]));
        assert!(folded == 1 && mean.abs() < 1e-15);
    }
}

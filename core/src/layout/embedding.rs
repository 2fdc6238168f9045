//! Embeddings of layouts on a refinement of the surface.

use glam::DVec3;

use crate::dual::RefinedMesh;

/// Least length of a step of a path. A shorter one counts as this long, so that parameters along a path strictly
/// increase.
const MIN_STEP: f64 = 1e-9;

/// A layout embedded on a refinement of the surface: nodes as vertices, arcs as edge paths.
#[derive(Debug, Clone)]
pub struct Embedding {
    /// The refined surface; the edges of arcs are marked [`Mark::Arc`](crate::dual::Mark::Arc).
    pub mesh: RefinedMesh,
    /// Triangle of the original mesh that each face lies in.
    pub base_face: Vec<u32>,
    /// Vertex of each node.
    pub nodes: Vec<u32>,
    /// Vertices of each arc, from its first node to its second.
    pub arcs: Vec<Vec<u32>>,
    /// A parameter at each vertex of each arc, strictly increasing from zero. Points at equal fractions of the
    /// parameter of all arcs of a chord are joined by isolines of the patch maps.
    pub arc_parameters: Vec<Vec<f64>>,
    /// A face inside each patch.
    pub seeds: Vec<u32>,
}

/// Length along a vertex path up to each of its vertices.
pub(super) fn path_lengths(positions: &[DVec3], path: &[u32]) -> Vec<f64> {
    let mut along = vec![0.0];
    for w in path.windows(2) {
        let step = positions[w[0] as usize].distance(positions[w[1] as usize]);
        along.push(along[along.len() - 1] + step.max(MIN_STEP));
    }
    along
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_lengths_increase_strictly_even_at_coincident_vertices() {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::X, DVec3::new(1.0, 2.0, 0.0)];
        let along = path_lengths(&positions, &[0, 1, 2, 3]);
        assert_eq!(along[..2], [0.0, 1.0]);
        assert!(along.windows(2).all(|w| w[0] < w[1]));
        assert!((along[3] - 3.0).abs() < 2.0 * MIN_STEP);
    }
}

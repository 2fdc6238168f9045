//! Maps of patches to rectangles.
//!
//! Every patch is cut out along its arcs and mapped with little stretch. Its four sides are mapped to the sides of a
//! rectangle by arc length. Width and height of the rectangle are the mean lengths of the arcs of its two chords, so
//! that all patches along a chord have the same width.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use thiserror::Error;

use super::disc_map::{InitialWeights, count_flipped, disc_map};
use super::embedding::{Embedding, path_lengths};
use super::patch_disc::{ArcLookup, PatchDisc, PatchShapeError};
use super::structure::QuadLayout;
use crate::dual::RefinedMesh;
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};
use crate::solve::SolveError;

/// Why patches could not be mapped.
#[derive(Debug, Error)]
pub enum PatchError {
    /// A patch is not a disc with the four sides of the layout.
    #[error(transparent)]
    Shape(#[from] PatchShapeError),
    /// The linear system of a patch could not be solved.
    #[error("patch {patch}: {source}")]
    Solve {
        /// The patch.
        patch: usize,
        /// What the solver says.
        source: SolveError,
    },
    /// Cancelled from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A patch and its map to the rectangle `[0, size.x] × [0, size.y]`.
#[derive(Debug, Clone)]
pub struct PatchMap {
    /// The patch as a mesh of its own.
    pub mesh: TriMesh,
    /// Vertex of the embedding for each of the first vertices; the others lie inside the patch.
    pub parent: Vec<u32>,
    /// Triangle of the original mesh that each face lies in.
    pub base_face: Vec<u32>,
    /// Image of each vertex.
    pub uv: Vec<DVec2>,
    /// Size of the rectangle.
    pub size: DVec2,
    /// Number of triangles that the map flips.
    pub flipped: usize,
}

/// Maps every patch of `layout`, embedded as `embedding`, to a rectangle.
///
/// # Errors
///
/// See [`PatchError`].
pub fn map_patches(
    layout: &QuadLayout,
    embedding: &Embedding,
    progress: &Progress,
) -> Result<Vec<PatchMap>, PatchError> {
    let arc_length = |a: usize| -> f64 {
        let p = |v: u32| embedding.mesh.positions[v as usize];
        embedding.arcs[a].windows(2).map(|w| p(w[0]).distance(p(w[1]))).sum()
    };
    let mut sum = vec![(0.0, 0.0); layout.chords];
    for (a, arc) in layout.arcs.iter().enumerate() {
        let s = &mut sum[arc.chord as usize];
        *s = (s.0 + arc_length(a), s.1 + 1.0);
    }
    let chord_length: Vec<f64> = sum.iter().map(|(total, n)| total / n).collect();
    let lookup = ArcLookup::new(embedding);
    (0..layout.patches.len())
        .into_par_iter()
        .map(|p| {
            progress.check()?;
            let chord = |i: usize| layout.arcs[layout.patches[p].sides[i].0 as usize].chord as usize;
            let size = DVec2::new(chord_length[chord(0)], chord_length[chord(1)]);
            map_patch(layout, embedding, &lookup, p, size)
        })
        .collect()
}

fn map_patch(
    layout: &QuadLayout,
    embedding: &Embedding,
    lookup: &ArcLookup,
    p: usize,
    size: DVec2,
) -> Result<PatchMap, PatchError> {
    let PatchDisc { submesh, faces, sides } = PatchDisc::cut_out(layout, embedding, lookup, p)?;
    let mut refined = RefinedMesh::new(&submesh.mesh);
    free_the_sides(&mut refined, &sides);
    let mesh = refined.to_mesh().map_err(|source| PatchShapeError::NoDisc { patch: p, source })?;
    if mesh.euler_characteristic() != 1 {
        return Err(PatchShapeError::Sides { patch: p }.into());
    }
    let fixed = rectangle_border(&mesh, &sides, size);
    let solve_error = |source| PatchError::Solve { patch: p, source };
    let uv = disc_map(&mesh, &fixed, InitialWeights::Cotangent).map_err(solve_error)?;
    let flipped = count_flipped(&mesh, &uv);
    let base_face = (0..refined.n_faces() as u32)
        .map(|f| embedding.base_face[faces[refined.base_face(f) as usize] as usize])
        .collect();
    Ok(PatchMap { mesh, parent: submesh.parent, base_face, uv, size, flipped })
}

/// Splits inner edges that join two vertices of one side. On a straight side their triangles would be degenerate.
fn free_the_sides(mesh: &mut RefinedMesh, sides: &[Vec<u32>; 4]) {
    let mut on_side = vec![0u8; mesh.n_vertices()];
    for (k, side) in sides.iter().enumerate() {
        for &v in side {
            on_side[v as usize] |= 1 << k;
        }
    }
    let chords: Vec<(u32, u32)> = (0..3 * mesh.n_faces() as u32)
        .filter(|&h| mesh.twin(h).is_some_and(|t| h < t))
        .map(|h| (mesh.origin(h), mesh.target(h)))
        .filter(|&(a, b)| on_side[a as usize] & on_side[b as usize] != 0)
        .collect();
    for (a, b) in chords {
        if let Some(h) = mesh.find(a, b) {
            mesh.split_edge(h, 0.5);
        }
    }
}

/// The positions of border vertices on the rectangle; `None` for inner vertices.
fn rectangle_border(mesh: &TriMesh, sides: &[Vec<u32>; 4], size: DVec2) -> Vec<Option<DVec2>> {
    let corner = [DVec2::ZERO, DVec2::new(size.x, 0.0), size, DVec2::new(0.0, size.y)];
    let mut fixed = vec![None; mesh.n_vertices()];
    for (k, side) in sides.iter().enumerate() {
        let along = path_lengths(mesh.positions(), side);
        let total = along[along.len() - 1];
        for (&v, s) in side.iter().zip(along).take(side.len() - 1) {
            fixed[v as usize] = Some(corner[k].lerp(corner[(k + 1) % 4], s / total));
        }
    }
    fixed
}

impl PatchMap {
    /// The points of the surface that are mapped to `points`, each with its triangle of the original mesh.
    ///
    /// Every point of the rectangle is found. A point that rounding errors place between triangles is assigned to the
    /// nearest.
    pub fn locate(&self, points: &[DVec2]) -> Vec<(DVec3, u32)> {
        let mut best: Vec<(f64, DVec3, u32)> = vec![(f64::NEG_INFINITY, DVec3::ZERO, 0); points.len()];
        let buckets = Buckets::new(points, self.size);
        for f in self.mesh.faces() {
            let corners = self.mesh.face_vertices(f);
            let [a, b, c] = corners.map(|v| self.uv[v.index()]);
            let area = (b - a).perp_dot(c - a);
            if area <= 0.0 {
                continue;
            }
            buckets.near(a.min(b).min(c), a.max(b).max(c), |i| {
                let p = points[i];
                let w = [(c - b).perp_dot(p - b), (a - c).perp_dot(p - c), (b - a).perp_dot(p - a)].map(|x| x / area);
                let inside = w[0].min(w[1]).min(w[2]);
                if inside > best[i].0 {
                    let w = w.map(|x| x.max(0.0));
                    let total = w[0] + w[1] + w[2];
                    let at = corners.iter().zip(w).map(|(&v, x)| self.mesh.position(v) * (x / total)).sum();
                    best[i] = (inside, at, self.base_face[f.index()]);
                }
            });
        }
        best.into_iter().map(|(_, at, f)| (at, f)).collect()
    }
}

/// Points of a rectangle, sorted into the cells of a regular grid.
struct Buckets {
    cells: Vec<Vec<usize>>,
    n: usize,
    size: DVec2,
}

impl Buckets {
    fn new(points: &[DVec2], size: DVec2) -> Self {
        let n = (points.len() as f64).sqrt().ceil().max(1.0) as usize;
        let mut this = Self { cells: vec![Vec::new(); n * n], n, size };
        for (i, &p) in points.iter().enumerate() {
            let (x, y) = this.cell(p);
            this.cells[y * n + x].push(i);
        }
        this
    }

    fn cell(&self, p: DVec2) -> (usize, usize) {
        let at = |x: f64, size: f64| ((x / size * self.n as f64).max(0.0) as usize).min(self.n - 1);
        (at(p.x, self.size.x), at(p.y, self.size.y))
    }

    /// Visits the points in all cells that the box from `low` to `high`, slightly enlarged, touches.
    fn near(&self, low: DVec2, high: DVec2, mut visit: impl FnMut(usize)) {
        let slack = self.size * 1e-9;
        let (from, to) = (self.cell(low - slack), self.cell(high + slack));
        for y in from.1..=to.1 {
            for x in from.0..=to.0 {
                self.cells[y * self.n + x].iter().for_each(|&i| visit(i));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::file_testing::dual_layout;
    use crate::testing::{column, row, torus};

    fn grid_layout() -> (QuadLayout, Embedding) {
        let curves: Vec<_> =
            (0..3).flat_map(|k| [row(12, 4 * k, true, 0.4), column(12, 12, 4 * k, true, 0.6)]).collect();
        dual_layout(&torus(12, 12), &curves)
    }

    #[test]
    fn patches_along_a_chord_have_the_same_width() {
        let (layout, embedding) = grid_layout();
        let maps = map_patches(&layout, &embedding, &Progress::new()).unwrap();
        let mut width = vec![None; layout.chords];
        for (patch, map) in layout.patches.iter().zip(&maps) {
            for i in 0..2 {
                let chord = layout.arcs[patch.sides[i].0 as usize].chord as usize;
                assert_eq!(*width[chord].get_or_insert(map.size[i]), map.size[i]);
            }
        }
    }

    #[test]
    fn corners_of_the_rectangle_are_located_at_the_nodes() {
        let (layout, embedding) = grid_layout();
        let maps = map_patches(&layout, &embedding, &Progress::new()).unwrap();
        for (patch, map) in layout.patches.iter().zip(&maps) {
            let corners = [DVec2::ZERO, map.size * DVec2::X, map.size, map.size * DVec2::Y];
            for (node, (at, _)) in patch.corners.iter().zip(map.locate(&corners)) {
                let wanted = embedding.mesh.positions[embedding.nodes[*node as usize] as usize];
                assert!(at.distance(wanted) < 1e-9);
            }
        }
    }

    #[test]
    fn patch_with_the_sides_of_another_is_refused() {
        let (mut layout, embedding) = grid_layout();
        let sides = layout.patches[5].sides;
        layout.patches[2].sides = sides;
        let error = map_patches(&layout, &embedding, &Progress::new()).unwrap_err();
        assert!(matches!(error, PatchError::Shape(PatchShapeError::Sides { patch: 2 })), "{error}");
    }
}

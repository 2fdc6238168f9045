//! Maps of all patches to rectangles.
//!
//! Every patch is cut out along its arcs and mapped with little stretch, its four sides to the sides of a rectangle
//! by arc length. The width of a rectangle is the mean length of the arcs of its chord, so that opposite
//! sides, and with them all patches of a dual strip, agree.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use thiserror::Error;

use super::disc;
use super::initial_embedding::{Embedding, lengths};
use super::piece::Submesh;
use super::structure::QuadLayout;
use crate::dual::{Mark, RefinedMesh};
use crate::mesh::{HalfedgeId, TriMesh, TriMeshError, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::solve::SolveError;

/// Why patches could not be mapped.
#[derive(Debug, Error)]
pub enum PatchError {
    /// A patch is no disc with the four sides that the layout says.
    #[error("patch {patch} has not the four sides of the layout")]
    Sides {
        /// The patch.
        patch: usize,
    },
    /// A patch is no disc.
    #[error("patch {patch} is not a disc: {source}")]
    NoDisc {
        /// The patch.
        patch: usize,
        /// What the mesh kernel says.
        source: TriMeshError,
    },
    /// The linear system of a patch could not be solved.
    #[error("patch {patch}: {source}")]
    Solve {
        /// The patch.
        patch: usize,
        /// What the solver says.
        source: SolveError,
    },
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// A patch and its map to the rectangle `[0, size.x] × [0, size.y]`.
#[derive(Debug, Clone)]
pub struct PatchMap {
    /// The patch as a mesh of its own.
    pub mesh: TriMesh,
    /// Vertex of the embedding that each of the first vertices is; the others lie inside the patch.
    pub whole: Vec<u32>,
    /// Triangle of the original mesh that each face lies in.
    pub base_face: Vec<u32>,
    /// Image of each vertex.
    pub uv: Vec<DVec2>,
    /// Size of the rectangle.
    pub size: DVec2,
    /// Number of triangles that the map turns over.
    pub flipped: usize,
}

/// Maps every patch of `layout`, embedded as `embedding`.
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

/// Where arcs and nodes are.
pub(crate) struct ArcLookup {
    /// Arc of each directed edge on an arc, and whether it runs forward.
    arc: HashMap<(u32, u32), (u32, bool)>,
    is_node: Vec<bool>,
}

impl ArcLookup {
    pub(crate) fn new(embedding: &Embedding) -> Self {
        let mut arc = HashMap::new();
        for (a, path) in embedding.arcs.iter().enumerate() {
            for w in path.windows(2) {
                arc.insert((w[0], w[1]), (a as u32, true));
                arc.insert((w[1], w[0]), (a as u32, false));
            }
        }
        let mut is_node = vec![false; embedding.mesh.n_vertices()];
        for &v in &embedding.nodes {
            is_node[v as usize] = true;
        }
        Self { arc, is_node }
    }
}

fn map_patch(
    layout: &QuadLayout,
    embedding: &Embedding,
    lookup: &ArcLookup,
    p: usize,
    size: DVec2,
) -> Result<PatchMap, PatchError> {
    let on_arc = |h: u32| embedding.mesh.mark(h) != Mark::Free;
    let faces = patch_faces(&embedding.mesh, embedding.seeds[p], on_arc);
    let piece =
        Submesh::cut_out(&embedding.mesh, &faces, on_arc).map_err(|source| PatchError::NoDisc { patch: p, source })?;
    let sides = patch_sides(layout, lookup, &piece, p).ok_or(PatchError::Sides { patch: p })?;

    let mut refined = RefinedMesh::new(&piece.mesh);
    free_the_sides(&mut refined, &sides);
    let mesh = refined.to_mesh().map_err(|source| PatchError::NoDisc { patch: p, source })?;
    if mesh.euler_characteristic() != 1 {
        return Err(PatchError::Sides { patch: p });
    }
    let fixed = rectangle_border(&mesh, &sides, size);
    let solve_error = |source| PatchError::Solve { patch: p, source };
    let uv = disc::relaxed(&mesh, &fixed, disc::First::Conformal).map_err(solve_error)?;
    let flipped = disc::flipped(&mesh, &uv);
    let base_face = (0..refined.n_faces() as u32)
        .map(|f| embedding.base_face[faces[refined.base_face(f) as usize] as usize])
        .collect();
    Ok(PatchMap { mesh, whole: piece.whole, base_face, uv, size, flipped })
}

/// The faces reached from `seed` without passing an arc, in increasing order.
pub(crate) fn patch_faces(mesh: &RefinedMesh, seed: u32, on_arc: impl Fn(u32) -> bool) -> Vec<u32> {
    let mut seen = std::collections::HashSet::from([seed]);
    let mut faces = vec![seed];
    let mut i = 0;
    while i < faces.len() {
        for h in 3 * faces[i]..3 * faces[i] + 3 {
            if let Some(t) = mesh.twin(h).filter(|_| !on_arc(h))
                && seen.insert(t / 3)
            {
                faces.push(t / 3);
            }
        }
        i += 1;
    }
    faces.sort_unstable();
    faces
}

/// The vertices of the four sides, in the order of the layout's patch, each from corner to corner.
pub(crate) fn patch_sides(layout: &QuadLayout, lookup: &ArcLookup, piece: &Submesh, p: usize) -> Option<[Vec<u32>; 4]> {
    let mesh = &piece.mesh;
    let start = mesh.halfedges().find(|&h| mesh.twin(h).is_none())?;
    let mut cycle = vec![start];
    let mut h = start;
    loop {
        // The next border half-edge leaves the target and is the first of its fan.
        h = mesh.vertex_halfedge(mesh.target(h));
        if h == start || cycle.len() > mesh.n_halfedges() {
            break;
        }
        cycle.push(h);
    }
    let whole = |v: VertexId| piece.whole[v.index()];
    let n = cycle.len();
    let corners: Vec<usize> = (0..n).filter(|&i| lookup.is_node[whole(mesh.origin(cycle[i])) as usize]).collect();
    if corners.len() != 4 {
        return None;
    }
    let side = |k: usize| -> Option<((u32, bool), Vec<u32>)> {
        let (from, to) = (corners[k], if k == 3 { corners[0] + n } else { corners[k + 1] });
        let mut list: Vec<u32> = (from..to).map(|i| mesh.origin(cycle[i % n]).0).collect();
        let first: HalfedgeId = cycle[from];
        let arc = lookup.arc.get(&(whole(mesh.origin(first)), whole(mesh.target(first))))?;
        list.push(mesh.origin(cycle[to % n]).0);
        Some((*arc, list))
    };
    let found: Vec<((u32, bool), Vec<u32>)> = (0..4).map(side).collect::<Option<_>>()?;
    let turn = (0..4).find(|t| (0..4).all(|i| found[(i + t) % 4].0 == layout.patches[p].sides[i]))?;
    Some([0, 1, 2, 3].map(|i| found[(i + turn) % 4].1.clone()))
}

/// Splits inner edges that join two vertices of one side: a straight side would flatten their triangles.
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

fn rectangle_border(mesh: &TriMesh, sides: &[Vec<u32>; 4], size: DVec2) -> Vec<Option<DVec2>> {
    let corner = [DVec2::ZERO, DVec2::new(size.x, 0.0), size, DVec2::new(0.0, size.y)];
    let mut fixed = vec![None; mesh.n_vertices()];
    for (k, side) in sides.iter().enumerate() {
        let along = lengths(mesh.positions(), side);
        let total = along[along.len() - 1];
        for (&v, s) in side.iter().zip(along).take(side.len() - 1) {
            fixed[v as usize] = Some(corner[k].lerp(corner[(k + 1) % 4], s / total));
        }
    }
    fixed
}

impl PatchMap {
    /// Barycentric coordinates in the map: the points of the surface that are mapped to `points`, each with
    /// the triangle of the original mesh it lies in.
    ///
    /// Every point of the rectangle is found; one that rounding puts between triangles goes to the nearest.
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

/// Points of a rectangle by cells of a regular grid.
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

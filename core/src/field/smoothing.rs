//! Smooth representation vectors: the linear systems behind cross fields.
//!
//! Unknown is one complex number `z` per triangle, minimised is `Σ w |z_g − e^{4iκ} z_f|²` over inner edges, where
//! `κ` transports from `f` to `g`, plus the pull towards given vectors. The weight of an edge is its length over
//! the distance of its triangles' centres. A component that nothing holds takes the smallest eigenvector, found
//! by inverse iteration.
//!
//! Over curved surface the vectors so found fade away from what holds them, and where they are short their
//! direction means little: pairs of singularities appear that a field of unit vectors would not have. Hence some
//! steps follow that make all vectors unit and diffuse them (Viertel and Osting, An Approach to Quad Meshing
//! Based on Harmonic Cross-Valued Maps), until close pairs have met.

use super::{FieldError, expect_length};
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::progress::Progress;
use crate::solve::{SparseHermitian, SpdFactor, SpdSymbolic, c64};
use crate::surface::Metric;

/// Bounds of edge weights, which are about 2 in well-shaped triangles: slivers must neither cut the field off nor
/// swamp the system.
const WEIGHT: [f64; 2] = [1e-3, 1e2];
/// A mass, relative to a mean triangle's, that keeps the system definite where the connection is flat and nothing
/// is held. Its effect reaches over thousands of triangles only.
const GROUND: f64 = 1e-7;
/// Inverse iterations for a free component: the eigenvalues that compete differ by little only if their vectors
/// are equally smooth.
const ITERATIONS: usize = 8;
/// Reach of a diffusion step, in lengths on the mesh, whose bounding box has diagonal 1: pairs closer than about
/// this vanish, features of the field of this size remain.
const REACH: f64 = 0.1;
/// Diffusion steps.
const STEPS: usize = 4;

/// Given vectors that draw the field towards them.
#[derive(Debug, Default)]
pub(super) struct Pull {
    /// Unit vector of each triangle, or nothing at all.
    pub vector: Vec<c64>,
    /// Strength for each triangle, in inverse squared length.
    pub weight: Vec<f64>,
}

/// The smoothest vectors that equal `hard` where given. Unit length where possible; never zero or not finite.
pub(super) fn interpolate_vectors(
    mesh: &TriMesh,
    metric: &Metric,
    hard: &[Option<c64>],
    pull: &Pull,
    progress: &Progress,
) -> Result<Vec<c64>, FieldError> {
    expect_length("the list of fixed crosses", hard.len(), mesh.n_faces())?;
    let mut index = vec![u32::MAX; mesh.n_faces()];
    let mut free = Vec::new();
    for f in mesh.faces() {
        if hard[f.index()].is_none() {
            index[f.index()] = free.len() as u32;
            free.push(f);
        }
    }
    let density = (REACH * REACH).recip();
    let assembled = |density: f64| assemble(mesh, metric, hard, pull, (&index, &free), density);
    let ((matrix, rhs), (heavy, _)) = rayon::join(|| assembled(0.0), || assembled(density));
    progress.check()?;
    let symbolic = SpdSymbolic::new(&matrix)?;
    progress.check()?;
    let mass: Vec<f64> = free.iter().map(|&f| metric.area(f)).collect();
    let harmonic = || {
        let factor = symbolic.factor(&matrix)?;
        let held = held_components(mesh, hard, pull);
        let loose: Vec<bool> = free.iter().map(|f| !held[f.index()]).collect();
        if loose.contains(&true) {
            inverse_iteration(&matrix, &factor, &rhs, &loose, &mass, progress)
        } else {
            Ok(factor.solve(&matrix, &rhs)?)
        }
    };
    let (z, heavy_factor) = rayon::join(harmonic, || symbolic.factor(&heavy));
    let (mut z, heavy_factor) = (z?, heavy_factor?);
    for _ in 0..STEPS {
        progress.check()?;
        let from = |i: usize| rhs[i] + unit(z[i]) * (density * mass[i]);
        let b: Vec<c64> = (0..z.len()).map(from).collect();
        z = heavy_factor.solve(&heavy, &b)?;
    }
    let value = |f: FaceId| hard[f.index()].unwrap_or_else(|| unit(z[index[f.index()] as usize]));
    Ok(mesh.faces().map(value).collect())
}

/// The unit vector along `z`; some unit vector if it has no direction.
fn unit(z: c64) -> c64 {
    let norm = z.norm();
    if norm > f64::MIN_POSITIVE && norm.is_finite() { z / norm } else { c64::new(1.0, 0.0) }
}

/// The system of the free triangles, with a mass of `density` per area added.
fn assemble(
    mesh: &TriMesh,
    metric: &Metric,
    hard: &[Option<c64>],
    pull: &Pull,
    (index, free): (&[u32], &[FaceId]),
    density: f64,
) -> (SparseHermitian<c64>, Vec<c64>) {
    let mean = mesh.faces().map(|f| metric.area(f)).sum::<f64>() / mesh.n_faces().max(1) as f64;
    let mut triplets = Vec::with_capacity(4 * free.len());
    let mut rhs = vec![c64::new(0.0, 0.0); free.len()];
    for (i, &f) in free.iter().enumerate() {
        let area = metric.area(f);
        let strength = pull.weight.get(f.index()).map_or(0.0, |w| w * area);
        if let Some(&v) = pull.vector.get(f.index()) {
            rhs[i] += v * strength;
        }
        // At least some ground for the smallest triangle, or its row might vanish.
        let ground = GROUND * (area / mean).clamp(1e-3, 1e3);
        triplets.push((i as u32, i as u32, c64::new(ground + strength + density * area, 0.0)));
    }
    for e in mesh.edges() {
        let h = mesh.halfedge(e);
        let Some(t) = mesh.twin(h) else { continue };
        let (f, g) = (mesh.face(h), mesh.face(t));
        let weight = edge_weight(metric, h, t);
        let coupling = c64::from_polar(weight, 4.0 * metric.transport(h, t));
        let (i, j) = (index[f.index()], index[g.index()]);
        for k in [i, j].into_iter().filter(|&k| k != u32::MAX) {
            triplets.push((k, k, c64::new(weight, 0.0)));
        }
        match (hard[f.index()], hard[g.index()]) {
            (None, None) => triplets.push((j, i, -coupling)),
            (Some(z), None) => rhs[j as usize] += coupling * z,
            (None, Some(z)) => rhs[i as usize] += coupling.conj() * z,
            (Some(_), Some(_)) => {}
        }
    }
    (SparseHermitian::from_triplets(free.len(), &triplets), rhs)
}

/// The weight of the edge of `h` and its twin: length over distance of the centres, within bounds.
pub(super) fn edge_weight(metric: &Metric, h: HalfedgeId, twin: HalfedgeId) -> f64 {
    let length = metric.length(h);
    let areas = metric.area(FaceId(h.0 / 3)) + metric.area(FaceId(twin.0 / 3));
    (1.5 * length * length / areas).clamp(WEIGHT[0], WEIGHT[1])
}

/// For each triangle, whether its component has a fixed or a pulled triangle.
fn held_components(mesh: &TriMesh, hard: &[Option<c64>], pull: &Pull) -> Vec<bool> {
    let mut held: Vec<bool> = mesh
        .faces()
        .map(|f| hard[f.index()].is_some() || pull.weight.get(f.index()).is_some_and(|&w| w > 0.0))
        .collect();
    let mut stack: Vec<FaceId> = mesh.faces().filter(|f| held[f.index()]).collect();
    while let Some(f) = stack.pop() {
        for t in mesh.face_halfedges(f).into_iter().filter_map(|h| mesh.twin(h)) {
            let g = mesh.face(t);
            if !held[g.index()] {
                held[g.index()] = true;
                stack.push(g);
            }
        }
    }
    held
}

/// Solves with `rhs` where something is held and iterates towards the smallest eigenvector elsewhere.
fn inverse_iteration(
    matrix: &SparseHermitian<c64>,
    factor: &SpdFactor<c64>,
    rhs: &[c64],
    loose: &[bool],
    mass: &[f64],
    progress: &Progress,
) -> Result<Vec<c64>, FieldError> {
    // A start without symmetry, the same each time: unit vectors turning by the golden angle.
    let mut x: Vec<c64> = (0..rhs.len()).map(|i| c64::from_polar(1.0, 2.399_963 * (i + 1) as f64)).collect();
    for _ in 0..ITERATIONS {
        progress.check()?;
        let b: Vec<c64> = (0..rhs.len()).map(|i| if loose[i] { x[i] * mass[i] } else { rhs[i] }).collect();
        x = factor.solve(matrix, &b)?;
        let size = (0..x.len()).filter(|&i| loose[i]).map(|i| x[i].norm()).fold(f64::MIN_POSITIVE, f64::max);
        for i in (0..x.len()).filter(|&i| loose[i]) {
            x[i] /= size;
        }
    }
    Ok(x)
}

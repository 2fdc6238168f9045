//! Smooth representation vectors: the linear systems behind cross fields.
//!
//! Unknown is one complex number `z` per triangle. Minimised is the sum of `w |z_g − e^{4iκ} z_f|²` over inner edges, where `κ`
//! transports from `f` to `g`, and of penalties `s A |z_f − p_f|²` over triangles of area `A`. The weight `w` of an edge is its
//! length over the distance of the centres of its triangles. A component without constraints takes the eigenvector of the
//! smallest eigenvalue, found by inverse iteration.
//!
//! On curved surfaces these vectors become short away from constraints; there their directions mean little, and pairs of
//! singularities appear that a field of unit vectors would not have. Hence some steps of normalising and diffusing follow
//! (Viertel and Osting, An Approach to Quad Meshing Based on Harmonic Cross-Valued Maps), in which close pairs cancel.

use super::error::{FieldError, expect_length};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, components};
use crate::progress::Progress;
use crate::solve::{SparseHermitian, SpdFactor, SpdSymbolic, c64};
use crate::surface::Metric;

/// Least and largest edge weight; in well-shaped triangles it is about 2. Without the bounds, slivers would decouple their
/// neighbours or spoil the condition of the system. Chosen by hand.
const WEIGHT: [f64; 2] = [1e-3, 1e2];
/// Diagonal entry added for a triangle of mean area, which keeps the system definite for flat components without constraints.
/// Its effect extends over thousands of triangles only.
const REGULARISATION: f64 = 1e-7;
/// Bounds of the ratio of a triangle's area to the mean that the regularisation is scaled by: for the smallest triangles
/// the row must not vanish.
const AREA_RATIO: [f64; 2] = [1e-3, 1e3];
/// Inverse iterations for components without constraints. Few suffice: eigenvectors not separated by then belong to nearly
/// equal eigenvalues, hence are nearly as smooth.
const ITERATIONS: usize = 8;
/// Length over which a diffusion step smooths, in model sizes (the mesh is normalised): pairs of singularities
/// closer than about this cancel, details of the field of this size remain.
const DIFFUSION_LENGTH: f64 = 0.1;
/// Number of diffusion steps.
const DIFFUSION_STEPS: usize = 4;

/// [`edge_weight`] of two equilateral triangles. Penalty weights are given relative to it.
pub(super) const EQUILATERAL_EDGE_WEIGHT: f64 = 1.732_050_807_568_877_2;

/// Penalties for deviation from given vectors.
#[derive(Debug, Default)]
pub(super) struct SoftConstraints {
    /// Unit vector of each triangle; empty: no penalties.
    pub vector: Vec<c64>,
    /// Penalty weight of each triangle, in inverse squared lengths; empty: no penalties.
    pub weight: Vec<f64>,
}

/// The smoothest unit vectors that equal `hard` where that is given.
pub(super) fn interpolate_vectors(
    mesh: &TriMesh,
    metric: &Metric,
    hard: &[Option<c64>],
    soft: &SoftConstraints,
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
    let density = (DIFFUSION_LENGTH * DIFFUSION_LENGTH).recip();
    let assembled = |density: f64| assemble(mesh, metric, hard, soft, (&index, &free), density);
    // The system of the harmonic vectors, and that of the diffusion steps.
    let ((matrix, rhs), (diffusion, _)) = rayon::join(|| assembled(0.0), || assembled(density));
    progress.check()?;
    let symbolic = SpdSymbolic::new(&matrix)?;
    progress.check()?;
    let mass: Vec<f64> = free.iter().map(|&f| metric.area(f)).collect();
    let harmonic = || {
        let factor = symbolic.factor(&matrix)?;
        let constrained = constrained_components(mesh, hard, soft);
        let unconstrained: Vec<bool> = free.iter().map(|f| !constrained[f.index()]).collect();
        if unconstrained.contains(&true) {
            inverse_iteration(&matrix, &factor, &rhs, &unconstrained, &mass, progress)
        } else {
            Ok(factor.solve(&matrix, &rhs)?)
        }
    };
    let (z, diffusion_factor) = rayon::join(harmonic, || symbolic.factor(&diffusion));
    let (mut z, diffusion_factor) = (z?, diffusion_factor?);
    for _ in 0..DIFFUSION_STEPS {
        progress.check()?;
        let from = |i: usize| rhs[i] + unit(z[i]) * (density * mass[i]);
        let b: Vec<c64> = (0..z.len()).map(from).collect();
        z = diffusion_factor.solve(&diffusion, &b)?;
    }
    let value = |f: FaceId| hard[f.index()].unwrap_or_else(|| unit(z[index[f.index()] as usize]));
    Ok(mesh.faces().map(value).collect())
}

/// The unit vector along `z`; 1 if `z` is zero or not finite.
fn unit(z: c64) -> c64 {
    let norm = z.norm();
    if norm > f64::MIN_POSITIVE && norm.is_finite() { z / norm } else { c64::new(1.0, 0.0) }
}

/// The system of the free triangles, with `density` times area added to the diagonal.
fn assemble(
    mesh: &TriMesh,
    metric: &Metric,
    hard: &[Option<c64>],
    soft: &SoftConstraints,
    (index, free): (&[u32], &[FaceId]),
    density: f64,
) -> (SparseHermitian<c64>, Vec<c64>) {
    let mean = mesh.faces().map(|f| metric.area(f)).sum::<f64>() / mesh.n_faces().max(1) as f64;
    let mut triplets = Vec::with_capacity(4 * free.len());
    let mut rhs = vec![c64::new(0.0, 0.0); free.len()];
    for (i, &f) in free.iter().enumerate() {
        let area = metric.area(f);
        let strength = soft.weight.get(f.index()).map_or(0.0, |w| w * area);
        if let Some(&v) = soft.vector.get(f.index()) {
            rhs[i] += v * strength;
        }
        let regularisation = REGULARISATION * (area / mean).clamp(AREA_RATIO[0], AREA_RATIO[1]);
        triplets.push((i as u32, i as u32, c64::new(regularisation + strength + density * area, 0.0)));
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

/// The weight of the edge of `h` and its twin: length over the distance of the centres, that is 3/2 length² over the sum of
/// both areas, within bounds.
pub(super) fn edge_weight(metric: &Metric, h: HalfedgeId, twin: HalfedgeId) -> f64 {
    let length = metric.length(h);
    let areas = metric.area(FaceId(h.0 / 3)) + metric.area(FaceId(twin.0 / 3));
    (1.5 * length * length / areas).clamp(WEIGHT[0], WEIGHT[1])
}

/// For each triangle, whether its component has a hard constraint or a penalty.
fn constrained_components(mesh: &TriMesh, hard: &[Option<c64>], soft: &SoftConstraints) -> Vec<bool> {
    let (component, count) = components(mesh.n_faces(), |f| mesh.adjacent_faces(f).map(|(_, g)| g));
    let mut constrained = vec![false; count];
    for f in mesh.faces() {
        let penalised = soft.weight.get(f.index()).is_some_and(|&w| w > 0.0);
        constrained[component[f.index()] as usize] |= hard[f.index()].is_some() || penalised;
    }
    component.into_iter().map(|c| constrained[c as usize]).collect()
}

/// Solves with `rhs` in components with constraints, and iterates towards the smallest eigenvector in the others.
fn inverse_iteration(
    matrix: &SparseHermitian<c64>,
    factor: &SpdFactor<c64>,
    rhs: &[c64],
    unconstrained: &[bool],
    mass: &[f64],
    progress: &Progress,
) -> Result<Vec<c64>, FieldError> {
    // A deterministic start without symmetry: unit vectors that turn by the golden angle (2.399963 radians).
    let mut x: Vec<c64> = (0..rhs.len()).map(|i| c64::from_polar(1.0, 2.399_963 * (i + 1) as f64)).collect();
    for _ in 0..ITERATIONS {
        progress.check()?;
        let b: Vec<c64> = (0..rhs.len()).map(|i| if unconstrained[i] { x[i] * mass[i] } else { rhs[i] }).collect();
        x = factor.solve(matrix, &b)?;
        let size = (0..x.len()).filter(|&i| unconstrained[i]).map(|i| x[i].norm()).fold(f64::MIN_POSITIVE, f64::max);
        for i in (0..x.len()).filter(|&i| unconstrained[i]) {
            x[i] /= size;
        }
    }
    Ok(x)
}

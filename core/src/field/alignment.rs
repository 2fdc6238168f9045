//! Direction penalties: alignment of fields with principal directions, features and boundaries.
//!
//! Principal directions are reliable where the surface is anisotropic, that is, where `κ₁ − κ₂` is large; on flat and
//! spherical parts they are noise. Campen (section 6.3.2, after Bommes et al., Mixed-Integer Quadrangulation) selects
//! reliable triangles and gives them a penalty weight of 100. Here the weight is continuous, `(κ₁ − κ₂)²` times the
//! triangle's area: this is how a deviation counts in the measure of alignment, it has no threshold at which the field
//! could change discontinuously, and being dimensionless it depends neither on scale nor on the fineness of the mesh. A
//! direction then prevails over smoothness within a distance inverse to `κ₁ − κ₂`, about the radius of the bend.

use super::guiding_field::{DirectionPenalty, RELIABLE_PENALTY};
use super::smoothing::EQUILATERAL_EDGE_WEIGHT;
use crate::mesh::{FaceId, TriMesh};
use crate::surface::Metric;
use crate::surface::PrincipalCurvature;
use crate::surface::face_curvature;

/// Strength of alignment in least-squares maps, a pure number: a principal direction prevails within the inverse of the
/// strength times `κ₁ − κ₂`. With larger values these maps have more residual and more flipped triangles.
const STRENGTH: f64 = 1.7;
/// Strength of alignment in locally injective maps. Measured at 1.7, 2.6 and, with sizing weighted less, 3.5: directions
/// deviate by 4.3°, 3.7° and 3.2° (Fertility, 84 patches), 3.9°, 3.0° and 2.6° (cino_3holes), 5.6°, 4.7° and 4.2° (rocker
/// arm, 68 patches); the conformal distortion exceeds 2 by 0.021, 0.031 and 0.042, by 0.023, 0.029 and 0.033, by 0.028,
/// 0.046 and 0.058.
const INJECTIVE_STRENGTH: f64 = 3.5;
/// Total length of features, in square roots of the surface's area, above which [`STRENGTH`] serves for locally injective
/// maps too: with more, features could not be made constraints (on the fan disk at 2.6 none).
const FEATURE_DOMINATED: f64 = 4.0;
/// Largest `κ₁ − κ₂` that counts, in inverse model sizes. Curvature is averaged over balls of radius 0.03, so no
/// bend is seen sharper; larger values stem from slivers and creases.
const MAX_DIFFERENCE: f64 = 40.0;
/// Anisotropy `(κ₁ − κ₂) / (|κ₁| + |κ₂|)` (0 on spheres, 1 on cylinders and saddles) up to which there is no penalty, and
/// from which on it is full. On a sphere of 4000 points with noise of up to a thousandth of the model size nine tenths of
/// the triangles have less than 0.18.
const ANISOTROPY: [f64; 2] = [0.2, 0.6];
/// Least weight of a penalty, in inverse squared model sizes: below, the direction prevails in no part of the
/// surface.
const MIN_WEIGHT: f64 = 1.0;

/// Penalties for deviation from the reliable principal directions, by ascending triangle, for a least-squares map or a
/// locally `injective` one. `curvature` has an entry per vertex, `sharp` a flag per edge (empty: none). Vertices on sharp
/// edges are left out: their curvature is that of the crease.
pub fn principal_direction_penalties(
    mesh: &TriMesh,
    metric: &Metric,
    curvature: &[PrincipalCurvature],
    sharp: &[bool],
    injective: bool,
) -> Vec<DirectionPenalty> {
    let strength = if injective && !is_feature_dominated(mesh, sharp) { INJECTIVE_STRENGTH } else { STRENGTH };
    let mut on_crease = vec![false; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| sharp.get(e.index()).copied().unwrap_or(false)) {
        for v in mesh.edge_vertices(e) {
            on_crease[v.index()] = true;
        }
    }
    let face_curvature = face_curvature(mesh, curvature, |v| !on_crease[v.index()]);
    let penalty = |face: FaceId| {
        let weight = penalty_weight(&face_curvature[face.index()], strength)?;
        let angle = metric.angle_of(mesh, face, face_curvature[face.index()].d_max)?;
        Some(DirectionPenalty {
            face,
            angle,
            weight: weight * metric.area(face) / EQUILATERAL_EDGE_WEIGHT,
            branch: None,
        })
    };
    mesh.faces().filter_map(penalty).collect()
}

/// Whether the features (a flag per edge; empty: none) are so long in total that they determine the shape.
pub(crate) fn is_feature_dominated(mesh: &TriMesh, sharp: &[bool]) -> bool {
    let length: f64 = mesh.edges().zip(sharp).filter(|(_, sharp)| **sharp).map(|(e, _)| mesh.edge_length(e)).sum();
    let area: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
    length > FEATURE_DOMINATED * area.sqrt()
}

/// The weight of a penalty per area, in inverse squared lengths; `None` where directions are unreliable.
fn penalty_weight(c: &PrincipalCurvature, strength: f64) -> Option<f64> {
    let difference = c.k_max - c.k_min;
    let relative = difference / (c.k_min.abs() + c.k_max.abs()).max(f64::MIN_POSITIVE);
    let weight = ramp(relative, ANISOTROPY) * (strength * difference.min(MAX_DIFFERENCE)).powi(2);
    (weight > MIN_WEIGHT).then_some(weight)
}

/// 0 up to the first bound, 1 from the second on, a cubic with zero slope at both between.
fn ramp(x: f64, [from, to]: [f64; 2]) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Penalties of weight [`RELIABLE_PENALTY`] for deviation from the edges marked in `along` (features, boundaries; a flag per
/// edge), one for each triangle beside each edge.
pub fn feature_direction_penalties(mesh: &TriMesh, metric: &Metric, along: &[bool]) -> Vec<DirectionPenalty> {
    let marked = mesh.halfedges().filter(|&h| along[mesh.edge(h).index()]);
    marked
        .map(|h| DirectionPenalty {
            face: mesh.face(h),
            angle: metric.direction(h),
            weight: RELIABLE_PENALTY,
            branch: None,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use glam::DVec3;

    use super::*;
    use crate::field::{AlignmentDirections, feature_aligned_field, samples::octasphere};
    use crate::mesh::{SHARP_DIHEDRAL, SHORT_FEATURE, drop_short_features, sharp_edges};
    use crate::progress::Progress;
    use crate::surface::principal_curvature;
    use crate::testing::{grid, research_mesh, square};

    fn penalties(mesh: &TriMesh) -> Vec<DirectionPenalty> {
        let curvature = principal_curvature(mesh, 0.03, &vec![false; mesh.n_edges()]);
        principal_direction_penalties(mesh, &Metric::new(mesh), &curvature, &[], false)
    }

    /// How far an angle is from a multiple of a quarter turn.
    fn off_quarter(angle: f64) -> f64 {
        (angle - (angle / FRAC_PI_2).round() * FRAC_PI_2).abs()
    }

    #[test]
    fn cylinders_and_saddles_have_penalties_and_spheres_and_planes_none() {
        assert!(penalties(&square(12)).is_empty());
        assert!(penalties(&octasphere(24)).is_empty());
        // Of radius 0.1, with its axis along z.
        let cylinder =
            grid(60, 50, [true, false], |u, v| DVec3::new(0.1 * (TAU * u).cos(), 0.1 * (TAU * u).sin(), 0.8 * v));
        let metric = Metric::new(&cylinder);
        let found = penalties(&cylinder);
        assert_eq!(found.len(), cylinder.n_faces());
        for g in found {
            let axis = metric.angle_of(&cylinder, g.face, DVec3::Z).unwrap();
            let z = cylinder.face_vertices(g.face).map(|v| cylinder.position(v).z).iter().sum::<f64>() / 3.0;
            assert!(off_quarter(g.angle - axis) < 1e-2, "{g:?}");
            let full = (10.0 * STRENGTH).powi(2) * metric.area(g.face) / EQUILATERAL_EDGE_WEIGHT;
            assert!((g.weight / full - 1.0).abs() < 0.05 || !(0.05..0.75).contains(&z), "{g:?} {full}");
        }
        // A saddle of curvatures 4 and -4.
        let saddle = grid(30, 30, [false, false], |u, v| {
            let (x, y) = (0.5 * (u - 0.5), 0.5 * (v - 0.5));
            DVec3::new(x, y, 2.0 * (x * x - y * y))
        });
        assert!(penalties(&saddle).len() * 10 > saddle.n_faces() * 9);
    }

    #[test]
    fn alignment_is_stronger_in_injective_maps_unless_features_dominate() {
        let tube =
            grid(60, 50, [true, false], |u, v| DVec3::new(0.1 * (TAU * u).cos(), 0.1 * (TAU * u).sin(), 0.8 * v));
        let (metric, none) = (Metric::new(&tube), vec![false; tube.n_edges()]);
        let curvature = principal_curvature(&tube, 0.03, &none);
        let weight = |sharp: &[bool], injective| {
            principal_direction_penalties(&tube, &metric, &curvature, sharp, injective)
                .iter()
                .map(|g| g.weight)
                .sum::<f64>()
        };
        let stronger = (INJECTIVE_STRENGTH / STRENGTH).powi(2);
        assert!((weight(&none, true) / weight(&none, false) / stronger - 1.0).abs() < 1e-9);
        // Every fifth ring of edges all around: ten times the circumference.
        let sharp: Vec<bool> = tube
            .edges()
            .map(|e| {
                let [a, b] = tube.edge_vertices(e).map(|v| tube.position(v).z / 0.8 * 50.0);
                (a - b).abs() < 1e-6 && (a.round() as u32).is_multiple_of(5)
            })
            .collect();
        assert_eq!(weight(&sharp, true), weight(&sharp, false));
    }

    #[test]
    fn features_align_the_triangles_beside_them() {
        let mesh = square(3);
        let metric = Metric::new(&mesh);
        let along: Vec<bool> = mesh.edges().map(|e| mesh.is_boundary_edge(e)).collect();
        let found = feature_direction_penalties(&mesh, &metric, &along);
        assert_eq!(found.len(), 12);
        for g in &found {
            let tangent = metric.tangent(&mesh, g.face, g.angle);
            assert!(tangent.x.abs().max(tangent.y.abs()) > 1.0 - 1e-12 && g.weight == RELIABLE_PENALTY);
        }
        let inner: Vec<bool> = along.iter().map(|a| !a).collect();
        assert_eq!(feature_direction_penalties(&mesh, &metric, &inner).len(), 2 * inner.iter().filter(|&&i| i).count());
    }

    #[test]
    fn penalties_align_the_field_of_a_real_shape_with_few_more_singularities() {
        let Some(loaded) = research_mesh("rockerarm_5k.obj") else { return };
        let mesh = loaded.mesh;
        let metric = Metric::new(&mesh);
        let mut sharp = sharp_edges(&mesh, SHARP_DIHEDRAL);
        drop_short_features(&mesh, &mut sharp, SHORT_FEATURE);
        let curvature = principal_curvature(&mesh, 0.03, &sharp);
        let found = principal_direction_penalties(&mesh, &metric, &curvature, &sharp, false);
        let face_curvature = face_curvature(&mesh, &curvature, |_| true);
        let (mut directions, mut weights) = (vec![DVec3::ZERO; mesh.n_faces()], vec![0.0; mesh.n_faces()]);
        for g in &found {
            directions[g.face.index()] = metric.tangent(&mesh, g.face, g.angle);
            weights[g.face.index()] = g.weight * EQUILATERAL_EDGE_WEIGHT / metric.area(g.face);
        }
        let of = |weights: &[f64]| {
            let towards = AlignmentDirections { directions: &directions, weights, radius: 1.0 };
            let field = feature_aligned_field(&mesh, &metric, Some(towards), &sharp, &Progress::new()).unwrap();
            let (mut sum, mut total) = (0.0, 0.0);
            for (f, c) in mesh.faces().zip(&face_curvature) {
                let weight = (c.k_max - c.k_min).powi(2) * metric.area(f);
                let along = metric.angle_of(&mesh, f, c.d_max).unwrap();
                sum += weight * off_quarter(field.angle[f.index()] - along).to_degrees();
                total += weight;
            }
            (sum / total, field.singularities.len())
        };
        let (free, aligned) = (of(&vec![0.0; mesh.n_faces()]), of(&weights));
        assert!(aligned.0 < 5.0 && free.0 > 15.0 && aligned.1 <= free.1 + 4, "{free:?} {aligned:?}");
    }
}

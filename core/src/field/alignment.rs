//! Directions that crosses should follow: principal directions, features and boundaries.
//!
//! Where the surface bends much more one way than the other its principal directions mean something; where it is
//! flat or round they are noise (Campen, section 6.3.2, after Bommes et al., Mixed-Integer Quadrangulation). There,
//! reliable triangles are selected and held with a penalty of 100. Here the weight of each triangle is continuous,
//! the square of `κ₁ − κ₂` times the triangle's area, for three reasons: it is what a deviation costs in the
//! alignment measure; it has no threshold at which the field could break; and it is a pure number, so that the pull
//! of a piece of surface depends neither on its size nor on how finely it is meshed. As a direction prevails over a
//! distance inverse to `κ₁ − κ₂`, of about the radius of the bend, fine detail aligns the field near it and a
//! gentle bend over a wide area.

use crate::field::{DirectionPenalty, RELIABLE_PENALTY};
use crate::mesh::{FaceId, TriMesh};
use crate::surface::Metric;
use crate::surface::PrincipalCurvature;
use crate::surface::face_curvature;

/// The distance over which a principal direction prevails is the inverse of the strength times `κ₁ − κ₂`.
///
/// In maps of least squares: with more, these follow with more residual and more folds.
const STRENGTH: f64 = 1.7;
/// In maps without folds, which can follow more. Measured at 1.7, 2.6 and, with sizes counting less, 3.5:
/// directions deviate by 4.3°, 3.7° and 3.2° (Fertility, 84 patches), 3.9°, 3.0° and 2.6° (cino_3holes) and 5.6°, 4.7° and 4.2°
/// (rocker arm, 68), and the conformal distortion over 2 is 0.021, 0.031 and 0.042, 0.023, 0.029 and 0.033, 0.028, 0.046 and
/// 0.058.
const STRENGTH_WHOLE: f64 = 3.5;
/// Length of features, in square roots of the surface's area, from which on they carry the shape: there maps without folds
/// follow no more than least squares do, or features could not be held (on the fan disk at 2.6 none).
const CREASED: f64 = 4.0;
/// Largest `κ₁ − κ₂` that counts, in inverse bounding-box diagonals: no bend is seen sharper than the ball of radius
/// 0.03 that curvature is averaged over, larger values stem from slivers and creases.
const MOST: f64 = 40.0;
/// `(κ₁ − κ₂) / (|κ₁| + |κ₂|)`, 0 on a sphere and 1 on cylinders and saddles, where guides begin and where they are
/// full. On a sphere of 4000 points that are off by up to a thousandth of the diagonal nine tenths of the triangles
/// show less than 0.18.
const ANISOTROPIC: [f64; 2] = [0.2, 0.6];
/// Guides weaker than this prevail nowhere in less than the whole surface.
const LEAST: f64 = 1.0;
/// The smoothness weight of an edge between equilateral triangles, its length over the distance of their centres.
const EQUILATERAL: f64 = 1.732_050_807_568_877_2;

/// The reliable principal directions, by triangle, for a map of least squares or one that is `whole`, without folds.
/// `curvature` has an entry per vertex, `sharp` a flag per edge (empty: none). Corners on sharp edges tell nothing of the
/// smooth surface beside them and are left out.
pub fn principal_direction_penalties(
    mesh: &TriMesh,
    metric: &Metric,
    curvature: &[PrincipalCurvature],
    sharp: &[bool],
    whole: bool,
) -> Vec<DirectionPenalty> {
    let strength = if whole && !is_feature_dominated(mesh, sharp) { STRENGTH_WHOLE } else { STRENGTH };
    let mut on_crease = vec![false; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| sharp.get(e.index()).copied().unwrap_or(false)) {
        for v in mesh.edge_vertices(e) {
            on_crease[v.index()] = true;
        }
    }
    let bending = face_curvature(mesh, curvature, |v| !on_crease[v.index()]);
    let guide = |face: FaceId| {
        let pull = pull(&bending[face.index()], strength)?;
        let angle = metric.angle_of(mesh, face, bending[face.index()].d_max)?;
        Some(DirectionPenalty { face, angle, weight: pull * metric.area(face) / EQUILATERAL, branch: None })
    };
    mesh.faces().filter_map(guide).collect()
}

/// Whether features carry the shape of a surface; a flag per edge (empty: none).
pub(crate) fn is_feature_dominated(mesh: &TriMesh, sharp: &[bool]) -> bool {
    let length: f64 = mesh.edges().zip(sharp).filter(|(_, sharp)| **sharp).map(|(e, _)| mesh.edge_length(e)).sum();
    let area: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
    length > CREASED * area.sqrt()
}

/// The weight of a guide in inverse squared lengths; `None` where the directions mean nothing.
fn pull(c: &PrincipalCurvature, strength: f64) -> Option<f64> {
    let difference = c.k_max - c.k_min;
    let relative = difference / (c.k_min.abs() + c.k_max.abs()).max(f64::MIN_POSITIVE);
    let pull = ramp(relative, ANISOTROPIC) * (strength * difference.min(MOST)).powi(2);
    (pull > LEAST).then_some(pull)
}

/// 0 up to the first bound, 1 from the second on, and smooth between.
fn ramp(x: f64, [from, to]: [f64; 2]) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The directions of the edges marked in `along` (features, boundaries to be followed; one flag per edge), one for
/// each triangle at each edge, all of full weight.
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
    use crate::testing::{grid, square};

    fn guides(mesh: &TriMesh) -> Vec<DirectionPenalty> {
        let curvature = principal_curvature(mesh, 0.03, &vec![false; mesh.n_edges()]);
        principal_direction_penalties(mesh, &Metric::new(mesh), &curvature, &[], false)
    }

    /// How far an angle is from a multiple of a quarter turn.
    fn off_quarter(angle: f64) -> f64 {
        (angle - (angle / FRAC_PI_2).round() * FRAC_PI_2).abs()
    }

    #[test]
    fn bent_surfaces_guide_and_round_or_flat_ones_do_not() {
        assert!(guides(&square(12)).is_empty());
        assert!(guides(&octasphere(24)).is_empty());
        // Of radius 0.1 and along z.
        let cylinder =
            grid(60, 50, [true, false], |u, v| DVec3::new(0.1 * (TAU * u).cos(), 0.1 * (TAU * u).sin(), 0.8 * v));
        let metric = Metric::new(&cylinder);
        let found = guides(&cylinder);
        assert_eq!(found.len(), cylinder.n_faces());
        for g in found {
            let axis = metric.angle_of(&cylinder, g.face, DVec3::Z).unwrap();
            let z = cylinder.face_vertices(g.face).map(|v| cylinder.position(v).z).iter().sum::<f64>() / 3.0;
            assert!(off_quarter(g.angle - axis) < 1e-2, "{g:?}");
            let full = (10.0 * STRENGTH).powi(2) * metric.area(g.face) / EQUILATERAL;
            assert!((g.weight / full - 1.0).abs() < 0.05 || !(0.05..0.75).contains(&z), "{g:?} {full}");
        }
        // A saddle of curvatures 4 and -4.
        let saddle = grid(30, 30, [false, false], |u, v| {
            let (x, y) = (0.5 * (u - 0.5), 0.5 * (v - 0.5));
            DVec3::new(x, y, 2.0 * (x * x - y * y))
        });
        assert!(guides(&saddle).len() * 10 > saddle.n_faces() * 9);
    }

    #[test]
    fn guides_are_stronger_once_the_map_cannot_fold_but_not_where_creases_carry_the_shape() {
        let tube =
            grid(60, 50, [true, false], |u, v| DVec3::new(0.1 * (TAU * u).cos(), 0.1 * (TAU * u).sin(), 0.8 * v));
        let (metric, none) = (Metric::new(&tube), vec![false; tube.n_edges()]);
        let curvature = principal_curvature(&tube, 0.03, &none);
        let weight = |sharp: &[bool], whole| {
            principal_direction_penalties(&tube, &metric, &curvature, sharp, whole)
                .iter()
                .map(|g| g.weight)
                .sum::<f64>()
        };
        let stronger = (STRENGTH_WHOLE / STRENGTH).powi(2);
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
    fn features_guide_the_triangles_beside_them() {
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
    fn guides_align_the_field_of_a_real_shape_without_further_singularities() {
        let folder = std::env::var_os("PLAIT_MESHES").map_or_else(
            || std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/meshes"),
            std::path::PathBuf::from,
        );
        let Ok(loaded) = crate::mesh::load(&folder.join("rockerarm_5k.obj")) else {
            eprintln!("rockerarm_5k.obj not found, skipped");
            return;
        };
        let mesh = loaded.mesh;
        let metric = Metric::new(&mesh);
        let mut sharp = sharp_edges(&mesh, SHARP_DIHEDRAL);
        drop_short_features(&mesh, &mut sharp, SHORT_FEATURE);
        let curvature = principal_curvature(&mesh, 0.03, &sharp);
        let found = principal_direction_penalties(&mesh, &metric, &curvature, &sharp, false);
        let bending = face_curvature(&mesh, &curvature, |_| true);
        let (mut directions, mut weights) = (vec![DVec3::ZERO; mesh.n_faces()], vec![0.0; mesh.n_faces()]);
        for g in &found {
            directions[g.face.index()] = metric.tangent(&mesh, g.face, g.angle);
            weights[g.face.index()] = g.weight * EQUILATERAL / metric.area(g.face);
        }
        let of = |weights: &[f64]| {
            let guides = AlignmentDirections { directions: &directions, weights, radius: 1.0 };
            let field = feature_aligned_field(&mesh, &metric, Some(guides), &sharp, &Progress::new()).unwrap();
            let (mut sum, mut total) = (0.0, 0.0);
            for (f, c) in mesh.faces().zip(&bending) {
                let weight = (c.k_max - c.k_min).powi(2) * metric.area(f);
                let along = metric.angle_of(&mesh, f, c.d_max).unwrap();
                sum += weight * off_quarter(field.angle[f.index()] - along).to_degrees();
                total += weight;
            }
            (sum / total, field.singularities.len())
        };
        let (free, guided) = (of(&vec![0.0; mesh.n_faces()]), of(&weights));
        assert!(guided.0 < 5.0 && free.0 > 15.0 && guided.1 <= free.1 + 4, "{free:?} {guided:?}");
    }
}

//! Quality measures of maps (Campen, section 6.8.1).
//!
//! With the gradients of u and v on each triangle, the singular values `σ₁ ≥ σ₂` of the map from surface to plane,
//! the second fundamental form II, principal curvatures κ, and the area A of the surface `M`:
//!
//! * conformal distortion `E_confor = 1/A ∫ σ₁/σ₂ + σ₂/σ₁`: 2 where angles are preserved, larger where squares become
//!   rectangles or rhombi;
//! * conjugacy error `E_planar = 1/√A ∫ |II(∇u/‖∇u‖, ∇v/‖∇v‖)|`: 0 if small quads along the isolines are planar. The
//!   absolute value is taken, which the thesis does not write: values of opposite sign would cancel;
//! * alignment error `E°`: the mean angle of ∇u and ∇v to the nearest principal direction, weighted by `(κ₁ − κ₂)²`, in
//!   degrees: 22.5 for random directions, 45 at most.
//!
//! All three are independent of the scale of the surface and of the map.

use glam::{DVec2, DVec3};
use serde::Serialize;

use crate::layout::PatchMap;
use crate::mesh::{FaceId, TriMesh};
use crate::param::SeamlessMap;
use crate::surface::PrincipalCurvature;
use crate::surface::second_fundamental_form;

/// Bound of the conformal distortion of one triangle: degenerate triangles would make the mean infinite. At 100, where
/// a square becomes a rectangle of 1 to 100, the map is useless anyway.
const MAX_CONFORMAL: f64 = 100.0;

/// The measures of a map of a whole surface. Integrals are over the surface.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Measures {
    /// Mean conformal distortion, at least 2.
    pub conformal: f64,
    /// Conjugacy error, at least 0.
    pub planar: f64,
    /// Alignment error in degrees, 0 to 45; 0 if curvature is the same in all directions everywhere.
    pub alignment: f64,
    /// Largest conformal distortion of a triangle, at most 100.
    pub max_conformal: f64,
    /// Number of flipped or degenerate triangles.
    pub flipped: usize,
    /// Number of triangles whose conformal distortion is clamped to 100.
    pub clamped: usize,
}

/// The measures of one patch.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct PatchMeasures {
    /// Ratio of the longer to the shorter side of the rectangle.
    pub aspect: f64,
    /// Area on the surface.
    pub area: f64,
    /// The measures of this patch alone; `A` is its own area.
    pub measures: Measures,
}

/// The measures of one triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleMeasure {
    /// Area on the surface.
    pub area: f64,
    /// Conformal distortion, 2 to 100.
    pub conformal: f64,
    /// Mean angle of ∇u and ∇v to the nearest principal direction, in degrees, 0 to 45.
    pub deviation: f64,
    /// `II(∇u/‖∇u‖, ∇v/‖∇v‖)`, in inverse lengths.
    pub torsion: f64,
    /// `(κ₁ − κ₂)²`, in inverse squared lengths.
    pub anisotropy: f64,
    /// Whether the image is flipped or has no area.
    pub flipped: bool,
}

/// The measures of a seamless map, and those of each triangle. `curvature` holds principal curvatures of the triangles,
/// as from [`face_curvature`](crate::surface::face_curvature).
pub fn measure_map(
    mesh: &TriMesh,
    map: &SeamlessMap,
    curvature: &[PrincipalCurvature],
) -> (Measures, Vec<TriangleMeasure>) {
    let corners = |f| mesh.face_vertices(f).map(|v| mesh.position(v));
    let triangle = |f: FaceId| measure(corners(f), map.uv[f.index()], &curvature[f.index()]);
    let triangles: Vec<TriangleMeasure> = mesh.faces().map(triangle).collect();
    (summary(&triangles), triangles)
}

/// The measures of patches that together are a surface, those of each patch, and those of each triangle of each
/// patch. `curvature` holds principal curvatures of the triangles of the original mesh.
pub fn measure_patches(
    patches: &[PatchMap],
    curvature: &[PrincipalCurvature],
) -> (Measures, Vec<PatchMeasures>, Vec<Vec<TriangleMeasure>>) {
    let triangles: Vec<Vec<TriangleMeasure>> = patches.iter().map(|p| patch_triangles(p, curvature)).collect();
    let each = patches.iter().zip(&triangles).map(|(patch, triangles)| PatchMeasures {
        aspect: patch.size.max_element() / patch.size.min_element(),
        area: triangles.iter().map(|t| t.area).sum(),
        measures: summary(triangles),
    });
    (summary(triangles.iter().flatten()), each.collect(), triangles)
}

fn patch_triangles(patch: &PatchMap, curvature: &[PrincipalCurvature]) -> Vec<TriangleMeasure> {
    let triangle = |f: FaceId| {
        let v = patch.mesh.face_vertices(f);
        let base = patch.base_face[f.index()] as usize;
        measure(v.map(|v| patch.mesh.position(v)), v.map(|v| patch.uv[v.index()]), &curvature[base])
    };
    patch.mesh.faces().map(triangle).collect()
}

/// The measures of the triangle `points` mapped to `uv`.
fn measure(points: [DVec3; 3], uv: [DVec2; 3], curvature: &PrincipalCurvature) -> TriangleMeasure {
    let [a, b, c] = points;
    let twice = (b - a).cross(c - a);
    let normal = twice.normalize_or_zero();
    let hats = [c - b, a - c, b - a].map(|side| normal.cross(side) / twice.length().max(f64::MIN_POSITIVE));
    let [du, dv]: [DVec3; 2] = [0, 1].map(|k| hats[0] * uv[0][k] + hats[1] * uv[1][k] + hats[2] * uv[2][k]);
    // σ₁/σ₂ + σ₂/σ₁ is the squared norm of the Jacobian over its determinant.
    let conformal = (du.length_squared() + dv.length_squared()) / du.cross(dv).dot(normal).abs();
    let [p, q] = [du, dv].map(|d| d.normalize_or_zero());
    TriangleMeasure {
        area: 0.5 * twice.length(),
        conformal: if conformal.is_finite() { conformal.clamp(2.0, MAX_CONFORMAL) } else { MAX_CONFORMAL },
        deviation: 0.5 * (deviation(p, curvature) + deviation(q, curvature)),
        torsion: second_fundamental_form(curvature, p, q),
        anisotropy: (curvature.k_max - curvature.k_min).powi(2),
        flipped: (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]) <= 0.0,
    }
}

/// The angle of a tangent direction to the nearest principal direction, in degrees.
fn deviation(d: DVec3, curvature: &PrincipalCurvature) -> f64 {
    let (x, y) = (d.dot(curvature.d_min).abs(), d.dot(curvature.d_max).abs());
    x.min(y).atan2(x.max(y)).to_degrees()
}

/// Area-weighted means, maxima and counts of the measures of triangles.
fn summary<'a>(triangles: impl IntoIterator<Item = &'a TriangleMeasure>) -> Measures {
    let mut total = Measures::default();
    let (mut area, mut weight) = (0.0, 0.0);
    for t in triangles {
        area += t.area;
        weight += t.area * t.anisotropy;
        total.conformal += t.area * t.conformal;
        total.planar += t.area * t.torsion.abs();
        total.alignment += t.area * t.anisotropy * t.deviation;
        total.max_conformal = total.max_conformal.max(t.conformal);
        total.flipped += usize::from(t.flipped);
        total.clamped += usize::from(t.conformal == MAX_CONFORMAL);
    }
    let over = |sum: f64, whole: f64| if whole > 0.0 { sum / whole } else { 0.0 };
    total.conformal = over(total.conformal, area);
    total.planar = over(total.planar, area.sqrt());
    total.alignment = over(total.alignment, weight);
    total
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::surface::face_curvature;
    use crate::surface::principal_curvature;
    use crate::testing::{grid, square, torus};

    const FLAT: PrincipalCurvature = PrincipalCurvature { k_min: 0.0, k_max: 0.0, d_min: DVec3::X, d_max: DVec3::Y };

    fn seamless(mesh: &TriMesh, uv: impl Fn(DVec3) -> DVec2) -> SeamlessMap {
        let image = |f| mesh.face_vertices(f).map(|v| uv(mesh.position(v)));
        SeamlessMap { uv: mesh.faces().map(image).collect(), jump: vec![0; mesh.n_edges()] }
    }

    /// The map of a [`grid`] of `n` by `m` cells that `map` makes of the fractions along both of its directions.
    fn grid_map(mesh: &TriMesh, n: u32, m: u32, map: impl Fn(DVec2) -> DVec2) -> SeamlessMap {
        let at = |i: u32, j: u32| map(DVec2::new(f64::from(i) / f64::from(n), f64::from(j) / f64::from(m)));
        let mut uv = Vec::new();
        for j in 0..m {
            for i in 0..n {
                uv.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                uv.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        SeamlessMap { uv, jump: vec![0; mesh.n_edges()] }
    }

    #[test]
    fn conformal_distortion_of_similarities_and_stretches() {
        let mesh = square(5);
        let flat = vec![FLAT; mesh.n_faces()];
        let of = |map: &dyn Fn(DVec3) -> DVec2| measure_map(&mesh, &seamless(&mesh, map), &flat).0;
        let same = of(&|p| p.truncate());
        assert!((same.conformal - 2.0).abs() < 1e-12 && (same.planar, same.alignment, same.flipped) == (0.0, 0.0, 0));
        let turned = of(&|p| DVec2::from_angle(0.7).rotate(p.truncate()) * 30.0 + DVec2::ONE);
        assert!((turned.conformal - 2.0).abs() < 1e-12 && turned.max_conformal < 2.0 + 1e-9);
        for a in [0.2, 3.0] {
            let m = of(&|p| DVec2::new(a * p.x, p.y));
            assert!((m.conformal - (a + 1.0 / a)).abs() < 1e-9 && (m.max_conformal - m.conformal).abs() < 1e-9);
        }
        let mirrored = of(&|p| DVec2::new(-p.x, p.y));
        assert_eq!((mirrored.flipped, mirrored.clamped), (50, 0));
        let collapsed = of(&|_| DVec2::ZERO);
        assert_eq!((collapsed.flipped, collapsed.clamped, collapsed.max_conformal), (50, 50, MAX_CONFORMAL));
    }

    /// A cylinder of radius 0.2 and height 1 with a map turned by `turn` from its lines of curvature.
    fn cylinder(turn: f64, scale: f64) -> Measures {
        let (n, m) = (90, 20);
        let mesh =
            grid(n, m, [true, false], |u, v| scale * DVec3::new(0.2 * (TAU * u).cos(), 0.2 * (TAU * u).sin(), v));
        let exact: Vec<PrincipalCurvature> = mesh
            .positions()
            .iter()
            .map(|p| {
                let d_max = DVec3::new(-p.y, p.x, 0.0).normalize();
                PrincipalCurvature { k_min: 0.0, k_max: 5.0 / scale, d_min: DVec3::Z, d_max }
            })
            .collect();
        let unrolled = DVec2::new(2.0 * 90.0 * 0.2 * (TAU / 180.0).sin(), 1.0);
        let map = grid_map(&mesh, n, m, |p| DVec2::from_angle(turn).rotate(p * unrolled));
        measure_map(&mesh, &map, &face_curvature(&mesh, &exact, |_| true)).0
    }

    #[test]
    fn alignment_and_conjugacy_error_on_a_cylinder() {
        let along = cylinder(0.0, 1.0);
        assert!((along.conformal - 2.0).abs() < 1e-9 && along.alignment < 1e-6 && along.planar < 1e-9, "{along:?}");
        // II = κ/2 half way between the lines of curvature; the area is the height times the circumference.
        let area: f64 = 2.0 * 90.0 * 0.2 * (TAU / 180.0).sin();
        for scale in [1.0, 7.0] {
            let across = cylinder(TAU / 8.0, scale);
            assert!((across.alignment - 45.0).abs() < 0.1, "{across:?}");
            // Averaging the corners' tensors over a triangle loses about a thousandth.
            assert!((across.planar - 2.5 * area.sqrt()).abs() < 0.01, "{across:?} {}", 2.5 * area.sqrt());
        }
        let slightly = cylinder(0.1, 1.0);
        assert!((slightly.alignment - 0.1f64.to_degrees()).abs() < 0.05, "{slightly:?}");
    }

    #[test]
    fn random_directions_have_an_alignment_error_of_22_5_degrees() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        let bent = PrincipalCurvature { k_max: 1.0, ..FLAT };
        let points = [DVec3::ZERO, DVec3::X, DVec3::new(0.3, 0.8, 0.0)];
        let triangles: Vec<TriangleMeasure> = (0..20_000)
            .map(|_| {
                let turn = DVec2::from_angle(TAU * random());
                measure(points, points.map(|p| turn.rotate(p.truncate())), &bent)
            })
            .collect();
        let m = summary(&triangles);
        assert!((m.alignment - 22.5).abs() < 0.3, "{m:?}");
    }

    #[test]
    fn measures_of_a_torus_mapped_along_its_circles() {
        let (n, m) = (96, 48);
        let mesh = torus(n, m);
        let curvature = principal_curvature(&mesh, 0.02, &vec![false; mesh.n_edges()]);
        let of_faces = face_curvature(&mesh, &curvature, |_| true);
        let map = grid_map(&mesh, n, m, |p| p * DVec2::new(0.3 * TAU, 0.1 * TAU));
        let (measures, triangles) = measure_map(&mesh, &map, &of_faces);
        // Cells are trapezoids, not rectangles; a turn by an eighth would give a planar measure of about 5.
        assert!(measures.alignment < 1.0 && measures.planar < 0.25 && measures.flipped == 0, "{measures:?}");
        // The stretch around the axis is r / 0.3 with r = 0.3 + 0.1 cos b; the area element goes with r.
        let steps = 1000;
        let (mut sum, mut area) = (0.0, 0.0);
        for k in 0..steps {
            let r = 0.3 + 0.1 * (TAU * f64::from(k) / f64::from(steps)).cos();
            sum += r * (r / 0.3 + 0.3 / r);
            area += r;
        }
        assert!((measures.conformal - sum / area).abs() < 2e-3, "{measures:?} {}", sum / area);
        assert_eq!(triangles.len(), mesh.n_faces());
    }

    #[test]
    fn measures_of_patches_agree_with_those_of_the_surface() {
        let mesh = square(4);
        let patch = PatchMap {
            parent: (0..25).collect(),
            base_face: (0..32).collect(),
            uv: mesh.positions().iter().map(|p| p.truncate() * DVec2::new(3.0, 1.0)).collect(),
            size: DVec2::new(3.0, 1.0),
            flipped: 0,
            mesh,
        };
        let bent = vec![PrincipalCurvature { k_min: -1.0, k_max: 2.0, ..FLAT }; 32];
        let (all, each, triangles) = measure_patches(&[patch.clone(), patch], &bent);
        assert_eq!((each.len(), triangles.len(), triangles[1].len()), (2, 2, 32));
        assert_eq!((each[0].aspect, each[1]), (3.0, each[0]));
        assert!((each[0].area - 1.0).abs() < 1e-12 && (all.conformal - 10.0 / 3.0).abs() < 1e-12);
        assert!((all.conformal - each[0].measures.conformal).abs() < 1e-12 && all.alignment < 1e-9);
    }
}

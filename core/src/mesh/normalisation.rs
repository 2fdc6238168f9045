//! Normalised coordinates: centred, of model size 1.
//!
//! The *model size* is the length that stands for a whole model. Radii, weights and tolerances are fractions of it, so that
//! they have one meaning for all models. Two lengths serve for it, see [`NormalisedBy`].

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::kernel::TriMesh;

/// What centre and size of a model are taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalisedBy {
    /// Its bounding box: the size is the diagonal. A model that is turned has another box, and so other costs and strips.
    BoundingBox,
    /// Its surface: the centre is the centroid, the size is [`SURFACE_SIZE`] times the root mean square distance of the
    /// surface from it. Both turn with the model, and depend on the surface only, not on its triangles.
    Surface,
}

impl NormalisedBy {
    /// What a file means that does not say: the bounding box, which was the only one at first.
    pub fn unnamed() -> Self {
        Self::BoundingBox
    }

    /// Whether a file may leave it out.
    pub fn is_unnamed(&self) -> bool {
        *self == Self::unnamed()
    }
}

/// Model size in root mean square distances of the surface from its centroid. With this factor a typical model is as large by
/// its surface as by its box, so that the radii and weights that were chosen for boxes hold: over the 49 research meshes the
/// diagonal is 3.82 root mean square distances in the median, between 2.7 (a cube) and 4.8 (a plate).
pub const SURFACE_SIZE: f64 = 3.8;

/// The similarity between file coordinates and normalised ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normalisation {
    /// What centre and scale are taken from.
    pub by: NormalisedBy,
    /// The centre, in file coordinates.
    pub centre: DVec3,
    /// The model size: file units per normalised unit.
    pub scale: f64,
}

impl Normalisation {
    /// By the bounding box of `positions`; `None` if there are none, they coincide, or the diagonal overflows or underflows.
    pub fn by_bounding_box(positions: &[DVec3]) -> Option<Self> {
        let min = positions.iter().copied().reduce(DVec3::min)?;
        let max = positions.iter().copied().reduce(DVec3::max)?;
        let (scale, centre) = ((max - min).length(), min + 0.5 * (max - min));
        Self::checked(NormalisedBy::BoundingBox, centre, scale)
    }

    /// By the surface of `mesh`; `None` if it has no area.
    ///
    /// The integrals over a triangle of area `A` with corners `a`, `b`, `c` are exact: `∫ x = A (a + b + c) / 3` and
    /// `∫ |x|² = A (|a|² + |b|² + |c|² + |a + b + c|²) / 12`.
    pub fn by_surface(mesh: &TriMesh) -> Option<Self> {
        let corners = |f| mesh.face_vertices(f).map(|v| mesh.position(v));
        let (mut area, mut first) = (0.0, DVec3::ZERO);
        for f in mesh.faces() {
            area += mesh.face_area(f);
            first += mesh.face_area(f) * corners(f).iter().sum::<DVec3>() / 3.0;
        }
        let centre = first / area;
        // Relative to the centre, which loses no digits where the model is far from the origin.
        let second = mesh.faces().map(|f| {
            let corners = corners(f).map(|p| p - centre);
            let squares: f64 = corners.iter().map(|p| p.length_squared()).sum();
            mesh.face_area(f) * (squares + corners.iter().sum::<DVec3>().length_squared()) / 12.0
        });
        let scale = SURFACE_SIZE * (second.sum::<f64>() / area).sqrt();
        Self::checked(NormalisedBy::Surface, centre, scale)
    }

    fn checked(by: NormalisedBy, centre: DVec3, scale: f64) -> Option<Self> {
        (scale.is_normal() && centre.is_finite()).then_some(Self { by, centre, scale })
    }

    /// From normalised to file coordinates.
    pub fn to_file(&self, p: DVec3) -> DVec3 {
        p * self.scale + self.centre
    }

    /// From file to normalised coordinates.
    pub fn from_file(&self, p: DVec3) -> DVec3 {
        (p - self.centre) / self.scale
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::DQuat;
    use proptest::prelude::*;

    use super::*;
    use crate::mesh::load;
    use crate::testing::{grid, research_meshes, square};

    #[test]
    fn the_bounding_box_is_centred_and_has_diagonal_one() {
        let corners = [DVec3::new(10.0, 0.0, -1.0), DVec3::new(13.0, 4.0, -1.0), DVec3::new(11.0, 1.0, -1.0)];
        let normalisation = Normalisation::by_bounding_box(&corners).unwrap();
        assert_eq!((normalisation.scale, normalisation.centre), (5.0, DVec3::new(11.5, 2.0, -1.0)));
        let [a, b, _] = corners.map(|p| normalisation.from_file(p));
        assert!((a + b).length() < 1e-15 && (a.distance(b) - 1.0).abs() < 1e-15);
        assert!(corners.iter().all(|&p| normalisation.to_file(normalisation.from_file(p)).distance(p) < 1e-14));
    }

    #[test]
    fn what_has_no_size_cannot_be_normalised() {
        assert_eq!(Normalisation::by_bounding_box(&[]), None);
        assert_eq!(Normalisation::by_bounding_box(&[DVec3::ONE; 3]), None);
        assert_eq!(Normalisation::by_bounding_box(&[DVec3::splat(-1e300), DVec3::splat(1e300)]), None);
        let line = TriMesh::from_faces(vec![DVec3::ZERO, DVec3::X, 2.0 * DVec3::X], &[[0, 1, 2]]).unwrap();
        assert_eq!(Normalisation::by_surface(&line), None);
    }

    #[test]
    fn the_size_by_the_surface_does_not_depend_on_its_triangles() {
        // Of a square of side 1: ∫ x² + y² = 1/6.
        for n in [1, 7] {
            let square = Normalisation::by_surface(&square(n)).unwrap();
            assert!((square.scale - SURFACE_SIZE / 6f64.sqrt()).abs() < 1e-14, "{square:?}");
            assert!(square.centre.distance(DVec3::new(0.5, 0.5, 0.0)) < 1e-14, "{square:?}");
        }
    }

    #[test]
    fn a_typical_model_is_as_large_by_its_surface_as_by_its_box() {
        let Some(folder) = research_meshes() else { return };
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let loaded = files.filter_map(|path| load(&path).ok());
        let mut sizes: Vec<f64> = loaded.map(|l| Normalisation::by_surface(&l.mesh).unwrap().scale).collect();
        sizes.sort_by(f64::total_cmp);
        let median = sizes[sizes.len() / 2];
        assert!((median - 1.0).abs() < 0.02, "{sizes:?}");
    }

    proptest! {
        #[test]
        fn the_size_by_the_surface_turns_with_the_model(
            (axis, angle) in ([-1.0f64..1.0, -1.0..1.0, -1.0..1.0], 0.0..TAU), by in [-9.0f64..9.0, -9.0..9.0, -9.0..9.0],
        ) {
            let mesh = grid(9, 5, [true, false], |u, v| DVec3::new((TAU * u).cos(), v * v, (TAU * u).sin() + v));
            let turn = DQuat::from_axis_angle(DVec3::from(axis).try_normalize().unwrap_or(DVec3::X), angle);
            let moved = |p| turn * p + DVec3::from(by);
            let [still, turned] = [mesh.clone(), mesh.mapped(moved)].map(|m| Normalisation::by_surface(&m).unwrap());
            prop_assert!((still.scale - turned.scale).abs() < 1e-13, "{} {}", still.scale, turned.scale);
            prop_assert!(moved(still.centre).distance(turned.centre) < 1e-13);
        }
    }
}

//! Normalised coordinates: centred, of bounding-box diagonal 1.

use glam::DVec3;

/// The similarity between file coordinates and normalised ones.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Normalisation {
    /// Centre of the bounding box, in file units.
    #[serde(rename = "center")]
    pub centre: DVec3,
    /// Diagonal of the bounding box: file units per normalised unit.
    pub scale: f64,
}

impl Normalisation {
    /// The one that centres the bounding box of `positions` and scales it to diagonal 1; `None` if there are none, they
    /// coincide, or the diagonal overflows or underflows.
    pub fn of(positions: &[DVec3]) -> Option<Self> {
        let min = positions.iter().copied().reduce(DVec3::min)?;
        let max = positions.iter().copied().reduce(DVec3::max)?;
        let scale = (max - min).length();
        let centre = min + 0.5 * (max - min);
        (scale.is_normal() && centre.is_finite()).then_some(Self { centre, scale })
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
    use super::*;

    #[test]
    fn the_bounding_box_is_centred_and_has_diagonal_one() {
        let corners = [DVec3::new(10.0, 0.0, -1.0), DVec3::new(13.0, 4.0, -1.0), DVec3::new(11.0, 1.0, -1.0)];
        let normalisation = Normalisation::of(&corners).unwrap();
        assert_eq!((normalisation.scale, normalisation.centre), (5.0, DVec3::new(11.5, 2.0, -1.0)));
        let [a, b, _] = corners.map(|p| normalisation.from_file(p));
        assert!((a + b).length() < 1e-15 && (a.distance(b) - 1.0).abs() < 1e-15);
        assert!(corners.iter().all(|&p| normalisation.to_file(normalisation.from_file(p)).distance(p) < 1e-14));
    }

    #[test]
    fn what_has_no_size_cannot_be_normalised() {
        assert_eq!(Normalisation::of(&[]), None);
        assert_eq!(Normalisation::of(&[DVec3::ONE; 3]), None);
        assert_eq!(Normalisation::of(&[DVec3::splat(-1e300), DVec3::splat(1e300)]), None);
    }
}

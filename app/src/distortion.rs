//! Colours of the surface by the distortion of an embedding: measures, colour scale, legend.
//!
//! The scale runs from light to dark with decreasing luminance, so that it also reads in grey. Flipped triangles are
//! magenta, which the scale does not contain.

use plait_core::weave::FaceDistortion;

use crate::engine::EmbeddingSummary;

/// Colour of flipped triangles.
pub const FLIPPED: [u8; 3] = [0xf0, 0x00, 0xd8];
/// The scale from best to worst, in equal steps.
const SCALE: [[u8; 3]; 5] =
    [[0xf4, 0xf6, 0xe6], [0xf6, 0xd5, 0x8a], [0xf0, 0x99, 0x4a], [0xcb, 0x4b, 0x32], [0x6a, 0x10, 0x26]];
/// Strength of the colours over the material, of 255. With less, the dark end would look like the middle.
const STRENGTH: f64 = 250.0;
/// Ratio of the singular values at the end of the scale; the conformal distortion is then 4 + 1/4.
const WORST_STRETCH: f64 = 4.0;
/// Angle to the nearest principal direction at the end of the scale, in degrees: the largest there is.
const WORST_DEVIATION: f64 = 45.0;

/// What the colours of the surface show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourMode {
    /// The problems of the regions.
    #[default]
    Regions,
    /// Conformal distortion.
    Conformal,
    /// Angle to the nearest principal direction.
    Alignment,
}

impl ColourMode {
    /// All modes, in the order of the menu.
    pub const ALL: [Self; 3] = [Self::Regions, Self::Conformal, Self::Alignment];

    /// The name in the menu.
    pub fn label(self) -> &'static str {
        match self {
            Self::Regions => "Regions",
            Self::Conformal => "Conformal distortion",
            Self::Alignment => "Alignment error",
        }
    }

    /// The meaning of the scale, for the legend; empty for regions.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Regions => "",
            Self::Conformal => "2: conformal; 4.25: stretched 4 to 1",
            Self::Alignment => "Angle to the nearest principal direction; uncoloured where curvature is isotropic",
        }
    }

    /// Ticks of the legend: position on the scale from 0 to 1, and label.
    pub fn ticks(self) -> &'static [(f64, &'static str)] {
        match self {
            Self::Regions => &[],
            Self::Conformal => &[(0.0, "2"), (0.292_48, "2.17"), (0.5, "2.5"), (0.792_48, "3.33"), (1.0, "4.25+")],
            Self::Alignment => &[(0.0, "0°"), (1.0 / 3.0, "15°"), (2.0 / 3.0, "30°"), (1.0, "45°")],
        }
    }

    /// The colour of each triangle of the design mesh, alpha as strength; `None` for regions.
    pub fn tints(self, summary: &EmbeddingSummary) -> Option<Vec<[u8; 4]>> {
        let colour: fn(&FaceDistortion) -> [u8; 4] = match self {
            Self::Regions => return None,
            Self::Conformal => |t| tint(conformal_position(t.conformal), 1.0),
            Self::Alignment => |t| tint(t.deviation / WORST_DEVIATION, t.anisotropy),
        };
        let [r, g, b] = FLIPPED;
        Some(summary.triangles.iter().map(|t| if t.flipped { [r, g, b, 0xff] } else { colour(t) }).collect())
    }
}

/// Position on the scale of a conformal distortion r + 1/r: the logarithm of the ratio r of the singular values.
fn conformal_position(distortion: f64) -> f64 {
    let half = 0.5 * distortion.max(2.0);
    (half + (half * half - 1.0).sqrt()).ln() / WORST_STRETCH.ln()
}

/// The colour at a position on the scale, with a strength from 0 to 1.
fn tint(t: f64, strength: f64) -> [u8; 4] {
    let [r, g, b] = scale_colour(t);
    [r, g, b, (STRENGTH * strength.clamp(0.0, 1.0)) as u8]
}

/// The colour at a position on the scale from 0 (best) to 1 (worst).
pub fn scale_colour(t: f64) -> [u8; 3] {
    let last = SCALE.len() - 1;
    let at = t.clamp(0.0, 1.0) * last as f64;
    let i = (at as usize).min(last - 1);
    let part = at - i as f64;
    std::array::from_fn(|k| (f64::from(SCALE[i][k]) * (1.0 - part) + f64::from(SCALE[i + 1][k]) * part).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_lie_at_their_values() {
        for (t, text) in ColourMode::Conformal.ticks() {
            let value: f64 = text.trim_end_matches('+').parse().unwrap();
            assert!((conformal_position(value) - t).abs() < 0.01, "{text}: {} {t}", conformal_position(value));
        }
        for (t, text) in ColourMode::Alignment.ticks() {
            let degrees: f64 = text.trim_end_matches('°').parse().unwrap();
            assert!((degrees / WORST_DEVIATION - t).abs() < 1e-9);
        }
    }

    #[test]
    fn worse_is_darker_and_flipped_is_magenta() {
        let luma = |t: f64| scale_colour(t).iter().zip([0.3, 0.6, 0.1]).map(|(&c, w)| f64::from(c) * w).sum::<f64>();
        for i in 0..20 {
            assert!(luma(f64::from(i) / 20.0) > luma(f64::from(i + 1) / 20.0), "{i}");
        }
        let good = FaceDistortion { conformal: 2.0, deviation: 45.0, anisotropy: 0.0, flipped: false };
        let triangles = vec![good, FaceDistortion { flipped: true, ..good }];
        let summary = EmbeddingSummary { triangles, ..EmbeddingSummary::default() };
        let conformal = ColourMode::Conformal.tints(&summary).unwrap();
        assert_eq!((conformal[0][..3].to_vec(), conformal[1][..3].to_vec()), (SCALE[0].to_vec(), FLIPPED.to_vec()));
        // Without anisotropy there is no direction to deviate from.
        assert_eq!(ColourMode::Alignment.tints(&summary).unwrap()[0][3], 0);
        assert!(ColourMode::Regions.tints(&summary).is_none());
    }

    #[test]
    fn distortion_below_the_minimum_is_at_the_start_of_the_scale() {
        // Rounding can lead below 2, where the ratio of the singular values is not real.
        assert_eq!((conformal_position(1.999), conformal_position(2.0)), (0.0, 0.0));
    }
}

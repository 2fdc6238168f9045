//! Distortion of an embedding as colours on the surface: what is measured, its scale, its legend.
//!
//! Good triangles are pale and bad ones dark, so that what is bad stands out, in one hue order that also reads in
//! grey; folded triangles are magenta, which the scale does not contain.

use crate::engine::{EmbeddingSummary, TriangleDistortion};

/// Folded triangles.
pub const FOLDED: [u8; 3] = [0xf0, 0x00, 0xd8];
/// From best to worst, at equal distances.
const SCALE: [[u8; 3]; 5] =
    [[0xf4, 0xf6, 0xe6], [0xf6, 0xd5, 0x8a], [0xf0, 0x99, 0x4a], [0xcb, 0x4b, 0x32], [0x6a, 0x10, 0x26]];
/// Strength of the colours over the material, of 255: nearly all, or the dark end would look like the middle.
const STRENGTH: f64 = 250.0;
/// Stretch, as a ratio of lengths, at the end of the scale; its conformal distortion is 4.25.
const WORST_STRETCH: f64 = 4.0;
/// Deviation at the end of the scale, in degrees: no direction is farther from both principal ones.
const WORST_DEVIATION: f64 = 45.0;

/// What the surface's colours tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Colours {
    /// How urgent regions are.
    #[default]
    Regions,
    /// Conformal distortion.
    Conformal,
    /// Deviation from principal directions.
    Alignment,
}

impl Colours {
    /// All, in the order of the choice.
    pub const ALL: [Self; 3] = [Self::Regions, Self::Conformal, Self::Alignment];

    /// The name in the choice.
    pub fn label(self) -> &'static str {
        match self {
            Self::Regions => "Regions",
            Self::Conformal => "Conformal error",
            Self::Alignment => "Alignment error",
        }
    }

    /// What the ends of the scale mean, in words; empty for regions, which have no scale.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Regions => "",
            Self::Conformal => "2: angles are kept; 4.25: stretched 1 to 4",
            Self::Alignment => "Degrees off the nearest principal direction; plain where there is none",
        }
    }

    /// Numbers of the legend, each with its place on the scale from 0 to 1.
    pub fn ticks(self) -> &'static [(f64, &'static str)] {
        match self {
            Self::Regions => &[],
            Self::Conformal => &[(0.0, "2"), (0.292_48, "2.17"), (0.5, "2.5"), (0.792_48, "3.33"), (1.0, "4.25+")],
            Self::Alignment => &[(0.0, "0°"), (1.0 / 3.0, "15°"), (2.0 / 3.0, "30°"), (1.0, "45°")],
        }
    }

    /// The wash over each triangle of the design mesh; `None` for regions.
    pub fn tints(self, summary: &EmbeddingSummary) -> Option<Vec<[u8; 4]>> {
        let tint: fn(&TriangleDistortion) -> [u8; 4] = match self {
            Self::Regions => return None,
            Self::Conformal => |t| wash(conformal(t.conformal), 1.0),
            Self::Alignment => |t| wash(t.deviation / WORST_DEVIATION, t.anisotropy),
        };
        let [r, g, b] = FOLDED;
        Some(summary.triangles.iter().map(|t| if t.flipped { [r, g, b, 0xff] } else { tint(t) }).collect())
    }
}

/// A conformal distortion's place on the scale: by the logarithm of the ratio r with `r + 1/r` this distortion.
fn conformal(distortion: f64) -> f64 {
    let half = 0.5 * distortion.max(2.0);
    (half + (half * half - 1.0).sqrt()).ln() / WORST_STRETCH.ln()
}

fn wash(t: f64, strength: f64) -> [u8; 4] {
    let [r, g, b] = color(t);
    [r, g, b, (STRENGTH * strength.clamp(0.0, 1.0)) as u8]
}

/// The colour at a place on the scale from 0 (best) to 1 (worst).
pub fn color(t: f64) -> [u8; 3] {
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
    fn ticks_lie_where_their_numbers_are() {
        for (t, text) in Colours::Conformal.ticks() {
            let value: f64 = text.trim_end_matches('+').parse().unwrap();
            assert!((conformal(value) - t).abs() < 0.01, "{text}: {} {t}", conformal(value));
        }
        for (t, text) in Colours::Alignment.ticks() {
            let degrees: f64 = text.trim_end_matches('°').parse().unwrap();
            assert!((degrees / WORST_DEVIATION - t).abs() < 1e-9);
        }
    }

    #[test]
    fn worse_is_darker_and_folds_are_magenta() {
        let luma = |t: f64| color(t).iter().zip([0.3, 0.6, 0.1]).map(|(&c, w)| f64::from(c) * w).sum::<f64>();
        for i in 0..20 {
            assert!(luma(f64::from(i) / 20.0) > luma(f64::from(i + 1) / 20.0), "{i}");
        }
        let good = TriangleDistortion { conformal: 2.0, deviation: 45.0, anisotropy: 0.0, flipped: false };
        let triangles = vec![good, TriangleDistortion { flipped: true, ..good }];
        let summary = EmbeddingSummary { triangles, ..EmbeddingSummary::default() };
        let conformal = Colours::Conformal.tints(&summary).unwrap();
        assert_eq!((conformal[0][..3].to_vec(), conformal[1][..3].to_vec()), (SCALE[0].to_vec(), FOLDED.to_vec()));
        // Where nothing is curved a direction is neither good nor bad.
        assert_eq!(Colours::Alignment.tints(&summary).unwrap()[0][3], 0);
        assert!(Colours::Regions.tints(&summary).is_none());
    }
}

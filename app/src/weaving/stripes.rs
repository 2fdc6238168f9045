//! The stripe pattern of a session's strips.

use plait_core::strip::{StripCoverage, StripMap};

use crate::engine::Stripes;

/// Distance of two lines of the pattern, as a fraction of the model's diagonal: close enough to read as a texture,
/// far enough to follow a single line.
const SPACING: f64 = 0.012;

/// The pattern of each face; `visible` tells which curves show theirs.
pub fn pattern(map: &StripMap, visible: impl Fn(u32) -> bool) -> Vec<[Option<Stripes>; 2]> {
    let family = |f: usize, k: usize| covering(map, f, k, &visible).map(|(strip, at)| stripes(strip, at));
    (0..map.covered.len()).map(|f| [family(f, 0), family(f, 1)]).collect()
}

/// The visible strip of a family that covers a face, and the distances of the face's corners from its spine.
pub fn covering(
    map: &StripMap,
    f: usize,
    k: usize,
    visible: impl Fn(u32) -> bool,
) -> Option<(&StripCoverage, [f64; 3])> {
    let strip = &map.strips[map.covered[f][k]? as usize];
    visible(strip.curve).then(|| (strip, map.spine_distance[f][k].map(f64::from)))
}

/// Lines at whole fractions of the strip's width on either side, so that it ends with one.
pub fn stripes(strip: &StripCoverage, distance: [f64; 3]) -> Stripes {
    let lines = strip.widths.map(|b| (b / SPACING).round().clamp(1.0, 120.0));
    let side = |d: f64| usize::from(d < 0.0);
    let at = distance.map(|d| d / strip.widths[side(d)].max(1e-9) * lines[side(d)]);
    Stripes { at, reach: lines.map(|n| n as u8) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_strip_ends_with_a_line_on_both_sides() {
        let strip = StripCoverage { curve: 0, widths: [0.1, 0.05], faces: 3 };
        let Stripes { at, reach } = stripes(&strip, [0.1, 0.0, -0.05]);
        assert_eq!(reach, [8, 4]);
        assert!((at[0] - 8.0).abs() < 1e-12 && at[1] == 0.0 && (at[2] + 4.0).abs() < 1e-12);
    }
}

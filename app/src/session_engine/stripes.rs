//! The stripe pattern that shows what each strip covers: lines parallel to its spine.

use plait_core::strip::{StripCoverage, StripMap};

use crate::engine::Stripes;

/// Distance of two lines, as a fraction of the model size: dense enough for a texture, sparse enough to
/// follow a line. Chosen by hand.
const SPACING: f64 = 0.012;
/// Most lines on one side of a strip; the renderer stores their number in a byte.
const MAX_LINES: f64 = 120.0;

/// The pattern of each face along both families of isolines. `visible` says which curves show theirs.
pub(super) fn pattern(map: &StripMap, visible: impl Fn(u32) -> bool) -> Vec<[Option<Stripes>; 2]> {
    let family = |f: usize, k: usize| covering_strip(map, f, k, &visible).map(|(strip, at)| stripes(strip, at));
    (0..map.covered.len()).map(|f| [family(f, 0), family(f, 1)]).collect()
}

/// The visible strip of family `k` that covers face `f`, and the distances of the face's corners from its spine.
pub(super) fn covering_strip(
    map: &StripMap,
    f: usize,
    k: usize,
    visible: impl Fn(u32) -> bool,
) -> Option<(&StripCoverage, [f64; 3])> {
    let strip = &map.strips[map.covered[f][k]? as usize];
    visible(strip.curve).then(|| (strip, map.spine_distance[f][k].map(f64::from)))
}

/// Stripe coordinates from distances to the spine. Each side of the strip is divided evenly, so that it ends with a
/// line.
pub(super) fn stripes(strip: &StripCoverage, distance: [f64; 3]) -> Stripes {
    let lines = strip.widths.map(|b| (b / SPACING).round().clamp(1.0, MAX_LINES));
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

    #[test]
    fn a_wide_strip_has_at_most_as_many_lines_as_the_renderer_counts() {
        let strip = StripCoverage { curve: 0, widths: [10.0, 1e-6], faces: 1 };
        let Stripes { at, reach } = stripes(&strip, [10.0, 0.0, 0.0]);
        assert_eq!((reach, at[0]), ([120, 1], 120.0));
    }
}

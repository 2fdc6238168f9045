//! The colours that tell strips apart.
//!
//! Hues go from teal over blue and violet to magenta. The others have a meaning: green is a proposal, yellow, orange and
//! red are problems. Any number of strips gets colours: the hue advances by the golden ratio, so that each new one falls
//! into the widest gap between the earlier ones, and the lightness changes in turn.

use crate::engine::StripId;

/// First hue and range of hues, in degrees of the colour space OKLCH.
const HUES: [f32; 2] = [196.0, 146.0];
/// Where in the range the hue of the first strip is: blue.
const FIRST: f32 = 0.44;
/// The golden ratio less one.
const ADVANCE: f32 = 0.618_034;
/// Lightness of successive strips, 0 black to 1 white: dark enough for lines on the pale material. Chosen by hand.
const LIGHTNESS: [f32; 4] = [0.50, 0.66, 0.38, 0.58];
/// Chroma, less where the screen cannot show it. Chosen by hand.
const CHROMA: f32 = 0.19;

/// The colour of a strip: red, green, blue.
pub fn strip_rgb(strip: StripId) -> [u8; 3] {
    let turn = (FIRST + strip.0 as f32 * ADVANCE).fract();
    let lightness = LIGHTNESS[strip.0 as usize % LIGHTNESS.len()];
    let (sin, cos) = (HUES[0] + HUES[1] * turn).to_radians().sin_cos();
    let mut chroma = CHROMA;
    loop {
        let rgb = linear_rgb(lightness, chroma * cos, chroma * sin);
        // Grey, of chroma 0, can always be shown.
        if chroma < 1e-3 || rgb.iter().all(|c| (0.0..=1.0).contains(c)) {
            return rgb.map(encoded);
        }
        chroma *= 0.95;
    }
}

/// The colour of a strip, opaque.
pub fn strip_rgba(strip: StripId) -> [u8; 4] {
    let [r, g, b] = strip_rgb(strip);
    [r, g, b, 0xff]
}

/// Linear sRGB of a colour of OKLab (B. Ottosson, A perceptual color space for image processing, 2020).
fn linear_rgb(lightness: f32, a: f32, b: f32) -> [f32; 3] {
    let l = (lightness + 0.396_337_78 * a + 0.215_803_76 * b).powi(3);
    let m = (lightness - 0.105_561_346 * a - 0.063_854_17 * b).powi(3);
    let s = (lightness - 0.089_484_18 * a - 1.291_485_5 * b).powi(3);
    [
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_38 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ]
}

/// A channel in display (gamma) space.
fn encoded(c: f32) -> u8 {
    let c = c.clamp(0.0, 1.0);
    let gamma = if c < 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (gamma * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn difference(a: [u8; 3], b: [u8; 3]) -> i32 {
        (0..3).map(|i| i32::from(a[i].abs_diff(b[i]))).sum()
    }

    #[test]
    fn colours_of_strips_are_neither_those_of_problems_nor_that_of_proposals() {
        for i in 0..300 {
            let [r, g, b] = strip_rgb(StripId(i));
            // Red, orange and yellow have the least of blue; green has more green than blue.
            assert!(b >= 70 && b > r.saturating_sub(50) && b >= g.saturating_sub(25), "{i}: {r} {g} {b}");
        }
    }

    #[test]
    fn strips_placed_one_after_another_differ_in_colour() {
        let colours: Vec<_> = (0..60).map(|i| strip_rgb(StripId(i))).collect();
        for (i, &a) in colours.iter().enumerate() {
            for (j, &b) in colours.iter().enumerate().skip(i + 1) {
                let least = if j - i < 5 { 40 } else { 1 };
                assert!(difference(a, b) >= least, "{i} and {j}: {a:?} {b:?}");
            }
        }
    }

    #[test]
    fn white_and_black_are_converted_exactly() {
        assert_eq!(linear_rgb(1.0, 0.0, 0.0).map(encoded), [255; 3]);
        assert_eq!(linear_rgb(0.0, 0.0, 0.0).map(encoded), [0; 3]);
    }
}

//! Where the isolines between quads cross the strips of a layout, and how many there are.
//!
//! All patches of a strip share the lines that run along it, so that these are chosen once for each chord. At even steps
//! of the map a limb whose image is small would get few quads, and a map that keeps angles makes such images. Hence lines
//! are placed where they keep edges short on the surface: least is `Σ ∫ (h_u² (1 + β_u) + h_v² (1 + β_v)) dA` with the lengths
//! `h` of a quad's edges, for the number of quads wanted. `β` is the surface's curvature along them over its mean: an edge of
//! length `h` leaves the surface by `κ h² / 8`. With `L` the length on the surface of a way
//! across the whole chord at the rate of the place, and `e(t) = ∫ L² (1 + β) dA` over the line at share `t` of the chord's width, the
//! best density of lines is `e^⅓`; then the integral is `E / n²` for `n` quads across, where `E = (∫ e^⅓ dt)³`, and with
//! `Q` quads along the strip, `n³ Q` is proportional to `E`. Directions, and so angles, are those of the map all the same.

use glam::DVec3;

use crate::layout::{Patch, PatchMap, QuadLayout};
use crate::mesh::FaceId;

/// Parts of a strip's width in which `e` is found: some more than quads across usual patches.
const PARTS: usize = 32;
/// By what factor the density of lines may differ from the mean: more would be cells many times longer than wide.
const EXTREME: f64 = 2.0;
/// By what factor a way across a patch may be longer than the mean: a triangle whose image is next to nothing says nothing
/// of lines that miss it.
const LONGEST: f64 = 4.0;
/// How much the bend of the surface counts, at its mean, beside evenness; and how many times the mean counts at most: a crease
/// bends without end.
const BENT: f64 = 3.0;
const SHARPEST: f64 = 5.0;
/// By what factor lines become denser at most in one round where quads are far from the surface.
const CLOSER: f64 = 1.5;
/// Fewest quads across a chord: with three no two quads share two edges and none touches itself, however small the layout.
const FEWEST: u32 = 3;
/// Most quads across a chord.
const MOST: f64 = 1e4;
/// Most that rounding numbers of quads is made up for by a common factor, and halvings of the bracket of that.
const ROUNDING: f64 = 1.5;
const HALVINGS: usize = 24;
/// Rounds of finding numbers of quads that depend on each other: errors fall to a third in each.
const ROUNDS: usize = 20;

/// For each chord of a layout the lines along it.
#[derive(Debug, Clone)]
pub struct Spacing {
    /// Of each chord the places of the lines as shares of its width, ascending, without 0 and 1.
    of_chord: Vec<Vec<f64>>,
    /// Whether each arc runs across its chord in the direction that these are measured in.
    agrees: Vec<bool>,
    /// The chord of each arc.
    chord: Vec<u32>,
}

impl Spacing {
    /// So many quads across every chord at even steps of the map.
    pub fn even(layout: &QuadLayout, counts: &[u32]) -> Self {
        Self::new(layout, directions(layout), &vec![vec![1.0; PARTS]; counts.len()], counts)
    }

    /// About so many quads in all, of edges as short on the surface as can be, above all where and along which it bends:
    /// `bend` is how sharply it does, as curvature, at a triangle of the original mesh in a direction.
    pub fn curvature_adapted(
        layout: &QuadLayout,
        maps: &[PatchMap],
        bend: impl Fn(u32, DVec3) -> f64,
        quads: f64,
    ) -> Self {
        let agrees = directions(layout);
        let parts = spread(layout, maps, &bend, &agrees);
        let density: Vec<Vec<f64>> = parts.iter().map(|parts| densities(parts)).collect();
        let cost = |d: &Vec<f64>| (d.iter().sum::<f64>() / PARTS as f64).powi(3);
        let counts = counts(layout, &density.iter().map(cost).collect::<Vec<f64>>(), quads);
        Self::new(layout, agrees, &density, &counts)
    }

    fn new(layout: &QuadLayout, agrees: Vec<bool>, density: &[Vec<f64>], counts: &[u32]) -> Self {
        Self {
            of_chord: density.iter().zip(counts).map(|(density, &n)| quantiles(&parts(density), n)).collect(),
            agrees,
            chord: layout.arcs.iter().map(|a| a.chord).collect(),
        }
    }

    /// These lines with others between where edges across are far from the surface, and fewer elsewhere: about so many quads
    /// in `all`. For each quad of their refinement `far` tells how far its edges along either side are from the surface;
    /// those farther than `bound` are to come nearer.
    pub(super) fn nearer(&self, layout: &QuadLayout, far: &[[f64; 2]], bound: f64, all: f64) -> Self {
        let most = self.farthest(layout, far);
        let lines = self.of_chord.iter().zip(most).map(|(places, most)| {
            let ends = || [0.0].into_iter().chain(places.iter().copied()).chain([1.0]);
            let pieces = ends().zip(ends().skip(1)).zip(most);
            pieces.map(|((a, b), far)| (b - a, (far / bound).sqrt().clamp(1.0, CLOSER))).collect::<Vec<(f64, f64)>>()
        });
        let pieces: Vec<Vec<(f64, f64)>> = lines.collect();
        let count: Vec<f64> = pieces.iter().map(|p| p.iter().map(|piece| piece.1).sum()).collect();
        let counts = rounded(layout, &count, all);
        let of_chord = pieces.iter().zip(counts).map(|(pieces, n)| quantiles(pieces, n)).collect();
        Self { of_chord, agrees: self.agrees.clone(), chord: self.chord.clone() }
    }

    /// For each chord and piece between its lines how far edges across it are from the surface at most.
    fn farthest(&self, layout: &QuadLayout, far: &[[f64; 2]]) -> Vec<Vec<f64>> {
        let mut most: Vec<Vec<f64>> = self.of_chord.iter().map(|lines| vec![0.0; lines.len() + 1]).collect();
        let mut far = far.iter();
        for patch in &layout.patches {
            let [(c, along_c), (d, along_d)] = [0, 1].map(|i| {
                let (arc, forward) = patch.sides[i];
                (self.chord[arc as usize] as usize, self.agrees[arc as usize] == forward)
            });
            let (m, n) = (most[c].len(), most[d].len());
            for (j, i) in (0..n).flat_map(|j| (0..m).map(move |i| (j, i))) {
                let Some([across, up]) = far.next() else { continue };
                let piece = &mut most[c][if along_c { i } else { m - 1 - i }];
                *piece = piece.max(*across);
                let piece = &mut most[d][if along_d { j } else { n - 1 - j }];
                *piece = piece.max(*up);
            }
        }
        most
    }

    /// The places of the lines along an arc, as shares of the whole from its first node on; from the second if it is not
    /// to be followed `forward`.
    pub fn along(&self, arc: u32, forward: bool) -> Vec<f64> {
        let list = &self.of_chord[self.chord[arc as usize] as usize];
        if self.agrees[arc as usize] == forward { list.clone() } else { list.iter().rev().map(|s| 1.0 - s).collect() }
    }
}

/// The number of quads across every chord where all chords are multiples of `edge` in the maps, and by what share of an
/// edge some chord is off at most.
pub fn integer_grid_counts(layout: &QuadLayout, maps: &[PatchMap], edge: f64) -> (Vec<u32>, f64) {
    let mut counts = vec![1; layout.chords];
    let mut off = 0.0f64;
    for (p, map) in layout.patches.iter().zip(maps) {
        for (i, length) in [(0, map.size.x), (1, map.size.y)] {
            let chord = layout.arcs[p.sides[i].0 as usize].chord as usize;
            let count = (length / edge).round().clamp(1.0, 1e4);
            off = off.max((length / edge - count).abs());
            counts[chord] = count as u32;
        }
    }
    (counts, off)
}

/// Directs every arc across its chord such that opposite sides of a patch run the same way; tells whether that is its own
/// direction. On a surface with two sides there is such a choice.
fn directions(layout: &QuadLayout) -> Vec<bool> {
    let mut across: Vec<Vec<(u32, bool)>> = vec![Vec::new(); layout.arcs.len()];
    for patch in &layout.patches {
        for i in 0..2 {
            let ((a, f), (b, g)) = (patch.sides[i], patch.sides[i + 2]);
            // Both sides are gone around the patch, hence against each other.
            across[a as usize].push((b, f != g));
            across[b as usize].push((a, f != g));
        }
    }
    let mut agrees = vec![None; layout.arcs.len()];
    for start in 0..agrees.len() {
        if agrees[start].is_some() {
            continue;
        }
        agrees[start] = Some(true);
        let mut stack = vec![start];
        while let Some(a) = stack.pop() {
            let own = agrees[a] == Some(true);
            for &(b, alike) in &across[a] {
                let slot = &mut agrees[b as usize];
                if slot.is_none() {
                    *slot = Some(own == alike);
                    stack.push(b as usize);
                }
            }
        }
    }
    agrees.into_iter().map(|a| a.unwrap_or(true)).collect()
}

/// The numbers of quads across all chords that make about so many quads in `all`, given for each the integral `E`.
fn counts(layout: &QuadLayout, cost: &[f64], all: f64) -> Vec<u32> {
    let chords = |p: &Patch| [0, 1].map(|i| layout.arcs[p.sides[i].0 as usize].chord as usize);
    let mut count = vec![1.0; layout.chords];
    for _ in 0..ROUNDS {
        let mut along = vec![0.0; layout.chords];
        for [c, d] in layout.patches.iter().map(chords) {
            along[c] += count[d];
            along[d] += count[c];
        }
        for (n, (e, q)) in count.iter_mut().zip(cost.iter().zip(along)) {
            *n = (e / q).cbrt();
        }
        let sum: f64 = layout.patches.iter().map(chords).map(|[c, d]| count[c] * count[d]).sum();
        count.iter_mut().for_each(|n| *n = (*n * (all / sum).sqrt()).clamp(1.0, MOST));
    }
    rounded(layout, &count, all)
}

/// Whole numbers of quads across all chords, in proportion to those given, that make about so many quads in `all`.
fn rounded(layout: &QuadLayout, count: &[f64], all: f64) -> Vec<u32> {
    let chords = |p: &Patch| [0, 1].map(|i| layout.arcs[p.sides[i].0 as usize].chord as usize);
    // Rounded they make another number in all; a common factor makes up for that.
    let rounded = |by: f64| count.iter().map(|n| ((n * by).round() as u32).max(FEWEST)).collect::<Vec<u32>>();
    let made = |by: f64| {
        let n = rounded(by);
        layout.patches.iter().map(chords).map(|[c, d]| f64::from(n[c]) * f64::from(n[d])).sum::<f64>()
    };
    let (mut few, mut many) = (1.0 / ROUNDING, ROUNDING);
    for _ in 0..HALVINGS {
        let by = 0.5 * (few + many);
        *(if made(by) < all { &mut few } else { &mut many }) = by;
    }
    let nearest = [few, many].into_iter().min_by(|x, y| (made(*x) - all).abs().total_cmp(&(made(*y) - all).abs()));
    rounded(nearest.unwrap_or(1.0))
}

/// For each chord the integrals of `L² (1 + β)` over parts of its width, all along the strip.
fn spread(
    layout: &QuadLayout,
    maps: &[PatchMap],
    bend: &impl Fn(u32, DVec3) -> f64,
    agrees: &[bool],
) -> Vec<[f64; PARTS]> {
    let usual = usual_bend(maps, bend);
    let weight = |base: u32, along: DVec3| 1.0 + BENT * (bend(base, along) / usual).min(SHARPEST);
    let mut sums = vec![[0.0; PARTS]; layout.chords];
    for (patch, map) in layout.patches.iter().zip(maps) {
        for axis in 0..2 {
            let (arc, forward) = patch.sides[axis];
            let agrees = agrees[arc as usize] == forward;
            let parts = &mut sums[layout.arcs[arc as usize].chord as usize];
            each_step(map, axis, &weight, |corners, length, area| {
                let corners = if agrees { corners } else { corners.map(|t| 1.0 - t) };
                let mut below = 0.0;
                for (k, sum) in parts.iter_mut().enumerate() {
                    let next = share_below(corners, (k + 1) as f64 / PARTS as f64);
                    *sum += length * length * area * (next - below);
                    below = next;
                }
            });
        }
    }
    sums
}

/// The share of a triangle's area where a coordinate, given at its corners, is below a value.
fn share_below(mut corners: [f64; 3], value: f64) -> f64 {
    corners.sort_unstable_by(f64::total_cmp);
    let [low, middle, high] = corners;
    if value <= low {
        0.0
    } else if value < middle {
        (value - low).powi(2) / ((middle - low) * (high - low))
    } else if value < high {
        1.0 - (high - value).powi(2) / ((high - low) * (high - middle))
    } else {
        1.0
    }
}

/// The mean of how sharply the surface bends along the isolines of all patches.
fn usual_bend(maps: &[PatchMap], bend: &impl Fn(u32, DVec3) -> f64) -> f64 {
    let (mut all, mut area) = (0.0, 0.0);
    for (map, axis) in maps.iter().flat_map(|map| [(map, 0), (map, 1)]) {
        each_step(map, axis, &|base, along| bend(base, along), |_, _, bent| all += bent);
        area += map.mesh.faces().map(|f| map.mesh.face_area(f)).sum::<f64>();
    }
    (all / area).max(f64::MIN_POSITIVE)
}

/// Shows every triangle of a patch: one coordinate of its corners, as shares of the whole; the length on the surface of the
/// whole way at its rate; and its area on the surface, times what `weight` says of its base and that way's direction.
fn each_step(
    map: &PatchMap,
    axis: usize,
    weight: &impl Fn(u32, DVec3) -> f64,
    mut visit: impl FnMut([f64; 3], f64, f64),
) {
    let other = 1 - axis;
    let step = |f: FaceId| {
        let corners = map.mesh.face_vertices(f);
        let [p, q, r] = corners.map(|v| map.mesh.position(v));
        let [a, b, c] = corners.map(|v| map.uv[v.index()]);
        let image = (b - a).perp_dot(c - a);
        let along = ((q - p) * (c - a)[other] - (r - p) * (b - a)[other]) / image;
        let length = along.length() * map.size[axis];
        let shares = [a, b, c].map(|w| (w[axis] / map.size[axis]).clamp(0.0, 1.0));
        (image > 0.0 && length.is_finite()).then_some((shares, along, length, image))
    };
    let (mut total, mut images) = (0.0, 0.0);
    for (_, _, length, image) in map.mesh.faces().filter_map(step) {
        total += length * image;
        images += image;
    }
    let longest = LONGEST * total / images;
    for f in map.mesh.faces() {
        if let Some((shares, along, length, _)) = step(f) {
            let area = map.mesh.face_area(f) * weight(map.base_face[f.index()], along.normalize_or_zero());
            visit(shares, length.min(longest), area);
        }
    }
}

/// The best density of lines in all parts of a chord; in those without anything it is the mean, and nowhere extreme.
fn densities(parts: &[f64]) -> Vec<f64> {
    let best: Vec<f64> = parts.iter().map(|e| (e * PARTS as f64).cbrt()).collect();
    let some: Vec<f64> = best.iter().copied().filter(|d| *d > 0.0).collect();
    let mean = some.iter().sum::<f64>() / some.len().max(1) as f64;
    if !(mean > 0.0 && mean.is_finite()) {
        return vec![1.0; parts.len()];
    }
    best.iter().map(|&d| if d > 0.0 { d.clamp(mean / EXTREME, mean * EXTREME) } else { mean }).collect()
}

/// Pieces of equal length with these densities.
fn parts(density: &[f64]) -> Vec<(f64, f64)> {
    density.iter().map(|&d| (1.0 / density.len() as f64, d)).collect()
}

/// The places that part a way into `n` of equal weight, where its pieces have these lengths, 1 in all, and weights.
fn quantiles(pieces: &[(f64, f64)], n: u32) -> Vec<f64> {
    let total: f64 = pieces.iter().map(|piece| piece.1).sum();
    let (mut piece, mut start, mut before) = (0, 0.0, 0.0);
    let place = |i: u32| {
        let want = total * f64::from(i) / f64::from(n);
        while piece + 1 < pieces.len() && before + pieces[piece].1 < want {
            start += pieces[piece].0;
            before += pieces[piece].1;
            piece += 1;
        }
        let (length, weight) = pieces[piece];
        start + length * ((want - before) / weight).clamp(0.0, 1.0)
    };
    (1..n).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_a_triangle_are_those_of_its_area() {
        let corners = [0.7, 0.1, 0.4];
        // By many points of the triangle.
        let n = 400;
        let points = (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j)));
        let at = |(i, j): (usize, usize)| {
            let [x, y] = [i, j].map(|k| (k as f64 + 1.0 / 3.0) / n as f64);
            corners[0] + (corners[1] - corners[0]) * x + (corners[2] - corners[0]) * y
        };
        let all: Vec<f64> = points.map(at).collect();
        for value in [0.0, 0.2, 0.4, 0.55, 0.9] {
            let counted = all.iter().filter(|t| **t < value).count() as f64 / all.len() as f64;
            assert!((share_below(corners, value) - counted).abs() < 0.01, "{value}");
        }
    }

    #[test]
    fn lines_are_dense_where_they_are_to_be() {
        let places = quantiles(&parts(&[1.0, 1.0, 2.0, 4.0]), 8);
        let expected = [0.25, 0.5, 0.625, 0.75, 0.8125, 0.875, 0.9375];
        assert!(places.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{places:?}");
        assert!(quantiles(&parts(&[1.0; PARTS]), 1).is_empty());
    }
}

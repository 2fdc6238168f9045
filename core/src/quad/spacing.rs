//! Spacing of isolines: how many quads there are across each chord, and where the isolines between them lie.
//!
//! All patches of a chord share the isolines along it, so they are chosen once for each chord. Uniform steps in the map
//! would give few quads to a limb with a small image, and an angle-preserving map makes such images. So isolines are
//! placed such that edges are short on the surface: for the requested number of quads they minimise
//! `Σ ∫ (h_u² (1 + β_u) + h_v² (1 + β_v)) dA`, where `h` are the edge lengths of a quad and `β` is the curvature `κ`
//! along the edge relative to its mean. The curvature counts because an edge of length `h` is up to `κ h² / 8` off the
//! surface.
//!
//! For one chord let `L` be the length on the surface of its whole width, extrapolated from the local rate of the map,
//! and `e(t) = ∫ L² (1 + β) dA` over the line at fraction `t` of the width. The optimal density of isolines is
//! proportional to `e^⅓`. The integral is then `E / n²` for `n` quads across, with `E = (∫ e^⅓ dt)³`; the optimal `n`
//! satisfies `n³ Q ∝ E` with `Q` the number of quads along the chord. Directions of edges, and so angles, remain those
//! of the map.

use glam::DVec3;

use crate::layout::{Patch, PatchMap, QuadLayout};
use crate::mesh::FaceId;

/// Intervals of a chord's width for which `e` is integrated; a few more than the usual number of quads across a chord.
const INTERVALS: usize = 32;
/// Greatest ratio of the density of isolines to its mean, and of the mean to it. More would make cells many times
/// longer than wide.
const DENSITY_RATIO: f64 = 2.0;
/// Greatest `L` at a triangle, relative to the mean over its patch. The rate of the map at a triangle with a tiny image
/// says nothing about isolines that do not meet it.
const LENGTH_RATIO: f64 = 4.0;
/// Weight of the mean curvature relative to the edge length: `β = 3 κ / κ̄`.
const CURVATURE_WEIGHT: f64 = 3.0;
/// Greatest `κ / κ̄`; at a crease the curvature is unbounded.
const CURVATURE_RATIO: f64 = 5.0;
/// Greatest factor of the density in one round of [`Spacing::denser`].
const REFINEMENT: f64 = 1.5;
/// Least number of quads across a chord. With three no two quads share two edges and none touches itself, in any
/// layout.
const LEAST_COUNT: u32 = 3;
/// Greatest number of quads across a chord.
const GREATEST_COUNT: f64 = 1e4;
/// Greatest common factor of the counts that compensates for rounding, and bisection steps to find it.
const ROUNDING: f64 = 1.5;
const BISECTIONS: usize = 24;
/// Iterations for the counts of all chords, which depend on each other; errors fall to a third in each.
const ITERATIONS: usize = 20;

/// The isolines along each chord of a layout.
#[derive(Debug, Clone)]
pub struct Spacing {
    /// For each chord the positions of its isolines as fractions of its width, ascending, without 0 and 1.
    of_chord: Vec<Vec<f64>>,
    /// Whether each arc has the direction in which its chord's width is measured.
    agrees: Vec<bool>,
    /// The chord of each arc.
    chord: Vec<u32>,
}

/// An interval of a chord's width.
#[derive(Debug, Clone, Copy)]
struct Interval {
    /// Fraction of the width.
    length: f64,
    /// Relative number of isolines in it.
    weight: f64,
}

impl Spacing {
    /// `counts[c]` quads across chord `c`, uniformly in the map.
    pub fn even(layout: &QuadLayout, counts: &[u32]) -> Self {
        Self::new(layout, directions(layout), &vec![vec![1.0; INTERVALS]; counts.len()], counts)
    }

    /// About `quads` quads in all, with edges short on the surface above all where and in the direction in which it is
    /// curved. `curvature` gives the absolute normal curvature at a triangle of the original mesh in a direction.
    pub fn curvature_adapted(
        layout: &QuadLayout,
        maps: &[PatchMap],
        curvature: impl Fn(u32, DVec3) -> f64,
        quads: f64,
    ) -> Self {
        let agrees = directions(layout);
        let integrals = width_integrals(layout, maps, &curvature, &agrees);
        let density: Vec<Vec<f64>> = integrals.iter().map(|e| optimal_density(e)).collect();
        // `E` of the chord.
        let total = |d: &Vec<f64>| (d.iter().sum::<f64>() / INTERVALS as f64).powi(3);
        let counts = optimal_counts(layout, &density.iter().map(total).collect::<Vec<f64>>(), quads);
        Self::new(layout, agrees, &density, &counts)
    }

    fn new(layout: &QuadLayout, agrees: Vec<bool>, density: &[Vec<f64>], counts: &[u32]) -> Self {
        Self {
            of_chord: density.iter().zip(counts).map(|(d, &n)| quantiles(&equal_intervals(d), n)).collect(),
            agrees,
            chord: layout.arcs.iter().map(|a| a.chord).collect(),
        }
    }

    /// These isolines, denser where edges are far from the surface and sparser elsewhere, for about `total` quads.
    ///
    /// `distance` has for each quad of the refinement, in order, the distances of its edges along either axis from the
    /// surface. Where they exceed `bound` the density increases.
    pub(super) fn denser(&self, layout: &QuadLayout, distance: &[[f64; 2]], bound: f64, total: f64) -> Self {
        let greatest = self.greatest_distances(layout, distance);
        let intervals: Vec<Vec<Interval>> = self
            .of_chord
            .iter()
            .zip(greatest)
            .map(|(isolines, distances)| {
                let ends = || [0.0].into_iter().chain(isolines.iter().copied()).chain([1.0]);
                // The distance is quadratic in the edge length, so the density grows with its square root.
                let weight = |distance: f64| (distance / bound).sqrt().clamp(1.0, REFINEMENT);
                let pairs = ends().zip(ends().skip(1)).zip(distances);
                pairs.map(|((a, b), distance)| Interval { length: b - a, weight: weight(distance) }).collect()
            })
            .collect();
        let counts: Vec<f64> = intervals.iter().map(|list| list.iter().map(|i| i.weight).sum()).collect();
        let counts = rounded_counts(layout, &counts, total);
        let of_chord = intervals.iter().zip(counts).map(|(list, n)| quantiles(list, n)).collect();
        Self { of_chord, agrees: self.agrees.clone(), chord: self.chord.clone() }
    }

    /// For each chord and each interval between its isolines the greatest distance of edges across it from the surface.
    fn greatest_distances(&self, layout: &QuadLayout, distance: &[[f64; 2]]) -> Vec<Vec<f64>> {
        let mut greatest: Vec<Vec<f64>> = self.of_chord.iter().map(|isolines| vec![0.0; isolines.len() + 1]).collect();
        let mut distance = distance.iter();
        for patch in &layout.patches {
            let [(c, along_c), (d, along_d)] = [0, 1].map(|i| {
                let (arc, forward) = patch.sides[i];
                (self.chord[arc as usize] as usize, self.agrees[arc as usize] == forward)
            });
            let (m, n) = (greatest[c].len(), greatest[d].len());
            for (j, i) in (0..n).flat_map(|j| (0..m).map(move |i| (j, i))) {
                let Some([across, up]) = distance.next() else { continue };
                let interval = &mut greatest[c][if along_c { i } else { m - 1 - i }];
                *interval = interval.max(*across);
                let interval = &mut greatest[d][if along_d { j } else { n - 1 - j }];
                *interval = interval.max(*up);
            }
        }
        greatest
    }

    /// The positions of the isolines along an arc as fractions of it, from its first node on; from its second node if
    /// not `forward`.
    pub fn along(&self, arc: u32, forward: bool) -> Vec<f64> {
        let list = &self.of_chord[self.chord[arc as usize] as usize];
        if self.agrees[arc as usize] == forward { list.clone() } else { list.iter().rev().map(|s| 1.0 - s).collect() }
    }
}

/// The numbers of quads across all chords of an integer-grid map with this `edge` length (in units of the maps), and the
/// greatest difference between a chord's width and its number, in edges.
pub fn integer_grid_counts(layout: &QuadLayout, maps: &[PatchMap], edge: f64) -> (Vec<u32>, f64) {
    let mut counts = vec![1; layout.chords];
    let mut error = 0.0f64;
    for (p, map) in layout.patches.iter().zip(maps) {
        for (i, length) in [(0, map.size.x), (1, map.size.y)] {
            let chord = layout.arcs[p.sides[i].0 as usize].chord as usize;
            let count = (length / edge).round().clamp(1.0, GREATEST_COUNT);
            error = error.max((length / edge - count).abs());
            counts[chord] = count as u32;
        }
    }
    (counts, error)
}

/// Directs every arc across its chord such that opposite sides of a patch have the same direction; returns for each arc
/// whether that is its own direction. On an orientable surface there is such a choice.
fn directions(layout: &QuadLayout) -> Vec<bool> {
    let mut across: Vec<Vec<(u32, bool)>> = vec![Vec::new(); layout.arcs.len()];
    for patch in &layout.patches {
        for i in 0..2 {
            let ((a, f), (b, g)) = (patch.sides[i], patch.sides[i + 2]);
            // Sides are listed around the patch, so opposite ones are listed in opposite directions.
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

/// The two chords of a patch.
fn chords(layout: &QuadLayout, patch: &Patch) -> [usize; 2] {
    [0, 1].map(|i| layout.arcs[patch.sides[i].0 as usize].chord as usize)
}

/// The numbers of quads across all chords for about `total` quads, given the integral `E` of each: a fixed-point
/// iteration of `n³ Q ∝ E`.
fn optimal_counts(layout: &QuadLayout, integral: &[f64], total: f64) -> Vec<u32> {
    let mut count = vec![1.0; layout.chords];
    for _ in 0..ITERATIONS {
        let mut along = vec![0.0; layout.chords];
        for [c, d] in layout.patches.iter().map(|p| chords(layout, p)) {
            along[c] += count[d];
            along[d] += count[c];
        }
        for (n, (e, q)) in count.iter_mut().zip(integral.iter().zip(along)) {
            *n = (e / q).cbrt();
        }
        let sum: f64 = layout.patches.iter().map(|p| chords(layout, p)).map(|[c, d]| count[c] * count[d]).sum();
        count.iter_mut().for_each(|n| *n = (*n * (total / sum).sqrt()).clamp(1.0, GREATEST_COUNT));
    }
    rounded_counts(layout, &count, total)
}

/// Integer numbers of quads across all chords, proportional to `count` up to rounding, for about `total` quads.
fn rounded_counts(layout: &QuadLayout, count: &[f64], total: f64) -> Vec<u32> {
    // Rounding changes the total; a common factor, found by bisection, compensates for it.
    let rounded = |by: f64| count.iter().map(|n| ((n * by).round() as u32).max(LEAST_COUNT)).collect::<Vec<u32>>();
    let quads = |by: f64| {
        let n = rounded(by);
        let of_patch = |[c, d]: [usize; 2]| f64::from(n[c]) * f64::from(n[d]);
        layout.patches.iter().map(|p| chords(layout, p)).map(of_patch).sum::<f64>()
    };
    let (mut few, mut many) = (1.0 / ROUNDING, ROUNDING);
    for _ in 0..BISECTIONS {
        let by = 0.5 * (few + many);
        *(if quads(by) < total { &mut few } else { &mut many }) = by;
    }
    let nearest =
        [few, many].into_iter().min_by(|x, y| (quads(*x) - total).abs().total_cmp(&(quads(*y) - total).abs()));
    rounded(nearest.unwrap_or(1.0))
}

/// For each chord the integrals of `L² (1 + β)` over the intervals of its width, along the whole chord.
fn width_integrals(
    layout: &QuadLayout,
    maps: &[PatchMap],
    curvature: &impl Fn(u32, DVec3) -> f64,
    agrees: &[bool],
) -> Vec<[f64; INTERVALS]> {
    let mean = mean_curvature(maps, curvature);
    let weight =
        |base: u32, along: DVec3| 1.0 + CURVATURE_WEIGHT * (curvature(base, along) / mean).min(CURVATURE_RATIO);
    let mut sums = vec![[0.0; INTERVALS]; layout.chords];
    for (patch, map) in layout.patches.iter().zip(maps) {
        for axis in 0..2 {
            let (arc, forward) = patch.sides[axis];
            let agrees = agrees[arc as usize] == forward;
            let intervals = &mut sums[layout.arcs[arc as usize].chord as usize];
            for_each_triangle(map, axis, &weight, |corners, length, area| {
                let corners = if agrees { corners } else { corners.map(|t| 1.0 - t) };
                let mut below = 0.0;
                for (k, sum) in intervals.iter_mut().enumerate() {
                    let next = fraction_below(corners, (k + 1) as f64 / INTERVALS as f64);
                    *sum += length * length * area * (next - below);
                    below = next;
                }
            });
        }
    }
    sums
}

/// The fraction of a triangle's area where a linear function, given at its corners, is below a value.
fn fraction_below(mut corners: [f64; 3], value: f64) -> f64 {
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

/// The mean curvature `κ̄` along the isolines of all patches.
fn mean_curvature(maps: &[PatchMap], curvature: &impl Fn(u32, DVec3) -> f64) -> f64 {
    let (mut integral, mut area) = (0.0, 0.0);
    for (map, axis) in maps.iter().flat_map(|map| [(map, 0), (map, 1)]) {
        for_each_triangle(map, axis, &|base, along| curvature(base, along), |_, _, weighted| integral += weighted);
        area += map.mesh.faces().map(|f| map.mesh.face_area(f)).sum::<f64>();
    }
    (integral / area).max(f64::MIN_POSITIVE)
}

/// Calls `visit` for every triangle of a patch with: the coordinate along `axis` of its corners, as fractions of the
/// whole width; the length `L` on the surface of the whole width at the triangle's rate; and its area on the surface
/// times `weight`, a function of the triangle of the original mesh and the direction of increasing coordinate.
fn for_each_triangle(
    map: &PatchMap,
    axis: usize,
    weight: &impl Fn(u32, DVec3) -> f64,
    mut visit: impl FnMut([f64; 3], f64, f64),
) {
    let other = 1 - axis;
    let measure = |f: FaceId| {
        let corners = map.mesh.face_vertices(f);
        let [p, q, r] = corners.map(|v| map.mesh.position(v));
        let [a, b, c] = corners.map(|v| map.uv[v.index()]);
        let image = (b - a).perp_dot(c - a);
        let along = ((q - p) * (c - a)[other] - (r - p) * (b - a)[other]) / image;
        let length = along.length() * map.size[axis];
        let fractions = [a, b, c].map(|w| (w[axis] / map.size[axis]).clamp(0.0, 1.0));
        (image > 0.0 && length.is_finite()).then_some((fractions, along, length, image))
    };
    let (mut total, mut images) = (0.0, 0.0);
    for (_, _, length, image) in map.mesh.faces().filter_map(measure) {
        total += length * image;
        images += image;
    }
    let greatest = LENGTH_RATIO * total / images;
    for f in map.mesh.faces() {
        if let Some((fractions, along, length, _)) = measure(f) {
            let area = map.mesh.face_area(f) * weight(map.base_face[f.index()], along.normalize_or_zero());
            visit(fractions, length.min(greatest), area);
        }
    }
}

/// The optimal density of isolines in the intervals of a chord, in proportion to `e^⅓` within [`DENSITY_RATIO`] of the
/// mean; the mean where `e` is 0.
fn optimal_density(integrals: &[f64]) -> Vec<f64> {
    let best: Vec<f64> = integrals.iter().map(|e| (e * INTERVALS as f64).cbrt()).collect();
    let positive: Vec<f64> = best.iter().copied().filter(|d| *d > 0.0).collect();
    let mean = positive.iter().sum::<f64>() / positive.len().max(1) as f64;
    if !(mean > 0.0 && mean.is_finite()) {
        return vec![1.0; integrals.len()];
    }
    let clamped = |d: f64| d.clamp(mean / DENSITY_RATIO, mean * DENSITY_RATIO);
    best.iter().map(|&d| if d > 0.0 { clamped(d) } else { mean }).collect()
}

/// Intervals of equal length with these densities.
fn equal_intervals(density: &[f64]) -> Vec<Interval> {
    density.iter().map(|&weight| Interval { length: 1.0 / density.len() as f64, weight }).collect()
}

/// The positions that divide a chord's width into `n` parts of equal weight.
fn quantiles(intervals: &[Interval], n: u32) -> Vec<f64> {
    let total: f64 = intervals.iter().map(|i| i.weight).sum();
    let (mut k, mut start, mut before) = (0, 0.0, 0.0);
    let position = |i: u32| {
        let wanted = total * f64::from(i) / f64::from(n);
        while k + 1 < intervals.len() && before + intervals[k].weight < wanted {
            start += intervals[k].length;
            before += intervals[k].weight;
            k += 1;
        }
        let Interval { length, weight } = intervals[k];
        start + length * ((wanted - before) / weight).clamp(0.0, 1.0)
    };
    (1..n).map(position).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn quantiles_divide_the_weight_into_equal_parts(
            density in prop::collection::vec(0.1f64..4.0, 1..12),
            n in 1u32..20,
        ) {
            let intervals = equal_intervals(&density);
            let positions = quantiles(&intervals, n);
            prop_assert_eq!(positions.len() as u32, n - 1);
            let ends: Vec<f64> = [0.0].into_iter().chain(positions).chain([1.0]).collect();
            let weight_below = |t: f64| -> f64 {
                let at = t * density.len() as f64;
                density.iter().enumerate().map(|(k, d)| d * (at - k as f64).clamp(0.0, 1.0)).sum()
            };
            let part = density.iter().sum::<f64>() / f64::from(n);
            for pair in ends.windows(2) {
                prop_assert!(pair[0] < pair[1], "{:?}", ends);
                prop_assert!((weight_below(pair[1]) - weight_below(pair[0]) - part).abs() < 1e-9, "{:?}", ends);
            }
        }
    }

    #[test]
    fn the_fraction_below_a_value_agrees_with_sampling() {
        let corners = [0.7, 0.1, 0.4];
        // Sample points on a regular grid of the triangle.
        let n = 400;
        let points = (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j)));
        let at = |(i, j): (usize, usize)| {
            let [x, y] = [i, j].map(|k| (k as f64 + 1.0 / 3.0) / n as f64);
            corners[0] + (corners[1] - corners[0]) * x + (corners[2] - corners[0]) * y
        };
        let all: Vec<f64> = points.map(at).collect();
        for value in [0.0, 0.2, 0.4, 0.55, 0.9] {
            let counted = all.iter().filter(|t| **t < value).count() as f64 / all.len() as f64;
            assert!((fraction_below(corners, value) - counted).abs() < 0.01, "{value}");
        }
    }

    #[test]
    fn isolines_follow_the_density() {
        let positions = quantiles(&equal_intervals(&[1.0, 1.0, 2.0, 4.0]), 8);
        let expected = [0.25, 0.5, 0.625, 0.75, 0.8125, 0.875, 0.9375];
        assert!(positions.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{positions:?}");
        assert!(quantiles(&equal_intervals(&[1.0; INTERVALS]), 1).is_empty());
    }
}

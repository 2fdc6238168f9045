//! How strongly a strip is drawn at each vertex of its sheets: it fades where it is cut off or its map is distorted.
//!
//! The drawn part is an opening of the sheet: what lies within the distance [`SOFT`] of a *core*, whose points are farther
//! than that from every cut; only large parts of it that contain a piece of the spine count. So the pattern ends in a soft edge instead of the outline of
//! triangles. Slivers of a sheet, and parts where a strip has turned around a singularity, would be stubs and tangles; they
//! are not drawn at all.

use glam::DVec3;
use plait_core::mesh::{Dijkstra, components};

use super::sheet::{Sheets, following, preceding};
use super::smooth::Gradients;

/// Width of the soft edge, in model sizes. With less, holes of a few triangles and the jagged borders of strips
/// show; with more, narrow parts of strips are lost. Chosen by hand.
const SOFT: f64 = 0.018;
/// Least width of the soft edge, in mean edge lengths: on a coarse mesh it must reach across a triangle. Chosen by hand.
const SOFT_EDGES: f64 = 1.3;
/// Largest ratio of the way to the spine to the distance from it. The map is nearly isometric, so where the way is longer the
/// strip has turned around a singularity. The ways are those along edges, up to a sixth longer than straight ones.
const DETOUR: f64 = 2.0;
/// Length that the way may have in addition, in mean edge lengths.
const DETOUR_SLACK: f64 = 1.5;
/// Least extent of a part of the core, in widths of the soft edge: smaller parts would be stubs. Chosen by hand.
const LEAST_EXTENT: f64 = 3.0;
/// Lengths of the gradient of the distance that count as undistorted. It is 1 for an isometric map.
const UNDISTORTED: std::ops::RangeInclusive<f64> = 0.30..=3.0;
/// Length of the mean gradient around a vertex relative to the mean of the lengths. Below this, the isolines turn by more
/// than about 45 degrees from triangle to triangle. Chosen by hand.
const COHERENT: f64 = 0.72;

/// The strength at each vertex, 0 to 1.
pub fn strengths(sheets: &Sheets, gradients: &Gradients<'_>, mean_edge: f64) -> Vec<f64> {
    let soft = SOFT.max(SOFT_EDGES * mean_edge);
    let to_spine = distances(sheets, gradients, (0..sheets.len()).filter(|&v| sheets.is_on_spine(v)));
    let bad = |v: usize| {
        let detour = to_spine[v] > DETOUR * sheets.distance[v].abs() + DETOUR_SLACK * mean_edge;
        let (length, coherence) = (gradients.at_vertex[v].length(), gradients.coherence[v]);
        sheets.cut[v] || detour || !UNDISTORTED.contains(&length) || coherence < COHERENT
    };
    let to_cut = distances(sheets, gradients, (0..sheets.len()).filter(|&v| bad(v)));
    let core = large_parts(sheets, gradients, |v| to_cut[v] >= soft, |v| to_cut[v].is_infinite(), LEAST_EXTENT * soft);
    let to_core = distances(sheets, gradients, (0..sheets.len()).filter(|&v| core[v]));
    to_core.into_iter().map(|d| (1.0 - d / soft).clamp(0.0, 1.0)).collect()
}

/// The vertices `inside` that belong to a connected part with a piece of a spine and at least the given extent. Of `whole`
/// sheets the extent does not matter.
fn large_parts(
    sheets: &Sheets,
    gradients: &Gradients<'_>,
    inside: impl Fn(usize) -> bool,
    whole: impl Fn(usize) -> bool,
    extent: f64,
) -> Vec<bool> {
    let joined = |v: u32| {
        let corners = if inside(v as usize) { sheets.corners(v as usize) } else { &[] };
        sheets.neighbours(corners).filter(|&w| inside(w as usize))
    };
    let (part, n_parts) = components(sheets.len(), joined);
    let mut boxes = vec![(DVec3::MAX, DVec3::MIN); n_parts];
    let (mut has_spine, mut is_large) = (vec![false; n_parts], vec![false; n_parts]);
    for (v, &p) in part.iter().enumerate() {
        let (p, at) = (p as usize, gradients.position(sheets.corners(v)[0]));
        boxes[p] = (boxes[p].0.min(at), boxes[p].1.max(at));
        has_spine[p] |= sheets.is_on_spine(v);
        is_large[p] |= whole(v) || boxes[p].0.distance(boxes[p].1) >= extent;
    }
    let is_kept = |(v, &p): (usize, &u32)| inside(v) && has_spine[p as usize] && is_large[p as usize];
    part.iter().enumerate().map(is_kept).collect()
}

/// The distance of each vertex from the nearest start, along edges; infinite where there is none on its sheet.
fn distances(sheets: &Sheets, gradients: &Gradients<'_>, starts: impl Iterator<Item = usize>) -> Vec<f64> {
    let mut search: Dijkstra<u32, ()> = Dijkstra::new(sheets.len());
    for v in starts {
        search.start(v as u32, 0.0);
    }
    while let Some((v, distance)) = search.settle() {
        for &c in sheets.corners(v as usize) {
            for other in [following(c), preceding(c)] {
                let length = gradients.side(c, other).length();
                search.reach(sheets.vertex_of_corner[other as usize], distance + length, ());
            }
        }
    }
    (0..sheets.len() as u32).map(|v| search.distance(v)).collect()
}

//! How strongly a strip is drawn at each vertex of its sheets: it fades where it is cut off or its map is distorted.
//!
//! The drawn part is an opening of the sheet: what lies within the distance [`SOFT`] of a *core*, whose points are farther
//! than that from every cut and connected with the spine. So the pattern ends in a soft edge instead of the outline of
//! triangles. Slivers of a sheet, and parts where a strip has turned around a singularity, would be stubs and tangles; they
//! are not drawn at all.

use plait_core::mesh::{BreadthFirst, Dijkstra};

use super::sheet::{Sheets, following, preceding};
use super::smooth::Gradients;

/// Width of the soft edge, in bounding-box diagonals. With less, holes of a few triangles and the jagged borders of strips
/// show; with more, narrow parts of strips are lost. Chosen by hand.
const SOFT: f64 = 0.018;
/// Least width of the soft edge, in mean edge lengths: on a coarse mesh it must reach across a triangle. Chosen by hand.
const SOFT_EDGES: f64 = 1.3;
/// Largest ratio of the way to the spine to the distance from it. The map is nearly isometric, so where the way is longer the
/// strip has turned around a singularity. The ways are those along edges, up to a sixth longer than straight ones.
const DETOUR: f64 = 2.0;
/// Length that the way may have in addition, in mean edge lengths.
const DETOUR_SLACK: f64 = 1.5;
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
    // A sheet without a cut is not reached, and therefore all core.
    let core = connected_with_spine(sheets, |v| to_cut[v] >= soft);
    let to_core = distances(sheets, gradients, (0..sheets.len()).filter(|&v| core[v]));
    to_core.into_iter().map(|d| (1.0 - d / soft).clamp(0.0, 1.0)).collect()
}

/// Which vertices are connected with a spine by vertices that are `inside`.
fn connected_with_spine(sheets: &Sheets, inside: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut search: BreadthFirst<u32, ()> = BreadthFirst::new(sheets.len());
    for v in (0..sheets.len()).filter(|&v| inside(v) && sheets.is_on_spine(v)) {
        search.start(v as u32);
    }
    while let Some(v) = search.visit() {
        for other in sheets.neighbours(v as usize).filter(|&w| inside(w as usize)) {
            search.reach(other, ());
        }
    }
    (0..sheets.len() as u32).map(|v| search.is_reached(v)).collect()
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

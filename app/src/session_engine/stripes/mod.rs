//! The stripe pattern that shows what each strip covers: lines parallel to its spine.
//!
//! The strip map gives the distance from the spine at every corner of the covered triangles. [`sheet`] joins these
//! triangles, [`fade`] finds where the pattern ends, [`refill`] closes the holes that this leaves in other strips, and
//! [`smooth`] makes the distances smooth. The shader draws the lines
//! from the [`Stripes`] of each triangle.

mod fade;
mod refill;
mod sheet;
mod smooth;
#[cfg(test)]
mod tests;

use plait_core::mesh::TriMesh;
use plait_core::strip::StripMap;
use plait_core::weave::Session;
use rayon::prelude::*;

use self::sheet::{Cover, Sheets, following, preceding};
use self::smooth::Gradients;
use crate::engine::{StripId, Stripes};

/// Distances at a corner that differ by no more, in model sizes, belong to the same part of a strip: its
/// continuation over a triangle is not exact. Less than the width of most strips. Chosen by hand.
const SAME_SHEET: f64 = 0.01;

/// The stripe pattern on the mesh of a strip map.
pub(super) struct Pattern {
    /// The pattern of each face along both families of isolines.
    pub(super) stripes: Vec<[Option<Stripes>; 2]>,
}

impl Pattern {
    /// The pattern of the visible strips of a session, on the woven mesh; `None` without a strip map.
    pub(super) fn of(session: &Session) -> Option<Self> {
        let (woven, strips) = (session.woven(), &session.design().strips);
        let shown = |curve: u32| strips.get(curve as usize).filter(|s| s.visible).map(|s| StripId(s.id.0));
        woven.strip_map.as_ref().map(|map| Self::new(&woven.mesh, map, shown))
    }

    /// The pattern of the strips of `map`, a strip map of `mesh`. `shown` gives the identifier of each curve, or `None` if its
    /// strip is hidden.
    pub(super) fn new(mesh: &TriMesh, map: &StripMap, shown: impl Fn(u32) -> Option<StripId> + Sync) -> Self {
        let cover = Cover::new(mesh, map);
        let sheets = Sheets::new(&cover);
        let strengths = fade::strengths(&sheets, &Gradients::new(mesh, &sheets), mesh.mean_edge_length());
        let cover = refill::refilled(&cover, map, &sheets, &strengths);
        let mut sheets = Sheets::new(&cover);
        let gradients = smooth::smooth(mesh, &mut sheets);
        let strengths = fade::strengths(&sheets, &gradients, mesh.mean_edge_length());
        let family = |f: usize, k: usize| {
            let strip = &map.strips[cover.strip[f][k]? as usize];
            Some(stripes(&sheets, &gradients, &strengths, shown(strip.curve)?, strip.widths, [f, k]))
        };
        let pattern = |f: usize| [family(f, 0), family(f, 1)];
        Self { stripes: (0..mesh.n_faces()).into_par_iter().map(pattern).collect() }
    }
}

/// The stripes of a strip with these widths on face `f` along family `k`.
fn stripes(
    sheets: &Sheets,
    gradients: &Gradients<'_>,
    strengths: &[f64],
    strip: StripId,
    widths: [f64; 2],
    [f, k]: [usize; 2],
) -> Stripes {
    let vertices = sheets.triangle(f, k);
    let distance = vertices.map(|v| sheets.distance[v]);
    let corner = (6 * f + 3 * k) as u32;
    let corners = [corner, following(corner), preceding(corner)];
    let bulge = [0, 1, 2].map(|i| gradients.bulge(sheets, corners[i], corners[(i + 1) % 3]));
    let right = distance.iter().sum::<f64>() < 0.0;
    Stripes { strip, at: distance, bulge, reach: widths[usize::from(right)], strength: vertices.map(|v| strengths[v]) }
}

/// The stripes of a triangle of another mesh: those of the face of the pattern under its middle, `stripes`, continued to its
/// corners. `corner(i)` is the pattern at the face under corner `i` with the barycentric coordinates of the corner, and
/// `outside(i)` the coordinates of the corner in the face under the middle.
pub(super) fn transferred(
    stripes: &Stripes,
    corner: impl Fn(usize) -> ([Option<Stripes>; 2], [f64; 3]),
    outside: impl Fn(usize) -> [f64; 3],
) -> Stripes {
    let at_corner = |i: usize| {
        let (straight, strength) = Stripes { bulge: [0.0; 3], ..*stripes }.sample(outside(i));
        let (there, weights) = corner(i);
        let same = there.into_iter().flatten().filter(|s| s.strip == stripes.strip).map(|s| s.sample(weights));
        let nearest = same.min_by(|a, b| (a.0 - straight).abs().total_cmp(&(b.0 - straight).abs()));
        nearest.filter(|s| (s.0 - straight).abs() < SAME_SHEET).unwrap_or((straight, strength))
    };
    let corners = [0, 1, 2].map(at_corner);
    Stripes { at: corners.map(|c| c.0), strength: corners.map(|c| c.1), bulge: [0.0; 3], ..*stripes }
}

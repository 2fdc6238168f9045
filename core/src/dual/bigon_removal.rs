//! Removal of bigons: pairs of crossings of two curves that a homotopy can remove.
//!
//! Where two curves cross twice in a row and run close to each other in between, their stretches between the two crossings
//! are exchanged. Such bigons arise when curves that run side by side, or cross at a small angle, are mapped onto another
//! mesh, and span a few triangles. Larger bigons are kept, as they may not be contractible.

use std::collections::HashMap;

use glam::DVec2;

use crate::mesh::{FaceId, TriMesh};
use crate::surface::{Crossing, SurfaceCurve};

/// Largest number of mesh edges that the two stretches of a bigon cross together. Chosen by hand.
const MAX_STRETCH_EDGES: usize = 24;
/// Largest number of bigons removed, far above the number that occurs: the loop ends even if an exchange adds crossings.
const MAX_BIGONS: usize = 1000;

/// A position on a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CurvePosition {
    curve: usize,
    /// The mesh-edge crossing after it.
    step: usize,
    /// Fraction of the chord between the crossing before and the crossing after.
    t: f64,
}

/// The part of a curve in a triangle.
struct Chord {
    curve: usize,
    /// The mesh-edge crossing at its end.
    step: usize,
    ends: [DVec2; 2],
}

/// Exchanges the stretches of `curves` that bound small bigons, until there are none. Returns the number of bigons removed.
pub fn remove_bigons(mesh: &TriMesh, curves: &mut [SurfaceCurve]) -> usize {
    let mut removed = 0;
    while removed < MAX_BIGONS
        && let Some([a, b]) = smallest_bigon(mesh, curves)
    {
        exchange(mesh, curves, a, b);
        removed += 1;
    }
    removed
}

/// A stretch of a curve between two intersections, in the direction of the curve.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    curve: usize,
    /// Its first mesh-edge crossing.
    from: usize,
    /// The number of its mesh-edge crossings.
    count: usize,
    /// Whether it runs from the intersection of larger index to that of smaller index.
    backward: bool,
}

/// The two stretches of the bigon with the fewest mesh-edge crossings, if that is small enough.
fn smallest_bigon(mesh: &TriMesh, curves: &[SurfaceCurve]) -> Option<[Stretch; 2]> {
    let intersections = intersections(mesh, curves);
    // The intersections along each curve: position and index.
    let mut along: Vec<Vec<(CurvePosition, usize)>> = vec![Vec::new(); curves.len()];
    for (i, positions) in intersections.iter().enumerate() {
        for position in positions {
            along[position.curve].push((*position, i));
        }
    }
    for list in &mut along {
        list.sort_by(|a, b| a.0.step.cmp(&b.0.step).then(a.0.t.total_cmp(&b.0.t)));
    }
    // The stretches between consecutive intersections of a curve, by the pair of intersections.
    let mut between: HashMap<[usize; 2], Vec<Stretch>> = HashMap::new();
    for (curve, list) in along.iter().enumerate() {
        let n = curves[curve].crossings.len();
        let pairs = if curves[curve].closed { list.len() } else { list.len().saturating_sub(1) };
        for k in 0..pairs {
            let ((from, x), (to, y)) = (list[k], list[(k + 1) % list.len()]);
            if x == y {
                continue;
            }
            let around = if k + 1 == list.len() { n } else { 0 };
            let count = to.step + around - from.step;
            let stretch = Stretch { curve, from: from.step, count, backward: x > y };
            between.entry([x.min(y), x.max(y)]).or_default().push(stretch);
        }
    }
    let mut found: Vec<[Stretch; 2]> = Vec::new();
    for list in between.values() {
        for (i, &a) in list.iter().enumerate() {
            let fits = |b: &&Stretch| a.count + b.count <= MAX_STRETCH_EDGES && disjoint(&a, b, curves);
            found.extend(list[i + 1..].iter().find(fits).map(|&b| [a, b]));
        }
    }
    // The minimum does not depend on the order of the map.
    found.into_iter().min_by_key(|[a, b]| (a.count + b.count, a.curve, a.from, b.curve, b.from))
}

/// Whether two stretches have no mesh-edge crossing in common, nor make up a whole curve.
fn disjoint(a: &Stretch, b: &Stretch, curves: &[SurfaceCurve]) -> bool {
    let n = curves[a.curve].crossings.len();
    let within = |s: &Stretch, at: usize| (at + n - s.from) % n < s.count;
    a.curve != b.curve || (0..b.count).all(|k| !within(a, (b.from + k) % n)) && a.count + b.count < n
}

/// All intersections of curves, each as the position on both curves; by face.
fn intersections(mesh: &TriMesh, curves: &[SurfaceCurve]) -> Vec<[CurvePosition; 2]> {
    let mut in_face: HashMap<FaceId, Vec<Chord>> = HashMap::new();
    for (curve, c) in curves.iter().enumerate() {
        let n = c.crossings.len();
        for step in usize::from(!c.closed)..n {
            let to = c.crossings[step];
            let before = c.crossings[(step + n - 1) % n];
            let from = match mesh.twin(before.halfedge) {
                Some(twin) => Crossing { halfedge: twin, t: 1.0 - before.t },
                None => before,
            };
            let ends = [from, to].map(in_reference_triangle);
            in_face.entry(mesh.face(to.halfedge)).or_default().push(Chord { curve, step, ends });
        }
    }
    let mut faces: Vec<FaceId> = in_face.keys().copied().collect();
    faces.sort_unstable();
    let mut found = Vec::new();
    for chords in faces.iter().map(|f| &in_face[f]) {
        for (i, p) in chords.iter().enumerate() {
            for q in &chords[i + 1..] {
                if let Some((s, t)) = chord_intersection(p.ends, q.ends) {
                    found.push([(p, s), (q, t)].map(|(x, t)| CurvePosition { curve: x.curve, step: x.step, t }));
                }
            }
        }
    }
    found
}

/// A mesh-edge crossing on the border of the reference triangle. Whether chords intersect does not depend on the shape of
/// the triangle.
fn in_reference_triangle(at: Crossing) -> DVec2 {
    const CORNERS: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::Y];
    let i = at.halfedge.index() % 3;
    CORNERS[i].lerp(CORNERS[(i + 1) % 3], at.t)
}

/// Intersection of two chords, as fractions of them; `None` if they do not intersect.
fn chord_intersection([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> Option<(f64, f64)> {
    let (u, v) = (b - a, d - c);
    let turn = u.perp_dot(v);
    let (s, t) = ((c - a).perp_dot(v) / turn, (c - a).perp_dot(u) / turn);
    (s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0).then_some((s, t))
}

/// Exchanges the stretches of two curves.
fn exchange(mesh: &TriMesh, curves: &mut [SurfaceCurve], a: Stretch, b: Stretch) {
    let crossings_of = |s: &Stretch, backward: bool| -> Vec<Crossing> {
        let list = &curves[s.curve].crossings;
        let mut taken: Vec<Crossing> = (0..s.count).map(|k| list[(s.from + k) % list.len()]).collect();
        if backward {
            taken.reverse();
            // A stretch between two intersections crosses no boundary edge, so each half-edge has a twin.
            taken
                .iter_mut()
                .for_each(|c| *c = Crossing { halfedge: mesh.twin(c.halfedge).unwrap_or(c.halfedge), t: 1.0 - c.t });
        }
        taken
    };
    let turned = a.backward != b.backward;
    let (for_b, for_a) = (crossings_of(&a, turned), crossings_of(&b, turned));
    let replacements = [(a, for_a), (b, for_b)];
    let mut affected = vec![a.curve, b.curve];
    affected.dedup();
    for curve in affected {
        let own: Vec<&(Stretch, Vec<Crossing>)> = replacements.iter().filter(|(s, _)| s.curve == curve).collect();
        let SurfaceCurve { crossings, closed } = &curves[curve];
        curves[curve].crossings = without_backtracking(mesh, replace_stretches(crossings, own), *closed);
    }
}

/// Crossings in which stretches are replaced by other crossings.
fn replace_stretches(crossings: &[Crossing], mut replacements: Vec<&(Stretch, Vec<Crossing>)>) -> Vec<Crossing> {
    let n = crossings.len();
    let contains = |s: &Stretch, k: usize| s.from == k || (k + n - s.from) % n < s.count;
    // Start outside all stretches. The first crossing of an open curve belongs to no stretch.
    let start = (0..n).find(|&k| !replacements.iter().any(|(s, _)| contains(s, k))).unwrap_or(0);
    let mut new = Vec::with_capacity(n + MAX_STRETCH_EDGES);
    let mut k = 0;
    while k < n {
        let at = (start + k) % n;
        if let Some(i) = replacements.iter().position(|(s, _)| s.from == at) {
            let (stretch, replacement) = replacements.swap_remove(i);
            new.extend_from_slice(replacement);
            k += stretch.count;
        } else {
            new.push(crossings[at]);
            k += 1;
        }
    }
    new
}

/// Removes pairs of consecutive crossings of an edge and back.
fn without_backtracking(mesh: &TriMesh, crossings: Vec<Crossing>, closed: bool) -> Vec<Crossing> {
    let goes_back = |a: &Crossing, b: &Crossing| mesh.twin(a.halfedge) == Some(b.halfedge);
    let mut kept: Vec<Crossing> = Vec::with_capacity(crossings.len());
    for c in crossings {
        match kept.last() {
            Some(last) if goes_back(last, &c) => drop(kept.pop()),
            _ => kept.push(c),
        }
    }
    while closed && kept.len() > 2 && goes_back(&kept[kept.len() - 1], &kept[0]) {
        kept.pop();
        kept.remove(0);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::HalfedgeId;
    use crate::testing::torus;

    /// The closed curve along a row of cells of a torus, from the half-edge `first` on, at the fraction `t` of each edge.
    fn row_curve(mesh: &TriMesh, first: HalfedgeId, t: impl Fn(usize) -> f64) -> SurfaceCurve {
        let mut crossings = Vec::new();
        let mut h = first;
        loop {
            // Alternately across one and the other of the two other sides of the triangle: straight along a row of cells.
            crossings.push(Crossing { halfedge: h, t: t(crossings.len()) });
            let g = mesh.twin(h).expect("closed");
            h = if crossings.len() % 2 == 1 { mesh.next(g) } else { mesh.prev(g) };
            if h == first {
                break;
            }
        }
        SurfaceCurve { crossings, closed: true }
    }

    fn row(mesh: &TriMesh) -> HalfedgeId {
        let closes = |h: &HalfedgeId| row_length(mesh, *h).is_some_and(|n| n >= 8);
        mesh.halfedges().find(closes).expect("a row")
    }

    fn row_length(mesh: &TriMesh, first: HalfedgeId) -> Option<usize> {
        let mut h = first;
        for k in 1..200 {
            let g = mesh.twin(h)?;
            h = if k % 2 == 1 { mesh.next(g) } else { mesh.prev(g) };
            if h == first && k % 2 == 0 {
                return Some(k);
            }
        }
        None
    }

    fn count(mesh: &TriMesh, curves: &[SurfaceCurve]) -> usize {
        intersections(mesh, curves).len()
    }

    #[test]
    fn bigons_of_curves_side_by_side_are_removed() {
        let mesh = torus(8, 8);
        let first = row(&mesh);
        let along = |k: usize, off: f64| if k.is_multiple_of(2) { 0.5 + off } else { 0.5 - off };
        let straight = row_curve(&mesh, first, |k| along(k, 0.0));
        let wavy = row_curve(&mesh, first, |k| along(k, if k % 5 < 2 { 0.1 } else { -0.1 }));
        let mut curves = [straight, wavy];
        let before = count(&mesh, &curves);
        assert!(before >= 4 && before.is_multiple_of(2), "{before}");
        assert_eq!(remove_bigons(&mesh, &mut curves), before / 2);
        assert_eq!(count(&mesh, &curves), 0);
        curves.iter().for_each(|c| c.check(&mesh).expect("a curve"));
        let all: usize = curves.iter().map(|c| c.crossings.len()).sum();
        assert_eq!(all, 2 * row_length(&mesh, first).expect("closes"));
    }

    #[test]
    fn the_direction_of_curves_does_not_matter() {
        let mesh = torus(8, 8);
        let first = row(&mesh);
        let straight = row_curve(&mesh, first, |_| 0.5);
        let mut other = row_curve(&mesh, first, |k| if k % 6 < 3 { 0.4 } else { 0.6 });
        other.crossings.reverse();
        for c in &mut other.crossings {
            *c = Crossing { halfedge: mesh.twin(c.halfedge).expect("closed"), t: 1.0 - c.t };
        }
        let mut curves = [straight, other];
        let before = count(&mesh, &curves);
        assert!(before > 0);
        remove_bigons(&mesh, &mut curves);
        assert!(count(&mesh, &curves) < 2, "{before}");
        curves.iter().for_each(|c| c.check(&mesh).expect("a curve"));
    }

    #[test]
    fn necessary_crossings_remain() {
        let mesh = torus(8, 8);
        let first = row(&mesh);
        // At different fractions of the edges, so that the curves do not cross on an edge.
        let straight = |h: HalfedgeId| row_curve(&mesh, h, |_| if h == first { 0.5 } else { 0.4 });
        // A row in the other direction around the torus.
        let rows = mesh.halfedges().filter(|&h| row_length(&mesh, h).is_some());
        let across = rows.into_iter().find(|&h| count(&mesh, &[straight(first), straight(h)]) % 2 == 1);
        let wavy = |h: HalfedgeId, by: f64| row_curve(&mesh, h, |k| if k % 3 == 0 { 0.5 - by } else { 0.5 + by });
        let mut curves = [wavy(first, 0.3), wavy(across.expect("a row across"), 0.4)];
        remove_bigons(&mesh, &mut curves);
        assert_eq!(count(&mesh, &curves), 1);
        curves.iter().for_each(|c| c.check(&mesh).expect("a curve"));
    }
}

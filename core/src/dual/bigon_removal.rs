//! Crossings of curves that need not be.
//!
//! Two curves that cross twice in a row and go the same way between are pulled apart by letting each go the other's way
//! there. This happens to curves that run beside each other or cross at a small angle when they are laid onto another
//! mesh, as a matter of a triangle or two; longer ways are left alone, since they may lead around something.

use std::collections::HashMap;

use glam::DVec2;

use crate::mesh::{FaceId, TriMesh};
use crate::surface::{Crossing, SurfaceCurve};

/// Edges that both ways together cross at most.
const LONGEST: usize = 24;
/// Pairs of crossings removed at most, which is far more than there ever are.
const MOST: usize = 1000;

/// A place on a curve: the curve, the crossing before which it lies, and how far along between the two.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    curve: usize,
    step: usize,
    t: f64,
}

/// A piece of a curve in a triangle.
struct Piece {
    curve: usize,
    step: usize,
    ends: [DVec2; 2],
}

/// Removes the crossings of curves that lie in pairs a few triangles apart; tells how many pairs there were.
pub fn remove_bigons(mesh: &TriMesh, curves: &mut [SurfaceCurve]) -> usize {
    let mut removed = 0;
    while removed < MOST
        && let Some([a, b]) = bigon(mesh, curves)
    {
        swap(mesh, curves, a, b);
        removed += 1;
    }
    removed
}

/// A stretch of a curve, in its direction, from the first step of which on crossings belong to it up to the last.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    curve: usize,
    from: usize,
    /// How many crossings it has.
    count: usize,
    /// Whether it is to be passed backward to go as the other stretch does.
    backward: bool,
}

/// Two stretches between the same two meetings, if there are any that are short.
fn bigon(mesh: &TriMesh, curves: &[SurfaceCurve]) -> Option<[Stretch; 2]> {
    let meetings = meetings(mesh, curves);
    // The meetings along every curve, each with what lies there on the other side.
    let mut along: Vec<Vec<(Place, usize)>> = vec![Vec::new(); curves.len()];
    for (i, meeting) in meetings.iter().enumerate() {
        for place in meeting {
            along[place.curve].push((*place, i));
        }
    }
    for list in &mut along {
        list.sort_by(|a, b| a.0.step.cmp(&b.0.step).then(a.0.t.total_cmp(&b.0.t)));
    }
    // Every pair of meetings that follow each other on a curve, with the stretch between.
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
            let fits = |b: &&Stretch| a.count + b.count <= LONGEST && apart(&a, b, curves);
            found.extend(list[i + 1..].iter().find(fits).map(|&b| [a, b]));
        }
    }
    // The same whatever the order of the map.
    found.into_iter().min_by_key(|[a, b]| (a.count + b.count, a.curve, a.from, b.curve, b.from))
}

/// Whether two stretches have no crossing in common.
fn apart(a: &Stretch, b: &Stretch, curves: &[SurfaceCurve]) -> bool {
    let n = curves[a.curve].crossings.len();
    let within = |s: &Stretch, at: usize| (at + n - s.from) % n < s.count;
    a.curve != b.curve || (0..b.count).all(|k| !within(a, (b.from + k) % n)) && a.count + b.count < n
}

/// All places where curves cross, on either curve.
fn meetings(mesh: &TriMesh, curves: &[SurfaceCurve]) -> Vec<[Place; 2]> {
    let mut in_face: HashMap<FaceId, Vec<Piece>> = HashMap::new();
    for (curve, c) in curves.iter().enumerate() {
        let n = c.crossings.len();
        for step in usize::from(!c.closed)..n {
            let to = c.crossings[step];
            let before = c.crossings[(step + n - 1) % n];
            let from = match mesh.twin(before.halfedge) {
                Some(twin) => Crossing { halfedge: twin, t: 1.0 - before.t },
                None => before,
            };
            let ends = [from, to].map(on_border);
            in_face.entry(mesh.face(to.halfedge)).or_default().push(Piece { curve, step, ends });
        }
    }
    let mut faces: Vec<FaceId> = in_face.keys().copied().collect();
    faces.sort_unstable();
    let mut found = Vec::new();
    for pieces in faces.iter().map(|f| &in_face[f]) {
        for (i, p) in pieces.iter().enumerate() {
            for q in &pieces[i + 1..] {
                if let Some((s, t)) = meet(p.ends, q.ends) {
                    found.push([(p, s), (q, t)].map(|(x, t)| Place { curve: x.curve, step: x.step, t }));
                }
            }
        }
    }
    found
}

/// A crossing in the plane of a triangle, whatever its shape: where pieces cross is the same in all.
fn on_border(at: Crossing) -> DVec2 {
    const CORNERS: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::Y];
    let i = at.halfedge.index() % 3;
    CORNERS[i].lerp(CORNERS[(i + 1) % 3], at.t)
}

/// Where two pieces cross, as fractions of them.
fn meet([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> Option<(f64, f64)> {
    let (u, v) = (b - a, d - c);
    let turn = u.perp_dot(v);
    let (s, t) = ((c - a).perp_dot(v) / turn, (c - a).perp_dot(u) / turn);
    (s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0).then_some((s, t))
}

/// Lets each of two curves go the other's way.
fn swap(mesh: &TriMesh, curves: &mut [SurfaceCurve], a: Stretch, b: Stretch) {
    let taken = |s: &Stretch, backward: bool| -> Vec<Crossing> {
        let list = &curves[s.curve].crossings;
        let mut way: Vec<Crossing> = (0..s.count).map(|k| list[(s.from + k) % list.len()]).collect();
        if backward {
            way.reverse();
            // Inside the surface every edge has two sides.
            way.iter_mut()
                .for_each(|c| *c = Crossing { halfedge: mesh.twin(c.halfedge).unwrap_or(c.halfedge), t: 1.0 - c.t });
        }
        way
    };
    let turned = a.backward != b.backward;
    let (for_b, for_a) = (taken(&a, turned), taken(&b, turned));
    let ways = [(a, for_a), (b, for_b)];
    let mut names = vec![a.curve, b.curve];
    names.dedup();
    for curve in names {
        let own: Vec<&(Stretch, Vec<Crossing>)> = ways.iter().filter(|(s, _)| s.curve == curve).collect();
        let SurfaceCurve { crossings, closed } = &curves[curve];
        curves[curve].crossings = straightened(mesh, spliced(crossings, own), *closed);
    }
}

/// Crossings with stretches replaced.
fn spliced(crossings: &[Crossing], mut ways: Vec<&(Stretch, Vec<Crossing>)>) -> Vec<Crossing> {
    let n = crossings.len();
    let begins = |s: &Stretch, k: usize| s.from == k || (k + n - s.from) % n < s.count;
    // The first crossing of an open curve belongs to no stretch.
    let start = (0..n).find(|&k| !ways.iter().any(|(s, _)| begins(s, k))).unwrap_or(0);
    let mut new = Vec::with_capacity(n + LONGEST);
    let mut k = 0;
    while k < n {
        let at = (start + k) % n;
        if let Some(i) = ways.iter().position(|(s, _)| s.from == at) {
            let (stretch, way) = ways.swap_remove(i);
            new.extend_from_slice(way);
            k += stretch.count;
        } else {
            new.push(crossings[at]);
            k += 1;
        }
    }
    new
}

/// Crossings without those that go over an edge and at once back again.
fn straightened(mesh: &TriMesh, crossings: Vec<Crossing>, closed: bool) -> Vec<Crossing> {
    let back = |a: &Crossing, b: &Crossing| mesh.twin(a.halfedge) == Some(b.halfedge);
    let mut kept: Vec<Crossing> = Vec::with_capacity(crossings.len());
    for c in crossings {
        match kept.last() {
            Some(last) if back(last, &c) => drop(kept.pop()),
            _ => kept.push(c),
        }
    }
    while closed && kept.len() > 2 && back(&kept[kept.len() - 1], &kept[0]) {
        kept.pop();
        kept.remove(0);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::samples::torus;
    use crate::mesh::HalfedgeId;

    /// A closed curve once around a torus of `n` by `m` cells along row `j`, at `t` of each of the edges it crosses.
    fn around(mesh: &TriMesh, first: HalfedgeId, t: impl Fn(usize) -> f64) -> SurfaceCurve {
        let mut crossings = Vec::new();
        let mut h = first;
        loop {
            // Alternately over the one and the other of the triangle's two other sides: straight along a row of cells.
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
        let closes = |h: &HalfedgeId| around_len(mesh, *h).is_some_and(|n| n >= 8);
        mesh.halfedges().find(closes).expect("a row")
    }

    fn around_len(mesh: &TriMesh, first: HalfedgeId) -> Option<usize> {
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
        meetings(mesh, curves).len()
    }

    #[test]
    fn curves_beside_each_other_that_wriggle_are_pulled_apart() {
        let mesh = torus(8, 8);
        let first = row(&mesh);
        let along = |k: usize, off: f64| if k.is_multiple_of(2) { 0.5 + off } else { 0.5 - off };
        let straight = around(&mesh, first, |k| along(k, 0.0));
        let wriggling = around(&mesh, first, |k| along(k, if k % 5 < 2 { 0.1 } else { -0.1 }));
        let mut curves = [straight, wriggling];
        let before = count(&mesh, &curves);
        assert!(before >= 4 && before.is_multiple_of(2), "{before}");
        assert_eq!(remove_bigons(&mesh, &mut curves), before / 2);
        assert_eq!(count(&mesh, &curves), 0);
        curves.iter().for_each(|c| c.check(&mesh).expect("a curve"));
        let all: usize = curves.iter().map(|c| c.crossings.len()).sum();
        assert_eq!(all, 2 * around_len(&mesh, first).expect("closes"));
    }

    #[test]
    fn the_direction_of_a_curve_does_not_matter() {
        let mesh = torus(8, 8);
        let first = row(&mesh);
        let straight = around(&mesh, first, |_| 0.5);
        let mut other = around(&mesh, first, |k| if k % 6 < 3 { 0.4 } else { 0.6 });
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
    fn curves_that_must_cross_still_do() {
        let mesh = torus(8, 8);
        let first = row(&mesh);
        // At different places of the edges: where both pass one they do not meet on it.
        let straight = |h: HalfedgeId| around(&mesh, h, |_| if h == first { 0.5 } else { 0.4 });
        // A row the other way around the torus.
        let rows = mesh.halfedges().filter(|&h| around_len(&mesh, h).is_some());
        let across = rows.into_iter().find(|&h| count(&mesh, &[straight(first), straight(h)]) % 2 == 1);
        let wriggling = |h: HalfedgeId, by: f64| around(&mesh, h, |k| if k % 3 == 0 { 0.5 - by } else { 0.5 + by });
        let mut curves = [wriggling(first, 0.3), wriggling(across.expect("a row across"), 0.4)];
        remove_bigons(&mesh, &mut curves);
        assert_eq!(count(&mesh, &curves), 1);
        curves.iter().for_each(|c| c.check(&mesh).expect("a curve"));
    }
}

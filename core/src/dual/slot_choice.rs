//! Choosing where a new curve crosses its mesh edges, between the curves that are there already.
//!
//! The vertices of older curves divide a mesh edge into slots. Within a triangle a new chord crosses an older one if and only
//! if their ends alternate around the triangle, so the slots on consecutive edges determine the number of crossings. A
//! shortest path over slots (cyclic for closed curves) gives the fewest crossings, and with equally many the least
//! displacement. So curves that run side by side through the same triangles do not cross each other repeatedly, even if
//! their parameters are equal.

use crate::mesh::{HalfedgeId, TriMesh};
use crate::surface::SurfaceCurve;

/// End of a chord: side of the triangle, and position along the half-edge of that side.
pub(super) type ChordEnd = (u32, f64);

/// Cost of one crossing; a displacement costs at most 1 per mesh edge. Chosen by hand, above the number of edges that a curve
/// crosses.
const CROSSING: f64 = 1e4;

/// Least distance from the ends of a slot, as a fraction of the mesh edge, at which a new vertex is placed in the slot that
/// contains it already. Chosen by hand.
const SLOT_MARGIN: f64 = 0.02;

/// The slots for one crossing of the new curve with a mesh edge.
struct Slots {
    /// Per slot: the position of the crossing in it, along the crossing's half-edge.
    positions: Vec<f64>,
    /// Per slot: the displacement of the crossing, as a fraction of the edge.
    displacements: Vec<f64>,
}

/// For each crossing of `curve` the position on its edge, along the crossing's half-edge.
///
/// `taken(h)` are the positions of older vertices along half-edge `h`, increasing; `chords(f)` are the chords of older
/// curves in face `f`.
pub(super) fn choose(
    mesh: &TriMesh,
    curve: &SurfaceCurve,
    taken: impl Fn(HalfedgeId) -> Vec<f64>,
    chords: impl Fn(u32) -> Vec<(ChordEnd, ChordEnd)>,
) -> Vec<f64> {
    let n = curve.crossings.len();
    let choices: Vec<Slots> = curve.crossings.iter().map(|c| slots(&taken(c.halfedge), c.t)).collect();
    let first = if curve.closed { (0..n).min_by_key(|&i| choices[i].positions.len()).unwrap_or(0) } else { 0 };
    let starts: Vec<Option<usize>> =
        if curve.closed { (0..choices[first].positions.len()).map(Some).collect() } else { vec![None] };
    let steps = if curve.closed { n } else { n - 1 };
    let links: Vec<Vec<Vec<f64>>> = (0..steps)
        .map(|k| {
            let (i, j) = ((first + k) % n, (first + k + 1) % n);
            crossing_costs(mesh, curve, (i, j), (&choices[i], &choices[j]), &chords)
        })
        .collect();
    let mut best: Option<(f64, Vec<usize>)> = None;
    for start in starts {
        let (cost, picks) = shortest(&choices, &links, first, start, curve.closed);
        if best.as_ref().is_none_or(|b| cost < b.0) {
            best = Some((cost, picks));
        }
    }
    let picks = best.map_or_else(|| vec![0; n], |b| b.1);
    let mut positions = vec![0.0; n];
    for (k, pick) in picks.into_iter().enumerate() {
        let i = (first + k) % n;
        positions[i] = choices[i].positions[pick];
    }
    positions
}

/// The slots between `taken` positions. In the slot that contains `t` the position is `t`; in the others it is near the end
/// towards `t`.
fn slots(taken: &[f64], t: f64) -> Slots {
    let mut slots = Slots { positions: Vec::new(), displacements: Vec::new() };
    for k in 0..=taken.len() {
        let low = if k == 0 { 0.0 } else { taken[k - 1] };
        let high = taken.get(k).copied().unwrap_or(1.0);
        // A third of the slot is left free towards either neighbour.
        let margin = (high - low) / 3.0;
        let inside = t.clamp(low + margin.min(SLOT_MARGIN), high - margin.min(SLOT_MARGIN));
        let position = if (low..high).contains(&t) { inside } else { t.clamp(low + margin, high - margin) };
        slots.positions.push(position);
        slots.displacements.push((position - t).abs());
    }
    slots
}

/// Cost of the crossings with older chords, for each pair of slots of the consecutive crossings `i` and `j`.
fn crossing_costs(
    mesh: &TriMesh,
    curve: &SurfaceCurve,
    (i, j): (usize, usize),
    (from, to): (&Slots, &Slots),
    chords: &impl Fn(u32) -> Vec<(ChordEnd, ChordEnd)>,
) -> Vec<Vec<f64>> {
    let exit = curve.crossings[j].halfedge;
    let face = mesh.face(exit);
    // The half-edge of the entry in this triangle. The start of an open curve already is in it.
    let left = curve.crossings[i].halfedge;
    let (entry, flipped) = if mesh.face(left) == face && (!curve.closed && i == 0) {
        (left, false)
    } else {
        (mesh.twin(left).unwrap_or(left), true)
    };
    let older = chords(face.0);
    let around = |(side, t): ChordEnd| f64::from(side) + t;
    let count = |a: f64, b: f64| {
        let (low, high) = (a.min(b), a.max(b));
        let inside = |x: f64| x > low && x < high;
        older.iter().filter(|(x, y)| inside(around(*x)) != inside(around(*y))).count() as f64
    };
    from.positions
        .iter()
        .map(|&s| {
            let a = f64::from(entry.0 % 3) + if flipped { 1.0 - s } else { s };
            to.positions.iter().map(|&t| CROSSING * count(a, f64::from(exit.0 % 3) + t)).collect()
        })
        .collect()
}

/// The cheapest choice of slots from crossing `first` on, and its cost; with `start`, from and back to that slot.
fn shortest(
    choices: &[Slots],
    links: &[Vec<Vec<f64>>],
    first: usize,
    start: Option<usize>,
    closed: bool,
) -> (f64, Vec<usize>) {
    let n = choices.len();
    let at = |k: usize| &choices[(first + k) % n];
    let allowed = |s: usize| start.is_none_or(|only| only == s);
    let mut cost: Vec<f64> =
        at(0).displacements.iter().enumerate().map(|(s, &p)| if allowed(s) { p } else { f64::INFINITY }).collect();
    let mut from: Vec<Vec<usize>> = Vec::with_capacity(links.len());
    for (k, link) in links.iter().enumerate() {
        let last = closed && k + 1 == n;
        let (mut next, mut back) = (Vec::new(), Vec::new());
        for (t, &displacement) in at(k + 1).displacements.iter().enumerate() {
            let (s, c) = (0..cost.len())
                .map(|s| (s, cost[s] + link[s][t]))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((0, f64::INFINITY));
            next.push(if last && !allowed(t) { f64::INFINITY } else { c + if last { 0.0 } else { displacement } });
            back.push(s);
        }
        cost = next;
        from.push(back);
    }
    let (mut s, total) =
        cost.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::INFINITY));
    let mut picks = vec![s];
    for back in from.iter().rev() {
        s = back[s];
        picks.push(s);
    }
    picks.reverse();
    picks.truncate(n);
    (total, picks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{row, torus};

    #[test]
    fn a_crossing_keeps_its_position_in_the_slot_that_contains_it() {
        assert_eq!(slots(&[], 0.37).positions, [0.37]);
        let Slots { positions, displacements } = slots(&[0.2, 0.6], 0.37);
        assert_eq!((positions[1], displacements[1]), (0.37, 0.0));
        // In the other slots it is a third from the end towards it.
        assert!((positions[0] - 0.4 / 3.0).abs() < 1e-12 && (positions[2] - (0.6 + 0.4 / 3.0)).abs() < 1e-12);
        assert!(positions.is_sorted());
    }

    #[test]
    fn a_crossing_at_an_older_vertex_moves_off_it() {
        let positions = slots(&[0.5], 0.5).positions;
        assert!(positions[0] < 0.5 && positions[1] > 0.5);
    }

    #[test]
    fn without_older_curves_nothing_moves() {
        let mesh = torus(8, 6);
        let curve = row(8, 2, true, 0.3);
        let chosen = choose(&mesh, &curve, |_| Vec::new(), |_| Vec::new());
        assert!(chosen.iter().zip(&curve.crossings).all(|(t, c)| *t == c.t));
    }
}

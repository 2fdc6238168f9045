//! Choosing where along its edges a new curve passes between the curves that are there already.
//!
//! On each mesh edge the vertices of older curves leave slots. Within one triangle a new chord crosses an
//! older one iff their ends alternate around it, so the slots on consecutive edges decide the number of
//! crossings. A shortest path over slots (cyclic for closed curves) takes the fewest crossings and among
//! those the least displacement. Curves that run side by side through the same triangles therefore never
//! braid, however close or equal their parameters are.

use crate::mesh::{HalfedgeId, TriMesh};
use crate::surface::SurfaceCurve;

/// Where a chord of an older curve ends: side of the triangle and place along its half-edge.
pub(super) type ChordEnd = (u32, f64);

/// Cost of one crossing, beside displacements that are at most 1 per mesh edge.
const CROSSING: f64 = 1e4;

/// The slots of one crossing of the new curve: centre and price of each.
struct Choice {
    /// Place along the crossing's half-edge, in its direction.
    centres: Vec<f64>,
    prices: Vec<f64>,
}

/// For every crossing of `curve` the place on its edge, in the direction of the crossing's half-edge.
///
/// `taken(h)` lists the places of older vertices along half-edge `h`, increasing; `chords(f)` the chords of
/// older curves in face `f`.
pub(super) fn choose(
    mesh: &TriMesh,
    curve: &SurfaceCurve,
    taken: impl Fn(HalfedgeId) -> Vec<f64>,
    chords: impl Fn(u32) -> Vec<(ChordEnd, ChordEnd)>,
) -> Vec<f64> {
    let n = curve.crossings.len();
    let choices: Vec<Choice> = curve.crossings.iter().map(|c| slots(&taken(c.halfedge), c.t)).collect();
    let first = if curve.closed { (0..n).min_by_key(|&i| choices[i].centres.len()).unwrap_or(0) } else { 0 };
    let starts: Vec<Option<usize>> =
        if curve.closed { (0..choices[first].centres.len()).map(Some).collect() } else { vec![None] };
    let steps = if curve.closed { n } else { n - 1 };
    let links: Vec<Vec<Vec<f64>>> = (0..steps)
        .map(|k| {
            let (i, j) = ((first + k) % n, (first + k + 1) % n);
            link(mesh, curve, (i, j), (&choices[i], &choices[j]), &chords)
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
    (0..n).map(|k| choices[(first + k) % n].centres[picks[k]]).enumerate().fold(vec![0.0; n], |mut out, (k, t)| {
        out[(first + k) % n] = t;
        out
    })
}

/// The slots between `taken` places; the one that holds `t` keeps it, the others are entered near their side
/// towards `t`.
fn slots(taken: &[f64], t: f64) -> Choice {
    let mut choice = Choice { centres: Vec::new(), prices: Vec::new() };
    for k in 0..=taken.len() {
        let low = if k == 0 { 0.0 } else { taken[k - 1] };
        let high = taken.get(k).copied().unwrap_or(1.0);
        // A third of the slot is left to either neighbour.
        let margin = (high - low) / 3.0;
        let inside = t.clamp(low + margin.min(0.02), high - margin.min(0.02));
        let centre = if (low..high).contains(&t) { inside } else { t.clamp(low + margin, high - margin) };
        choice.centres.push(centre);
        choice.prices.push((centre - t).abs());
    }
    choice
}

/// Crossings with older chords for every pair of slots of crossings `i` and `j`, consecutive on the curve.
fn link(
    mesh: &TriMesh,
    curve: &SurfaceCurve,
    (i, j): (usize, usize),
    (from, to): (&Choice, &Choice),
    chords: &impl Fn(u32) -> Vec<(ChordEnd, ChordEnd)>,
) -> Vec<Vec<f64>> {
    let exit = curve.crossings[j].halfedge;
    let face = mesh.face(exit);
    // The entry seen from this triangle; the start of an open curve already is.
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
    from.centres
        .iter()
        .map(|&s| {
            let a = f64::from(entry.0 % 3) + if flipped { 1.0 - s } else { s };
            to.centres.iter().map(|&t| CROSSING * count(a, f64::from(exit.0 % 3) + t)).collect()
        })
        .collect()
}

/// The cheapest choice of slots from crossing `first` on; with `start` given, back to that slot.
fn shortest(
    choices: &[Choice],
    links: &[Vec<Vec<f64>>],
    first: usize,
    start: Option<usize>,
    closed: bool,
) -> (f64, Vec<usize>) {
    let n = choices.len();
    let at = |k: usize| &choices[(first + k) % n];
    let allowed = |s: usize| start.is_none_or(|only| only == s);
    let mut cost: Vec<f64> =
        at(0).prices.iter().enumerate().map(|(s, &p)| if allowed(s) { p } else { f64::INFINITY }).collect();
    let mut from: Vec<Vec<usize>> = Vec::with_capacity(links.len());
    for (k, link) in links.iter().enumerate() {
        let last = closed && k + 1 == n;
        let (mut next, mut back) = (Vec::new(), Vec::new());
        for (t, &price) in at(k + 1).prices.iter().enumerate() {
            let (s, c) = (0..cost.len())
                .map(|s| (s, cost[s] + link[s][t]))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((0, f64::INFINITY));
            next.push(if last && !allowed(t) { f64::INFINITY } else { c + if last { 0.0 } else { price } });
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

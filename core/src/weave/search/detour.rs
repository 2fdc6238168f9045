//! Curves by connectivity alone, for regions that no elastica loop helps.
//!
//! A tree of shortest paths over the triangles of the arrangement is grown from a triangle of the region. Every edge that
//! the tree does not cross closes a loop, every two boundary edges an open curve. Curves are equivalent for the arrangement
//! if they cross each segment equally often modulo two and are homologous modulo two; the shortest of each class is kept.
//! One of them cuts any region that is not a disc. Classes are told apart by 64-bit hashes: a collision loses a curve.

use std::collections::BTreeMap;

use crate::dual::{Arrangement, Mark, next};
use crate::mesh::{Dijkstra, HalfedgeId, TriMesh};
use crate::surface::{Crossing, SurfaceCurve};
use crate::union_find::UnionFind;
use crate::weave::proposal::Proposal;

/// Cost of crossing a placed curve, as a length on a surface of model size 1: shorter detours avoid a crossing. Chosen by
/// hand.
const CROSSING_COST: f64 = 0.05;

/// The shortest curve of each class through the triangle `root` of the arrangement, the shortest first, at most `max`.
pub(in crate::weave) fn detours(arrangement: &Arrangement, base: &TriMesh, root: u32, max: usize) -> Vec<Proposal> {
    let tree = Tree::grow(arrangement, root);
    let mut classes: BTreeMap<u64, (f64, Closing)> = BTreeMap::new();
    let mut offer = |class: u64, length: f64, closing: Closing| {
        let entry = classes.entry(class).or_insert((length, closing));
        if length < entry.0 {
            *entry = (length, closing);
        }
    };
    let refined = &arrangement.refined;
    let homology = tree.homology(arrangement);
    let mut ends: BTreeMap<u64, (f64, u32)> = BTreeMap::new();
    for h in 0..3 * refined.n_faces() as u32 {
        let f = (h / 3) as usize;
        if !tree.distance[f].is_finite() {
            continue;
        }
        match refined.twin(h) {
            Some(t) if h < t => {
                let g = (t / 3) as usize;
                if tree.entered[g] == h || tree.entered[f] == t {
                    continue;
                }
                let class = tree.class[f] ^ tree.class[g] ^ segment_class(arrangement, h) ^ homology[h as usize];
                offer(class, tree.distance[f] + tree.distance[g], Closing::Loop(h));
            }
            Some(_) => {}
            None => {
                let class = tree.class[f] ^ boundary_class(arrangement, h);
                let end = ends.entry(class).or_insert((tree.distance[f], h));
                if tree.distance[f] < end.0 {
                    *end = (tree.distance[f], h);
                }
            }
        }
    }
    let ends: Vec<(u64, (f64, u32))> = ends.into_iter().take(MAX_ENDS).collect();
    for (i, &(a, (la, ha))) in ends.iter().enumerate() {
        for &(b, (lb, hb)) in &ends[i + 1..] {
            offer(mix(a ^ b.rotate_left(1)), la + lb, Closing::Open(ha, hb));
        }
    }
    let mut list: Vec<(f64, Closing)> = classes.into_values().collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    let curves = list.into_iter().filter_map(|(length, closing)| {
        let walk = tree.walk(arrangement, closing);
        let curve = on_base(arrangement, base, &walk, matches!(closing, Closing::Loop(_)))?;
        Some(Proposal { curve, cost: COST_PER_LENGTH * length, energy: None, anchors: Vec::new() })
    });
    curves.take(max).collect()
}

/// Largest number of classes of boundary ends; their pairs are quadratic in number. Chosen by hand.
const MAX_ENDS: usize = 64;
/// Cost per length of a curve, comparable to elastica loops, which cost about three times their length.
const COST_PER_LENGTH: f64 = 3.0;

/// How a curve closes.
#[derive(Clone, Copy)]
enum Closing {
    /// Across this half-edge.
    Loop(u32),
    /// From one boundary half-edge to another.
    Open(u32, u32),
}

/// Shortest paths over the triangles of an arrangement.
struct Tree {
    distance: Vec<f64>,
    /// The half-edge of the preceding triangle across which each triangle was entered; `u32::MAX` for the root.
    entered: Vec<u32>,
    /// Hash of the segments crossed an odd number of times on the way.
    class: Vec<u64>,
}

impl Tree {
    fn grow(arrangement: &Arrangement, root: u32) -> Self {
        let refined = &arrangement.refined;
        let n = refined.n_faces();
        let mut tree = Self { distance: vec![f64::INFINITY; n], entered: vec![u32::MAX; n], class: vec![0; n] };
        let centre = |f: u32| {
            let [a, b, c] = refined.corners(f).map(|v| refined.positions[v as usize]);
            (a + b + c) / 3.0
        };
        let mut search = Dijkstra::new(n);
        search.start(root, 0.0);
        while let Some((f, d)) = search.settle() {
            tree.distance[f as usize] = d;
            if let Some(h) = search.via(f) {
                tree.entered[f as usize] = h;
                tree.class[f as usize] = tree.class[(h / 3) as usize] ^ segment_class(arrangement, h);
            }
            for h in 3 * f..3 * f + 3 {
                let Some(t) = refined.twin(h) else { continue };
                let g = t / 3;
                let crossing = if refined.mark(h) == Mark::Free { 0.0 } else { CROSSING_COST };
                search.reach(g, d + centre(f).distance(centre(g)) + crossing, h);
            }
        }
        tree
    }

    /// A hash for each half-edge such that the exclusive or over a curve distinguishes homology classes modulo two: zero on
    /// a spanning tree of the vertices whose edges the paths do not cross, random on the few edges that neither tree has
    /// (tree-cotree decomposition).
    fn homology(&self, arrangement: &Arrangement) -> Vec<u64> {
        let refined = &arrangement.refined;
        let n_half = 3 * refined.n_faces() as u32;
        let dual_tree = |h: u32| {
            refined.twin(h).is_some_and(|t| self.entered[(t / 3) as usize] == h || self.entered[(h / 3) as usize] == t)
        };
        let mut sets = UnionFind::new(refined.n_vertices());
        let mut open = Vec::new();
        // Boundary edges first: each boundary loop counts as one vertex.
        let boundary = (0..n_half).filter(|&h| refined.is_boundary(h));
        let inner = (0..n_half).filter(|&h| refined.twin(h).is_some_and(|t| h < t) && !dual_tree(h));
        for h in boundary.chain(inner) {
            if !sets.join(refined.origin(h), refined.target(h)) {
                open.push(h);
            }
        }
        let mut hash = vec![0; n_half as usize];
        // The remaining edges generate the homology.
        for h in open {
            let value = mix(u64::from(h) + 0x5bd1_e995);
            hash[h as usize] = value;
            if let Some(t) = refined.twin(h) {
                hash[t as usize] = value;
            }
        }
        hash
    }

    /// The half-edges that a curve crosses, each in the triangle that the curve leaves. The path from the root that both parts
    /// of the curve share is left out.
    fn walk(&self, arrangement: &Arrangement, closing: Closing) -> Vec<u32> {
        let refined = &arrangement.refined;
        let path_to = |mut f: u32| {
            let mut path = Vec::new();
            while self.entered[f as usize] != u32::MAX {
                let h = self.entered[f as usize];
                path.push(h);
                f = h / 3;
            }
            path.reverse();
            path
        };
        let (one, other) = match closing {
            Closing::Loop(h) => (path_to(h / 3), refined.twin(h).map_or_else(Vec::new, |t| path_to(t / 3))),
            Closing::Open(a, b) => (path_to(b / 3), path_to(a / 3)),
        };
        let shared = one.iter().zip(&other).take_while(|(a, b)| a == b).count();
        let back = other[shared..].iter().rev().filter_map(|&h| refined.twin(h));
        match closing {
            Closing::Loop(h) => one[shared..].iter().copied().chain([h]).chain(back).collect(),
            Closing::Open(a, b) => {
                [a].into_iter().chain(back).chain(one[shared..].iter().copied()).chain([b]).collect()
            }
        }
    }
}

/// A walk over triangles of the arrangement as a curve on the base mesh.
fn on_base(arrangement: &Arrangement, base: &TriMesh, walk: &[u32], closed: bool) -> Option<SurfaceCurve> {
    let refined = &arrangement.refined;
    let mut crossings: Vec<Crossing> = Vec::new();
    for &h in walk {
        let Some(b) = refined.base_halfedge(h).map(HalfedgeId) else { continue };
        let (p, q) = (base.position(base.origin(b)), base.position(base.target(b)));
        let middle =
            0.5 * (refined.positions[refined.origin(h) as usize] + refined.positions[refined.target(h) as usize]);
        let t = (middle.distance(p) / p.distance(q).max(f64::MIN_POSITIVE)).clamp(1e-3, 1.0 - 1e-3);
        let crossing = Crossing { halfedge: b, t };
        // Crossing an edge back and forth cancels.
        if crossings.last().is_some_and(|last| base.twin(last.halfedge) == Some(b)) {
            crossings.pop();
        } else {
            crossings.push(crossing);
        }
    }
    while closed
        && crossings.len() > 1
        && base.twin(crossings[crossings.len() - 1].halfedge) == Some(crossings[0].halfedge)
    {
        crossings.pop();
        crossings.remove(0);
    }
    let curve = SurfaceCurve { crossings, closed };
    curve.check(base).ok().map(|()| curve)
}

/// Hash of the segment that a half-edge belongs to, 0 if it belongs to none.
fn segment_class(arrangement: &Arrangement, h: u32) -> u64 {
    arrangement.segment_at(h).map_or(0, |(s, _)| mix(u64::from(s) + 1))
}

/// Hash of the stretch of boundary that a boundary half-edge belongs to: of the curve end before it, or of the whole loop.
fn boundary_class(arrangement: &Arrangement, h: u32) -> u64 {
    let refined = &arrangement.refined;
    let mut g = h;
    let mut least = h;
    loop {
        let end = arrangement.ends.binary_search_by_key(&refined.target(g), |e| e.vertex);
        if let Ok(i) = end {
            return mix(0x1_0000_0000 + i as u64);
        }
        // The next boundary half-edge of the loop.
        g = next(g);
        while let Some(t) = refined.twin(g) {
            g = next(t);
        }
        least = least.min(g);
        if g == h {
            return mix(0x2_0000_0000 + u64::from(least));
        }
    }
}

/// The finaliser of SplitMix64, a hash of 64 bits. Callers add different offsets to their numbers, so that segments,
/// edges, curve ends and boundary loops have different arguments.
fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

//! From curves to strips: conquering the isolines beside each curve.
//!
//! On each side of a curve triangles are taken in the order of their distance `d` from it, measured by the
//! coordinate the curve keeps constant and continued across cuts (in the developed chart of the curve). A side
//! ends at the smallest `|d|` of a singular vertex it meets; folded triangles are not entered. A triangle that is
//! reached again along the same family of isolines is skipped, boundaries just end the front (Campen, Quad
//! Layouts, section 8.2.2).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::StripCoverage;
use crate::field::{CrossField, EdgePath, Step, cancel_opposite_pairs};
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::surface::Metric;

/// Folded triangles smaller than this part of the mean do not stop a strip: splitting edges leaves such slivers,
/// and where isolines are forced through them their orientation means nothing.
const SLIVER: f64 = 0.05;

/// Singularities of opposite index closer than this, in lengths on a mesh of diagonal 1, do not end a strip: its
/// isolines pass such a pair with a kink and go on as before.
const PAIR: f64 = 0.04;

/// Singularities closer to a curve than this do not end its strip: at this width one could not see it.
const NEAR: f64 = 0.015;

/// How far a front may have travelled over the surface for the distance it has gained, as a factor and as an addend
/// in mean edge lengths. The map is close to isometric, so a front that goes on without gaining has been led astray
/// by a singularity that did not end the strip.
const DETOUR: (f64, f64) = (3.0, 2.0);

/// What a strip has conquered: triangle, family (0: u constant), signed distance at its corners.
type Conquest = (FaceId, u8, [f64; 3]);

/// The map's data that the conquest reads.
pub(super) struct Ground<'a> {
    pub mesh: &'a TriMesh,
    pub metric: &'a Metric,
    pub field: &'a CrossField,
    pub uv: &'a [[DVec2; 3]],
    pub flipped: &'a [bool],
    pub mean_edge: f64,
}

/// The strips, and what they cover as in [`super::StripMap`].
pub(super) struct Conquered {
    pub strips: Vec<StripCoverage>,
    pub covered: Vec<[Option<u32>; 2]>,
    pub stripe: Vec<[[f32; 3]; 2]>,
}

/// Conquers for all `paths`; of several strips the nearest covers a triangle.
pub(super) fn conquer(ground: &Ground<'_>, paths: &[EdgePath]) -> Conquered {
    let n = ground.mesh.n_faces();
    let mean = ground.mesh.faces().map(|f| ground.metric.area(f)).sum::<f64>() / n.max(1) as f64;
    let mut closed = vec![false; n];
    for f in ground.mesh.faces() {
        closed[f.index()] = ground.flipped[f.index()] && ground.metric.area(f) > SLIVER * mean;
    }
    let mut singular = vec![false; ground.mesh.n_vertices()];
    for s in cancel_opposite_pairs(ground.mesh, &ground.field.singularities, PAIR) {
        singular[s.vertex.index()] = true;
    }
    let results: Vec<_> = paths.par_iter().map(|p| conquer_one(ground, &closed, &singular, p)).collect();
    let mut nearest = vec![[f64::INFINITY; 2]; n];
    let mut out = Conquered { strips: Vec::new(), covered: vec![[None; 2]; n], stripe: vec![[[0.0; 3]; 2]; n] };
    for (i, (path, (bounds, taken))) in paths.iter().zip(results).enumerate() {
        out.strips.push(StripCoverage { curve: path.curve, bounds, faces: taken.len() });
        for (f, family, d) in taken {
            let (f, family) = (f.index(), usize::from(family));
            let far = d.iter().sum::<f64>().abs();
            if far < nearest[f][family] {
                nearest[f][family] = far;
                out.covered[f][family] = Some(i as u32);
                out.stripe[f][family] = d.map(|d| d as f32);
            }
        }
    }
    out
}

/// How the distance reads in a triangle: `d = Re(i^{-branch} w) + offset`.
#[derive(Clone, Copy)]
struct Lift {
    branch: i32,
    offset: f64,
    /// Length of the front's way from the curve to the triangle.
    travelled: f64,
}

impl Lift {
    fn distance(self, w: DVec2) -> f64 {
        self.offset + component(w, self.branch)
    }
}

/// The coordinate of `w` along axis `branch`: u, v, -u, -v.
fn component(w: DVec2, branch: i32) -> f64 {
    match branch.rem_euclid(4) {
        0 => w.x,
        1 => w.y,
        2 => -w.x,
        _ => -w.y,
    }
}

fn conquer_one(g: &Ground<'_>, closed: &[bool], singular: &[bool], path: &EdgePath) -> ([f64; 2], Vec<Conquest>) {
    let mut bounds = [0.0; 2];
    let mut taken = Vec::new();
    let mut visited = vec![[false; 2]; g.mesh.n_faces()];
    for (side, bound) in bounds.iter_mut().enumerate() {
        let seeds = path
            .steps
            .iter()
            .zip(&path.tangent_offset)
            .filter_map(|(&s, &tangent_offset)| seed(g, s, tangent_offset, side));
        let (reached, mut part) = conquer_side(g, closed, singular, seeds, &mut visited);
        *bound = reached;
        if side == 1 {
            for (_, _, d) in &mut part {
                *d = d.map(|d| -d);
            }
        }
        taken.extend(part);
    }
    (bounds, taken)
}

/// The triangle left (side 0) or right of a step, and the lift in which the distance is zero on the step and
/// positive inside.
fn seed(g: &Ground<'_>, step: Step, tangent_offset: f64, side: usize) -> Option<(FaceId, Lift)> {
    let (left, right) = (step.left(g.mesh), step.right(g.mesh));
    // Along `h` runs branch `along` of the chart; to its left, a quarter turn on, the inside, or the outside.
    let inside = |h: HalfedgeId, quarters: i32| {
        let f = g.mesh.face(h);
        let branch = g.field.branch_along(g.metric, h, tangent_offset) + quarters;
        Lift { branch, offset: -component(g.uv[f.index()][h.index() % 3], branch), travelled: 0.0 }
    };
    match (side, left, right) {
        (0, Some(l), _) => Some((g.mesh.face(l), inside(l, 1))),
        (1, Some(l), Some(r)) => Some((g.mesh.face(r), Lift { travelled: 0.0, ..cross(g, inside(l, -1), l, r, 0.0) })),
        (1, None, Some(r)) => Some((g.mesh.face(r), inside(r, 1))),
        _ => None,
    }
}

fn conquer_side(
    g: &Ground<'_>,
    closed: &[bool],
    singular: &[bool],
    seeds: impl Iterator<Item = (FaceId, Lift)>,
    visited: &mut [[bool; 2]],
) -> (f64, Vec<Conquest>) {
    let mut bound = f64::INFINITY;
    let mut reach: f64 = 0.0;
    let mut taken: Vec<Conquest> = Vec::new();
    // Distances are not negative here, so their bits order as they do.
    let mut queue = BinaryHeap::new();
    let mut lifts: Vec<Lift> = Vec::new();
    let push = |queue: &mut BinaryHeap<_>, lifts: &mut Vec<Lift>, key: f64, f: FaceId, lift: Lift| {
        queue.push(Reverse((key.max(0.0).to_bits(), f, lifts.len())));
        lifts.push(lift);
    };
    for (f, lift) in seeds {
        push(&mut queue, &mut lifts, 0.0, f, lift);
    }
    let n_seeds = lifts.len();
    let slack = DETOUR.1 * g.mean_edge;
    while let Some(Reverse((bits, f, at))) = queue.pop() {
        let (key, lift) = (f64::from_bits(bits), lifts[at]);
        if key >= bound {
            break;
        }
        let family = lift.branch.rem_euclid(2) as usize;
        let d = g.uv[f.index()].map(|w| lift.distance(w));
        // A front that has come around to the other side of its curve ends there, and one that goes astray.
        let mean = d.iter().sum::<f64>() / 3.0;
        let inside = at < n_seeds || (mean > 0.0 && lift.travelled < DETOUR.0 * mean + slack);
        if visited[f.index()][family] || closed[f.index()] || !inside {
            continue;
        }
        visited[f.index()][family] = true;
        taken.push((f, family as u8, d));
        for (i, h) in g.mesh.face_halfedges(f).into_iter().enumerate() {
            reach = reach.max(d[i]);
            if singular[g.mesh.origin(h).index()] && d[i] > NEAR {
                bound = bound.min(d[i]);
            }
            let Some(t) = g.mesh.twin(h) else { continue };
            let next = cross(g, lift, h, t, d[i]);
            push(&mut queue, &mut lifts, d[i].min(d[(i + 1) % 3]), g.mesh.face(t), next);
        }
    }
    taken.retain(|(_, _, d)| d[0].min(d[1]).min(d[2]) < bound);
    (bound.min(reach), taken)
}

/// The lift continued from the triangle of `h` to that of its twin `t`, where `d` is the distance at the origin of
/// `h`.
fn cross(g: &Ground<'_>, lift: Lift, h: HalfedgeId, t: HalfedgeId, d: f64) -> Lift {
    let jump = g.field.jump_across(g.mesh, h);
    // w_to = i^{-p} w_from + T, so that i^{-b} w_from = i^{-(b - p)} w_to up to a constant.
    let branch = (lift.branch - jump).rem_euclid(4);
    let corner = g.mesh.next(t).index() % 3;
    let centre = |f: FaceId| g.mesh.face_vertices(f).map(|v| g.mesh.position(v)).iter().sum::<DVec3>() / 3.0;
    let travelled = lift.travelled + centre(g.mesh.face(h)).distance(centre(g.mesh.face(t)));
    Lift { branch, offset: d - component(g.uv[t.index() / 3][corner], branch), travelled }
}

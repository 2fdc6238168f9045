//! Strip coverage: which triangles the isolines beside each curve pass.
//!
//! On each side of a curve a front advances over the triangles in the order of their distance `d` from the curve. `d` is
//! the coordinate that is constant along the curve, continued across cuts. A side ends at the smallest `d` of a singular
//! vertex that the front reaches. Flipped triangles are not entered; a triangle reached again along the same family of
//! isolines is skipped; at boundaries the front ends (Campen, Quad Layouts, section 8.2.2).

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::field::{CrossField, EdgePath, Step, cancel_opposite_pairs};
use crate::mesh::{DistanceQueue, FaceId, HalfedgeId, TriMesh};
use crate::surface::Metric;

/// Flipped triangles of less area than this, in mean triangle areas, do not stop the front: slivers left by edge splits,
/// whose orientation is not reliable where isolines are constraints. Chosen by hand; 0 would stop it at all of them.
const SLIVER: f64 = 0.05;

/// Singularities of opposite index closer than this, in model sizes, do not end a strip: isolines pass such a
/// pair with a kink only. Chosen by hand.
const PAIR_DISTANCE: f64 = 0.04;

/// Singularities within this distance of a curve, in model sizes, do not end its strip: it would be too narrow to
/// be seen.
const MIN_WIDTH: f64 = 0.015;

/// Largest ratio of the length that a front has travelled over the surface to the distance `d` gained. The map is nearly
/// isometric, so a front that travels on without gaining distance has been diverted by a singularity that did not end the
/// strip.
const MAX_DETOUR: f64 = 3.0;
/// Length that a front may travel in addition, in mean edge lengths.
const DETOUR_SLACK: f64 = 2.0;

/// The strip of one curve.
#[derive(Debug, Clone, PartialEq)]
pub struct StripCoverage {
    /// The curve that is its spine.
    pub curve: u32,
    /// Its widths to the left and to the right of the spine, in lengths on the mesh.
    pub widths: [f64; 2],
    /// Number of triangles it covers, each counted once per family of isolines.
    pub faces: usize,
}

/// A triangle taken by a front: the family of isolines (0: u constant, 1: v constant) and the signed distances of its
/// corners from the curve.
type Taken = (FaceId, u8, [f64; 3]);

/// The seamless map that fronts advance in.
pub(super) struct MapView<'a> {
    pub mesh: &'a TriMesh,
    pub metric: &'a Metric,
    pub field: &'a CrossField,
    pub uv: &'a [[DVec2; 3]],
    pub flipped: &'a [bool],
}

/// The strips, and what they cover; the fields are those of [`super::StripMap`].
pub(super) struct Coverage {
    pub strips: Vec<StripCoverage>,
    pub covered: Vec<[Option<u32>; 2]>,
    pub spine_distance: Vec<[[f32; 3]; 2]>,
}

/// The strips of all `paths`. A triangle that several strips reach belongs to the nearest.
pub(super) fn coverage(map: &MapView<'_>, paths: &[EdgePath]) -> Coverage {
    let n = map.mesh.n_faces();
    let fronts = Fronts::new(map);
    let results: Vec<_> = paths.par_iter().map(|p| fronts.strip(p)).collect();
    let mut nearest = vec![[f64::INFINITY; 2]; n];
    let mut out = Coverage { strips: Vec::new(), covered: vec![[None; 2]; n], spine_distance: vec![[[0.0; 3]; 2]; n] };
    for (i, (path, (widths, taken))) in paths.iter().zip(results).enumerate() {
        out.strips.push(StripCoverage { curve: path.curve, widths, faces: taken.len() });
        for (f, family, d) in taken {
            let (f, family) = (f.index(), usize::from(family));
            let far = d.iter().sum::<f64>().abs();
            if far < nearest[f][family] {
                nearest[f][family] = far;
                out.covered[f][family] = Some(i as u32);
                out.spine_distance[f][family] = d.map(|d| d as f32);
            }
        }
    }
    out
}

/// The distance from the curve as a function of the coordinates `w` of a triangle: `d = Re(i^{-branch} w) + offset`.
#[derive(Clone, Copy)]
struct Distance {
    branch: i32,
    offset: f64,
    /// Length over the surface from the curve to the triangle, along the path of the front.
    travelled: f64,
}

impl Distance {
    fn at(self, w: DVec2) -> f64 {
        self.offset + component(w, self.branch)
    }
}

/// The component of `w` along axis `branch`: u, v, −u, −v.
fn component(w: DVec2, branch: i32) -> f64 {
    match branch.rem_euclid(4) {
        0 => w.x,
        1 => w.y,
        2 => -w.x,
        _ => -w.y,
    }
}

/// The data that the fronts of all curves share.
struct Fronts<'a> {
    map: &'a MapView<'a>,
    /// The triangles that are not entered.
    blocked: Vec<bool>,
    /// The vertices that end a strip.
    singular: Vec<bool>,
    mean_edge: f64,
}

impl<'a> Fronts<'a> {
    fn new(map: &'a MapView<'a>) -> Self {
        let MapView { mesh, metric, .. } = *map;
        let mean = mesh.faces().map(|f| metric.area(f)).sum::<f64>() / mesh.n_faces().max(1) as f64;
        let blocked = mesh.faces().map(|f| map.flipped[f.index()] && metric.area(f) > SLIVER * mean).collect();
        let mut singular = vec![false; mesh.n_vertices()];
        for s in cancel_opposite_pairs(mesh, &map.field.singularities, PAIR_DISTANCE) {
            singular[s.vertex.index()] = true;
        }
        Self { map, blocked, singular, mean_edge: mesh.mean_edge_length() }
    }

    /// The widths of the strip of a curve on both sides, and its triangles.
    fn strip(&self, path: &EdgePath) -> ([f64; 2], Vec<Taken>) {
        let mut widths = [0.0; 2];
        let mut taken = Vec::new();
        let mut visited = vec![[false; 2]; self.map.mesh.n_faces()];
        for (side, width) in widths.iter_mut().enumerate() {
            let steps = path.steps.iter().zip(&path.tangent_offset);
            let seeds = steps.filter_map(|(&step, &tangent_offset)| self.seed(step, tangent_offset, side));
            let (reached, mut part) = self.advance(seeds, &mut visited);
            *width = reached;
            // Right of the spine distances are negative.
            if side == 1 {
                for (_, _, d) in &mut part {
                    *d = d.map(|d| -d);
                }
            }
            taken.extend(part);
        }
        (widths, taken)
    }

    /// The triangle left (side 0) or right (side 1) of a step, with the distance that is zero on the step and positive in the
    /// triangle.
    fn seed(&self, step: Step, tangent_offset: f64, side: usize) -> Option<(FaceId, Distance)> {
        let MapView { mesh, metric, field, uv, .. } = *self.map;
        let (left, right) = (step.left(mesh), step.right(mesh));
        // Distances increase along the direction of the cross that is `quarters` quarter turns to the left of `h`.
        let across = |h: HalfedgeId, quarters: i32| {
            let f = mesh.face(h);
            let branch = field.branch_along(metric, h, tangent_offset) + quarters;
            Distance { branch, offset: -component(uv[f.index()][h.index() % 3], branch), travelled: 0.0 }
        };
        match (side, left, right) {
            (0, Some(l), _) => Some((mesh.face(l), across(l, 1))),
            (1, Some(l), Some(r)) => {
                Some((mesh.face(r), Distance { travelled: 0.0, ..self.cross(across(l, -1), l, r, 0.0) }))
            }
            (1, None, Some(r)) => Some((mesh.face(r), across(r, 1))),
            _ => None,
        }
    }

    /// Advances a front from its seeds until a singular vertex ends it; the width reached, and the triangles within.
    fn advance(&self, seeds: impl Iterator<Item = (FaceId, Distance)>, visited: &mut [[bool; 2]]) -> (f64, Vec<Taken>) {
        let mesh = self.map.mesh;
        let mut width = f64::INFINITY;
        let mut reach: f64 = 0.0;
        let mut taken: Vec<Taken> = Vec::new();
        // Triangles by the least distance of the side they are entered by, with the index of their distance function.
        let mut queue = DistanceQueue::new();
        let mut distances: Vec<Distance> = Vec::new();
        for (f, distance) in seeds {
            queue.push(0.0, (f, distances.len()));
            distances.push(distance);
        }
        let n_seeds = distances.len();
        let slack = DETOUR_SLACK * self.mean_edge;
        while let Some((key, (f, at))) = queue.pop() {
            let distance = distances[at];
            if key >= width {
                break;
            }
            let family = distance.branch.rem_euclid(2) as usize;
            let d = self.map.uv[f.index()].map(|w| distance.at(w));
            // A front ends where it has come around to the other side of its curve, or has been diverted.
            let mean = d.iter().sum::<f64>() / 3.0;
            let advances = at < n_seeds || (mean > 0.0 && distance.travelled < MAX_DETOUR * mean + slack);
            if visited[f.index()][family] || self.blocked[f.index()] || !advances {
                continue;
            }
            visited[f.index()][family] = true;
            taken.push((f, family as u8, d));
            for (i, h) in mesh.face_halfedges(f).into_iter().enumerate() {
                reach = reach.max(d[i]);
                if self.singular[mesh.origin(h).index()] && d[i] > MIN_WIDTH {
                    width = width.min(d[i]);
                }
                let Some(t) = mesh.twin(h) else { continue };
                queue.push(d[i].min(d[(i + 1) % 3]).max(0.0), (mesh.face(t), distances.len()));
                distances.push(self.cross(distance, h, t, d[i]));
            }
        }
        taken.retain(|(_, _, d)| d[0].min(d[1]).min(d[2]) < width);
        (width.min(reach), taken)
    }

    /// The distance continued from the triangle of `h` to that of its twin `t`; `d` is that of the origin of `h`.
    fn cross(&self, distance: Distance, h: HalfedgeId, t: HalfedgeId, d: f64) -> Distance {
        let MapView { mesh, field, uv, .. } = *self.map;
        let jump = field.jump_across(mesh, h);
        // w_to = i^{-p} w_from + T, hence i^{-b} w_from = i^{-(b - p)} w_to up to a constant.
        let branch = (distance.branch - jump).rem_euclid(4);
        let corner = mesh.next(t).index() % 3;
        let centre = |f: FaceId| mesh.face_vertices(f).map(|v| mesh.position(v)).iter().sum::<DVec3>() / 3.0;
        let travelled = distance.travelled + centre(mesh.face(h)).distance(centre(mesh.face(t)));
        Distance { branch, offset: d - component(uv[t.index() / 3][corner], branch), travelled }
    }
}

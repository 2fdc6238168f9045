//! Closes holes and notches of strips.
//!
//! Where two strips reach a triangle along the same family of isolines, the strip map gives it to the nearer one. If that
//! is a part which is not drawn, for instance because the strip has turned around a singularity, the other strip has a hole.
//! Its distances are continued into the hole by the map, in the order of the distance. They are also continued into
//! triangles that no strip covers, such as flipped ones, if these have the strip on two sides.

use plait_core::mesh::{DistanceQueue, FaceId, HalfedgeId};
use plait_core::strip::StripMap;

use super::sheet::{Cover, Sheets, is_same};

/// A triangle and a family of isolines.
type Slot = (u32, u32);

/// The cover without the triangles that are not drawn, which are given to other strips where possible.
pub fn refilled<'a>(cover: &Cover<'a>, map: &StripMap, sheets: &Sheets, strengths: &[f64]) -> Cover<'a> {
    let mut out = cover.clone();
    let mut queue = DistanceQueue::new();
    let n = cover.mesh.n_faces();
    let mut freed = vec![[false; 2]; n];
    for (f, k) in (0..n).flat_map(|f| [(f, 0), (f, 1)]).filter(|&(f, k)| cover.strip[f][k].is_some()) {
        if sheets.triangle(f, k).iter().all(|&v| strengths[v] == 0.0) {
            out.strip[f][k] = None;
            freed[f][k] = true;
        } else {
            queue.push(0.0, (f as u32, k as u32));
        }
    }
    while let Some((_, slot)) = queue.pop() {
        for h in cover.mesh.face_halfedges(FaceId(slot.0)) {
            let Some(Continued { slot: (g, k), strip, distance }) = continued(&out, map, slot, h) else { continue };
            let (g, k) = (g as usize, k as usize);
            let nearest = distance.iter().fold(f32::INFINITY, |least, d| least.min(d.abs()));
            let nearest = nearest.copysign(distance.iter().sum());
            let free = out.strip[g][k].is_none() && out.is_within(strip, nearest, nearest);
            if free && (freed[g][k] || sides(&out, g, strip, distance) > 1) {
                out.strip[g][k] = Some(strip);
                out.distance[g][k] = distance;
                queue.push(f64::from(nearest.abs()), (g as u32, k as u32));
            }
        }
    }
    out
}

/// On how many sides of triangle `f` a strip has the given distances.
fn sides(cover: &Cover<'_>, f: usize, strip: u32, distance: [f32; 3]) -> usize {
    let mesh = cover.mesh;
    let is_beyond = |h: HalfedgeId| {
        let Some(t) = mesh.twin(h) else { return false };
        let g = mesh.face(t).index();
        let (start, end) = (distance[h.index() % 3], distance[mesh.next(h).index() % 3]);
        let same = |k: usize| {
            let there = cover.distance[g][k];
            is_same(there[mesh.next(t).index() % 3], start) && is_same(there[t.index() % 3], end)
        };
        [0, 1].into_iter().any(|k| cover.strip[g][k] == Some(strip) && same(k))
    };
    mesh.face_halfedges(FaceId(f as u32)).into_iter().filter(|&h| is_beyond(h)).count()
}

/// What a strip would have in the next triangle.
struct Continued {
    slot: Slot,
    strip: u32,
    distance: [f32; 3],
}

/// The strip of a slot continued over the half-edge `h` of its triangle by the map; `None` at a boundary.
fn continued(cover: &Cover<'_>, map: &StripMap, (f, k): Slot, h: HalfedgeId) -> Option<Continued> {
    let mesh = cover.mesh;
    let t = mesh.twin(h)?;
    let strip = cover.strip[f as usize][k as usize]?;
    let distance = cover.distance[f as usize][k as usize];
    // In a chart, the distance is a coordinate or its negative, up to a constant. Coordinate and sign are a branch of the
    // cross: u, v, -u, -v.
    let uv = map.uv[f as usize];
    let change = |i: usize| (uv[(i + 1) % 3] - uv[i])[k as usize];
    let i = (0..3).max_by(|&i, &j| change(i).abs().total_cmp(&change(j).abs()))?;
    let increases = f64::from(distance[(i + 1) % 3] - distance[i]) * change(i) > 0.0;
    let branch = (k as i32 + if increases { 0 } else { 2 } - map.field.jump_across(mesh, h)).rem_euclid(4);
    let (family, sign) = (branch as usize % 2, if branch < 2 { 1.0 } else { -1.0 });
    let g = mesh.face(t);
    let there = map.uv[g.index()];
    let shared = mesh.next(t).index() % 3;
    let start = f64::from(distance[h.index() % 3]);
    let distance = there.map(|w| (start + sign * (w[family] - there[shared][family])) as f32);
    Some(Continued { slot: (g.0, family as u32), strip, distance })
}

//! Triangulation of polygons.
//!
//! Ears are clipped in the plane of the polygon's vector area, so that triangles of a concave polygon stay inside its
//! outline. The ear with the best triangle is clipped first. Diagonals that are edges of the mesh already are avoided:
//! two quads that share two sides would otherwise take the same diagonal, which four triangles would share.

use std::collections::HashSet;

use glam::{DVec2, DVec3};

use super::error::LoadError;
use super::read::RawMesh;

/// Most corners of a polygon. Ear clipping takes quadratic time; chosen by hand, far above what files hold.
const MAX_CORNERS: usize = 10_000;

/// The triangles of a file, each with the polygon it comes from.
#[derive(Debug, Default)]
pub(super) struct Triangles {
    pub faces: Vec<[u32; 3]>,
    /// The polygon of each triangle.
    pub source: Vec<u32>,
    /// Polygons of fewer than three different corners.
    pub dropped: Vec<u32>,
}

/// Triangulates all polygons of a file.
pub(super) fn triangulate(raw: &RawMesh) -> Result<Triangles, LoadError> {
    let mut edges = Edges::of_polygons(raw);
    let mut out = Triangles::default();
    out.faces.reserve(raw.n_polygons());
    out.source.reserve(raw.n_polygons());
    let mut outline = Vec::new();
    for i in 0..raw.n_polygons() {
        outline.clear();
        outline.extend_from_slice(raw.polygon(i));
        outline.dedup();
        while outline.len() > 1 && outline.first() == outline.last() {
            outline.pop();
        }
        if outline.len() > MAX_CORNERS {
            return Err(LoadError::HugeFace { face: raw.face_ref(i), corners: outline.len(), limit: MAX_CORNERS });
        }
        match outline.as_slice() {
            [] | [_] | [_, _] => out.dropped.push(i as u32),
            &[a, b, c] => out.faces.push([a, b, c]),
            _ => clip_ears(&mut outline, &raw.positions, &mut edges, &mut out.faces),
        }
        out.source.resize(out.faces.len(), i as u32);
    }
    Ok(out)
}

/// The edges of the mesh so far; empty if all polygons are triangles.
struct Edges(HashSet<(u32, u32)>);

impl Edges {
    fn of_polygons(raw: &RawMesh) -> Self {
        let mut edges = Self(HashSet::new());
        let polygons = (0..raw.n_polygons()).map(|i| raw.polygon(i));
        if polygons.clone().any(|p| p.len() > 3) {
            for polygon in polygons {
                for (i, &a) in polygon.iter().enumerate() {
                    edges.insert(a, polygon[(i + 1) % polygon.len()]);
                }
            }
        }
        edges
    }

    fn insert(&mut self, a: u32, b: u32) {
        self.0.insert((a.min(b), a.max(b)));
    }

    fn contains(&self, a: u32, b: u32) -> bool {
        self.0.contains(&(a.min(b), a.max(b)))
    }
}

/// Triangulates one polygon of at least four corners.
fn clip_ears(outline: &mut Vec<u32>, positions: &[DVec3], edges: &mut Edges, faces: &mut Vec<[u32; 3]>) {
    let mut flat = flatten(outline, positions);
    let mut score: Vec<f64> = (0..outline.len()).map(|i| ear_score(&flat, outline, edges, i)).collect();
    while outline.len() > 3 {
        let n = outline.len();
        let mut best = best_of(&score);
        if score[best] <= 0.0 {
            // No ear is known: clipping elsewhere may have made some.
            score = (0..n).map(|i| ear_score(&flat, outline, edges, i)).collect();
            best = best_of(&score);
        }
        let (a, b, c) = (outline[(best + n - 1) % n], outline[best], outline[(best + 1) % n]);
        faces.push([a, b, c]);
        edges.insert(a, c);
        outline.remove(best);
        flat.remove(best);
        score.remove(best);
        let n = n - 1;
        for i in [(best + n - 1) % n, best % n] {
            score[i] = ear_score(&flat, outline, edges, i);
        }
    }
    faces.push([outline[0], outline[1], outline[2]]);
}

/// Index of the first of the highest scores.
fn best_of(score: &[f64]) -> usize {
    (1..score.len()).fold(0, |best, i| if score[i] > score[best] { i } else { best })
}

/// The polygon projected to the plane of its vector area, with positive area there.
fn flatten(outline: &[u32], positions: &[DVec3]) -> Vec<DVec2> {
    let at = |i: usize| positions[outline[i % outline.len()] as usize];
    let centre = at(0);
    let normal: DVec3 = (0..outline.len()).map(|i| (at(i) - centre).cross(at(i + 1) - centre)).sum();
    let normal = normal.try_normalize().unwrap_or(DVec3::Z);
    let (u, v) = normal.any_orthonormal_pair();
    (0..outline.len()).map(|i| DVec2::new((at(i) - centre).dot(u), (at(i) - centre).dot(v))).collect()
}

/// Score of clipping corner `i`: 2 to 3 for an ear with a new diagonal, 1 to 2 for an ear whose diagonal is an edge
/// already, at most 0 for a corner that is no ear. Within a class it is the quality of the triangle.
fn ear_score(flat: &[DVec2], outline: &[u32], edges: &Edges, i: usize) -> f64 {
    let n = flat.len();
    let (before, after) = ((i + n - 1) % n, (i + 1) % n);
    let (a, b, c) = (flat[before], flat[i], flat[after]);
    let quality = quality(a, b, c);
    if quality <= 0.0 {
        return quality - 1.0;
    }
    let blocked = (0..n).any(|j| {
        let p = flat[j];
        // A corner at the place of one of the ear's own does not lie inside it.
        ![before, i, after].contains(&j)
            && ![a, b, c].contains(&p)
            && [(a, b), (b, c), (c, a)].iter().all(|&(s, t)| (t - s).perp_dot(p - s) >= 0.0)
    });
    // Of a quad both triangles count.
    let quality = if n == 4 { quality.min(self::quality(a, c, flat[(i + 2) % n])) } else { quality };
    match (blocked || quality <= 0.0, edges.contains(outline[before], outline[after])) {
        (true, _) => quality.min(0.0),
        (false, true) => 1.0 + quality,
        (false, false) => 2.0 + quality,
    }
}

/// Shape quality of a triangle, `4 √3 area / Σ side²`: 1 if equilateral, 0 if degenerate, negative if clockwise.
fn quality(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let sides = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    if sides > 0.0 { 2.0 * 3f64.sqrt() * (b - a).perp_dot(c - a) / sides } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw(positions: &[[f64; 2]], polygons: &[&[u32]]) -> RawMesh {
        let positions = positions.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect();
        let mut raw = RawMesh { positions, ..RawMesh::default() };
        for polygon in polygons {
            raw.corners.extend_from_slice(polygon);
            raw.ends.push(raw.corners.len() as u32);
        }
        raw
    }

    /// Checks that all triangles have positive area and that the areas add up to that of the polygon.
    fn check_inside(raw: &RawMesh, area: f64) {
        let out = triangulate(raw).unwrap();
        let p = |v: u32| raw.positions[v as usize].truncate();
        let areas = out.faces.iter().map(|&[a, b, c]| 0.5 * (p(b) - p(a)).perp_dot(p(c) - p(a)));
        assert!(areas.clone().all(|a| a > 0.0), "{out:?}");
        assert!((areas.sum::<f64>() - area).abs() < 1e-12);
    }

    #[test]
    fn concave_polygons_stay_inside() {
        check_inside(&raw(&[[0.0, 0.0], [2.0, 0.0], [0.5, 0.5], [0.0, 2.0]], &[&[0, 1, 2, 3]]), 1.0);
        check_inside(&raw(&[[0.5, 0.5], [0.0, 2.0], [0.0, 0.0], [2.0, 0.0]], &[&[0, 1, 2, 3]]), 1.0);
        // A comb with three teeth.
        let comb = [[0., 0.], [5., 0.], [5., 3.], [4., 3.], [4., 1.], [3., 1.], [3., 3.], [2., 3.], [2., 1.], [1., 1.]];
        let comb: Vec<[f64; 2]> = comb.iter().copied().chain([[1., 3.], [0., 3.]]).collect();
        let all: Vec<u32> = (0..comb.len() as u32).collect();
        check_inside(&raw(&comb, &[&all]), 11.0);
    }

    #[test]
    fn quads_that_share_two_sides_take_different_diagonals() {
        // Corner 4 lies inside and belongs to the two quads only.
        let m = raw(&[[0., 0.], [2., 0.], [2., 2.], [0., 2.], [1.1, 0.9]], &[&[0, 1, 2, 4], &[0, 4, 2, 3]]);
        let out = triangulate(&m).unwrap();
        let uses = |a: u32, b: u32| out.faces.iter().filter(|f| f.contains(&a) && f.contains(&b)).count();
        assert!(uses(0, 2) <= 2 && out.faces.len() == 4, "{out:?}");
    }

    #[test]
    fn repeated_corners_are_dropped() {
        let m = raw(&[[0., 0.], [2., 0.], [2., 2.]], &[&[0, 0, 1, 2, 0], &[0, 1, 0], &[1]]);
        let out = triangulate(&m).unwrap();
        assert_eq!((out.faces, out.dropped), (vec![[0, 1, 2]], vec![1, 2]));
    }
}

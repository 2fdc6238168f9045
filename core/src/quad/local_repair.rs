//! Mending the worst quads.
//!
//! Smoothing makes quads good on the whole, and may leave one at a crease much worse than all others. Here the vertices of
//! such quads try places around where they are and go where the worst quad around them is best (a pattern search on what
//! Freitag and Ollivier-Gooch, Tetrahedral Mesh Improvement Using Swapping and Smoothing, 1997, maximise). The worst quad
//! of the mesh never becomes worse.

use std::f64::consts::TAU;

use glam::DVec3;

use super::ground::Ground;
use super::rail::Rail;
use super::refine::QuadMesh;
use super::smooth::scaled_jacobian;
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

/// Scaled Jacobian below which a quad is worth mending: its angles are off by more than 45°.
const POOR: f64 = 0.8;
/// Rounds over all vertices of such quads.
const ROUNDS: usize = 12;
/// How far a vertex tries to go, in shares of the shortest side around, and in how many directions.
const REACHES: [f64; 4] = [0.4, 0.2, 0.1, 0.05];
const DIRECTIONS: usize = 12;
/// By how much the worst quad around a vertex has to become better for it to move.
const GAIN: f64 = 1e-4;

/// Cosine of the angle up to which a line through a vertex is straight on.
const STRAIGHT: f64 = 0.9;

/// What vertices are held on.
pub struct FeatureConstraint<'a> {
    /// The vertices that lie on lines; those beyond its end are free.
    pub vertices: &'a [bool],
    /// Whether a place on the surface, in that triangle, lies on a line.
    pub on_feature: &'a (dyn Fn(DVec3, u32) -> bool + 'a),
}

/// Mends the worst quads of a mesh on `base`. Vertices that are held move along their lines only.
///
/// # Errors
///
/// When cancelled; `mesh` is then as before.
pub fn repair_locally(
    mesh: &mut QuadMesh,
    base: &TriMesh,
    held: &FeatureConstraint<'_>,
    progress: &Progress,
) -> Result<(), Cancelled> {
    let mut around = vec![Vec::new(); mesh.positions.len()];
    for (q, quad) in (0u32..).zip(&mesh.quads) {
        quad.iter().for_each(|&v| around[v as usize].push(q));
    }
    let mut mending =
        Mending { ground: Ground::new(base), rail: Rail::new(mesh, base), mesh: mesh.clone(), around, held };
    for _ in 0..ROUNDS {
        progress.check()?;
        let poor = mending.mesh.quads.iter().filter(|q| scaled_jacobian(&mending.mesh, q) < POOR);
        let mut list: Vec<u32> = poor.flatten().copied().collect();
        list.sort_unstable();
        list.dedup();
        let moved = list.into_iter().filter(|&v| mending.improve(v)).count();
        if moved == 0 {
            break;
        }
    }
    *mesh = mending.mesh;
    Ok(())
}

/// A place for a vertex: with the length along the boundary if it lies there, and its triangle.
type Place = (Option<f64>, DVec3, u32);

struct Mending<'a> {
    mesh: QuadMesh,
    ground: Ground<'a>,
    rail: Rail,
    /// The quads around each vertex.
    around: Vec<Vec<u32>>,
    held: &'a FeatureConstraint<'a>,
}

impl Mending<'_> {
    /// Moves a vertex to the best of the places around it; tells whether one is better than where it is.
    fn improve(&mut self, v: u32) -> bool {
        if self.rail.is_fixed(v) {
            return false;
        }
        let at = self.mesh.positions[v as usize];
        let side = self.shortest_side(v);
        let directions = self.directions(v);
        let before = self.worst(v);
        for reach in REACHES {
            let mut best = (before + GAIN, None);
            for direction in &directions {
                let Some(place) = self.place(v, at + side * reach * *direction) else { continue };
                self.mesh.positions[v as usize] = place.1;
                let now = self.worst(v);
                if now > best.0 {
                    best = (now, Some(place));
                }
            }
            self.mesh.positions[v as usize] = at;
            if let (_, Some((along, p, f))) = best {
                (self.mesh.positions[v as usize], self.mesh.base_face[v as usize]) = (p, f);
                along.into_iter().for_each(|s| self.rail.put(v, s));
                return true;
            }
        }
        false
    }

    /// The scaled Jacobian of the worst quad around a vertex.
    fn worst(&self, v: u32) -> f64 {
        let of = |&q: &u32| scaled_jacobian(&self.mesh, &self.mesh.quads[q as usize]);
        self.around[v as usize].iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// The place on the surface next to where a vertex is wanted; `None` if it must not go there.
    fn place(&self, v: u32, wanted: DVec3) -> Option<Place> {
        if let Some((s, p, f)) = self.rail.slide(v, wanted) {
            return Some((Some(s), p, f));
        }
        let (p, f) = self.ground.follow(wanted, self.mesh.base_face[v as usize]);
        (p.is_finite() && (!self.is_held(v) || (self.held.on_feature)(p, f))).then_some((None, p, f))
    }

    fn is_held(&self, v: u32) -> bool {
        self.held.vertices.get(v as usize).is_some_and(|&h| h)
    }

    /// The unit vectors along which a vertex may go: all around, or both ways along its line if that does not bend there.
    fn directions(&self, v: u32) -> Vec<DVec3> {
        let at = self.mesh.positions[v as usize];
        if self.is_held(v) {
            let mut list: Vec<u32> = self.sides(v).flatten().filter(|&w| w != v && self.is_held(w)).collect();
            list.sort_unstable();
            list.dedup();
            let ways: Vec<DVec3> =
                list.iter().map(|&w| (self.mesh.positions[w as usize] - at).normalize_or_zero()).collect();
            return match ways[..] {
                [a, b] if a.dot(b) < -STRAIGHT => ways,
                _ => Vec::new(),
            };
        }
        let normal = self.ground.normal(at, self.mesh.base_face[v as usize]);
        let x = normal.any_orthonormal_vector();
        let y = normal.cross(x);
        let angle = |k: usize| TAU * k as f64 / DIRECTIONS as f64;
        (0..DIRECTIONS).map(|k| x * angle(k).cos() + y * angle(k).sin()).collect()
    }

    /// The sides that end at a vertex.
    fn sides(&self, v: u32) -> impl Iterator<Item = [u32; 2]> {
        let of = |&q: &u32| {
            let quad = self.mesh.quads[q as usize];
            (0..4).map(move |k| [quad[k], quad[(k + 1) % 4]])
        };
        self.around[v as usize].iter().flat_map(of).filter(move |side| side.contains(&v))
    }

    /// The length of the shortest side at a vertex.
    fn shortest_side(&self, v: u32) -> f64 {
        let p = |v: u32| self.mesh.positions[v as usize];
        self.sides(v).map(|[a, b]| p(a).distance(p(b))).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quad::scaled_jacobians;
    use crate::testing::square;

    /// A grid of four by four unit cells of which one inner vertex lies far off.
    fn spoiled() -> (TriMesh, QuadMesh) {
        let base = square(16);
        let place = |k: usize| DVec3::new((k % 5) as f64, (k / 5) as f64, 0.0) / 4.0;
        let mut positions: Vec<DVec3> = (0..25).map(place).collect();
        positions[12] += DVec3::new(0.18, 0.2, 0.0);
        let quad = |k: usize| {
            let v = (k + k / 4) as u32;
            [v, v + 1, v + 6, v + 5]
        };
        let index = crate::surface::SurfaceIndex::new(&base);
        let base_face = positions.iter().map(|&p| index.nearest(p).face.0).collect();
        let boundary = (0..25).map(|k| [0, 4].contains(&(k % 5)) || [0, 4].contains(&(k / 5))).collect();
        let quads = (0..16).map(quad).collect();
        (base, QuadMesh { positions, quads, patch: vec![0; 16], base_face, boundary, n_nodes: 1, arcs: Vec::new() })
    }

    fn least(mesh: &QuadMesh) -> f64 {
        scaled_jacobians(mesh).into_iter().fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_worst_quad_becomes_good_enough() {
        let (base, mut mesh) = spoiled();
        assert!(least(&mesh) < 0.5);
        let held = FeatureConstraint { vertices: &[], on_feature: &|_, _| true };
        repair_locally(&mut mesh, &base, &held, &Progress::new()).unwrap();
        assert!(least(&mesh) >= POOR, "{}", least(&mesh));
    }

    #[test]
    fn held_vertices_keep_to_their_line() {
        let (base, mut mesh) = spoiled();
        // The column through the spoiled vertex is a line, and so straight enough.
        for k in [2, 7, 17, 22] {
            mesh.positions[k].x = mesh.positions[12].x;
        }
        let x = mesh.positions[12].x;
        let vertices: Vec<bool> = (0..25).map(|k| k % 5 == 2).collect();
        let on_feature = |p: DVec3, _| (p.x - x).abs() < 1e-9;
        let before = least(&mesh);
        repair_locally(
            &mut mesh,
            &base,
            &FeatureConstraint { vertices: &vertices, on_feature: &on_feature },
            &Progress::new(),
        )
        .unwrap();
        assert!(least(&mesh) > before + 0.1, "{before} {}", least(&mesh));
        assert!((0..25).filter(|k| k % 5 == 2).all(|k| (mesh.positions[k].x - x).abs() < 1e-9));
    }
}

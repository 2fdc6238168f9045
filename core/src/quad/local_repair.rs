//! Local repair of the worst quads.
//!
//! Smoothing improves quads on average and may leave a few much worse ones, for example at a crease. The vertices of
//! such quads move by a pattern search: to the one of several positions around them where the least scaled Jacobian of
//! the quads around is greatest (the objective of Freitag and Ollivier-Gooch, Tetrahedral Mesh Improvement Using
//! Swapping and Smoothing, 1997). The least scaled Jacobian of the mesh never decreases.

use std::f64::consts::TAU;

use glam::DVec3;

use super::boundary::Boundary;
use super::projection::Projection;
use super::quad_mesh::QuadMesh;
use super::quality::scaled_jacobian;
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

/// Scaled Jacobian below which a quad is repaired: an angle differs by more than 37° from a right one.
const POOR: f64 = 0.8;
/// Most rounds over all vertices of poor quads.
const ROUNDS: usize = 12;
/// Radii of the search pattern, in lengths of the shortest side at the vertex, in the order in which they are tried.
const RADII: [f64; 4] = [0.4, 0.2, 0.1, 0.05];
/// Directions of the search pattern.
const DIRECTIONS: usize = 12;
/// Least increase of the least scaled Jacobian around a vertex for it to move.
const GAIN: f64 = 1e-4;
/// Cosine of the greatest angle between two feature sides at a vertex for the feature to be straight there; at a corner
/// of a feature a vertex does not move.
const STRAIGHT: f64 = 0.9;

/// The vertices that may move along features only, and where features are.
pub struct FeatureConstraint<'a> {
    /// Whether each vertex lies on a feature; vertices beyond the end of the list are free.
    pub vertices: &'a [bool],
    /// Whether a position on the surface, in this triangle, lies on a feature.
    pub on_feature: &'a (dyn Fn(DVec3, u32) -> bool + 'a),
}

/// Repairs the worst quads of a mesh on `base`. Vertices on features move along them only.
///
/// # Errors
///
/// When cancelled; `mesh` is then unchanged.
pub fn repair_locally(
    mesh: &mut QuadMesh,
    base: &TriMesh,
    constraint: &FeatureConstraint<'_>,
    progress: &Progress,
) -> Result<(), Cancelled> {
    let mut around = vec![Vec::new(); mesh.positions.len()];
    for (q, quad) in (0u32..).zip(&mesh.quads) {
        quad.iter().for_each(|&v| around[v as usize].push(q));
    }
    let mut repair = LocalRepair {
        surface: Projection::new(base),
        boundary: Boundary::new(mesh, base),
        mesh: mesh.clone(),
        around,
        constraint,
    };
    for _ in 0..ROUNDS {
        progress.check()?;
        let poor = repair.mesh.quads.iter().filter(|q| scaled_jacobian(&repair.mesh, q) < POOR);
        let mut list: Vec<u32> = poor.flatten().copied().collect();
        list.sort_unstable();
        list.dedup();
        let moved = list.into_iter().filter(|&v| repair.improve(v)).count();
        if moved == 0 {
            break;
        }
    }
    *mesh = repair.mesh;
    Ok(())
}

/// A position for a vertex, with its triangle and, on the boundary, its arc length there.
struct Candidate {
    position: DVec3,
    face: u32,
    arc_length: Option<f64>,
}

struct LocalRepair<'a> {
    mesh: QuadMesh,
    surface: Projection<'a>,
    boundary: Boundary,
    /// The quads around each vertex.
    around: Vec<Vec<u32>>,
    constraint: &'a FeatureConstraint<'a>,
}

impl LocalRepair<'_> {
    /// Moves a vertex to the best position of the first radius that has a better one; returns whether a radius has.
    fn improve(&mut self, v: u32) -> bool {
        if self.boundary.is_fixed(v) {
            return false;
        }
        let at = self.mesh.positions[v as usize];
        let side = self.shortest_side(v);
        let directions = self.directions(v);
        let before = self.least_jacobian(v);
        for radius in RADII {
            let mut best = (before + GAIN, None);
            for direction in &directions {
                let Some(candidate) = self.candidate(v, at + side * radius * *direction) else { continue };
                self.mesh.positions[v as usize] = candidate.position;
                let now = self.least_jacobian(v);
                if now > best.0 {
                    best = (now, Some(candidate));
                }
            }
            self.mesh.positions[v as usize] = at;
            if let (_, Some(to)) = best {
                (self.mesh.positions[v as usize], self.mesh.base_face[v as usize]) = (to.position, to.face);
                to.arc_length.into_iter().for_each(|s| self.boundary.move_to(v, s));
                return true;
            }
        }
        false
    }

    /// The least scaled Jacobian of the quads around a vertex.
    fn least_jacobian(&self, v: u32) -> f64 {
        let of = |&q: &u32| scaled_jacobian(&self.mesh, &self.mesh.quads[q as usize]);
        self.around[v as usize].iter().map(of).fold(f64::INFINITY, f64::min)
    }

    /// The position on the surface near `wanted`; `None` if the vertex must not move there.
    fn candidate(&self, v: u32, wanted: DVec3) -> Option<Candidate> {
        if let Some(point) = self.boundary.nearest_allowed(v, wanted) {
            return Some(Candidate { position: point.position, face: point.face, arc_length: Some(point.s) });
        }
        let (position, face) = self.surface.project(wanted, self.mesh.base_face[v as usize]);
        let allowed = !self.is_constrained(v) || (self.constraint.on_feature)(position, face);
        (position.is_finite() && allowed).then_some(Candidate { position, face, arc_length: None })
    }

    fn is_constrained(&self, v: u32) -> bool {
        self.constraint.vertices.get(v as usize).is_some_and(|&c| c)
    }

    /// The unit vectors along which a vertex may move: all around in the tangent plane; for a vertex on a feature both
    /// directions of it, none where it turns.
    fn directions(&self, v: u32) -> Vec<DVec3> {
        let at = self.mesh.positions[v as usize];
        if self.is_constrained(v) {
            let mut list: Vec<u32> = self.sides(v).flatten().filter(|&w| w != v && self.is_constrained(w)).collect();
            list.sort_unstable();
            list.dedup();
            let along: Vec<DVec3> =
                list.iter().map(|&w| (self.mesh.positions[w as usize] - at).normalize_or_zero()).collect();
            return match along[..] {
                [a, b] if a.dot(b) < -STRAIGHT => along,
                _ => Vec::new(),
            };
        }
        let normal = self.surface.normal(at, self.mesh.base_face[v as usize]);
        let x = normal.any_orthonormal_vector();
        let y = normal.cross(x);
        let angle = |k: usize| TAU * k as f64 / DIRECTIONS as f64;
        (0..DIRECTIONS).map(|k| x * angle(k).cos() + y * angle(k).sin()).collect()
    }

    /// The sides of quads at a vertex.
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
    use super::super::quality::scaled_jacobians;
    use super::*;
    use crate::surface::SurfaceIndex;
    use crate::testing::square;

    /// A grid of four by four quads with one inner vertex far from its place.
    fn distorted() -> (TriMesh, QuadMesh) {
        let base = square(16);
        let place = |k: usize| DVec3::new((k % 5) as f64, (k / 5) as f64, 0.0) / 4.0;
        let mut positions: Vec<DVec3> = (0..25).map(place).collect();
        positions[12] += DVec3::new(0.18, 0.2, 0.0);
        let quad = |k: usize| {
            let v = (k + k / 4) as u32;
            [v, v + 1, v + 6, v + 5]
        };
        let index = SurfaceIndex::new(&base);
        let base_face = positions.iter().map(|&p| index.nearest(p).face.0).collect();
        let boundary = (0..25).map(|k| [0, 4].contains(&(k % 5)) || [0, 4].contains(&(k / 5))).collect();
        let quads = (0..16).map(quad).collect();
        (base, QuadMesh { positions, quads, patch: vec![0; 16], base_face, boundary, n_nodes: 1, arcs: Vec::new() })
    }

    fn least(mesh: &QuadMesh) -> f64 {
        scaled_jacobians(mesh).into_iter().fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn the_worst_quad_is_repaired() {
        let (base, mut mesh) = distorted();
        assert!(least(&mesh) < 0.5);
        let constraint = FeatureConstraint { vertices: &[], on_feature: &|_, _| true };
        repair_locally(&mut mesh, &base, &constraint, &Progress::new()).unwrap();
        assert!(least(&mesh) >= POOR, "{}", least(&mesh));
    }

    #[test]
    fn vertices_on_a_feature_move_along_it() {
        let (base, mut mesh) = distorted();
        // The column through the displaced vertex is a feature.
        for k in [2, 7, 17, 22] {
            mesh.positions[k].x = mesh.positions[12].x;
        }
        let x = mesh.positions[12].x;
        let vertices: Vec<bool> = (0..25).map(|k| k % 5 == 2).collect();
        let on_feature = |p: DVec3, _| (p.x - x).abs() < 1e-9;
        let before = least(&mesh);
        let constraint = FeatureConstraint { vertices: &vertices, on_feature: &on_feature };
        repair_locally(&mut mesh, &base, &constraint, &Progress::new()).unwrap();
        assert!(least(&mesh) > before + 0.1, "{before} {}", least(&mesh));
        assert!((0..25).filter(|k| k % 5 == 2).all(|k| (mesh.positions[k].x - x).abs() < 1e-9));
    }
}

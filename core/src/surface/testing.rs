//! Meshes and curves for tests of curves on surfaces.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::curve::{Crossing, SurfaceCurve};
use crate::surface::geodesic::geodesic_in;
use crate::surface::vertex_path::VertexPath;
use crate::testing::research_mesh;

/// A pseudo-random number generator (an LCG with the constants of Knuth's MMIX).
pub struct Random(pub u64);

impl Random {
    /// Uniform in `[0, 1)`.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in `0..n`.
    pub fn below(&mut self, n: usize) -> usize {
        ((self.unit() * n as f64) as usize).min(n - 1)
    }
}

/// A grid that is periodic in `i` and, where `wrap`, in `j`. `place` maps `(i / nu, j / nv)`, displaced by up to
/// `jitter` cells.
fn grid(nu: usize, nv: usize, wrap: bool, jitter: f64, place: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let mut random = Random(7);
    let rows = if wrap { nv } else { nv + 1 };
    let mut positions = Vec::new();
    for j in 0..rows {
        for i in 0..nu {
            let inner = wrap || (j > 0 && j < nv);
            let mut displacement = || (random.unit() - 0.5) * 2.0 * jitter;
            let (du, dv) = (displacement(), displacement());
            let v = j as f64 + if inner { dv } else { 0.0 };
            positions.push(place((i as f64 + du) / nu as f64, v / nv as f64));
        }
    }
    let mut faces = Vec::new();
    for j in 0..nv {
        for i in 0..nu {
            let at = |i: usize, j: usize| ((j % rows) * nu + i % nu) as u32;
            faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    TriMesh::from_faces(positions, &faces).unwrap()
}

/// An upright cylinder of radius 0.25 and height 0.8, `nu` cells around, `nv` high.
pub fn cylinder(nu: usize, nv: usize, jitter: f64) -> TriMesh {
    grid(nu, nv, false, jitter, |u, v| DVec3::new(0.25 * (TAU * u).cos(), 0.25 * (TAU * u).sin(), 0.8 * v))
}

/// A torus of radii 0.3 and 0.12, `nu` cells the long way, `nv` the short way.
pub fn torus(nu: usize, nv: usize, jitter: f64) -> TriMesh {
    grid(nu, nv, true, jitter, |u, v| {
        let r = 0.3 + 0.12 * (TAU * v).cos();
        DVec3::new(r * (TAU * u).cos(), r * (TAU * u).sin(), 0.12 * (TAU * v).sin())
    })
}

/// The curve along row `j` of a grid, its parameters displaced by up to `noise`.
pub fn ring(mesh: &TriMesh, nu: usize, j: usize, noise: f64) -> SurfaceCurve {
    let mut random = Random(11);
    let mut crossings = Vec::new();
    for i in 0..nu {
        let a = 2 * (j * nu + i);
        for h in [3 * (a + 1), 3 * a + 1] {
            let t = 0.5 + noise * 2.0 * (random.unit() - 0.5);
            crossings.push(Crossing { halfedge: HalfedgeId::new(h), t });
        }
    }
    let curve = SurfaceCurve { crossings, closed: true };
    curve.check(mesh).unwrap();
    curve
}

/// The curve along column `i` of a cylinder of `nv` rows, with pseudo-random parameters.
pub fn upright(mesh: &TriMesh, nu: usize, nv: usize, i: usize) -> SurfaceCurve {
    let mut random = Random(5);
    let mut halfedges = vec![3 * 2 * i];
    for j in 0..nv {
        let a = 2 * (j * nu + i);
        halfedges.extend([3 * a + 2, 3 * (a + 1) + 1]);
    }
    let crossing = |h| Crossing { halfedge: HalfedgeId::new(h), t: 0.15 + 0.7 * random.unit() };
    let curve = SurfaceCurve { crossings: halfedges.into_iter().map(crossing).collect(), closed: false };
    curve.check(mesh).unwrap();
    curve
}

/// A closed curve along a cycle of the dual graph: a random dual edge and its path in a breadth-first tree from a
/// random triangle. `None` where the cycle is too short.
pub fn dual_cycle(mesh: &TriMesh, random: &mut Random) -> Option<SurfaceCurve> {
    let root = FaceId::new(random.below(mesh.n_faces()));
    let mut tree: BreadthFirst<FaceId, HalfedgeId> = BreadthFirst::new(mesh.n_faces());
    tree.start(root);
    while let Some(f) = tree.visit() {
        for (h, g) in mesh.adjacent_faces(f) {
            tree.reach(g, h);
        }
    }
    // The half-edges crossed from a triangle up to the root.
    let path = |mut f: FaceId| {
        let mut up = Vec::new();
        while let Some(h) = tree.via(f) {
            up.push(mesh.twin(h).unwrap());
            f = mesh.face(h);
        }
        up
    };
    let h = HalfedgeId::new(random.below(mesh.n_halfedges()));
    let g = mesh.twin(h)?;
    let (mut from, mut to) = (path(mesh.face(h)), path(mesh.face(g)));
    while from.last().is_some() && from.last() == to.last() {
        from.pop();
        to.pop();
    }
    // From the common ancestor down to `h`, across it, and up again on the other side.
    let mut halfedges: Vec<HalfedgeId> = from.iter().rev().map(|&h| mesh.twin(h).unwrap()).collect();
    halfedges.push(h);
    halfedges.extend(to);
    let crossing = |halfedge| Crossing { halfedge, t: 0.1 + 0.8 * random.unit() };
    let curve = SurfaceCurve { crossings: halfedges.into_iter().map(crossing).collect(), closed: true };
    (curve.crossings.len() > 8 && curve.check(mesh).is_ok()).then_some(curve)
}

/// Algebraic intersection numbers of a closed curve with `count` closed edge paths, each a random edge and its path in
/// a breadth-first tree of the vertices. They depend on the homology class of the curve alone.
pub fn homology_numbers(mesh: &TriMesh, curve: &SurfaceCurve, count: usize) -> Vec<i64> {
    let mut tree: BreadthFirst<VertexId, HalfedgeId> = BreadthFirst::new(mesh.n_vertices());
    tree.start(VertexId(0));
    while let Some(v) = tree.visit() {
        for (h, w) in mesh.spokes(v) {
            tree.reach(w, h);
        }
    }
    let mut signed = vec![0i64; mesh.n_edges()];
    for c in &curve.crossings {
        let along = mesh.halfedge(mesh.edge(c.halfedge)) == c.halfedge;
        signed[mesh.edge(c.halfedge).index()] += if along { 1 } else { -1 };
    }
    // The signed crossings on the path from `v` to the root of its tree, and that root.
    let up = |mut v: VertexId| {
        let mut sum = 0;
        while let Some(h) = tree.via(v) {
            let w = if mesh.origin(h) == v { mesh.target(h) } else { mesh.origin(h) };
            let e = mesh.edge(h);
            sum += signed[e.index()] * if mesh.edge_vertices(e)[0] == v { 1 } else { -1 };
            v = w;
        }
        (sum, v)
    };
    let mut random = Random(3);
    let mut number = || {
        let e = mesh.edges().nth(random.below(mesh.n_edges())).unwrap();
        let [a, b] = mesh.edge_vertices(e);
        let ((up_a, root_a), (up_b, root_b)) = (up(a), up(b));
        if root_a == root_b { up_b - up_a + signed[e.index()] } else { 0 }
    };
    (0..count).map(|_| number()).collect()
}

/// The closed curve of geodesics from each waypoint to the next. It passes each waypoint counter-clockwise at a
/// thousandth of an edge, like the result of a search on a graph of geodesics.
pub fn geodesic_polygon(mesh: &TriMesh, waypoints: &[VertexId]) -> SurfaceCurve {
    let next = |k: usize| waypoints[(k + 1) % waypoints.len()];
    let paths: Vec<VertexPath> =
        waypoints.iter().enumerate().map(|(k, &v)| geodesic_in(mesh, v, next(k), |_| true).unwrap()).collect();
    let mut crossings = Vec::new();
    for (k, path) in paths.iter().enumerate() {
        crossings.extend(path.crossings.iter().copied());
        let goal = mesh.face(paths[(k + 1) % paths.len()].crossings[0].halfedge);
        // The outgoing half-edge at the waypoint in the triangle that the curve has reached.
        let mut out = mesh.prev(mesh.twin(path.crossings.last().unwrap().halfedge).unwrap());
        while mesh.face(out) != goal {
            crossings.push(Crossing { halfedge: mesh.prev(out), t: 1.0 - 1e-3 });
            out = mesh.twin(mesh.prev(out)).unwrap();
        }
    }
    let curve = SurfaceCurve { crossings, closed: true };
    curve.check(mesh).unwrap();
    curve
}

/// A research mesh; `None` where it is missing.
pub fn real_mesh(file: &str) -> Option<TriMesh> {
    research_mesh(file).map(|loaded| (*loaded.mesh).clone())
}

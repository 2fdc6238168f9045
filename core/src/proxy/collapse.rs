//! Simplification by half-edge collapse.
//!
//! The vertex of least cost is removed first, by collapsing an edge to its best neighbour. The cost is the squared
//! length of the edge plus a multiple of the mean squared distance from the planes around both vertices (quadric error
//! metrics). Triangles are then of even size but smaller where the surface is curved. A collapse must keep the topology
//! (link condition), keep features and boundaries on themselves, flip no triangle in the flat star or in space, and
//! leave no triangle too thin. The remaining vertex does not move, so all vertices stay on the original surface.
//!
//! Instead of a priority queue there are sweeps over all vertices, each with a higher ceiling of the cost. The order is
//! nearly the same, but vertices that are neighbours in memory are visited together, which is much faster on large
//! meshes. A vertex above the ceiling is skipped; one that cannot be removed is tried again after a neighbour has been.
//! The limits on shape are loosened in passes while the target is not reached.

use glam::{DVec2, DVec3};

use super::connectivity::{Connectivity, NONE, next};
use super::flat_star::{FlatFace, FlatStar, in_face_order};
use super::quadric::Quadric;
use super::tracked_vertices::TrackedVertices;
use super::triangle_shape::roundness;
use super::vertex_kinds::VertexKind;
use crate::mesh::TriMesh;
use crate::progress::{Cancelled, Progress};

/// Weight of the squared distance from the planes, relative to the squared length. On a sphere a triangle of side `L`
/// is about `L²/8R` off; with 100 this costs as much as the length where `R = 1.25 L`, and a tenth of it where
/// `R = 4 L`.
const DISTANCE_WEIGHT: f64 = 100.0;

/// Cosine of 40°, the most by which a feature may turn when one of its vertices is removed.
const CREASE_COSINE: f64 = 0.766;

/// Least height over length of a triangle in the flat star, relative to [`Limits::roundness`]: tracked vertices in it
/// then have well-conditioned barycentric coordinates.
const FLAT_SHAPE: f64 = 0.25;

/// Least cosine between the normals of a triangle and of the original at its corners, relative to [`Limits::turn`].
const ORIGINAL_TURN: f64 = 0.5;

/// Vertices between two checks for cancellation: a few milliseconds of work.
const CHECK_INTERVAL: usize = 4096;

/// Limits on the triangles that a collapse leaves.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// Least roundness of a triangle, unless it was worse before.
    roundness: f64,
    /// Greatest length of a new edge, in units of the equilateral length.
    length: f64,
    /// Greatest degree of a vertex.
    degree: usize,
    /// Least cosine between the normals of a triangle before and after.
    turn: f64,
}

/// Passes from strict to loose limits. The first leaves near-isotropic triangles and mostly suffices; the last is for
/// meshes with slivers, and still flips no triangle.
const PASSES: [Limits; 3] = [
    Limits { roundness: 0.4, length: 1.7, degree: 9, turn: 0.8 },
    Limits { roundness: 0.2, length: 2.5, degree: 10, turn: 0.7 },
    Limits { roundness: 0.05, length: 6.0, degree: 12, turn: 0.5 },
];

/// Factor of the cost ceiling from sweep to sweep. The cost is a squared length, so edges collapse in the order of
/// their lengths up to 10 %.
const CEILING_GROWTH: f64 = 1.2;

/// The first ceiling, in squared equilateral lengths; edges shorter than a thousandth collapse in any order.
const FIRST_CEILING: f64 = 1e-6;

/// The state of a simplification.
pub(super) struct Simplifier<'a> {
    pub positions: &'a [DVec3],
    pub mesh: Connectivity,
    pub kinds: Vec<VertexKind>,
    pub normals: &'a [DVec3],
    pub tracked: TrackedVertices,
    pub star: FlatStar,
    quadrics: Vec<Quadric>,
    /// Side length of equilateral triangles at the target.
    length: f64,
    /// A lower bound of the cost of each vertex; infinite where it cannot be removed at present.
    cost_bound: Vec<f32>,
    /// `mark[v] == stamp` for the ring of the current star.
    mark: Vec<u32>,
    stamp: u32,
    candidates: Vec<(f64, usize)>,
    faces: Vec<FlatFace>,
    points: Vec<(u32, DVec2)>,
}

impl<'a> Simplifier<'a> {
    /// Starts a simplification of `mesh` to triangles with sides of about `length`.
    pub fn new(mesh: &'a TriMesh, sharp: &[bool], kinds: Vec<VertexKind>, normals: &'a [DVec3], length: f64) -> Self {
        let n = mesh.n_vertices();
        Self {
            positions: mesh.positions(),
            mesh: Connectivity::new(mesh, sharp),
            kinds,
            normals,
            tracked: TrackedVertices::new(n, mesh.n_faces()),
            star: FlatStar::default(),
            quadrics: quadrics(mesh, sharp),
            length,
            cost_bound: vec![f32::INFINITY; n],
            mark: vec![0; n],
            stamp: 0,
            candidates: Vec::new(),
            faces: Vec::new(),
            points: Vec::new(),
        }
    }

    /// Collapses edges until `target` faces are left or no vertex can be removed.
    pub fn reduce(&mut self, target: usize, progress: &Progress) -> Result<(), Cancelled> {
        let from = self.mesh.n_faces();
        for limits in PASSES {
            let mut vertices = self.movable();
            let mut ceiling = FIRST_CEILING * self.length * self.length;
            while self.mesh.n_faces() > target {
                progress.check()?;
                progress.report("Simplifying", (from - self.mesh.n_faces()) as f64 / (from - target) as f64);
                self.sweep(&vertices, ceiling as f32, &limits, target, progress)?;
                vertices.retain(|&v| self.mesh.has_vertex(v));
                let least = vertices.iter().map(|&v| self.cost_bound[v as usize]).fold(f32::INFINITY, f32::min);
                if least == f32::INFINITY {
                    break;
                }
                ceiling = CEILING_GROWTH * ceiling.max(f64::from(least));
            }
        }
        Ok(())
    }

    /// Removes the vertices that cost no more than `ceiling`.
    fn sweep(
        &mut self,
        vertices: &[u32],
        ceiling: f32,
        limits: &Limits,
        target: usize,
        progress: &Progress,
    ) -> Result<(), Cancelled> {
        for (count, &v) in vertices.iter().enumerate() {
            if count % CHECK_INTERVAL == CHECK_INTERVAL - 1 {
                progress.check()?;
            }
            if self.cost_bound[v as usize] > ceiling || !self.mesh.has_vertex(v) {
                continue;
            }
            match self.cheapest_collapse(v, limits) {
                Some((cost, k)) if cost as f32 <= ceiling => self.collapse(v, k),
                Some((cost, _)) => self.cost_bound[v as usize] = cost as f32,
                None => self.cost_bound[v as usize] = f32::INFINITY,
            }
            if self.mesh.n_faces() <= target {
                break;
            }
        }
        Ok(())
    }

    /// The vertices that may be removed; sets their cost bounds to the squared length of the shortest edge.
    fn movable(&mut self) -> Vec<u32> {
        let free = |v: &u32| self.mesh.has_vertex(*v) && self.kinds[*v as usize] != VertexKind::Corner;
        let vertices: Vec<u32> = (0..self.kinds.len() as u32).filter(free).collect();
        for &v in &vertices {
            let mut least = f64::INFINITY;
            self.mesh.for_neighbours(v, |b| {
                least = least.min(self.positions[b as usize].distance_squared(self.positions[v as usize]));
            });
            self.cost_bound[v as usize] = least as f32;
        }
        vertices
    }

    /// The cheapest allowed collapse of `v`: its cost and the neighbour, by index in the star's ring.
    fn cheapest_collapse(&mut self, v: u32, limits: &Limits) -> Option<(f64, usize)> {
        let crease = self.kinds[v as usize] == VertexKind::Crease;
        self.star.gather(&self.mesh, v, crease);
        if crease && self.star.crease.is_none() {
            return None;
        }
        let p = self.positions[v as usize];
        self.candidates.clear();
        for (k, &b) in self.star.ring.iter().enumerate() {
            if crease && k != 0 && Some(k) != self.star.crease {
                continue;
            }
            let q = self.positions[b as usize];
            let distance = self.quadrics[v as usize].mean_of_two(&self.quadrics[b as usize], q);
            self.candidates.push((p.distance_squared(q) + DISTANCE_WEIGHT * distance, k));
        }
        self.candidates.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.star.flatten(self.positions, v);
        self.stamp += 1;
        for &b in &self.star.ring {
            self.mark[b as usize] = self.stamp;
        }
        self.candidates
            .iter()
            .copied()
            .find(|&(_, k)| self.keeps_shape(v, k, limits) && self.keeps_topology(v, k, limits))
    }

    /// Link condition and degrees for a collapse of `v` to ring vertex `k`.
    fn keeps_topology(&self, v: u32, k: usize, limits: &Limits) -> bool {
        let star = &self.star;
        let b = star.ring[k];
        let n = star.ring.len();
        // The ring neighbours of `b`: the third corners of the triangles at the edge.
        let beside = [(star.closed || k > 0).then(|| (k + n - 1) % n), (star.closed || k + 1 < n).then(|| (k + 1) % n)];
        let mut common = 0;
        self.mesh.for_neighbours(b, |c| {
            common += usize::from(self.mark[c as usize] == self.stamp);
        });
        if common != beside.iter().flatten().count() || self.mesh.degree(b) + n - 2 - common > limits.degree {
            return false;
        }
        beside.iter().flatten().all(|&i| {
            let c = star.ring[i];
            self.mesh.degree(c) > if self.mesh.is_boundary(c) { 3 } else { 4 }
        }) && self.keeps_crease(v, k)
    }

    /// Whether a feature or boundary keeps its direction and does not coincide with another one.
    fn keeps_crease(&self, v: u32, k: usize) -> bool {
        let star = &self.star;
        let Some(far) = star.crease else { return true };
        let (b, c) = (star.ring[k], star.ring[if k == 0 { far } else { 0 }]);
        let [p, q, r] = [v, b, c].map(|i| self.positions[i as usize]);
        let along = (q - r).normalize_or_zero();
        let straight = |d: DVec3| d.normalize_or_zero().dot(along) > CREASE_COSINE;
        // If both features at `v` belong to one triangle, its third side becomes the feature. It must not be one
        // already.
        let mut coincides = false;
        self.mesh.for_spokes(b, |h| {
            coincides |= self.mesh.target(h) == c && (self.mesh.is_feature(h) || self.mesh.twin(h) == NONE);
        });
        straight(q - p) && straight(p - r) && !coincides
    }

    /// Whether a collapse of `v` to ring vertex `k` keeps all other triangles within the limits.
    fn keeps_shape(&self, v: u32, k: usize, limits: &Limits) -> bool {
        let star = &self.star;
        let b = star.ring[k] as usize;
        let (p, q) = (self.positions[v as usize], self.positions[b]);
        let longest = (limits.length * self.length).powi(2);
        for i in 0..star.spokes.len() {
            let j = star.after(i);
            if i == k || j == k {
                continue;
            }
            let flat = [star.flat[k], star.flat[i], star.flat[j]];
            let area = (flat[1] - flat[0]).perp_dot(flat[2] - flat[0]);
            let size = (flat[1] - flat[0]).length_squared().max((flat[2] - flat[0]).length_squared());
            let well_shaped = area > FLAT_SHAPE * limits.roundness * size;
            if !well_shaped {
                return false;
            }
            let [c, d] = [i, j].map(|i| star.ring[i] as usize);
            let (x, y) = (self.positions[c], self.positions[d]);
            if !self.keeps_triangle([p, q, x, y], [b, c, d], limits, longest) {
                return false;
            }
        }
        true
    }

    /// Whether a triangle may change from `[p, x, y]` to `[q, x, y]`; `ids` are its corners after the change.
    fn keeps_triangle(&self, [p, q, x, y]: [DVec3; 4], ids: [usize; 3], limits: &Limits, longest: f64) -> bool {
        let (before, after) = ((x - p).cross(y - p), (x - q).cross(y - q));
        let normal = after.normalize_or_zero();
        let was = before.normalize_or_zero();
        let shape = roundness([q, x, y]);
        if shape < limits.roundness && shape < roundness([p, x, y]) {
            return false;
        }
        // A degenerate triangle has no normal to keep.
        if was != DVec3::ZERO && normal.dot(was) <= limits.turn {
            return false;
        }
        // Turns of many collapses add up, so the normal is also compared with those of the original.
        let least = ORIGINAL_TURN * limits.turn;
        if ids.iter().any(|&i| self.kinds[i] == VertexKind::Smooth && self.normals[i].dot(normal) <= least) {
            return false;
        }
        let old = (p - x).length_squared().max((p - y).length_squared());
        let new = (q - x).length_squared().max((q - y).length_squared());
        new <= longest || new <= old
    }

    /// Collapses `v` to ring vertex `k` of its star.
    fn collapse(&mut self, v: u32, k: usize) {
        let star = &self.star;
        let b = star.ring[k];
        self.points.clear();
        self.faces.clear();
        for i in 0..star.spokes.len() {
            let j = star.after(i);
            let h = star.spokes[i];
            self.tracked.take(in_face_order(h, [DVec2::ZERO, star.flat[i], star.flat[j]]), &mut self.points);
            if i != k && j != k {
                self.faces.push(in_face_order(h, [star.flat[k], star.flat[i], star.flat[j]]));
            }
        }
        self.points.push((v, DVec2::ZERO));
        self.mesh.collapse(&star.spokes, v, b);
        for &(p, position) in &self.points {
            self.tracked.insert(p, position, &self.faces);
        }
        let removed = self.quadrics[v as usize];
        self.quadrics[b as usize].add(&removed);
        // Neighbours that could not be removed before are tried again.
        for &c in &self.star.ring {
            if self.cost_bound[c as usize] == f32::INFINITY && self.kinds[c as usize] != VertexKind::Corner {
                self.cost_bound[c as usize] = 0.0;
            }
        }
    }

    /// Replaces vertex `v`, whose star has been flattened, by the tracked vertex `w` at `position` in the flat star.
    pub fn shift(&mut self, v: u32, w: u32, position: DVec2) {
        let star = &self.star;
        self.points.clear();
        self.faces.clear();
        for i in 0..star.spokes.len() {
            let (h, ends) = (star.spokes[i], [star.flat[i], star.flat[star.after(i)]]);
            self.tracked.take(in_face_order(h, [DVec2::ZERO, ends[0], ends[1]]), &mut self.points);
            self.faces.push(in_face_order(h, [position, ends[0], ends[1]]));
        }
        self.mesh.replace(&star.spokes, v, w);
        self.points.push((v, DVec2::ZERO));
        for &(p, position) in self.points.iter().filter(|p| p.0 != w) {
            self.tracked.insert(p, position, &self.faces);
        }
        self.tracked.untrack(w);
        self.quadrics[w as usize] = self.quadrics[v as usize];
    }

    /// Flips the inner edge of `h`. The corners of its two triangles in the plane are the origin and target of `h` and
    /// the opposite corners on its left and right.
    pub fn flip(&mut self, h: u32, [a, b, c, d]: [DVec2; 4]) {
        let g = self.mesh.twin(h);
        self.points.clear();
        self.tracked.take(in_face_order(h, [a, b, c]), &mut self.points);
        self.tracked.take(in_face_order(g, [b, a, d]), &mut self.points);
        self.mesh.flip(h);
        let faces = [(h / 3, [c, a, d]), (g / 3, [d, b, c])];
        for &(p, position) in &self.points {
            self.tracked.insert(p, position, &faces);
        }
    }
}

/// For each vertex the planes of its faces, weighted by area, and of features and boundaries the planes through the
/// edge and orthogonal to the face.
fn quadrics(mesh: &TriMesh, sharp: &[bool]) -> Vec<Quadric> {
    let mut quadrics = vec![Quadric::default(); mesh.n_vertices()];
    for f in mesh.faces() {
        let [a, b, c] = mesh.face_vertices(f);
        let area = mesh.face_area(f) / 3.0;
        let plane = Quadric::plane(mesh.face_normal(f), mesh.position(a), area, area);
        for v in [a, b, c] {
            quadrics[v.index()].add(&plane);
        }
    }
    for h in mesh.halfedges().filter(|&h| mesh.twin(h).is_none() || sharp[mesh.edge(h).index()]) {
        let along = mesh.vector(h);
        let upright = along.cross(mesh.face_normal(mesh.face(h))).normalize_or_zero();
        // No weight in the denominator of the mean: leaving a feature costs more than leaving the surface.
        let plane = Quadric::plane(upright, mesh.position(mesh.origin(h)), along.length_squared(), 0.0);
        for v in [mesh.origin(h), mesh.target(h)] {
            quadrics[v.index()].add(&plane);
        }
    }
    quadrics
}

/// The two triangles at the inner edge of `h`, unfolded to the plane: ids and positions of the origin and target of `h`
/// and of the opposite corners on its left and right.
pub(super) fn unfolded_edge(mesh: &Connectivity, positions: &[DVec3], h: u32) -> ([u32; 4], [DVec2; 4]) {
    let g = mesh.twin(h);
    let ids = [mesh.origin(h), mesh.origin(g), mesh.target(next(h)), mesh.target(next(g))];
    let [a, b, c, d] = ids.map(|v| positions[v as usize]);
    let along = b - a;
    let length = along.length().max(f64::MIN_POSITIVE);
    let flat = |p: DVec3| DVec2::new((p - a).dot(along) / length, (p - a).cross(along).length() / length);
    let below = flat(d);
    (ids, [DVec2::ZERO, DVec2::new(length, 0.0), flat(c), DVec2::new(below.x, -below.y)])
}

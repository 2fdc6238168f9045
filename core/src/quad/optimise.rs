//! Optimisation of the shape of all quads on the surface.
//!
//! Vertices move one at a time by Newton's method in the tangent plane of the surface, with a line search on the energy
//! of the corners around them ([`corner_energy`](super::corner_energy)) at the point projected onto the surface.
//! Vertices of one quad have different colours and only vertices of one colour move at once, so the result does not
//! depend on the number of threads. Areas are signed by the normal of the *surface*, so folded quads unfold.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::boundary::Boundary;
use super::corner_energy::{Corner, Ideal, Moving, newton};
use super::projection::Projection;
use super::quad_mesh::QuadMesh;
use crate::progress::{Cancelled, Progress};

/// Step sizes tried in the line search, each half the one before; then the vertex stays.
const STEP_SIZES: usize = 6;
/// Least regularisation `ε` of the corner energy. With it a corner with a thousandth of its ideal area or more does not
/// count as folded.
const LEAST_EPSILON: f64 = 1e-3;
/// Regularisation `ε` at a vertex with folded corners, as a fraction of their most negative relative area.
const EPSILON: f64 = 0.3;
/// Least and greatest ideal angle at a corner (radians): at nodes of very low or high valence equal angles would be too
/// far from a right angle.
const ANGLES: (f64, f64) = (0.5, 2.4);
/// Weight of a quad's own side lengths in its ideal lengths; the rest is the weight of the mean of its patch.
const OWN_WEIGHT: f64 = 0.6;
/// Least ideal side length, in units of the mesh.
const LEAST_LENGTH: f64 = 1e-12;
/// Greatest step, in mean side lengths of the quads around.
const GREATEST_STEP: f64 = 1.0;
/// Least step, as a fraction of the greatest; a vertex with a smaller one stays.
const LEAST_STEP: f64 = 1e-6;

/// A corner of a quad at a vertex: the quad, and the index of the vertex in it.
type CornerOf = (u32, u8);

/// The connectivity of a quad mesh and its side lengths before the optimisation.
pub(super) struct Structure {
    /// The corners at each vertex.
    corners: Vec<Vec<CornerOf>>,
    /// Vertices of one colour, which may move at once.
    colours: Vec<Vec<u32>>,
    /// Side lengths of the quads before the optimisation.
    initial: Vec<[f64; 2]>,
}

impl Structure {
    /// Vertices with `fixed` true never move; those beyond the end of the list are free.
    pub(super) fn new(mesh: &QuadMesh, fixed: &[bool]) -> Self {
        let n = mesh.positions.len();
        let mut corners = vec![Vec::new(); n];
        for (q, quad) in (0u32..).zip(&mesh.quads) {
            for (k, &v) in (0u8..).zip(quad) {
                corners[v as usize].push((q, k));
            }
        }
        // Greedy colouring in order of ids.
        let mut colour = vec![usize::MAX; n];
        let mut colours: Vec<Vec<u32>> = Vec::new();
        for v in 0..n {
            let taken = |c: usize| {
                corners[v].iter().flat_map(|&(q, _)| mesh.quads[q as usize]).any(|w| colour[w as usize] == c)
            };
            let c = (0..).find(|&c| !taken(c)).unwrap_or(0);
            colour[v] = c;
            if c == colours.len() {
                colours.push(Vec::new());
            }
            if !fixed.get(v).is_some_and(|&f| f) {
                colours[c].push(v as u32);
            }
        }
        let initial = mesh.quads.iter().map(|q| side_lengths(mesh, q)).collect();
        Self { corners, colours, initial }
    }
}

/// The ideal corners of a round.
struct Targets {
    /// Normal of each quad by which areas are signed.
    normals: Vec<DVec3>,
    /// Ideal lengths of the two pairs of opposite sides of each quad.
    lengths: Vec<[f64; 2]>,
    /// Cosine and sine of the ideal angle of the corners at each vertex.
    angles: Vec<DVec2>,
}

/// Rounds of the optimisation. `initial_weight` is the weight of the initial side lengths in the ideal ones.
///
/// # Errors
///
/// When cancelled; `mesh` is then partly optimised.
pub(super) fn optimise(
    mesh: &mut QuadMesh,
    surface: &Projection,
    structure: &Structure,
    boundary: &mut Boundary,
    (rounds, initial_weight): (usize, f64),
    progress: &Progress,
) -> Result<(), Cancelled> {
    for _ in 0..rounds {
        progress.check()?;
        let targets = Targets::new(mesh, surface, structure, boundary, initial_weight);
        for colour in &structure.colours {
            let moves: Vec<Option<Move>> = colour
                .par_iter()
                .map(|&v| VertexProblem { mesh, surface, structure, boundary, targets: &targets, v }.improve())
                .collect();
            for (&v, to) in colour.iter().zip(moves) {
                let Some(to) = to else { continue };
                mesh.positions[v as usize] = to.position;
                mesh.base_face[v as usize] = to.face;
                if let Some(s) = to.arc_length {
                    boundary.move_to(v, s);
                }
            }
        }
    }
    Ok(())
}

impl Targets {
    fn new(
        mesh: &QuadMesh,
        surface: &Projection,
        structure: &Structure,
        boundary: &Boundary,
        initial_weight: f64,
    ) -> Self {
        let at: Vec<DVec3> =
            mesh.positions.par_iter().zip(&mesh.base_face).map(|(&p, &f)| surface.normal(p, f)).collect();
        let normals =
            mesh.quads.iter().map(|q| q.iter().map(|&v| at[v as usize]).sum::<DVec3>().normalize_or(DVec3::Z));
        // Right angles at regular vertices and at boundary vertices with one quad; equal angles elsewhere.
        let angles = (0..mesh.positions.len()).map(|v| {
            let n = structure.corners[v].len() as f64;
            let angle = match (boundary.contains(v as u32), structure.corners[v].len()) {
                (false, 4) | (true, 1) => std::f64::consts::FRAC_PI_2,
                (true, _) => std::f64::consts::PI / n,
                (false, _) => std::f64::consts::TAU / n,
            };
            DVec2::from_angle(angle.clamp(ANGLES.0, ANGLES.1))
        });
        let lengths = ideal_lengths(mesh, &structure.initial, initial_weight);
        Self { normals: normals.collect(), lengths, angles: angles.collect() }
    }
}

/// Ideal side lengths of the quads: weighted means of their present lengths, the mean of their patch, and the lengths
/// `initial` before the optimisation.
fn ideal_lengths(mesh: &QuadMesh, initial: &[[f64; 2]], initial_weight: f64) -> Vec<[f64; 2]> {
    let n_patches = mesh.patch.iter().max().map_or(0, |&p| p as usize + 1);
    let mut sum = vec![[0.0; 3]; n_patches];
    let own: Vec<[f64; 2]> = mesh.quads.iter().map(|q| side_lengths(mesh, q)).collect();
    for (s, &p) in own.iter().zip(&mesh.patch) {
        for (total, x) in sum[p as usize].iter_mut().zip([s[0], s[1], 1.0]) {
            *total += x;
        }
    }
    let mean = |p: u32, i: usize| sum[p as usize][i] / sum[p as usize][2];
    let present = |(s, &p): (&[f64; 2], &u32)| {
        [0, 1].map(|i| (OWN_WEIGHT * s[i] + (1.0 - OWN_WEIGHT) * mean(p, i)).max(LEAST_LENGTH))
    };
    let blend = |(now, initial): ([f64; 2], &[f64; 2])| {
        [0, 1].map(|i| (1.0 - initial_weight) * now[i] + initial_weight * initial[i])
    };
    own.iter().zip(&mesh.patch).map(present).zip(initial).map(blend).collect()
}

/// Mean lengths of the two pairs of opposite sides.
fn side_lengths(mesh: &QuadMesh, q: &[u32; 4]) -> [f64; 2] {
    let d = |i: usize, j: usize| mesh.positions[q[i] as usize].distance(mesh.positions[q[j] as usize]);
    [0.5 * (d(0, 1) + d(3, 2)), 0.5 * (d(1, 2) + d(0, 3))]
}

/// A new position of a vertex.
struct Move {
    position: DVec3,
    face: u32,
    /// Arc length on the boundary; `None` for inner vertices.
    arc_length: Option<f64>,
}

/// The minimisation of the energy by the position of one vertex.
struct VertexProblem<'a> {
    mesh: &'a QuadMesh,
    surface: &'a Projection<'a>,
    structure: &'a Structure,
    boundary: &'a Boundary,
    targets: &'a Targets,
    v: u32,
}

impl VertexProblem<'_> {
    /// The corners that depend on the vertex, with the vertex at `p`.
    fn corners(&self, p: DVec3) -> impl Iterator<Item = (Corner, Moving)> + '_ {
        self.structure.corners[self.v as usize].iter().flat_map(move |&(q, k)| {
            let quad = &self.mesh.quads[q as usize];
            [(0, Moving::Own), (1, Moving::Previous), (3, Moving::Next)].map(|(step, moving)| {
                let at = |i: usize| {
                    let w = quad[i % 4];
                    if i % 4 == k as usize { p } else { self.mesh.positions[w as usize] }
                };
                let i = k as usize + step;
                let [a, b] = self.targets.lengths[q as usize];
                let lengths = if i.is_multiple_of(2) { [a, b] } else { [b, a] };
                let ideal = Ideal { lengths, angle: self.targets.angles[quad[i % 4] as usize] };
                (Corner::new([at(i), at(i + 1), at(i + 3)], self.targets.normals[q as usize], ideal), moving)
            })
        })
    }

    fn energy(&self, p: DVec3, epsilon: f64) -> f64 {
        self.corners(p).map(|(c, _)| c.energy(epsilon)).sum()
    }

    /// A position of lower energy along Newton's direction, if there is one.
    fn improve(&self) -> Option<Move> {
        if self.boundary.is_fixed(self.v) {
            return None;
        }
        let (p, f) = (self.mesh.positions[self.v as usize], self.mesh.base_face[self.v as usize]);
        let least_area = self.corners(p).map(|(c, _)| c.area).fold(0.0, f64::min);
        let epsilon = LEAST_EPSILON.hypot(EPSILON * least_area);
        let n = self.surface.normal(p, f);
        let x = n.any_orthonormal_vector();
        let frame = [x, n.cross(x)];
        let (mut gradient, mut hessian) = Default::default();
        for (c, moving) in self.corners(p) {
            let (g, h) = c.derivatives(epsilon, moving, frame);
            gradient += g;
            hessian += h;
        }
        let mut step = newton(gradient, hessian);
        let greatest = GREATEST_STEP * self.mean_side();
        if !step.is_finite() || step.length() < LEAST_STEP * greatest {
            return None;
        }
        step *= (greatest / step.length()).min(1.0);
        let old = self.energy(p, epsilon);
        for _ in 0..STEP_SIZES {
            let to = self.allowed(p + frame[0] * step.x + frame[1] * step.y, f);
            if self.energy(to.position, epsilon) < old {
                return Some(to);
            }
            step *= 0.5;
        }
        None
    }

    /// The point nearest to `wanted` where the vertex may be: on the boundary for a boundary vertex, else on the
    /// surface.
    fn allowed(&self, wanted: DVec3, face: u32) -> Move {
        match self.boundary.nearest_allowed(self.v, wanted) {
            Some(point) => Move { position: point.position, face: point.face, arc_length: Some(point.s) },
            None => {
                let (position, face) = self.surface.project(wanted, face);
                Move { position, face, arc_length: None }
            }
        }
    }

    /// Mean ideal side length of the quads around.
    fn mean_side(&self) -> f64 {
        let list = &self.structure.corners[self.v as usize];
        let sum: f64 = list.iter().map(|&(q, _)| self.targets.lengths[q as usize].iter().sum::<f64>()).sum();
        0.5 * sum / list.len().max(1) as f64
    }
}

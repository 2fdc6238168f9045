//! Guiding fields: cross fields of prescribed topology, with penalties for deviation from directions.
//!
//! The period jump `p` of each edge is given. The residual rotation `r = θ_g − θ_f − κ − p π/2`, with the transport `κ` of
//! [`Metric::transport`], is not reduced modulo full turns. The jumps then determine the index of every vertex and the
//! turning number of every cycle of triangles, whatever the angles, and the angles minimise `Σ w r²` plus the penalties:
//! one linear system (Ray, Vallet, Li and Lévy, N-Symmetry Direction Field Design; Campen, Quad Layouts, section 6.3).
//!
//! A penalty gives a direction modulo full turns, or modulo quarter turns if any of the four directions of the cross may
//! follow it. The multiple is rounded from a solution without these penalties, then solving and rounding alternate until
//! no multiple changes; the objective falls in every round.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::cross_field::CrossField;
use super::error::{FieldError, expect_length};
use super::singularities::{Singularity, vertex_indices};
use super::smoothing::{EQUILATERAL_EDGE_WEIGHT, edge_weight};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId, components};
use crate::progress::Progress;
use crate::solve::{SparseHermitian, SpdFactor, SpdSymbolic, c64};
use crate::surface::Metric;

/// The weight of a reliable penalty, where an edge between equilateral triangles weighs 1: the direction is met up to some
/// slack near singularities (Campen, section 6.3.2).
pub const RELIABLE_PENALTY: f64 = 100.0;
/// Most rounds of solving and rounding; multiples hardly ever change after the third.
const MAX_ROUNDS: usize = 8;

/// A penalty for deviation of the field from a direction in a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionPenalty {
    /// The triangle.
    pub face: FaceId,
    /// The direction, as an angle in radians from half-edge 0 of the triangle.
    pub angle: f64,
    /// Penalty weight, where an edge between equilateral triangles weighs 1; see [`RELIABLE_PENALTY`].
    pub weight: f64,
    /// Which direction of the cross is to follow it, 0 to 3 counter-clockwise; `None`: the nearest one.
    pub branch: Option<i32>,
}

/// A field of prescribed topology.
#[derive(Debug, Clone)]
pub struct GuidingField {
    /// Angle of direction 0 of each triangle, in radians from its half-edge 0; not reduced.
    pub angle: Vec<f64>,
    /// For each penalty, which direction of the cross follows it, 0 to 3.
    pub branch: Vec<i32>,
    /// The smoothness energy `Σ w r²`, without penalties.
    pub energy: f64,
}

/// The linear system of a mesh: analysed once, solved for any positions, jumps and penalties.
#[derive(Debug, Clone)]
pub struct GuidingFieldSystem {
    symbolic: SpdSymbolic,
    /// The component of each triangle.
    component: Vec<u32>,
    n_components: usize,
}

/// One solve.
struct Solve<'a> {
    system: &'a GuidingFieldSystem,
    penalties: &'a [DirectionPenalty],
    /// The triangles of each inner edge, its weight and its prescribed rotation `κ + p π/2`.
    edges: Vec<(u32, u32, f64, f64)>,
}

impl GuidingFieldSystem {
    /// Analyses the connectivity of `mesh`; positions are not used.
    ///
    /// # Errors
    ///
    /// [`FieldError::Solve`].
    pub fn new(mesh: &TriMesh) -> Result<Self, FieldError> {
        let unit: Vec<_> = inner_edges(mesh).map(|(h, t)| (h.0 / 3, t.0 / 3, 1.0, 0.0)).collect();
        let symbolic = SpdSymbolic::new(&matrix(mesh.n_faces(), &unit, vec![1.0; mesh.n_faces()]))?;
        let (component, n_components) = components(mesh.n_faces(), |f| mesh.adjacent_faces(f).map(|(_, g)| g));
        Ok(Self { symbolic, component, n_components })
    }

    /// Solves for the angles.
    ///
    /// `jump` has one entry per edge, for crossing from the triangle of [`TriMesh::halfedge`] to that of its twin. Penalties
    /// are rounded first from the angles of `previous`; without these, from a field without penalties, turned as a whole
    /// to agree with them best.
    ///
    /// # Errors
    ///
    /// [`FieldError::WrongLength`], [`FieldError::Solve`] (also for a penalty that is not finite) or
    /// [`FieldError::Cancelled`].
    pub fn solve(
        &self,
        mesh: &TriMesh,
        metric: &Metric,
        jump: &[i32],
        penalties: &[DirectionPenalty],
        previous: Option<&[f64]>,
        progress: &Progress,
    ) -> Result<GuidingField, FieldError> {
        let n = self.component.len();
        expect_length("the mesh of the field", mesh.n_faces(), n)?;
        expect_length("the list of period jumps", jump.len(), mesh.n_edges())?;
        let edge = |(h, t): (HalfedgeId, HalfedgeId)| {
            let rotation = metric.transport(h, t) + f64::from(jump[mesh.edge(h).index()]) * FRAC_PI_2;
            (h.0 / 3, t.0 / 3, edge_weight(metric, h, t) / EQUILATERAL_EDGE_WEIGHT, rotation)
        };
        let solve = Solve { system: self, penalties, edges: inner_edges(mesh).map(edge).collect() };
        let mut angle = match previous {
            Some(angle) => {
                expect_length("the list of previous angles", angle.len(), n)?;
                angle.to_vec()
            }
            None => solve.initial_angles(progress)?,
        };
        progress.check()?;
        let all = |_: &DirectionPenalty| true;
        let (matrix, factor) = solve.factor(all)?;
        let mut multiples = solve.round(&angle);
        for _ in 0..MAX_ROUNDS {
            progress.check()?;
            angle = factor.solve(&matrix, &solve.rhs(&multiples, all))?;
            let next = solve.round(&angle);
            if next == multiples {
                break;
            }
            multiples = next;
        }
        let square = |&(f, g, w, rotation): &(u32, u32, f64, f64)| {
            w * (angle[g as usize] - angle[f as usize] - rotation).powi(2)
        };
        let energy = solve.edges.iter().map(square).sum();
        let branch = |(p, &multiple): (&DirectionPenalty, &i64)| {
            // A multiple of quarter turns added to direction 0 makes direction −multiple follow.
            p.branch.map_or((-multiple).rem_euclid(4) as i32, |b| b.rem_euclid(4))
        };
        let branch = penalties.iter().zip(&multiples).map(branch).collect();
        Ok(GuidingField { angle, branch, energy })
    }
}

/// The angle modulo which a penalty gives its direction.
fn period(penalty: &DirectionPenalty) -> f64 {
    if penalty.branch.is_some() { TAU } else { FRAC_PI_2 }
}

/// The angle of direction 0 that satisfies a penalty, modulo its period.
fn base(penalty: &DirectionPenalty) -> f64 {
    penalty.angle - f64::from(penalty.branch.unwrap_or(0)) * FRAC_PI_2
}

impl Solve<'_> {
    /// The angles from which penalties are rounded first: without penalties, then, if there are both kinds, with those of
    /// known direction.
    fn initial_angles(&self, progress: &Progress) -> Result<Vec<f64>, FieldError> {
        let none = |_: &DirectionPenalty| false;
        let (matrix, factor) = self.factor(none)?;
        let multiples = vec![0; self.penalties.len()];
        let mut angle = factor.solve(&matrix, &self.rhs(&multiples, none))?;
        let known = |g: &DirectionPenalty| g.branch.is_some();
        self.turn_towards(&mut angle, known);
        if !self.penalties.iter().any(known) || self.penalties.iter().all(known) {
            return Ok(angle);
        }
        progress.check()?;
        let (matrix, factor) = self.factor(known)?;
        let mut angle = factor.solve(&matrix, &self.rhs(&self.round(&angle), known))?;
        self.turn_towards(&mut angle, known);
        Ok(angle)
    }

    /// Turns each component as a whole to agree best with its penalties: with those that are `known`, or if it has none of
    /// these, with the others.
    fn turn_towards(&self, angle: &mut [f64], known: impl Fn(&DirectionPenalty) -> bool) {
        let mut sums = vec![[c64::new(0.0, 0.0); 2]; self.system.n_components];
        for g in self.penalties {
            let off = base(g) - angle[g.face.index()];
            let kind = usize::from(!known(g));
            let symmetry = TAU / period(g);
            sums[self.system.component[g.face.index()] as usize][kind] += c64::from_polar(g.weight, symmetry * off);
        }
        let turn = |[known, open]: &[c64; 2]| {
            if known.norm() > 0.0 { known.arg() } else { open.arg() / 4.0 }
        };
        let turns: Vec<f64> = sums.iter().map(turn).collect();
        for (a, &c) in angle.iter_mut().zip(&self.system.component) {
            *a += turns[c as usize];
        }
    }

    /// The multiple of its period to add to each penalty's angle to be nearest to `angle`.
    fn round(&self, angle: &[f64]) -> Vec<i64> {
        self.penalties.iter().map(|g| ((angle[g.face.index()] - base(g)) / period(g)).round() as i64).collect()
    }

    /// The first triangle of each component without penalty among those `used`.
    fn unconstrained(&self, used: impl Fn(&DirectionPenalty) -> bool) -> impl Iterator<Item = usize> {
        let mut constrained = vec![false; self.system.n_components];
        for g in self.penalties.iter().filter(|g| used(g) && g.weight > 0.0) {
            constrained[self.system.component[g.face.index()] as usize] = true;
        }
        let component = &self.system.component;
        (0..component.len()).filter(move |&f| !std::mem::replace(&mut constrained[component[f] as usize], true))
    }

    /// The matrix, with the penalties that are `used`, and its factor. In components without any, the first triangle gets a
    /// penalty for deviation from angle 0; it has that angle exactly, since turning a whole component costs nothing else.
    fn factor(
        &self,
        used: impl Fn(&DirectionPenalty) -> bool,
    ) -> Result<(SparseHermitian<f64>, SpdFactor<f64>), FieldError> {
        let mut diagonal = vec![0.0; self.system.component.len()];
        for g in self.penalties.iter().filter(|g| used(g)) {
            diagonal[g.face.index()] += g.weight;
        }
        for f in self.unconstrained(&used) {
            diagonal[f] += 1.0;
        }
        let matrix = matrix(diagonal.len(), &self.edges, diagonal);
        let factor = self.system.symbolic.factor(&matrix)?;
        Ok((matrix, factor))
    }

    /// The right-hand side, with the penalties that are `used`.
    fn rhs(&self, multiples: &[i64], used: impl Fn(&DirectionPenalty) -> bool) -> Vec<f64> {
        let mut rhs = vec![0.0; self.system.component.len()];
        for &(f, g, w, rotation) in &self.edges {
            rhs[g as usize] += w * rotation;
            rhs[f as usize] -= w * rotation;
        }
        for (g, &l) in self.penalties.iter().zip(multiples).filter(|(g, _)| used(g)) {
            rhs[g.face.index()] += g.weight * (base(g) + l as f64 * period(g));
        }
        rhs
    }
}

/// The half-edge of each inner edge and its twin.
fn inner_edges(mesh: &TriMesh) -> impl Iterator<Item = (HalfedgeId, HalfedgeId)> {
    mesh.edges().map(|e| mesh.halfedge(e)).filter_map(|h| Some((h, mesh.twin(h)?)))
}

/// The matrix of the edges (triangles, weight, rotation) with what is added to its diagonal.
fn matrix(n: usize, edges: &[(u32, u32, f64, f64)], mut diagonal: Vec<f64>) -> SparseHermitian<f64> {
    for &(f, g, w, _) in edges {
        diagonal[f as usize] += w;
        diagonal[g as usize] += w;
    }
    let mut triplets: Vec<_> = (0u32..).zip(diagonal).map(|(f, d)| (f, f, d)).collect();
    triplets.extend(edges.iter().map(|&(f, g, w, _)| (f, g, -w)));
    SparseHermitian::from_triplets(n, &triplets)
}

/// The prescribed rotation `κ + p π/2` across `h`; zero on the boundary.
fn prescribed_rotation(mesh: &TriMesh, metric: &Metric, jump: &[i32], h: HalfedgeId) -> f64 {
    let e = mesh.edge(h);
    let first = mesh.halfedge(e);
    let Some(t) = mesh.twin(first) else { return 0.0 };
    let value = metric.transport(first, t) + f64::from(jump[e.index()]) * FRAC_PI_2;
    if first == h { value } else { -value }
}

/// The index of each vertex in quarters, for jumps that are not reduced. A node there has valence `4 − index`; on the boundary
/// `3 − index`, if the field is aligned with it. At an inner vertex the index depends on the jumps only, at a boundary vertex
/// on the angles too. Increasing the jump of an edge by one decreases the index of the target of its
/// [`TriMesh::halfedge`] by one and increases that of the origin.
pub fn indices(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i32]) -> Vec<i32> {
    vertex_indices(mesh, metric, |h| {
        let residual =
            |t: HalfedgeId| angle[t.index() / 3] - angle[h.index() / 3] - prescribed_rotation(mesh, metric, jump, h);
        mesh.twin(h).map_or(0.0, residual)
    })
}

/// The turning number, in quarters, of a closed cycle of triangles in a field of these jumps: the number of quarter turns that
/// the direction of travel turns counter-clockwise against the crosses. Clockwise around a vertex of valence `k` it is `−k`
/// (Campen, section 6.3.1).
///
/// `crossed` are the half-edges crossed, each of the triangle that is left. `None` if they form no closed cycle, or go back
/// across an edge just crossed.
pub fn turning_number(mesh: &TriMesh, metric: &Metric, jump: &[i32], crossed: &[HalfedgeId]) -> Option<i32> {
    let mut turn = 0.0;
    for (i, &h) in crossed.iter().enumerate() {
        let entry = mesh.twin(crossed[(i + crossed.len() - 1) % crossed.len()])?;
        // From the midpoint of the side entered to that of the side left, around their common vertex.
        turn += if h == mesh.next(entry) {
            -metric.corner_angle(h)
        } else if h == mesh.prev(entry) {
            metric.corner_angle(entry)
        } else {
            return None;
        };
        turn += prescribed_rotation(mesh, metric, jump, h);
    }
    Some((turn / FRAC_PI_2).round() as i32)
}

/// The cross field of these angles and jumps, with its singularities at inner vertices.
pub fn cross_field(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i32]) -> CrossField {
    let inner = |(v, index): (VertexId, i32)| {
        (index != 0 && !mesh.is_boundary_vertex(v)).then_some(Singularity { vertex: v, index: index as i8 })
    };
    CrossField {
        angle: angle.to_vec(),
        jump: jump.iter().map(|p| ((p + 1).rem_euclid(4) - 1) as i8).collect(),
        singularities: mesh.vertices().zip(indices(mesh, metric, angle, jump)).filter_map(inner).collect(),
    }
}

#[cfg(test)]
mod tests;

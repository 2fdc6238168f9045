//! Cross fields of prescribed topology, guided by directions.
//!
//! The period jump of each edge is a given whole number. What the field turns across the edge beyond its jump,
//! `r = θ_g − θ_f − κ − p π/2` with the transport `κ` of [`Metric::transport`], is not reduced modulo anything: the
//! jumps then fix the index of every vertex and the turning number along every cycle of triangles, whatever the
//! angles, and the angles are the solution of one linear system, that of `Σ w r² + Σ guides` (Ray, Vallet, Li and
//! Lévy, N-Symmetry Direction Field Design; Campen, Quad Layouts, section 6.3).
//!
//! A guide tells a direction up to whole turns, or up to quarter turns if it leaves open which of the four
//! directions follows it. Which one is meant is rounded from a solution without the guide, then solved and rounded
//! again until nothing changes; every round lowers the sum.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::cross_field::CrossField;
use super::error::{FieldError, expect_length};
use super::singularities::Singularity;
use super::smoothing::edge_weight;
use crate::mesh::{FaceId, HalfedgeId, TriMesh};
use crate::progress::Progress;
use crate::solve::{SparseHermitian, SpdFactor, SpdSymbolic, c64};
use crate::surface::Metric;

/// [`edge_weight`] of two equilateral triangles: divided by it an edge weighs 1 there, so that the strength of a
/// guide means the same on every mesh.
const EQUILATERAL: f64 = 1.732_050_807_568_877_2;
/// The strength of a guide that holds but for a little slack, as near singularities (thesis, section 6.3.2).
pub const RELIABLE_PENALTY: f64 = 100.0;
/// How often guides are rounded and the field solved for again; the guides hardly ever change after the third.
const ROUNDS: usize = 8;

/// A direction that the field is to take in a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionPenalty {
    /// The triangle.
    pub face: FaceId,
    /// The direction, as an angle from its half-edge 0.
    pub angle: f64,
    /// How strongly, where an edge between equilateral triangles weighs 1; see [`RELIABLE_PENALTY`].
    pub weight: f64,
    /// Which direction of the cross it is for, 0 to 3 counter-clockwise; `None` for whichever is nearest.
    pub branch: Option<i32>,
}

/// A solved field.
#[derive(Debug, Clone)]
pub struct GuidingField {
    /// Angle of direction 0 of each triangle, from its half-edge 0; not reduced.
    pub angle: Vec<f64>,
    /// For each guide, which direction of the cross follows it, 0 to 3.
    pub branch: Vec<i32>,
    /// What is left of the weighted squares of rotations across edges, without the guides.
    pub energy: f64,
}

/// The system of a mesh: analysed once, solved for any geometry, jumps and guides.
#[derive(Debug, Clone)]
pub struct GuidingFieldSystem {
    symbolic: SpdSymbolic,
    /// The component of each triangle.
    component: Vec<u32>,
    n_components: usize,
}

/// One solve: the edges with their weights and the rotations wanted across them, and where the guides want to go.
struct Work<'a> {
    system: &'a GuidingFieldSystem,
    guides: &'a [DirectionPenalty],
    /// The triangles of each inner edge, its weight and `κ + p π/2`.
    edges: Vec<(u32, u32, f64, f64)>,
}

impl GuidingFieldSystem {
    /// Analyses the triangles of `mesh`, of which only the connectivity is read.
    ///
    /// # Errors
    ///
    /// [`FieldError::Solve`].
    pub fn new(mesh: &TriMesh) -> Result<Self, FieldError> {
        let unit: Vec<_> = inner_edges(mesh).map(|(h, t)| (h.0 / 3, t.0 / 3, 1.0, 0.0)).collect();
        let symbolic = SpdSymbolic::new(&matrix(mesh.n_faces(), &unit, vec![1.0; mesh.n_faces()]))?;
        let mut component = vec![u32::MAX; mesh.n_faces()];
        let mut n_components = 0;
        for root in mesh.faces() {
            if component[root.index()] != u32::MAX {
                continue;
            }
            component[root.index()] = n_components;
            let mut stack = vec![root];
            while let Some(f) = stack.pop() {
                for g in mesh.face_halfedges(f).into_iter().filter_map(|h| mesh.twin(h)).map(|t| mesh.face(t)) {
                    if component[g.index()] == u32::MAX {
                        component[g.index()] = n_components;
                        stack.push(g);
                    }
                }
            }
            n_components += 1;
        }
        Ok(Self { symbolic, component, n_components: n_components as usize })
    }

    /// Solves for the angles.
    ///
    /// `jump` has one entry per edge, for crossing from the triangle of [`TriMesh::halfedge`] to that of its twin.
    /// With the angles of `previous`, guides first follow the direction nearest to them there; without, a field
    /// without guides is solved for and turned as a whole towards them.
    ///
    /// # Errors
    ///
    /// [`FieldError::WrongLength`], [`FieldError::Solve`] (also for a guide that is not finite) or
    /// [`FieldError::Cancelled`].
    pub fn solve(
        &self,
        mesh: &TriMesh,
        metric: &Metric,
        jump: &[i32],
        guides: &[DirectionPenalty],
        previous: Option<&[f64]>,
        progress: &Progress,
    ) -> Result<GuidingField, FieldError> {
        let n = self.component.len();
        expect_length("the mesh of the field", mesh.n_faces(), n)?;
        expect_length("the list of period jumps", jump.len(), mesh.n_edges())?;
        let weighed = |(h, t): (HalfedgeId, HalfedgeId)| {
            let want = metric.transport(h, t) + f64::from(jump[mesh.edge(h).index()]) * FRAC_PI_2;
            (h.0 / 3, t.0 / 3, edge_weight(metric, h, t) / EQUILATERAL, want)
        };
        let work = Work { system: self, guides, edges: inner_edges(mesh).map(weighed).collect() };
        let mut angle = match previous {
            Some(angle) => {
                expect_length("the list of previous angles", angle.len(), n)?;
                angle.to_vec()
            }
            None => work.first(progress)?,
        };
        progress.check()?;
        let all = |_: &DirectionPenalty| true;
        let (matrix, factor) = work.factor(all)?;
        let mut lift = work.round(&angle);
        for _ in 0..ROUNDS {
            progress.check()?;
            angle = factor.solve(&matrix, &work.rhs(&lift, all))?;
            let next = work.round(&angle);
            if next == lift {
                break;
            }
            lift = next;
        }
        let square =
            |&(f, g, w, want): &(u32, u32, f64, f64)| w * (angle[g as usize] - angle[f as usize] - want).powi(2);
        let energy = work.edges.iter().map(square).sum();
        let branch =
            guides.iter().zip(&lift).map(|(g, &l)| (g.branch.unwrap_or(0) - follow(g, l)).rem_euclid(4)).collect();
        Ok(GuidingField { angle, branch, energy })
    }
}

/// The quarter turns that a lift adds to the angle of direction 0 of a guide of open branch; none for a known one.
fn follow(guide: &DirectionPenalty, lift: i64) -> i32 {
    if guide.branch.is_some() { 0 } else { lift.rem_euclid(4) as i32 }
}

/// The turn that a guide leaves open.
fn period(guide: &DirectionPenalty) -> f64 {
    if guide.branch.is_some() { TAU } else { FRAC_PI_2 }
}

/// The angle of direction 0 that a guide asks for, up to its period.
fn base(guide: &DirectionPenalty) -> f64 {
    guide.angle - f64::from(guide.branch.unwrap_or(0)) * FRAC_PI_2
}

impl Work<'_> {
    /// Angles to round the first guides from.
    fn first(&self, progress: &Progress) -> Result<Vec<f64>, FieldError> {
        let none = |_: &DirectionPenalty| false;
        let (matrix, factor) = self.factor(none)?;
        let lift = vec![0; self.guides.len()];
        let mut angle = factor.solve(&matrix, &self.rhs(&lift, none))?;
        let known = |g: &DirectionPenalty| g.branch.is_some();
        self.turn_towards(&mut angle, known);
        if !self.guides.iter().any(known) || self.guides.iter().all(known) {
            return Ok(angle);
        }
        progress.check()?;
        let (matrix, factor) = self.factor(known)?;
        let mut angle = factor.solve(&matrix, &self.rhs(&self.round(&angle), known))?;
        self.turn_towards(&mut angle, known);
        Ok(angle)
    }

    /// Turns each component as a whole so that it agrees with its guides best: with those that are `known`, or
    /// if it has none, with all.
    fn turn_towards(&self, angle: &mut [f64], known: impl Fn(&DirectionPenalty) -> bool) {
        let mut sums = vec![[c64::new(0.0, 0.0); 2]; self.system.n_components];
        for g in self.guides {
            let off = base(g) - angle[g.face.index()];
            let kind = usize::from(!known(g));
            let fold = TAU / period(g);
            sums[self.system.component[g.face.index()] as usize][kind] += c64::from_polar(g.weight, fold * off);
        }
        let turn = |[known, open]: &[c64; 2]| {
            if known.norm() > 0.0 { known.arg() } else { open.arg() / 4.0 }
        };
        let turns: Vec<f64> = sums.iter().map(turn).collect();
        for (a, &c) in angle.iter_mut().zip(&self.system.component) {
            *a += turns[c as usize];
        }
    }

    /// How many periods to add to each guide to be nearest to `angle`.
    fn round(&self, angle: &[f64]) -> Vec<i64> {
        self.guides.iter().map(|g| ((angle[g.face.index()] - base(g)) / period(g)).round() as i64).collect()
    }

    /// The first triangles of components that no guide among those `used` holds.
    fn loose(&self, used: impl Fn(&DirectionPenalty) -> bool) -> impl Iterator<Item = usize> {
        let mut held = vec![false; self.system.n_components];
        for g in self.guides.iter().filter(|g| used(g) && g.weight > 0.0) {
            held[self.system.component[g.face.index()] as usize] = true;
        }
        let component = &self.system.component;
        (0..component.len()).filter(move |&f| !std::mem::replace(&mut held[component[f] as usize], true))
    }

    /// The system with the guides that are `used`. Where none is, one triangle is pulled to the angle 0: as turning
    /// the whole changes nothing else, it gets there exactly.
    fn factor(
        &self,
        used: impl Fn(&DirectionPenalty) -> bool,
    ) -> Result<(SparseHermitian<f64>, SpdFactor<f64>), FieldError> {
        let mut diagonal = vec![0.0; self.system.component.len()];
        for g in self.guides.iter().filter(|g| used(g)) {
            diagonal[g.face.index()] += g.weight;
        }
        for f in self.loose(&used) {
            diagonal[f] += 1.0;
        }
        let matrix = matrix(diagonal.len(), &self.edges, diagonal);
        let factor = self.system.symbolic.factor(&matrix)?;
        Ok((matrix, factor))
    }

    fn rhs(&self, lift: &[i64], used: impl Fn(&DirectionPenalty) -> bool) -> Vec<f64> {
        let mut rhs = vec![0.0; self.system.component.len()];
        for &(f, g, w, want) in &self.edges {
            rhs[g as usize] += w * want;
            rhs[f as usize] -= w * want;
        }
        for (g, &l) in self.guides.iter().zip(lift).filter(|(g, _)| used(g)) {
            rhs[g.face.index()] += g.weight * (base(g) + l as f64 * period(g));
        }
        rhs
    }
}

/// The half-edge of each inner edge and its twin.
fn inner_edges(mesh: &TriMesh) -> impl Iterator<Item = (HalfedgeId, HalfedgeId)> {
    mesh.edges().map(|e| mesh.halfedge(e)).filter_map(|h| Some((h, mesh.twin(h)?)))
}

fn matrix(n: usize, edges: &[(u32, u32, f64, f64)], mut diagonal: Vec<f64>) -> SparseHermitian<f64> {
    for &(f, g, w, _) in edges {
        diagonal[f as usize] += w;
        diagonal[g as usize] += w;
    }
    let mut triplets: Vec<_> = (0u32..).zip(diagonal).map(|(f, d)| (f, f, d)).collect();
    triplets.extend(edges.iter().map(|&(f, g, w, _)| (f, g, -w)));
    SparseHermitian::from_triplets(n, &triplets)
}

/// How much a field of these jumps turns against a fixed direction across `h`, not counting its angles; what
/// [`GuidingField`] calls `κ + p π/2`. Zero on the boundary.
fn wanted(mesh: &TriMesh, metric: &Metric, jump: &[i32], h: HalfedgeId) -> f64 {
    let e = mesh.edge(h);
    let first = mesh.halfedge(e);
    let Some(t) = mesh.twin(first) else { return 0.0 };
    let value = metric.transport(first, t) + f64::from(jump[e.index()]) * FRAC_PI_2;
    if first == h { value } else { -value }
}

/// The index of each vertex in quarters, exactly as the jumps have it: a node there has valence `4 − index`, at the
/// boundary `3 − index` if the field is aligned with it. Around an inner vertex the angles cancel; at the boundary
/// they count. Raising the jump of an edge by one lowers the index at the target of its [`TriMesh::halfedge`] by one
/// and raises that at the origin.
pub fn indices(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i32]) -> Vec<i32> {
    let mut turn: Vec<f64> = mesh.vertices().map(|v| if mesh.is_boundary_vertex(v) { PI } else { TAU }).collect();
    for h in mesh.halfedges() {
        turn[mesh.origin(h).index()] -= metric.corner_angle(h);
        // Crossing the incoming spoke `h` leads counter-clockwise around its target.
        if let Some(t) = mesh.twin(h) {
            let rest = angle[t.index() / 3] - angle[h.index() / 3] - wanted(mesh, metric, jump, h);
            turn[mesh.target(h).index()] += rest;
        }
    }
    turn.into_iter().map(|a| (a / FRAC_PI_2).round() as i32).collect()
}

/// The turning number, in quarters, of a closed cycle of triangles against a field of these jumps: by how many
/// quarter turns the direction of travel turns counter-clockwise against the crosses, continued across edges by the
/// jumps. Clockwise around a vertex of valence `k` it is `−k` (thesis, section 6.3.1).
///
/// `crossed` are the half-edges crossed, each of the triangle that is left. `None` if they are not a closed cycle,
/// or return across the edge they came by.
pub fn turning_number(mesh: &TriMesh, metric: &Metric, jump: &[i32], crossed: &[HalfedgeId]) -> Option<i32> {
    let mut turn = 0.0;
    for (i, &h) in crossed.iter().enumerate() {
        let entry = mesh.twin(crossed[(i + crossed.len() - 1) % crossed.len()])?;
        // From the middle of the side entered by, around one of its ends, across the side left by.
        turn += if h == mesh.next(entry) {
            -metric.corner_angle(h)
        } else if h == mesh.prev(entry) {
            metric.corner_angle(entry)
        } else {
            return None;
        };
        turn += wanted(mesh, metric, jump, h);
    }
    Some((turn / FRAC_PI_2).round() as i32)
}

/// The cross field of solved angles, with its singularities at inner vertices as the jumps have them.
pub fn cross_field(mesh: &TriMesh, metric: &Metric, angle: &[f64], jump: &[i32]) -> CrossField {
    let inner = |(v, index): (crate::mesh::VertexId, i32)| {
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

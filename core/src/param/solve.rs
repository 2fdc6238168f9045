//! Solving for seamless maps.
//!
//! Three parts that change at different times: the topology (cut, wedges and relations, eliminated exactly to the
//! affine expression of every corner in free variables) changes with the period jumps and the relations; the
//! analysis of the matrix changes only if its pattern does; the values change with the geometry, the angles of the
//! field and the objective. Where each triangle's share goes in the matrix is worked out with the topology, so that
//! the assembly for new values is one pass over the triangles (Campen, Quad Layouts, section 6.4).

use glam::DVec2;

use super::constraints;
use super::cut::Cut;
use super::objective::{Objective, PAIRS, residuals};
use super::seamless::{Relation, SeamlessMap};
use super::{ParamError, expect_length};
use crate::field::{CrossField, Metric};
use crate::mesh::{EdgeId, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::solve::{
    Constraint, EliminationError, Reduction, SparseHermitian, SpdFactor, SpdSymbolic, eliminate_in_turn,
};

/// The system of seamless maps of one topology.
#[derive(Debug, Clone)]
pub struct SeamlessSystem {
    cut: Cut,
    /// Period jump of each edge, 0 to 3.
    jump: Vec<u8>,
    /// Seams first, then one for each relation.
    constraints: Vec<Constraint>,
    n_seams: usize,
    reduction: Reduction,
    scatter: Scatter,
    symbolic: Option<SpdSymbolic>,
}

/// A coordinate of a corner as an affine expression of the free variables: `sign · (Σ terms + constant)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate<'a> {
    /// 1 or -1.
    pub sign: f64,
    /// Free variables and their coefficients.
    pub terms: &'a [(u32, f64)],
    /// The constant.
    pub constant: f64,
}

impl Coordinate<'_> {
    /// The coordinate where the free variables are `y`.
    pub fn value(&self, y: &[f64]) -> f64 {
        self.sign * self.terms.iter().fold(self.constant, |sum, &(x, c)| sum + c * y[x as usize])
    }
}

/// A solved map, and the linear system it solves.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The map, in the frames of the field.
    pub map: SeamlessMap,
    /// The free variables.
    pub free: Vec<f64>,
    /// The energy of each triangle, without stiffness.
    pub face_energy: Vec<f64>,
    /// Their sum.
    pub energy: f64,
    /// The matrix `H` of the free variables `y`: with stiffness the objective is `y' H y − 2 b y` and a constant.
    pub matrix: SparseHermitian<f64>,
    /// The right-hand side `b`.
    pub rhs: Vec<f64>,
    /// The factor of the matrix.
    pub factor: SpdFactor<f64>,
}

impl SeamlessSystem {
    /// Sets up the maps of `mesh` along a field of the period jumps of `field`, whose singularities are among
    /// `nodes`, that satisfy all `relations`. Redundant relations do no harm.
    ///
    /// # Errors
    ///
    /// [`ParamError::Topology`], [`ParamError::Malformed`] or [`ParamError::Conflict`].
    pub fn new(
        mesh: &TriMesh,
        field: &CrossField,
        nodes: &[VertexId],
        relations: &[Relation],
    ) -> Result<Self, ParamError> {
        expect_length("the list of period jumps", field.jump.len(), mesh.n_edges())?;
        let cut = Cut::new(mesh, field, nodes)?;
        let mut constraints = constraints::seams(mesh, &cut);
        let n_seams = constraints.len();
        extend(mesh, &cut, relations, &mut constraints)?;
        let reduction = reduce(&cut, &constraints, n_seams)?;
        let scatter = Scatter::new(&cut, &reduction);
        let jump = field.jump.iter().map(|p| p.rem_euclid(4) as u8).collect();
        Ok(Self { cut, jump, constraints, n_seams, reduction, scatter, symbolic: None })
    }

    /// Sets up anew as [`Self::new`] does, but keeps the analysis of the matrix if its pattern is the same.
    ///
    /// # Errors
    ///
    /// Those of [`Self::new`]; the system then stays as it was.
    pub fn rebuild(
        &mut self,
        mesh: &TriMesh,
        field: &CrossField,
        nodes: &[VertexId],
        relations: &[Relation],
    ) -> Result<(), ParamError> {
        let new = Self::new(mesh, field, nodes, relations)?;
        let symbolic = self.symbolic.take().filter(|_| new.scatter.zero.same_pattern(&self.scatter.zero));
        *self = Self { symbolic, ..new };
        Ok(())
    }

    /// Changes the relations only.
    ///
    /// # Errors
    ///
    /// [`ParamError::Malformed`] or [`ParamError::Conflict`]; the system then stays as it was.
    pub fn set_relations(&mut self, mesh: &TriMesh, relations: &[Relation]) -> Result<(), ParamError> {
        let mut constraints = self.constraints[..self.n_seams].to_vec();
        extend(mesh, &self.cut, relations, &mut constraints)?;
        let reduction = reduce(&self.cut, &constraints, self.n_seams)?;
        let scatter = Scatter::new(&self.cut, &reduction);
        if !scatter.zero.same_pattern(&self.scatter.zero) {
            self.symbolic = None;
        }
        (self.constraints, self.reduction, self.scatter) = (constraints, reduction, scatter);
        Ok(())
    }

    /// Changes the differences of all relations, and nothing else: the analysis of the matrix stays.
    ///
    /// # Errors
    ///
    /// [`ParamError::WrongLength`], [`ParamError::Malformed`] or [`ParamError::Conflict`]; the system then stays as
    /// it was.
    pub fn set_differences(&mut self, differences: &[f64]) -> Result<(), ParamError> {
        expect_length("the list of differences", differences.len(), self.constraints.len() - self.n_seams)?;
        let mut constraints = self.constraints.clone();
        for (c, &difference) in constraints[self.n_seams..].iter_mut().zip(differences) {
            c.rhs = difference;
        }
        // The order of elimination does not depend on constants, hence neither does what the matrix is made of.
        self.reduction = reduce(&self.cut, &constraints, self.n_seams)?;
        self.constraints = constraints;
        Ok(())
    }

    /// The cut surface.
    pub fn cut(&self) -> &Cut {
        &self.cut
    }

    /// Number of free variables.
    pub fn n_free(&self) -> usize {
        self.reduction.n_free()
    }

    /// Coordinate `axis` (0: u, 1: v) of the origin of `h` in the frame of the field in its triangle.
    pub fn coordinate(&self, h: HalfedgeId, axis: u32) -> Coordinate<'_> {
        let (variable, sign) = constraints::corner(&self.cut, h, axis);
        let (terms, constant) = self.reduction.expression(variable as usize);
        Coordinate { sign, terms, constant }
    }

    /// The matrix and the right-hand side of an objective. Slivers and target lengths are taken as they are.
    ///
    /// # Errors
    ///
    /// [`ParamError::WrongLength`] or [`ParamError::OtherJump`].
    pub fn assemble(
        &self,
        metric: &Metric,
        field: &CrossField,
        objective: &Objective,
    ) -> Result<(SparseHermitian<f64>, Vec<f64>), ParamError> {
        let n_faces = self.cut.turn.len();
        expect_length("the list of angles", field.angle.len(), n_faces)?;
        objective.check(n_faces)?;
        expect_length("the list of period jumps", field.jump.len(), self.jump.len())?;
        if let Some(e) = (0..self.jump.len()).find(|&e| self.jump[e] != field.jump[e].rem_euclid(4) as u8) {
            return Err(ParamError::OtherJump { edge: EdgeId::new(e) });
        }
        let mut matrix = self.scatter.zero.clone();
        let mut rhs = vec![0.0; self.n_free()];
        let mut shares = self.scatter.shares.iter();
        for (f, &count) in self.scatter.count.iter().enumerate() {
            let local = objective.local(metric, field.angle[f], FaceId::new(f));
            let values = matrix.values_mut();
            for share in shares.by_ref().take(count as usize) {
                let k = usize::from(share.pair);
                values[share.slot as usize] += share.factor * local.stiffness[k / 6][k % 6];
            }
            for (axis, (stiffness, load)) in local.stiffness.iter().zip(&local.load).enumerate() {
                let corners = [0, 1, 2].map(|i| self.coordinate(HalfedgeId::new(3 * f + i), axis as u32));
                // What constants contribute is known and goes to the right.
                let mut load = *load;
                for (&(i, j), k) in PAIRS.iter().zip(stiffness) {
                    load[i] -= k * corners[j].sign * corners[j].constant;
                    if i != j {
                        load[j] -= k * corners[i].sign * corners[i].constant;
                    }
                }
                for (corner, load) in corners.iter().zip(load) {
                    for &(x, c) in corner.terms {
                        rhs[x as usize] += corner.sign * c * load;
                    }
                }
            }
        }
        Ok((matrix, rhs))
    }

    /// Factors a matrix of this system; the first time its pattern is analysed.
    ///
    /// # Errors
    ///
    /// [`ParamError::Solve`].
    pub fn factor(&mut self, matrix: &SparseHermitian<f64>) -> Result<SpdFactor<f64>, ParamError> {
        let symbolic = match self.symbolic.take() {
            Some(symbolic) => symbolic,
            None => SpdSymbolic::new(matrix)?,
        };
        Ok(self.symbolic.insert(symbolic).factor(matrix)?)
    }

    /// The map of least objective along `field`.
    ///
    /// # Errors
    ///
    /// See [`ParamError`].
    pub fn solve(
        &mut self,
        metric: &Metric,
        field: &CrossField,
        objective: &Objective,
        progress: &Progress,
    ) -> Result<Solution, ParamError> {
        let (matrix, rhs) = self.assemble(metric, field, objective)?;
        progress.check()?;
        let factor = self.factor(&matrix)?;
        progress.check()?;
        let free = factor.solve(&matrix, &rhs)?;
        let map = self.map(&free);
        let each = residuals(metric, &field.angle, &map.uv, objective);
        let face_energy: Vec<f64> = each.iter().map(|r| r.energy).collect();
        let energy = face_energy.iter().sum();
        Ok(Solution { map, free, face_energy, energy, matrix, rhs, factor })
    }

    /// The map where the free variables are `y`.
    pub fn map(&self, y: &[f64]) -> SeamlessMap {
        let x = self.reduction.expand(y);
        let at = |h: usize| {
            let [u, v] = [0, 1].map(|axis| {
                let (variable, sign) = constraints::corner(&self.cut, HalfedgeId::new(h), axis);
                sign * x[variable as usize]
            });
            DVec2::new(u, v)
        };
        let uv = (0..self.cut.turn.len()).map(|f| [at(3 * f), at(3 * f + 1), at(3 * f + 2)]).collect();
        SeamlessMap { uv, jump: self.jump.clone() }
    }
}

fn extend(mesh: &TriMesh, cut: &Cut, relations: &[Relation], out: &mut Vec<Constraint>) -> Result<(), ParamError> {
    for (i, r) in relations.iter().enumerate() {
        out.push(constraints::relation(mesh, cut, r).ok_or(ParamError::Malformed { relation: i })?);
    }
    Ok(())
}

/// Eliminates the seams, which never contradict each other, and then the relations.
fn reduce(cut: &Cut, constraints: &[Constraint], n_seams: usize) -> Result<Reduction, ParamError> {
    eliminate_in_turn(&constraints::keep(cut), constraints, n_seams).map_err(|error| match error {
        EliminationError::Conflict { constraint, rest } if constraint >= n_seams => {
            ParamError::Conflict { relation: constraint - n_seams, rest }
        }
        EliminationError::Malformed { constraint } if constraint >= n_seams => {
            ParamError::Malformed { relation: constraint - n_seams }
        }
        other => ParamError::Elimination(other),
    })
}

/// Where each triangle's share of the matrix goes.
#[derive(Debug, Clone)]
struct Scatter {
    /// The matrix without values.
    zero: SparseHermitian<f64>,
    /// The shares of all triangles one after the other.
    shares: Vec<Share>,
    /// How many of them each triangle has.
    count: Vec<u32>,
}

/// One local entry times a factor, to be added to one entry of the matrix.
#[derive(Debug, Clone, Copy)]
struct Share {
    slot: u32,
    /// Pair of corners as in [`PAIRS`], those of v after those of u.
    pair: u8,
    factor: f64,
}

impl Scatter {
    fn new(cut: &Cut, reduction: &Reduction) -> Self {
        let n_faces = cut.turn.len();
        let mut at: Vec<(u32, u32)> = Vec::with_capacity(13 * n_faces);
        let mut shares: Vec<Share> = Vec::with_capacity(13 * n_faces);
        let mut count = Vec::with_capacity(n_faces);
        for f in 0..n_faces {
            let before = shares.len();
            for axis in 0..2 {
                let corners = [0, 1, 2].map(|i| {
                    let (variable, sign) = constraints::corner(cut, HalfedgeId::new(3 * f + i), axis);
                    (reduction.expression(variable as usize).0, sign)
                });
                for (pair, &(i, j)) in (6 * axis as u8..).zip(&PAIRS) {
                    let ((row, s), (column, t)) = (corners[i], corners[j]);
                    for (a, &(x, c)) in row.iter().enumerate() {
                        // A pair of one corner with itself meets each pair of terms twice, of which one is stored;
                        // of two corners, one variable meets itself twice.
                        let from = if i == j { a } else { 0 };
                        for &(y, d) in &column[from..] {
                            let twice = if i != j && x == y { 2.0 } else { 1.0 };
                            at.push((x, y));
                            shares.push(Share { slot: 0, pair, factor: twice * s * t * c * d });
                        }
                    }
                }
            }
            count.push((shares.len() - before) as u32);
        }
        let (zero, slot) = SparseHermitian::zero(reduction.n_free(), at.len(), || at.iter().copied());
        for (share, slot) in shares.iter_mut().zip(slot) {
            share.slot = slot;
        }
        Self { zero, shares, count }
    }
}

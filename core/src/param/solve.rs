//! Solving for seamless maps.
//!
//! Parts that change at different times: the cut with its seams changes with the period jumps; what is left is tied
//! by the relations; after both have been eliminated exactly every corner is an affine expression of free variables.
//! The analysis of the matrix changes only if its pattern does. The values change with the geometry, the angles of
//! the field and the objective; where they go in the matrix has been worked out with the rest, so that the assembly
//! is one pass over the triangles and one over the entries (Campen, Quad Layouts, section 6.4).

use std::sync::Arc;

use glam::DVec2;

use super::assembly::Scatter;
use super::constraints;
use super::cut::Cut;
use super::injective::NewtonSystem;
use super::objective::{Local, Objective, residuals};
use super::seamless::{CoordinateConstraint, SeamlessMap};
use super::unfold::{Effort, OrientationProblem, OrientedTriangle, Unfolded, unfold};
use super::{ParamError, expect_length};
use crate::field::CrossField;
use crate::mesh::{EdgeId, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::solve::{
    Constraint, EliminationError, Reduction, SolveError, SparseHermitian, SpdFactor, SpdSymbolic, eliminate,
};
use crate::surface::Metric;

/// The system of seamless maps of one topology.
#[derive(Debug, Clone)]
pub struct SeamlessSystem {
    cut: Cut,
    /// Period jump of each edge, 0 to 3.
    jump: Vec<u8>,
    /// What the seams leave of all variables.
    seams: Reduction,
    /// How the shares of triangles make the matrix of what the seams leave.
    shares: Scatter,
    /// One constraint of all variables for each relation.
    relations: Vec<Constraint>,
    tied: Tied,
    symbolic: Option<SpdSymbolic>,
    /// The nodes that the cuts lead to.
    nodes: Vec<VertexId>,
    /// What Newton's method needs, once it has been used: what is left of it by the seams alone, and all of it.
    newton_shares: Option<Arc<Scatter>>,
    newton: Option<Arc<NewtonSystem>>,
}

/// What follows from the relations.
#[derive(Debug, Clone)]
struct Tied {
    /// What they leave of what the seams leave.
    ties: Reduction,
    /// What both leave of all variables.
    reduction: Reduction,
    /// How the matrix of what the seams leave makes that of the free variables.
    fold: Scatter,
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

/// A solved map.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The map, in the frames of the field.
    pub map: SeamlessMap,
    /// The free variables.
    pub free: Vec<f64>,
    /// Its energy: of least squares without stiffness, or of maps without folds.
    pub energy: f64,
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
        relations: &[CoordinateConstraint],
    ) -> Result<Self, ParamError> {
        expect_length("the list of period jumps", field.jump.len(), mesh.n_edges())?;
        let cut = Cut::new(mesh, field, nodes)?;
        let seams = eliminate(&constraints::keep(&cut), &constraints::seams(mesh, &cut))?;
        let shares = Scatter::of_triangles(&cut, &seams);
        let relations = constraints::relations(mesh, &cut, relations)?;
        let tied = Tied::new(&seams, &shares, &relations)?;
        let jump = turns(field);
        let nodes = nodes.to_vec();
        let (symbolic, newton_shares, newton) = (None, None, None);
        Ok(Self { cut, jump, seams, shares, relations, tied, symbolic, nodes, newton_shares, newton })
    }

    /// Sets up as [`Self::new`] does for another field or other places of the vertices of the same mesh, but keeps what
    /// does not depend on what has changed: cuts and seams if jumps and nodes are the same, the analysis of a matrix if
    /// its pattern is.
    ///
    /// # Errors
    ///
    /// Those of [`Self::new`]; the system then stays as it was.
    pub fn rebuild(
        &mut self,
        mesh: &TriMesh,
        field: &CrossField,
        nodes: &[VertexId],
        relations: &[CoordinateConstraint],
    ) -> Result<(), ParamError> {
        if mesh.n_faces() == self.cut.turn.len() && nodes == self.nodes && turns(field) == self.jump {
            return self.set_relations(mesh, relations);
        }
        let new = Self::new(mesh, field, nodes, relations)?;
        let symbolic = self.symbolic.take().filter(|_| new.tied.same_pattern(&self.tied));
        *self = Self { symbolic, ..new };
        Ok(())
    }

    /// Changes the relations only.
    ///
    /// # Errors
    ///
    /// [`ParamError::Malformed`] or [`ParamError::Conflict`]; the system then stays as it was.
    pub fn set_relations(&mut self, mesh: &TriMesh, relations: &[CoordinateConstraint]) -> Result<(), ParamError> {
        let relations = constraints::relations(mesh, &self.cut, relations)?;
        if relations == self.relations {
            return Ok(());
        }
        let tied = Tied::new(&self.seams, &self.shares, &relations)?;
        if !tied.same_pattern(&self.tied) {
            self.symbolic = None;
        }
        self.newton = None;
        (self.relations, self.tied) = (relations, tied);
        Ok(())
    }

    /// Changes the differences of all relations, and nothing else: the analysis of the matrix stays.
    ///
    /// # Errors
    ///
    /// [`ParamError::WrongLength`], [`ParamError::Malformed`] or [`ParamError::Conflict`]; the system then stays as
    /// it was.
    pub fn set_differences(&mut self, differences: &[f64]) -> Result<(), ParamError> {
        expect_length("the list of differences", differences.len(), self.relations.len())?;
        let changed = |(c, &rhs): (&Constraint, &f64)| Constraint { rhs, ..c.clone() };
        let relations: Vec<_> = self.relations.iter().zip(differences).map(changed).collect();
        // The order of elimination does not depend on constants, hence neither does what the matrix is made of.
        self.tied.ties = tie(&self.seams, &relations)?;
        self.tied.reduction = self.seams.then(&self.tied.ties);
        self.relations = relations;
        Ok(())
    }

    /// The differences of all relations.
    pub(super) fn differences(&self) -> Vec<f64> {
        self.relations.iter().map(|c| c.rhs).collect()
    }

    /// What the differences of all relations are where all variables have these values.
    pub(super) fn differences_at(&self, values: &[f64]) -> Vec<f64> {
        let at = |c: &Constraint| c.terms.iter().map(|&(x, a)| a * values[x as usize]).sum();
        self.relations.iter().map(at).collect()
    }

    /// The values of all variables in a map with the seams of this system.
    pub(super) fn values_of(&self, mesh: &TriMesh, uv: &[[DVec2; 3]]) -> Vec<f64> {
        let mut values = vec![0.0; self.seams.n_variables()];
        for (h, w) in uv.iter().flatten().enumerate() {
            for axis in 0..2 {
                let (variable, sign) = constraints::corner(&self.cut, HalfedgeId::new(h), axis);
                values[variable as usize] = sign * w[axis as usize];
            }
        }
        constraints::add_translations(mesh, &self.cut, &mut values);
        values
    }

    /// The free variables where all variables have these values.
    pub(super) fn free_of(&self, values: &[f64]) -> Vec<f64> {
        let mut free = vec![0.0; self.n_free()];
        for (x, &value) in values.iter().enumerate() {
            // A free variable is expressed by itself alone.
            if let (&[(y, 1.0)], 0.0) = self.tied.reduction.expression(x) {
                free[y as usize] = value;
            }
        }
        free
    }

    /// The cut surface.
    pub fn cut(&self) -> &Cut {
        &self.cut
    }

    /// Number of free variables.
    pub fn n_free(&self) -> usize {
        self.tied.reduction.n_free()
    }

    /// Coordinate `axis` (0: u, 1: v) of the origin of `h` in the frame of the field in its triangle.
    pub fn coordinate(&self, h: HalfedgeId, axis: u32) -> Coordinate<'_> {
        let (variable, sign) = constraints::corner(&self.cut, h, axis);
        let (terms, constant) = self.tied.reduction.expression(variable as usize);
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
        Ok(self.assemble_with(|f| objective.local(metric, field.angle[f.index()], f)))
    }

    /// The matrix and the right-hand side of what each triangle contributes.
    pub(super) fn assemble_with(&self, local: impl Fn(FaceId) -> Local) -> (SparseHermitian<f64>, Vec<f64>) {
        let mut open = self.shares.zero.clone();
        let mut load = vec![0.0; self.seams.n_free()];
        for f in 0..self.cut.turn.len() {
            let local = local(FaceId::new(f));
            self.shares.add(f, local.stiffness.as_flattened(), &mut open);
            for (axis, shares) in (0..).zip(local.load) {
                for (i, share) in shares.into_iter().enumerate() {
                    let (variable, sign) = constraints::corner(&self.cut, HalfedgeId::new(3 * f + i), axis);
                    for &(z, c) in self.seams.expression(variable as usize).0 {
                        load[z as usize] += sign * c * share;
                    }
                }
            }
        }
        self.tied.fold(&open, load)
    }

    /// What the seams leave of all variables.
    pub(super) fn seams(&self) -> &Reduction {
        &self.seams
    }

    /// What the relations leave of what the seams leave.
    pub(super) fn ties(&self) -> &Reduction {
        &self.tied.ties
    }

    /// What Newton's method needs, if it has been used since the relations changed.
    pub(super) fn newton_kept(&self) -> Option<Arc<NewtonSystem>> {
        self.newton.clone()
    }

    /// How the whole shares of triangles make the matrix of what the seams leave.
    pub(super) fn whole_shares(&self) -> Arc<Scatter> {
        self.newton_shares.clone().unwrap_or_else(|| Arc::new(Scatter::of_whole_triangles(&self.cut, &self.seams)))
    }

    /// Keeps what Newton's method needs until the relations change.
    pub(super) fn keep_newton(&mut self, newton: &Arc<NewtonSystem>) {
        (self.newton_shares, self.newton) = (Some(newton.shares()), Some(newton.clone()));
    }

    /// The analysis of the pattern of this system's matrices.
    pub(super) fn analysed(&self) -> Result<SpdSymbolic, SolveError> {
        self.symbolic.clone().map_or_else(|| SpdSymbolic::new(&self.tied.fold.zero), Ok)
    }

    /// Keeps an analysis for the matrices to come.
    pub(super) fn keep_analysis(&mut self, symbolic: SpdSymbolic) {
        self.symbolic = Some(symbolic);
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

    /// The map of least objective along `field`: the free variables `y` that minimise `y' H y − 2 b y` with the matrix
    /// and right-hand side of [`Self::assemble`].
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
        let energy = residuals(metric, &field.angle, &map.uv, objective).iter().map(|r| r.energy).sum();
        Ok(Solution { map, free, energy })
    }

    /// The triangles of the map as [`Self::unfold`] wants them.
    ///
    /// # Errors
    ///
    /// [`ParamError::WrongLength`] for arrays of another mesh.
    pub fn triangles(
        &self,
        mesh: &TriMesh,
        metric: &Metric,
        field: &CrossField,
        objective: &Objective,
    ) -> Result<Vec<OrientedTriangle>, ParamError> {
        expect_length("the mesh", mesh.n_faces(), self.cut.turn.len())?;
        expect_length("the field", field.angle.len(), mesh.n_faces())?;
        let triangle = |f: FaceId| {
            let [a, b] = objective.target(f);
            OrientedTriangle {
                layout: *metric.layout(f),
                axis: DVec2::from_angle(field.angle[f.index()]),
                lengths: DVec2::new(a, b),
                weight: metric.area(f),
                ratio: objective.anisotropy,
                vertices: mesh.face_vertices(f).map(|v| v.0),
                corners: mesh.face_halfedges(f).map(|h| [0, 1].map(|axis| constraints::corner(&self.cut, h, axis))),
            }
        };
        Ok(mesh.faces().map(triangle).collect())
    }

    /// Removes the folds of the map with free variables `y`; see [`unfold`](super::unfold). `quarters` tells the angle
    /// around every vertex in the map, in quarter turns; 0 where it is open, as on the boundary.
    ///
    /// # Errors
    ///
    /// [`ParamError::WrongLength`] or [`ParamError::Cancelled`].
    pub fn unfold(
        &self,
        triangles: &[OrientedTriangle],
        (y, quarters): (&[f64], &[u32]),
        effort: Effort,
        progress: &Progress,
    ) -> Result<Unfolded, ParamError> {
        expect_length("the list of triangles", triangles.len(), self.cut.turn.len())?;
        expect_length("the list of free variables", y.len(), self.n_free())?;
        let n_vertices = triangles.iter().flat_map(|t| t.vertices).max().map_or(0, |v| v as usize + 1);
        if quarters.len() < n_vertices {
            expect_length("the list of angles around vertices", quarters.len(), n_vertices)?;
        }
        let problem = OrientationProblem { triangles, reduction: &self.tied.reduction, quarters };
        Ok(unfold(&problem, y, effort, progress)?)
    }

    /// The map where the free variables are `y`.
    pub fn map(&self, y: &[f64]) -> SeamlessMap {
        let x = self.tied.reduction.expand(y);
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

/// The period jumps of a field, 0 to 3.
fn turns(field: &CrossField) -> Vec<u8> {
    field.jump.iter().map(|p| p.rem_euclid(4) as u8).collect()
}

impl Tied {
    fn new(seams: &Reduction, shares: &Scatter, relations: &[Constraint]) -> Result<Self, ParamError> {
        let ties = tie(seams, relations)?;
        let fold = Scatter::of_matrix(&shares.zero, &ties);
        Ok(Self { reduction: seams.then(&ties), ties, fold })
    }

    fn same_pattern(&self, other: &Self) -> bool {
        self.fold.zero.same_pattern(&other.fold.zero)
    }

    /// The system of the free variables from that of what the seams leave.
    fn fold(&self, open: &SparseHermitian<f64>, mut load: Vec<f64>) -> (SparseHermitian<f64>, Vec<f64>) {
        let mut matrix = self.fold.zero.clone();
        for (k, (_, _, value)) in open.entries().enumerate() {
            self.fold.add(k, &[value], &mut matrix);
        }
        // What constants contribute is known and goes to the right.
        let constants: Vec<f64> = (0..load.len()).map(|z| self.ties.expression(z).1).collect();
        if constants.iter().any(|&d| d != 0.0) {
            for (b, known) in load.iter_mut().zip(open.multiply(&constants)) {
                *b -= known;
            }
        }
        let mut rhs = vec![0.0; matrix.n()];
        for (z, b) in load.into_iter().enumerate() {
            for &(y, c) in self.ties.expression(z).0 {
                rhs[y as usize] += c * b;
            }
        }
        (matrix, rhs)
    }
}

/// Eliminates the relations among what the seams leave. That is done apart, as the seams never contradict each
/// other and change less often, and as expressions grow long: the matrix is folded as a whole, not triangle by
/// triangle.
fn tie(seams: &Reduction, relations: &[Constraint]) -> Result<Reduction, ParamError> {
    let mut keep = vec![0; seams.n_free()];
    for x in 0..seams.n_variables() {
        for &(z, _) in seams.expression(x).0 {
            keep[z as usize] += 1;
        }
    }
    let substituted = |c: &Constraint| {
        let of = |&(x, a): &(u32, f64)| seams.expression(x as usize).0.iter().map(move |&(z, c)| (z, a * c));
        Constraint { terms: c.terms.iter().flat_map(of).collect(), rhs: c.rhs }
    };
    let relations: Vec<Constraint> = relations.iter().map(substituted).collect();
    eliminate(&keep, &relations).map_err(|error| match error {
        EliminationError::Conflict { constraint, rest } => ParamError::Conflict { relation: constraint, rest },
        EliminationError::Malformed { constraint } => ParamError::Malformed { relation: constraint },
    })
}

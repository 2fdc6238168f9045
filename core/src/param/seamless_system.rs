//! The linear system of seamless maps (Campen, Quad Layouts, section 6.4).
//!
//! Constraints are eliminated exactly in two stages: first the seams, then the coordinate constraints. Every corner
//! coordinate is then an affine expression of free variables. What is computed depends on what has changed:
//!
//! - The cut graph and the elimination of the seams depend on period jumps and nodes.
//! - The elimination of the coordinate constraints depends on these and on the constraints.
//! - The symbolic factorisation depends on the pattern of the matrix only.
//! - The values depend on geometry, field angles and objective. Assembly is one pass over the triangles and one over
//!   the entries, because [`Scatter`] stores where they go.

use std::sync::Arc;

use glam::DVec2;

use super::assembly::Scatter;
use super::constraints;
use super::cut_graph::CutGraph;
use super::flip_removal::{Effort, FlipRemoval, OrientationProblem, OrientedTriangle, remove_flips};
use super::newton_system::NewtonSystem;
use super::objective::{Objective, TriangleForm, residuals};
use super::seamless::{CoordinateConstraint, SeamlessMap};
use super::{ParamError, expect_length};
use crate::field::CrossField;
use crate::mesh::{EdgeId, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::solve::{
    Constraint, EliminationError, Reduction, SolveError, SparseHermitian, SpdFactor, SpdSymbolic, eliminate,
};
use crate::surface::Metric;

/// The linear system of the seamless maps of a mesh, for one set of period jumps, nodes and constraints.
#[derive(Debug, Clone)]
pub struct SeamlessSystem {
    cut: CutGraph,
    /// Period jump of each edge, 0 to 3.
    jump: Vec<u8>,
    /// All variables in terms of those free after eliminating the seams (seam-free variables).
    seams: Reduction,
    /// Assembly of the matrix of the seam-free variables from triangle matrices.
    scatter: Scatter,
    /// The coordinate constraints as linear equalities of all variables.
    equalities: Vec<Constraint>,
    reduced: Reduced,
    symbolic: Option<SpdSymbolic>,
    /// The nodes that the cuts reach.
    nodes: Vec<VertexId>,
    /// Cache of Newton's method: assembly of coupled triangle matrices, valid while the seams stay.
    coupled_scatter: Option<Arc<Scatter>>,
    /// Cache of Newton's method, valid while the constraints stay.
    newton: Option<Arc<NewtonSystem>>,
}

/// Elimination of the coordinate constraints.
#[derive(Debug, Clone)]
struct Reduced {
    /// Seam-free variables in terms of the free variables.
    constraints: Reduction,
    /// All variables in terms of the free variables.
    reduction: Reduction,
    /// Assembly of the matrix of the free variables from that of the seam-free variables.
    scatter: Scatter,
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
    /// The value of the coordinate for free variables `y`.
    pub fn value(&self, y: &[f64]) -> f64 {
        self.sign * self.terms.iter().fold(self.constant, |sum, &(x, c)| sum + c * y[x as usize])
    }
}

/// A solved seamless map.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The map, in the charts of the field.
    pub map: SeamlessMap,
    /// The free variables.
    pub free: Vec<f64>,
    /// Its energy: the least-squares objective without stiffness, or that of
    /// [`InjectiveEnergy`](super::InjectiveEnergy).
    pub energy: f64,
}

impl SeamlessSystem {
    /// Sets up the seamless maps of `mesh` for the period jumps of `field`, subject to `constraints`. `nodes` must
    /// include all singularities of the field. Redundant constraints are allowed.
    ///
    /// # Errors
    ///
    /// [`ParamError::Topology`], [`ParamError::Malformed`] or [`ParamError::Conflict`].
    pub fn new(
        mesh: &TriMesh,
        field: &CrossField,
        nodes: &[VertexId],
        constraints: &[CoordinateConstraint],
    ) -> Result<Self, ParamError> {
        expect_length("the list of period jumps", field.jump.len(), mesh.n_edges())?;
        let cut = CutGraph::new(mesh, field, nodes)?;
        let seams = eliminate(&constraints::keep(&cut), &constraints::seams(mesh, &cut))?;
        let scatter = Scatter::of_triangles(&cut, &seams);
        let equalities = constraints::linear_constraints(mesh, &cut, constraints)?;
        let reduced = Reduced::new(&seams, &scatter, &equalities)?;
        let jump = turns(field);
        let nodes = nodes.to_vec();
        let (symbolic, coupled_scatter, newton) = (None, None, None);
        Ok(Self { cut, jump, seams, scatter, equalities, reduced, symbolic, nodes, coupled_scatter, newton })
    }

    /// Sets up anew as [`Self::new`] does, for another field or other vertex positions of the same mesh. Keeps the cut
    /// graph and the elimination of seams if period jumps and nodes are unchanged, and the symbolic factorisation if
    /// the pattern of the matrix is unchanged.
    ///
    /// # Errors
    ///
    /// Those of [`Self::new`]; the system is then unchanged.
    pub fn rebuild(
        &mut self,
        mesh: &TriMesh,
        field: &CrossField,
        nodes: &[VertexId],
        constraints: &[CoordinateConstraint],
    ) -> Result<(), ParamError> {
        if mesh.n_faces() == self.cut.turn.len() && nodes == self.nodes && turns(field) == self.jump {
            return self.set_constraints(mesh, constraints);
        }
        let new = Self::new(mesh, field, nodes, constraints)?;
        let symbolic = self.symbolic.take().filter(|_| new.reduced.same_pattern(&self.reduced));
        *self = Self { symbolic, ..new };
        Ok(())
    }

    /// Replaces the coordinate constraints.
    ///
    /// # Errors
    ///
    /// [`ParamError::Malformed`] or [`ParamError::Conflict`]; the system is then unchanged.
    pub fn set_constraints(&mut self, mesh: &TriMesh, constraints: &[CoordinateConstraint]) -> Result<(), ParamError> {
        let equalities = constraints::linear_constraints(mesh, &self.cut, constraints)?;
        if equalities == self.equalities {
            return Ok(());
        }
        let reduced = Reduced::new(&self.seams, &self.scatter, &equalities)?;
        if !reduced.same_pattern(&self.reduced) {
            self.symbolic = None;
        }
        self.newton = None;
        (self.equalities, self.reduced) = (equalities, reduced);
        Ok(())
    }

    /// Replaces the differences of all coordinate constraints; the symbolic factorisation stays valid.
    ///
    /// # Errors
    ///
    /// [`ParamError::WrongLength`], [`ParamError::Malformed`] or [`ParamError::Conflict`]; the system is then
    /// unchanged.
    pub fn set_differences(&mut self, differences: &[f64]) -> Result<(), ParamError> {
        expect_length("the list of differences", differences.len(), self.equalities.len())?;
        let changed = |(c, &rhs): (&Constraint, &f64)| Constraint { rhs, ..c.clone() };
        let equalities: Vec<_> = self.equalities.iter().zip(differences).map(changed).collect();
        // The order of elimination does not depend on right-hand sides, so the pattern and the scatter stay valid.
        self.reduced.constraints = reduce(&self.seams, &equalities)?;
        self.reduced.reduction = self.seams.then(&self.reduced.constraints);
        self.equalities = equalities;
        Ok(())
    }

    /// The differences of all coordinate constraints.
    pub(super) fn differences(&self) -> Vec<f64> {
        self.equalities.iter().map(|c| c.rhs).collect()
    }

    /// The coordinate differences between the points of all constraints, for given values of all variables.
    pub(super) fn differences_at(&self, values: &[f64]) -> Vec<f64> {
        let at = |c: &Constraint| c.terms.iter().map(|&(x, a)| a * values[x as usize]).sum();
        self.equalities.iter().map(at).collect()
    }

    /// The values of all variables for a map that satisfies the seam constraints of this system.
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

    /// The free variables for given values of all variables.
    pub(super) fn free_of(&self, values: &[f64]) -> Vec<f64> {
        let mut free = vec![0.0; self.n_free()];
        for (x, &value) in values.iter().enumerate() {
            // The expression of a free variable is the variable itself.
            if let (&[(y, 1.0)], 0.0) = self.reduced.reduction.expression(x) {
                free[y as usize] = value;
            }
        }
        free
    }

    /// The cut graph.
    pub fn cut(&self) -> &CutGraph {
        &self.cut
    }

    /// Number of free variables.
    pub fn n_free(&self) -> usize {
        self.reduced.reduction.n_free()
    }

    /// Coordinate `axis` (0: u, 1: v) of the origin of `h` in the chart of its triangle.
    pub fn coordinate(&self, h: HalfedgeId, axis: u32) -> Coordinate<'_> {
        let (variable, sign) = constraints::corner(&self.cut, h, axis);
        let (terms, constant) = self.reduced.reduction.expression(variable as usize);
        Coordinate { sign, terms, constant }
    }

    /// The matrix and the right-hand side of an objective. Slivers and target lengths are not modified.
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
        Ok(self.assemble_with(|f| objective.form(metric, field.angle[f.index()], f)))
    }

    /// The matrix and the right-hand side of the sum of triangle forms.
    pub(super) fn assemble_with(&self, form: impl Fn(FaceId) -> TriangleForm) -> (SparseHermitian<f64>, Vec<f64>) {
        let mut matrix = self.scatter.zero.clone();
        let mut load = vec![0.0; self.seams.n_free()];
        for f in 0..self.cut.turn.len() {
            let form = form(FaceId::new(f));
            self.scatter.add(f, form.stiffness.as_flattened(), &mut matrix);
            for (axis, corners) in (0..).zip(form.load) {
                for (i, value) in corners.into_iter().enumerate() {
                    let (variable, sign) = constraints::corner(&self.cut, HalfedgeId::new(3 * f + i), axis);
                    for &(z, c) in self.seams.expression(variable as usize).0 {
                        load[z as usize] += sign * c * value;
                    }
                }
            }
        }
        self.reduced.system(&matrix, load)
    }

    /// All variables in terms of the seam-free variables.
    pub(super) fn seams(&self) -> &Reduction {
        &self.seams
    }

    /// The seam-free variables in terms of the free variables.
    pub(super) fn constraint_reduction(&self) -> &Reduction {
        &self.reduced.constraints
    }

    /// The cached Newton system, if Newton's method has been used since the constraints changed.
    pub(super) fn cached_newton(&self) -> Option<Arc<NewtonSystem>> {
        self.newton.clone()
    }

    /// Assembly of the matrix of the seam-free variables from coupled triangle matrices.
    pub(super) fn coupled_scatter(&self) -> Arc<Scatter> {
        self.coupled_scatter.clone().unwrap_or_else(|| Arc::new(Scatter::of_coupled_triangles(&self.cut, &self.seams)))
    }

    /// Caches a Newton system until the constraints change.
    pub(super) fn cache_newton(&mut self, newton: &Arc<NewtonSystem>) {
        (self.coupled_scatter, self.newton) = (Some(newton.scatter()), Some(newton.clone()));
    }

    /// The symbolic factorisation of this system's matrices.
    pub(super) fn symbolic(&self) -> Result<SpdSymbolic, SolveError> {
        self.symbolic.clone().map_or_else(|| SpdSymbolic::new(&self.reduced.scatter.zero), Ok)
    }

    /// Caches a symbolic factorisation.
    pub(super) fn cache_symbolic(&mut self, symbolic: SpdSymbolic) {
        self.symbolic = Some(symbolic);
    }

    /// Factorises a matrix of this system; the symbolic factorisation is computed once.
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

    /// The map of least objective along `field`: the free variables `y` minimise `y' H y − 2 b y` with the matrix and
    /// right-hand side of [`Self::assemble`].
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

    /// The triangles of the map as input of [`Self::remove_flips`].
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

    /// Removes the flipped triangles of the map with free variables `y`; see [`remove_flips`]. `quarters` is the angle
    /// around each vertex in the map, in quarter turns; 0 where it is not prescribed, as on the boundary.
    ///
    /// # Errors
    ///
    /// [`ParamError::WrongLength`] or [`ParamError::Cancelled`].
    pub fn remove_flips(
        &self,
        triangles: &[OrientedTriangle],
        (y, quarters): (&[f64], &[u32]),
        effort: Effort,
        progress: &Progress,
    ) -> Result<FlipRemoval, ParamError> {
        expect_length("the list of triangles", triangles.len(), self.cut.turn.len())?;
        expect_length("the list of free variables", y.len(), self.n_free())?;
        let n_vertices = triangles.iter().flat_map(|t| t.vertices).max().map_or(0, |v| v as usize + 1);
        if quarters.len() < n_vertices {
            expect_length("the list of angles around vertices", quarters.len(), n_vertices)?;
        }
        let problem = OrientationProblem { triangles, reduction: &self.reduced.reduction, quarters };
        Ok(remove_flips(&problem, y, effort, progress)?)
    }

    /// The map with free variables `y`.
    pub fn map(&self, y: &[f64]) -> SeamlessMap {
        let x = self.reduced.reduction.expand(y);
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

impl Reduced {
    fn new(seams: &Reduction, scatter: &Scatter, equalities: &[Constraint]) -> Result<Self, ParamError> {
        let constraints = reduce(seams, equalities)?;
        let scatter = Scatter::of_matrix(&scatter.zero, &constraints);
        Ok(Self { reduction: seams.then(&constraints), constraints, scatter })
    }

    fn same_pattern(&self, other: &Self) -> bool {
        self.scatter.zero.same_pattern(&other.scatter.zero)
    }

    /// The system of the free variables from that of the seam-free variables.
    fn system(&self, seam_free: &SparseHermitian<f64>, mut load: Vec<f64>) -> (SparseHermitian<f64>, Vec<f64>) {
        let mut matrix = self.scatter.zero.clone();
        for (k, (_, _, value)) in seam_free.entries().enumerate() {
            self.scatter.add(k, &[value], &mut matrix);
        }
        // Constant terms of the expressions move to the right-hand side.
        let constants: Vec<f64> = (0..load.len()).map(|z| self.constraints.expression(z).1).collect();
        if constants.iter().any(|&d| d != 0.0) {
            for (b, known) in load.iter_mut().zip(seam_free.multiply(&constants)) {
                *b -= known;
            }
        }
        let mut rhs = vec![0.0; matrix.n()];
        for (z, b) in load.into_iter().enumerate() {
            for &(y, c) in self.constraints.expression(z).0 {
                rhs[y as usize] += c * b;
            }
        }
        (matrix, rhs)
    }
}

/// Eliminates the coordinate constraints: seam-free variables in terms of free variables.
///
/// This is a stage of its own because seams never contradict each other and change less often, and because expressions
/// become long: the matrix is reduced as a whole rather than triangle by triangle.
fn reduce(seams: &Reduction, equalities: &[Constraint]) -> Result<Reduction, ParamError> {
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
    let substituted: Vec<Constraint> = equalities.iter().map(substituted).collect();
    eliminate(&keep, &substituted).map_err(|error| match error {
        EliminationError::Conflict { constraint, rest } => ParamError::Conflict { constraint, residual: rest },
        EliminationError::Malformed { constraint } => ParamError::Malformed { constraint },
    })
}

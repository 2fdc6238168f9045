//! Curves along mesh edges: from a curve number per edge to ordered paths with smoothed tangents.
//!
//! Where a curve crosses itself, four of its edges meet at a vertex; opposite ones are joined, since crossings are
//! transversal. Curves may end at the boundary only.
//!
//! An edge path zigzags at the scale of the triangles, which fields must not follow, so its tangent is averaged. The turning
//! angles at its vertices, each the mean of those measured on the left and on the right, give the direction of the path as
//! a step function of arc length; its mean over a window around an edge, less the direction of the edge, is the edge's
//! tangent offset.

use std::f64::consts::PI;

use super::error::{FieldError, expect_length};
use crate::mesh::{EdgeId, HalfedgeId, TriMesh, VertexId};
use crate::surface::Metric;

/// Half the width of the window over which tangents are averaged, in mean edge lengths; chosen by hand. Zero would leave the
/// directions of the edges.
const HALF_WINDOW: f64 = 2.0;

/// An edge with a direction of traversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// The edge.
    pub edge: EdgeId,
    /// Whether it is traversed in the direction of [`TriMesh::halfedge`].
    pub forward: bool,
}

impl Step {
    /// The half-edge along the step, in the triangle left of it; `None` on the boundary.
    pub fn left(self, mesh: &TriMesh) -> Option<HalfedgeId> {
        let h = mesh.halfedge(self.edge);
        if self.forward { Some(h) } else { mesh.twin(h) }
    }

    /// The half-edge against the step, in the triangle right of it; `None` on the boundary.
    pub fn right(self, mesh: &TriMesh) -> Option<HalfedgeId> {
        self.reversed().left(mesh)
    }

    /// The same edge in the other direction.
    pub fn reversed(self) -> Self {
        Self { edge: self.edge, forward: !self.forward }
    }

    /// The vertex it starts at.
    pub fn from(self, mesh: &TriMesh) -> VertexId {
        mesh.edge_vertices(self.edge)[usize::from(!self.forward)]
    }

    /// The vertex it ends at.
    pub fn to(self, mesh: &TriMesh) -> VertexId {
        mesh.edge_vertices(self.edge)[usize::from(self.forward)]
    }
}

/// A path along edges: a curve, or one connected part of it.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgePath {
    /// The number of the curve.
    pub curve: u32,
    /// Consecutive edges.
    pub steps: Vec<Step>,
    /// Angle from each edge to the smoothed tangent of the curve, counter-clockwise, in radians.
    pub tangent_offset: Vec<f64>,
    /// Whether the last step ends where the first starts; otherwise both ends lie on the boundary.
    pub closed: bool,
}

/// The edges at a vertex counter-clockwise, as steps away from it.
fn steps_from(mesh: &TriMesh, v: VertexId) -> Vec<Step> {
    let away = |(h, _): (HalfedgeId, VertexId)| {
        let edge = mesh.edge(h);
        Step { edge, forward: mesh.edge_vertices(edge)[0] == v }
    };
    mesh.spokes(v).map(away).collect()
}

/// Orders the edges of each curve into paths, by ascending curve. A closed path starts at its smallest edge, an open one at
/// one of its ends.
///
/// # Errors
///
/// [`FieldError::WrongLength`], or [`FieldError::OpenCurve`] if a curve ends at an inner vertex.
pub fn trace_curves(
    mesh: &TriMesh,
    metric: &Metric,
    curve_of_edge: &[Option<u32>],
) -> Result<Vec<EdgePath>, FieldError> {
    expect_length("the list of curves per edge", curve_of_edge.len(), mesh.n_edges())?;
    let mut used = vec![false; mesh.n_edges()];
    let mut edges: Vec<(u32, EdgeId)> = mesh.edges().filter_map(|e| Some((curve_of_edge[e.index()]?, e))).collect();
    edges.sort();
    let mut paths = Vec::new();
    let window = HALF_WINDOW * mesh.mean_edge_length();
    for &(curve, e) in &edges {
        if used[e.index()] {
            continue;
        }
        let first = Step { edge: e, forward: true };
        let (mut steps, closed) = follow(mesh, curve_of_edge, curve, first)?;
        if !closed {
            let (back, _) = follow(mesh, curve_of_edge, curve, first.reversed())?;
            let mut all: Vec<Step> = back.iter().rev().map(|s| s.reversed()).collect();
            all.extend_from_slice(&steps[1..]);
            steps = all;
        }
        for s in &steps {
            used[s.edge.index()] = true;
        }
        let tangent_offset = tangent_offsets(mesh, metric, &steps, closed, window);
        paths.push(EdgePath { curve, steps, tangent_offset, closed });
    }
    Ok(paths)
}

impl EdgePath {
    /// Pairs of consecutive steps, as indices into [`Self::steps`].
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let n = self.steps.len();
        (usize::from(!self.closed)..n).map(move |i| ((i + n - 1) % n, i))
    }
}

/// The half-edges crossed counter-clockwise around the vertex between steps `a` and `b`, from the triangle left of `b` to
/// the triangle left of `a`; `None` if the boundary lies between.
pub(super) fn left_fan(mesh: &TriMesh, a: Step, b: Step) -> Option<Vec<HalfedgeId>> {
    let end = a.left(mesh)?;
    let mut h = b.left(mesh)?;
    let mut fan = Vec::new();
    loop {
        let spoke = mesh.prev(h);
        if spoke == end {
            return Some(fan);
        }
        fan.push(spoke);
        h = mesh.twin(spoke)?;
    }
}

/// The angle by which a path turns left between two steps: half the difference of the angles on its right and left.
fn turn(mesh: &TriMesh, metric: &Metric, a: Step, b: Step) -> f64 {
    let angle = |a: Step, b: Step| {
        let fan = left_fan(mesh, a, b)?;
        let first = metric.corner_angle(b.left(mesh)?);
        Some(fan.iter().filter_map(|&h| mesh.twin(h)).map(|h| metric.corner_angle(h)).sum::<f64>() + first)
    };
    match (angle(a, b), angle(b.reversed(), a.reversed())) {
        (Some(left), Some(right)) => 0.5 * (right - left),
        (Some(left), None) => PI - left,
        (None, Some(right)) => right - PI,
        (None, None) => 0.0,
    }
}

/// For each step, the angle to the mean direction of the path within `window` of the step's midpoint.
fn tangent_offsets(mesh: &TriMesh, metric: &Metric, steps: &[Step], closed: bool, window: f64) -> Vec<f64> {
    let n = steps.len();
    let length: Vec<f64> = steps.iter().map(|s| mesh.edge_length(s.edge)).collect();
    let turns: Vec<f64> = (0..n)
        .map(|i| if i == 0 && !closed { 0.0 } else { turn(mesh, metric, steps[(i + n - 1) % n], steps[i]) })
        .collect();
    // A window longer than a closed path would count parts of it twice.
    let window = window.min(0.25 * length.iter().sum::<f64>());
    (0..n)
        .map(|i| {
            let mut weight = length[i];
            let mut moment = 0.0;
            for forward in [true, false] {
                let (mut k, mut angle, mut reach) = (i, 0.0, window - 0.5 * length[i]);
                while reach > 0.0 {
                    let end = if forward { k + 1 == n } else { k == 0 };
                    if end && !closed {
                        break;
                    }
                    if forward {
                        k = (k + 1) % n;
                        angle += turns[k];
                    } else {
                        angle -= turns[k];
                        k = (k + n - 1) % n;
                    }
                    let part = length[k].min(reach);
                    weight += part;
                    moment += part * angle;
                    reach -= length[k];
                    if k == i {
                        break;
                    }
                }
            }
            if weight > 0.0 { moment / weight } else { 0.0 }
        })
        .collect()
}

/// Follows a curve from a step until it closes or ends at the boundary; returns its steps, and whether it closes.
fn follow(mesh: &TriMesh, of: &[Option<u32>], curve: u32, first: Step) -> Result<(Vec<Step>, bool), FieldError> {
    let mut steps = vec![first];
    let mut at = first;
    loop {
        let vertex = at.to(mesh);
        let here: Vec<Step> =
            steps_from(mesh, vertex).into_iter().filter(|s| of[s.edge.index()] == Some(curve)).collect();
        let Some(arriving) = here.iter().position(|s| s.edge == at.edge) else { return Ok((steps, false)) };
        if here.len() % 2 == 1 {
            if mesh.is_boundary_vertex(vertex) {
                return Ok((steps, false));
            }
            return Err(FieldError::OpenCurve { curve, vertex, edge: at.edge });
        }
        at = here[(arriving + here.len() / 2) % here.len()];
        if at == first {
            return Ok((steps, true));
        }
        if steps.len() > mesh.n_edges() {
            return Err(FieldError::OpenCurve { curve, vertex, edge: at.edge });
        }
        steps.push(at);
    }
}

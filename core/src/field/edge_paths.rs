//! Curves that run along edges of the mesh: from a curve per edge to ordered paths.
//!
//! Where a curve crosses itself four of its edges meet in one vertex; opposite ones belong together, because
//! crossings are transversal. Curves may end at the boundary only.
//!
//! Such a path zigzags on the scale of the triangles, and fields must not follow that. Its direction is therefore
//! averaged: the turns at its vertices, measured by the angles on both sides, unroll it into a staircase of angles
//! over arc length, whose mean over a window says by how much each edge leans away from the curve it stands for.

use std::f64::consts::PI;

use super::{FieldError, expect_length};
use crate::mesh::{EdgeId, HalfedgeId, TriMesh, VertexId};
use crate::surface::Metric;

/// Half the window over which directions are averaged, in mean edge lengths.
const WINDOW: f64 = 2.0;

/// An edge passed in one direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// The edge.
    pub edge: EdgeId,
    /// Whether it is passed in the direction of [`TriMesh::halfedge`].
    pub forward: bool,
}

impl Step {
    /// The half-edge in the direction of the step, left of it; `None` if there is no triangle.
    pub fn left(self, mesh: &TriMesh) -> Option<HalfedgeId> {
        let h = mesh.halfedge(self.edge);
        if self.forward { Some(h) } else { mesh.twin(h) }
    }

    /// The half-edge against the direction of the step, right of it; `None` if there is no triangle.
    pub fn right(self, mesh: &TriMesh) -> Option<HalfedgeId> {
        self.reversed().left(mesh)
    }

    /// The same edge passed the other way.
    pub fn reversed(self) -> Self {
        Self { edge: self.edge, forward: !self.forward }
    }

    /// The vertex it starts from.
    pub fn from(self, mesh: &TriMesh) -> VertexId {
        mesh.edge_vertices(self.edge)[usize::from(!self.forward)]
    }

    /// The vertex it leads to.
    pub fn to(self, mesh: &TriMesh) -> VertexId {
        mesh.edge_vertices(self.edge)[usize::from(self.forward)]
    }
}

/// A curve along edges.
#[derive(Debug, Clone, PartialEq)]
pub struct EdgePath {
    /// The curve it is, or is a part of.
    pub curve: u32,
    /// Consecutive edges.
    pub steps: Vec<Step>,
    /// Angle from each edge to the smoothed tangent of the curve, counter-clockwise, in radians.
    pub lean: Vec<f64>,
    /// Whether the last step leads to the start of the first; otherwise both ends lie on the boundary.
    pub closed: bool,
}

/// The spokes of a vertex counter-clockwise, as steps away from it.
fn spokes(mesh: &TriMesh, v: VertexId) -> Vec<Step> {
    let away = |h: HalfedgeId| {
        let edge = mesh.edge(h);
        Step { edge, forward: mesh.edge_vertices(edge)[0] == v }
    };
    let mut out: Vec<Step> = mesh.outgoing(v).map(away).collect();
    if mesh.is_boundary_vertex(v)
        && let Some(last) = mesh.outgoing(v).last()
    {
        out.push(away(mesh.prev(last)));
    }
    out
}

/// Orders the edges of each curve into paths, curves ascending, each path starting at its smallest edge or, if it
/// is open, at one of its ends.
///
/// # Errors
///
/// [`FieldError::WrongLength`], or [`FieldError::OpenCurve`] where a curve ends inside the surface.
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
    let window = WINDOW * mesh.edges().map(|e| mesh.edge_length(e)).sum::<f64>() / mesh.n_edges().max(1) as f64;
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
        let lean = lean(mesh, metric, &steps, closed, window);
        paths.push(EdgePath { curve, steps, lean, closed });
    }
    Ok(paths)
}

impl EdgePath {
    /// Consecutive steps, as positions in [`Self::steps`].
    pub fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let n = self.steps.len();
        (usize::from(!self.closed)..n).map(move |i| ((i + n - 1) % n, i))
    }
}

/// The half-edges crossed counter-clockwise around the vertex between two steps, from the triangle left of the
/// second to the triangle left of the first; `None` if the boundary is in between.
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

/// How much a path turns to the left between two steps: half the difference of the angles on its sides.
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

/// For each step the angle to the mean direction of the path over `window` before and behind its middle.
fn lean(mesh: &TriMesh, metric: &Metric, steps: &[Step], closed: bool, window: f64) -> Vec<f64> {
    let n = steps.len();
    let length: Vec<f64> = steps.iter().map(|s| mesh.edge_length(s.edge)).collect();
    let turns: Vec<f64> = (0..n)
        .map(|i| if i == 0 && !closed { 0.0 } else { turn(mesh, metric, steps[(i + n - 1) % n], steps[i]) })
        .collect();
    // A window that is longer than the path would count parts of it twice.
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

/// Follows a curve from a step until it closes or meets the boundary.
fn follow(mesh: &TriMesh, of: &[Option<u32>], curve: u32, first: Step) -> Result<(Vec<Step>, bool), FieldError> {
    let mut steps = vec![first];
    let mut at = first;
    loop {
        let vertex = at.to(mesh);
        let here: Vec<Step> = spokes(mesh, vertex).into_iter().filter(|s| of[s.edge.index()] == Some(curve)).collect();
        let Some(mine) = here.iter().position(|s| s.edge == at.edge) else { return Ok((steps, false)) };
        if here.len() % 2 == 1 {
            if mesh.is_boundary_vertex(vertex) {
                return Ok((steps, false));
            }
            return Err(FieldError::OpenCurve { curve, vertex, edge: at.edge });
        }
        at = here[(mine + here.len() / 2) % here.len()];
        if at == first {
            return Ok((steps, true));
        }
        if steps.len() > mesh.n_edges() {
            return Err(FieldError::OpenCurve { curve, vertex, edge: at.edge });
        }
        steps.push(at);
    }
}

//! Curves that run along edges of the mesh: from a curve per edge to ordered paths.
//!
//! Where a curve crosses itself four of its edges meet in one vertex; opposite ones belong together, because
//! crossings are transversal. Curves may end at the boundary only.

use super::{FieldError, expect_length};
use crate::mesh::{EdgeId, HalfedgeId, TriMesh, VertexId};

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
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EdgePath {
    /// The curve it is, or is a part of.
    pub curve: u32,
    /// Consecutive edges.
    pub steps: Vec<Step>,
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
pub fn trace_curves(mesh: &TriMesh, curve_of_edge: &[Option<u32>]) -> Result<Vec<EdgePath>, FieldError> {
    expect_length("the list of curves per edge", curve_of_edge.len(), mesh.n_edges())?;
    let mut used = vec![false; mesh.n_edges()];
    let mut edges: Vec<(u32, EdgeId)> = mesh.edges().filter_map(|e| Some((curve_of_edge[e.index()]?, e))).collect();
    edges.sort();
    let mut paths = Vec::new();
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
        paths.push(EdgePath { curve, steps, closed });
    }
    Ok(paths)
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

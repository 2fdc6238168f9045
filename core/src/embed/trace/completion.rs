//! Completion: the layout that a map determines, its base complex (Campen, section 6.5.2).
//!
//! All isolines that leave the given nodes are traced to a node or to the boundary. Where they cross, or end on the
//! boundary, there are regular nodes, and together with the boundary they cut the surface into rectangles. So the
//! missing arcs of a partial layout are read off the map. For all nodes of a complete layout the result is that layout
//! if and only if the map realises it.

use thiserror::Error;

use crate::dual::{Mark, RefinedMesh, next};
use crate::embed::trace::error::TraceError;
use crate::embed::trace::isoline_points::{Point, degenerate_crossing, isoline_points, snap_vertices};
use crate::embed::trace::isolines::{Exit, Isolines, OutgoingIsoline, Step, Stop, map_rounding, nodes_at};
use crate::embed::trace::overlay::{Meeting, overlay};
use crate::embed::trace::traced_layout::TracedLayout;
use crate::layout::{Arc, LayoutError, Node, Patch, QuadLayout};
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::param::SeamlessMap;

/// Why a map has no base complex.
#[derive(Debug, Error)]
pub enum CompletionError {
    /// An isoline reaches neither a node nor the boundary within the length allowed.
    #[error("an isoline from node {node} reaches neither a node nor the boundary")]
    Endless {
        /// The node.
        node: usize,
    },
    /// An isoline runs into a flipped triangle, or does not continue at a vertex.
    #[error("an isoline from node {node} runs into a flipped triangle")]
    FlippedTriangle {
        /// The node.
        node: usize,
    },
    /// A region between isolines does not have four sides.
    #[error("the region beside arc {arc} does not have four sides")]
    Sides {
        /// The arc.
        arc: usize,
    },
    /// The isolines could not be overlaid with the mesh.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The structure is not that of a layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// A layout read off a map, with its embedding.
#[derive(Debug, Clone)]
pub struct CompletedLayout {
    /// The layout; the nodes given come first.
    pub layout: QuadLayout,
    /// Its embedding.
    pub traced: TracedLayout,
}

/// The base complex of `map` for the given nodes, which must include all singular vertices of the map and all corners
/// of the boundary. Isolines are traced for a length of at most `limit` in the map.
///
/// # Errors
///
/// See [`CompletionError`].
pub fn complete_layout(
    mesh: &TriMesh,
    map: &SeamlessMap,
    nodes: &[VertexId],
    limit: f64,
) -> Result<CompletedLayout, CompletionError> {
    let (isolines, exact) = separatrices(mesh, map, nodes, limit)?;
    let mut overlay = overlay(mesh, &exact, &isolines, Meeting::Vertex)?;
    let mut nodes: Vec<u32> = nodes.iter().map(|v| v.0).collect();
    let node = add_regular_nodes(&mut nodes, &overlay.paths, overlay.mesh.n_vertices());
    let mut arcs = split_at_nodes(&overlay.paths, &node);
    arcs.extend(boundary_arcs(&overlay.mesh, &node));
    for (arc, path) in (0u32..).zip(&arcs) {
        for w in path.windows(2) {
            let h = overlay.refined.find(w[0], w[1]).ok_or(CompletionError::Sides { arc: arc as usize })?;
            overlay.refined.set_mark(h, Mark::Arc(arc));
        }
    }
    let graph = ArcGraph { refined: &overlay.refined, mesh: &overlay.mesh, node: &node, paths: &arcs };
    let layout = graph.layout(&nodes)?;
    let traced = TracedLayout::new(overlay, &layout, nodes, arcs)?;
    Ok(CompletedLayout { layout, traced })
}

/// The isolines of all nodes, each once, and the map with the vertices on them moved onto them.
fn separatrices(
    mesh: &TriMesh,
    map: &SeamlessMap,
    nodes: &[VertexId],
    limit: f64,
) -> Result<(Vec<Vec<Point>>, SeamlessMap), CompletionError> {
    let at = nodes_at(mesh, nodes);
    let isolines = Isolines { mesh, map, node: &at, rounding: map_rounding(map), cross_flipped: false };
    let outgoing: Vec<Vec<OutgoingIsoline>> = nodes.iter().map(|&v| isolines.outgoing(v)).collect();
    let mut done: Vec<Vec<bool>> =
        outgoing.iter().map(|all| all.iter().map(|o| on_boundary(mesh, o)).collect()).collect();
    let mut exact = map.clone();
    let mut found = Vec::new();
    for node in 0..nodes.len() {
        for (i, &isoline) in outgoing[node].iter().enumerate() {
            if done[node][i] {
                continue;
            }
            let mut steps = Vec::new();
            let outcome = isolines.trace_into(&mut steps, isoline, limit);
            let inner = match outcome {
                Ok(_) => {
                    let Some(Step::Vertex(end, _)) = steps.last() else { continue };
                    let to = at[mesh.origin(*end).index()] as usize;
                    let arrival = isolines.arrival(&steps, &outgoing[to]);
                    // Traced from the other node, it would be the same isoline.
                    done[to][arrival.ok_or(CompletionError::FlippedTriangle { node })?] = true;
                    &steps[1..steps.len() - 1]
                }
                Err(Stop::Boundary(_)) => &steps[1..],
                Err(Stop::Vertex(v)) if mesh.is_boundary_vertex(v) => &steps[1..],
                Err(Stop::Length(_)) => return Err(CompletionError::Endless { node }),
                Err(Stop::FlippedTriangle(_) | Stop::Vertex(_)) => {
                    return Err(CompletionError::FlippedTriangle { node });
                }
            };
            snap_vertices(&isolines, &mut exact, inner);
            found.push(steps);
        }
    }
    let isolines = Isolines { map: &exact, ..isolines };
    let found: Vec<Vec<Point>> = found.iter().map(|steps| isoline_points(&isolines, steps)).collect();
    for (arc, points) in found.iter().enumerate() {
        if let Some(face) = degenerate_crossing(mesh, points) {
            return Err(TraceError::Lost { arc, face }.into());
        }
    }
    Ok((found, exact))
}

/// Whether an isoline runs along the boundary.
fn on_boundary(mesh: &TriMesh, isoline: &OutgoingIsoline) -> bool {
    isoline.exit == Exit::Back || isoline.exit == Exit::Along && mesh.twin(isoline.corner).is_none()
}

/// Adds the vertices where isolines cross or end to `nodes`; returns the node at each vertex, or `u32::MAX`.
fn add_regular_nodes(nodes: &mut Vec<u32>, paths: &[Vec<u32>], n_vertices: usize) -> Vec<u32> {
    let mut visits = vec![0; n_vertices];
    for path in paths {
        for (i, &v) in path.iter().enumerate() {
            visits[v as usize] += if i == 0 || i + 1 == path.len() { 2 } else { 1 };
        }
    }
    let mut node = vec![u32::MAX; n_vertices];
    for (n, &v) in (0u32..).zip(nodes.iter()) {
        node[v as usize] = n;
    }
    for v in 0..n_vertices {
        if visits[v] >= 2 && node[v] == u32::MAX {
            node[v] = nodes.len() as u32;
            nodes.push(v as u32);
        }
    }
    node
}

/// The paths, split at nodes.
fn split_at_nodes(paths: &[Vec<u32>], node: &[u32]) -> Vec<Vec<u32>> {
    let mut arcs = Vec::new();
    for path in paths {
        let mut from = 0;
        for i in 1..path.len() {
            if node[path[i] as usize] != u32::MAX {
                arcs.push(path[from..=i].to_vec());
                from = i;
            }
        }
    }
    arcs
}

/// The edge paths along the boundary from node to node.
fn boundary_arcs(mesh: &TriMesh, node: &[u32]) -> Vec<Vec<u32>> {
    let mut arcs = Vec::new();
    for first in mesh.halfedges() {
        if mesh.twin(first).is_some() || node[mesh.origin(first).index()] == u32::MAX {
            continue;
        }
        let mut path = vec![mesh.origin(first).0];
        let mut h = first;
        loop {
            let v = mesh.target(h);
            path.push(v.0);
            if node[v.index()] != u32::MAX {
                break;
            }
            h = mesh.vertex_halfedge(v);
        }
        arcs.push(path);
    }
    arcs
}

/// A half-arc as a side of a patch: the arc, and whether it is run through forward.
type Side = (usize, bool);

/// Arcs that are edge paths of a mesh, marked on its edges.
struct ArcGraph<'a> {
    refined: &'a RefinedMesh,
    mesh: &'a TriMesh,
    /// The node at each vertex, or `u32::MAX`.
    node: &'a [u32],
    paths: &'a [Vec<u32>],
}

impl ArcGraph<'_> {
    /// The structure of the layout whose nodes are the given vertices.
    fn layout(&self, nodes: &[u32]) -> Result<QuadLayout, CompletionError> {
        let arcs: Vec<Arc> = self.paths.iter().map(|p| self.arc(p)).collect();
        let patches = self.patches(&arcs)?;
        let mut nodes: Vec<Node> =
            nodes.iter().map(|&v| Node { valence: 0, boundary: self.mesh.is_boundary_vertex(VertexId(v)) }).collect();
        for corner in patches.iter().flat_map(|p| p.corners) {
            nodes[corner as usize].valence += 1;
        }
        let mut layout = QuadLayout { nodes, arcs, patches, chords: 0 };
        layout.find_chords();
        layout.check(self.mesh.euler_characteristic())?;
        Ok(layout)
    }

    fn arc(&self, path: &[u32]) -> Arc {
        Arc {
            nodes: [path[0], path[path.len() - 1]].map(|v| self.node[v as usize]),
            boundary: self.refined.find(path[0], path[1]).is_some_and(|h| self.refined.is_boundary(h)),
            chord: 0,
        }
    }

    /// The patches: each half-arc that has the surface on its left is a side of one of them.
    fn patches(&self, arcs: &[Arc]) -> Result<Vec<Patch>, CompletionError> {
        let mut used = vec![[false; 2]; arcs.len()];
        let mut patches = Vec::new();
        for first in (0..arcs.len()).flat_map(|a| [(a, true), (a, false)]) {
            let outside = || arcs[first.0].boundary && self.leaving(self.first_edge(first)).is_none();
            if used[first.0][usize::from(first.1)] || outside() {
                continue;
            }
            let sides = self.sides(first).ok_or(CompletionError::Sides { arc: first.0 })?;
            for (arc, forward) in sides {
                used[arc][usize::from(forward)] = true;
            }
            let sides = sides.map(|(a, forward)| (a as u32, forward));
            let corners = sides.map(|(a, forward)| arcs[a as usize].nodes[usize::from(!forward)]);
            patches.push(Patch { corners, sides });
        }
        Ok(patches)
    }

    /// The four sides of the patch to the left of `first`; `None` if it does not have four.
    fn sides(&self, first: Side) -> Option<[Side; 4]> {
        let mut sides = [first; 4];
        for i in 1..4 {
            sides[i] = self.next_side(sides[i - 1])?;
            if sides[i] == first {
                return None;
            }
        }
        (self.next_side(sides[3])? == first).then_some(sides)
    }

    /// The side that follows a side counter-clockwise around the patch to its left.
    fn next_side(&self, side: Side) -> Option<Side> {
        // Clockwise around the end of the side, through the faces on its left, to the next arc.
        let reversed = self.first_edge((side.0, !side.1));
        let mut h = next(self.leaving([reversed[1], reversed[0]])?.0);
        while self.refined.mark(h) == Mark::Free {
            h = next(self.refined.twin(h)?);
        }
        let Mark::Arc(a) = self.refined.mark(h) else { return None };
        let edge = [self.refined.origin(h), self.refined.target(h)];
        Some((a as usize, self.first_edge((a as usize, true)) == edge))
    }

    /// The two vertices of the first edge of a side.
    fn first_edge(&self, (a, forward): Side) -> [u32; 2] {
        let (p, n) = (&self.paths[a], self.paths[a].len());
        if forward { [p[0], p[1]] } else { [p[n - 1], p[n - 2]] }
    }

    /// The half-edge from one vertex to another, if there is one in the mesh.
    fn leaving(&self, [from, to]: [u32; 2]) -> Option<HalfedgeId> {
        self.mesh.outgoing(VertexId(from)).find(|&h| self.mesh.target(h) == VertexId(to))
    }
}

//! The layout that a map has by itself: its base complex.
//!
//! All isolines that leave the irregular nodes are followed to a node or the boundary. Where they cross one another
//! there are regular nodes, and together with the boundary they part the surface into rectangles (Campen, section
//! 6.5.2: arcs of a partial layout that are not given emerge from the map). Given all nodes of a complete
//! layout, the result is that layout if, and only if, the map realises it.

use thiserror::Error;

use crate::dual::{Mark, RefinedMesh, next};
use crate::embed::trace::arcs::{TraceError, TracedLayout, misplaced, parameters, points, seeds, straighten};
use crate::embed::trace::isolines::{Exit, Isolines, Slot, Step, Stop, exactness, nodes_at};
use crate::embed::trace::overlay::{Meeting, Point, overlay};
use crate::layout::{Arc, Embedding, LayoutError, Node, Patch, QuadLayout};
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::param::SeamlessMap;

/// Why a map has no base complex.
#[derive(Debug, Error)]
pub enum CompletionError {
    /// An isoline comes to no node and not to the boundary within the length allowed.
    #[error("an isoline from node {node} does not end")]
    Endless {
        /// The node.
        node: usize,
    },
    /// The map is folded where an isoline runs.
    #[error("an isoline from node {node} runs into a fold")]
    Fold {
        /// The node.
        node: usize,
    },
    /// The isolines bound something that has not four sides.
    #[error("beside arc {arc} lies no patch of four sides")]
    Sides {
        /// The arc.
        arc: usize,
    },
    /// The isolines do not fit on the surface.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// The structure is no layout.
    #[error(transparent)]
    Layout(#[from] LayoutError),
}

/// A layout with the embedding it was read off.
#[derive(Debug, Clone)]
pub struct CompletedLayout {
    /// The layout; the nodes given come first.
    pub layout: QuadLayout,
    /// Its embedding.
    pub traced: TracedLayout,
}

/// The base complex of `map` with `nodes` for nodes, which must hold all its singular vertices and all corners of
/// the boundary; isolines are followed for a length of `limit` in the map.
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
    let (lines, exact) = separatrices(mesh, map, nodes, limit)?;
    let welded = overlay(mesh, &exact, &lines, Meeting::Vertex)?;
    let mut refined = welded.refined;
    let mut nodes: Vec<u32> = nodes.iter().map(|v| v.0).collect();
    let is_node = find_nodes(&mut nodes, &welded.paths, welded.mesh.n_vertices());
    let mut arcs = split(&welded.paths, &is_node);
    arcs.extend(boundary_arcs(&welded.mesh, &is_node));
    for (arc, path) in (0u32..).zip(&arcs) {
        for w in path.windows(2) {
            let h = refined.find(w[0], w[1]).ok_or(CompletionError::Sides { arc: arc as usize })?;
            refined.set_mark(h, Mark::Arc(arc));
        }
    }
    let layout = structure(&refined, &welded.mesh, &nodes, &arcs)?;
    let seeds = seeds(&layout, &welded.mesh, &arcs)?;
    let arc_parameters = arcs.iter().map(|p| parameters(&welded.mesh, &welded.map, p)).collect();
    let embedding = Embedding { mesh: refined, base_face: welded.base_face, nodes, arcs, arc_parameters, seeds };
    Ok(CompletedLayout { layout, traced: TracedLayout { embedding, mesh: welded.mesh, map: welded.map } })
}

/// The isolines of all nodes, each once, and the map in which they are exact.
fn separatrices(
    mesh: &TriMesh,
    map: &SeamlessMap,
    nodes: &[VertexId],
    limit: f64,
) -> Result<(Vec<Vec<Point>>, SeamlessMap), CompletionError> {
    let at = nodes_at(mesh, nodes);
    let lines = Isolines { mesh, map, node: &at, exact: exactness(map), through_folds: false };
    let slots: Vec<Vec<Slot>> = nodes.iter().map(|&v| lines.slots(v)).collect();
    let mut done: Vec<Vec<bool>> = slots.iter().map(|s| s.iter().map(|s| on_boundary(mesh, s)).collect()).collect();
    let mut exact = map.clone();
    let mut found = Vec::new();
    for node in 0..nodes.len() {
        for (i, &slot) in slots[node].iter().enumerate() {
            if done[node][i] {
                continue;
            }
            let mut steps = Vec::new();
            let outcome = lines.march_into(&mut steps, slot, limit);
            let inner = match outcome {
                Ok(_) => {
                    let Some(Step::Vertex(end, _)) = steps.last() else { continue };
                    let to = at[mesh.origin(*end).index()] as usize;
                    let arrival = lines.arrival(&steps, &slots[to]).ok_or(CompletionError::Fold { node })?;
                    done[to][arrival] = true;
                    &steps[1..steps.len() - 1]
                }
                Err(Stop::Boundary(_)) => &steps[1..],
                Err(Stop::Vertex(v)) if mesh.is_boundary_vertex(v) => &steps[1..],
                Err(Stop::Length(_)) => return Err(CompletionError::Endless { node }),
                Err(Stop::Fold(_) | Stop::Vertex(_)) => return Err(CompletionError::Fold { node }),
            };
            straighten(&lines, &mut exact, inner);
            found.push(steps);
        }
    }
    let lines = Isolines { map: &exact, ..lines };
    let found: Vec<Vec<Point>> = found.iter().map(|steps| points(&lines, steps)).collect();
    for (arc, points) in found.iter().enumerate() {
        if let Some(face) = misplaced(mesh, points) {
            return Err(TraceError::Lost { arc, face }.into());
        }
    }
    Ok((found, exact))
}

/// Whether a slot runs along the boundary.
fn on_boundary(mesh: &TriMesh, slot: &Slot) -> bool {
    slot.exit == Exit::Back || slot.exit == Exit::Along && mesh.twin(slot.corner).is_none()
}

/// Adds the vertices where isolines meet or end to `nodes`; returns the node at each vertex, or `u32::MAX`.
fn find_nodes(nodes: &mut Vec<u32>, paths: &[Vec<u32>], n_vertices: usize) -> Vec<u32> {
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

/// The paths cut at nodes.
fn split(paths: &[Vec<u32>], node: &[u32]) -> Vec<Vec<u32>> {
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

/// The stretches of the boundary from node to node.
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

/// The structure of arcs that are marked on a mesh.
fn structure(
    refined: &RefinedMesh,
    mesh: &TriMesh,
    nodes: &[u32],
    paths: &[Vec<u32>],
) -> Result<QuadLayout, CompletionError> {
    let node = {
        let vertices: Vec<VertexId> = nodes.iter().map(|&v| VertexId(v)).collect();
        nodes_at(mesh, &vertices)
    };
    let leaving = |from: u32, to: u32| -> Option<HalfedgeId> {
        mesh.outgoing(VertexId(from)).find(|&h| mesh.target(h) == VertexId(to))
    };
    let arcs: Vec<Arc> = paths
        .iter()
        .map(|p| Arc {
            nodes: [p[0], p[p.len() - 1]].map(|v| node[v as usize]),
            boundary: refined.find(p[0], p[1]).is_some_and(|h| refined.is_boundary(h)),
            chord: 0,
        })
        .collect();
    let mut used = vec![[false; 2]; arcs.len()];
    let mut patches = Vec::new();
    for first in (0..arcs.len()).flat_map(|a| [(a, true), (a, false)]) {
        let ends = |(a, forward): (usize, bool)| {
            let (p, n) = (&paths[a], paths[a].len());
            if forward { ([p[0], p[1]], [p[n - 2], p[n - 1]]) } else { ([p[n - 1], p[n - 2]], [p[1], p[0]]) }
        };
        let outside = || arcs[first.0].boundary && leaving(ends(first).0[0], ends(first).0[1]).is_none();
        if used[first.0][usize::from(first.1)] || outside() {
            continue;
        }
        let error = || CompletionError::Sides { arc: first.0 };
        let mut sides = Vec::new();
        let mut side = first;
        loop {
            used[side.0][usize::from(side.1)] = true;
            sides.push(side);
            let last = ends(side).1;
            // Clockwise around the end through the faces on the left, to the next arc.
            let mut h = next(leaving(last[0], last[1]).ok_or_else(error)?.0);
            while refined.mark(h) == Mark::Free {
                h = next(refined.twin(h).ok_or_else(error)?);
            }
            let Mark::Arc(a) = refined.mark(h) else { return Err(error()) };
            let way = [refined.origin(h), refined.target(h)];
            side = (a as usize, ends((a as usize, true)).0 == way);
            if side == first {
                break;
            }
            if sides.len() == 4 {
                return Err(error());
            }
        }
        let &[a, b, c, d] = sides.as_slice() else { return Err(error()) };
        let sides = [a, b, c, d].map(|(a, forward)| (a as u32, forward));
        let corners = sides.map(|(a, forward)| arcs[a as usize].nodes[usize::from(!forward)]);
        patches.push(Patch { corners, sides });
    }
    let mut nodes: Vec<Node> =
        nodes.iter().map(|&v| Node { valence: 0, boundary: mesh.is_boundary_vertex(VertexId(v)) }).collect();
    for corner in patches.iter().flat_map(|p| p.corners) {
        nodes[corner as usize].valence += 1;
    }
    let mut layout = QuadLayout { nodes, arcs, patches, chords: 0 };
    layout.find_chords();
    layout.check(mesh.euler_characteristic())?;
    Ok(layout)
}

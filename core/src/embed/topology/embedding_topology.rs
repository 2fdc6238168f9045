//! The topology of an embedding: a layout on a mesh up to homotopy, which is all that the parameterisation needs.
//!
//! Nodes are vertices of a triangle mesh, arcs are chains of triangles from node to node. Every region between arcs has
//! a chart in which each arc on its border has a heading (a direction 0 to 3); from one region to the next the chart
//! turns by the difference of the headings of the arc between them. Each triangle takes the chart of one point in it,
//! which gives every edge a period jump.
//!
//! The jumps fix the topology of the field completely (Campen, section 6.3.1): its turning number around a node of
//! valence `k` is `−k/4`, and each arc keeps its direction. The turning numbers along generators and boundaries are
//! sums of these jumps, so that they need not be computed one by one and zipped together.

use std::collections::HashMap;

use crate::dual::{Mark, next};
use crate::embed::EmbeddingError;
use crate::embed::topology::node_insertion::WorkingMesh;
use crate::embed::topology::period_jumps::{DirectionHint, integer_jumps, jump_across, turns_along};
use crate::layout::{Embedding, QuadLayout};
use crate::mesh::{BreadthFirst, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::Metric;

/// A node of the layout as a vertex of the mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct TopologyNode {
    /// The vertex of the mesh.
    pub vertex: VertexId,
    /// Number of patch corners at the node; each is a quarter turn in the map.
    pub valence: usize,
    /// Whether it lies on the boundary.
    pub boundary: bool,
}

impl TopologyNode {
    /// Whether the field is regular at the node.
    pub fn is_regular(&self) -> bool {
        self.index() == 0
    }

    /// Index of the field at the node, in quarter turns; at the boundary relative to the boundary's direction.
    pub fn index(&self) -> i32 {
        (if self.boundary { 2 } else { 4 }) - self.valence as i32
    }
}

/// An arc as a chain of triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct TopologyArc {
    /// The two nodes.
    pub nodes: [u32; 2],
    /// The corner it starts at: a half-edge whose origin is the first node, in the chain's first triangle.
    pub start: HalfedgeId,
    /// The half-edges crossed from the first triangle to the last, each of the triangle that is left.
    pub crossed: Vec<HalfedgeId>,
    /// The corner it ends at: a half-edge whose origin is the second node, in the chain's last triangle.
    pub end: HalfedgeId,
    /// The direction (0 to 3) of the first triangle's cross in which it runs.
    pub heading: u8,
    /// Whether it runs along the boundary.
    pub boundary: bool,
}

/// A layout on a mesh up to homotopy.
#[derive(Debug, Clone)]
pub struct EmbeddingTopology {
    /// The mesh, with a vertex for every node.
    pub mesh: TriMesh,
    /// Triangle of the surface that each triangle lies in.
    pub base_face: Vec<FaceId>,
    /// Period jump of each edge, exact as an integer: as [`crate::field::CrossField::jump`], but not reduced.
    pub jump: Vec<i32>,
    /// Angle of direction 0 of each triangle's cross, from half-edge 0: that of a smooth field along the arcs of the
    /// initial embedding, a first guess.
    pub angle: Vec<f64>,
    /// The nodes, as in the layout.
    pub nodes: Vec<TopologyNode>,
    /// The arcs, as in the layout.
    pub arcs: Vec<TopologyArc>,
    /// For each boundary half-edge the direction (0 to 3) of its triangle's cross that runs along it, and its arc.
    pub boundary: HashMap<HalfedgeId, (u8, u32)>,
}

/// The headings (0 to 3) of an arc on its two sides: that of the forward half-arc in the chart of the region to its
/// left, and that of the backward half-arc in the chart of the region to its left; `None` where there is no region.
pub type ArcHeadings = [Option<u8>; 2];

/// The headings of the arcs of a complete layout: every patch is a chart, in which side `i` has heading `i`.
pub fn arc_headings(layout: &QuadLayout) -> Vec<ArcHeadings> {
    let mut of = vec![[None; 2]; layout.arcs.len()];
    for patch in &layout.patches {
        for (i, &(arc, forward)) in patch.sides.iter().enumerate() {
            of[arc as usize][usize::from(!forward)] = Some(i as u8);
        }
    }
    of
}

impl EmbeddingTopology {
    /// The topology of an initial embedding on the triangles of `surface`, with the headings of each arc.
    ///
    /// # Errors
    ///
    /// [`EmbeddingError::Node`], [`EmbeddingError::Arc`] or [`EmbeddingError::Edge`] where the embedding is not one of
    /// `layout` on `surface`, [`EmbeddingError::Turning`] where the headings do not fit together.
    pub fn new(
        surface: &TriMesh,
        embedding: &Embedding,
        layout: &QuadLayout,
        arc_headings: &[ArcHeadings],
    ) -> Result<Self, EmbeddingError> {
        let working = WorkingMesh::new(surface, embedding)?;
        let charts = Charts::new(&working, arc_headings);
        let arcs = (0..layout.arcs.len())
            .map(|a| charts.arc(&working, layout, a).ok_or(EmbeddingError::Arc { arc: a }))
            .collect::<Result<_, _>>()?;
        let jump = charts.jumps(&working)?;
        let boundary = charts.boundary(&working);
        let hints = charts.directions(&working);
        let nodes: Vec<TopologyNode> = working
            .nodes
            .iter()
            .zip(&layout.nodes)
            .map(|(&vertex, n)| TopologyNode { vertex, valence: n.valence, boundary: n.boundary })
            .collect();
        let WorkingMesh { mesh, base_face, .. } = working;
        let metric = Metric::new(&mesh);
        let (jump, angle) = integer_jumps(&mesh, &metric, &jump, &hints, &node_indices(&mesh, &nodes))?;
        Ok(Self { mesh, base_face, jump, angle, nodes, arcs, boundary })
    }

    /// For each vertex the angle around it in a map, in quarter turns; 0 on the boundary, where it is not prescribed.
    pub(in crate::embed) fn quarters(&self) -> Vec<u32> {
        let mesh = &self.mesh;
        let mut quarters: Vec<u32> = mesh.vertices().map(|v| if mesh.is_boundary_vertex(v) { 0 } else { 4 }).collect();
        for n in self.nodes.iter().filter(|n| !n.boundary) {
            quarters[n.vertex.index()] = n.valence as u32;
        }
        quarters
    }

    /// The period jump from the triangle of `h` to that of its twin.
    #[inline]
    pub fn jump_across(&self, h: HalfedgeId) -> i32 {
        jump_across(&self.mesh, &self.jump, h)
    }

    /// The sum of the period jumps across a chain of half-edges.
    pub(in crate::embed) fn turns_along(&self, crossed: &[HalfedgeId]) -> i32 {
        turns_along(&self.mesh, &self.jump, crossed)
    }
}

/// The index of each vertex in quarter turns: that of its node, or 0 where there is no node inside the surface.
pub(super) fn node_indices(mesh: &TriMesh, nodes: &[TopologyNode]) -> Vec<i32> {
    let mut index = vec![0; mesh.n_vertices()];
    for n in nodes.iter().filter(|n| !n.boundary) {
        index[n.vertex.index()] = n.index();
    }
    index
}

/// How the charts of the regions between arcs are turned against the crosses of the working triangles.
struct Charts {
    /// For each face of the refined mesh the quarter turns `j` such that direction `k` of its region's chart is
    /// direction `k + j` of the working triangle it lies in.
    frame: Vec<i32>,
    arc_headings: Vec<ArcHeadings>,
    /// For each half-edge of the refined mesh on an arc the arc, and whether it is run through forward.
    along: HashMap<u32, (u32, bool)>,
}

impl Charts {
    fn new(working: &WorkingMesh, arc_headings: &[ArcHeadings]) -> Self {
        let refined = &working.refined;
        let mut along = HashMap::new();
        for (a, path) in working.arcs.iter().enumerate() {
            for w in path.windows(2) {
                for (from, to, forward) in [(w[0], w[1], true), (w[1], w[0], false)] {
                    let h = refined.outgoing(from).into_iter().find(|&h| refined.target(h) == to);
                    along.extend(h.map(|h| (h, (a as u32, forward))));
                }
            }
        }
        let mut charts = Self { frame: vec![0; refined.n_faces()], arc_headings: arc_headings.to_vec(), along };
        // The first face of each working triangle gives it its frame; the frames of its other faces follow by a flood.
        let mut search = BreadthFirst::new(refined.n_faces());
        for seed in 0..refined.n_faces() as u32 {
            search.start(seed);
            while let Some(f) = search.visit() {
                for h in 3 * f..3 * f + 3 {
                    let Some(t) = refined.twin(h) else { continue };
                    let g = t / 3;
                    if refined.tag[g as usize] == refined.tag[f as usize] && search.reach(g, ()) {
                        charts.frame[g as usize] = charts.frame[f as usize] + charts.rotation(working, h, t);
                    }
                }
            }
        }
        charts
    }

    /// The heading of a half-edge on an arc in the chart of the region to its left.
    fn heading(&self, h: u32) -> Option<i32> {
        let &(arc, forward) = self.along.get(&h)?;
        self.arc_headings[arc as usize][usize::from(!forward)].map(i32::from)
    }

    /// The jump between the charts of the regions on both sides of a half-edge of the refined mesh, from its own to its
    /// twin's: 0 inside a region.
    fn rotation(&self, working: &WorkingMesh, h: u32, twin: u32) -> i32 {
        if working.refined.mark(h) == Mark::Free {
            return 0;
        }
        match (self.heading(h), self.heading(twin)) {
            (Some(left), Some(right)) => (left - right - 2).rem_euclid(4),
            _ => 0,
        }
    }

    /// The jump of every edge of the working mesh, from 0 to 3.
    fn jumps(&self, working: &WorkingMesh) -> Result<Vec<i32>, EmbeddingError> {
        let (mesh, refined) = (&working.mesh, &working.refined);
        let mut jump = vec![i32::MIN; mesh.n_edges()];
        for h in 0..3 * refined.n_faces() as u32 {
            let Some(crossed) = working.crossing(h) else { continue };
            let edge = mesh.edge(crossed);
            if mesh.halfedge(edge) != crossed || jump[edge.index()] != i32::MIN {
                continue;
            }
            let Some(t) = refined.twin(h) else { continue };
            let frame = |h: u32| self.frame[h as usize / 3];
            jump[edge.index()] = (frame(h) + self.rotation(working, h, t) - frame(t)).rem_euclid(4);
        }
        for e in mesh.edges() {
            if mesh.is_boundary_edge(e) {
                jump[e.index()] = 0;
            } else if jump[e.index()] == i32::MIN {
                return Err(EmbeddingError::Edge { edge: e });
            }
        }
        Ok(jump)
    }

    /// The chain of an arc: the triangles to the left of its path, or to its right where there is no region on the
    /// left.
    fn arc(&self, working: &WorkingMesh, layout: &QuadLayout, a: usize) -> Option<TopologyArc> {
        let arc = &layout.arcs[a];
        let mut path = working.arcs[a].clone();
        let backward = self.arc_headings[a][0].is_none();
        if backward {
            path.reverse();
        }
        let refined = &working.refined;
        let step = |w: &[u32]| refined.outgoing(w[0]).into_iter().find(|&h| refined.target(h) == w[1]);
        let halfedges: Vec<u32> = path.windows(2).map(step).collect::<Option<_>>()?;
        let mut crossed = Vec::new();
        for pair in halfedges.windows(2) {
            let mut n = next(pair[0]);
            while n != pair[1] {
                crossed.extend(working.crossing(n));
                n = next(refined.twin(n)?);
            }
        }
        let corner = |h: u32, node: u32| working.corner(h / 3, working.nodes[node as usize]);
        let heading = |h: u32| Some((self.heading(h)? + self.frame[h as usize / 3]).rem_euclid(4) as u8);
        let (head, tail) = (halfedges[0], halfedges[halfedges.len() - 1]);
        let (boundary, nodes) = (arc.boundary, arc.nodes);
        Some(if backward {
            let crossed = crossed.iter().rev().map(|&h| working.mesh.twin(h)).collect::<Option<_>>()?;
            let (start, end) = (corner(tail, nodes[0])?, corner(head, nodes[1])?);
            TopologyArc { nodes, start, crossed, end, heading: (heading(tail)? + 2) % 4, boundary }
        } else {
            let (start, end) = (corner(head, nodes[0])?, corner(tail, nodes[1])?);
            TopologyArc { nodes, start, crossed, end, heading: heading(head)?, boundary }
        })
    }

    /// See [`EmbeddingTopology::boundary`].
    fn boundary(&self, working: &WorkingMesh) -> HashMap<HalfedgeId, (u8, u32)> {
        let (mesh, refined) = (&working.mesh, &working.refined);
        let mut out = HashMap::new();
        for h in mesh.halfedges().filter(|&h| mesh.twin(h).is_none()) {
            // The boundary half-edge of the refined mesh that leaves the same vertex.
            let g = refined.outgoing(working.refined_vertex[mesh.origin(h).index()])[0];
            if let (Some(k), Some(&(arc, _))) = (self.heading(g), self.along.get(&g)) {
                out.insert(h, ((k + self.frame[g as usize / 3]).rem_euclid(4) as u8, arc));
            }
        }
        out
    }

    /// The directions of the arcs in the working triangles they pass through, one hint for each edge of the refined
    /// mesh.
    fn directions(&self, working: &WorkingMesh) -> Vec<DirectionHint> {
        let refined = &working.refined;
        let mut halfedges: Vec<u32> = self.along.keys().copied().collect();
        halfedges.sort_unstable();
        let position = |v: u32| refined.positions[v as usize];
        halfedges
            .into_iter()
            .filter_map(|h| {
                let k = self.heading(h)? + self.frame[h as usize / 3];
                let vector = position(refined.target(h)) - position(refined.origin(h));
                Some(DirectionHint { face: FaceId(refined.tag[h as usize / 3]), vector, direction: k })
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::embed::topology::testing::{indices, regular_topology, sample_topology};
    use crate::layout::{Arc, Node, Patch};

    #[test]
    fn the_index_of_a_node_counts_missing_quarters() {
        let node = |valence, boundary| TopologyNode { vertex: VertexId(0), valence, boundary };
        assert_eq!([node(3, false), node(4, false), node(6, false)].map(|n| n.index()), [1, 0, -2]);
        assert_eq!([node(1, true), node(2, true), node(3, true)].map(|n| n.index()), [1, 0, -1]);
        assert!(node(2, true).is_regular() && !node(2, false).is_regular());
    }

    #[test]
    fn arcs_on_the_boundary_have_one_heading() {
        let nodes = vec![Node { valence: 1, boundary: true }; 4];
        let arc = |a, b| Arc { nodes: [a, b], boundary: true, chord: 0 };
        let arcs = vec![arc(0, 1), arc(1, 2), arc(3, 2), arc(3, 0)];
        let patches = vec![Patch { corners: [0, 1, 2, 3], sides: [(0, true), (1, true), (2, false), (3, true)] }];
        let layout = QuadLayout { nodes, arcs, patches, chords: 2 };
        let expected = [[Some(0), None], [Some(1), None], [None, Some(2)], [Some(3), None]];
        assert_eq!(arc_headings(&layout), expected);
    }

    #[test]
    fn jumps_back_are_inverse() {
        let topology = sample_topology();
        let (mesh, jump) = (&topology.mesh, &topology.jump);
        for h in mesh.halfedges() {
            let twin = mesh.twin(h).unwrap();
            assert_eq!(jump_across(mesh, jump, h), -jump_across(mesh, jump, twin));
            assert_eq!(topology.turns_along(&[h, twin, h]), topology.jump_across(h));
        }
    }

    #[test]
    fn a_regular_layout_has_a_field_without_singularities() {
        let (layout, topology) = regular_topology();
        assert!(topology.nodes.iter().all(TopologyNode::is_regular));
        assert_eq!(topology.nodes.len(), layout.nodes.len());
        assert!(indices(&topology.mesh, &topology.jump).iter().all(|&i| i == 0));
        assert!(topology.quarters().iter().all(|&q| q == 4));
    }

    #[test]
    fn the_angle_in_a_map_is_the_valence_of_the_node() {
        let topology = sample_topology();
        let quarters = topology.quarters();
        for n in &topology.nodes {
            assert_eq!(quarters[n.vertex.index()], n.valence as u32);
        }
        assert_eq!(quarters.iter().filter(|&&q| q != 4).count(), 2);
    }
}

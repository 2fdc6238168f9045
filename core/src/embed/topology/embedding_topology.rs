//! A layout on a mesh up to homotopy: what a parameterization has to know of it.
//!
//! Nodes are vertices of a triangle mesh, arcs are chains of triangles from node to node, and the directions of a
//! cross field are tied to the layout: in every region between arcs there is a chart in which each arc of its border
//! has a heading, and crossing an arc leads from one chart to the next by the difference of headings. Each triangle
//! takes the chart of one point in it; that makes a period jump, in quarter turns, of every edge.
//!
//! This fixes the topology of the field completely (Campen, section 6.3.1): around a node of valence `k` it turns by
//! `−k` quarters against the node's arcs, along arcs it continues. Turning numbers along generators and boundaries
//! need not be computed one by one and zipped together: they are sums of these jumps.

use std::collections::{HashMap, VecDeque};

use crate::dual::{Mark, next};
use crate::embed::EmbeddingError;
use crate::embed::topology::node_insertion::Working;
use crate::embed::topology::period_jumps;
use crate::layout::{Embedding, QuadLayout};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::Metric;

/// A node of the layout on the mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct TopologyNode {
    /// Its vertex.
    pub vertex: VertexId,
    /// Number of quarters (patch corners) around it.
    pub valence: usize,
    /// Whether it lies on the boundary.
    pub boundary: bool,
}

impl TopologyNode {
    /// Whether the field is regular there.
    pub fn is_regular(&self) -> bool {
        self.index() == 0
    }

    /// Index of the field there, in quarters; at the boundary against the boundary's direction.
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
    /// The half-edges crossed, each of the triangle that is left.
    pub crossed: Vec<HalfedgeId>,
    /// The corner it ends at, in the last triangle.
    pub end: HalfedgeId,
    /// The direction (0 to 3) of the first triangle's cross along which it runs.
    pub heading: u8,
    /// Whether it runs along the boundary.
    pub boundary: bool,
}

/// A layout on a mesh, up to homotopy.
#[derive(Debug, Clone)]
pub struct EmbeddingTopology {
    /// The mesh, with a vertex for every node.
    pub mesh: TriMesh,
    /// Triangle of the surface that each triangle lies in.
    pub base_face: Vec<FaceId>,
    /// Period jump of each edge, exact as an integer: as [`crate::field::CrossField::jump`], but not reduced.
    pub jump: Vec<i32>,
    /// Direction 0 of each triangle's cross in the rough drawing, from half-edge 0: a guess only.
    pub angle: Vec<f64>,
    /// The nodes, as in the layout.
    pub nodes: Vec<TopologyNode>,
    /// The arcs, as in the layout.
    pub arcs: Vec<TopologyArc>,
    /// For each boundary half-edge the direction of its triangle's cross that runs along it, and its arc.
    pub boundary: HashMap<HalfedgeId, (u8, u32)>,
}

/// The headings of an arc's two sides: in the region to its left when it is run through forward, and in the one to
/// its left backward.
pub type ArcHeadings = [Option<u8>; 2];

/// The headings of the arcs of a complete layout: every patch is its own chart, its side `i` heading along `i`.
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
    /// Transfers a drawn layout to the triangles of `surface`.
    ///
    /// # Errors
    ///
    /// See [`EmbeddingError`].
    pub fn new(
        surface: &TriMesh,
        embedding: &Embedding,
        layout: &QuadLayout,
        arc_headings: &[ArcHeadings],
    ) -> Result<Self, EmbeddingError> {
        let working = Working::new(surface, embedding)?;
        let charts = Charts::new(&working, arc_headings);
        let arcs = (0..layout.arcs.len())
            .map(|a| charts.arc(&working, layout, a).ok_or(EmbeddingError::Arc { arc: a }))
            .collect::<Result<_, _>>()?;
        let jump = charts.jumps(&working)?;
        let boundary = charts.boundary(&working);
        let guides = charts.directions(&working);
        let nodes: Vec<TopologyNode> = working
            .nodes
            .iter()
            .zip(&layout.nodes)
            .map(|(&vertex, n)| TopologyNode { vertex, valence: n.valence, boundary: n.boundary })
            .collect();
        let Working { mesh, base_face, .. } = working;
        let metric = Metric::new(&mesh);
        let mut index = vec![0; mesh.n_vertices()];
        for n in nodes.iter().filter(|n| !n.boundary) {
            index[n.vertex.index()] = n.index();
        }
        let (jump, angle) = period_jumps::lift(&mesh, &metric, &jump, &guides, &index)?;
        Ok(Self { mesh, base_face, jump, angle, nodes, arcs, boundary })
    }

    /// For each vertex the angle around it in a map, in quarter turns; 0 on the boundary, where it is open.
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
}

/// The jump across `h`, from its triangle to that of its twin.
#[inline]
pub(in crate::embed) fn jump_across(mesh: &TriMesh, jump: &[i32], h: HalfedgeId) -> i32 {
    let e = mesh.edge(h);
    if mesh.halfedge(e) == h { jump[e.index()] } else { -jump[e.index()] }
}

/// How the faces of the drawing see the crosses of the working triangles.
struct Charts {
    /// For each face of the drawing the quarters `j` such that its direction `k` is direction `k + j` of the working
    /// triangle it lies in.
    frame: Vec<i32>,
    /// Headings of the arcs' sides.
    arc_headings: Vec<ArcHeadings>,
    /// Arc and sense of each marked half-edge of the drawing.
    along: HashMap<u32, (u32, bool)>,
}

impl Charts {
    fn new(working: &Working, arc_headings: &[ArcHeadings]) -> Self {
        let drawing = &working.drawing;
        let mut along = HashMap::new();
        for (a, path) in working.arcs.iter().enumerate() {
            for w in path.windows(2) {
                for (from, to, forward) in [(w[0], w[1], true), (w[1], w[0], false)] {
                    let h = drawing.outgoing(from).into_iter().find(|&h| drawing.target(h) == to);
                    along.extend(h.map(|h| (h, (a as u32, forward))));
                }
            }
        }
        let mut charts = Self { frame: vec![i32::MIN; drawing.n_faces()], arc_headings: arc_headings.to_vec(), along };
        // One face of each working triangle speaks for it; the frames of the others follow from it.
        for seed in 0..drawing.n_faces() as u32 {
            if charts.frame[seed as usize] != i32::MIN {
                continue;
            }
            charts.frame[seed as usize] = 0;
            let mut queue = VecDeque::from([seed]);
            while let Some(f) = queue.pop_front() {
                for h in 3 * f..3 * f + 3 {
                    let Some(t) = drawing.twin(h) else { continue };
                    let g = t / 3;
                    if drawing.tag[g as usize] == drawing.tag[f as usize] && charts.frame[g as usize] == i32::MIN {
                        charts.frame[g as usize] = charts.frame[f as usize] + charts.rotation(working, h, t);
                        queue.push_back(g);
                    }
                }
            }
        }
        charts
    }

    /// The heading of a marked half-edge in the region to its left.
    fn heading(&self, h: u32) -> Option<i32> {
        let &(arc, forward) = self.along.get(&h)?;
        self.arc_headings[arc as usize][usize::from(!forward)].map(i32::from)
    }

    /// The jump between the region charts on both sides of a half-edge of the drawing, from its own to its twin's.
    fn rotation(&self, working: &Working, h: u32, twin: u32) -> i32 {
        if working.drawing.mark(h) == Mark::Free {
            return 0;
        }
        match (self.heading(h), self.heading(twin)) {
            (Some(left), Some(right)) => (left - right - 2).rem_euclid(4),
            _ => 0,
        }
    }

    /// The jump of every working edge, from 0 to 3.
    fn jumps(&self, working: &Working) -> Result<Vec<i32>, EmbeddingError> {
        let (mesh, drawing) = (&working.mesh, &working.drawing);
        let mut jump = vec![i32::MIN; mesh.n_edges()];
        for h in 0..3 * drawing.n_faces() as u32 {
            let Some(crossed) = working.crossing(h) else { continue };
            let edge = mesh.edge(crossed);
            if mesh.halfedge(edge) != crossed || jump[edge.index()] != i32::MIN {
                continue;
            }
            let Some(t) = drawing.twin(h) else { continue };
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

    /// The chain of an arc, to the left of its path where that lies on the surface, else to its right.
    fn arc(&self, working: &Working, layout: &QuadLayout, a: usize) -> Option<TopologyArc> {
        let arc = &layout.arcs[a];
        let mut path = working.arcs[a].clone();
        let backward = self.arc_headings[a][0].is_none();
        if backward {
            path.reverse();
        }
        let drawing = &working.drawing;
        let step = |w: &[u32]| drawing.outgoing(w[0]).into_iter().find(|&h| drawing.target(h) == w[1]);
        let halfedges: Vec<u32> = path.windows(2).map(step).collect::<Option<_>>()?;
        let mut crossed = Vec::new();
        for pair in halfedges.windows(2) {
            let mut n = next(pair[0]);
            while n != pair[1] {
                crossed.extend(working.crossing(n));
                n = next(drawing.twin(n)?);
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

    fn boundary(&self, working: &Working) -> HashMap<HalfedgeId, (u8, u32)> {
        let (mesh, drawing) = (&working.mesh, &working.drawing);
        let mut out = HashMap::new();
        for h in mesh.halfedges().filter(|&h| mesh.twin(h).is_none()) {
            // The drawing's boundary half-edge that leaves the same vertex.
            let g = drawing.outgoing(working.drawn[mesh.origin(h).index()])[0];
            if let (Some(k), Some(&(arc, _))) = (self.heading(g), self.along.get(&g)) {
                out.insert(h, ((k + self.frame[g as usize / 3]).rem_euclid(4) as u8, arc));
            }
        }
        out
    }

    /// Direction 0 of each working triangle that arcs pass through, in space, by the arcs' own directions and lengths:
    /// pairs of a vector along an arc and the direction index it stands for.
    fn directions(&self, working: &Working) -> Vec<(FaceId, glam::DVec3, i32)> {
        let drawing = &working.drawing;
        let mut halfedges: Vec<u32> = self.along.keys().copied().collect();
        halfedges.sort_unstable();
        let position = |v: u32| drawing.positions[v as usize];
        halfedges
            .into_iter()
            .filter_map(|h| {
                let k = self.heading(h)? + self.frame[h as usize / 3];
                let along = position(drawing.target(h)) - position(drawing.origin(h));
                Some((FaceId(drawing.tag[h as usize / 3]), along, k))
            })
            .collect()
    }
}

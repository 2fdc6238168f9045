//! Partial embeddings: the regions between embedded arcs, and the headings of arcs in them.
//!
//! In a chart of a region every arc has one of four headings. Around the region, with the region to the left, the
//! heading changes at nodes only: a corner that spans `m` quarter sectors turns by `2 − m` quarter turns. The turns
//! around a disc without singularity sum to four (Campen, section 6.3.1: turning numbers). Valences and slots therefore
//! determine the headings of all arcs, however many arcs are missing, provided that every region is a disc. In a
//! complete layout every region has four corners of one sector: it is a patch.

use std::collections::HashMap;

use super::error::PartialEmbeddingError;
use super::format::{ArcEnd, LayoutFile};
use super::insertion::InsertedLayout;
use crate::dual::{Mark, RefinedMesh, next};
use crate::layout::embedding::{Embedding, path_lengths};
use crate::layout::structure::{Arc, LayoutError, Node, Patch, QuadLayout};
use crate::mesh::{FaceId, components};

/// A corner of a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PartialCorner {
    /// The node.
    pub node: u32,
    /// Index in the border of the half-edge that leaves the node.
    pub at: usize,
    /// Number of quarter sectors of the node that the corner spans.
    pub sectors: u32,
}

impl PartialCorner {
    /// The turn of the border to the left, in quarter turns.
    pub fn turn(&self) -> i64 {
        2 - i64::from(self.sectors)
    }
}

/// A region between arcs; an open disc.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartialRegion {
    /// The half-edges around it in order, with the region to the left. An arc with the region on both sides occurs in
    /// both directions.
    pub border: Vec<u32>,
    /// Its corners in the order of the border.
    pub corners: Vec<PartialCorner>,
}

/// A layout, complete or partial, embedded on a refinement of the surface.
#[derive(Debug, Clone)]
pub struct PartialEmbedding {
    /// The refined surface; the edges of arcs are marked [`Mark::Arc`].
    pub mesh: RefinedMesh,
    /// Triangle of the original mesh that each face lies in.
    pub base_face: Vec<u32>,
    /// Vertex of each node.
    pub nodes: Vec<u32>,
    /// Valence of each node, and whether it lies on the boundary.
    pub layout_nodes: Vec<Node>,
    /// Vertices of each arc, from its first end to its second. Arcs of the file come first, boundary arcs that it omits
    /// last.
    pub arcs: Vec<Vec<u32>>,
    /// Nodes and slots at the ends of each arc.
    pub ends: Vec<[ArcEnd; 2]>,
    /// Heading, 0 to 3, of each half-edge on an arc or on the boundary, in the chart of the region to its left. The
    /// first half-edge of each region's border has heading 0.
    pub headings: Vec<Option<u8>>,
    /// Region of each face.
    pub region: Vec<u32>,
    /// All regions, in the order of their first faces.
    pub regions: Vec<PartialRegion>,
}

impl PartialEmbedding {
    /// Determines the regions and headings of an inserted layout.
    pub(super) fn new(file: &LayoutFile, inserted: InsertedLayout) -> Result<Self, PartialEmbeddingError> {
        let InsertedLayout { mesh, nodes, arcs, ends } = inserted;
        let layout_nodes = nodes.iter().zip(&file.nodes).map(|(&v, n)| {
            let boundary = mesh.is_boundary(mesh.outgoing(v)[0]);
            Node { valence: n.valence as usize, boundary }
        });
        let mut this = Self {
            base_face: (0..mesh.n_faces() as u32).map(|f| mesh.base_face(f)).collect(),
            layout_nodes: layout_nodes.collect(),
            ends,
            headings: vec![None; 3 * mesh.n_faces()],
            region: Vec::new(),
            regions: Vec::new(),
            mesh,
            nodes,
            arcs,
        };
        this.check_boundary()?;
        let slots = this.slots()?;
        this.find_regions(&slots)?;
        Ok(this)
    }

    /// Whether arc `a` has the slots of a boundary arc.
    fn is_boundary_arc(&self, a: usize) -> bool {
        let [p, q] = self.ends[a];
        let kind = |end: ArcEnd| &self.layout_nodes[end.node as usize];
        let last = |end: ArcEnd| end.slot as usize == kind(end).valence;
        kind(p).boundary && kind(q).boundary && ((p.slot == 0 && last(q)) || (q.slot == 0 && last(p)))
    }

    /// Whether a half-edge lies on the border of its region.
    fn is_border(&self, h: u32) -> bool {
        self.mesh.mark(h) != Mark::Free || self.mesh.is_boundary(h)
    }

    /// Checks that boundary arcs run along the boundary and that others do not touch it.
    fn check_boundary(&self) -> Result<(), PartialEmbeddingError> {
        for (a, path) in self.arcs.iter().enumerate() {
            let arc = a as u32;
            let on_boundary = |w: &[u32]| {
                let h = self.mesh.find(w[0], w[1]);
                h.is_some_and(|h| self.mesh.is_boundary(h) || self.mesh.twin(h).is_none())
            };
            if self.is_boundary_arc(a) {
                if !path.windows(2).all(on_boundary) {
                    return Err(PartialEmbeddingError::OffBoundary { arc });
                }
            } else {
                let touches = |&v: &u32| self.mesh.is_boundary(self.mesh.outgoing(v)[0]);
                if path[1..path.len() - 1].iter().any(touches) || path.windows(2).any(on_boundary) {
                    return Err(PartialEmbeddingError::OnBoundary { arc });
                }
            }
        }
        Ok(())
    }

    /// The slot of each edge that leaves a node along an arc, by the edge's two vertices; at boundary nodes also of the
    /// boundary edges.
    fn slots(&self) -> Result<HashMap<(u32, u32), u32>, PartialEmbeddingError> {
        let mut of_edge = HashMap::new();
        for (a, (path, ends)) in self.arcs.iter().zip(&self.ends).enumerate() {
            of_edge.insert((path[0], path[1]), (ends[0].slot, a as u32));
            of_edge.insert((path[path.len() - 1], path[path.len() - 2]), (ends[1].slot, a as u32));
        }
        let mut slots: HashMap<(u32, u32), u32> = of_edge.iter().map(|(&edge, &(slot, _))| (edge, slot)).collect();
        for (node, (&v, kind)) in self.nodes.iter().zip(&self.layout_nodes).enumerate() {
            let neighbours = self.mesh.neighbours(v);
            let found: Vec<(usize, u32, u32)> = neighbours
                .iter()
                .enumerate()
                .filter_map(|(i, &w)| of_edge.get(&(v, w)).map(|&(slot, arc)| (i, slot, arc)))
                .collect();
            let valence = kind.valence as u32;
            let in_order = if kind.boundary {
                let last = neighbours.len() - 1;
                slots.insert((v, neighbours[0]), 0);
                slots.insert((v, neighbours[last]), valence);
                // The outer slots are those of the boundary edges only.
                found.iter().all(|&(i, slot, _)| (i == 0) == (slot == 0) && (i == last) == (slot == valence))
                    && found.windows(2).all(|w| w[0].1 < w[1].1)
            } else if found.is_empty() {
                return Err(PartialEmbeddingError::Isolated { node: node as u32 });
            } else {
                let descents = (0..found.len()).filter(|&i| found[(i + 1) % found.len()].1 <= found[i].1).count();
                descents == 1
            };
            if !in_order {
                let arcs = found.iter().map(|f| f.2).collect();
                return Err(PartialEmbeddingError::SlotOrder { node: node as u32, arcs });
            }
        }
        Ok(slots)
    }

    /// Finds the regions, checks that they are discs with the right turning, and sets the headings.
    fn find_regions(&mut self, slots: &HashMap<(u32, u32), u32>) -> Result<(), PartialEmbeddingError> {
        let count = self.number_regions();
        let euler = self.euler(count);
        let mut starts = vec![None; count];
        for h in (0..3 * self.mesh.n_faces() as u32).rev().filter(|&h| self.is_border(h)) {
            starts[self.region[h as usize / 3] as usize] = Some(h);
        }
        let node_at: HashMap<u32, u32> = self.nodes.iter().enumerate().map(|(n, &v)| (v, n as u32)).collect();
        for (r, (euler, start)) in euler.into_iter().zip(starts).enumerate() {
            let start = start.filter(|_| euler == 1).ok_or_else(|| {
                let (face, arcs) = self.bounds(r as u32);
                PartialEmbeddingError::NotADisc { region: r as u32, face, arcs }
            })?;
            let region = self.walk(start, slots, &node_at);
            let quarters: i64 = region.corners.iter().map(PartialCorner::turn).sum();
            if quarters != 4 {
                let (face, arcs) = self.bounds(r as u32);
                return Err(PartialEmbeddingError::Turning { region: r as u32, face, arcs, quarters });
            }
            self.set_headings(&region);
            self.regions.push(region);
        }
        Ok(())
    }

    /// Numbers the regions; returns their number.
    fn number_regions(&mut self) -> usize {
        let beyond =
            |f: u32| (3 * f..3 * f + 3).filter(|&h| !self.is_border(h)).filter_map(|h| Some(self.mesh.twin(h)? / 3));
        let (region, count) = components(self.mesh.n_faces(), beyond);
        self.region = region;
        count
    }

    /// The Euler characteristic of each region without its border; 1 for a disc only.
    fn euler(&self, count: usize) -> Vec<i64> {
        let mut euler = vec![0; count];
        let mut inner = vec![true; self.mesh.n_vertices()];
        let mut some_face = vec![0; self.mesh.n_vertices()];
        for f in 0..self.mesh.n_faces() as u32 {
            let region = &mut euler[self.region[f as usize] as usize];
            *region += 1;
            for h in 3 * f..3 * f + 3 {
                let (from, to) = (self.mesh.origin(h) as usize, self.mesh.target(h) as usize);
                some_face[from] = f;
                if self.is_border(h) {
                    (inner[from], inner[to]) = (false, false);
                } else if self.mesh.twin(h).is_some_and(|t| h < t) {
                    *region -= 1;
                }
            }
        }
        for (_, f) in some_face.into_iter().enumerate().filter(|&(v, _)| inner[v]) {
            euler[self.region[f as usize] as usize] += 1;
        }
        euler
    }

    /// A triangle of the original mesh in region `r`, and the arcs on its border.
    fn bounds(&self, r: u32) -> (FaceId, Vec<u32>) {
        let faces = (0..self.mesh.n_faces() as u32).filter(|&f| self.region[f as usize] == r);
        let mut arcs: Vec<u32> = faces
            .clone()
            .flat_map(|f| 3 * f..3 * f + 3)
            .filter_map(|h| match self.mesh.mark(h) {
                Mark::Arc(a) => Some(a),
                _ => None,
            })
            .collect();
        arcs.sort_unstable();
        arcs.dedup();
        (FaceId(faces.map(|f| self.base_face[f as usize]).next().unwrap_or(0)), arcs)
    }

    /// The border and the corners of a disc, from half-edge `start` on.
    fn walk(&self, start: u32, slots: &HashMap<(u32, u32), u32>, node_at: &HashMap<u32, u32>) -> PartialRegion {
        let mut region = PartialRegion { border: vec![start], corners: Vec::new() };
        loop {
            let arriving = region.border[region.border.len() - 1];
            let mut leaving = next(arriving);
            while let Some(t) = self.mesh.twin(leaving).filter(|_| !self.is_border(leaving)) {
                leaving = next(t);
            }
            let v = self.mesh.origin(leaving);
            let at = if leaving == start { 0 } else { region.border.len() };
            if let Some(&node) = node_at.get(&v) {
                let kind = &self.layout_nodes[node as usize];
                let slot = |w: u32| slots.get(&(v, w)).copied().map_or(0, i64::from);
                // Counter-clockwise from the leaving to the arriving edge.
                let span = slot(self.mesh.origin(arriving)) - slot(self.mesh.target(leaving));
                let valence = kind.valence as i64;
                let sectors = if kind.boundary || span > 0 { span } else { span + valence };
                region.corners.push(PartialCorner { node, at, sectors: sectors as u32 });
            }
            if leaving == start {
                break;
            }
            region.border.push(leaving);
        }
        region.corners.sort_by_key(|c| c.at);
        region
    }

    /// Sets the headings along the border of a region.
    fn set_headings(&mut self, region: &PartialRegion) {
        let mut heading = 0;
        let mut corners = region.corners.iter().skip_while(|c| c.at == 0).peekable();
        for (i, &h) in region.border.iter().enumerate() {
            if let Some(corner) = corners.next_if(|c| c.at == i) {
                heading += corner.turn();
            }
            self.headings[h as usize] = Some(heading.rem_euclid(4) as u8);
        }
    }

    /// Whether the layout is complete.
    pub fn is_complete(&self) -> bool {
        self.regions.iter().flat_map(|r| &r.corners).all(|c| c.sectors == 1)
    }

    /// The layout and its embedding; region `p` is patch `p`. A partial layout has no patches, every arc is a chord of
    /// its own, and the embedding has a seed per region.
    ///
    /// # Errors
    ///
    /// [`LayoutError`] if the layout is invalid. This is a defect of this module.
    pub fn to_embedding(&self) -> Result<(QuadLayout, Embedding), LayoutError> {
        let arc =
            |a: usize| Arc { nodes: self.ends[a].map(|e| e.node), boundary: self.is_boundary_arc(a), chord: a as u32 };
        let (nodes, arcs) = (self.layout_nodes.clone(), (0..self.arcs.len()).map(arc).collect());
        let layout = if self.is_complete() {
            QuadLayout::new(nodes, arcs, self.patches()?, self.surface_euler())?
        } else {
            QuadLayout { nodes, arcs, patches: Vec::new(), chords: self.arcs.len() }
        };
        Ok((layout, self.embedding()))
    }

    /// The heading of each arc in the region to its left, traversed forward and backward.
    pub fn arc_headings(&self) -> Vec<[Option<u8>; 2]> {
        let heading = |from: u32, to: u32| {
            let h = self.mesh.outgoing(from).into_iter().find(|&h| self.mesh.target(h) == to)?;
            self.headings[h as usize]
        };
        self.arcs.iter().map(|path| [heading(path[0], path[1]), heading(path[1], path[0])]).collect()
    }

    /// The regions of a complete layout as patches.
    fn patches(&self) -> Result<Vec<Patch>, LayoutError> {
        let patch = |(patch, region): (usize, &PartialRegion)| {
            let invalid = LayoutError::Patch { patch };
            let corners = <[PartialCorner; 4]>::try_from(region.corners.clone()).map_err(|_| invalid.clone())?;
            let side = |c: PartialCorner| self.side(region.border[c.at]).ok_or(invalid.clone());
            let [a, b, c, d] = corners.map(side);
            Ok(Patch { corners: corners.map(|c| c.node), sides: [a?, b?, c?, d?] })
        };
        self.regions.iter().enumerate().map(patch).collect()
    }

    /// The arc along a half-edge that leaves a node, and whether the half-edge runs in the direction of the arc.
    fn side(&self, h: u32) -> Option<(u32, bool)> {
        let Mark::Arc(a) = self.mesh.mark(h) else { return None };
        let path = &self.arcs[a as usize];
        Some((a, (path[0], path[1]) == (self.mesh.origin(h), self.mesh.target(h))))
    }

    fn surface_euler(&self) -> i64 {
        let halfedges = 0..3 * self.mesh.n_faces() as u32;
        let edges = halfedges.filter(|&h| self.mesh.twin(h).is_none_or(|t| h < t)).count();
        self.mesh.n_vertices() as i64 - edges as i64 + self.mesh.n_faces() as i64
    }

    fn embedding(&self) -> Embedding {
        Embedding {
            mesh: self.mesh.clone(),
            base_face: self.base_face.clone(),
            nodes: self.nodes.clone(),
            arcs: self.arcs.clone(),
            arc_parameters: self.arcs.iter().map(|path| path_lengths(&self.mesh.positions, path)).collect(),
            seeds: self.regions.iter().map(|r| r.border[0] / 3).collect(),
        }
    }
}

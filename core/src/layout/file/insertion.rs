//! Insertion of the nodes and arcs of a layout file into the mesh, as vertices and edge paths.
//!
//! First all nodes inside triangles become vertices, then all points on mesh edges, in their order along each edge.
//! Every step of an arc then lies in one triangle of the mesh, between two vertices, and is inserted there without
//! crossing earlier paths. Steps at nodes inside a triangle are inserted first. Once these nodes are connected to the
//! border of the triangle, the path of each step between border points is unique up to homotopy, so that rounding
//! errors cannot put a node on the wrong side of an arc.

use std::collections::{BTreeMap, HashMap, HashSet};

use glam::{DVec2, DVec3};

use super::error::{LayoutElement, PartialEmbeddingError};
use super::format::{ArcEnd, LayoutFile};
use super::places::{ArcPoint, Place, along_boundary, arc_points, check_slots, node_place};
use crate::dual::{Mark, RefinedMesh};
use crate::mesh::{EdgeId, FaceId, TriMesh};

/// Distance of a node from a side of a piece of a triangle, in barycentric coordinates, below which the node splits the
/// side instead of the piece.
const ON_SIDE: f64 = 1e-9;

/// A layout inserted into a refinement of the mesh.
pub(super) struct InsertedLayout {
    pub mesh: RefinedMesh,
    /// Vertex of each node.
    pub nodes: Vec<u32>,
    /// Vertices of each arc; boundary arcs that the file omits are last.
    pub arcs: Vec<Vec<u32>>,
    /// Nodes and slots at the ends of each arc.
    pub ends: Vec<[ArcEnd; 2]>,
}

/// The part of an arc between two consecutive points.
struct Step {
    arc: u32,
    index: usize,
    /// The triangle that contains it; `None` along a mesh edge.
    face: Option<FaceId>,
    /// Whether an end is a node inside the triangle.
    at_inner_node: bool,
}

/// Inserts the nodes and arcs of `file` into a refinement of `base`.
pub(super) fn insert(file: &LayoutFile, base: &TriMesh) -> Result<InsertedLayout, PartialEmbeddingError> {
    let places: Vec<Place> =
        file.nodes.iter().enumerate().map(|(n, node)| node_place(base, n as u32, node)).collect::<Result<_, _>>()?;
    check_slots(file, base, &places)?;
    let mut arcs = Vec::with_capacity(file.arcs.len());
    for a in 0..file.arcs.len() {
        arcs.push(arc_points(file, base, &places, a)?);
    }
    let mut insertion =
        Insertion { base, mesh: RefinedMesh::new(base), owner: HashMap::new(), on_edge: BTreeMap::new() };
    let nodes = insertion.insert_points(file, &places, &mut arcs)?;
    let mut paths = insertion.insert_arcs(file, &places, &nodes, &arcs)?;
    let mut ends = file.arcs.iter().map(|a| a.ends).collect();
    insertion.complete_boundary(file, &nodes, &mut paths, &mut ends)?;
    Ok(InsertedLayout { mesh: insertion.mesh, nodes, arcs: paths, ends })
}

/// The refinement of a mesh into which a layout is inserted.
struct Insertion<'a> {
    base: &'a TriMesh,
    mesh: RefinedMesh,
    /// The node or arc at a vertex.
    owner: HashMap<u32, LayoutElement>,
    /// The nodes and arcs at the points on each edge, in order.
    on_edge: BTreeMap<EdgeId, Vec<LayoutElement>>,
}

impl Insertion<'_> {
    /// Inserts vertices for all nodes and path points; returns those of the nodes.
    fn insert_points(
        &mut self,
        file: &LayoutFile,
        places: &[Place],
        arcs: &mut [Vec<ArcPoint>],
    ) -> Result<Vec<u32>, PartialEmbeddingError> {
        let mut nodes = vec![u32::MAX; places.len()];
        let mut pieces = HashMap::new();
        let mut on_edges: Vec<(EdgeId, f64, LayoutElement, usize)> = Vec::new();
        for (n, &place) in places.iter().enumerate() {
            match place {
                Place::Vertex(v) => {
                    nodes[n] = v.0;
                    self.assign(v.0, LayoutElement::Node(n as u32))?;
                }
                Place::Edge(e, t) => on_edges.push((e, t, LayoutElement::Node(n as u32), 0)),
                Place::Inside(f) => nodes[n] = self.insert_inside(file, n as u32, f, &nodes, &mut pieces)?,
            }
        }
        for (a, points) in arcs.iter_mut().enumerate() {
            let last = points.len() - 1;
            for (k, point) in points.iter_mut().enumerate().take(last).skip(1) {
                match point.place {
                    Place::Vertex(v) => {
                        point.vertex = v.0;
                        self.assign(v.0, LayoutElement::Arc(a as u32))?;
                    }
                    Place::Edge(e, t) => on_edges.push((e, t, LayoutElement::Arc(a as u32), k)),
                    Place::Inside(_) => {}
                }
            }
        }
        self.insert_on_edges(on_edges, &mut nodes, arcs)?;
        for (arc, points) in file.arcs.iter().zip(arcs.iter_mut()) {
            let last = points.len() - 1;
            points[0].vertex = nodes[arc.ends[0].node as usize];
            points[last].vertex = nodes[arc.ends[1].node as usize];
        }
        Ok(nodes)
    }

    /// Inserts vertices for points on edges, given by edge, fraction, node or arc, and index of the arc's point.
    fn insert_on_edges(
        &mut self,
        mut on_edges: Vec<(EdgeId, f64, LayoutElement, usize)>,
        nodes: &mut [u32],
        arcs: &mut [Vec<ArcPoint>],
    ) -> Result<(), PartialEmbeddingError> {
        on_edges.sort_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)));
        for run in on_edges.chunk_by(|x, y| x.0 == y.0) {
            if let Some(w) = run.windows(2).find(|w| w[0].1 >= w[1].1) {
                return Err(PartialEmbeddingError::Meet { first: w[0].2, second: w[1].2 });
            }
            self.on_edge.insert(run[0].0, run.iter().map(|x| x.2).collect());
            let (mut rest, mut from) = (self.whole_edge(run[0].0), 0.0);
            for &(_, t, element, k) in run {
                let x = self.mesh.split_edge(rest, (t - from) / (1.0 - from));
                (rest, from) = (self.mesh.vertex_halfedge(x), t);
                self.owner.insert(x, element);
                match element {
                    LayoutElement::Node(n) => nodes[n as usize] = x,
                    LayoutElement::Arc(a) => arcs[a as usize][k].vertex = x,
                }
            }
        }
        Ok(())
    }

    /// The half-edge of an edge that has not been split yet; splits beside it may have changed its index.
    fn whole_edge(&self, e: EdgeId) -> u32 {
        let h = self.base.halfedge(e);
        let along = |&g: &u32| self.mesh.base_halfedge(g) == Some(h.0);
        self.mesh.outgoing(self.base.origin(h).0).into_iter().find(along).unwrap_or(h.0)
    }

    /// Assigns a vertex to a node or arc.
    fn assign(&mut self, vertex: u32, element: LayoutElement) -> Result<(), PartialEmbeddingError> {
        match self.owner.insert(vertex, element) {
            Some(first) => Err(PartialEmbeddingError::Meet { first, second: element }),
            None => Ok(()),
        }
    }

    /// Inserts a vertex for node `n` inside triangle `f`; `pieces` lists the faces of the triangle so far. Uses
    /// barycentric coordinates, in which the triangle is not degenerate.
    fn insert_inside(
        &mut self,
        file: &LayoutFile,
        n: u32,
        f: FaceId,
        nodes: &[u32],
        pieces: &mut HashMap<u32, Vec<u32>>,
    ) -> Result<u32, PartialEmbeddingError> {
        let weights = |w: [f64; 3]| DVec2::new(w[1], w[2]);
        let at = file.nodes[n as usize].at;
        let point = weights(at.weights);
        let corners = self.base.face_vertices(f);
        let flat = |v: u32| {
            let corner = corners.iter().position(|c| c.0 == v);
            corner.map(|i| [DVec2::ZERO, DVec2::X, DVec2::Y][i]).unwrap_or_else(|| {
                let node = nodes.iter().position(|&w| w == v);
                node.map_or(DVec2::ZERO, |i| weights(file.nodes[i].at.weights))
            })
        };
        let list = pieces.entry(f.0).or_insert_with(|| vec![f.0]);
        // The piece that contains the node, and its nearest side.
        let (mut best, mut depth) = (3 * f.0, f64::NEG_INFINITY);
        for &piece in list.iter() {
            let [a, b, c] = self.mesh.corners(piece).map(flat);
            let area = (b - a).perp_dot(c - a);
            let inside = [(a, b), (b, c), (c, a)].map(|(p, q)| (q - p).perp_dot(point - p) / area);
            let side = (0..3).min_by(|&i, &j| inside[i].total_cmp(&inside[j])).unwrap_or(0);
            if inside[side] > depth {
                (best, depth) = (3 * piece + side as u32, inside[side]);
            }
        }
        for v in self.mesh.corners(best / 3) {
            if let Some(&owner @ LayoutElement::Node(other)) = self.owner.get(&v)
                && file.nodes[other as usize].at == at
            {
                return Err(PartialEmbeddingError::Meet { first: owner, second: LayoutElement::Node(n) });
            }
        }
        let before = self.mesh.n_faces() as u32;
        let x = if depth < ON_SIDE && self.mesh.base_halfedge(best).is_none() {
            let [a, b] = [self.mesh.origin(best), self.mesh.target(best)].map(flat);
            let t = (point - a).dot(b - a) / (b - a).length_squared();
            self.mesh.split_edge(best, t.clamp(ON_SIDE, 1.0 - ON_SIDE))
        } else {
            self.mesh.split_face(best / 3)
        };
        self.mesh.positions[x as usize] = at.position(self.base);
        list.extend(before..self.mesh.n_faces() as u32);
        self.owner.insert(x, LayoutElement::Node(n));
        Ok(x)
    }

    /// Inserts all arcs; returns their vertices.
    fn insert_arcs(
        &mut self,
        file: &LayoutFile,
        places: &[Place],
        nodes: &[u32],
        arcs: &[Vec<ArcPoint>],
    ) -> Result<Vec<Vec<u32>>, PartialEmbeddingError> {
        let mut steps = Vec::new();
        let mut paths: Vec<Vec<Vec<u32>>> = Vec::with_capacity(arcs.len());
        for (a, points) in arcs.iter().enumerate() {
            let border = along_boundary(file, self.base, places, a).filter(|_| file.arcs[a].path.is_empty());
            if let Some(ends) = border {
                let arc = a as u32;
                let meet = |other| PartialEmbeddingError::Meet {
                    first: LayoutElement::Arc(other),
                    second: LayoutElement::Arc(arc),
                };
                let mut path = self.boundary_path(arc, nodes[ends[0] as usize]).map_err(meet)?;
                if path[path.len() - 1] != nodes[ends[1] as usize] {
                    return Err(PartialEmbeddingError::OffBoundary { arc });
                }
                if file.arcs[a].ends[0].slot != 0 {
                    path.reverse();
                }
                paths.push(vec![path]);
                continue;
            }
            for index in 0..points.len() - 1 {
                steps.push(self.step(a as u32, index, points)?);
            }
            paths.push(vec![Vec::new(); points.len() - 1]);
        }
        steps.sort_by_key(|s| (s.face.is_some(), !s.at_inner_node, s.arc, s.index));
        for step in &steps {
            let ends = [0, 1].map(|i| arcs[step.arc as usize][step.index + i]);
            let path = match step.face {
                Some(face) => self.insert_in_face(step.arc, face, ends)?,
                None => self.insert_on_edge(step.arc, ends)?,
            };
            paths[step.arc as usize][step.index] = path;
        }
        Ok(paths.into_iter().map(concatenate).collect())
    }

    /// The step from point `index` of an arc to the next.
    fn step(&self, arc: u32, index: usize, points: &[ArcPoint]) -> Result<Step, PartialEmbeddingError> {
        let (from, to) = (points[index], points[index + 1]);
        let inner = |s: ArcPoint| matches!(s.place, Place::Inside(_));
        let at_inner_node = inner(from) || inner(to);
        let gap = PartialEmbeddingError::Gap { arc, step: index };
        if from.vertex == to.vertex {
            return Err(gap);
        }
        if from.faces.is_none() && to.faces.is_none() && from.place.common_edge(self.base, to.place).is_some() {
            return Ok(Step { arc, index, face: None, at_inner_node });
        }
        let before = from.faces.map_or_else(|| from.place.faces(self.base), |f| vec![f[1]]);
        let after = to.faces.map_or_else(|| to.place.faces(self.base), |f| vec![f[0]]);
        let face = before.into_iter().find(|f| after.contains(f)).ok_or(gap)?;
        Ok(Step { arc, index, face: Some(face), at_inner_node })
    }

    /// Marks the boundary from the node at `from` to the next node, with the surface to the left, as an arc. The error
    /// is the arc that obstructs it.
    fn boundary_path(&mut self, arc: u32, from: u32) -> Result<Vec<u32>, u32> {
        let mut path = vec![from];
        loop {
            let h = self.mesh.outgoing(path[path.len() - 1])[0];
            if let Mark::Arc(other) = self.mesh.mark(h) {
                return Err(other);
            }
            self.mesh.set_mark(h, Mark::Arc(arc));
            let v = self.mesh.target(h);
            path.push(v);
            match self.owner.get(&v) {
                Some(LayoutElement::Node(_)) => return Ok(path),
                Some(&LayoutElement::Arc(other)) => return Err(other),
                None => self.owner.insert(v, LayoutElement::Arc(arc)),
            };
        }
    }

    /// Adds a boundary arc at each boundary node whose slot 0 is free.
    fn complete_boundary(
        &mut self,
        file: &LayoutFile,
        nodes: &[u32],
        arcs: &mut Vec<Vec<u32>>,
        ends: &mut Vec<[ArcEnd; 2]>,
    ) -> Result<(), PartialEmbeddingError> {
        let taken: HashSet<u32> = ends.iter().flatten().filter(|e| e.slot == 0).map(|e| e.node).collect();
        for (node, &v) in (0..).zip(nodes).filter(|(n, _)| !taken.contains(n)) {
            if !self.mesh.is_boundary(self.mesh.outgoing(v)[0]) {
                continue;
            }
            let path =
                self.boundary_path(arcs.len() as u32, v).map_err(|arc| PartialEmbeddingError::OnBoundary { arc })?;
            if let Some(&LayoutElement::Node(to)) = self.owner.get(&path[path.len() - 1]) {
                let last = file.nodes[to as usize].valence;
                ends.push([ArcEnd { node, slot: 0 }, ArcEnd { node: to, slot: last }]);
                arcs.push(path);
            }
        }
        Ok(())
    }

    /// Inserts a step along a mesh edge.
    fn insert_on_edge(&mut self, arc: u32, [from, to]: [ArcPoint; 2]) -> Result<Vec<u32>, PartialEmbeddingError> {
        let (p, q) = (from.vertex, to.vertex);
        let edge = from.place.common_edge(self.base, to.place);
        let between =
            |element: &LayoutElement| self.owner.get(&p) != Some(element) && self.owner.get(&q) != Some(element);
        let meet = |first: LayoutElement| PartialEmbeddingError::Meet { first, second: LayoutElement::Arc(arc) };
        let Some(h) = self.mesh.find(p, q).filter(|&h| self.mesh.base_halfedge(h).is_some()) else {
            let there = edge.and_then(|e| self.on_edge.get(&e)).and_then(|list| list.iter().copied().find(between));
            return Err(meet(there.unwrap_or(LayoutElement::Arc(arc))));
        };
        if let Mark::Arc(other) = self.mesh.mark(h) {
            return Err(meet(LayoutElement::Arc(other)));
        }
        self.mesh.set_mark(h, Mark::Arc(arc));
        Ok(vec![p, q])
    }

    /// Inserts a step inside a triangle.
    fn insert_in_face(
        &mut self,
        arc: u32,
        face: FaceId,
        ends: [ArcPoint; 2],
    ) -> Result<Vec<u32>, PartialEmbeddingError> {
        let (p, q) = (ends[0].vertex, ends[1].vertex);
        if let Some(h) = self.mesh.find(p, q)
            && let Mark::Arc(other) = self.mesh.mark(h)
        {
            return Err(PartialEmbeddingError::Meet {
                first: LayoutElement::Arc(other),
                second: LayoutElement::Arc(arc),
            });
        }
        let [a, b, _] = self.base.face_vertices(face).map(|v| self.base.position(v));
        let x = (b - a).normalize_or(DVec3::X);
        let y = self.base.face_area_vector(face).cross(x).normalize_or_zero();
        let plane = |m: &RefinedMesh, v: u32| {
            let d = m.positions[v as usize] - a;
            DVec2::new(d.dot(x), d.dot(y))
        };
        let inside = |m: &RefinedMesh, f: u32| m.base_face(f) == face.0;
        if let Ok(path) = self.mesh.insert_path((p, q), Mark::Arc(arc), inside, |_| true, plane) {
            return Ok(path);
        }
        // Find the obstructing arc by a path that may cross arcs.
        let across = self.mesh.insert_path((p, q), Mark::Arc(arc), inside, |_| false, plane);
        let Ok(path) = across else { return Err(PartialEmbeddingError::NoPath { arc, face }) };
        let other =
            path[1..path.len() - 1].iter().flat_map(|&v| self.mesh.outgoing(v)).find_map(|h| match self.mesh.mark(h) {
                Mark::Arc(other) if other != arc => Some(other),
                _ => None,
            });
        Err(PartialEmbeddingError::Cross { first: other.unwrap_or(arc), second: arc, face })
    }
}

/// Concatenates consecutive paths.
fn concatenate(pieces: Vec<Vec<u32>>) -> Vec<u32> {
    let mut path: Vec<u32> = Vec::new();
    for piece in pieces {
        path.pop();
        path.extend(piece);
    }
    path
}

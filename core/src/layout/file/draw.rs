//! Drawing nodes and arcs as vertices and edge paths.
//!
//! First all nodes inside triangles, then all places on mesh edges become vertices, in their order along each edge.
//! Afterwards every step of an arc lies in one triangle of the mesh, between two vertices that exist, and is drawn
//! there without crossing what is drawn already. Steps at nodes inside a triangle come first: once these are tied to
//! its border, only one way is left for each step between places on the border, so that rounding cannot put a node
//! on the wrong side of an arc.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec2, DVec3};

use super::{DrawError, FileNode, LayoutFile, MAX_VALENCE, Part, PathPoint};
use crate::dual::{Mark, RefinedMesh};
use crate::mesh::{EdgeId, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::surface::Crossing;

/// How far the weights of a node may be from the sum 1: written with ten digits, they still are.
const WEIGHT_SUM: f64 = 1e-9;
/// A node this near to the side of a part of a triangle, in weights, splits the side instead of the part.
const ON_SIDE: f64 = 1e-9;

/// What is drawn, before its regions are known.
pub(super) struct Drawn {
    pub mesh: RefinedMesh,
    /// Vertex of each node.
    pub nodes: Vec<u32>,
    /// Vertices of each arc.
    pub arcs: Vec<Vec<u32>>,
}

/// Where on the mesh a point lies.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Vertex(VertexId),
    /// The fraction is that along the edge's own half-edge, [`TriMesh::halfedge`].
    Edge(EdgeId, f64),
    Inside(FaceId),
}

/// A point of an arc.
#[derive(Debug, Clone, Copy)]
struct Stop {
    place: Place,
    /// For a crossing: the triangle left and the one entered.
    faces: Option<[FaceId; 2]>,
    /// Its vertex, once there is one.
    vertex: u32,
}

/// A piece of an arc between two stops.
struct Step {
    arc: u32,
    index: usize,
    /// The triangle it lies in; none along a mesh edge.
    face: Option<FaceId>,
    /// Whether one end is a node inside the triangle.
    at_inner_node: bool,
}

pub(super) fn draw(file: &LayoutFile, base: &TriMesh) -> Result<Drawn, DrawError> {
    let places: Vec<Place> =
        file.nodes.iter().enumerate().map(|(n, node)| node_place(base, n as u32, node)).collect::<Result<_, _>>()?;
    check_slots(file, base, &places)?;
    let mut arcs = Vec::with_capacity(file.arcs.len());
    for a in 0..file.arcs.len() {
        arcs.push(stops(file, base, &places, a)?);
    }
    let mut canvas = Canvas { base, mesh: RefinedMesh::new(base), owner: HashMap::new(), on_edge: BTreeMap::new() };
    let nodes = canvas.insert(file, &places, &mut arcs)?;
    let paths = canvas.connect(file, &places, &nodes, &arcs)?;
    Ok(Drawn { mesh: canvas.mesh, nodes, arcs: paths })
}

fn node_place(base: &TriMesh, node: u32, FileNode { at, valence, .. }: &FileNode) -> Result<Place, DrawError> {
    if at.face.index() >= base.n_faces() {
        return Err(DrawError::UnknownFace { node, face: at.face });
    }
    let sum: f64 = at.weights.iter().sum();
    let fits = at.weights.iter().all(|w| (0.0..=1.0).contains(w)) && (sum - 1.0).abs() <= WEIGHT_SUM;
    if !fits {
        return Err(DrawError::Weights { node });
    }
    if !(1..=MAX_VALENCE).contains(valence) {
        return Err(DrawError::Valence { node, valence: *valence });
    }
    let [h0, h1, h2] = base.face_halfedges(at.face);
    Ok(match at.weights.map(|w| w > 0.0) {
        [true, true, true] => Place::Inside(at.face),
        [true, true, false] => on_edge(base, h0, at.weights[1] / sum),
        [false, true, true] => on_edge(base, h1, at.weights[2] / sum),
        [true, false, true] => on_edge(base, h2, at.weights[0] / sum),
        [first, second, _] => Place::Vertex(base.origin(if first {
            h0
        } else if second {
            h1
        } else {
            h2
        })),
    })
}

fn on_edge(base: &TriMesh, h: HalfedgeId, t: f64) -> Place {
    let e = base.edge(h);
    Place::Edge(e, if base.halfedge(e) == h { t } else { 1.0 - t })
}

impl Place {
    fn is_boundary(self, base: &TriMesh) -> bool {
        match self {
            Self::Vertex(v) => base.is_boundary_vertex(v),
            Self::Edge(e, _) => base.is_boundary_edge(e),
            Self::Inside(_) => false,
        }
    }

    /// The triangles that contain it.
    fn faces(self, base: &TriMesh) -> Vec<FaceId> {
        match self {
            Self::Vertex(v) => base.outgoing(v).map(|h| base.face(h)).collect(),
            Self::Edge(e, _) => {
                let h = base.halfedge(e);
                [Some(h), base.twin(h)].into_iter().flatten().map(|h| base.face(h)).collect()
            }
            Self::Inside(f) => vec![f],
        }
    }

    /// Whether it lies on an edge, its ends included.
    fn is_on(self, base: &TriMesh, e: EdgeId) -> bool {
        match self {
            Self::Vertex(v) => base.edge_vertices(e).contains(&v),
            Self::Edge(own, _) => own == e,
            Self::Inside(_) => false,
        }
    }

    /// An edge that it shares with another place.
    fn common_edge(self, base: &TriMesh, other: Self) -> Option<EdgeId> {
        let edges = match self {
            Self::Vertex(v) => base.outgoing(v).flat_map(|h| [base.edge(h), base.edge(base.prev(h))]).collect(),
            Self::Edge(e, _) => vec![e],
            Self::Inside(_) => Vec::new(),
        };
        edges.into_iter().find(|&e| other.is_on(base, e))
    }
}

/// Checks that nodes and slots exist and that no slot is taken twice.
fn check_slots(file: &LayoutFile, base: &TriMesh, places: &[Place]) -> Result<(), DrawError> {
    let mut taken = HashMap::new();
    for (arc, a) in file.arcs.iter().enumerate() {
        let arc = arc as u32;
        for end in a.ends {
            let (node, slot) = (end.node, end.slot);
            let Some(place) = places.get(node as usize) else {
                return Err(DrawError::UnknownNode { arc, node, count: places.len() });
            };
            let last = file.nodes[node as usize].valence - u32::from(!place.is_boundary(base));
            if slot > last {
                return Err(DrawError::UnknownSlot { arc, node, slot, last });
            }
            if let Some(other) = taken.insert((node, slot), arc) {
                return Err(DrawError::SlotTaken { node, slot, arcs: [other, arc] });
            }
        }
    }
    Ok(())
}

/// The nodes between which arc `a` runs along the boundary with the surface to its left, if its slots say so.
fn along_boundary(file: &LayoutFile, base: &TriMesh, places: &[Place], a: usize) -> Option<[u32; 2]> {
    let [p, q] = file.arcs[a].ends;
    let outer = |node: u32| places[node as usize].is_boundary(base).then(|| file.nodes[node as usize].valence);
    let (last_p, last_q) = (outer(p.node)?, outer(q.node)?);
    match (p.slot, q.slot) {
        (0, slot) if slot == last_q => Some([p.node, q.node]),
        (slot, 0) if slot == last_p => Some([q.node, p.node]),
        _ => None,
    }
}

/// The stops of an arc, both nodes included.
fn stops(file: &LayoutFile, base: &TriMesh, places: &[Place], a: usize) -> Result<Vec<Stop>, DrawError> {
    let arc = &file.arcs[a];
    let at_node = |i: usize| Stop { place: places[arc.ends[i].node as usize], faces: None, vertex: u32::MAX };
    let mut list = vec![at_node(0)];
    for (place, point) in arc.path.iter().enumerate() {
        let wrong = |reason| DrawError::Place { arc: a as u32, place, reason };
        list.push(match *point {
            PathPoint::Vertex { vertex } if vertex.index() >= base.n_vertices() => {
                return Err(wrong("the mesh has no such vertex"));
            }
            PathPoint::Vertex { vertex } => Stop { place: Place::Vertex(vertex), faces: None, vertex: u32::MAX },
            PathPoint::Crossing(c) => crossing_stop(base, c).map_err(wrong)?,
        });
    }
    list.push(at_node(1));
    Ok(list)
}

fn crossing_stop(base: &TriMesh, Crossing { halfedge: h, t }: Crossing) -> Result<Stop, &'static str> {
    if h.index() >= base.n_halfedges() {
        return Err("the mesh has no such half-edge");
    }
    let Some(twin) = base.twin(h) else { return Err("an arc cannot cross the boundary") };
    let place = on_edge(base, h, t);
    let inner = |t: f64| t > 0.0 && t < 1.0;
    if !(inner(t) && matches!(place, Place::Edge(_, s) if inner(s))) {
        return Err("t is not strictly between 0 and 1");
    }
    Ok(Stop { place, faces: Some([base.face(h), base.face(twin)]), vertex: u32::MAX })
}

/// The mesh on which is drawn.
struct Canvas<'a> {
    base: &'a TriMesh,
    mesh: RefinedMesh,
    /// Who takes a vertex.
    owner: HashMap<u32, Part>,
    /// Places on each edge in order: who is there.
    on_edge: BTreeMap<EdgeId, Vec<Part>>,
}

impl Canvas<'_> {
    /// Makes vertices of all nodes and stops; returns those of the nodes.
    fn insert(&mut self, file: &LayoutFile, places: &[Place], arcs: &mut [Vec<Stop>]) -> Result<Vec<u32>, DrawError> {
        let mut nodes = vec![u32::MAX; places.len()];
        let mut parts = HashMap::new();
        // Places on edges: where, whose, and the node or stop in question.
        let mut on_edges: Vec<(EdgeId, f64, Part, usize)> = Vec::new();
        for (n, &place) in places.iter().enumerate() {
            match place {
                Place::Vertex(v) => {
                    nodes[n] = v.0;
                    self.take(v.0, Part::Node(n as u32))?;
                }
                Place::Edge(e, t) => on_edges.push((e, t, Part::Node(n as u32), 0)),
                Place::Inside(f) => nodes[n] = self.insert_inside(file, n as u32, f, &nodes, &mut parts)?,
            }
        }
        for (a, stops) in arcs.iter_mut().enumerate() {
            let last = stops.len() - 1;
            for (k, stop) in stops.iter_mut().enumerate().take(last).skip(1) {
                match stop.place {
                    Place::Vertex(v) => {
                        stop.vertex = v.0;
                        self.take(v.0, Part::Arc(a as u32))?;
                    }
                    Place::Edge(e, t) => on_edges.push((e, t, Part::Arc(a as u32), k)),
                    Place::Inside(_) => {}
                }
            }
        }
        on_edges.sort_by(|x, y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)));
        for run in on_edges.chunk_by(|x, y| x.0 == y.0) {
            if let Some(w) = run.windows(2).find(|w| w[0].1 >= w[1].1) {
                return Err(DrawError::Meet { first: w[0].2, second: w[1].2 });
            }
            self.on_edge.insert(run[0].0, run.iter().map(|x| x.2).collect());
            let (mut rest, mut from) = (self.whole_edge(run[0].0), 0.0);
            for &(_, t, part, k) in run {
                let x = self.mesh.split_edge(rest, (t - from) / (1.0 - from));
                (rest, from) = (self.mesh.any_outgoing(x), t);
                self.owner.insert(x, part);
                match part {
                    Part::Node(n) => nodes[n as usize] = x,
                    Part::Arc(a) => arcs[a as usize][k].vertex = x,
                }
            }
        }
        for (arc, stops) in file.arcs.iter().zip(arcs) {
            let last = stops.len() - 1;
            stops[0].vertex = nodes[arc.ends[0].node as usize];
            stops[last].vertex = nodes[arc.ends[1].node as usize];
        }
        Ok(nodes)
    }

    /// The half-edge of an edge that has not been split yet; splits beside it may have changed its number.
    fn whole_edge(&self, e: EdgeId) -> u32 {
        let h = self.base.halfedge(e);
        let along = |&g: &u32| self.mesh.base_halfedge(g) == Some(h.0);
        self.mesh.outgoing(self.base.origin(h).0).into_iter().find(along).unwrap_or(h.0)
    }

    fn take(&mut self, vertex: u32, part: Part) -> Result<(), DrawError> {
        match self.owner.insert(vertex, part) {
            Some(first) => Err(DrawError::Meet { first, second: part }),
            None => Ok(()),
        }
    }

    /// Makes a vertex of node `n` inside triangle `f`, of which `parts` lists the pieces so far. All is measured
    /// in weights, where the triangle is never degenerate.
    fn insert_inside(
        &mut self,
        file: &LayoutFile,
        n: u32,
        f: FaceId,
        nodes: &[u32],
        parts: &mut HashMap<u32, Vec<u32>>,
    ) -> Result<u32, DrawError> {
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
        let list = parts.entry(f.0).or_insert_with(|| vec![f.0]);
        // The piece that contains it, and the side of that piece to which it is nearest.
        let (mut best, mut depth) = (3 * f.0, f64::NEG_INFINITY);
        for &part in list.iter() {
            let [a, b, c] = self.mesh.corners(part).map(flat);
            let area = (b - a).perp_dot(c - a);
            let inside = [(a, b), (b, c), (c, a)].map(|(p, q)| (q - p).perp_dot(point - p) / area);
            let side = (0..3).min_by(|&i, &j| inside[i].total_cmp(&inside[j])).unwrap_or(0);
            if inside[side] > depth {
                (best, depth) = (3 * part + side as u32, inside[side]);
            }
        }
        for v in self.mesh.corners(best / 3) {
            if let Some(&owner @ Part::Node(other)) = self.owner.get(&v)
                && file.nodes[other as usize].at == at
            {
                return Err(DrawError::Meet { first: owner, second: Part::Node(n) });
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
        self.owner.insert(x, Part::Node(n));
        Ok(x)
    }

    /// Draws all arcs; returns their vertices.
    fn connect(
        &mut self,
        file: &LayoutFile,
        places: &[Place],
        nodes: &[u32],
        arcs: &[Vec<Stop>],
    ) -> Result<Vec<Vec<u32>>, DrawError> {
        let mut steps = Vec::new();
        let mut paths: Vec<Vec<Vec<u32>>> = Vec::with_capacity(arcs.len());
        for (a, stops) in arcs.iter().enumerate() {
            let border = along_boundary(file, self.base, places, a).filter(|_| file.arcs[a].path.is_empty());
            if let Some(ends) = border {
                let mut path = self.boundary_path(a as u32, ends.map(|n| nodes[n as usize]))?;
                if file.arcs[a].ends[0].slot != 0 {
                    path.reverse();
                }
                paths.push(vec![path]);
                continue;
            }
            for index in 0..stops.len() - 1 {
                steps.push(self.step(a as u32, index, stops)?);
            }
            paths.push(vec![Vec::new(); stops.len() - 1]);
        }
        steps.sort_by_key(|s| (s.face.is_some(), !s.at_inner_node, s.arc, s.index));
        for step in &steps {
            let ends = [0, 1].map(|i| arcs[step.arc as usize][step.index + i]);
            let drawn = match step.face {
                Some(face) => self.draw_inside(step.arc, face, ends)?,
                None => self.draw_along(step.arc, ends)?,
            };
            paths[step.arc as usize][step.index] = drawn;
        }
        Ok(paths.into_iter().map(chain).collect())
    }

    /// Where a step runs.
    fn step(&self, arc: u32, index: usize, stops: &[Stop]) -> Result<Step, DrawError> {
        let (from, to) = (stops[index], stops[index + 1]);
        let inner = |s: Stop| matches!(s.place, Place::Inside(_));
        let at_inner_node = inner(from) || inner(to);
        let gap = DrawError::Gap { arc, step: index };
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

    /// The boundary from one node to another, with the surface to the left; marked.
    fn boundary_path(&mut self, arc: u32, [from, to]: [u32; 2]) -> Result<Vec<u32>, DrawError> {
        let mut path = vec![from];
        loop {
            let h = self.mesh.outgoing(path[path.len() - 1])[0];
            let v = self.mesh.target(h);
            if self.mesh.mark(h) != Mark::Free {
                return Err(DrawError::OffBoundary { arc });
            }
            self.mesh.set_mark(h, Mark::Arc(arc));
            path.push(v);
            if v == to {
                return Ok(path);
            }
            match self.owner.insert(v, Part::Arc(arc)) {
                Some(Part::Node(_)) => return Err(DrawError::OffBoundary { arc }),
                Some(first) => return Err(DrawError::Meet { first, second: Part::Arc(arc) }),
                None => {}
            }
        }
    }

    /// Draws a step along a mesh edge.
    fn draw_along(&mut self, arc: u32, [from, to]: [Stop; 2]) -> Result<Vec<u32>, DrawError> {
        let (p, q) = (from.vertex, to.vertex);
        let edge = from.place.common_edge(self.base, to.place);
        let between = |part: &Part| self.owner.get(&p) != Some(part) && self.owner.get(&q) != Some(part);
        let meet = |first: Part| DrawError::Meet { first, second: Part::Arc(arc) };
        let Some(h) = self.mesh.find(p, q).filter(|&h| self.mesh.base_halfedge(h).is_some()) else {
            let there = edge.and_then(|e| self.on_edge.get(&e)).and_then(|list| list.iter().copied().find(between));
            return Err(meet(there.unwrap_or(Part::Arc(arc))));
        };
        if let Mark::Arc(other) = self.mesh.mark(h) {
            return Err(meet(Part::Arc(other)));
        }
        self.mesh.set_mark(h, Mark::Arc(arc));
        Ok(vec![p, q])
    }

    /// Draws a step inside a triangle.
    fn draw_inside(&mut self, arc: u32, face: FaceId, ends: [Stop; 2]) -> Result<Vec<u32>, DrawError> {
        let (p, q) = (ends[0].vertex, ends[1].vertex);
        if let Some(h) = self.mesh.find(p, q)
            && let Mark::Arc(other) = self.mesh.mark(h)
        {
            return Err(DrawError::Meet { first: Part::Arc(other), second: Part::Arc(arc) });
        }
        let [a, b, _] = self.base.face_vertices(face).map(|v| self.base.position(v));
        let x = (b - a).normalize_or(DVec3::X);
        let y = self.base.face_area_vector(face).cross(x).normalize_or_zero();
        let plane = |m: &RefinedMesh, v: u32| {
            let d = m.positions[v as usize] - a;
            DVec2::new(d.dot(x), d.dot(y))
        };
        let inside = |m: &RefinedMesh, f: u32| m.base_face(f) == face.0;
        if let Ok(path) = self.mesh.draw((p, q), Mark::Arc(arc), inside, |_| true, plane) {
            return Ok(path);
        }
        // What is in the way is found by drawing across it.
        let across = self.mesh.draw((p, q), Mark::Arc(arc), inside, |_| false, plane);
        let Ok(path) = across else { return Err(DrawError::NoWay { arc, face }) };
        let other =
            path[1..path.len() - 1].iter().flat_map(|&v| self.mesh.outgoing(v)).find_map(|h| match self.mesh.mark(h) {
                Mark::Arc(other) if other != arc => Some(other),
                _ => None,
            });
        Err(DrawError::Cross { first: other.unwrap_or(arc), second: arc, face })
    }
}

/// One path of several that follow each other.
fn chain(pieces: Vec<Vec<u32>>) -> Vec<u32> {
    let mut path: Vec<u32> = Vec::new();
    for piece in pieces {
        path.pop();
        path.extend(piece);
    }
    path
}

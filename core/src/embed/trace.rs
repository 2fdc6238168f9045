//! The arcs of a layout traced as isolines of a seamless map (Campen, section 6.4.2).
//!
//! From a node as many isolines go out as it has arcs, in the same cyclic order; so a node's arcs are known as soon
//! as one of them is. All isolines from all nodes are marched to the next node. A node is then turned such that
//! most of its arcs end at the node they should, after the length they should have, as the isoline of the other
//! end; what the arcs' chains say about their headings decides where that leaves a choice.
//!
//! Arcs then become edge paths of a refined mesh. Vertices that they pass through move in the map, not on the surface,
//! by what they were off, so that arcs are isolines exactly.

use glam::{DVec2, DVec3};
use thiserror::Error;

use super::march::{Isolines, Marched, Slot, Step, Stop, exactness};
use super::weld::{Point, weld};
use crate::layout::{Embedding, QuadLayout};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, TriMeshError, VertexId};
use crate::param::{SeamlessMap, Transition, turn};

/// Relative difference between the length of an arc and that its chain says which is rounding.
const LENGTH: f64 = 1e-6;

/// How an arc runs: through which triangles, up to homotopy, and in which direction of the map.
#[derive(Debug, Clone, Copy)]
pub struct ArcChain<'a> {
    /// A corner at the first node, as outgoing half-edge.
    pub start: HalfedgeId,
    /// The half-edges crossed from its triangle to the last, each of the triangle that is left.
    pub crossed: &'a [HalfedgeId],
    /// A corner at the second node in the last triangle.
    pub end: HalfedgeId,
    /// The direction of the map, in the chart of the first triangle, that the arc runs in: 0 is +u, 1 is +v, 2 is −u,
    /// 3 is −v.
    pub heading: u8,
}

/// Why the arcs of a layout could not be traced.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum TraceError {
    /// A chain does not join its nodes.
    #[error("the chain of arc {arc} does not join its nodes")]
    Chain {
        /// The arc.
        arc: usize,
    },
    /// The nodes of an arc lie the wrong way round in the map, or one on the other.
    #[error("arc {arc} has a length of {length} in the map")]
    Length {
        /// The arc.
        arc: usize,
        /// Its length.
        length: f64,
    },
    /// The patches around a node do not follow one another.
    #[error("the patches around node {node} do not close up")]
    Order {
        /// The node.
        node: usize,
    },
    /// Not as many isolines go out from a node as it has arcs: the map is folded there.
    #[error("{found} isolines go out from node {node} with {expected} arcs")]
    Node {
        /// The node.
        node: usize,
        /// The isolines.
        found: usize,
        /// The arcs.
        expected: usize,
    },
    /// An arc runs into a triangle that the map turns over.
    #[error("arc {arc} meets a fold at triangle {}", face.0)]
    Fold {
        /// The arc.
        arc: usize,
        /// The triangle.
        face: FaceId,
    },
    /// An arc leaves the surface or finds no way on.
    #[error("arc {arc} is lost at triangle {}", face.0)]
    Lost {
        /// The arc.
        arc: usize,
        /// The triangle.
        face: FaceId,
    },
    /// An arc comes to another node, or after another length, than it should.
    #[error("arc {arc} comes to node {node} after {length} instead of to node {expected_node} after {expected}")]
    Strayed {
        /// The arc.
        arc: usize,
        /// The node it comes to.
        node: usize,
        /// Its length.
        length: f64,
        /// The node it should come to.
        expected_node: usize,
        /// The length it should have.
        expected: f64,
    },
    /// Two arcs meet other than at a node.
    #[error("arcs {} and {} meet in triangle {}", arcs[0], arcs[1], face.0)]
    Crossing {
        /// The arcs.
        arcs: [u32; 2],
        /// The triangle.
        face: FaceId,
    },
    /// An arc of a patch does not have it on its side.
    #[error("patch {patch} does not lie beside its arcs")]
    Patch {
        /// The patch.
        patch: usize,
    },
    /// The refined mesh is no manifold.
    #[error("the refined surface is not a manifold: {0}")]
    Mesh(#[from] TriMeshError),
}

/// A layout traced in a map.
#[derive(Debug, Clone)]
pub struct Traced {
    /// The layout on the refined surface.
    pub embedding: Embedding,
    /// The refined surface.
    pub mesh: TriMesh,
    /// The map on the refined surface; every triangle has the chart of the one it lies in.
    pub map: SeamlessMap,
}

/// Traces the arcs of `layout` in `map`, whose nodes are the vertices `node_vertex` and whose arcs run like `chains`.
///
/// # Errors
///
/// See [`TraceError`]; a map without folds whose nodes are where the chains say has none.
pub fn trace_arcs(
    mesh: &TriMesh,
    map: &SeamlessMap,
    layout: &QuadLayout,
    node_vertex: &[VertexId],
    chains: &[ArcChain],
) -> Result<Traced, TraceError> {
    let node = nodes_at(mesh, node_vertex);
    let lines = Isolines { mesh, map, node: &node, exact: exactness(map), through_folds: false };
    let marched = Rose::new(&lines, layout, node_vertex, chains)?.arcs()?;
    let mut exact = map.clone();
    for (line, _) in &marched {
        straighten(mesh, &mut exact, &line.steps);
    }
    let lines = Isolines { map: &exact, ..lines };
    let mut arcs = Vec::with_capacity(marched.len());
    for (arc, (line, backward)) in marched.iter().enumerate() {
        let mut points = points(&lines, &line.steps);
        if let Some(face) = misplaced(mesh, &points) {
            return Err(TraceError::Lost { arc, face });
        }
        if *backward {
            points.reverse();
            points = points.iter().map(|p| p.reversed(mesh)).collect();
        }
        arcs.push(points);
    }
    let welded = weld(mesh, &exact, &arcs)?;
    let seeds = seeds(layout, &welded.mesh, &welded.paths)?;
    let parameters = welded.paths.iter().map(|p| parameters(&welded.mesh, &welded.map, p)).collect();
    let embedding = Embedding {
        mesh: welded.refined,
        base_face: welded.base_face,
        nodes: node_vertex.iter().map(|v| v.0).collect(),
        arcs: welded.paths,
        arc_parameters: parameters,
        seeds,
    };
    Ok(Traced { embedding, mesh: welded.mesh, map: welded.map })
}

/// The arcs as polylines, each by itself and as far as a map that need not be free of folds lets them be traced;
/// `None` for those that do not come to their node.
pub fn preview_arcs(
    mesh: &TriMesh,
    map: &SeamlessMap,
    node_vertex: &[VertexId],
    chains: &[ArcChain],
) -> Vec<Option<Vec<DVec3>>> {
    let node = nodes_at(mesh, node_vertex);
    let lines = Isolines { mesh, map, node: &node, exact: exactness(map), through_folds: true };
    let trace = |from: HalfedgeId, heading: u8, to: HalfedgeId, length: f64| -> Option<Vec<DVec3>> {
        let slots = lines.slots(mesh.origin(from));
        lines.matching(&slots, from, heading).into_iter().find_map(|i| {
            let marched = lines.march(slots[i], length * (1.0 + LENGTH) + lines.exact).ok()?;
            let Step::Vertex(end, _) = *marched.steps.last()? else { return None };
            let right = mesh.origin(end) == mesh.origin(to) && (marched.length - length).abs() <= CLOSE * length;
            right.then(|| points(&lines, &marched.steps).iter().map(|p| p.position(mesh)).collect())
        })
    };
    let both = |chain: &ArcChain| {
        let run = Run::new(mesh, map, chain).filter(|r| r.length > 0.0)?;
        trace(chain.start, chain.heading, chain.end, run.length).or_else(|| {
            let mut back = trace(chain.end, run.back, chain.start, run.length)?;
            back.reverse();
            Some(back)
        })
    };
    chains.iter().map(both).collect()
}

/// How far, relative to its length, a previewed arc may end from where it should.
const CLOSE: f64 = 1e-3;

/// What the chain of an arc says.
struct Run {
    /// Length of the arc in the map.
    length: f64,
    /// Heading from the second node back, in the chart of the last triangle.
    back: u8,
}

impl Run {
    /// `None` if the chain is none.
    fn new(mesh: &TriMesh, map: &SeamlessMap, chain: &ArcChain) -> Option<Self> {
        let mut change = Transition::IDENTITY;
        let mut face = mesh.face(chain.start);
        for &h in chain.crossed {
            if mesh.face(h) != face {
                return None;
            }
            change = change.then(&map.transition(mesh, h)?);
            face = mesh.face(mesh.twin(h)?);
        }
        let at = |h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
        let end = change.inverse().apply(at(chain.end)) - at(chain.start);
        let length = turn(end, -i32::from(chain.heading)).x;
        (face == mesh.face(chain.end)).then_some(Self { length, back: (chain.heading + change.turns + 2) % 4 })
    }
}

/// Where the isoline of a slot leads.
type Spoke = Result<(Marched, usize, usize), Stop>;

/// The isolines of all nodes, to be matched with the arcs.
struct Rose<'a> {
    layout: &'a QuadLayout,
    mesh: &'a TriMesh,
    runs: Vec<Run>,
    exact: f64,
    /// Ends of arcs (twice the arc, plus one at the second node) around each node, counter-clockwise.
    ends: Vec<Vec<u32>>,
    /// Place of each end of an arc among those of its node.
    place: Vec<usize>,
    /// For each node and slot the line, and the node and slot it comes to.
    spokes: Vec<Vec<Spoke>>,
    /// The slot that the chain says for each end of an arc.
    hints: Vec<Option<usize>>,
    /// By how many slots each node's arcs are turned.
    turned: Vec<usize>,
}

impl<'a> Rose<'a> {
    fn new(
        lines: &Isolines<'a>,
        layout: &'a QuadLayout,
        node_vertex: &[VertexId],
        chains: &[ArcChain],
    ) -> Result<Self, TraceError> {
        let (mesh, map) = (lines.mesh, lines.map);
        let mut runs = Vec::with_capacity(chains.len());
        for (arc, chain) in chains.iter().enumerate() {
            let run = Run::new(mesh, map, chain).ok_or(TraceError::Chain { arc })?;
            let ends = [chain.start, chain.end].map(|h| lines.node[mesh.origin(h).index()]);
            if ends != layout.arcs[arc].nodes {
                return Err(TraceError::Chain { arc });
            }
            if run.length <= lines.exact {
                return Err(TraceError::Length { arc, length: run.length });
            }
            runs.push(run);
        }
        let ends = ends_around(layout)?;
        let mut place = vec![0; 2 * layout.arcs.len()];
        for around in &ends {
            for (i, &e) in around.iter().enumerate() {
                place[e as usize] = i;
            }
        }
        let slots: Vec<Vec<Slot>> = node_vertex.iter().map(|&v| lines.slots(v)).collect();
        for (node, (found, expected)) in slots.iter().zip(&ends).enumerate() {
            if found.len() != expected.len() {
                return Err(TraceError::Node { node, found: found.len(), expected: expected.len() });
            }
        }
        let limit = |n: usize| ends[n].iter().map(|&e| runs[e as usize / 2].length).fold(0.0, f64::max);
        let spoke = |slot: Slot, limit: f64| -> Spoke {
            let marched = lines.march(slot, limit * (1.0 + LENGTH) + lines.exact)?;
            let Some(&Step::Vertex(end, _)) = marched.steps.last() else { return Err(Stop::Length(FaceId(0))) };
            let to = lines.node[mesh.origin(end).index()] as usize;
            let at = lines.arrival(&marched, &slots[to]).ok_or(Stop::Vertex(mesh.origin(end)))?;
            Ok((marched, to, at))
        };
        let spokes = slots.iter().enumerate().map(|(n, s)| s.iter().map(|&s| spoke(s, limit(n))).collect()).collect();
        let hint = |n: u32, corner, heading| lines.matching(&slots[n as usize], corner, heading).first().copied();
        let hints = chains.iter().zip(&runs).zip(&layout.arcs).flat_map(|((chain, run), arc)| {
            [hint(arc.nodes[0], chain.start, chain.heading), hint(arc.nodes[1], chain.end, run.back)]
        });
        let hints = hints.collect();
        let turned = vec![0; layout.nodes.len()];
        Ok(Self { layout, mesh, runs, exact: lines.exact, ends, place, spokes, hints, turned })
    }

    fn node(&self, end: u32) -> usize {
        self.layout.arcs[end as usize / 2].nodes[end as usize % 2] as usize
    }

    /// The slot of an end of an arc if its node is turned by `turned`.
    fn slot(&self, end: u32, turned: usize) -> usize {
        let n = self.node(end);
        (self.place[end as usize] + turned) % self.ends[n].len()
    }

    /// Where the line of a slot leads if that is where the arc of this end should lead: the slot there.
    fn leads(&self, end: u32, slot: usize) -> Option<usize> {
        let (marched, to, at) = self.spokes[self.node(end)][slot].as_ref().ok()?;
        let length = self.runs[end as usize / 2].length;
        let right = *to == self.node(end ^ 1) && (marched.length - length).abs() <= LENGTH * length + self.exact;
        right.then_some(*at)
    }

    /// How good it is to turn a node by `turned`: ends whose line is also that of the other end, ends whose line leads
    /// where it should, ends that agree with their chain.
    fn score(&self, n: usize, turned: usize, others: bool) -> [usize; 3] {
        let mut score = [0; 3];
        for &end in &self.ends[n] {
            let slot = self.slot(end, turned);
            let other = self.node(end ^ 1);
            let there = self.slot(end ^ 1, if other == n { turned } else { self.turned[other] });
            let (to, back) = (self.leads(end, slot), self.leads(end ^ 1, there));
            score[0] += usize::from(others && (to == Some(there) || back == Some(slot)));
            score[1] += usize::from(to.is_some());
            score[2] += usize::from(self.hints[end as usize] == Some(slot));
        }
        score
    }

    /// The line of each arc, and whether it runs from the second node to the first.
    fn arcs(mut self) -> Result<Vec<(Marched, bool)>, TraceError> {
        for round in 0..ROUNDS {
            let before = self.turned.clone();
            for n in 0..self.ends.len() {
                if self.layout.nodes[n].boundary {
                    continue;
                }
                let now = self.turned[n];
                let best = (0..self.ends[n].len())
                    .max_by_key(|&t| (self.score(n, t, round > 0), t == now, std::cmp::Reverse(t)));
                self.turned[n] = best.unwrap_or(now);
            }
            if round > 0 && before == self.turned {
                break;
            }
        }
        let mut lines = Vec::with_capacity(self.runs.len());
        for arc in 0..self.runs.len() {
            let ends = [2 * arc as u32, 2 * arc as u32 + 1];
            let slots = ends.map(|e| self.slot(e, self.turned[self.node(e)]));
            let fits = |i: usize| self.leads(ends[i], slots[i]) == Some(slots[1 - i]);
            let Some(i) = [0, 1].into_iter().find(|&i| fits(i)) else {
                return Err(self.failure(arc, ends[0], slots[0]));
            };
            if let Ok((marched, ..)) = &self.spokes[self.node(ends[i])][slots[i]] {
                lines.push((marched.clone(), i == 1));
            }
        }
        Ok(lines)
    }

    fn failure(&self, arc: usize, end: u32, slot: usize) -> TraceError {
        match &self.spokes[self.node(end)][slot] {
            Err(Stop::Fold(face)) => TraceError::Fold { arc, face: *face },
            Err(Stop::Boundary(face) | Stop::Length(face)) => TraceError::Lost { arc, face: *face },
            Err(Stop::Vertex(v)) => TraceError::Lost { arc, face: self.mesh.face(self.mesh.vertex_halfedge(*v)) },
            Ok((marched, node, _)) => TraceError::Strayed {
                arc,
                node: *node,
                length: marched.length,
                expected_node: self.node(end ^ 1),
                expected: self.runs[arc].length,
            },
        }
    }
}

/// Rounds of turning nodes to fit their neighbours; agreement spreads from nodes without choice, mostly in one.
const ROUNDS: usize = 8;

/// The node at each vertex of a mesh, or `u32::MAX`.
pub(super) fn nodes_at(mesh: &TriMesh, node_vertex: &[VertexId]) -> Vec<u32> {
    let mut node = vec![u32::MAX; mesh.n_vertices()];
    for (n, v) in (0u32..).zip(node_vertex) {
        node[v.index()] = n;
    }
    node
}

/// The ends of arcs around each node counter-clockwise, as twice the arc plus one at its second node; at the boundary
/// beginning with the one that has the surface on its left only.
fn ends_around(layout: &QuadLayout) -> Result<Vec<Vec<u32>>, TraceError> {
    let mut next = vec![u32::MAX; 2 * layout.arcs.len()];
    let mut has_previous = vec![false; next.len()];
    for patch in &layout.patches {
        for i in 0..4 {
            let (leaving, arriving) = (patch.sides[i], patch.sides[(i + 3) % 4]);
            let after = 2 * arriving.0 + u32::from(arriving.1);
            next[(2 * leaving.0 + u32::from(!leaving.1)) as usize] = after;
            has_previous[after as usize] = true;
        }
    }
    let mut ends: Vec<Vec<u32>> = vec![Vec::new(); layout.nodes.len()];
    let mut count = vec![0; layout.nodes.len()];
    let node = |e: u32| layout.arcs[e as usize / 2].nodes[e as usize % 2] as usize;
    for e in 0..next.len() as u32 {
        count[node(e)] += 1;
    }
    // First the ends that begin a fan, then any: a closed fan may begin anywhere.
    for begins in [true, false] {
        for first in (0..next.len() as u32).filter(|&e| !begins || !has_previous[e as usize]) {
            let around = &mut ends[node(first)];
            if !around.is_empty() {
                continue;
            }
            let mut e = first;
            while e != u32::MAX && around.len() < next.len() && (around.is_empty() || e != first) {
                around.push(e);
                e = next[e as usize];
            }
        }
    }
    match (0..ends.len()).find(|&n| ends[n].len() != count[n]) {
        Some(node) => Err(TraceError::Order { node }),
        None => Ok(ends),
    }
}

/// Moves the vertices inside a line, which are no nodes, onto it in the map.
fn straighten(mesh: &TriMesh, map: &mut SeamlessMap, steps: &[Step]) {
    for step in steps.iter().skip(1).take(steps.len().saturating_sub(2)) {
        let Step::Vertex(corner, line) = *step else { continue };
        let off = line.off(map.uv[corner.index() / 3][corner.index() % 3]);
        let shift = -off * turn(DVec2::Y, i32::from(line.heading));
        // All first, then moved: on the way around, changes of chart must be those of the map as it was.
        let mut fan = Vec::new();
        for clockwise in [false, true] {
            let (mut at, mut moved) = (corner, shift);
            loop {
                if fan.iter().all(|&(h, _)| h != at) {
                    fan.push((at, moved));
                }
                let over = if clockwise { at } else { mesh.prev(at) };
                let (Some(g), Some(change)) = (mesh.twin(over), map.transition(mesh, over)) else { break };
                at = if clockwise { mesh.next(g) } else { g };
                moved = turn(moved, i32::from(change.turns));
                if at == corner {
                    break;
                }
            }
        }
        for (h, moved) in fan {
            map.uv[h.index() / 3][h.index() % 3] += moved;
        }
    }
}

fn points(lines: &Isolines, steps: &[Step]) -> Vec<Point> {
    let point = |s: &Step| match *s {
        Step::Vertex(corner, _) => Point::Vertex(lines.mesh.origin(corner)),
        Step::Edge(h, line) => Point::Edge(h, lines.crossing(h, &line)),
    };
    steps.iter().map(point).collect()
}

/// The triangle of a crossing that is not inside its edge.
fn misplaced(mesh: &TriMesh, points: &[Point]) -> Option<FaceId> {
    points.iter().find_map(|p| match *p {
        Point::Edge(h, t) => (!(t > 0.0 && t < 1.0)).then(|| mesh.face(h)),
        Point::Vertex(_) => None,
    })
}

/// A face of each patch: that to the left of its first side.
fn seeds(layout: &QuadLayout, mesh: &TriMesh, paths: &[Vec<u32>]) -> Result<Vec<u32>, TraceError> {
    let seed = |(patch, p): (usize, &crate::layout::Patch)| {
        let (arc, forward) = p.sides[0];
        let path = &paths[arc as usize];
        let n = path.len();
        let (from, to) = if forward { (path[0], path[1]) } else { (path[n - 1], path[n - 2]) };
        let h = mesh.outgoing(VertexId(from)).find(|&h| mesh.target(h) == VertexId(to));
        h.map(|h| mesh.face(h).0).ok_or(TraceError::Patch { patch })
    };
    layout.patches.iter().enumerate().map(seed).collect()
}

/// Length in the map along a path of edges, up to each of its vertices.
fn parameters(mesh: &TriMesh, map: &SeamlessMap, path: &[u32]) -> Vec<f64> {
    let mut along = vec![0.0];
    for w in path.windows(2) {
        let joins = |h: HalfedgeId| mesh.target(h) == VertexId(w[1]);
        let ahead = mesh.outgoing(VertexId(w[0])).find(|&h| joins(h));
        let back = || mesh.outgoing(VertexId(w[1])).find(|&h| mesh.target(h) == VertexId(w[0]));
        let at = |h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
        let step = ahead.or_else(back).map_or(0.0, |h| at(h).distance(at(mesh.next(h))));
        along.push(along[along.len() - 1] + step);
    }
    along
}

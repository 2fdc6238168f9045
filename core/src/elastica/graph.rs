//! The elastica graph: directed straight geodesics between near vertices, and the implicit search graph on top.
//!
//! A state of the search is a directed geodesic `e` of `g`. It is followed by the geodesics `f` that leave its end
//! within 30° of straight on; as the geodesics around a vertex are sorted by angle, these are one (cyclic) range,
//! found once. The price of a step is (8.2) of the source:
//!
//! `w(e, f) = |e′| (1 + α ½ (q(e) + q(f))) + β γ² / min(|e|, |f|)`, with `|e′| = γ m / (2 tan ½γ) + ½ ||e| − |f||`.
//!
//! Every number in it is symmetric bit for bit, so that `w(e, f) = w(rev f, rev e)` exactly: the search relies on
//! it, as it lets one distance field serve both ways.

use std::f32::consts::PI;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

use super::unfold::{Corners, EdgeCrossing, Geodesic, Unfolding, direction_in_face};
use crate::mesh::{EdgeId, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::surface::PrincipalCurvature;

/// Index of a state, a directed geodesic of `g`.
pub(super) type State = u32;

/// "No state".
pub(super) const NO_STATE: State = u32::MAX;

/// Most geodesics kept per vertex besides its own edges; the shortest ones. A regular 4-ring has about 60, a
/// 5-ring 90, irregular ones up to twice that; the rest are hubs of slivers, where thousands would lie nearly
/// in one place.
const MAX_GEODESICS: usize = 250;

/// Largest ring looked at from one vertex, for the same reason.
const MAX_RING: usize = 1000;

/// Largest alignment cost of one geodesic, so that degenerate triangles cannot overflow the sums. Ordinary surfaces
/// of diagonal 1 stay below 2000.
const MAX_ALIGNMENT: f64 = 1e6;

/// Shortest length a geodesic counts with, so that the turning cost stays finite.
const MIN_LENGTH: f64 = 1e-9;

/// Vertices per parallel piece of work.
const CHUNK: usize = 256;

/// Weights and size of the graph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticaOptions {
    /// Rings of vertices joined to each vertex, 3 to 5. More rings give finer directions and a slower search.
    pub rings: usize,
    /// Weight of alignment with the principal directions.
    pub alpha: f64,
    /// Weight of the squared geodesic curvature, for a surface of bounding-box diagonal 1.
    pub beta: f64,
    /// Largest turn between two geodesics, in radians; at most a right angle.
    pub max_turn: f64,
    /// What the factor `(|κ₁| − |κ₂|)²` is at sharp edges. The default is what strongly curved parts of ordinary
    /// models have (the largest tenth).
    pub feature_weight: f64,
    /// Largest deviation counted at a sharp edge: 20 is reached less than 3° off the edge.
    pub feature_cap: f64,
    /// Whether boundary edges count as sharp, so that curves end at a right angle.
    pub aligned_boundary: bool,
}

impl Default for ElasticaOptions {
    fn default() -> Self {
        Self {
            rings: 4,
            alpha: 1.0,
            beta: 0.25,
            max_turn: std::f64::consts::FRAC_PI_6,
            feature_weight: 1000.0,
            feature_cap: 20.0,
            aligned_boundary: true,
        }
    }
}

/// Why no graph was built.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum ElasticaError {
    /// Stopped from outside.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Curvatures or sharp-edge flags of another mesh.
    #[error("{given} values given for {expected} elements")]
    WrongLength {
        /// Number of values given.
        given: usize,
        /// Number of vertices or edges.
        expected: usize,
    },
    /// A number of rings, a weight or an angle outside its range.
    #[error("the options of the elastica graph are out of range")]
    BadOptions,
    /// More geodesics than 32-bit indices can name.
    #[error("the mesh is too large for the elastica graph")]
    TooLarge,
}

/// What a step reads of a state.
#[derive(Debug, Clone, Copy)]
pub(super) struct Node {
    /// Tangent angle at the start.
    out: f32,
    /// Tangent angle of the way back, at the end.
    back: f32,
    pub(super) length: f32,
    pub(super) alignment: f32,
}

/// The graph `g` of a mesh, with the turns of `g′` as ranges.
#[derive(Debug)]
pub struct ElasticaGraph {
    pub(super) mesh: Arc<TriMesh>,
    pub(super) corners: Corners,
    pub(super) options: ElasticaOptions,
    /// Whether the mesh has any boundary.
    pub(super) has_boundary: bool,
    /// First state of each vertex, and the end.
    pub(super) first: Vec<u32>,
    pub(super) nodes: Vec<Node>,
    pub(super) target: Vec<u32>,
    pub(super) reverse: Vec<State>,
    /// Per state: where among the states of its end its successors begin, and how many they are.
    window: Vec<(u16, u16)>,
    /// Middle of each geodesic, by face: first entry of each face, then state and angle in the face.
    pub(super) middle_first: Vec<u32>,
    pub(super) middle: Vec<(State, f32)>,
}

/// A geodesic between two vertices, before it has a place in the graph.
#[derive(Debug, Clone, Copy)]
struct Pair {
    ends: [u32; 2],
    angles: [f32; 2],
    length: f32,
    alignment: f32,
    middle_face: u32,
    middle_angle: f32,
}

impl ElasticaGraph {
    /// Joins the vertices of `mesh` (normalised to diagonal 1) by straight geodesics and weighs them by `curvature`
    /// (per vertex) and `sharp` (per edge).
    ///
    /// # Errors
    ///
    /// See [`ElasticaError`].
    pub fn build(
        mesh: Arc<TriMesh>,
        curvature: &[PrincipalCurvature],
        sharp: &[bool],
        options: &ElasticaOptions,
        progress: &Progress,
    ) -> Result<Self, ElasticaError> {
        check_length(curvature.len(), mesh.n_vertices())?;
        check_length(sharp.len(), mesh.n_edges())?;
        let in_range = (1..=8).contains(&options.rings)
            && options.alpha >= 0.0
            && options.beta >= 0.0
            && (0.0..=FRAC_PI_2).contains(&options.max_turn)
            && options.feature_weight >= 0.0
            && options.feature_cap >= 0.0;
        if !in_range {
            return Err(ElasticaError::BadOptions);
        }
        progress.report("Elastica graph", 0.0);
        let corners = Corners::new(&mesh);
        let weights = Weights::new(&mesh, curvature, sharp, options);
        let pairs = geodesics(&mesh, &corners, &weights, options.rings, progress)?;
        progress.report("Elastica graph", 0.8);
        if pairs.len() >= (NO_STATE / 2) as usize {
            return Err(ElasticaError::TooLarge);
        }
        Ok(Self::assemble(mesh, corners, *options, &pairs))
    }

    fn assemble(mesh: Arc<TriMesh>, corners: Corners, options: ElasticaOptions, pairs: &[Pair]) -> Self {
        let mut first = vec![0u32; mesh.n_vertices() + 1];
        for end in pairs.iter().flat_map(|p| p.ends) {
            first[end as usize + 1] += 1;
        }
        prefix_sum(&mut first);
        // Each entry names one direction of a pair: twice its index, plus one for the way from the second end.
        let mut fill = first.clone();
        let mut ways = vec![0u32; 2 * pairs.len()];
        for (i, p) in pairs.iter().enumerate() {
            for side in 0..2 {
                let slot = &mut fill[p.ends[side] as usize];
                ways[*slot as usize] = (2 * i + side) as u32;
                *slot += 1;
            }
        }
        let angle = |way: u32| pairs[way as usize / 2].angles[way as usize % 2];
        for v in 0..mesh.n_vertices() {
            ways[first[v] as usize..first[v + 1] as usize]
                .sort_unstable_by(|&a, &b| angle(a).total_cmp(&angle(b)).then(a.cmp(&b)));
        }
        let mut place = vec![0u32; ways.len()];
        for (state, &way) in ways.iter().enumerate() {
            place[way as usize] = state as u32;
        }
        let node = |&way: &u32| {
            let p = &pairs[way as usize / 2];
            Node { out: angle(way), back: angle(way ^ 1), length: p.length, alignment: p.alignment }
        };
        let nodes: Vec<Node> = ways.par_iter().map(node).collect();
        let target: Vec<u32> = ways.iter().map(|&w| pairs[w as usize / 2].ends[1 - w as usize % 2]).collect();
        let reverse = ways.iter().map(|&w| place[w as usize ^ 1]).collect();
        let (middle_first, middle) = by_middle(mesh.n_faces(), pairs, &place);
        let has_boundary = mesh.edges().any(|e| mesh.is_boundary_edge(e));
        let mut graph = Self {
            mesh,
            corners,
            options,
            has_boundary,
            first,
            nodes,
            target,
            reverse,
            window: Vec::new(),
            middle_first,
            middle,
        };
        graph.window = (0..graph.n_states()).into_par_iter().map(|e| graph.find_window(e as State)).collect();
        graph
    }

    fn find_window(&self, e: State) -> (u16, u16) {
        let states = self.leaving(VertexId(self.target[e as usize]));
        let n = (states.end - states.start) as usize;
        let max_turn = self.options.max_turn as f32;
        let allowed = |i: usize| self.turn(e, states.start + (i % n) as u32) <= max_turn;
        let Some(start) = (0..n).find(|&i| allowed(i) && !allowed(i + n - 1)) else {
            return (0, if n > 0 && allowed(0) { n as u16 } else { 0 });
        };
        let count = (1..n).find(|&i| !allowed(start + i)).unwrap_or(n);
        (start as u16, count as u16)
    }

    /// Turning angle from `e` into `f`, which leaves the end of `e`. The same number from `rev f` into `rev e`.
    #[inline]
    pub(super) fn turn(&self, e: State, f: State) -> f32 {
        ((self.nodes[f as usize].out - self.nodes[e as usize].back).abs() - PI).abs()
    }

    /// The mesh the graph lies on.
    pub fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    /// Number of search states, the directed geodesics.
    pub fn n_states(&self) -> usize {
        self.nodes.len()
    }

    /// Number of steps between states.
    pub fn n_steps(&self) -> usize {
        self.window.iter().map(|w| w.1 as usize).sum()
    }

    /// Bytes held, without the mesh.
    pub fn bytes(&self) -> usize {
        self.n_states() * (size_of::<Node>() + 8 + 4) + self.middle.len() * 8 + self.mesh.n_halfedges() * 8
    }

    /// The options it was built with.
    pub fn options(&self) -> &ElasticaOptions {
        &self.options
    }

    /// The states that leave `v`, counter-clockwise.
    #[inline]
    pub(super) fn leaving(&self, v: VertexId) -> std::ops::Range<State> {
        self.first[v.index()]..self.first[v.index() + 1]
    }

    /// The states that may follow `e`.
    #[inline]
    pub(super) fn successors(&self, e: State) -> impl Iterator<Item = State> + use<> {
        let at = self.target[e as usize] as usize;
        let (first, end) = (self.first[at], self.first[at + 1]);
        let (offset, count) = self.window[e as usize];
        let start = first + u32::from(offset);
        let wrapped = (start + u32::from(count)).saturating_sub(end);
        (start..start + u32::from(count) - wrapped).chain(first..first + wrapped)
    }

    /// Whether `f` may follow `e`.
    #[inline]
    pub(super) fn follows(&self, e: State, f: State) -> bool {
        self.leaving(VertexId(self.target[e as usize])).contains(&f) && self.turn(e, f) <= self.options.max_turn as f32
    }

    /// Parts of the price of the step from `e` into `f`: length, alignment and bending, weighted.
    #[inline]
    pub(super) fn step_parts(&self, e: State, f: State) -> [f32; 3] {
        let (a, b) = (&self.nodes[e as usize], &self.nodes[f as usize]);
        let turn = self.turn(e, f);
        let least = a.length.min(b.length);
        // ½γ / tan ½γ by its series; the next term is below 1e-6 at 30°.
        let x = 0.25 * turn * turn;
        let arc = 1.0 - x * (1.0 / 3.0 + x * (1.0 / 45.0 + x * (2.0 / 945.0)));
        let length = arc * least + 0.5 * (a.length - b.length).abs();
        let alignment = self.options.alpha as f32 * 0.5 * (a.alignment + b.alignment) * length;
        [length, alignment, self.options.beta as f32 * turn * turn / least]
    }

    /// Price of the step from `e` into `f`.
    #[inline]
    pub(super) fn step(&self, e: State, f: State) -> f32 {
        let [length, alignment, bending] = self.step_parts(e, f);
        length + alignment + bending
    }

    /// Price of half of a state, where an open curve ends on the boundary: length and alignment.
    #[inline]
    pub(super) fn half_parts(&self, e: State) -> [f32; 3] {
        let node = &self.nodes[e as usize];
        let length = 0.5 * node.length;
        [length, self.options.alpha as f32 * node.alignment * length, 0.0]
    }

    /// The vertex a state starts at.
    #[inline]
    pub(super) fn origin(&self, e: State) -> VertexId {
        VertexId(self.target[self.reverse[e as usize] as usize])
    }

    /// Tangent angle at which a state leaves its origin, in the plane of the fan there.
    #[inline]
    pub(super) fn out_angle(&self, e: State) -> f64 {
        f64::from(self.nodes[e as usize].out)
    }

    /// Unit vector in which a state leaves its origin.
    pub(super) fn departure(&self, e: State) -> DVec3 {
        let (h, local) = self.corners.locate(&self.mesh, self.origin(e), self.out_angle(e));
        direction_in_face(&self.mesh, h, local)
    }
}

fn check_length(given: usize, expected: usize) -> Result<(), ElasticaError> {
    if given == expected { Ok(()) } else { Err(ElasticaError::WrongLength { given, expected }) }
}

fn prefix_sum(counts: &mut [u32]) {
    for i in 1..counts.len() {
        counts[i] += counts[i - 1];
    }
}

fn by_middle(n_faces: usize, pairs: &[Pair], place: &[u32]) -> (Vec<u32>, Vec<(State, f32)>) {
    let mut first = vec![0u32; n_faces + 1];
    for p in pairs {
        first[p.middle_face as usize + 1] += 1;
    }
    prefix_sum(&mut first);
    let mut fill = first.clone();
    let mut middle = vec![(0, 0.0); pairs.len()];
    for (i, p) in pairs.iter().enumerate() {
        let slot = &mut fill[p.middle_face as usize];
        middle[*slot as usize] = (place[2 * i], p.middle_angle);
        *slot += 1;
    }
    (first, middle)
}

/// Alignment cost of directions (7.3 of the thesis summary: deviation times anisotropy, features apart).
struct Weights<'a> {
    mesh: &'a TriMesh,
    curvature: &'a [PrincipalCurvature],
    /// Per edge: whether curves should cross it at a right angle.
    crease: Vec<bool>,
    /// Per vertex: whether a crease ends or passes there.
    on_crease: Vec<bool>,
    options: &'a ElasticaOptions,
}

impl<'a> Weights<'a> {
    fn new(
        mesh: &'a TriMesh,
        curvature: &'a [PrincipalCurvature],
        sharp: &[bool],
        options: &'a ElasticaOptions,
    ) -> Self {
        let is_crease = |e: EdgeId| sharp[e.index()] || (options.aligned_boundary && mesh.is_boundary_edge(e));
        let crease: Vec<bool> = mesh.edges().map(is_crease).collect();
        let mut on_crease = vec![false; mesh.n_vertices()];
        for e in mesh.edges().filter(|e| crease[e.index()]) {
            for v in mesh.edge_vertices(e) {
                on_crease[v.index()] = true;
            }
        }
        Self { mesh, curvature, crease, on_crease, options }
    }

    /// Alignment cost of leaving `v` in the unit direction `t`.
    fn at_vertex(&self, v: VertexId, t: DVec3) -> f64 {
        if self.on_crease[v.index()] {
            let along = self.crease_directions(v).map(|s| s.dot(t)).fold(0.0, f64::max);
            return self.feature((1.0 - along * along).max(0.0).sqrt());
        }
        let c = &self.curvature[v.index()];
        let (x, y) = (t.dot(c.d_min), t.dot(c.d_max));
        let longer = x.abs().max(y.abs());
        let deviation = if longer > 0.0 { x.hypot(y) / longer - 1.0 } else { 0.0 };
        deviation * (c.k_min.abs() - c.k_max.abs()).powi(2)
    }

    /// Cost of meeting a crease at an angle of the given sine.
    fn feature(&self, sine: f64) -> f64 {
        let cap = self.options.feature_cap;
        let deviation = if sine * (1.0 + cap) > 1.0 { 1.0 / sine - 1.0 } else { cap };
        self.options.feature_weight * deviation
    }

    /// Unit vectors from `v` along its creases.
    fn crease_directions(&self, v: VertexId) -> impl Iterator<Item = DVec3> + '_ {
        let mesh = self.mesh;
        let last = mesh.outgoing(v).map(move |h| mesh.prev(h)).find(move |&h| mesh.twin(h).is_none());
        let spokes = mesh.outgoing(v).map(move |h| (h, mesh.vector(h)));
        spokes
            .chain(last.map(|h| (h, -mesh.vector(h))))
            .filter(|(h, _)| self.crease[mesh.edge(*h).index()])
            .map(|(_, vector)| vector.normalize_or_zero())
    }

    /// Alignment cost of a geodesic: the mean of its ends, and what the creases it crosses on its way add.
    fn of_geodesic(&self, v: VertexId, g: &Geodesic, crossings: &[EdgeCrossing]) -> f64 {
        let departure = direction_in_face(self.mesh, g.start, g.start_angle);
        let arrival = direction_in_face(self.mesh, g.end, g.end_angle);
        let ends = 0.5 * (self.at_vertex(v, departure) + self.at_vertex(g.target, arrival));
        let crossed = crossings
            .iter()
            .filter(|c| self.crease[self.mesh.edge(c.halfedge).index()])
            .map(|c| self.feature(c.angle.sin().abs()))
            .fold(0.0, f64::max);
        (ends + crossed).min(MAX_ALIGNMENT)
    }
}

/// The rings around a vertex, with marks that are reused.
struct Rings {
    mark: Vec<u32>,
    members: Vec<VertexId>,
}

impl Rings {
    /// Marks the vertices within `rings` edges of `v`.
    fn gather(&mut self, mesh: &TriMesh, v: VertexId, rings: usize) {
        self.members.clear();
        self.members.push(v);
        self.mark[v.index()] = v.0;
        let mut done = 0;
        for _ in 0..rings {
            let end = self.members.len();
            for i in done..end {
                for h in mesh.outgoing(self.members[i]) {
                    for w in [mesh.target(h), mesh.opposite(h)] {
                        if self.mark[w.index()] != v.0 && self.members.len() < MAX_RING {
                            self.mark[w.index()] = v.0;
                            self.members.push(w);
                        }
                    }
                }
            }
            done = end;
        }
    }
}

/// All geodesics of the graph, each once, from its smaller to its larger vertex.
fn geodesics(
    mesh: &TriMesh,
    corners: &Corners,
    weights: &Weights,
    rings: usize,
    progress: &Progress,
) -> Result<Vec<Pair>, Cancelled> {
    let n = mesh.n_vertices();
    let chunks: Vec<(Vec<Pair>, Vec<f32>)> = (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map(|c| {
            progress.check()?;
            let mut ring = Rings { mark: vec![u32::MAX; n], members: Vec::new() };
            let mut work = Unfolding::default();
            let (mut pairs, mut limits) = (Vec::new(), Vec::new());
            for v in (c * CHUNK..((c + 1) * CHUNK).min(n)).map(VertexId::new) {
                ring.gather(mesh, v, rings);
                limits.push(from_vertex(mesh, corners, weights, v, &ring, &mut work, &mut pairs));
            }
            Ok((pairs, limits))
        })
        .collect::<Result<_, Cancelled>>()?;
    let limits: Vec<f32> = chunks.iter().flat_map(|c| &c.1).copied().collect();
    let kept = |p: &Pair| p.ends.iter().all(|&v| p.length <= limits[v as usize]) || is_edge(mesh, p);
    Ok(chunks.iter().flat_map(|c| &c.0).copied().filter(kept).collect())
}

fn is_edge(mesh: &TriMesh, p: &Pair) -> bool {
    edge_between(mesh, VertexId(p.ends[0]), VertexId(p.ends[1])).is_some()
}

/// A half-edge along the edge between two vertices: from `v` to `w`, or back if only that exists.
pub(super) fn edge_between(mesh: &TriMesh, v: VertexId, w: VertexId) -> Option<HalfedgeId> {
    mesh.outgoing(v).find_map(|h| {
        let back = mesh.prev(h);
        if mesh.target(h) == w {
            Some(h)
        } else {
            (mesh.origin(back) == w && mesh.twin(back).is_none()).then_some(back)
        }
    })
}

/// Appends the geodesics from `v` to larger vertices; returns the length beyond which `v` wants none.
fn from_vertex(
    mesh: &TriMesh,
    corners: &Corners,
    weights: &Weights,
    v: VertexId,
    ring: &Rings,
    work: &mut Unfolding,
    pairs: &mut Vec<Pair>,
) -> f32 {
    let mut found: Vec<Geodesic> = Vec::new();
    work.all(
        mesh,
        v,
        |w| ring.mark[w.index()] == v.0,
        |g| {
            if g.target != v {
                found.push(g);
            }
        },
    );
    // Mesh edges are visited first and stay; of the others the shortest to each vertex stays.
    found.sort_by(|a, b| {
        let key = |g: &Geodesic| (g.target, !g.is_edge());
        key(a).cmp(&key(b)).then(a.length.total_cmp(&b.length))
    });
    found.dedup_by_key(|g| g.target);
    let limit = if found.len() > MAX_GEODESICS {
        let mut lengths: Vec<f64> = found.iter().map(|g| g.length).collect();
        *lengths.select_nth_unstable_by(MAX_GEODESICS, f64::total_cmp).1 as f32
    } else {
        f32::INFINITY
    };
    for g in found.iter().filter(|g| g.target > v) {
        let crossings = work.crossings(g);
        let (middle_face, middle_angle) = middle(mesh, g, &crossings);
        let angle = |h: HalfedgeId, local: f64| {
            let tangent = corners.tangent(mesh, h, local);
            // An inner fan closes at 2π, where its first spoke is again.
            if tangent >= TAU && !mesh.is_boundary_vertex(mesh.origin(h)) { tangent - TAU } else { tangent }
        };
        pairs.push(Pair {
            ends: [v.0, g.target.0],
            angles: [angle(g.start, g.start_angle) as f32, angle(g.end, g.end_angle) as f32],
            length: g.length.max(MIN_LENGTH) as f32,
            alignment: weights.of_geodesic(v, g, &crossings) as f32,
            middle_face: middle_face.0,
            middle_angle: middle_angle as f32,
        });
    }
    limit
}

/// The triangle that holds the middle of a geodesic, and the angle of its direction there from side 0.
fn middle(mesh: &TriMesh, g: &Geodesic, crossings: &[EdgeCrossing]) -> (FaceId, f64) {
    let half = 0.5 * g.length;
    let (h, angle) = match crossings.iter().find(|c| c.distance >= half) {
        Some(c) => (c.halfedge, c.angle),
        None => (g.end, g.end_angle + std::f64::consts::PI),
    };
    (mesh.face(h), side_angle(mesh, h) + angle)
}

/// Angle from side 0 of its triangle to a half-edge, counter-clockwise.
fn side_angle(mesh: &TriMesh, h: HalfedgeId) -> f64 {
    let [first, second, _] = mesh.face_halfedges(mesh.face(h));
    match h.0 % 3 {
        0 => 0.0,
        1 => std::f64::consts::PI - mesh.corner_angle(second),
        _ => std::f64::consts::PI + mesh.corner_angle(first),
    }
}

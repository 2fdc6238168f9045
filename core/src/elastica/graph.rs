//! The elastica graph: directed straight geodesics between near vertices, and the implicit search graph on top.
//!
//! A state of the search is a directed geodesic `e` of `g`. It is followed by the geodesics `f` that leave its end
//! within 30° of straight on; as the geodesics around a vertex are sorted by angle, these are one (cyclic) range,
//! found once, and the prices of steps into them, which are (8.2) of the source, are kept in their order:
//!
//! `w(e, f) = |e′| (1 + α ½ (q(e) + q(f))) + β γ² / min(|e|, |f|)`, with `|e′| = γ m / (2 tan ½γ) + ½ ||e| − |f||`.
//!
//! Every number in it is symmetric bit for bit, so that `w(e, f) = w(rev f, rev e)` exactly: the search relies on
//! it, as it lets one distance field serve both ways.

use std::f64::consts::FRAC_PI_2;
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use rayon::prelude::*;
use thiserror::Error;

use super::alignment_cost::Weights;
use super::geodesics::{Pair, geodesics};
use super::step_costs::Window;
use super::unfold::{Corners, direction_in_face};
use crate::mesh::{TriMesh, VertexId};
use crate::progress::{Cancelled, Progress};
use crate::surface::PrincipalCurvature;

/// Index of a state, a directed geodesic of `g`.
pub(super) type State = u32;

/// "No state".
pub(super) const NO_STATE: State = u32::MAX;

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
    pub(super) out: f32,
    /// Tangent angle of the way back, at the end.
    pub(super) back: f32,
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
    pub(super) window: Vec<Window>,
    /// The prices of all steps.
    pub(super) prices: Vec<f32>,
    /// Middle of each geodesic, by face: first entry of each face, then state and angle in the face.
    pub(super) middle_first: Vec<u32>,
    pub(super) middle: Vec<(State, f32)>,
    /// Per state the least cost of a way to the boundary, once it was asked for.
    pub(super) ways_out: OnceLock<Vec<f32>>,
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
        Self::assemble(mesh, corners, *options, &pairs)
    }

    fn assemble(
        mesh: Arc<TriMesh>,
        corners: Corners,
        options: ElasticaOptions,
        pairs: &[Pair],
    ) -> Result<Self, ElasticaError> {
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
        let mut around = Vec::with_capacity(mesh.n_vertices());
        let mut rest = &mut ways[..];
        for v in 0..mesh.n_vertices() {
            let (here, after) = rest.split_at_mut((first[v + 1] - first[v]) as usize);
            around.push(here);
            rest = after;
        }
        around
            .into_par_iter()
            .for_each(|here| here.sort_unstable_by(|&a, &b| angle(a).total_cmp(&angle(b)).then(a.cmp(&b))));
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
            prices: Vec::new(),
            middle_first,
            middle,
            ways_out: OnceLock::new(),
        };
        graph.find_steps()?;
        Ok(graph)
    }

    /// The mesh the graph lies on.
    pub fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    /// Number of search states, the directed geodesics.
    pub fn n_states(&self) -> usize {
        self.nodes.len()
    }

    /// Bytes held, without the mesh.
    pub fn bytes(&self) -> usize {
        self.n_states() * (size_of::<Node>() + size_of::<Window>() + 8)
            + self.prices.len() * size_of::<f32>()
            + self.middle.len() * 8
            + self.mesh.n_halfedges() * 8
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

//! The elastica graph: directed straight geodesics between nearby vertices, with the implicit search graph on top.
//!
//! A state of the search is a directed geodesic of `g`, that is a node of `g′`. The states that leave a vertex are
//! numbered consecutively, counter-clockwise. The states that may follow a state leave its end within the largest turning
//! angle, so they are one cyclic range of those numbers ([`Successors`]). The costs of the steps into them are stored in
//! the same order ([`super::step_costs`]).
//!
//! All stored numbers are symmetric bit for bit, so `w(e, f) = w(rev f, rev e)` holds exactly. The search relies on it: one
//! distance field serves both ways.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::options::ElasticaOptions;
use super::unfold::{Corners, direction_in_face};
use crate::mesh::{TriMesh, VertexId};

/// Index of a state, a directed geodesic of `g`.
pub(super) type State = u32;

/// The index that stands for no state.
pub(super) const NO_STATE: State = u32::MAX;

/// The numbers of a state that its step costs depend on.
#[derive(Debug, Clone, Copy)]
pub(super) struct DirectedGeodesic {
    /// Tangent angle at which it leaves its origin, in radians.
    pub(super) out_angle: f32,
    /// Tangent angle of its reverse at its target, in radians.
    pub(super) back_angle: f32,
    /// Length, on a surface of model size 1.
    pub(super) length: f32,
    /// Alignment cost `q` per unit length.
    pub(super) alignment: f32,
}

/// The states that may follow a state: a cyclic range of the states around its target.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Successors {
    /// The first of them.
    pub(super) start: State,
    /// Position of `start` among the states of the vertex.
    pub(super) offset: u16,
    /// How many they are.
    pub(super) count: u16,
    /// How many of them, at the end of the range, are the first states of the vertex.
    pub(super) wrapped: u16,
    /// Index of the cost of the first step into them in [`ElasticaGraph::step_costs`].
    pub(super) costs: u32,
}

/// The graph `g` of a mesh, with the edges of `g′` as ranges.
#[derive(Debug)]
pub struct ElasticaGraph {
    pub(super) mesh: Arc<TriMesh>,
    pub(super) corners: Corners,
    pub(super) options: ElasticaOptions,
    pub(super) has_boundary: bool,
    /// First state of each vertex, and the number of states.
    pub(super) first: Vec<u32>,
    pub(super) geodesics: Vec<DirectedGeodesic>,
    /// Per state: the vertex it ends at.
    pub(super) target: Vec<u32>,
    /// Per state: the same geodesic in the other direction.
    pub(super) reverse: Vec<State>,
    pub(super) successors: Vec<Successors>,
    /// Costs of all steps, grouped by the state they leave.
    pub(super) step_costs: Vec<f32>,
    /// First entry of each face in [`Self::midpoints`], and the number of entries.
    pub(super) first_midpoint: Vec<u32>,
    /// The geodesics by the face that holds their midpoint: one of the two states, and the angle of its direction from
    /// side 0 of the face.
    pub(super) midpoints: Vec<(State, f32)>,
    /// Per state: the least cost from its midpoint to the boundary, computed at the first request.
    pub(super) boundary_costs: OnceLock<Vec<f32>>,
}

impl ElasticaGraph {
    /// The mesh that the graph was built on.
    pub fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    /// Number of search states, the directed geodesics.
    pub fn n_states(&self) -> usize {
        self.geodesics.len()
    }

    /// Memory held, in bytes, without the mesh.
    pub fn bytes(&self) -> usize {
        self.n_states() * (size_of::<DirectedGeodesic>() + size_of::<Successors>() + 8)
            + self.step_costs.len() * size_of::<f32>()
            + self.midpoints.len() * 8
            + self.mesh.n_halfedges() * 8
    }

    /// The options it was built with.
    pub fn options(&self) -> &ElasticaOptions {
        &self.options
    }

    /// The states that leave `v`, counter-clockwise.
    #[inline]
    pub(super) fn outgoing(&self, v: VertexId) -> Range<State> {
        self.first[v.index()]..self.first[v.index() + 1]
    }

    /// The state in the other direction.
    #[inline]
    pub(super) fn reversed(&self, e: State) -> State {
        self.reverse[e as usize]
    }

    /// The vertex a state ends at.
    #[inline]
    pub(super) fn target(&self, e: State) -> VertexId {
        VertexId(self.target[e as usize])
    }

    /// The vertex a state starts at.
    #[inline]
    pub(super) fn origin(&self, e: State) -> VertexId {
        self.target(self.reversed(e))
    }

    /// Tangent angle at which a state leaves its origin, in radians.
    #[inline]
    pub(super) fn out_angle(&self, e: State) -> f64 {
        f64::from(self.geodesics[e as usize].out_angle)
    }

    /// Unit vector in which a state leaves its origin.
    pub(super) fn departure(&self, e: State) -> DVec3 {
        let (h, local) = self.corners.locate(&self.mesh, self.origin(e), self.out_angle(e));
        direction_in_face(&self.mesh, h, local)
    }
}

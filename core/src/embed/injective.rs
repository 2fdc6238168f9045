//! Maps without folds from the drawing of a layout.
//!
//! A drawing with every patch mapped one to one onto its rectangle, opposite sides of equal length, is a seamless map of
//! the whole surface without folds, however bad its shape. From there the energy of [`crate::param::InjectiveEnergy`] is
//! made less, with the arcs free to move across the surface: only that they are isolines is kept.

use glam::{DVec2, DVec3};

use super::EmbeddingError;
use super::descent::Surface;
use super::net::Net;
use super::pipeline::Job;
use super::solver::{Solver, State};
use super::spacing::Spacing;
use super::straight::Crossroads;
use crate::dual::{Mark, RefinedMesh};
use crate::field::{GuidedSystem, Metric};
use crate::layout::{Embedding, PatchMap, QuadLayout, map_patches};
use crate::mesh::{FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{InjectiveEnergy, Shape};
use crate::progress::Progress;
use crate::surface::PrincipalCurvature;

/// A drawing on a mesh of its own, with a map of each triangle in the chart of its patch.
pub(super) struct Drawn {
    /// The surface with all arcs as edge paths.
    pub mesh: TriMesh,
    /// Triangle of the original surface that each triangle lies in.
    pub base_face: Vec<u32>,
    /// The layout drawn on it.
    pub embedding: Embedding,
    /// The coordinates of the corners of each triangle, in the chart of its patch.
    pub uv: Vec<[DVec2; 3]>,
    /// Triangles that are turned over or flat.
    pub flipped: usize,
}

impl Drawn {
    /// Maps the patches of a drawing and puts them together again.
    pub(super) fn new(layout: &QuadLayout, drawing: &Embedding, progress: &Progress) -> Result<Self, EmbeddingError> {
        let maps = map_patches(layout, drawing, progress)?;
        let flipped = maps.iter().map(|m| m.flipped).sum();
        let mut positions: Vec<DVec3> = drawing.mesh.positions.clone();
        let (mut faces, mut base_face, mut uv) = (Vec::new(), Vec::new(), Vec::new());
        let mut seeds = Vec::with_capacity(maps.len());
        for PatchMap { mesh, whole, base_face: base, uv: at, .. } in &maps {
            let first_new = positions.len() - whole.len();
            let global = |v: usize| whole.get(v).copied().unwrap_or((first_new + v) as u32);
            positions.extend(&mesh.positions()[whole.len()..]);
            seeds.push(faces.len() as u32);
            for f in mesh.faces() {
                let corners = mesh.face_vertices(f);
                faces.push(corners.map(|v| global(v.index())));
                uv.push(corners.map(|v| at[v.index()]));
            }
            base_face.extend(base);
        }
        let mesh = TriMesh::from_faces(positions, &faces)?;
        let mut refined = RefinedMesh::new(&mesh);
        for (a, path) in drawing.arcs.iter().enumerate() {
            for w in path.windows(2) {
                let h = refined.find(w[0], w[1]).ok_or(EmbeddingError::Arc { arc: a })?;
                refined.set_mark(h, Mark::Arc(a as u32));
            }
        }
        let embedding = Embedding {
            base_face: (0..mesh.n_faces() as u32).collect(),
            nodes: drawing.nodes.clone(),
            arcs: drawing.arcs.clone(),
            arc_parameters: drawing.arc_parameters.clone(),
            seeds,
            mesh: refined,
        };
        Ok(Self { mesh, base_face, embedding, uv, flipped })
    }
}

/// How steps are counted when nothing else ends them: Newton's method has long converged by then.
const STEPS: usize = 60;
/// How much size counts beside shape: enough to keep patches of one strip from shrinking away, little enough not to be
/// paid for by angles.
const SIZE: f64 = 0.1;

/// The map of least energy without folds, on the mesh of the drawing.
pub(super) fn solve(job: &Job<'_>, anisotropy: f64, progress: &Progress) -> Result<(State, Vec<u32>), EmbeddingError> {
    let Job { surface, layout, settings, .. } = *job;
    let drawn = Drawn::new(layout, job.drawing, progress)?;
    let net = Net::new(&drawn.mesh, &drawn.embedding, layout, job.headings)?;
    let sharp = drawn.sharp(&surface);
    let curvature = drawn.curvature(&surface);
    let mut roads = Crossroads::new(layout, |_| true);
    roads.hold_all();
    let spacing = Spacing::none(layout.chords);
    let guided = GuidedSystem::new(&net.mesh)?;
    let metric = Metric::new(&net.mesh);
    let mut solver = Solver {
        curvature: &curvature,
        sharp: &sharp,
        roads: &roads,
        spacing: &spacing,
        least: 0.0,
        guided: &guided,
        seamless: None,
        sizes: None,
        settings,
        features: false,
    };
    let mut state = solver.solve(net, metric, None, progress)?;
    let Some(mut system) = solver.seamless else { return Ok((state, drawn.base_face)) };
    let free = system.fit(&state.metric, &drawn.uv)?;
    let shape = Shape { anisotropy, size: SIZE };
    let energy = InjectiveEnergy::new(&state.metric, &state.field.angle, &state.objective, shape);
    let before = drawn.flipped;
    let Some(mut at) = system.injective(&energy, free) else {
        tracing::debug!(before, "the drawing folds");
        return Ok((state, drawn.base_face));
    };
    let newton = system.newton()?;
    system.descend(&newton, &energy, &mut at, STEPS, progress)?;
    state.solution.map = at.map;
    state.solution.free = at.free;
    state.solution.energy = at.energy;
    Ok((state, drawn.base_face))
}

impl Drawn {
    /// Whether each edge lies on a sharp edge of the surface.
    fn sharp(&self, surface: &Surface<'_>) -> Vec<bool> {
        let base = |h: HalfedgeId| FaceId(self.base_face[h.index() / 3]);
        let between = |f: FaceId, g: FaceId| {
            let sides = surface.mesh.face_halfedges(f).into_iter();
            let mut shared = sides.filter(|&s| surface.mesh.twin(s).is_some_and(|t| surface.mesh.face(t) == g));
            shared.any(|s| surface.sharp[surface.mesh.edge(s).index()])
        };
        let lies = |h: HalfedgeId| {
            let t = self.mesh.twin(h)?;
            Some(base(h) != base(t) && between(base(h), base(t)))
        };
        self.mesh.edges().map(|e| lies(self.mesh.halfedge(e)).unwrap_or(false)).collect()
    }

    /// The principal curvatures at the vertices, for those added that of the nearest corner of their triangle.
    fn curvature(&self, surface: &Surface<'_>) -> Vec<PrincipalCurvature> {
        let n = surface.mesh.n_vertices();
        let at = |v: VertexId| {
            if v.index() < n {
                return surface.curvature[v.index()];
            }
            let face = FaceId(self.base_face[self.mesh.vertex_halfedge(v).index() / 3]);
            let corners = surface.mesh.face_vertices(face);
            let far = |w: &VertexId| surface.mesh.position(*w).distance_squared(self.mesh.position(v));
            let nearest = corners.into_iter().min_by(|a, b| far(a).total_cmp(&far(b)));
            surface.curvature[nearest.unwrap_or(corners[0]).index()]
        };
        self.mesh.vertices().map(at).collect()
    }
}

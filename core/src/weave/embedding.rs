//! A session's layout on the surface: its first drawing, what of it is pinned, and its optimisation.

use glam::DVec3;

use crate::dual::{Arrangement, Colour, RegionReport, assess, remove_bigons, vertex_curvatures};
use crate::embed::{EmbeddingError, Next, OptimisedEmbedding, Problem, Settings, Snapshot, arc_headings};
use crate::layout::{Embedding, Part, QuadLayout, embed};
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::SurfaceCurve;
use crate::weave::design::Pin;
use crate::weave::error::WeaveError;
use crate::weave::mesh_role::{MeshRole, alike};
use crate::weave::model::{Model, features};
use crate::weave::session::Session;

/// A layout and a drawing of it.
#[derive(Debug, Clone)]
pub struct InitialLayout {
    /// Its structure.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
    /// The mesh that they are drawn on.
    pub mesh_role: MeshRole,
}

/// Which nodes and arcs are pinned.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PinnedParts {
    /// One for each node.
    pub nodes: Vec<bool>,
    /// One for each arc.
    pub arcs: Vec<bool>,
}

impl PinnedParts {
    /// Pins these nodes and arcs too.
    ///
    /// # Errors
    ///
    /// [`WeaveError::NoPart`] if there is no such node or arc.
    pub fn pin(&mut self, nodes: &[usize], arcs: &[usize]) -> Result<(), WeaveError> {
        for &i in nodes {
            *self.nodes.get_mut(i).ok_or(WeaveError::NoPart(Part::Node(i as u32)))? = true;
        }
        for &i in arcs {
            *self.arcs.get_mut(i).ok_or(WeaveError::NoPart(Part::Arc(i as u32)))? = true;
        }
        Ok(())
    }
}

/// Triangles up to which a mesh that is woven on a proxy has the layout embedded on itself; beyond, the optimisation takes
/// minutes and gigabytes for what quads much larger than the triangles do not show.
const EMBEDDED: usize = 150_000;

/// The layout of a session in its first drawing. With a proxy it is drawn on the mesh of the design where the strips make
/// the same layout there and the mesh is not too large, and else on the proxy.
///
/// # Errors
///
/// [`crate::layout::LayoutError::RedRegions`] while there are red regions.
pub fn initial_layout(session: &Session, progress: &Progress) -> Result<InitialLayout, WeaveError> {
    let (model, woven) = (session.model(), session.woven());
    if model.proxy.is_some()
        && model.loaded.mesh.n_faces() <= EMBEDDED
        && woven.red().is_empty()
        && let Some(drawn) = initial_layout_on_design(session, progress)?
    {
        return Ok(drawn);
    }
    initial_layout_as_woven(session, progress)
}

/// The drawing on the mesh that is woven on.
pub(in crate::weave) fn initial_layout_as_woven(
    session: &Session,
    progress: &Progress,
) -> Result<InitialLayout, WeaveError> {
    let (model, woven) = (session.model(), session.woven());
    let layout = QuadLayout::dual(&woven.arrangement, &woven.red(), model.mesh.euler_characteristic())?;
    progress.report("Drawing nodes and arcs", 0.1);
    let (sharp, curved) = (&model.sharp, &model.vertex_curvatures);
    let preferred = preferred_nodes(&woven.arrangement, &layout, &woven.reports, &model.mesh, sharp, curved);
    let embedding = embed(&woven.arrangement, &layout, &preferred, progress)?;
    let mesh_role = if model.proxy.is_some() { MeshRole::Proxy } else { MeshRole::Design };
    Ok(InitialLayout { layout, embedding, mesh_role })
}

/// The drawing on the mesh of the design; `None` where the strips, carried there, do not make the same layout.
fn initial_layout_on_design(session: &Session, progress: &Progress) -> Result<Option<InitialLayout>, WeaveError> {
    let (model, mesh) = (session.model(), &session.model().loaded.mesh);
    progress.report("Arranging strips on the whole mesh", 0.02);
    let Some(arrangement) = arranged_on_design(session, progress)? else {
        tracing::warn!("the strips make another layout on the mesh than on the proxy: embedded on the proxy");
        return Ok(None);
    };
    progress.check()?;
    let curved = vertex_curvatures(mesh);
    let reports = assess(&arrangement, &curved, &corners_on_design(model));
    let red: Vec<u32> = (0..reports.len() as u32).filter(|&r| reports[r as usize].colour == Colour::Red).collect();
    let layout = QuadLayout::dual(&arrangement, &red, mesh.euler_characteristic())?;
    progress.report("Drawing nodes and arcs", 0.1);
    let sharp = features(mesh, &model.options);
    let preferred = preferred_nodes(&arrangement, &layout, &reports, mesh, &sharp, &curved);
    let embedding = embed(&arrangement, &layout, &preferred, progress)?;
    Ok(Some(InitialLayout { layout, embedding, mesh_role: MeshRole::Design }))
}

/// The arrangement on the mesh of the design that is like the one on the proxy, if there is one: of the strips as they were
/// carried one by one, or else as they are drawn beside each other now.
fn arranged_on_design(session: &Session, progress: &Progress) -> Result<Option<Arrangement>, WeaveError> {
    let (mesh, woven) = (&session.model().loaded.mesh, &session.woven().arrangement);
    let like = |mut curves: Vec<SurfaceCurve>| {
        remove_bigons(mesh, &mut curves);
        Arrangement::new(mesh, &curves).ok().filter(|a| alike(a, woven))
    };
    let placed: Vec<SurfaceCurve> = session.design().strips.iter().map(|s| s.curve.clone()).collect();
    let count = placed.len();
    if let Some(arrangement) = like(placed) {
        return Ok(Some(arrangement));
    }
    progress.check()?;
    let drawn: Option<Vec<SurfaceCurve>> = (0..count).map(|i| drawn_on_design(session, i)).collect();
    Ok(drawn.and_then(like))
}

/// A strip as it is drawn between the others on the proxy, on the mesh of the design.
fn drawn_on_design(session: &Session, strip: usize) -> Option<SurfaceCurve> {
    let (model, arrangement) = (session.model(), &session.woven().arrangement);
    let refined = &arrangement.refined;
    let face = |h: u32| FaceId(refined.base_face(h / 3));
    let at = |v: u32| refined.positions[v as usize];
    let curve_halfedges = arrangement.curve_halfedges(strip as u32);
    let mut line: Vec<(DVec3, FaceId)> = curve_halfedges.iter().map(|&h| (at(refined.origin(h)), face(h))).collect();
    let (closed, &last) = (session.design().strips[strip].curve.closed, curve_halfedges.last()?);
    if !closed {
        line.push((at(refined.target(last)), face(last)));
    }
    model.proxy.as_ref()?.polyline_to_original(&model.loaded.mesh, &line, closed).ok()
}

/// The pronounced corners of the shape by vertices of the design's mesh.
fn corners_on_design(model: &Model) -> Vec<(VertexId, i8)> {
    let vertex = |v| model.proxy.as_ref().map_or(v, |p| p.original_vertex(v));
    model.corners.iter().map(|&(v, index)| (vertex(v), index)).collect()
}

/// Where the node of each region is to lie: at its only pronounced corner, or where there is none, at that corner of its
/// features which is `curved` most in the sense of the node.
pub(in crate::weave) fn preferred_nodes(
    arrangement: &Arrangement,
    layout: &QuadLayout,
    reports: &[RegionReport],
    mesh: &TriMesh,
    sharp: &[bool],
    curved: &[f64],
) -> Vec<Option<VertexId>> {
    let is_corner = feature_corners(mesh, sharp);
    let of_features = |r: usize| {
        let sense = 4.0 - layout.nodes[r].valence as f64;
        let curved = |v: &VertexId| sense * curved[v.index()];
        let faces = arrangement.regions[r].faces.iter();
        let corners = faces.flat_map(|&f| arrangement.refined.corners(f)).map(VertexId);
        let candidates = corners.filter(|v| is_corner.get(v.index()).copied().unwrap_or(false));
        let best = candidates.max_by(|a, b| curved(a).total_cmp(&curved(b)).then(b.cmp(a)));
        best.filter(|v| curved(v) > 0.0)
    };
    let of = |(r, report): (usize, &RegionReport)| match report.corners[..] {
        [(only, _)] => Some(only),
        [] if !layout.nodes[r].boundary => of_features(r),
        _ => None,
    };
    reports.iter().enumerate().map(of).collect()
}

/// Whether three or more sharp edges meet at each vertex.
fn feature_corners(mesh: &TriMesh, sharp: &[bool]) -> Vec<bool> {
    let mut degree = vec![0; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| sharp[e.index()]) {
        for v in mesh.edge_vertices(e) {
            degree[v.index()] += 1;
        }
    }
    degree.into_iter().map(|d| d > 2).collect()
}

impl InitialLayout {
    /// The pin that stands for a node; this must be the first drawing.
    pub fn node_pin(&self, node: usize) -> Option<Pin> {
        self.embedding.nodes.get(node).map(|&v| Pin::Node(self.position(v).to_array()))
    }

    /// The pin that stands for an arc; this must be the first drawing.
    pub fn arc_pin(&self, arc: usize) -> Option<Pin> {
        let middle = |path: &Vec<u32>| path.get(path.len() / 2).map(|&v| Pin::Arc(self.position(v).to_array()));
        self.embedding.arcs.get(arc).and_then(middle)
    }

    /// The nodes and arcs that `pins` stand for: the nearest to each; this must be the first drawing.
    pub fn pinned(&self, pins: &[Pin]) -> PinnedParts {
        let place = |pin: Option<Pin>| match pin {
            Some(Pin::Node(p) | Pin::Arc(p)) => DVec3::from_array(p),
            None => DVec3::INFINITY,
        };
        let nodes: Vec<DVec3> = (0..self.layout.nodes.len()).map(|i| place(self.node_pin(i))).collect();
        let arcs: Vec<DVec3> = (0..self.layout.arcs.len()).map(|i| place(self.arc_pin(i))).collect();
        let mut parts = PinnedParts { nodes: vec![false; nodes.len()], arcs: vec![false; arcs.len()] };
        for pin in pins {
            let (places, pinned) = match pin {
                Pin::Node(_) => (&nodes, &mut parts.nodes),
                Pin::Arc(_) => (&arcs, &mut parts.arcs),
            };
            let distance = |i: usize| places[i].distance_squared(place(Some(*pin)));
            if let Some(i) = (0..places.len()).min_by(|&i, &j| distance(i).total_cmp(&distance(j))) {
                pinned[i] = true;
            }
        }
        parts
    }

    /// The pins that stand for these parts; this must be the first drawing.
    pub fn pins(&self, parts: &PinnedParts) -> Vec<Pin> {
        let set = |list: &[bool]| (0..list.len()).filter(|&i| list[i]).collect::<Vec<_>>();
        let nodes = set(&parts.nodes).into_iter().filter_map(|i| self.node_pin(i));
        let arcs = set(&parts.arcs).into_iter().filter_map(|i| self.arc_pin(i));
        nodes.chain(arcs).collect()
    }

    fn position(&self, v: u32) -> DVec3 {
        self.embedding.mesh.positions[v as usize]
    }
}

/// Optimises the embedding of a session's layout from a drawing of it on.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn optimise(
    session: &Session,
    drawn: &InitialLayout,
    pinned: &PinnedParts,
    progress: &Progress,
    watch: &mut dyn FnMut(&Snapshot) -> Next,
) -> Result<OptimisedEmbedding, EmbeddingError> {
    let model = session.model();
    let surface = model.surface(drawn.mesh_role);
    let arc_headings = arc_headings(&drawn.layout);
    let job = Problem {
        surface,
        layout: &drawn.layout,
        initial_embedding: &drawn.embedding,
        arc_headings: &arc_headings,
        pinned_nodes: &pinned.nodes,
        pinned_arcs: &pinned.arcs,
        settings: Settings::default(),
    };
    crate::embed::optimise_embedding(&job, progress, watch)
}

//! The layout of a session on the surface: its initial embedding, its pinned parts, and its optimisation.

use glam::DVec3;

use crate::dual::{Arrangement, RegionReport, assess, remove_bigons, vertex_curvatures};
use crate::embed::{EmbeddingError, Next, OptimisedEmbedding, Problem, Settings, Snapshot, arc_headings};
use crate::layout::{Embedding, LayoutElement, QuadLayout, initial_embedding};
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::SurfaceCurve;
use crate::weave::design::Pin;
use crate::weave::error::WeaveError;
use crate::weave::mesh_role::{MeshRole, same_regions};
use crate::weave::model::{Model, features};
use crate::weave::session::Session;
use crate::weave::woven::red_regions;

/// A layout with its initial embedding.
#[derive(Debug, Clone)]
pub struct InitialLayout {
    /// Its structure: nodes, arcs and patches.
    pub layout: QuadLayout,
    /// Its nodes and arcs on the surface.
    pub embedding: Embedding,
    /// The mesh that it is embedded on.
    pub mesh_role: MeshRole,
}

/// Which nodes and arcs are pinned.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PinnedElements {
    /// For each node.
    pub nodes: Vec<bool>,
    /// For each arc.
    pub arcs: Vec<bool>,
}

impl PinnedElements {
    /// Pins further nodes and arcs.
    ///
    /// # Errors
    ///
    /// [`WeaveError::NoElement`] if there is no such node or arc.
    pub fn pin(&mut self, nodes: &[usize], arcs: &[usize]) -> Result<(), WeaveError> {
        for &i in nodes {
            *self.nodes.get_mut(i).ok_or(WeaveError::NoElement(LayoutElement::Node(i as u32)))? = true;
        }
        for &i in arcs {
            *self.arcs.get_mut(i).ok_or(WeaveError::NoElement(LayoutElement::Arc(i as u32)))? = true;
        }
        Ok(())
    }
}

/// Largest design mesh with a proxy, in triangles, that the layout is embedded on itself. On larger ones the optimisation
/// takes minutes and gigabytes, and quads much larger than the triangles do not show the difference.
const MAX_DESIGN_FACES: usize = 150_000;

/// The layout of a session with its initial embedding. With a proxy, it is embedded on the design mesh if that is not larger
/// than [`MAX_DESIGN_FACES`] and the strips have the same layout there, and else on the proxy.
///
/// # Errors
///
/// [`crate::layout::LayoutError::RedRegions`] while there are red regions.
pub fn initial_layout(session: &Session, progress: &Progress) -> Result<InitialLayout, WeaveError> {
    let (model, woven) = (session.model(), session.woven());
    if model.proxy.is_some()
        && model.loaded.mesh.n_faces() <= MAX_DESIGN_FACES
        && woven.red().is_empty()
        && let Some(initial) = initial_layout_on_design(session, progress)?
    {
        return Ok(initial);
    }
    initial_layout_as_woven(session, progress)
}

/// The layout with its initial embedding on the woven mesh.
pub(in crate::weave) fn initial_layout_as_woven(
    session: &Session,
    progress: &Progress,
) -> Result<InitialLayout, WeaveError> {
    let (model, woven) = (session.model(), session.woven());
    progress.report("Embedding nodes and arcs", 0.1);
    let place = Place { mesh: &model.mesh, sharp: &model.sharp, vertex_curvatures: &model.vertex_curvatures };
    let (layout, embedding) = embedded_dual(&woven.arrangement, &woven.reports, place, progress)?;
    Ok(InitialLayout { layout, embedding, mesh_role: model.woven_role() })
}

/// The layout with its initial embedding on the design mesh; `None` where the strips have another arrangement there.
fn initial_layout_on_design(session: &Session, progress: &Progress) -> Result<Option<InitialLayout>, WeaveError> {
    let (model, mesh) = (session.model(), &session.model().loaded.mesh);
    progress.report("Arranging strips on the design mesh", 0.02);
    let Some(arrangement) = arranged_on_design(session, progress)? else {
        tracing::warn!("the strips have another layout on the design mesh: embedded on the proxy");
        return Ok(None);
    };
    progress.check()?;
    let vertex_curvatures = vertex_curvatures(mesh);
    let reports = assess(&arrangement, &vertex_curvatures, &corners_on_design(model));
    progress.report("Embedding nodes and arcs", 0.1);
    let sharp = features(mesh, &model.options);
    let place = Place { mesh, sharp: &sharp, vertex_curvatures: &vertex_curvatures };
    let (layout, embedding) = embedded_dual(&arrangement, &reports, place, progress)?;
    Ok(Some(InitialLayout { layout, embedding, mesh_role: MeshRole::Design }))
}

/// A mesh with the data by which nodes are placed on it.
#[derive(Debug, Clone, Copy)]
pub(in crate::weave) struct Place<'a> {
    pub mesh: &'a TriMesh,
    /// Whether each edge is a sharp feature.
    pub sharp: &'a [bool],
    /// Contribution of each vertex to the total curvature.
    pub vertex_curvatures: &'a [f64],
}

/// The layout dual to an arrangement, and its initial embedding.
///
/// # Errors
///
/// [`crate::layout::LayoutError::RedRegions`] if a region is red, or why there is no embedding.
pub(in crate::weave) fn embedded_dual(
    arrangement: &Arrangement,
    reports: &[RegionReport],
    place: Place<'_>,
    progress: &Progress,
) -> Result<(QuadLayout, Embedding), WeaveError> {
    let layout = QuadLayout::dual(arrangement, &red_regions(reports), place.mesh.euler_characteristic())?;
    let preferred = preferred_nodes(arrangement, &layout, reports, place);
    let embedding = initial_embedding(arrangement, &layout, &preferred, progress)?;
    Ok((layout, embedding))
}

/// An arrangement on the design mesh with the same regions as the one on the proxy, if there is one: of the strips'
/// curves on the design mesh, or else of their edge paths in the arrangement on the proxy, transferred to the design
/// mesh.
fn arranged_on_design(session: &Session, progress: &Progress) -> Result<Option<Arrangement>, WeaveError> {
    let (mesh, woven) = (&session.model().loaded.mesh, &session.woven().arrangement);
    let same = |mut curves: Vec<SurfaceCurve>| {
        remove_bigons(mesh, &mut curves);
        Arrangement::new(mesh, &curves).ok().filter(|a| same_regions(a, woven))
    };
    let placed: Vec<SurfaceCurve> = session.design().strips.iter().map(|s| s.curve.clone()).collect();
    let count = placed.len();
    if let Some(arrangement) = same(placed) {
        return Ok(Some(arrangement));
    }
    progress.check()?;
    let transferred: Option<Vec<SurfaceCurve>> = (0..count).map(|i| transferred_path(session, i)).collect();
    Ok(transferred.and_then(same))
}

/// The edge path of a strip in the arrangement on the proxy, as a curve on the design mesh.
fn transferred_path(session: &Session, strip: usize) -> Option<SurfaceCurve> {
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

/// The pronounced corners of the shape as vertices of the design mesh.
fn corners_on_design(model: &Model) -> Vec<(VertexId, i8)> {
    let vertex = |v| model.proxy.as_ref().map_or(v, |p| p.original_vertex(v));
    model.corners.iter().map(|&(v, index)| (vertex(v), index)).collect()
}

/// The preferred position of the node of each region: its only pronounced corner, or if it has none, the corner of features
/// with the largest curvature of the sign of the node's index.
fn preferred_nodes(
    arrangement: &Arrangement,
    layout: &QuadLayout,
    reports: &[RegionReport],
    place: Place<'_>,
) -> Vec<Option<VertexId>> {
    let is_corner = feature_corners(place.mesh, place.sharp);
    let of_features = |r: usize| {
        let index = 4.0 - layout.nodes[r].valence as f64;
        let curved = |v: &VertexId| index * place.vertex_curvatures[v.index()];
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

/// For each vertex whether three or more sharp edges meet there.
fn feature_corners(mesh: &TriMesh, sharp: &[bool]) -> Vec<bool> {
    let mut degree = vec![0; mesh.n_vertices()];
    for e in mesh.edges().filter(|e| sharp[e.index()]) {
        for v in mesh.edge_vertices(e) {
            degree[v.index()] += 1;
        }
    }
    degree.into_iter().map(|d| d > 2).collect()
}

/// Pins are identified by points of the initial embedding, so none of these methods works on an optimised one.
impl InitialLayout {
    /// The pin of a node.
    pub fn node_pin(&self, node: usize) -> Option<Pin> {
        self.embedding.nodes.get(node).map(|&v| Pin::Node(self.position(v).to_array()))
    }

    /// The pin of an arc.
    pub fn arc_pin(&self, arc: usize) -> Option<Pin> {
        let middle = |path: &Vec<u32>| path.get(path.len() / 2).map(|&v| Pin::Arc(self.position(v).to_array()));
        self.embedding.arcs.get(arc).and_then(middle)
    }

    /// The nodes and arcs of `pins`: the part nearest to each.
    pub fn pinned(&self, pins: &[Pin]) -> PinnedElements {
        let place = |pin: Option<Pin>| match pin {
            Some(Pin::Node(p) | Pin::Arc(p)) => DVec3::from_array(p),
            None => DVec3::INFINITY,
        };
        let nodes: Vec<DVec3> = (0..self.layout.nodes.len()).map(|i| place(self.node_pin(i))).collect();
        let arcs: Vec<DVec3> = (0..self.layout.arcs.len()).map(|i| place(self.arc_pin(i))).collect();
        let mut parts = PinnedElements { nodes: vec![false; nodes.len()], arcs: vec![false; arcs.len()] };
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

    /// The pins of these parts.
    pub fn pins(&self, parts: &PinnedElements) -> Vec<Pin> {
        let set = |list: &[bool]| (0..list.len()).filter(|&i| list[i]).collect::<Vec<_>>();
        let nodes = set(&parts.nodes).into_iter().filter_map(|i| self.node_pin(i));
        let arcs = set(&parts.arcs).into_iter().filter_map(|i| self.arc_pin(i));
        nodes.chain(arcs).collect()
    }

    fn position(&self, v: u32) -> DVec3 {
        self.embedding.mesh.positions[v as usize]
    }
}

/// Optimises the embedding of a session's layout, starting with an initial embedding.
///
/// # Errors
///
/// See [`EmbeddingError`].
pub fn optimise(
    session: &Session,
    initial: &InitialLayout,
    pinned: &PinnedElements,
    progress: &Progress,
    watch: &mut dyn FnMut(&Snapshot) -> Next,
) -> Result<OptimisedEmbedding, EmbeddingError> {
    let model = session.model();
    let surface = model.surface(initial.mesh_role);
    let arc_headings = arc_headings(&initial.layout);
    let problem = Problem {
        surface,
        layout: &initial.layout,
        initial_embedding: &initial.embedding,
        arc_headings: &arc_headings,
        pinned_nodes: &pinned.nodes,
        pinned_arcs: &pinned.arcs,
        settings: Settings::default(),
    };
    crate::embed::optimise_embedding(&problem, progress, watch)
}

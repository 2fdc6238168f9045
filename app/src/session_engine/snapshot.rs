//! Makes the scenes that the window shows of a session.

use std::cell::RefCell;
use std::sync::Arc;

use glam::DVec3;
use plait_core::dual::RefinedMesh;
use plait_core::mesh::{FaceId, TriMesh};
use plait_core::surface::barycentric_inside;
use plait_core::weave::{Session, Woven};

use super::layout_state::LayoutState;
use super::proxy_display::ProxyDisplay;
use super::remarks;
use super::stripes::Pattern;
use crate::engine::{Detail, DisplaySurface, ModelFacts, Scene, Strip, StripId};
use crate::shading::corner_normals;
use crate::texts::grouped;

/// The part of the scene that depends on the model alone.
pub(super) struct ModelSnapshot {
    facts: Arc<ModelFacts>,
    display: ModelDisplay,
    latest: RefCell<Option<LatestSurface>>,
}

/// The surface of the latest scene, with what it depends on. Pins and embeddings do not change it, and its stripes take long.
struct LatestSurface {
    woven: Arc<Woven>,
    visible: Vec<bool>,
    surface: Arc<DisplaySurface>,
}

/// How the design mesh is displayed.
enum ModelDisplay {
    /// Strips are woven on the design mesh itself: the normals at the corners of its faces.
    Direct(Vec<[DVec3; 3]>),
    /// Strips are woven on a proxy.
    Proxy(ProxyDisplay),
}

impl ModelSnapshot {
    pub(super) fn new(session: &Session) -> Self {
        let model = session.model();
        let mesh = &model.loaded.mesh;
        let faces: Vec<[u32; 3]> = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0)).collect();
        let normals = corner_normals(mesh.positions(), &faces, model.options.sharp_dihedral);
        let display = match model.proxy {
            Some(_) => ModelDisplay::Proxy(ProxyDisplay::new(model, faces, normals)),
            None => ModelDisplay::Direct(normals),
        };
        Self { facts: Arc::new(facts(session)), display, latest: RefCell::default() }
    }

    /// The present state of `session`.
    pub(super) fn scene(&self, session: &Session, layout: &LayoutState) -> Scene {
        let (model, design) = (session.model(), session.design());
        let (summary, exportable) = remarks::summary(session);
        let strips = design.strips.iter().map(|s| Strip {
            id: StripId(s.id.0),
            polyline: s.curve.points(&model.loaded.mesh),
            closed: s.curve.closed,
            length: s.curve.length(&model.loaded.mesh) * model.loaded.units.scale,
            cost: s.cost,
            visible: s.visible,
            anchors: s.anchors.clone(),
        });
        Scene {
            model: Arc::clone(&self.facts),
            design_mesh: Arc::clone(&model.loaded.mesh),
            index: Arc::clone(&model.index),
            surface: self.surface(session),
            strips: strips.collect(),
            remarks: remarks::remarks(session),
            summary,
            exportable,
            layout: layout.preview(session).map(Arc::new),
            embedding: layout.optimised.as_ref().map(|o| Arc::clone(&o.summary)),
            detail: Detail { curvature_radius: model.options.curvature_radius, smoothing: model.options.smoothing },
            can_undo: session.can_undo(),
            can_redo: session.can_redo(),
        }
    }

    fn surface(&self, session: &Session) -> Arc<DisplaySurface> {
        let visible: Vec<bool> = session.design().strips.iter().map(|s| s.visible).collect();
        let mut latest = self.latest.borrow_mut();
        if let Some(latest) = latest.as_ref().filter(|l| Arc::ptr_eq(&l.woven, session.woven()) && l.visible == visible)
        {
            return Arc::clone(&latest.surface);
        }
        let surface = Arc::new(self.new_surface(session));
        let woven = Arc::clone(session.woven());
        *latest = Some(LatestSurface { woven, visible, surface: Arc::clone(&surface) });
        surface
    }

    fn new_surface(&self, session: &Session) -> DisplaySurface {
        match (&self.display, &session.model().proxy) {
            (ModelDisplay::Proxy(display), Some(proxy)) => display.surface(session, proxy),
            (ModelDisplay::Proxy(_), None) => DisplaySurface::default(),
            (ModelDisplay::Direct(normals), _) => refined_surface(normals, session),
        }
    }
}

/// The design mesh, refined by its strips.
fn refined_surface(normals: &[[DVec3; 3]], session: &Session) -> DisplaySurface {
    let (mesh, woven) = (&session.model().mesh, session.woven());
    let refined = &woven.arrangement.refined;
    let faces: Vec<[u32; 3]> = (0..refined.n_faces() as u32).map(|f| refined.corners(f)).collect();
    let normals = (0..faces.len() as u32).map(|f| face_normals(normals, mesh, refined, f)).collect();
    // Without strips the whole surface is one region; its colour would say nothing.
    let regions = if session.design().strips.is_empty() {
        Vec::new()
    } else {
        let colour = |&r: &u32| remarks::region_colour(woven.reports[r as usize].colour);
        woven.arrangement.region_of_face.iter().map(colour).collect()
    };
    let stripes = Pattern::of(session).map(|p| p.stripes).unwrap_or_default();
    DisplaySurface {
        positions: Arc::new(refined.positions.clone()),
        base: Arc::new((0..refined.n_faces() as u32).map(|f| refined.base_face(f)).collect()),
        faces: Arc::new(faces),
        normals: Arc::new(normals),
        regions,
        stripes,
    }
}

/// Normals of the design mesh at the corners of a refined face, so that the refinement does not show in the shading.
fn face_normals(normals: &[[DVec3; 3]], mesh: &TriMesh, refined: &RefinedMesh, f: u32) -> [DVec3; 3] {
    let base = FaceId(refined.base_face(f));
    let corners = mesh.face_vertices(base);
    let normals = normals[base.index()];
    refined.corners(f).map(|v| match corners.iter().position(|c| c.0 == v) {
        Some(corner) => normals[corner],
        None => {
            let weights = barycentric_inside(corners.map(|c| mesh.position(c)), refined.positions[v as usize]);
            (0..3).map(|i| normals[i] * weights[i]).sum()
        }
    })
}

/// Size and topology of the model, as the panel lists them.
fn facts(session: &Session) -> ModelFacts {
    let model = session.model();
    let mut facts = vec![
        ("Vertices".to_owned(), grouped(model.loaded.mesh.n_vertices())),
        ("Triangles".to_owned(), grouped(model.loaded.mesh.n_faces())),
        ("Genus".to_owned(), model.topology.genus.to_string()),
    ];
    if let Some(proxy) = &model.proxy {
        facts.push(("Triangles of the proxy".to_owned(), grouped(proxy.mesh().n_faces())));
    }
    let mut unless = |usual: usize, name: &str, n: usize| {
        if n != usual {
            facts.push((name.to_owned(), grouped(n)));
        }
    };
    unless(1, "Components", model.topology.components.len());
    unless(0, "Boundary loops", model.topology.boundary_loops.len());
    ModelFacts {
        name: model.loaded.name.clone(),
        facts,
        repairs: model.loaded.repairs.iter().map(ToString::to_string).collect(),
    }
}

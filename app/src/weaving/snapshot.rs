//! Snapshots of a session for the window.

use std::sync::Arc;

use glam::DVec3;
use plait_core::dual::RefinedMesh;
use plait_core::mesh::{FaceId, TriMesh};
use plait_core::weave::Session;

use super::cover::Cover;
use super::{Later, stripes, words};
use crate::engine::{Detail, DisplaySurface, ModelFacts, Scene, Strip, StripId};
use crate::shading::corner_normals;

/// What stays the same while strips come and go.
pub struct ModelSnapshot {
    facts: Arc<ModelFacts>,
    look: Look,
}

/// How the mesh looks without strips.
enum Look {
    /// Normals at the corners of the faces of a mesh that is woven on itself.
    Itself(Vec<[DVec3; 3]>),
    /// A mesh that is woven on its proxy.
    Covered(Cover),
}

impl ModelSnapshot {
    pub fn new(session: &Session) -> Self {
        let model = session.model();
        let mesh = &model.loaded.mesh;
        let faces: Vec<[u32; 3]> = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0)).collect();
        let normals = corner_normals(mesh.positions(), &faces, model.options.sharp_dihedral);
        let look = match model.proxy {
            Some(_) => Look::Covered(Cover::new(model, faces, normals)),
            None => Look::Itself(normals),
        };
        Self { facts: Arc::new(facts(session)), look }
    }

    /// The present state of `session`.
    pub fn scene(&self, session: &Session, later: &Later) -> Scene {
        let (model, design) = (session.model(), session.design());
        let (summary, exportable) = words::summary(session);
        let strips = design.strips.iter().map(|s| Strip {
            id: StripId(s.id.0),
            polyline: s.curve.points(&model.loaded.mesh),
            closed: s.curve.closed,
            length: s.curve.length(&model.loaded.mesh) * model.loaded.units.scale,
            visible: s.visible,
        });
        Scene {
            model: Arc::clone(&self.facts),
            design_mesh: Arc::clone(&model.loaded.mesh),
            index: Arc::clone(&model.index),
            surface: Arc::new(self.surface(session)),
            strips: strips.collect(),
            remarks: words::remarks(session),
            summary,
            exportable,
            layout: later.preview(session).map(Arc::new),
            embedding: later.embedded.as_ref().map(|e| Arc::clone(&e.summary)),
            detail: Detail { curvature_radius: model.options.curvature_radius, smoothing: model.options.smoothing },
            can_undo: session.can_undo(),
            can_redo: session.can_redo(),
        }
    }

    fn surface(&self, session: &Session) -> DisplaySurface {
        match (&self.look, &session.model().proxy) {
            (Look::Covered(cover), Some(proxy)) => cover.surface(session, proxy),
            (Look::Covered(_), None) => DisplaySurface::default(),
            (Look::Itself(normals), _) => refined_surface(normals, session),
        }
    }
}

/// A mesh that is woven on itself, refined by its strips.
fn refined_surface(normals: &[[DVec3; 3]], session: &Session) -> DisplaySurface {
    let (mesh, woven) = (&session.model().mesh, session.woven());
    let refined = &woven.arrangement.refined;
    let faces: Vec<[u32; 3]> = (0..refined.n_faces() as u32).map(|f| refined.corners(f)).collect();
    let normals = (0..faces.len() as u32).map(|f| face_normals(normals, mesh, refined, f)).collect();
    // Before the first strip all is one region; to paint it red would say nothing.
    let regions = if session.design().strips.is_empty() {
        Vec::new()
    } else {
        let color = |&r: &u32| words::color(woven.reports[r as usize].colour);
        woven.arrangement.region_of_face.iter().map(color).collect()
    };
    let visible = |curve: u32| session.design().strips.get(curve as usize).is_some_and(|s| s.visible);
    let stripes = woven.strip_map.as_ref().map(|m| stripes::pattern(m, visible)).unwrap_or_default();
    DisplaySurface {
        positions: Arc::new(refined.positions.clone()),
        base: Arc::new((0..refined.n_faces() as u32).map(|f| refined.base_face(f)).collect()),
        faces: Arc::new(faces),
        normals: Arc::new(normals),
        regions,
        stripes,
    }
}

/// The design mesh's normals at the corners of a refined face: refinement must not show in the shading.
fn face_normals(normals: &[[DVec3; 3]], mesh: &TriMesh, refined: &RefinedMesh, f: u32) -> [DVec3; 3] {
    let base = FaceId(refined.base_face(f));
    let corners = mesh.face_vertices(base);
    let normals = normals[base.index()];
    refined.corners(f).map(|v| match corners.iter().position(|c| c.0 == v) {
        Some(corner) => normals[corner],
        None => {
            let weights = weights(corners.map(|c| mesh.position(c)), refined.positions[v as usize]);
            (0..3).map(|i| normals[i] * weights[i]).sum()
        }
    })
}

/// The barycentric coordinates of `p`, which lies in the triangle's plane.
fn weights(corners: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let part = |i: usize| (corners[(i + 1) % 3] - p).cross(corners[(i + 2) % 3] - p).dot(normal).max(0.0);
    let parts = [part(0), part(1), part(2)];
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 { parts.map(|p| p / sum) } else { [1.0 / 3.0; 3] }
}

fn facts(session: &Session) -> ModelFacts {
    let model = session.model();
    let mut facts = vec![
        ("Vertices".to_owned(), grouped(model.loaded.mesh.n_vertices())),
        ("Triangles".to_owned(), grouped(model.loaded.mesh.n_faces())),
        ("Genus".to_owned(), model.topology.genus.to_string()),
    ];
    if let Some(proxy) = &model.proxy {
        facts.push(("Woven on a proxy of".to_owned(), grouped(proxy.mesh().n_faces())));
    }
    let mut several = |name: &str, n: usize, usual: usize| {
        if n != usual {
            facts.push((name.to_owned(), grouped(n)));
        }
    };
    several("Parts", model.topology.components.len(), 1);
    several("Boundary loops", model.topology.boundary_loops.len(), 0);
    ModelFacts {
        name: model.loaded.name.clone(),
        facts,
        repairs: model.loaded.repairs.iter().map(ToString::to_string).collect(),
    }
}

/// A number with its digits in groups of three.
fn grouped(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_grouped() {
        assert_eq!([0, 999, 1000, 1234567].map(grouped), ["0", "999", "1 000", "1 234 567"]);
    }

    #[test]
    fn weights_add_to_one_and_find_the_point() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::new(0.2, 0.9, 0.4)];
        let p = corners[0] * 0.2 + corners[1] * 0.5 + corners[2] * 0.3;
        let w = weights(corners, p);
        assert!((w[0] - 0.2).abs() < 1e-12 && (w[1] - 0.5).abs() < 1e-12 && (w[2] - 0.3).abs() < 1e-12);
    }
}

//! The handles of the edited strip: a disc at each anchor, and two tips along the direction of a directional one.

use glam::{DVec3, Vec2};
use plait_core::weave::Anchor;

use super::hover::Grip;
use super::state::PlaitApp;
use super::strip_picking;
use crate::shading::Handle;

/// Radius in which a handle is taken, in points: that of a fingertip.
const REACH: f32 = 14.0;
/// Radius in which the spine is taken, in points.
const SPINE_REACH: f32 = 9.0;
/// Distance of the tips from their anchor on the screen, in points.
const TIP_DISTANCE: f32 = 36.0;

/// The handles of the edited strip.
pub fn of(app: &PlaitApp) -> Vec<Handle> {
    let (Some(editing), Some(scene)) = (&app.editing, &app.scene) else { return Vec::new() };
    let handle = |(i, anchor): (usize, &Anchor)| Handle {
        position: anchor.at.position(&scene.design_mesh),
        tips: tips(app, anchor),
        selected: editing.selected == Some(i),
        pointed: matches!(app.hover.grip, Some(Grip::Anchor(k) | Grip::Tip(k, _)) if k == i),
    };
    editing.anchors().iter().enumerate().map(handle).collect()
}

/// The ends of the direction of an anchor, at about the same distance on the screen whatever the zoom is.
fn tips(app: &PlaitApp, anchor: &Anchor) -> Option<[DVec3; 2]> {
    let scene = app.scene.as_ref()?;
    let centre = anchor.at.position(&scene.design_mesh);
    let direction = anchor.direction?.reject_from(scene.design_mesh.face_normal(anchor.at.face)).try_normalize()?;
    let depth = f64::from(centre.as_vec3().distance(app.camera.ray(Vec2::ZERO, app.view_size).origin));
    let per_point =
        depth * 2.0 * f64::from((0.5 * app.camera.vertical_fov).tan()) / f64::from(app.view_size.y.max(1.0));
    let step = direction * per_point * f64::from(TIP_DISTANCE);
    Some([centre + step, centre - step])
}

/// What of the edited strip is under the pointer: an anchor before a tip before the spine.
pub fn pick(app: &PlaitApp, at: Vec2) -> Option<Grip> {
    app.editing.as_ref()?;
    let handles = of(app);
    let distance = |p: DVec3| app.camera.project(p.as_vec3(), app.view_size).map_or(f32::INFINITY, |q| q.distance(at));
    let mut near: Vec<(f32, Grip)> = Vec::new();
    for (i, handle) in handles.iter().enumerate() {
        near.push((distance(handle.position), Grip::Anchor(i)));
        for (tip, sign) in handle.tips.into_iter().flatten().zip([1.0, -1.0]) {
            // A tip seen from its end lies over its anchor, which comes first.
            near.push((distance(tip) + 1.0, Grip::Tip(i, sign)));
        }
    }
    let nearest = near.into_iter().filter(|(d, _)| *d <= REACH).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map(|(_, grip)| grip).or_else(|| {
        let spine = app.hover.shown()?;
        let on = strip_picking::nearest_on(app, &spine.polyline, spine.curve.closed, at, SPINE_REACH)?;
        Some(Grip::Spine(app.scene.as_ref()?.index.nearest(on.1)))
    })
}

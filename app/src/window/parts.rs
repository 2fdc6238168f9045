//! Which part of the layout is under the pointer: nodes by their markers, arcs by their lines.

use glam::{DVec3, Vec2};

use super::PlaitApp;
use crate::engine::{LayoutPart, LayoutPreview};

/// How near the pointer must come to a node, in points: a little more than its marker.
const NODE_REACH: f32 = 8.0;
/// How near to an arc: less, since between arcs strips are placed.
const ARC_REACH: f32 = 4.0;
/// How far behind the surface a point may lie and still count as seen, as a fraction of the model's diagonal.
const SLACK: f32 = 0.01;

/// The part under `at` that a click would pin or let go: nodes before arcs, the nearest on the screen, and only what is
/// shown and seen. None while the layout moves.
pub fn under(app: &PlaitApp, at: Vec2) -> Option<LayoutPart> {
    let layout = app.layout().filter(|_| app.options.layout && app.step.is_none())?;
    if app.is_bettering() {
        return None;
    }
    nearest_node(app, layout, at).or_else(|| nearest_arc(app, layout, at))
}

fn nearest_node(app: &PlaitApp, layout: &LayoutPreview, at: Vec2) -> Option<LayoutPart> {
    let near = |(i, p): (usize, DVec3)| {
        let distance = app.camera.project(p.as_vec3(), app.view_size)?.distance(at);
        (distance < NODE_REACH).then_some((i, p, distance))
    };
    let nodes = layout.nodes.iter().map(|n| n.position).enumerate().filter_map(near);
    let best = nodes.filter(|&(_, p, _)| is_seen(app, p)).min_by(|a, b| a.2.total_cmp(&b.2));
    best.map(|(i, ..)| LayoutPart::Node(i))
}

fn nearest_arc(app: &PlaitApp, layout: &LayoutPreview, at: Vec2) -> Option<LayoutPart> {
    let mut best: Option<(usize, f32)> = None;
    for (i, arc) in layout.arcs.iter().enumerate() {
        let on_screen = |p: &DVec3| app.camera.project(p.as_vec3(), app.view_size);
        let mut before = arc.points.first().and_then(on_screen);
        for (k, p) in arc.points.iter().enumerate().skip(1) {
            let now = on_screen(p);
            if let (Some(a), Some(b)) = (before, now) {
                let t = ((at - a).dot(b - a) / (b - a).length_squared().max(1e-6)).clamp(0.0, 1.0);
                let distance = at.distance(a.lerp(b, t));
                let nearer = distance < ARC_REACH && best.is_none_or(|(_, d)| distance < d);
                if nearer && is_seen(app, arc.points[k - 1].lerp(*p, f64::from(t))) {
                    best = Some((i, distance));
                }
            }
            before = now;
        }
    }
    best.map(|(i, _)| LayoutPart::Arc(i))
}

/// Whether the surface does not hide a point.
fn is_seen(app: &PlaitApp, p: DVec3) -> bool {
    let (Some(scene), Some(at)) = (&app.scene, app.camera.project(p.as_vec3(), app.view_size)) else { return false };
    let ray = app.camera.ray(at, app.view_size);
    let distance = p.as_vec3().distance(ray.origin);
    match scene.index.ray(ray.origin.as_dvec3(), ray.direction.as_dvec3()) {
        Some((hit, _)) => hit.position(&scene.design_mesh).as_vec3().distance(ray.origin) > distance - SLACK,
        // On the outline.
        None => true,
    }
}

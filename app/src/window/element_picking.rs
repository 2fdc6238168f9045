//! Picks the node or the arc of the layout under the pointer.

use glam::{DVec3, Vec2};

use super::state::PlaitApp;
use crate::engine::{LayoutPart, LayoutPreview};

/// Pick radius of a node, in points: a little more than its marker.
const NODE_RADIUS: f32 = 8.0;
/// Pick radius of an arc, in points. It is smaller, since strips are placed between arcs.
const ARC_RADIUS: f32 = 4.0;
/// Depth behind the surface up to which a point counts as visible, as a fraction of the model size. Nodes
/// and arcs may lie a little below the triangles.
const DEPTH_TOLERANCE: f32 = 0.01;

/// The visible node or arc nearest to `at` on the screen, nodes first. `None` while the layout is hidden or being
/// optimised.
pub fn pick(app: &PlaitApp, at: Vec2) -> Option<LayoutPart> {
    let layout = app.layout().filter(|_| app.options.layout && app.step.is_none())?;
    if app.is_optimising() {
        return None;
    }
    nearest_node(app, layout, at).or_else(|| nearest_arc(app, layout, at))
}

fn nearest_node(app: &PlaitApp, layout: &LayoutPreview, at: Vec2) -> Option<LayoutPart> {
    let near = |(i, p): (usize, DVec3)| {
        let distance = app.camera.project(p.as_vec3(), app.view_size)?.distance(at);
        (distance < NODE_RADIUS).then_some((i, p, distance))
    };
    let nodes = layout.nodes.iter().map(|n| n.position).enumerate().filter_map(near);
    let best = nodes.filter(|&(_, p, _)| is_visible(app, p)).min_by(|a, b| a.2.total_cmp(&b.2));
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
                let nearer = distance < ARC_RADIUS && best.is_none_or(|(_, d)| distance < d);
                if nearer && is_visible(app, arc.points[k - 1].lerp(*p, f64::from(t))) {
                    best = Some((i, distance));
                }
            }
            before = now;
        }
    }
    best.map(|(i, _)| LayoutPart::Arc(i))
}

/// Whether a point is not hidden by the surface.
fn is_visible(app: &PlaitApp, p: DVec3) -> bool {
    let (Some(scene), Some(at)) = (&app.scene, app.camera.project(p.as_vec3(), app.view_size)) else { return false };
    let ray = app.camera.ray(at, app.view_size);
    let distance = p.as_vec3().distance(ray.origin);
    match scene.index.ray(ray.origin.as_dvec3(), ray.direction.as_dvec3()) {
        Some((hit, _)) => hit.position(&scene.design_mesh).as_vec3().distance(ray.origin) > distance - DEPTH_TOLERANCE,
        // The ray misses the surface at a silhouette.
        None => true,
    }
}

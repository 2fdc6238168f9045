//! Picks the node or the arc of the layout under the pointer.

use glam::{DVec3, Vec2};

use super::state::PlaitApp;
use crate::engine::{LayoutPart, LayoutPreview};

/// Pick radius of a node, in points: a little more than its marker.
const NODE_RADIUS: f32 = 8.0;
/// Pick radius of an arc, in points. It is smaller, since strips are placed between arcs.
const ARC_RADIUS: f32 = 4.0;

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
    let best = nodes.filter(|&(_, p, _)| app.sees(p)).min_by(|a, b| a.2.total_cmp(&b.2));
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
                if nearer && app.sees(arc.points[k - 1].lerp(*p, f64::from(t))) {
                    best = Some((i, distance));
                }
            }
            before = now;
        }
    }
    best.map(|(i, _)| LayoutPart::Arc(i))
}

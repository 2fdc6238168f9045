//! Picks the placed strip under the pointer.

use glam::{DVec3, Vec2};

use super::state::PlaitApp;
use crate::distortion::ColourMode;
use crate::engine::StripId;

/// Radius in which the spine of a placed strip is picked, in points.
const REACH: f32 = 6.0;

/// The visible placed strip whose spine is nearest to `at` on the screen. `None` where strips are hidden.
pub fn pick(app: &PlaitApp, at: Vec2) -> Option<StripId> {
    if !app.options.stripes || app.colour_mode() != ColourMode::Regions || app.is_optimising() {
        return None;
    }
    let strips = app.scene.as_ref()?.strips.iter().filter(|s| s.visible);
    let near = strips.filter_map(|s| Some((s.id, nearest_on(app, &s.polyline, s.closed, at, REACH)?.0)));
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(id, _)| id)
}

/// The point of a polyline in space that appears nearest to `at` within `reach` points, of those not hidden by the surface,
/// with its distance on the screen.
pub fn nearest_on(app: &PlaitApp, polyline: &[DVec3], closed: bool, at: Vec2, reach: f32) -> Option<(f32, DVec3)> {
    let on_screen = |p: DVec3| app.camera.project(p.as_vec3(), app.view_size);
    let n = polyline.len();
    let mut best: Option<(f32, DVec3)> = None;
    for i in 0..if closed { n } else { n.saturating_sub(1) } {
        let (p, q) = (polyline[i], polyline[(i + 1) % n]);
        let (Some(a), Some(b)) = (on_screen(p), on_screen(q)) else { continue };
        let t = ((at - a).dot(b - a) / (b - a).length_squared().max(1e-6)).clamp(0.0, 1.0);
        let distance = at.distance(a.lerp(b, t));
        let point = p.lerp(q, f64::from(t));
        if distance <= reach && best.is_none_or(|(d, _)| distance < d) && app.sees(point) {
            best = Some((distance, point));
        }
    }
    best
}

//! Polylines that show the arcs of an embedding, before and during its optimisation.

use glam::DVec3;

use crate::layout::Embedding;

/// Segments of a smoothed polyline, whatever its length.
const SEGMENTS: usize = 48;
/// Smoothing rounds. The kernel 1/4, 1/2, 1/4 has a standard deviation of √(120/2) ≈ 8 segments after 120 rounds: a kink
/// spreads over about a quarter of the arc.
const SMOOTHING_ROUNDS: usize = 120;
/// Smoothing rounds between two projections to the surface.
const ROUNDS_PER_PROJECTION: usize = 15;

/// Positions of the nodes and polylines of the arcs of an embedding.
pub fn embedding_polylines(embedding: &Embedding) -> (Vec<DVec3>, Vec<Vec<DVec3>>) {
    let position = |&v: &u32| embedding.mesh.positions[v as usize];
    let arcs = embedding.arcs.iter().map(|a| a.iter().map(position).collect());
    (embedding.nodes.iter().map(position).collect(), arcs.collect())
}

/// A polyline resampled to equal segments and smoothed, with the same ends. `on_surface` projects a point to the surface.
pub fn smoothed_polyline(line: &[DVec3], on_surface: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
    let mut points = resampled(line, SEGMENTS);
    for round in 1..=SMOOTHING_ROUNDS {
        let before = points.clone();
        for (p, around) in points[1..].iter_mut().zip(before.windows(3)) {
            *p = 0.25 * (around[0] + 2.0 * around[1] + around[2]);
        }
        if round % ROUNDS_PER_PROJECTION == 0 {
            let inner = points.len().saturating_sub(1);
            points[1..inner].iter_mut().for_each(|p| *p = on_surface(*p));
        }
    }
    points
}

/// Points at equal distances along a polyline, with both ends.
fn resampled(line: &[DVec3], segments: usize) -> Vec<DVec3> {
    let length: f64 = line.windows(2).map(|w| w[0].distance(w[1])).sum();
    let mut points = Vec::with_capacity(segments + 1);
    let mut passed = 0.0;
    for w in line.windows(2) {
        let step = w[0].distance(w[1]);
        while points.len() < segments && length * points.len() as f64 / segments as f64 <= passed + step {
            let t = (length * points.len() as f64 / segments as f64 - passed) / step.max(f64::MIN_POSITIVE);
            points.push(w[0].lerp(w[1], t.clamp(0.0, 1.0)));
        }
        passed += step;
    }
    points.extend(line.last());
    points
}

/// Moves a polyline to new ends. Points in between move by the displacement of the ends, interpolated along the length,
/// and are projected to the surface by `on_surface`.
pub fn move_ends(points: &mut [DVec3], ends: [DVec3; 2], on_surface: impl Fn(DVec3) -> DVec3) {
    let (Some(&first), Some(&last)) = (points.first(), points.last()) else { return };
    let moves = [ends[0] - first, ends[1] - last];
    if moves == [DVec3::ZERO; 2] {
        return;
    }
    let length: f64 = points.windows(2).map(|w| w[0].distance(w[1])).sum();
    let (mut along, mut before, n) = (0.0, first, points.len());
    for (k, p) in points.iter_mut().enumerate() {
        along += p.distance(before);
        before = *p;
        let moved = *p + moves[0].lerp(moves[1], if length > 0.0 { along / length } else { 0.0 });
        *p = if k == 0 || k == n - 1 { moved } else { on_surface(moved) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_the_ends_and_removes_kinks() {
        let kinked = [DVec3::ZERO, DVec3::new(1.0, 0.4, 0.0), DVec3::new(2.0, 0.0, 0.0)];
        let line = smoothed_polyline(&kinked, |p| p);
        assert_eq!((line.len(), line[0], line[48]), (49, kinked[0], kinked[2]));
        let turn = |l: &[DVec3]| l.windows(3).map(|w| (w[1] - w[0]).angle_between(w[2] - w[1])).fold(0.0, f64::max);
        assert!(turn(&line) < 0.1 && turn(&kinked) > 0.7, "{}", turn(&line));
    }

    #[test]
    fn a_moved_polyline_ends_at_the_new_ends() {
        let mut line: Vec<DVec3> = (0..5).map(|i| DVec3::new(f64::from(i), 0.0, 0.0)).collect();
        move_ends(&mut line, [DVec3::Y, DVec3::new(4.0, 0.0, 0.0)], |p| p.with_z(7.0));
        assert_eq!((line[0], line[2]), (DVec3::Y, DVec3::new(2.0, 0.5, 7.0)));
        assert_eq!(line[4], DVec3::new(4.0, 0.0, 0.0));
    }
}

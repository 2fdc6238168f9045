//! The original curve and the tube around it, in which a relaxed curve stays.

use glam::DVec3;

use super::energy::Energy;
use super::options::{RelaxOptions, Waypoint};
use super::triangle_strip::TriangleStrip;
use crate::mesh::TriMesh;
use crate::surface::vertex_fan::Side;

/// Weight of the squared distance from a waypoint, relative to that of bending. A curve displaced at one point deforms
/// over a length `λ` of about half a model size and resists with a stiffness of `192 / λ³`, about a
/// thousand; this weight is far larger, so the curve nearly passes the point. It is far smaller than the cost of a kink
/// at a single edge.
const WAYPOINT_WEIGHT: f64 = 2e4;
/// The same for waypoints with a direction, which hold the curve a few edges apart. A curve clamped at an angle to where it
/// tends resists with a stiffness of `12 / h³` at distance `h`, about `10⁶` for the edges of ordinary meshes.
const DIRECTED_WAYPOINT_WEIGHT: f64 = 1e6;
/// How far along the original curve, in segments, the nearest segment is searched around the last one.
const SEARCH_REACH: usize = 8;

/// The point of the original curve nearest to a given point.
struct Foot {
    point: DVec3,
    /// Vector along its segment.
    along: DVec3,
    segment: usize,
}

/// A waypoint in space.
#[derive(Debug, Clone, Copy)]
struct PlacedWaypoint {
    point: DVec3,
    /// Unit vector along the curve; zero: that of the original curve.
    direction: DVec3,
    /// The nearest crossing of the original curve.
    reference: usize,
}

/// The original curve with a tube around it.
pub(super) struct Tube<'a> {
    pub mesh: &'a TriMesh,
    pub options: &'a RelaxOptions<'a>,
    /// Crossings of the original curve.
    points: Vec<DVec3>,
    closed: bool,
    waypoints: Vec<PlacedWaypoint>,
    radius: f64,
}

impl<'a> Tube<'a> {
    /// The tube around a strip's curve.
    pub fn new(mesh: &'a TriMesh, options: &'a RelaxOptions<'a>, strip: &TriangleStrip) -> Self {
        let edges: f64 = strip.crossings.iter().map(|n| mesh.vector(n.halfedge).length()).sum();
        let points: Vec<DVec3> = (0..strip.len()).map(|i| strip.point(mesh, i)).collect();
        let nearest = |p: DVec3| {
            let distance = |i: &usize| points[*i].distance_squared(p);
            (0..points.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
        };
        let place = |w: &Waypoint| {
            let (point, direction) = (w.at.position(mesh), w.direction.unwrap_or(DVec3::ZERO).normalize_or_zero());
            PlacedWaypoint { point, direction, reference: nearest(point) }
        };
        let waypoints = options.waypoints.iter().map(place).collect();
        let radius = options.tube * edges / strip.len() as f64;
        Self { mesh, options, points, closed: strip.closed, waypoints, radius }
    }

    /// Moves the crossings of a strip by at most `steps` steps of minimisation; returns the energy and the parameters.
    pub fn minimise(&self, strip: &mut TriangleStrip, steps: usize) -> (Energy<'a>, Vec<f64>) {
        let energy = self.energy(strip);
        let mut t: Vec<f64> = strip.crossings.iter().map(|n| n.t).collect();
        energy.minimise(&mut t, steps);
        strip.crossings.iter_mut().zip(&t).for_each(|(n, &t)| n.t = t);
        (energy, t)
    }

    /// Whether the vertex at one end of the edge crossed at `i` lies in the tube.
    pub fn contains_end(&self, strip: &TriangleStrip, i: usize, side: Side) -> bool {
        let p = self.mesh.position(strip.end(self.mesh, i, side));
        self.foot(p, strip.crossings[i].reference).point.distance(p) <= self.radius
    }

    /// Distance of crossing `i` from the original curve.
    pub fn displacement(&self, strip: &TriangleStrip, i: usize) -> f64 {
        let p = strip.point(self.mesh, i);
        self.foot(p, strip.crossings[i].reference).point.distance(p)
    }

    fn n_segments(&self) -> usize {
        if self.closed { self.points.len() } else { self.points.len() - 1 }
    }

    /// The point nearest to `p` on the segments around `reference`.
    fn foot(&self, p: DVec3, reference: usize) -> Foot {
        let (n, reach) = (self.n_segments(), SEARCH_REACH.min(self.n_segments() / 2));
        let margin = (self.options.tie * self.radius).powi(2);
        let mut least = f64::INFINITY;
        let mut best = Foot { point: self.points[0], along: DVec3::ZERO, segment: 0 };
        for k in 0..=2 * reach {
            let segment = if self.closed {
                (reference + n + k - reach) % n
            } else {
                match (reference + k).checked_sub(reach) {
                    Some(j) if j < n => j,
                    _ => continue,
                }
            };
            let a = self.points[segment];
            let along = self.points[(segment + 1) % self.points.len()] - a;
            let s = (along.dot(p - a) / along.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let point = a + along * s;
            let distance = point.distance_squared(p);
            // A crossing of the original curve is on two of its segments: rounding must not decide whose tangent it has.
            if distance + margin < least {
                least = distance;
                best = Foot { point, along, segment };
            }
        }
        best
    }

    /// The energy of a strip with the fidelity to this curve; updates the references of the strip's crossings.
    fn energy(&self, strip: &mut TriangleStrip) -> Energy<'a> {
        let mesh = self.mesh;
        let points: Vec<DVec3> = (0..strip.len()).map(|i| strip.point(mesh, i)).collect();
        let lengths: Vec<f64> = (0..strip.n_segments()).map(|j| points[j].distance(points[strip.after(j)])).collect();
        let (mut fidelity, mut bounds) = (Vec::with_capacity(strip.len()), Vec::with_capacity(strip.len()));
        for i in 0..strip.len() {
            let Foot { point: foot, along, segment } = self.foot(points[i], strip.crossings[i].reference);
            let here = lengths.get(i).copied().unwrap_or(0.0);
            let back = if strip.closed || i > 0 { lengths[strip.before(i)] } else { 0.0 };
            let [right, left] = [Side::Right, Side::Left].map(|s| mesh.position(strip.end(mesh, i, s)));
            // Squared distances are quadratic polynomials of the parameter. Only the component of the displacement
            // orthogonal to the original curve counts for the fidelity.
            let tangent = along.normalize_or_zero();
            let away = square(right - foot, left - right);
            let crossing = &mut strip.crossings[i];
            crossing.reference = segment;
            let weight = self.options.fidelity * 0.5 * (here + back) / (self.radius * self.radius);
            let across = square(orthogonal(right - foot, tangent), orthogonal(left - right, tangent));
            fidelity.push(across.map(|x| weight * x));
            bounds.push(if crossing.fixed { (crossing.t, crossing.t) } else { self.bounds(away, crossing.t) });
        }
        for &waypoint in &self.waypoints {
            self.add_waypoint(strip, waypoint, &mut fidelity);
        }
        Energy::new(mesh, self.options, strip, fidelity, bounds)
    }

    /// Adds the squared distance from a waypoint, across the curve, to the fidelity of the crossing nearest to it. Does
    /// nothing if the strip is a window that does not contain that part of the curve.
    fn add_waypoint(&self, strip: &TriangleStrip, waypoint: PlacedWaypoint, fidelity: &mut [[f64; 3]]) {
        let mesh = self.mesh;
        let PlacedWaypoint { point: p, direction, reference } = waypoint;
        let around = |i: &usize| {
            let apart = strip.crossings[*i].reference.abs_diff(reference);
            apart.min(self.points.len() - apart) <= SEARCH_REACH
        };
        let distance = |i: &usize| strip.point(mesh, *i).distance_squared(p);
        let Some(i) = (0..strip.len()).filter(around).min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            return;
        };
        let j = strip.crossings[i].reference;
        let along = (self.points[(j + 1) % self.points.len()] - self.points[j]).normalize_or_zero();
        let (tangent, weight) = match direction {
            DVec3::ZERO => (along, WAYPOINT_WEIGHT),
            _ => (direction, DIRECTED_WAYPOINT_WEIGHT),
        };
        let [right, left] = [Side::Right, Side::Left].map(|s| mesh.position(strip.end(mesh, i, s)));
        let square = square(orthogonal(right - p, tangent), orthogonal(left - right, tangent));
        let weight = weight * self.options.beta;
        fidelity[i].iter_mut().zip(square).for_each(|(f, s)| *f += weight * s);
    }

    /// The interval of parameters inside the tube and at least `t_min` from the vertices, extended to contain `t`. The
    /// squared distance from the original curve is `c + b t + a t²`.
    fn bounds(&self, [c, b, a]: [f64; 3], t: f64) -> (f64, f64) {
        let t_min = self.options.t_min;
        let (mut low, mut high) = (t_min, 1.0 - t_min);
        if a > 0.0 {
            let root = (b * b - 4.0 * a * (c - self.radius * self.radius)).max(0.0).sqrt();
            low = low.max((-b - root) / (2.0 * a));
            high = high.min((-b + root) / (2.0 * a));
        }
        (low.min(t), high.max(t))
    }
}

/// The component of `v` orthogonal to a unit vector.
fn orthogonal(v: DVec3, tangent: DVec3) -> DVec3 {
    v - tangent * v.dot(tangent)
}

/// The coefficients of `|c + t d|²`, constant first.
fn square(c: DVec3, d: DVec3) -> [f64; 3] {
    [c.length_squared(), 2.0 * c.dot(d), d.length_squared()]
}

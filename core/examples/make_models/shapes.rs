//! The shapes of the models.

use glam::{DVec2, DVec3, dvec3};

use super::field::{ellipsoid, round_cone, tube, unite};

/// A model: an implicit function, the box it is meshed in, cutting planes, and edge length.
pub struct Shape {
    pub name: &'static str,
    pub field: Box<dyn Fn(DVec3) -> f64>,
    pub min: DVec3,
    pub max: DVec3,
    /// Planes `normal · p = offset`; the part with `normal · p > offset` is cut off.
    pub cuts: Vec<(DVec3, f64)>,
    /// Wanted edge length.
    pub edge: f64,
}

impl Shape {
    /// The gradient of the field, by central differences.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        // Small relative to all features, large relative to rounding errors of the field.
        const STEP: f64 = 1e-5;
        let along = |d: DVec3| ((self.field)(p + d * STEP) - (self.field)(p - d * STEP)) / (2.0 * STEP);
        dvec3(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
    }

    /// Projects a point onto the zero set by Newton steps along the gradient; within a plane if it lies on one.
    pub fn project(&self, mut p: DVec3, plane: Option<usize>) -> DVec3 {
        for _ in 0..8 {
            let mut g = self.gradient(p);
            if let Some((normal, offset)) = plane.map(|i| self.cuts[i]) {
                p -= normal * (normal.dot(p) - offset);
                g -= normal * normal.dot(g);
            }
            let steepness = g.length_squared();
            if steepness < 1e-12 {
                break;
            }
            let step = g * ((self.field)(p) / steepness);
            // Where the function is far from linear, Newton steps are too long.
            p -= step.clamp_length_max(0.5 * self.edge);
        }
        p
    }
}

/// All models.
pub fn all() -> Vec<Shape> {
    vec![creature(), rounded_cube(), pretzel(), torus(), sleeve()]
}

fn closed(name: &'static str, half: DVec3, centre: DVec3, edge: f64, field: impl Fn(DVec3) -> f64 + 'static) -> Shape {
    Shape { name, field: Box::new(field), min: centre - half, max: centre + half, cuts: Vec::new(), edge }
}

/// A four-legged animal with a curled tail.
fn creature() -> Shape {
    let field = |p: DVec3| {
        // The shape is symmetric: legs and ears are defined on one side.
        let q = dvec3(p.x, p.y, p.z.abs());
        let mut d = round_cone(p, dvec3(-0.50, 0.74, 0.0), dvec3(0.42, 0.80, 0.0), 0.30, 0.31);
        d = unite(d, round_cone(p, dvec3(0.55, 0.92, 0.0), dvec3(0.88, 1.32, 0.0), 0.21, 0.16), 0.20);
        d = unite(d, ellipsoid(p, dvec3(0.98, 1.42, 0.0), dvec3(0.25, 0.22, 0.21)), 0.12);
        d = unite(d, round_cone(p, dvec3(1.05, 1.38, 0.0), dvec3(1.30, 1.30, 0.0), 0.15, 0.11), 0.10);
        d = unite(d, round_cone(q, dvec3(0.90, 1.54, 0.12), dvec3(0.78, 1.80, 0.25), 0.10, 0.075), 0.10);
        for (hip, foot) in [(0.42, 0.46), (-0.50, -0.54)] {
            let (top, knee) = (dvec3(hip, 0.66, 0.17), dvec3(0.5 * (hip + foot) + 0.02, 0.36, 0.21));
            let sole = dvec3(foot, 0.13, 0.22);
            d = unite(d, round_cone(q, top, knee, 0.17, 0.125), 0.14);
            d = unite(d, round_cone(q, knee, sole, 0.125, 0.11), 0.08);
            d = unite(d, ellipsoid(q, sole + dvec3(0.05, -0.02, 0.0), dvec3(0.17, 0.11, 0.13)), 0.10);
        }
        // The tail: a Bézier curve from the rump up and forward.
        let tail = |t: f64| {
            let s = 1.0 - t;
            let [a, b, c, d] = [(-0.66, 0.84), (-1.20, 0.82), (-1.36, 1.32), (-1.02, 1.62)];
            let at = |a: f64, b: f64, c: f64, d: f64| s * s * s * a + 3.0 * s * t * (s * b + t * c) + t * t * t * d;
            dvec3(at(a.0, b.0, c.0, d.0), at(a.1, b.1, c.1, d.1), 0.0)
        };
        // Pieces shorter than the triangles: their joints are not visible.
        let piece = |i: u32| {
            let (s, t) = (f64::from(i) / 40.0, f64::from(i + 1) / 40.0);
            let r = |t: f64| 0.125 - 0.025 * t;
            round_cone(p, tail(s), tail(t), r(s), r(t))
        };
        d = unite(d, (0..40).map(piece).fold(f64::INFINITY, f64::min), 0.18);
        d
    };
    closed("creature", dvec3(1.6, 1.1, 0.6), dvec3(0.05, 0.95, 0.0), 0.044, field)
}

/// A cube with rounded edges and corners: a ball of a p-norm.
fn rounded_cube() -> Shape {
    // Between a ball (2) and a cube (infinity).
    const POWER: f64 = 5.0;
    let field = |p: DVec3| p.abs().to_array().map(|x| x.powf(POWER)).iter().sum::<f64>().powf(1.0 / POWER) - 0.8;
    closed("rounded-cube", DVec3::splat(1.0), DVec3::ZERO, 0.058, field)
}

/// A pretzel: one strand whose ends cross and blend into its bow; genus 3.
fn pretzel() -> Shape {
    let curve: Vec<DVec3> = (0..=400)
        .map(|i| {
            let t = -4.0 + 8.0 * f64::from(i) / 400.0;
            0.46 * dvec3((3.3 - 0.4 * t * t) * t.sin(), (2.5 - 0.3 * t * t) * t.cos() - 0.9, 0.0)
        })
        .collect();
    closed("pretzel", dvec3(1.8, 1.3, 0.5), DVec3::ZERO, 0.049, move |p| tube(p, &curve, 0.18))
}

/// A torus.
fn torus() -> Shape {
    let field = |p: DVec3| DVec2::new(DVec2::new(p.x, p.z).length() - 0.75, p.y).length() - 0.32;
    closed("torus", dvec3(1.2, 0.45, 1.2), DVec3::ZERO, 0.055, field)
}

/// A shirt: open at the hem, the neck and both sleeves.
fn sleeve() -> Shape {
    let field = |p: DVec3| {
        let q = dvec3(p.x.abs(), p.y, p.z);
        // The trunk is flattened: depth is scaled before the round cone is evaluated.
        let flat = dvec3(p.x, p.y, p.z * 1.45);
        let trunk = round_cone(flat, dvec3(0.0, -0.6, 0.0), dvec3(0.0, 0.92, 0.0), 0.50, 0.44) / 1.2;
        let arm = round_cone(q, dvec3(0.28, 1.02, 0.0), dvec3(1.25, 0.62, 0.0), 0.25, 0.20);
        let neck = round_cone(p, dvec3(0.0, 1.10, 0.02), dvec3(0.0, 1.75, 0.05), 0.24, 0.20);
        unite(unite(trunk, arm, 0.25), neck, 0.22)
    };
    let out = dvec3(0.97, -0.40, 0.0).normalize();
    Shape {
        name: "sleeve",
        field: Box::new(field),
        min: dvec3(-1.5, -0.3, -0.6),
        max: dvec3(1.5, 1.7, 0.6),
        cuts: vec![
            (DVec3::NEG_Y, 0.0),
            (dvec3(0.0, 1.0, 0.12).normalize(), 1.40),
            (out, 0.62),
            (dvec3(-out.x, out.y, 0.0), 0.62),
        ],
        edge: 0.046,
    }
}

//! Implicit functions: smooth, negative inside a shape, close to the signed distance near its surface.

use glam::DVec3;

/// A round cone: the convex hull of two spheres.
pub fn round_cone(p: DVec3, a: DVec3, b: DVec3, r1: f64, r2: f64) -> f64 {
    let (axis, shrink) = (b - a, r1 - r2);
    let length2 = axis.length_squared();
    let slant2 = length2 - shrink * shrink;
    let along = (p - a).dot(axis);
    let beyond = along - length2;
    let x2 = ((p - a) * length2 - axis * along).length_squared();
    let (along2, beyond2) = (along * along * length2, beyond * beyond * length2);
    let k = shrink.signum() * shrink * shrink * x2;
    if beyond.signum() * slant2 * beyond2 > k {
        (x2 + beyond2).sqrt() / length2 - r2
    } else if along.signum() * slant2 * along2 < k {
        (x2 + along2).sqrt() / length2 - r1
    } else {
        ((x2 * slant2 / length2).sqrt() + along * shrink) / length2 - r1
    }
}

/// An ellipsoid; close to a distance if its radii are similar.
pub fn ellipsoid(p: DVec3, centre: DVec3, radii: DVec3) -> f64 {
    let q = p - centre;
    let (k0, k1) = ((q / radii).length(), (q / (radii * radii)).length());
    if k1 > 0.0 { k0 * (k0 - 1.0) / k1 } else { -radii.min_element() }
}

/// The smooth union of two shapes, with a fillet of about width `k`.
pub fn unite(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    // A cubic blend: its second derivative vanishes where the fillet begins, so the curvature is continuous there.
    a.min(b) - h * h * h * k / 6.0
}

/// A tube of radius about `r` along a polyline, as a convolution surface with a Gaussian kernel: strands that meet blend
/// smoothly.
pub fn tube(p: DVec3, curve: &[DVec3], r: f64) -> f64 {
    // With a kernel of the tube's width, crossings are a third thicker than strands.
    let sigma2 = r * r;
    let sum: f64 =
        curve.windows(2).map(|w| w[0].distance(w[1]) * (-p.distance_squared(0.5 * (w[0] + w[1])) / sigma2).exp()).sum();
    // The value on the surface of a long straight tube. The logarithm makes the function close to a distance.
    let iso = (std::f64::consts::PI * sigma2).sqrt() * (-1.0f64).exp();
    -0.5 * r * (sum.max(1e-30) / iso).ln()
}

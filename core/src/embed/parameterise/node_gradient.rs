//! The gradient of the map's energy by the position of a node, estimated (Campen, section 6.6.1).
//!
//! The energy depends on a node's position through the shapes of the triangles around it, through the field and through
//! the map. The estimator freezes field and map; the rest has a closed form over the 1-ring. The ring lies in the plane
//! by the geodesic polar map. For a triangle `(h, a, b)` of area `A`, with `φ = J(b − a) / 2A` the gradient of the
//! node's hat function, `J` a rotation by 90° and `W` the matrix of the norm,
//!
//! `∂E/∂h = Σ A [(r_u·W r_u + r_v·W r_v) φ − 2 (φ·W r_u) ∇u − 2 (φ·W r_v) ∇v]`, `r_u = ∇u − u_t`, `r_v = ∇v − v_t`.

use glam::DVec2;

use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::param::{DistortionWeights, EnergyDensity, Objective};
use crate::surface::{Metric, PolarMap};

/// A triangle of the 1-ring in the plane, with the node at the origin.
#[derive(Debug, Clone, Copy)]
struct Wedge {
    face: FaceId,
    /// The two other corners.
    outer: [DVec2; 2],
    /// The coordinates of the three corners, the node's first.
    uv: [DVec2; 3],
    /// The unit direction `u_t`.
    axis: DVec2,
    /// Target lengths of `∇u` and `∇v`.
    lengths: [f64; 2],
}

/// The descent direction `−∂E/∂h` of the least-squares energy at a vertex, as a vector of its polar map.
pub(in crate::embed) fn descent(
    mesh: &TriMesh,
    metric: &Metric,
    angle: &[f64],
    uv: &[[DVec2; 3]],
    objective: &Objective,
    v: VertexId,
) -> DVec2 {
    wedges(mesh, metric, angle, uv, objective, v).iter().map(|w| -w.gradient(DVec2::ZERO, objective.anisotropy)).sum()
}

/// The descent direction of the energy of injective maps. If the map is at its minimum, the derivative through the map
/// vanishes and the estimator only neglects that through the field.
pub(in crate::embed) fn injective_descent(
    mesh: &TriMesh,
    metric: &Metric,
    angle: &[f64],
    uv: &[[DVec2; 3]],
    (objective, distortion, anisotropy_share): (&Objective, DistortionWeights, &[f64]),
    v: VertexId,
) -> DVec2 {
    let share = |w: &Wedge| anisotropy_share.get(w.face.index()).copied().unwrap_or(1.0);
    let wedges = wedges(mesh, metric, angle, uv, objective, v);
    wedges.iter().map(|w| -w.injective_gradient(DVec2::ZERO, distortion.with_anisotropy_share(share(w)))).sum()
}

/// The triangles of the 1-ring of a vertex, counter-clockwise.
fn wedges(
    mesh: &TriMesh,
    metric: &Metric,
    angle: &[f64],
    uv: &[[DVec2; 3]],
    objective: &Objective,
    v: VertexId,
) -> Vec<Wedge> {
    let polar = PolarMap::new(mesh, metric, v);
    polar
        .spokes
        .iter()
        .map(|&(h, at)| {
            let (f, i): (FaceId, usize) = (mesh.face(h), h.index() % 3);
            let far = at + polar.scale * metric.corner_angle(h);
            let reach = [metric.length(h), metric.length(mesh.prev(h))];
            let w = uv[f.index()];
            Wedge {
                face: f,
                outer: [DVec2::from_angle(at) * reach[0], DVec2::from_angle(far) * reach[1]],
                uv: [w[i], w[(i + 1) % 3], w[(i + 2) % 3]],
                axis: DVec2::from_angle(at + angle[f.index()] - metric.direction(h)),
                lengths: objective.lengths.get(f.index()).copied().unwrap_or([1.0; 2]),
            }
        })
        .collect()
}

impl Wedge {
    /// Area, `φ`, and for each coordinate the gradient `∇u`, the residual `r_u` and `W r_u`, with the node at `h`.
    fn terms(&self, h: DVec2, rho: f64) -> (f64, DVec2, [(DVec2, DVec2, DVec2); 2]) {
        let [a, b] = self.outer;
        let area = 0.5 * (a - h).perp_dot(b - h);
        let hats = [b - a, h - b, a - h].map(|side| side.perp() / (2.0 * area));
        let terms = [0, 1].map(|k| {
            let gradient: DVec2 = (0..3).map(|i| hats[i] * self.uv[i][k]).sum();
            let along = if k == 0 { self.axis } else { self.axis.perp() };
            let residual = gradient - along * self.lengths[k];
            let weighted = along * along.dot(residual) + along.perp() * (rho * along.perp().dot(residual));
            (gradient, residual, weighted)
        });
        (area, hats[0], terms)
    }

    /// The summand of `∂E/∂h` with the node at `h`.
    fn gradient(&self, h: DVec2, rho: f64) -> DVec2 {
        let (area, phi, terms) = self.terms(h, rho);
        terms
            .iter()
            .map(|&(gradient, residual, weighted)| {
                area * (residual.dot(weighted) * phi - 2.0 * phi.dot(weighted) * gradient)
            })
            .sum()
    }

    /// Area, `φ`, and the gradients of the map in the frame of the field.
    fn matrix(&self, h: DVec2) -> (f64, DVec2, [f64; 4]) {
        let (area, phi, terms) = self.terms(h, 1.0);
        let [[ux, uy], [vx, vy]] = terms.map(|(g, ..)| [g.dot(self.axis), g.dot(self.axis.perp())]);
        (area, phi, [ux, uy, vx, vy])
    }

    /// The summand for an energy density `e(∇u, ∇v)`: `A [e φ − (∂e/∂∇u·φ) ∇u − (∂e/∂∇v·φ) ∇v]`.
    fn injective_gradient(&self, h: DVec2, distortion: DistortionWeights) -> DVec2 {
        let (area, phi, j) = self.matrix(h);
        let density = EnergyDensity::new(distortion, self.lengths);
        let Some(e) = density.value(&j) else { return DVec2::ZERO };
        let slope = density.gradient(&j);
        let across = self.axis.perp();
        let (px, py) = (phi.dot(self.axis), phi.dot(across));
        let along = |k: usize| (slope[k] * px + slope[k + 1] * py) * (self.axis * j[k] + across * j[k + 1]);
        area * (e * phi - along(0) - along(2))
    }

    #[cfg(test)]
    fn injective_energy(&self, h: DVec2, distortion: DistortionWeights) -> f64 {
        let (area, _, j) = self.matrix(h);
        area * EnergyDensity::new(distortion, self.lengths).value(&j).unwrap()
    }

    #[cfg(test)]
    fn energy(&self, h: DVec2, rho: f64) -> f64 {
        let (area, _, terms) = self.terms(h, rho);
        area * terms.iter().map(|t| t.1.dot(t.2)).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn least_squares_gradient_agrees_with_finite_differences() {
        let noise = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) % 1000) / 1000.0 - 0.5;
        for k in 0..40 {
            let n = 5 + k % 3;
            let turn = std::f64::consts::TAU / f64::from(n);
            let reach = |i: u32| 1.0 + 0.6 * noise(31 * k + i % n);
            let wedges: Vec<Wedge> = (0..n)
                .map(|i| Wedge {
                    face: FaceId(i),
                    outer: [0, 1].map(|j| DVec2::from_angle(turn * f64::from(i + j)) * reach(i + j)),
                    uv: [1, 2, 3].map(|j| DVec2::new(noise(7 * k + i + j), noise(11 * k + 3 * i + j))),
                    axis: DVec2::from_angle(3.0 * noise(k + i)),
                    lengths: [1.0 + noise(i), 1.0 - noise(i)],
                })
                .collect();
            let h = DVec2::new(0.2 * noise(k), 0.2 * noise(k + 5));
            let energy = |h: DVec2| wedges.iter().map(|w| w.energy(h, 10.0)).sum::<f64>();
            let exact: DVec2 = wedges.iter().map(|w| w.gradient(h, 10.0)).sum();
            let step = 1e-5;
            let difference = |d: DVec2| (energy(h + step * d) - energy(h - step * d)) / (2.0 * step);
            let measured = DVec2::new(difference(DVec2::X), difference(DVec2::Y));
            assert!(exact.distance(measured) < 1e-8 * (1.0 + exact.length()) * 10.0, "{exact} {measured}");
        }
    }

    #[test]
    fn injective_gradient_agrees_with_finite_differences() {
        let distortion = DistortionWeights { anisotropy: 3.0, size: 0.3 };
        let (n, turn) = (6, std::f64::consts::TAU / 6.0);
        // A 1-ring mapped by a perturbed identity.
        let bent = |p: DVec2| p + DVec2::new(0.1 * p.y * p.y, 0.2 * p.x * p.y);
        let corner = |i: u32| DVec2::from_angle(turn * f64::from(i)) * (1.0 + 0.1 * f64::from(i % n));
        let wedges: Vec<Wedge> = (0..n)
            .map(|i| Wedge {
                face: FaceId(i),
                outer: [corner(i), corner(i + 1)],
                uv: [bent(DVec2::ZERO), bent(corner(i)), bent(corner(i + 1))],
                axis: DVec2::from_angle(0.2 + 0.1 * f64::from(i)),
                lengths: [1.0, 1.2],
            })
            .collect();
        let h = DVec2::new(0.05, -0.08);
        let energy = |h: DVec2| wedges.iter().map(|w| w.injective_energy(h, distortion)).sum::<f64>();
        let exact: DVec2 = wedges.iter().map(|w| w.injective_gradient(h, distortion)).sum();
        let difference = |d: DVec2| (energy(h + 1e-5 * d) - energy(h - 1e-5 * d)) / 2e-5;
        let measured = DVec2::new(difference(DVec2::X), difference(DVec2::Y));
        assert!(exact.distance(measured) < 1e-7 * (1.0 + exact.length()), "{exact} {measured}");
    }
}

//! The quads of an embedded layout: refined, projected to the surface and smoothed.
//!
//! On a surface with features, vertices of quads on features are fixed while the others are smoothed. Where that leaves a
//! quad nearly flat, the vertices around it are released, and the smoothing starts again.

use glam::DVec3;

use crate::embed::Surface;
use crate::layout::{Embedding, PatchMap, QuadLayout};
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;
use crate::proxy::Proxy;
use crate::quad::{
    FeatureConstraint, QuadMesh, Spacing, project, quality, refine, repair_locally, scaled_jacobians, smooth,
};
use crate::surface::{SurfacePoint, nearest_in_triangle};
use crate::weave::error::WeaveError;
use crate::weave::export::input::EmbeddingInput;

/// Distance from a sharp edge up to which a vertex lies on it, on a surface of model size 1: a tenth of the
/// smallest visible width.
const ON_FEATURE: f64 = 1e-4;
/// Scaled Jacobian below which a quad releases the fixed vertices around it. Chosen by hand.
const FLAT: f64 = 0.3;
/// Number of times that vertices are released, at most. Chosen by hand.
const RELEASES: usize = 3;
/// Rings of quads around a flat quad whose vertices are released. Chosen by hand.
const RELEASED_RINGS: usize = 2;
/// Number of connected vertices on a feature from which on the quads resolve the feature. Chosen by hand.
const RESOLVED: usize = 8;

/// The refinement of an embedded layout on the design mesh.
pub(super) fn quads(
    input: &EmbeddingInput<'_>,
    (layout, embedding, maps): (&QuadLayout, &Embedding, &[PatchMap]),
    optimised: bool,
    spacing: &Spacing,
    progress: &Progress,
) -> Result<QuadMesh, WeaveError> {
    let surface = input.surface;
    progress.report("Refining to quads", 0.97);
    let mut quads = refine(layout, embedding, maps, spacing);
    if optimised || input.proxy.is_some() {
        project(&mut quads, surface.mesh);
    }
    let mesh = match input.proxy {
        Some((proxy, original)) => {
            transfer_to_original(&mut quads, proxy, original);
            project(&mut quads, original);
            original
        }
        None => surface.mesh,
    };
    // Vertices on features stay there. The positions of features are known on the design mesh only, so on a proxy with
    // features nothing is smoothed unless a quad is folded.
    let aligned = optimised && surface.sharp.contains(&true);
    if !aligned || input.proxy.is_none() || quality(&quads).0 > 0 {
        let mut fixed = if aligned && input.proxy.is_none() { on_features(&quads, &surface) } else { Vec::new() };
        let refined = quads.clone();
        smooth(&mut quads, mesh, &fixed, progress)?;
        // A flat or folded quad is worse than a vertex off its feature.
        for _ in 0..RELEASES {
            let is_corner = |v: usize| is_corner(quads.positions[v], quads.base_face[v], &surface);
            if !release(&quads, is_corner, &mut fixed) {
                break;
            }
            quads.clone_from(&refined);
            smooth(&mut quads, mesh, &fixed, progress)?;
        }
        let on_feature = |p, f| is_on_feature(p, f, &surface);
        repair_locally(&mut quads, mesh, &FeatureConstraint { vertices: &fixed, on_feature: &on_feature }, progress)?;
    }
    Ok(quads)
}

/// For each vertex of the quads whether it is fixed on the feature that it lies on.
fn on_features(quads: &QuadMesh, surface: &Surface<'_>) -> Vec<bool> {
    let places = quads.positions.iter().zip(&quads.base_face);
    let on: Vec<bool> = places.map(|(&p, &f)| is_on_feature(p, f, surface)).collect();
    resolved(&on, &quads.quads)
}

/// Marks the vertices on features that belong to a group of [`RESOLVED`] or more, connected by sides of quads. Others lie on
/// a feature by chance, or on a crease too short for the quads.
fn resolved(on: &[bool], quads: &[[u32; 4]]) -> Vec<bool> {
    let mut along = vec![Vec::new(); on.len()];
    for [a, b] in quads.iter().flat_map(|q| (0..4).map(|k| [q[k], q[(k + 1) % 4]])) {
        if on[a as usize] && on[b as usize] {
            along[a as usize].push(b);
            along[b as usize].push(a);
        }
    }
    let mut fixed = vec![false; on.len()];
    let mut seen: Vec<bool> = on.iter().map(|on| !on).collect();
    for first in 0..on.len() {
        if std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let mut row = vec![first as u32];
        let mut next = 0;
        while let Some(&v) = row.get(next) {
            next += 1;
            row.extend(along[v as usize].iter().filter(|&&w| !std::mem::replace(&mut seen[w as usize], true)));
        }
        if row.len() >= RESOLVED {
            row.iter().for_each(|&v| fixed[v as usize] = true);
        }
    }
    fixed
}

/// Releases the fixed vertices of flat and folded quads and of the rings around them, except corners of features; returns
/// whether there are any.
fn release(quads: &QuadMesh, is_corner: impl Fn(usize) -> bool, fixed: &mut [bool]) -> bool {
    let flat = scaled_jacobians(quads).into_iter().zip(&quads.quads).filter(|(s, _)| *s < FLAT);
    let mut near = vec![false; quads.positions.len()];
    flat.flat_map(|(_, q)| q).for_each(|&v| near[v as usize] = true);
    for _ in 0..RELEASED_RINGS {
        let touching = quads.quads.iter().filter(|q| q.iter().any(|&v| near[v as usize]));
        let ring: Vec<u32> = touching.flatten().copied().collect();
        ring.into_iter().for_each(|v| near[v as usize] = true);
    }
    let mut any = false;
    for (v, fixed) in fixed.iter_mut().enumerate().filter(|(v, _)| near[*v]) {
        if *fixed && !is_corner(v) {
            (*fixed, any) = (false, true);
        }
    }
    any
}

/// Whether a point in triangle `f` is a vertex at which features meet or end.
fn is_corner(p: DVec3, f: u32, surface: &Surface<'_>) -> bool {
    let mesh = surface.mesh;
    let rays = |v| mesh.outgoing(v).filter(|&h| surface.sharp[mesh.edge(h).index()]).count();
    let near = mesh.face_vertices(FaceId(f)).into_iter().filter(|&v| mesh.position(v).distance(p) < ON_FEATURE);
    near.into_iter().any(|v| rays(v) != 2)
}

/// Whether a point in triangle `f` lies on a sharp edge at one of the triangle's corners.
fn is_on_feature(p: DVec3, f: u32, surface: &Surface<'_>) -> bool {
    let mesh = surface.mesh;
    let around = mesh.face_vertices(FaceId(f)).into_iter().flat_map(|v| mesh.outgoing(v));
    around.filter(|&h| surface.sharp[mesh.edge(h).index()]).any(|h| {
        let (from, along) = (mesh.position(mesh.origin(h)), mesh.vector(h));
        let t = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (from + t * along).distance(p) < ON_FEATURE
    })
}

/// Transfers the vertices of quads from the proxy to the original mesh.
fn transfer_to_original(quads: &mut QuadMesh, proxy: &Proxy, original: &TriMesh) {
    let mesh = proxy.mesh();
    for (position, face) in quads.positions.iter_mut().zip(&mut quads.base_face) {
        let corners = mesh.face_vertices(FaceId(*face)).map(|v| mesh.position(v));
        let at = SurfacePoint { face: FaceId(*face), weights: nearest_in_triangle(*position, &corners) };
        let at = proxy.to_original(original, at);
        (*position, *face) = (at.position(original), at.face.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of unit squares, `n` by `n` vertices.
    fn grid(n: u32) -> QuadMesh {
        let place = |k: u32| DVec3::new(f64::from(k % n), f64::from(k / n), 0.0);
        let quad = |k: u32| {
            let v = k + k / (n - 1);
            [v, v + 1, v + n + 1, v + n]
        };
        let count = (n * n) as usize;
        let quads: Vec<[u32; 4]> = (0..(n - 1) * (n - 1)).map(quad).collect();
        QuadMesh {
            positions: (0..n * n).map(place).collect(),
            patch: vec![0; quads.len()],
            quads,
            base_face: vec![0; count],
            boundary: vec![false; count],
            n_nodes: 1,
            arcs: Vec::new(),
        }
    }

    #[test]
    fn only_long_rows_of_vertices_on_features_are_fixed() {
        let mesh = grid(10);
        let mut on = vec![false; 100];
        (0..10).for_each(|k| on[30 + k] = true);
        (0..4).for_each(|k| on[70 + k] = true);
        on[95] = true;
        let fixed = resolved(&on, &mesh.quads);
        assert!((0..100).all(|v| fixed[v] == (30..40).contains(&v)));
    }

    #[test]
    fn vertices_of_a_flat_quad_are_released_except_corners() {
        let mut mesh = grid(10);
        let mut fixed: Vec<bool> = (0..100).map(|v| v / 10 == 5).collect();
        let before = fixed.clone();
        assert!(!release(&mesh, |_| false, &mut fixed));
        assert_eq!(fixed, before);
        // One corner on the line between its neighbours.
        mesh.positions[54] = 0.5 * (mesh.positions[44] + mesh.positions[55]);
        assert!(release(&mesh, |v| v == 53, &mut fixed));
        assert!(!fixed[54] && !fixed[52] && fixed[53] && fixed[50] && fixed[59]);
    }
}

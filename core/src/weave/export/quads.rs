//! The quads of an embedded layout: refined, brought to the surface and smoothed.

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
use crate::weave::export::files::EmbeddingInput;

/// How near to a sharp edge a vertex lies on it, on a surface of bounding-box diagonal 1: a tenth of the width that can be
/// seen.
const ON_FEATURE: f64 = 1e-4;
/// Scaled Jacobian below which a quad is flat, how often those are let go that hold such a quad, and how many rings of
/// quads around.
const FLAT: f64 = 0.3;
const RELEASES: usize = 3;
const RELEASED_RINGS: usize = 2;
/// Vertices in a row on a feature from which on quads resolve it.
const RESOLVED: usize = 8;

/// The refinement of an embedded layout, on the surface.
pub(in crate::weave) fn quads(
    sketch: &EmbeddingInput<'_>,
    (layout, embedding, maps): (&QuadLayout, &Embedding, &[PatchMap]),
    optimised: bool,
    stops: &Spacing,
    progress: &Progress,
) -> Result<QuadMesh, WeaveError> {
    let surface = sketch.surface;
    progress.report("Refining to quads", 0.97);
    let mut quads = refine(layout, embedding, maps, stops);
    if optimised || sketch.proxy.is_some() {
        project(&mut quads, surface.mesh);
    }
    let mesh = match sketch.proxy {
        Some((proxy, original)) => {
            carry(&mut quads, proxy, original);
            project(&mut quads, original);
            original
        }
        None => surface.mesh,
    };
    // What is aligned to features stays there; on a proxy it is not known where those of the mesh are.
    let aligned = optimised && surface.sharp.contains(&true);
    if !aligned || sketch.proxy.is_none() || quality(&quads).0 > 0 {
        let mut held = if aligned && sketch.proxy.is_none() { on_features(&quads, &surface) } else { Vec::new() };
        let refined = quads.clone();
        smooth(&mut quads, mesh, &held, progress)?;
        // A flat or folded quad is worse than a vertex beside its feature.
        for _ in 0..RELEASES {
            let is_corner = |v: usize| is_corner(quads.positions[v], quads.base_face[v], &surface);
            if !release(&quads, is_corner, &mut held) {
                break;
            }
            quads.clone_from(&refined);
            smooth(&mut quads, mesh, &held, progress)?;
        }
        let on_feature = |p, f| is_on_feature(p, f, &surface);
        repair_locally(&mut quads, mesh, &FeatureConstraint { vertices: &held, on_feature: &on_feature }, progress)?;
    }
    Ok(quads)
}

/// For each vertex of quads on a surface whether it is to stay on the feature that it lies on.
fn on_features(quads: &QuadMesh, surface: &Surface<'_>) -> Vec<bool> {
    let places = quads.positions.iter().zip(&quads.base_face);
    let on: Vec<bool> = places.map(|(&p, &f)| is_on_feature(p, f, surface)).collect();
    resolved(&on, &quads.quads)
}

/// Which of the vertices on features are in rows along sides of quads, long enough to be seen: what lies there by chance, or
/// on a crease too short for the quads, is not.
fn resolved(on: &[bool], quads: &[[u32; 4]]) -> Vec<bool> {
    let mut along = vec![Vec::new(); on.len()];
    for [a, b] in quads.iter().flat_map(|q| (0..4).map(|k| [q[k], q[(k + 1) % 4]])) {
        if on[a as usize] && on[b as usize] {
            along[a as usize].push(b);
            along[b as usize].push(a);
        }
    }
    let mut held = vec![false; on.len()];
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
            row.iter().for_each(|&v| held[v as usize] = true);
        }
    }
    held
}

/// Lets the vertices of flat and folded quads go that are held on features, and those next to them, but for corners of
/// features; tells whether there are any.
fn release(quads: &QuadMesh, is_corner: impl Fn(usize) -> bool, held: &mut [bool]) -> bool {
    let flat = scaled_jacobians(quads).into_iter().zip(&quads.quads).filter(|(s, _)| *s < FLAT);
    let mut near = vec![false; quads.positions.len()];
    flat.flat_map(|(_, q)| q).for_each(|&v| near[v as usize] = true);
    for _ in 0..RELEASED_RINGS {
        let touching = quads.quads.iter().filter(|q| q.iter().any(|&v| near[v as usize]));
        let ring: Vec<u32> = touching.flatten().copied().collect();
        ring.into_iter().for_each(|v| near[v as usize] = true);
    }
    let mut any = false;
    for (v, held) in held.iter_mut().enumerate().filter(|(v, _)| near[*v]) {
        if *held && !is_corner(v) {
            (*held, any) = (false, true);
        }
    }
    any
}

/// Whether a place in a triangle is that of a vertex at which features meet or end.
fn is_corner(p: DVec3, f: u32, surface: &Surface<'_>) -> bool {
    let mesh = surface.mesh;
    let rays = |v| mesh.outgoing(v).filter(|&h| surface.sharp[mesh.edge(h).index()]).count();
    let near = mesh.face_vertices(FaceId(f)).into_iter().filter(|&v| mesh.position(v).distance(p) < ON_FEATURE);
    near.into_iter().any(|v| rays(v) != 2)
}

/// Whether a place in a triangle lies on a sharp edge of it or of its neighbours.
fn is_on_feature(p: DVec3, f: u32, surface: &Surface<'_>) -> bool {
    let mesh = surface.mesh;
    let around = mesh.face_vertices(FaceId(f)).into_iter().flat_map(|v| mesh.outgoing(v));
    around.filter(|&h| surface.sharp[mesh.edge(h).index()]).any(|h| {
        let (from, along) = (mesh.position(mesh.origin(h)), mesh.vector(h));
        let t = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        (from + t * along).distance(p) < ON_FEATURE
    })
}

/// Carries quads from the proxy to the mesh it stands for.
fn carry(quads: &mut QuadMesh, proxy: &Proxy, original: &TriMesh) {
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
    fn long_rows_on_features_are_held_and_short_ones_and_single_vertices_not() {
        let mesh = grid(10);
        let mut on = vec![false; 100];
        (0..10).for_each(|k| on[30 + k] = true);
        (0..4).for_each(|k| on[70 + k] = true);
        on[95] = true;
        let held = resolved(&on, &mesh.quads);
        assert!((0..100).all(|v| held[v] == (30..40).contains(&v)));
    }

    #[test]
    fn vertices_of_a_flat_quad_are_let_go_but_for_corners() {
        let mut mesh = grid(10);
        let mut held: Vec<bool> = (0..100).map(|v| v / 10 == 5).collect();
        let before = held.clone();
        assert!(!release(&mesh, |_| false, &mut held));
        assert_eq!(held, before);
        // One corner on the line between its neighbours.
        mesh.positions[54] = 0.5 * (mesh.positions[44] + mesh.positions[55]);
        assert!(release(&mesh, |v| v == 53, &mut held));
        assert!(!held[54] && !held[52] && held[53] && held[50] && held[59]);
    }
}

//! The quads of an embedded layout: refined, brought to the surface and smoothed.

use glam::DVec3;

use super::export::Sketch;
use super::session::WeaveError;
use crate::embed::Surface;
use crate::layout::{Embedding, PatchMap, QuadLayout};
use crate::mesh::{FaceId, TriMesh};
use crate::progress::Progress;
use crate::proxy::Proxy;
use crate::quad::{Held, QuadMesh, Stops, land, mend, quality, refine, smooth};
use crate::surface::{SurfacePoint, nearest_in_triangle};

/// How near to a sharp edge a vertex lies on it, on a surface of bounding-box diagonal 1: a tenth of the width that can be
/// seen.
const ON_FEATURE: f64 = 1e-4;

/// The refinement of an embedded layout, on the surface.
pub(super) fn quads(
    sketch: &Sketch<'_>,
    (layout, embedding, maps): (&QuadLayout, &Embedding, &[PatchMap]),
    optimised: bool,
    stops: &Stops,
    progress: &Progress,
) -> Result<QuadMesh, WeaveError> {
    let surface = sketch.surface;
    progress.report("Refining to quads", 0.97);
    let mut quads = refine(layout, embedding, maps, stops);
    if optimised || sketch.proxy.is_some() {
        land(&mut quads, surface.mesh);
    }
    let mesh = match sketch.proxy {
        Some((proxy, original)) => {
            carry(&mut quads, proxy, original);
            land(&mut quads, original);
            original
        }
        None => surface.mesh,
    };
    // What is aligned to features stays there; on a proxy it is not known where those of the mesh are.
    let aligned = optimised && surface.sharp.contains(&true);
    if !aligned || sketch.proxy.is_none() || quality(&quads).0 > 0 {
        let mut held = if aligned && sketch.proxy.is_none() { on_features(&quads, &surface) } else { Vec::new() };
        smooth(&mut quads, mesh, &held, progress)?;
        // A fold is worse than a vertex beside its feature.
        if held.contains(&true) && quality(&quads).0 > 0 {
            held.clear();
            smooth(&mut quads, mesh, &held, progress)?;
        }
        let on_line = |p, f| is_on_feature(p, f, &surface);
        mend(&mut quads, mesh, &Held { vertices: &held, on_line: &on_line }, progress)?;
    }
    Ok(quads)
}

/// For each vertex of quads on a surface whether it lies on a sharp edge.
fn on_features(quads: &QuadMesh, surface: &Surface<'_>) -> Vec<bool> {
    quads.positions.iter().zip(&quads.base_face).map(|(&p, &f)| is_on_feature(p, f, surface)).collect()
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

//! What holds of every traced layout, and helpers of the tests of this room.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use crate::dual::Mark;
use crate::embed::trace::arcs::{FlippedTriangles, preview_arcs, trace_arcs};
use crate::embed::trace::completion::{CompletedLayout, complete_layout};
use crate::embed::trace::error::TraceError;
use crate::embed::trace::rectangles::map_rectangles;
use crate::embed::trace::samples::Sample;
use crate::embed::trace::traced_layout::TracedLayout;
use crate::layout::{PatchMap, QuadLayout};
use crate::mesh::{TriMesh, VertexId};
use crate::param::SeamlessMap;
use crate::progress::Progress;

/// Traces the arcs of a sample.
pub(super) fn trace(s: &Sample) -> Result<TracedLayout, TraceError> {
    trace_arcs(&s.mesh, &s.map, &s.layout, &s.nodes, &s.chains(), FlippedTriangles::Refuse)
}

/// The area of a mesh.
pub(super) fn area(mesh: &TriMesh) -> f64 {
    mesh.faces().map(|f| mesh.face_area(f)).sum()
}

/// Traces a sample and checks everything that holds for every layout in a map without flipped triangles.
pub(super) fn rectangles(s: &Sample) -> (TracedLayout, Vec<PatchMap>) {
    let (traced, maps) = trace_rectangles(s);
    assert!(maps.iter().all(|m| m.flipped == 0));
    check_overlay(&s.mesh, &traced);
    check_patch_maps(&s.mesh, &s.layout, &traced, &maps);
    for (arc, path) in traced.embedding.arcs.iter().enumerate() {
        let ends = s.layout.arcs[arc].nodes.map(|n| s.nodes[n as usize].0);
        assert_eq!([path[0], path[path.len() - 1]], ends);
    }
    let lines = preview_arcs(&s.mesh, &s.map, &s.nodes, &s.chains());
    for (line, path) in lines.iter().zip(&traced.embedding.arcs) {
        let line = line.as_ref().unwrap();
        let path: Vec<DVec3> = path.iter().map(|&v| traced.embedding.mesh.positions[v as usize]).collect();
        let length = |p: &[DVec3]| p.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
        assert!((length(line) - length(&path)).abs() < 1e-3 * length(&path));
    }
    (traced, maps)
}

/// Traces a sample and maps its patches to rectangles.
pub(super) fn trace_rectangles(s: &Sample) -> (TracedLayout, Vec<PatchMap>) {
    let traced = trace(s).unwrap();
    let maps = map_rectangles(&s.layout, &traced, &Progress::new()).unwrap();
    (traced, maps)
}

/// The refined mesh is a manifold of the same topology and area as `mesh`, and every arc is a path of its edges, marked
/// as that arc's.
fn check_overlay(mesh: &TriMesh, traced: &TracedLayout) {
    // A `TriMesh` is a manifold.
    assert_eq!(traced.mesh.euler_characteristic(), mesh.euler_characteristic());
    let mut parts = vec![0.0; mesh.n_faces()];
    for f in traced.mesh.faces() {
        let face_area = traced.mesh.face_area(f);
        assert!(face_area > 1e-12, "{f:?} has area {face_area}");
        parts[traced.embedding.base_face[f.index()] as usize] += face_area;
    }
    for f in mesh.faces() {
        assert!((parts[f.index()] - mesh.face_area(f)).abs() < 1e-9, "{f:?} has the area of its parts");
    }
    let refined = &traced.embedding.mesh;
    let mut marked = 0;
    for (arc, path) in (0u32..).zip(&traced.embedding.arcs) {
        for w in path.windows(2) {
            let h = refined.find(w[0], w[1]).expect("an arc is an edge path");
            assert_eq!(refined.mark(h), Mark::Arc(arc));
            marked += if refined.is_boundary(h) { 1 } else { 2 };
        }
    }
    let all = (0..3 * refined.n_faces() as u32).filter(|&h| refined.mark(h) != Mark::Free).count();
    assert_eq!(all, marked, "only edges of arcs are marked");
}

/// The patches cover the surface once, and their maps agree with the parameters of the arcs: two patches beside an arc
/// agree along it.
fn check_patch_maps(mesh: &TriMesh, layout: &QuadLayout, traced: &TracedLayout, maps: &[PatchMap]) {
    let parts: f64 = maps.iter().map(|m| area(&m.mesh)).sum();
    assert!((parts - area(mesh)).abs() < 1e-9 * area(mesh), "patches cover the surface once");
    let embedding = &traced.embedding;
    for (path, along) in embedding.arcs.iter().zip(&embedding.arc_parameters) {
        assert!(along.windows(2).all(|w| w[0] < w[1]) && along.len() == path.len());
    }
    for (patch, map) in layout.patches.iter().zip(maps) {
        // A patch may have a vertex of the surface several times on its border.
        let mut uv: BTreeMap<u32, Vec<DVec2>> = BTreeMap::new();
        for (&v, &w) in map.parent.iter().zip(&map.uv) {
            uv.entry(v).or_default().push(w);
        }
        let corners = [DVec2::ZERO, DVec2::new(map.size.x, 0.0), map.size, DVec2::new(0.0, map.size.y)];
        for (i, &(arc, forward)) in patch.sides.iter().enumerate() {
            let (path, along) = (&embedding.arcs[arc as usize], &embedding.arc_parameters[arc as usize]);
            let length = along[along.len() - 1];
            for (&v, &t) in path.iter().zip(along) {
                let from_corner = if forward { t } else { length - t };
                let at = corners[i].lerp(corners[(i + 1) % 4], from_corner / length);
                assert!(uv[&v].iter().any(|w| w.distance(at) < 1e-9), "side {i} at vertex {v}: {:?} for {at}", uv[&v]);
            }
        }
    }
}

/// All rectangles have this size, in one of the two orders.
pub(super) fn sizes_are(maps: &[PatchMap], size: DVec2) {
    for m in maps {
        assert!(m.size.distance(size) < 1e-12 || m.size.distance(DVec2::new(size.y, size.x)) < 1e-12, "{}", m.size);
    }
}

/// The base complex of a map for some nodes, checked.
pub(super) fn completed(mesh: &TriMesh, map: &SeamlessMap, nodes: &[VertexId]) -> CompletedLayout {
    let c = complete_layout(mesh, map, nodes, 100.0).unwrap();
    let maps = map_rectangles(&c.layout, &c.traced, &Progress::new()).unwrap();
    assert!(maps.iter().all(|m| m.flipped == 0));
    check_overlay(mesh, &c.traced);
    check_patch_maps(mesh, &c.layout, &c.traced, &maps);
    c
}

/// The vertices of a sample's irregular nodes.
pub(super) fn irregular(s: &Sample) -> Vec<VertexId> {
    s.nodes.iter().zip(&s.layout.nodes).filter(|(_, n)| !n.is_regular()).map(|(&v, _)| v).collect()
}

/// The patches as cycles of nodes, each from its least corner on.
pub(super) fn cycles(layout: &QuadLayout) -> Vec<[u32; 4]> {
    let least = |c: [u32; 4]| (0..4).map(|i| [0, 1, 2, 3].map(|k| c[(i + k) % 4])).min().unwrap();
    let mut list: Vec<[u32; 4]> = layout.patches.iter().map(|p| least(p.corners)).collect();
    list.sort_unstable();
    list
}

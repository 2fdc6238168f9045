use glam::{DVec2, DVec3};

use crate::embed::CompletedLayout;
use crate::embed::RectangleError;
use crate::embed::map_rectangles;
use crate::embed::trace::arcs::{FlippedTriangles, TraceError, TracedLayout, preview_arcs, trace_arcs};
use crate::embed::trace::completion::complete_layout;
use crate::embed::trace::samples::{self, Sample};
use crate::layout::PatchMap;
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::param::SeamlessMap;
use crate::progress::Progress;
use crate::quad::{QuadMesh, Spacing, refine};

fn trace(s: &Sample) -> Result<TracedLayout, TraceError> {
    trace_arcs(&s.mesh, &s.map, &s.layout, &s.nodes, &s.chains(), FlippedTriangles::Refuse)
}

fn area(mesh: &TriMesh) -> f64 {
    mesh.faces().map(|f| mesh.face_area(f)).sum()
}

/// Traces a sample and checks everything that holds for every layout in a map without folds.
fn rectangles(s: &Sample) -> (TracedLayout, Vec<PatchMap>) {
    let traced = trace(s).unwrap();
    let maps = map_rectangles(&s.layout, &traced, &Progress::new()).unwrap();
    assert!(maps.iter().all(|m| m.flipped == 0));
    let whole = area(&s.mesh);
    let parts: f64 = maps.iter().map(|m| area(&m.mesh)).sum();
    assert!((parts - whole).abs() < 1e-9 * whole, "patches cover the surface once: {parts} of {whole}");
    let smallest = traced.mesh.faces().map(|f| traced.mesh.face_area(f)).fold(f64::INFINITY, f64::min);
    assert!(smallest > 1e-12, "no triangle without area: {smallest}");
    for (arc, (path, along)) in traced.embedding.arcs.iter().zip(&traced.embedding.arc_parameters).enumerate() {
        let ends = s.layout.arcs[arc].nodes.map(|n| s.nodes[n as usize].0);
        assert_eq!([path[0], path[path.len() - 1]], ends);
        assert!(along.windows(2).all(|w| w[0] < w[1]) && along.len() == path.len());
    }
    let lines = preview_arcs(&s.mesh, &s.map, &s.nodes, &s.chains());
    for (line, path) in lines.iter().zip(&traced.embedding.arcs) {
        let line = line.as_ref().unwrap();
        let path: Vec<DVec3> = path.iter().map(|&v| traced.embedding.mesh.positions[v as usize]).collect();
        let length = |p: &[DVec3]| p.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
        assert!((length(line) - length(&path)).abs() < 1e-3 * length(&path));
    }
    let quads = refine(&s.layout, &traced.embedding, &maps, &Spacing::even(&s.layout, &vec![5; s.layout.chords]));
    assert_eq!(euler(&quads), s.mesh.euler_characteristic());
    (traced, maps)
}

fn euler(q: &QuadMesh) -> i64 {
    let triangles: Vec<[u32; 3]> = q.quads.iter().flat_map(|c| [[c[0], c[1], c[2]], [c[0], c[2], c[3]]]).collect();
    TriMesh::from_faces(q.positions.clone(), &triangles).unwrap().euler_characteristic()
}

fn sizes_are(maps: &[PatchMap], size: DVec2) {
    for m in maps {
        assert!(m.size.distance(size) < 1e-12 || m.size.distance(DVec2::new(size.y, size.x)) < 1e-12, "{}", m.size);
    }
}

#[test]
fn a_square_with_its_boundary_is_one_patch() {
    for shake in [0.0, 0.3] {
        let s = samples::square(6, 1, shake);
        let (traced, maps) = rectangles(&s);
        sizes_are(&maps, DVec2::ONE);
        assert_eq!(traced.mesh.n_vertices(), s.mesh.n_vertices(), "arcs run along the boundary edges");
    }
}

#[test]
fn arcs_inside_a_square_cross_triangles() {
    for (n, k) in [(6, 2), (8, 2), (12, 3), (12, 4)] {
        for shake in [0.0, 1e-7, 1e-3, 0.3] {
            let s = samples::square(n, k, shake);
            let (traced, maps) = rectangles(&s);
            sizes_are(&maps, DVec2::splat(1.0 / f64::from(k)));
            assert_eq!(
                traced.mesh.n_vertices() == s.mesh.n_vertices(),
                shake < 1e-6,
                "close to edges arcs follow them"
            );
        }
    }
}

#[test]
fn quads_continue_across_arcs_by_the_parameter() {
    let s = samples::square(8, 2, 0.3);
    let (traced, maps) = rectangles(&s);
    let quads = refine(&s.layout, &traced.embedding, &maps, &Spacing::even(&s.layout, &vec![4; s.layout.chords]));
    // The map is the identity: all vertices of the quads lie on a regular grid.
    for p in &quads.positions {
        assert!((*p * 8.0 - (*p * 8.0).round()).length() < 1e-9, "{p}");
    }
}

#[test]
fn slanted_arcs_close_up_on_a_torus() {
    for n in [1, 2, 3, 4] {
        for shake in [0.0, 1e-7, 0.2, 0.3] {
            let (traced, maps) = rectangles(&samples::slanted_torus(n, shake));
            sizes_are(&maps, DVec2::splat(5f64.sqrt()));
            assert_eq!(traced.mesh.euler_characteristic(), 0);
        }
    }
}

#[test]
fn a_cube_has_its_sides_as_patches() {
    for (k, n) in [(1, 5), (2, 4), (2, 6)] {
        for shake in [0.0, 0.3] {
            let s = samples::cube(n, k, shake);
            let (traced, maps) = rectangles(&s);
            sizes_are(&maps, DVec2::splat(1.0 / f64::from(k)));
            // Arcs on the edges of the cube are edges already.
            assert_eq!(traced.mesh.n_vertices() == s.mesh.n_vertices(), k == 1 || shake == 0.0);
        }
    }
}

#[test]
fn nodes_of_every_valence_have_their_patches() {
    for k in [3, 5, 6, 8, 9] {
        for shake in [0.0, 0.25] {
            let (_, maps) = rectangles(&samples::cone(k, 4, shake));
            sizes_are(&maps, DVec2::ONE);
        }
    }
}

#[test]
fn a_common_first_triangle_is_enough_to_tell_arcs_of_a_node_apart() {
    for k in [3, 5, 6, 8] {
        let mut s = samples::cone(k, 4, 0.2);
        let centre = s.nodes[0];
        // Every chain is led around the centre to begin in the same triangle, the same way around.
        let first = s.mesh.vertex_halfedge(centre);
        for (chain, arc) in s.chains.iter_mut().zip(&s.layout.arcs) {
            if arc.nodes[0] != 0 {
                continue;
            }
            let mut lead = Vec::new();
            let (mut at, mut turns) = (first, 0);
            while at != chain.start {
                let over = s.mesh.prev(at);
                turns += s.map.transition(&s.mesh, over).unwrap().turns;
                lead.push(over);
                at = s.mesh.twin(over).unwrap();
            }
            lead.append(&mut chain.crossed);
            chain.crossed = lead;
            chain.start = first;
            chain.heading = (chain.heading + 4 - turns % 4) % 4;
        }
        let (_, maps) = rectangles_without_preview(&s);
        sizes_are(&maps, DVec2::ONE);
    }
}

fn rectangles_without_preview(s: &Sample) -> (TracedLayout, Vec<PatchMap>) {
    let traced = trace(s).unwrap();
    let maps = map_rectangles(&s.layout, &traced, &Progress::new()).unwrap();
    (traced, maps)
}

#[test]
fn folds_are_errors_that_name_the_place() {
    let mut errors = 0;
    for v in 0..81 {
        let s = samples::square(8, 2, 0.2);
        let v = crate::mesh::VertexId(v);
        if s.mesh.is_boundary_vertex(v) {
            continue;
        }
        let mut folded = s;
        // Charts are turned, but a vertex put beside all of its ring is folded in any of them.
        for h in folded.mesh.outgoing(v).collect::<Vec<_>>() {
            let corner = &mut folded.map.uv[h.index() / 3];
            let i = h.index() % 3;
            corner[i] = 2.0 * corner[(i + 1) % 3] - corner[i];
        }
        match trace(&folded) {
            Ok(_) => {}
            Err(e) => {
                errors += 1;
                assert!(
                    matches!(
                        e,
                        TraceError::Fold { .. }
                            | TraceError::Node { .. }
                            | TraceError::Lost { .. }
                            | TraceError::Strayed { .. }
                            | TraceError::Length { .. }
                            | TraceError::Crossing { .. }
                    ),
                    "{e}"
                );
            }
        }
        preview_arcs(&folded.mesh, &folded.map, &folded.nodes, &folded.chains());
    }
    assert!(errors > 5, "{errors}");
}

#[test]
fn a_fold_beside_the_arcs_is_counted() {
    let s = samples::square(16, 2, 0.0);
    let mut folded = s;
    let v = samples::vertex_at(&folded.mesh, DVec3::new(0.25, 0.25, 0.0));
    let ring: Vec<_> = folded.mesh.outgoing(v).collect();
    let shift = DVec2::new(1.5, 0.3) / 16.0;
    // The same move in every chart of the ring, from the first on.
    let mut by = shift;
    for h in ring {
        folded.map.uv[h.index() / 3][h.index() % 3] += by;
        let over = folded.mesh.prev(h);
        let e = folded.mesh.edge(over);
        let p = i32::from(folded.map.jump[e.index()]);
        by = crate::param::turn(by, if folded.mesh.halfedge(e) == over { -p } else { p });
    }
    let traced = trace(&folded).unwrap();
    let maps = map_rectangles(&folded.layout, &traced, &Progress::new()).unwrap();
    let flipped: Vec<usize> = maps.iter().map(|m| m.flipped).collect();
    assert_eq!(flipped.iter().filter(|&&n| n > 0).count(), 1, "{flipped:?}");
}

#[test]
fn arcs_of_another_layout_are_not_taken() {
    let mut s = samples::cube(4, 1, 0.2);
    // Two chains exchanged: they do not join the nodes of their arcs.
    s.chains.swap(0, 1);
    assert!(matches!(trace(&s), Err(TraceError::Chain { .. })));
    let mut s = samples::cube(4, 1, 0.2);
    for chain in &mut s.chains {
        chain.heading = (chain.heading + 2) % 4;
    }
    assert!(matches!(trace(&s), Err(TraceError::Length { .. })));
}

#[test]
fn a_patch_that_is_no_rectangle_is_an_error() {
    let mut s = samples::square(8, 1, 0.2);
    // The boundary is followed whatever the map says of it.
    let v = samples::vertex_at(&s.mesh, {
        let near = |p: DVec3| p.y == 0.0 && (p.x - 0.5).abs() < 0.06;
        s.mesh.positions().iter().copied().find(|&p| near(p)).unwrap()
    });
    for h in s.mesh.outgoing(v).collect::<Vec<_>>() {
        s.map.uv[h.index() / 3][h.index() % 3] += DVec2::splat(0.003);
    }
    let traced = trace(&s).unwrap();
    let error = map_rectangles(&s.layout, &traced, &Progress::new()).unwrap_err();
    assert!(matches!(error, RectangleError::NotRectangle { patch: 0, .. }), "{error}");
}

/// The base complex of a sample with some of its nodes, checked.
fn emerged(mesh: &TriMesh, map: &SeamlessMap, nodes: &[VertexId]) -> CompletedLayout {
    let e = complete_layout(mesh, map, nodes, 100.0).unwrap();
    let maps = map_rectangles(&e.layout, &e.traced, &Progress::new()).unwrap();
    assert!(maps.iter().all(|m| m.flipped == 0));
    let parts: f64 = maps.iter().map(|m| area(&m.mesh)).sum();
    assert!((parts - area(mesh)).abs() < 1e-9);
    let quads = refine(&e.layout, &e.traced.embedding, &maps, &Spacing::even(&e.layout, &vec![4; e.layout.chords]));
    assert_eq!(euler(&quads), mesh.euler_characteristic());
    e
}

/// The patches as cycles of nodes, each from its least corner on.
fn cycles(layout: &crate::layout::QuadLayout) -> Vec<[u32; 4]> {
    let least = |c: [u32; 4]| (0..4).map(|i| [0, 1, 2, 3].map(|k| c[(i + k) % 4])).min().unwrap();
    let mut list: Vec<[u32; 4]> = layout.patches.iter().map(|p| least(p.corners)).collect();
    list.sort_unstable();
    list
}

#[test]
fn with_all_nodes_the_layout_itself_emerges() {
    let mut list = vec![samples::slanted_torus(2, 0.0), samples::slanted_torus(3, 0.3), samples::cube(4, 2, 0.3)];
    list.extend([samples::square(12, 3, 0.3), samples::square(8, 1, 0.0), samples::cone(5, 4, 0.2)]);
    for s in list {
        let e = emerged(&s.mesh, &s.map, &s.nodes);
        assert_eq!(cycles(&e.layout), cycles(&s.layout));
        assert_eq!(e.layout.nodes, s.layout.nodes);
        assert_eq!((e.layout.arcs.len(), e.layout.chords), (s.layout.arcs.len(), s.layout.chords));
    }
}

#[test]
fn regular_nodes_emerge_where_isolines_cross_or_end() {
    for shake in [0.0, 0.2] {
        let s = samples::cone(3, 4, shake);
        let irregular: Vec<_> = s.nodes.iter().zip(&s.layout.nodes).filter(|(_, n)| !n.is_regular()).collect();
        let vertices: Vec<_> = irregular.into_iter().map(|(&v, _)| v).collect();
        assert_eq!(vertices.len(), 4);
        let e = emerged(&s.mesh, &s.map, &vertices);
        assert_eq!((e.layout.nodes.len(), e.layout.arcs.len(), e.layout.patches.len()), (7, 9, 3));

        let s = samples::cube(6, 2, shake);
        let vertices: Vec<_> =
            s.nodes.iter().zip(&s.layout.nodes).filter(|(_, n)| !n.is_regular()).map(|(&v, _)| v).collect();
        let e = emerged(&s.mesh, &s.map, &vertices);
        assert_eq!((e.layout.nodes.len(), e.layout.arcs.len(), e.layout.patches.len()), (8, 12, 6));
    }
}

#[test]
fn a_slanted_cube_has_the_lattice_for_its_base_complex() {
    // Slanted by the direction (a, b), a cube's sides are squares over the lattice that hold a² + b² cells each.
    for (a, b) in [(1, 1), (2, 1), (3, 1), (5, 3)] {
        // On a regular mesh isolines cross on edges; with a little noise, close to them.
        for (n, shake) in [(5, 0.0), (7, 0.3), (3, 0.2), (3, 1e-5), (3, 1e-9)] {
            let along = DVec2::new(f64::from(a), f64::from(b)).normalize();
            let (mesh, map) = samples::cube_map(n, shake, along);
            let corners: Vec<_> = mesh
                .vertices()
                .filter(|&v| mesh.position(v).to_array().iter().all(|x| (x - x.round()).abs() < 1e-9))
                .collect();
            assert_eq!(corners.len(), 8);
            let e = emerged(&mesh, &map, &corners);
            assert_eq!(e.layout.n_irregular(), 8);
            let patches = 6 * (a * a + b * b) as usize;
            assert_eq!((e.layout.nodes.len(), e.layout.patches.len()), (patches + 2, patches));
        }
    }
}

/// The sample of a layout whose arcs are edges of the mesh; chains run beside them, on the left.
fn beside(e: &CompletedLayout) -> Sample {
    let (mesh, map) = (e.traced.mesh.clone(), e.traced.map.clone());
    let nodes = e.traced.embedding.nodes.iter().map(|&v| VertexId(v)).collect();
    let mut chains = Vec::new();
    for path in &e.traced.embedding.arcs {
        let leaving =
            |i: usize| mesh.outgoing(VertexId(path[i])).find(|&h| mesh.target(h) == VertexId(path[i + 1])).unwrap();
        let start = leaving(0);
        let (mut h, mut crossed) = (start, Vec::new());
        for &next in &path[2..] {
            h = mesh.next(h);
            while mesh.target(h) != VertexId(next) {
                crossed.push(h);
                h = mesh.next(mesh.twin(h).unwrap());
            }
        }
        let way = map.uv[start.index() / 3][(start.index() + 1) % 3] - map.uv[start.index() / 3][start.index() % 3];
        let along = |k: u8| crate::param::turn(way, -i32::from(k)).x;
        let heading = (0..4u8).max_by(|&a, &b| along(a).total_cmp(&along(b))).unwrap();
        chains.push(samples::OwnedChain { start, crossed, end: mesh.next(h), heading });
    }
    Sample { mesh, map, layout: e.layout.clone(), nodes, chains }
}

#[test]
fn arcs_that_are_edges_already_are_traced_along_them() {
    for (n, shake) in [(4, 0.0), (5, 0.2)] {
        let (mesh, map) = samples::cube_map(n, shake, DVec2::new(2.0, 1.0).normalize());
        let corners: Vec<_> = mesh
            .vertices()
            .filter(|&v| mesh.position(v).to_array().iter().all(|x| (x - x.round()).abs() < 1e-9))
            .collect();
        let e = emerged(&mesh, &map, &corners);
        let (traced, maps) = rectangles(&beside(&e));
        assert_eq!(traced.mesh.n_vertices(), e.traced.mesh.n_vertices());
        assert_eq!(traced.embedding.arcs, e.traced.embedding.arcs);
        sizes_are(&maps, DVec2::splat(0.2f64.sqrt()));
    }
}

#[test]
fn rounding_in_the_map_does_no_harm() {
    for mut s in [samples::cube(6, 2, 0.2), samples::cone(5, 4, 0.0), samples::slanted_torus(3, 0.0)] {
        let mut noise = samples::Noise(1);
        for w in s.map.uv.iter_mut().flatten() {
            *w += 1e-11 * DVec2::new(noise.next(), noise.next());
        }
        let traced = trace(&s).unwrap();
        let maps = map_rectangles(&s.layout, &traced, &Progress::new()).unwrap();
        assert!(maps.iter().all(|m| m.flipped == 0));
    }
}

#[test]
fn arcs_can_cross_folds() {
    let mut s = samples::square(16, 2, 0.2);
    // From one side of the arc from (0.5, 0) to (0.5, 0.5) to the other and beyond its ring.
    let away = |v: &VertexId| s.mesh.position(*v).distance(DVec3::new(0.4375, 0.25, 0.0));
    let v = s.mesh.vertices().min_by(|a, b| away(a).total_cmp(&away(b))).unwrap();
    let chart = |map: &SeamlessMap, h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
    let first = s.mesh.vertex_halfedge(v);
    let edge = chart(&s.map, s.mesh.next(first)) - chart(&s.map, first);
    let to = s.mesh.vector(first);
    // The chart of the first corner is the plane, turned.
    let turned = (0..4).find(|&k| crate::param::turn(to.truncate(), k).distance(edge) < 1e-9).unwrap();
    let mut by = crate::param::turn(DVec2::new(2.3, 0.4) / 16.0, turned);
    for h in s.mesh.outgoing(v).collect::<Vec<_>>() {
        s.map.uv[h.index() / 3][h.index() % 3] += by;
        let change = s.map.transition(&s.mesh, s.mesh.prev(h)).unwrap();
        by = crate::param::turn(by, i32::from(change.turns));
    }
    assert!(matches!(trace(&s), Err(TraceError::Fold { .. })));
    let traced = trace_arcs(&s.mesh, &s.map, &s.layout, &s.nodes, &s.chains(), FlippedTriangles::Cross).unwrap();
    let maps = map_rectangles(&s.layout, &traced, &Progress::new()).unwrap();
    sizes_are(&maps, DVec2::splat(0.5));
    assert!(maps.iter().filter(|m| m.flipped > 0).count() == 2);
    let whole: f64 = maps.iter().map(|m| area(&m.mesh)).sum();
    assert!((whole - 1.0).abs() < 1e-9);
}

#[test]
fn isolines_leave_a_node_that_lies_in_a_fold() {
    for k in [3, 4, 5, 6] {
        for (i, far) in (0..8).flat_map(|i| [(i, 0.6), (i, 1.1), (i, 1.5)]) {
            let mut s = samples::cone(k, 4, 0.1);
            // A neighbour of the centre goes round it beyond the next, so that the triangle between turns over.
            let ring: Vec<HalfedgeId> = s.mesh.outgoing(s.nodes[0]).collect();
            let moved = s.mesh.target(ring[i % ring.len()]);
            let at = |map: &SeamlessMap, h: HalfedgeId| map.uv[h.index() / 3][h.index() % 3];
            let corner = s.mesh.next(ring[i % ring.len()]);
            let spoke = at(&s.map, corner) - at(&s.map, ring[i % ring.len()]);
            let mut by = DVec2::from_angle(far).rotate(spoke) - spoke;
            let around: Vec<HalfedgeId> = s.mesh.outgoing(moved).collect();
            let begin = around.iter().position(|&h| h == corner).unwrap();
            for j in 0..around.len() {
                let h = around[(begin + j) % around.len()];
                s.map.uv[h.index() / 3][h.index() % 3] += by;
                let change = s.map.transition(&s.mesh, s.mesh.prev(h)).unwrap();
                by = crate::param::turn(by, i32::from(change.turns));
            }
            let node = crate::embed::trace::isolines::nodes_at(&s.mesh, &s.nodes);
            let exact = crate::embed::trace::isolines::exactness(&s.map);
            let lines = crate::embed::trace::isolines::Isolines {
                mesh: &s.mesh,
                map: &s.map,
                node: &node,
                exact,
                through_folds: true,
            };
            assert_eq!(lines.slots(s.nodes[0]).len(), k as usize, "{k} {i} {far}");
            let traced =
                trace_arcs(&s.mesh, &s.map, &s.layout, &s.nodes, &s.chains(), FlippedTriangles::Cross).unwrap();
            let maps = map_rectangles(&s.layout, &traced, &Progress::new()).unwrap();
            let folded = s.mesh.faces().any(|f| s.map.is_flipped(f));
            assert_eq!(maps.iter().any(|m| m.flipped > 0), folded);
            let whole: f64 = maps.iter().map(|m| area(&m.mesh)).sum();
            assert!((whole - area(&s.mesh)).abs() < 1e-9);
        }
    }
}

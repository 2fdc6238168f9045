use glam::{DVec2, DVec3};
use proptest::prelude::*;

use crate::embed::trace::arcs::{FlippedTriangles, preview_arcs, trace_arcs};
use crate::embed::trace::completion::{CompletedLayout, CompletionError, complete_layout};
use crate::embed::trace::error::TraceError;
use crate::embed::trace::isolines::{Isolines, corner_uv, map_rounding, nodes_at};
use crate::embed::trace::rectangles::{RectangleError, map_rectangles};
use crate::embed::trace::samples::{self, Sample};
use crate::embed::trace::testing::{
    area, completed, cycles, irregular, rectangles, sizes_are, trace, trace_rectangles,
};
use crate::layout::PatchShapeError;
use crate::mesh::{HalfedgeId, TriMesh, VertexId};
use crate::param::turn;
use crate::progress::Progress;

#[test]
fn a_square_is_one_patch() {
    for shake in [0.0, 0.3] {
        let s = samples::square(6, 1, shake);
        let (traced, maps) = rectangles(&s);
        sizes_are(&maps, DVec2::ONE);
        assert_eq!(traced.mesh.n_vertices(), s.mesh.n_vertices(), "arcs run along the boundary edges");
    }
}

#[test]
fn arcs_inside_a_square_are_straight() {
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
fn slanted_arcs_on_a_torus_are_closed() {
    for n in [1, 2, 3, 4] {
        for shake in [0.0, 1e-7, 0.2, 0.3] {
            let (traced, maps) = rectangles(&samples::slanted_torus(n, shake));
            sizes_are(&maps, DVec2::splat(5f64.sqrt()));
            assert_eq!(traced.mesh.euler_characteristic(), 0);
        }
    }
}

#[test]
fn the_patches_of_a_cube_are_its_sides() {
    for (k, n) in [(1, 5), (2, 4), (2, 6)] {
        for shake in [0.0, 0.3] {
            let s = samples::cube(n, k, shake);
            let (traced, maps) = rectangles(&s);
            sizes_are(&maps, DVec2::splat(1.0 / f64::from(k)));
            // Arcs on the edges of the cube are edges of the mesh.
            assert_eq!(traced.mesh.n_vertices() == s.mesh.n_vertices(), k == 1 || shake == 0.0);
        }
    }
}

#[test]
fn nodes_of_all_valences_are_traced() {
    for k in [3, 5, 6, 8, 9] {
        for shake in [0.0, 0.25] {
            let (_, maps) = rectangles(&samples::cone(k, 4, shake));
            sizes_are(&maps, DVec2::ONE);
        }
    }
}

#[test]
fn arcs_of_a_node_may_all_start_in_one_triangle() {
    for k in [3, 5, 6, 8] {
        let mut s = samples::cone(k, 4, 0.2);
        let centre = s.nodes[0];
        // Every chain is extended around the centre to start in the same triangle, always counter-clockwise.
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
        let (_, maps) = trace_rectangles(&s);
        sizes_are(&maps, DVec2::ONE);
    }
}

#[test]
fn flipped_triangles_are_errors_with_their_place() {
    let mut errors = 0;
    for v in 0..81 {
        let s = samples::square(8, 2, 0.2);
        let v = VertexId(v);
        if s.mesh.is_boundary_vertex(v) {
            continue;
        }
        let mut flipped = s;
        // The vertex is moved out of its ring, which flips triangles whatever their charts.
        for h in flipped.mesh.outgoing(v).collect::<Vec<_>>() {
            let corner = &mut flipped.map.uv[h.index() / 3];
            let i = h.index() % 3;
            corner[i] = 2.0 * corner[(i + 1) % 3] - corner[i];
        }
        match trace(&flipped) {
            Ok(_) => {}
            Err(e) => {
                errors += 1;
                assert!(
                    matches!(
                        e,
                        TraceError::FlippedTriangle { .. }
                            | TraceError::Node { .. }
                            | TraceError::Lost { .. }
                            | TraceError::WrongEnd { .. }
                            | TraceError::Length { .. }
                            | TraceError::Crossing { .. }
                    ),
                    "{e}"
                );
            }
        }
        preview_arcs(&flipped.mesh, &flipped.map, &flipped.nodes, &flipped.chains());
    }
    assert!(errors > 5, "{errors}");
}

#[test]
fn flipped_triangles_inside_a_patch_are_counted() {
    let s = samples::square(16, 2, 0.0);
    let mut flipped = s;
    let v = samples::vertex_at(&flipped.mesh, DVec3::new(0.25, 0.25, 0.0));
    let ring: Vec<_> = flipped.mesh.outgoing(v).collect();
    let shift = DVec2::new(1.5, 0.3) / 16.0;
    // The same move in every chart of the ring, from the first on.
    let mut by = shift;
    for h in ring {
        flipped.map.uv[h.index() / 3][h.index() % 3] += by;
        let over = flipped.mesh.prev(h);
        let e = flipped.mesh.edge(over);
        let p = i32::from(flipped.map.jump[e.index()]);
        by = turn(by, if flipped.mesh.halfedge(e) == over { -p } else { p });
    }
    let traced = trace(&flipped).unwrap();
    let maps = map_rectangles(&flipped.layout, &traced, &Progress::new()).unwrap();
    let counts: Vec<usize> = maps.iter().map(|m| m.flipped).collect();
    assert_eq!(counts.iter().filter(|&&n| n > 0).count(), 1, "{counts:?}");
}

#[test]
fn chains_that_contradict_the_layout_are_errors() {
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
fn a_patch_that_is_not_a_rectangle_is_an_error() {
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

#[test]
fn completion_with_all_nodes_yields_the_layout() {
    let mut list = vec![samples::slanted_torus(2, 0.0), samples::slanted_torus(3, 0.3), samples::cube(4, 2, 0.3)];
    list.extend([samples::square(12, 3, 0.3), samples::square(8, 1, 0.0), samples::cone(5, 4, 0.2)]);
    for s in list {
        let e = completed(&s.mesh, &s.map, &s.nodes);
        assert_eq!(cycles(&e.layout), cycles(&s.layout));
        assert_eq!(e.layout.nodes, s.layout.nodes);
        assert_eq!((e.layout.arcs.len(), e.layout.chords), (s.layout.arcs.len(), s.layout.chords));
    }
}

#[test]
fn completion_adds_regular_nodes_at_crossings_and_ends() {
    for shake in [0.0, 0.2] {
        let s = samples::cone(3, 4, shake);
        assert_eq!(irregular(&s).len(), 4);
        let e = completed(&s.mesh, &s.map, &irregular(&s));
        assert_eq!((e.layout.nodes.len(), e.layout.arcs.len(), e.layout.patches.len()), (7, 9, 3));

        let s = samples::cube(6, 2, shake);
        let e = completed(&s.mesh, &s.map, &irregular(&s));
        assert_eq!((e.layout.nodes.len(), e.layout.arcs.len(), e.layout.patches.len()), (8, 12, 6));
    }
}

/// The corners of a cube of side 1.
fn cube_corners(mesh: &TriMesh) -> Vec<VertexId> {
    let is_corner = |&v: &VertexId| mesh.position(v).to_array().iter().all(|x| (x - x.round()).abs() < 1e-9);
    mesh.vertices().filter(is_corner).collect()
}

#[test]
fn the_base_complex_of_a_slanted_cube_is_the_lattice() {
    // Slanted by the direction (a, b), a cube's sides are squares over the lattice that hold a² + b² cells each.
    for (a, b) in [(1, 1), (2, 1), (3, 1), (5, 3)] {
        // On a regular mesh isolines cross on edges; with a little noise, close to them.
        for (n, shake) in [(5, 0.0), (7, 0.3), (3, 0.2), (3, 1e-5), (3, 1e-9)] {
            let along = DVec2::new(f64::from(a), f64::from(b)).normalize();
            let (mesh, map) = samples::cube_map(n, shake, along);
            let corners = cube_corners(&mesh);
            assert_eq!(corners.len(), 8);
            let e = completed(&mesh, &map, &corners);
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
        let edge = map.uv[start.index() / 3][(start.index() + 1) % 3] - map.uv[start.index() / 3][start.index() % 3];
        let along = |k: u8| turn(edge, -i32::from(k)).x;
        let heading = (0..4u8).max_by(|&a, &b| along(a).total_cmp(&along(b))).unwrap();
        chains.push(samples::OwnedChain { start, crossed, end: mesh.next(h), heading });
    }
    Sample { mesh, map, layout: e.layout.clone(), nodes, chains }
}

#[test]
fn arcs_along_edges_of_the_mesh_are_traced_along_them() {
    for (n, shake) in [(4, 0.0), (5, 0.2)] {
        let (mesh, map) = samples::cube_map(n, shake, DVec2::new(2.0, 1.0).normalize());
        let corners = cube_corners(&mesh);
        let e = completed(&mesh, &map, &corners);
        let (traced, maps) = rectangles(&beside(&e));
        assert_eq!(traced.mesh.n_vertices(), e.traced.mesh.n_vertices());
        assert_eq!(traced.embedding.arcs, e.traced.embedding.arcs);
        sizes_are(&maps, DVec2::splat(0.2f64.sqrt()));
    }
}

#[test]
fn rounding_errors_of_the_map_are_tolerated() {
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
fn arcs_can_cross_flipped_triangles() {
    let mut s = samples::square(16, 2, 0.2);
    // From one side of the arc from (0.5, 0) to (0.5, 0.5) to the other and beyond its ring.
    let away = |v: &VertexId| s.mesh.position(*v).distance(DVec3::new(0.4375, 0.25, 0.0));
    let v = s.mesh.vertices().min_by(|a, b| away(a).total_cmp(&away(b))).unwrap();
    let first = s.mesh.vertex_halfedge(v);
    let edge = corner_uv(&s.map, s.mesh.next(first)) - corner_uv(&s.map, first);
    let to = s.mesh.vector(first);
    // The chart of the first corner is the plane, turned.
    let turned = (0..4).find(|&k| turn(to.truncate(), k).distance(edge) < 1e-9).unwrap();
    let mut by = turn(DVec2::new(2.3, 0.4) / 16.0, turned);
    for h in s.mesh.outgoing(v).collect::<Vec<_>>() {
        s.map.uv[h.index() / 3][h.index() % 3] += by;
        let change = s.map.transition(&s.mesh, s.mesh.prev(h)).unwrap();
        by = turn(by, i32::from(change.turns));
    }
    assert!(matches!(trace(&s), Err(TraceError::FlippedTriangle { .. })));
    let traced = trace_arcs(&s.mesh, &s.map, &s.layout, &s.nodes, &s.chains(), FlippedTriangles::Cross).unwrap();
    let maps = map_rectangles(&s.layout, &traced, &Progress::new()).unwrap();
    sizes_are(&maps, DVec2::splat(0.5));
    assert!(maps.iter().filter(|m| m.flipped > 0).count() == 2);
    let whole: f64 = maps.iter().map(|m| area(&m.mesh)).sum();
    assert!((whole - 1.0).abs() < 1e-9);
}

#[test]
fn a_node_among_flipped_triangles_has_as_many_isolines_as_arcs() {
    for k in [3, 4, 5, 6] {
        for (i, far) in (0..8).flat_map(|i| [(i, 0.6), (i, 1.1), (i, 1.5)]) {
            let mut s = samples::cone(k, 4, 0.1);
            // A neighbour of the centre is rotated about it past the next one, which flips the triangle between them.
            let ring: Vec<HalfedgeId> = s.mesh.outgoing(s.nodes[0]).collect();
            let moved = s.mesh.target(ring[i % ring.len()]);
            let corner = s.mesh.next(ring[i % ring.len()]);
            let spoke = corner_uv(&s.map, corner) - corner_uv(&s.map, ring[i % ring.len()]);
            let mut by = DVec2::from_angle(far).rotate(spoke) - spoke;
            let around: Vec<HalfedgeId> = s.mesh.outgoing(moved).collect();
            let begin = around.iter().position(|&h| h == corner).unwrap();
            for j in 0..around.len() {
                let h = around[(begin + j) % around.len()];
                s.map.uv[h.index() / 3][h.index() % 3] += by;
                let change = s.map.transition(&s.mesh, s.mesh.prev(h)).unwrap();
                by = turn(by, i32::from(change.turns));
            }
            let node = nodes_at(&s.mesh, &s.nodes);
            let rounding = map_rounding(&s.map);
            let isolines = Isolines { mesh: &s.mesh, map: &s.map, node: &node, rounding, cross_flipped: true };
            assert_eq!(isolines.outgoing(s.nodes[0]).len(), k as usize, "{k} {i} {far}");
            let traced =
                trace_arcs(&s.mesh, &s.map, &s.layout, &s.nodes, &s.chains(), FlippedTriangles::Cross).unwrap();
            let maps = map_rectangles(&s.layout, &traced, &Progress::new()).unwrap();
            let any_flipped = s.mesh.faces().any(|f| s.map.is_flipped(f));
            assert_eq!(maps.iter().any(|m| m.flipped > 0), any_flipped);
            let whole: f64 = maps.iter().map(|m| area(&m.mesh)).sum();
            assert!((whole - area(&s.mesh)).abs() < 1e-9);
        }
    }
}

#[test]
fn an_isoline_that_does_not_end_is_an_error_of_completion() {
    let s = samples::slanted_torus(2, 0.0);
    let error = complete_layout(&s.mesh, &s.map, &s.nodes, 1.0).unwrap_err();
    assert!(matches!(error, CompletionError::Endless { node: 0 }), "{error}");
}

#[test]
fn completion_without_a_singular_node_is_an_error() {
    let s = samples::cube(4, 1, 0.0);
    assert!(complete_layout(&s.mesh, &s.map, &s.nodes[1..], 100.0).is_err());
}

#[test]
fn patches_that_form_two_fans_around_a_node_are_an_error() {
    let mut s = samples::cone(5, 4, 0.0);
    s.layout.patches.remove(2);
    s.layout.patches.remove(0);
    assert!(matches!(trace(&s), Err(TraceError::Order { node: 0 })));
}

#[test]
fn patches_beside_other_arcs_are_an_error() {
    let s = samples::cube(4, 1, 0.0);
    let traced = trace(&s).unwrap();
    let mut other = s.layout.clone();
    other.patches.swap(0, 1);
    let error = map_rectangles(&other, &traced, &Progress::new()).unwrap_err();
    assert!(matches!(error, RectangleError::Shape(PatchShapeError::Sides { patch: 0 | 1 })), "{error}");
}

#[test]
fn a_cancelled_mapping_to_rectangles_says_so() {
    let s = samples::square(4, 1, 0.0);
    let traced = trace(&s).unwrap();
    let progress = Progress::new();
    progress.cancel();
    let error = map_rectangles(&s.layout, &traced, &progress).unwrap_err();
    assert!(matches!(error, RectangleError::Cancelled(_)), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn a_random_integer_grid_map_is_traced_back_to_its_layout(
        heights in prop::collection::vec(1i32..4, 1..4),
        n in prop::sample::select(vec![4, 6]),
        shake in 0.0f64..0.3,
        seed in 0u64..1000,
    ) {
        let s = samples::skyline(&heights, n, shake, seed);
        let (_, maps) = rectangles(&s);
        sizes_are(&maps, DVec2::ONE);
        let c = completed(&s.mesh, &s.map, &s.nodes);
        prop_assert_eq!(cycles(&c.layout), cycles(&s.layout));
        // Its base complex may be coarser, with whole sizes.
        let c = completed(&s.mesh, &s.map, &irregular(&s));
        let maps = map_rectangles(&c.layout, &c.traced, &Progress::new()).unwrap();
        prop_assert!(maps.iter().all(|m| (m.size - m.size.round()).length() < 1e-9));
    }

    #[test]
    fn the_overlay_of_crossing_isolines_is_a_manifold_with_arcs_as_paths(
        slant in (1u8..6, 0u8..6),
        n in 3i32..7,
        shake in 0.0f64..0.3,
    ) {
        let along = DVec2::new(f64::from(slant.0), f64::from(slant.1)).normalize();
        let (mesh, map) = samples::cube_map(n, shake, along);
        let c = completed(&mesh, &map, &cube_corners(&mesh));
        prop_assert_eq!(c.layout.n_irregular(), 8);
    }
}

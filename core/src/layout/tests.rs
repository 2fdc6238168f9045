//! Collapse of chords of layouts made from triangle meshes, and re-embedding of the remaining layout.

use std::collections::BTreeSet;

use glam::DVec3;
use proptest::prelude::*;

use super::structure::{Arc, Node, Patch};
use super::*;
use crate::dual::{Arrangement, Mark, RefinedMesh};
use crate::mesh::{HalfedgeId, TriMesh};
use crate::progress::Progress;
use crate::surface::{Crossing, SurfaceCurve};
use crate::testing::{column, grid, row, square, torus};

/// The layout with three patches around the centre of each triangle, embedded on the mesh with each triangle divided
/// into six: all arcs are single edges, all patches two triangles.
fn thirds(mesh: &TriMesh) -> (QuadLayout, Embedding) {
    let (v, e) = (mesh.n_vertices() as u32, mesh.n_edges() as u32);
    let middle = |h| v + mesh.edge(h).0;
    let mut nodes = vec![Node { valence: 0, boundary: false }; (v + e) as usize + mesh.n_faces()];
    let mut arcs: Vec<Arc> = Vec::new();
    let mut positions = mesh.positions().to_vec();
    for e in mesh.edges() {
        let ends = mesh.edge_vertices(e);
        let boundary = mesh.is_boundary_edge(e);
        positions.push(0.5 * (mesh.position(ends[0]) + mesh.position(ends[1])));
        for end in ends {
            arcs.push(Arc { nodes: [end.0, v + e.0], boundary, chord: 0 });
            nodes[end.index()].boundary |= boundary;
        }
        nodes[(v + e.0) as usize].boundary = boundary;
    }
    let (mut patches, mut faces, mut seeds) = (Vec::new(), Vec::new(), Vec::new());
    for f in mesh.faces() {
        let sides = mesh.face_halfedges(f);
        let centre = v + e + f.0;
        positions.push(mesh.face_vertices(f).iter().map(|&v| mesh.position(v)).sum::<DVec3>() / 3.0);
        let first = arcs.len() as u32;
        arcs.extend(sides.map(|h| Arc { nodes: [middle(h), centre], boundary: false, chord: 0 }));
        for i in 0..3 {
            let (h, g) = (sides[i], sides[(i + 2) % 3]);
            let at = mesh.origin(h);
            let half = |h| 2 * mesh.edge(h).0 + u32::from(mesh.edge_vertices(mesh.edge(h))[1] == at);
            let corners = [at.0, middle(h), centre, middle(g)];
            corners.iter().for_each(|&n| nodes[n as usize].valence += 1);
            let back = first + (i as u32 + 2) % 3;
            patches.push(Patch {
                corners,
                sides: [(half(h), true), (first + i as u32, true), (back, false), (half(g), false)],
            });
            seeds.push(faces.len() as u32);
            faces.extend([[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]);
        }
    }
    let sixths = TriMesh::from_faces(positions, &faces).unwrap();
    let mut refined = RefinedMesh::new(&sixths);
    for (a, arc) in arcs.iter().enumerate() {
        let h = refined.find(arc.nodes[0], arc.nodes[1]).unwrap();
        refined.set_mark(h, Mark::Arc(a as u32));
    }
    let embedding = Embedding {
        base_face: (0..sixths.n_faces() as u32).collect(),
        nodes: (0..nodes.len() as u32).collect(),
        arc_parameters: vec![vec![0.0, 1.0]; arcs.len()],
        arcs: arcs.iter().map(|a| a.nodes.to_vec()).collect(),
        mesh: refined,
        seeds,
    };
    (QuadLayout::new(nodes, arcs, patches, mesh.euler_characteristic()).unwrap(), embedding)
}

/// A torus, a square, an open cylinder, a ring of cubes and a cube.
fn surfaces() -> Vec<TriMesh> {
    let open = grid(4, 3, [true, false], |u, v| {
        let a = std::f64::consts::TAU * u;
        DVec3::new(a.cos(), a.sin(), v)
    });
    let ring = crate::field::samples::cells(
        &[[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1, 0], [0, 2, 0], [1, 2, 0], [2, 2, 0]],
        1,
    );
    vec![torus(4, 3), square(3), open, ring, crate::field::samples::cells(&[[0, 0, 0]], 1)]
}

/// Four times the sum of all indices, inside and on the boundary.
fn index_sum(layout: &QuadLayout) -> i64 {
    layout.nodes.iter().map(|n| if n.boundary { 2 } else { 4 } - n.valence as i64).sum()
}

#[test]
fn collapsing_keeps_layouts_valid_and_the_sum_of_indices() {
    let (mut done, mut refused) = (0, BTreeSet::new());
    for (mesh, seed) in surfaces().iter().flat_map(|m| (0..12u64).map(move |s| (m, s))) {
        let (mut layout, _) = thirds(mesh);
        let (euler, sum) = (mesh.euler_characteristic(), index_sum(&layout));
        assert_eq!(sum, 4 * euler);
        let mut random = seed;
        for _ in 0..40 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let chord = (random >> 33) as u32 % layout.chords as u32;
            let before = layout.clone();
            match layout.collapse(chord) {
                Ok(collapsed) => {
                    layout = collapsed.layout;
                    layout.check(euler).unwrap();
                    assert_eq!((layout.chords, index_sum(&layout)), (before.chords - 1, sum));
                    assert!(layout.patches.len() < before.patches.len());
                    for (a, target) in collapsed.arcs.iter().enumerate() {
                        assert_eq!(target.is_none(), before.arcs[a].chord == chord);
                        let Some((b, forward)) = *target else { continue };
                        let ends = before.arcs[a].nodes.map(|n| collapsed.nodes[n as usize]);
                        let wanted = layout.arcs[b as usize].nodes;
                        assert_eq!(ends, if forward { wanted } else { [wanted[1], wanted[0]] });
                        assert_eq!(
                            collapsed.chords[before.arcs[a].chord as usize],
                            Some(layout.arcs[b as usize].chord)
                        );
                    }
                    done += 1;
                }
                Err(error) => {
                    refused.insert(error.to_string().split(' ').next_back().unwrap_or_default().to_owned());
                }
            }
        }
    }
    assert!(done > 200, "{done}");
    // No disc; more than one contact with the boundary; two patches at a node.
    for word in ["disc", "once", "2"] {
        assert!(refused.contains(word), "{refused:?}");
    }
}

#[test]
fn the_last_chord_that_crosses_another_is_kept() {
    let mesh = square(8);
    let arrangement = Arrangement::new(&mesh, &[row(8, 2, false, 0.5), column(8, 8, 3, false, 0.5)]).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], 1).unwrap();
    assert_eq!(layout.collapse(0), Err(CollapseError::Uncrossed { chord: 1 }));
    // Two patches side by side: the chord along both must stay; one of the chords across can go. Its arcs join corners
    // of the boundary to regular nodes, which become corners.
    let curves = [row(8, 2, false, 0.5), column(8, 8, 2, false, 0.5), column(8, 8, 5, false, 0.5)];
    let arrangement = Arrangement::new(&mesh, &curves).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], 1).unwrap();
    let left: Vec<usize> = (0..3).filter_map(|c| Some(layout.collapse(c).ok()?.layout.patches.len())).collect();
    assert_eq!(left, [1, 1]);
}

#[test]
fn a_merged_node_has_the_sum_of_valences_less_four_per_merge() {
    let (layout, _) = thirds(&torus(4, 3));
    let mut merged = 0;
    for chord in 0..layout.chords as u32 {
        let Ok(collapsed) = layout.collapse(chord) else { continue };
        for (n, node) in collapsed.layout.nodes.iter().enumerate() {
            let old: Vec<usize> = (0..layout.nodes.len()).filter(|&o| collapsed.nodes[o] as usize == n).collect();
            let sum: usize = old.iter().map(|&o| layout.nodes[o].valence).sum();
            assert_eq!(node.valence, sum - 4 * (old.len() - 1));
            merged += usize::from(old.len() > 1);
        }
    }
    assert!(merged > 0);
    assert_eq!(layout.collapse(99), Err(CollapseError::Unknown(99)));
}

/// Checks a re-embedded layout: its patches are discs with four sides that cover the surface.
fn check_embedding(mesh: &TriMesh, reembedded: &Reembedded) {
    reembedded.layout.check(mesh.euler_characteristic()).unwrap();
    let maps = map_patches(&reembedded.layout, &reembedded.embedding, &Progress::new()).unwrap();
    let area = |m: &TriMesh| m.faces().map(|f| m.face_area(f)).sum::<f64>();
    let parts: f64 = maps.iter().map(|m| area(&m.mesh)).sum();
    assert!((parts - area(mesh)).abs() < 1e-9 * parts, "{parts} of {}", area(mesh));
    // Faces of the embedding lie in their triangles of the surface.
    let refined = reembedded.embedding.mesh.to_mesh().unwrap();
    for f in refined.faces() {
        let base = crate::mesh::FaceId(reembedded.embedding.base_face[f.index()]);
        let off = refined.face_vertices(f).map(|v| {
            let at = refined.position(v) - mesh.position(mesh.face_vertices(base)[0]);
            at.dot(mesh.face_normal(base)).abs()
        });
        assert!(off.iter().all(|&d| d < 1e-9), "{off:?}");
    }
}

#[test]
fn collapsed_layouts_are_reembedded_on_all_surfaces() {
    let mut embedded = 0;
    for mesh in surfaces() {
        let (layout, embedding) = thirds(&mesh);
        let sixths = embedding.mesh.to_mesh().unwrap();
        let n = sixths.n_vertices();
        let mut deleted = vec![false; layout.chords];
        for chord in 0..layout.chords {
            deleted[chord] = true;
            let Ok(collapsed) = layout.without_chords(&deleted) else {
                deleted[chord] = false;
                continue;
            };
            let reembedded = reembed(&layout, &embedding, &deleted, |_| false, n, &Progress::new()).unwrap();
            check_embedding(&sixths, &reembedded);
            assert_eq!(reembedded.layout.patches.len(), collapsed.layout.patches.len());
            let kinds =
                |list: &[u32], nodes: &[Node]| list.iter().map(|&n| nodes[n as usize].clone()).collect::<Vec<_>>();
            assert_eq!(
                kinds(&reembedded.nodes, &reembedded.layout.nodes),
                kinds(&collapsed.nodes, &collapsed.layout.nodes)
            );
            embedded += 1;
        }
    }
    assert!(embedded > 10, "{embedded}");
}

#[test]
fn loops_on_a_torus_are_deleted_until_two_remain() {
    let mesh = torus(24, 12);
    let curves: Vec<_> = (0..3).flat_map(|k| [row(24, 4 * k, true, 0.4), column(24, 12, 7 * k, true, 0.6)]).collect();
    let arrangement = Arrangement::new(&mesh, &curves).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], 0).unwrap();
    let embedding = initial_embedding(&arrangement, &layout, &[None; 9], &Progress::new()).unwrap();
    assert_eq!((layout.chords, layout.patches.len()), (6, 9));
    // A chord is dual to a row or a column.
    let is_row = |chord: usize| {
        let arc = layout.arcs.iter().position(|a| a.chord as usize == chord).unwrap();
        arrangement.segments[arc].curve.is_multiple_of(2)
    };
    let mut deleted = vec![false; 6];
    let mut left = [3, 3];
    for chord in 0..6 {
        deleted[chord] = true;
        let of = &mut left[usize::from(is_row(chord))];
        if *of == 1 {
            assert!(matches!(
                layout.without_chords(&deleted),
                Err(CollapseError::NoDisc { .. } | CollapseError::Uncrossed { .. })
            ));
            deleted[chord] = false;
            continue;
        }
        *of -= 1;
        let reembedded =
            reembed(&layout, &embedding, &deleted, |n| n == 0, mesh.n_vertices(), &Progress::new()).unwrap();
        check_embedding(&mesh, &reembedded);
        assert_eq!(reembedded.layout.patches.len(), left[0] * left[1]);
        let kept = reembedded.embedding.nodes[reembedded.nodes[0] as usize];
        assert_eq!(
            reembedded.embedding.mesh.positions[kept as usize],
            embedding.mesh.positions[embedding.nodes[0] as usize]
        );
    }
    assert_eq!(left, [1, 1]);
}

/// The section of a star-shaped mesh around the origin with the plane through the origin of given normal.
fn plane_section(mesh: &TriMesh, normal: DVec3) -> SurfaceCurve {
    let height = |v| normal.dot(mesh.position(v));
    let rises = |&h: &HalfedgeId| height(mesh.origin(h)) < 0.0 && height(mesh.target(h)) >= 0.0;
    let start = mesh.halfedges().find(rises).unwrap();
    let (mut crossings, mut h) = (Vec::new(), start);
    loop {
        let (low, high) = (height(mesh.origin(h)), height(mesh.target(h)));
        crossings.push(Crossing { halfedge: h, t: low / (low - high) });
        // The section enters the triangle across a falling half-edge and leaves it across the rising one.
        let entered = mesh.face(mesh.twin(h).unwrap());
        h = mesh.face_halfedges(entered).into_iter().find(rises).unwrap();
        if h == start {
            return SurfaceCurve { crossings, closed: true };
        }
    }
}

/// Checks the structure of a layout dual to `curves` closed curves on a surface of Euler characteristic `euler`.
fn check_structure(layout: &QuadLayout, arrangement: &Arrangement, curves: usize, euler: i64) {
    layout.check(euler).unwrap();
    assert_eq!(layout.nodes.len() as i64 - layout.arcs.len() as i64 + layout.patches.len() as i64, euler);
    assert_eq!(layout.arcs.len(), 2 * layout.patches.len());
    // Chords correspond to curves.
    assert_eq!(layout.chords, curves);
    let chord_of: BTreeSet<(u32, u32)> =
        layout.arcs.iter().zip(&arrangement.segments).map(|(arc, segment)| (arc.chord, segment.curve)).collect();
    assert_eq!(chord_of.len(), curves);
    // Every arc is a side of two patches, in opposite directions.
    let mut beside = vec![[None; 2]; layout.arcs.len()];
    for (p, patch) in layout.patches.iter().enumerate() {
        for (i, &(arc, forward)) in patch.sides.iter().enumerate() {
            assert_eq!(beside[arc as usize][usize::from(forward)].replace((p, i)), None);
        }
    }
    // From arc to opposite arc, every chord is one cycle through all of its arcs.
    for chord in 0..layout.chords as u32 {
        let of_chord = |a: &usize| layout.arcs[*a].chord == chord;
        let first = (0..layout.arcs.len()).find(of_chord).unwrap();
        let (mut arc, mut forward, mut length) = (first, true, 0);
        loop {
            let (p, i) = beside[arc][usize::from(forward)].unwrap();
            // Opposite sides run in opposite directions around the patch; the next patch lies beyond.
            let (next, along) = layout.patches[p].sides[(i + 2) % 4];
            (arc, forward, length) = (next as usize, !along, length + 1);
            if arc == first {
                break;
            }
        }
        assert_eq!(length, (0..layout.arcs.len()).filter(of_chord).count());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn random_grids_on_a_torus_have_consistent_structure(
        rows in prop::collection::btree_map(0..12u32, 0.1..0.9f64, 1..4),
        columns in prop::collection::btree_map(0..24u32, 0.1..0.9f64, 1..4),
    ) {
        let mesh = torus(24, 12);
        let rows_of = rows.iter().map(|(&j, &t)| row(24, j, true, t));
        let curves: Vec<SurfaceCurve> =
            rows_of.chain(columns.iter().map(|(&i, &t)| column(24, 12, i, true, t))).collect();
        let arrangement = Arrangement::new(&mesh, &curves).unwrap();
        let layout = QuadLayout::dual(&arrangement, &[], 0).unwrap();
        check_structure(&layout, &arrangement, curves.len(), 0);
        prop_assert_eq!(layout.patches.len(), rows.len() * columns.len());
        prop_assert!(layout.nodes.iter().all(Node::is_regular));
    }

    #[test]
    fn random_great_circles_on_a_sphere_have_consistent_structure(
        normals in prop::collection::vec((0.0..std::f64::consts::TAU, -0.95..0.95f64), 2..6),
    ) {
        let mesh = crate::field::samples::octasphere(16);
        let normal = |&(angle, z): &(f64, f64)| {
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * angle.cos(), r * angle.sin(), z)
        };
        let normals: Vec<DVec3> = normals.iter().map(normal).collect();
        // Planes through vertices are not in general position. Circles that are less than a few edges apart may cross the same
        // edges; their crossings can then be avoided.
        let apart = |a: &DVec3, b: &DVec3| a.cross(*b).length() > 0.4;
        prop_assume!((0..normals.len()).all(|i| normals[..i].iter().all(|n| apart(n, &normals[i]))));
        prop_assume!(normals.iter().all(|n| mesh.positions().iter().all(|p| n.dot(*p).abs() > 1e-6)));
        let curves: Vec<SurfaceCurve> = normals.iter().map(|&n| plane_section(&mesh, n)).collect();
        let arrangement = Arrangement::new(&mesh, &curves).unwrap();
        let layout = QuadLayout::dual(&arrangement, &[], 2).unwrap();
        check_structure(&layout, &arrangement, curves.len(), 2);
        prop_assert_eq!(layout.patches.len(), curves.len() * (curves.len() - 1));
    }
}

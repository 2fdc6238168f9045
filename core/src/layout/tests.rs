//! Deleting chords of layouts made from triangle meshes, and drawing what is left.

use super::structure::{Arc, Node, Patch};
use super::*;
use crate::dual::{Arrangement, Mark, RefinedMesh};
use crate::mesh::TriMesh;
use crate::progress::Progress;
use crate::testing::{column, grid, row, square, torus};

/// The layout that parts every triangle of a mesh into three patches around its middle, drawn on the mesh of the sixths of
/// the triangles: all arcs are single edges, all patches two triangles.
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
        positions.push(mesh.face_vertices(f).iter().map(|&v| mesh.position(v)).sum::<glam::DVec3>() / 3.0);
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
    let drawing = Embedding {
        base_face: (0..sixths.n_faces() as u32).collect(),
        nodes: (0..nodes.len() as u32).collect(),
        arc_parameters: vec![vec![0.0, 1.0]; arcs.len()],
        arcs: arcs.iter().map(|a| a.nodes.to_vec()).collect(),
        mesh: refined,
        seeds,
    };
    (QuadLayout::new(nodes, arcs, patches, mesh.euler_characteristic()).unwrap(), drawing)
}

fn surfaces() -> Vec<TriMesh> {
    let open = grid(4, 3, [true, false], |u, v| {
        let a = std::f64::consts::TAU * u;
        glam::DVec3::new(a.cos(), a.sin(), v)
    });
    let two = crate::field::samples::cells(
        &[[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [2, 1, 0], [0, 2, 0], [1, 2, 0], [2, 2, 0]],
        1,
    );
    vec![torus(4, 3), square(3), open, two, crate::field::samples::cells(&[[0, 0, 0]], 1)]
}

/// Four times the sum of all indices, inside and on the boundary.
fn index_sum(layout: &QuadLayout) -> i64 {
    layout.nodes.iter().map(|n| if n.boundary { 2 } else { 4 } - n.valence as i64).sum()
}

#[test]
fn collapsing_keeps_layouts_valid_and_the_sum_of_indices() {
    let (mut done, mut refused) = (0, std::collections::BTreeSet::new());
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
    // No disc, several places of the boundary, two patches at a node.
    for word in ["disc", "together", "2"] {
        assert!(refused.contains(word), "{refused:?}");
    }
}

#[test]
fn a_single_patch_keeps_its_chords() {
    let mesh = square(8);
    let arrangement = Arrangement::new(&mesh, &[row(8, 2, false, 0.5), column(8, 8, 3, false, 0.5)]).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], 1).unwrap();
    assert_eq!(layout.collapse(0), Err(CollapseError::Uncrossed { chord: 1 }));
    // In two patches side by side the chord along both is needed, one of the chords across is not; its arcs join corners
    // of the boundary to regular nodes, which become corners.
    let curves = [row(8, 2, false, 0.5), column(8, 8, 2, false, 0.5), column(8, 8, 5, false, 0.5)];
    let arrangement = Arrangement::new(&mesh, &curves).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], 1).unwrap();
    let left: Vec<usize> = (0..3).filter_map(|c| Some(layout.collapse(c).ok()?.layout.patches.len())).collect();
    assert_eq!(left, [1, 1]);
}

#[test]
fn merged_nodes_add_their_valences() {
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

/// Checks the drawing of what is left: patches are discs of four sides that cover the surface.
fn checked(mesh: &TriMesh, redrawn: &Reembedded) {
    redrawn.layout.check(mesh.euler_characteristic()).unwrap();
    let maps = map_patches(&redrawn.layout, &redrawn.embedding, &Progress::new()).unwrap();
    let area = |m: &TriMesh| m.faces().map(|f| m.face_area(f)).sum::<f64>();
    let parts: f64 = maps.iter().map(|m| area(&m.mesh)).sum();
    assert!((parts - area(mesh)).abs() < 1e-9 * parts, "{parts} of {}", area(mesh));
    // Faces of the drawing lie in the triangles that they say.
    let refined = redrawn.embedding.mesh.to_mesh().unwrap();
    for f in refined.faces() {
        let base = crate::mesh::FaceId(redrawn.embedding.base_face[f.index()]);
        let off = refined.face_vertices(f).map(|v| {
            let at = refined.position(v) - mesh.position(mesh.face_vertices(base)[0]);
            at.dot(mesh.face_normal(base)).abs()
        });
        assert!(off.iter().all(|&d| d < 1e-9), "{off:?}");
    }
}

#[test]
fn what_is_left_is_drawn_whatever_the_surface() {
    let mut drawn = 0;
    for mesh in surfaces() {
        let (layout, drawing) = thirds(&mesh);
        let sixths = drawing.mesh.to_mesh().unwrap();
        let n = sixths.n_vertices();
        let mut gone = vec![false; layout.chords];
        for chord in 0..layout.chords {
            gone[chord] = true;
            let Ok(collapsed) = layout.without(&gone) else {
                gone[chord] = false;
                continue;
            };
            let redrawn = redraw(&layout, &drawing, &gone, |_| false, n, &Progress::new()).unwrap();
            checked(&sixths, &redrawn);
            assert_eq!(redrawn.layout.patches.len(), collapsed.layout.patches.len());
            let kinds =
                |list: &[u32], nodes: &[Node]| list.iter().map(|&n| nodes[n as usize].clone()).collect::<Vec<_>>();
            assert_eq!(kinds(&redrawn.nodes, &redrawn.layout.nodes), kinds(&collapsed.nodes, &collapsed.layout.nodes));
            drawn += 1;
        }
    }
    assert!(drawn > 10, "{drawn}");
}

#[test]
fn loops_on_a_torus_are_taken_out_until_two_are_left() {
    let mesh = torus(24, 12);
    let curves: Vec<_> = (0..3).flat_map(|k| [row(24, 4 * k, true, 0.4), column(24, 12, 7 * k, true, 0.6)]).collect();
    let arrangement = Arrangement::new(&mesh, &curves).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], 0).unwrap();
    let drawing = embed(&arrangement, &layout, &[None; 9], &Progress::new()).unwrap();
    assert_eq!((layout.chords, layout.patches.len()), (6, 9));
    // A chord is the row or the column that its arcs cross.
    let is_row = |chord: usize| {
        let arc = layout.arcs.iter().position(|a| a.chord as usize == chord).unwrap();
        arrangement.segments[arc].curve.is_multiple_of(2)
    };
    let mut gone = vec![false; 6];
    let mut left = [3, 3];
    for chord in 0..6 {
        gone[chord] = true;
        let of = &mut left[usize::from(is_row(chord))];
        if *of == 1 {
            assert!(matches!(
                layout.without(&gone),
                Err(CollapseError::NoDisc { .. } | CollapseError::Uncrossed { .. })
            ));
            gone[chord] = false;
            continue;
        }
        *of -= 1;
        let redrawn = redraw(&layout, &drawing, &gone, |n| n == 0, mesh.n_vertices(), &Progress::new()).unwrap();
        checked(&mesh, &redrawn);
        assert_eq!(redrawn.layout.patches.len(), left[0] * left[1]);
        let kept = redrawn.embedding.nodes[redrawn.nodes[0] as usize];
        assert_eq!(redrawn.embedding.mesh.positions[kept as usize], drawing.mesh.positions[drawing.nodes[0] as usize]);
    }
    assert_eq!(left, [1, 1]);
}

//! Layouts written, read and drawn again; layouts with arcs missing; broken files.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::dual::{Arrangement, Mark};
use crate::embed::EmbeddingTopology;
use crate::layout::{Embedding, QuadLayout, embed, map_patches};
use crate::mesh::HalfedgeId;
use crate::progress::Progress;
use crate::surface::SurfaceCurve;
use crate::testing::{column, row, square, torus};

fn source() -> MeshSource {
    MeshSource::File("test.obj".into())
}

/// A cube of `n` × `n` cells per side, of two triangles each.
fn cube(n: u32) -> TriMesh {
    let mut vertices: BTreeMap<[u32; 3], u32> = BTreeMap::new();
    let mut faces = Vec::new();
    let at = |axis: usize, far: bool, i: u32, j: u32| {
        let mut p = [0; 3];
        p[axis] = if far { n } else { 0 };
        (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (i, j);
        p
    };
    for (axis, far) in [(0, false), (0, true), (1, false), (1, true), (2, false), (2, true)] {
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
            let mut quad = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| at(axis, far, i, j));
            if !far {
                quad.reverse();
            }
            let [a, b, c, d] = quad.map(|p| {
                let next = vertices.len() as u32;
                *vertices.entry(p).or_insert(next)
            });
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mut positions = vec![DVec3::ZERO; vertices.len()];
    for (p, v) in vertices {
        positions[v as usize] = DVec3::from(p.map(f64::from)) / f64::from(n);
    }
    TriMesh::from_faces(positions, &faces).unwrap()
}

fn at_vertex(mesh: &TriMesh, v: VertexId) -> SurfacePoint {
    let h = mesh.vertex_halfedge(v);
    let mut weights = [0.0; 3];
    weights[h.index() % 3] = 1.0;
    SurfacePoint { face: mesh.face(h), weights }
}

/// The layout of a cube whose arcs are its edges, as vertex paths.
fn cube_file(mesh: &TriMesh, n: u32) -> LayoutFile {
    let find = |p: DVec3| mesh.vertices().find(|&v| mesh.position(v).distance(p) < 1e-9).unwrap();
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1));
    let mut file = LayoutFile::new(source(), mesh);
    for i in 0..8 {
        file.nodes.push(FileNode { at: at_vertex(mesh, find(corner(i))), valence: 3, fixed: i == 0 });
    }
    // Seen from outside the axes follow each other counter-clockwise or clockwise, in turn from corner to corner.
    let slot = |i: u32, axis: u32| if i.count_ones().is_multiple_of(2) { 2 - axis } else { axis };
    for (i, axis) in (0..8).flat_map(|i| (0..3).map(move |a| (i, a))).filter(|(i, a)| i >> a & 1 == 0) {
        let j = i | 1 << axis;
        let ends = [i, j].map(|k| ArcEnd { node: k, slot: slot(k, axis) });
        let between = |k: u32| find(corner(i).lerp(corner(j), f64::from(k) / f64::from(n)));
        let path = (1..n).map(|k| PathPoint::Vertex { vertex: between(k) }).collect();
        file.arcs.push(FileArc { ends, fixed: false, path });
    }
    file
}

fn woven(mesh: &TriMesh, curves: &[SurfaceCurve]) -> (QuadLayout, Embedding) {
    let arrangement = Arrangement::new(mesh, curves).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], mesh.euler_characteristic()).unwrap();
    let embedding = embed(&arrangement, &layout, &vec![None; layout.nodes.len()], &Progress::new()).unwrap();
    (layout, embedding)
}

/// A 3 × 3 grid of loops on a torus.
fn torus_grid() -> (TriMesh, LayoutFile) {
    let mesh = torus(24, 12);
    let curves: Vec<SurfaceCurve> =
        (0..3).flat_map(|k| [row(24, 4 * k, true, 0.4), column(24, 12, 7 * k, true, 0.6)]).collect();
    let (layout, embedding) = woven(&mesh, &curves);
    let file = LayoutFile::from_embedding(source(), &mesh, &layout, &embedding).unwrap();
    (mesh, file)
}

/// Patches by their sides alone, however numbered and turned.
fn patches(layout: &QuadLayout) -> Vec<[(u32, bool); 4]> {
    let turned = |s: [(u32, bool); 4]| (0..4).map(|k| [0, 1, 2, 3].map(|i| s[(i + k) % 4])).min().unwrap();
    let mut list: Vec<_> = layout.patches.iter().map(|p| turned(p.sides)).collect();
    list.sort_unstable();
    list
}

/// Writes, reads and draws a layout; it must be the same, and its patches must still have maps.
fn round_trip(mesh: &TriMesh, layout: &QuadLayout, embedding: &Embedding) {
    let file = LayoutFile::from_embedding(source(), mesh, layout, embedding).unwrap();
    let folder = tempfile();
    let path = folder.join("a.layout");
    file.write(&path).unwrap();
    let read = LayoutFile::read(&path).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    assert_eq!(read, file);
    read.check_mesh(mesh).unwrap();
    let drawing = read.draw(mesh).unwrap();
    assert!(drawing.is_complete());
    let (again, embedded) = drawing.to_embedding().unwrap();
    assert_eq!(again.nodes, layout.nodes);
    assert_eq!(again.chords, layout.chords);
    for (a, b) in again.arcs.iter().zip(&layout.arcs) {
        assert_eq!((a.nodes, a.boundary), (b.nodes, b.boundary));
    }
    assert_eq!(patches(&again), patches(layout));
    for (a, b) in embedded.nodes.iter().zip(&embedding.nodes) {
        let distance = embedded.mesh.positions[*a as usize].distance(embedding.mesh.positions[*b as usize]);
        assert!(distance < 1e-8, "a node has moved by {distance}");
    }
    let maps = map_patches(&again, &embedded, &Progress::new()).unwrap();
    assert!(maps.iter().all(|m| m.flipped == 0));
    let area: f64 = maps.iter().flat_map(|m| m.mesh.faces().map(|f| m.mesh.face_area(f))).sum();
    let whole: f64 = mesh.faces().map(|f| mesh.face_area(f)).sum();
    assert!((area - whole).abs() < 1e-6 * whole, "the patches cover the surface once: {area} of {whole}");
    // Written once more from the drawing it is still the same layout.
    let second = LayoutFile::from_drawing(source(), mesh, &drawing).unwrap();
    let (third, _) = second.draw(mesh).unwrap().to_embedding().unwrap();
    assert_eq!(patches(&third), patches(layout));
}

/// A new folder of its own.
fn tempfile() -> PathBuf {
    use std::sync::atomic::{AtomicU32, Ordering};
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let name = format!("plait-layout-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
    let path = std::env::temp_dir().join(name);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// What holds of every drawing: regions turn once, headings change at nodes only and by the corner there, and the
/// sectors at every node add up to its valence.
fn check(drawing: &PartialEmbedding) {
    let mut sectors = vec![0; drawing.nodes.len()];
    for region in &drawing.regions {
        assert_eq!(region.corners.iter().map(PartialCorner::turn).sum::<i64>(), 4);
        let heading = |i: usize| i64::from(drawing.headings[region.border[i] as usize].unwrap());
        assert_eq!(heading(0), 0);
        let n = region.border.len();
        for i in 0..n {
            let (before, after) = (region.border[(i + n - 1) % n], region.border[i]);
            assert_eq!(drawing.mesh.target(before), drawing.mesh.origin(after));
            let corner = region.corners.iter().find(|c| c.at == i);
            let turn = corner.map_or(0, PartialCorner::turn);
            assert_eq!((heading(i) - heading((i + n - 1) % n) - turn).rem_euclid(4), 0);
            if let Some(c) = corner {
                assert_eq!(drawing.mesh.origin(after), drawing.nodes[c.node as usize]);
                sectors[c.node as usize] += c.sectors as usize;
            }
        }
    }
    for (path, headings) in drawing.arcs.iter().zip(drawing.arc_headings()) {
        let boundary =
            path.windows(2).all(|w| drawing.mesh.find(w[0], w[1]).is_some_and(|h| drawing.mesh.is_boundary(h)));
        assert_eq!(headings.iter().flatten().count(), if boundary { 1 } else { 2 });
    }
    for (n, kind) in drawing.kinds.iter().enumerate() {
        assert_eq!(sectors[n], kind.valence);
    }
    for h in 0..3 * drawing.mesh.n_faces() as u32 {
        let on_border = drawing.mesh.mark(h) != Mark::Free || drawing.mesh.is_boundary(h);
        assert_eq!(drawing.headings[h as usize].is_some(), on_border);
    }
}

#[test]
fn woven_layouts_survive_writing_and_reading() {
    for curves in [1, 3] {
        let mesh = torus(24, 12);
        let list: Vec<SurfaceCurve> =
            (0..curves).flat_map(|k| [row(24, 4 * k, true, 0.4), column(24, 12, 7 * k, true, 0.6)]).collect();
        let (layout, embedding) = woven(&mesh, &list);
        round_trip(&mesh, &layout, &embedding);
    }
}

#[test]
fn layouts_with_boundary_survive_writing_and_reading() {
    for curves in [1, 2, 3] {
        let mesh = square(8);
        let list: Vec<SurfaceCurve> =
            (0..curves).flat_map(|k| [row(8, 2 * k, false, 0.5), column(8, 8, 1 + 2 * k, false, 0.5)]).collect();
        let (layout, embedding) = woven(&mesh, &list);
        round_trip(&mesh, &layout, &embedding);
    }
}

#[test]
fn the_edges_of_a_cube_make_its_six_sides() {
    let mesh = cube(4);
    let drawing = cube_file(&mesh, 4).draw(&mesh).unwrap();
    check(&drawing);
    let (layout, embedding) = drawing.to_embedding().unwrap();
    assert_eq!((layout.nodes.len(), layout.arcs.len(), layout.patches.len(), layout.chords), (8, 12, 6, 3));
    assert!(layout.nodes.iter().all(|n| n.valence == 3 && !n.boundary));
    round_trip(&mesh, &layout, &embedding);
}

#[test]
fn a_cube_of_single_edges_can_be_drawn() {
    let mesh = cube(1);
    let drawing = cube_file(&mesh, 1).draw(&mesh).unwrap();
    let (layout, embedding) = drawing.to_embedding().unwrap();
    round_trip(&mesh, &layout, &embedding);
}

#[test]
fn a_cube_may_lack_arcs_while_its_regions_are_discs() {
    let mesh = cube(4);
    let mut file = cube_file(&mesh, 4);
    file.arcs.remove(0);
    let drawing = file.draw(&mesh).unwrap();
    check(&drawing);
    assert!(!drawing.is_complete() && drawing.to_embedding().unwrap().0.patches.is_empty());
    assert_eq!(drawing.regions.len(), 5);
    // Two sides in one: four right angles and two straight ones where the arc was.
    let larger = drawing.regions.iter().find(|r| r.corners.len() == 6).unwrap();
    let mut turns: Vec<i64> = larger.corners.iter().map(PartialCorner::turn).collect();
    turns.sort_unstable();
    assert_eq!(turns, [0, 0, 1, 1, 1, 1]);
    let again = LayoutFile::from_drawing(source(), &mesh, &drawing).unwrap();
    check(&again.draw(&mesh).unwrap());
}

#[test]
fn arcs_along_the_boundary_may_be_left_out() {
    let (mesh, whole) = square_grid();
    let (layout, _) = whole.draw(&mesh).unwrap().to_embedding().unwrap();
    let mut file = whole.clone();
    let mut arcs = layout.arcs.iter();
    file.arcs.retain(|_| !arcs.next().unwrap().boundary);
    assert_eq!(file.arcs.len(), 12);
    let drawing = file.draw(&mesh).unwrap();
    check(&drawing);
    assert!(drawing.is_complete());
    let (again, _) = drawing.to_embedding().unwrap();
    assert_eq!((again.nodes, again.chords, again.arcs.len()), (layout.nodes, layout.chords, layout.arcs.len()));
    // Without any other arc a region is left whose corners are those of the square alone.
    file.arcs.clear();
    file.nodes.retain(|n| n.valence < 4);
    let drawing = file.draw(&mesh).unwrap();
    check(&drawing);
    assert_eq!((drawing.regions.len(), drawing.arcs.len()), (1, 12));
    assert!(!drawing.is_complete());
}

#[test]
fn nodes_inside_one_triangle_and_on_edges() {
    // On two triangles: a quad of four nodes, all in one triangle, inside a boundary quad of its corners.
    let p = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    let mesh = TriMesh::from_faces(p.to_vec(), &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let mut file = LayoutFile::new(source(), &mesh);
    for v in 0..4 {
        file.nodes.push(FileNode { at: at_vertex(&mesh, VertexId(v)), valence: 1, fixed: false });
    }
    let inside = |weights| FileNode { at: SurfacePoint { face: FaceId(0), weights }, valence: 3, fixed: false };
    file.nodes.push(inside([0.6, 0.25, 0.15]));
    file.nodes.push(inside([0.25, 0.6, 0.15]));
    file.nodes.push(inside([0.15, 0.35, 0.5]));
    file.nodes.push(inside([0.5, 0.0, 0.5]));
    let mut arc = |a: (u32, u32), b: (u32, u32)| {
        let ends = [a, b].map(|(node, slot)| ArcEnd { node, slot });
        file.arcs.push(FileArc { ends, fixed: false, path: Vec::new() });
    };
    for i in 0..4 {
        let j = (i + 1) % 4;
        // Along the boundary, from the inner quad outwards, around the inner quad.
        arc((i, 0), (j, 2));
        arc((4 + i, 0), (i, 1));
        arc((4 + i, 1), (4 + j, 2));
    }
    // A boundary corner with an arc has two sectors.
    file.nodes[..4].iter_mut().for_each(|n| n.valence = 2);
    let drawing = file.draw(&mesh).unwrap();
    check(&drawing);
    let (layout, embedding) = drawing.to_embedding().unwrap();
    assert_eq!((layout.nodes.len(), layout.arcs.len(), layout.patches.len()), (8, 12, 5));
    assert_eq!(layout.arcs.iter().filter(|a| a.boundary).count(), 4);
    round_trip(&mesh, &layout, &embedding);
}

fn error(change: impl FnOnce(&mut LayoutFile)) -> PartialEmbeddingError {
    let mesh = cube(4);
    let mut file = cube_file(&mesh, 4);
    change(&mut file);
    file.draw(&mesh).unwrap_err()
}

#[test]
fn broken_layouts_are_named() {
    assert_eq!(error(|f| f.arcs[3].ends[1].node = 8), PartialEmbeddingError::UnknownNode { arc: 3, node: 8, count: 8 });
    assert_eq!(
        error(|f| f.arcs[3].ends[0].slot = 7),
        PartialEmbeddingError::UnknownSlot { arc: 3, node: f_node(3), slot: 7, last: 2 }
    );
    assert!(matches!(error(|f| f.arcs[0].ends[0].slot = 1), PartialEmbeddingError::SlotTaken { node: 0, slot: 1, .. }));
    assert_eq!(error(|f| f.nodes[2].at.weights[0] = f64::NAN), PartialEmbeddingError::Weights { node: 2 });
    assert_eq!(error(|f| f.nodes[2].at.weights = [0.5, 0.6, -0.1]), PartialEmbeddingError::Weights { node: 2 });
    assert_eq!(
        error(|f| f.nodes[2].at.face.0 = 1 << 30),
        PartialEmbeddingError::UnknownFace { node: 2, face: FaceId(1 << 30) }
    );
    assert_eq!(error(|f| f.nodes[2].valence = 0), PartialEmbeddingError::Valence { node: 2, valence: 0 });
    let gap = error(|f| f.arcs[5].path = vec![f.arcs[5].path[0], f.arcs[5].path[2]]);
    assert_eq!(gap, PartialEmbeddingError::Gap { arc: 5, step: 1 });
    assert!(matches!(
        error(|f| f.arcs[5].path[0] = PathPoint::Vertex { vertex: VertexId(1 << 20) }),
        PartialEmbeddingError::Place { arc: 5, place: 0, .. }
    ));
    let crossing = |h: u32, t: f64| PathPoint::Crossing(Crossing { halfedge: HalfedgeId(h), t });
    for t in [0.0, 1.0, f64::NAN, f64::INFINITY, -1.0] {
        assert!(
            matches!(
                error(|f| f.arcs[5].path[0] = crossing(0, t)),
                PartialEmbeddingError::Place { arc: 5, place: 0, .. }
            ),
            "{t}"
        );
    }
    // Two nodes at one place, a node on an arc.
    let meet = |e| matches!(e, PartialEmbeddingError::Meet { .. });
    assert!(meet(error(|f| f.nodes[1].at = f.nodes[0].at)));
    let node_3 = cube_node(3);
    let through = |f: &mut LayoutFile| f.arcs[0].path.push(PathPoint::Vertex { vertex: node_3 });
    assert!(meet(error(through)));
}

/// The mesh vertex of a node of the cube.
fn cube_node(node: usize) -> VertexId {
    let mesh = cube(4);
    cube_file(&mesh, 4).nodes[node].at.nearest_vertex(&mesh)
}

/// The first node of an arc of the cube.
fn f_node(arc: usize) -> u32 {
    cube_file(&cube(4), 4).arcs[arc].ends[0].node
}

#[test]
fn slots_out_of_order_are_named() {
    // Two arcs exchanged at node 0.
    let swapped = error(|f| {
        for a in &mut f.arcs {
            for end in a.ends.iter_mut().filter(|e| e.node == 0 && e.slot < 2) {
                end.slot = 1 - end.slot;
            }
        }
    });
    assert!(matches!(swapped, PartialEmbeddingError::SlotOrder { node: 0, .. }), "{swapped}");
}

#[test]
fn a_valence_that_contradicts_the_turning_is_named_with_its_region() {
    let error = error(|f| f.nodes[0].valence = 4);
    let PartialEmbeddingError::Turning { arcs, quarters: 3, .. } = &error else { panic!("{error}") };
    assert_eq!(arcs.len(), 4);
    assert!(error.to_string().contains("instead of 4"), "{error}");
}

#[test]
fn missing_arcs_that_leave_no_disc_are_named() {
    let all = error(|f| f.arcs.clear());
    assert!(matches!(all, PartialEmbeddingError::Isolated { node: 0 }), "{all}");
    // Two opposite sides of the cube: between them is a ring.
    let ring = error(|f| f.arcs.retain(|a| a.ends[0].node / 4 == a.ends[1].node / 4));
    let PartialEmbeddingError::NotADisc { arcs, .. } = &ring else { panic!("{ring}") };
    assert_eq!(arcs.len(), 8);
}

#[test]
fn crossing_arcs_are_named() {
    // Across a flat square, from side to side both ways.
    let mesh = square(2);
    let mut file = LayoutFile::new(source(), &mesh);
    let on = |h: u32, t: f64| {
        let mut weights = [0.0; 3];
        (weights[h as usize % 3], weights[(h as usize + 1) % 3]) = (1.0 - t, t);
        FileNode { at: SurfacePoint { face: FaceId(h / 3), weights }, valence: 2, fixed: false }
    };
    let path = |curve: SurfaceCurve| -> Vec<PathPoint> {
        curve.crossings[1..curve.crossings.len() - 1].iter().map(|&c| PathPoint::Crossing(c)).collect()
    };
    for (k, curve) in [row(2, 0, false, 0.5), column(2, 2, 0, false, 0.4)].into_iter().enumerate() {
        let [first, last] = [curve.crossings[0], curve.crossings[curve.crossings.len() - 1]];
        file.nodes.extend([first, last].map(|c| on(c.halfedge.0, c.t)));
        let ends = [0, 1].map(|i| ArcEnd { node: 2 * k as u32 + i, slot: 1 });
        file.arcs.push(FileArc { ends, fixed: false, path: path(curve) });
    }
    let both = file.draw(&mesh).unwrap_err();
    assert!(matches!(both, PartialEmbeddingError::Cross { first: 0, second: 1, .. }), "{both}");
    // One of them alone parts the square; its two halves have two corners too few.
    file.arcs.pop();
    assert!(matches!(file.draw(&mesh).unwrap_err(), PartialEmbeddingError::Turning { .. }));
}

#[test]
fn files_that_cannot_be_read_say_why() {
    let folder = tempfile();
    let path = folder.join("a.layout");
    let read = |text: &str| {
        std::fs::write(&path, text).unwrap();
        LayoutFile::read(&path).unwrap_err()
    };
    assert!(matches!(LayoutFile::read(Path::new("/nowhere.layout")), Err(LayoutFileError::File { .. })));
    assert!(matches!(read("{}"), LayoutFileError::Format { .. }));
    assert!(matches!(read(r#"{"version": 2, "shape": "new"}"#), LayoutFileError::Version(2)));
    assert!(matches!(read(r#"{"version": 0}"#), LayoutFileError::Version(0)));
    let node = |w: &str| {
        format!(
            r#"{{"version":1,"mesh":{{"builtin":"torus"}},"nodes":[{{"at":{{"face":0,"weights":[{w},0,0]}},"valence":3}}],"arcs":[]}}"#
        )
    };
    assert!(matches!(read(&node("1e999")), LayoutFileError::Format { .. }));
    assert!(matches!(read(&node("NaN")), LayoutFileError::Format { .. }));
    std::fs::write(&path, node("1")).unwrap();
    let file = LayoutFile::read(&path).unwrap();
    assert_eq!(file.fingerprint, None);
    std::fs::remove_dir_all(folder).unwrap();
    let (other, mesh) = (square(2), square(3));
    assert!(matches!(LayoutFile::new(source(), &other).check_mesh(&mesh), Err(LayoutFileError::OtherMesh { .. })));
    file.check_mesh(&mesh).unwrap();
}

/// A square woven from side to side.
fn square_grid() -> (TriMesh, LayoutFile) {
    let mesh = square(8);
    let curves: Vec<SurfaceCurve> =
        (0..3).flat_map(|k| [row(8, 2 * k, false, 0.5), column(8, 8, 1 + 2 * k, false, 0.5)]).collect();
    let (layout, embedding) = woven(&mesh, &curves);
    let file = LayoutFile::from_embedding(source(), &mesh, &layout, &embedding).unwrap();
    (mesh, file)
}

#[test]
fn patches_much_smaller_than_triangles_survive_writing_and_reading() {
    for (n, m, count) in [(3, 3, 4), (4, 4, 7), (6, 4, 9)] {
        let mesh = torus(n, m);
        let fraction = |i: u32| (f64::from(i) + 0.5 + 0.4 * f64::from(3 * i).sin()) / f64::from(count);
        let curves: Vec<SurfaceCurve> = (0..count)
            .flat_map(|i| [row(n, (i / 4) % m, true, fraction(i)), column(n, m, (i / 3) % n, true, 1.0 - fraction(i))])
            .collect();
        let (layout, embedding) = woven(&mesh, &curves);
        let file = LayoutFile::from_embedding(source(), &mesh, &layout, &embedding).unwrap();
        let drawing = file.draw(&mesh).unwrap();
        check(&drawing);
        assert_eq!(patches(&drawing.to_embedding().unwrap().0), patches(&layout));
    }
}

#[test]
fn arcs_at_the_boundary_have_slots_that_say_so() {
    let (mesh, whole) = square_grid();
    let error = |change: &dyn Fn(&mut LayoutFile)| {
        let mut file = whole.clone();
        change(&mut file);
        file.draw(&mesh).unwrap_err()
    };
    let at_corner =
        |f: &LayoutFile, v: u32| f.nodes.iter().position(|n| n.at == at_vertex(&mesh, VertexId(v))).unwrap();
    let corners = [0, 8, 80].map(|v| at_corner(&whole, v) as u32);
    let end = |node: u32, slot: u32| ArcEnd { node, slot };
    let only = |f: &mut LayoutFile, ends: [ArcEnd; 2], path: &[u32]| {
        let path = path.iter().map(|&v| PathPoint::Vertex { vertex: VertexId(v) }).collect();
        f.arcs = vec![FileArc { ends, fixed: false, path }];
    };
    // To the next corner but across other nodes.
    let across = error(&|f| only(f, [end(corners[0], 0), end(corners[1], 1)], &[]));
    assert_eq!(across, PartialEmbeddingError::OffBoundary { arc: 0 });
    // With the slots of a boundary arc, but through the interior.
    let inside = error(&|f| only(f, [end(corners[0], 0), end(corners[2], 1)], &[10, 20, 30, 40, 50, 60, 70]));
    assert_eq!(inside, PartialEmbeddingError::OffBoundary { arc: 0 });
    // Along the boundary with other slots.
    let along = error(&|f| {
        f.nodes.retain(|n| n.at == at_vertex(&mesh, VertexId(0)) || n.at == at_vertex(&mesh, VertexId(8)));
        f.nodes.iter_mut().for_each(|n| n.valence = 2);
        only(f, [end(0, 1), end(1, 1)], &[1, 2, 3, 4, 5, 6, 7]);
    });
    assert_eq!(along, PartialEmbeddingError::OnBoundary { arc: 0 });
}

#[test]
fn the_example_of_the_documentation_is_a_layout() {
    let text = include_str!("../../../../docs/layout-file.md");
    let json = text.split("```json").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let file: LayoutFile = serde_json::from_str(json).unwrap();
    let p = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    let mesh = TriMesh::from_faces(p.to_vec(), &[[0, 1, 2], [0, 2, 3]]).unwrap();
    let drawing = file.draw(&mesh).unwrap();
    check(&drawing);
    let (layout, embedding) = drawing.to_embedding().unwrap();
    assert_eq!((layout.nodes.len(), layout.patches.len(), layout.chords), (6, 2, 3));
    round_trip(&mesh, &layout, &embedding);
}

#[test]
fn drawings_with_arcs_missing_determine_a_field() {
    let mesh = cube(4);
    let (torus, grid) = torus_grid();
    let (square, sheet) = square_grid();
    for (mesh, mut file) in [(&mesh, cube_file(&mesh, 4)), (&torus, grid), (&square, sheet)] {
        for _ in 0..3 {
            let drawing = file.draw(mesh).unwrap();
            let (layout, embedding) = drawing.to_embedding().unwrap();
            // It checks the index of every vertex.
            EmbeddingTopology::new(mesh, &embedding, &layout, &drawing.arc_headings()).unwrap();
            let spare = (0..file.arcs.len()).find(|&a| {
                let mut fewer = file.clone();
                fewer.arcs.remove(a);
                fewer.draw(mesh).is_ok_and(|d| d.regions.len() < drawing.regions.len())
            });
            file.arcs.remove(spare.unwrap());
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn whatever_arcs_are_dropped_is_drawn_or_refused(
        dropped in prop::collection::vec(0.0..1.0f64, 24), share in 0.0..0.6f64, which in 0..3usize
    ) {
        static LAYOUTS: OnceLock<[(TriMesh, LayoutFile); 3]> = OnceLock::new();
        let cube = || (cube(4), cube_file(&cube(4), 4));
        let (mesh, whole) = &LAYOUTS.get_or_init(|| [torus_grid(), square_grid(), cube()])[which];
        let mut file = whole.clone();
        let mut keep = dropped.iter().map(|x| *x >= share);
        file.arcs.retain(|_| keep.next().unwrap());
        match file.draw(mesh) {
            Ok(drawing) => {
                check(&drawing);
                // Those along the boundary are added again.
                prop_assert_eq!(drawing.is_complete(), drawing.arcs.len() == whole.arcs.len());
                let again = LayoutFile::from_drawing(source(), mesh, &drawing).unwrap();
                let second = again.draw(mesh).unwrap();
                check(&second);
                prop_assert_eq!(second.regions.len(), drawing.regions.len());
            }
            Err(e) => prop_assert!(matches!(e, PartialEmbeddingError::NotADisc { .. } | PartialEmbeddingError::Isolated { .. }), "{e}"),
        }
    }

    #[test]
    fn whatever_a_file_says_is_drawn_or_refused(
        changes in prop::collection::vec((0..7u32, any::<u32>(), any::<u32>(), -0.1..1.1f64), 1..4), which in 0..3usize
    ) {
        static LAYOUTS: OnceLock<[(TriMesh, LayoutFile); 3]> = OnceLock::new();
        let cube = || (cube(4), cube_file(&cube(4), 4));
        let (mesh, whole) = &LAYOUTS.get_or_init(|| [torus_grid(), square_grid(), cube()])[which];
        let mut file = whole.clone();
        for (kind, i, j, t) in changes {
            let (n_arcs, n_nodes) = (file.arcs.len(), file.nodes.len());
            let arc = &mut file.arcs[i as usize % n_arcs];
            let at = j as usize % (arc.path.len() + 1);
            match kind {
                0 => arc.ends[i as usize % 2].slot = j % 5,
                1 => arc.ends[i as usize % 2].node = j % (n_nodes as u32 + 1),
                2 => arc.path.insert(at, PathPoint::Vertex { vertex: VertexId(j % (mesh.n_vertices() as u32 + 1)) }),
                3 => {
                    let halfedge = HalfedgeId(j % (mesh.n_halfedges() as u32 + 1));
                    arc.path.insert(at, PathPoint::Crossing(Crossing { halfedge, t }));
                }
                4 => match arc.path.get_mut(at) {
                    Some(PathPoint::Crossing(c)) => c.t = t,
                    Some(place) => *place = PathPoint::Vertex { vertex: VertexId(j % mesh.n_vertices() as u32) },
                    None => arc.path.clear(),
                },
                5 => file.nodes[i as usize % n_nodes].at.weights = [t, 1.0 - t, 0.0],
                _ => file.nodes[i as usize % n_nodes].valence = j % 6,
            }
        }
        if let Ok(drawing) = file.draw(mesh) {
            check(&drawing);
            drawing.to_embedding().unwrap();
        }
    }
}

//! Errors of layout files and of the embedding of their layouts.

use std::path::Path;

use super::*;
use crate::mesh::HalfedgeId;
use crate::surface::Crossing;

/// The error of a changed file of a cube.
fn error(change: impl FnOnce(&mut LayoutFile)) -> PartialEmbeddingError {
    let mesh = cube(4);
    let mut file = cube_file(&mesh, 4);
    change(&mut file);
    file.partial_embedding(&mesh).unwrap_err()
}

#[test]
fn invalid_elements_are_reported() {
    assert_eq!(error(|f| f.arcs[3].ends[1].node = 8), PartialEmbeddingError::UnknownNode { arc: 3, node: 8, count: 8 });
    assert_eq!(
        error(|f| f.arcs[3].ends[0].slot = 7),
        PartialEmbeddingError::UnknownSlot { arc: 3, node: first_node(3), slot: 7, last: 2 }
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
        PartialEmbeddingError::PathPoint { arc: 5, point: 0, .. }
    ));
    let crossing = |h: u32, t: f64| PathPoint::Crossing(Crossing { halfedge: HalfedgeId(h), t });
    for t in [0.0, 1.0, f64::NAN, f64::INFINITY, -1.0] {
        assert!(
            matches!(
                error(|f| f.arcs[5].path[0] = crossing(0, t)),
                PartialEmbeddingError::PathPoint { arc: 5, point: 0, .. }
            ),
            "{t}"
        );
    }
    // Two nodes at one point; a node on an arc.
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
fn first_node(arc: usize) -> u32 {
    cube_file(&cube(4), 4).arcs[arc].ends[0].node
}

#[test]
fn slots_out_of_order_are_reported() {
    // Exchange the slots of two arcs at node 0.
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
fn valence_that_contradicts_the_turning_is_reported_with_its_region() {
    let error = error(|f| f.nodes[0].valence = 4);
    let PartialEmbeddingError::Turning { arcs, quarters: 3, .. } = &error else { panic!("{error}") };
    assert_eq!(arcs.len(), 4);
    assert!(error.to_string().contains("instead of 4"), "{error}");
}

#[test]
fn missing_arcs_around_a_region_that_is_no_disc_are_reported() {
    let all = error(|f| f.arcs.clear());
    assert!(matches!(all, PartialEmbeddingError::Isolated { node: 0 }), "{all}");
    // Between two opposite sides of the cube the region is an annulus.
    let ring = error(|f| f.arcs.retain(|a| a.ends[0].node / 4 == a.ends[1].node / 4));
    let PartialEmbeddingError::NotADisc { arcs, .. } = &ring else { panic!("{ring}") };
    assert_eq!(arcs.len(), 8);
}

#[test]
fn crossing_arcs_are_reported() {
    // Two arcs across a square, from side to side.
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
    let both = file.partial_embedding(&mesh).unwrap_err();
    assert!(matches!(both, PartialEmbeddingError::Cross { first: 0, second: 1, .. }), "{both}");
    // One arc divides the square into halves with two corners too few.
    file.arcs.pop();
    assert!(matches!(file.partial_embedding(&mesh).unwrap_err(), PartialEmbeddingError::Turning { .. }));
}

#[test]
fn unreadable_files_are_reported() {
    let folder = temporary_folder();
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

#[test]
fn slots_of_boundary_arcs_are_checked() {
    let (mesh, whole) = square_grid();
    let error = |change: &dyn Fn(&mut LayoutFile)| {
        let mut file = whole.clone();
        change(&mut file);
        file.partial_embedding(&mesh).unwrap_err()
    };
    let at_corner =
        |f: &LayoutFile, v: u32| f.nodes.iter().position(|n| n.at == at_vertex(&mesh, VertexId(v))).unwrap();
    let corners = [0, 8, 80].map(|v| at_corner(&whole, v) as u32);
    let end = |node: u32, slot: u32| ArcEnd { node, slot };
    let only = |f: &mut LayoutFile, ends: [ArcEnd; 2], path: &[u32]| {
        let path = path.iter().map(|&v| PathPoint::Vertex { vertex: VertexId(v) }).collect();
        f.arcs = vec![FileArc { ends, fixed: false, path }];
    };
    // To the next corner, past other nodes.
    let across = error(&|f| only(f, [end(corners[0], 0), end(corners[1], 1)], &[]));
    assert_eq!(across, PartialEmbeddingError::OffBoundary { arc: 0 });
    // With the slots of a boundary arc but through the interior.
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

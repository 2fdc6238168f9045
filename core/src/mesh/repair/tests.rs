//! Repairs one by one, and their outcome on random triangle soups.

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::mesh::error::FaceRef;
use crate::mesh::load::{LoadedMesh, parse};

const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 5 5\n";

fn obj(faces: &str) -> Result<LoadedMesh, LoadError> {
    parse(format!("{CORNERS}{faces}").as_bytes(), "test.obj")
}

#[test]
fn each_repair_is_listed() {
    let good = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    let unused = |m: &LoadedMesh| matches!(m.repairs.last(), Some(Repair::DroppedUnusedVertices { count: 1, .. }));
    let m = obj(good).unwrap();
    assert!(m.repairs.len() == 1 && unused(&m));

    let m = obj(&format!("{good}f 4 2 1\nf 1 1 2\n")).unwrap();
    let listed: Vec<String> = m.repairs.iter().map(ToString::to_string).collect();
    assert_eq!(listed[0], "dropped 1 face without three different corners (first: face 6 (line 11))");
    assert_eq!(listed[1], "dropped 1 face with the corners of another face (first: face 5 (line 10))");
    assert_eq!(listed[2], "dropped 1 vertex that no face uses (first: vertex 5 at (5, 5, 5))");

    let m = obj("f 1 3 2\nf 1 4 2\nf 2 3 4\nf 3 1 4\n").unwrap();
    assert!(matches!(m.repairs[0], Repair::Reoriented { count: 1, first: FaceRef { number: 2, .. } }));

    let m = obj("f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n").unwrap();
    assert!(matches!(m.repairs[0], Repair::TurnedOutwards { count: 4, .. }));
    let outwards = m.mesh.faces().all(|f| {
        let a = m.mesh.position(m.mesh.face_vertices(f)[0]);
        let middle = m.mesh.positions().iter().sum::<DVec3>() / 4.0;
        m.mesh.face_area_vector(f).dot(a - middle) > 0.0
    });
    assert!(outwards);
}

#[test]
fn an_inner_surface_may_bound_a_cavity() {
    let shell = |scale: f64, shift: f64, from: usize, inward: bool| {
        let p = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.]].map(|p| p.map(|x| x * scale + shift));
        let vertices = p.map(|p| format!("v {} {} {}\n", p[0], p[1], p[2])).concat();
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].map(|mut f| {
            if inward {
                f.swap(1, 2);
            }
            let [a, b, c] = f.map(|v| v + from);
            format!("f {a} {b} {c}\n")
        });
        vertices + &faces.concat()
    };
    let nested = shell(10.0, 0.0, 1, false) + &shell(1.0, 1.0, 5, true);
    assert_eq!(parse(nested.as_bytes(), "a.obj").unwrap().repairs, []);
    let apart = shell(1.0, 5.0, 1, false) + &shell(1.0, 1.0, 5, true);
    assert!(matches!(parse(apart.as_bytes(), "a.obj").unwrap().repairs[..], [Repair::TurnedOutwards { .. }]));
}

#[test]
fn vertices_of_several_fans_are_split() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n";
    let m = parse(text.as_bytes(), "a.obj").unwrap();
    assert_eq!(m.mesh.n_vertices(), 6);
    assert!(matches!(m.repairs[..], [Repair::SplitVertices { count: 1, .. }]));
}

#[test]
fn uncertain_repairs_are_refused() {
    let message = |faces: &str| obj(faces).unwrap_err().to_string();
    assert_eq!(
        message("f 1 2 3\nf 2 1 4\nf 1 2 5\n"),
        "3 faces share the edge from vertex 1 at (0, 0, 0) to vertex 2 at (1, 0, 0) (among them face 1 (line 6) and \
         face 2 (line 7)); at most two may"
    );
    assert!(message("f 1 2 9\n").contains("face 1 (line 6) names vertex 9, but there are only 5"));
    assert!(message("").contains("no faces"));
    assert!(message("f 1 1 2\n").contains("no faces"));
    // A Möbius strip of five triangles.
    assert!(message("f 1 2 3\nf 2 3 4\nf 3 4 5\nf 4 5 1\nf 5 1 2\n").contains("not orientable"));
    assert!(matches!(parse(b"v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "a.obj"), Err(LoadError::NoSize)));
}

/// The positions and triangles of a mesh as a file of triangles would hold them.
fn as_raw(positions: &[DVec3], faces: &[[u32; 3]]) -> (RawMesh, Triangles) {
    let corners: Vec<u32> = faces.iter().flatten().copied().collect();
    let ends = (1..=faces.len() as u32).map(|i| 3 * i).collect();
    let raw = RawMesh { positions: positions.to_vec(), corners, ends, ..RawMesh::default() };
    let source = (0..faces.len() as u32).collect();
    (raw, Triangles { faces: faces.to_vec(), source, dropped: Vec::new() })
}

/// Triangles over few vertices, some of them at equal positions: with duplicate and degenerate faces, inconsistent
/// orientation, several fans at a vertex, unused vertices.
fn soup() -> impl Strategy<Value = (Vec<DVec3>, Vec<[u32; 3]>)> {
    let position = (0i32..3, 0i32..3, 0i32..3).prop_map(|(x, y, z)| DVec3::new(x.into(), y.into(), z.into()));
    let face = (0u32..10, 0u32..10, 0u32..10).prop_map(|(a, b, c)| [a, b, c]);
    (prop::collection::vec(position, 10), prop::collection::vec(face, 1..9))
}

/// A triangulated surface, part of whose faces are reversed, doubled or missing: no edge has more than two faces.
fn damaged_surface() -> impl Strategy<Value = (Vec<DVec3>, Vec<[u32; 3]>)> {
    let mesh = crate::testing::torus(6, 4);
    let faces: Vec<[u32; 3]> = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0)).collect();
    let positions = mesh.positions().to_vec();
    prop::collection::vec(0u8..6, faces.len()).prop_map(move |damage| {
        let mut damaged = Vec::new();
        for (&[a, b, c], d) in faces.iter().zip(damage) {
            match d {
                0 => {}
                1 => damaged.push([a, c, b]),
                2 => damaged.extend([[a, b, c], [b, a, c]]),
                3 => damaged.extend([[a, b, c], [a, a, c]]),
                _ => damaged.push([a, b, c]),
            }
        }
        (positions.clone(), damaged)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    /// What is repaired is an oriented manifold, and repairing it again changes nothing.
    #[test]
    fn repair_gives_an_oriented_manifold_and_is_idempotent(
        (positions, faces) in prop_oneof![soup(), damaged_surface()],
    ) {
        let (raw, triangles) = as_raw(&positions, &faces);
        match repair(raw, triangles) {
            Ok((positions, faces, _)) => {
                let mesh = crate::mesh::TriMesh::from_faces(positions.clone(), &faces);
                prop_assert!(mesh.is_ok(), "{:?}", mesh.err());
                // Where no two faces share a vertex any more, vertices that were split would be welded again.
                if faces.len() == 1 || positions.len() < 3 * faces.len() {
                    let (raw, triangles) = as_raw(&positions, &faces);
                    prop_assert_eq!(repair(raw, triangles).unwrap(), (positions, faces, Vec::new()));
                }
            }
            Err(LoadError::NoFaces { .. } | LoadError::NonManifoldEdge { .. } | LoadError::NonOrientable { .. }) => {}
            Err(other) => prop_assert!(false, "{other}"),
        }
    }

    /// A damaged orientable surface is always repaired, with the positions and face sets it had.
    #[test]
    fn damaged_surfaces_are_repaired((positions, faces) in damaged_surface()) {
        let corners = |positions: &[DVec3], f: &[u32; 3]| {
            let mut at = f.map(|v| positions[v as usize].to_array().map(f64::to_bits));
            at.sort_unstable();
            at
        };
        let mut wanted: Vec<_> =
            faces.iter().filter(|f| f[0] != f[1]).map(|f| corners(&positions, f)).collect();
        wanted.sort_unstable();
        wanted.dedup();
        let (raw, triangles) = as_raw(&positions, &faces);
        match repair(raw, triangles) {
            Ok((positions, faces, _)) => {
                let mut found: Vec<_> = faces.iter().map(|f| corners(&positions, f)).collect();
                found.sort_unstable();
                prop_assert_eq!(found, wanted);
            }
            Err(error) => prop_assert!(matches!(error, LoadError::NoFaces { .. }) && wanted.is_empty(), "{error}"),
        }
    }
}

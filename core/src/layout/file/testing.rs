//! Layout files that several tests use.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{ArcEnd, FileArc, FileNode, LayoutFile, PathPoint};
use crate::dual::Arrangement;
use crate::layout::{Embedding, QuadLayout, initial_embedding};
use crate::mesh::{MeshSource, TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::{SurfaceCurve, SurfacePoint};
use crate::testing::{column, row, square, torus};

/// The source of the mesh in test files.
pub(crate) fn source() -> MeshSource {
    MeshSource::File("test.obj".into())
}

/// A cube of `n` × `n` cells per side, each of two triangles.
pub(crate) fn cube(n: u32) -> TriMesh {
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

/// A vertex as a point of a triangle.
pub(crate) fn at_vertex(mesh: &TriMesh, v: VertexId) -> SurfacePoint {
    let h = mesh.vertex_halfedge(v);
    let mut weights = [0.0; 3];
    weights[h.index() % 3] = 1.0;
    SurfacePoint { face: mesh.face(h), weights }
}

/// The layout whose arcs are the edges of a cube, as vertex paths.
pub(crate) fn cube_file(mesh: &TriMesh, n: u32) -> LayoutFile {
    let find = |p: DVec3| mesh.vertices().find(|&v| mesh.position(v).distance(p) < 1e-9).unwrap();
    let corner = |i: u32| DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2 & 1));
    let mut file = LayoutFile::new(source(), mesh);
    for i in 0..8 {
        file.nodes.push(FileNode { at: at_vertex(mesh, find(corner(i))), valence: 3, fixed: i == 0 });
    }
    // Seen from outside, the axes follow each other counter-clockwise at corners of one parity, clockwise at the
    // others.
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

/// The layout dual to given curves, with its initial embedding.
pub(crate) fn dual_layout(mesh: &TriMesh, curves: &[SurfaceCurve]) -> (QuadLayout, Embedding) {
    let arrangement = Arrangement::new(mesh, curves).unwrap();
    let layout = QuadLayout::dual(&arrangement, &[], mesh.euler_characteristic()).unwrap();
    let embedding =
        initial_embedding(&arrangement, &layout, &vec![None; layout.nodes.len()], &Progress::new()).unwrap();
    (layout, embedding)
}

/// The layout dual to a 3 × 3 grid of loops on a torus.
pub(crate) fn torus_grid() -> (TriMesh, LayoutFile) {
    let mesh = torus(24, 12);
    let curves: Vec<SurfaceCurve> =
        (0..3).flat_map(|k| [row(24, 4 * k, true, 0.4), column(24, 12, 7 * k, true, 0.6)]).collect();
    let (layout, embedding) = dual_layout(&mesh, &curves);
    let file = LayoutFile::from_embedding(source(), &mesh, &layout, &embedding).unwrap();
    (mesh, file)
}

/// The layout dual to three rows and three columns of a square.
pub(crate) fn square_grid() -> (TriMesh, LayoutFile) {
    let mesh = square(8);
    let curves: Vec<SurfaceCurve> =
        (0..3).flat_map(|k| [row(8, 2 * k, false, 0.5), column(8, 8, 1 + 2 * k, false, 0.5)]).collect();
    let (layout, embedding) = dual_layout(&mesh, &curves);
    let file = LayoutFile::from_embedding(source(), &mesh, &layout, &embedding).unwrap();
    (mesh, file)
}

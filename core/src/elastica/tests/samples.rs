//! Sample meshes, and their elastica graphs.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;

use crate::elastica::{DirectionMask, ElasticaGraph, ElasticaOptions};
use crate::mesh::{TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::{SurfaceCurve, principal_curvature};
use crate::testing::{grid, research_mesh};

/// Normalises by the bounding box, as loading does.
pub(super) fn normalised(points: Vec<DVec3>, faces: &[[u32; 3]]) -> TriMesh {
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let scale = 1.0 / low.distance(high);
    TriMesh::from_faces(points.iter().map(|p| (*p - low) * scale).collect(), faces).unwrap()
}

/// A grid of `n` by `m` quads, each cut in two, closed along the first direction, and along the second if `closed`; scaled
/// to bounding-box diagonal 1. Vertices are numbered along the second.
pub(super) fn around(n: u32, m: u32, closed: bool, point: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let mesh = grid(m, n, [closed, true], |v, u| point(u, v));
    let turned = |f| mesh.face_vertices(f).map(|v| v.0);
    let faces: Vec<[u32; 3]> = mesh.faces().map(turned).map(|[a, b, c]| [a, c, b]).collect();
    normalised(mesh.positions().to_vec(), &faces)
}

/// A torus of `n` by `m` quads.
pub(super) fn torus(n: u32, m: u32) -> TriMesh {
    around(n, m, true, |u, v| {
        let (a, b) = (TAU * u, TAU * v);
        let r = 1.0 + 0.4 * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), 0.4 * b.sin())
    })
}

/// An open tube with a waist, of `n` by `m` quads.
pub(super) fn tube(n: u32, m: u32) -> TriMesh {
    around(n, m, false, |u, v| {
        let (a, z) = (TAU * u, v - 0.5);
        let r = 0.2 + z * z;
        DVec3::new(r * a.cos(), r * a.sin(), 2.0 * z)
    })
}

/// An octahedron, subdivided `levels` times and scaled to an ellipsoid.
pub(super) fn ellipsoid(levels: u32, radii: DVec3) -> TriMesh {
    let mut points = vec![DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y, DVec3::Z, -DVec3::Z];
    let mut faces: Vec<[u32; 3]> = (0..4).flat_map(|i| [[i, (i + 1) % 4, 4], [(i + 1) % 4, i, 5]]).collect();
    for _ in 0..levels {
        let mut middle = std::collections::BTreeMap::new();
        let mut at = |a: u32, b: u32| {
            *middle.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((points[a as usize] + points[b as usize]).normalize());
                points.len() as u32 - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (x, y, z) = (at(a, b), at(b, c), at(c, a));
                [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
            })
            .collect();
    }
    normalised(points.iter().map(|p| *p * radii).collect(), &faces)
}

/// A research mesh, if it is there.
pub(super) fn research(name: &str) -> Option<TriMesh> {
    Some(Arc::unwrap_or_clone(research_mesh(name)?.mesh))
}

/// Whether each edge is inside the surface and has a dihedral angle above `degrees`.
fn sharp_edges(mesh: &TriMesh, degrees: f64) -> Vec<bool> {
    let normal = |h| mesh.face_normal(mesh.face(h));
    mesh.edges()
        .map(|e| {
            let h = mesh.halfedge(e);
            mesh.twin(h).is_some_and(|t| normal(h).dot(normal(t)) < degrees.to_radians().cos())
        })
        .collect()
}

pub(super) fn graph_with(mesh: TriMesh, options: &ElasticaOptions) -> ElasticaGraph {
    let sharp = sharp_edges(&mesh, 50.0);
    let curvature = principal_curvature(&mesh, 0.03, &sharp);
    ElasticaGraph::build(Arc::new(mesh), &curvature, &sharp, options, &Progress::new()).unwrap()
}

pub(super) fn graph(mesh: TriMesh) -> ElasticaGraph {
    graph_with(mesh, &ElasticaOptions::default())
}

/// At most `count` vertices, spread over the mesh.
pub(super) fn sample(graph: &ElasticaGraph, count: usize) -> impl Iterator<Item = VertexId> + use<> {
    let n = graph.mesh().n_vertices();
    (0..count.min(n)).map(move |i| VertexId::new((i * 7919 + 13) % n))
}

/// Closes the directions equivalent to a curve.
pub(super) fn close_along(graph: &ElasticaGraph, curve: &SurfaceCurve, mask: &mut DirectionMask) {
    let n = curve.crossings.len();
    for i in usize::from(!curve.closed)..n {
        let along = curve.point(graph.mesh(), i) - curve.point(graph.mesh(), (i + n - 1) % n);
        graph.close_near(mask, curve.face_before(graph.mesh(), i).unwrap(), along, 45f64.to_radians());
    }
}

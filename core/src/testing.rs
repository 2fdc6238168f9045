//! Small meshes and curves for tests, and the research meshes beside the repository.

use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::mesh::{HalfedgeId, LoadedMesh, TriMesh, load};
use crate::surface::{Crossing, SurfaceCurve};

/// Reports that a test or a part of one is skipped, and why.
///
/// # Panics
///
/// If the environment variable `PLAIT_TEST_ALL` is set: then nothing may be skipped.
pub(crate) fn skip(reason: &str) {
    assert!(std::env::var_os("PLAIT_TEST_ALL").is_none(), "PLAIT_TEST_ALL is set, but {reason}");
    eprintln!("skipped: {reason}");
}

/// The folder of research meshes: `PLAIT_MESHES`, or `shared/meshes` beside the repository; else [`skip`].
pub(crate) fn research_meshes() -> Option<PathBuf> {
    let folder = std::env::var_os("PLAIT_MESHES")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/meshes"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    skip(&format!("there is no folder {}", folder.display()));
    None
}

/// A research mesh as it is loaded, normalised by its bounding box; where it is missing, [`skip`].
pub(crate) fn research_mesh(file: &str) -> Option<LoadedMesh> {
    let path = research_meshes()?.join(file);
    if path.is_file() {
        return Some(load(&path).expect("a research mesh can be read"));
    }
    skip(&format!("there is no {}", path.display()));
    None
}

/// A grid of `n` × `m` cells of two triangles each, closed or open in each direction; `map` takes the fractions of both
/// directions to positions. Cell `(i, j)` has faces `2 (j n + i)` and the next one.
pub(crate) fn grid(n: u32, m: u32, closed: [bool; 2], map: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let (columns, rows) = (n + u32::from(!closed[0]), m + u32::from(!closed[1]));
    let mut positions = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            positions.push(map(f64::from(i) / f64::from(n), f64::from(j) / f64::from(m)));
        }
    }
    let at = |i: u32, j: u32| (j % rows) * columns + i % columns;
    let mut faces = Vec::new();
    for j in 0..m {
        for i in 0..n {
            faces.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            faces.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    TriMesh::from_faces(positions, &faces).expect("a grid is a manifold")
}

/// A torus of radii 0.3 and 0.1 as a closed grid.
pub(crate) fn torus(n: u32, m: u32) -> TriMesh {
    grid(n, m, [true, true], |u, v| {
        let (a, b) = (TAU * u, TAU * v);
        let r = 0.3 + 0.1 * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), 0.1 * b.sin())
    })
}

/// A flat unit square as an open grid.
pub(crate) fn square(n: u32) -> TriMesh {
    grid(n, n, [false, false], |u, v| DVec3::new(u, v, 0.0))
}

/// The curve along row `j` of a [`grid`], at fraction `t` of the row's height.
pub(crate) fn row(n: u32, j: u32, closed: bool, t: f64) -> SurfaceCurve {
    let mut crossings = Vec::new();
    if !closed {
        crossings.push(Crossing { halfedge: HalfedgeId(3 * (2 * j * n + 1) + 2), t: 1.0 - t });
    }
    for i in 0..n {
        let cell = 2 * (j * n + i);
        crossings.push(Crossing { halfedge: HalfedgeId(3 * (cell + 1)), t });
        crossings.push(Crossing { halfedge: HalfedgeId(3 * cell + 1), t });
    }
    SurfaceCurve { crossings, closed }
}

/// The curve along column `i` of a [`grid`] of `n` × `m` cells, at fraction `t` of the column's width.
pub(crate) fn column(n: u32, m: u32, i: u32, closed: bool, t: f64) -> SurfaceCurve {
    let mut crossings = Vec::new();
    if !closed {
        crossings.push(Crossing { halfedge: HalfedgeId(3 * (2 * i)), t });
    }
    for j in 0..m {
        let cell = 2 * (j * n + i);
        crossings.push(Crossing { halfedge: HalfedgeId(3 * cell + 2), t: 1.0 - t });
        crossings.push(Crossing { halfedge: HalfedgeId(3 * (cell + 1) + 1), t: 1.0 - t });
    }
    SurfaceCurve { crossings, closed }
}

/// The closed curve parallel to the diagonals of a closed [`grid`] of `n` × `n` cells, beside the main diagonal.
pub(crate) fn diagonal(n: u32) -> SurfaceCurve {
    let beside = |i: u32| {
        let cell = 2 * (i * n + i);
        let next = 2 * (i * n + (i + 1) % n);
        [
            Crossing { halfedge: HalfedgeId(3 * cell + 1), t: 0.5 },
            Crossing { halfedge: HalfedgeId(3 * next + 4), t: 0.5 },
        ]
    };
    SurfaceCurve { crossings: (0..n).flat_map(beside).collect(), closed: true }
}

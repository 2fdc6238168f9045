//! Shapes for tests of fields and maps. Their symmetric curves run along edges.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::mesh::{EdgeId, TriMesh};

/// A thin torus of `n` steps around and `m` steps across; vertex `(i, j)` is number `i m + j`. (On a thick torus the smoothest
/// field has singularities.)
pub(crate) fn torus(n: u32, m: u32) -> TriMesh {
    let at = |i: u32, j: u32| {
        let (a, b) = (turn(i, n), turn(j, m));
        let r = 0.4 + 0.06 * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), 0.06 * b.sin())
    };
    let positions = (0..n * m).map(|k| at(k / m, k % m)).collect();
    let quads = (0..n * m).map(|k| {
        let (i, j) = (k / m, k % m);
        let id = |i: u32, j: u32| (i % n) * m + j % m;
        [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)]
    });
    TriMesh::from_faces(positions, &split(quads)).unwrap()
}

/// A flat ring of `n` steps around and `m` steps from radius 0.2 to 0.5; vertex `(i, j)` is number `i (m + 1) + j`.
pub(crate) fn ring(n: u32, m: u32) -> TriMesh {
    let at = |i: u32, j: u32| {
        let r = 0.2 + 0.3 * f64::from(j) / f64::from(m);
        DVec3::new(r * turn(i, n).cos(), r * turn(i, n).sin(), 0.0)
    };
    let positions = (0..n * (m + 1)).map(|k| at(k / (m + 1), k % (m + 1))).collect();
    let quads = (0..n * m).map(|k| {
        let (i, j) = (k / m, k % m);
        let id = |i: u32, j: u32| (i % n) * (m + 1) + j;
        [id(i, j), id(i, j + 1), id(i + 1, j + 1), id(i + 1, j)]
    });
    TriMesh::from_faces(positions, &split(quads)).unwrap()
}

fn turn(i: u32, n: u32) -> f64 {
    std::f64::consts::TAU * f64::from(i) / f64::from(n)
}

fn split(quads: impl Iterator<Item = [u32; 4]>) -> Vec<[u32; 3]> {
    quads.flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

/// The boundary surface of the cells `solid` of a cubic lattice, with `n` steps along a cell's edge.
pub(crate) fn cells(solid: &[[i32; 3]], n: i32) -> TriMesh {
    let inside = |c: [i32; 3]| solid.contains(&c);
    let mut ids = BTreeMap::new();
    let mut quads = Vec::new();
    for &c in solid {
        for axis in 0..3 {
            for side in [0, 1] {
                let mut over = c;
                over[axis] += 2 * side - 1;
                if inside(over) {
                    continue;
                }
                let (p, q) =
                    if side == 1 { ((axis + 1) % 3, (axis + 2) % 3) } else { ((axis + 2) % 3, (axis + 1) % 3) };
                for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
                    quads.push([(0, 0), (1, 0), (1, 1), (0, 1)].map(|(a, b)| {
                        let mut x = c.map(|x| x * n);
                        x[axis] += side * n;
                        x[p] += i + a;
                        x[q] += j + b;
                        let next = ids.len() as u32;
                        *ids.entry(x).or_insert(next)
                    }));
                }
            }
        }
    }
    let mut positions = vec![DVec3::ZERO; ids.len()];
    for (x, &id) in &ids {
        positions[id as usize] = DVec3::from_array(x.map(f64::from)) * (0.2 / f64::from(n));
    }
    TriMesh::from_faces(positions, &split(quads.into_iter())).unwrap()
}

/// A plate with `holes` holes: genus `holes`.
pub(crate) fn plate(holes: i32, n: i32) -> TriMesh {
    let solid: Vec<[i32; 3]> =
        (0..3 * (2 * holes + 1)).map(|k| [k / 3, k % 3, 0]).filter(|c| !(c[0] % 2 == 1 && c[1] == 1)).collect();
    cells(&solid, n)
}

/// A sphere, made from an octahedron with `n` steps along an edge; its three coordinate circles are edge paths.
pub(crate) fn octasphere(n: i32) -> TriMesh {
    let mut ids: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    let mut faces = Vec::new();
    for k in 0..8 {
        let sign = [0, 1, 2].map(|axis| if (k >> axis) & 1 == 0 { 1 } else { -1 });
        let even = sign.iter().product::<i32>() > 0;
        let mut id = |a: i32, b: i32| {
            let x = [a * sign[0], b * sign[1], (n - a - b) * sign[2]];
            let next = ids.len() as u32;
            *ids.entry(x).or_insert(next)
        };
        let mut add = |t: [u32; 3]| faces.push(if even { t } else { [t[0], t[2], t[1]] });
        for a in 0..n {
            for b in 0..n - a {
                add([id(a, b), id(a + 1, b), id(a, b + 1)]);
                if a + b + 1 < n {
                    add([id(a + 1, b), id(a + 1, b + 1), id(a, b + 1)]);
                }
            }
        }
    }
    let mut positions = vec![DVec3::ZERO; ids.len()];
    for (x, &id) in &ids {
        positions[id as usize] = DVec3::from_array(x.map(f64::from)).normalize() * 0.3;
    }
    TriMesh::from_faces(positions, &faces).unwrap()
}

/// The edge between two vertices.
pub(crate) fn edge_between(mesh: &TriMesh, a: u32, b: u32) -> EdgeId {
    let ends = |e: EdgeId| mesh.edge_vertices(e).map(|v| v.0);
    mesh.edges().find(|&e| ends(e) == [a, b] || ends(e) == [b, a]).unwrap()
}

/// Gives the edges whose two ends satisfy `on` the curve number `curve`.
pub(crate) fn mark(mesh: &TriMesh, curves: &mut Vec<Option<u32>>, curve: u32, on: impl Fn(DVec3) -> bool) {
    curves.resize(mesh.n_edges(), None);
    for e in mesh.edges() {
        if mesh.edge_vertices(e).iter().all(|&v| on(mesh.position(v))) {
            curves[e.index()] = Some(curve);
        }
    }
}

/// The mesh and its curves after `count` pseudo-random edge splits close to an end.
pub(crate) fn slivers(mesh: &TriMesh, curves: &[Option<u32>], count: usize) -> (TriMesh, Vec<Option<u32>>) {
    let mut positions = mesh.positions().to_vec();
    let mut faces: Vec<[u32; 3]> = mesh.faces().map(|f| mesh.face_vertices(f).map(|v| v.0)).collect();
    let key = |a: u32, b: u32| (a.min(b), a.max(b));
    let mut of: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for e in mesh.edges() {
        if let Some(c) = curves[e.index()] {
            let [a, b] = mesh.edge_vertices(e);
            of.insert(key(a.0, b.0), c);
        }
    }
    let mut state = 12345u64;
    for _ in 0..count {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let f = (state >> 33) as usize % faces.len();
        let i = (state >> 20) as usize % 3;
        let t = if (state >> 25) & 1 == 0 { 0.05 } else { 0.95 };
        let (a, b) = (faces[f][i], faces[f][(i + 1) % 3]);
        let m = positions.len() as u32;
        positions.push(positions[a as usize].lerp(positions[b as usize], t));
        for k in 0..faces.len() {
            if let Some(j) = (0..3).find(|&j| key(faces[k][j], faces[k][(j + 1) % 3]) == key(a, b)) {
                let [p, q, r] = [faces[k][j], faces[k][(j + 1) % 3], faces[k][(j + 2) % 3]];
                faces[k] = [p, m, r];
                faces.push([m, q, r]);
            }
        }
        if let Some(c) = of.remove(&key(a, b)) {
            of.insert(key(a, m), c);
            of.insert(key(m, b), c);
        }
    }
    let mesh = TriMesh::from_faces(positions, &faces).unwrap();
    let of_edge = |e: EdgeId| {
        let [a, b] = mesh.edge_vertices(e);
        of.get(&key(a.0, b.0)).copied()
    };
    let curves = mesh.edges().map(of_edge).collect();
    (mesh, curves)
}

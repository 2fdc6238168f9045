//! Sample meshes for the tests of this module, with exact seamless maps and layouts whose arcs are isolines of them.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use crate::embed::trace::isolines::corner_uv;
use crate::embed::trace::separatrix_matching::ArcChain;
use crate::layout::{Arc, Node, Patch, QuadLayout};
use crate::mesh::{Dijkstra, FaceId, HalfedgeId, TriMesh, VertexId};
use crate::param::{SeamlessMap, Transition, turn};

/// Pseudo-random numbers from −1 to 1.
pub(super) struct Noise(pub u64);

impl Noise {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A mesh with a map, and a layout on it.
pub(super) struct Sample {
    pub mesh: TriMesh,
    pub map: SeamlessMap,
    pub layout: QuadLayout,
    pub nodes: Vec<VertexId>,
    pub chains: Vec<OwnedChain>,
}

/// An [`ArcChain`] that owns its crossings.
pub(super) struct OwnedChain {
    pub start: HalfedgeId,
    pub crossed: Vec<HalfedgeId>,
    pub end: HalfedgeId,
    pub heading: u8,
}

impl Sample {
    pub(super) fn chains(&self) -> Vec<ArcChain<'_>> {
        let chain = |c: &'_ OwnedChain| (c.start, c.end, c.heading);
        let borrowed = |c| {
            let (start, end, heading) = chain(c);
            ArcChain { start, crossed: &c.crossed, end, heading }
        };
        self.chains.iter().map(borrowed).collect()
    }
}

/// The map with these coordinates, the chart of each triangle rotated by random quarter turns and translated.
pub(super) fn seamless(mesh: &TriMesh, uv: &[[DVec2; 3]], seed: u64) -> SeamlessMap {
    let mut noise = Noise(seed);
    let scrambled = uv.iter().map(|corners| {
        let quarters = (noise.next() * 2.0 + 2.0) as i32;
        let shift = DVec2::new(noise.next(), noise.next());
        corners.map(|w| turn(w, quarters) + shift)
    });
    let uv: Vec<[DVec2; 3]> = scrambled.collect();
    let at = |h: HalfedgeId| uv[h.index() / 3][h.index() % 3];
    let jump = mesh.edges().map(|e| {
        let h = mesh.halfedge(e);
        let Some(t) = mesh.twin(h) else { return 0 };
        let (here, there) = (at(mesh.next(h)) - at(h), at(t) - at(mesh.next(t)));
        let fits = (0..4u8).filter(|&p| turn(here, -i32::from(p)).distance(there) < 1e-9 * here.length().max(1e-3));
        let list: Vec<u8> = fits.collect();
        assert_eq!(list.len(), 1, "the charts fit together");
        list[0]
    });
    let jump = jump.collect();
    SeamlessMap { uv, jump }
}

/// The layout with these quadrilaterals of nodes; two nodes must have one arc between them at most.
pub(super) fn layout(n_nodes: usize, quads: &[[u32; 4]]) -> QuadLayout {
    let mut nodes = vec![Node { valence: 0, boundary: false }; n_nodes];
    let mut arcs: Vec<Arc> = Vec::new();
    let mut ids: BTreeMap<(u32, u32), (u32, u32)> = BTreeMap::new();
    let mut patches = Vec::new();
    for &corners in quads {
        let mut sides = [(0, true); 4];
        for i in 0..4 {
            let (a, b) = (corners[i], corners[(i + 1) % 4]);
            nodes[a as usize].valence += 1;
            let entry = ids.entry((a.min(b), a.max(b))).or_insert_with(|| {
                arcs.push(Arc { nodes: [a, b], boundary: false, chord: 0 });
                (arcs.len() as u32 - 1, 0)
            });
            entry.1 += 1;
            sides[i] = (entry.0, arcs[entry.0 as usize].nodes == [a, b]);
        }
        patches.push(Patch { corners, sides });
    }
    for (arc, uses) in ids.into_values() {
        if uses == 1 {
            arcs[arc as usize].boundary = true;
            for n in arcs[arc as usize].nodes {
                nodes[n as usize].boundary = true;
            }
        }
    }
    let mut layout = QuadLayout { nodes, arcs, patches, chords: 0 };
    layout.find_chords();
    layout
}

/// A sample with a chain for each arc: a shortest chain of triangles by way of the points `via(arc)` in space.
pub(super) fn sample(
    mesh: TriMesh,
    map: SeamlessMap,
    layout: QuadLayout,
    nodes: Vec<VertexId>,
    via: impl Fn(usize) -> Vec<DVec3>,
) -> Sample {
    let chains = layout.arcs.iter().enumerate().map(|(a, arc)| {
        let [from, to] = arc.nodes.map(|n| nodes[n as usize]);
        chain(&mesh, &map, from, &via(a), to)
    });
    let chains = chains.collect();
    Sample { mesh, map, layout, nodes, chains }
}

fn chain(mesh: &TriMesh, map: &SeamlessMap, from: VertexId, via: &[DVec3], to: VertexId) -> OwnedChain {
    let middle = |f: usize| mesh.face_vertices(FaceId::new(f)).iter().map(|&v| mesh.position(v)).sum::<DVec3>() / 3.0;
    let nearest = |p: DVec3, faces: Vec<usize>| {
        faces.into_iter().min_by(|&a, &b| middle(a).distance(p).total_cmp(&middle(b).distance(p))).unwrap()
    };
    let at = |v: VertexId| mesh.outgoing(v).map(|h| h.index() / 3).collect::<Vec<_>>();
    let mut waypoints = vec![nearest(via[0], at(from))];
    waypoints.extend(via.iter().map(|&p| nearest(p, (0..mesh.n_faces()).collect())));
    waypoints.push(nearest(via[via.len() - 1], at(to)));
    let mut crossed = Vec::new();
    for leg in waypoints.windows(2) {
        crossed.extend(route(mesh, leg[0], leg[1], &middle));
    }
    let corner = |f: usize, v: VertexId| mesh.outgoing(v).find(|h| h.index() / 3 == f).unwrap();
    let (start, end) = (corner(waypoints[0], from), corner(waypoints[waypoints.len() - 1], to));
    let mut change = Transition::IDENTITY;
    for &h in &crossed {
        change = change.then(&map.transition(mesh, h).unwrap());
    }
    let uv = |h: HalfedgeId| corner_uv(map, h);
    let way = change.inverse().apply(uv(end)) - uv(start);
    let heading = (0..4u8).max_by(|&a, &b| {
        let along = |k: u8| turn(way, -i32::from(k)).x;
        along(a).total_cmp(&along(b))
    });
    OwnedChain { start, crossed, end, heading: heading.unwrap() }
}

/// The half-edges crossed on the shortest chain from one triangle to another, measured between centroids.
fn route(mesh: &TriMesh, from: usize, to: usize, middle: &impl Fn(usize) -> DVec3) -> Vec<HalfedgeId> {
    let (from, to) = (FaceId::new(from), FaceId::new(to));
    let mut search = Dijkstra::new(mesh.n_faces());
    search.start(from, 0.0);
    while let Some((f, distance)) = search.settle() {
        for (h, g) in mesh.adjacent_faces(f) {
            search.reach(g, distance + middle(f.index()).distance(middle(g.index())), h);
        }
    }
    search.path_to(to, |&h| mesh.face(h)).unwrap()
}

/// A vertex of a mesh at a point.
pub(super) fn vertex_at(mesh: &TriMesh, p: DVec3) -> VertexId {
    mesh.vertices().find(|&v| mesh.position(v).distance(p) < 1e-9).unwrap()
}

/// A flat unit square of `n` × `n` cells with `k` × `k` patches; vertices inside patches and on arcs inside the square
/// are moved by up to `shake` cells, those on the boundary along it.
pub(super) fn square(n: u32, k: u32, shake: f64) -> Sample {
    let mut noise = Noise(7);
    let step = 1.0 / f64::from(n);
    let at = |i: u32, j: u32| DVec2::new(f64::from(i), f64::from(j)) * step;
    let mut place = BTreeMap::new();
    for j in 0..=n {
        for i in 0..=n {
            let keep = [i, j].map(|x| x == 0 || x == n);
            let node = i % (n / k) == 0 && j % (n / k) == 0;
            let mut by = DVec2::new(noise.next(), noise.next()) * shake * step;
            by = DVec2::new(if keep[0] || node { 0.0 } else { by.x }, if keep[1] || node { 0.0 } else { by.y });
            place.insert((i, j), at(i, j) + by);
        }
    }
    let index = |x: f64| (x * f64::from(n)).round() as u32;
    let mesh = crate::testing::grid(n, n, [false, false], |u, v| place[&(index(u), index(v))].extend(0.0));
    let uv: Vec<[DVec2; 3]> =
        mesh.faces().map(|f| mesh.face_vertices(f).map(|v| mesh.position(v).truncate())).collect();
    let map = seamless(&mesh, &uv, 3);
    let id = |i: u32, j: u32| j * (k + 1) + i;
    let quads: Vec<[u32; 4]> = (0..k * k)
        .map(|c| (c % k, c / k))
        .map(|(i, j)| [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)])
        .collect();
    let layout = layout(((k + 1) * (k + 1)) as usize, &quads);
    let point = |n: u32| DVec2::new(f64::from(n % (k + 1)), f64::from(n / (k + 1))).extend(0.0) / f64::from(k);
    let nodes = (0..(k + 1) * (k + 1)).map(|n| vertex_at(&mesh, point(n))).collect();
    let middles: Vec<DVec3> = layout.arcs.iter().map(|a| 0.5 * (point(a.nodes[0]) + point(a.nodes[1]))).collect();
    sample(mesh, map, layout, nodes, |a| vec![middles[a]])
}

/// A torus of 5 `n` × 5 `n` cells with a layout of five square patches whose arcs run in the directions (2, 1) and
/// (−1, 2) of the grid.
pub(super) fn slanted_torus(n: u32, shake: f64) -> Sample {
    let cells = 5 * n;
    let mut noise = Noise(11);
    let is_node = |i: u32, j: u32| (0..5).any(|s| (i, j) == ((2 * s * n) % cells, (s * n) % cells));
    let mut place = BTreeMap::new();
    for (i, j) in (0..cells * cells).map(|c| (c % cells, c / cells)) {
        let by = DVec2::new(noise.next(), noise.next()) * if is_node(i, j) { 0.0 } else { shake };
        place.insert((i, j), (DVec2::new(f64::from(i), f64::from(j)) + by) / f64::from(n));
    }
    let on_torus = |w: DVec2| {
        let (a, b) = (std::f64::consts::TAU * w.x / 5.0, std::f64::consts::TAU * w.y / 5.0);
        let r = 0.3 + 0.1 * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), 0.1 * b.sin())
    };
    let index = |x: f64| (x * f64::from(cells)).round() as u32;
    let mesh = crate::testing::grid(cells, cells, [true, true], |u, v| on_torus(place[&(index(u), index(v))]));
    // Faces of the grid come cell by cell, so that corners can be continued beyond the seam.
    let slant = |w: DVec2| DVec2::new(2.0 * w.x + w.y, 2.0 * w.y - w.x) / 5f64.sqrt();
    let uv: Vec<[DVec2; 3]> = (0..cells * cells)
        .flat_map(|c| {
            let corner = |(di, dj): (u32, u32)| {
                let (i, j) = (c % cells + di, c / cells + dj);
                let over = DVec2::new(f64::from(i / cells), f64::from(j / cells)) * 5.0;
                slant(place[&(i % cells, j % cells)] + over)
            };
            [[(0, 0), (1, 0), (1, 1)].map(corner), [(0, 0), (1, 1), (0, 1)].map(corner)]
        })
        .collect();
    let map = seamless(&mesh, &uv, 5);
    let point = |k: u32| DVec2::new(f64::from(2 * k % 5), f64::from(k % 5));
    // From node k the direction (2, 1) leads to node k + 1 and (−1, 2) to node k + 2.
    let quads: Vec<[u32; 4]> = (0..5).map(|k| [k, (k + 1) % 5, (k + 3) % 5, (k + 2) % 5]).collect();
    let layout = layout(5, &quads);
    let nodes = (0..5).map(|k| vertex_at(&mesh, on_torus(point(k)))).collect();
    let middles: Vec<Vec<DVec3>> = layout
        .arcs
        .iter()
        .map(|a| {
            let by = match (a.nodes[1] + 5 - a.nodes[0]) % 5 {
                1 => DVec2::new(2.0, 1.0),
                2 => DVec2::new(-1.0, 2.0),
                3 => DVec2::new(1.0, -2.0),
                _ => DVec2::new(-2.0, -1.0),
            };
            (1..8).map(|i| on_torus(point(a.nodes[0]) + by * (f64::from(i) / 8.0))).collect()
        })
        .collect();
    sample(mesh, map, layout, nodes, |a| middles[a].clone())
}

/// The surface of unit cubes at lattice points `solid`, with `n` steps along an edge of a cube; +u runs in the
/// direction `along` on every side. Vertices are moved by up to `shake` steps inside the sides of cubes and along their
/// edges; midpoints of sides and edges stay.
pub(super) fn polycube_map(solid: &[[i32; 3]], n: i32, shake: f64, along: DVec2, seed: u64) -> (TriMesh, SeamlessMap) {
    let plain = crate::field::samples::cells(solid, n);
    let mut noise = Noise(seed);
    let step = 1.0 / f64::from(n);
    let positions: Vec<DVec3> = plain
        .positions()
        .iter()
        .map(|p| {
            let p = *p * 5.0;
            let half = p.to_array().iter().all(|x| ((2.0 * x).round() - 2.0 * x).abs() < 1e-9);
            let by = p.to_array().map(|x| if half || (x.round() - x).abs() < 1e-9 { 0.0 } else { shake * step });
            p + DVec3::from_array(by) * DVec3::new(noise.next(), noise.next(), noise.next())
        })
        .collect();
    let faces: Vec<[u32; 3]> = plain.faces().map(|f| plain.face_vertices(f).map(|v| v.0)).collect();
    let mesh = TriMesh::from_faces(positions, &faces).unwrap();
    let uv: Vec<[DVec2; 3]> = mesh
        .faces()
        .map(|f| {
            let normal = mesh.face_normal(f);
            let x = if normal.x.abs() > 0.5 { DVec3::Y } else { DVec3::X };
            let y = normal.cross(x);
            mesh.face_vertices(f).map(|v| {
                let p = mesh.position(v);
                DVec2::new(along.x, -along.y).rotate(DVec2::new(p.dot(x), p.dot(y)))
            })
        })
        .collect();
    let map = seamless(&mesh, &uv, seed + 1);
    (mesh, map)
}

/// [`polycube_map`] of one cube.
pub(super) fn cube_map(n: i32, shake: f64, along: DVec2) -> (TriMesh, SeamlessMap) {
    polycube_map(&[[0, 0, 0]], n, shake, along, 17)
}

/// The layout of all sides of the cubes `solid` that face outwards, and its nodes as lattice points.
fn lattice_layout(solid: &[[i32; 3]]) -> (QuadLayout, Vec<DVec3>) {
    let mut ids: BTreeMap<[i32; 3], u32> = BTreeMap::new();
    let mut points: Vec<DVec3> = Vec::new();
    let mut quads = Vec::new();
    for (&cell, axis, side) in solid.iter().flat_map(|c| (0..6).map(move |k| (c, k / 2, k % 2))) {
        let mut over = cell;
        over[axis] += 2 * side as i32 - 1;
        if solid.contains(&over) {
            continue;
        }
        let (p, q) = if side == 1 { ((axis + 1) % 3, (axis + 2) % 3) } else { ((axis + 2) % 3, (axis + 1) % 3) };
        quads.push([(0, 0), (1, 0), (1, 1), (0, 1)].map(|(a, b)| {
            let mut x = cell;
            x[axis] += side as i32;
            x[p] += a;
            x[q] += b;
            *ids.entry(x).or_insert_with(|| {
                points.push(DVec3::from_array(x.map(f64::from)));
                points.len() as u32 - 1
            })
        }));
    }
    (layout(points.len(), &quads), points)
}

/// The sample of a mesh and the layout of the outward sides of the cubes `solid`, of side `scale`.
fn lattice_sample((mesh, map): (TriMesh, SeamlessMap), solid: &[[i32; 3]], scale: f64) -> Sample {
    let (layout, points) = lattice_layout(solid);
    let points: Vec<DVec3> = points.into_iter().map(|p| p * scale).collect();
    let nodes = points.iter().map(|&p| vertex_at(&mesh, p)).collect();
    let middles: Vec<DVec3> =
        layout.arcs.iter().map(|a| 0.5 * (points[a.nodes[0] as usize] + points[a.nodes[1] as usize])).collect();
    sample(mesh, map, layout, nodes, |a| vec![middles[a]])
}

/// A cube with `k` × `k` patches on each side, `k` 1 or 2.
pub(super) fn cube(n: i32, k: i32, shake: f64) -> Sample {
    let solid: Vec<[i32; 3]> = (0..k * k * k).map(|c| [c % k, c / k % k, c / (k * k)]).collect();
    lattice_sample(cube_map(n, shake, DVec2::X), &solid, 1.0 / f64::from(k))
}

/// Columns of unit cubes side by side, with a patch on each side of a cube: its map is an integer-grid map.
pub(super) fn skyline(heights: &[i32], n: i32, shake: f64, seed: u64) -> Sample {
    let solid: Vec<[i32; 3]> = (0..).zip(heights).flat_map(|(i, &h)| (0..h).map(move |k| [i, 0, k])).collect();
    lattice_sample(polycube_map(&solid, n, shake, DVec2::X, seed), &solid, 1.0)
}

/// The vertices of a disc of `k` unit squares of `n` × `n` cells around a point. Vertex `(i, j)` of sector `s`; those
/// between two sectors belong to the sector that begins there, on its u-axis.
struct ConeGrid {
    k: u32,
    n: u32,
    ids: BTreeMap<(u32, u32, u32), u32>,
    keys: Vec<(u32, u32, u32)>,
    /// Coordinates in the vertex's own sector.
    place: Vec<DVec2>,
}

impl ConeGrid {
    fn new(k: u32, n: u32, shake: f64) -> Self {
        let mut noise = Noise(23);
        let mut grid = Self { k, n, ids: BTreeMap::new(), keys: Vec::new(), place: Vec::new() };
        for s in 0..k {
            for (i, j) in (0..(n + 1) * (n + 1)).map(|c| (c % (n + 1), c / (n + 1))) {
                let key = grid.key(s, i, j);
                if grid.ids.contains_key(&key) {
                    continue;
                }
                grid.ids.insert(key, grid.keys.len() as u32);
                grid.keys.push(key);
                let fixed = [key.1, key.2].map(|x| x == n || key.1 == 0 && key.2 == 0);
                let end = key.1 == n && key.2 == 0;
                let by = DVec2::new(noise.next(), noise.next()) * shake;
                let by = DVec2::new(if fixed[0] || end { 0.0 } else { by.x }, if fixed[1] || end { 0.0 } else { by.y });
                grid.place.push((DVec2::new(f64::from(key.1), f64::from(key.2)) + by) / f64::from(n));
            }
        }
        grid
    }

    fn key(&self, s: u32, i: u32, j: u32) -> (u32, u32, u32) {
        match (i, j) {
            (0, 0) => (0, 0, 0),
            (0, _) => ((s + 1) % self.k, j, 0),
            _ => (s, i, j),
        }
    }

    fn position(&self, v: usize) -> DVec3 {
        let w = self.place[v];
        let sector = f64::from(self.keys[v].0) * std::f64::consts::FRAC_PI_2;
        let angle = (w.to_angle() + sector) * 4.0 / f64::from(self.k);
        (DVec2::from_angle(angle) * w.length()).extend(0.0)
    }

    /// A vertex and its coordinates in sector `s`.
    fn corner(&self, s: u32, i: u32, j: u32) -> (u32, DVec2) {
        let key = self.key(s, i, j);
        let v = self.ids[&key];
        let w = self.place[v as usize];
        (v, if key.0 != s && (i, j) != (0, 0) { turn(w, 1) } else { w })
    }

    /// The mesh, and the coordinates of its triangles' corners in the chart of their sector.
    fn mesh(&self) -> (TriMesh, Vec<[DVec2; 3]>) {
        let (mut faces, mut uv) = (Vec::new(), Vec::new());
        for s in 0..self.k {
            for (i, j) in (0..self.n * self.n).map(|c| (c % self.n, c / self.n)) {
                let quad = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| self.corner(s, i, j));
                for t in [[0, 1, 2], [0, 2, 3]] {
                    faces.push(t.map(|c| quad[c].0));
                    uv.push(t.map(|c| quad[c].1));
                }
            }
        }
        let positions = (0..self.keys.len()).map(|v| self.position(v)).collect();
        (TriMesh::from_faces(positions, &faces).unwrap(), uv)
    }
}

/// A disc of `k` unit squares of `n` × `n` cells around one vertex, each a patch.
pub(super) fn cone(k: u32, n: u32, shake: f64) -> Sample {
    let grid = ConeGrid::new(k, n, shake);
    let (mesh, uv) = grid.mesh();
    let map = seamless(&mesh, &uv, 29);
    let quads: Vec<[u32; 4]> = (0..k).map(|s| [0, 1 + s, 1 + k + s, 1 + (s + 1) % k]).collect();
    let layout = layout(1 + 2 * k as usize, &quads);
    let mut nodes = vec![VertexId(grid.ids[&(0, 0, 0)])];
    nodes.extend((0..k).map(|s| VertexId(grid.ids[&(s, n, 0)])));
    nodes.extend((0..k).map(|s| VertexId(grid.ids[&(s, n, n)])));
    let middles: Vec<DVec3> = layout
        .arcs
        .iter()
        .map(|a| 0.5 * (mesh.position(nodes[a.nodes[0] as usize]) + mesh.position(nodes[a.nodes[1] as usize])))
        .collect();
    sample(mesh, map, layout, nodes, |a| vec![middles[a]])
}

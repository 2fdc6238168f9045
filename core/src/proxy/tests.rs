//! Tests of the simplification, the map and the transfer of curves.

use std::f64::consts::TAU;
use std::sync::{Arc, LazyLock};

use glam::DVec3;
use proptest::prelude::*;

use super::build::ProxyError;
use super::collapse::Simplifier;
use super::map::Proxy;
use super::triangle_shape::{equilateral_length, roundness};
use super::vertex_kinds::{VertexKind, vertex_kinds, vertex_normals};
use crate::mesh::{
    FaceId, HalfedgeId, SHARP_DIHEDRAL, SHORT_FEATURE, Topology, TriMesh, VertexId, builtin, drop_short_features,
    sharp_edges,
};
use crate::progress::{Cancelled, Progress};
use crate::surface::testing::{Random, dual_cycle, real_mesh};
use crate::surface::{Crossing, RelaxOptions, SurfaceCurve, SurfaceIndex, SurfacePoint, relax};
use crate::testing::{column, grid, row, square, torus};

fn features(mesh: &TriMesh) -> Vec<bool> {
    let mut sharp = sharp_edges(mesh, SHARP_DIHEDRAL);
    drop_short_features(mesh, &mut sharp, SHORT_FEATURE);
    sharp
}

/// Genus and number of boundary loops of each component.
fn topology(mesh: &TriMesh) -> Vec<(usize, usize)> {
    Topology::new(mesh).components.iter().map(|c| (c.genus(), c.boundary_loops.len())).collect()
}

/// A proxy, after checks of the properties that every proxy has.
fn proxy_of(mesh: &TriMesh, target: usize) -> Proxy {
    let sharp = features(mesh);
    let proxy = Proxy::new(mesh, &sharp, target, &Progress::new()).unwrap();
    let q = proxy.mesh();
    assert_eq!(topology(mesh), topology(q));
    for v in q.vertices() {
        let o = proxy.original_vertex(v);
        assert_eq!((q.position(v), proxy.image_positions()[o.index()]), (mesh.position(o), mesh.position(o)));
    }
    let kept: Vec<VertexId> = q.vertices().map(|v| proxy.original_vertex(v)).collect();
    let kinds = vertex_kinds(mesh, &sharp);
    for v in mesh.vertices() {
        if kinds[v.index()] == VertexKind::Corner {
            assert!(kept.binary_search(&v).is_ok(), "corner {v:?} was removed");
        }
        if kinds[v.index()] == VertexKind::Crease {
            // The image of a crease vertex is on an edge that is a feature or boundary.
            let p = proxy.image(v);
            let sides = q.face_halfedges(p.face);
            let on = |i: usize| q.twin(sides[i]).is_none() || proxy.sharp()[q.edge(sides[i]).index()];
            let near = (0..3).any(|i| p.weights[(i + 2) % 3] < 1e-9 && on(i));
            assert!(near || kept.binary_search(&v).is_ok(), "{v:?} left its crease: {p:?}");
        }
    }
    proxy
}

/// Largest distance of the original's vertices from the proxy and of the proxy's triangle centres from the original.
fn hausdorff(mesh: &TriMesh, proxy: &Proxy) -> f64 {
    let q = proxy.mesh();
    let (there, back) = (SurfaceIndex::new(q), SurfaceIndex::new(mesh));
    let out = mesh.positions().iter().map(|&p| there.nearest(p).position(q).distance(p));
    let centre = |face| SurfacePoint { face, weights: [1.0 / 3.0; 3] }.position(q);
    let home = q.faces().map(|f| back.nearest(centre(f)).position(mesh).distance(centre(f)));
    out.chain(home).fold(0.0, f64::max)
}

fn mean_edge(mesh: &TriMesh) -> f64 {
    mesh.edges().map(|e| mesh.edge_length(e)).sum::<f64>() / mesh.n_edges() as f64
}

/// Fraction of triangles rounder than 0.6 (smallest angle about 25°), and the spread of edge lengths over their mean.
fn shape_statistics(mesh: &TriMesh) -> (f64, f64) {
    let round = |f: &FaceId| roundness(mesh.face_vertices(*f).map(|v| mesh.position(v))) > 0.6;
    let mean = mean_edge(mesh);
    let spread = mesh.edges().map(|e| (mesh.edge_length(e) / mean - 1.0).powi(2)).sum::<f64>() / mesh.n_edges() as f64;
    (mesh.faces().filter(round).count() as f64 / mesh.n_faces() as f64, spread.sqrt())
}

#[test]
fn built_in_models_keep_their_topology_and_get_triangles_of_even_size() {
    for (name, target) in [("pretzel", 1600), ("sleeve", 1200), ("rounded-cube", 1500), ("creature", 2500)] {
        let mesh = builtin(name).unwrap().mesh;
        let proxy = proxy_of(&mesh, target);
        let n = proxy.mesh().n_faces();
        assert!(n <= target && n + 2 >= target, "{name}: {n}");
        let (round, spread) = shape_statistics(proxy.mesh());
        assert!(round > 0.95 && spread < 0.3, "{name}: {round} {spread}");
        let off = hausdorff(&mesh, &proxy) / mean_edge(proxy.mesh());
        assert!(off < 0.3, "{name}: {off}");
    }
}

#[test]
fn degrees_and_spokes_stay_correct() {
    for name in ["pretzel", "sleeve"] {
        let mesh = builtin(name).unwrap().mesh;
        let sharp = features(&mesh);
        let (kinds, normals) = (vertex_kinds(&mesh, &sharp), vertex_normals(&mesh));
        let mut work = Simplifier::new(&mesh, &sharp, kinds, &normals, equilateral_length(&mesh, 1500));
        work.reduce(1500, &Progress::new()).unwrap();
        work.improve(2, &Progress::new()).unwrap();
        for v in (0..mesh.n_vertices() as u32).filter(|&v| work.mesh.has_vertex(v)) {
            let mut n = 0;
            work.mesh.for_neighbours(v, |_| n += 1);
            assert_eq!((work.mesh.degree(v), work.mesh.origin(work.mesh.spoke(v))), (n, v), "{name}");
        }
    }
}

#[test]
fn a_small_mesh_is_its_own_proxy() {
    let mesh = torus(20, 10);
    let proxy = proxy_of(&mesh, 1000);
    assert_eq!(proxy.mesh().n_faces(), mesh.n_faces());
    assert!(mesh.vertices().all(|v| proxy.image_positions()[v.index()] == mesh.position(v)));
}

#[test]
fn a_straight_crease_and_boundary_stay_straight() {
    let roof = grid(60, 60, [false, false], |u, v| DVec3::new(u, v, 0.6 - (u - 0.5).abs()) / 1.6);
    let proxy = proxy_of(&roof, 800);
    let q = proxy.mesh();
    let ridge: f64 = q.edges().filter(|e| proxy.sharp()[e.index()]).map(|e| q.edge_length(e)).sum();
    assert!((ridge - 1.0 / 1.6).abs() < 1e-9, "{ridge}");
    assert!(hausdorff(&roof, &proxy) < 1e-9);
    assert!(shape_statistics(q).0 > 0.9);
}

#[test]
fn a_wrong_number_of_flags_and_cancellation_are_errors() {
    let mesh = square(10);
    let progress = Progress::new();
    let wrong = Proxy::new(&mesh, &[], 50, &progress).err();
    assert_eq!(wrong, Some(ProxyError::Sharp { given: 0, edges: mesh.n_edges() }));
    progress.cancel();
    let stopped = Proxy::new(&mesh, &features(&mesh), 50, &progress).err();
    assert_eq!(stopped, Some(ProxyError::Cancelled(Cancelled)));
}

#[test]
fn a_mesh_that_cannot_be_simplified_is_kept() {
    // No edge of a tetrahedron or of a single triangle can be collapsed.
    let p = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let smooth = |mesh: &TriMesh| Proxy::new(mesh, &vec![false; mesh.n_edges()], 1, &Progress::new()).unwrap();
    let tetrahedron = TriMesh::from_faces(p.to_vec(), &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]).unwrap();
    assert_eq!(smooth(&tetrahedron).mesh().n_faces(), 4);
    let triangle = TriMesh::from_faces(p[..3].to_vec(), &[[0, 1, 2]]).unwrap();
    assert_eq!(smooth(&triangle).mesh().n_faces(), 1);
    // A target that cannot be reached leaves the topology unchanged.
    let small = smooth(&torus(40, 20));
    assert_eq!(topology(small.mesh()), [(1, 0)]);
    assert!(small.mesh().n_faces() < 300);
}

/// Largest distance of a point from its round trip, from the original to the proxy and back and the other way round, in
/// mean edges of the proxy.
fn round_trips(mesh: &TriMesh, proxy: &Proxy) -> (f64, f64) {
    let q = proxy.mesh();
    let point = |face| SurfacePoint { face, weights: [0.2, 0.3, 0.5] };
    let there = mesh.faces().map(point).map(|p| {
        let back = proxy.to_original(mesh, proxy.to_proxy(mesh, p));
        back.position(mesh).distance(p.position(mesh))
    });
    let here = q.faces().map(point).map(|p| {
        let back = proxy.to_proxy(mesh, proxy.to_original(mesh, p));
        back.position(q).distance(p.position(q))
    });
    (there.fold(0.0, f64::max) / mean_edge(q), here.fold(0.0, f64::max) / mean_edge(q))
}

#[test]
fn points_return_from_a_round_trip() {
    for (name, target) in [("pretzel", 1600), ("sleeve", 1200)] {
        let mesh = builtin(name).unwrap().mesh;
        let proxy = proxy_of(&mesh, target);
        let (there, here) = round_trips(&mesh, &proxy);
        assert!(there < 0.15 && here < 0.15, "{name}: {there} {here}");
        for v in proxy.mesh().vertices() {
            let p = proxy.mesh().outgoing(v).next().unwrap();
            let mut weights = [0.0; 3];
            weights[p.index() % 3] = 1.0;
            let o = proxy.to_original(&mesh, SurfacePoint { face: proxy.mesh().face(p), weights });
            assert!(o.position(&mesh).distance(proxy.mesh().position(v)) < 1e-12);
        }
    }
}

#[test]
fn points_of_a_thin_plate_are_mapped_within_their_sheet() {
    // A flat ring of two sheets, a tenth of a proxy edge apart.
    let plate = grid(160, 80, [true, true], |u, v| {
        let r = 0.3 + 0.15 * (TAU * v).cos();
        DVec3::new(r * (TAU * u).cos(), r * (TAU * u).sin(), 0.001 * (TAU * v).sin())
    });
    let proxy = Proxy::new(&plate, &vec![false; plate.n_edges()], 4000, &Progress::new()).unwrap();
    let q = proxy.mesh();
    assert_eq!(topology(q), [(1, 0)]);
    // Off the rims, where the sheets meet.
    let inside = |p: DVec3| (p.truncate().length() - 0.3).abs() < 0.13;
    let point = |face| SurfacePoint { face, weights: [0.3, 0.3, 0.4] };
    for p in plate.faces().map(point).filter(|p| inside(p.position(&plate))) {
        let r = proxy.to_proxy(&plate, p);
        let back = proxy.to_original(&plate, r);
        let up = plate.face_normal(p.face).z;
        assert!(up * q.face_normal(r.face).z > 0.0 && up * plate.face_normal(back.face).z > 0.0);
        assert!(back.position(&plate).distance(p.position(&plate)) < 0.2 * mean_edge(q));
    }
    for p in q.faces().map(point).filter(|p| inside(p.position(q))) {
        assert!(q.face_normal(p.face).z * plate.face_normal(proxy.to_original(&plate, p).face).z > 0.0);
    }
}

/// Algebraic intersection number of two closed curves, from the order of their ends around each triangle. The second
/// curve is displaced a little along all edges, since crossings kept off a vertex may coincide.
fn intersections(mesh: &TriMesh, a: &SurfaceCurve, b: &SurfaceCurve) -> i64 {
    let segments = |curve: &SurfaceCurve, nudge: f64| -> Vec<(FaceId, f64, f64)> {
        let n = curve.crossings.len();
        let around = |h: HalfedgeId, t: f64| {
            let along = mesh.halfedge(mesh.edge(h)) == h;
            f64::from(h.0 % 3) + t + if along { nudge } else { -nudge }
        };
        let segment = |i: usize| {
            let (before, c) = (curve.crossings[(i + n - 1) % n], curve.crossings[i]);
            let entered = mesh.twin(before.halfedge).unwrap();
            (mesh.face(c.halfedge), around(entered, 1.0 - before.t), around(c.halfedge, c.t))
        };
        (0..n).map(segment).collect()
    };
    let mut others = segments(b, 1e-7);
    others.sort_by_key(|s| s.0);
    let mut sum = 0;
    for (face, from, to) in segments(a, 0.0) {
        let first = others.partition_point(|s| s.0 < face);
        // Counter-clockwise from where `a` enters to where it leaves is its right side.
        let right = |x: f64| (x - from).rem_euclid(3.0) < (to - from).rem_euclid(3.0);
        for s in others[first..].iter().take_while(|s| s.0 == face) {
            sum += i64::from(right(s.1)) - i64::from(right(s.2));
        }
    }
    sum
}

/// Relaxed random cycles on the proxy and their counterparts on the original.
fn transferred_cycles(mesh: &TriMesh, proxy: &Proxy, count: usize) -> Vec<(SurfaceCurve, SurfaceCurve)> {
    let q = proxy.mesh();
    let mut random = Random(5);
    let mut list = Vec::new();
    while list.len() < count {
        let Some(cycle) = dual_cycle(q, &mut random) else { continue };
        let Ok(relaxed) = relax(q, &cycle, &RelaxOptions::default(), &Progress::new()) else { continue };
        let there = proxy.curve_to_original(mesh, &relaxed.curve);
        let there = there.unwrap_or_else(|e| panic!("{e} ({} crossings)", relaxed.curve.crossings.len()));
        assert_eq!(there.check(mesh), Ok(()));
        list.push((relaxed.curve, there));
    }
    list
}

#[test]
fn transferred_cycles_keep_length_and_intersection_numbers() {
    for (mesh, target) in [(Arc::new(torus(150, 60)), 2500), (builtin("pretzel").unwrap().mesh, 1600)] {
        let proxy = proxy_of(&mesh, target);
        // Random cycles are mostly contractible; plane sections go around handles.
        let mut cycles = transferred_cycles(&mesh, &proxy, 10);
        for normal in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.5, -0.6, 0.2)] {
            let middle = mesh.positions().iter().sum::<DVec3>() / mesh.n_vertices() as f64;
            for curve in sections(proxy.mesh(), normal, middle.dot(normal) + 0.0123) {
                let there = proxy.curve_to_original(&mesh, &curve).unwrap();
                cycles.push((curve, there));
            }
        }
        let mut crossing = 0;
        for (a, on_original) in &cycles {
            let ratio = on_original.length(&mesh) / a.length(proxy.mesh());
            assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
            let back = proxy.curve_to_proxy(&mesh, on_original).unwrap();
            for (b, other) in &cycles {
                let number = intersections(proxy.mesh(), a, b);
                assert_eq!(number, intersections(&mesh, on_original, other));
                assert_eq!(number, intersections(proxy.mesh(), &back, b));
                crossing += usize::from(number != 0);
            }
        }
        assert!(crossing > 10, "{crossing}");
    }
}

static TORUS: LazyLock<(TriMesh, Proxy)> = LazyLock::new(|| {
    let mesh = torus(120, 48);
    let proxy = proxy_of(&mesh, 2500);
    (mesh, proxy)
});

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// A curve of the original, transferred to the proxy and back, is closed and valid and has the same homology class,
    /// told by its intersection numbers with a row and a column.
    #[test]
    fn a_curve_keeps_its_class_to_the_proxy_and_back(
        normal in prop::array::uniform3(-1.0f64..1.0).prop_map(DVec3::from_array),
        offset in -0.3f64..0.3,
    ) {
        let (mesh, proxy) = &*TORUS;
        prop_assume!(normal.length() > 0.1);
        let generators = [row(120, 3, true, 0.37), column(120, 48, 5, true, 0.61)];
        let class = |curve: &SurfaceCurve| generators.clone().map(|g| intersections(mesh, curve, &g));
        for curve in sections(mesh, normal.normalize(), offset) {
            // Curves around less than a few triangles of the proxy have no counterpart there.
            if curve.length(mesh) < 20.0 * mean_edge(proxy.mesh()) {
                continue;
            }
            let there = proxy.curve_to_proxy(mesh, &curve).unwrap();
            prop_assert_eq!((there.check(proxy.mesh()), there.closed), (Ok(()), true));
            let back = proxy.curve_to_original(mesh, &there).unwrap();
            prop_assert_eq!((back.check(mesh), back.closed), (Ok(()), true));
            prop_assert_eq!(class(&back), class(&curve));
            prop_assert!((back.length(mesh) / curve.length(mesh) - 1.0).abs() < 0.15);
        }
    }

    /// A point mapped to the proxy and back moves by a fraction of an edge at most.
    #[test]
    fn a_point_returns_from_the_proxy(face in 0u32..120 * 48 * 2, u in 0.0f64..1.0, v in 0.0f64..1.0) {
        let (mesh, proxy) = &*TORUS;
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let point = SurfacePoint { face: FaceId(face), weights: [1.0 - u - v, u, v] };
        let back = proxy.to_original(mesh, proxy.to_proxy(mesh, point));
        prop_assert!(back.position(mesh).distance(point.position(mesh)) < 0.15 * mean_edge(proxy.mesh()));
    }
}

/// The closed curves of a plane section.
fn sections(mesh: &TriMesh, normal: DVec3, offset: f64) -> Vec<SurfaceCurve> {
    let height = |v: VertexId| mesh.position(v).dot(normal) - offset;
    let rises = |h: HalfedgeId| {
        let (a, b) = (height(mesh.origin(h)), height(mesh.target(h)));
        (a < 0.0 && b >= 0.0).then(|| Crossing { halfedge: h, t: (a / (a - b)).clamp(1e-3, 1.0 - 1e-3) })
    };
    let mut seen = vec![false; mesh.n_halfedges()];
    let mut curves = Vec::new();
    for first in mesh.halfedges() {
        let (mut h, mut crossings) = (first, Vec::new());
        while let Some(c) = rises(h).filter(|_| !seen[h.index()]) {
            seen[h.index()] = true;
            crossings.push(c);
            let Some(g) = mesh.twin(h) else { break };
            h = if rises(mesh.next(g)).is_some() { mesh.next(g) } else { mesh.prev(g) };
        }
        let curve = SurfaceCurve { crossings, closed: true };
        if h == first && curve.check(mesh).is_ok() {
            curves.push(curve);
        }
    }
    curves
}

#[test]
fn smoothing_removes_relief_and_keeps_shape_and_map() {
    let (big, small) = (0.3, 0.1);
    // A torus with ripples of a wavelength of 0.03.
    let rippled = |height: f64| {
        grid(200, 80, [true, true], move |u, v| {
            let small = small + height * (60.0 * TAU * u).sin();
            let r = big + small * (TAU * v).cos();
            DVec3::new(r * (TAU * u).cos(), r * (TAU * u).sin(), small * (TAU * v).sin())
        })
    };
    let (rough, plain) = (rippled(0.003), SurfaceIndex::new(&rippled(0.0)));
    let plain_mesh = rippled(0.0);
    let mut proxy = Proxy::new(&rough, &vec![false; rough.n_edges()], rough.n_faces(), &Progress::new()).unwrap();
    let off = |proxy: &Proxy| {
        let far = proxy.mesh().positions().iter().map(|&p| plain.nearest(p).position(&plain_mesh).distance_squared(p));
        (far.sum::<f64>() / proxy.mesh().n_vertices() as f64).sqrt()
    };
    let before = off(&proxy);
    proxy.smooth(0.06);
    // The filter enlarges the tube by almost a percent, which is the remaining difference.
    assert!(off(&proxy) < 0.5 * before, "{} {before}", off(&proxy));
    let (there, here) = round_trips(&rough, &proxy);
    assert!(there < 0.01 && here < 0.01, "{there} {here}");
}

#[test]
fn a_transferred_open_curve_goes_from_boundary_to_boundary() {
    let map = |u: f64, v: f64| DVec3::new(0.2 * (TAU * u).cos(), 0.2 * (TAU * u).sin(), 0.7 * v);
    let tube = grid(120, 60, [true, false], map);
    let proxy = proxy_of(&tube, 1500);
    // On a mesh that is its own proxy a column is transferred to itself.
    let coarse = grid(24, 12, [true, false], map);
    let own = proxy_of(&coarse, 10_000);
    let curve = column(24, 12, 5, false, 0.3);
    assert_eq!(own.curve_to_original(&coarse, &curve).unwrap().check(&coarse), Ok(()));
    let q = proxy.mesh();
    let up = straight_up(q);
    let there = proxy.curve_to_original(&tube, &up).unwrap();
    assert_eq!((there.check(&tube), there.closed), (Ok(()), false));
    assert!((there.length(&tube) - 0.7).abs() < 0.02, "{}", there.length(&tube));
    let back = proxy.curve_to_proxy(&tube, &there).unwrap();
    assert_eq!((back.check(q), back.closed), (Ok(()), false));
    assert!((back.length(q) - 0.7).abs() < 0.02, "{}", back.length(q));
}

/// The curve along an upright tube from bottom to top in the plane `y = 0.031`.
fn straight_up(mesh: &TriMesh) -> SurfaceCurve {
    let height = |v: VertexId| mesh.position(v).y - 0.031;
    let meets = |h: HalfedgeId| {
        let (a, b) = (height(mesh.origin(h)), height(mesh.target(h)));
        ((a < 0.0) != (b < 0.0)).then(|| Crossing { halfedge: h, t: a / (a - b) })
    };
    let bottom = |h: &HalfedgeId| {
        let p = mesh.position(mesh.origin(*h));
        mesh.twin(*h).is_none() && p.z < 0.1 && p.x > 0.0 && meets(*h).is_some()
    };
    let first = mesh.halfedges().find(bottom).unwrap();
    let mut crossings = vec![meets(first).unwrap()];
    let mut entered = first;
    loop {
        let c = [mesh.next(entered), mesh.prev(entered)].into_iter().find_map(meets).unwrap();
        crossings.push(c);
        match mesh.twin(c.halfedge) {
            Some(g) => entered = g,
            None => return SurfaceCurve { crossings, closed: false },
        }
    }
}

#[test]
fn real_meshes_keep_their_topology_features_and_loops() {
    for (file, target) in [
        ("fandisk_14k.off", 3000),
        ("vase_open.off", 800),
        ("cad_upright_slivers.off", 1500),
        ("aqua_center.off", 3000),
        ("fertility_13k.off", 4000),
        ("rockerarm_5k.obj", 2000),
    ] {
        let Some(mesh) = real_mesh(file) else { continue };
        let proxy = proxy_of(&mesh, target);
        let off = hausdorff(&mesh, &proxy) / mean_edge(proxy.mesh());
        assert!(off < 0.35, "{file}: {off}");
        if !file.starts_with("cad") {
            let (round, spread) = shape_statistics(proxy.mesh());
            assert!(round > 0.9 && spread < 0.4, "{file}: {round} {spread}");
        }
    }
    if let Some(mesh) = real_mesh("fertility_13k.off") {
        let proxy = proxy_of(&mesh, 4000);
        for (curve, there) in transferred_cycles(&mesh, &proxy, 30) {
            assert!((there.length(&mesh) / curve.length(proxy.mesh()) - 1.0).abs() < 0.1);
        }
    }
}

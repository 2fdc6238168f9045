//! The search against plain Dijkstra, and the curves it returns, on generated and on real meshes.

mod anchored_loops;

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::TAU;
use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

use super::graph::State;
use super::search::{LoopSearch, Meter, ROUNDING, Route};
use super::*;
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::Progress;
use crate::surface::principal_curvature;
use crate::testing::grid;

/// Scales to bounding-box diagonal 1, as loading does.
fn normalised(points: Vec<DVec3>, faces: &[[u32; 3]]) -> TriMesh {
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let scale = 1.0 / low.distance(high);
    TriMesh::from_faces(points.iter().map(|p| (*p - low) * scale).collect(), faces).unwrap()
}

/// A grid of `n` by `m` quads, each cut in two, closed along the first, and along the second if so; scaled like what is
/// loaded. Vertices are numbered along the second.
fn around(n: u32, m: u32, closed: bool, point: impl Fn(f64, f64) -> DVec3) -> TriMesh {
    let mesh = grid(m, n, [closed, true], |v, u| point(u, v));
    let turned = |f| mesh.face_vertices(f).map(|v| v.0);
    let faces: Vec<[u32; 3]> = mesh.faces().map(turned).map(|[a, b, c]| [a, c, b]).collect();
    normalised(mesh.positions().to_vec(), &faces)
}

/// A torus of `n` by `m` quads.
fn torus(n: u32, m: u32) -> TriMesh {
    around(n, m, true, |u, v| {
        let (a, b) = (TAU * u, TAU * v);
        let r = 1.0 + 0.4 * b.cos();
        DVec3::new(r * a.cos(), r * a.sin(), 0.4 * b.sin())
    })
}

/// An open tube with a waist, of `n` by `m` quads.
fn tube(n: u32, m: u32) -> TriMesh {
    around(n, m, false, |u, v| {
        let (a, z) = (TAU * u, v - 0.5);
        let r = 0.2 + z * z;
        DVec3::new(r * a.cos(), r * a.sin(), 2.0 * z)
    })
}

/// An octahedron, subdivided `levels` times and drawn out to an ellipsoid.
fn ellipsoid(levels: u32, radii: DVec3) -> TriMesh {
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

/// A mesh of the test folder, if that is there.
fn real(name: &str) -> Option<TriMesh> {
    let folder = std::env::var_os("PLAIT_MESHES")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/meshes"), PathBuf::from);
    let Ok(text) = std::fs::read_to_string(folder.join(name)) else {
        eprintln!("skipped: no {name} in {}", folder.display());
        return None;
    };
    let off = name.ends_with(".off");
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    let lines = text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#') && *l != "OFF");
    let mut n_points = None;
    for line in lines {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |i: usize| words[i].parse::<f64>().unwrap();
        let index = |i: usize, base: u32| words[i].split('/').next().unwrap().parse::<u32>().unwrap() - base;
        match (off, n_points) {
            (true, None) => n_points = Some(number(0) as usize),
            (true, Some(n)) if points.len() < n => points.push(DVec3::new(number(0), number(1), number(2))),
            (true, Some(_)) => faces.push([index(1, 0), index(2, 0), index(3, 0)]),
            _ if words[0] == "v" => points.push(DVec3::new(number(1), number(2), number(3))),
            _ if words[0] == "f" => faces.push([index(1, 1), index(2, 1), index(3, 1)]),
            _ => {}
        }
    }
    Some(normalised(points, &faces))
}

fn sharp_edges(mesh: &TriMesh, degrees: f64) -> Vec<bool> {
    let normal = |h| mesh.face_normal(mesh.face(h));
    mesh.edges()
        .map(|e| {
            let h = mesh.halfedge(e);
            mesh.twin(h).is_some_and(|t| normal(h).dot(normal(t)) < degrees.to_radians().cos())
        })
        .collect()
}

fn graph_with(mesh: TriMesh, options: &ElasticaOptions) -> ElasticaGraph {
    let sharp = sharp_edges(&mesh, 50.0);
    let curvature = principal_curvature(&mesh, 0.03, &sharp);
    ElasticaGraph::build(Arc::new(mesh), &curvature, &sharp, options, &Progress::new()).unwrap()
}

fn graph(mesh: TriMesh) -> ElasticaGraph {
    graph_with(mesh, &ElasticaOptions::default())
}

/// Some vertices, spread over the mesh.
fn sample(graph: &ElasticaGraph, count: usize) -> impl Iterator<Item = VertexId> + use<> {
    let n = graph.mesh().n_vertices();
    (0..count.min(n)).map(move |i| VertexId::new((i * 7919 + 13) % n))
}

fn price(graph: &ElasticaGraph, route: &Route) -> f32 {
    let s = &route.states;
    let inner: f32 = s.windows(2).map(|w| graph.step(w[0], w[1])).sum();
    assert!(s.windows(2).all(|w| graph.follows(w[0], w[1])));
    assert!(graph.follows(*s.last().unwrap(), s[0]));
    inner + graph.step(*s.last().unwrap(), s[0])
}

/// Plain Dijkstra over all of `g′` from the successors of `a` back to `a`.
fn reference(graph: &ElasticaGraph, mask: &DirectionMask, a: State) -> f32 {
    let mut dist = vec![f32::INFINITY; graph.n_states()];
    let mut queue = BinaryHeap::new();
    let mut from = Some((0.0, a));
    while let Some((d, e)) = from {
        for f in graph.successors(e).filter(|&f| mask.is_open(f)) {
            let reached = d + graph.step(e, f);
            if reached < dist[f as usize] {
                dist[f as usize] = reached;
                queue.push(Reverse((reached.to_bits(), f)));
            }
        }
        from = loop {
            match queue.pop() {
                Some(Reverse((key, e))) if f32::from_bits(key) <= dist[e as usize] => {
                    break Some((f32::from_bits(key), e)).filter(|_| e != a);
                }
                Some(_) => {}
                None => break None,
            }
        };
    }
    dist[a as usize]
}

/// Compares all routes up to `factor` with the reference in every direction; returns how many were compared.
fn compare(graph: &ElasticaGraph, mask: &DirectionMask, v: VertexId, factor: f32) -> usize {
    let progress = Progress::new();
    let mut work = SearchWorkspace::new();
    let mut search = LoopSearch {
        graph,
        mask,
        work: &mut work,
        meter: Meter { progress: &progress, budget: u64::MAX, settled: 0 },
        vertex: v,
        factor,
    };
    let mut routes = Vec::new();
    search.all(None, &mut routes, |_, _| {}).unwrap();
    let out: Vec<State> = graph.leaving(v).filter(|&a| mask.is_open(a)).collect();
    let expected: Vec<f32> = out.iter().map(|&a| reference(graph, mask, a)).collect();
    let near = |a: f32, b: f32| (a - b).abs() <= 1e-4 * b;
    for r in &routes {
        assert!(near(price(graph, r), r.cost), "{v:?}: {} for {}", r.cost, price(graph, r));
    }
    let best = routes.iter().map(|r| r.cost).fold(f32::INFINITY, f32::min);
    let best_expected = expected.iter().copied().fold(f32::INFINITY, f32::min);
    assert!(best == best_expected || near(best, best_expected), "{v:?}: {best}, expected {best_expected}");
    let mut compared = 1;
    if factor > 1.0 {
        for (&a, &cost) in out.iter().zip(&expected).filter(|(_, c)| **c < best * factor / ROUNDING) {
            let here = routes.iter().filter(|r| r.states[0] == a).map(|r| r.cost).fold(f32::INFINITY, f32::min);
            assert!(near(here, cost), "{v:?} along {a}: {here}, expected {cost}");
            compared += 1;
        }
    }
    compared
}

fn compare_some(graph: &ElasticaGraph, count: usize) {
    let open = DirectionMask::none();
    let mut compared = 0;
    for v in sample(graph, count) {
        compared += compare(graph, &open, v, 1.0) + compare(graph, &open, v, 1.5);
    }
    assert!(compared > count);
}

#[test]
fn the_search_is_exact_on_generated_meshes() {
    compare_some(&graph(torus(24, 12)), 4);
    compare_some(&graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5))), 3);
}

#[test]
fn the_search_is_exact_on_real_meshes() {
    for (name, count) in [("od_cube.obj", 8), ("torus_1k.obj", 3), ("rockerarm_1k.off", 3)] {
        if let Some(mesh) = real(name) {
            compare_some(&graph(mesh), count);
        }
    }
}

/// Closes what is equivalent to a curve.
fn close_along(graph: &ElasticaGraph, curve: &crate::surface::SurfaceCurve, mask: &mut DirectionMask) {
    let n = curve.crossings.len();
    for i in usize::from(!curve.closed)..n {
        let along = curve.point(graph.mesh(), i) - curve.point(graph.mesh(), (i + n - 1) % n);
        graph.disable_near(mask, curve.face_before(graph.mesh(), i).unwrap(), along, 45f64.to_radians());
    }
}

#[test]
fn the_search_is_exact_around_closed_directions() {
    let g = graph(torus(24, 12));
    let v = VertexId(13);
    let mut mask = DirectionMask::none();
    let before =
        g.proposals(&ProposalQuery::cheapest(v, &mask), &mut SearchWorkspace::new(), &Progress::new()).unwrap();
    close_along(&g, &before.loops[0].curve, &mut mask);
    assert!(mask.n_closed() > 0);
    compare(&g, &mask, v, 1.0);
    compare(&g, &mask, v, 1.5);
    let after = g.proposals(&ProposalQuery::cheapest(v, &mask), &mut SearchWorkspace::new(), &Progress::new()).unwrap();
    assert!(after.loops[0].cost > before.loops[0].cost);
}

#[test]
fn loops_are_handed_out_while_the_search_goes_on() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    let mask = DirectionMask::none();
    let mut work = SearchWorkspace::new();
    for v in sample(&g, 6) {
        let mut seen = Vec::new();
        let query = ProposalQuery::alternatives(v, &mask);
        let found = g.proposals_with(&query, &mut work, &Progress::new(), |c, l| seen.push((c, l.cost))).unwrap();
        let costs: Vec<f64> = seen.iter().map(|s| s.1).collect();
        assert!(seen.len() >= 2 && seen[0].0 == Certainty::Found && costs.is_sorted_by(|a, b| a >= b));
        let last = seen.last().unwrap();
        assert!(last.0 == Certainty::Proved && (last.1 - found.loops[0].cost).abs() < 1e-5 * last.1);
    }
}

#[test]
fn one_direction_is_searched_exactly() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    let open = DirectionMask::none();
    let mut work = SearchWorkspace::new();
    for v in sample(&g, 3) {
        for a in g.leaving(v).step_by(9) {
            let query = ProposalQuery { direction: Some(g.departure(a)), ..ProposalQuery::cheapest(v, &open) };
            let found = g.proposals(&query, &mut work, &Progress::new()).unwrap();
            let expected = f64::from(reference(&g, &open, a));
            assert!(found.proved && (found.loops[0].cost - expected).abs() < 1e-4 * expected);
        }
    }
}

#[test]
fn prices_are_symmetric_to_the_last_bit() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    for e in 0..g.n_states() as State {
        let back = g.reverse[e as usize];
        assert_eq!(g.reverse[back as usize], e);
        for f in g.successors(e) {
            let turned = g.reverse[f as usize];
            assert_eq!(g.step(e, f).to_bits(), g.step(turned, back).to_bits());
            assert!(g.successors(turned).any(|s| s == back));
            assert!(g.follows(e, f));
        }
        assert_eq!(
            g.successors(e).count(),
            g.leaving(VertexId(g.target[e as usize])).filter(|&f| g.follows(e, f)).count()
        );
    }
}

#[test]
fn the_cheapest_loop_of_a_torus_is_a_meridian_circle() {
    let g = graph(torus(48, 24));
    let mask = DirectionMask::none();
    let found =
        g.proposals(&ProposalQuery::alternatives(VertexId(5), &mask), &mut SearchWorkspace::new(), &Progress::new());
    let found = found.unwrap();
    // Tube radius over the diagonal of the box.
    let radius = 0.4 / 2.8f64.hypot(2.8).hypot(0.8);
    let best = &found.loops[0];
    assert!(found.proved && best.curve.closed);
    assert!((best.length - radius * std::f64::consts::TAU).abs() < 0.02 * best.length, "{}", best.length);
    assert!(best.bending < 0.01 * best.length);
    assert!(found.loops.windows(2).all(|w| w[0].cost <= w[1].cost));
}

#[test]
fn of_loops_shifted_over_the_surface_one_is_proposed() {
    let (round, long) = (graph(torus(48, 24)), graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5))));
    let mask = DirectionMask::none();
    let mut fewer = 0;
    // The corners of an octahedron, and besides a handle, which needs no mark.
    for (g, marks) in [(round, 0..0), (long, 0..6)] {
        let classes = HomologyClasses::new(g.mesh(), marks.map(VertexId));
        let mut work = SearchWorkspace::new();
        for v in sample(&g, 6) {
            let query = ProposalQuery { factor: 3.0, ..ProposalQuery::alternatives(v, &mask) };
            let all = g.proposals(&ProposalQuery { max: 1000, ..query }, &mut work, &Progress::new()).unwrap();
            let query = ProposalQuery { classes: Some(&classes), ..query };
            let some = g.proposals(&query, &mut work, &Progress::new()).unwrap();
            assert_eq!(all.loops[0], some.loops[0]);
            fewer += usize::from(some.loops.len() < all.loops.len());
            let class = |l: &FoundLoop| classes.of(g.mesh(), &l.curve);
            let heading = |l: &FoundLoop| {
                let at = |i: usize| g.mesh().position(l.path[i]);
                ((at(1) - at(0)).normalize() + (at(0) - at(l.path.len() - 1)).normalize()).normalize()
            };
            for (i, l) in some.loops.iter().enumerate() {
                let same = some.loops[..i].iter().filter(|s| class(s).is_some() && class(s) == class(l));
                // Geodesics are not straight in space.
                assert!(same.into_iter().all(|s| heading(s).dot(heading(l)).abs() < 40f64.to_radians().cos()), "{v:?}");
            }
            let missing = |l: &&FoundLoop| !some.loops.iter().any(|s| class(s) == class(l));
            assert!(some.loops.len() == query.max || !all.loops.iter().any(|l| missing(&l)), "{v:?}");
        }
    }
    assert!(fewer > 3, "{fewer}");
}

#[test]
fn open_curves_compete_with_loops() {
    let g = graph(tube(24, 40));
    let mask = DirectionMask::none();
    let v = VertexId(20);
    let query = ProposalQuery { factor: 20.0, max: 100, ..ProposalQuery::alternatives(v, &mask) };
    let found = g.proposals(&query, &mut SearchWorkspace::new(), &Progress::new()).unwrap();
    assert!(found.loops.iter().any(|l| l.curve.closed) && found.loops.iter().any(|l| !l.curve.closed));
    for l in &found.loops {
        assert_eq!(l.curve.check(g.mesh()), Ok(()));
        assert!(l.path.contains(&v));
        if !l.curve.closed {
            assert!([l.path[0], *l.path.last().unwrap()].iter().all(|&w| g.mesh().is_boundary_vertex(w)));
        }
    }
}

#[test]
fn every_loop_is_a_curve() {
    let names = [
        "od_cube.obj",
        "torus_1k.obj",
        "half_torus.obj",
        "chipped_torus.obj",
        "vase_open.off",
        "rockerarm_1k.off",
        "bunny_1k.obj",
        "cad_upright_slivers.off",
        "meshlab_block.off",
    ];
    let progress = Progress::new();
    for mesh in names.iter().filter_map(|n| Some((n, real(n)?))) {
        let (name, g) = (mesh.0, graph(mesh.1));
        let mask = DirectionMask::none();
        let mut work = SearchWorkspace::new();
        let (mut with, mut without) = (0, 0);
        for v in sample(&g, 40) {
            let query = ProposalQuery { budget: 300_000, ..ProposalQuery::alternatives(v, &mask) };
            let found = g.proposals(&query, &mut work, &progress).unwrap();
            for l in &found.loops {
                assert_eq!(l.curve.check(g.mesh()), Ok(()), "{name} {v:?}");
                assert!(l.cost.is_finite() && (l.cost - l.length - l.alignment - l.bending).abs() < 1e-9);
            }
            if found.loops.is_empty() { without += 1 } else { with += 1 }
        }
        assert!(with > 3 * without, "{name}: {without} vertices of {} without a loop", with + without);
    }
}

#[test]
fn a_loop_nearby_bounds_the_search_and_changes_no_result() {
    let meshes = [Some(torus(24, 12)), real("rockerarm_1k.off"), real("bunny_1k.obj")];
    let (mask, progress) = (DirectionMask::none(), Progress::new());
    for g in meshes.into_iter().flatten().map(graph) {
        let (mut work, mut seeded, mut all) = (SearchWorkspace::new(), 0, 0);
        let mut settled = [0, 0];
        for v in sample(&g, 12) {
            let there = g.proposals(&ProposalQuery::cheapest(v, &mask), &mut work, &progress).unwrap();
            let Some(nearby) = there.loops.first().filter(|l| l.curve.closed) else { continue };
            for w in g.mesh().outgoing(v).map(|h| g.mesh().target(h)) {
                all += 1;
                let Some(route) = g.seed(&mask, w, &nearby.path) else { continue };
                seeded += 1;
                assert!((price(&g, &route) - route.cost).abs() < 1e-4 * route.cost);
                assert_eq!(g.origin(route.states[0]), w);
                let ring = route.states.iter().zip(route.states.iter().cycle().skip(1));
                assert!(ring.into_iter().all(|(&e, &f)| g.follows(e, f)));

                let plain = ProposalQuery::cheapest(w, &mask);
                let alone = g.proposals(&plain, &mut work, &progress).unwrap();
                let mut first = None;
                let query = ProposalQuery { nearby: Some(nearby), ..plain };
                let found = g.proposals_with(&query, &mut work, &progress, |c, l| {
                    first.get_or_insert((c, l.cost));
                });
                let found = found.unwrap();
                let cost = |p: &Proposals| p.loops.first().map(|l| l.cost);
                let (Some(a), Some(b)) = (cost(&alone), cost(&found)) else { panic!("{w:?}: no loop") };
                assert!((a - b).abs() < 1e-5 * a, "{w:?}: {b}, alone {a}");
                assert!(first.is_some_and(|(c, cost)| c == Certainty::Found && cost >= a * (1.0 - 1e-5)));
                settled[0] += alone.settled;
                settled[1] += found.settled;
            }
        }
        assert!(2 * seeded > all, "{seeded} of {all} neighbours");
        assert!(settled[1] <= settled[0], "{settled:?} states settled");
    }
}

#[test]
fn a_spent_budget_is_told() {
    let g = graph(torus(24, 12));
    let mask = DirectionMask::none();
    let query = ProposalQuery { budget: 10, ..ProposalQuery::cheapest(VertexId(3), &mask) };
    let found = g.proposals(&query, &mut SearchWorkspace::new(), &Progress::new()).unwrap();
    assert!(!found.proved && found.settled == 10);
    let stop = Progress::new();
    stop.cancel();
    let query = ProposalQuery::cheapest(VertexId(3), &mask);
    assert!(g.proposals(&query, &mut SearchWorkspace::new(), &stop).is_err());
    let built = ElasticaGraph::build(g.mesh().clone(), &[], &[], &ElasticaOptions::default(), &Progress::new());
    assert!(matches!(built, Err(ElasticaError::WrongLength { given: 0, .. })));
}

#[test]
fn the_middle_of_a_geodesic_lies_in_its_face() {
    let g = graph(ellipsoid(2, DVec3::ONE));
    let mut mask = DirectionMask::none();
    for f in 0..g.mesh().n_faces() {
        g.disable_near(&mut mask, FaceId::new(f), DVec3::X, std::f64::consts::FRAC_PI_2 + 1e-6);
    }
    assert_eq!(2 * mask.n_closed(), g.n_states());
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let g = graph(torus(32, 16));
            let mask = DirectionMask::none();
            let mut work = SearchWorkspace::new();
            let find = |v| {
                let query = ProposalQuery { factor: 4.0, budget: 60_000, ..ProposalQuery::alternatives(v, &mask) };
                g.proposals(&query, &mut work, &Progress::new()).unwrap()
            };
            sample(&g, 6).map(find).collect::<Vec<_>>()
        })
    };
    assert_eq!(run(1), run(3));
}

//! Proposed loops: their order, their curves, and what the query options do.

use std::f64::consts::TAU;

use glam::DVec3;

use super::reference::{cost_of_steps, same_cost};
use super::samples::{ellipsoid, graph, research, sample, torus, tube};
use crate::elastica::{
    Certainty, DirectionMask, ElasticaError, ElasticaGraph, ElasticaOptions, FoundLoop, HomologyClasses, ProposalQuery,
    Proposals, SearchWorkspace, Selection,
};
use crate::mesh::VertexId;
use crate::progress::Progress;

#[test]
fn loops_are_shown_while_the_search_continues() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    let mask = DirectionMask::all_open();
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
fn the_cheapest_loop_of_a_torus_is_a_meridian_circle() {
    let g = graph(torus(48, 24));
    let mask = DirectionMask::all_open();
    let found =
        g.proposals(&ProposalQuery::alternatives(VertexId(5), &mask), &mut SearchWorkspace::new(), &Progress::new());
    let found = found.unwrap();
    // Tube radius over the diagonal of the box.
    let radius = 0.4 / 2.8f64.hypot(2.8).hypot(0.8);
    let best = &found.loops[0];
    assert!(found.proved && best.curve.closed);
    assert!((best.length - radius * TAU).abs() < 0.02 * best.length, "{}", best.length);
    assert!(best.bending < 0.01 * best.length);
    assert!(found.loops.windows(2).all(|w| w[0].cost <= w[1].cost));
}

#[test]
fn of_homologous_loops_in_one_direction_one_is_proposed() {
    let (round, long) = (graph(torus(48, 24)), graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5))));
    let mask = DirectionMask::all_open();
    let mut fewer = 0;
    // Marks at the six corners of an octahedron; a torus needs none.
    for (g, marks) in [(round, 0..0), (long, 0..6)] {
        let classes = HomologyClasses::new(g.mesh(), marks.map(VertexId));
        let mut work = SearchWorkspace::new();
        for v in sample(&g, 6) {
            let selection = Selection { factor: 3.0, ..Selection::alternatives() };
            let query = |selection| ProposalQuery { selection, ..ProposalQuery::alternatives(v, &mask) };
            let all = query(Selection { max: 1000, ..selection });
            let all = g.proposals(&all, &mut work, &Progress::new()).unwrap();
            let query = query(Selection { classes: Some(&classes), ..selection });
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
            assert!(some.loops.len() == query.selection.max || !all.loops.iter().any(|l| missing(&l)), "{v:?}");
        }
    }
    assert!(fewer > 3, "{fewer}");
}

#[test]
fn open_curves_compete_with_loops() {
    let g = graph(tube(24, 40));
    let mask = DirectionMask::all_open();
    let v = VertexId(20);
    let selection = Selection { factor: 20.0, max: 100, ..Selection::alternatives() };
    let query = ProposalQuery { selection, ..ProposalQuery::alternatives(v, &mask) };
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
fn every_proposal_is_a_valid_curve() {
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
    for mesh in names.iter().filter_map(|n| Some((n, research(n)?))) {
        let (name, g) = (mesh.0, graph(mesh.1));
        let mask = DirectionMask::all_open();
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
fn a_nearby_loop_bounds_the_search_without_changing_the_result() {
    let meshes = [Some(torus(24, 12)), research("rockerarm_1k.off"), research("bunny_1k.obj")];
    let (mask, progress) = (DirectionMask::all_open(), Progress::new());
    for g in meshes.into_iter().flatten().map(graph) {
        let (mut work, mut joined, mut all) = (SearchWorkspace::new(), 0, 0);
        let mut settled = [0, 0];
        for v in sample(&g, 12) {
            let there = g.proposals(&ProposalQuery::cheapest(v, &mask), &mut work, &progress).unwrap();
            let Some(nearby) = there.loops.first().filter(|l| l.curve.closed) else { continue };
            for w in g.mesh().outgoing(v).map(|h| g.mesh().target(h)) {
                all += 1;
                let Some(route) = g.initial_loop(&mask, w, &nearby.path) else { continue };
                joined += 1;
                assert!(same_cost(cost_of_steps(&g, &route), route.cost));
                assert_eq!(g.origin(route.states[0]), w);
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
        assert!(2 * joined > all, "{joined} of {all} neighbours");
        assert!(settled[1] <= settled[0], "{settled:?} states settled");
    }
}

#[test]
fn a_spent_budget_is_reported() {
    let g = graph(torus(24, 12));
    let mask = DirectionMask::all_open();
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
fn the_number_of_threads_changes_nothing() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let g = graph(torus(32, 16));
            let mask = DirectionMask::all_open();
            let mut work = SearchWorkspace::new();
            let find = |v| {
                let selection = Selection { factor: 4.0, ..Selection::alternatives() };
                let query = ProposalQuery { selection, budget: 60_000, ..ProposalQuery::alternatives(v, &mask) };
                g.proposals(&query, &mut work, &Progress::new()).unwrap()
            };
            sample(&g, 6).map(find).collect::<Vec<_>>()
        })
    };
    assert_eq!(run(1), run(3));
}

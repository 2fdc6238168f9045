//! Properties of the searches on random meshes: the exact searches give the costs of plain Dijkstra.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;
use proptest::prelude::*;

use super::reference::{cheapest_round, compare_loops, compare_open_curves, same_cost};
use super::samples::{around, graph_with};
use crate::elastica::budget::SearchBudget;
use crate::elastica::graph::State;
use crate::elastica::{Anchor, AnchorQuery, DirectionMask, ElasticaGraph, ElasticaOptions, SearchWorkspace};
use crate::mesh::{FaceId, TriMesh, VertexId};
use crate::progress::Progress;

/// A torus (`closed`) or an open tube of a few quads, with a random height per vertex, from 0 to 1.
fn uneven(n: u32, m: u32, closed: bool, heights: &[f64]) -> TriMesh {
    let (rows, columns) = (if closed { m } else { m + 1 }, n);
    let height = |u: f64, v: f64| {
        let (i, j) = ((u * f64::from(n)).round() as u32 % columns, (v * f64::from(m)).round() as u32 % rows);
        heights[(i * rows + j) as usize % heights.len()]
    };
    around(n, m, closed, |u, v| {
        let (a, b) = (TAU * u, TAU * v);
        if closed {
            let minor = 0.4 * (1.0 + 0.4 * height(u, v));
            let r = 1.0 + minor * b.cos();
            DVec3::new(r * a.cos(), r * a.sin(), minor * b.sin())
        } else {
            let r = 0.4 * (1.0 + 0.4 * height(u, v));
            DVec3::new(r * a.cos(), r * a.sin(), 2.0 * v)
        }
    })
}

/// The graph of an uneven mesh. Three rings keep plain Dijkstra fast.
fn uneven_graph(n: u32, m: u32, closed: bool, heights: &[f64]) -> ElasticaGraph {
    graph_with(uneven(n, m, closed, heights), &ElasticaOptions { rings: 3, ..ElasticaOptions::default() })
}

/// Closes directions in some faces; each item selects a face and an angle.
fn close_some(graph: &ElasticaGraph, closed: &[(usize, f64)]) -> DirectionMask {
    let mut mask = DirectionMask::all_open();
    let mesh = graph.mesh();
    for &(face, angle) in closed {
        let f = FaceId::new(face % mesh.n_faces());
        let [h, ..] = mesh.face_halfedges(f);
        let (x, normal) = (mesh.vector(h).normalize(), mesh.face_normal(f));
        let direction = x * angle.cos() + normal.cross(x) * angle.sin();
        graph.close_near(&mut mask, f, direction, 0.4 * FRAC_PI_2);
    }
    mask
}

fn heights() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.0f64..1.0, 90)
}

fn closed_directions() -> impl Strategy<Value = Vec<(usize, f64)>> {
    prop::collection::vec((0usize..200, 0.0f64..TAU), 0..12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn loops_are_exact(
        (n, m) in (5u32..10, 5u32..9),
        heights in heights(),
        closed in closed_directions(),
        vertex in 0usize..100,
        factor in 1.0f32..2.0,
    ) {
        let g = uneven_graph(n, m, true, &heights);
        let mask = close_some(&g, &closed);
        let v = VertexId::new(vertex % g.mesh().n_vertices());
        compare_loops(&g, &mask, v, 1.0);
        compare_loops(&g, &mask, v, factor);
    }

    #[test]
    fn open_curves_are_exact(
        (n, m) in (5u32..10, 4u32..9),
        heights in heights(),
        closed in closed_directions(),
        vertex in 0usize..100,
    ) {
        let g = uneven_graph(n, m, false, &heights);
        let mask = close_some(&g, &closed);
        let inside: Vec<VertexId> = g.mesh().vertices().filter(|&v| !g.mesh().is_boundary_vertex(v)).collect();
        compare_open_curves(&g, &mask, inside[vertex % inside.len()]);
    }

    #[test]
    fn loops_through_anchors_are_exact(
        (n, m) in (5u32..8, 5u32..8),
        heights in heights(),
        closed in closed_directions(),
        anchors in prop::collection::vec((0usize..100, prop::option::of(prop::array::uniform3(-1.0f64..1.0))), 1..4),
    ) {
        let g = uneven_graph(n, m, true, &heights);
        let mask = close_some(&g, &closed);
        let vertex = |i: usize| VertexId::new(i % g.mesh().n_vertices());
        let anchors: Vec<Anchor> = anchors
            .iter()
            .map(|&(i, d)| Anchor { vertex: vertex(i), direction: d.map(DVec3::from_array) })
            .collect();
        let departures: Vec<Vec<State>> = anchors
            .iter()
            .map(|a| match a.direction {
                Some(d) => g.nearest_open(&mask, a.vertex, d).into_iter().collect(),
                None => g.outgoing(a.vertex).filter(|&e| mask.is_open(e)).collect(),
            })
            .collect();
        let reachable = departures.iter().all(|d| !d.is_empty());
        let expected = if reachable { cheapest_round(&g, &mask, &departures) } else { f32::INFINITY };
        let query = AnchorQuery { anchors: &anchors, mask: &mask, budget: u64::MAX };
        let progress = Progress::new();
        let mut budget = SearchBudget { progress: &progress, limit: u64::MAX, settled: 0 };
        let (route, proved) = g.route_through(&query, &mut SearchWorkspace::new(), &mut budget).unwrap();
        let cost = route.as_ref().map_or(f32::INFINITY, |r| r.cost);
        prop_assert!(proved);
        prop_assert!(same_cost(cost, expected), "{anchors:?}: {cost}, expected {expected}");
    }
}

//! Properties of the searches on random meshes: the exact searches give the costs of plain Dijkstra.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;
use proptest::prelude::*;

use super::reference::{cheapest_round, cheapest_rounds, compare_loops, compare_open_curves, cost_of_steps, same_cost};
use super::samples::{around, graph_with};
use crate::elastica::budget::SearchBudget;
use crate::elastica::graph::State;
use crate::elastica::route::{ROUNDING, Route};
use crate::elastica::{Anchor, AnchorQuery, DirectionMask, ElasticaGraph, ElasticaOptions, SearchWorkspace, Selection};
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
        let (cost, expected) = anchored_costs([n, m], &heights, &closed, &anchors);
        prop_assert!(same_cost(cost, expected), "{anchors:?}: {cost}, expected {expected}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(8))]

    #[test]
    fn alternatives_through_anchors_are_exact(
        heights in heights(),
        closed in closed_directions(),
        anchors in prop::collection::vec((0usize..100, prop::option::of(prop::array::uniform3(-1.0f64..1.0))), 1..4),
        factor in 1.05f64..1.4,
    ) {
        let g = uneven_graph(6, 6, true, &heights);
        let mask = close_some(&g, &closed);
        let anchors = at_vertices(&g, &anchors);
        let mut departures = departures(&g, &mask, &anchors);
        prop_assume!(departures.iter().all(|d| !d.is_empty()));
        let selection = Selection { factor, ..Selection::alternatives() };
        let query = AnchorQuery { selection, budget: u64::MAX, ..AnchorQuery::cheapest(&anchors, &mask) };
        let progress = Progress::new();
        let mut budget = SearchBudget { progress: &progress, limit: u64::MAX, settled: 0 };
        let (routes, _) = g.routes_through(&query, &mut SearchWorkspace::new(), &mut budget, &mut |_| {}).unwrap();
        let limit = routes.first().map_or(0.0, |r| r.cost) * factor as f32 / ROUNDING;
        for route in &routes {
            prop_assert!(same_cost(cost_of_steps(&g, route), route.cost));
            prop_assert!(departures.iter().all(|d| route.states.iter().any(|s| d.contains(s))));
        }
        for _ in 0..departures.len() {
            for (&x, cost) in departures[0].iter().zip(cheapest_rounds(&g, &mask, &departures)) {
                let found = |r: &Route| r.states.contains(&x) && same_cost(r.cost, cost);
                prop_assert!(cost > limit || routes.iter().any(found), "{x}: {cost} up to {limit}");
            }
            departures.rotate_left(1);
        }
    }
}

/// An anchor: the number of its vertex, and a direction.
type Choice = (usize, Option<[f64; 3]>);

fn at_vertices(g: &ElasticaGraph, anchors: &[Choice]) -> Vec<Anchor> {
    let vertex = |i: usize| VertexId::new(i % g.mesh().n_vertices());
    anchors.iter().map(|&(i, d)| Anchor { vertex: vertex(i), direction: d.map(DVec3::from_array) }).collect()
}

/// The states by which a loop may leave each anchor.
fn departures(g: &ElasticaGraph, mask: &DirectionMask, anchors: &[Anchor]) -> Vec<Vec<State>> {
    anchors.iter().map(|a| g.departures(mask, a)).collect()
}

/// The cost of the loop found through anchors on an uneven torus, and that of the cheapest by plain Dijkstra.
fn anchored_costs([n, m]: [u32; 2], heights: &[f64], closed: &[(usize, f64)], anchors: &[Choice]) -> (f32, f32) {
    let g = uneven_graph(n, m, true, heights);
    let mask = close_some(&g, closed);
    let anchors = at_vertices(&g, anchors);
    let departures = departures(&g, &mask, &anchors);
    let reachable = departures.iter().all(|d| !d.is_empty());
    let expected = if reachable { cheapest_round(&g, &mask, &departures) } else { f32::INFINITY };
    let query = AnchorQuery { budget: u64::MAX, ..AnchorQuery::cheapest(&anchors, &mask) };
    let progress = Progress::new();
    let mut budget = SearchBudget { progress: &progress, limit: u64::MAX, settled: 0 };
    let (routes, proved) = g.routes_through(&query, &mut SearchWorkspace::new(), &mut budget, &mut |_| {}).unwrap();
    let cost = routes.first().map_or(f32::INFINITY, |r| r.cost);
    assert!(proved);
    (cost, expected)
}

/// Here the field of one leg has older entries of settled states in its queue, with keys below those of other legs.
#[test]
fn a_loop_through_two_free_anchors_and_a_directed_one_is_exact() {
    let heights = [
        0.0,
        0.36602968796151963,
        0.9104412395001829,
        0.40805689287032143,
        0.601959705268989,
        0.5556893883926397,
        0.3416257748189453,
        0.7568800295246814,
        0.6758620499852441,
        0.0,
        0.273523680991185,
        0.11658143677465142,
        0.33047881936764056,
        0.8734033470805872,
        0.3393834145236624,
        0.8407777834443462,
        0.0,
        0.8979251527455674,
        0.7141664027113654,
        0.5272130515444076,
        0.0,
        0.0,
        0.8602430181701578,
        0.0,
        0.8662816182620104,
        0.0,
        0.0,
        0.0,
        0.704076252108906,
        0.0,
        0.467625878049459,
        0.6084580343246772,
        0.34911961147290244,
        0.167665153051294,
        0.0,
        0.6786333516345799,
        0.7874262465093248,
        0.3485031384985415,
        0.4622845702711125,
        0.23066639400387529,
        0.6231267963313863,
        0.5268025906522001,
        0.5331821946489721,
        0.15311317973628666,
        0.866620715499806,
        0.5873209914387564,
        0.5334511780456579,
        0.44017863142384517,
        0.6578653834299102,
        0.4885339069484,
        0.19480021830992325,
        0.8316846187662573,
        0.20774541706077373,
        0.0781505514091397,
        0.6579790220073596,
        0.3260496329676427,
        0.5086797165723969,
        0.17538646839442554,
        0.4514996078500695,
        0.2969776271796953,
        0.6463108023961528,
        0.729514876996506,
        0.9412891196405639,
        0.22627059920309311,
        0.2744996199637945,
        0.23099970985640444,
        0.34276305793397227,
        0.9171231240681811,
        0.22599279586967752,
        0.8459174279880649,
        0.9495459166497928,
        0.3488888670714754,
        0.7863342355892581,
        0.1661394503663628,
        0.5990791785585664,
        0.0455948006062414,
        0.5920623522905131,
        0.5037460050265259,
        0.5068085648418695,
        0.17865784523701947,
        0.3732783738912033,
        0.6558521294165056,
        0.28856984902557753,
        0.03392499243374742,
        0.9626794632944891,
        0.8746608014615997,
        0.5944897095493966,
        0.33194855888650326,
        0.6034370138809126,
        0.9346113454435487,
    ];
    let closed: Vec<(usize, f64)> = vec![
        (134, 3.857505405779581),
        (166, 4.094309725154457),
        (161, 0.33811478706340264),
        (170, 5.011703811234001),
        (125, 2.3745491719423004),
        (151, 1.5072846166329676),
        (87, 3.081130155571154),
    ];
    let anchors: Vec<Choice> =
        vec![(13, None), (18, None), (87, Some([-0.2642165358079778, 0.32442493696965147, 0.0012890924057124995]))];
    let (cost, expected) = anchored_costs([7, 7], &heights, &closed, &anchors);
    assert!(same_cost(cost, expected), "{cost}, expected {expected}");
}

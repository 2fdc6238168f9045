//! Traversals compared with simple reference implementations, on random graphs with many ties.

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::testing::{square, torus};

/// A directed graph by its edges: from, to, length.
type Graph = Vec<(u32, u32, f64)>;

const N: u32 = 12;

/// Few different lengths, zero among them, so that ties are common.
fn graph() -> impl Strategy<Value = Graph> {
    let edge = (0..N, 0..N, 0u32..4).prop_map(|(a, b, length)| (a, b, f64::from(length)));
    prop::collection::vec(edge, 0..40)
}

fn leaving(graph: &Graph, at: u32) -> impl Iterator<Item = (usize, u32, f64)> + '_ {
    graph.iter().enumerate().filter(move |(_, e)| e.0 == at).map(|(i, e)| (i, e.1, e.2))
}

/// Distances by relaxing all edges until nothing changes (Bellman and Ford).
fn relaxed(graph: &Graph, starts: &[(u32, f64)]) -> Vec<f64> {
    let mut distance = vec![f64::INFINITY; N as usize];
    for &(at, d) in starts {
        distance[at as usize] = d.min(distance[at as usize]);
    }
    for _ in 0..N {
        for &(a, b, length) in graph {
            distance[b as usize] = distance[b as usize].min(distance[a as usize] + length);
        }
    }
    distance
}

fn run(search: &mut Dijkstra<u32, usize>, graph: &Graph, starts: &[(u32, f64)]) -> Vec<(u32, f64)> {
    for &(at, d) in starts {
        search.start(at, d);
    }
    let mut settled = Vec::new();
    while let Some((at, d)) = search.settle() {
        settled.push((at, d));
        for (i, to, length) in leaving(graph, at) {
            search.reach(to, d + length, i);
        }
    }
    settled
}

proptest! {
    #[test]
    fn dijkstra_agrees_with_relaxation(
        graph in graph(),
        starts in prop::collection::vec((0..N, 0u32..3), 1..4),
    ) {
        let starts: Vec<(u32, f64)> = starts.into_iter().map(|(at, d)| (at, f64::from(d))).collect();
        let wanted = relaxed(&graph, &starts);
        let mut search = Dijkstra::new(N as usize);
        let settled = run(&mut search, &graph, &starts);
        for at in 0..N {
            prop_assert_eq!(search.distance(at), wanted[at as usize]);
            let Some(path) = search.path_to(at, |&i| graph[i].0) else {
                prop_assert!(wanted[at as usize].is_infinite());
                continue;
            };
            let first = path.first().map_or(at, |&i| graph[i].0);
            prop_assert!(path.windows(2).all(|w| graph[w[0]].1 == graph[w[1]].0));
            prop_assert!(path.last().is_none_or(|&i| graph[i].1 == at));
            let length: f64 = search.distance(first) + path.iter().map(|&i| graph[i].2).sum::<f64>();
            prop_assert_eq!(length, wanted[at as usize]);
        }
        // Each reached element is settled once, by ascending distance.
        prop_assert!(settled.windows(2).all(|w| w[0].1 <= w[1].1));
        let mut once: Vec<u32> = settled.iter().map(|s| s.0).collect();
        once.sort_unstable();
        let mut reached = search.reached().to_vec();
        reached.sort_unstable();
        prop_assert_eq!(once, reached);
        // The same search with sparse labels, and again after clearing.
        let mut sparse = Dijkstra::sparse();
        prop_assert_eq!(run(&mut sparse, &graph, &starts), settled.clone());
        for search in [&mut search, &mut sparse] {
            search.clear();
            prop_assert!(search.reached().is_empty() && search.distance(starts[0].0).is_infinite());
            prop_assert_eq!(run(search, &graph, &starts), settled.clone());
        }
    }

    #[test]
    fn breadth_first_search_counts_steps(graph in graph(), starts in prop::collection::vec(0..N, 1..4)) {
        let unit: Graph = graph.iter().map(|&(a, b, _)| (a, b, 1.0)).collect();
        let wanted = relaxed(&unit, &starts.iter().map(|&at| (at, 0.0)).collect::<Vec<_>>());
        for mut search in [BreadthFirst::new(N as usize), BreadthFirst::sparse()] {
            for &at in &starts {
                search.start(at);
            }
            let mut visited = Vec::new();
            while let Some(at) = search.visit() {
                visited.push(at);
                for (i, to, _) in leaving(&unit, at) {
                    search.reach(to, i);
                }
            }
            prop_assert_eq!(&visited, search.reached());
            for at in 0..N {
                let steps = search.path_to(at, |&i| unit[i].0).map(|path| path.len() as f64);
                prop_assert_eq!(steps.unwrap_or(f64::INFINITY), wanted[at as usize]);
                prop_assert_eq!(search.depth(at).map(f64::from), steps);
                prop_assert_eq!(search.is_reached(at), steps.is_some());
            }
        }
    }

    #[test]
    fn components_are_those_of_joined_sets(graph in graph()) {
        let mut sets = crate::union_find::UnionFind::new(N as usize);
        for e in &graph {
            sets.join(e.0, e.1);
        }
        let across = |at: u32| {
            let ends = graph.iter().flat_map(|e| [(e.0, e.1), (e.1, e.0)]);
            ends.filter(|e| e.0 == at).map(|e| e.1).collect::<Vec<_>>()
        };
        let (component, count) = components(N as usize, across);
        let roots: Vec<u32> = (0..N).filter(|&at| sets.root(at) == at).collect();
        prop_assert_eq!(count, roots.len());
        for at in 0..N {
            prop_assert_eq!(roots[component[at as usize] as usize], sets.root(at));
        }
    }

    #[test]
    fn dilation_adds_the_vertices_within_as_many_edges(seeds in prop::collection::vec(0u32..35, 1..4), rings in 0usize..4) {
        let mesh = crate::testing::grid(6, 4, [false, false], |u, v| DVec3::new(u, v, 0.0));
        let mut marked = vec![false; mesh.n_vertices()];
        let mut search: BreadthFirst<VertexId, ()> = BreadthFirst::new(mesh.n_vertices());
        for &v in &seeds {
            marked[v as usize] = true;
            search.start(VertexId(v));
        }
        mesh.dilate_vertices(&mut marked, rings);
        while let Some(v) = search.visit() {
            for (_, w) in mesh.spokes(v) {
                search.reach(w, ());
            }
        }
        for v in mesh.vertices() {
            prop_assert_eq!(marked[v.index()], search.depth(v).is_some_and(|d| d as usize <= rings));
        }
        let faces = mesh.faces_touching(&marked);
        mesh.dilate_vertices(&mut marked, 1);
        prop_assert_eq!(mesh.vertices_of_faces(&faces), marked);
    }
}

#[test]
fn elements_at_equal_distance_are_settled_by_id() {
    let mut search: Dijkstra<u32, ()> = Dijkstra::new(5);
    for (at, d) in [(4, 1.0), (2, 1.0), (3, 0.5), (0, 1.0)] {
        assert!(search.start(at, d));
    }
    assert!(!search.start(2, 1.0) && !search.reach(2, 1.5, ()));
    let order: Vec<u32> = std::iter::from_fn(|| search.settle()).map(|s| s.0).collect();
    assert_eq!(order, [3, 0, 2, 4]);
    assert_eq!(search.path_to(1, |()| 0), None);
}

#[test]
fn spokes_are_all_edges_at_a_vertex_once() {
    for mesh in [square(3), torus(6, 5)] {
        for v in mesh.vertices() {
            let spokes: Vec<_> = mesh.spokes(v).collect();
            for &(h, w) in &spokes {
                let ends = [mesh.origin(h), mesh.target(h)];
                assert!(ends == [v, w] || ends == [w, v] && mesh.twin(h).is_none());
            }
            let mut edges: Vec<EdgeId> = spokes.iter().map(|s| mesh.edge(s.0)).collect();
            edges.sort_unstable();
            let wanted: Vec<EdgeId> = mesh.edges().filter(|&e| mesh.edge_vertices(e).contains(&v)).collect();
            assert_eq!(edges, wanted);
        }
        for f in mesh.faces() {
            for (h, g) in mesh.adjacent_faces(f) {
                assert!(
                    mesh.face(h) == f && mesh.adjacent_faces(g).any(|(t, back)| back == f && mesh.twin(h) == Some(t))
                );
            }
        }
    }
}

//! Loops through several anchors and curves from boundary to boundary, against plain Dijkstra.

use super::*;

/// Plain Dijkstra from `a` to every state, by at least one step.
fn distances(graph: &ElasticaGraph, mask: &DirectionMask, a: State) -> Vec<f32> {
    let mut dist = vec![f32::INFINITY; graph.n_states()];
    let mut queue = BinaryHeap::new();
    let mut from = (0.0, a);
    loop {
        let (d, e) = from;
        for f in graph.successors(e).filter(|&f| mask.is_open(f)) {
            let reached = d + graph.step(e, f);
            if reached < dist[f as usize] {
                dist[f as usize] = reached;
                queue.push(Reverse((reached.to_bits(), f)));
            }
        }
        let Some(Reverse((key, e))) = queue.pop() else { return dist };
        from = (f32::from_bits(key).max(dist[e as usize]), e);
    }
}

/// The cheapest round through the gates, by the metagraph of the source.
fn reference_round(graph: &ElasticaGraph, gates: &[Vec<State>]) -> f32 {
    let n = gates.len();
    let table: Vec<Vec<Vec<f32>>> = (0..n)
        .map(|i| {
            let next = &gates[(i + 1) % n];
            gates[i]
                .iter()
                .map(|&a| {
                    let d = distances(graph, &DirectionMask::none(), a);
                    next.iter().map(|&b| d[b as usize]).collect()
                })
                .collect()
        })
        .collect();
    let mut best = f32::INFINITY;
    for x in 0..gates[0].len() {
        let mut cost = vec![f32::INFINITY; gates[0].len()];
        cost[x] = 0.0;
        for leg in &table {
            let to = leg[0].len();
            cost = (0..to).map(|b| (0..leg.len()).map(|a| cost[a] + leg[a][b]).fold(f32::INFINITY, f32::min)).collect();
        }
        best = best.min(cost[x]);
    }
    best
}

#[test]
fn loops_through_anchors_are_exact() {
    let g = graph(ellipsoid(3, DVec3::new(1.0, 0.7, 0.5)));
    let mask = DirectionMask::none();
    let mut work = SearchWorkspace::new();
    let directed = |v: u32, d: DVec3| Anchor { vertex: VertexId(v), direction: Some(d) };
    let free = |v: u32| Anchor { vertex: VertexId(v), direction: None };
    let cases: [&[Anchor]; 5] = [
        &[free(10)],
        &[free(3), free(120)],
        &[free(40), directed(200, DVec3::X)],
        &[directed(40, DVec3::Y), directed(200, DVec3::Z), directed(77, DVec3::X)],
        &[free(5), free(5)],
    ];
    for anchors in cases {
        let gates: Vec<Vec<State>> = anchors
            .iter()
            .map(|a| match a.direction {
                Some(d) => g.nearest(&mask, a.vertex, d).into_iter().collect(),
                None => g.leaving(a.vertex).collect(),
            })
            .collect();
        let expected = f64::from(reference_round(&g, &gates));
        let query = AnchorQuery { anchors, mask: &mask, budget: u64::MAX };
        let found = g.loop_through(&query, &mut work, &Progress::new()).unwrap();
        assert!(found.proved);
        let l = &found.loops[0];
        assert!((l.cost - expected).abs() < 1e-4 * expected, "{anchors:?}: {}, expected {expected}", l.cost);
        assert!(anchors.iter().all(|a| l.path.contains(&a.vertex)));
        assert_eq!(l.path[0], anchors[0].vertex);
        assert_eq!(l.curve.check(g.mesh()), Ok(()));
    }
}

#[test]
fn anchors_on_an_open_surface_can_be_passed_from_boundary_to_boundary() {
    let g = graph(tube(24, 40));
    let mask = DirectionMask::none();
    let mut work = SearchWorkspace::new();
    let anchors = [10, 20, 30].map(|i| Anchor { vertex: VertexId(i), direction: Some(DVec3::Z) });
    let query = AnchorQuery { anchors: &anchors, mask: &mask, budget: u64::MAX };
    let l = &g.loop_through(&query, &mut work, &Progress::new()).unwrap().loops[0];
    assert!(!l.curve.closed && anchors.iter().all(|a| l.path.contains(&a.vertex)));
    assert_eq!(l.curve.check(g.mesh()), Ok(()));
    assert!((l.cost - l.length).abs() < 0.05 * l.length, "{} of length {}", l.cost, l.length);
}

#[test]
fn open_curves_are_exact() {
    for mesh in [Some(tube(16, 24)), real("half_torus.obj")].into_iter().flatten() {
        let g = graph(mesh);
        let v = sample(&g, 8).find(|&v| !g.mesh().is_boundary_vertex(v)).unwrap();
        let open = DirectionMask::none();
        let cheapest = compare_open(&g, &open, v);
        // Once a strip runs there, the ways of the open surface are only bounds.
        let mut mask = open.clone();
        close_along(&g, &cheapest, &mut mask);
        for w in sample(&g, 4).filter(|&w| !g.mesh().is_boundary_vertex(w)).chain([v]) {
            compare_open(&g, &mask, w);
        }
    }
}

/// Compares the cheapest open curve through a vertex inside the surface with what plain Dijkstra finds.
fn compare_open(g: &ElasticaGraph, mask: &DirectionMask, v: VertexId) -> crate::surface::SurfaceCurve {
    let half = |e: State| g.half_parts(e).iter().sum::<f32>();
    let ends = |e: State| g.mesh().is_boundary_vertex(VertexId(g.target[e as usize]));
    let home = |a: State| {
        let d = distances(g, mask, a);
        let onwards = (0..g.n_states() as State).filter(|&e| ends(e)).map(|e| d[e as usize] + half(e));
        onwards.fold(if ends(a) { half(a) } else { f32::INFINITY }, f32::min)
    };
    let out = g.leaving(v);
    let homes: Vec<f32> = out.clone().map(|a| if mask.is_open(a) { home(a) } else { f32::INFINITY }).collect();
    let pairs = out.clone().flat_map(|a| out.clone().map(move |b| (a, b)));
    let expected = pairs
        .filter(|&(a, b)| g.follows(g.reverse[b as usize], a))
        .map(|(a, b)| {
            let at = |s: State| homes[(s - out.start) as usize];
            at(a) + at(b) + g.step(g.reverse[b as usize], a)
        })
        .fold(f32::INFINITY, f32::min);
    let query = ProposalQuery { factor: 100.0, max: 1000, separation: 0.0, ..ProposalQuery::alternatives(v, mask) };
    let found = g.proposals(&query, &mut SearchWorkspace::new(), &Progress::new()).unwrap();
    let cheapest = found.loops.iter().find(|l| !l.curve.closed).unwrap();
    assert!((cheapest.cost - f64::from(expected)).abs() < 1e-5 * cheapest.cost, "{} {expected}", cheapest.cost);
    cheapest.curve.clone()
}

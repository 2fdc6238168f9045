//! Times the elastica graph and its search: `bench_search MESH [VERTICES] [RINGS] [RADIUS]`.
//!
//! For seeded random vertices it prints the time to the first loop, to the proved cheapest and to all alternatives,
//! and one plain Dijkstra over the whole search graph for comparison.

use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use plait_core::elastica::{
    Anchor, AnchorQuery, DirectionMask, ElasticaGraph, ElasticaOptions, ProposalQuery, SearchWorkspace,
};
use plait_core::mesh::{TriMesh, VertexId};
use plait_core::progress::Progress;
use plait_core::surface::principal_curvature;

fn read(path: &str) -> TriMesh {
    let text = std::fs::read_to_string(path).expect("a readable file");
    let off = path.ends_with(".off");
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    let mut n_points = usize::MAX;
    for line in text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#') && *l != "OFF") {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |i: usize| words[i].parse::<f64>().expect("a number");
        let corner = |i: usize| words[i].split('/').next().and_then(|w| w.parse::<u32>().ok()).expect("an index");
        if off && n_points == usize::MAX {
            n_points = number(0) as usize;
        } else if off && points.len() < n_points {
            points.push(DVec3::new(number(0), number(1), number(2)));
        } else if off {
            faces.push([corner(1), corner(2), corner(3)]);
        } else if words[0] == "v" {
            points.push(DVec3::new(number(1), number(2), number(3)));
        } else if words[0] == "f" {
            faces.push([corner(1) - 1, corner(2) - 1, corner(3) - 1]);
        }
    }
    let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let scale = 1.0 / low.distance(high);
    TriMesh::from_faces(points.iter().map(|p| (*p - low) * scale).collect(), &faces).expect("a manifold")
}

/// Median, 95th percentile and largest.
fn summary(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    let at = |q: f64| values[((values.len() - 1) as f64 * q).round() as usize];
    format!("{:9.2} {:9.2} {:9.2}", at(0.5), at(0.95), at(1.0))
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

#[allow(clippy::print_stdout)]
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let number = |i: usize, default: f64| args.get(i).map_or(default, |a| a.parse().expect("a number"));
    let mesh = Arc::new(read(args.get(1).expect("a mesh file")));
    let count = number(2, 200.0) as usize;
    let options = ElasticaOptions { rings: number(3, 4.0) as usize, ..ElasticaOptions::default() };
    let normal = |h| mesh.face_normal(mesh.face(h));
    let dihedral_limit = 50f64.to_radians().cos();
    let is_sharp = |h| mesh.twin(h).is_some_and(|t| normal(h).dot(normal(t)) < dihedral_limit);
    let sharp: Vec<bool> = mesh.edges().map(|e| is_sharp(mesh.halfedge(e))).collect();
    let progress = Progress::new();

    let start = Instant::now();
    let curvature = principal_curvature(&mesh, number(4, 0.03), &sharp);
    let curvature_ms = ms(start);
    let start = Instant::now();
    let graph = ElasticaGraph::build(mesh.clone(), &curvature, &sharp, &options, &progress).expect("a graph");
    println!(
        "{}: {} vertices, {} sharp edges, {} states, {:.1} steps each, {:.1} MB; curvature {curvature_ms:.0} ms, graph {:.0} ms",
        args[1],
        mesh.n_vertices(),
        sharp.iter().filter(|s| **s).count(),
        graph.n_states(),
        graph.n_steps() as f64 / graph.n_states() as f64,
        graph.bytes() as f64 / 1e6,
        ms(start),
    );
    let mut work = SearchWorkspace::new();
    let mask = DirectionMask::none();
    let start = Instant::now();
    work.prepare(&graph, &mask, &progress).expect("not cancelled");
    println!("boundary field {:.1} ms", ms(start));

    // A multiplicative generator is random enough to spread samples.
    let mut seed = 12345u64;
    let vertices: Vec<VertexId> = (0..count)
        .map(|_| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            VertexId::new((seed >> 33) as usize % mesh.n_vertices())
        })
        .collect();
    let (mut first, mut proved, mut states, mut ratio) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut cost, mut unproved, mut none) = (Vec::new(), 0, 0);
    for &v in &vertices {
        let start = Instant::now();
        let mut upper = None;
        let query = ProposalQuery::cheapest(v, &mask);
        let found = graph
            .proposals_with(&query, &mut work, &progress, |l| upper = Some((ms(start), l.cost)))
            .expect("not cancelled");
        proved.push(ms(start));
        states.push(100.0 * found.settled as f64 / graph.n_states() as f64);
        unproved += usize::from(!found.proved);
        none += usize::from(found.loops.is_empty());
        if let (Some((at, upper)), Some(best)) = (upper, found.loops.first()) {
            first.push(at);
            ratio.push(upper / best.cost);
            cost.push(best.cost);
        }
    }
    println!("                         median       p95       max");
    println!("first loop, ms        {}", summary(first));
    println!("proved cheapest, ms   {}   ({unproved} unproved, {none} without a loop)", summary(proved));
    println!("settled, % of states  {}", summary(states));
    println!("first / cheapest cost {}", summary(ratio));
    println!("cheapest cost         {}", summary(cost));
    let (mut all, mut routes, mut all_states, mut unproved) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for &v in vertices.iter().take(60) {
        let start = Instant::now();
        let query = ProposalQuery::alternatives(v, &mask);
        let found = graph.proposals(&query, &mut work, &progress).expect("not cancelled");
        all.push(ms(start));
        routes.push(found.loops.len() as f64);
        all_states.push(100.0 * found.settled as f64 / graph.n_states() as f64);
        unproved += usize::from(!found.proved);
    }
    println!("alternatives, ms      {}   ({unproved} unproved)", summary(all));
    println!("alternatives, count   {}", summary(routes));
    println!("settled, % of states  {}", summary(all_states));
    let anchor = |i: usize, turned: bool| {
        let vertex = vertices[i % count];
        let direction = turned.then(|| DVec3::new(i as f64, 7.0, -3.0 * i as f64).cross(mesh.position(vertex)));
        Anchor { vertex, direction }
    };
    for (name, per_loop, turned) in [("two free anchors, ms ", 2, false), ("three directions, ms  ", 3, true)] {
        let mut times = Vec::new();
        for i in 0..10 {
            let anchors: Vec<Anchor> = (0..per_loop).map(|k| anchor(per_loop * i + k, turned)).collect();
            let start = Instant::now();
            let query = AnchorQuery { anchors: &anchors, mask: &mask, budget: 20_000_000 };
            graph.loop_through(&query, &mut work, &progress).expect("not cancelled");
            times.push(ms(start));
        }
        println!("{name}{}", summary(times));
    }
    let start = Instant::now();
    let mut closed = DirectionMask::none();
    for f in mesh.faces() {
        graph.disable_near(&mut closed, f, mesh.vector(mesh.face_halfedges(f)[0]), std::f64::consts::FRAC_PI_4);
    }
    println!("closing directions in all faces, ms {:9.2}", ms(start));
    println!("plain Dijkstra, ms    {:9.2}", {
        let start = Instant::now();
        std::hint::black_box(graph.farthest(vertices[0]));
        ms(start)
    });
}

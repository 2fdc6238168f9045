//! Times what a designer waits for: `bench MESH [POINTS]`.
//!
//! Searches run from seeded random vertices; field, map and arrangement are those of the first strips that are
//! suggested. Beside them, from the same run, stands one plain Dijkstra over the whole search graph, so that
//! ratios can be compared between machines.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use plait_core::dual::{Arrangement, Mark, assess};
use plait_core::elastica::{DirectionMask, ElasticaGraph, ElasticaOptions, ProposalQuery, SearchWorkspace};
use plait_core::field::{self, Metric, trace_curves};
use plait_core::mesh::{VertexId, load};
use plait_core::progress::Progress;
use plait_core::strip::StripMap;
use plait_core::weave::{Goal, MeshSource, Model, Options, Session};

/// Strips placed before field, map and arrangement are timed.
const STRIPS: usize = 6;
/// Repetitions of what is timed as a whole.
const REPEATS: usize = 5;

#[allow(clippy::print_stdout, reason = "a benchmark prints its figures")]
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let path = args.get(1).expect("usage: bench MESH [POINTS]");
    let points = args.get(2).map_or(200, |a| a.parse().expect("a number of points"));
    let loaded = load(Path::new(path)).expect("a mesh");
    let progress = Progress::new();
    let start = Instant::now();
    let model = Model::prepare(loaded.clone(), Options::default(), &progress).expect("a model");
    let ready = ms(start);
    println!("{path}: {} triangles, {} threads", model.mesh.n_faces(), rayon::current_num_threads());
    println!("{:<34}{:>10} {:>9} {:>9}", "milliseconds", "median", "p95", "worst");
    row("made ready, all of it", vec![ready]);
    let options = ElasticaOptions::default();
    row(
        "search graph",
        repeat(|| {
            let graph =
                ElasticaGraph::build(Arc::clone(&model.mesh), &model.curvature, &model.sharp, &options, &progress);
            std::hint::black_box(graph.expect("a graph").n_states());
        }),
    );
    searches(&model, points, &progress);
    maps(loaded, path, &progress);
    row(
        "plain Dijkstra over the graph",
        repeat(|| {
            std::hint::black_box(model.graph.farthest(VertexId(0)));
        }),
    );
    println!("search graph: {} states, {:.1} MB", model.graph.n_states(), model.graph.bytes() as f64 / 1e6);
}

fn searches(model: &Model, points: usize, progress: &Progress) {
    let mut work = SearchWorkspace::new();
    let mask = DirectionMask::none();
    work.prepare(&model.graph, &mask, progress).expect("not cancelled");
    let (mut first, mut proved, mut all, mut ratio) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut seed = 12345u64;
    for _ in 0..points {
        // A multiplicative generator is random enough to spread samples.
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let vertex = VertexId::new((seed >> 33) as usize % model.mesh.n_vertices());
        let start = Instant::now();
        let mut upper = None;
        let query = ProposalQuery::cheapest(vertex, &mask);
        let found = model
            .graph
            .proposals_with(&query, &mut work, progress, |l| upper = Some((ms(start), l.cost)))
            .expect("not cancelled");
        proved.push(ms(start));
        if let (Some((at, upper)), Some(best)) = (upper, found.loops.first()) {
            first.push(at);
            ratio.push(upper / best.cost);
        }
        let start = Instant::now();
        let query = ProposalQuery::alternatives(vertex, &mask);
        std::hint::black_box(model.graph.proposals(&query, &mut work, progress).expect("not cancelled"));
        all.push(ms(start));
    }
    row("first loop", first);
    row("proved cheapest", proved);
    row("all alternatives to 1.5 × cheapest", all);
    row("(cost of the first / cheapest)", ratio);
}

#[allow(clippy::print_stdout, reason = "a benchmark prints its figures")]
fn maps(loaded: plait_core::mesh::LoadedMesh, path: &str, progress: &Progress) {
    let source = MeshSource::File(path.into());
    let mut session = Session::open(loaded, source, Options::default(), progress).expect("a session");
    while session.design().strips.len() < STRIPS {
        let Ok(proposal) = session.suggest(Goal::Separated, progress) else { break };
        session.place(proposal, progress).expect("a strip on the mesh");
    }
    let model = session.model();
    let strips = &session.design().strips;
    println!("with {} strips:", strips.len());
    row(
        "arrangement and assessment",
        repeat(|| {
            let arrangement = Arrangement::new(&model.mesh, strips.iter().map(|s| &s.curve)).expect("an arrangement");
            std::hint::black_box(assess(&arrangement, &model.mesh, &model.corners));
        }),
    );
    let woven = session.woven();
    let mesh = &woven.mesh;
    let curve = |e| match woven.arrangement.refined.mark(mesh.halfedge(e).0) {
        Mark::Curve(c) => Some(c),
        _ => None,
    };
    let curves: Vec<Option<u32>> = mesh.edges().map(curve).collect();
    let metric = Metric::new(mesh);
    let paths = trace_curves(mesh, &metric, &curves).expect("curves");
    row(
        "cross field",
        repeat(|| {
            std::hint::black_box(field::interpolate(mesh, &metric, &paths, &[], progress).expect("a field"));
        }),
    );
    let crosses = field::interpolate(mesh, &metric, &paths, &[], progress).expect("a field");
    row(
        "parameterization and strips",
        repeat(|| {
            let map = StripMap::along_field(mesh, &metric, &paths, crosses.clone(), progress);
            std::hint::black_box(map.expect("a map"));
        }),
    );
}

fn repeat(mut work: impl FnMut()) -> Vec<f64> {
    (0..REPEATS)
        .map(|_| {
            let start = Instant::now();
            work();
            ms(start)
        })
        .collect()
}

/// Prints median, 95th percentile and largest.
#[allow(clippy::print_stdout, reason = "a benchmark prints its figures")]
fn row(name: &str, mut values: Vec<f64>) {
    values.sort_by(f64::total_cmp);
    let at = |q: f64| values.get(((values.len().max(1) - 1) as f64 * q).round() as usize).copied().unwrap_or(f64::NAN);
    println!("{name:<34}{:>10.2} {:>9.2} {:>9.2}", at(0.5), at(0.95), at(1.0));
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

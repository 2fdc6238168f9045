//! Reference measurements of the same run, so that reports of different machines can be compared as ratios.

use std::time::{Duration, Instant};

use plait_core::mesh::{TriMesh, VertexId};
use plait_core::solve::{SparseHermitian, SpdSymbolic};
use plait_core::weave::Model;

use super::super::arguments::bench::RunArguments;
use super::report::Report;

/// Group of the rows in the report; the name stays, since stored reports have it.
pub(super) const GROUP: &str = "yardsticks";
/// Row of one search over the whole graph.
pub(super) const DIJKSTRA: &str = "plain Dijkstra over the graph";
/// Row of one factorisation, symbolic analysis included.
pub(super) const FACTORED: &str = "mesh Laplacian analysed and factored";

/// Times both references.
pub(super) fn measure(model: &Model, arguments: &RunArguments, report: &mut Report) -> anyhow::Result<()> {
    let dijkstra = repeated(arguments, || {
        std::hint::black_box(model.graph.eccentricity(VertexId(0)));
        Ok(())
    })?;
    report.add_times(GROUP, DIJKSTRA, &dijkstra);
    let matrix = laplacian(&model.mesh);
    let factored = repeated(arguments, || {
        std::hint::black_box(SpdSymbolic::new(&matrix)?.factor(&matrix)?);
        Ok(())
    })?;
    report.add_times(GROUP, FACTORED, &factored);
    Ok(())
}

fn repeated(arguments: &RunArguments, mut work: impl FnMut() -> anyhow::Result<()>) -> anyhow::Result<Vec<Duration>> {
    let mut times = Vec::new();
    let start = Instant::now();
    while times.len() < arguments.repeats as usize && start.elapsed() <= arguments.limit() {
        let now = Instant::now();
        work()?;
        times.push(now.elapsed());
    }
    Ok(times)
}

/// The graph Laplacian of the mesh, with a small diagonal term that makes it positive definite. The cost of its
/// factorisation depends on the sparsity pattern alone, so all weights are 1: no triangle shape makes it indefinite.
fn laplacian(mesh: &TriMesh) -> SparseHermitian<f64> {
    /// Diagonal term, relative to the edge weights; chosen by hand.
    const SHIFT: f64 = 1e-6;
    let edges = mesh.edges().flat_map(|e| {
        let [a, b] = mesh.edge_vertices(e).map(|v| v.0);
        [(a, a, 1.0), (b, b, 1.0), (a, b, -1.0)]
    });
    let triplets: Vec<(u32, u32, f64)> = mesh.vertices().map(|v| (v.0, v.0, SHIFT)).chain(edges).collect();
    SparseHermitian::from_triplets(mesh.n_vertices(), &triplets)
}

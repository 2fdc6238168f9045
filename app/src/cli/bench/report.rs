//! The results of one benchmark run.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use plait_core::progress::{Progress, StageTime};
use plait_core::weave::Model;
use serde::{Deserialize, Serialize};

use super::machine::{Machine, Program};

/// The results of one run, with everything they depend on. Written and read as JSON.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Report {
    pub(super) program: Program,
    pub(super) machine: Machine,
    /// Threads used.
    pub(super) threads: usize,
    /// Seed of the points.
    pub(super) seed: u64,
    pub(super) mesh: MeshFacts,
    pub(super) graph: GraphFacts,
    pub(super) rows: Vec<Row>,
    /// Peak memory in bytes; `None` if the system does not tell.
    pub(super) peak_memory: Option<u64>,
}

/// The mesh of a run.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct MeshFacts {
    pub(super) name: String,
    pub(super) vertices: usize,
    pub(super) triangles: usize,
    pub(super) genus: usize,
    pub(super) boundary_loops: usize,
    /// Number of subdivisions applied to it.
    pub(super) subdivided: u32,
    /// Number of triangles of the proxy, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) proxy: Option<usize>,
}

/// Size of the search graph (section 8.2).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct GraphFacts {
    /// Directed edges of `g`, the states of the search.
    pub(super) states: usize,
    /// Edges of `g'`, the steps between states.
    pub(super) steps: usize,
    pub(super) bytes: usize,
}

/// Unit of the values of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Unit {
    Milliseconds,
    /// A number without unit.
    Number,
}

/// One repeated measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Row {
    /// Group of rows it belongs to.
    pub(super) group: String,
    pub(super) what: String,
    pub(super) unit: Unit,
    /// Number of measurements.
    pub(super) count: usize,
    pub(super) median: f64,
    /// The 95th percentile.
    pub(super) p95: f64,
    pub(super) worst: f64,
}

impl Report {
    /// An empty report of this machine and program.
    pub(super) fn new(seed: u64) -> Self {
        Self {
            program: Program::here(),
            machine: Machine::here(),
            threads: rayon::current_num_threads(),
            seed,
            mesh: MeshFacts::default(),
            graph: GraphFacts::default(),
            rows: Vec::new(),
            peak_memory: None,
        }
    }

    /// Fills in mesh and graph.
    pub(super) fn describe(&mut self, model: &Model, subdivided: u32) {
        self.mesh = MeshFacts {
            name: model.loaded.name.clone(),
            vertices: model.loaded.mesh.n_vertices(),
            triangles: model.loaded.mesh.n_faces(),
            genus: model.topology.genus,
            boundary_loops: model.topology.boundary_loops.len(),
            subdivided,
            proxy: model.proxy.as_ref().map(|p| p.mesh().n_faces()),
        };
        let graph = &model.graph;
        self.graph = GraphFacts { states: graph.n_states(), steps: graph.n_steps(), bytes: graph.bytes() };
    }

    /// Adds a row, unless there are no values.
    pub(super) fn add(&mut self, group: &str, what: &str, unit: Unit, mut values: Vec<f64>) {
        values.sort_by(f64::total_cmp);
        let Some(last) = values.len().checked_sub(1) else { return };
        // The smallest value that at least this share of the values does not exceed.
        let at = |q: f64| values[((values.len() as f64 * q).ceil() as usize).clamp(1, values.len()) - 1];
        self.rows.push(Row {
            group: group.into(),
            what: what.into(),
            unit,
            count: values.len(),
            median: at(0.5),
            p95: at(0.95),
            worst: values[last],
        });
    }

    /// Adds a row of times.
    pub(super) fn add_times(&mut self, group: &str, what: &str, times: &[Duration]) {
        self.add(group, what, Unit::Milliseconds, times.iter().map(|t| t.as_secs_f64() * 1e3).collect());
    }

    /// The row of this group and name.
    pub(super) fn row(&self, group: &str, what: &str) -> Option<&Row> {
        self.rows.iter().find(|r| r.group == group && r.what == what)
    }

    /// Reads reports from files.
    pub(super) fn read_all(paths: &[PathBuf]) -> anyhow::Result<Vec<Self>> {
        let read = |path: &PathBuf| {
            let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
            serde_json::from_str(&text).with_context(|| format!("{} is not a benchmark report", path.display()))
        };
        paths.iter().map(read).collect()
    }
}

/// Repeated times of work, by stage.
#[derive(Debug, Default)]
pub(super) struct Staged {
    totals: Vec<Duration>,
    /// Stages in order of appearance, with the milliseconds of each repetition.
    stages: Vec<(String, Vec<f64>)>,
}

impl Staged {
    /// Times `work`, which reports its stages to the [`Progress`].
    pub(super) fn time<T, E>(&mut self, work: impl FnOnce(&Progress) -> Result<T, E>) -> Result<T, E> {
        let progress = Progress::new();
        let start = Instant::now();
        let result = work(&progress)?;
        self.totals.push(start.elapsed());
        for StageTime { stage, seconds, .. } in progress.stage_times() {
            match self.stages.iter_mut().find(|(name, _)| *name == stage) {
                Some((_, values)) => values.push(seconds * 1e3),
                None => self.stages.push((stage, vec![seconds * 1e3])),
            }
        }
        Ok(result)
    }

    /// Total time of each repetition.
    pub(super) fn totals(&self) -> &[Duration] {
        &self.totals
    }

    /// Sum over all repetitions.
    pub(super) fn spent(&self) -> Duration {
        self.totals.iter().sum()
    }

    /// Adds a row for each stage, and one called `total`.
    pub(super) fn write(self, report: &mut Report, group: &str, total: &str) {
        // A stage that is followed by another at once did no work of its own.
        let works = |values: &[f64]| values.iter().any(|&ms| ms > 0.01);
        for (stage, values) in self.stages.into_iter().filter(|s| works(&s.1)) {
            report.add(group, &stage, Unit::Milliseconds, values);
        }
        report.add_times(group, total, &self.totals);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_measured_values() {
        let mut report = Report::new(1);
        report.add("g", "all", Unit::Number, (1..=100).rev().map(f64::from).collect());
        report.add("g", "one", Unit::Number, vec![3.0]);
        report.add("g", "none", Unit::Number, Vec::new());
        let all = report.row("g", "all").unwrap();
        assert_eq!((all.count, all.median, all.p95, all.worst), (100, 50.0, 95.0, 100.0));
        let one = report.row("g", "one").unwrap();
        assert_eq!((one.median, one.p95, one.worst), (3.0, 3.0, 3.0));
        assert!(report.row("g", "none").is_none());
        let text = serde_json::to_string(&report).unwrap();
        assert_eq!(serde_json::from_str::<Report>(&text).unwrap(), report);
    }
}

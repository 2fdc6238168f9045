//! Time to find proposals, at random points and along strokes of a moving pointer, with more and more strips placed.

use std::time::{Duration, Instant};

use plait_core::elastica::{ProposalQuery, SearchWorkspace, Selection};
use plait_core::progress::Progress;
use plait_core::surface::{Metric, SurfacePoint};
use plait_core::weave::Session;

use super::super::arguments::bench::RunArguments;
use super::points::Points;
use super::report::{Report, Unit};
use super::strips;

/// Row: time until the first loop is found.
pub(super) const SHOWN: &str = "a loop shown";
/// Row: time until the search has proved which loop is best.
pub(super) const PROVED: &str = "proved best";
/// Row: time of the search for all loops of at most 1.5 times the cost of the best.
pub(super) const ALTERNATIVES: &str = "alternatives to 1.5 × best";
/// Row: time until the window shows the best loop, relaxed.
const BEST: &str = "the best loop, relaxed";
/// Row: time until the window has all alternatives, relaxed.
const ALL: &str = "all proposals, relaxed";

/// Row: elastic energy of the best loop before relaxation.
const ENERGY: &str = "length and bending of the best loop";
/// Row: elastic energy of the proposed curve, after relaxation.
const RELAXED: &str = "the same, relaxed";
/// Row: ratio of the two energies.
const RELAXED_SHARE: &str = "the same, relaxed / found";

/// Number of points of one stroke of the pointer.
const STROKE: usize = 25;
/// Distance between them, as a fraction of the model size: a few pixels in the window.
const STEP: f64 = 0.004;

/// Group of the rows in the report, for this number of placed strips.
pub(super) fn group(strips: usize) -> String {
    format!("hover, {strips} strips")
}

/// Times proposals, for each number of strips in the arguments.
pub(super) fn measure(session: &mut Session, arguments: &RunArguments, report: &mut Report) -> anyhow::Result<()> {
    let mut counts = arguments.strips.clone();
    counts.sort_unstable();
    counts.dedup();
    let mut placements = strips::Placements::new(session, arguments.seed);
    for count in counts {
        while session.design().strips.len() < count {
            if !placements.place(session, |s, proposal, progress| s.place(proposal, progress))? {
                return Ok(());
            }
        }
        searches(session, arguments, &group(count), report)?;
        if !arguments.search_only {
            pointer(session, arguments, &group(count), report)?;
        }
    }
    Ok(())
}

/// Times the search alone, at random points. Never inlined: `scripts/instructions.sh` counts its instructions.
#[inline(never)]
fn searches(session: &Session, arguments: &RunArguments, group: &str, report: &mut Report) -> anyhow::Result<()> {
    let (model, mask) = (session.model(), &session.woven().mask);
    let progress = Progress::new();
    let mut work = SearchWorkspace::new();
    let start = Instant::now();
    model.graph.prepare_boundary_costs(&progress)?;
    if !model.topology.boundary_loops.is_empty() {
        report.add_times(group, "ways to the boundary, once", &[start.elapsed()]);
    }
    let mut figures = Figures::default();
    let mut points = Points::new(&model.mesh, arguments.seed);
    let start = Instant::now();
    for _ in 0..arguments.points {
        let vertex = points.point().nearest_vertex(&model.mesh);
        let now = Instant::now();
        let mut shown = None;
        let query = ProposalQuery::cheapest(vertex, mask);
        let best = model.graph.proposals_with(&query, &mut work, &progress, |_, l| {
            shown.get_or_insert((now.elapsed(), l.cost));
        })?;
        figures.proved.push(now.elapsed());
        figures.settled.push(best.settled as f64);
        let now = Instant::now();
        let classes = Some(&session.woven().classes);
        let selection = Selection { classes, ..Selection::alternatives() };
        let query = ProposalQuery { selection, ..ProposalQuery::alternatives(vertex, mask) };
        let all = model.graph.proposals(&query, &mut work, &progress)?;
        figures.alternatives.push(now.elapsed());
        figures.settled_all.push(all.settled as f64);
        figures.loops.push(all.loops.len() as f64);
        figures.unproved += f64::from(u8::from(!(best.proved && all.proved)));
        if let (Some((at, cost)), Some(best)) = (shown, best.loops.first()) {
            figures.shown.push(at);
            figures.excess.push(cost / best.cost);
        }
        if start.elapsed() > arguments.limit() {
            break;
        }
    }
    figures.write(report, group);
    Ok(())
}

#[derive(Default)]
struct Figures {
    shown: Vec<Duration>,
    proved: Vec<Duration>,
    alternatives: Vec<Duration>,
    /// Cost of the first loop relative to the best.
    excess: Vec<f64>,
    loops: Vec<f64>,
    settled: Vec<f64>,
    settled_all: Vec<f64>,
    unproved: f64,
}

impl Figures {
    fn write(self, report: &mut Report, group: &str) {
        report.add_times(group, SHOWN, &self.shown);
        report.add_times(group, PROVED, &self.proved);
        report.add_times(group, ALTERNATIVES, &self.alternatives);
        let searched = !self.proved.is_empty();
        let numbers = [
            ("cost of the loop shown / best", self.excess),
            ("loops proposed", self.loops),
            ("states settled for the best", self.settled),
            ("states settled for all", self.settled_all),
            ("points not proved in time", if searched { vec![self.unproved] } else { Vec::new() }),
        ];
        for (what, values) in numbers {
            report.add(group, what, Unit::Number, values);
        }
    }
}

/// Times what the window does, at random points and along strokes.
fn pointer(session: &mut Session, arguments: &RunArguments, group: &str, report: &mut Report) -> anyhow::Result<()> {
    let model = session.model().clone();
    let mesh = &model.loaded.mesh;
    let metric = Metric::new(mesh);
    let mut points = Points::new(mesh, arguments.seed);
    let scattered: Vec<SurfacePoint> = (0..arguments.points).map(|_| points.point()).collect();
    let strokes = arguments.points.div_ceil(STROKE);
    let moving: Vec<SurfacePoint> =
        (0..strokes).flat_map(|_| points.stroke(mesh, &metric, STROKE, STEP)).take(arguments.points).collect();
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for (name, list) in [("pointer", scattered), ("moving pointer", moving)] {
        let (mut shown, mut proved, mut all) = (Vec::new(), Vec::new(), Vec::new());
        let progress = Progress::new();
        let start = Instant::now();
        for at in list {
            let now = Instant::now();
            let (mut first, mut best) = (None, None);
            let proposals = session.proposals_with(at, &progress, |proposal| {
                drop(model.on_design_mesh(&proposal.curve));
                best = Some(now.elapsed());
                first = first.or(best);
            })?;
            all.push(now.elapsed());
            shown.extend(first);
            proved.extend(best);
            if let Some(energy) = proposals.first().and_then(|p| p.energy) {
                before.push(energy.found);
                after.push(energy.relaxed);
            }
            if start.elapsed() > arguments.limit() {
                break;
            }
        }
        report.add_times(group, &format!("{name}: {SHOWN}"), &shown);
        report.add_times(group, &format!("{name}: {BEST}"), &proved);
        report.add_times(group, &format!("{name}: {ALL}"), &all);
    }
    let share = before.iter().zip(&after).map(|(before, after)| after / before).collect();
    for (what, values) in [(ENERGY, before), (RELAXED, after), (RELAXED_SHARE, share)] {
        report.add(group, what, Unit::Number, values);
    }
    Ok(())
}

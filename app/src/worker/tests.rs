//! Tests of the worker, with an engine whose operations last as long as the test needs.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use plait_core::mesh::{FaceId, TriMesh};
use plait_core::progress::Progress;
use plait_core::surface::{SurfaceCurve, SurfaceIndex, SurfacePoint};
use plait_core::weave::Improvement;

use super::*;
use crate::engine::{
    BuiltIn, Detail, EmbeddingStep, Engine, EngineError, ExportOptions, ExportReport, LayoutPart, LayoutPreview,
    Proposal, Scene, Search, Source, StripId,
};

/// An engine whose proposals have the number of the picked face as their cost. Undo runs until it is cancelled, redo
/// panics, improving and optimising run until they are stopped.
struct Fake(Arc<Scene>);

struct FakeOpener;

impl Opener for FakeOpener {
    fn built_ins(&self) -> Vec<BuiltIn> {
        Vec::new()
    }

    fn open(&self, _: &Source, _: &Progress) -> Result<Box<dyn Engine>, EngineError> {
        let p = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let mesh = TriMesh::from_faces(p, &[[0, 1, 2]]).map_err(|e| EngineError::failed(e.to_string()))?;
        Ok(Box::new(Fake(Arc::new(Scene {
            model: Arc::default(),
            index: Arc::new(SurfaceIndex::new(&mesh)),
            design_mesh: Arc::new(mesh),
            surface: Arc::default(),
            strips: Vec::new(),
            remarks: Vec::new(),
            summary: String::new(),
            exportable: false,
            layout: None,
            embedding: None,
            detail: Detail::default(),
            can_undo: false,
            can_redo: false,
        }))))
    }
}

fn until_cancelled(progress: &Progress) -> EngineError {
    let start = Instant::now();
    while !progress.is_cancelled() && start.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(1));
    }
    EngineError::Cancelled
}

impl Engine for Fake {
    fn proposals(
        &mut self,
        search: &Search,
        _: &mut dyn FnMut(Proposal),
        progress: &Progress,
    ) -> Result<Vec<Proposal>, EngineError> {
        let Search::Point(at) = search else { return Err(EngineError::failed("no anchors here")) };
        if at.face.index() == 0 {
            return Err(until_cancelled(progress));
        }
        let curve = SurfaceCurve { crossings: Vec::new(), closed: true };
        Ok(vec![Proposal {
            curve,
            cost: at.face.index() as f64,
            energy: None,
            polyline: Vec::new(),
            anchors: Vec::new(),
        }])
    }
    fn place(&mut self, _: &Proposal, _: Option<StripId>, _: &Progress) -> Result<StripId, EngineError> {
        Ok(StripId(0))
    }
    fn remove(&mut self, _: StripId, _: &Progress) -> Result<(), EngineError> {
        Ok(())
    }
    fn undo(&mut self, progress: &Progress) -> Result<(), EngineError> {
        Err(until_cancelled(progress))
    }
    fn redo(&mut self, _: &Progress) -> Result<(), EngineError> {
        panic!("the panic of this test")
    }
    fn set_visible(&mut self, _: StripId, _: bool) -> Result<(), EngineError> {
        Ok(())
    }
    fn suggest(&mut self, _: &Progress) -> Result<Proposal, EngineError> {
        Err(EngineError::failed("nothing helps"))
    }
    fn improve(
        &mut self,
        watch: &mut dyn FnMut(Arc<Scene>, Improvement) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<Improvement, EngineError> {
        for changes in 1.. {
            progress.check()?;
            let improvement = Improvement { changes, ..Improvement::default() };
            if watch(self.scene(), improvement).is_break() {
                return Ok(improvement);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Err(EngineError::failed("never"))
    }
    fn set_detail(&mut self, _: Detail, _: &Progress) -> Result<(), EngineError> {
        Ok(())
    }
    fn set_pinned(&mut self, _: LayoutPart, _: bool) -> Result<(), EngineError> {
        Ok(())
    }
    fn optimise(
        &mut self,
        watch: &mut dyn FnMut(EmbeddingStep) -> ControlFlow<()>,
        progress: &Progress,
    ) -> Result<(), EngineError> {
        for step in 0.. {
            progress.check()?;
            let layout = LayoutPreview::default();
            if watch(EmbeddingStep { step, energy: 1.0, flipped: 0, layout }).is_break() {
                break;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }
    fn scene(&self) -> Arc<Scene> {
        Arc::clone(&self.0)
    }
    fn complete(&mut self, _: &Progress) -> Result<bool, EngineError> {
        Ok(false)
    }
    fn save(&self, _: &Path) -> Result<(), EngineError> {
        Ok(())
    }
    fn export(&mut self, _: &Path, _: &ExportOptions, _: &Progress) -> Result<ExportReport, EngineError> {
        Ok(ExportReport::default())
    }
}

fn worker() -> Worker {
    let worker = Worker::start(Arc::new(FakeOpener), || ()).unwrap();
    worker.request(Job::Open(Source::BuiltIn("fake".into())));
    assert!(matches!(reply(&worker), Reply::Opened { .. }));
    worker
}

fn reply(worker: &Worker) -> Reply {
    worker.replies.recv_timeout(Duration::from_secs(20)).unwrap()
}

fn point(face: usize) -> Search {
    Search::Point(SurfacePoint { face: FaceId::new(face), weights: [1.0 / 3.0; 3] })
}

fn running(worker: &Worker, label: &str) {
    let start = Instant::now();
    while worker.running().is_none_or(|r| r.label != label) {
        assert!(start.elapsed() < Duration::from_secs(20));
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn the_latest_search_request_cancels_the_running_one() {
    let worker = worker();
    worker.search(point(0));
    running(&worker, "Searching for strips");
    worker.search(point(3));
    let latest = worker.search(point(5));
    // The first was cancelled; the last reply is the one of the latest request.
    loop {
        let Reply::Proposals { generation, proposals, complete: true } = reply(&worker) else {
            panic!("not an answer")
        };
        if generation == latest {
            assert_eq!(proposals[0].cost, 5.0);
            break;
        }
    }
}

#[test]
fn jobs_precede_and_drop_search_requests() {
    let worker = worker();
    worker.search(point(0));
    running(&worker, "Searching for strips");
    worker.request(Job::Save("x".into()));
    assert!(matches!(reply(&worker), Reply::Saved(_)));
    assert!(worker.reply().is_none());
}

#[test]
fn cancelling_drops_the_jobs_that_wait() {
    let worker = worker();
    worker.request(Job::Undo);
    running(&worker, "Undoing");
    worker.request(Job::Save("x".into()));
    worker.cancel();
    assert!(matches!(reply(&worker), Reply::Failed { error: EngineError::Cancelled, .. }));
    worker.request(Job::Suggest);
    let Reply::Failed { error, .. } = reply(&worker) else { panic!("not a failure") };
    assert_eq!(error.to_string(), "nothing helps");
}

#[test]
fn an_improvement_sends_scenes_and_is_stopped_or_cancelled() {
    let worker = worker();
    worker.request(Job::Improve);
    let mut shown = 0;
    while shown < 3 {
        let Reply::StripsImproved { complete: false, improvement, .. } = reply(&worker) else { panic!("not a step") };
        shown = improvement.changes;
    }
    worker.stop();
    let done = loop {
        match reply(&worker) {
            Reply::StripsImproved { complete: false, .. } => {}
            Reply::StripsImproved { improvement, .. } => break improvement,
            other => panic!("{other:?}"),
        }
    };
    assert!(done.changes >= shown);

    worker.request(Job::Improve);
    running(&worker, "Improving the layout");
    worker.cancel();
    // The scenes shown meanwhile are replaced by the present one.
    let mut back = false;
    loop {
        match reply(&worker) {
            Reply::StripsImproved { .. } => {}
            Reply::Changed(_) => back = true,
            Reply::Failed { error: EngineError::Cancelled, .. } => break,
            other => panic!("{other:?}"),
        }
    }
    assert!(back);
}

/// The first reply after the steps of an optimisation, and how many those were.
fn after_steps(worker: &Worker) -> (usize, Reply) {
    let mut steps = 0;
    loop {
        match reply(worker) {
            Reply::EmbeddingStep(_) => steps += 1,
            other => return (steps, other),
        }
    }
}

#[test]
fn a_stopped_optimisation_is_kept_and_a_cancelled_one_is_not() {
    let worker = worker();
    worker.request(Job::Optimise);
    running(&worker, "Optimising the embedding");
    worker.stop();
    let (steps, last) = after_steps(&worker);
    assert!(steps > 0 && matches!(last, Reply::Optimised(_)), "{last:?}");
    worker.request(Job::Optimise);
    running(&worker, "Optimising the embedding");
    worker.cancel();
    let (_, last) = after_steps(&worker);
    assert!(matches!(last, Reply::Failed { error: EngineError::Cancelled, .. }), "{last:?}");
}

#[test]
fn jobs_that_change_strips_cancel_an_optimisation_and_others_wait() {
    let worker = worker();
    worker.request(Job::Optimise);
    running(&worker, "Optimising the embedding");
    worker.request(Job::Remove(StripId(0)));
    let (_, last) = after_steps(&worker);
    assert!(matches!(last, Reply::Failed { error: EngineError::Cancelled, .. }), "{last:?}");
    assert!(matches!(reply(&worker), Reply::Changed(_)));

    worker.request(Job::Optimise);
    running(&worker, "Optimising the embedding");
    worker.request(Job::Save("x".into()));
    worker.stop();
    assert!(matches!(after_steps(&worker).1, Reply::Optimised(_)));
    assert!(matches!(reply(&worker), Reply::Saved(_)));
}

#[test]
fn a_panic_of_the_engine_costs_one_operation_only() {
    let worker = worker();
    worker.request(Job::Redo);
    let Reply::Failed { error, .. } = reply(&worker) else { panic!("not a failure") };
    assert!(error.to_string().contains("internal error"));
    worker.request(Job::Save("x".into()));
    assert!(matches!(reply(&worker), Reply::Saved(_)));
}

#[test]
fn opening_a_model_drops_the_jobs_that_wait() {
    let worker = worker();
    worker.request(Job::Undo);
    running(&worker, "Undoing");
    worker.request(Job::Save("x".into()));
    worker.request(Job::Open(Source::BuiltIn("other".into())));
    assert!(matches!(reply(&worker), Reply::Failed { error: EngineError::Cancelled, .. }));
    assert!(matches!(reply(&worker), Reply::Opened { source: Source::BuiltIn(name), .. } if name == "other"));
}

#[test]
fn jobs_without_a_model_fail_and_search_requests_have_no_reply() {
    let worker = Worker::start(Arc::new(FakeOpener), || ()).unwrap();
    worker.search(point(1));
    worker.request(Job::Suggest);
    let Reply::Failed { error, .. } = reply(&worker) else { panic!("not a failure") };
    assert_eq!(error.to_string(), "no model is open");
    assert!(worker.reply().is_none());
}

//! The worker: a thread that owns the engine, so that the window never waits.
//!
//! Requests that change something are queued and done in order. Of hover requests only the latest counts: a newer
//! one, or any change, cancels the one being worked on. An optimisation of the embedding hands out what it has so far, may
//! be stopped, and is dropped by any change of the strips. Opening cancels everything. Every reply wakes the window.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use plait_core::progress::Progress;
use plait_core::surface::SurfacePoint;

use crate::engine::{
    EmbeddingStep, Engine, EngineError, ExportOptions, ExportReport, LayoutPart, Opener, Proposal, Scene, Source,
    StripId,
};

/// Something to be done, in order.
#[derive(Debug, Clone)]
pub enum Job {
    /// Open a model or a design in place of the present one.
    Open(Source),
    /// Place a proposal.
    Place(Proposal),
    /// Remove a strip.
    Remove(StripId),
    /// Show or hide a strip.
    SetVisible(StripId, bool),
    /// Take back.
    Undo,
    /// Make again.
    Redo,
    /// Find the strip that helps most and place it.
    Suggest,
    /// Pin a part of the layout, or let it go.
    SetPinned(LayoutPart, bool),
    /// Optimise the embedding of the layout.
    Optimise,
    /// Write the design.
    Save(PathBuf),
    /// Write the finished layout into a folder.
    Export(PathBuf, ExportOptions),
}

impl Job {
    /// What is being done, for the progress bar.
    pub fn label(&self) -> String {
        match self {
            Self::Open(source) => format!("Opening {}", source.name()),
            Self::Place(_) => "Placing the strip".into(),
            Self::Remove(_) => "Removing the strip".into(),
            Self::SetVisible(..) => "Updating the view".into(),
            Self::Undo => "Undoing".into(),
            Self::Redo => "Redoing".into(),
            Self::Suggest => "Looking for the strip that helps most".into(),
            Self::SetPinned(..) => "Pinning".into(),
            Self::Optimise => "Optimising the embedding".into(),
            Self::Save(_) => "Saving the design".into(),
            Self::Export(..) => "Exporting the layout".into(),
        }
    }

    /// Whether it makes any work on the present layout useless.
    fn changes_strips(&self) -> bool {
        matches!(self, Self::Open(_) | Self::Place(_) | Self::Remove(_) | Self::Undo | Self::Redo | Self::Suggest)
    }
}

/// What comes back.
#[derive(Debug)]
pub enum Reply {
    /// A model was opened.
    Opened {
        /// What was asked for.
        source: Source,
        /// Its first snapshot.
        scene: Arc<Scene>,
    },
    /// The design changed.
    Changed(Arc<Scene>),
    /// The design is the same, the scene says more of it.
    Completed(Arc<Scene>),
    /// The strips for a hover request.
    Proposals {
        /// Which request.
        generation: u64,
        /// Best first; of an answer that is not final, one that was found early.
        proposals: Vec<Proposal>,
        /// Whether this is all.
        complete: bool,
    },
    /// The embedding became better; more may follow.
    Improved(EmbeddingStep),
    /// The embedding was optimised.
    Optimised(Arc<Scene>),
    /// The design was written.
    Saved(PathBuf),
    /// The layout was written.
    Exported(PathBuf, ExportReport),
    /// It could not be done.
    Failed {
        /// What.
        label: String,
        /// Why; never [`EngineError::Cancelled`] for a hover request.
        error: EngineError,
    },
}

/// What the worker is busy with.
#[derive(Debug, Clone)]
pub struct Running {
    /// In words.
    pub label: String,
    /// Since when.
    pub since: Instant,
    /// How far; may be cancelled.
    pub progress: Arc<Progress>,
    /// Whether anything else goes before it: a hover request, or what was left for later.
    pub yields: bool,
    /// Of an optimisation: to be set in order to stop it and keep the best so far.
    pub stop: Option<Arc<AtomicBool>>,
}

#[derive(Default)]
struct State {
    jobs: VecDeque<Job>,
    hover: Option<(u64, SurfacePoint)>,
    generation: u64,
    /// Whether the engine may still have something to add to its scene.
    incomplete: bool,
    running: Option<Running>,
    closed: bool,
}

struct Shared {
    state: Mutex<State>,
    wake: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The window's end of the worker.
pub struct Worker {
    shared: Arc<Shared>,
    replies: Receiver<Reply>,
    thread: Option<std::thread::JoinHandle<()>>,
}

/// How long the window may be held up by a worker that does not notice the end of the program.
const PATIENCE_AT_EXIT: Duration = Duration::from_millis(300);

impl Worker {
    /// Starts the thread. `notify` is called after every reply, from that thread.
    ///
    /// # Errors
    ///
    /// When the system gives no thread.
    pub fn start(opener: Arc<dyn Opener>, notify: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared { state: Mutex::default(), wake: Condvar::new() });
        let (sender, replies) = channel();
        let inner = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("engine".into())
            .stack_size(16 << 20) // deep recursions of searches on large meshes
            .spawn(move || Loop { shared: inner, opener, engine: None, sender, notify: Box::new(notify) }.run())?;
        Ok(Self { shared, replies, thread: Some(thread) })
    }

    /// Queues a job. It goes before any hover request; [`Job::Open`] drops all that was asked before.
    pub fn request(&self, job: Job) {
        let mut state = self.shared.lock();
        let open = matches!(job, Job::Open(_));
        state.hover = None;
        if open {
            state.jobs.clear();
        }
        let useless = |r: &&Running| r.yields || open || (r.stop.is_some() && job.changes_strips());
        if let Some(running) = state.running.as_ref().filter(useless) {
            running.progress.cancel();
        }
        state.jobs.push_back(job);
        self.shared.wake.notify_one();
    }

    /// Asks for the strips through a point in place of any such request before; returns its generation.
    pub fn hover(&self, at: SurfacePoint) -> u64 {
        let mut state = self.shared.lock();
        state.generation += 1;
        state.hover = Some((state.generation, at));
        cancel_yielding(&state);
        self.shared.wake.notify_one();
        state.generation
    }

    /// Drops the hover request.
    pub fn forget_hover(&self) {
        let mut state = self.shared.lock();
        state.hover = None;
        cancel_yielding(&state);
    }

    /// Cancels the job being done and all that wait.
    pub fn cancel(&self) {
        let mut state = self.shared.lock();
        state.jobs.clear();
        state.hover = None;
        if let Some(running) = &state.running {
            running.progress.cancel();
        }
    }

    /// Stops an optimisation: the best so far is finished and kept.
    pub fn stop(&self) {
        if let Some(stop) = self.shared.lock().running.as_ref().and_then(|r| r.stop.as_ref()) {
            stop.store(true, Ordering::Relaxed);
        }
    }

    /// What is being done.
    pub fn running(&self) -> Option<Running> {
        self.shared.lock().running.clone()
    }

    /// Whether nothing is being done or waits.
    pub fn is_idle(&self) -> bool {
        let state = self.shared.lock();
        state.running.is_none() && state.jobs.is_empty() && state.hover.is_none() && !state.incomplete
    }

    /// The next reply, if there is one.
    pub fn reply(&self) -> Option<Reply> {
        self.replies.try_recv().ok()
    }
}

fn cancel_yielding(state: &State) {
    if let Some(running) = state.running.as_ref().filter(|r| r.yields) {
        running.progress.cancel();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.cancel();
        self.shared.wake.notify_one();
        let Some(thread) = self.thread.take() else { return };
        let start = Instant::now();
        while !thread.is_finished() && start.elapsed() < PATIENCE_AT_EXIT {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

enum Task {
    Job(Job),
    Hover(u64, SurfacePoint),
    /// Add to the scene what was left for later, while nothing else is asked.
    Complete,
}

impl Task {
    fn label(&self) -> String {
        match self {
            Self::Job(job) => job.label(),
            Self::Hover(..) => "Looking for strips".into(),
            Self::Complete => "Drawing the layout".into(),
        }
    }
}

/// The worker's end.
struct Loop {
    shared: Arc<Shared>,
    opener: Arc<dyn Opener>,
    engine: Option<Box<dyn Engine>>,
    sender: Sender<Reply>,
    notify: Box<dyn Fn() + Send>,
}

impl Loop {
    fn run(mut self) {
        while let Some((task, running)) = self.next() {
            let Running { label, yields, .. } = running.clone();
            let changes = !matches!(task, Task::Hover(..) | Task::Complete);
            // A bug in the engine must cost one operation, not the user's session.
            let result = catch_unwind(AssertUnwindSafe(|| self.work(task, &running)))
                .unwrap_or_else(|_| Err(EngineError::failed("an internal error; the design is as it was before")));
            {
                let mut state = self.shared.lock();
                state.running = None;
                state.incomplete |= changes;
            }
            match result {
                Ok(replies) => replies.into_iter().for_each(|r| drop(self.sender.send(r))),
                Err(EngineError::Cancelled) if yields => {}
                Err(error) => drop(self.sender.send(Reply::Failed { label, error })),
            }
            (self.notify)();
        }
    }

    /// Waits for the next task.
    fn next(&self) -> Option<(Task, Running)> {
        let mut state = self.shared.lock();
        loop {
            if state.closed {
                return None;
            }
            let task = match state.jobs.pop_front() {
                Some(job) => Some(Task::Job(job)),
                None => state.hover.take().map(|(generation, at)| Task::Hover(generation, at)),
            };
            let task = task.or_else(|| std::mem::take(&mut state.incomplete).then_some(Task::Complete));
            if let Some(task) = task {
                let running = Running {
                    label: task.label(),
                    since: Instant::now(),
                    progress: Arc::default(),
                    yields: !matches!(task, Task::Job(_)),
                    stop: matches!(task, Task::Job(Job::Optimise)).then(Arc::default),
                };
                state.running = Some(running.clone());
                drop(state);
                (self.notify)();
                return Some((task, running));
            }
            state = self.shared.wake.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn work(&mut self, task: Task, running: &Running) -> Result<Option<Reply>, EngineError> {
        let progress = &*running.progress;
        let job = match task {
            Task::Job(Job::Open(source)) => return self.open(source, progress).map(Some),
            Task::Job(job) => job,
            Task::Hover(generation, at) => {
                let Some(engine) = &mut self.engine else { return Ok(None) };
                let mut first = |proposal| {
                    let proposals = vec![proposal];
                    drop(self.sender.send(Reply::Proposals { generation, proposals, complete: false }));
                    (self.notify)();
                };
                let proposals = engine.proposals(at, &mut first, progress)?;
                return Ok(Some(Reply::Proposals { generation, proposals, complete: true }));
            }
            Task::Complete => {
                let Some(engine) = &mut self.engine else { return Ok(None) };
                let completed = engine.complete(progress);
                // There may be more to add; what was cut short is taken up again after what went before it.
                self.shared.lock().incomplete |= matches!(completed, Ok(true) | Err(EngineError::Cancelled));
                return Ok(completed?.then(|| Reply::Completed(engine.scene())));
            }
        };
        let Some(engine) = &mut self.engine else { return Err(EngineError::failed("no model is open")) };
        match job {
            Job::Open(_) => return Ok(None),
            Job::Place(proposal) => drop(engine.place(&proposal, progress)?),
            Job::Remove(strip) => engine.remove(strip, progress)?,
            Job::SetVisible(strip, visible) => engine.set_visible(strip, visible)?,
            Job::Undo => engine.undo(progress)?,
            Job::Redo => engine.redo(progress)?,
            Job::Suggest => {
                let proposal = engine.suggest(progress)?;
                engine.place(&proposal, progress)?;
            }
            Job::SetPinned(part, pinned) => engine.set_pinned(part, pinned)?,
            Job::Optimise => {
                let stopped = || running.stop.as_ref().is_some_and(|s| s.load(Ordering::Relaxed));
                let mut watch = |step| {
                    drop(self.sender.send(Reply::Improved(step)));
                    (self.notify)();
                    if stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                };
                engine.optimise(&mut watch, progress)?;
                return Ok(Some(Reply::Optimised(engine.scene())));
            }
            Job::Save(path) => {
                engine.save(&path)?;
                return Ok(Some(Reply::Saved(path)));
            }
            Job::Export(folder, options) => {
                let report = engine.export(&folder, &options, progress)?;
                return Ok(Some(Reply::Exported(folder, report)));
            }
        }
        Ok(Some(Reply::Changed(engine.scene())))
    }

    fn open(&mut self, source: Source, progress: &Progress) -> Result<Reply, EngineError> {
        let engine = self.opener.open(&source, progress)?;
        let scene = engine.scene();
        self.engine = Some(engine);
        Ok(Reply::Opened { source, scene })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{BuiltIn, LayoutPreview};
    use glam::DVec3;
    use plait_core::mesh::{FaceId, TriMesh};
    use plait_core::surface::{SurfaceCurve, SurfaceIndex};
    use std::path::Path;

    /// An engine whose answers carry the face they were asked for as their cost. Undo waits to be cancelled, redo
    /// panics, optimising goes on until it is stopped.
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
                remains: Vec::new(),
                summary: String::new(),
                exportable: false,
                layout: None,
                embedding: None,
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
            at: SurfacePoint,
            _: &mut dyn FnMut(Proposal),
            progress: &Progress,
        ) -> Result<Vec<Proposal>, EngineError> {
            if at.face.index() == 0 {
                return Err(until_cancelled(progress));
            }
            let curve = SurfaceCurve { crossings: Vec::new(), closed: true };
            Ok(vec![Proposal { curve, cost: at.face.index() as f64, polyline: Vec::new() }])
        }
        fn place(&mut self, _: &Proposal, _: &Progress) -> Result<StripId, EngineError> {
            Ok(StripId(0))
        }
        fn remove(&mut self, _: StripId, _: &Progress) -> Result<(), EngineError> {
            Ok(())
        }
        fn undo(&mut self, progress: &Progress) -> Result<(), EngineError> {
            Err(until_cancelled(progress))
        }
        fn redo(&mut self, _: &Progress) -> Result<(), EngineError> {
            panic!("a bug, on purpose")
        }
        fn set_visible(&mut self, _: StripId, _: bool) -> Result<(), EngineError> {
            Ok(())
        }
        fn suggest(&mut self, _: &Progress) -> Result<Proposal, EngineError> {
            Err(EngineError::failed("nothing helps"))
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

    fn point(face: usize) -> SurfacePoint {
        SurfacePoint { face: FaceId::new(face), weights: [1.0 / 3.0; 3] }
    }

    fn running(worker: &Worker, label: &str) {
        let start = Instant::now();
        while worker.running().is_none_or(|r| r.label != label) {
            assert!(start.elapsed() < Duration::from_secs(20));
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    #[test]
    fn the_latest_hover_supersedes_the_one_being_worked_on() {
        let worker = worker();
        worker.hover(point(0));
        running(&worker, "Looking for strips");
        worker.hover(point(3));
        let latest = worker.hover(point(5));
        // The first was cut short; of those that waited only the last may be answered last.
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
    fn changes_go_before_hovers_and_forget_them() {
        let worker = worker();
        worker.hover(point(0));
        running(&worker, "Looking for strips");
        worker.request(Job::Save("x".into()));
        assert!(matches!(reply(&worker), Reply::Saved(_)));
        assert!(worker.reply().is_none());
    }

    #[test]
    fn long_work_is_cancelled_and_what_waited_is_dropped() {
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

    /// The first reply after the steps of an optimisation, and how many those were.
    fn after_steps(worker: &Worker) -> (usize, Reply) {
        let mut steps = 0;
        loop {
            match reply(worker) {
                Reply::Improved(_) => steps += 1,
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
    fn changes_of_the_strips_drop_an_optimisation_and_others_wait_for_it() {
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
    fn a_bug_in_the_engine_costs_one_operation_only() {
        let worker = worker();
        worker.request(Job::Redo);
        let Reply::Failed { error, .. } = reply(&worker) else { panic!("not a failure") };
        assert!(error.to_string().contains("internal error"));
        worker.request(Job::Save("x".into()));
        assert!(matches!(reply(&worker), Reply::Saved(_)));
    }
}

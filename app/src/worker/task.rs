//! The worker's end: the loop that does one task after the other on the engine.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::Sender;
use std::sync::{Arc, PoisonError};
use std::time::Instant;

use plait_core::progress::Progress;
use plait_core::surface::SurfacePoint;

use super::Shared;
use super::messages::{Job, Reply, Running, Steps};
use crate::engine::{Engine, EngineError, Opener, Source};

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
pub(super) struct Loop {
    pub(super) shared: Arc<Shared>,
    pub(super) opener: Arc<dyn Opener>,
    pub(super) engine: Option<Box<dyn Engine>>,
    pub(super) sender: Sender<Reply>,
    pub(super) notify: Box<dyn Fn() + Send>,
}

impl Loop {
    /// Works until the window closes the worker.
    pub(super) fn run(mut self) {
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
                let betters = if let Task::Job(job) = &task { job.betters() } else { None };
                let running = Running {
                    label: task.label(),
                    since: Instant::now(),
                    progress: Arc::default(),
                    yields: !matches!(task, Task::Job(_)),
                    steps: betters.map(|of| Steps { of, stop: Arc::default() }),
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
            Job::Improve => {
                let mut watch = |scene, improvement| {
                    drop(self.sender.send(Reply::Refitted { scene, improvement, complete: false }));
                    (self.notify)();
                    running.flow()
                };
                let done = engine.improve(&mut watch, progress);
                // What was shown on the way is not what there is.
                if done.is_err() {
                    drop(self.sender.send(Reply::Changed(engine.scene())));
                }
                let improvement = done?;
                return Ok(Some(Reply::Refitted { scene: engine.scene(), improvement, complete: true }));
            }
            Job::SetDetail(detail) => engine.set_detail(detail, progress)?,
            Job::SetPinned(part, pinned) => engine.set_pinned(part, pinned)?,
            Job::Optimise => {
                let mut watch = |step| {
                    drop(self.sender.send(Reply::Improved(step)));
                    (self.notify)();
                    running.flow()
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

//! The worker's end: a loop that runs one task after the other on the engine.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::Sender;
use std::sync::{Arc, PoisonError};
use std::time::Instant;

use plait_core::progress::Progress;

use super::messages::{Job, Reply, Running, StopFlag};
use super::shared::Shared;
use crate::engine::{Engine, EngineError, Opener, Search, Source};

enum Task {
    Job(Job),
    /// Find the proposals of a search.
    Search(u64, Search),
    /// Complete the scene, while there is nothing else to do.
    Complete,
}

impl Task {
    fn label(&self) -> String {
        match self {
            Self::Job(job) => job.label(),
            Self::Search(..) => "Searching for strips".into(),
            Self::Complete => "Computing the layout".into(),
        }
    }
}

/// Sends replies and wakes the window.
pub(super) struct Replies {
    pub(super) sender: Sender<Reply>,
    pub(super) notify: Box<dyn Fn() + Send>,
}

impl Replies {
    /// Sends a reply. At the end of the program nobody receives it.
    fn send(&self, reply: Reply) {
        drop(self.sender.send(reply));
    }

    /// Sends an intermediate reply, and wakes the window at once.
    fn send_now(&self, reply: Reply) {
        self.send(reply);
        (self.notify)();
    }
}

/// The worker's end.
pub(super) struct WorkerLoop {
    pub(super) shared: Arc<Shared>,
    pub(super) opener: Arc<dyn Opener>,
    pub(super) engine: Option<Box<dyn Engine>>,
    pub(super) replies: Replies,
}

impl WorkerLoop {
    /// Works until the window closes the worker.
    pub(super) fn run(mut self) {
        while let Some((task, running)) = self.next() {
            let Running { label, yields, .. } = running.clone();
            let changes = !matches!(task, Task::Search(..) | Task::Complete);
            // A panic of the engine must cost one operation, not the design of the user.
            let result = catch_unwind(AssertUnwindSafe(|| self.work(task, &running)))
                .unwrap_or_else(|_| Err(EngineError::failed("internal error; the design is unchanged")));
            {
                let mut state = self.shared.lock();
                state.running = None;
                state.incomplete |= changes;
            }
            match result {
                Ok(reply) => reply.into_iter().for_each(|r| self.replies.send(r)),
                Err(EngineError::Cancelled) if yields => {}
                Err(error) => self.replies.send(Reply::Failed { label, error }),
            }
            (self.replies.notify)();
        }
    }

    /// Waits for the next task. `None`: the program ends.
    fn next(&self) -> Option<(Task, Running)> {
        let mut state = self.shared.lock();
        loop {
            if state.closed {
                return None;
            }
            let task = match state.jobs.pop_front() {
                Some(job) => Some(Task::Job(job)),
                None => state.search.take().map(|(generation, search)| Task::Search(generation, search)),
            };
            let task = task.or_else(|| std::mem::take(&mut state.incomplete).then_some(Task::Complete));
            if let Some(task) = task {
                let work = if let Task::Job(job) = &task { job.stoppable_work() } else { None };
                let running = Running {
                    label: task.label(),
                    since: Instant::now(),
                    progress: Arc::default(),
                    yields: !matches!(task, Task::Job(_)),
                    stoppable: work.map(|work| StopFlag { work, stop: Arc::default() }),
                };
                state.running = Some(running.clone());
                drop(state);
                (self.replies.notify)();
                return Some((task, running));
            }
            state = self.shared.wake.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Runs a task. `None`: there is nothing to reply.
    fn work(&mut self, task: Task, running: &Running) -> Result<Option<Reply>, EngineError> {
        let progress = &*running.progress;
        match task {
            Task::Job(Job::Open(source)) => self.open(source, progress).map(Some),
            Task::Job(job) => {
                let Some(engine) = &mut self.engine else { return Err(EngineError::failed("no model is open")) };
                run_job(job, &mut **engine, running, &self.replies).map(Some)
            }
            Task::Search(generation, search) => {
                let Some(engine) = &mut self.engine else { return Ok(None) };
                let mut first = |proposal| {
                    let proposals = vec![proposal];
                    self.replies.send_now(Reply::Proposals { generation, proposals, complete: false });
                };
                Ok(Some(match engine.proposals(&search, &mut first, progress) {
                    Ok(proposals) => Reply::Proposals { generation, proposals, complete: true },
                    Err(EngineError::Cancelled) => return Err(EngineError::Cancelled),
                    Err(error) => Reply::NoProposals { generation, error },
                }))
            }
            Task::Complete => {
                let Some(engine) = &mut self.engine else { return Ok(None) };
                let completed = engine.complete(progress);
                // There may be more to add, and a completion that was cancelled is resumed later.
                self.shared.lock().incomplete |= matches!(completed, Ok(true) | Err(EngineError::Cancelled));
                Ok(completed?.then(|| Reply::Completed(engine.scene())))
            }
        }
    }

    fn open(&mut self, source: Source, progress: &Progress) -> Result<Reply, EngineError> {
        let engine = self.opener.open(&source, progress)?;
        let scene = engine.scene();
        self.engine = Some(engine);
        Ok(Reply::Opened { source, scene })
    }
}

/// Runs a job other than [`Job::Open`] on the engine.
fn run_job(job: Job, engine: &mut dyn Engine, running: &Running, replies: &Replies) -> Result<Reply, EngineError> {
    let progress = &*running.progress;
    match job {
        Job::Open(_) => {}
        Job::Place(proposal, replaces) => drop(engine.place(&proposal, replaces, progress)?),
        Job::Remove(strip) => engine.remove(strip, progress)?,
        Job::SetVisible(strip, visible) => engine.set_visible(strip, visible)?,
        Job::Undo => engine.undo(progress)?,
        Job::Redo => engine.redo(progress)?,
        Job::Suggest => {
            let proposal = engine.suggest(progress)?;
            engine.place(&proposal, None, progress)?;
        }
        Job::SetDetail(detail) => engine.set_detail(detail, progress)?,
        Job::SetPinned(part, pinned) => engine.set_pinned(part, pinned)?,
        Job::Improve => return improve(engine, running, replies),
        Job::Optimise => {
            let mut watch = |step| {
                replies.send_now(Reply::EmbeddingStep(step));
                running.flow()
            };
            engine.optimise(&mut watch, progress)?;
            return Ok(Reply::Optimised(engine.scene()));
        }
        Job::Save(path) => {
            engine.save(&path)?;
            return Ok(Reply::Saved(path));
        }
        Job::Export(folder, options) => {
            let report = engine.export(&folder, &options, progress)?;
            return Ok(Reply::Exported(folder, report));
        }
    }
    Ok(Reply::Changed(engine.scene()))
}

fn improve(engine: &mut dyn Engine, running: &Running, replies: &Replies) -> Result<Reply, EngineError> {
    let mut watch = |scene, improvement| {
        replies.send_now(Reply::StripsImproved { scene, improvement, complete: false });
        running.flow()
    };
    let done = engine.improve(&mut watch, &running.progress);
    // A cancelled search leaves the strips as they were, but the window shows those of the last step.
    if done.is_err() {
        replies.send(Reply::Changed(engine.scene()));
    }
    let improvement = done?;
    Ok(Reply::StripsImproved { scene: engine.scene(), improvement, complete: true })
}

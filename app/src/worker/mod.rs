//! The worker: a thread that owns the engine, so that the window never waits.
//!
//! Requests that change something are queued and done in order. Of hover requests only the latest counts: a newer
//! one, or any change, cancels the one being worked on. An optimisation of the embedding hands out what it has so far, may
//! be stopped, and is dropped by any change of the strips. Opening cancels everything. Every reply wakes the window.

mod messages;
mod task;
#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use plait_core::surface::SurfacePoint;

pub use messages::{Job, Reply, Running, Steps, StoppableWork};
use task::Loop;

use crate::engine::Opener;

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
        let useless = |r: &&Running| r.yields || open || (r.steps.is_some() && job.changes_strips());
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

    /// Stops what makes something better step by step: the best so far is finished and kept.
    pub fn stop(&self) {
        if let Some(steps) = self.shared.lock().running.as_ref().and_then(|r| r.steps.as_ref()) {
            steps.stop.store(true, Ordering::Relaxed);
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

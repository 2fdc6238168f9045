//! The worker: a thread that owns the engine, so that the window never waits.
//!
//! Jobs that change the design are queued and done in order. Of search requests only the latest counts: a newer one, or
//! any job, cancels the one that runs. A search for better strips and an optimisation of the embedding send
//! intermediate results and can be stopped; a job that changes the strips cancels them. Opening a model cancels
//! everything. Every reply wakes the window.

mod messages;
mod shared;
mod task;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

pub use messages::{Job, Reply, Running, StopFlag, StoppableWork};
use shared::Shared;
use task::{Replies, WorkerLoop};

use crate::engine::{Opener, Search};

/// The window's end of the worker.
pub struct Worker {
    shared: Arc<Shared>,
    replies: Receiver<Reply>,
    thread: Option<std::thread::JoinHandle<()>>,
}

/// Longest wait for the thread at the end of the program. A thread that does not stop by then ends with the process.
const EXIT_TIMEOUT: Duration = Duration::from_millis(300);
/// Stack of the thread, in bytes: searches on large meshes recurse deeply.
const STACK_SIZE: usize = 16 << 20;

impl Worker {
    /// Starts the thread. The thread calls `notify` after every reply.
    ///
    /// # Errors
    ///
    /// When the system cannot start a thread.
    pub fn start(opener: Arc<dyn Opener>, notify: impl Fn() + Send + 'static) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::new());
        let (sender, replies) = channel();
        let inner = Arc::clone(&shared);
        let run = move || {
            let replies = Replies { sender, notify: Box::new(notify) };
            WorkerLoop { shared: inner, opener, engine: None, replies }.run();
        };
        let thread = std::thread::Builder::new().name("engine".into()).stack_size(STACK_SIZE).spawn(run)?;
        Ok(Self { shared, replies, thread: Some(thread) })
    }

    /// Queues a job. Jobs precede search requests; [`Job::Open`] drops all earlier jobs.
    pub fn request(&self, job: Job) {
        let mut state = self.shared.lock();
        let open = matches!(job, Job::Open(_));
        state.search = None;
        if open {
            state.jobs.clear();
        }
        let obsolete = |r: &&Running| r.yields || open || (r.stoppable.is_some() && job.changes_strips());
        if let Some(running) = state.running.as_ref().filter(obsolete) {
            running.progress.cancel();
        }
        state.jobs.push_back(job);
        self.shared.wake.notify_one();
    }

    /// Requests the proposals of a search, in place of any earlier such request. Returns the generation of the request.
    pub fn search(&self, search: Search) -> u64 {
        let mut state = self.shared.lock();
        state.generation += 1;
        state.search = Some((state.generation, search));
        state.cancel_yielding();
        self.shared.wake.notify_one();
        state.generation
    }

    /// Drops the search request.
    pub fn forget_search(&self) {
        let mut state = self.shared.lock();
        state.search = None;
        state.cancel_yielding();
    }

    /// Cancels the running job and drops all that wait.
    pub fn cancel(&self) {
        let mut state = self.shared.lock();
        state.jobs.clear();
        state.search = None;
        if let Some(running) = &state.running {
            running.progress.cancel();
        }
    }

    /// Stops the running search or optimisation. Its best result so far is kept.
    pub fn stop(&self) {
        if let Some(stoppable) = self.shared.lock().running.as_ref().and_then(|r| r.stoppable.as_ref()) {
            stoppable.stop.store(true, Ordering::Relaxed);
        }
    }

    /// The task that runs now.
    pub fn running(&self) -> Option<Running> {
        self.shared.lock().running.clone()
    }

    /// Whether no task runs or waits.
    pub fn is_idle(&self) -> bool {
        let state = self.shared.lock();
        state.running.is_none() && state.jobs.is_empty() && state.search.is_none() && !state.incomplete
    }

    /// The next reply, if there is one.
    pub fn reply(&self) -> Option<Reply> {
        self.replies.try_recv().ok()
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.cancel();
        self.shared.wake.notify_one();
        let Some(thread) = self.thread.take() else { return };
        let start = Instant::now();
        while !thread.is_finished() && start.elapsed() < EXIT_TIMEOUT {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

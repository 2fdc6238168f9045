//! The state that the window's end and the worker's end share.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use super::messages::{Job, Running};
use crate::engine::Search;

/// What is to be done and what is being done.
#[derive(Default)]
pub(super) struct State {
    /// Jobs that wait, in order.
    pub(super) jobs: VecDeque<Job>,
    /// The latest search request, with its generation.
    pub(super) search: Option<(u64, Search)>,
    /// Generation of the latest search request.
    pub(super) generation: u64,
    /// Whether the scene may be incomplete, see [`crate::engine::Engine::complete`].
    pub(super) incomplete: bool,
    /// The task that runs now.
    pub(super) running: Option<Running>,
    /// Whether the program ends.
    pub(super) closed: bool,
}

impl State {
    /// Cancels the running task if it yields to others.
    pub(super) fn cancel_yielding(&self) {
        if let Some(running) = self.running.as_ref().filter(|r| r.yields) {
            running.progress.cancel();
        }
    }
}

/// The state, and the signal that it has changed.
pub(super) struct Shared {
    state: Mutex<State>,
    pub(super) wake: Condvar,
}

impl Shared {
    pub(super) fn new() -> Self {
        Self { state: Mutex::default(), wake: Condvar::new() }
    }

    /// The state. A panic of the other thread leaves it consistent: it is locked only between tasks.
    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

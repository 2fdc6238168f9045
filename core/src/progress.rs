//! Progress of long work, and the wish to stop it.
//!
//! The side that works reports a stage and a fraction and asks now and then whether to go on; the side that
//! waits reads both and may cancel. Shared by reference between threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use thiserror::Error;

/// The work was cancelled from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Progress of one piece of work.
#[derive(Debug, Default)]
pub struct Progress {
    cancelled: AtomicBool,
    /// Fraction done, in thousandths.
    permille: AtomicU32,
    stage: Mutex<String>,
}

impl Progress {
    /// Progress that nobody watches yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Asks the work to stop.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the work should stop.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Returns an error once the work should stop.
    ///
    /// # Errors
    ///
    /// [`Cancelled`] after [`Self::cancel`].
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// Reports what is being done and how much of the whole is done, from 0 to 1.
    pub fn report(&self, stage: &str, fraction: f64) {
        self.permille.store((fraction.clamp(0.0, 1.0) * 1000.0) as u32, Ordering::Relaxed);
        let mut text = self.stage.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if *text != stage {
            stage.clone_into(&mut text);
        }
    }

    /// The stage and the fraction last reported.
    pub fn state(&self) -> (String, f64) {
        let text = self.stage.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone();
        (text, f64::from(self.permille.load(Ordering::Relaxed)) / 1000.0)
    }
}

//! Progress and cancellation of long work, shared between threads.
//!
//! The working thread reports stage and fraction and checks now and then whether it was cancelled; another thread reads both
//! and may cancel. The time of each stage is recorded.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use thiserror::Error;

/// The work was cancelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("cancelled")]
pub struct Cancelled;

/// Progress of one piece of work.
#[derive(Debug, Default)]
pub struct Progress {
    cancelled: AtomicBool,
    /// Fraction of all the work that is done, in thousandths.
    permille: AtomicU32,
    /// The range of all the work that reported fractions refer to, as fractions; `None`: all of it.
    range: Mutex<Option<[f64; 2]>>,
    stages: Mutex<Stages>,
}

/// The time a stage has taken.
#[derive(Debug, Clone, PartialEq)]
pub struct StageTime {
    /// The stage, as reported.
    pub stage: String,
    /// Total seconds in it.
    pub seconds: f64,
    /// How many times it was entered.
    pub times: usize,
}

#[derive(Debug, Default)]
struct Stages {
    /// All stages, in the order of their first report.
    all: Vec<StageTime>,
    /// Index of the stage reported last.
    now: Option<usize>,
    /// When it was entered; `None` once the work is done.
    since: Option<Instant>,
}

impl Stages {
    /// Adds the time since the present stage was entered.
    fn close(&mut self) {
        if let (Some(now), Some(since)) = (self.now, self.since.take()) {
            self.all[now].seconds += since.elapsed().as_secs_f64();
        }
    }

    /// Enters a stage.
    fn open(&mut self, stage: &str) {
        let at = self.all.iter().position(|s| s.stage == stage).unwrap_or(self.all.len());
        if at == self.all.len() {
            self.all.push(StageTime { stage: stage.to_owned(), seconds: 0.0, times: 0 });
        }
        self.all[at].times += 1;
        (self.now, self.since) = (Some(at), Some(Instant::now()));
    }
}

impl Progress {
    /// Progress of work that has not begun.
    pub fn new() -> Self {
        Self::default()
    }

    /// Cancels the work.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the work was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Returns an error if the work was cancelled.
    ///
    /// # Errors
    ///
    /// [`Cancelled`] after [`Self::cancel`].
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    /// Reports the present stage and the fraction of the work done, 0 to 1. A stage lasts until another one is reported; at
    /// fraction 1 of all the work its time ends at once.
    pub fn report(&self, stage: &str, fraction: f64) {
        let range = *self.range.lock().unwrap_or_else(PoisonError::into_inner);
        let [from, to] = range.unwrap_or([0.0, 1.0]);
        let of_all = from + (to - from) * fraction.clamp(0.0, 1.0);
        self.permille.store((of_all * 1000.0) as u32, Ordering::Relaxed);
        let mut stages = self.stages();
        let same = stages.now.is_some_and(|now| stages.all[now].stage == stage);
        if !same {
            stages.close();
            stages.open(stage);
        }
        if fraction >= 1.0 && range.is_none() {
            stages.close();
        }
    }

    /// Sets the range of all the work that fractions reported from now on refer to; `None`: all of it.
    pub fn set_range(&self, range: Option<[f64; 2]>) {
        *self.range.lock().unwrap_or_else(PoisonError::into_inner) = range;
    }

    /// The stage reported last, and the fraction of all the work.
    pub fn state(&self) -> (String, f64) {
        let stages = self.stages();
        let text = stages.now.map(|now| stages.all[now].stage.clone()).unwrap_or_default();
        (text, f64::from(self.permille.load(Ordering::Relaxed)) / 1000.0)
    }

    /// All stages in the order of their first report; the present one with its time up to now.
    pub fn stage_times(&self) -> Vec<StageTime> {
        let stages = self.stages();
        let mut list = stages.all.clone();
        if let (Some(now), Some(since)) = (stages.now, stages.since) {
            list[now].seconds += since.elapsed().as_secs_f64();
        }
        list
    }

    fn stages(&self) -> MutexGuard<'_, Stages> {
        self.stages.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_equal_stages_are_summed() {
        let progress = Progress::new();
        assert_eq!((progress.state(), progress.stage_times()), ((String::new(), 0.0), Vec::new()));
        for (stage, fraction) in [("a", 0.0), ("a", 0.2), ("b", 0.5), ("a", 0.75), ("done", 1.0)] {
            progress.report(stage, fraction);
        }
        let times: Vec<_> = progress.stage_times().into_iter().map(|s| (s.stage, s.times)).collect();
        assert_eq!(times, [("a".to_owned(), 2), ("b".to_owned(), 1), ("done".to_owned(), 1)]);
        assert_eq!(progress.state(), ("done".to_owned(), 1.0));
        let before = progress.stage_times();
        std::thread::sleep(std::time::Duration::from_millis(2));
        assert_eq!(progress.stage_times(), before);
    }

    #[test]
    fn fractions_refer_to_the_range_that_is_set() {
        let progress = Progress::new();
        progress.set_range(Some([0.2, 0.6]));
        progress.report("part", 0.5);
        assert_eq!(progress.state(), ("part".to_owned(), 0.4));
        // The end of a range is not the end of the work: time goes on.
        progress.report("part", 1.0);
        let before = progress.stage_times()[0].seconds;
        std::thread::sleep(std::time::Duration::from_millis(2));
        assert!(progress.stage_times()[0].seconds > before);
        progress.set_range(None);
        progress.report("rest", 0.9);
        assert_eq!(progress.state(), ("rest".to_owned(), 0.9));
    }
}

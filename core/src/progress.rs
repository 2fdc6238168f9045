//! Progress of long work, and the wish to stop it.
//!
//! The side that works reports a stage and a fraction and asks now and then whether to go on; the side that
//! waits reads both and may cancel. Shared by reference between threads. How long each stage took is kept, so that
//! whoever watches need not know the stages beforehand.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

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
    /// The part of the whole that fractions are of, likewise; nothing: all of it.
    part: Mutex<Option<[f64; 2]>>,
    stages: Mutex<Stages>,
}

/// A stage of the work and how long it has taken.
#[derive(Debug, Clone, PartialEq)]
pub struct StageTime {
    /// The stage, as reported.
    pub stage: String,
    /// Seconds in it, all times together.
    pub seconds: f64,
    /// How often it began.
    pub times: usize,
}

#[derive(Debug, Default)]
struct Stages {
    /// The stages met, in the order of their first report.
    met: Vec<StageTime>,
    /// Which of them was reported last.
    now: Option<usize>,
    /// When it began; nothing once the work is done.
    since: Option<Instant>,
}

impl Stages {
    fn close(&mut self) {
        if let (Some(now), Some(since)) = (self.now, self.since.take()) {
            self.met[now].seconds += since.elapsed().as_secs_f64();
        }
    }

    fn open(&mut self, stage: &str) {
        let at = self.met.iter().position(|s| s.stage == stage).unwrap_or(self.met.len());
        if at == self.met.len() {
            self.met.push(StageTime { stage: stage.to_owned(), seconds: 0.0, times: 0 });
        }
        self.met[at].times += 1;
        (self.now, self.since) = (Some(at), Some(Instant::now()));
    }
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

    /// Reports what is being done and how much of the whole is done, from 0 to 1. The stage lasts until another is
    /// reported; one reported as wholly done takes no time.
    pub fn report(&self, stage: &str, fraction: f64) {
        let part = *self.part.lock().unwrap_or_else(PoisonError::into_inner);
        let [from, to] = part.unwrap_or([0.0, 1.0]);
        let of_whole = from + (to - from) * fraction.clamp(0.0, 1.0);
        self.permille.store((of_whole * 1000.0) as u32, Ordering::Relaxed);
        let mut stages = self.stages();
        let same = stages.now.is_some_and(|now| stages.met[now].stage == stage);
        if !same {
            stages.close();
            stages.open(stage);
        }
        if fraction >= 1.0 && part.is_none() {
            stages.close();
        }
    }

    /// Takes the fractions reported from now on for those of a part of the whole, or of all of it again.
    pub fn set_range(&self, part: Option<[f64; 2]>) {
        *self.part.lock().unwrap_or_else(PoisonError::into_inner) = part;
    }

    /// The stage and the fraction last reported.
    pub fn state(&self) -> (String, f64) {
        let stages = self.stages();
        let text = stages.now.map(|now| stages.met[now].stage.clone()).unwrap_or_default();
        (text, f64::from(self.permille.load(Ordering::Relaxed)) / 1000.0)
    }

    /// The stages so far in the order of their first report, the present one up to now.
    pub fn stage_times(&self) -> Vec<StageTime> {
        let stages = self.stages();
        let mut list = stages.met.clone();
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
    fn stages_add_up_under_their_names() {
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
    fn a_part_of_the_work_reports_as_a_part_of_the_whole() {
        let progress = Progress::new();
        progress.set_range(Some([0.2, 0.6]));
        progress.report("part", 0.5);
        assert_eq!(progress.state(), ("part".to_owned(), 0.4));
        // The end of a part is not the end: time goes on.
        progress.report("part", 1.0);
        let before = progress.stage_times()[0].seconds;
        std::thread::sleep(std::time::Duration::from_millis(2));
        assert!(progress.stage_times()[0].seconds > before);
        progress.set_range(None);
        progress.report("rest", 0.9);
        assert_eq!(progress.state(), ("rest".to_owned(), 0.9));
    }
}

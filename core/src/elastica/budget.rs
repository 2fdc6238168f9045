//! The budget of a search: how many states it may settle.

use crate::progress::{Cancelled, Progress};

/// Number of states settled between two checks for cancellation: some tenths of a millisecond.
const CHECK_EVERY: u64 = 1024;

/// Why a search ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Stop {
    /// It was cancelled.
    Cancelled,
    /// The budget is spent.
    Spent,
}

impl From<Cancelled> for Stop {
    fn from(_: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// Counts the states that a search settles, and ends it when the budget is spent or when it is cancelled.
#[derive(Debug)]
pub(super) struct SearchBudget<'a> {
    pub(super) progress: &'a Progress,
    /// Largest number of states.
    pub(super) limit: u64,
    /// Number of states settled so far.
    pub(super) settled: u64,
}

impl SearchBudget<'_> {
    /// Counts one state, unless the search has to end.
    #[inline]
    pub(super) fn count(&mut self) -> Result<(), Stop> {
        if self.settled >= self.limit {
            return Err(Stop::Spent);
        }
        if self.settled.is_multiple_of(CHECK_EVERY) {
            self.progress.check()?;
        }
        self.settled += 1;
        Ok(())
    }
}

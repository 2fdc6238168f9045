//! Time to place a strip, with everything that is recomputed.

use plait_core::progress::Progress;
use plait_core::weave::{Proposal, Session, StripId, WeaveError};

use super::super::arguments::bench::RunArguments;
use super::points::Points;
use super::report::{Report, Staged};

/// Group of the rows in the report.
pub(super) const GROUP: &str = "strips";
/// Row of the total time.
pub(super) const PLACED: &str = "placed";

/// Points to try until one has a proposal.
const TRIES: usize = 100;

/// Places the best loop at random points, one after the other.
#[derive(Debug)]
pub(super) struct Placements {
    points: Points,
}

impl Placements {
    /// Placements with the points of a seed. The points differ from those at which proposals are timed.
    pub(super) fn new(session: &Session, seed: u64) -> Self {
        Self { points: Points::new(&session.model().loaded.mesh, !seed) }
    }

    /// Calls `place` with the best proposal at the next point that has one; false after [`TRIES`] points without.
    pub(super) fn place(
        &mut self,
        session: &mut Session,
        place: impl FnOnce(&mut Session, Proposal, &Progress) -> Result<StripId, WeaveError>,
    ) -> anyhow::Result<bool> {
        let progress = Progress::new();
        for _ in 0..TRIES {
            let found = session.proposals(self.points.point(), &progress)?;
            if let Some(best) = found.into_iter().next() {
                place(session, best, &progress)?;
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Times the placement of strips, and the removal of the last.
pub(super) fn measure(session: &mut Session, arguments: &RunArguments, report: &mut Report) -> anyhow::Result<()> {
    let mut placements = Placements::new(session, arguments.seed);
    let (mut placed, mut removed) = (Staged::default(), Staged::default());
    for _ in 0..arguments.most_strips() {
        let timed =
            |session: &mut Session, proposal, _: &Progress| placed.time(|progress| session.place(proposal, progress));
        if !placements.place(session, timed)? || placed.spent() > arguments.limit() {
            break;
        }
    }
    if let Some(last) = session.design().strips.last().map(|s| s.id) {
        removed.time(|progress| session.remove(last, progress))?;
    }
    placed.write(report, GROUP, PLACED);
    report.add_times(GROUP, "removed again", removed.totals());
    Ok(())
}

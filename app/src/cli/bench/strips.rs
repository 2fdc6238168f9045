//! Placing strips, and all that follows from one more.

use plait_core::progress::Progress;
use plait_core::weave::{Proposal, Session, StripId, WeaveError};

use super::RunArguments;
use super::points::Points;
use super::report::{Report, Staged};

/// The group of the rows.
pub(super) const GROUP: &str = "strips";
/// All stages together.
pub(super) const PLACED: &str = "placed";

/// Points tried until one has a proposal.
const TRIES: usize = 100;

/// The best loops at random points, one after the other.
#[derive(Debug)]
pub(super) struct Placements {
    points: Points,
}

impl Placements {
    /// The placements of a seed; their points are others than those at which proposals are timed.
    pub(super) fn new(session: &Session, seed: u64) -> Self {
        Self { points: Points::new(&session.model().loaded.mesh, !seed) }
    }

    /// Has `place` place the next strip; tells whether there was one.
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

/// Places strips, and removes the last again.
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

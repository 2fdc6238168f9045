//! Time to embed a valid layout, from its strips to the maps of its patches.

use std::time::Instant;

use plait_core::progress::Progress;
use plait_core::weave::{ExportOptions, Goal, QuadSize, Session, export};

use super::super::arguments::bench::RunArguments;
use super::report::{Report, Staged};

/// Group of the rows in the report.
pub(super) const GROUP: &str = "embed";
/// Row of the total time.
pub(super) const EMBEDDED: &str = "embedded";

/// Places suggested strips until the layout is valid, then embeds it several times.
pub(super) fn measure(session: &mut Session, arguments: &RunArguments, report: &mut Report) -> anyhow::Result<()> {
    let start = Instant::now();
    if let Some(reason) = session.weave_to(Goal::Valid, &Progress::new())? {
        anyhow::bail!("there is no layout to embed: {reason}");
    }
    report.add_times(GROUP, "woven by suggestions", &[start.elapsed()]);
    // The coarsest quad mesh, since its computation is not measured.
    let options = ExportOptions { size: QuadSize::Count(1), ..Default::default() };
    let mut staged = Staged::default();
    for _ in 0..arguments.repeats {
        staged.time(|progress| export(session, &options, progress))?;
        if staged.spent() > arguments.limit() {
            break;
        }
    }
    staged.write(report, GROUP, EMBEDDED);
    Ok(())
}

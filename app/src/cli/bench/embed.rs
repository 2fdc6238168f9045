//! Embedding: from the strips of a valid layout to its patches on the surface.

use std::time::Instant;

use plait_core::progress::Progress;
use plait_core::weave::{ExportOptions, Goal, QuadSize, Session, export};

use super::RunArguments;
use super::report::{Report, Staged};

/// The group of the rows.
pub(super) const GROUP: &str = "embed";
/// All stages together.
pub(super) const EMBEDDED: &str = "embedded";

/// Weaves by suggestions until the layout is valid and embeds it several times.
pub(super) fn measure(session: &mut Session, arguments: &RunArguments, report: &mut Report) -> anyhow::Result<()> {
    let start = Instant::now();
    if let Some(stuck) = session.weave_to(Goal::Valid, &Progress::new())? {
        anyhow::bail!("there is no layout to embed: {stuck}");
    }
    report.add_times(GROUP, "woven by suggestions", &[start.elapsed()]);
    // As few quads as there can be: refining is not what is measured.
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

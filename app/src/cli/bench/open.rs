//! Time to open a mesh, from the file to the prepared model.

use plait_core::weave::{Model, Options};

use super::super::arguments::bench::RunArguments;
use super::input::Input;
use super::report::{Report, Staged};

/// Group of the rows in the report.
pub(super) const GROUP: &str = "open";
/// Row of the total time.
pub(super) const READY: &str = "opened and ready";

/// Opens the input several times.
pub(super) fn measure(input: &Input, arguments: &RunArguments, report: &mut Report) -> anyhow::Result<()> {
    let mut staged = Staged::default();
    for _ in 0..arguments.repeats {
        let model = staged.time(|progress| -> anyhow::Result<Model> {
            let loaded = input.load(progress)?;
            Ok(Model::prepare(loaded, arguments.detail.over(Options::default()), progress)?)
        })?;
        drop(model);
        if staged.spent() > arguments.limit() {
            break;
        }
    }
    staged.write(report, GROUP, READY);
    Ok(())
}

//! `plait weave`: replays a script, or places suggestions, and writes the layout.

use super::WeaveArguments;

/// Weaves and writes into the folder.
///
/// # Errors
///
/// When the input cannot be read, the layout is not valid in the end, or a file cannot be written.
pub fn run(arguments: &WeaveArguments) -> anyhow::Result<()> {
    anyhow::bail!("not built yet: weave {} into {}", arguments.input.display(), arguments.out.display())
}

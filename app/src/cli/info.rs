//! `plait info`: what a mesh is, as text or as JSON on standard output.

use super::InfoArguments;

/// Reads the mesh and writes its facts.
///
/// # Errors
///
/// When the mesh cannot be read.
pub fn run(arguments: &InfoArguments) -> anyhow::Result<()> {
    anyhow::bail!("not built yet: info {} (json: {})", arguments.mesh.display(), arguments.json)
}

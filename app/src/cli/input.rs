//! What the commands read: meshes, designs and weave scripts.

use std::path::Path;

use anyhow::Context as _;
use plait_core::progress::Progress;
use plait_core::weave::{Design, MeshSource, Options, Script, Session, replay};

use super::arguments::options::DetailArguments;
use super::output::print_message;
use crate::engine::{Opener, Source};

/// Whether a path ends in `.extension`, in upper or lower case.
pub(super) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// What a path names: a file, or a built-in model if there is no such file.
pub(super) fn source(path: &Path, opener: &dyn Opener) -> Source {
    let name = path.to_string_lossy();
    let known = |n: &str| n.eq_ignore_ascii_case(&name);
    match opener.built_ins().into_iter().find(|b| known(&b.name)) {
        Some(built_in) if !path.exists() => Source::BuiltIn(built_in.name),
        _ => Source::File(path.to_path_buf()),
    }
}

/// The session of a replayed script or a saved design. With `suggest` also an empty session on a mesh.
///
/// # Errors
///
/// When the input cannot be read, or a step of the script fails.
pub(super) fn open_session(
    input: &Path,
    suggest: bool,
    detail: &DetailArguments,
    progress: &Progress,
) -> anyhow::Result<Session> {
    let session = read_session(input, suggest, detail, progress)?;
    if let Some(proxy) = &session.model().proxy {
        let (all, n) = (session.model().loaded.mesh.n_faces(), proxy.mesh().n_faces());
        print_message(&format!("plait: {all} triangles, woven on a proxy of {n} triangles"));
    }
    Ok(session)
}

fn read_session(input: &Path, suggest: bool, detail: &DetailArguments, progress: &Progress) -> anyhow::Result<Session> {
    let folder = input.parent().unwrap_or(Path::new(""));
    if has_extension(input, "json") {
        let mut script = Script::read(input)?;
        script.options = detail.over(script.options);
        return Ok(replay(&script, folder, progress)?);
    }
    if has_extension(input, "plait") {
        let mut design = Design::read(input)?;
        design.options = detail.over(design.options);
        let loaded = design.mesh.load(folder)?;
        return Ok(Session::resume(loaded, design, progress)?);
    }
    if !suggest {
        let input = input.display();
        anyhow::bail!("{input} is neither a weave script (.json) nor a design (.plait); a mesh needs --suggest");
    }
    let source = MeshSource::from_name(&input.to_string_lossy());
    let loaded = source.load(Path::new("")).with_context(|| input.display().to_string())?;
    let source = match source {
        MeshSource::File(path) => MeshSource::File(path.canonicalize().unwrap_or(path)),
        builtin @ MeshSource::Builtin(_) => builtin,
    };
    Ok(Session::open(loaded, source, detail.over(Options::default()), progress)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::session_engine::SessionOpener;

    #[test]
    fn extensions_are_known_in_upper_case() {
        assert!(has_extension(Path::new("a.PLAIT"), "plait") && !has_extension(Path::new("plait"), "plait"));
    }

    #[test]
    fn a_name_without_a_file_is_a_built_in_model() {
        assert_eq!(source(Path::new("Torus"), &SessionOpener), Source::BuiltIn("torus".into()));
        assert_eq!(source(Path::new("torus.obj"), &SessionOpener), Source::File("torus.obj".into()));
    }

    #[test]
    fn a_mesh_needs_suggestions() {
        let error = open_session(Path::new("a.obj"), false, &DetailArguments::default(), &Progress::new());
        assert!(error.unwrap_err().to_string().contains("--suggest"));
    }
}

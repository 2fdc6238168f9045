//! Opens sessions on built-in models, mesh files and saved designs.

use std::path::{Path, PathBuf};

use plait_core::mesh::builtin_names;
use plait_core::progress::Progress;
use plait_core::weave::{Design, MeshSource, Options, Session};

use super::engine::SessionEngine;
use super::errors::without_place;
use crate::engine::{BuiltIn, Engine, EngineError, Opener, Source};

/// File name extension of designs.
const DESIGN: &str = "plait";

/// Opens sessions.
#[derive(Debug, Clone, Copy, Default)]
pub struct SessionOpener;

impl Opener for SessionOpener {
    fn built_ins(&self) -> Vec<BuiltIn> {
        builtin_names().map(|name| BuiltIn { name: name.into(), hint: hint(name).into() }).collect()
    }

    fn open(&self, source: &Source, progress: &Progress) -> Result<Box<dyn Engine>, EngineError> {
        progress.report("Reading", 0.0);
        let session = match source {
            Source::BuiltIn(name) => open_mesh(MeshSource::Builtin(name.clone()), progress)?,
            Source::File(path) if path.extension().is_some_and(|e| e.eq_ignore_ascii_case(DESIGN)) => {
                open_design(path, progress)?
            }
            Source::File(path) => open_mesh(MeshSource::File(absolute(path)), progress)?,
        };
        Ok(Box::new(SessionEngine::new(session)))
    }
}

/// A few words on the shape of a built-in model.
fn hint(name: &str) -> &'static str {
    match name {
        "creature" => "limbs",
        "rounded-cube" => "eight corners",
        "torus" => "genus 1",
        "pretzel" => "genus 3",
        "sleeve" => "with boundary",
        _ => "",
    }
}

fn open_mesh(source: MeshSource, progress: &Progress) -> Result<Session, EngineError> {
    let loaded = source.load(Path::new("")).map_err(without_place)?;
    progress.check()?;
    Session::open(loaded, source, Options::default(), progress).map_err(without_place)
}

fn open_design(path: &Path, progress: &Progress) -> Result<Session, EngineError> {
    let design = Design::read(path).map_err(without_place)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let loaded = design.mesh.load(folder).map_err(without_place)?;
    progress.check()?;
    let mut session = Session::resume(loaded, design, progress).map_err(without_place)?;
    // The path in the file is relative to the design, which may be saved to another folder.
    if let MeshSource::File(mesh) = &session.design().mesh {
        let mesh = absolute(&folder.join(mesh));
        session.set_source(MeshSource::File(mesh));
    }
    Ok(session)
}

/// A path that does not depend on the working directory.
fn absolute(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_path_buf())
}

//! The mesh of a benchmark: a file or a built-in model, possibly subdivided.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use plait_core::mesh::{
    LoadedMesh, MeshSource, SHARP_DIHEDRAL, load, loop_subdivision, parse_with, sharp_edges, write_mesh_obj,
};
use plait_core::progress::Progress;

/// The input of the measurements. Built-in and subdivided meshes are kept in memory as the text of an OBJ file, so that
/// reading them is measured too.
#[derive(Debug)]
pub(super) enum Input {
    File(PathBuf),
    Memory { name: String, obj: Vec<u8> },
}

impl Input {
    /// The file at `path` or the built-in model of this name, after `levels` Loop subdivisions.
    pub(super) fn new(path: &Path, levels: u32) -> anyhow::Result<Self> {
        let source = MeshSource::from_name(&path.to_string_lossy());
        let is_file = matches!(source, MeshSource::File(_));
        let mut loaded = if is_file { load(path) } else { source.load(Path::new("")) }
            .with_context(|| path.display().to_string())?;
        if is_file && levels == 0 {
            return Ok(Self::File(path.to_owned()));
        }
        let mut crease = sharp_edges(&loaded.mesh, SHARP_DIHEDRAL);
        for _ in 0..levels {
            let (mesh, finer) = loop_subdivision(&loaded.mesh, &crease)?;
            (loaded.mesh, crease) = (mesh.into(), finer);
        }
        let mut obj = Vec::new();
        write_mesh_obj(&mut obj, &loaded.mesh, &loaded.units)?;
        Ok(Self::Memory { name: format!("{}.obj", loaded.name), obj })
    }

    /// Reads the mesh.
    pub(super) fn load(&self, progress: &Progress) -> anyhow::Result<LoadedMesh> {
        let loaded = match self {
            Self::File(path) => {
                progress.report("Reading", 0.0);
                let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
                let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
                parse_with(&bytes, &name, progress)
            }
            Self::Memory { name, obj } => parse_with(obj, name, progress),
        };
        Ok(loaded?)
    }

    /// The mesh source of a design on this input.
    pub(super) fn source(&self) -> MeshSource {
        match self {
            Self::File(path) => MeshSource::File(path.clone()),
            Self::Memory { name, .. } => MeshSource::File(name.into()),
        }
    }
}

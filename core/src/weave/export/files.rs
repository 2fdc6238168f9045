//! The files of an export.

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::mesh::{MeshSource, Normalisation, write_obj};
use crate::output::{self, FileKind, MESH_COMMENT, OutputStream};
use crate::weave::error::WeaveError;
use crate::weave::export::result::Export;

/// The files that an export may write to its folder, with their kinds.
const EXPORTED: [(&str, FileKind); 6] = [
    ("design.plait", FileKind::Design),
    ("layout.layout", FileKind::Layout),
    ("layout.obj", FileKind::Mesh),
    ("quads.obj", FileKind::Mesh),
    ("patches.obj", FileKind::Mesh),
    ("report.json", FileKind::Report),
];

/// The files in `folder` that an export to it may replace.
pub fn existing_files(folder: &Path) -> Vec<PathBuf> {
    EXPORTED.iter().map(|(name, _)| folder.join(name)).filter(|path| path.exists()).collect()
}

/// Makes the folder of an export, and checks that the export replaces neither files that are not its own nor the mesh it is
/// made from.
pub(in crate::weave) fn prepare_folder(folder: &Path, mesh: &MeshSource) -> Result<(), WeaveError> {
    std::fs::create_dir_all(folder).map_err(|source| WeaveError::Folder { path: folder.to_owned(), source })?;
    let own = if let MeshSource::File(path) = mesh { path.canonicalize().ok() } else { None };
    for (name, kind) in EXPORTED {
        let path = folder.join(name);
        output::check_replaceable(&path, kind)?;
        if own.is_some() && path.canonicalize().ok() == own {
            return Err(WeaveError::OwnMesh { path });
        }
    }
    Ok(())
}

impl Export {
    /// Writes `layout.obj`, `quads.obj` and `patches.obj` to `folder`, in units of the file.
    ///
    /// # Errors
    ///
    /// [`WeaveError::Write`].
    pub fn write(&self, folder: &Path, units: &Normalisation) -> Result<(), WeaveError> {
        let in_file = |ps: &[glam::DVec3]| ps.iter().map(|&p| units.to_file(p)).collect::<Vec<_>>();
        let nodes = &self.quads.positions[..self.quads.n_nodes];
        let corners: Vec<[u32; 4]> = self.layout.patches.iter().map(|p| p.corners).collect();
        write_mesh(&folder.join("layout.obj"), "the patches of the layout, each as one polygon", |out| {
            write_obj(out, &in_file(nodes), &corners)
        })?;
        write_mesh(&folder.join("quads.obj"), "the quad mesh of the layout", |out| {
            write_obj(out, &in_file(&self.quads.positions), &self.quads.quads)
        })?;
        let about = "the triangle mesh, a group for each patch, with the map of the patch as texture coordinates";
        write_mesh(&folder.join("patches.obj"), about, |out| self.write_patches(out, units))
    }

    /// The triangle mesh, with one group for each patch and the map of the patch as texture coordinates. Vertices of the
    /// embedding come first, then those that only a map has.
    fn write_patches(&self, out: &mut impl Write, units: &Normalisation) -> std::io::Result<()> {
        let mut positions = self.embedding.mesh.positions.clone();
        let ids: Vec<Vec<u32>> = self
            .maps
            .iter()
            .map(|map| {
                let inner = map.mesh.positions()[map.parent.len()..].iter();
                let first = positions.len() as u32;
                positions.extend(inner);
                map.parent.iter().copied().chain(first..positions.len() as u32).collect()
            })
            .collect();
        for p in positions {
            let p = units.to_file(p);
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        for map in &self.maps {
            for uv in &map.uv {
                let uv = *uv * units.scale;
                writeln!(out, "vt {} {}", uv.x, uv.y)?;
            }
        }
        let mut first_uv = 1;
        for (p, (map, ids)) in self.maps.iter().zip(&ids).enumerate() {
            writeln!(out, "g patch{p}")?;
            for f in map.mesh.faces() {
                let [a, b, c] = map.mesh.face_vertices(f).map(|v| (ids[v.index()] + 1, first_uv + v.0));
                writeln!(out, "f {}/{} {}/{} {}/{}", a.0, a.1, b.0, b.1, c.0, c.1)?;
            }
            first_uv += map.uv.len() as u32;
        }
        Ok(())
    }
}

/// Writes an OBJ file that begins with a comment, by which it is recognised when it is to be replaced.
fn write_mesh(
    path: &Path,
    about: &str,
    fill: impl FnOnce(&mut OutputStream) -> std::io::Result<()>,
) -> Result<(), WeaveError> {
    output::write(path, FileKind::Mesh, |out| {
        writeln!(out, "{MESH_COMMENT}{about}")?;
        fill(out)
    })?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::OutputError;

    #[test]
    fn files_that_no_export_wrote_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let (folder, builtin) = (folder.path().join("a/b"), MeshSource::Builtin("torus".into()));
        prepare_folder(&folder, &builtin).unwrap();
        assert!(folder.is_dir() && existing_files(&folder).is_empty());
        let path = folder.join("quads.obj");
        std::fs::write(&path, "v 0 0 0\n").unwrap();
        let error = prepare_folder(&folder, &builtin).unwrap_err();
        assert!(matches!(&error, WeaveError::Write(OutputError::OtherKind { path: named, .. }) if *named == path));
        assert_eq!(existing_files(&folder), [path]);
    }

    #[test]
    fn the_mesh_of_the_layout_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("quads.obj");
        write_mesh(&path, "test", |out| writeln!(out, "v 0 0 0")).unwrap();
        prepare_folder(folder.path(), &MeshSource::File("other.obj".into())).unwrap();
        let error = prepare_folder(folder.path(), &MeshSource::File(path.clone())).unwrap_err();
        assert!(matches!(error, WeaveError::OwnMesh { path: named } if named == path));
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        let error = prepare_folder(&file.join("out"), &MeshSource::Builtin("torus".into())).unwrap_err();
        assert!(matches!(&error, WeaveError::Folder { .. }) && error.to_string().contains("file/out"), "{error}");
    }
}

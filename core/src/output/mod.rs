//! Writing files: a file is written whole or not at all, and replaces only a file of its own kind.
//!
//! The text goes to a temporary file in the same folder, which is renamed at the end. Whoever reads the file, or opens it
//! after the program or the machine has stopped, finds the old contents or the new ones.

mod kind;

use std::fs::File;
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};

use thiserror::Error;

pub use kind::FileKind;
pub(crate) use kind::MESH_COMMENT;

/// Why a file was not written. What was there before is unchanged.
#[derive(Debug, Error)]
pub enum OutputError {
    /// The operating system refused.
    #[error("{path} cannot be written: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// There is a file of another kind.
    #[error("{path} is no {kind}, so it is not replaced; choose another name or remove the file")]
    OtherKind {
        /// The file.
        path: PathBuf,
        /// The kind of file that would have replaced it.
        kind: FileKind,
    },
}

/// Where the contents of a file are written to.
pub type OutputStream<'a> = BufWriter<&'a mut File>;

/// Checks that a file of this kind may be written to `path`: nothing is there, an empty file, or one of the same kind.
///
/// # Errors
///
/// [`OutputError::OtherKind`], or [`OutputError::Io`] if the file cannot be read.
pub fn check_replaceable(path: &Path, kind: FileKind) -> Result<(), OutputError> {
    let failed = |source| OutputError::Io { path: path.to_owned(), source };
    match std::fs::metadata(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(failed(error)),
        // Nothing can be lost in an empty file, a pipe or a device.
        Ok(found) if found.len() == 0 && !found.is_dir() => Ok(()),
        Ok(found) if found.is_dir() => Err(failed(io::ErrorKind::IsADirectory.into())),
        Ok(_) if kind.recognises(path).map_err(failed)? => Ok(()),
        Ok(_) => Err(OutputError::OtherKind { path: path.to_owned(), kind }),
    }
}

/// Writes a file of this kind with what `fill` writes.
///
/// # Errors
///
/// See [`check_replaceable`]; and [`OutputError::Io`] if the file cannot be written.
pub fn write(
    path: &Path,
    kind: FileKind,
    fill: impl FnOnce(&mut OutputStream) -> io::Result<()>,
) -> Result<(), OutputError> {
    check_replaceable(path, kind)?;
    replace(path, fill).map_err(|source| OutputError::Io { path: path.to_owned(), source })
}

fn replace(path: &Path, fill: impl FnOnce(&mut OutputStream) -> io::Result<()>) -> io::Result<()> {
    // A link stays a link: the file that it names is replaced.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let before = std::fs::metadata(&path).ok();
    if before.as_ref().is_some_and(|found| !found.is_file()) {
        return fill_buffered(&mut File::options().write(true).open(&path)?, fill);
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".plait-");
    // Not readable by the user alone, as temporary files are, but as the user's settings have it.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut file = builder.tempfile_in(folder)?;
    fill_buffered(file.as_file_mut(), fill)?;
    file.as_file().sync_all()?;
    if let Some(found) = before {
        if found.permissions().readonly() {
            return Err(io::ErrorKind::PermissionDenied.into());
        }
        file.as_file().set_permissions(found.permissions())?;
    }
    file.persist(&path)?;
    Ok(())
}

fn fill_buffered(file: &mut File, fill: impl FnOnce(&mut OutputStream) -> io::Result<()>) -> io::Result<()> {
    let mut out = BufWriter::new(file);
    fill(&mut out)?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    const DESIGN: &str = r#"{"version":1,"mesh":{"builtin":"torus"},"fingerprint":"0","options":{},"strips":[]}"#;

    fn write_text(path: &Path, text: &str) -> Result<(), OutputError> {
        write(path, FileKind::Design, |out| out.write_all(text.as_bytes()))
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
    }

    #[test]
    fn a_file_of_another_kind_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bunny.obj");
        for kept in ["v 0 0 0\n", "{}", "{\"version\": 1}", "\u{0}\u{1}"] {
            std::fs::write(&path, kept).unwrap();
            let error = write_text(&path, DESIGN).unwrap_err();
            assert!(matches!(error, OutputError::OtherKind { .. }), "{error}");
            assert!(error.to_string().contains("bunny.obj is no Plait design"), "{error}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), kept);
        }
        assert_eq!(names(folder.path()), ["bunny.obj"]);
    }

    #[test]
    fn a_new_file_an_empty_one_and_one_of_the_same_kind_are_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.plait");
        write_text(&path, DESIGN).unwrap();
        let other = DESIGN.replace("torus", "cube");
        write_text(&path, &other).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), other);
        std::fs::write(&path, "").unwrap();
        write_text(&path, DESIGN).unwrap();
        assert_eq!(names(folder.path()), ["a.plait"]);
    }

    #[test]
    fn a_write_that_fails_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.plait");
        write_text(&path, DESIGN).unwrap();
        let failed = write(&path, FileKind::Design, |out| {
            out.write_all(b"half of it")?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert!(matches!(failed, Err(OutputError::Io { .. })));
        assert_eq!(std::fs::read_to_string(&path).unwrap(), DESIGN);
        assert_eq!(names(folder.path()), ["a.plait"]);
    }

    #[test]
    fn a_folder_that_is_missing_is_named() {
        let path = tempfile::tempdir().unwrap().path().join("none").join("a.plait");
        let error = write_text(&path, DESIGN).unwrap_err();
        assert!(error.to_string().contains("a.plait"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (path, link) = (folder.path().join("a.plait"), folder.path().join("link.plait"));
        std::fs::write(&path, DESIGN).unwrap();
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink("a.plait", &link).unwrap();
        let other = DESIGN.replace("torus", "cube");
        write_text(&link, &other).unwrap();
        assert!(link.is_symlink());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), other);
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    }
}

//! What a chosen path stands for: the file or folder that is written, and the files that are replaced.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use plait_core::weave::existing_files;

use super::asked::Asked;

/// Extension of a design.
const DESIGN: &str = "plait";

/// The path, with the extension of a design if a design is saved. Another extension stays in front of it, so that a name
/// never means a file that is there already.
pub(super) fn with_extension(asked: Asked, path: PathBuf) -> PathBuf {
    if asked != Asked::Save || path.extension().is_some_and(|e| e.eq_ignore_ascii_case(DESIGN)) {
        return path;
    }
    let mut name = path.file_name().map(OsStr::to_os_string).unwrap_or_default();
    name.push(".");
    name.push(DESIGN);
    path.with_file_name(name)
}

/// The files that are replaced if `path` is confirmed.
pub(super) fn replaced_files(asked: Asked, path: &Path) -> Vec<PathBuf> {
    match asked {
        Asked::Open => Vec::new(),
        Asked::Save => Some(path.to_owned()).filter(|p| p.exists()).into_iter().collect(),
        Asked::Export => existing_files(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_design_has_its_extension() {
        for (typed, written) in [
            ("a", "a.plait"),
            ("a.plait", "a.plait"),
            ("a.PLAIT", "a.PLAIT"),
            ("bunny.obj", "bunny.obj.plait"),
            ("v1.2", "v1.2.plait"),
            ("x/a", "x/a.plait"),
        ] {
            assert_eq!(with_extension(Asked::Save, typed.into()), Path::new(written));
        }
        assert_eq!(with_extension(Asked::Export, "a".into()), Path::new("a"));
    }

    #[test]
    fn files_that_are_there_are_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["a.plait", "quads.obj", "other.obj"] {
            std::fs::write(at(name), "").unwrap();
        }
        assert_eq!(replaced_files(Asked::Save, &at("a.plait")), [at("a.plait")]);
        assert!(replaced_files(Asked::Save, &at("b.plait")).is_empty());
        assert!(replaced_files(Asked::Open, &at("a.plait")).is_empty());
        assert_eq!(replaced_files(Asked::Export, folder.path()), [at("quads.obj")]);
    }
}

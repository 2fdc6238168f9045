//! The kinds of files that the program writes, and how each is recognised.

use std::fmt;
use std::fs::File;
use std::io::{self, BufReader, Read as _};
use std::path::Path;

use serde::Deserialize;
use serde::de::IgnoredAny;

/// The first words of a mesh file that the program writes.
pub(crate) const MESH_COMMENT: &str = "# Plait: ";

/// A kind of file that the program writes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A design, `.plait`.
    Design,
    /// A layout file, `.layout`.
    Layout,
    /// A report of an export, JSON.
    Report,
    /// An OBJ file that the program wrote; other OBJ files are not recognised.
    Mesh,
    /// A PNG picture.
    Png,
    /// An SVG picture.
    Svg,
}

impl fmt::Display for FileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Design => "Plait design",
            Self::Layout => "Plait layout",
            Self::Report => "report of an export",
            Self::Mesh => "mesh written by Plait",
            Self::Png => "PNG picture",
            Self::Svg => "SVG picture",
        })
    }
}

/// The fields by which a design is recognised.
#[derive(Deserialize)]
struct DesignFields {
    #[serde(rename = "version")]
    _version: u32,
    #[serde(rename = "mesh")]
    _mesh: IgnoredAny,
    #[serde(rename = "strips")]
    _strips: Vec<IgnoredAny>,
}

/// The fields by which a layout file is recognised.
#[derive(Deserialize)]
struct LayoutFields {
    #[serde(rename = "version")]
    _version: u32,
    #[serde(rename = "nodes")]
    _nodes: Vec<IgnoredAny>,
    #[serde(rename = "arcs")]
    _arcs: Vec<IgnoredAny>,
}

/// The fields by which a report is recognised.
#[derive(Deserialize)]
struct ReportFields {
    #[serde(rename = "faces")]
    _faces: u64,
    #[serde(rename = "valid")]
    _valid: bool,
    #[serde(rename = "seconds")]
    _seconds: IgnoredAny,
}

impl FileKind {
    /// Whether the file at `path` is of this kind.
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    pub fn recognises(self, path: &Path) -> io::Result<bool> {
        let mut file = BufReader::new(File::open(path)?);
        match self {
            Self::Design => is_json::<DesignFields>(file),
            Self::Layout => is_json::<LayoutFields>(file),
            Self::Report => is_json::<ReportFields>(file),
            Self::Mesh => begins_with(&mut file, &[MESH_COMMENT.as_bytes()]),
            Self::Png => begins_with(&mut file, &[b"\x89PNG\r\n\x1a\n"]),
            Self::Svg => begins_with(&mut file, &[b"<svg", b"<?xml"]),
        }
    }
}

fn is_json<T: for<'de> Deserialize<'de>>(file: BufReader<File>) -> io::Result<bool> {
    match serde_json::from_reader::<_, T>(file) {
        Ok(_) => Ok(true),
        Err(error) if error.is_io() => Err(error.into()),
        Err(_) => Ok(false),
    }
}

fn begins_with(file: &mut BufReader<File>, beginnings: &[&[u8]]) -> io::Result<bool> {
    let longest = beginnings.iter().map(|b| b.len()).max().unwrap_or(0);
    let mut head = Vec::new();
    file.take(longest as u64).read_to_end(&mut head)?;
    Ok(beginnings.iter().any(|b| head.starts_with(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_recognised_by_their_contents() {
        let files = [
            (FileKind::Design, r#"{"version":1,"mesh":{"file":"a.obj"},"strips":[{"id":0}]}"#),
            (FileKind::Layout, r#"{"version":1,"mesh":{},"nodes":[],"arcs":[]}"#),
            (FileKind::Report, r#"{"mesh":"a","faces":12,"valid":false,"seconds":{}}"#),
            (FileKind::Mesh, "# Plait: quads\nv 0 0 0\n"),
            (FileKind::Png, "\u{89}PNG"),
            (FileKind::Svg, "<svg xmlns=\"http://www.w3.org/2000/svg\"/>"),
        ];
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        for (own, text) in files {
            let png = b"\x89PNG\r\n\x1a\nIHDR";
            let bytes: &[u8] = if own == FileKind::Png { png } else { text.as_bytes() };
            std::fs::write(&path, bytes).unwrap();
            for (kind, _) in files {
                assert_eq!(kind.recognises(&path).unwrap(), kind == own, "{own} taken for {kind}");
            }
        }
    }

    #[test]
    fn a_mesh_of_another_program_is_not_recognised() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("quads.obj");
        for text in ["v 0 0 0\n", "# Blender\nv 0 0 0\n", ""] {
            std::fs::write(&path, text).unwrap();
            assert!(!FileKind::Mesh.recognises(&path).unwrap(), "{text}");
        }
    }
}

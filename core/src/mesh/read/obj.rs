//! Wavefront OBJ: `v` and `f` lines; all others are ignored.
//!
//! No library is used because errors must name their line, indices may be negative (counted back from the latest vertex),
//! faces may have any number of corners, and coordinates are read in double precision.

use std::borrow::Cow;

use glam::DVec3;

use super::raw_mesh::RawMesh;
use super::text::{coordinate, lines, number, show, syntax, tokens};
use crate::mesh::error::LoadError;

pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, LoadError> {
    let bytes = join_continued(bytes);
    let mut raw = RawMesh { base: 1, ..RawMesh::default() };
    for (line, content) in lines(&bytes) {
        let mut words = tokens(content);
        match words.next() {
            Some(b"v") => {
                let mut xyz = || coordinate(&mut words, line);
                raw.positions.push(DVec3::new(xyz()?, xyz()?, xyz()?));
            }
            Some(b"f") => {
                for word in words {
                    let corner = corner(word, raw.positions.len(), line)?;
                    raw.corners.push(corner);
                }
                raw.close_polygon(Some(line));
            }
            _ => {}
        }
    }
    Ok(raw)
}

/// The vertex index (from 0) of a corner written as `v`, `v/vt`, `v//vn` or `v/vt/vn`.
fn corner(word: &[u8], n_vertices: usize, line: usize) -> Result<u32, LoadError> {
    let digits = word.split(|&b| b == b'/').next().unwrap_or_default();
    let written: i64 =
        number(digits).ok_or_else(|| syntax(line, format!("“{}” is not a corner of a face", show(word))))?;
    let index = if written < 0 { n_vertices as i64 + written } else { written - 1 };
    u32::try_from(index).map_err(|_| syntax(line, format!("there is no vertex {written} here")))
}

/// Joins lines that end in a backslash with the next one; empty lines keep the line numbers.
fn join_continued(bytes: &[u8]) -> Cow<'_, [u8]> {
    if !bytes.contains(&b'\\') {
        return Cow::Borrowed(bytes);
    }
    let mut joined = Vec::with_capacity(bytes.len());
    let mut missing_lines = 0;
    for line in bytes.split(|&b| b == b'\n') {
        let text = line.strip_suffix(b"\r").unwrap_or(line);
        if let Some(head) = text.strip_suffix(b"\\") {
            joined.extend_from_slice(head);
            joined.push(b' ');
            missing_lines += 1;
        } else {
            joined.extend_from_slice(text);
            joined.extend(std::iter::repeat_n(b'\n', missing_lines + 1));
            missing_lines = 0;
        }
    }
    Cow::Owned(joined)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_read_in_all_notations() {
        let text = b"v 0 0 0 1 0 0\r\nv 1 0 0\n# caf\xe9\nv 0 1 0\nf 1/1/1 2//2 3/4\nf -3 -2 \\\n -1\nf 1 2 3\n";
        let raw = read(text).unwrap();
        assert_eq!(raw.positions.len(), 3);
        assert_eq!(raw.corners, [0, 1, 2, 0, 1, 2, 0, 1, 2]);
        assert_eq!(raw.lines, [5, 6, 8]);
    }

    #[test]
    fn an_error_names_its_line() {
        let message = |text: &str| read(text.as_bytes()).unwrap_err().to_string();
        assert!(message("v 0 0 0\nv 0 x 0\n").contains("line 2"));
        assert!(message("v 0 0 nan\n").contains("finite"));
        assert!(message("v 0 0 0\n\nf 1 2 -2\n").contains("line 3: there is no vertex -2"));
        assert!(message("v 0 0\n").contains("three coordinates"));
    }
}

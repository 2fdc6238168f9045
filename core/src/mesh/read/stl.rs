//! STL, as text and as binary: a triangle soup.
//!
//! No library is used because the length of the file tells binary from text (a binary header may begin with "solid" too),
//! and errors in text files must name their line.

use glam::DVec3;

use super::raw_mesh::RawMesh;
use super::text::{coordinate, lines, syntax, tokens};
use crate::mesh::error::LoadError;

/// Bytes before the triangles of a binary file: 80 of any content and the number of triangles.
const HEADER: usize = 84;
/// Bytes of a triangle of a binary file: normal and three corners of three 4-byte numbers each, 2 bytes of attributes.
const RECORD: usize = 50;

/// Whether the length of the file is that of the declared number of triangles.
pub(super) fn is_binary(bytes: &[u8]) -> bool {
    declared(bytes).is_some_and(|n| n.checked_mul(RECORD).is_some_and(|size| size + HEADER == bytes.len()))
}

/// The declared number of triangles.
fn declared(bytes: &[u8]) -> Option<usize> {
    let n = bytes.get(HEADER - 4..HEADER)?;
    Some(u32::from_le_bytes([n[0], n[1], n[2], n[3]]) as usize)
}

pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, LoadError> {
    let is_text =
        !is_binary(bytes) && bytes.trim_ascii_start().get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    if is_text { read_text(bytes) } else { read_binary(bytes) }
}

fn read_binary(bytes: &[u8]) -> Result<RawMesh, LoadError> {
    let Some(n) = declared(bytes) else {
        return Err(LoadError::Syntax { line: None, message: "the file ends inside its header".into() });
    };
    let records = &bytes[HEADER..];
    if records.len() / RECORD < n {
        let message = format!("the file ends after {} of {n} triangles", records.len() / RECORD);
        return Err(LoadError::Syntax { line: None, message });
    }
    let mut raw = RawMesh { soup: true, ..RawMesh::default() };
    for record in records.chunks_exact(RECORD).take(n) {
        let float = |i: usize| f64::from(f32::from_le_bytes([record[i], record[i + 1], record[i + 2], record[i + 3]]));
        for corner in [12, 24, 36] {
            raw.corners.push(raw.positions.len() as u32);
            raw.positions.push(DVec3::new(float(corner), float(corner + 4), float(corner + 8)));
        }
        raw.close_polygon(None);
    }
    Ok(raw)
}

fn read_text(bytes: &[u8]) -> Result<RawMesh, LoadError> {
    let mut raw = RawMesh { soup: true, ..RawMesh::default() };
    let mut open_since = None;
    for (line, content) in lines(bytes) {
        let mut words = tokens(content);
        let Some(word) = words.next() else { continue };
        if word.eq_ignore_ascii_case(b"vertex") {
            let mut xyz = || coordinate(&mut words, line);
            let position = DVec3::new(xyz()?, xyz()?, xyz()?);
            raw.corners.push(raw.positions.len() as u32);
            raw.positions.push(position);
        } else if word.eq_ignore_ascii_case(b"facet") {
            open_since = Some((line, raw.corners.len()));
        } else if word.eq_ignore_ascii_case(b"endfacet") {
            match open_since.take() {
                Some((start, n)) if raw.corners.len() == n + 3 => raw.close_polygon(Some(start)),
                _ => return Err(syntax(line, "a facet must have three vertices")),
            }
        }
    }
    match open_since {
        Some((line, _)) => Err(syntax(line, "the file ends inside this facet")),
        None => Ok(raw),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "solid a\n facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1 0 0\n vertex 0 1 0\n \
                        endloop\n endfacet\nendsolid a\n";

    #[test]
    fn text_and_binary_agree() {
        let text = read(TEXT.as_bytes()).unwrap();
        let mut bytes = b"solid but binary".to_vec();
        bytes.resize(80, 0);
        bytes.extend(1u32.to_le_bytes());
        for x in [0.0f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            bytes.extend(x.to_le_bytes());
        }
        bytes.extend([0, 0]);
        assert!(is_binary(&bytes));
        let binary = read(&bytes).unwrap();
        assert_eq!((text.positions, text.corners), (binary.positions, binary.corners));
        bytes.pop();
        assert!(read_binary(&bytes).unwrap_err().to_string().contains("0 of 1"));
    }

    #[test]
    fn an_error_names_its_line() {
        let message = |text: &str| read(text.as_bytes()).unwrap_err().to_string();
        assert!(message(&TEXT.replace("1 0 0", "1 q 0")).contains("line 5"));
        assert!(message(&TEXT[..60]).contains("line 2"));
        assert!(message(&TEXT.replace("vertex 0 1 0\n", "\n")).contains("three vertices"));
    }
}

//! PLY, as text and as binary of both byte orders.
//!
//! The header declares elements and their properties. All values are read as declared; `x`, `y`, `z` of `vertex` and the
//! list `vertex_indices` (or `vertex_index`) of `face` are kept. No library is used because headers cannot be trusted
//! (elements without properties, counts beyond the file) and errors in text files must name their line.

use glam::DVec3;

use super::raw_mesh::RawMesh;
use super::text::{number, show, tokens};
use crate::mesh::error::LoadError;

/// The type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(word: &[u8]) -> Option<Self> {
        Some(match word {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }
}

#[derive(Debug)]
struct Property {
    name: Vec<u8>,
    /// Type of the length, if the property is a list.
    length: Option<Scalar>,
    scalar: Scalar,
}

#[derive(Debug)]
struct Element {
    name: Vec<u8>,
    count: usize,
    properties: Vec<Property>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Text,
    Little,
    Big,
}

pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, LoadError> {
    let mut source = Source { bytes, at: 0, line: 0, encoding: Encoding::Text, row: &[] };
    let (encoding, elements) = read_header(&mut source)?;
    source.encoding = encoding;
    let mut raw = RawMesh::default();
    for element in &elements {
        match element.name.as_slice() {
            b"vertex" => read_vertices(&mut source, element, &mut raw)?,
            b"face" => read_faces(&mut source, element, &mut raw)?,
            // Elements without properties take no bytes, whatever their declared count.
            _ if element.properties.is_empty() => {}
            _ => {
                for i in 0..element.count {
                    source.open_row(element, i)?;
                    for property in &element.properties {
                        source.property(property, |_| {})?;
                    }
                }
            }
        }
    }
    Ok(raw)
}

fn read_header(source: &mut Source<'_>) -> Result<(Encoding, Vec<Element>), LoadError> {
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let Some(line) = source.next_line() else { return Err(source.error("the file ends inside its header")) };
        let words: Vec<&[u8]> = tokens(line).collect();
        match words.as_slice() {
            [] | [b"ply" | b"comment" | b"obj_info", ..] => {}
            [b"format", b"ascii", _] => encoding = Some(Encoding::Text),
            [b"format", b"binary_little_endian", _] => encoding = Some(Encoding::Little),
            [b"format", b"binary_big_endian", _] => encoding = Some(Encoding::Big),
            [b"element", name, count] => {
                let count =
                    number(count).ok_or_else(|| source.error("the number of elements is not a whole number"))?;
                elements.push(Element { name: name.to_vec(), count, properties: Vec::new() });
            }
            [b"property", rest @ ..] => {
                let property =
                    parse_property(rest).ok_or_else(|| source.error("the property declaration is malformed"))?;
                let element =
                    elements.last_mut().ok_or_else(|| source.error("a property is declared before any element"))?;
                element.properties.push(property);
            }
            [b"end_header"] => break,
            [word, ..] => return Err(source.error(format!("“{}” is not a keyword of a PLY header", show(word)))),
        }
    }
    let encoding = encoding.ok_or_else(|| source.error("the header does not name the format"))?;
    Ok((encoding, elements))
}

fn parse_property(words: &[&[u8]]) -> Option<Property> {
    match words {
        [b"list", length, scalar, name] => {
            let length = Scalar::parse(length).filter(|l| !matches!(l, Scalar::F32 | Scalar::F64))?;
            Some(Property { name: name.to_vec(), length: Some(length), scalar: Scalar::parse(scalar)? })
        }
        [scalar, name] => Some(Property { name: name.to_vec(), length: None, scalar: Scalar::parse(scalar)? }),
        _ => None,
    }
}

fn read_vertices(source: &mut Source<'_>, element: &Element, raw: &mut RawMesh) -> Result<(), LoadError> {
    let axis = |p: &Property| [b"x", b"y", b"z"].iter().position(|name| p.length.is_none() && p.name == *name);
    let axes: Vec<Option<usize>> = element.properties.iter().map(axis).collect();
    if (0..3).any(|i| !axes.contains(&Some(i))) {
        return Err(source.error("the vertices have no x, y and z"));
    }
    for i in 0..element.count {
        source.open_row(element, i)?;
        let mut position = DVec3::ZERO;
        for (property, axis) in element.properties.iter().zip(&axes) {
            source.property(property, |value| {
                if let Some(axis) = *axis {
                    position[axis] = value;
                }
            })?;
        }
        raw.positions.push(position);
    }
    Ok(())
}

fn read_faces(source: &mut Source<'_>, element: &Element, raw: &mut RawMesh) -> Result<(), LoadError> {
    let is_corners = |p: &Property| p.length.is_some() && (p.name == b"vertex_indices" || p.name == b"vertex_index");
    if element.count > 0 && !element.properties.iter().any(is_corners) {
        return Err(source.error("the faces have no list of vertex indices"));
    }
    for i in 0..element.count {
        source.open_row(element, i)?;
        let mut valid = true;
        for property in &element.properties {
            let keep = is_corners(property);
            source.property(property, |value| {
                if keep {
                    // The cast saturates for a value that is not an index; the error follows below.
                    valid &= value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0;
                    raw.corners.push(value as u32);
                }
            })?;
        }
        if !valid {
            return Err(source.error(format!("face {i} has a corner that is not a vertex number")));
        }
        raw.close_polygon((source.encoding == Encoding::Text).then_some(source.line));
    }
    Ok(())
}

/// The bytes of a file and the position in them.
struct Source<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Line read last, from 1.
    line: usize,
    encoding: Encoding,
    /// The rest of that line, in text.
    row: &'a [u8],
}

impl<'a> Source<'a> {
    fn error(&self, message: impl Into<String>) -> LoadError {
        let line = (self.encoding == Encoding::Text).then_some(self.line);
        LoadError::Syntax { line, message: message.into() }
    }

    /// The next line; a line may end in `\n`, `\r\n` or `\r`.
    fn next_line(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return None;
        }
        let end = rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(rest.len());
        let break_length = if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        self.at = (self.at + end + break_length).min(self.bytes.len());
        self.line += 1;
        Some(&rest[..end])
    }

    /// Moves to element `i`; in text, to the next line that is not blank.
    fn open_row(&mut self, element: &Element, i: usize) -> Result<(), LoadError> {
        let ended = match self.encoding {
            Encoding::Text => loop {
                match self.next_line() {
                    None => break true,
                    Some(line) if !line.trim_ascii().is_empty() => {
                        self.row = line;
                        break false;
                    }
                    Some(_) => {}
                }
            },
            Encoding::Little | Encoding::Big => self.at >= self.bytes.len(),
        };
        if ended {
            let name = show(&element.name);
            let message = format!("the file ends after {i} of {} elements “{name}”", element.count);
            return Err(LoadError::Syntax { line: None, message });
        }
        Ok(())
    }

    /// Reads all values of a property of the current element.
    fn property(&mut self, property: &Property, mut keep: impl FnMut(f64)) -> Result<(), LoadError> {
        let n = match property.length {
            None => 1,
            Some(length) => {
                let n = self.scalar(length)?;
                if n < 0.0 || n.fract() != 0.0 {
                    return Err(self.error("a list has a length that is not a whole number"));
                }
                n as u64
            }
        };
        for _ in 0..n {
            keep(self.scalar(property.scalar)?);
        }
        Ok(())
    }

    fn scalar(&mut self, scalar: Scalar) -> Result<f64, LoadError> {
        match self.encoding {
            Encoding::Text => {
                let row = self.row.trim_ascii_start();
                let end = row.iter().position(u8::is_ascii_whitespace).unwrap_or(row.len());
                let (token, rest) = row.split_at(end);
                self.row = rest;
                if token.is_empty() {
                    return Err(self.error("there are fewer values than the header announces"));
                }
                number(token).ok_or_else(|| self.error(format!("“{}” is not a number", show(token))))
            }
            Encoding::Little => self.binary(scalar, false),
            Encoding::Big => self.binary(scalar, true),
        }
    }

    fn binary(&mut self, scalar: Scalar, big: bool) -> Result<f64, LoadError> {
        Ok(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.take(big)?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.take(big)?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.take(big)?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.take(big)?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.take(big)?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.take(big)?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.take(big)?)),
            Scalar::F64 => f64::from_le_bytes(self.take(big)?),
        })
    }

    /// The next bytes in little-endian order.
    fn take<const N: usize>(&mut self, big: bool) -> Result<[u8; N], LoadError> {
        let chunk = self.bytes.get(self.at..self.at + N).and_then(|b| <[u8; N]>::try_from(b).ok());
        let mut chunk = chunk.ok_or_else(|| self.error("the file ends inside an element"))?;
        self.at += N;
        if big {
            chunk.reverse();
        }
        Ok(chunk)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "element vertex 3\nproperty float x\nproperty double y\nproperty uchar red\nproperty float z\n\
                        element face 1\nproperty list uchar int vertex_indices\nelement nothing 99999999999\nend_header\n";

    fn binary(big: bool) -> Vec<u8> {
        let name = if big { "big" } else { "little" };
        let mut bytes = format!("ply\nformat binary_{name}_endian 1.0\ncomment caf\n{HEAD}").into_bytes();
        let mut put = |little: &[u8]| {
            let mut value = little.to_vec();
            if big {
                value.reverse();
            }
            bytes.extend(value);
        };
        for p in [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 2.0]] {
            put(&p[0].to_le_bytes());
            put(&f64::from(p[1]).to_le_bytes());
            put(&[7]);
            put(&p[2].to_le_bytes());
        }
        put(&[3]);
        for i in 0..3i32 {
            put(&i.to_le_bytes());
        }
        bytes
    }

    #[test]
    fn text_and_binary_agree() {
        let text = format!("ply\nformat ascii 1.0\n{HEAD}0 0 7 0\n1. 0 7 0\n\n0 1e0 7 2\n3 0 1 2\n");
        let text = read(text.as_bytes()).unwrap();
        assert_eq!(text.positions[2], DVec3::new(0.0, 1.0, 2.0));
        for big in [false, true] {
            let raw = read(&binary(big)).unwrap();
            assert_eq!((&raw.positions, &raw.corners), (&text.positions, &text.corners));
        }
        assert_eq!(text.lines, [16]);
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = binary(false);
        for n in 0..bytes.len() {
            assert!(read(&bytes[..n]).is_err(), "{n}");
        }
    }
}

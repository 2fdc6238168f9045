//! Lines, tokens and numbers of text formats, read as bytes, since comments may be of any encoding.

use std::str::FromStr;

use crate::mesh::error::LoadError;

/// The lines with their numbers from 1, without comments (from `#` on).
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, &[u8])> {
    bytes.split(|&b| b == b'\n').enumerate().map(|(i, line)| {
        let end = line.iter().position(|&b| b == b'#').unwrap_or(line.len());
        (i + 1, &line[..end])
    })
}

/// The words of a line.
pub(super) fn tokens(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|t| !t.is_empty())
}

/// The number a token stands for; `None` if it is no number.
pub(super) fn number<T: FromStr>(token: &[u8]) -> Option<T> {
    std::str::from_utf8(token).ok()?.parse().ok()
}

/// The next token as a finite coordinate.
pub(super) fn coordinate<'a>(tokens: &mut impl Iterator<Item = &'a [u8]>, line: usize) -> Result<f64, LoadError> {
    let token = tokens.next().ok_or_else(|| syntax(line, "a vertex needs three coordinates"))?;
    let value: f64 = number(token).ok_or_else(|| syntax(line, format!("“{}” is not a number", show(token))))?;
    if !value.is_finite() {
        return Err(syntax(line, format!("the coordinate “{}” is not a finite number", show(token))));
    }
    Ok(value)
}

/// A syntax error at a line.
pub(super) fn syntax(line: usize, message: impl Into<String>) -> LoadError {
    LoadError::Syntax { line: Some(line), message: message.into() }
}

/// A token for a message: control characters replaced, shortened.
pub(super) fn show(token: &[u8]) -> String {
    // Bytes of a token that are shown; chosen by hand.
    const SHOWN: usize = 24;
    let text = String::from_utf8_lossy(&token[..token.len().min(SHOWN)]);
    let mut shown: String = text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    if token.len() > SHOWN {
        shown.push('…');
    }
    shown
}

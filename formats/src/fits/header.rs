//! Header cards: `KEYWORD = value / comment`, 80 characters each, up to `END`.

use super::input::{BLOCK, Input, padding};
use crate::{FormatError, Result};
use cittert_arrays::Polarization;
use std::path::{Path, PathBuf};

/// Largest number of blocks of a header; a block has 36 cards, so this allows about 130,000 cards.
const MOST_BLOCKS: usize = 3600;

/// Value of a card.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    /// `T` or `F`.
    Logical(bool),
    /// A number without point or exponent.
    Integer(i64),
    /// Any other number.
    Real(f64),
    /// A text between quotes.
    Text(String),
    /// No value, or one that could not be understood.
    None,
}

/// A header that was read: keywords with values, and the history.
#[derive(Debug, Clone)]
pub(crate) struct Header {
    path: PathBuf,
    cards: Vec<(String, Value)>,
    /// Texts of the HISTORY cards.
    pub(crate) history: Vec<String>,
    /// Number of COMMENT cards.
    pub(crate) comments: usize,
}

impl Header {
    /// Read blocks up to the block with END. `None` where the file ends before the first block.
    pub(crate) fn read(input: &mut Input, first: bool) -> Result<Option<Self>> {
        let mut header = Self { path: input.path().into(), cards: Vec::new(), history: Vec::new(), comments: 0 };
        let mut block = [0u8; BLOCK];
        for n in 0..MOST_BLOCKS {
            let got = input.read_some(&mut block)?;
            if n == 0 {
                let start = if first { &b"SIMPLE  ="[..] } else { b"XTENSION=" };
                if !block[..got].starts_with(start) {
                    // Some writers leave padding after the last extension.
                    if !first {
                        return Ok(None);
                    }
                    let shown: String = block[..got.min(8)].iter().map(|b| b.escape_ascii().to_string()).collect();
                    return Err(FormatError::not_a(
                        &header.path,
                        "a FITS file, which begins with \"SIMPLE  =\"",
                        format!("it begins with \"{shown}\""),
                    ));
                }
            }
            if got < BLOCK {
                return Err(FormatError::malformed(
                    &header.path,
                    format!("header block {n}"),
                    "2880 bytes with an END card",
                    format!("{got} bytes to the end of the file (truncated)"),
                ));
            }
            for card in block.chunks_exact(80) {
                if header.take(card) {
                    return Ok(Some(header));
                }
            }
        }
        Err(FormatError::malformed(&header.path, "header", "an END card", format!("none in {MOST_BLOCKS} blocks")))
    }

    /// Parse one card. True for END.
    fn take(&mut self, card: &[u8]) -> bool {
        // Real files contain bytes outside printable ASCII. They must not shift the columns.
        let text: String = card.iter().map(|b| if (32..127).contains(b) { *b as char } else { ' ' }).collect();
        let key = text[..8].trim_end();
        match key {
            "END" if text[3..].trim().is_empty() => return true,
            "HISTORY" => self.history.push(text[8..].trim_end().to_string()),
            "COMMENT" => self.comments += 1,
            "CONTINUE" => {
                if let (Value::Text(more), Some((_, Value::Text(whole)))) = (parse_value(&text[8..]), self.cards.last_mut())
                    && whole.ends_with('&')
                {
                    whole.pop();
                    whole.push_str(&more);
                }
            }
            _ if &text[8..10] == "= " => self.cards.push((key.to_string(), parse_value(&text[10..]))),
            _ => {}
        }
        false
    }

    /// The file of this header.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// All keywords with their values, in their order.
    pub(crate) fn all(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.cards.iter().map(|(key, value)| (key.as_str(), value))
    }

    /// First value of a keyword.
    pub(crate) fn get(&self, key: &str) -> Option<&Value> {
        self.cards.iter().find(|c| c.0 == key).map(|c| &c.1)
    }

    /// A number, where there is one. Numbers written as texts are accepted, as real files have them.
    pub(crate) fn real(&self, key: &str) -> Option<f64> {
        match self.get(key)? {
            Value::Integer(i) => Some(*i as f64),
            Value::Real(r) => Some(*r),
            Value::Text(t) => t.trim().trim_start_matches('J').parse().ok(),
            _ => None,
        }
    }

    /// A whole number, where there is one.
    pub(crate) fn integer(&self, key: &str) -> Option<i64> {
        match self.get(key)? {
            Value::Integer(i) => Some(*i),
            Value::Real(r) if r.fract() == 0.0 && r.abs() < 1e15 => Some(*r as i64),
            _ => None,
        }
    }

    /// A text without the blanks at its end, where there is one.
    pub(crate) fn text(&self, key: &str) -> Option<&str> {
        match self.get(key)? {
            Value::Text(t) => Some(t.trim_end()),
            _ => None,
        }
    }

    /// True where the keyword is `T`.
    pub(crate) fn is_true(&self, key: &str) -> bool {
        self.get(key) == Some(&Value::Logical(true))
    }

    /// A whole number of a range that must be there.
    pub(crate) fn require(&self, key: &str, range: std::ops::RangeInclusive<i64>) -> Result<i64> {
        match self.get(key) {
            Some(_) => self.integer(key).filter(|v| range.contains(v)),
            None => None,
        }
        .ok_or_else(|| {
            let found = self.get(key).map_or("no such keyword".into(), |v| format!("{v:?}"));
            FormatError::malformed(&self.path, key, format!("a whole number from {} to {}", range.start(), range.end()), found)
        })
    }

    /// Lengths of the axes, NAXIS1 first.
    pub(crate) fn axes(&self) -> Result<Vec<u64>> {
        let n = self.require("NAXIS", 0..=99)?;
        (1..=n).map(|k| self.require(&format!("NAXIS{k}"), 0..=i64::MAX).map(|v| v as u64)).collect()
    }

    /// Type of axis `k` in upper case, or an empty text.
    pub(crate) fn ctype(&self, k: usize) -> String {
        self.text(&format!("CTYPE{k}")).unwrap_or("").trim().to_ascii_uppercase()
    }

    /// Value at the reference pixel of axis `k`, the pixel, and the step; `default` are value and step where the header has none.
    pub(crate) fn axis(&self, k: usize, default: (f64, f64)) -> (f64, f64, f64) {
        let value = |key: &str, default: f64| self.real(&format!("{key}{k}")).unwrap_or(default);
        (value("CRVAL", default.0), value("CRPIX", 1.0), value("CDELT", default.1))
    }

    /// The `n` polarisations of axis `k`.
    pub(crate) fn polarizations(&self, k: usize, n: usize) -> Result<Vec<Polarization>> {
        let (reference, pixel, step) = self.axis(k, (1.0, 1.0));
        let codes = (0..n).map(|p| (reference + (p as f64 + 1.0 - pixel) * step).round() as i32);
        codes.map(Polarization::from_aips).collect::<Result<_, _>>().map_err(|e| FormatError::values(&self.path, e))
    }

    /// Size of the data that follow this header, without padding, bytes.
    pub(crate) fn data_bytes(&self) -> Result<u64> {
        let bitpix = self.require("BITPIX", -64..=64)?.unsigned_abs();
        let mut axes = self.axes()?;
        let groups = self.is_true("GROUPS") && axes.first() == Some(&0);
        if groups {
            axes.remove(0);
        }
        if axes.is_empty() {
            return Ok(0);
        }
        let count = |key| self.get(key).map_or(Ok(None), |_| self.require(key, 0..=i64::MAX).map(|v| Some(v as u64)));
        let (pcount, gcount) = (count("PCOUNT")?.unwrap_or(0), count("GCOUNT")?.unwrap_or(1));
        let too_much =
            || FormatError::malformed(&self.path, "NAXISn, PCOUNT, GCOUNT", "a size that a file can have", "more than 2^64 bytes");
        axes.iter()
            .try_fold(1u64, |n, a| n.checked_mul(*a))
            .and_then(|n| n.checked_add(pcount))
            .and_then(|n| n.checked_mul(gcount))
            .and_then(|n| n.checked_mul(bitpix / 8))
            .filter(|n| *n < u64::MAX - BLOCK as u64)
            .ok_or_else(too_much)
    }
}

/// The value before an optional comment.
fn parse_value(text: &str) -> Value {
    let text = text.trim_start();
    if let Some(quoted) = text.strip_prefix('\'') {
        let mut out = String::new();
        let mut chars = quoted.chars().peekable();
        while let Some(c) = chars.next() {
            // Two quotes mean one quote; a single quote ends the text.
            if c == '\'' && chars.next_if_eq(&'\'').is_none() {
                break;
            }
            out.push(c);
        }
        return Value::Text(out.trim_end().to_string());
    }
    let word = text.split('/').next().unwrap_or("").trim();
    match word {
        "" => Value::None,
        "T" => Value::Logical(true),
        "F" => Value::Logical(false),
        _ => {
            if let Ok(i) = word.parse::<i64>() {
                return Value::Integer(i);
            }
            let number = word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
            match word.replace(['D', 'd'], "E").parse::<f64>() {
                Ok(r) if number => Value::Real(r),
                _ => Value::None,
            }
        }
    }
}

/// A header being written.
#[derive(Debug, Default)]
pub(crate) struct HeaderWriter {
    bytes: Vec<u8>,
}

impl HeaderWriter {
    fn card(&mut self, text: &str) {
        let start = self.bytes.len();
        self.bytes.extend(text.chars().map(|c| if (' '..='~').contains(&c) { c as u8 } else { b'?' }).take(80));
        self.bytes.resize(start + 80, b' ');
    }

    fn value(&mut self, key: &str, value: &str, comment: &str) {
        let slash = if comment.is_empty() { "" } else { " / " };
        self.card(&format!("{key:<8}= {value}{slash}{comment}"));
    }

    /// `T` or `F`.
    pub(crate) fn logical(&mut self, key: &str, value: bool, comment: &str) {
        self.value(key, &format!("{:>20}", if value { "T" } else { "F" }), comment);
    }

    /// A whole number.
    pub(crate) fn integer(&mut self, key: &str, value: i64, comment: &str) {
        self.value(key, &format!("{value:>20}"), comment);
    }

    /// A real number with all its digits.
    pub(crate) fn real(&mut self, key: &str, value: f64, comment: &str) {
        let plain = format!("{value:?}");
        let text = if plain.len() <= 20 && !plain.contains('e') { plain } else { format!("{value:E}") };
        let text = if text.contains('.') { text } else { text.replacen('E', ".0E", 1) };
        self.value(key, &format!("{text:>20}"), comment);
    }

    /// A text. It is cut where it does not fit into the card.
    pub(crate) fn text(&mut self, key: &str, value: &str, comment: &str) {
        let mut escaped = String::new();
        for c in value.chars() {
            let piece = if c == '\'' { "''".to_string() } else { c.to_string() };
            if escaped.len() + piece.len() > 68 {
                break;
            }
            escaped.push_str(&piece);
        }
        self.value(key, &format!("'{escaped:<8}'"), comment);
    }

    /// History, broken into cards of 72 characters.
    pub(crate) fn history(&mut self, lines: &[String]) {
        for line in lines.iter().flat_map(|l| l.lines()) {
            let chars: Vec<char> = line.chars().collect();
            for piece in chars.chunks(72) {
                self.card(&format!("HISTORY {}", piece.iter().collect::<String>()));
            }
        }
    }

    /// The cards alone, for a header that is there already.
    pub(crate) fn cards(self) -> Vec<u8> {
        self.bytes
    }

    /// The finished header in whole blocks.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.card("END");
        let len = self.bytes.len();
        self.bytes.resize(len + padding(len as u64) as usize, b' ');
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_every_kind_are_understood() {
        assert_eq!(parse_value("                   T / yes"), Value::Logical(true));
        assert_eq!(parse_value("-32"), Value::Integer(-32));
        assert_eq!(parse_value("4.40391466727220D-12"), Value::Real(4.403_914_667_272_20e-12));
        assert_eq!(parse_value("'Jy/beam ' / unit"), Value::Text("Jy/beam".into()));
        assert_eq!(parse_value("'it''s / not a comment'"), Value::Text("it's / not a comment".into()));
        assert_eq!(parse_value("nan"), Value::None);
        assert_eq!(parse_value(""), Value::None);
    }

    #[test]
    fn what_is_written_is_read_back() {
        let mut w = HeaderWriter::default();
        w.logical("SIMPLE", true, "conforms");
        w.integer("BITPIX", -32, "");
        w.real("TINY", 4.4e-300, "");
        w.real("WHOLE", 94e9, "");
        w.real("LONG", -123_456.789_012_345_67, "");
        w.text("OBJECT", "O'Neill's star", "");
        w.history(&["x".repeat(100), "two\nlines".into()]);
        let bytes = w.finish();
        assert_eq!(bytes.len(), BLOCK);
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), &bytes).unwrap();
        let h = Header::read(&mut Input::open(file.path()).unwrap(), true).unwrap().unwrap();
        assert_eq!(h.real("TINY"), Some(4.4e-300));
        assert_eq!(h.real("WHOLE"), Some(94e9));
        assert_eq!(h.real("LONG"), Some(-123_456.789_012_345_67));
        assert_eq!(h.text("OBJECT"), Some("O'Neill's star"));
        assert_eq!(h.history.len(), 4);
    }
}

//! Small binary tables (BINTABLE), held in memory.

use super::header::{Header, HeaderWriter};
use super::input::{Input, padding};
use super::number::{Number, scaled};
use crate::{FormatError, Result};

/// One column of a table.
#[derive(Debug, Clone)]
struct Column {
    name: String,
    offset: usize,
    repeat: usize,
    kind: u8,
    scale: f64,
    zero: f64,
}

/// A binary table that was read.
#[derive(Debug, Clone)]
pub(crate) struct Table {
    /// Keywords of the extension.
    pub(crate) header: Header,
    rows: usize,
    row_bytes: usize,
    columns: Vec<Column>,
    data: Vec<u8>,
}

/// Bytes of one element of a TFORM letter.
fn element_bytes(kind: u8) -> Option<usize> {
    Some(match kind {
        b'L' | b'X' | b'B' | b'A' => 1,
        b'I' => 2,
        b'J' | b'E' => 4,
        b'K' | b'D' | b'C' | b'P' => 8,
        b'M' | b'Q' => 16,
        _ => return None,
    })
}

impl Table {
    /// Read the data that follow `header`, with their padding.
    pub(crate) fn read(input: &mut Input, header: Header) -> Result<Self> {
        let name = format!("table {}", header.text("EXTNAME").unwrap_or("without a name"));
        let bytes = header.data_bytes()?;
        let axes = header.axes()?;
        let bad = |what: &str, found: String| FormatError::malformed(header.path(), name.clone(), what, found);
        let &[row_bytes, rows] = &axes[..] else { return Err(bad("two axes", format!("{}", axes.len()))) };
        let own = row_bytes.checked_mul(rows).filter(|own| *own <= bytes);
        let own =
            own.ok_or_else(|| bad(&format!("{rows} rows of {row_bytes} bytes"), format!("{bytes} bytes by BITPIX, PCOUNT, GCOUNT")))?;
        input.demand(&name, bytes)?;
        let mut data = vec![0; own as usize];
        input.read_exact(&name, &mut data)?;
        // A missing padding at the end of the file is accepted, as in other readers.
        let rest = bytes - own + padding(bytes);
        let _ = input.read_some(&mut vec![0; rest.min(1 << 20) as usize])?;
        let mut columns = Vec::new();
        let mut offset = 0usize;
        for k in 1..=header.require("TFIELDS", 0..=999)? {
            let form =
                header.text(&format!("TFORM{k}")).ok_or_else(|| bad(&format!("TFORM{k}"), "no such keyword".into()))?.trim().to_string();
            let digits = form.len() - form.trim_start_matches(|c: char| c.is_ascii_digit()).len();
            let repeat = if digits == 0 { Some(1) } else { form[..digits].parse::<usize>().ok() };
            let kind = form.as_bytes().get(digits).copied().unwrap_or(b'?');
            let size = element_bytes(kind).zip(repeat).and_then(|(b, r)| if kind == b'X' { Some(r.div_ceil(8)) } else { b.checked_mul(r) });
            let end = size.and_then(|s| offset.checked_add(s)).filter(|e| *e as u64 <= row_bytes);
            let (Some(repeat), Some(end)) = (repeat, end) else {
                return Err(bad(
                    &format!("columns that fit into rows of {row_bytes} bytes"),
                    format!("TFORM{k} = {form:?} at byte {offset}"),
                ));
            };
            columns.push(Column {
                name: header.text(&format!("TTYPE{k}")).unwrap_or("").trim().to_ascii_uppercase(),
                offset,
                repeat,
                kind,
                scale: header.real(&format!("TSCAL{k}")).unwrap_or(1.0),
                zero: header.real(&format!("TZERO{k}")).unwrap_or(0.0),
            });
            offset = end;
        }
        Ok(Self { rows: rows as usize, row_bytes: row_bytes as usize, columns, data, header })
    }

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Names of the columns.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|c| c.name.as_str())
    }

    /// True where a row of a column has a number that is not 0, or a text that is not blank.
    pub(crate) fn says_something(&self, column: &str) -> bool {
        (0..self.rows).any(|row| match (self.reals(row, column), self.text(row, column)) {
            (Some(numbers), _) => numbers.iter().any(|n| *n != 0.0),
            (None, Some(text)) => !text.trim().is_empty(),
            (None, None) => false,
        })
    }

    fn cell(&self, row: usize, column: &str) -> Option<(&Column, &[u8])> {
        let column = self.columns.iter().find(|c| c.name == column)?;
        let start = row.checked_mul(self.row_bytes)? + column.offset;
        let len = element_bytes(column.kind)? * column.repeat;
        Some((column, self.data.get(start..start + len)?))
    }

    /// Numbers of a cell.
    pub(crate) fn reals(&self, row: usize, column: &str) -> Option<Vec<f64>> {
        let (c, bytes) = self.cell(row, column)?;
        let number = Number::of_letter(c.kind)?;
        Some((0..bytes.len() / number.bytes()).map(|k| scaled(number.get(bytes, k), c.scale, c.zero)).collect())
    }

    /// First number of a cell.
    pub(crate) fn real(&self, row: usize, column: &str) -> Option<f64> {
        self.reals(row, column)?.first().copied()
    }

    /// Text of a cell: printable ASCII without the blanks at its end; real files pad with NUL, blanks or other characters.
    pub(crate) fn text(&self, row: usize, column: &str) -> Option<String> {
        let (c, bytes) = self.cell(row, column)?;
        (c.kind == b'A').then(|| {
            let text: String = bytes.iter().take_while(|b| **b != 0).filter(|b| (32..127).contains(*b)).map(|b| *b as char).collect();
            text.trim_end().to_string()
        })
    }
}

/// Type of a column to be written.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Form {
    /// Text with this number of characters.
    Text(usize),
    /// 32-bit integers.
    Int(usize),
    /// 32-bit floats.
    Float(usize),
    /// 64-bit floats.
    Double(usize),
}

impl Form {
    fn tform(self) -> String {
        match self {
            Self::Text(n) => format!("{n}A"),
            Self::Int(n) => format!("{n}J"),
            Self::Float(n) => format!("{n}E"),
            Self::Double(n) => format!("{n}D"),
        }
    }

    fn bytes(self) -> usize {
        match self {
            Self::Text(n) => n,
            Self::Int(n) | Self::Float(n) => 4 * n,
            Self::Double(n) => 8 * n,
        }
    }
}

/// A binary table being written, cell by cell in the order of its columns.
#[derive(Debug)]
pub(crate) struct TableWriter {
    extname: &'static str,
    columns: Vec<(&'static str, Form, &'static str)>,
    next: usize,
    rows: usize,
    data: Vec<u8>,
}

impl TableWriter {
    /// A table with columns of a name, a type and a unit.
    pub(crate) fn new(extname: &'static str, columns: Vec<(&'static str, Form, &'static str)>) -> Self {
        Self { extname, columns, next: 0, rows: 0, data: Vec::new() }
    }

    fn form(&mut self) -> Form {
        let form = self.columns[self.next].1;
        self.next += 1;
        if self.next == self.columns.len() {
            self.next = 0;
            self.rows += 1;
        }
        form
    }

    /// A text, cut or padded with NUL to the width of its column. Blanks are not used, because readers keep them as part of a name.
    pub(crate) fn text(&mut self, value: &str) {
        let width = self.form().bytes();
        let mut bytes: Vec<u8> = value.chars().map(|c| if (' '..='~').contains(&c) { c as u8 } else { b'?' }).collect();
        bytes.resize(width, 0);
        self.data.extend(bytes);
    }

    /// Numbers in the type of their column.
    pub(crate) fn numbers(&mut self, values: &[f64]) {
        let form = self.form();
        for v in values {
            match form {
                Form::Int(_) => self.data.extend((*v as i32).to_be_bytes()),
                Form::Float(_) => self.data.extend((*v as f32).to_be_bytes()),
                Form::Double(_) => self.data.extend(v.to_be_bytes()),
                Form::Text(_) => {}
            }
        }
    }

    /// One number for each of the next columns.
    pub(crate) fn each(&mut self, values: &[f64]) {
        values.iter().for_each(|v| self.numbers(&[*v]));
    }

    /// Header and data in whole blocks; `keywords` adds the table's own.
    pub(crate) fn finish(self, keywords: impl FnOnce(&mut HeaderWriter)) -> Vec<u8> {
        let row_bytes: usize = self.columns.iter().map(|c| c.1.bytes()).sum();
        let mut h = HeaderWriter::default();
        h.text("XTENSION", "BINTABLE", "binary table extension");
        for (key, value) in [("BITPIX", 8), ("NAXIS", 2), ("NAXIS1", row_bytes), ("NAXIS2", self.rows), ("PCOUNT", 0), ("GCOUNT", 1)] {
            h.integer(key, value as i64, "");
        }
        h.integer("TFIELDS", self.columns.len() as i64, "");
        for (k, (name, form, unit)) in self.columns.iter().enumerate() {
            h.text(&format!("TTYPE{}", k + 1), name, "");
            h.text(&format!("TFORM{}", k + 1), &form.tform(), "");
            if !unit.is_empty() {
                h.text(&format!("TUNIT{}", k + 1), unit, "");
            }
        }
        h.text("EXTNAME", self.extname, "");
        h.integer("EXTVER", 1, "");
        keywords(&mut h);
        let mut bytes = h.finish();
        let len = self.data.len() as u64;
        bytes.extend(self.data);
        bytes.resize(bytes.len() + padding(len) as usize, 0);
        bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_comes_back_cell_by_cell() {
        let mut w = TableWriter::new(
            "T",
            vec![
                ("NAME", Form::Text(8), ""),
                ("XYZ", Form::Double(3), "METERS"),
                ("N", Form::Int(1), ""),
                ("NONE", Form::Double(0), ""),
                ("F", Form::Float(1), ""),
            ],
        );
        for k in 0..3 {
            w.text(["a", "bb", "a name too long"][k]);
            w.numbers(&[k as f64, 0.1, -1e7]);
            w.numbers(&[k as f64 * 7.0]);
            w.numbers(&[]);
            w.numbers(&[0.5]);
        }
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), w.finish(|h| h.real("FREQ", 1e9, ""))).unwrap();
        let mut input = Input::open(file.path()).unwrap();
        let header = Header::read(&mut input, false).unwrap().unwrap();
        let t = Table::read(&mut input, header).unwrap();
        assert_eq!((t.rows(), t.header.real("FREQ")), (3, Some(1e9)));
        assert_eq!(t.text(1, "NAME").as_deref(), Some("bb"));
        assert_eq!(t.text(2, "NAME").as_deref(), Some("a name t"));
        assert_eq!(t.reals(2, "XYZ"), Some(vec![2.0, 0.1, -1e7]));
        assert_eq!(t.real(2, "N"), Some(14.0));
        assert_eq!(t.reals(0, "NONE"), Some(vec![]));
        assert!(t.real(0, "G").is_none() && t.real(3, "N").is_none() && t.real(0, "NAME").is_none());
    }
}

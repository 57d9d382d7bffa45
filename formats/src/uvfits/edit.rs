//! Changes to a copy of a UVFITS file: the numbers of the groups that differ, and the history. Parameters, tables and all other cards stay as
//! they are.

use super::read::UvfitsReader;
use crate::atomic::AtomicFile;
use crate::columns::{check_columns, check_rows};
use crate::fits::{HeaderWriter, Number, padding};
use crate::{ColumnSink, Edit, FormatError, Result};
use cittert_arrays::{ArrayError, VisibilityBlock, VisibilitySink, VisibilitySource};
use ndarray::ArrayView3;
use num_complex::Complex;
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::Path;

/// Length of a card of a header.
const CARD: usize = 80;

/// A copy of a UVFITS file that is being changed.
pub(super) struct UvfitsEdit {
    /// The file as it was.
    old: UvfitsReader,
    file: File,
    out: AtomicFile,
    /// First byte of the groups of the copy.
    start: u64,
    data: bool,
    rows: usize,
}

impl UvfitsEdit {
    /// Begin a copy. `None` where the file stores scaled or other numbers than 32-bit floats, which cannot hold any visibility.
    pub(super) fn begin(from: &Path, to: &Path, edit: &Edit) -> Result<Option<Self>> {
        let mut old = UvfitsReader::open(from)?;
        if edit.data && !(old.number == Number::Float && old.scale == (1.0, 0.0)) {
            return Ok(None);
        }
        let header = with_history(from, &old.header_bytes()?, &edit.history)?;
        let out = AtomicFile::create(to, edit.overwrite)?;
        let mut file = out.open()?;
        let io = |e| FormatError::io(to, "copy the old file to", e);
        file.write_all(&header).map_err(io)?;
        io::copy(&mut old.seek_groups()?, &mut file).map_err(io)?;
        Ok(Some(Self { old, file, out, start: header.len() as u64, data: edit.data, rows: 0 }))
    }

    /// Change the numbers of the groups of a block that differ.
    fn put(&mut self, block: &VisibilityBlock) -> Result<()> {
        let range = self.rows..self.rows + block.n_rows();
        let (before, mut bytes) = (self.old.read(range.clone())?, self.old.bytes(range)?);
        let size = self.old.group_bytes;
        let mut changed = false;
        for ((row, chan, pol), v) in block.vis.indexed_iter() {
            let at = (row, chan, pol);
            let [re, im, weight] = self.old.places(chan, pol).map(|k| row * size + 4 * k);
            let mut put = |k: usize, value: f32| {
                bytes[k..k + 4].copy_from_slice(&value.to_be_bytes());
                changed = true;
            };
            let old = before.vis[at];
            if v.re.to_bits() != old.re.to_bits() {
                put(re, v.re);
            }
            if v.im.to_bits() != old.im.to_bits() {
                put(im, -v.im);
            }
            let flag = block.flags[at] || before.flags[at];
            let new = block.weights[at];
            if new.to_bits() != before.weights[at].to_bits() || flag != before.flags[at] {
                put(weight, if flag { -new.abs() } else { new });
            }
        }
        if !changed {
            return Ok(());
        }
        let io = |e| FormatError::io(self.out.target(), "write", e);
        self.file.seek(SeekFrom::Start(self.start + (self.rows * size) as u64)).map_err(io)?;
        self.file.write_all(&bytes).map_err(io)
    }
}

/// The header with more cards of history. Cards with check sums are left out, because they would be wrong.
fn with_history(path: &Path, header: &[u8], lines: &[String]) -> Result<Vec<u8>> {
    let is = |card: &[u8], key: &str| card.starts_with(format!("{key:<8}").as_bytes());
    let end = header.chunks_exact(CARD).position(|card| is(card, "END"));
    let end = end.ok_or_else(|| FormatError::malformed(path, "header", "an END card", "none"))?;
    let old = header.chunks_exact(CARD).take(end).filter(|card| !is(card, "CHECKSUM") && !is(card, "DATASUM"));
    let mut new: Vec<u8> = old.flatten().copied().collect();
    let mut history = HeaderWriter::default();
    history.history(lines);
    new.extend(history.cards());
    new.extend(format!("{:<80}", "END").bytes());
    new.resize(new.len() + padding(new.len() as u64) as usize, b' ');
    Ok(new)
}

impl ColumnSink for UvfitsEdit {
    fn write_columns(&mut self, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>]) -> Result<()> {
        self.old.header().check_block(block).map_err(|e| FormatError::values(self.out.target(), e))?;
        check_columns(self.out.target(), block, columns, 0)?;
        if self.data {
            self.put(block)?;
        }
        self.rows += block.n_rows();
        Ok(())
    }
}

impl VisibilitySink for UvfitsEdit {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<(), ArrayError> {
        Ok(self.write_columns(block, &[])?)
    }

    fn finish(self: Box<Self>) -> Result<(), ArrayError> {
        let Self { old, file, out, rows, .. } = *self;
        check_rows(out.target(), rows, old.n_rows())?;
        drop(file);
        Ok(out.commit()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn history_is_added_and_the_other_cards_stay() {
        let card = |text: &str| format!("{text:<80}");
        let mut header = format!("{}{}{}", card("SIMPLE  =                    T"), card("CHECKSUM= 'x'"), card("END"));
        header.push_str(&" ".repeat(2880 - header.len()));
        let new = with_history(Path::new("x"), header.as_bytes(), &["one".into()]).unwrap();
        let text = String::from_utf8(new).unwrap();
        assert_eq!(text.len(), 2880);
        assert!(text.starts_with(&(card("SIMPLE  =                    T") + &card("HISTORY one") + &card("END"))), "{text}");
        let long = with_history(Path::new("x"), header.as_bytes(), &vec!["line".into(); 40]).unwrap();
        assert_eq!(long.len(), 2 * 2880);
        assert!(with_history(Path::new("x"), &[b' '; 2880], &[]).is_err());
    }
}

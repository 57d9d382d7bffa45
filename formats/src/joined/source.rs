//! Reading a joined set.

use super::build::{Files, index};
use super::headers::{Agreed, Headers, Places};
use super::index::{Place, RowIndex};
use super::shelf::{Open, Shelf};
use crate::{FormatError, Result};
use cittert_arrays::{ArrayError, PartSource, Ranks, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, Array3, s};
use num_complex::Complex;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// Largest difference of uvw of one row in two files, m, and relative to the length of its baseline: UVFITS rounds them.
const SAME_UVW: (f64, f64) = (1e-3, 1e-6);

/// Several files as one set.
pub struct JoinedSource {
    inner: Arc<Inner>,
    shelf: Shelf,
    place: Place,
    /// Whether rows can be read in parts.
    in_parts: bool,
}

struct Inner {
    names: Vec<PathBuf>,
    header: VisibilityHeader,
    places: Vec<Places>,
    /// Number of rows of each file.
    rows: Vec<usize>,
    index: RowIndex,
    notes: Vec<String>,
}

/// Consecutive rows of a file, and where they go.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) file: u32,
    /// Row in what is read of the file.
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) n: usize,
    /// Whether this file tells the coverage of these rows.
    leads: bool,
}

/// Rows of a file.
type FileRows = (u32, Range<usize>);

impl JoinedSource {
    /// A set of files with these names, which `open` opens by their numbers. Each of several processes looks for its part of the rows.
    ///
    /// # Errors
    /// As [`JoinedSource::open`].
    pub(super) fn of(names: Vec<PathBuf>, open: Open, ranks: &dyn Ranks) -> Result<Self> {
        let mut shelf = Shelf::new(names.len(), open);
        let mut headers = Headers::new(names.clone());
        let mut rows = Vec::with_capacity(names.len());
        let mut in_parts = true;
        for k in 0..names.len() {
            let file = shelf.take(k)?;
            rows.push(file.n_rows());
            headers.add(file.header())?;
            in_parts &= file.in_parts().is_some();
        }
        let Agreed { mut header, places, mut notes } = headers.agreed()?;
        let (index, of_rows) = index(&Files { names: &names, header: &header, places: &places, rows: &rows }, &mut shelf, ranks)?;
        notes.extend(of_rows);
        let list: Vec<String> = names.iter().map(|n| n.display().to_string()).collect();
        header.history.push(format!("one set of {} files: {}", names.len(), list.join(", ")));
        let place = Place::start(names.len());
        in_parts &= index.sets().iter().all(|(files, _)| files.len() == 1);
        let mut set = Self { inner: Arc::new(Inner { names, header, places, rows, index, notes }), shelf, place, in_parts };
        set.in_parts &= (0..set.inner.names.len()).all(|file| set.has_all_values(file as u32));
        Ok(set)
    }

    /// The same rows from other sources with the same coverage.
    pub(super) fn beside(&self, open: Open) -> Self {
        let n = self.inner.names.len();
        Self { inner: self.inner.clone(), shelf: Shelf::new(n, open), place: Place::start(n), in_parts: false }
    }

    /// Names of the files, sorted.
    #[must_use]
    pub fn names(&self) -> &[PathBuf] {
        &self.inner.names
    }

    /// Sentences about gaps between the files, and about what was left out of the header.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.inner.notes
    }

    /// The pieces of a range of rows, and the rows of each file that are read for them, both by file. A file that tells the coverage of a row comes
    /// before those that are compared with it.
    pub(super) fn pieces(&mut self, range: Range<usize>) -> Result<(Vec<Piece>, Vec<FileRows>), ArrayError> {
        let index = &self.inner.index;
        ArrayError::unless_rows(&range, index.n_rows())?;
        self.place.go(index, range.start);
        let mut starts: BTreeMap<u32, usize> = BTreeMap::new();
        let mut pieces = Vec::new();
        let mut to = 0;
        while to < range.len() {
            let Some((set, n)) = self.place.step(index, range.len() - to) else { break };
            for (k, &file) in index.files(set).iter().enumerate() {
                let next = self.place.next_of(file) - n as usize;
                let start = *starts.entry(file).or_insert(next);
                pieces.push(Piece { file, from: next - start, to, n: n as usize, leads: k == 0 });
            }
            to += n as usize;
        }
        pieces.sort_by_key(|p| p.file);
        Ok((pieces, starts.into_iter().map(|(file, start)| (file, start..self.place.next_of(file))).collect()))
    }

    /// A file that has the number of rows that it had at the beginning.
    pub(super) fn file(&mut self, k: u32) -> Result<&mut dyn VisibilitySource> {
        let (k, inner) = (k as usize, &self.inner);
        let file = self.shelf.take(k)?;
        if file.n_rows() != inner.rows[k] {
            let expected = format!("{} rows, as at the beginning", inner.rows[k]);
            return Err(FormatError::malformed(&inner.names[k], "rows", expected, format!("{} rows", file.n_rows())));
        }
        Ok(file)
    }

    /// Whether a file has all channels and products of the set, in the same order.
    fn has_all_values(&self, file: u32) -> bool {
        let (places, header) = (&self.inner.places[file as usize], &self.inner.header);
        let same = |list: &[usize], n: usize| list.len() == n && list.iter().enumerate().all(|(k, place)| k == *place);
        same(&places.channels, header.spectrum.n_chan()) && same(&places.products, header.polarizations.len())
    }

    /// Whether all of a file has the same numbers in the set.
    fn is_alike(&self, file: u32) -> bool {
        let places = &self.inner.places[file as usize];
        places.antennas.is_none() && places.centers.iter().enumerate().all(|(k, c)| k == usize::from(*c)) && self.has_all_values(file)
    }

    /// Copy the coverage of a piece, or compare it with that of another file.
    fn cover(&self, piece: &Piece, of: &UvCoverage, all: &mut UvCoverage) -> Result<()> {
        let places = &self.inner.places[piece.file as usize];
        let antenna = |k: u32| places.antennas.as_ref().map_or(k, |a| a[k as usize]);
        for (from, to) in (piece.from..piece.from + piece.n).zip(piece.to..) {
            if piece.leads {
                all.uvw_m.row_mut(to).assign(&of.uvw_m.row(from));
                (all.ant1[to], all.ant2[to]) = (antenna(of.ant1[from]), antenna(of.ant2[from]));
                (all.time_jd[to], all.integration_s[to]) = (of.time_jd[from], of.integration_s[from]);
                all.phase_center[to] = places.centers[usize::from(of.phase_center[from])];
                continue;
            }
            let length = all.uvw_m.row(to).iter().map(|x| x * x).sum::<f64>().sqrt();
            let off = (0..3).map(|k| (all.uvw_m[(to, k)] - of.uvw_m[(from, k)]).abs()).fold(0.0, f64::max);
            if off > SAME_UVW.0 + SAME_UVW.1 * length {
                let layout = &self.inner.header.layout;
                let name = |k: u32| layout.antennas().get(k as usize).map_or("?", |a| a.name.as_str());
                let (a, b) = (name(all.ant1[to]), name(all.ant2[to]));
                let found = format!("uvw of the baseline {a}-{b} that differ from those of another file of the set by {off:.4} m");
                let expected = "the same uvw in all files that hold a row";
                return Err(FormatError::malformed(&self.inner.names[piece.file as usize], "uvw", expected, found));
            }
        }
        Ok(())
    }
}

/// `n` rows without coverage.
fn uncovered(n: usize) -> UvCoverage {
    UvCoverage {
        uvw_m: Array2::zeros((n, 3)),
        ant1: vec![0; n],
        ant2: vec![0; n],
        time_jd: vec![0.0; n],
        integration_s: vec![0.0; n],
        phase_center: vec![0; n],
    }
}

/// Copy a piece to the places of its channels and products.
fn put<T: Copy>(piece: &Piece, places: &Places, from: &Array3<T>, to: &mut Array3<T>) {
    let (rows_from, rows_to) = (piece.from..piece.from + piece.n, piece.to..piece.to + piece.n);
    let run = |list: &[usize]| list.windows(2).all(|w| w[1] == w[0] + 1).then(|| list.first().map_or(0..0, |f| *f..f + list.len()));
    if let (Some(channels), Some(products)) = (run(&places.channels), run(&places.products)) {
        to.slice_mut(s![rows_to, channels, products]).assign(&from.slice(s![rows_from, .., ..]));
        return;
    }
    for (row, target) in rows_from.zip(rows_to) {
        for (c, chan) in places.channels.iter().enumerate() {
            for (p, pol) in places.products.iter().enumerate() {
                to[(target, *chan, *pol)] = from[(row, c, p)];
            }
        }
    }
}

impl VisibilitySource for JoinedSource {
    fn header(&self) -> &VisibilityHeader {
        &self.inner.header
    }

    fn n_rows(&self) -> usize {
        self.inner.index.n_rows()
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock, ArrayError> {
        let n = range.len();
        let (pieces, reads) = self.pieces(range)?;
        if let [(file, rows)] = &reads[..]
            && rows.len() == n
            && self.is_alike(*file)
        {
            return self.file(*file)?.read_rows(rows.clone());
        }
        let shape = self.inner.header.shape(n);
        let mut coverage = uncovered(n);
        let mut vis = Array3::<Complex<f32>>::zeros(shape);
        let mut weights = Array3::<f32>::zeros(shape);
        let mut flags = Array3::from_elem(shape, true);
        let mut nsamples = Array3::<f32>::zeros(shape);
        for ((file, rows), pieces) in reads.into_iter().zip(pieces.chunk_by(|a, b| a.file == b.file)) {
            let block = self.file(file)?.read_rows(rows)?;
            let places = &self.inner.places[file as usize];
            for piece in pieces {
                self.cover(piece, &block.coverage, &mut coverage)?;
                put(piece, places, &block.vis, &mut vis);
                put(piece, places, &block.weights, &mut weights);
                put(piece, places, &block.flags, &mut flags);
                put(piece, places, &block.nsamples, &mut nsamples);
            }
        }
        VisibilityBlock::new(coverage, vis, weights, flags, nsamples)
    }

    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage, ArrayError> {
        let n = range.len();
        let (pieces, reads) = self.pieces(range)?;
        let mut coverage = uncovered(n);
        for ((file, rows), pieces) in reads.into_iter().zip(pieces.chunk_by(|a, b| a.file == b.file)) {
            if pieces.iter().any(|p| p.leads) {
                let of = self.file(file)?.read_coverage(rows)?;
                for piece in pieces.iter().filter(|p| p.leads) {
                    self.cover(piece, &of, &mut coverage)?;
                }
            }
        }
        Ok(coverage)
    }

    fn in_parts(&mut self) -> Option<&mut dyn PartSource> {
        if self.in_parts { Some(self) } else { None }
    }
}

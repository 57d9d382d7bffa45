//! The errors of a call, put into a set of any length.

use super::context::{Context, Survey, nearest_index};
use super::{CorruptOptions, Error};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{
    ArrayError, GainTable, Polarization, SpectralWindow, VisibilityBlock, VisibilityHeader, VisibilitySink, VisibilitySource,
    for_each_block,
};
use num_complex::{Complex, Complex64};

/// Rows are read in blocks of about this size, bytes.
const BLOCK_BYTES: usize = 32 << 20;
/// Gains of a set are held in memory up to this size, bytes.
const MOST_GAIN_BYTES: usize = 4 << 30;

/// Header of the output: that of the input with a line of history.
#[must_use]
pub fn corrupted_header(header: &VisibilityHeader, options: &CorruptOptions) -> VisibilityHeader {
    let mut header = header.clone();
    header.history.push(describe(options));
    header
}

fn describe(options: &CorruptOptions) -> String {
    let errors: Vec<String> = options.errors.iter().map(|e| format!("{e:?}")).collect();
    format!("corrupt: seed {}, {}, {}", options.seed, if options.per_feed { "per feed" } else { "feeds alike" }, errors.join(", "))
}

/// Read a set, put the errors into it, write it, and return the true gains: V_corrupt = g1 conj(g2) V. The source is read twice, once
/// for its times. The caller opens the sink with [`corrupted_header`] and finishes it.
///
/// Weights follow the amplitude of the gains, as they are those of the data as written.
///
/// # Errors
/// A parameter outside its range, an empty set, gains of more than 4 GiB, errors of the source, the sink or a kind of error, a
/// request to stop.
pub fn corrupt(
    source: &mut dyn VisibilitySource,
    sink: &mut dyn VisibilitySink,
    options: &CorruptOptions,
    observer: &dyn Observer,
) -> Result<GainTable> {
    for error in &options.errors {
        error.model().check()?;
    }
    let header = source.header().clone();
    let mut survey = Survey::default();
    for_each_block::<ChainError>(source, BLOCK_BYTES, |_, block| {
        survey.add(&block.coverage, &header.layout);
        if observer.cancelled() { Err(ChainError::Cancelled) } else { Ok(()) }
    })?;
    let (time_jd, interval_s, toward) = survey.finish(&header.layout);
    if time_jd.is_empty() {
        return Err(ChainError::NoData("the set holds no rows to put errors into".into()));
    }
    if let Some(t) = time_jd.iter().find(|t| !t.is_finite()) {
        return Err(ChainError::NoData(format!("a row has the time {t}: repair or remove it first")));
    }
    let seconds: Vec<f64> = time_jd.iter().map(|t| (t - time_jd[0]) * 86_400.0).collect();
    let spectrum = gain_spectrum(&header, options)?;
    let freq_hz = spectrum.freq_hz().to_vec();
    let feeds = feed_names(&header, options.per_feed);
    let bytes = 17 * time_jd.len() * header.layout.n_ant() * freq_hz.len() * feeds.len();
    if bytes > MOST_GAIN_BYTES {
        return Err(ChainError::BadOption {
            option: "errors that differ from channel to channel",
            value: format!("{:.1} GiB of gains", bytes as f64 / f64::from(1 << 30)),
            expected: "at most 4 GiB: corrupt fewer channels or times in one call".into(),
        });
    }
    let mut table = GainTable::unity(header.layout.clone(), spectrum, feeds, time_jd.clone(), interval_s)?;
    table.mode = "injected truth".into();
    table.history.push(describe(options));
    // Kinds act in the order of their table; within a kind, in the order given.
    let mut order: Vec<(usize, &Error)> = options.errors.iter().enumerate().collect();
    order.sort_by_key(|(_, e)| Error::TABLE.iter().position(|t| t.0 == e.name()));
    let context = |(place, error): &(usize, &Error)| Context {
        header: &header,
        time_jd: &time_jd,
        seconds: &seconds,
        toward: &toward,
        freq_hz: &freq_hz,
        seed: options.seed,
        name: error.name(),
        place: options.errors[..*place].iter().filter(|e| e.name() == error.name()).count(),
    };
    for entry in &order {
        entry.1.model().gains(&context(entry), &mut table)?;
    }
    let pairs = feed_pairs(&header, table.feeds.len());
    let total = (source.n_rows() * header.spectrum.n_chan() * header.polarizations.len()) as u64;
    observer.event(Event::Phase { name: "corrupting", total: Some(total), unit: "vis" });
    for_each_block::<ChainError>(source, BLOCK_BYTES, |first_row, mut block| {
        if observer.cancelled() {
            return Err(ChainError::Cancelled);
        }
        check_antennas(&block, header.layout.n_ant())?;
        apply(&table, &pairs, &mut block);
        for entry in &order {
            entry.1.model().data(&context(entry), &table, &mut block, first_row as u64)?;
        }
        observer.event(Event::Advance(block.vis.len() as u64));
        Ok(sink.write_block(&block)?)
    })?;
    observer.event(Event::Done);
    Ok(table)
}

/// The channels of the set where an error needs them, else one as wide as the band.
fn gain_spectrum(header: &VisibilityHeader, options: &CorruptOptions) -> Result<SpectralWindow> {
    if options.errors.iter().any(|e| e.model().chromatic()) {
        return Ok(header.spectrum.clone());
    }
    Ok(SpectralWindow::new(vec![header.spectrum.mean_hz()], vec![header.spectrum.extent_hz()])?)
}

/// Feeds that get errors of their own: both of the set's basis, or one entry for all.
fn feed_names(header: &VisibilityHeader, per_feed: bool) -> Vec<String> {
    let has = |list: &[Polarization]| header.polarizations.iter().any(|p| list.contains(p));
    let names: &[&str] = match per_feed {
        true if has(&[Polarization::RR, Polarization::LL, Polarization::RL, Polarization::LR]) => &["R", "L"],
        true if has(&[Polarization::XX, Polarization::YY, Polarization::XY, Polarization::YX]) => &["X", "Y"],
        _ => &[Polarization::shared_feed(&header.polarizations)],
    };
    names.iter().map(|n| (*n).to_owned()).collect()
}

/// Feed of the first and second antenna in each product \[pol\].
fn feed_pairs(header: &VisibilityHeader, n_feed: usize) -> Vec<(usize, usize)> {
    let last = n_feed - 1;
    header.polarizations.iter().map(|p| p.feeds().map_or((0, 0), |(a, b)| (a.min(last), b.min(last)))).collect()
}

fn check_antennas(block: &VisibilityBlock, n_ant: usize) -> Result<()> {
    let all = block.coverage.ant1.iter().chain(&block.coverage.ant2);
    match all.map(|a| *a as usize).find(|a| *a >= n_ant) {
        Some(index) => Err(ArrayError::OutOfRange { what: "antenna", index, len: n_ant }.into()),
        None => Ok(()),
    }
}

/// V_corrupt = g1 conj(g2) V.
fn apply(table: &GainTable, pairs: &[(usize, usize)], block: &mut VisibilityBlock) {
    let wide = table.spectrum.n_chan() > 1;
    for row in 0..block.n_rows() {
        let time = nearest_index(&table.time_jd, block.coverage.time_jd[row]);
        let (a, b) = (block.coverage.ant1[row] as usize, block.coverage.ant2[row] as usize);
        for chan in 0..block.vis.shape()[1] {
            let c = if wide { chan } else { 0 };
            for (pol, (f1, f2)) in pairs.iter().enumerate() {
                let g = table.gains[[time, a, c, *f1]] * table.gains[[time, b, c, *f2]].conj();
                let v = &mut block.vis[[row, chan, pol]];
                let out = Complex64::new(v.re.into(), v.im.into()) * g;
                *v = Complex::new(out.re as f32, out.im as f32);
                let power = g.norm_sqr();
                if power > 0.0 {
                    block.weights[[row, chan, pol]] = (f64::from(block.weights[[row, chan, pol]]) / power) as f32;
                }
            }
        }
    }
}

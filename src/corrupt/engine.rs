//! Injects errors into a set of any length.

use super::context::{Context, Survey, direction, nearest_index};
use super::scene::{SceneChange, SceneErrors, without_scene};
use super::{CorruptOptions, Error};
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::simulate::SkyModel;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::feeds::{FourProducts, leakage_matrix};
use cittert_arrays::{
    GainTable, Polarization, SpectralWindow, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySink, VisibilitySource,
    for_each_block,
};
use num_complex::{Complex, Complex64};

/// Size in bytes of one gain: a complex number and a flag.
const GAIN_BYTES: usize = 17;

/// Sizes of gains with which visibilities and weights stay within single precision.
const LARGEST_GAIN: f64 = 1e9;
const SMALLEST_GAIN: f64 = 1e-9;

/// Header of the output: the header of the input with a line of history.
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

/// Read a set, inject the errors, write the result, and return the true gains: V_corrupt = g1 conj(g2) V. The source is read twice, the first
/// time for the times of its rows. The caller opens the sink with [`corrupted_header`] and finishes it.
///
/// The weights are divided by the power of the gains, so that they remain those of the written data.
///
/// # Errors
/// A parameter is outside its range, the set is empty, the gains are larger than the memory budget, the source, the sink or a kind of error
/// fails, or the observer asks to stop.
pub fn corrupt(
    source: &mut dyn VisibilitySource,
    sink: &mut dyn VisibilitySink,
    options: &CorruptOptions,
    observer: &dyn Observer,
) -> Result<GainTable> {
    Ok(corrupt_with(source, sink, options, None, observer)?.gains)
}

/// What was put into a set.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The gains.
    pub gains: GainTable,
    /// What is no gain, but changes the view of the scene.
    pub scene: SceneErrors,
}

/// As [`corrupt`], with the scene that was observed, which some errors need.
///
/// # Errors
/// As [`corrupt`]. Also if an error needs the scene and there is none, or the scene does not belong to the set.
pub fn corrupt_with(
    source: &mut dyn VisibilitySource,
    sink: &mut dyn VisibilitySink,
    options: &CorruptOptions,
    scene: Option<&SkyModel>,
    observer: &dyn Observer,
) -> Result<Truth> {
    options.errors.iter().try_for_each(|error| error.model().check())?;
    let blind = scene.is_none().then(|| options.errors.iter().find(|e| e.model().of_scene())).flatten();
    if let Some(error) = blind {
        return Err(without_scene(error.name()));
    }
    let header = source.header().clone();
    let memory = MemoryBudget::default();
    let mut survey = Survey::default();
    for_each_block::<ChainError>(source, memory.block(), |_, block| {
        survey.add(&block.coverage, &header.layout)?;
        if observer.cancelled() { Err(ChainError::Cancelled) } else { Ok(()) }
    })?;
    let when = When::new(survey, &header, options)?;
    let table = when.gains(&header, options)?;
    let errors = when.scene_errors(&header, options, |e| e.model().of_scene())?;
    let mut change = match scene {
        Some(sky) if errors != SceneErrors::default() => Some(SceneChange::new(&header, &errors, sky)?),
        _ => None,
    };
    let pairs = feed_pairs(&header, table.feeds.len());
    let total = (source.n_rows() * header.spectrum.n_chan() * header.polarizations.len()) as u64;
    observer.event(Event::Phase { name: "corrupting", total: Some(total), unit: "vis" });
    for_each_block::<ChainError>(source, memory.block(), |first_row, mut block| {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        if let Some(change) = &mut change {
            change.add(&mut block, first_row as u64, observer)?;
        }
        apply(&table, &pairs, &mut block);
        for entry in in_order(options) {
            entry.1.model().data(&when.context(&header, options, entry), &table, &mut block, first_row as u64)?;
        }
        observer.event(Event::Advance(block.vis.len() as u64));
        Ok(sink.write_block(&block)?)
    })?;
    observer.event(Event::Done);
    Ok(Truth { gains: table, scene: errors })
}

/// The true gains of a set that is still to be made, from its rows: those that [`corrupt`] would put into it.
///
/// # Errors
/// As [`corrupt`].
pub fn true_gains(
    header: &VisibilityHeader,
    rows: &mut dyn Iterator<Item = cittert_arrays::Result<UvCoverage>>,
    options: &CorruptOptions,
) -> Result<GainTable> {
    When::of_rows(header, rows, options)?.gains(header, options)
}

/// The patterns and receivers of a set that is still to be made: all errors that have to do with them, jitter included. Put them into the
/// simulation before its noise.
///
/// # Errors
/// As [`corrupt`].
pub fn true_scene_errors(
    header: &VisibilityHeader,
    rows: &mut dyn Iterator<Item = cittert_arrays::Result<UvCoverage>>,
    options: &CorruptOptions,
) -> Result<SceneErrors> {
    When::of_rows(header, rows, options)?.scene_errors(header, options, |_| true)
}

/// Puts gains into the blocks on their way into another sink.
pub struct GainedSink<'a> {
    sink: &'a mut dyn VisibilitySink,
    table: &'a GainTable,
    pairs: Vec<(usize, usize)>,
}

impl<'a> GainedSink<'a> {
    /// A sink for sets with a header like that of the table.
    #[must_use]
    pub fn new(sink: &'a mut dyn VisibilitySink, table: &'a GainTable, header: &VisibilityHeader) -> Self {
        Self { sink, table, pairs: feed_pairs(header, table.feeds.len()) }
    }
}

impl VisibilitySink for GainedSink<'_> {
    fn write_block(&mut self, block: &VisibilityBlock) -> cittert_arrays::Result<()> {
        let mut block = block.clone();
        apply(self.table, &self.pairs, &mut block);
        self.sink.write_block(&block)
    }

    fn finish(self: Box<Self>) -> cittert_arrays::Result<()> {
        Ok(())
    }
}

/// The integrations of a set, and the channels of its gains.
struct When {
    time_jd: Vec<f64>,
    seconds: Vec<f64>,
    length_s: Vec<f64>,
    toward: Vec<[f64; 3]>,
    spectrum: SpectralWindow,
}

impl When {
    fn of_rows(
        header: &VisibilityHeader,
        rows: &mut dyn Iterator<Item = cittert_arrays::Result<UvCoverage>>,
        options: &CorruptOptions,
    ) -> Result<Self> {
        options.errors.iter().try_for_each(|error| error.model().check())?;
        let mut survey = Survey::default();
        for coverage in rows {
            survey.add(&coverage?, &header.layout)?;
        }
        Self::new(survey, header, options)
    }

    /// What some of the errors do to patterns and receivers.
    fn scene_errors(&self, header: &VisibilityHeader, options: &CorruptOptions, which: impl Fn(&Error) -> bool) -> Result<SceneErrors> {
        let entries = in_order(options).into_iter().filter(|e| which(e.1));
        SceneErrors::draw(header, &self.time_jd, entries.map(|e| (e.1.model(), self.context(header, options, e))))
    }

    fn new(survey: Survey, header: &VisibilityHeader, options: &CorruptOptions) -> Result<Self> {
        let integrations = survey.finish();
        ensure!(!integrations.is_empty(), ChainError::NoData("the set has no rows".into()));
        let time_jd: Vec<f64> = integrations.iter().map(|i| i.time_jd).collect();
        let length_s = integrations.iter().map(|i| i.length_s).collect();
        let toward: Vec<[f64; 3]> = if options.errors.iter().any(|e| e.model().needs_direction()) {
            integrations.iter().map(|i| direction(i, &header.layout)).collect::<Result<_>>()?
        } else {
            Vec::new()
        };
        if let Some(t) = time_jd.iter().find(|t| !t.is_finite()) {
            return Err(ChainError::NoData(format!("a row has the time {t}: repair or remove it first")));
        }
        let seconds = time_jd.iter().map(|t| (t - time_jd[0]) * 86_400.0).collect();
        Ok(Self { time_jd, seconds, length_s, toward, spectrum: gain_spectrum(header, options)? })
    }

    fn context<'a>(&'a self, header: &'a VisibilityHeader, options: &CorruptOptions, (place, error): (usize, &Error)) -> Context<'a> {
        Context {
            header,
            time_jd: &self.time_jd,
            seconds: &self.seconds,
            length_s: &self.length_s,
            toward: &self.toward,
            freq_hz: self.spectrum.freq_hz(),
            seed: options.seed,
            name: error.name(),
            place: options.errors[..place].iter().filter(|e| e.name() == error.name()).count(),
        }
    }

    /// The product of the gains of all errors.
    fn gains(&self, header: &VisibilityHeader, options: &CorruptOptions) -> Result<GainTable> {
        let memory = MemoryBudget::default();
        let feeds = feed_names(header, options.per_feed);
        let bytes = GAIN_BYTES * self.time_jd.len() * header.layout.n_ant() * self.spectrum.n_chan() * feeds.len();
        let gib = |bytes: usize| format!("{:.1} GiB", bytes as f64 / f64::from(1 << 30));
        let expected = format!("at most the memory budget of {}: corrupt fewer channels or times in one call", gib(memory.bytes()));
        need("size of the gain table", gib(bytes), bytes <= memory.bytes(), expected)?;
        let mut table = GainTable::unity(header.layout.clone(), self.spectrum.clone(), feeds, self.time_jd.clone(), self.length_s.clone())?;
        table.mode = "injected truth".into();
        table.history.push(describe(options));
        let (apart, alike): (Vec<_>, Vec<_>) = in_order(options).into_iter().partition(|e| e.1.model().tells_feeds_apart());
        let last = alike.len();
        for (k, entry) in alike.into_iter().chain(apart).enumerate() {
            if k >= last {
                table = table.with_each_feed();
            }
            entry.1.model().gains(&self.context(header, options, entry), &mut table)?;
            if let Some(gain) = table.gains.iter().find(|g| !(**g == Complex64::ZERO || (SMALLEST_GAIN..=LARGEST_GAIN).contains(&g.norm())))
            {
                let expected = format!("gains from {SMALLEST_GAIN:e} to {LARGEST_GAIN:e}, or 0: make this error smaller");
                return Err(ChainError::bad_option("size of an error", format!("the gain {gain:e} of kind {}", entry.1.name()), expected));
            }
        }
        Ok(table)
    }
}

/// The errors with their places: the kinds in the order of their table, and the errors of one kind in the given order.
fn in_order(options: &CorruptOptions) -> Vec<(usize, &Error)> {
    let mut order: Vec<(usize, &Error)> = options.errors.iter().enumerate().collect();
    order.sort_by_key(|(_, e)| Error::TABLE.iter().position(|t| t.0 == e.name()));
    order
}

/// The channels of the gains: those of the set if an error differs from channel to channel, otherwise one channel as wide as the band.
fn gain_spectrum(header: &VisibilityHeader, options: &CorruptOptions) -> Result<SpectralWindow> {
    if options.errors.iter().any(|e| e.model().chromatic()) {
        return Ok(header.spectrum.clone());
    }
    Ok(SpectralWindow::new(vec![header.spectrum.mean_hz()], vec![header.spectrum.extent_hz()])?)
}

/// The feeds of the gains: both feeds of the set if each has errors of its own, otherwise one entry for all feeds.
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
    let of = |p: &Polarization| if n_feed == 1 { None } else { p.feeds() };
    header.polarizations.iter().map(|p| of(p).unwrap_or((0, 0))).collect()
}

/// V_corrupt = g1 conj(g2) V, after the leakages.
fn apply(table: &GainTable, pairs: &[(usize, usize)], block: &mut VisibilityBlock) {
    let wide = table.spectrum.n_chan() > 1;
    if let Some(leakages) = &table.leakages {
        // A table has leakages only for sets of four products, which the pairs show.
        let find = |pair| pairs.iter().position(|p| *p == pair).unwrap_or(0);
        let four = FourProducts([[find((0, 0)), find((0, 1))], [find((1, 0)), find((1, 1))]]);
        for row in 0..block.n_rows() {
            let time = nearest_index(&table.time_jd, block.coverage.time_jd[row]);
            let ants = [block.coverage.ant1[row], block.coverage.ant2[row]].map(|a| a as usize);
            for chan in 0..block.vis.shape()[1] {
                let c = if wide { chan } else { 0 };
                let [a, b] = ants.map(|ant| leakage_matrix([0, 1].map(|feed| leakages[[time, ant, c, feed]])));
                four.transform(block, (row, chan), (&a, &b));
            }
        }
    }
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

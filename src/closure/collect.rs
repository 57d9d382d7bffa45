//! The samples of each averaging interval, read from a set that may be too large for the memory, and the combinations of antennas in it.

use super::baselines::{n_pairs, pair_index, pairs_of};
use super::options::{ClosureChannels, ClosureOptions};
use super::sets::{ClosureSet, Links};
use super::time::{SolutionInterval, TimeBins, TimeSpan};
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Polarization, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block};
use num_complex::Complex64;
use std::collections::{BTreeMap, HashMap};

/// Where and when a closure quantity was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosureKey {
    /// Middle of the interval, Julian date UTC.
    pub time_jd: f64,
    /// Length of the interval, s.
    pub interval_s: f64,
    /// Index of the channel; 0 where they are averaged.
    pub chan: usize,
    /// Frequency, Hz.
    pub freq_hz: f64,
    /// Polarisation product.
    pub polarization: Polarization,
    /// Quantities averaged.
    pub samples: usize,
}

/// Weighted sum of the visibilities of a baseline in an integration, antenna p to q with p < q.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sample {
    pub(super) wv: Complex64,
    pub(super) w: f64,
}

impl Sample {
    pub(super) fn vis(&self) -> Complex64 {
        self.wv / self.w
    }

    /// Variance of the real part.
    pub(super) fn variance(&self) -> f64 {
        1.0 / self.w
    }
}

/// One averaging interval: integrations by their time in ms, each \[chan, pol, pair\].
pub(super) struct Bin {
    span: TimeSpan,
    integrations: BTreeMap<i64, Vec<Sample>>,
}

struct Collector<'a> {
    header: &'a VisibilityHeader,
    options: ClosureOptions,
    bins: TimeBins,
    times: TimeBins,
    held: BTreeMap<i64, Bin>,
    released: Option<i64>,
}

impl Collector<'_> {
    fn n_chan(&self) -> usize {
        if self.options.channels == ClosureChannels::AverageVisibilities { 1 } else { self.header.spectrum.n_chan() }
    }

    fn add(&mut self, block: &VisibilityBlock) -> Result<()> {
        let (n_ant, n_chan) = (self.header.layout.n_ant(), self.n_chan());
        let n_pol = self.header.polarizations.len();
        let averaged = self.options.channels == ClosureChannels::AverageVisibilities;
        let coverage = &block.coverage;
        for row in 0..block.n_rows() {
            let (a1, a2) = (coverage.ant1[row] as usize, coverage.ant2[row] as usize);
            if a1 == a2 {
                continue;
            }
            ensure!(a1.max(a2) < n_ant, ChainError::Incompatible(format!("a row names antenna {}, the array has {n_ant}", a1.max(a2))));
            let (time, length) = (coverage.time_jd[row], coverage.integration_s[row]);
            let key = self.bins.key(time, length)?;
            if self.released.is_some_and(|r| key <= r) {
                return Err(ChainError::Incompatible(
                    "the rows are not in order of time and the set is too large to hold: sort it by time first".into(),
                ));
            }
            let moment = self.times.key(time, length)?;
            let bin = self.held.entry(key).or_insert_with(|| Bin { span: TimeSpan::empty(), integrations: BTreeMap::new() });
            bin.span.add(time, length);
            let samples = bin.integrations.entry(moment).or_insert_with(|| vec![Sample::default(); n_chan * n_pol * n_pairs(n_ant)]);
            let pair = pair_index(n_ant, a1.min(a2), a1.max(a2));
            for chan in 0..block.vis.dim().1 {
                for pol in 0..n_pol {
                    let w = f64::from(block.usable_weight(row, chan, pol));
                    if w > 0.0 {
                        let v = block.vis[(row, chan, pol)];
                        let im = if a1 < a2 { v.im } else { -v.im };
                        let group = if averaged { 0 } else { chan };
                        let s = &mut samples[(group * n_pol + pol) * n_pairs(n_ant) + pair];
                        s.wv += w * Complex64::new(f64::from(v.re), f64::from(im));
                        s.w += w;
                    }
                }
            }
        }
        Ok(())
    }

    /// Bytes held.
    fn held_bytes(&self) -> usize {
        let each = self.n_chan() * self.header.polarizations.len() * n_pairs(self.header.layout.n_ant()) * size_of::<Sample>();
        self.held.values().map(|b| b.integrations.len()).sum::<usize>() * each
    }

    /// Give the oldest bins to `work` while the bins take too much memory. The newest bin is kept, because it may still receive samples.
    fn release_if_large(&mut self, work: &mut dyn FnMut(&Bin) -> Result<()>) -> Result<()> {
        while self.held.len() > 1 && self.held_bytes() > MemoryBudget::default().waiting_rows() {
            if let Some((key, bin)) = self.held.pop_first() {
                self.released = Some(key);
                work(&bin)?;
            }
        }
        Ok(())
    }
}

pub(super) fn collect(
    source: &mut dyn VisibilitySource,
    options: &ClosureOptions,
    observer: &dyn Observer,
    work: &mut dyn FnMut(&VisibilityHeader, &Bin) -> Result<()>,
) -> Result<()> {
    let header = source.header().clone();
    let mut collector = Collector {
        header: &header,
        options: *options,
        bins: TimeBins::new(options.solint),
        times: TimeBins::new(SolutionInterval::Integration),
        held: BTreeMap::new(),
        released: None,
    };
    observer.event(Event::Phase { name: "closure quantities", total: Some(source.n_rows() as u64), unit: "rows" });
    for_each_block(source, MemoryBudget::default().block(), |_, block| {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        collector.add(&block)?;
        collector.release_if_large(&mut |bin| work(&header, bin))?;
        observer.event(Event::Advance(block.n_rows() as u64));
        Ok(())
    })?;
    for bin in collector.held.values() {
        work(&header, bin)?;
    }
    observer.event(Event::Done);
    Ok(())
}

/// The baselines of one channel and polarisation that have data anywhere in a bin, and the antennas ordered by their number of baselines.
/// Neither depends on gains, so the same combinations are formed before and after calibration.
fn links_and_order(header: &VisibilityHeader, bin: &Bin, block: usize) -> (Links, Vec<usize>) {
    let n = header.layout.n_ant();
    let mut links = Links::new(n);
    for samples in bin.integrations.values() {
        for ((p, q), _) in pairs_of(n).zip(&samples[block * n_pairs(n)..]).filter(|(_, s)| s.w > 0.0 && s.wv.norm_sqr() > 0.0) {
            links.set(p, q);
        }
    }
    let count: Vec<usize> = (0..n).map(|p| (0..n).filter(|q| links.has(p, *q)).count()).collect();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| count[*b].cmp(&count[*a]).then(a.cmp(b)));
    (links, order)
}

/// The sample of antennas p to q, conjugated where q < p; `None` without data.
pub(super) fn sample(n: usize, samples: &[Sample], p: usize, q: usize) -> Option<Sample> {
    let s = samples[pair_index(n, p.min(q), p.max(q))];
    (s.w > 0.0 && s.wv.norm_sqr() > 0.0).then_some(if p < q { s } else { Sample { wv: s.wv.conj(), ..s } })
}

/// Which channels of the samples go into each output channel.
fn channel_groups(n_chan: usize, channels: ClosureChannels) -> Vec<Vec<usize>> {
    match channels {
        ClosureChannels::AverageClosures => vec![(0..n_chan).collect()],
        _ => (0..n_chan).map(|c| vec![c]).collect(),
    }
}

/// A function of one combination of antennas: it takes the samples \[pair\] of each integration and channel.
pub(super) type CombinationWork<'a, const K: usize> =
    dyn FnMut(ClosureKey, [usize; K], &mut dyn Iterator<Item = &[Sample]>) -> Result<()> + 'a;

/// Call `work` with the samples of each combination of antennas of a bin. `sets` chooses the combinations.
pub(super) fn each_combination<const K: usize>(
    header: &VisibilityHeader,
    options: &ClosureOptions,
    bin: &Bin,
    sets: fn(&Links, ClosureSet, &[usize]) -> Vec<[usize; K]>,
    work: &mut CombinationWork<'_, K>,
) -> Result<()> {
    let set = if options.all { ClosureSet::All } else { ClosureSet::Minimal };
    let pairs = n_pairs(header.layout.n_ant());
    let n_pol = header.polarizations.len();
    let whole = options.channels == ClosureChannels::AverageVisibilities;
    let mut known: HashMap<(Links, Vec<usize>), Vec<[usize; K]>> = HashMap::new();
    for (chan, group) in channel_groups(if whole { 1 } else { header.spectrum.n_chan() }, options.channels).iter().enumerate() {
        let one = options.channels == ClosureChannels::Each;
        let freq_hz = if one { header.spectrum.freq_hz()[chan] } else { header.spectrum.mean_hz() };
        for (pol, polarization) in header.polarizations.iter().enumerate() {
            let found = links_and_order(header, bin, group[0] * n_pol + pol);
            let combinations = known.entry(found).or_insert_with_key(|(links, order)| sets(links, set, order));
            let key = ClosureKey {
                time_jd: bin.span.middle_jd(),
                interval_s: bin.span.length_s(),
                chan,
                freq_hz,
                polarization: *polarization,
                samples: 0,
            };
            for antennas in combinations.iter() {
                let mut blocks = bin
                    .integrations
                    .values()
                    .flat_map(|samples| group.iter().map(move |c| &samples[(c * n_pol + pol) * pairs..(c * n_pol + pol + 1) * pairs]));
                work(key, *antennas, &mut blocks)?;
            }
        }
    }
    Ok(())
}

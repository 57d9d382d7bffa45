//! Closure phases and closure amplitudes: what the data say that no antenna error can touch.
//!
//! They are formed in each integration and only then averaged: the bispectrum V_ab V_bc V_ca by its vector mean, the
//! logarithm of the amplitude ratio by its weighted mean. So gains may change from one integration to the next. Channels
//! are kept, averaged after the quantities are formed, or averaged before (more sensitive, but then gains must not change
//! over the band).
//!
//! # Reference
//! Jennison 1958, MNRAS 118, 276; Twiss, Carter & Little 1960, Observatory 80, 153; Rogers et al. 1974, ApJ 193, 293;
//! Blackburn et al. 2020, ApJ 894, 31 (errors).

pub use super::closure_sets::ClosureSet;
use super::closure_sets::{Links, quadrangles, triangles};
use super::intervals::{TimeBins, TimeSpan, n_pairs, pair_index, pairs_of};
use super::options::SolutionInterval;
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{Polarization, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block};
use num_complex::Complex64;
use std::collections::{BTreeMap, HashMap};

/// Standard deviation of a phase of which nothing is known, pi / sqrt(3) rad.
const UNKNOWN_PHASE_RAD: f64 = 1.813_799_364_234_218;

/// What happens to the channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ClosureChannels {
    /// One quantity for each.
    Each,
    /// Quantities are formed for each and averaged.
    AverageClosures,
    /// Visibilities are averaged over the band, then quantities are formed.
    AverageVisibilities,
}

/// Options of [`closure_phases`] and [`closure_amplitudes`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosureOptions {
    /// Independent ones, or all.
    pub set: ClosureSet,
    /// Over what time the quantities are averaged.
    pub interval: SolutionInterval,
    /// What happens to the channels.
    pub channels: ClosureChannels,
}

impl Default for ClosureOptions {
    fn default() -> Self {
        Self { set: ClosureSet::Minimal, interval: SolutionInterval::Integration, channels: ClosureChannels::AverageVisibilities }
    }
}

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

/// arg(V_ab V_bc V_ca) for antennas a, b, c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosurePhase {
    /// Where and when.
    pub key: ClosureKey,
    /// The antennas a < b < c.
    pub antennas: [usize; 3],
    /// The phase, rad.
    pub phase_rad: f64,
    /// Its standard deviation, rad; at most pi / sqrt(3), that of a phase of which nothing is known.
    pub sigma_rad: f64,
    /// Cube root of the modulus of the mean bispectrum, in the unit of the visibilities.
    pub amplitude: f64,
}

/// ln(|V_ab| |V_cd| / (|V_ac| |V_bd|)) for antennas a, b, c, d.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosureAmplitude {
    /// Where and when.
    pub key: ClosureKey,
    /// The antennas a, b, c, d.
    pub antennas: [usize; 4],
    /// Logarithm of the closure amplitude.
    pub log_amplitude: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// Weighted sum of the visibilities of a baseline in an integration, antenna p to q with p < q.
#[derive(Debug, Clone, Copy, Default)]
struct Sample {
    wv: Complex64,
    w: f64,
}

impl Sample {
    fn vis(&self) -> Complex64 {
        self.wv / self.w
    }

    /// Variance of the real part.
    fn variance(&self) -> f64 {
        1.0 / self.w
    }
}

/// One averaging interval: integrations by their time in ms, each \[chan, pol, pair\].
struct Bin {
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
        let coverage = &block.coverage;
        for row in 0..block.n_rows() {
            let (a1, a2) = (coverage.ant1[row] as usize, coverage.ant2[row] as usize);
            if a1 == a2 {
                continue;
            }
            if a1.max(a2) >= n_ant {
                return Err(ChainError::Incompatible(format!("a row names antenna {}, the array has {n_ant}", a1.max(a2))));
            }
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
                        let s = &mut samples[(chan.min(n_chan - 1) * n_pol + pol) * n_pairs(n_ant) + pair];
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

    /// Hand on the oldest bin, but never the newest, which may still grow.
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

fn collect(
    source: &mut dyn VisibilitySource,
    options: &ClosureOptions,
    observer: &dyn Observer,
    work: &mut dyn FnMut(&VisibilityHeader, &Bin) -> Result<()>,
) -> Result<()> {
    let header = source.header().clone();
    let mut collector = Collector {
        header: &header,
        options: *options,
        bins: TimeBins::new(options.interval),
        times: TimeBins::new(SolutionInterval::Integration),
        held: BTreeMap::new(),
        released: None,
    };
    observer.event(Event::Phase { name: "closure quantities", total: Some(source.n_rows() as u64), unit: "rows" });
    for_each_block(source, MemoryBudget::default().block(), |_, block| {
        if observer.cancelled() {
            return Err(ChainError::Cancelled);
        }
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

/// The baselines of one channel and polarisation that have data anywhere in a bin, and the antennas by their number of
/// baselines. Neither depends on gains, so the same combinations are formed before and after calibration.
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
fn sample(n: usize, samples: &[Sample], p: usize, q: usize) -> Option<Sample> {
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

/// Takes the samples \[pair\] of each integration and channel that one combination of antennas is formed from.
type CombinationWork<'a, const K: usize> = dyn FnMut(ClosureKey, [usize; K], &mut dyn Iterator<Item = &[Sample]>) -> Result<()> + 'a;

/// Walk over the quantities of a bin: `sets` chooses the antennas, `work` takes the samples of one combination.
fn each_combination<const K: usize>(
    header: &VisibilityHeader,
    options: &ClosureOptions,
    bin: &Bin,
    sets: fn(&Links, ClosureSet, &[usize]) -> Vec<[usize; K]>,
    work: &mut CombinationWork<'_, K>,
) -> Result<()> {
    let pairs = n_pairs(header.layout.n_ant());
    let n_pol = header.polarizations.len();
    let whole = options.channels == ClosureChannels::AverageVisibilities;
    let mut known: HashMap<(Links, Vec<usize>), Vec<[usize; K]>> = HashMap::new();
    for (chan, group) in channel_groups(if whole { 1 } else { header.spectrum.n_chan() }, options.channels).iter().enumerate() {
        let one = options.channels == ClosureChannels::Each;
        let freq_hz = if one { header.spectrum.freq_hz()[chan] } else { header.spectrum.mean_hz() };
        for (pol, polarization) in header.polarizations.iter().enumerate() {
            let found = links_and_order(header, bin, group[0] * n_pol + pol);
            let combinations = known.entry(found).or_insert_with_key(|(links, order)| sets(links, options.set, order));
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

/// Form the closure phases of a set and hand them on one by one, in order of time.
///
/// # Errors
/// Fewer than 3 antennas, an interval shorter than an integration, a set too large to hold whose rows are not in order of
/// time, or what source and `emit` say.
pub fn closure_phases(
    source: &mut dyn VisibilitySource,
    options: &ClosureOptions,
    observer: &dyn Observer,
    mut emit: impl FnMut(ClosurePhase) -> Result<()>,
) -> Result<()> {
    let n = source.header().layout.n_ant();
    if n < 3 {
        return Err(ChainError::NoData(format!("closure phases need at least 3 antennas, the array has {n}")));
    }
    collect(source, options, observer, &mut |header, bin| {
        each_combination(header, options, bin, triangles, &mut |mut key, [a, b, c], blocks| {
            let (mut sum, mut variance, mut weight) = (Complex64::new(0.0, 0.0), 0.0, 0.0);
            for samples in blocks {
                let sides = [sample(n, samples, a, b), sample(n, samples, b, c), sample(n, samples, c, a)];
                let [Some(x), Some(y), Some(z)] = sides else { continue };
                let power = [x, y, z].map(|s| s.vis().norm_sqr());
                let clean = [x, y, z].map(|s| (s.vis().norm_sqr() - 2.0 * s.variance()).max(0.0));
                let w = 1.0 / (x.variance() + y.variance() + z.variance());
                sum += w * x.vis() * y.vis() * z.vis();
                // Half the variance of a product of noisy complex numbers, that across its direction.
                variance += w * w * (power.iter().product::<f64>() - clean.iter().product::<f64>()) / 2.0;
                weight += w;
                key.samples += 1;
            }
            if key.samples == 0 || sum.norm_sqr() == 0.0 {
                return Ok(());
            }
            emit(ClosurePhase {
                key,
                antennas: [a, b, c],
                phase_rad: sum.arg(),
                sigma_rad: (variance.sqrt() / sum.norm()).min(UNKNOWN_PHASE_RAD),
                amplitude: (sum.norm() / weight).cbrt(),
            })
        })
    })
}

/// Form the logarithms of the closure amplitudes of a set and hand them on one by one, in order of time. They need no
/// correction for noise bias: the mean of ln|V| over complex Gaussian noise is ln|S| up to terms exp(-SNR^2 / 2).
///
/// # Errors
/// Fewer than 4 antennas, otherwise as [`closure_phases`].
pub fn closure_amplitudes(
    source: &mut dyn VisibilitySource,
    options: &ClosureOptions,
    observer: &dyn Observer,
    mut emit: impl FnMut(ClosureAmplitude) -> Result<()>,
) -> Result<()> {
    let n = source.header().layout.n_ant();
    if n < 4 {
        return Err(ChainError::NoData(format!("closure amplitudes need at least 4 antennas, the array has {n}")));
    }
    collect(source, options, observer, &mut |header, bin| {
        each_combination(header, options, bin, quadrangles, &mut |mut key, [a, b, c, d], blocks| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for samples in blocks {
                let sides = [sample(n, samples, a, b), sample(n, samples, c, d), sample(n, samples, a, c), sample(n, samples, b, d)];
                let [Some(x), Some(y), Some(z), Some(t)] = sides else { continue };
                let log = 0.5 * (x.vis().norm_sqr() * y.vis().norm_sqr() / (z.vis().norm_sqr() * t.vis().norm_sqr())).ln();
                let w = 1.0 / [x, y, z, t].iter().map(|s| s.variance() / s.vis().norm_sqr()).sum::<f64>();
                sum += w * log;
                weight += w;
                key.samples += 1;
            }
            if key.samples == 0 {
                return Ok(());
            }
            emit(ClosureAmplitude { key, antennas: [a, b, c, d], log_amplitude: sum / weight, sigma: weight.sqrt().recip() })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::testdata::{Scene, cis, random_phases};
    use super::*;
    use crate::progress::Silent;
    use cittert_arrays::VisibilitySet;

    fn phases(mut set: VisibilitySet, options: ClosureOptions) -> Vec<ClosurePhase> {
        let mut out = Vec::new();
        closure_phases(&mut set, &options, &Silent, |c| {
            out.push(c);
            Ok(())
        })
        .unwrap();
        out
    }

    fn amplitudes(mut set: VisibilitySet, options: ClosureOptions) -> Vec<ClosureAmplitude> {
        let mut out = Vec::new();
        closure_amplitudes(&mut set, &options, &Silent, |c| {
            out.push(c);
            Ok(())
        })
        .unwrap();
        out
    }

    fn scene() -> Scene {
        Scene { n_chan: 2, sources: vec![(0.0, 0.0, 1.0), (2e-4, 1e-4, 0.5), (-1e-4, 2e-4, 0.3)], ..Scene::point(7, 6) }
    }

    #[test]
    fn antenna_errors_leave_the_closures_alone() {
        let phase = random_phases(6 * 7, 3.0, 5);
        let gain = |t: usize, a: usize| Complex64::from_polar(1.0 + 0.4 * (a as f64).sin(), phase[t * 7 + a]);
        for set in [ClosureSet::Minimal, ClosureSet::All] {
            for channels in [ClosureChannels::Each, ClosureChannels::AverageClosures, ClosureChannels::AverageVisibilities] {
                let options = ClosureOptions { set, channels, interval: SolutionInterval::Seconds(30.0) };
                let (clean, dirty) = (scene().set(|_, _, _, _| cis(0.0)), scene().set(|t, a, _, _| gain(t, a)));
                let (a, b) = (phases(clean.clone(), options), phases(dirty.clone(), options));
                let each = if channels == ClosureChannels::Each { 2 } else { 1 };
                assert_eq!(a.len(), 2 * each * if set == ClosureSet::Minimal { 15 } else { 35 });
                for (x, y) in a.iter().zip(&b) {
                    assert_eq!(x.antennas, y.antennas);
                    assert!(cis(x.phase_rad - y.phase_rad).arg().abs() < 1e-5);
                }
                assert!(a.iter().any(|x| x.phase_rad.abs() > 0.2), "the scene has closure phases");
                let (a, b) = (amplitudes(clean, options), amplitudes(dirty, options));
                assert_eq!(a.len(), 2 * each * if set == ClosureSet::Minimal { 14 } else { 105 });
                assert!(a.iter().zip(&b).all(|(x, y)| (x.log_amplitude - y.log_amplitude).abs() < 1e-5));
            }
        }
    }

    #[test]
    fn errors_are_those_of_the_scatter() {
        for (interval, sigma) in [(SolutionInterval::Integration, 0.1), (SolutionInterval::Seconds(100.0), 0.5)] {
            let options = ClosureOptions { interval, channels: ClosureChannels::AverageClosures, ..ClosureOptions::default() };
            let run = Scene { sigma, n_chan: 4, ..Scene::point(6, 200) }.set(|_, _, _, _| cis(0.0));
            let p = phases(run.clone(), options);
            let pull = (p.iter().map(|c| (c.phase_rad / c.sigma_rad).powi(2)).sum::<f64>() / p.len() as f64).sqrt();
            assert!((pull - 1.0).abs() < 0.15, "{interval:?}: {pull}");
            if sigma < 0.2 {
                let a = amplitudes(run, options);
                let pull = (a.iter().map(|c| (c.log_amplitude / c.sigma).powi(2)).sum::<f64>() / a.len() as f64).sqrt();
                assert!((pull - 1.0).abs() < 0.15, "{pull}");
            }
        }
    }

    #[test]
    fn flagged_data_are_left_out_and_small_arrays_refused() {
        let mut set = Scene::point(5, 1).set(|_, _, _, _| cis(0.0));
        set.data.flags[(0, 0, 0)] = true;
        let p = phases(set.clone(), ClosureOptions { set: ClosureSet::All, ..ClosureOptions::default() });
        assert_eq!(p.len(), 7);
        assert!(p.iter().all(|c| !(c.antennas[0] == 0 && c.antennas[1] == 1)));
        assert_eq!(phases(set, ClosureOptions::default()).len(), 5);
        let mut two = Scene::point(2, 1).set(|_, _, _, _| cis(0.0));
        assert!(closure_phases(&mut two, &ClosureOptions::default(), &Silent, |_| Ok(())).unwrap_err().to_string().contains("3 antennas"));
    }
}

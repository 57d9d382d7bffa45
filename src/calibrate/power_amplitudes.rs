//! Amplitudes of gains from autocorrelations.
//!
//! An autocorrelation is |g_p|^2 (Z + R_p): the zero spacing Z, which all antennas of one pattern share, and the power R_p of the receiver, which the
//! set states. So autocorrelations tell all amplitudes but for one number, Z + R. A calibrated radiometer beside the array measures Z (the antenna
//! temperature that the set states). Without one, the mean of ln |g| over the antennas is taken to be 0, which is right within its scatter over the
//! root of their number.

use super::grouping::{ChannelPlan, FeedPlan};
use super::lookup::nearest_channel;
use super::options::SolveOptions;
use super::over_ranks::{Numbers, begin, of_all};
use crate::closure::{TimeBins, TimeSpan};
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{GainTable, Ranks, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block, jy_per_kelvin_sr};
use ndarray::Array3;
use num_complex::Complex64;
use std::collections::BTreeMap;

/// Where the common factor of the amplitudes comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScaleFrom {
    /// The antenna temperature that the set states.
    AntennaTemperature,
    /// The mean of ln |g| over the antennas, taken to be 0.
    MeanGain,
}

impl ScaleFrom {
    /// Name in results.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::AntennaTemperature => "antenna temperature",
            Self::MeanGain => "mean gain",
        }
    }
}

/// Amplitudes, and how certain their common factor is.
#[derive(Debug, Clone)]
pub struct PowerAmplitudes {
    /// Gains with phase 0.
    pub gains: GainTable,
    /// Where their common factor comes from.
    pub scale_from: ScaleFrom,
    /// Relative standard deviation of the scale of calibrated visibilities.
    pub scale_sigma: f64,
}

/// Sums of one interval: power times expected power, its square and the weight \[ant, chan group, feed\].
struct Interval {
    span: TimeSpan,
    cross: Array3<f64>,
    square: Array3<f64>,
}

/// The amplitudes that the autocorrelations of a set tell. `None` where they are missing for an antenna or a receiver is not stated.
///
/// # Errors
/// The source fails, or an interval is shorter than an integration.
pub fn amplitudes_from_power(source: &mut dyn VisibilitySource, options: &SolveOptions) -> Result<Option<PowerAmplitudes>> {
    let header = source.header().clone();
    if !header.layout.states_receivers() || header.unit == VisUnit::Uncalibrated {
        return Ok(None);
    }
    let freq = header.spectrum.freq_hz().to_vec();
    let shape = (header.layout.n_ant(), freq.len());
    let receivers: Option<Vec<f64>> =
        (0..shape.0 * shape.1).map(|k| header.layout.receiver_power(k / shape.1, header.unit, freq[k % shape.1])).collect();
    let Some(receivers) = receivers else { return Ok(None) };
    let per_ksr = |f: f64| if header.unit == VisUnit::Jy { jy_per_kelvin_sr(f) } else { 1.0 };
    let stated = header.antenna_temperature_k.and_then(|t| {
        let of = |f: &f64| header.layout.pattern.solid_angle_sr(*f).map(|omega| t * omega * per_ksr(*f));
        freq.iter().map(of).collect::<Option<Vec<f64>>>()
    });
    let (zero, scale_from) = match stated {
        Some(zero) => (zero, ScaleFrom::AntennaTemperature),
        None => {
            let Some(kelvin_sr) = of_mean_gain(source, &header, &receivers, &per_ksr)? else { return Ok(None) };
            (freq.iter().map(|f| kelvin_sr * per_ksr(*f)).collect(), ScaleFrom::MeanGain)
        }
    };
    let expected: Vec<f64> = receivers.iter().enumerate().map(|(k, r)| r + zero[k % shape.1]).collect();
    let gains = solved(source, &header, options, &expected)?;
    let logs: Vec<f64> = gains.gains.iter().zip(&gains.flags).filter(|(_, f)| !**f).map(|(g, _)| g.norm().ln()).collect();
    if gains.flags.iter().any(|f| *f) || logs.iter().any(|l| !l.is_finite()) {
        return Ok(None);
    }
    let scale_sigma = match scale_from {
        ScaleFrom::AntennaTemperature => 0.0,
        ScaleFrom::MeanGain => {
            let mean = logs.iter().sum::<f64>() / logs.len() as f64;
            let variance = logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / logs.len() as f64;
            2.0 * (variance / shape.0 as f64).sqrt()
        }
    };
    Ok(Some(PowerAmplitudes { gains, scale_from, scale_sigma }))
}

impl PowerAmplitudes {
    /// Multiply the gains of a table, which were solved from data that these amplitudes calibrate, by them.
    pub fn multiply(&self, table: &mut GainTable) {
        let own = &self.gains;
        let n_feed = own.feeds.len();
        let times: Vec<usize> = table.time_jd.iter().map(|t| own.interval_at(*t)).collect();
        let chans: Vec<usize> = table.spectrum.freq_hz().iter().map(|f| nearest_channel(own, *f)).collect();
        for ((t, a, c, f), g) in table.gains.indexed_iter_mut() {
            *g *= own.gains[(times[t], a, chans[c], f.min(n_feed - 1))];
        }
        table.mode = format!("{} and amplitudes from autocorrelations", table.mode);
    }

    /// Tell the user.
    pub fn say(&self, observer: &dyn Observer) {
        let how = match self.scale_from {
            ScaleFrom::AntennaTemperature => "the antenna temperature that the set states fixes their common factor".to_owned(),
            ScaleFrom::MeanGain => format!(
                "no antenna temperature fixes their common factor: their mean logarithm is taken to be 0, and the flux scale is uncertain by {:.1} %",
                100.0 * self.scale_sigma
            ),
        };
        observer.event(Event::Note(&format!("amplitudes of the gains by the autocorrelations; {how}. Only phases are left to solve")));
    }
}

/// The zero spacing in K sr for which the mean of ln |g| is 0; `None` without autocorrelations of every antenna.
fn of_mean_gain(
    source: &mut dyn VisibilitySource,
    header: &VisibilityHeader,
    receivers: &[f64],
    per_ksr: &dyn Fn(f64) -> f64,
) -> Result<Option<f64>> {
    let freq = header.spectrum.freq_hz();
    let n_chan = freq.len();
    // Mean power and receiver of each antenna, in K sr.
    let (mut power, mut count) = (vec![0.0; header.layout.n_ant()], vec![0.0; header.layout.n_ant()]);
    for_each_power(source, header, |_, antenna, chan, _, (v, _)| {
        power[antenna] += v / per_ksr(freq[chan]);
        count[antenna] += 1.0;
        Ok(())
    })?;
    let ranks = source.ranks();
    ranks.sum(&mut power);
    ranks.sum(&mut count);
    let receiver = |a: usize| (0..n_chan).map(|c| receivers[a * n_chan + c] / per_ksr(freq[c])).sum::<f64>() / n_chan as f64;
    let all: Option<Vec<(f64, f64)>> = (0..power.len()).map(|a| (power[a] > 0.0).then(|| (power[a] / count[a], receiver(a)))).collect();
    let Some(all) = all else { return Ok(None) };
    let most = all.iter().map(|(p, r)| p + r).fold(0.0, f64::max);
    let excess = |zero: f64| all.iter().map(|(p, r)| (p / (zero + r)).ln()).sum::<f64>();
    // The sum falls as the zero spacing grows.
    let (mut low, mut high) = (0.0, 10.0 * most);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    Ok(Some(0.5 * (low + high)))
}

/// |g| = sqrt(sum(w V E) / sum(w E^2)) with the expected powers E \[ant x chan\].
fn solved(source: &mut dyn VisibilitySource, header: &VisibilityHeader, options: &SolveOptions, expected: &[f64]) -> Result<GainTable> {
    let channels = ChannelPlan::new(&header.spectrum, options.channels)?;
    let feeds = FeedPlan::new(header, options.feeds)?;
    let shape = (header.layout.n_ant(), channels.n_groups(), feeds.names.len());
    let n_chan = header.spectrum.n_chan();
    let mut bins = TimeBins::new(options.solint);
    let ranks = source.ranks();
    if ranks.size() > 1 {
        let mut first = None;
        let read = for_each_power(source, header, |(time_jd, length_s), _, _, pol, _| {
            first = first.or(feeds.of_pol[pol].map(|_| [time_jd, length_s]));
            Ok(())
        });
        begin(&mut bins, &*ranks, read.map(|()| first))?;
    }
    let mut intervals: BTreeMap<i64, Interval> = BTreeMap::new();
    let own = for_each_power(source, header, |(time_jd, length_s), antenna, chan, pol, (v, weight)| {
        let Some(feed) = feeds.of_pol[pol] else { return Ok(()) };
        let empty = || Interval { span: TimeSpan::empty(), cross: Array3::zeros(shape), square: Array3::zeros(shape) };
        let interval = intervals.entry(bins.key(time_jd, length_s)?).or_insert_with(empty);
        interval.span.add(time_jd, length_s);
        let (at, e) = ((antenna, channels.group_of[chan], feed), expected[antenna * n_chan + chan]);
        interval.cross[at] += weight * v * e;
        interval.square[at] += weight * e * e;
        Ok(())
    });
    let intervals = if ranks.size() > 1 { of_all_rows(&*ranks, own.map(|()| intervals), shape)? } else { own.map(|()| intervals)? };
    let spans: Vec<&Interval> = intervals.values().collect();
    let mut table = GainTable::unity(
        header.layout.clone(),
        channels.spectrum.clone(),
        feeds.names,
        spans.iter().map(|i| i.span.middle_jd()).collect(),
        spans.iter().map(|i| i.span.length_s()).collect(),
    )
    .map_err(|_| ChainError::NoData("no autocorrelation can be used".into()))?;
    for (t, interval) in spans.iter().enumerate() {
        for (at, square) in interval.square.indexed_iter() {
            let power = interval.cross[at] / square;
            let place = (t, at.0, at.1, at.2);
            if power > 0.0 && power.is_finite() {
                table.gains[place] = Complex64::from(power.sqrt());
            } else {
                table.flags[place] = true;
            }
        }
    }
    table.mode = "amplitudes from autocorrelations".into();
    Ok(table)
}

/// The sums over the rows of all processes, from those over the rows of this one.
fn of_all_rows(ranks: &dyn Ranks, own: Result<BTreeMap<i64, Interval>>, shape: (usize, usize, usize)) -> Result<BTreeMap<i64, Interval>> {
    let numbers = |(key, i): (&i64, &Interval)| -> Vec<f64> {
        let sums = i.cross.iter().chain(&i.square).copied();
        std::iter::once(*key as f64).chain(i.span.ends_jd()).chain(sums).collect()
    };
    let mut all: BTreeMap<i64, Interval> = BTreeMap::new();
    for told in of_all(ranks, own.map(|intervals| intervals.iter().flat_map(numbers).collect()))? {
        let mut told = Numbers::of(&told);
        while let Some([key, first_jd, last_jd]) = told.next() {
            let empty = || Interval { span: TimeSpan::empty(), cross: Array3::zeros(shape), square: Array3::zeros(shape) };
            let interval = all.entry(key as i64).or_insert_with(empty);
            interval.span.unite(TimeSpan::of(first_jd, last_jd));
            for sum in interval.cross.iter_mut().chain(&mut interval.square) {
                *sum += told.next().map_or(0.0, |[x]: [f64; 1]| x);
            }
        }
    }
    Ok(all)
}

/// Call `work` with time and integration, antenna, channel, product, power and weight of every usable autocorrelation of a parallel hand.
fn for_each_power(
    source: &mut dyn VisibilitySource,
    header: &VisibilityHeader,
    mut work: impl FnMut((f64, f64), usize, usize, usize, (f64, f64)) -> Result<()>,
) -> Result<()> {
    let powered: Vec<bool> = header.polarizations.iter().map(|p| p.is_parallel_hand() || *p == cittert_arrays::Polarization::I).collect();
    for_each_block(source, MemoryBudget::default().block(), |_, block: VisibilityBlock| -> Result<()> {
        let same = block.coverage.ant1.iter().zip(&block.coverage.ant2).enumerate().filter(|(_, (a, b))| a == b);
        for (row, (antenna, _)) in same {
            let when = (block.coverage.time_jd[row], block.coverage.integration_s[row]);
            for ((chan, pol), v) in block.vis.index_axis(ndarray::Axis(0), row).indexed_iter().filter(|((_, p), _)| powered[*p]) {
                let weight = block.usable_weight(row, chan, pol);
                if weight > 0.0 {
                    work(when, *antenna as usize, chan, pol, (f64::from(v.re), f64::from(weight)))?;
                }
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::corrupt::{AmplitudeError, CorruptOptions, Error, PhaseError, Variation, corrupt, corrupted_header};
    use crate::fixtures::positions;
    use crate::progress::Silent;
    use crate::simulate::{SimulateOptions, SkyModel, TrackOptions, simulate_set};
    use cittert_arrays::quantity::{Duration, Temperature};
    use cittert_arrays::{
        Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, Polarization, SkyFrame, SkyGrid, SpectralWindow, UvCoverage,
        VisibilitySet,
    };
    use ndarray::Array4;

    /// What 30 elements see of a uniform 270 K, with amplitude errors of 30 %, and the true gains.
    fn observed(radiometer: bool) -> (VisibilitySet, GainTable) {
        let antennas = positions(30, 0.1, 0.0, 5).into_iter().enumerate().map(|(k, p)| Antenna::new(format!("E{k}"), k as u32, p));
        let mut layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
        layout.pattern = "gaussian fwhm_deg=9".parse().unwrap();
        let grid = SkyGrid::new(64, 64, 8e-3, SkyFrame::Boresight).unwrap();
        let band = SpectralWindow::band(94e9, 8e9, 1).unwrap();
        let scene =
            Image::new(grid, band, vec![Polarization::I], Array4::from_elem((1, 1, 64, 64), 270.0), BrightnessUnit::Kelvin).unwrap();
        let options = SimulateOptions {
            autos: true,
            no_antenna_temperature: !radiometer,
            tsys: Some(Temperature(600.0)),
            ..SimulateOptions::default()
        };
        let track = TrackOptions { integration: Duration(0.1), duration: Some(Duration(0.4)), ..TrackOptions::default() };
        let planned = track.plan(&layout).unwrap();
        let rows = planned.plan.with_autocorrelations(true).coverage().unwrap();
        let header = options.header(layout, SpectralWindow::band(94e9, 8e9, 4).unwrap(), planned.center, VisUnit::KelvinSr);
        let mut set = simulate_set(header, &rows, &SkyModel::of_image(scene), &options, &Silent).unwrap();
        let errors = CorruptOptions {
            seed: 3,
            errors: vec![
                Error::Phase(PhaseError { rms_rad: 1.0, variation: Variation::Constant }),
                Error::Amplitude(AmplitudeError { rms: 0.3, variation: Variation::Integration }),
            ],
            per_feed: false,
        };
        let empty = VisibilityBlock::zeros(UvCoverage::empty(), 4, 1);
        let mut out = VisibilitySet::new(corrupted_header(&set.header, &errors), empty).unwrap();
        let table = corrupt(&mut set, &mut out, &errors, &Silent).unwrap();
        (out, table)
    }

    #[test]
    fn autocorrelations_and_a_radiometer_tell_every_amplitude_in_every_interval() {
        let (mut set, truth) = observed(true);
        let options = SolveOptions { solint: crate::closure::SolutionInterval::Integration, ..SolveOptions::default() };
        let found = amplitudes_from_power(&mut set, &options).unwrap().unwrap();
        assert_eq!((found.scale_from, found.gains.gains.dim()), (ScaleFrom::AntennaTemperature, (4, 30, 1, 1)));
        for (at, g) in found.gains.gains.indexed_iter() {
            let t = truth.gains[(at.0, at.1, 0, 0)].norm();
            // Tsys / sqrt(B t) is 4e-5 of the power.
            assert!((g.re / t - 1.0).abs() < 1e-3 && g.im == 0.0, "{at:?}: {g} {t}");
        }
        // Phases times amplitudes are the gains.
        let mut phases = truth.clone();
        phases.gains.mapv_inplace(|g| g / g.norm());
        found.multiply(&mut phases);
        assert!(phases.gains.iter().zip(&truth.gains).all(|(a, b)| (a - b).norm() < 2e-3 * b.norm()));
    }

    #[test]
    fn without_a_radiometer_the_scale_is_uncertain_and_said_to_be() {
        let (mut set, truth) = observed(false);
        let options = SolveOptions { solint: crate::closure::SolutionInterval::Integration, ..SolveOptions::default() };
        let found = amplitudes_from_power(&mut set, &options).unwrap().unwrap();
        assert_eq!(found.scale_from, ScaleFrom::MeanGain);
        let ratios: Vec<f64> = found.gains.gains.indexed_iter().map(|(at, g)| g.re / truth.gains[(at.0, at.1, 0, 0)].norm()).collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!(ratios.iter().all(|r| (r / mean - 1.0).abs() < 1e-3), "the amplitudes relative to each other");
        assert!((mean * mean - 1.0).abs() < 4.0 * found.scale_sigma && found.scale_sigma > 0.01, "{mean} {}", found.scale_sigma);
        // Without a statement of the receivers, autocorrelations tell nothing.
        let mut antennas = set.header.layout.antennas().to_vec();
        antennas[3].receiver = None;
        let pattern = set.header.layout.pattern.clone();
        set.header.layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap();
        set.header.layout.pattern = pattern;
        assert!(amplitudes_from_power(&mut set, &options).unwrap().is_none());
    }
}

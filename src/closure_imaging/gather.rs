//! Reads a set of visibilities as the few hundred data of a sparse array: one polarisation product, averaged over scans, with systematic
//! errors.

use super::samples::Samples;
use crate::imaging::{DataCounts, PolSelector};
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::quantity::Duration;
use cittert_arrays::{Polarization, SPEED_OF_LIGHT_M_S, VisibilityHeader, VisibilitySource, for_each_block};
use num_complex::{Complex32, Complex64};
use std::collections::BTreeMap;

/// Data that are averaged into one.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Cell {
    scan: usize,
    chan: u32,
    pair: (u32, u32),
}

/// Sums of w, w V and w (u, v).
#[derive(Default)]
struct Sum {
    w: f64,
    wv: Complex64,
    wuv: [f64; 2],
}

/// Largest number of samples. The transform is direct, and its time grows with the number of samples times the number of cells.
const MOST_SAMPLES: usize = 50_000;
/// A pause longer than this many usual time steps ends a scan.
const PAUSE: f64 = 6.0;
/// Longest scan that is averaged into one datum, s.
const LONGEST_SCAN_S: f64 = 600.0;
const DAY_S: f64 = 86_400.0;

/// Averaging before the closure quantities are formed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Average {
    /// Scans of at most 10 minutes. Pauses between integrations separate them; without pauses single integrations are used.
    #[default]
    Scans,
    /// Every integration for itself.
    Integration,
    /// Intervals of this length within the scans.
    Time(Duration),
}

/// The data of a sparse array.
#[derive(Debug, Clone)]
pub struct SparseSet {
    /// The visibilities with their antennas and times.
    pub samples: Samples,
    /// u and v in wavelengths \[n\], for the antennas p < q in the order of the samples.
    pub uv: Vec<[f64; 2]>,
    /// Time of the last integration of each moment, Julian date.
    pub times_jd: Vec<f64>,
    /// Names of the antennas.
    pub names: Vec<String>,
    /// Index of the phase centre.
    pub phase_center: usize,
    /// Counts of the data that were used and left out.
    pub counts: DataCounts,
}

#[derive(Clone, Copy)]
struct Datum {
    time_jd: f64,
    chan: u32,
    pair: (u32, u32),
    uvw: [f64; 3],
    vis: Complex64,
    weight: f64,
}

impl SparseSet {
    /// Read a set. `polarization` is the product to image. `systematic` is the fraction of every amplitude that is added to its error in
    /// quadrature.
    ///
    /// # Errors
    /// The source cannot be read, it has several phase centres or no usable datum, it has too many data after averaging for a direct
    /// transform, or the fraction is outside 0..1.
    pub fn gather(
        source: &mut dyn VisibilitySource,
        polarization: Polarization,
        average: Average,
        systematic: f64,
        observer: &dyn Observer,
    ) -> Result<Self> {
        need("systematic-noise", systematic, (0.0..1.0).contains(&systematic), "a fraction from 0 to 1")?;
        let header = source.header().clone();
        let (data, counts, phase_center) = read(source, &header, polarization, observer)?;
        if data.is_empty() {
            return Err(ChainError::NoData(format!("no usable visibility: {}", counts.left_out(polarization.name()))));
        }
        let scans = intervals(&data, average)?;
        let n_ant = header.layout.n_ant();
        let mut sums: BTreeMap<Cell, Sum> = BTreeMap::new();
        let freq = header.spectrum.freq_hz();
        for d in &data {
            let scan = scans.partition_point(|end| *end < d.time_jd);
            let sum = sums.entry(Cell { scan, chan: d.chan, pair: d.pair }).or_default();
            let per_m = freq[d.chan as usize] / SPEED_OF_LIGHT_M_S;
            sum.w += d.weight;
            sum.wv += d.weight * d.vis;
            (0..2).for_each(|i| sum.wuv[i] += d.weight * d.uvw[i] * per_m);
        }
        if sums.len() > MOST_SAMPLES {
            return Err(ChainError::Incompatible(format!(
                "{} visibilities are left after averaging, at most {MOST_SAMPLES} can be imaged from closure quantities: average more, or \
                 self-calibrate and image complex visibilities",
                sums.len()
            )));
        }
        let (mut pairs, mut vis, mut sigma, mut uv) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut moments, mut times_jd): (Vec<std::ops::Range<usize>>, _) = (Vec::new(), Vec::new());
        let mut last = None;
        for (Cell { scan, chan, pair }, Sum { w, wv, wuv }) in &sums {
            if last != Some((*scan, *chan)) {
                last = Some((*scan, *chan));
                moments.push(pairs.len()..pairs.len());
                times_jd.push(scans[*scan]);
            }
            let v = wv / *w;
            pairs.push((pair.0 as usize, pair.1 as usize));
            vis.push(v);
            sigma.push((1.0 / w).sqrt().hypot(systematic * v.norm()));
            uv.push(wuv.map(|x| x / w));
            if let Some(m) = moments.last_mut() {
                m.end = pairs.len();
            }
        }
        let names = header.layout.antennas().iter().map(|a| a.name.clone()).collect();
        Ok(Self { samples: Samples::new(n_ant, pairs, (vis, sigma), moments)?, uv, times_jd, names, phase_center, counts })
    }

    /// Lengths of the baselines, wavelengths \[n\].
    #[must_use]
    pub fn lengths_wl(&self) -> Vec<f64> {
        self.uv.iter().map(|[u, v]| u.hypot(*v)).collect()
    }

    /// Keep the entries that `keep` \[n\] marks.
    ///
    /// # Errors
    /// No entry is kept.
    pub fn retain(&mut self, keep: &[bool]) -> Result<()> {
        let s = &self.samples;
        let kept: Vec<usize> = (0..s.len()).filter(|k| keep[*k]).collect();
        ensure!(!kept.is_empty(), ChainError::NoData("no baseline is long enough for the shortest that was asked for".into()));
        let (mut moments, mut times) = (Vec::new(), Vec::new());
        let mut end = 0;
        for (m, t) in s.moments().iter().zip(&self.times_jd) {
            let n = m.clone().filter(|k| keep[*k]).count();
            if n > 0 {
                moments.push(end..end + n);
                times.push(*t);
                end += n;
            }
        }
        let pick = |k: &usize| (s.pairs()[*k], s.vis()[*k], s.sigma()[*k]);
        let (pairs, (vis, sigma)) = kept.iter().map(pick).map(|(p, v, e)| (p, (v, e))).unzip();
        self.uv = kept.iter().map(|k| self.uv[*k]).collect();
        self.samples = Samples::new(s.n_ant(), pairs, (vis, sigma), moments)?;
        self.times_jd = times;
        Ok(())
    }
}

fn read(
    source: &mut dyn VisibilitySource,
    header: &VisibilityHeader,
    polarization: Polarization,
    observer: &dyn Observer,
) -> Result<(Vec<Datum>, DataCounts, usize)> {
    let selector = PolSelector::of(polarization, header)?;
    let (n_ant, n_chan) = (header.layout.n_ant(), header.spectrum.n_chan());
    let (mut data, mut counts, mut center) = (Vec::new(), DataCounts::default(), None);
    observer.event(Event::Phase { name: "reading", total: Some(source.n_rows() as u64), unit: "rows" });
    for_each_block(source, MemoryBudget::default().block(), |_, block| -> Result<()> {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        let c = &block.coverage;
        let (mut vis, mut weight) = (vec![Complex32::default(); n_chan], vec![0.0_f32; n_chan]);
        let own = selector.by_row(c)?;
        for row in 0..block.n_rows() {
            let (a, b) = (c.ant1[row] as usize, c.ant2[row] as usize);
            if a == b {
                continue;
            }
            ensure!(a.max(b) < n_ant, ChainError::Incompatible(format!("a row names antenna {}, the array has {n_ant}", a.max(b))));
            if *center.get_or_insert(c.phase_center[row]) != c.phase_center[row] {
                return Err(ChainError::Incompatible(
                    "the rows have several phase centres: split the set and image one field at a time".into(),
                ));
            }
            counts = counts.plus(selector.row(&block, (row, own.as_ref().map(|own| &own[row])), false, (&mut vis, &mut weight)));
            let turn = if a < b { 1.0 } else { -1.0 };
            for (chan, (v, w)) in vis.iter().zip(&weight).enumerate().filter(|(_, (_, w))| **w > 0.0) {
                data.push(Datum {
                    time_jd: c.time_jd[row],
                    chan: chan as u32,
                    pair: (a.min(b) as u32, a.max(b) as u32),
                    uvw: [0, 1, 2].map(|i| turn * c.uvw_m[(row, i)]),
                    vis: Complex64::new(f64::from(v.re), turn * f64::from(v.im)),
                    weight: f64::from(*w),
                });
            }
        }
        observer.event(Event::Advance(block.n_rows() as u64));
        Ok(())
    })?;
    observer.event(Event::Done);
    Ok((data, counts, usize::from(center.unwrap_or(0))))
}

/// Ends of the intervals over which data are averaged, Julian dates, in order.
fn intervals(data: &[Datum], average: Average) -> Result<Vec<f64>> {
    let mut times: Vec<f64> = data.iter().map(|d| d.time_jd).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let step = |w: &[f64]| (w[1] - w[0]) * DAY_S;
    let mut steps: Vec<f64> = times.windows(2).map(step).collect();
    steps.sort_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let longest_s = match average {
        Average::Integration => 0.0,
        Average::Time(t) => {
            need("average", t, t.si() > 0.0 && t.si().is_finite(), "a positive time, scan or none")?;
            t.si()
        }
        Average::Scans if steps.last().is_some_and(|last| *last > PAUSE * usual) => LONGEST_SCAN_S,
        Average::Scans => 0.0,
    };
    if longest_s == 0.0 {
        return Ok(times);
    }
    let mut ends = Vec::new();
    let mut first = 0;
    for k in 0..times.len() {
        let last_of_scan = k + 1 == times.len() || step(&times[k..k + 2]) > PAUSE * usual;
        if !last_of_scan {
            continue;
        }
        // Equal pieces, none longer than allowed.
        let span = (times[k] - times[first]) * DAY_S + usual;
        let pieces = (span / longest_s - 1e-6).ceil().max(1.0) as usize;
        let share = (times[k] - times[first] + usual / DAY_S) / pieces as f64;
        for piece in 1..pieces {
            let until = times[first] + share * piece as f64;
            let end = times[first..=k].partition_point(|t| *t < until - 0.01 * usual / DAY_S);
            if end > 0 {
                ends.push(times[first + end - 1]);
            }
        }
        ends.push(times[k]);
        first = k + 1;
    }
    ends.dedup();
    Ok(ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(seconds: &[f64]) -> Vec<Datum> {
        let datum = |s: &f64| Datum {
            time_jd: 2_457_850.0 + s / DAY_S,
            chan: 0,
            pair: (0, 1),
            uvw: [0.0; 3],
            vis: Complex64::new(1.0, 0.0),
            weight: 1.0,
        };
        seconds.iter().map(datum).collect()
    }

    fn ends(seconds: &[f64], average: Average) -> Vec<f64> {
        intervals(&at(seconds), average).unwrap().iter().map(|t| ((t - 2_457_850.0) * DAY_S).round()).collect()
    }

    #[test]
    fn pauses_end_scans_and_long_scans_are_cut() {
        let scan = |start: f64, n: usize| (0..n).map(move |k| start + 10.0 * k as f64);
        let two: Vec<f64> = scan(0.0, 30).chain(scan(1000.0, 30)).collect();
        assert_eq!(ends(&two, Average::Scans), [290.0, 1290.0]);
        assert_eq!(ends(&two, Average::Time(Duration(100.0))), [90.0, 190.0, 290.0, 1090.0, 1190.0, 1290.0]);
        assert_eq!(ends(&two, Average::Integration).len(), 60);
        let long: Vec<f64> = scan(0.0, 100).chain(scan(5000.0, 3)).collect();
        assert_eq!(ends(&long, Average::Scans), [490.0, 990.0, 5020.0]);
        let gapless: Vec<f64> = scan(0.0, 50).collect();
        assert_eq!(ends(&gapless, Average::Scans).len(), 50, "without pauses nothing says what a scan is");
        assert!(intervals(&at(&two), Average::Time(Duration(-1.0))).is_err());
    }
}

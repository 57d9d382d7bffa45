//! Pointing offsets of a whole set, and whether held-out baselines support them.

use super::basis::{OffsetBasis, Weights};
use super::data::{Products, Row, before_pattern, read};
use super::fit::{Fit, Problem, model};
use crate::calibrate::apply::ApplyOptions;
use crate::calibrate::held_out::{HeldOut, JudgeOptions, Prediction, Without};
use crate::calibrate::model::{ModelVisibilities, sees_unpolarized};
use crate::closure::{SolutionInterval, TimeBins};
use crate::mem::noise_from_hands;
use crate::progress::{Event, Observer};
use crate::simulate::SkyModel;
use crate::{ChainError, Result, ensure};
use cittert_arrays::pattern::{Pointing, Pointings};
use cittert_arrays::{UvCoverage, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, Array3};
use num_complex::{Complex, Complex64};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Whether pointings are solved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", command(next_help_heading = "Pointing"))]
pub struct PointingSolveOptions {
    /// Solve where the antennas point, from the calibrated data, the model (the given one, or the final image) and the pattern of the set.
    #[cfg_attr(feature = "cli", arg(long))]
    pub pointing: bool,
    /// Length of an interval in which the antennas hold still: a time, int (each integration) or inf (the whole set).
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME|int|inf", default_value_t = PointingSolveOptions::default().pointing_interval))]
    pub pointing_interval: SolutionInterval,
}

impl Default for PointingSolveOptions {
    fn default() -> Self {
        Self { pointing: false, pointing_interval: SolutionInterval::Infinite }
    }
}

/// Offsets of the antennas, and how they were judged.
#[derive(Debug, Clone, PartialEq)]
pub struct PointingReport {
    /// The offsets with their standard deviations.
    pub pointings: Pointings,
    /// Whether the held-out baselines support them; `None` where none could be held out.
    pub supported: Option<bool>,
    /// Misfit of the held-out baselines without offsets and with them.
    pub misfit: Option<[f64; 2]>,
    /// Standard deviations by which the offsets predict them better.
    pub sigmas: Option<f64>,
}

/// First reach of the polynomials, and the farthest, in widths of the pattern.
const REACH: [f64; 2] = [0.12, 0.6];
/// Offsets that nothing else tells are taken to be about so many widths of the pattern.
const PRIOR: f64 = 0.5;

/// Solve the pointing offsets of the antennas of calibrated data against a scene (before the pattern) or an image that contains the pattern.
///
/// Gains are fitted together with the offsets, so that neither is taken for the other, and left.
///
/// # Errors
/// Elements without a pattern, a scene that does not belong to the set, data that do not fit into the memory budget, or
/// [`ChainError::Cancelled`].
pub fn solve_pointings(
    data: &mut dyn VisibilitySource,
    sky: &SkyModel,
    interval: SolutionInterval,
    judging: &JudgeOptions,
    observer: &dyn Observer,
) -> Result<PointingReport> {
    let header = data.header().clone();
    let pattern = header.layout.pattern.clone();
    let none =
        "the set states no pattern of its elements, so its antennas cannot be told to point anywhere: give the pattern in the layout";
    ensure!(!pattern.is_none(), ChainError::Incompatible(none.into()));
    let width = pattern.solid_angle_sr(header.spectrum.mean_hz()).unwrap_or(1.0).sqrt();
    let sky = before_pattern(sky);
    let (rows, coverage) = read(data)?;
    let bins = bins(&rows, &coverage, interval)?;
    let n_ant = header.layout.n_ant();
    let mut reach = REACH[0] * width;
    let (basis, products, fits) = loop {
        let basis = OffsetBasis::new(reach).ok_or_else(|| ChainError::NoData("no polynomials of the offsets".into()))?;
        let products = Products::new(&header, (&pattern, &basis), &sky, &coverage, observer)?;
        let set = Setting { products: &products, basis: &basis, n_ant, prior_rad: PRIOR * width, bins: &bins };
        let fits = set.fits(&rows, true);
        let farthest = fits.iter().flat_map(|f| &f.offsets).flatten().fold(0.0_f64, |a, d| a.max(d.abs()));
        if farthest <= 0.95 * reach || reach >= REACH[1] * width {
            break (basis, products, fits);
        }
        reach = (2.5 * reach).min(REACH[1] * width);
    };
    let mut report = PointingReport { pointings: table(&rows, &bins, &fits), supported: None, misfit: None, sigmas: None };
    let Some(held) = HeldOut::draw(data, judging, 4)? else {
        observer.event(Event::Warning("too few baselines to hold some out: whether the pointing offsets are right is not known"));
        return Ok(report);
    };
    let hands = noise_from_hands(data)?;
    let noise = hands.factor.unwrap_or(if hands.weights_are_counts { 0.0 } else { 1.0 });
    let (seen, _) = read(&mut Without::new(data, Some(&held)))?;
    let set = Setting { products: &products, basis: &basis, n_ant, prior_rad: PRIOR * width, bins: &bins };
    let mut predict = |offsets: bool| {
        let fits = set.fits(&seen, offsets);
        let mut model = Pointed { setting: &set, rows: &rows, fits: &fits };
        Prediction::of(data, &held, &mut model, None, ApplyOptions::default(), noise)
    };
    let (before, after) = (predict(false)?, predict(true)?);
    let sigmas = after.better_than(&before);
    report.misfit = Some([before.misfit(), after.misfit()]);
    report.sigmas = Some(sigmas);
    report.supported = Some(sigmas >= judging.sigmas && after.misfit() < before.misfit());
    Ok(report)
}

/// The rows of each interval.
fn bins(rows: &[Row], coverage: &UvCoverage, interval: SolutionInterval) -> Result<Vec<Vec<usize>>> {
    let mut bins = TimeBins::new(interval);
    let mut found: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
    for (index, row) in rows.iter().enumerate() {
        found.entry(bins.key(row.time_jd, coverage.integration_s[index])?).or_default().push(index);
    }
    Ok(found.into_values().collect())
}

/// What the fits of all intervals share.
struct Setting<'a> {
    products: &'a Products,
    basis: &'a OffsetBasis,
    n_ant: usize,
    prior_rad: f64,
    bins: &'a [Vec<usize>],
}

impl Setting<'_> {
    fn fits(&self, rows: &[Row], offsets: bool) -> Vec<Fit> {
        let of = |members: &Vec<usize>| {
            let Self { products, basis, n_ant, prior_rad, .. } = *self;
            Problem { rows, members, products, basis, n_ant, prior_rad, offsets }.solve()
        };
        self.bins.iter().map(of).collect()
    }
}

/// The offsets as a table over time.
fn table(rows: &[Row], bins: &[Vec<usize>], fits: &[Fit]) -> Pointings {
    let middle = |members: &Vec<usize>| {
        let times = members.iter().map(|m| rows[*m].time_jd);
        let (first, last) = times.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
        0.5 * (first + last)
    };
    let n_ant = fits.first().map_or(0, |f| f.offsets.len());
    let at = |(time, ant): (usize, usize)| {
        let [l, m] = fits[time].offsets[ant];
        Pointing { l, m, width: 1.0 }
    };
    Pointings {
        time_jd: bins.iter().map(middle).collect(),
        antennas: Array2::from_shape_fn((fits.len(), n_ant), at),
        sigma_rad: Some(Array2::from_shape_fn((fits.len(), n_ant), |(time, ant)| fits[time].sigma[ant])),
    }
}

/// The model with gains and offsets.
struct Pointed<'a> {
    setting: &'a Setting<'a>,
    rows: &'a [Row],
    fits: &'a [Fit],
}

impl ModelVisibilities for Pointed<'_> {
    fn predict(&mut self, header: &VisibilityHeader, first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        let basis = self.setting.basis;
        let weights: Vec<Vec<Weights>> = self.fits.iter().map(|f| f.offsets.iter().map(|d| basis.at(*d)).collect()).collect();
        let mut bin_of = vec![0; self.rows.len()];
        self.setting.bins.iter().enumerate().for_each(|(k, members)| members.iter().for_each(|m| bin_of[*m] = k));
        let hands: Vec<bool> = header.polarizations.iter().map(|p| sees_unpolarized(*p)).collect();
        let mut out = Array3::zeros(header.shape(coverage.n_rows()));
        for row in 0..coverage.n_rows() {
            let index = first_row + row;
            let bin = bin_of[index];
            let [p, q] = self.rows[index].ants;
            let gain: Complex64 = self.fits[bin].gains[p] * self.fits[bin].gains[q].conj();
            for chan in 0..header.spectrum.n_chan() {
                let v = gain * model(self.setting.products, [&weights[bin][p], &weights[bin][q]], index, chan)[0];
                for pol in (0..hands.len()).filter(|p| hands[*p]) {
                    out[(row, chan, pol)] = Complex::new(v.re as f32, v.im as f32);
                }
            }
        }
        Ok(out)
    }
}

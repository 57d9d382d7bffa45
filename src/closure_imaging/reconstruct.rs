//! Rounds of imaging, from several starts, with the total flux of the largest likelihood of the amplitudes.

use super::amplitude_term::Amplitudes;
use super::closure_amplitude_term::ClosureAmplitudes;
use super::dft::SmallDft;
use super::field::{choose_grid, co_located, fitted_fwhm, gaussian, median, smoothed};
use super::gains::StationGains;
use super::gather::SparseSet;
use super::options::{ClosureImagingOptions, FluxFrom, Term};
use super::penalty::Penalty;
use super::phase_term::ClosurePhases;
use super::problem::Problem;
use super::samples::Samples;
use super::station_term::StationAmplitudes;
use crate::closure::ClosureSet;
use crate::lbfgs::{Limits, minimise};
use crate::misfit::{Visibilities, VisibilityTerm};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{SkyFrame, SkyGrid};
use ndarray::Array2;
use num_complex::{Complex32, Complex64};
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use std::time::Instant;

/// How well one kind of data is explained.
#[derive(Debug, Clone, PartialEq)]
pub struct TermMisfit {
    /// Name of the kind of data.
    pub name: &'static str,
    /// Independent data.
    pub data: usize,
    /// Chi squared over their number.
    pub chi2_per_datum: f64,
}

/// How one start ended.
#[derive(Debug, Clone, PartialEq)]
pub struct StartRecord {
    /// The objective at the end.
    pub value: f64,
    /// Evaluations of all terms.
    pub evaluations: usize,
    /// Normalised cross-correlation of its image with that of the best start, at the best shift by whole cells.
    pub correlation: f64,
}

/// The result of closure imaging.
#[derive(Debug, Clone)]
pub struct ClosureImage {
    /// Where the cells are.
    pub grid: SkyGrid,
    /// The image of the best start, flux a cell \[m, l\].
    pub model: Array2<f64>,
    /// The residual image after calibration against the model, with natural weights, flux per beam \[m, l\].
    pub residual: Array2<f64>,
    /// Standard deviation over the images of several starts \[m, l\], each shifted by whole cells onto the best.
    pub spread: Option<Array2<f64>>,
    /// 1 / (longest baseline), rad.
    pub resolution_rad: f64,
    /// Width of the prior, rad.
    pub prior_fwhm_rad: f64,
    /// Total flux to which the image is constrained.
    pub flux: f64,
    /// Fluxes that were tried. The second number is twice the negative log likelihood of the amplitudes per datum, except for a constant.
    pub fluxes_tried: Vec<(f64, f64)>,
    /// The flux that the co-located antennas measure, if the array has any.
    pub total_flux: Option<f64>,
    /// Misfits of all terms, including terms that were not selected.
    pub misfits: Vec<TermMisfit>,
    /// Standard deviations of the log gains \[antenna\].
    pub gain_sigma: Vec<f64>,
    /// Gains against the model.
    pub gains: StationGains,
    /// The starts, the first from the prior.
    pub starts: Vec<StartRecord>,
    /// Index of the best.
    pub best: usize,
    /// Data that were imaged.
    pub n_vis: usize,
    /// Number of evaluations of all terms in all runs. Each takes one pair of transforms.
    pub evaluations: usize,
    /// Seconds for the flux and for the images.
    pub seconds: [f64; 2],
}

/// Image a set from its closure quantities and amplitudes.
///
/// Each round minimises the sum of the weighted chi squared per datum and of the penalties over ln I. It starts from the image of the last
/// round, smoothed to the resolution. Between rounds the gain errors are estimated. If complex visibilities are among the terms, the data
/// are then self-calibrated against the image and added to the terms.
///
/// # Errors
/// An option is out of range, the data have no triangles or quadrangles although a term needs them, or an image is not finite.
///
/// # Reference
/// Chael et al. 2018, ApJ 857, 23; EHT Collaboration 2019, ApJL 875, L4, sect. 6.2.2.
pub fn reconstruct(set: &SparseSet, frame: SkyFrame, options: &ClosureImagingOptions, observer: &dyn Observer) -> Result<ClosureImage> {
    options.check()?;
    let mut set = set.clone();
    if options.uv_min_wl > 0.0 {
        let keep: Vec<bool> = set.lengths_wl().iter().map(|l| *l >= options.uv_min_wl).collect();
        set.retain(&keep)?;
    }
    let tuning = &options.tuning;
    let short = co_located(&set, tuning);
    let grid = choose_grid(&set, &short, frame, options, observer)?;
    let lengths = set.lengths_wl();
    let resolution_rad = 1.0 / lengths.iter().fold(0.0_f64, |a, l| a.max(*l));
    let total_flux = median(short.iter().zip(set.samples.vis()).filter(|(s, _)| **s).map(|(_, v)| v.norm()).collect());
    let prior_fwhm_rad = options.prior_fwhm.map(|a| a.si()).unwrap_or_else(|| {
        let fitted = fitted_fwhm(&set, &short).unwrap_or(tuning.usual_prior * resolution_rad);
        fitted.clamp(tuning.least_prior * resolution_rad, tuning.largest_prior * resolution_rad)
    });
    let transform = SmallDft::new(&grid, &set.uv);
    let field = Field { set: &set, short: &short, grid: &grid, transform: &transform, options, total_flux, prior_fwhm_rad, resolution_rad };
    let clock = Instant::now();
    let likelihood = options.flux == FluxFrom::Likelihood;
    let trials = if likelihood { field.try_fluxes(&lengths)? } else { Vec::new() };
    let fluxes_tried: Vec<(f64, f64)> = trials.iter().map(|t| (t.flux, t.misfit)).collect();
    let flux = match options.flux {
        FluxFrom::Given(f) => f,
        FluxFrom::Likelihood => likeliest(&fluxes_tried)?,
    };
    let trial_evaluations: usize = trials.iter().map(|t| t.evaluations).sum();
    let seconds_flux = clock.elapsed().as_secs_f64();
    ensure!(!observer.cancelled(), ChainError::Cancelled);
    let clock = Instant::now();
    observer.event(Event::Phase { name: "closure imaging", total: Some(options.starts as u64), unit: "starts" });
    let length = Length { rounds: options.rounds, iterations: options.iterations, selfcal_rounds: options.selfcal_rounds };
    let run = |start: usize| {
        let run = field.run(flux, start, length);
        observer.event(Event::Advance(1));
        run
    };
    let runs: Vec<Run> = (0..options.starts).into_par_iter().map(run).collect::<Result<_>>()?;
    observer.event(Event::Done);
    let Some(best) = (0..runs.len()).min_by(|a, b| runs[*a].value.total_cmp(&runs[*b].value)) else {
        return Err(ChainError::NoData("closure imaging made no run".into()));
    };
    let (gains, residual) = field.calibrated(&runs[best])?;
    let shape = (grid.n_m, grid.n_l);
    // Closure quantities do not determine the position, so images are compared at the shift where they match best.
    let aligned: Vec<(f64, Vec<f64>)> = runs.iter().map(|r| align(&r.image, &runs[best].image, grid.n_l)).collect();
    let starts = runs.iter().zip(&aligned).map(|(r, (correlation, _))| StartRecord {
        value: r.value,
        evaluations: r.evaluations,
        correlation: *correlation,
    });
    let image = ClosureImage {
        model: plane(shape, runs[best].image.clone())?,
        residual: plane(shape, residual)?,
        spread: if runs.len() > 1 { Some(plane(shape, deviation(&aligned))?) } else { None },
        resolution_rad,
        prior_fwhm_rad,
        flux,
        total_flux,
        misfits: field.misfits(&runs[best], &gains)?,
        gain_sigma: runs[best].station.gain_sigma().to_vec(),
        gains,
        best,
        n_vis: set.samples.len(),
        evaluations: trial_evaluations + runs.iter().map(|r| r.evaluations).sum::<usize>(),
        starts: starts.collect(),
        fluxes_tried,
        seconds: [seconds_flux, clock.elapsed().as_secs_f64()],
        grid,
    };
    let finite = image.model.iter().all(|v| v.is_finite());
    ensure!(finite, ChainError::NoData("the image is not finite: are the errors of the data right?".into()));
    Ok(image)
}

/// The flux at the minimum of a parabola in ln flux, through the best of the tried fluxes and its two neighbours.
fn likeliest(tried: &[(f64, f64)]) -> Result<f64> {
    let Some(best) = (0..tried.len()).min_by(|a, b| tried[*a].1.total_cmp(&tried[*b].1)) else {
        return Err(ChainError::NoData("no total flux was tried".into()));
    };
    if best == 0 || best + 1 == tried.len() {
        return Ok(tried[best].0);
    }
    let at = |k: usize| (tried[k].0.ln(), tried[k].1);
    let ((x0, y0), (x1, y1), (x2, y2)) = (at(best - 1), at(best), at(best + 1));
    let (a, b) = ((x1 - x0) * (y1 - y2), (x1 - x2) * (y1 - y0));
    Ok((x1 - 0.5 * ((x1 - x0) * a - (x1 - x2) * b) / (a - b)).exp())
}

fn plane(shape: (usize, usize), data: Vec<f64>) -> Result<Array2<f64>> {
    let n = data.len();
    Array2::from_shape_vec(shape, data)
        .map_err(|_| ChainError::Incompatible(format!("an image of {n} cells, expected {} rows of {}", shape.0, shape.1)))
}

/// An image, shifted by whole cells to the best match with another image, and the normalised cross-correlation of the two.
fn align(image: &[f64], other: &[f64], n_l: usize) -> (f64, Vec<f64>) {
    let (nx, ny) = (n_l as isize, (image.len() / n_l) as isize);
    let moved = |dx: isize, dy: isize| -> Vec<f64> {
        let at = |i: isize| (i % nx + dx, i / nx + dy);
        let inside = |(c, r): (isize, isize)| (0..nx).contains(&c) && (0..ny).contains(&r);
        (0..nx * ny).map(|i| if inside(at(i)) { image[(at(i).1 * nx + at(i).0) as usize] } else { 0.0 }).collect()
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let norm = (dot(image, image) * dot(other, other)).sqrt();
    let (mut best, mut shifted) = (f64::NEG_INFINITY, image.to_vec());
    for dy in -ny / 4..=ny / 4 {
        for dx in -nx / 4..=nx / 4 {
            let candidate = moved(dx, dy);
            let r = dot(&candidate, other) / norm;
            if r > best {
                (best, shifted) = (r, candidate);
            }
        }
    }
    (best, shifted)
}

/// Standard deviation of each cell over the images.
fn deviation(aligned: &[(f64, Vec<f64>)]) -> Vec<f64> {
    let n = aligned.len() as f64;
    let at = |i: usize| {
        let mean = aligned.iter().map(|(_, a)| a[i]).sum::<f64>() / n;
        (aligned.iter().map(|(_, a)| (a[i] - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt()
    };
    (0..aligned[0].1.len()).map(at).collect()
}

/// One run of imaging.
struct Run {
    image: Vec<f64>,
    value: f64,
    evaluations: usize,
    station: StationAmplitudes,
    samples: Samples,
}

/// How long a run is.
#[derive(Clone, Copy)]
struct Length {
    rounds: usize,
    iterations: usize,
    selfcal_rounds: usize,
}

/// The trial of a total flux.
struct FluxTrial {
    flux: f64,
    /// Twice the negative log likelihood of the amplitudes a datum, to a constant.
    misfit: f64,
    evaluations: usize,
}

/// The data and options that all runs share.
struct Field<'a> {
    set: &'a SparseSet,
    short: &'a [bool],
    grid: &'a SkyGrid,
    transform: &'a SmallDft,
    options: &'a ClosureImagingOptions,
    total_flux: Option<f64>,
    prior_fwhm_rad: f64,
    resolution_rad: f64,
}

impl Field<'_> {
    /// The data with the visibilities of co-located antennas scaled to the flux of the image. The rest of their flux is on scales beyond it.
    fn samples(&self, flux: f64) -> Samples {
        let mut samples = self.set.samples.clone();
        if let Some(total) = self.total_flux {
            samples.scale(self.short, flux / total);
        }
        samples
    }

    /// Likelihood of the amplitudes for some total fluxes, at the end of short runs.
    fn try_fluxes(&self, lengths: &[f64]) -> Result<Vec<FluxTrial>> {
        let tuning = &self.options.tuning;
        let (top, parts) = match self.total_flux {
            Some(total) => (total, tuning.fluxes),
            None => {
                // No baseline measures the total flux: it is at least that of the shortest baselines.
                let mut order: Vec<usize> = (0..lengths.len()).collect();
                order.sort_by(|a, b| lengths[*a].total_cmp(&lengths[*b]));
                let shortest = order.iter().take(lengths.len().div_ceil(10)).map(|k| self.set.samples.vis()[*k].norm()).collect();
                let Some(flux) = median(shortest) else {
                    return Err(ChainError::NoData("no visibility is left to estimate the flux from".into()));
                };
                (flux, tuning.fluxes.map(|f| 1.0 / f))
            }
        };
        let likelihood = |part: f64| {
            let length = Length { rounds: tuning.trial_rounds, iterations: tuning.trial_iterations, selfcal_rounds: 0 };
            let run = self.run(top * part, 0, length)?;
            let vis = self.transform.forward(&run.image);
            let chi2 = run.station.add(&vis, 0.0, &mut vec![Complex64::default(); vis.len()]);
            // The scaling of the short baselines scales their errors too. The likelihood is that of the logarithms, whose errors do not
            // change.
            let misfit = chi2 / run.station.data() as f64 + run.station.log_determinant();
            Ok(FluxTrial { flux: top * part, misfit, evaluations: run.evaluations })
        };
        parts.into_par_iter().map(likelihood).collect()
    }

    /// The first image of a run: the prior, or a random image like it.
    fn first(&self, prior: &[f64], start: usize) -> Vec<f64> {
        if start == 0 {
            return prior.to_vec();
        }
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(self.options.seed.wrapping_add(start as u64));
        let noisy: Vec<f64> = prior.iter().map(|p| -p * (1.0 - rng.random::<f64>()).ln()).collect();
        let noisy = self.smoothed(&noisy);
        let (sum, flux) = (noisy.iter().sum::<f64>(), prior.iter().sum::<f64>());
        noisy.into_iter().map(|v| v * flux / sum).collect()
    }

    fn smoothed(&self, image: &[f64]) -> Vec<f64> {
        smoothed(image, (self.grid.n_l, self.grid.n_m), self.resolution_rad / self.grid.cell_rad)
    }

    /// Several rounds from one start.
    fn run(&self, flux: f64, start: usize, length: Length) -> Result<Run> {
        let (o, Length { rounds, iterations, selfcal_rounds }) = (self.options, length);
        let samples = self.samples(flux);
        let all = vec![true; samples.len()];
        let resolving: Vec<bool> = self.short.iter().map(|s| !s).collect();
        let floor = vec![o.gain_error; samples.n_ant()];
        let mut station = StationAmplitudes::new(&samples, &all, &floor)?;
        let wanted = |term: Term| o.weight(term) > 0.0;
        let phases = wanted(Term::ClosurePhase).then(|| ClosurePhases::new(&samples, &resolving, o.set)).transpose()?;
        let closures = wanted(Term::LogClosureAmplitude).then(|| ClosureAmplitudes::new(&samples, &all, o.set)).transpose()?;
        let calibrated = (wanted(Term::Amplitude) && o.gain_error == 0.0).then(|| Amplitudes::new(&samples, &all, 0.0)).transpose()?;
        let penalty = Penalty {
            weights: o.penalty,
            prior: gaussian(self.grid, self.prior_fwhm_rad, flux),
            flux,
            shape: (self.grid.n_l, self.grid.n_m),
            cells: self.resolution_rad / self.grid.cell_rad,
        };
        let mut image = self.first(&penalty.prior, start);
        let (mut evaluations, mut value) = (0, f64::INFINITY);
        let selfcal_rounds = if wanted(Term::Visibility) { selfcal_rounds } else { 0 };
        for round in 0..rounds + selfcal_rounds {
            let complex = if round < rounds {
                None
            } else {
                let vis = self.transform.forward(&image);
                let gains = StationGains::solve(&samples, &vis, Some(&station.gains(&vis)));
                let (vis, sigma) = gains.corrected(&samples)?;
                let weight = sigma.iter().map(|s| (1.0 / (s * s)) as f32).collect();
                Some(Visibilities::new(vis.iter().map(|v| Complex32::new(v.re as f32, v.im as f32)).collect(), weight)?)
            };
            let mut terms: Vec<(f64, &dyn VisibilityTerm)> = Vec::new();
            match &calibrated {
                Some(term) => terms.push((o.weight(Term::Amplitude), term)),
                None if wanted(Term::Amplitude) => terms.push((o.weight(Term::Amplitude), &station)),
                None => {}
            }
            terms.extend(phases.iter().map(|term| (o.weight(Term::ClosurePhase), term as _)));
            terms.extend(closures.iter().map(|term| (o.weight(Term::LogClosureAmplitude), term as _)));
            terms.extend(complex.iter().map(|term| (o.weight(Term::Visibility), term as _)));
            let problem = Problem { transform: self.transform, terms, penalty: &penalty };
            let from = if round == 0 { image } else { self.smoothed(&image) };
            let dark = 1e-10 * from.iter().fold(0.0_f64, |a, v| a.max(*v));
            let x = from.iter().map(|v| v.max(dark).ln()).collect();
            let limits = Limits { iterations, decrease: o.tuning.decrease };
            let found = minimise(x, limits, &mut |x, g| problem.value(x, g));
            evaluations += found.evaluations;
            value = found.value;
            image = found.x.iter().map(|x| x.exp()).collect();
            let vis = self.transform.forward(&image);
            if !o.fixed_gain_error && round + 1 < rounds {
                station.learn_gain_sigma(&vis, &floor)?;
            }
        }
        Ok(Run { image, value, evaluations, station, samples })
    }

    /// The gains that are solved against the image of a run, and the dirty image of the residual.
    fn calibrated(&self, run: &Run) -> Result<(StationGains, Vec<f64>)> {
        let vis = self.transform.forward(&run.image);
        let gains = StationGains::solve(&run.samples, &vis, Some(&run.station.gains(&vis)));
        let (corrected, sigma) = gains.corrected(&run.samples)?;
        let weight: Vec<f64> = sigma.iter().map(|s| 1.0 / (s * s)).collect();
        let total: f64 = weight.iter().sum();
        let left: Vec<Complex64> = corrected.iter().zip(&vis).zip(&weight).map(|((v, m), w)| (v - m) * (w / total)).collect();
        Ok((gains, self.transform.adjoint(&left)))
    }

    /// Misfits of the image of a run, on minimal sets.
    fn misfits(&self, run: &Run, gains: &StationGains) -> Result<Vec<TermMisfit>> {
        let vis = self.transform.forward(&run.image);
        let all = vec![true; run.samples.len()];
        let resolving: Vec<bool> = self.short.iter().map(|s| !s).collect();
        let each = |name: &'static str, term: &dyn VisibilityTerm| {
            let chi2 = term.add(&vis, 0.0, &mut vec![Complex64::default(); vis.len()]);
            TermMisfit { name, data: term.data(), chi2_per_datum: chi2 / term.data().max(1) as f64 }
        };
        let mut out = vec![each("amplitudes, gains integrated out", &run.station)];
        // Three antennas have no closure amplitudes, and two antennas have no closure phases either. These lines are then left out.
        let phases = ClosurePhases::new(&run.samples, &resolving, ClosureSet::Minimal).map(|term| each("closure phases", &term));
        let amplitudes = ClosureAmplitudes::new(&run.samples, &all, ClosureSet::Minimal).map(|term| each("log closure amplitudes", &term));
        for found in [phases, amplitudes] {
            match found {
                Ok(misfit) => out.push(misfit),
                Err(ChainError::NoData(_)) => {}
                Err(e) => return Err(e),
            }
        }
        let (corrected, sigma) = gains.corrected(&run.samples)?;
        let chi2: f64 = corrected.iter().zip(&vis).zip(&sigma).map(|((v, m), s)| (v - m).norm_sqr() / (s * s)).sum();
        let n = 2 * corrected.len();
        out.push(TermMisfit { name: "visibilities, self-calibrated", data: n, chi2_per_datum: chi2 / n as f64 });
        Ok(out)
    }
}

//! Multiscale CLEAN: components of several widths.
//!
//! The residual is smoothed with each scale. A component of scale s at its peak R takes R^2 / B from chi squared, where B is the peak of
//! the beam smoothed twice with s; the scale for which R / sqrt(B), weighed by the bias, is largest takes components. (Cornwell compares
//! R / B, the flux of the component, which favours wide scales for points too.) These are found by the exact algorithm of [`super::hogbom`] in the residual smoothed with the scale, with the beam smoothed
//! twice, until that peak has come down by a fixed part. The pattern of wide components found so is then given the amplitude that leaves
//! the least residual (a line search, which the gain would take many rounds to reach), the residual is brought up to date by
//! convolution, and the scales compete again.
//!
//! # Reference
//! Cornwell 2008, IEEE JSTSP 2, 793 (scales, their shape, the bias); Offringa & Smirnov 2017, MNRAS 471, 301 (the inner loop at one scale).

use super::hogbom::components;
use super::tiles::TiledBeam;
use super::{CleanOptions, Component, DIVERGED, Deconvolver, Minor, MinorLimits, MinorReport, MinorStop, check_beam, check_cycle, peak_of};
use crate::fourier::{Convolver, Spectrum};
use crate::{ChainError, Result};
use ndarray::{Array2, ArrayView2};

/// Part of its peak that a scale keeps when it hands over.
const HAND_OVER: f64 = 0.75;

struct Scale {
    width_px: f64,
    bias: f64,
    /// Spectrum of the kernel of sum 1; none for points.
    kernel: Option<Spectrum<f64>>,
    /// Beam smoothed twice, with its peak divided out.
    beam: TiledBeam,
    /// That peak.
    peak: f64,
}

struct Multiscale {
    beam: TiledBeam,
    convolver: Convolver<f64>,
    scales: Vec<Scale>,
}

/// The kernel of a scale: a paraboloid with a soft edge at `width_px` from the centre, sum 1 \[m, l\].
fn kernel((n_m, n_l): (usize, usize), width_px: f64) -> Array2<f64> {
    let mut k = Array2::from_shape_fn((n_m, n_l), |(i, j)| {
        let (y, x) = (i as f64 - (n_m / 2) as f64, j as f64 - (n_l / 2) as f64);
        let r = x.hypot(y) / width_px;
        // The cosine takes the edge to zero with zero slope, so that the smoothed beam has no ringing.
        if r < 1.0 { (1.0 - r * r) * (0.5 + 0.5 * (std::f64::consts::PI * r).cos()) } else { 0.0 }
    });
    let sum = k.sum();
    k /= sum;
    k
}

/// Points, then twice the main lobe and on by factors of two up to nearly half of the image.
fn chosen(beam_px: f64, smallest_side: usize) -> Vec<f64> {
    let mut scales = vec![0.0];
    let mut width = 2.0 * beam_px.max(1.0);
    let largest = 0.43 * smallest_side as f64;
    while width < largest {
        scales.push(width);
        width *= 2.0;
    }
    if largest > 1.0 {
        scales.push(largest);
    }
    scales
}

pub(super) fn make(psf: ArrayView2<'_, f64>, opts: &CleanOptions, beam_px: f64) -> Result<Box<dyn Deconvolver>> {
    check_beam(psf)?;
    let (n_m, n_l) = psf.dim();
    let most = n_m.min(n_l) as f64 / 2.0;
    let widths = if opts.scales.is_empty() { chosen(beam_px, n_m.min(n_l)) } else { opts.scales.clone() };
    let bad = |option, value: f64, expected: String| Err(ChainError::BadOption { option, value: value.to_string(), expected });
    if let Some(w) = widths.iter().find(|w| !(**w >= 0.0 && **w <= most)) {
        return bad("scales", *w, format!("0 to half the image ({most} pixels)"));
    }
    if !(0.0..1.0).contains(&opts.scale_bias) {
        return bad("scale-bias", opts.scale_bias, "0 to below 1".into());
    }
    let largest = widths.iter().copied().fold(1.0, f64::max);
    let convolver = Convolver::<f64>::new((n_m, n_l), n_m.max(n_l) / 2 + 1);
    let scales = widths.iter().filter_map(|width_px| {
        let bias = 1.0 - opts.scale_bias * width_px / largest;
        if *width_px < 1.0 {
            return Some(Scale { width_px: 0.0, bias, kernel: None, beam: TiledBeam::new(psf), peak: 1.0 });
        }
        let spectrum = convolver.kernel(kernel((n_m, n_l), *width_px).view());
        let once = convolver.convolve(psf, &spectrum);
        let twice = convolver.convolve(once.view(), &spectrum);
        let peak = twice[(n_m / 2, n_l / 2)];
        // A scale that the baselines do not see has no peak of its own: its components would be made of side lobes.
        let seen = twice.iter().all(|v| v.abs() <= peak);
        seen.then(|| Scale { width_px: *width_px, bias, kernel: Some(spectrum), beam: TiledBeam::new((twice / peak).view()), peak })
    });
    let scales: Vec<Scale> = scales.collect();
    if scales.is_empty() {
        return bad("scales", f64::NAN, "at least one scale that the baselines see; 0 always is".into());
    }
    Ok(Box::new(Multiscale { beam: TiledBeam::new(psf), convolver, scales }))
}

/// The length of the step along `added` that leaves the smallest chi squared, where `seen` is `added` seen with the beam: at least 1, and at
/// most what a gain of 1 would have taken. The gain keeps wide components from taking what belongs to others; once the pattern of
/// them is found, its amplitude is no longer in doubt.
fn stretch(residual: &Array2<f64>, added: &Array2<f64>, seen: &Array2<f64>, gain: f64) -> f64 {
    let along: f64 = added.iter().zip(residual).map(|(a, r)| a * r).sum();
    let across: f64 = added.iter().zip(seen).map(|(a, s)| a * s).sum();
    if across > 0.0 && along > 0.0 { (along / across).clamp(1.0, 1.0 / gain) } else { 1.0 }
}

impl Multiscale {
    fn smoothed(&self, residual: &Array2<f64>, scale: &Scale) -> Array2<f64> {
        scale.kernel.as_ref().map_or_else(|| residual.clone(), |k| self.convolver.convolve(residual.view(), k))
    }

    /// The scale that takes the next components: its index, the smoothed residual and its peak.
    fn strongest(
        &self,
        residual: &Array2<f64>,
        mask: Option<&Array2<bool>>,
        (negative, alive): (bool, &[bool]),
    ) -> Option<(usize, Array2<f64>, f64)> {
        let mut best = None;
        let mut most = 0.0;
        for (k, scale) in self.scales.iter().enumerate().filter(|(k, _)| alive[*k]) {
            let smoothed = self.smoothed(residual, scale);
            if let Some((value, _)) = peak_of(smoothed.view(), mask, negative) {
                let size = value.abs();
                let worth = size / scale.peak.sqrt() * scale.bias;
                if worth > most {
                    most = worth;
                    best = Some((k, smoothed, size));
                }
            }
        }
        best
    }
}

impl Deconvolver for Multiscale {
    fn minor(&mut self, cycle: Minor<'_>) -> Result<MinorReport> {
        check_cycle(&cycle, self.beam.shape())?;
        let Minor { residual, model, mask, limits } = cycle;
        let size_of = |r: &Array2<f64>| peak_of(r.view(), mask, limits.negative).map_or(0.0, |p| p.0.abs());
        let mut taken: Vec<Component> = Vec::new();
        // Scales that have not made things worse in this cycle.
        let mut alive = vec![true; self.scales.len()];
        let mut peak = size_of(residual);
        let mut least = peak;
        let stop = loop {
            if peak == 0.0 {
                break MinorStop::Nothing;
            }
            if peak <= limits.level {
                break MinorStop::Level;
            }
            if taken.len() >= limits.iterations {
                break MinorStop::Iterations;
            }
            let Some((k, mut smoothed, top)) = self.strongest(residual, mask, (limits.negative, &alive)) else { break MinorStop::Diverged };
            let scale = &self.scales[k];
            let inner = MinorLimits { level: HAND_OVER * top, iterations: limits.iterations - taken.len(), ..limits };
            let mut found = components(&scale.beam, &mut smoothed, mask, &inner).components;
            if found.is_empty() {
                alive[k] = false;
                continue;
            }
            let mut flux = Array2::zeros(residual.dim());
            for c in &mut found {
                c.flux /= scale.peak;
                c.scale_px = scale.width_px;
                flux[(c.row, c.column)] += c.flux;
            }
            let mut added = self.smoothed(&flux, scale);
            let seen = self.beam.convolve(added.view());
            let mut next = &*residual - &seen;
            let mut after = size_of(&next);
            let stretch = if scale.kernel.is_some() { stretch(residual, &added, &seen, limits.gain) } else { 1.0 };
            let longer = &*residual - &(&seen * stretch);
            let peak_longer = size_of(&longer);
            // The least chi squared may still leave a much higher peak: then the gain had better be kept.
            if peak_longer <= after.max(DIVERGED * least) {
                (next, after) = (longer, peak_longer);
                added *= stretch;
                found.iter_mut().for_each(|c| c.flux *= stretch);
            }
            if !(after <= DIVERGED * least) {
                alive[k] = false;
                continue;
            }
            *residual = next;
            *model += &added;
            taken.extend(found);
            peak = after;
            least = least.min(after);
        };
        Ok(MinorReport { iterations: taken.len(), peak, stop, components: taken })
    }
}

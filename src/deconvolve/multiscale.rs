//! Multiscale CLEAN: components of several widths.
//!
//! The residual is smoothed with each scale. Let R be the peak of the residual smoothed with a scale, and B the peak of the beam smoothed
//! twice with it. A component of this scale lowers chi squared by R^2 / B. The scale with the largest R / sqrt(B), multiplied by the bias,
//! takes the next components. (Cornwell compares R / B, the flux of the component, which prefers wide scales for points too.)
//!
//! The components are found by the exact algorithm of [`super::hogbom`], in the residual smoothed with the scale and with the beam smoothed
//! twice, until the peak has decreased to a fixed fraction. Wide components then form a pattern. A line search scales the pattern to the
//! amplitude with the smallest residual, which would otherwise take many rounds because of the loop gain. The residual is updated by
//! convolution, and the scales are compared again.
//!
//! A scale whose spectrum lies mostly in the hole of the u-v plane, at baselines shorter than those of the array, is left out: its components would be
//! fitted by the small rest of their spectrum, and what they add in the hole grows without limit.
//!
//! # Reference
//! Cornwell 2008, IEEE JSTSP 2, 793 (scales, their shape, the bias); Offringa & Smirnov 2017, MNRAS 471, 301 (the inner loop at one scale).

use super::hogbom::components;
use super::minor::{Component, Deconvolver, Minor, MinorLimits, MinorReport, MinorStop, Scales, check_beam, check_cycle, peak_size};
use super::tiles::TiledBeam;
use super::tuning::CleanTuning;
use crate::fourier::{Convolver, Spectrum};
use crate::values::need;
use crate::{ChainError, Result};
use ndarray::{Array2, ArrayView2};

struct Scale {
    width_px: f64,
    bias: f64,
    /// Spectrum of the kernel, whose sum is 1; none for points.
    kernel: Option<Spectrum<f64>>,
    /// The beam smoothed twice with the kernel, divided by its peak.
    beam: TiledBeam,
    /// The peak of the beam smoothed twice.
    peak: f64,
}

struct Multiscale {
    beam: TiledBeam,
    convolver: Convolver<f64>,
    scales: Vec<Scale>,
    tuning: CleanTuning,
}

/// The scale that takes the next components.
struct Strongest {
    index: usize,
    smoothed: Array2<f64>,
    peak: f64,
}

/// The kernel of a scale \[m, l\]: a paraboloid with a soft edge at `width_px` from the centre and a sum of 1.
fn kernel((n_m, n_l): (usize, usize), width_px: f64) -> Array2<f64> {
    let mut k = Array2::from_shape_fn((n_m, n_l), |(i, j)| {
        let (y, x) = (i as f64 - (n_m / 2) as f64, j as f64 - (n_l / 2) as f64);
        let r = x.hypot(y) / width_px;
        // The cosine gives the edge a slope of zero, so that the smoothed beam does not ring.
        if r < 1.0 { (1.0 - r * r) * (0.5 + 0.5 * (std::f64::consts::PI * r).cos()) } else { 0.0 }
    });
    let sum = k.sum();
    k /= sum;
    k
}

/// The scales in pixels for an image with this shorter side: points, then multiples of the main lobe up to nearly half of the image.
fn chosen(opts: &Scales, tuning: &CleanTuning, shorter_side: usize) -> Vec<f64> {
    let mut scales = vec![0.0];
    let mut width = tuning.first_scale * opts.beam_px.max(1.0);
    let largest = tuning.largest_scale * shorter_side as f64;
    while width < largest {
        scales.push(width);
        width *= tuning.scale_ratio;
    }
    if largest > 1.0 {
        scales.push(largest);
    }
    scales
}

pub(super) fn make(psf: ArrayView2<'_, f64>, opts: &Scales, tuning: &CleanTuning) -> Result<Box<dyn Deconvolver>> {
    check_beam(psf)?;
    let (n_m, n_l) = psf.dim();
    let most = n_m.min(n_l) as f64 / 2.0;
    let widths = if opts.widths_px.is_empty() { chosen(opts, tuning, n_m.min(n_l)) } else { opts.widths_px.clone() };
    if let Some(w) = widths.iter().find(|w| !(**w >= 0.0 && **w <= most)) {
        return Err(ChainError::bad_option("scales", w, format!("0 to half the image ({most} pixels)")));
    }
    need("scale-bias", opts.bias, (0.0..1.0).contains(&opts.bias), "0 to below 1")?;
    let largest = widths.iter().copied().fold(1.0, f64::max);
    let convolver = Convolver::<f64>::new((n_m, n_l), n_m.max(n_l) / 2 + 1);
    let hole = Hole::of(&convolver, psf, tuning.hole_edge);
    let scales = widths.iter().filter_map(|width_px| {
        let bias = 1.0 - opts.bias * width_px / largest;
        if *width_px < 1.0 {
            return Some(Scale { width_px: 0.0, bias, kernel: None, beam: TiledBeam::new(psf), peak: 1.0 });
        }
        let spectrum = convolver.kernel(kernel((n_m, n_l), *width_px).view());
        if hole.power_outside(&convolver, &spectrum) < tuning.least_measured {
            return None;
        }
        let once = convolver.convolve(psf, &spectrum);
        let twice = convolver.convolve(once.view(), &spectrum);
        let peak = twice[(n_m / 2, n_l / 2)];
        // The baselines do not measure a scale whose smoothed beam is not largest at its centre. Its components would be fitted to side lobes.
        let seen = twice.iter().all(|v| v.abs() <= peak);
        seen.then(|| Scale { width_px: *width_px, bias, kernel: Some(spectrum), beam: TiledBeam::new((twice / peak).view()), peak })
    });
    let scales: Vec<Scale> = scales.collect();
    let expected = "at least one scale that the baselines measure; they always measure scale 0";
    need("scales_px", format!("{widths:?}"), !scales.is_empty(), expected)?;
    Ok(Box::new(Multiscale { beam: TiledBeam::new(psf), convolver, scales, tuning: *tuning }))
}

/// The hole in the middle of the u-v plane: the baselines that are shorter than the shortest ones of the array.
struct Hole {
    /// Its radius, cycles a pixel.
    radius: f64,
}

/// Radii of the values of a half spectrum, cycles a pixel, with the number of times that each value occurs in the whole spectrum.
fn radii((p_m, p_l): (usize, usize)) -> impl Iterator<Item = (f64, f64)> {
    (0..=p_l / 2).flat_map(move |u| {
        let twice = if u == 0 || 2 * u == p_l { 1.0 } else { 2.0 };
        (0..p_m).map(move |v| ((u as f64 / p_l as f64).hypot(v.min(p_m - v) as f64 / p_m as f64), twice))
    })
}

impl Hole {
    /// The hole ends at the first ring of the u-v plane whose mean weight is `edge` times that of the ring with the largest mean. A ring is as wide
    /// as the resolution of the beam in the u-v plane, one over the size of the image.
    fn of(convolver: &Convolver<f64>, psf: ArrayView2<'_, f64>, edge: f64) -> Self {
        let n = psf.nrows().min(psf.ncols());
        let mut rings = vec![(0.0, 0.0); n];
        for (w, (radius, twice)) in convolver.kernel(psf).real_parts().zip(radii(convolver.padded())) {
            if let Some((sum, count)) = rings.get_mut((radius * n as f64).round() as usize) {
                *sum += twice * w;
                *count += twice;
            }
        }
        let means: Vec<f64> = rings.iter().map(|(sum, count)| if *count > 0.0 { sum / count } else { 0.0 }).collect();
        let most = means.iter().copied().fold(0.0, f64::max);
        let first = means.iter().position(|m| *m >= edge * most).unwrap_or(0);
        Self { radius: (first as f64 - 0.5) / n as f64 }
    }

    /// The fraction of the power of a kernel that lies outside.
    fn power_outside(&self, convolver: &Convolver<f64>, kernel: &Spectrum<f64>) -> f64 {
        let (mut all, mut outside) = (0.0, 0.0);
        for (k, (radius, twice)) in kernel.real_parts().zip(radii(convolver.padded())) {
            all += twice * k * k;
            outside += if radius >= self.radius { twice * k * k } else { 0.0 };
        }
        outside / all
    }
}

/// The factor for `added` that gives the smallest chi squared. `seen` is `added` convolved with the beam. The factor is at least 1 and at most
/// 1 / gain, which is the flux that a loop gain of 1 would have removed. The loop gain prevents wide components from taking flux that belongs
/// to other components. It is not needed for the amplitude of the pattern, once the pattern is found.
fn stretch(residual: &Array2<f64>, added: &Array2<f64>, seen: &Array2<f64>, gain: f64) -> f64 {
    let along: f64 = added.iter().zip(residual).map(|(a, r)| a * r).sum();
    let across: f64 = added.iter().zip(seen).map(|(a, s)| a * s).sum();
    if across > 0.0 && along > 0.0 { (along / across).clamp(1.0, 1.0 / gain) } else { 1.0 }
}

impl Multiscale {
    fn smoothed(&self, residual: &Array2<f64>, scale: &Scale) -> Array2<f64> {
        scale.kernel.as_ref().map_or_else(|| residual.clone(), |k| self.convolver.convolve(residual.view(), k))
    }

    /// The scale that takes the next components, among those that are `alive`.
    fn strongest(&self, residual: &Array2<f64>, mask: Option<&Array2<bool>>, (negative, alive): (bool, &[bool])) -> Option<Strongest> {
        let mut best = None;
        let mut most = 0.0;
        for (index, scale) in self.scales.iter().enumerate().filter(|(k, _)| alive[*k]) {
            let smoothed = self.smoothed(residual, scale);
            let peak = peak_size(smoothed.view(), mask, negative);
            let worth = peak / scale.peak.sqrt() * scale.bias;
            if worth > most {
                most = worth;
                best = Some(Strongest { index, smoothed, peak });
            }
        }
        best
    }
}

impl Deconvolver for Multiscale {
    fn minor(&mut self, cycle: Minor<'_>) -> Result<MinorReport> {
        check_cycle(&cycle, self.beam.shape())?;
        let Minor { residual, model, mask, limits } = cycle;
        let size_of = |r: &Array2<f64>| peak_size(r.view(), mask, limits.negative);
        let divergence = self.tuning.minor_divergence;
        let mut taken: Vec<Component> = Vec::new();
        // The scales that have not raised the peak in this cycle.
        let mut alive = vec![true; self.scales.len()];
        let mut peak = size_of(residual);
        let mut least = peak;
        let stop = loop {
            if let Some(stop) = limits.reached(peak, taken.len()) {
                break stop;
            }
            let Some(Strongest { index: k, mut smoothed, peak: top }) = self.strongest(residual, mask, (limits.negative, &alive)) else {
                break MinorStop::Diverged;
            };
            let scale = &self.scales[k];
            let inner = MinorLimits { level: self.tuning.hand_over * top, iterations: limits.iterations - taken.len(), ..limits };
            let mut found = components(&scale.beam, &mut smoothed, mask, (&inner, divergence)).components;
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
            // The smallest chi squared may have a much higher peak. In that case the pattern keeps the loop gain.
            if peak_longer <= after.max(divergence * least) {
                (next, after) = (longer, peak_longer);
                added *= stretch;
                found.iter_mut().for_each(|c| c.flux *= stretch);
            }
            if !(after <= divergence * least) {
                alive[k] = false;
                continue;
            }
            *residual = next;
            *model += &added;
            taken.extend(found);
            peak = after;
            least = least.min(after);
        };
        Ok(MinorReport { stop, components: taken })
    }
}

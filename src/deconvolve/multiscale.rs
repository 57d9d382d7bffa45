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
use super::tiled_beam::TiledBeam;
use super::tuning::CleanTuning;
use crate::fourier::{Convolver, RealSpectrum};
use crate::values::need;
use crate::{ChainError, Result};
use ndarray::{ArcArray2, Array2, ArrayView2, Zip};

struct Scale {
    width_px: f64,
    bias: f64,
    /// Spectrum of the kernel, whose sum is 1; none for points.
    kernel: Option<RealSpectrum<f32>>,
    /// The beam smoothed twice with the kernel, divided by its peak.
    beam: TiledBeam,
    /// The peak of the beam smoothed twice.
    peak: f64,
}

struct Multiscale {
    beam: TiledBeam,
    convolver: Convolver<f32>,
    scales: Vec<Scale>,
    tuning: CleanTuning,
}

/// The scale that takes the next components.
struct Strongest {
    index: usize,
    smoothed: Array2<f32>,
    peak: f64,
}

/// The kernel of a scale \[m, l\]: a paraboloid with a soft edge at `width_px` from the centre and a sum of 1. The array ends where it is 0.
fn kernel(width_px: f64) -> Array2<f64> {
    let reach = width_px.ceil();
    let side = 2 * reach as usize + 1;
    let mut k = Array2::from_shape_fn((side, side), |(i, j)| {
        let r = (i as f64 - reach).hypot(j as f64 - reach) / width_px;
        // The cosine gives the edge a slope of zero, so that the smoothed beam does not ring.
        if r < 1.0 { (1.0 - r * r) * (0.5 + 0.5 * (std::f64::consts::PI * r).cos()) } else { 0.0 }
    });
    let sum = k.sum();
    k /= sum;
    k
}

/// The scales in pixels for an image with this shorter side: points, then multiples of the main lobe up to nearly half of the image.
pub(crate) fn chosen(opts: &Scales, tuning: &CleanTuning, shorter_side: usize) -> Vec<f64> {
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

pub(super) fn make(psf: &ArcArray2<f32>, opts: &Scales, tuning: &CleanTuning) -> Result<Box<dyn Deconvolver>> {
    check_beam(psf.view())?;
    let (n_m, n_l) = psf.dim();
    let most = n_m.min(n_l) as f64 / 2.0;
    let widths = if opts.widths_px.is_empty() { chosen(opts, tuning, n_m.min(n_l)) } else { opts.widths_px.clone() };
    if let Some(w) = widths.iter().find(|w| !(**w >= 0.0 && **w <= most)) {
        return Err(ChainError::bad_option("scales", w, format!("0 to half the image ({most} pixels)")));
    }
    need("scale-bias", opts.bias, (0.0..1.0).contains(&opts.bias), "0 to below 1")?;
    let largest = widths.iter().copied().fold(1.0, f64::max);
    let convolver = Convolver::<f32>::new((n_m, n_l), n_m.max(n_l) / 2 + 1);
    let hole = Hole::of(&convolver, psf.view(), tuning.hole_edge);
    let scale = |width_px: &f64| -> Result<Option<Scale>> {
        let bias = 1.0 - opts.bias * width_px / largest;
        if *width_px < 1.0 {
            return Ok(Some(Scale { width_px: 0.0, bias, kernel: None, beam: TiledBeam::new(psf)?, peak: 1.0 }));
        }
        let spectrum = convolver.kernel(kernel(*width_px).mapv(|v| v as f32).view()).real(|v| v);
        if hole.power_outside(&convolver, &spectrum) < tuning.least_measured {
            return Ok(None);
        }
        let once = convolver.convolve(psf.view(), &spectrum);
        let mut twice = convolver.convolve(once.view(), &spectrum);
        let peak = twice[(n_m / 2, n_l / 2)];
        // The baselines do not measure a scale whose smoothed beam is not largest at its centre. Its components would be fitted to side lobes.
        let seen = twice.iter().all(|v| v.abs() <= peak);
        if !seen {
            return Ok(None);
        }
        twice /= peak;
        let beam = TiledBeam::new(&twice.into_shared())?;
        Ok(Some(Scale { width_px: *width_px, bias, kernel: Some(spectrum), beam, peak: peak.into() }))
    };
    let scales = widths.iter().filter_map(|w| scale(w).transpose()).collect::<Result<Vec<_>>>()?;
    let expected = "at least one scale that the baselines measure; they always measure scale 0";
    need("scales_px", format!("{widths:?}"), !scales.is_empty(), expected)?;
    Ok(Box::new(Multiscale { beam: TiledBeam::new(psf)?, convolver, scales, tuning: *tuning }))
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
    fn of(convolver: &Convolver<f32>, psf: ArrayView2<'_, f32>, edge: f64) -> Self {
        let n = psf.nrows().min(psf.ncols());
        let mut rings = vec![(0.0, 0.0); n];
        for (w, (radius, twice)) in convolver.kernel(psf).real_parts().zip(radii(convolver.padded())) {
            if let Some((sum, count)) = rings.get_mut((radius * n as f64).round() as usize) {
                *sum += twice * f64::from(w);
                *count += twice;
            }
        }
        let means: Vec<f64> = rings.iter().map(|(sum, count)| if *count > 0.0 { sum / count } else { 0.0 }).collect();
        let most = means.iter().copied().fold(0.0, f64::max);
        let first = means.iter().position(|m| *m >= edge * most).unwrap_or(0);
        Self { radius: (first as f64 - 0.5) / n as f64 }
    }

    /// The fraction of the power of a kernel that lies outside.
    fn power_outside(&self, convolver: &Convolver<f32>, kernel: &RealSpectrum<f32>) -> f64 {
        let (mut all, mut outside) = (0.0, 0.0);
        for (k, (radius, twice)) in kernel.values().iter().zip(radii(convolver.padded())) {
            let k = f64::from(*k);
            all += twice * k * k;
            outside += if radius >= self.radius { twice * k * k } else { 0.0 };
        }
        outside / all
    }
}

/// The factor for `added` that gives the smallest chi squared. `seen` is `added` convolved with the beam. The factor is at least 1 and at most
/// 1 / gain, which is the flux that a loop gain of 1 would have removed. The loop gain prevents wide components from taking flux that belongs
/// to other components. It is not needed for the amplitude of the pattern, once the pattern is found.
fn stretch(residual: &Array2<f32>, added: &Array2<f32>, seen: &Array2<f32>, gain: f64) -> f64 {
    let dot = |a: &Array2<f32>, b: &Array2<f32>| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
    let (along, across) = (dot(added, residual), dot(added, seen));
    if across > 0.0 && along > 0.0 { (along / across).clamp(1.0, 1.0 / gain) } else { 1.0 }
}

impl Multiscale {
    fn smoothed(&self, residual: &Array2<f32>, scale: &Scale) -> Array2<f32> {
        scale.kernel.as_ref().map_or_else(|| residual.clone(), |k| self.convolver.convolve(residual.view(), k))
    }

    /// The scale that takes the next components, among those that are `alive`.
    fn strongest(&self, residual: &Array2<f32>, mask: Option<&Array2<bool>>, (negative, alive): (bool, &[bool])) -> Option<Strongest> {
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
        let Minor { residual, mask, limits } = cycle;
        let spectrum = self.beam.spectrum();
        let size_of = |r: &Array2<f32>| peak_size(r.view(), mask, limits.negative);
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
            drop(smoothed);
            let mut flux = Array2::zeros(residual.dim());
            for c in &mut found {
                c.flux /= scale.peak;
                c.scale_px = scale.width_px;
                flux[(c.row, c.column)] += c.flux as f32;
            }
            let added = self.smoothed(&flux, scale);
            drop(flux);
            let seen = self.beam.convolve(added.view(), &spectrum);
            let mut next = &*residual - &seen;
            let mut after = size_of(&next);
            let stretch = if scale.kernel.is_some() { stretch(residual, &added, &seen, limits.gain) } else { 1.0 };
            let mut longer = seen;
            Zip::from(&mut longer).and(&*residual).par_for_each(|l, r| *l = r - *l * stretch as f32);
            let peak_longer = size_of(&longer);
            // The smallest chi squared may have a much higher peak. In that case the pattern keeps the loop gain.
            if peak_longer <= after.max(divergence * least) {
                (next, after) = (longer, peak_longer);
                found.iter_mut().for_each(|c| c.flux *= stretch);
            }
            if !(after <= divergence * least) {
                alive[k] = false;
                continue;
            }
            *residual = next;
            taken.extend(found);
            peak = after;
            least = least.min(after);
        };
        Ok(MinorReport { stop, components: taken })
    }

    fn draw(&self, components: &[Component], model: &mut Array2<f64>) {
        let mut widths: Vec<f64> = components.iter().map(|c| c.scale_px).collect();
        widths.sort_by(f64::total_cmp);
        widths.dedup();
        for width in widths {
            let mine = components.iter().filter(|c| c.scale_px == width);
            if width < 1.0 {
                mine.for_each(|c| model[(c.row, c.column)] += c.flux);
                continue;
            }
            // The model is in double precision, so that a bright source leaves nothing of its rounding over the whole image.
            let engine = Convolver::<f64>::new(model.dim(), width.ceil() as usize + 1);
            // The engine subtracts points.
            let points: Vec<(usize, usize, f64)> = mine.map(|c| (c.row, c.column, -c.flux)).collect();
            engine.subtract_points(&points, &engine.kernel(kernel(width).view()).real(|v| v), model);
        }
    }
}

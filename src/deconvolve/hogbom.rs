//! CLEAN as Högbom wrote it: each component is a part of the largest residual of the whole image, and takes the whole beam with it.
//!
//! # Reference
//! Högbom 1974, A&AS 15, 417. The order in which pixels are brought up to date is ours (see [`super::tiles`]); the components are his.

use super::tiles::{TiledBeam, TiledResidual, point};
use super::{CleanOptions, DIVERGED, Deconvolver, Minor, MinorReport, MinorStop, check_beam, check_cycle};
use crate::Result;
use ndarray::ArrayView2;

struct Hogbom {
    beam: TiledBeam,
}

pub(super) fn make(psf: ArrayView2<'_, f64>, _opts: &CleanOptions, _beam_px: f64) -> Result<Box<dyn Deconvolver>> {
    check_beam(psf)?;
    Ok(Box::new(Hogbom { beam: TiledBeam::new(psf) }))
}

impl Deconvolver for Hogbom {
    fn minor(&mut self, cycle: Minor<'_>) -> Result<MinorReport> {
        check_cycle(&cycle, self.beam.shape())?;
        let report = components(&self.beam, cycle.residual, cycle.mask, &cycle.limits);
        for c in &report.components {
            cycle.model[(c.row, c.column)] += c.flux;
        }
        Ok(report)
    }
}

/// Take components off a residual by the exact algorithm.
pub(super) fn components(
    beam: &TiledBeam,
    residual: &mut ndarray::Array2<f64>,
    mask: Option<&ndarray::Array2<bool>>,
    limits: &super::MinorLimits,
) -> MinorReport {
    let mut state = TiledResidual::new(beam, residual, mask, limits.negative);
    let mut taken = Vec::new();
    // Smallest peak so far and the number of components that led to it.
    let (mut least, mut best) = (f64::INFINITY, 0);
    let stop = loop {
        let Some((value, row, column)) = state.peak() else { break MinorStop::Nothing };
        let size = value.abs();
        if size < least {
            (least, best) = (size, taken.len());
        }
        if size <= limits.level {
            break MinorStop::Level;
        }
        if !(size <= DIVERGED * least) {
            // Undo what came after the best state.
            for c in taken.drain(best..).rev() {
                let c: super::Component = c;
                state.subtract(c.row, c.column, -c.flux);
            }
            break MinorStop::Diverged;
        }
        if taken.len() >= limits.iterations {
            break MinorStop::Iterations;
        }
        let flux = limits.gain * value;
        state.subtract(row, column, flux);
        taken.push(point(row, column, flux));
    };
    let peak = if stop == MinorStop::Nothing { 0.0 } else { state.peak().map_or(0.0, |p| p.0.abs()) };
    *residual = state.finish();
    MinorReport { iterations: taken.len(), peak, stop, components: taken }
}

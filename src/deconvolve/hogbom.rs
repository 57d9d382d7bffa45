//! Högbom's CLEAN: each component is a fraction of the largest residual of the whole image. The whole dirty beam is subtracted with it.
//!
//! # Reference
//! Högbom 1974, A&AS 15, 417. The components are those of the paper. Only the order in which pixels are updated differs (see
//! [`super::tiles`]).

use super::minor::{Component, Deconvolver, Minor, MinorLimits, MinorReport, MinorStop, Scales, check_beam, check_cycle};
use super::tiled_beam::TiledBeam;
use super::tiles::TiledResidual;
use super::tuning::CleanTuning;
use crate::Result;
use ndarray::{ArcArray2, Array2};

struct Hogbom {
    beam: TiledBeam,
    divergence: f64,
}

pub(super) fn make(psf: &ArcArray2<f32>, _opts: &Scales, tuning: &CleanTuning) -> Result<Box<dyn Deconvolver>> {
    check_beam(psf.view())?;
    Ok(Box::new(Hogbom { beam: TiledBeam::new(psf)?, divergence: tuning.minor_divergence }))
}

impl Deconvolver for Hogbom {
    fn minor(&mut self, cycle: Minor<'_>) -> Result<MinorReport> {
        check_cycle(&cycle, self.beam.shape())?;
        Ok(components(&self.beam, cycle.residual, cycle.mask, (&cycle.limits, self.divergence)))
    }
}

/// Remove components from a residual by the exact algorithm. The cycle has diverged when the peak is above `divergence` times its
/// smallest value.
pub(super) fn components(
    beam: &TiledBeam,
    residual: &mut Array2<f32>,
    mask: Option<&Array2<bool>>,
    limits: (&MinorLimits, f64),
) -> MinorReport {
    // On a thread of the pool, because work is handed to the other threads faster from there.
    rayon::scope(|_| components_in_turn(beam, residual, mask, limits))
}

fn components_in_turn(
    beam: &TiledBeam,
    residual: &mut Array2<f32>,
    mask: Option<&Array2<bool>>,
    (limits, divergence): (&MinorLimits, f64),
) -> MinorReport {
    let mut state = TiledResidual::new(beam, std::mem::take(residual), mask, limits.negative);
    let mut taken: Vec<Component> = Vec::new();
    // Smallest peak so far, and the number of components at that time.
    let (mut least, mut best) = (f64::INFINITY, 0);
    let stop = loop {
        let Some(peak) = state.peak() else { break MinorStop::Nothing };
        let size = peak.value.abs();
        if size < least {
            (least, best) = (size, taken.len());
        }
        if size <= limits.level {
            break MinorStop::Level;
        }
        if !(size <= divergence * least) {
            // Undo the components after the best state.
            for c in taken.drain(best..).rev() {
                state.subtract(Component { flux: -c.flux, ..c });
            }
            break MinorStop::Diverged;
        }
        if taken.len() >= limits.iterations {
            break MinorStop::Iterations;
        }
        let component = Component::point(peak.row, peak.column, limits.gain * peak.value);
        state.subtract(component);
        taken.push(component);
    };
    *residual = state.finish();
    MinorReport { stop, components: taken }
}

//! CLEAN that continues from an earlier model. It serves loops in which the data change between short updates of the model.

use super::imager::Imager;
use super::psf::side_lobe;
use crate::Result;
use crate::deconvolve::{CleanOptions, Deconvolver};
use crate::progress::Observer;
use cittert_arrays::RestoringBeam;
use ndarray::{ArcArray2, Array2};

/// The start and the end of a run. By default it starts with an empty model and ends with an exact residual.
#[derive(Debug, Clone, Copy)]
pub struct Continue<'a> {
    /// Model of each output channel, flux per pixel \[m, l\]. An empty list means empty models.
    pub models: &'a [Array2<f64>],
    /// True if the models were already subtracted from the data of the imager. They are not subtracted again.
    pub subtracted: bool,
    /// Smallest flux of a pixel of the model. After each minor cycle, pixels below it are raised to it.
    pub floor: Option<f64>,
    /// End with the exact residual from the visibilities. Without it, the residual is that of the last minor cycle and chi squared is unknown
    /// (NaN). This saves two transforms.
    pub exact: bool,
}

impl Default for Continue<'_> {
    fn default() -> Self {
        Self { models: &[], subtracted: false, floor: None, exact: true }
    }
}

/// Beams and deconvolvers of all output channels, and the weights that they were made for.
pub struct Tools {
    pub(super) all: Vec<Tool>,
    made_for: (Vec<f64>, u64),
}

/// Beam and deconvolver of one output channel.
pub(super) struct Tool {
    pub(super) psf: ArcArray2<f32>,
    pub(super) beam: RestoringBeam,
    pub(super) side_lobe: f64,
    pub(super) deconvolver: Box<dyn Deconvolver>,
}

impl std::fmt::Debug for Tools {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tools").field("made_for", &self.made_for).finish_non_exhaustive()
    }
}

/// Relative change of a sum of weights by rounding, when gains of amplitude 1 are applied.
const ROUNDING: f64 = 1e-5;

fn key(imager: &Imager<'_>) -> (Vec<f64>, u64) {
    ((0..imager.channels().len()).map(|k| imager.sum_of_weights(k)).collect(), imager.survey().counts.used)
}

impl Tools {
    /// Make the beams and the deconvolvers for an imager.
    ///
    /// # Errors
    /// No Gaussian fits a beam, or the source fails.
    pub(super) fn new(imager: &mut Imager<'_>, opts: &CleanOptions, observer: &dyn Observer) -> Result<Self> {
        let entry = opts.entry()?;
        let make = |imager: &mut Imager<'_>, k: usize| {
            let psf = imager.psf_in::<f32>(k, observer)?.into_shared();
            let beam = imager.beam_of(psf.view())?;
            let beam_px = (beam.bmaj_rad * beam.bmin_rad).sqrt() / imager.grid().cell_rad;
            let deconvolver = (entry.make)(&psf, &opts.scales(beam_px), &opts.tuning)?;
            Ok(Tool { side_lobe: side_lobe(imager.grid(), psf.view(), &beam, opts.tuning.main_lobe_fwhm), psf, beam, deconvolver })
        };
        let all = (0..imager.channels().len()).map(|k| make(imager, k)).collect::<Result<_>>()?;
        Ok(Self { all, made_for: key(imager) })
    }

    /// True if the data have the weights that the beams were made for.
    pub(super) fn fit(&self, imager: &Imager<'_>) -> bool {
        let (sums, used) = key(imager);
        let same = |(a, b): (&f64, &f64)| (a - b).abs() <= ROUNDING * a.abs();
        used == self.made_for.1 && sums.len() == self.made_for.0.len() && self.made_for.0.iter().zip(&sums).all(same)
    }
}

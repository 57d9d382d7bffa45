//! CLEAN that goes on from an earlier model, for loops in which the data change between short updates of the model.

use super::Imager;
use super::major::{CleanOptions, side_lobe};
use crate::Result;
use crate::deconvolve::Deconvolver;
use crate::progress::Observer;
use cittert_arrays::RestoringBeam;
use ndarray::Array2;

/// Where a run begins and how it ends. The default begins with nothing and ends with an exact residual.
#[derive(Debug, Clone, Copy)]
pub struct Continue<'a> {
    /// Model of each output channel, flux a pixel \[m, l\]; none for an empty one.
    pub models: &'a [Array2<f64>],
    /// The data of the imager are what these models leave: they are not taken away again.
    pub subtracted: bool,
    /// Least flux of a pixel of the model; what a minor cycle takes below it is given back.
    pub floor: Option<f64>,
    /// End with the residual of the visibilities. Without, it is the residual as the last minor cycle left it, chi squared is not known,
    /// and two transforms are saved.
    pub exact: bool,
}

impl Default for Continue<'_> {
    fn default() -> Self {
        Self { models: &[], subtracted: false, floor: None, exact: true }
    }
}

/// What output channels are cleaned with, and what it was made for.
pub struct Tools {
    pub(super) all: Vec<Tool>,
    made_for: (Vec<f64>, u64),
}

/// Beam and deconvolver of an output channel.
pub(super) struct Tool {
    pub(super) psf: Array2<f64>,
    pub(super) beam: RestoringBeam,
    pub(super) side_lobe: f64,
    pub(super) deconvolver: Box<dyn Deconvolver>,
}

impl std::fmt::Debug for Tools {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tools").field("made_for", &self.made_for).finish_non_exhaustive()
    }
}

/// Relative change of a sum of weights that rounding makes when gains of amplitude 1 are applied.
const ROUNDING: f64 = 1e-5;

fn key(imager: &Imager<'_>) -> (Vec<f64>, u64) {
    ((0..imager.channels().len()).map(|k| imager.sum_of_weights(k)).collect(), imager.survey().counts.used)
}

impl Tools {
    /// Beams and deconvolvers for an imager.
    ///
    /// # Errors
    /// A beam that no Gaussian fits, whatever the source says.
    pub(super) fn new(imager: &mut Imager<'_>, opts: &CleanOptions, observer: &dyn Observer) -> Result<Self> {
        let entry = opts.entry()?;
        let make = |imager: &mut Imager<'_>, k: usize| {
            let psf = imager.psf(k, observer)?;
            let beam = imager.beam_of(&psf)?;
            let beam_px = (beam.bmaj_rad * beam.bmin_rad).sqrt() / imager.grid().cell_rad;
            let deconvolver = (entry.make)(psf.view(), opts, beam_px)?;
            Ok(Tool { side_lobe: side_lobe(imager, &psf, &beam), psf, beam, deconvolver })
        };
        let all = (0..imager.channels().len()).map(|k| make(imager, k)).collect::<Result<_>>()?;
        Ok(Self { all, made_for: key(imager) })
    }

    /// True where the data have the same weights as those that the beams were made of.
    pub(super) fn fit(&self, imager: &Imager<'_>) -> bool {
        let (sums, used) = key(imager);
        let same = |(a, b): (&f64, &f64)| (a - b).abs() <= ROUNDING * a.abs();
        used == self.made_for.1 && sums.len() == self.made_for.0.len() && self.made_for.0.iter().zip(&sums).all(same)
    }
}

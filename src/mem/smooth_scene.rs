//! Whether and how a smooth scene is expected: from the option `smoothness` to a penalty and its multiplier.

use super::beam::BeamHessian;
use super::fluctuations::{Fluctuations, mean_spectrum, strength};
use super::imager::Method;
use super::inside::sum_inside;
use super::options::SmoothnessChoice;
use super::plan::{MemPlan, Prior};
use super::power_plane::PowerPlane;
use super::response::Response;
use super::smoothness::Smoothness;
use super::statistics::powers_by_length;
use crate::imaging::Imager;
use crate::progress::{Event, Observer, Quiet};
use crate::{ChainError, Result, ensure};
use cittert_arrays::VisUnit;
use ndarray::{ArcArray2, Array2};

/// The penalty of a smooth scene and the multiplier of chi squared that belongs to it, in units of the mean prior.
pub(crate) struct SmoothScene {
    pub(crate) penalty: Smoothness,
    pub(crate) lambda: f64,
}

/// What of the model is known before the solver starts.
pub(crate) struct Known<'a> {
    pub(crate) beam: &'a BeamHessian,
    pub(crate) response: &'a Response,
    /// Flux a pixel \[m, l\].
    pub(crate) prior: &'a ArcArray2<f32>,
    /// Flux a pixel of one unit of brightness in the middle of the image.
    pub(crate) one: f64,
    pub(crate) inside: Option<&'a Array2<bool>>,
    pub(crate) offset: Option<&'a Array2<f32>>,
    /// 1/sigma^2 over the weight of a visibility.
    pub(crate) factor: f64,
}

impl SmoothScene {
    /// For an output channel, if the options or the data ask for one.
    ///
    /// # Errors
    /// An rms in kelvin for data that are not in kelvin; the source cannot be read.
    pub(crate) fn of(at: (&mut Imager<'_>, usize), known: &Known<'_>, opts: &MemPlan, observer: &dyn Observer) -> Result<Option<Self>> {
        let (imager, channel) = at;
        let choice = opts.options.smoothness;
        let newton = opts.options.solver == Method::QuasiNewton;
        ensure!(
            newton || !matches!(choice, SmoothnessChoice::Varies(_)),
            ChainError::Incompatible("vtess knows no smoothness: use the quasi-Newton solver, or smoothness none".into())
        );
        let automatic = newton && !known.response.is_one() && opts.prior != Prior::Smoothed;
        if choice == SmoothnessChoice::None || (choice == SmoothnessChoice::Auto && !automatic) {
            return Ok(None);
        }
        let count = known.inside.map_or(known.prior.len(), |m| m.iter().filter(|x| **x).count());
        let unit = sum_inside(known.prior, known.inside) / count.max(1) as f64;
        let strength = strength(known.response, known.prior.dim());
        let penalty = || Smoothness::new(known.prior.clone(), known.inside.cloned(), strength, unit);
        if let SmoothnessChoice::Varies(rms) = choice {
            let kelvin = imager.header().unit == VisUnit::KelvinSr;
            ensure!(kelvin, ChainError::Incompatible("an rms in kelvin needs data in K sr: use smoothness auto or none".into()));
            let variance = (rms.si() * known.one / unit).powi(2);
            return Ok(Some(Self { penalty: penalty()?, lambda: variance / mean_spectrum(known.beam, strength) }));
        }
        let mut expected = known.prior.to_owned();
        if let Some(offset) = known.offset {
            expected -= offset;
        }
        known.response.multiply_single(&mut expected);
        let plane = PowerPlane::of(known.beam, imager.grid(), expected.view());
        let bins = powers_by_length((imager, channel), known.factor, |u, v| plane.at(u, v), &Quiet(observer))?;
        let cell = imager.grid().cell_rad;
        let found = Fluctuations::of(&bins, known.response, known.prior.dim(), (unit, cell)).filter(|f| f.smooth);
        let Some(Fluctuations { lambda, .. }) = found else { return Ok(None) };
        let rms = (lambda * mean_spectrum(known.beam, strength)).sqrt() * unit / known.one;
        let text = if imager.header().unit == VisUnit::KelvinSr { format!("{rms:.1} K") } else { format!("{rms:.3e} Jy/pixel") };
        observer.event(Event::Note(&format!(
            "the data fit a smooth scene that varies by {text} rms: neighbours are expected to be alike (smoothness auto)"
        )));
        Ok(Some(Self { penalty: penalty()?, lambda }))
    }
}

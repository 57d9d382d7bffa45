//! The model maker of the loop. It keeps the image of each round and measures its time.

use crate::Result;
use crate::calibrate::{ImageMaker, Joint, JointStage, ModelMaker, ModelMetrics, ModelVisibilities, RoundPlan};
use crate::imaging::CleanProducts;
use crate::progress::Observer;
use cittert_arrays::{Image, UvCoverage, VisibilityHeader, VisibilitySource};
use ndarray::Array3;
use num_complex::Complex;
use serde_json::{Value, json};
use std::time::Instant;

/// Wall-clock seconds by stage.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Seconds {
    /// Images and deconvolution.
    pub(super) imaging: f64,
    /// Reading, predicting and solving.
    pub(super) solving: f64,
    /// Applying the gains and writing.
    pub(super) writing: f64,
}

impl Seconds {
    pub(super) fn json(&self, total: f64) -> Value {
        json!({ "imaging": self.imaging, "solving": self.solving, "writing": self.writing, "total": total })
    }
}

/// Takes the image of each round. Round 0 is the image before any calibration.
pub(super) trait Keep {
    /// Keep the image of a round of a candidate.
    fn keep(&self, candidate: &'static str, round: usize, image: &Image) -> Result<()>;
    /// Time that images took.
    fn took(&self, seconds: f64);
}

/// A maker that passes the image of each round on.
pub(super) struct KeepingMaker<'a> {
    pub(super) inner: Box<dyn ImageMaker + 'a>,
    pub(super) candidate: &'static str,
    pub(super) round: Option<usize>,
    pub(super) keep: &'a dyn Keep,
}

/// The joint solution of image and gains, if there is one.
pub(super) fn joint(maker: &dyn ImageMaker) -> Option<Value> {
    maker.solution().map(|j| {
        let stage = |s: &JointStage| {
            json!({ "strength": s.strength, "evaluations": s.evaluations, "chi2_per_datum": s.chi2_per_datum,
                "moved_pixels": [s.moved.0, s.moved.1] })
        };
        let stages: Vec<Value> = j.stages.iter().map(stage).collect();
        json!({
            "evaluations": j.state.evaluations, "chi2_per_datum": j.misfit(), "kkt_residual": j.state.kkt, "met": j.progress.met,
            "noise_factor": j.noise_factor, "stages": stages,
        })
    })
}

/// The final images. For a joint solution, chi squared and the noise come from the solution, because the weights of the images may be
/// counts of samples.
pub(super) fn products(maker: &dyn ImageMaker) -> Option<CleanProducts> {
    let mut products = maker.products().cloned();
    if let (Some(p), Some(j)) = (&mut products, maker.solution()) {
        p.statistics.chi2_per_datum = j.misfit();
        p.statistics.iterations = j.state.evaluations;
    }
    products
}

impl KeepingMaker<'_> {
    fn timed<T>(&mut self, work: impl FnOnce(&mut dyn ImageMaker) -> Result<T>) -> Result<T> {
        let begun = Instant::now();
        let done = work(self.inner.as_mut());
        self.keep.took(begun.elapsed().as_secs_f64());
        done
    }
}

impl ModelVisibilities for KeepingMaker<'_> {
    fn predict(&mut self, header: &VisibilityHeader, first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        self.inner.predict(header, first_row, coverage)
    }

    fn predict_some(&mut self, header: &VisibilityHeader, place: (usize, &UvCoverage), rows: &[usize]) -> Result<Array3<Complex<f32>>> {
        self.inner.predict_some(header, place, rows)
    }
}

impl ModelMaker for KeepingMaker<'_> {
    fn update(&mut self, data: &mut dyn VisibilitySource, plan: &RoundPlan, observer: &dyn Observer) -> Result<ModelMetrics> {
        let metrics = self.timed(|inner| inner.update(data, plan, observer))?;
        if let (Some(round), Some(products)) = (self.round.take(), self.inner.products()) {
            self.keep.keep(self.candidate, round, &products.restored)?;
        }
        Ok(metrics)
    }

    fn as_they_are(&mut self, data: &mut dyn VisibilitySource, step: usize, observer: &dyn Observer) -> Result<Option<ModelMetrics>> {
        self.timed(|inner| inner.as_they_are(data, step, observer))
    }

    fn reopen(&mut self, data: &mut dyn VisibilitySource, observer: &dyn Observer) -> Result<()> {
        self.timed(|inner| inner.reopen(data, observer))
    }

    fn begin_round(&mut self, number: usize) {
        self.round = Some(number);
    }

    fn remember(&mut self) {
        self.inner.remember();
    }

    fn recall(&mut self) {
        self.inner.recall();
    }
}

impl ImageMaker for KeepingMaker<'_> {
    fn products(&self) -> Option<&CleanProducts> {
        self.inner.products()
    }

    fn solution(&self) -> Option<&Joint> {
        self.inner.solution()
    }
}

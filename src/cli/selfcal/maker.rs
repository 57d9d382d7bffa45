//! The model maker of the loop. It keeps the image of each round and measures its time.

use crate::Result;
use crate::calibrate::{ImageMaker, JointStage, ModelMaker, ModelMetrics, ModelVisibilities, RoundPlan};
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

/// A maker that passes the image of each round to `keep`. Round 0 is the image before any calibration.
pub(super) struct KeepingMaker<K> {
    inner: Box<dyn ImageMaker>,
    first: usize,
    next: usize,
    keep: K,
    /// Seconds spent on images.
    pub(super) seconds: f64,
}

impl<K: FnMut(usize, &Image) -> Result<()>> KeepingMaker<K> {
    /// `before` is true if the first image is made from the data before any calibration.
    pub(super) fn new(inner: Box<dyn ImageMaker>, before: bool, keep: K) -> Self {
        Self { inner, first: usize::from(!before), next: usize::from(!before), keep, seconds: 0.0 }
    }

    /// Call `remove` for the images of round `from` and later that were kept.
    pub(super) fn forget_from(&self, from: usize, remove: impl Fn(usize)) {
        (from.max(self.first)..self.next).for_each(remove);
    }

    /// The joint solution of image and gains, if there is one.
    pub(super) fn joint(&self) -> Option<Value> {
        self.inner.solution().map(|j| {
            let stage = |s: &JointStage| {
                json!({ "strength": s.strength, "evaluations": s.evaluations, "chi2_per_datum": s.chi2_per_datum,
                    "moved_pixels": [s.moved.0, s.moved.1] })
            };
            let stages: Vec<Value> = j.stages.iter().map(stage).collect();
            json!({
                "evaluations": j.state.evaluations, "chi2_per_datum": j.state.chi2_per_datum / j.noise_factor.unwrap_or(1.0),
                "kkt_residual": j.state.kkt, "met": j.progress.met, "noise_factor": j.noise_factor, "stages": stages,
            })
        })
    }

    /// The images of the best round. For a joint solution, chi squared and the noise come from the solution, because the weights of the
    /// images may be counts of samples.
    pub(super) fn into_products(self) -> Option<CleanProducts> {
        let mut products = self.inner.products().cloned();
        if let (Some(p), Some(j)) = (&mut products, self.inner.solution()) {
            p.statistics.chi2_per_datum = j.state.chi2_per_datum / j.noise_factor.unwrap_or(1.0);
            p.statistics.iterations = j.state.evaluations;
        }
        products
    }
}

impl<K> ModelVisibilities for KeepingMaker<K> {
    fn predict(&mut self, header: &VisibilityHeader, first_row: usize, coverage: &UvCoverage) -> Result<Array3<Complex<f32>>> {
        self.inner.predict(header, first_row, coverage)
    }
}

impl<K: FnMut(usize, &Image) -> Result<()>> ModelMaker for KeepingMaker<K> {
    fn update(&mut self, data: &mut dyn VisibilitySource, plan: &RoundPlan, observer: &dyn Observer) -> Result<ModelMetrics> {
        let begun = Instant::now();
        let metrics = self.inner.update(data, plan, observer)?;
        self.seconds += begun.elapsed().as_secs_f64();
        if let Some(products) = self.inner.products() {
            (self.keep)(self.next, &products.restored)?;
        }
        self.next += 1;
        Ok(metrics)
    }

    fn remember(&mut self) {
        self.inner.remember();
    }

    fn recall(&mut self) {
        self.inner.recall();
    }
}

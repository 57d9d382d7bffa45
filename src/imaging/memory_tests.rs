//! The memory budget changes how an image is computed, but not the image.

use super::*;
use crate::fixtures::{Recorder, positions, snapshot};
use crate::progress::Silent;
use cittert_arrays::{Polarization, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySet, VisibilitySource};
use std::ops::Range;

/// A set that counts how often its rows are read.
struct Counting(VisibilitySet, usize);

impl VisibilitySource for Counting {
    fn header(&self) -> &VisibilityHeader {
        &self.0.header
    }

    fn n_rows(&self) -> usize {
        self.0.n_rows()
    }

    fn read_rows(&mut self, range: Range<usize>) -> cittert_arrays::Result<VisibilityBlock> {
        self.1 += 1;
        self.0.read_rows(range)
    }
}

/// Under the small budget the set is read again in every pass, in several blocks, and the planes of w are made in groups for every block. Under
/// the large budget everything stays in memory. The dirty image, the beam and the residual agree to 1e-6 of the peak.
#[test]
fn a_tiny_and_a_large_budget_give_the_same_image() {
    let freq: Vec<f64> = (0..96).map(|c| 94e9 + 2e7 * f64::from(c)).collect();
    // 1770 baselines of 96 channels are 2.7 MB of reduced data, above an eighth of 16 MiB. A height of 0.3 m needs planes of w.
    let set =
        snapshot(&positions(60, 0.5, 0.3, 3), &freq, &[Polarization::I], &[(0.1, 0.05, 1.0), (-0.14, 0.09, 0.4)], (0.01, VisUnit::Jy));
    let run = |bytes: u64| {
        let mut source = Counting(set.clone(), 0);
        let memory = crate::memory::MemoryBudget::new(bytes).unwrap();
        let opts = ImagingOptions {
            size: Some(ImageSize::square(256)),
            cell: Some(cittert_arrays::quantity::Angle(1.5e-3)),
            weighting: Weighting::Briggs,
            robust: Some(0.5),
            memory,
            ..ImagingOptions::default()
        };
        let mut imager = Imager::new(&mut source, opts, &Silent).unwrap();
        let told = Recorder::default();
        let (dirty, psf) = (imager.dirty(0, &told).unwrap(), imager.psf(0, &told).unwrap());
        let mut model = ndarray::Array2::zeros((256, 256));
        model[(140, 170)] = 0.7;
        let residual = imager.residual(0, model.view(), &Silent).unwrap();
        drop(imager);
        let notes = told.messages().iter().filter(|m| m.contains("planes of the grid")).count();
        assert_eq!(notes, usize::from(bytes < 1 << 30), "{:?}", told.messages());
        (source.1, [dirty, psf, residual.image], residual.chi2_per_datum)
    };
    let (reads, small, chi2) = run(16 << 20);
    let (read_once, large, chi2_large) = run(8 << 30);
    assert!(read_once == 1 && reads > 10, "{read_once} {reads}");
    for (a, b) in small.iter().zip(&large) {
        let peak = b.iter().fold(0.0, |top: f64, v| top.max(v.abs()));
        let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-6 * peak, "{worst:e} of {peak:e}");
    }
    assert!((chi2 / chi2_large - 1.0).abs() < 1e-6, "{chi2} {chi2_large}");
}

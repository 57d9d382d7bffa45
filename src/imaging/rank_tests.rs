//! Several processes that share a set make the images of one process.

use super::*;
use crate::ChainError;
use crate::deconvolve::by_name;
use crate::fixtures::{in_processes, positions, snapshot};
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Image, Polarization, VisUnit, VisibilitySet, VisibilitySource};
use major::CleanOptions;
use ndarray::{Array1, ArrayView1, s};

fn set() -> VisibilitySet {
    let sources = [(0.012, 0.005, 1.0), (-0.004, 0.009, 0.4)];
    let mut set = snapshot(&positions(24, 0.5, 0.01, 3), &[94e9, 95e9], &[Polarization::I], &sources, (0.05, VisUnit::Jy));
    set.data.flags[(7, 0, 0)] = true;
    set.data.weights[(100, 1, 0)] = 0.0;
    set
}

fn options(weighting: Weighting) -> ImagingOptions {
    ImagingOptions { cell: Some(Angle(1e-3)), weighting, ..ImagingOptions::default() }
}

/// Largest difference over the largest value.
fn apart(a: ArrayView1<'_, f64>, b: ArrayView1<'_, f64>) -> f64 {
    let top = a.iter().fold(0.0_f64, |t, v| t.max(v.abs()));
    a.iter().zip(b).fold(0.0_f64, |d, (a, b)| d.max((a - b).abs())) / top
}

/// The pixels of the middle of an image.
fn inner_half(image: &Image) -> Array1<f64> {
    let (_, _, m, l) = image.data.dim();
    image.data.slice(s![.., .., m / 4..m - m / 4, l / 4..l - l / 4]).iter().copied().collect()
}

/// Each process rounds its own grid. In single precision this is below 1e-7 in the middle of the image; at its edges, where an image is divided by the small
/// transform of the gridding kernel, it is up to 1e-6, as is the difference between single and double precision. This is part of the error `epsilon`.
#[test]
fn images_do_not_depend_on_the_number_of_processes() {
    for (epsilon, bound) in [(1e-7, 1e-6), (1e-5, 1e-5)] {
        for weighting in [Weighting::Natural, Weighting::Uniform, Weighting::Briggs] {
            let run = |source: &mut dyn VisibilitySource| {
                let mut imager = Imager::new(source, ImagingOptions { epsilon, ..options(weighting) }, &Silent).unwrap();
                let opts = CleanOptions { niter: 300, ..CleanOptions::default() };
                let out = clean(&mut imager, &opts, &Silent).unwrap();
                (imager.survey().clone(), out)
            };
            let (survey, one) = in_processes(1, &set(), run).remove(0);
            for size in [2, 3, 5] {
                let several = in_processes(size, &set(), run);
                for (found, other) in &several {
                    assert!(other.dirty.data == several[0].1.dirty.data && other.restored.data == several[0].1.restored.data);
                    assert_eq!((found.counts, found.extent, found.uv_range_wl), (survey.counts, survey.extent, survey.uv_range_wl));
                    assert_eq!((found.time_jd, &found.shortest_by_octave_wl), (survey.time_jd, &survey.shortest_by_octave_wl));
                    for (a, b) in [(&one.dirty, &other.dirty), (&one.restored, &other.restored), (&one.model, &other.model)] {
                        let difference = apart(a.data.flatten().view(), b.data.flatten().view());
                        assert!(difference < bound, "epsilon {epsilon}, {weighting:?}, {size} processes: {difference:e}");
                    }
                    let [a, b] = [&one.dirty, &other.dirty].map(inner_half);
                    let difference = apart(a.view(), b.view());
                    assert!(difference < 1e-6, "epsilon {epsilon}, {weighting:?}, {size} processes, inner half: {difference:e}");
                    assert_eq!(one.components.len(), other.components.len());
                    assert!((one.statistics.chi2_per_datum / other.statistics.chi2_per_datum - 1.0).abs() < 1e-6);
                }
            }
        }
    }
}

/// Where grids are in double precision, sums over processes differ by less than the pixels are rounded to. A deep CLEAN then takes the steps of one process,
/// also far below the noise, where a difference in the last digit of single precision would lead to other components.
#[test]
fn deep_cleans_in_double_precision_take_the_same_steps() {
    let run = |source: &mut dyn VisibilitySource| {
        let mut imager = Imager::new(source, ImagingOptions { epsilon: 9e-6, ..options(Weighting::Briggs) }, &Silent).unwrap();
        let opts = CleanOptions { algorithm: by_name("hogbom").unwrap().into(), niter: 5000, nsigma: 0.0, ..CleanOptions::default() };
        clean(&mut imager, &opts, &Silent).unwrap()
    };
    let one = in_processes(1, &set(), run).remove(0);
    assert!(one.statistics.iterations > 1000, "{}", one.statistics.iterations);
    for size in [2, 3, 4] {
        for other in in_processes(size, &set(), run) {
            assert_eq!((one.statistics.iterations, one.components.len()), (other.statistics.iterations, other.components.len()));
            for a in &one.components {
                let there = other.components.iter().find(|b| (a.l, a.m) == (b.l, b.m)).unwrap();
                assert!((a.flux - there.flux).abs() <= 1e-6 * a.flux.abs(), "{a:?} {there:?}");
            }
            let difference = apart(one.restored.data.flatten().view(), other.restored.data.flatten().view());
            assert!(difference < 1e-7, "{size} processes: {difference:e}");
        }
    }
}

/// A process may have no row at all. In single precision the sums of three rows in another order differ by more than those of many rows.
#[test]
fn more_processes_than_rows_make_the_same_image() {
    let set = snapshot(&positions(3, 0.5, 0.01, 3), &[94e9], &[Polarization::I], &[(0.0, 0.0, 1.0)], (0.05, VisUnit::Jy));
    for (epsilon, bound) in [(1e-7, 1e-9), (1e-5, 1e-5)] {
        let run = |source: &mut dyn VisibilitySource| {
            let opts = ImagingOptions { size: Some(ImageSize::square(32)), epsilon, ..options(Weighting::Briggs) };
            Imager::new(source, opts, &Silent).unwrap().dirty(0, &Silent).unwrap()
        };
        let one = in_processes(1, &set, run).remove(0);
        for other in in_processes(5, &set, run) {
            let difference = apart(one.flatten().view(), other.flatten().view());
            assert!(difference < bound, "epsilon {epsilon}: {difference:e}");
        }
    }
}

#[test]
fn all_processes_find_what_is_wrong_with_the_set() {
    let mut fields = set();
    fields.header.phase_centers.push(fields.header.phase_centers[0].clone());
    let n = fields.data.coverage.phase_center.len();
    fields.data.coverage.phase_center[n / 2..].fill(1);
    let open = |source: &mut dyn VisibilitySource| Imager::new(source, options(Weighting::Natural), &Silent).map(drop);
    for error in in_processes(2, &fields, open) {
        assert!(error.unwrap_err().to_string().contains("several phase centres"));
    }
    let mut empty = set();
    empty.data.flags.fill(true);
    for error in in_processes(3, &empty, open) {
        assert!(matches!(error, Err(ChainError::NoData(_))), "{error:?}");
    }
}

/// Each process cleans some channels; with five processes two have none.
#[test]
fn channels_that_are_shared_out_are_those_of_one_process() {
    let sources = [(0.012, 0.005, 1.0), (-0.004, 0.009, 0.4)];
    let set = snapshot(&positions(24, 0.5, 0.01, 3), &[92e9, 94e9, 96e9], &[Polarization::I], &sources, (0.05, VisUnit::Jy));
    for (algorithm, auto_mask) in [("hogbom", None), ("clark", Some(5.0)), ("multiscale", None)] {
        let run = |source: &mut dyn VisibilitySource| {
            let mut imager =
                Imager::new(source, ImagingOptions { channels_out: 3, epsilon: 9e-6, ..options(Weighting::Natural) }, &Silent).unwrap();
            let algorithm = by_name(algorithm).unwrap().into();
            let opts = CleanOptions { algorithm, auto_mask, niter: 2000, nsigma: 1.0, mgain: 0.5, ..CleanOptions::default() };
            clean(&mut imager, &opts, &Silent).unwrap()
        };
        let one = in_processes(1, &set, run).remove(0);
        assert!(one.statistics.major_cycles > 6, "{}", one.statistics.major_cycles);
        for size in [2, 5] {
            for other in in_processes(size, &set, run) {
                assert_eq!((&one.statistics.stop, one.statistics.major_cycles), (&other.statistics.stop, other.statistics.major_cycles));
                assert_eq!(one.components.len(), other.components.len());
                for (a, b) in [(&one.restored, &other.restored), (&one.residual, &other.residual), (&one.model, &other.model)] {
                    let difference = apart(a.data.flatten().view(), b.data.flatten().view());
                    assert!(difference < 1e-6, "{algorithm}, {size} processes: {difference:e}");
                }
            }
        }
    }
}

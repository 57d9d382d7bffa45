//! Tests of dirty images and CLEAN of elements with a pattern.

use super::*;
use crate::deconvolve::CleanOptions;
use crate::fixtures::{Recorder, positions, snapshot};
use crate::progress::Silent;
use cittert_arrays::{ElementPattern, Image, Polarization, VisUnit, VisibilitySet};

/// A set of 24 antennas through Gaussian elements that sees these points (l, m, flux), which are already dimmed.
fn seen(points: &[(f64, f64, f64)], unit: VisUnit) -> VisibilitySet {
    let mut set = snapshot(&positions(24, 30.0, 0.0, 3), &[1e9, 1.02e9], &[Polarization::I], points, (0.0, unit));
    set.header.layout.pattern = "gaussian fwhm_rad=0.05".parse().unwrap();
    set
}

fn options() -> ImagingOptions {
    ImagingOptions { size: Some("64".parse().unwrap()), cell: Some("1mrad".parse().unwrap()), ..ImagingOptions::default() }
}

#[test]
fn a_corrected_image_has_the_flux_of_the_source_and_blanks_outside() {
    let pattern: ElementPattern = "gaussian fwhm_rad=0.05".parse().unwrap();
    let (l, m) = (0.015, -0.012);
    let mut set = seen(&[(l, m, 2.0 * pattern.power(l, m, 1e9))], VisUnit::Jy);
    let mut imager = Imager::new(&mut set, options(), &Silent).unwrap();
    let made = clean(&mut imager, &CleanOptions { niter: 300, ..CleanOptions::default() }, &Silent).unwrap();
    assert_eq!(made.restored.pattern, pattern);
    let single = |image: &Image| Image {
        data: image.data.mapv(|v| v as f32),
        grid: image.grid.clone(),
        spectrum: image.spectrum.clone(),
        polarizations: image.polarizations.clone(),
        unit: image.unit,
        beams: image.beams.clone(),
        object: String::new(),
        telescope: String::new(),
        time_jd: None,
        pedestal_k: None,
        pattern: image.pattern.clone(),
        seen_through: image.seen_through.clone(),
        near_field: image.near_field.clone(),
        history: Vec::new(),
    };
    let flat = single(&made.restored);
    let how = CorrectionOptions { pbcor: true, pbcor_limit: 0.3 };
    how.check(&flat.pattern).unwrap();
    let (corrected, shown) = (how.corrected(&flat), pattern_image(&flat));
    let at = [0, 0, flat.grid.row_of(m).round() as usize, flat.grid.column_of(l).round() as usize];
    assert!((corrected.data[at] - 2.0).abs() < 0.02 && corrected.pattern.is_none(), "{}", corrected.data[at]);
    assert!((f64::from(shown.data[at]) - pattern.power(l, m, 1e9)).abs() < 1e-6);
    for (v, a) in corrected.data.iter().zip(&shown.data) {
        assert_eq!(v.is_nan(), *a < 0.3);
    }
    assert!(CorrectionOptions { pbcor_limit: 0.5, ..CorrectionOptions::default() }.check(&pattern).is_err());
    assert!(how.check(&ElementPattern::None).is_err());
}

#[test]
fn a_background_leaves_the_data_and_comes_back_into_the_image() {
    let mut set = seen(&[], VisUnit::KelvinSr);
    set.header.spectrum = cittert_arrays::SpectralWindow::new(vec![1e9, 1.02e9], vec![2e7, 2e7]).unwrap();
    // A uniform 250 K through the pattern, as a sum over the pixels of the image.
    let pattern = set.header.layout.pattern.clone();
    let grid = cittert_arrays::SkyGrid::new(64, 64, 1e-3, cittert_arrays::SkyFrame::Boresight).unwrap();
    let plane = pattern.plane(&grid, 1e9) * (250.0 * grid.cell_sr());
    let vis = crate::simulate::dft::image_dft(&grid, plane.view(), set.data.coverage.uvw_m.view(), &[1e9, 1.02e9], true).unwrap();
    set.data.vis.indexed_iter_mut().for_each(|((r, c, _), v)| *v = num_complex::Complex::new(vis[(r, c)].re as f32, vis[(r, c)].im as f32));
    for (choice, told) in [(BackgroundChoice::Auto, "fits the visibilities best"), ("250K".parse().unwrap(), "as given")] {
        let recorder = Recorder::default();
        let mut imager = Imager::new(&mut set, ImagingOptions { background: choice, ..options() }, &recorder).unwrap();
        let image = dirty_image(&mut imager, false, &recorder).unwrap();
        let power = pattern.plane(&grid, 1.01e9);
        let worst = image.plane(0, 0).iter().zip(&power).map(|(v, a)| (f64::from(*v) - 250.0 * a).abs()).fold(0.0, f64::max);
        assert!(worst < 0.5, "{worst} K of 250 K");
        assert!(recorder.messages().iter().any(|m| m.contains(told)), "{:?}", recorder.messages());
    }
    let mut imager = Imager::new(&mut set, ImagingOptions { background: BackgroundChoice::None, ..options() }, &Silent).unwrap();
    let image = dirty_image(&mut imager, false, &Silent).unwrap();
    assert!(image.data.iter().zip(&pattern.plane(&grid, 1e9)).any(|(v, a)| (f64::from(*v) - 250.0 * a).abs() > 50.0));
}

//! Images of scenes near the array.

use super::*;
use crate::deconvolve::CleanOptions;
use crate::fixtures::{Recorder, positions};
use crate::nearfield::Focusing;
use crate::progress::Silent;
use crate::simulate::{Method, SimulateOptions, SkyModel, simulate_set};
use cittert_arrays::{
    Antenna, ArrayLayout, CoveragePlan, FocusPoint, LayoutFrame, PhaseCenter, Source, SpectralWindow, Track, VisUnit, VisibilitySet,
    Weighting,
};
use ndarray::Array2;

const WAVELENGTH_M: f64 = 3.2e-3;

/// Sources seen by 40 elements of an aperture of 1 m at 3.2 mm.
fn set(range: Option<&str>, sources: Vec<Source>, pattern: &str) -> VisibilitySet {
    let antennas = positions(40, 0.5, 0.0, 4).iter().enumerate().map(|(k, p)| Antenna::new(format!("a{k}"), k as u32, *p)).collect();
    let mut layout = ArrayLayout::new("test", LayoutFrame::Boresight, antennas).unwrap();
    layout.pattern = pattern.parse().unwrap();
    let center = PhaseCenter::unprojected("boresight");
    let rows = CoveragePlan::track(&layout, &center, &Track::new(2_460_000.5, 2.0, 1.0)).unwrap().coverage().unwrap();
    let options = SimulateOptions { range: range.map(|r| r.parse().unwrap()), method: Method::Dft, ..SimulateOptions::default() };
    let header = options.header(layout, SpectralWindow::band(299_792_458.0 / WAVELENGTH_M, 2e9, 2).unwrap(), center, VisUnit::Jy);
    simulate_set(header, &rows, &SkyModel::of_sources(sources), &options, &Silent).unwrap()
}

fn options(size: usize, cell: f64, range: Option<&str>) -> ImagingOptions {
    ImagingOptions {
        size: Some(ImageSize::square(size)),
        cell: Some(cittert_arrays::quantity::Angle(cell)),
        weighting: Weighting::Natural,
        range: range.map(|r| r.parse().unwrap()),
        ..ImagingOptions::default()
    }
}

/// The place of the highest pixel, refined by a parabola, and its value.
fn peak(imager: &Imager<'_>, image: &Array2<f64>) -> (f64, f64, f64) {
    let ((r, c), top) = image.indexed_iter().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
    let shift = |a: f64, b: f64, c: f64| 0.5 * (a - c) / (a - 2.0 * b + c);
    let dr = shift(image[(r - 1, c)], *top, image[(r + 1, c)]);
    let dc = shift(image[(r, c - 1)], *top, image[(r, c + 1)]);
    (imager.grid().l_at(c as f64 + dc), imager.grid().m_at(r as f64 + dr), *top)
}

#[test]
fn a_point_is_found_within_a_tenth_of_a_beam_over_14_degrees() {
    // Fringes of 3.2 mrad, 7 degrees to each side.
    for (degrees, along) in [(0.0_f64, 0.6_f64), (3.0, 2.0), (7.0, 0.3), (7.0, 4.0)] {
        let (l, m) = (degrees.to_radians().sin() * along.cos(), degrees.to_radians().sin() * along.sin());
        for range in ["10m", "31.25m"] {
            let mut set = set(Some(range), vec![Source::point(l, m, 2.0)], "none");
            // The whole field at a pixel of a third of a fringe would take long: a field of 0.26 rad in pixels of 2 mrad holds all of these places.
            let mut imager = Imager::new(&mut set, options(130, 2e-3, Some("auto")), &Silent).unwrap();
            let beam = imager.restoring_beam(0, &Silent).unwrap().unwrap();
            let image = imager.dirty(0, &Silent).unwrap();
            let (l1, m1, _) = peak(&imager, &image);
            let off = (l1 - l).hypot(m1 - m) / beam.bmin_rad;
            assert!(off < 0.1, "{degrees} deg, {range}: {off} beams");
        }
    }
}

#[test]
fn at_infinity_the_images_are_those_of_the_fourier_transform() {
    let sources = vec![Source::point(0.02, -0.03, 2.0), Source::point(-0.01, 0.01, 1.0)];
    let mut set = set(None, sources, "none");
    let model = Array2::from_shape_fn((64, 64), |(r, c)| if (r, c) == (20, 40) { 0.7 } else { 0.0 });
    let mut run = |range| {
        let mut imager = Imager::new(&mut set, ImagingOptions { epsilon: 1e-9, ..options(64, 1.2e-3, range) }, &Silent).unwrap();
        let dirty = imager.dirty(0, &Silent).unwrap();
        let psf = imager.psf(0, &Silent).unwrap();
        let residual = imager.residual(0, model.view(), &Silent).unwrap();
        let misfit = imager.chi_squared(0, model.view().into(), &Silent).unwrap();
        (dirty, psf, residual, misfit)
    };
    let (far, near) = (run(None), run(Some("1e14m")));
    let worst = |a: &Array2<f64>, b: &Array2<f64>| {
        (a - b).iter().fold(0.0_f64, |m, d| m.max(d.abs())) / b.iter().fold(0.0_f64, |m, d| m.max(d.abs()))
    };
    assert!(worst(&near.0, &far.0) < 1e-7 && worst(&near.1, &far.1) < 1e-7 && worst(&near.2.image, &far.2.image) < 1e-7);
    assert!((near.2.chi2_per_datum / far.2.chi2_per_datum - 1.0).abs() < 1e-7 && (near.3.chi2 / far.3.chi2 - 1.0).abs() < 1e-7);
    assert!(worst(&near.3.gradient, &far.3.gradient) < 1e-7);
}

#[test]
fn the_gradient_of_chi_squared_is_that_of_finite_differences() {
    let mut set = set(Some("6m"), vec![Source::point(0.05, -0.03, 2.0)], "gaussian fwhm_deg=12");
    let mut imager = Imager::new(&mut set, ImagingOptions { epsilon: 1e-9, ..options(24, 8e-3, Some("auto")) }, &Silent).unwrap();
    let model = Array2::from_shape_fn((24, 24), |(r, c)| 0.01 * ((r * 5 + c * 3) % 7) as f64);
    let slope = imager.chi_squared(0, model.view().into(), &Silent).unwrap().gradient;
    let top = slope.iter().fold(0.0_f64, |a, g| a.max(g.abs()));
    for at in [(3, 4), (12, 12), (20, 2)] {
        let mut moved = |x: f64| {
            let mut m = model.clone();
            m[at] += x;
            imager.chi_squared(0, m.into(), &Silent).unwrap().chi2
        };
        let numeric = (moved(1e-3) - moved(-1e-3)) / 2e-3;
        assert!((numeric - slope[at]).abs() < 1e-6 * top, "{at:?}: {numeric} {}", slope[at]);
    }
}

#[test]
fn a_focused_set_gives_the_same_exact_image_and_a_sharp_fourier_image_of_the_focus() {
    let (l, m) = (0.06, -0.036);
    let mut plain = set(Some("10m"), vec![Source::point(l, m, 2.0)], "none");
    let focus = FocusPoint::new(l, m, 10.0 / (1.0_f64 - l * l - m * m).sqrt()).unwrap();
    let focusing = Focusing::new(&plain.header, Some(focus)).unwrap();
    let mut focused = plain.clone();
    focused.header = focusing.header().clone();
    focusing.apply(&mut focused.data, 0).unwrap();
    assert!(focused.data.vis.iter().all(|v| v.arg().abs() < 1e-5 && v.norm() > 1.9), "the phase of a point at the focus is 0");
    assert_eq!(focused.data.coverage, plain.data.coverage);
    let dirty = |set: &mut VisibilitySet, range| {
        let mut imager = Imager::new(set, options(128, 1.2e-3, range), &Silent).unwrap();
        let image = imager.dirty(0, &Silent).unwrap();
        let peak = peak(&imager, &image);
        (image, peak)
    };
    let (a, b) = (dirty(&mut plain, Some("auto")), dirty(&mut focused, Some("auto")));
    assert!((&a.0 - &b.0).iter().all(|d| d.abs() < 1e-4));
    // The Fourier image keeps the boresight in its middle, and shows the point at its place.
    let (_, (l1, m1, top)) = dirty(&mut focused, None);
    assert!((l1 - l).hypot(m1 - m) < 2e-4 && (top - 2.0).abs() < 0.02, "{l1} {m1} {top}");
    let (_, (_, _, blurred)) = dirty(&mut plain, None);
    // Out of focus it is speckle of 40 random phases, whose highest peak is about S ln(pixels) / 40 = 0.49.
    assert!(blurred < 0.6, "{blurred}");
    // Back to infinity.
    let back = Focusing::new(&focused.header, None).unwrap();
    back.apply(&mut focused.data, 0).unwrap();
    let worst = focused.data.vis.iter().zip(&plain.data.vis).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
    assert!(worst < 1e-6 && back.header().near_field.focus.is_none());
}

#[test]
fn clean_finds_points_all_over_the_near_field() {
    let truth = [(0.0, 0.0, 1.0), (0.1, -0.08, 2.0), (-0.12, 0.02, 1.5)];
    let mut set = set(Some("5m"), truth.iter().map(|(l, m, s)| Source::point(*l, *m, *s)).collect(), "none");
    let mut imager = Imager::new(&mut set, options(140, 2e-3, Some("auto")), &Silent).unwrap();
    let cleaned = clean(&mut imager, &CleanOptions { niter: 400, gain: 0.2, ..CleanOptions::default() }, &Silent).unwrap();
    for (l, m, s) in truth {
        let (c, r) = (cleaned.model.grid.column_of(l).round() as usize, cleaned.model.grid.row_of(m).round() as usize);
        let flux: f64 = cleaned.model.plane(0, 0).slice(ndarray::s![r - 1..r + 2, c - 1..c + 2]).sum();
        assert!((flux / s - 1.0).abs() < 0.02, "{l} {m}: {flux}");
    }
    assert!(cleaned.statistics.residual_peak < 0.02, "{}", cleaned.statistics.residual_peak);
    assert!(cleaned.model.near_field.scene.is_some());
}

#[test]
fn a_fourier_image_of_a_near_scene_is_warned_of() {
    let mut set = set(Some("10m"), vec![Source::point(0.0, 0.0, 1.0)], "none");
    let warned = |set: &mut VisibilitySet, options: ImagingOptions| {
        let recorder = Recorder::default();
        Imager::new(set, options, &recorder).map(|_| recorder.messages().join("\n"))
    };
    assert!(warned(&mut set, options(128, 1.2e-3, None)).unwrap().contains("not focused"));
    set.header.near_field.focus = Some(FocusPoint::new(0.0, 0.0, 10.0).unwrap());
    assert!(warned(&mut set, options(256, 1.2e-3, None)).unwrap().contains("beyond the surroundings of the focus"));
    assert!(!warned(&mut set, options(64, 1.2e-3, None)).unwrap().contains("residual phase"));
    set.header.near_field = Default::default();
    assert!(!warned(&mut set, options(128, 1.2e-3, None)).unwrap().contains("residual phase"));
    assert!(warned(&mut set, options(128, 1.2e-3, Some("auto"))).unwrap_err().to_string().contains("does not say where its scene is"));
}

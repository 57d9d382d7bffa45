//! Tests of whole simulations.

use super::*;
use crate::fixtures::Recorder;
use crate::fourier::GridOptions;
use crate::fourier::fixtures::vis_to_image;
use crate::progress::Silent;
use cittert_arrays::quantity::Length;
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, Image, LayoutFrame, PhaseCenter, Polarization, Sensitivity, SkyFrame, SkyGrid, Source,
    SourceShape, SpectralWindow, UvCoverage, VisUnit, VisibilityHeader,
};
use ndarray::{Array2, Array4};
use num_complex::Complex64;

pub(super) fn header(unit: VisUnit, spectrum: SpectralWindow, products: &[Polarization]) -> VisibilityHeader {
    let antennas = (0..6_u32).map(|k| Antenna {
        sensitivity: Some(Sensitivity::SefdJy(100.0)),
        ..Antenna::new(format!("A{k}"), k, [f64::from(k * k), 0.0, 0.0])
    });
    VisibilityHeader {
        layout: ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap(),
        spectrum,
        polarizations: products.to_vec(),
        phase_centers: vec![PhaseCenter::unprojected("b")],
        unit,
        telescope: "t".into(),
        instrument: "t".into(),
        pedestal_k: None,
        scene_pedestal_k: None,
        scene_width_rad: None,
        antenna_temperature_k: None,
        near_field: Default::default(),
        annotations: Default::default(),
        history: Vec::new(),
    }
}

/// Baselines of up to `longest` m in all directions, with a w of up to half of that.
pub(super) fn coverage(rows: usize, longest: f64) -> UvCoverage {
    let uvw = Array2::from_shape_fn((rows, 3), |(r, axis)| {
        let (angle, length) = (2.4 * r as f64, longest * ((r as f64 + 1.0) / rows as f64).sqrt());
        [length * angle.cos(), length * angle.sin(), 0.5 * longest * (0.7 * r as f64).sin()][axis]
    });
    let ant1 = (0..rows as u32).map(|r| r % 5).collect();
    UvCoverage::new(uvw, ant1, vec![5; rows], vec![2_460_000.5; rows], vec![1.0; rows], vec![0; rows]).unwrap()
}

pub(super) fn scene(n: usize, cell: f64, unit: BrightnessUnit, value: impl Fn(usize, usize) -> f64) -> Image {
    let grid = SkyGrid::new(n, n, cell, SkyFrame::Boresight).unwrap();
    let data = Array4::from_shape_fn((1, 1, n, n), |(_, _, r, c)| value(r, c));
    Image::new(grid, SpectralWindow::band(1e9, 1e8, 1).unwrap(), vec![Polarization::I], data, unit).unwrap()
}

fn exact() -> SimulateOptions {
    SimulateOptions { method: Method::Dft, ..SimulateOptions::default() }
}

fn simulate(header: &VisibilityHeader, rows: &UvCoverage, sky: &SkyModel, options: &SimulateOptions) -> cittert_arrays::VisibilitySet {
    simulate_set(header.clone(), rows, sky, options, &Silent).unwrap()
}

fn wide(v: num_complex::Complex<f32>) -> Complex64 {
    Complex64::new(f64::from(v.re), f64::from(v.im))
}

#[test]
fn degrid_reaches_the_requested_accuracy_with_the_w_term() {
    let h = header(VisUnit::Jy, SpectralWindow::band(1e9, 2e8, 3).unwrap(), &[Polarization::I]);
    let rows = coverage(60, 30.0);
    let image = scene(64, 4e-3, BrightnessUnit::JyPerPixel, |r, c| ((r * 31 + c * 17) % 13) as f64);
    let total: f64 = image.data.sum();
    let sky = SkyModel::of_image(image);
    for w_term in [true, false] {
        let truth = simulate(&h, &rows, &sky, &SimulateOptions { no_w: !w_term, ..exact() });
        for epsilon in [1e-3, 1e-5, 1e-7] {
            let options = SimulateOptions { epsilon, no_w: !w_term, ..SimulateOptions::default() };
            let fast = simulate(&h, &rows, &sky, &options);
            let worst = fast.data.vis.iter().zip(&truth.data.vis).map(|(a, b)| (wide(*a) - wide(*b)).norm()).fold(0.0, f64::max);
            assert!(worst <= epsilon * total, "w {w_term}, epsilon {epsilon:e}: {:e}", worst / total);
        }
    }
}

#[test]
fn a_point_gives_the_closed_form_in_every_product() {
    let h = header(VisUnit::Jy, SpectralWindow::band(1e9, 2e8, 3).unwrap(), &[Polarization::XX, Polarization::XY, Polarization::YY]);
    let rows = coverage(20, 30.0);
    let (l, m) = (0.012, 0.005);
    let source = Source { spectral_index: -0.7, ref_freq_hz: Some(1e9), ..Source::point(l, m, 2.0) };
    let set = simulate(&h, &rows, &SkyModel::of_sources(vec![source]), &exact());
    let nm1 = (1.0_f64 - l * l - m * m).sqrt() - 1.0;
    for ((row, chan, pol), v) in set.data.vis.indexed_iter() {
        let f = h.spectrum.freq_hz()[chan];
        let uvw = rows.uvw_m.row(row);
        let phase = std::f64::consts::TAU * (uvw[0] * l + uvw[1] * m + uvw[2] * nm1) * f / 299_792_458.0;
        let truth = if pol == 1 { Complex64::ZERO } else { Complex64::from_polar(2.0 * (f / 1e9).powf(-0.7), phase) };
        assert!((wide(*v) - truth).norm() < 3e-7, "{row} {chan} {pol}");
    }
}

#[test]
fn a_uniform_scene_in_kelvin_has_its_solid_angle_at_the_zero_spacing() {
    let h = header(VisUnit::KelvinSr, SpectralWindow::band(94e9, 1e9, 1).unwrap(), &[Polarization::I]);
    let mut rows = coverage(2, 1.0);
    rows.uvw_m.fill(0.0);
    let image = scene(64, 0.01, BrightnessUnit::Kelvin, |_, _| 300.0);
    // Integral of 1 / sqrt(1 - l^2 - m^2) over the square that the cells cover, from the series of the square root.
    let truth: f64 = 300.0
        * (0..64)
            .flat_map(|r| (0..64).map(move |c| (r, c)))
            .map(|(r, c)| {
                let (l, m) = (image.grid.l_at(f64::from(c)), image.grid.m_at(f64::from(r)));
                1e-4 / (1.0 - l * l - m * m).sqrt()
            })
            .sum::<f64>();
    let sky = SkyModel::of_image(image);
    let go = |options: SimulateOptions| {
        let set = simulate(&h, &rows, &sky, &SimulateOptions { method: Method::Dft, ..options });
        (f64::from(set.data.vis[[0, 0, 0]].re), set.header.pedestal_k)
    };
    let (v, none) = go(SimulateOptions { pedestal: Pedestal::None, ..exact() });
    assert!((v / truth - 1.0).abs() < 1e-6 && none.is_none(), "{v} {truth}");
    let (v, _) = go(SimulateOptions { pedestal: Pedestal::None, one_over_n: false, ..exact() });
    assert!((v / (300.0 * 64.0 * 64.0 * 1e-4) - 1.0).abs() < 1e-6);
    let (v, pedestal) = go(exact());
    assert!(v.abs() < 1e-6 * truth && (pedestal.unwrap() - 300.0).abs() < 1e-9, "{v} {pedestal:?}");
    // In Jy the same scene is 2 k / lambda^2 as bright.
    let jy = VisibilityHeader { unit: VisUnit::Jy, ..h.clone() };
    let set = simulate(&jy, &rows, &sky, &exact());
    assert!((f64::from(set.data.vis[[0, 0, 0]].re) / (truth * jy_per_kelvin_sr(94e9)) - 1.0).abs() < 1e-6);
}

#[test]
fn sub_channels_smear_by_the_sinc_of_the_channel() {
    // One channel of 100 MHz; a delay of 10 ns turns the phase once across it.
    let spectrum = SpectralWindow::band(1e9, 1e8, 1).unwrap();
    let h = header(VisUnit::Jy, spectrum, &[Polarization::I]);
    let (l, delay_s) = (0.05, 4e-9);
    let mut rows = coverage(1, 1.0);
    rows.uvw_m.row_mut(0).assign(&ndarray::arr1(&[delay_s * 299_792_458.0 / l, 0.0, 0.0]));
    let go = |subchannels| {
        let set = simulate(&h, &rows, &SkyModel::of_sources(vec![Source::point(l, 0.0, 1.0)]), &SimulateOptions { subchannels, ..exact() });
        wide(set.data.vis[[0, 0, 0]])
    };
    let x = std::f64::consts::PI * 1e8 * delay_s;
    let truth = Complex64::from_polar(x.sin() / x, std::f64::consts::TAU * 1e9 * delay_s);
    assert!((go(64) - truth).norm() < 1e-4, "{} {truth}", go(64));
    assert!((go(1).norm() - 1.0).abs() < 1e-6);
}

#[test]
fn the_pattern_scales_images_and_sources_channel_by_channel() {
    let h = header(VisUnit::Jy, SpectralWindow::band(1e9, 4e8, 2).unwrap(), &[Polarization::I]);
    let rows = coverage(12, 20.0);
    let pattern = "airy diameter_m=3".parse::<ElementPattern>().unwrap();
    let mut image = scene(32, 4e-3, BrightnessUnit::JyPerPixel, |_, _| 0.0);
    image.data[[0, 0, 20, 25]] = 1.5;
    let (l, m) = (image.grid.l_at(25.0), image.grid.m_at(20.0));
    let options = SimulateOptions { element: Element::Airy, element_diameter: Some(Length(3.0)), ..exact() };
    let a = simulate(&h, &rows, &SkyModel::of_image(image), &options);
    let b = simulate(&h, &rows, &SkyModel::of_sources(vec![Source::point(l, m, 1.5)]), &options);
    for (x, y) in a.data.vis.iter().zip(&b.data.vis) {
        assert!((wide(*x) - wide(*y)).norm() < 1e-6);
    }
    let truth = 1.5 * pattern.power(l, m, h.spectrum.freq_hz()[1]);
    assert!((f64::from(a.data.vis[[3, 1, 0]].norm()) - truth).abs() < 1e-6 && truth < 1.4);
}

#[test]
fn the_mask_method_moves_sources_and_images_alike_and_flags_what_is_outside() {
    let h = header(VisUnit::Jy, SpectralWindow::band(1e9, 4e8, 2).unwrap(), &[Polarization::I]);
    let rows = coverage(40, 25.0);
    let mut image = scene(32, 6e-3, BrightnessUnit::JyPerPixel, |_, _| 0.0);
    image.data[[0, 0, 20, 25]] = 1.5;
    let (l, m) = (image.grid.l_at(25.0), image.grid.m_at(20.0));
    let options = SimulateOptions { method: Method::Mask, ..exact() };
    let empty = scene(32, 6e-3, BrightnessUnit::JyPerPixel, |_, _| 0.0);
    let both = SkyModel { images: vec![image], sources: vec![Source::point(l, m, -1.5)], surface: None };
    let set = simulate(&h, &rows, &both, &options);
    assert!(set.data.vis.iter().all(|v| v.norm() < 1e-6), "the negative source cancels the pixel");
    // 1 / (2 cell) = 83.3 wavelengths; 25 m at 1.1 GHz are 91.7.
    let recorder = Recorder::default();
    let set = simulate_set(h, &rows, &SkyModel::of_image(empty), &options, &recorder).unwrap();
    let flagged = set.data.flags.iter().filter(|f| **f).count();
    assert!(flagged > 0 && flagged < 20, "{flagged}");
    assert!(recorder.messages().iter().any(|m| m.contains("outside")), "{:?}", recorder.messages());
}

#[test]
fn blocks_of_any_size_give_the_same_set() {
    let h = header(VisUnit::Jy, SpectralWindow::band(1e9, 2e8, 2).unwrap(), &[Polarization::RR, Polarization::LL]);
    let rows = coverage(37, 30.0);
    let mut gaussian = Source::point(0.01, 0.0, 3.0);
    gaussian.shape = SourceShape::Gaussian { major_rad: 0.01, minor_rad: 0.004, pa_rad: 0.3 };
    let sky = SkyModel {
        images: vec![scene(16, 4e-3, BrightnessUnit::JyPerPixel, |r, c| (r * c) as f64)],
        sources: vec![gaussian],
        surface: None,
    };
    let options = SimulateOptions { noise: true, seed: 5, ..exact() };
    let whole = simulate(&h, &rows, &sky, &options);
    let mut parts = whole.clone();
    parts.data = parts.data.rows(0..0).unwrap();
    let mut simulator = Simulator::new(h, &sky, &options, &Silent).unwrap();
    let mut blocks = [0..10, 10..11, 11..37].into_iter().map(|r| rows.rows(r));
    let summary = simulator.run(&mut blocks, Some(37), &mut parts, &Silent).unwrap();
    assert_eq!((summary.rows, summary.visibilities), (37, 148));
    assert_eq!(parts, whole);
}

#[test]
fn what_cannot_be_simulated_is_refused_and_doubts_are_told() {
    let h = header(VisUnit::Jy, SpectralWindow::band(1e9, 2e8, 1).unwrap(), &[Polarization::I]);
    let say =
        |sky: &SkyModel, options: &SimulateOptions| Simulator::new(h.clone(), sky, options, &Silent).err().map(|e| e.to_string()).unwrap();
    assert!(say(&SkyModel::default(), &exact()).contains("neither"));
    let mut blank = scene(8, 1e-3, BrightnessUnit::JyPerPixel, |_, _| 1.0);
    blank.data[[0, 0, 2, 3]] = f64::NAN;
    assert!(say(&SkyModel::of_image(blank), &exact()).contains("column 3, row 2"));
    let good = SkyModel::of_sources(vec![Source::point(0.0, 0.0, 1.0)]);
    assert!(say(&good, &SimulateOptions { subchannels: 0, ..exact() }).contains("subchannels"));
    assert!(say(&good, &SimulateOptions { epsilon: f64::NAN, ..exact() }).contains("epsilon"));
    assert!(say(&good, &SimulateOptions { method: Method::Mask, ..exact() }).contains("mask"));
    let recorder = Recorder::default();
    let coarse = SkyModel::of_image(scene(8, 0.02, BrightnessUnit::JyPerPixel, |_, _| 1.0));
    simulate_set(h, &coverage(4, 30.0), &coarse, &exact(), &recorder).unwrap();
    let told: Vec<String> = recorder.messages().into_iter().filter(|m| m.contains("longest baseline")).collect();
    assert_eq!(told.len(), 1, "{told:?}");
}

#[test]
fn the_dirty_image_of_an_empty_field_has_the_rms_of_the_formula() {
    let h = header(VisUnit::Jy, SpectralWindow::band(1e9, 2e8, 2).unwrap(), &[Polarization::I]);
    let rows = coverage(700, 40.0);
    let grid = SkyGrid::new(48, 48, 2e-3, SkyFrame::Boresight).unwrap();
    let nothing = SkyModel::of_sources(vec![Source::point(0.0, 0.0, 0.0)]);
    let options = GridOptions { epsilon: 1e-4, w_term: true, divide_by_n: false, ..GridOptions::default() };
    let mut sum = 0.0;
    let seeds = 20;
    for seed in 0..seeds {
        let set = simulate(&h, &rows, &nothing, &SimulateOptions { noise: true, seed, ..exact() });
        let vis = Array2::from_shape_fn((700, 2), |(r, c)| wide(set.data.vis[[r, c, 0]]));
        let weights = Array2::from_shape_fn((700, 2), |(r, c)| f64::from(set.data.weights[[r, c, 0]]));
        let freq = h.spectrum.freq_hz();
        let dirty = vis_to_image(&grid, rows.uvw_m.view(), freq, vis.view(), weights.view(), &options).unwrap() / weights.sum();
        sum += dirty.iter().map(|v| v * v).sum::<f64>() / dirty.len() as f64;
    }
    let rms = (sum / seeds as f64).sqrt();
    // sigma / sqrt(number of visibilities), sigma = SEFD / sqrt(2 B t) for each part.
    let truth = 100.0 / (2.0 * 1e8 * 1.0_f64).sqrt() / 1400.0_f64.sqrt();
    assert!((rms / truth - 1.0).abs() < 0.03, "{}", rms / truth);
}

//! Compares beams and images of small sets with the direct sum and with formulas.

use super::*;
use crate::deconvolve::by_name;
use crate::fixtures::Recorder;
use crate::fixtures::{positions, snapshot};
use crate::fourier::fixtures::vis_to_image_exact;
use crate::memory::MemoryBudget;
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Polarization, SPEED_OF_LIGHT_M_S, VisUnit, VisibilitySet};
use major::{CleanOptions, StopReason};
use ndarray::{Array2, s};
use num_complex::Complex64;

const GHZ: f64 = 94e9;

fn options(n: usize, cell: f64) -> ImagingOptions {
    ImagingOptions {
        size: Some(ImageSize::square(n)),
        cell: Some(Angle(cell)),
        weighting: Weighting::Natural,
        epsilon: 1e-6,
        ..ImagingOptions::default()
    }
}

fn points(set_sigma: f64) -> VisibilitySet {
    let sources = [(0.012, 0.005, 1.0), (-0.004, 0.009, 0.4)];
    snapshot(&positions(24, 0.5, 0.01, 3), &[GHZ, 1.01 * GHZ], &[Polarization::I], &sources, (set_sigma, VisUnit::Jy))
}

#[test]
fn the_beam_of_a_snapshot_is_the_array_factor() {
    let places = positions(12, 0.4, 0.0, 5);
    let mut set = snapshot(&places, &[GHZ], &[Polarization::I], &[], (0.0, VisUnit::Jy));
    let mut imager = Imager::new(&mut set, options(64, 1e-3), &Silent).unwrap();
    let psf = imager.psf(0, &Silent).unwrap();
    assert_eq!(psf[(32, 32)], 1.0);
    let n = places.len() as f64;
    let wavelength = SPEED_OF_LIGHT_M_S / GHZ;
    let grid = imager.grid();
    for ((i, j), v) in psf.indexed_iter() {
        let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
        let af: Complex64 =
            places.iter().map(|p| Complex64::from_polar(1.0, std::f64::consts::TAU * (p[0] * l + p[1] * m) / wavelength)).sum();
        assert!((v - (af.norm_sqr() - n) / (n * (n - 1.0))).abs() < 1e-5);
    }
}

/// Column and row of the density cell of (u, v) wavelengths: cells of 1 / (2 n cell), folded to v >= 0. This code is independent of the
/// code under test.
fn density_cell(n: usize, cell_rad: f64, u: f64, v: f64) -> (i64, i64) {
    let (u, v) = if v < 0.0 { (-u, -v) } else { (u, v) };
    let per_wavelength = 2.0 * n as f64 * cell_rad;
    ((u * per_wavelength).floor() as i64, (v * per_wavelength).floor() as i64)
}

/// The factor of each cell by the formulas of the book (Briggs 1995), from cells and weights.
fn expected_factors(weighting: Weighting, robust: f64, data: impl Iterator<Item = ((i64, i64), f64)>) -> impl Fn((i64, i64)) -> f64 {
    let mut density = std::collections::BTreeMap::<(i64, i64), f64>::new();
    data.filter(|(_, w)| *w > 0.0).for_each(|(cell, w)| *density.entry(cell).or_default() += w);
    let (sum, squares) = density.values().fold((0.0, 0.0), |(s, q), w| (s + w, q + w * w));
    move |cell: (i64, i64)| match weighting {
        Weighting::Natural => 1.0,
        Weighting::Briggs => 1.0 / (1.0 + density[&cell] * (5.0 * 10f64.powf(-robust)).powi(2) / (squares / sum)),
        Weighting::Uniform => {
            let near = |c: &(i64, i64)| (-8..8).contains(&(c.0 - cell.0)) && (-8..8).contains(&(c.1 - cell.1));
            let around: Vec<f64> = density.iter().filter(|(c, _)| near(c)).map(|(_, w)| 1.0 / w).collect();
            (1.0 / density[&cell]).min(3.0 * around.iter().sum::<f64>() / around.len() as f64)
        }
    }
}

#[test]
fn autocorrelations_are_in_no_image() {
    let mut cross = points(0.02);
    let mut both = cross.clone();
    let mut powers = cross.data.clone();
    powers.coverage.ant2.clone_from(&powers.coverage.ant1);
    powers.coverage.uvw_m.fill(0.0);
    powers.vis.fill(num_complex::Complex32::new(1e4, 0.0));
    both.data.append(&powers).unwrap();
    for weighting in [Weighting::Natural, Weighting::Uniform, Weighting::Briggs] {
        let image = |set: &mut VisibilitySet| {
            let recorder = Recorder::default();
            let mut imager = Imager::new(set, ImagingOptions { weighting, ..options(48, 1.5e-3) }, &recorder).unwrap();
            (imager.dirty(0, &Silent).unwrap(), imager.survey().counts.autocorrelations, recorder.messages())
        };
        let ((wanted, none, _), (found, count, said)) = (image(&mut cross), image(&mut both));
        assert_eq!((none, count), (0, powers.vis.len() as u64));
        let apart = (&found - &wanted).iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        assert!(apart < 1e-6 * wanted.iter().fold(0.0_f64, |a, v| a.max(v.abs())), "{apart}");
        assert!(said.iter().any(|m| m.contains(&format!("{count} are autocorrelations"))), "{said:?}");
    }
}

#[test]
fn dirty_images_agree_with_the_direct_sum_for_every_scheme_of_weights() {
    let mut set = points(0.02);
    set.data.flags[(3, 0, 0)] = true;
    set.data.vis[(5, 1, 0)].re = f32::NAN;
    set.data.weights[(7, 0, 0)] = f32::INFINITY;
    set.data.weights.slice_mut(s![20..60, .., ..]).mapv_inplace(|w| w * 3.0);
    let (uvw, freq) = (set.data.coverage.uvw_m.clone(), set.header.spectrum.freq_hz().to_vec());
    let (data_weights, flags) = (set.data.weights.clone(), set.data.flags.clone());
    for weighting in [Weighting::Natural, Weighting::Uniform, Weighting::Briggs] {
        let opts = ImagingOptions { weighting, ..options(48, 1.5e-3) };
        let recorder = Recorder::default();
        let mut imager = Imager::new(&mut set, opts, &recorder).unwrap();
        assert!(recorder.messages()[0].contains("1 of 552 visibilities"), "{:?}", recorder.messages());
        let dirty = imager.dirty(0, &Silent).unwrap();
        let mut vis = Array2::from_elem((uvw.nrows(), 2), Complex64::default());
        let mut weights = Array2::zeros(vis.dim());
        let grid = imager.grid().clone();
        let usable = |r: usize, c: usize| {
            let (w, v) = (data_weights[(r, c, 0)], set.data.vis[(r, c, 0)]);
            let good = !flags[(r, c, 0)] && w > 0.0 && w.is_finite() && v.re.is_finite() && v.im.is_finite();
            if good { f64::from(w) } else { 0.0 }
        };
        let cell = |r: usize, c: usize| {
            let per_hz = freq[c] / SPEED_OF_LIGHT_M_S;
            density_cell(grid.n_l, grid.cell_rad, uvw[(r, 0)] * per_hz, uvw[(r, 1)] * per_hz)
        };
        let factors =
            expected_factors(weighting, 0.0, (0..uvw.nrows()).flat_map(|r| [(cell(r, 0), usable(r, 0)), (cell(r, 1), usable(r, 1))]));
        for ((r, c), w) in weights.indexed_iter_mut() {
            *w = if usable(r, c) > 0.0 { usable(r, c) * factors(cell(r, c)) } else { 0.0 };
            if *w > 0.0 {
                let v = set.data.vis[(r, c, 0)];
                vis[(r, c)] = Complex64::new(v.re.into(), v.im.into());
            }
        }
        let exact = vis_to_image_exact(&grid, uvw.view(), &freq, (vis.view(), weights.view()), (true, false)) / weights.sum();
        let peak = exact.iter().copied().fold(0.0, f64::max);
        for (a, b) in dirty.iter().zip(&exact) {
            assert!((a - b).abs() < 2e-6 * peak, "{weighting:?}: {a} {b}");
        }
    }
}

#[test]
fn sources_come_out_where_they_were_put() {
    let mut set = points(0.0);
    let mut imager = Imager::new(&mut set, options(64, 1e-3), &Silent).unwrap();
    let dirty = imager.dirty(0, &Silent).unwrap();
    let (at, top) = dirty.indexed_iter().fold(((0, 0), 0.0), |b, (i, v)| if *v > b.1 { (i, *v) } else { b });
    assert_eq!(at, (37, 44));
    assert!((top - 1.0).abs() < 0.1, "{top}");
}

#[test]
fn a_stream_in_small_blocks_without_cache_gives_the_same_image() {
    let mut set = points(0.05);
    let opts = ImagingOptions { weighting: Weighting::Briggs, robust: Some(0.5), channels_out: 2, ..options(32, 2e-3) };
    let mut cached = Imager::new(&mut set, opts.clone(), &Silent).unwrap();
    let a = (cached.dirty(1, &Silent).unwrap(), cached.psf(0, &Silent).unwrap());
    let model = Array2::from_shape_fn((32, 32), |(i, j)| f64::from((i == 20 && j == 11) as u8));
    let ra = cached.residual(1, model.view(), &Silent).unwrap();
    let mut streamed = Imager::new(&mut set, ImagingOptions { memory: MemoryBudget::new(16 << 20).unwrap(), ..opts }, &Silent).unwrap();
    let b = (streamed.dirty(1, &Silent).unwrap(), streamed.psf(0, &Silent).unwrap());
    let rb = streamed.residual(1, model.view(), &Silent).unwrap();
    let close = |x: &Array2<f64>, y: &Array2<f64>| x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-12);
    assert!(close(&a.0, &b.0) && close(&a.1, &b.1) && close(&ra.image, &rb.image));
    assert!((ra.chi2_per_datum - rb.chi2_per_datum).abs() < 1e-9 * ra.chi2_per_datum);
}

#[test]
fn the_residual_of_the_true_model_is_noise_with_a_chi_squared_of_one() {
    let sources = [(0.006, -0.009, 2.0)];
    let mut set = snapshot(&positions(30, 0.4, 0.05, 1), &[GHZ], &[Polarization::RR, Polarization::LL], &sources, (0.1, VisUnit::Jy));
    let mut imager = Imager::new(&mut set, options(40, 1.5e-3), &Silent).unwrap();
    let mut model = Array2::zeros((40, 40));
    model[(14, 24)] = 2.0;
    let r = imager.residual(0, model.view(), &Silent).unwrap();
    assert!((r.chi2_per_datum - 1.0).abs() < 0.1, "{}", r.chi2_per_datum);
    // Noise of the mean of 435 visibilities of two hands: 0.1 / sqrt(870).
    let rms = (r.image.iter().map(|v| v * v).sum::<f64>() / 1600.0).sqrt();
    assert!((rms / (0.1 / 870f64.sqrt()) - 1.0).abs() < 0.25, "{rms}");
}

#[test]
fn clean_finds_both_sources_and_says_why_it_stopped() {
    for (name, major) in [("hogbom", true), ("clark", true), ("multiscale", true)] {
        let mut set = points(0.01);
        let mut imager = Imager::new(&mut set, options(64, 1e-3), &Silent).unwrap();
        let opts = CleanOptions { algorithm: by_name(name).unwrap().into(), niter: 3000, nsigma: 4.0, ..CleanOptions::default() };
        let out = clean(&mut imager, &opts, &Silent).unwrap();
        let s = &out.statistics;
        assert_eq!(s.stop, [StopReason::Noise], "{name}: {s:?}");
        assert!((s.model_flux - 1.4).abs() < 0.02, "{name}: {s:?}");
        assert!(s.chi2_per_datum < 1.1 && s.dynamic_range > 300.0 && (s.major_cycles > 1) == major, "{name}: {s:?}");
        let near = |l: f64, m: f64| {
            let inside = out.components.iter().filter(|c| (c.l - l).hypot(c.m - m) < 2.5e-3);
            inside.map(|c| c.flux).sum::<f64>()
        };
        assert!((near(0.012, 0.005) - 1.0).abs() < 0.01 && (near(-0.004, 0.009) - 0.4).abs() < 0.01, "{name}");
        assert_eq!(out.restored.beams.len(), 1);
        let restored = out.restored.plane(0, 0);
        assert!((restored[(37, 44)] - 1.0).abs() < 0.02, "{}", restored[(37, 44)]);
    }
}

#[test]
fn a_set_in_kelvin_steradian_gives_kelvin_with_the_pedestal_back() {
    // A uniform patch of 50 K above a pedestal of 200 K, as one cell of flux.
    let cell = 2e-3;
    let flux = 50.0 * cell * cell;
    let mut set = snapshot(&positions(20, 0.3, 0.0, 4), &[GHZ], &[Polarization::I], &[(0.0, 0.0, flux)], (0.0, VisUnit::KelvinSr));
    set.header.pedestal_k = Some(200.0);
    let mut imager = Imager::new(&mut set, options(32, cell), &Silent).unwrap();
    let out = clean(&mut imager, &CleanOptions { gain: 1.0, niter: 1, ..CleanOptions::default() }, &Silent).unwrap();
    assert!((out.model.plane(0, 0)[(16, 16)] - 250.0).abs() < 1e-3);
    let seen = 50.0 * cell * cell / out.beams[0].solid_angle_sr();
    assert!((out.restored.plane(0, 0)[(16, 16)] - 200.0 - seen).abs() < 1e-3);
    assert!((out.dirty.plane(0, 0)[(16, 16)] - 200.0 - seen).abs() < 1e-3);
    assert!(out.residual.plane(0, 0)[(16, 16)].abs() < 1e-3);
    assert_eq!(out.model.unit, cittert_arrays::BrightnessUnit::Kelvin);
    assert_eq!(out.statistics.stop, [StopReason::Iterations]);
}

#[test]
fn size_and_cell_are_chosen_and_a_coarse_cell_is_warned_of() {
    let mut set = points(0.0);
    let recorder = Recorder::default();
    let imager = Imager::new(&mut set, ImagingOptions::default(), &recorder).unwrap();
    let g = imager.grid().clone();
    let (_, longest) = imager.survey().uv_range_wl;
    assert!((g.cell_rad * longest - 0.25).abs() < 1e-12 && g.n_l >= 64, "{g:?}");
    assert!(recorder.messages()[0].contains("chosen from the coverage"));
    // A simulated scene that is narrower than the field of the antennas sets the size, a wider one does not.
    let sizes = SizeTuning { least_side: 4, ..SizeTuning::default() };
    let width = |set: &mut VisibilitySet, scene| {
        set.header.scene_width_rad = scene;
        let grid = Imager::new(set, ImagingOptions { sizes, ..ImagingOptions::default() }, &Silent).unwrap().grid().clone();
        grid.n_l as f64 * grid.cell_rad
    };
    let field = width(&mut set, None);
    assert!((0.5..0.7).contains(&(width(&mut set, Some(0.5 * field)) / field)));
    assert_eq!(width(&mut set, Some(2.0 * field)), field);
    set.header.scene_width_rad = None;
    let recorder = Recorder::default();
    Imager::new(&mut set, options(16, 1e-2), &recorder).unwrap();
    assert!(recorder.messages()[0].contains("too coarse for the longest baseline"), "{:?}", recorder.messages());
}

#[test]
fn hostile_sets_give_errors_or_images_but_never_nan() {
    let mut flagged = points(0.0);
    flagged.data.flags.fill(true);
    let e = Imager::new(&mut flagged, options(16, 1e-3), &Silent).unwrap_err();
    assert!(e.to_string().contains("no usable visibility: 552 of 552"), "{e}");
    let mut zero = points(0.0);
    zero.data.weights.fill(0.0);
    assert!(Imager::new(&mut zero, options(16, 1e-3), &Silent).is_err());
    let mut one = points(0.0);
    one.data.flags.slice_mut(s![1.., .., ..]).fill(true);
    let mut imager = Imager::new(&mut one, options(16, 1e-3), &Silent).unwrap();
    assert!(imager.psf(0, &Silent).unwrap().iter().all(|v| v.is_finite() && v.abs() <= 1.0 + 1e-5));
    let mut lost = points(0.0);
    lost.data.coverage.uvw_m[(2, 1)] = f64::NAN;
    let recorder = Recorder::default();
    let mut imager = Imager::new(&mut lost, options(16, 1e-3), &recorder).unwrap();
    assert!(imager.dirty(0, &Silent).unwrap().iter().all(|v| v.is_finite()));
    assert!(recorder.messages()[0].contains("2 are not finite"), "{:?}", recorder.messages());
    for bad in [
        ImagingOptions { channels_out: 0, ..options(16, 1e-3) },
        ImagingOptions { channels_out: 3, ..options(16, 1e-3) },
        ImagingOptions { pol: Polarization::XX, ..options(16, 1e-3) },
        ImagingOptions { size: Some(ImageSize { columns: 1, rows: 64 }), ..options(16, 1e-3) },
        ImagingOptions { epsilon: 1e-20, ..options(16, 1e-3) },
    ] {
        let mut set = points(0.0);
        let failed = match Imager::new(&mut set, bad.clone(), &Silent) {
            Ok(mut imager) => imager.dirty(0, &Silent).is_err(),
            Err(_) => true,
        };
        assert!(failed, "{bad:?}");
    }
    let cancelled = Recorder::default();
    cancelled.cancel();
    assert!(Imager::new(&mut points(0.0), options(16, 1e-3), &cancelled).is_err());
}

use super::residuals::Residuals;
use super::{AntennaErrors, CrossCheck, Explained, ImageFacts, Levels, look_outside, of_image, of_pedestal, of_residuals};
use crate::calibrate::{Accuracy, ModelVisibilities, PointModel};
use crate::deconvolve::CleanOptions;
use crate::fixtures::{Noise, in_processes, positions, snapshot, swap_antennas};
use crate::imaging::{ImageSize, Imager, ImagingOptions, StopReason, clean};
use crate::progress::Silent;
use crate::simulate::{SimulateOptions, Simulator, SkyModel};
use cittert_arrays::quantity::Angle;
use cittert_arrays::{
    BrightnessUnit, Image, Polarization, RestoringBeam, SkyFrame, SkyGrid, Source, SourceShape, SpectralWindow, VisUnit, VisibilityBlock,
    VisibilitySet, VisibilitySource,
};
use ndarray::Array4;
use num_complex::Complex32;

const POINT: (f64, f64, f64) = (0.004, -0.003, 1.0);

/// 20 antennas, 16 channels, a point of 1 Jy with noise of 0.1 Jy in each real part.
fn observed(sources: &[(f64, f64, f64)]) -> VisibilitySet {
    let freq: Vec<f64> = (0..16).map(|c| 94e9 + 5e8 * f64::from(c)).collect();
    snapshot(&positions(20, 0.5, 0.0, 5), &freq, &[Polarization::I], sources, (0.1, VisUnit::Jy))
}

fn names(set: &mut VisibilitySet, model: &mut dyn ModelVisibilities, flux: f64) -> Vec<&'static str> {
    let residuals = Residuals::measure(set, model).unwrap().unwrap();
    of_residuals(&residuals, &|k| format!("a{k}"), Some(flux)).iter().map(|f| f.name).collect()
}

#[test]
fn a_right_model_draws_no_finding_and_a_wrong_one_does() {
    let mut set = observed(&[POINT]);
    let r = Residuals::measure(&mut set, &mut PointModel { l: POINT.0, m: POINT.1, flux: POINT.2 }).unwrap().unwrap();
    assert!((r.mean - 1.0).abs() < 0.05 && (r.typical - 1.0).abs() < 0.1 && r.unexplained < 1e-3 && r.outliers == 0.0, "{r:?}");
    assert_eq!(names(&mut set, &mut PointModel { l: POINT.0, m: POINT.1, flux: 1.0 }, 1.0), Vec::<&str>::new());
    assert_eq!(names(&mut set, &mut PointModel { l: -POINT.0, m: POINT.1, flux: 1.0 }, 1.0), ["chi_squared"]);
    assert_eq!(names(&mut set, &mut PointModel { l: POINT.0, m: POINT.1, flux: 0.6 }, 0.6), ["chi_squared", "missing_flux"]);
}

/// A polarised source differs between the hands, which an image of total intensity need not explain.
#[test]
fn a_polarised_source_is_no_misfit_of_total_intensity() {
    use Polarization::{XX, YY};
    let mut set = snapshot(&positions(20, 0.5, 0.0, 5), &[94e9, 95e9, 96e9, 97e9], &[XX, YY], &[POINT], (0.1, VisUnit::Jy));
    for mut hands in set.data.vis.rows_mut() {
        // Half of the flux is linearly polarised: V_XX - V_YY = 2 Q.
        let flux = 0.5 * (hands[0] + hands[1]);
        hands[0] += flux * 0.5;
        hands[1] -= flux * 0.5;
    }
    let mut model = PointModel { l: POINT.0, m: POINT.1, flux: POINT.2 };
    let r = Residuals::measure(&mut set, &mut model).unwrap().unwrap();
    assert!((r.mean - 1.0).abs() < 0.1 && r.unexplained < 2e-3 && r.samples == set.data.vis.len() / 2, "{r:?}");
    assert_eq!(names(&mut set, &mut model, 1.0), Vec::<&str>::new());
    // A flagged hand leaves the other, which has its polarisation.
    set.data.flags.slice_mut(ndarray::s![.., .., 1]).fill(true);
    assert!(Residuals::measure(&mut set, &mut model).unwrap().unwrap().unexplained > 0.1);
}

/// Fluxes that fall with frequency leave residuals that a flat model cannot explain.
#[test]
fn a_spectrum_is_told_from_other_misfits() {
    let bright = PointModel { l: POINT.0, m: POINT.1, flux: 10.0 * POINT.2 };
    let mut set = observed(&[(bright.l, bright.m, bright.flux)]);
    let middle = 94e9 + 5e8 * 7.5;
    for (c, mut chan) in set.data.vis.axis_iter_mut(ndarray::Axis(1)).enumerate() {
        let scale = ((94e9 + 5e8 * c as f64) / middle).powf(-1.5);
        chan.mapv_inplace(|v| v * scale as f32);
    }
    let r = Residuals::measure(&mut set, &mut bright.clone()).unwrap().unwrap();
    assert!((r.spectrum.index + 1.5).abs() < 0.1 && r.spectrum.share > 0.9, "{r:?}");
    assert!(super::left_beyond_noise(&r).unwrap().contains("--channels-out"), "{r:?}");
    // A point at another place is no spectrum.
    let mut wrong = PointModel { l: -POINT.0, ..bright };
    assert!(Residuals::measure(&mut set, &mut wrong).unwrap().unwrap().spectrum.share < 0.05);
}

#[test]
fn interference_and_swapped_antennas_are_named() {
    let mut model = PointModel { l: POINT.0, m: POINT.1, flux: POINT.2 };
    let mut set = observed(&[POINT]);
    let mut noise = Noise(3);
    set.data.vis.iter_mut().filter(|_| noise.next() > 0.96).for_each(|v| *v += Complex32::new(20.0, 0.0));
    assert_eq!(names(&mut set, &mut model, 1.0)[0], "interference");
    let mut set = observed(&[POINT]);
    swap_antennas(&mut set, 3, 11);
    let r = Residuals::measure(&mut set, &mut model).unwrap().unwrap();
    let findings = of_residuals(&r, &|k| format!("a{k}"), Some(1.0));
    let told = findings.iter().find(|f| f.name == "antennas").unwrap();
    assert!(told.says.contains("a3") && told.says.contains("a11") && !told.says.contains("a4"), "{told:?}");
}

/// Errors of antennas are told from interference, and from a source of another flux.
#[test]
fn errors_of_antennas_are_named() {
    let mut model = PointModel { l: POINT.0, m: POINT.1, flux: POINT.2 };
    let mut set = observed(&[POINT]);
    let gain = |antenna: u32| if antenna.is_multiple_of(2) { 1.2 } else { 0.8 };
    let VisibilityBlock { vis, coverage, .. } = &mut set.data;
    for ((mut row, p), q) in vis.outer_iter_mut().zip(&coverage.ant1).zip(&coverage.ant2) {
        row.mapv_inplace(|v| v * gain(*p) * gain(*q));
    }
    assert_eq!(names(&mut set, &mut model, 1.0)[..2], ["amplitudes", "chi_squared"]);
    let mut set = observed(&[POINT]);
    let VisibilityBlock { vis, coverage, .. } = &mut set.data;
    for ((mut row, p), q) in vis.outer_iter_mut().zip(&coverage.ant1).zip(&coverage.ant2) {
        let phase = |antenna: u32| 0.1 * (antenna * antenna % 7) as f32;
        row.mapv_inplace(|v| v * Complex32::from_polar(1.0, phase(*p) - phase(*q)));
    }
    assert_eq!(names(&mut set, &mut model, 1.0)[0], "phases");
    let faint = names(&mut observed(&[POINT]), &mut PointModel { flux: 0.6 * POINT.2, ..model }, 0.6);
    assert!(!faint.contains(&"amplitudes"), "{faint:?}");
    // Small errors of some integrations leave little, and stand out.
    let good = Residuals::measure(&mut observed(&[POINT]), &mut model).unwrap().unwrap();
    for (amplitudes, phases, name) in [(0.5, 0.2, "amplitudes"), (0.2, 0.5, "phases"), (0.2, 0.1, "interference")] {
        let [amplitudes, phases] = [amplitudes, phases].map(|share| Explained { share, sigma: 0.03 });
        let r = Residuals { outliers: 0.002, errors: AntennaErrors { amplitudes, phases }, ..good.clone() };
        assert_eq!(of_residuals(&r, &|k| format!("a{k}"), Some(1.0)).iter().map(|f| f.name).collect::<Vec<_>>(), [name]);
    }
}

/// What an image lacks may leave most on long baselines, which only the outer antennas have. They are not accused of it; of what they have done they are.
#[test]
fn outer_antennas_are_not_accused_of_what_the_image_lacks() {
    let freq: Vec<f64> = (0..16).map(|c| 94e9 + 5e8 * f64::from(c)).collect();
    let circle = |n: u32, radius: f64| {
        (0..n).map(move |k| (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos()).map(move |(s, c)| (radius * c, radius * s))
    };
    let mut places = positions(20, 0.2, 0.0, 5);
    places.extend(circle(5, 0.9).map(|(x, y)| [x, y, 0.0]));
    // A ring that the model takes for a point.
    let ring: Vec<(f64, f64, f64)> = circle(8, 8e-4).map(|(l, m)| (POINT.0 + l, POINT.1 + m, POINT.2 / 8.0)).collect();
    let mut observed = snapshot(&places, &freq, &[Polarization::I], &ring, (0.1, VisUnit::Jy));
    let mut model = PointModel { l: POINT.0, m: POINT.1, flux: POINT.2 };
    let found = names(&mut observed, &mut model, 1.0);
    assert!(found.contains(&"chi_squared") && !found.contains(&"antennas"), "{found:?}");
    let mut set = snapshot(&places, &freq, &[Polarization::I], &[POINT], (0.1, VisUnit::Jy));
    swap_antennas(&mut set, 21, 23);
    let r = Residuals::measure(&mut set, &mut model).unwrap().unwrap();
    let findings = of_residuals(&r, &|k| format!("a{k}"), Some(1.0));
    let told = findings.iter().find(|f| f.name == "antennas").unwrap();
    assert!(told.says.contains("of a21, a23 ") || told.says.contains("of a23, a21 "), "{told:?}");
}

/// CLEAN explains the data of swapped antennas to the noise, because its image has more pixels than the array has visibilities.
#[test]
fn an_image_of_swapped_antennas_does_not_predict_the_baselines_that_it_was_not_made_from() {
    let imaging = ImagingOptions { size: Some(ImageSize::square(128)), cell: Some(Angle(3e-4)), ..ImagingOptions::default() };
    let make = |data: &mut dyn VisibilitySource| {
        let mut imager = Imager::new(data, imaging.clone(), &Silent)?;
        Ok(SkyModel::of_image(clean(&mut imager, &CleanOptions::default(), &Silent)?.model))
    };
    let sources = [POINT, (-0.006, 0.002, 0.7), (0.001, 0.005, 0.5)];
    let mut set = observed(&sources);
    let accuracy = Accuracy { epsilon: 1e-4, no_w: false };
    let check = |set: &mut dyn VisibilitySource| CrossCheck::of(set, 0.15, &mut { make }, accuracy, &Silent).unwrap();
    let right = check(&mut set).unwrap();
    assert!(right.misfit < 0.02 && right.finding().is_none() && right.baselines == 29, "{right:?}");
    swap_antennas(&mut set, 3, 11);
    let wrong = check(&mut set).unwrap();
    assert!(wrong.misfit > 0.15 && wrong.finding().is_some(), "{wrong:?}");
    for of_process in in_processes(3, &set, check) {
        let of_process = of_process.unwrap();
        assert_eq!(of_process.baselines, wrong.baselines);
        assert!((of_process.misfit / wrong.misfit - 1.0).abs() < 1e-4, "{of_process:?} {wrong:?}");
    }
    // Six antennas have 15 baselines: too few to leave any out.
    let mut few = snapshot(&positions(6, 0.5, 0.0, 5), &[94e9], &[Polarization::I], &[POINT], (0.1, VisUnit::Jy));
    assert_eq!(check(&mut few), None);
}

/// A wide Gaussian whose shortest baselines are flagged.
#[test]
fn flux_on_spacings_that_nobody_measures_is_named() {
    let sky = SkyModel::of_sources(vec![Source {
        shape: SourceShape::Gaussian { major_rad: 0.004, minor_rad: 0.004, pa_rad: 0.0 },
        ..Source::point(0.0, 0.0, 1.0)
    }]);
    let mut set = observed(&[]);
    let header = set.header.clone();
    let options = SimulateOptions::default();
    let mut model = Simulator::new(header, &sky, &options, &Silent).unwrap();
    let seen = model.block(set.data.coverage.clone(), 0, &Silent).unwrap();
    set.data.vis += &seen.vis;
    let known = |r: &Residuals, flux| of_residuals(r, &|k| k.to_string(), Some(flux)).iter().map(|f| f.name).collect::<Vec<_>>();
    struct Given(ndarray::Array3<Complex32>);
    impl ModelVisibilities for Given {
        fn predict(
            &mut self,
            _: &cittert_arrays::VisibilityHeader,
            first: usize,
            coverage: &cittert_arrays::UvCoverage,
        ) -> crate::Result<ndarray::Array3<Complex32>> {
            Ok(self.0.slice(ndarray::s![first..first + coverage.n_rows(), .., ..]).to_owned())
        }
    }
    let mut given = Given(seen.vis);
    let whole = Residuals::measure(&mut set, &mut given).unwrap().unwrap();
    assert_eq!(known(&whole, 1.0), Vec::<&str>::new(), "{whole:?}");
    for row in 0..set.data.n_rows() {
        let uvw = set.data.coverage.uvw_m.row(row);
        if uvw[0].hypot(uvw[1]) < 0.25 {
            set.data.flags.index_axis_mut(ndarray::Axis(0), row).fill(true);
        }
    }
    let cut = Residuals::measure(&mut set, &mut given).unwrap().unwrap();
    assert_eq!(known(&cut, 0.6), ["short_spacings"], "{cut:?}");
    assert_eq!(known(&cut, 1.0), Vec::<&str>::new(), "the image holds the flux all the same: {cut:?}");
}

#[test]
fn images_that_no_sky_has_are_named() {
    let grid = SkyGrid::new(16, 16, 1e-3, SkyFrame::Boresight).unwrap();
    let spectrum = SpectralWindow::band(94e9, 1e9, 1).unwrap();
    let image = |unit, at: f64| {
        let mut data = Array4::from_elem((1, 1, 16, 16), 0.0);
        data[[0, 0, 4, 4]] = 100.0;
        data[[0, 0, 9, 9]] = at;
        Image::new(grid.clone(), spectrum.clone(), vec![Polarization::I], data, unit).unwrap()
    };
    let mut residual = image(BrightnessUnit::Kelvin, 0.0);
    residual.data.fill(0.5);
    let beam = RestoringBeam { bmaj_rad: 2e-3, bmin_rad: 2e-3, bpa_rad: 0.0 };
    let found = |restored: &Image, stop: &[StopReason]| -> Vec<&str> {
        let facts = ImageFacts { restored: Levels::of(restored), residual: Levels::of(&residual), beam: Some(&beam), stop };
        of_image(&facts, None).iter().map(|f| f.name).collect()
    };
    assert_eq!(found(&image(BrightnessUnit::Kelvin, -2.0), &[]), Vec::<&str>::new(), "within the noise");
    assert_eq!(found(&image(BrightnessUnit::Kelvin, -20.0), &[]), ["negative"]);
    assert_eq!(found(&image(BrightnessUnit::JyPerBeam, -20.0), &[]), ["negative"]);
    let mut warm = image(BrightnessUnit::Kelvin, -20.0);
    warm.data += 200.0;
    warm.pedestal_k = Some(200.0);
    assert_eq!(found(&warm, &[]), Vec::<&str>::new(), "colder than the pedestal, above 0 K");
    assert_eq!(found(&warm, &[StopReason::Diverged]), ["diverged"]);
    assert_eq!(found(&warm, &[StopReason::Iterations]), Vec::<&str>::new(), "the residual is flat");
}

#[test]
fn an_image_of_noise_alone_is_named() {
    let image = |peak: f64| {
        let grid = SkyGrid::new(16, 16, 1e-3, SkyFrame::Boresight).unwrap();
        let mut data = Array4::from_shape_fn((1, 1, 16, 16), |(_, _, i, j)| if (i + j) % 2 == 0 { 0.1 } else { -0.1 });
        data[[0, 0, 4, 4]] = peak;
        Image::new(grid, SpectralWindow::band(94e9, 1e9, 1).unwrap(), vec![Polarization::I], data, BrightnessUnit::JyPerBeam).unwrap()
    };
    let found = |sources: &[(f64, f64, f64)], peak: f64| -> Vec<&str> {
        let residuals = Residuals::measure(&mut observed(sources), &mut PointModel { l: POINT.0, m: POINT.1, flux: 0.0 }).unwrap().unwrap();
        let (restored, residual) = (image(peak), image(0.1));
        of_image(&ImageFacts { restored: Levels::of(&restored), residual: Levels::of(&residual), beam: None, stop: &[] }, Some(&residuals))
            .iter()
            .map(|f| f.name)
            .collect()
    };
    assert_eq!(found(&[], 0.45), ["nothing_seen"]);
    assert_eq!(found(&[], 1.0), Vec::<&str>::new(), "the image has a source");
    assert_eq!(found(&[POINT], 0.45), Vec::<&str>::new(), "the visibilities hold a signal");
}

#[test]
fn a_pedestal_that_is_not_the_mean_of_the_scene_is_named() {
    let header = |pedestal_k, scene_pedestal_k| cittert_arrays::VisibilityHeader { pedestal_k, scene_pedestal_k, ..observed(&[]).header };
    let found = |removed, mean| of_pedestal(&header(removed, mean)).map(|f| f.name);
    assert_eq!(found(Some(200.0), Some(204.0)), None);
    assert_eq!(found(Some(140.0), Some(204.0)), Some("pedestal"));
    assert_eq!(found(Some(290.0), Some(204.0)), Some("pedestal"));
    assert_eq!(found(None, Some(204.0)), Some("pedestal"), "a warm scene without a pedestal");
    assert_eq!(found(Some(60.0), Some(0.0)), Some("pedestal"), "a cold background");
    assert_eq!(found(None, Some(0.0)), None);
    assert_eq!(found(Some(140.0), None), None, "the scene is not known");
}

/// Several processes look at the rows that one would look at, and the first judges all of them.
#[test]
fn several_processes_judge_the_residuals_of_one() {
    let run =
        |source: &mut dyn VisibilitySource| Residuals::measure(source, &mut PointModel { l: POINT.0, m: POINT.1, flux: 0.9 }).unwrap();
    let small = observed(&[POINT]);
    // So many visibilities that runs of rows are looked at, which end within the parts of processes.
    let mut large = small.clone();
    for _ in 0..9 {
        let all = large.data.clone();
        large.data.append(&all).unwrap();
    }
    for set in [small, large] {
        let one = in_processes(1, &set, run).remove(0).unwrap();
        for size in [2, 7] {
            let several = in_processes(size, &set, run);
            let all = several[0].as_ref().unwrap();
            assert!(several[1..].iter().all(Option::is_none));
            assert_eq!(
                (all.samples, all.noise_known, &all.antennas, all.typical),
                (one.samples, one.noise_known, &one.antennas, one.typical)
            );
            assert!((all.mean / one.mean - 1.0).abs() < 1e-9 && (all.unexplained / one.unexplained - 1.0).abs() < 1e-9, "{all:?} {one:?}");
        }
    }
}

/// A source that the image has no place for is found by the residuals of a point that it does hold, near the image and far from it; a wrong model of what lies
/// within the image is no such source.
#[test]
fn a_source_outside_the_image_is_found() {
    let grid = SkyGrid::new(64, 64, 3e-4, SkyFrame::Boresight).unwrap();
    let accuracy = Accuracy { epsilon: 1e-4, no_w: false };
    let look = |source: &mut dyn VisibilitySource, flux: f64| {
        let mut model = PointModel { l: POINT.0, m: POINT.1, flux };
        let residuals = Residuals::measure(source, &mut model).unwrap();
        look_outside(source, &mut model, residuals.as_ref(), (&grid, accuracy)).unwrap()
    };
    for (l, m) in [(0.0101, -0.002), (0.02, 0.024), (-0.06, 0.03)] {
        let set = observed(&[POINT, (l, m, 0.5)]);
        let found = look(&mut set.clone(), POINT.2).unwrap();
        assert!((found.l - l).abs() < 4e-4 && (found.m - m).abs() < 4e-4 && (found.flux - 0.5).abs() < 0.1, "{found:?}");
        assert!(found.share > 0.6, "{found:?}");
        let told = found.finding(&grid, VisUnit::Jy);
        let size: f64 = told.next.split("--size ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((2.0..3.0).contains(&(size * grid.cell_rad / l.abs().max(m.abs()))) && told.says.contains("about 0."), "{told:?}");
        assert!(told.next.ends_with("--cell 61.8794arcsec"), "{told:?}");
        for several in in_processes(3, &set, |source| look(source, POINT.2)) {
            let several = several.unwrap();
            assert!(
                (several.l, several.m) == (found.l, found.m) && (several.share / found.share - 1.0).abs() < 1e-4,
                "{several:?} {found:?}"
            );
        }
    }
    assert_eq!(look(&mut observed(&[POINT]), 0.5), None);
    assert_eq!(look(&mut observed(&[(-POINT.0, POINT.1, 1.0)]), 1.0), None);
    assert_eq!(look(&mut observed(&[POINT]), 1.0), None);
    // A regular array shows whatever is wrong many times over, also outside the image.
    let regular: Vec<[f64; 3]> = (0..25).map(|k| [0.1 * f64::from(k % 5), 0.1 * f64::from(k / 5), 0.0]).collect();
    for seed in 1..6 {
        let mut set = snapshot(&regular, &[94e9], &[Polarization::I], &[], (0.01, VisUnit::Jy));
        let mut noise = Noise(seed);
        set.data.vis.iter_mut().for_each(|v| *v += Complex32::new(noise.next() as f32, noise.next() as f32));
        assert_eq!(look(&mut set, 1.0), None, "{seed}");
    }
}

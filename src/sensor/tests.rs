//! What holds for whole sensors.

use super::*;
use cittert_arrays::quantity::{Angle, Duration, Frequency, Length, Temperature};
use cittert_arrays::{BrightnessUnit, Image, Polarization, SkyFrame, SkyGrid, SpectralWindow};
use ndarray::{Array2, Axis, s};

fn grid(n_l: usize, n_m: usize) -> SkyGrid {
    SkyGrid::new(n_l, n_m, 1e-3, SkyFrame::Boresight).unwrap()
}

fn band() -> SpectralWindow {
    SpectralWindow::band(94e9, 4e9, 1).unwrap()
}

fn scene(plane: Array2<f64>) -> Image {
    let grid = grid(plane.ncols(), plane.nrows());
    let data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
    Image::new(grid, band(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap()
}

fn options(aperture: &str) -> SensorOptions {
    let mut options = SensorOptions::default();
    options.pupil.aperture = Some(aperture.parse().unwrap());
    options.noise.tsys = Some(Temperature(1000.0));
    options
}

fn sensor(options: &SensorOptions, dim: (usize, usize)) -> Sensor {
    Sensor::new(options, &grid(dim.1, dim.0), &band()).unwrap()
}

fn disc() -> Array2<f64> {
    Array2::from_shape_fn((96, 112), |(r, c)| if (r as f64 - 50.0).hypot(c as f64 - 58.0) < 12.0 { 300.0 } else { 250.0 })
}

#[test]
fn optics_and_resampling_keep_the_mean_and_flat_scenes() {
    let patterns = ["array", "raster", "pushbroom"];
    for (pattern, zernike, pitch) in [(0, "", None), (1, "5:0.1", Some(1.6e-3)), (2, "", Some(0.7e-3)), (0, "8:0.2", None)] {
        let mut options = options("circle=1.2m");
        options.scan.scan = patterns[pattern].parse().unwrap();
        options.scan.pitch = pitch.map(Angle);
        options.aberrations.zernike = (!zernike.is_empty()).then(|| zernike.parse().unwrap());
        let sensor = sensor(&options, (96, 112));
        let flat = sensor.noiseless(&scene(Array2::from_elem((96, 112), 280.0))).unwrap();
        assert!(flat.data.iter().all(|v| (v - 280.0).abs() < 1e-6), "{pattern} {pitch:?}");
        let out = sensor.noiseless(&scene(disc())).unwrap();
        if pitch.is_none() && zernike != "8:0.2" {
            // The plane with its mirror images keeps its mean, far wings of the PSF included.
            assert!((out.data.mean().unwrap() - disc().mean().unwrap()).abs() < 1e-6 * 280.0);
        }
        if let Some(pitch) = pitch {
            // Energy above the background, in solid angle.
            let excess = |plane: &Array2<f64>, cell: f64| plane.iter().map(|v| v - 250.0).sum::<f64>() * cell * cell;
            let (before, after) = (excess(&disc(), 1e-3), excess(&out.plane(0, 0).to_owned(), pitch));
            assert!((after / before - 1.0).abs() < 0.01, "{pitch}: {after} {before}");
        }
    }
}

/// A warm patch whose spectrum the pitch can follow, far from the edges, has the same energy before and after.
#[test]
fn the_energy_of_a_patch_is_kept_within_1e_6() {
    let patch =
        Array2::from_shape_fn((192, 192), |(r, c)| 250.0 + 50.0 * (-((r as f64 - 96.0).powi(2) + (c as f64 - 96.0).powi(2)) / 72.0).exp());
    for pitch in [0.8e-3, 1.3e-3] {
        let mut options = options("rectangle=0.9m:0.9m");
        // The far wings of the PSF carry energy over the edge in proportion to the edge of the illumination.
        options.pupil.taper = "parabola=100:2".parse().unwrap();
        options.scan.pitch = Some(Angle(pitch));
        let out = sensor(&options, (192, 192)).noiseless(&scene(patch.clone())).unwrap();
        let mean = |plane: &Array2<f64>, cell: f64| plane.sum() * cell * cell / (plane.len() as f64 * cell * cell);
        let area = out.grid.n_l as f64 * pitch * out.grid.n_m as f64 * pitch / (0.192 * 0.192);
        let excess = |plane: &Array2<f64>, cell: f64| (mean(plane, cell) - 250.0) * if cell == 1e-3 { 1.0 } else { area };
        let (before, after) = (excess(&patch, 1e-3), excess(&out.plane(0, 0).to_owned(), pitch));
        // 1e-6 of the temperature.
        assert!((after - before).abs() < 1e-6 * 250.0, "{pitch}: {after} {before}");
    }
}

#[test]
fn a_point_becomes_the_psf() {
    let mut point = Array2::zeros((128, 128));
    point[[64, 64]] = 1.0;
    let mut options = options("circle=1.2m");
    options.aberrations.zernike = Some("7:0.1,5:0.1".parse().unwrap());
    options.scan.motion = Some("20mrad/s:30deg".parse().unwrap());
    options.scan.frame_time = Duration(0.1);
    let sensor = sensor(&options, (128, 128));
    let (image, psf) = (sensor.noiseless(&scene(point)).unwrap(), sensor.psf().unwrap());
    assert!((psf.data.sum() - 1.0).abs() < 1e-12 && psf.data.iter().all(|v| *v >= 0.0));
    let n = psf.grid.n_l;
    let (near, other) = (s![56..72, 56..72], s![n / 2 - 8..n / 2 + 8, n / 2 - 8..n / 2 + 8]);
    let largest = psf.data.iter().fold(0.0_f64, |a, v| a.max(*v));
    for (a, b) in image.plane(0, 0).slice(near).iter().zip(psf.plane(0, 0).slice(other)) {
        // Mirror images of the far wings differ.
        assert!((a - b).abs() < 2e-3 * largest, "{a} {b}");
    }
    // `enhance` takes it as it is.
    assert!(psf.plane(0, 0)[[n / 2, n / 2]] > 0.5 * largest);
}

/// The PSF by the transfer function is that by the transform of the pupil, also the way round.
#[test]
fn the_weights_are_the_psf_of_the_optics() {
    let mut options = options("circle=1.2m");
    options.aberrations.zernike = Some("7:0.1,5:0.1,10:0.05".parse().unwrap());
    options.scan.footprint = Some(Angle(0.0));
    options.band.frequencies = 3;
    let sensor = sensor(&options, (128, 128));
    let weights = sensor.psf().unwrap();
    let n = weights.grid.n_l;
    let psf = sensor.optics().psf((0.0, 0.0), 1e-3, n) * 1e-6;
    let peak = psf.iter().fold(0.0_f64, |a, v| a.max(*v));
    let worst = (&psf - &weights.plane(0, 0)).iter().fold(0.0_f64, |a, v| a.max(v.abs())) / peak;
    assert!(worst < 3e-5, "{worst}");
}

#[test]
fn noise_follows_the_radiometer_equation_within_2_percent_over_200_frames() {
    let flat = scene(Array2::from_elem((24, 32), 280.0));
    // Pattern, beams, samples that share the frame time.
    for (pattern, beams, shared) in [("array", 1, 1.0), ("raster", 4, 24.0 * 32.0 / 4.0), ("pushbroom", 1, 24.0)] {
        for (receiver, radiometer, factor) in [(None, "total-power", 1000.0), (Some(700.0), "dicke", 2.0 * 980.0)] {
            let mut options = options("circle=1.2m");
            (options.scan.scan, options.scan.beams) = (pattern.parse().unwrap(), beams);
            (options.scan.frame_time, options.scan.efficiency) = (Duration(0.04), 0.8);
            options.noise.radiometer = radiometer.parse().unwrap();
            if let Some(receiver) = receiver {
                (options.noise.tsys, options.noise.receiver) = (None, Some(Temperature(receiver)));
            }
            let sensor = sensor(&options, (24, 32));
            let tau = 0.04 * 0.8 / shared;
            assert!((sensor.dwell_s() / tau - 1.0).abs() < 1e-12);
            let expected = factor / (4e9 * tau).sqrt();
            let mut run = sensor.begin(7);
            let square: f64 =
                (0..200).map(|_| sensor.frame(&flat, &mut run).unwrap().data.mapv(|v| (v - 280.0).powi(2)).mean().unwrap()).sum();
            let found = (square / 200.0).sqrt();
            assert!((found / expected - 1.0).abs() < 0.02, "{pattern} {radiometer}: {found} {expected}");
            let map = sensor.nedt(&flat).unwrap();
            assert!(map.data.iter().all(|v| (v / expected - 1.0).abs() < 1e-9));
        }
    }
}

fn noisy(pattern: &str) -> SensorOptions {
    let mut options = options("circle=1.2m");
    options.scan.scan = pattern.parse().unwrap();
    options.scan.beams = 3;
    options.noise.knee = Some(Frequency(5.0));
    options.noise.gain_drift = 1e-3;
    options.noise.calibration = Some(Duration(0.35));
    options.noise.offset_pattern = Some(Temperature(0.4));
    options.noise.gain_pattern = 0.002;
    options.noise.bits = Some(12);
    options
}

#[test]
fn the_map_of_noise_is_the_scatter_over_frames_of_all_parts() {
    let flat = scene(Array2::from_elem((24, 32), 280.0));
    for pattern in ["array", "raster", "conical=30mrad", "pushbroom"] {
        let mut options = noisy(pattern);
        // The pattern of detectors is the same in all frames: its scatter is over instruments. Levels as wide as the noise are not random.
        (options.noise.offset_pattern, options.noise.gain_pattern, options.noise.bits) = (None, 0.0, Some(16));
        let sensor = sensor(&options, (24, 32));
        let runs = 300;
        let mut scatter = Array2::<f64>::zeros((24, 32));
        for seed in 0..runs {
            let frame = sensor.frame(&flat, &mut sensor.begin(seed)).unwrap();
            scatter += &frame.plane(0, 0).mapv(|v| (v - 280.0).powi(2) / runs as f64);
        }
        let (found, map) = (scatter.mean().unwrap().sqrt(), sensor.nedt(&flat).unwrap());
        let expected = map.data.mapv(|v| v * v).mean().unwrap().sqrt();
        assert!((found / expected - 1.0).abs() < 0.06, "{pattern}: {found} {expected}");
        let parts: f64 = sensor.noise_parts(&flat).unwrap().iter().map(|p| p.1).sum();
        assert!(parts.sqrt() >= expected * 0.999, "{pattern}");
    }
}

#[test]
fn the_bytes_of_a_film_depend_on_the_seed_and_not_on_the_threads() {
    let scene = scene(disc());
    for pattern in ["array", "raster", "conical=80mrad", "pushbroom"] {
        let film = |threads: usize, seed: u64| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let sensor = sensor(&noisy(pattern), (96, 112));
                let mut run = sensor.begin(seed);
                (0..3).map(|_| sensor.frame(&scene, &mut run).unwrap().data).collect::<Vec<_>>()
            })
        };
        let (one, three, other) = (film(1, 5), film(3, 5), film(1, 6));
        assert!(one.iter().flatten().zip(three.iter().flatten()).all(|(a, b)| a.to_bits() == b.to_bits()), "{pattern}");
        assert!(one[0] != other[0] && one[0] != one[1], "{pattern}");
    }
}

#[test]
fn a_calibration_removes_the_drift_and_levels_are_multiples_of_the_step() {
    let flat = scene(Array2::from_elem((24, 32), 280.0));
    let rms = |calibration: f64| {
        let mut options = options("circle=1.2m");
        options.scan.scan = "pushbroom".parse().unwrap();
        options.noise.gain_drift = 1e-2;
        options.noise.calibration = Some(Duration(calibration));
        let sensor = sensor(&options, (24, 32));
        sensor.noise_parts(&flat).unwrap().iter().find(|p| p.0 == "gain drift").unwrap().1.sqrt()
    };
    assert!(rms(0.05) < 0.3 * rms(1.0) && rms(1.0) < rms(100.0), "{} {} {}", rms(0.05), rms(1.0), rms(100.0));
    let mut options = options("circle=1.2m");
    options.noise.bits = Some(8);
    (options.noise.lowest, options.noise.highest) = (Temperature(200.0), Temperature(300.0));
    let frame = {
        let sensor = sensor(&options, (24, 32));
        sensor.frame(&flat, &mut sensor.begin(1)).unwrap()
    };
    let step = 100.0 / 255.0;
    assert!(frame.data.iter().all(|v| ((v - 200.0) / step - ((v - 200.0) / step).round()).abs() < 1e-9));
}

#[test]
fn coma_of_the_field_grows_outwards_and_leaves_the_centre_sharp() {
    let mut points = Array2::zeros((128, 128));
    for at in [[64, 64], [64, 112], [64, 15], [112, 64]] {
        points[at] = 1000.0;
    }
    let mut options = options("circle=1.2m");
    options.aberrations.coma = 0.3;
    options.scan.footprint = Some(Angle(0.0));
    let out = sensor(&options, (128, 128)).noiseless(&scene(points)).unwrap();
    let plane = out.plane(0, 0);
    // Third moment of the image of a point along a direction away from the centre.
    let skew = |(r, c): (usize, usize), (dr, dc): (isize, isize)| {
        (-6..=6_isize).map(|k| plane[[(r as isize + k * dr) as usize, (c as isize + k * dc) as usize]] * (k as f64).powi(3)).sum::<f64>()
    };
    let (center, right, left, up) = (skew((64, 64), (0, 1)), skew((64, 112), (0, 1)), skew((64, 15), (0, -1)), skew((112, 64), (1, 0)));
    assert!(center.abs() < 0.03 * right.abs(), "{center} {right} {left} {up}");
    assert!((left / right - 1.0).abs() < 0.02 && (up / right - 1.0).abs() < 0.02, "{left} {right} {up}");
    assert!(plane[[64, 64]] > 1.2 * plane[[64, 112]]);
}

#[test]
fn defocus_and_motion_blur_an_image() {
    let sharpness = |change: &dyn Fn(&mut SensorOptions)| {
        let mut options = options("circle=1.2m");
        change(&mut options);
        let out = sensor(&options, (96, 112)).noiseless(&scene(disc())).unwrap();
        out.data.std(0.0)
    };
    let sharp = sharpness(&|_| {});
    let near = sharpness(&|o| o.aberrations.range = Some(Length(60.0)));
    let focused = sharpness(&|o| (o.aberrations.range, o.aberrations.focus) = (Some(Length(60.0)), Some(Length(60.0))));
    let moved = sharpness(&|o| o.scan.motion = Some("20mrad/s".parse().unwrap()));
    assert!(near < 0.98 * sharp && moved < 0.98 * sharp && (focused - sharp).abs() < 1e-9, "{sharp} {near} {focused} {moved}");
}

#[test]
fn arcs_of_a_conical_scan_show_the_scene_where_it_is() {
    let smooth = Array2::from_shape_fn((96, 112), |(r, c)| 250.0 + 20.0 * (r as f64 * 0.12).sin() * (c as f64 * 0.1).cos());
    let out = |pattern: &str| {
        let mut options = options("circle=1.2m");
        (options.scan.scan, options.scan.step, options.scan.footprint) = (pattern.parse().unwrap(), true, Some(Angle(0.0)));
        sensor(&options, (96, 112)).noiseless(&scene(smooth.clone())).unwrap()
    };
    let (arcs, lines) = (out("conical=100mrad"), out("raster"));
    // The mean of two lines flattens a wave with 0.12 rad a line by at most 1 - cos(0.06).
    let worst = (&arcs.data - &lines.data).slice_move(s![.., .., 16..80, ..]).iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    assert!(worst < 20.0 * 0.0019, "{worst}");
}

#[test]
fn channels_are_averaged_and_polarisations_have_noise_of_their_own() {
    let window = SpectralWindow::band(94e9, 4e9, 2).unwrap();
    let mut data = ndarray::Array4::from_elem((2, 2, 24, 32), 280.0);
    data.slice_mut(s![1, .., .., ..]).fill(290.0);
    let image = Image::new(grid(32, 24), window.clone(), vec![Polarization::XX, Polarization::YY], data, BrightnessUnit::Kelvin).unwrap();
    let sensor = Sensor::new(&options("circle=1.2m"), &grid(32, 24), &window).unwrap();
    assert!(sensor.noiseless(&image).unwrap().data.iter().all(|v| (v - 285.0).abs() < 1e-9));
    let frame = sensor.frame(&image, &mut sensor.begin(1)).unwrap();
    assert_eq!(frame.data.dim(), (1, 2, 24, 32));
    assert!(frame.plane(0, 0) != frame.plane(0, 1));
}

#[test]
fn wrong_options_and_scenes_name_what_is_wrong() {
    let message = |change: &dyn Fn(&mut SensorOptions)| {
        let mut options = options("circle=1.2m");
        change(&mut options);
        Sensor::new(&options, &grid(32, 24), &band()).unwrap_err().to_string()
    };
    type Change = fn(&mut SensorOptions);
    let wrong: [(Change, &str); 18] = [
        (|o| o.pupil.aperture = None, "aperture"),
        (|o| o.pupil.struts = 3, "strut-width"),
        (|o| o.pupil.strut_width = Some(Length(0.1)), "struts"),
        (|o| o.aberrations.range = Some(Length(0.0)), "range"),
        (|o| o.aberrations.coma = 1e6, "coma"),
        (|o| o.aberrations.field_nodes = 1, "field_nodes"),
        (|o| o.band.freq = Some(Frequency(0.0)), "freq"),
        (|o| o.band.bandwidth = Some(Frequency(200e9)), "bandwidth"),
        (|o| o.band.bandwidth = Some(Frequency(0.0)), "bandwidth"),
        (|o| o.band.frequencies = 0, "frequencies"),
        (|o| o.scan.pitch = Some(Angle(1.0)), "pitch"),
        (|o| o.scan.frame_time = Duration(0.0), "frame_time"),
        (|o| o.scan.efficiency = 1.5, "efficiency"),
        (|o| o.scan.motion = Some("1rad/s".parse().unwrap()), "slower motion"),
        (|o| o.scan.scan = "conical=2mrad".parse().unwrap(), "above half of the width"),
        (|o| (o.noise.tsys, o.noise.knee) = (None, Some(Frequency(1.0))), "knee"),
        (|o| o.noise.bits = Some(40), "bits"),
        (|o| (o.noise.bits, o.noise.lowest) = (Some(8), Temperature(500.0)), "highest"),
    ];
    for (change, says) in wrong {
        let message = message(&change);
        assert!(message.contains(says), "{says}: {message}");
    }
    let sensor = sensor(&options("circle=1.2m"), (24, 32));
    let refused = |image: &Image| sensor.noiseless(image).unwrap_err().to_string();
    let mut blank = scene(Array2::from_elem((24, 32), 280.0));
    blank.data[[0, 0, 3, 4]] = f64::NAN;
    assert!(refused(&blank).contains("1 of 768 pixels are blank"));
    assert!(refused(&scene(Array2::zeros((24, 24)))).contains("another grid"));
    let mut flux = scene(Array2::zeros((24, 32)));
    flux.unit = BrightnessUnit::JyPerBeam;
    assert!(refused(&flux).contains("Jy/beam"));
    let coarse = SkyGrid::new(32, 24, 0.05, SkyFrame::Boresight).unwrap();
    let e = Sensor::new(&options("circle=100m"), &coarse, &band()).unwrap_err().to_string();
    assert!(e.contains("finer image"), "{e}");
}

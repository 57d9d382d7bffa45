use super::*;
use crate::{Antenna, BUILTIN_LAYOUTS, LayoutFrame, SPEED_OF_LIGHT_M_S};

fn boresight(points: &[[f64; 2]]) -> ArrayLayout {
    let antennas = points.iter().enumerate().map(|(i, p)| Antenna::new(format!("A{i}"), i as u32, [p[0], p[1], 0.0])).collect();
    ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap()
}

/// Antennas of normal density make a Gaussian beam: exp(-(2 pi s r)^2) has FWHM sqrt(ln 2) / (pi s).
#[test]
fn a_gaussian_aperture_has_the_beam_of_theory() {
    let (s, squeeze): (f64, f64) = (30.0, 0.5);
    let mut points = Vec::new();
    // Quantiles of the radial normal distribution along a golden-angle spiral.
    for k in 0..500 {
        let r = s * (-2.0 * (1.0 - (f64::from(k) + 0.5) / 500.0_f64).ln()).sqrt();
        let angle = f64::from(k) * 2.399_963_229_728_653;
        points.push([squeeze * r * angle.cos(), r * angle.sin()]);
    }
    let f = boresight(&points).figures(SPEED_OF_LIGHT_M_S).unwrap();
    let expected = std::f64::consts::LN_2.sqrt() / (std::f64::consts::PI * s);
    assert!((f.bmin_rad / expected - 1.0).abs() < 5e-3, "{} {expected}", f.bmin_rad);
    assert!((f.bmaj_rad / (expected / squeeze) - 1.0).abs() < 5e-3, "{}", f.bmaj_rad);
    // Narrow in x means wide beam along x: the major axis lies along +x, 90 degrees from +y.
    assert!((f.bpa_rad.abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-2, "{}", f.bpa_rad);
}

#[test]
fn a_uniform_line_counts_its_spacings() {
    let line: Vec<[f64; 2]> = (0..8).map(|i| [0.1 * f64::from(i), 0.0]).collect();
    let f = boresight(&line).figures(30e9).unwrap();
    assert_eq!(f.unique_baselines, 7);
    assert!((f.redundancy - 4.0).abs() < 1e-12);
    assert!((f.largest_scale_rad - SPEED_OF_LIGHT_M_S / 30e9 / 0.1).abs() < 1e-12);
    assert_eq!(f.bmaj_rad, std::f64::consts::PI, "a line resolves nothing across itself");
    // Cross terms only: (|sin(N x)/sin x|^2 - N)/(N(N-1)) has its half maximum close to the textbook 0.886 lambda/D.
    let width = SPEED_OF_LIGHT_M_S / 30e9 / 0.8;
    assert!((0.75..1.0).contains(&(f.bmin_rad / width)), "{}", f.bmin_rad / width);
    // The grating lobes of a uniform line are as high as the main lobe.
    assert!(f.psl_db > -0.1, "{}", f.psl_db);
}

/// An L of elements at two wavelengths repeats its main lobe at l = 1/2, 55 wavelengths over the aperture away. Nearer, only one of its arms is in
/// phase, and the other adds 0.128 of itself, the second side lobe of a line.
#[test]
fn the_whole_field_holds_the_grating_lobe_that_the_near_range_does_not() {
    let wavelength = SPEED_OF_LIGHT_M_S / 30e9;
    let step = |i: i32| 2.0 * wavelength * f64::from(i);
    let points: Vec<[f64; 2]> = (0..40).map(|i| [step(i), 0.0]).chain((1..40).map(|i| [0.0, step(i)])).collect();
    let f = boresight(&points).figures(30e9).unwrap();
    let expected = 20.0 * ((40.0 + 0.128 * 39.0) / 79.0_f64).log10();
    assert!(f.psl_db > -0.01 && (f.psl_within_db - expected).abs() < 0.1, "{} {}", f.psl_db, f.psl_within_db);
    assert_eq!(f.field_rad, 1.0);
    assert!((f.field - 78.0 * 2f64.sqrt()).abs() < 1e-9, "{}", f.field);
}

#[test]
fn an_odd_ring_has_no_two_baselines_alike() {
    let f = ArrayLayout::builtin("mm-ring").unwrap().figures(94e9).unwrap();
    assert_eq!(f.unique_baselines, 59 * 58 / 2);
    assert_eq!(f.redundancy, 1.0);
    // Beam of a ring of diameter D: J0^2 falls to half at 0.359 lambda/D, so the width is 0.72 lambda/D.
    let expected = 0.718 * SPEED_OF_LIGHT_M_S / 94e9 / 0.6;
    assert!((f.bmaj_rad / expected - 1.0).abs() < 0.04, "{}", f.bmaj_rad / expected);
}

#[test]
fn figures_of_all_built_in_layouts_are_sensible() {
    for b in BUILTIN_LAYOUTS {
        let layout = ArrayLayout::builtin(b.name).unwrap();
        let (e, f) = (layout.extent(), layout.figures(b.freq_hz).unwrap());

        let resolution = SPEED_OF_LIGHT_M_S / b.freq_hz / e.longest_m;
        assert!(f.bmin_rad > 0.3 * resolution && f.bmin_rad < 6.0 * resolution, "{}: {f:?}", b.name);
        assert!(f.bmaj_rad >= f.bmin_rad && f.largest_scale_rad > f.bmin_rad, "{}: {f:?}", b.name);
        assert!(f.psl_db <= 0.0 && f.rms_sidelobe > 0.0 && f.rms_sidelobe < 1.0, "{}: {f:?}", b.name);
        assert!(f.uv_fill > 0.0 && f.uv_fill <= 1.0 && f.unique_baselines <= e.n_baselines, "{}: {f:?}", b.name);
    }
}

#[test]
fn bad_questions_are_refused() {
    let l = boresight(&[[0.0, 0.0], [1.0, 0.0]]);
    assert!(l.figures(0.0).is_err() && l.figures(f64::NAN).is_err());
    assert!(boresight(&[[0.0, 0.0]]).figures(1e9).is_err());
    let column = vec![Antenna::new("a", 0, [0.0; 3]), Antenna::new("b", 1, [0.0, 0.0, 1.0])];
    assert!(ArrayLayout::new("t", LayoutFrame::Boresight, column).unwrap().figures(1e9).is_err());
}

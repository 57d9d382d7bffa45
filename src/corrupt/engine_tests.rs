//! Tests of whole corruptions.

use super::*;
use crate::progress::Silent;
use cittert_arrays::{
    Antenna, ArrayLayout, LayoutFrame, PhaseCenter, Polarization, Sensitivity, Site, SpectralWindow, UvCoverage, VisUnit, VisibilityBlock,
    VisibilityHeader, VisibilitySet,
};
use ndarray::Array2;
use num_complex::{Complex, Complex64};

const N_ANT: u32 = 6;

fn place(k: u32) -> [f64; 3] {
    [f64::from(k * k) * 10.0, f64::from(k % 3) * 25.0, 0.0]
}

/// A point source of 2 Jy at the phase centre, observed by six antennas for `times` integrations of 10 s.
fn set(times: usize, channels: usize, frame: LayoutFrame) -> VisibilitySet {
    let antennas =
        (0..N_ANT).map(|k| Antenna { sensitivity: Some(Sensitivity::SefdJy(50.0)), ..Antenna::new(format!("A{k}"), k, place(k)) });
    let header = VisibilityHeader {
        layout: ArrayLayout::new("t", frame, antennas.collect()).unwrap(),
        spectrum: SpectralWindow::band(1.4e9, 1e8, channels).unwrap(),
        polarizations: vec![Polarization::RR, Polarization::LL],
        phase_centers: vec![PhaseCenter::unprojected("b")],
        unit: VisUnit::Jy,
        telescope: "t".into(),
        instrument: "t".into(),
        pedestal_k: None,
        scene_pedestal_k: None,
        scene_width_rad: None,
        antenna_temperature_k: None,
        near_field: Default::default(),
        annotations: Default::default(),
        history: Vec::new(),
    };
    let pairs: Vec<(u32, u32)> = (0..N_ANT).flat_map(|a| (a + 1..N_ANT).map(move |b| (a, b))).collect();
    let rows: Vec<(usize, (u32, u32))> = (0..times).flat_map(|t| pairs.iter().map(move |p| (t, *p))).collect();
    let n = rows.len();
    let uvw = Array2::from_shape_fn((n, 3), |(r, k)| place(rows[r].1.1)[k] - place(rows[r].1.0)[k]);
    let (ant1, ant2) = rows.iter().map(|r| r.1).unzip();
    let time = rows.iter().map(|r| 2_460_000.5 + r.0 as f64 * 10.0 / 86_400.0).collect();
    let coverage = UvCoverage::new(uvw, ant1, ant2, time, vec![10.0; n], vec![0; n]).unwrap();
    let mut data = VisibilityBlock::zeros(coverage, channels, 2);
    data.vis.fill(Complex::new(2.0, 0.0));
    VisibilitySet::new(header, data).unwrap()
}

fn run(set: &VisibilitySet, errors: &[Error], seed: u64) -> (VisibilitySet, cittert_arrays::GainTable) {
    let options = CorruptOptions { seed, errors: errors.to_vec(), per_feed: false };
    let mut source = set.clone();
    let mut out = VisibilitySet::new(corrupted_header(&set.header, &options), set.data.rows(0..0).unwrap()).unwrap();
    let table = corrupt(&mut source, &mut out, &options, &Silent).unwrap();
    table.check().unwrap();
    (out, table)
}

fn phase(rms_rad: f64, variation: Variation) -> Error {
    Error::Phase(PhaseError { rms_rad, variation })
}

fn wide(v: Complex<f32>) -> Complex64 {
    Complex64::new(v.re.into(), v.im.into())
}

#[test]
fn data_are_g1_conj_g2_times_the_truth_and_closures_survive() {
    let clean = set(8, 4, LayoutFrame::Boresight);
    let errors = [
        phase(1.0, Variation::Integration),
        Error::Amplitude(AmplitudeError { rms: 0.2, variation: Variation::Coherent { time_s: 50.0 } }),
        Error::Delay(DelayError { rms_s: 3e-9, variation: Variation::Constant }),
        Error::Bandpass(BandpassError { ripple: 0.05, period_hz: 3e7, mismatch: 0.01 }),
        Error::Troposphere(Troposphere { baseline_m: 100.0, ..Troposphere::default() }),
    ];
    let (out, table) = run(&clean, &errors, 4);
    assert_eq!(table.gains.dim(), (8, 6, 4, 1));
    let vis = |time: usize, a: u32, b: u32, chan: usize| {
        let at = |r: &usize| (out.data.coverage.ant1[*r], out.data.coverage.ant2[*r]) == (a, b);
        let row = (0..out.data.n_rows()).filter(at).nth(time).unwrap();
        (wide(out.data.vis[[row, chan, 0]]), f64::from(out.data.weights[[row, chan, 1]]))
    };
    for time in 0..8 {
        for chan in 0..4 {
            for (a, b) in [(0, 1), (2, 5), (1, 4)] {
                let g = table.gains[[time, a as usize, chan, 0]] * table.gains[[time, b as usize, chan, 0]].conj();
                let (v, w) = vis(time, a, b, chan);
                assert!((v - g * 2.0).norm() < 1e-6 * g.norm() * 2.0);
                assert!((w * g.norm_sqr() - 1.0).abs() < 1e-6);
            }
            let closure = (vis(time, 0, 2, chan).0 * vis(time, 2, 5, chan).0 * vis(time, 0, 5, chan).0.conj()).arg();
            assert!(closure.abs() < 1e-5, "{closure}");
        }
    }
}

#[test]
fn the_rms_of_the_gains_is_what_was_asked_for() {
    let clean = set(200, 1, LayoutFrame::Boresight);
    let (_, table) = run(&clean, &[phase(0.5, Variation::Integration)], 1);
    let n = table.gains.len() as f64;
    let rms = (table.gains.iter().map(|g| g.arg().powi(2)).sum::<f64>() / n).sqrt();
    // Three standard errors of 1200 draws.
    assert!((rms / 0.5 - 1.0).abs() < 3.0 / (2.0 * n).sqrt(), "{rms}");
    let (_, table) = run(&clean, &[Error::Amplitude(AmplitudeError { rms: 0.1, variation: Variation::Integration })], 1);
    let rms = (table.gains.iter().map(|g| g.norm().ln().powi(2)).sum::<f64>() / n).sqrt();
    assert!((rms / 0.1 - 1.0).abs() < 3.0 / (2.0 * n).sqrt(), "{rms}");
    // The phase is constant for a minute: it is the same in six integrations and differs in the seventh.
    let (_, table) = run(&clean, &[phase(0.5, Variation::Interval { length_s: 60.0 })], 1);
    assert_eq!(table.gains[[0, 2, 0, 0]], table.gains[[5, 2, 0, 0]]);
    assert_ne!(table.gains[[5, 2, 0, 0]], table.gains[[6, 2, 0, 0]]);
}

#[test]
fn a_delay_is_a_slope_and_leaves_the_middle_of_the_band() {
    let clean = set(1, 5, LayoutFrame::Boresight);
    let (_, table) = run(&clean, &[Error::Delay(DelayError { rms_s: 1e-9, variation: Variation::Constant })], 3);
    let g = |ant: usize, chan: usize| table.gains[[0, ant, chan, 0]];
    for ant in 0..6 {
        assert!((g(ant, 2) - 1.0).norm() < 1e-12);
        let tau = g(ant, 3).arg() / (std::f64::consts::TAU * 2e7);
        assert!(tau != 0.0 && tau.abs() < 5e-9);
        assert!((g(ant, 0) - Complex64::cis(-std::f64::consts::TAU * 4e7 * tau)).norm() < 1e-9);
    }
}

#[test]
fn a_displaced_antenna_turns_the_phase_by_its_path_towards_the_source() {
    let site = Site { latitude_rad: 0.5, longitude_rad: 0.0, altitude_m: 0.0 };
    let toward = [0.6, 0.0, 0.8];
    let mut clean = set(1, 2, LayoutFrame::EastNorthUp(site));
    for row in 0..clean.data.n_rows() {
        let (a, b) = (clean.data.coverage.ant1[row], clean.data.coverage.ant2[row]);
        clean.data.coverage.uvw_m[[row, 2]] = (0..3).map(|k| (place(b)[k] - place(a)[k]) * toward[k]).sum();
    }
    let error = PositionError { rms_m: Some(0.02) };
    let (out, _) = run(&clean, &[Error::Position(error)], 9);
    let header = out.header.clone();
    let freq = header.spectrum.freq_hz().to_vec();
    let context = Context {
        header: &header,
        time_jd: &[],
        seconds: &[],
        length_s: &[],
        toward: &[],
        freq_hz: &freq,
        seed: 9,
        name: "position",
        place: 0,
    };
    let offsets = error.offsets(&context).unwrap();
    for row in 0..out.data.n_rows() {
        let (a, b) = (out.data.coverage.ant1[row] as usize, out.data.coverage.ant2[row] as usize);
        // The true baseline is longer by d2 - d1, and its component along the direction of the source is added to w.
        let path: f64 = (0..3).map(|k| (offsets[b][k] - offsets[a][k]) * toward[k]).sum();
        for (chan, f) in freq.iter().enumerate() {
            let truth = Complex64::from_polar(2.0, std::f64::consts::TAU * path * f / 299_792_458.0);
            assert!((wide(out.data.vis[[row, chan, 0]]) - truth).norm() < 1e-4, "{row}");
        }
    }
}

#[test]
fn the_screen_moves_with_the_wind() {
    // Antenna 1 is 10 m east of antenna 0. A wind of 1 m/s to the east moves the screen from antenna 0 to antenna 1 in one integration.
    let clean = set(5, 1, LayoutFrame::Boresight);
    let wind = Wind { wind_m_s: 1.0, wind_to_rad: std::f64::consts::FRAC_PI_2, ..Wind::default() };
    let model = Troposphere { baseline_m: 100.0, wind, ..Troposphere::default() };
    let mut moved = clean.clone();
    let antennas = clean.header.layout.antennas().iter().enumerate().map(|(k, a)| {
        let x = if k == 1 { [10.0, 0.0, 0.0] } else { a.position_m };
        Antenna { position_m: x, ..a.clone() }
    });
    moved.header.layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap();
    let (_, table) = run(&moved, &[Error::Troposphere(model)], 2);
    for time in 0..4 {
        let difference = table.gains[[time, 0, 0, 0]] - table.gains[[time + 1, 1, 0, 0]];
        // Julian dates are good to 0.05 ms, here 0.05 mm of wind.
        assert!(difference.norm() < 2e-6, "{difference}");
        assert!((table.gains[[time, 0, 0, 0]] - table.gains[[time + 1, 0, 0, 0]]).norm() > 1e-3);
    }
}

#[test]
fn offsets_belong_to_baselines_and_break_closure() {
    let clean = set(4, 2, LayoutFrame::Boresight);
    let (out, table) = run(&clean, &[Error::Baseline(BaselineOffset { rms: 0.3 })], 5);
    assert!(table.gains.iter().all(|g| *g == Complex64::new(1.0, 0.0)));
    let n = 15;
    for row in 0..n {
        assert_eq!(out.data.vis[[row, 0, 0]], out.data.vis[[row + 2 * n, 1, 0]], "constant in time and frequency");
    }
    let sum: f64 = (0..n).flat_map(|r| [(r, 0), (r, 1)]).map(|(r, p)| (wide(out.data.vis[[r, 0, p]]) - 2.0).norm_sqr()).sum();
    let rms = (sum / (4.0 * n as f64)).sqrt();
    // 60 numbers: 9 per cent.
    assert!((rms / 0.3 - 1.0).abs() < 0.3, "{rms}");
}

#[test]
fn dropouts_last_their_part_of_the_time_and_are_known_to_the_truth() {
    let clean = set(2000, 1, LayoutFrame::Boresight);
    let error = Dropout { fraction: 0.2, mean_s: 60.0, noticed: true };
    let (out, table) = run(&clean, &[Error::Dropout(error)], 6);
    let off = table.flags.iter().filter(|f| **f).count() as f64 / table.flags.len() as f64;
    // 6 antennas x 20,000 s in cycles of 300 s are 400 dropouts. The fraction then scatters by 7 per cent of its value.
    assert!((off - 0.2).abs() < 0.045, "{off}");
    for (v, f) in out.data.vis.iter().zip(&out.data.flags) {
        assert_eq!(*f, v.norm() == 0.0);
    }
    let (out, _) = run(&clean, &[Error::Dropout(Dropout { noticed: false, ..error })], 6);
    assert!(out.data.flags.iter().all(|f| !f) && out.data.vis.iter().any(|v| v.norm() == 0.0));
}

#[test]
fn wrong_flags_have_their_fractions() {
    let mut clean = set(300, 1, LayoutFrame::Boresight);
    clean.data.flags.slice_mut(ndarray::s![.., .., 1]).fill(true);
    let (out, _) = run(&clean, &[Error::Flags(WrongFlags { good_flagged: 0.1, bad_unflagged: 0.3 })], 8);
    let part = |pol: usize| out.data.flags.slice(ndarray::s![.., .., pol]).iter().filter(|f| **f).count() as f64 / 4500.0;
    // Four standard errors of 4500 draws.
    assert!((part(0) - 0.1).abs() < 0.018 && (part(1) - 0.7).abs() < 0.028, "{} {}", part(0), part(1));
}

#[test]
fn noise_comes_on_top_and_its_variance_adds_to_that_of_the_data() {
    let clean = set(100, 1, LayoutFrame::Boresight);
    let error = ThermalNoise { sensitivity: None, diameter_m: None, data_have_noise: false };
    let sigma = 50.0 / (2.0 * 1e8 * 10.0_f64).sqrt();
    let (out, _) = run(&clean, &[Error::Noise(error)], 8);
    let rms = (out.data.vis.iter().map(|v| (f64::from(v.re) - 2.0).powi(2)).sum::<f64>() / 3000.0).sqrt();
    assert!((rms / sigma - 1.0).abs() < 4.0 / 6000.0_f64.sqrt(), "{}", rms / sigma);
    assert!((f64::from(out.data.weights[[0, 0, 0]]) * sigma * sigma - 1.0).abs() < 1e-5);
    let twice = ThermalNoise { data_have_noise: true, ..error };
    let (again, _) = run(&out, &[Error::Noise(twice)], 9);
    assert!((f64::from(again.data.weights[[0, 0, 0]]) * 2.0 * sigma * sigma - 1.0).abs() < 1e-5);
}

#[test]
fn each_error_keeps_its_numbers_when_another_is_added_and_blocks_do_not_matter() {
    let clean = set(3, 2, LayoutFrame::Boresight);
    let one = [phase(0.5, Variation::Constant)];
    let two = [Error::Flags(WrongFlags { good_flagged: 0.3, bad_unflagged: 0.0 }), one[0].clone(), phase(0.5, Variation::Constant)];
    let (_, a) = run(&clean, &one, 12);
    let (_, b) = run(&clean, &two, 12);
    let second = b.gains[[0, 3, 0, 0]] / a.gains[[0, 3, 0, 0]];
    assert!((second - a.gains[[0, 3, 0, 0]]).norm() > 1e-3, "the second phase error is another draw");
    let (_, c) = run(&clean, &two[..2], 12);
    assert_eq!(a.gains, c.gains);
    assert_ne!(run(&clean, &one, 13).1.gains, a.gains);
}

#[test]
fn feeds_get_errors_of_their_own_on_request() {
    let clean = set(1, 1, LayoutFrame::Boresight);
    let options = CorruptOptions { seed: 1, errors: vec![phase(1.0, Variation::Constant)], per_feed: true };
    let mut out = VisibilitySet::new(clean.header.clone(), clean.data.rows(0..0).unwrap()).unwrap();
    let table = corrupt(&mut clean.clone(), &mut out, &options, &Silent).unwrap();
    assert_eq!(table.feeds, ["R", "L"]);
    let g = |a: usize, b: usize, f: usize| table.gains[[0, a, 0, f]] * table.gains[[0, b, 0, f]].conj() * 2.0;
    assert!((wide(out.data.vis[[0, 0, 0]]) - g(0, 1, 0)).norm() < 1e-6);
    assert!((wide(out.data.vis[[0, 0, 1]]) - g(0, 1, 1)).norm() < 1e-6);
    assert!((g(0, 1, 0) - g(0, 1, 1)).norm() > 1e-3);
}

#[test]
fn bad_parameters_and_empty_sets_are_refused_and_every_kind_has_its_row() {
    let clean = set(1, 1, LayoutFrame::Boresight);
    let try_with = |set: &VisibilitySet, error: Error| {
        let options = CorruptOptions { seed: 1, errors: vec![error], per_feed: false };
        let mut out = VisibilitySet::new(set.header.clone(), set.data.rows(0..0).unwrap()).unwrap();
        corrupt(&mut set.clone(), &mut out, &options, &Silent).map(|_| ()).unwrap_err().to_string()
    };
    assert!(try_with(&clean, phase(-1.0, Variation::Constant)).contains("phase rms"));
    assert!(try_with(&clean, phase(f64::NAN, Variation::Constant)).contains("NaN"));
    assert!(try_with(&clean, Error::Position(PositionError { rms_m: None })).contains("A0"));
    let empty = VisibilitySet::new(clean.header.clone(), clean.data.rows(0..0).unwrap()).unwrap();
    assert!(try_with(&empty, phase(1.0, Variation::Constant)).contains("no rows"));
    let names: Vec<&str> = [
        phase(1.0, Variation::Constant),
        Error::Amplitude(AmplitudeError { rms: 0.1, variation: Variation::Constant }),
        Error::Delay(DelayError { rms_s: 1e-9, variation: Variation::Constant }),
        Error::Position(PositionError { rms_m: None }),
        Error::Troposphere(Troposphere::default()),
        Error::Atmosphere(atmosphere_tests::still()),
        Error::Bandpass(BandpassError { ripple: 0.1, period_hz: 1e6, mismatch: 0.0 }),
        Error::Band(BandError { shape: crate::simulate::BandShape::Flat, offset_rms_hz: 0.0, width_rms: 0.0 }),
        Error::Jitter(JitterError { rms_s: 1e-13, sampler_hz: None }),
        Error::Pointing(PointingError { rms_rad: 0.1, variation: Variation::Constant }),
        Error::Width(WidthError { rms: 0.1 }),
        Error::CrossPhase(CrossPhase { phase_rad: 0.1 }),
        Error::Leakage(LeakageError { rms: 0.1 }),
        Error::Baseline(BaselineOffset { rms: 0.1 }),
        Error::Dropout(Dropout { fraction: 0.1, mean_s: 1.0, noticed: true }),
        Error::Noise(ThermalNoise { sensitivity: None, diameter_m: None, data_have_noise: false }),
        Error::Flags(WrongFlags { good_flagged: 0.0, bad_unflagged: 0.0 }),
    ]
    .iter()
    .map(Error::name)
    .collect();
    assert_eq!(names, Error::TABLE.iter().map(|t| t.0).collect::<Vec<_>>());
}

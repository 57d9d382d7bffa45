//! What is written comes back.

use crate::{common, read, temp, write};
use cittert_arrays::*;
use cittert_formats::ms::{MsSource, MsWriter};
use cittert_formats::{ColumnSink, CreateOptions, VisColumn};
use num_complex::Complex;
use std::f64::consts::TAU;

/// Same header and rows; nsamples come back as weights, since Measurement Sets have only these.
fn assert_same(a: &VisibilitySet, b: &VisibilitySet) {
    assert_eq!((&a.header.polarizations, &a.header.spectrum), (&b.header.polarizations, &b.header.spectrum));
    assert_eq!((&a.header.phase_centers, a.header.unit), (&b.header.phase_centers, b.header.unit));
    assert_eq!((&a.header.telescope, &a.header.layout.name), (&b.header.telescope, &b.header.layout.name));
    assert_eq!(a.header.history, b.header.history);
    for (x, y) in a.header.layout.antennas().iter().zip(b.header.layout.antennas()) {
        assert_eq!((&x.name, x.number, x.diameter_m), (&y.name, y.number, y.diameter_m));
        assert!((0..3).all(|k| (x.position_m[k] - y.position_m[k]).abs() < 1e-7), "{x:?} {y:?}");
    }
    let (x, y) = (&a.data.coverage, &b.data.coverage);
    assert_eq!((&x.ant1, &x.ant2, &x.phase_center), (&y.ant1, &y.ant2, &y.phase_center));
    assert_eq!((&x.uvw_m, &x.integration_s), (&y.uvw_m, &y.integration_s));
    assert!(x.time_jd.iter().zip(&y.time_jd).all(|(s, t)| (s - t).abs() * 86_400.0 < 1e-3));
    assert_eq!((&a.data.vis, &a.data.flags, &a.data.weights), (&b.data.vis, &b.data.flags, &b.data.weights));
    assert_eq!(b.data.nsamples, b.data.weights);
}

#[test]
fn a_set_comes_back_whatever_the_blocks() {
    let set = common::earth();
    for (out, back) in [(1000, 1000), (37, 11)] {
        let (_dir, path) = temp();
        assert!(write(&path, &set, out).is_empty());
        assert_same(&set, &read(&path, VisColumn::Data, back));
    }
}

#[test]
fn weights_that_begin_to_differ_between_channels_late_come_back() {
    let mut set = common::earth();
    let n = set.data.n_rows();
    set.data.weights[(n - 1, 2, 1)] = 0.25;
    set.data.weights[(n - 1, 3, 1)] = 0.0;
    let (_dir, path) = temp();
    write(&path, &set, 50);
    assert_same(&set, &read(&path, VisColumn::Data, 64));
}

#[test]
fn several_windows_and_phase_centres_come_back() {
    let mut set = common::earth();
    let freq = vec![1.40e9, 1.41e9, 1.60e9, 1.61e9];
    set.header.spectrum = SpectralWindow::with_windows(freq, vec![1e7; 4], vec![0, 0, 1, 1]).unwrap();
    let mut other = PhaseCenter::sidereal("OLD", 1.0, -0.5).unwrap();
    (other.frame, other.epoch, other.id) = ("fk5".into(), Some(2000.0), 7);
    set.header.phase_centers.push(other);
    set.data.weights[(3, 0, 0)] = 9.0;
    let n = set.data.n_rows();
    set.data.coverage.phase_center[n / 2..].fill(1);
    let (_dir, path) = temp();
    write(&path, &set, 45);
    let back = read(&path, VisColumn::Data, 31);
    assert_same(&set, &back);
    assert_eq!(MsSource::open(&path, VisColumn::Data).unwrap().columns(), [VisColumn::Data]);
}

#[test]
fn rows_that_repeat_a_baseline_and_time_stay_apart_in_several_windows() {
    let mut set = common::earth();
    set.header.spectrum = SpectralWindow::with_windows(vec![1.40e9, 1.41e9, 1.60e9, 1.61e9], vec![1e7; 4], vec![0, 0, 1, 1]).unwrap();
    let mut twice = set.data.rows(0..100).unwrap();
    twice.vis.mapv_inplace(|v| v + 3.0);
    set.data.append(&twice).unwrap();
    set.data.append(&twice).unwrap();
    let (_dir, path) = temp();
    write(&path, &set, 1000);
    assert_same(&set, &read(&path, VisColumn::Data, 77));
}

/// Rows whose antennas stand in the wrong order are exchanged, with baseline, visibilities and cross products: the set predicts the
/// same, and a second round changes nothing.
#[test]
fn exchanged_rows_are_the_same_measurement() {
    let pols = [Polarization::RR, Polarization::LL, Polarization::RL, Polarization::LR];
    let layout = common::earth().header.layout;
    let mut set = common::set(common::header(layout, SpectralWindow::band(1.4e9, 4e6, 2).unwrap(), &pols), 2);
    set.data.vis.indexed_iter_mut().for_each(|((r, c, p), v)| *v += Complex::new(r as f32, (10 * c + p) as f32));
    let original = set.clone();
    for row in (0..set.data.n_rows()).step_by(3) {
        let c = &mut set.data.coverage;
        std::mem::swap(&mut c.ant1[row], &mut c.ant2[row]);
        c.uvw_m.row_mut(row).mapv_inplace(|x| -x);
        for chan in 0..2 {
            for (to, from) in [0, 1, 3, 2].into_iter().enumerate() {
                let i = (row, chan, from);
                let o = (row, chan, to);
                set.data.vis[o] = original.data.vis[i].conj();
                set.data.flags[o] = original.data.flags[i];
                set.data.weights[o] = original.data.weights[i];
            }
        }
    }
    let (_dir, path) = temp();
    write(&path, &set, 20);
    assert_same(&original, &read(&path, VisColumn::Data, 100));
}

#[test]
fn a_boresight_set_in_kelvin_becomes_two_hands_in_jy_and_stays_in_its_frame() {
    let mut set = common::boresight();
    set.header.layout.pattern = "gaussian fwhm_deg=9".parse().unwrap();
    set.header.antenna_temperature_k = Some(264.7);
    set.header.near_field = cittert_arrays::NearField::of_parts(Some("plane 10.5"), [Some(0.1), Some(-0.05), Some(31.25)]).unwrap();
    let receivers: Vec<Sensitivity> = (0..set.header.layout.n_ant())
        .map(|k| if k % 3 == 1 { Sensitivity::SefdJy(4e8 * k as f64) } else { Sensitivity::TsysK(100.0 * k as f64) })
        .collect();
    set.header.layout = set.header.layout.with_receivers(&receivers);
    let (_dir, path) = temp();
    let notes = write(&path, &set, 1000).join("\n");
    for part in ["2 k nu^2 / c^2", "RR and LL", "zenith", "280 K", "2^"] {
        assert!(notes.contains(part), "{part}: {notes}");
    }
    let back = read(&path, VisColumn::Data, 1000);
    assert!(back.header.is_boresight());
    assert_eq!(back.header.unit, VisUnit::Jy);
    assert_eq!(back.header.polarizations, [Polarization::RR, Polarization::LL]);
    let simulated = (back.header.pedestal_k, back.header.scene_pedestal_k, back.header.scene_width_rad);
    assert_eq!(simulated, (Some(280.0), Some(281.5), Some(0.25)));
    assert_eq!((&back.header.layout.pattern, back.header.antenna_temperature_k), (&set.header.layout.pattern, Some(264.7)));
    assert_eq!(back.header.near_field, set.header.near_field);
    let of = |l: &ArrayLayout| l.antennas().iter().map(|a| a.receiver).collect::<Vec<_>>();
    assert_eq!(of(&back.header.layout), of(&set.header.layout), "the receivers");
    assert_eq!(back.header.phase_centers[0].kind, PhaseCenterKind::Unprojected);
    assert!(back.header.history.iter().any(|h| h.contains("zenith")));
    assert_eq!(back.data.coverage.uvw_m, set.data.coverage.uvw_m);
    for (x, y) in set.header.layout.antennas().iter().zip(back.header.layout.antennas()) {
        assert!((0..3).all(|k| (x.position_m[k] - y.position_m[k]).abs() < 1e-7));
    }
    let freq = set.header.spectrum.freq_hz();
    for ((r, c, p), v) in back.data.vis.indexed_iter() {
        let factor = 2.0 * BOLTZMANN_J_PER_K * (freq[c] / SPEED_OF_LIGHT_M_S).powi(2) * 1e26;
        let want = set.data.vis[(r, c, 0)] * factor as f32;
        assert!((v - want).norm() <= 1e-6 * want.norm(), "{r} {c} {p}");
        let weight = f64::from(set.data.weights[(r, c, 0)]) / (2.0 * factor * factor);
        assert!((f64::from(back.data.weights[(r, c, p)]) / weight - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_drifting_array_gets_a_field_for_each_time() {
    let mut set = common::earth();
    set.header.phase_centers = vec![PhaseCenter::unprojected("zenith")];
    let (_dir, path) = temp();
    let notes = write(&path, &set, 100);
    assert!(notes[0].contains("each time gets its own field"), "{notes:?}");
    let back = read(&path, VisColumn::Data, 1000);
    assert_eq!(back.header.phase_centers.len(), 6);
    let ra = |k: usize| back.header.phase_centers[k].ra_dec_rad().unwrap().0;
    // The sky turns by 60 s of sidereal time between two fields; 23 years of precession stretch right ascensions by at most
    // n t tan(dec) = 20.04 arcsec x 23 x 0.68, 1.5e-3.
    assert!(((ra(1) - ra(0)) / (TAU * 60.0 * 1.002_737_9 / 86_400.0) - 1.0).abs() < 1.6e-3, "{}", ra(1) - ra(0));
    assert_eq!(back.data.coverage.phase_center.last(), Some(&5));
}

#[test]
fn model_and_corrected_columns_are_written_and_read() {
    let set = common::earth();
    let (model, corrected) = (set.data.vis.mapv(|v| v * 2.0), set.data.vis.mapv(|v| v * Complex::i()));
    let (_dir, path) = temp();
    let options = CreateOptions { columns: vec![VisColumn::Model, VisColumn::Corrected], ..CreateOptions::default() };
    let mut writer = MsWriter::create(&path, &set.header, &options).unwrap();
    assert!(
        writer.write(&set.data).unwrap_err().to_string().contains("columns beside the data"),
        "a column that was asked for and is not given"
    );
    writer.write_columns(&set.data, &[model.view(), corrected.view()]).unwrap();
    writer.complete().unwrap();
    assert_eq!(read(&path, VisColumn::Data, 1000).data.vis, set.data.vis);
    assert_eq!(read(&path, VisColumn::Model, 1000).data.vis, model);
    assert_eq!(read(&path, VisColumn::Corrected, 1000).data.vis, corrected);
}

#[test]
fn data_that_no_imager_can_take_are_flagged_and_counted() {
    let mut set = common::earth();
    set.data.flags.fill(false);
    set.data.weights[(0, 0, 0)] = f32::INFINITY;
    set.data.weights[(0, 1, 0)] = -1.0;
    set.data.vis[(1, 0, 1)] = Complex::new(f32::NAN, 0.0);
    let (_dir, path) = temp();
    let notes = write(&path, &set, 1000).join("\n");
    assert!(notes.contains("2 weights") && notes.contains("1 visibilities"), "{notes}");
    let back = read(&path, VisColumn::Data, 1000);
    assert_eq!(back.data.flags.iter().filter(|f| **f).count(), 3);
    assert!(back.data.vis.iter().all(|v| v.re.is_finite()) && back.data.weights.iter().all(|w| *w >= 0.0 && w.is_finite()));
}

#[test]
fn a_single_cross_product_cannot_be_exchanged() {
    let layout = common::earth().header.layout;
    let pols = [Polarization::RR, Polarization::RL];
    let mut set = common::set(common::header(layout, SpectralWindow::band(1.4e9, 4e6, 1).unwrap(), &pols), 1);
    let (_dir, path) = temp();
    write(&path, &set, 1000);
    let c = &mut set.data.coverage;
    std::mem::swap(&mut c.ant1[0], &mut c.ant2[0]);
    let mut writer = MsWriter::create(&path.with_extension("b"), &set.header, &CreateOptions::default()).unwrap();
    let error = writer.write(&set.data).unwrap_err().to_string();
    assert!(error.contains("both cross products"), "{error}");
}

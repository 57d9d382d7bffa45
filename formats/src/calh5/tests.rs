//! Gain tables there and back.

use super::*;
use cittert_arrays::{Antenna, ArrayLayout, GainTable, LayoutFrame, SpectralWindow};
use ndarray::{Array3, Array4, Axis};
use num_complex::Complex64;

fn table() -> GainTable {
    let antennas = (0..4).map(|k| Antenna::new(format!("A{k}"), k + 3, [f64::from(k), 0.5, 0.0])).collect();
    let layout = ArrayLayout::new("imager", LayoutFrame::Boresight, antennas).unwrap();
    let spectrum = SpectralWindow::band(94e9, 8e9, 2).unwrap();
    let mut t =
        GainTable::unity(layout, spectrum, vec!["R".into(), "L".into()], vec![2_460_000.5, 2_460_000.625, 2_460_000.75], vec![5400.0; 3])
            .unwrap();
    let value = |(s, a, c, f): (usize, usize, usize, usize)| {
        Complex64::from_polar(1.0 + 0.1 * a as f64, 0.3 * s as f64 - 0.2 * c as f64 + f as f64)
    };
    t.gains = Array4::from_shape_fn(t.gains.raw_dim(), value);
    t.flags[(1, 2, 0, 1)] = true;
    t.quality = Some(t.gains.mapv(|g| g.norm()));
    t.total_quality = Some(Array3::from_shape_fn((3, 2, 2), |(s, c, f)| (4 * s + 2 * c + f) as f64));
    t.refant = Some(1);
    t.mode = "phase".into();
    t.history = vec!["a".into(), "b".into()];
    t
}

#[test]
fn a_table_comes_back() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("g.calh5");
    let mut t = table();
    write_gains(&path, &t, false).unwrap();
    assert!(is_gains(&path));
    assert_eq!(read_gains(&path).unwrap(), t);
    (t.quality, t.total_quality, t.refant, t.feeds[0]) = (None, None, None, "X".into());
    write_gains(&path, &t, true).unwrap();
    assert_eq!(read_gains(&path).unwrap(), t);
}

#[test]
fn leakages_come_back_as_elements_of_jones_matrices() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("g.calh5");
    for (feeds, numbers) in [(["R", "L"], [-1, -2, -3, -4]), (["X", "Y"], [-5, -6, -7, -8])] {
        let mut t = table();
        t.feeds = feeds.map(String::from).to_vec();
        let d = |(s, a, c, f): (usize, usize, usize, usize)| Complex64::new(0.1 * a as f64 - 0.02 * f as f64, 0.01 * (s + c) as f64);
        let mut leakages = Array4::from_shape_fn(t.gains.raw_dim(), d);
        // Leakages of gains that are not known are not known.
        leakages[(1, 2, 0, 1)] = Complex64::ZERO;
        t.leakages = Some(leakages.clone());
        write_gains(&path, &t, true).unwrap();
        let jones: Vec<i64> = hdf5::File::open(&path).and_then(|f| f.dataset("Header/jones_array")).and_then(|d| d.read_raw()).unwrap();
        assert_eq!(jones, numbers);
        let mut back = read_gains(&path).unwrap();
        let off = back.leakages.take().unwrap().iter().zip(&leakages).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-15, "{off}");
        t.leakages = None;
        assert_eq!(back, t);
    }
}

#[test]
fn a_table_spread_over_channels_is_read_as_one_channel_where_they_agree() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("g.calh5");
    let mut t = table();
    let wide = SpectralWindow::band(94e9, 8e9, 4).unwrap();
    write_gains_on(&path, &t, (&wide, &[0, 0, 1, 1]), false).unwrap();
    let all = read_gains(&path).unwrap();
    assert_eq!(all.spectrum, wide);
    assert_eq!(all.gains, t.gains.select(Axis(2), &[0, 0, 1, 1]));
    assert_eq!(all.flags, t.flags.select(Axis(2), &[0, 0, 1, 1]));
    assert_eq!(all.quality, t.quality.as_ref().map(|q| q.select(Axis(2), &[0, 0, 1, 1])));
    assert_eq!(all.total_quality, t.total_quality.as_ref().map(|q| q.select(Axis(1), &[0, 0, 1, 1])));
    assert_eq!(read_gains_for(&path, &wide).unwrap(), all, "two channels differ");
    write_gains_on(&path, &t, (&wide, &[1; 4]), true).unwrap();
    let one = read_gains_for(&path, &wide).unwrap();
    assert_eq!((one.spectrum.freq_hz(), one.spectrum.width_hz()), (&[94e9][..], &[8e9][..]));
    assert_eq!(one.gains, t.gains.select(Axis(2), &[1]));
    assert_eq!((one.flags, one.time_jd), (t.flags.select(Axis(2), &[1]), t.time_jd.clone()));
    let wrong = write_gains_on(&path, &t, (&wide, &[0, 2, 0, 0]), true).unwrap_err();
    assert!(wrong.to_string().contains("channel of the table"), "{wrong}");
    t.flags[(0, 0, 0, 0)] = true;
    write_gains(&path, &t, true).unwrap();
    assert_eq!(read_gains_for(&path, &t.spectrum).unwrap().spectrum, t.spectrum);
}

#[test]
fn shared_gains_are_written_for_each_feed() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("g.calh5");
    let t = table();
    let layout = t.layout.clone();
    let mut shared = GainTable::unity(layout, t.spectrum.clone(), vec!["X+Y".into()], t.time_jd.clone(), t.interval_s.clone()).unwrap();
    shared.gains = t.gains.select(Axis(3), &[1]);
    shared.flags = t.flags.select(Axis(3), &[1]);
    write_gains(&path, &shared, false).unwrap();
    let jones: Vec<i64> = hdf5::File::open(&path).and_then(|f| f.dataset("Header/jones_array")).and_then(|d| d.read_raw()).unwrap();
    assert_eq!(jones, [-5, -6]);
    assert_eq!(read_gains(&path).unwrap(), shared);
}

#[test]
fn gains_to_multiply_by_are_inverted() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("g.calh5");
    let t = table();
    write_gains(&path, &t, false).unwrap();
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        file.unlink("Header/gain_convention").unwrap();
        file.new_dataset::<hdf5::types::FixedAscii<8>>()
            .create("Header/gain_convention")
            .and_then(|d| d.write_scalar(&hdf5::types::FixedAscii::<8>::from_ascii("multiply").unwrap()))
            .unwrap();
    }
    let back = read_gains(&path).unwrap();
    assert!(back.gains.iter().zip(&t.gains).all(|(a, b)| (a * b - 1.0).norm() < 1e-12));
}

#[test]
fn what_is_no_gain_table_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("g.calh5");
    std::fs::write(&path, "text").unwrap();
    assert!(read_gains(&path).unwrap_err().to_string().contains("CalH5"));
    hdf5::File::create(&path).unwrap().create_group("Data").unwrap();
    assert!(read_gains(&path).unwrap_err().to_string().contains("without Data/gains or Data/delays"));
}

/// A table of the gains of delays between -3 and 3 ns, over two windows.
fn delayed() -> (GainTable, Array4<f64>) {
    let freq = [93e9, 93.1e9, 93.2e9, 95e9, 95.1e9].to_vec();
    let mut t = table();
    t.spectrum = SpectralWindow::with_windows(freq, vec![1e8; 5], vec![0, 0, 0, 1, 1]).unwrap();
    let delay = Array4::from_shape_fn((3, 4, 2, 2), |(s, a, w, f)| 1e-9 * (s as f64 - 0.7 * a as f64 + 0.3 * w as f64 + 0.05 * f as f64));
    let gain = |(s, a, c, f): (usize, usize, usize, usize)| {
        let tau = delay[(s, a, usize::from(c > 2), f)];
        Complex64::from_polar(1.0, -std::f64::consts::TAU * t.spectrum.freq_hz()[c] * tau)
    };
    t.gains = Array4::from_shape_fn((3, 4, 5, 2), gain);
    t.flags = Array4::from_elem((3, 4, 5, 2), false);
    (t.quality, t.total_quality) = (None, None);
    (t, delay)
}

#[test]
fn delays_come_back_at_the_channels_of_the_data() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("d.calh5");
    let (mut t, delay) = delayed();
    t.flags.slice_mut(ndarray::s![1, 2, 3.., 0]).fill(true);
    write_delays(&path, &t, false).unwrap();
    assert!(is_gains(&path));
    let on_disk: Array4<f64> = {
        let file = hdf5::File::open(&path).unwrap();
        file.dataset("Data/delays").unwrap().read_dyn::<f64>().unwrap().into_dimensionality().unwrap()
    };
    for ((a, w, s, f), d) in on_disk.indexed_iter() {
        let expected = if (s, a, w, f) == (1, 2, 1, 0) { 0.0 } else { delay[(s, a, w, f)] };
        assert!((d - expected).abs() < 1e-18, "{d} {expected}");
    }
    let back = read_gains_for(&path, &t.spectrum).unwrap();
    assert_eq!(back.flags, t.flags);
    assert_eq!((&back.feeds, &back.refant, &back.time_jd), (&t.feeds, &t.refant, &t.time_jd));
    let good = back.gains.iter().zip(&t.gains).zip(&t.flags).filter(|g| !g.1);
    assert!(good.clone().count() == 118 && good.into_iter().all(|((a, b), _)| (a - b).norm() < 1e-6));
    // Without the data the channels are made so that they show the delay; from them the same delays are written.
    let alone = read_gains(&path).unwrap();
    let longest = 2.1e-9;
    assert!(alone.spectrum.n_chan() >= (std::f64::consts::TAU * longest * 3e8 / 0.05) as usize);
    write_delays(&dir.path().join("again.calh5"), &alone, false).unwrap();
    let again = read_gains_for(&dir.path().join("again.calh5"), &t.spectrum).unwrap();
    assert!(again.gains.iter().zip(&back.gains).all(|(a, b)| (a - b).norm() < 1e-6));
}

#[test]
fn gains_that_are_no_delays_are_refused_by_the_antenna() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("d.calh5");
    let (good, _) = delayed();
    let refused = |change: &dyn Fn(&mut GainTable), words: [&str; 3]| {
        let mut t = good.clone();
        change(&mut t);
        let e = write_delays(&path, &t, false).unwrap_err().to_string();
        assert!(words.iter().all(|w| e.contains(w)) && e.contains("d.calh5") && !path.exists(), "{e}");
    };
    refused(&|t| t.gains[(0, 1, 2, 0)] *= 1.5, ["antenna A1, interval 0, feed R, window 0", "expected", "amplitude of 1.5"]);
    let turn = Complex64::from_polar(1.0, 1.3);
    refused(
        &|t| t.gains.slice_mut(ndarray::s![2, 3, .., 1]).mapv_inplace(|g| g * turn),
        ["antenna A3", "interval 2", "a phase of its own"],
    );
    refused(&|t| t.flags.slice_mut(ndarray::s![0, 0, 1.., 0]).fill(true), ["antenna A0", "interval 0", "one channel"]);
}

//! UVFITS: sets that cittert writes are read back unchanged, conversions are reported, and unusual files are read.

use super::common;
use cittert_arrays::*;
use cittert_formats::uvfits::{UvfitsOptions, UvfitsReader, UvfitsWriter};
use std::path::Path;

fn save(path: &Path, set: &VisibilitySet, options: UvfitsOptions) -> Vec<String> {
    let mut writer = UvfitsWriter::create(path, &set.header, options).unwrap();
    let notes = writer.notes().to_vec();
    let n = set.data.n_rows();
    for start in (0..n).step_by(41) {
        writer.write(&set.data.rows(start..(start + 41).min(n)).unwrap()).unwrap();
    }
    assert!(!path.exists());
    writer.complete().unwrap();
    assert_eq!(std::fs::metadata(path).unwrap().len() % 2880, 0);
    notes
}

/// Largest difference of uvw over the longest baseline, of time in s, and of positions in m.
fn differences(a: &VisibilitySet, b: &VisibilityBlock, layout: &ArrayLayout) -> (f64, f64, f64) {
    let (ca, cb) = (&a.data.coverage, &b.coverage);
    let max = |i: &mut dyn Iterator<Item = f64>| i.fold(0.0, f64::max);
    let uvw = max(&mut ca.uvw_m.iter().zip(&cb.uvw_m).map(|(x, y)| (x - y).abs())) / ca.longest_uv_m();
    let time = max(&mut ca.time_jd.iter().zip(&cb.time_jd).map(|(x, y)| (x - y).abs() * 86_400.0));
    let pairs = a.header.layout.antennas().iter().zip(layout.antennas());
    let place = max(&mut pairs.flat_map(|(x, y)| (0..3).map(move |k| (x.position_m[k] - y.position_m[k]).abs())));
    (uvw, time, place)
}

#[test]
fn a_set_keeps_everything_to_the_promised_digits() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("e.uvfits");
    let mut set = common::earth();
    set.data.coverage.time_jd.iter_mut().for_each(|t| *t += 0.123_456_789);
    let notes = save(&path, &set, UvfitsOptions::default());
    assert!(notes.is_empty(), "{notes:?}");
    let mut reader = UvfitsReader::open(&path).unwrap();
    let block = reader.read(0..set.data.n_rows()).unwrap();
    assert_eq!(block.vis, set.data.vis);
    assert_eq!(block.flags, set.data.flags);
    assert_eq!(block.weights, set.data.weights);
    assert_eq!((&block.coverage.ant1, &block.coverage.ant2), (&set.data.coverage.ant1, &set.data.coverage.ant2));
    let header = reader.header();
    let (uvw, time, place) = differences(&set, &block, &header.layout);
    assert!(uvw < 1e-7 && time < 1e-4 && place < 1e-6, "uvw {uvw} time {time} s place {place} m");
    assert_eq!(header.spectrum, set.header.spectrum);
    assert_eq!(header.polarizations, set.header.polarizations);
    assert_eq!((header.unit, header.telescope.as_str()), (VisUnit::Jy, "SPIRAL"));
    assert_eq!((header.phase_centers[0].frame.as_str(), header.phase_centers[0].name.as_str()), ("icrs", "CYGA"));
    let (a, b) = (header.phase_centers[0].ra_dec_rad().unwrap(), set.header.phase_centers[0].ra_dec_rad().unwrap());
    assert!((a.0 - b.0).abs() < 1e-15 && (a.1 - b.1).abs() < 1e-15);
    assert_eq!(header.layout.antennas()[3].diameter_m, Some(12.0));
    assert!(UvfitsWriter::create(&path, &set.header, UvfitsOptions::default()).is_err());
}

#[test]
fn a_boresight_set_gets_a_place_on_the_sky_and_jansky() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("b.uvfits");
    let mut set = common::boresight();
    set.header.layout.pattern = "airy diameter_m=0.01 blockage=0.25".parse().unwrap();
    set.header.antenna_temperature_k = Some(264.7);
    set.header.near_field = cittert_arrays::NearField::of_parts(Some("plane 10.5"), [Some(0.1), Some(-0.05), Some(31.25)]).unwrap();
    let receivers: Vec<Sensitivity> = (0..set.header.layout.n_ant())
        .map(|k| if k % 3 == 1 { Sensitivity::SefdJy(4e8 * k as f64) } else { Sensitivity::TsysK(100.0 * k as f64) })
        .collect();
    set.header.layout = set.header.layout.with_receivers(&receivers);
    // Weights that are not the numbers of samples are 1/sigma^2.
    set.data.weights.mapv_inplace(|w| w * 1e18);
    let notes = save(&path, &set, UvfitsOptions::default()).join("\n");
    for word in ["zenith", "K str became Jy", "RR and LL", "280 K"] {
        assert!(notes.contains(word), "{notes}");
    }
    let mut reader = UvfitsReader::open(&path).unwrap();
    let block = reader.read(0..set.data.n_rows()).unwrap();
    let header = reader.header();
    assert_eq!((header.unit, &header.polarizations[..]), (VisUnit::Jy, &[Polarization::RR, Polarization::LL][..]));
    assert_eq!((header.pedestal_k, header.scene_pedestal_k, header.scene_width_rad), (Some(280.0), Some(281.5), Some(0.25)));
    assert_eq!((&header.layout.pattern, header.antenna_temperature_k), (&set.header.layout.pattern, Some(264.7)));
    assert_eq!(header.near_field, set.header.near_field);
    let of = |l: &ArrayLayout| l.antennas().iter().map(|a| a.receiver).collect::<Vec<_>>();
    assert_eq!(of(&header.layout), of(&set.header.layout), "the receivers");
    assert!(header.phase_centers[0].ra_dec_rad().is_some());
    assert!(header.history.iter().any(|h| h.contains("zenith")));
    let f = header.spectrum.freq_hz()[2];
    let jy = jy_per_kelvin_sr(f);
    for pol in 0..2 {
        let (found, expected) = (block.vis[(5, 2, pol)].re, f64::from(set.data.vis[(5, 2, 0)].re) * jy);
        assert!((f64::from(found) - expected).abs() < 1e-6 * jy, "{found} {expected}");
        let (found, expected) = (f64::from(block.weights[(5, 2, pol)]), f64::from(set.data.weights[(5, 2, 0)]) / (2.0 * jy * jy));
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
    }
    let (uvw, time, place) = differences(&set, &block, &header.layout);
    assert!(uvw < 1e-7 && time < 1e-4 && place < 1e-9, "uvw {uvw} time {time} place {place}");
}

#[test]
fn weights_without_noise_stay_near_one_after_kelvin_became_jansky() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("b.uvfits");
    let set = common::boresight();
    save(&path, &set, UvfitsOptions::default());
    let block = UvfitsReader::open(&path).unwrap().read(0..5).unwrap();
    let expected = 0.5 * set.data.weights[(1, 0, 0)];
    assert!((block.weights[(1, 0, 0)] / expected - 1.0).abs() < 0.2, "{} {expected}", block.weights[(1, 0, 0)]);
    assert!(block.weights[(1, 0, 0)] > block.weights[(1, 3, 0)]);
}

#[test]
fn the_zenith_is_where_the_array_looks() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("z.uvfits");
    let set = common::boresight();
    save(&path, &set, UvfitsOptions::default());
    let reader = UvfitsReader::open(&path).unwrap();
    let (ra, dec) = reader.header().phase_centers[0].ra_dec_rad().unwrap();
    let sky = astrometry::LocalSky::at(set.data.coverage.time_jd[0], &cittert_formats::uvh5::NOMINAL_SITE).unwrap();
    let place = sky.apparent_place(ra, dec, "icrs").unwrap();
    assert!((place.ra_rad - sky.lst_rad()).abs() < 1e-9 && place.dec_rad.abs() < 1e-9, "{place:?}");
}

#[test]
fn uneven_channels_and_windows_become_ifs() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("w.uvfits");
    let mut set = common::earth();
    let even = SpectralWindow::with_windows(vec![1.4e9, 1.401e9, 1.7e9, 1.701e9], vec![1e6; 4], vec![0, 0, 1, 1]).unwrap();
    let uneven = SpectralWindow::new(vec![1.4e9, 1.5e9, 1.7e9, 1.75e9], vec![1e6, 2e6, 1e6, 5e5]).unwrap();
    for (spectrum, noted) in [(even, false), (uneven, true)] {
        set.header.spectrum = spectrum.clone();
        let notes = save(&path, &set, UvfitsOptions { overwrite: true, ..Default::default() });
        assert_eq!(!notes.is_empty(), noted, "{notes:?}");
        let mut reader = UvfitsReader::open(&path).unwrap();
        assert_eq!(reader.header().spectrum.freq_hz(), spectrum.freq_hz());
        assert_eq!(reader.header().spectrum.width_hz(), spectrum.width_hz());
        assert_eq!(reader.read(0..9).unwrap().vis, set.data.rows(0..9).unwrap().vis);
        std::fs::remove_file(&path).unwrap();
    }
}

#[test]
fn several_phase_centres_and_all_four_hands_survive() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("m.uvfits");
    let layout = common::spiral(5, 100.0, LayoutFrame::EastNorthUp(common::site()));
    let pols = [Polarization::RL, Polarization::RR, Polarization::LR, Polarization::LL];
    let mut header = common::header(layout, SpectralWindow::band(5e9, 1e8, 1).unwrap(), &pols);
    header.phase_centers.push(PhaseCenter::sidereal("3C48", 0.42, 0.57).unwrap());
    let mut set = common::set(header, 4);
    (20..40).for_each(|r| set.data.coverage.phase_center[r] = 1);
    save(&path, &set, UvfitsOptions::default());
    let mut reader = UvfitsReader::open(&path).unwrap();
    assert_eq!(reader.header().polarizations, [Polarization::RR, Polarization::LL, Polarization::RL, Polarization::LR]);
    assert_eq!(reader.header().phase_centers[1].name, "3C48");
    let block = reader.read(0..40).unwrap();
    assert_eq!(block.coverage.phase_center, set.data.coverage.phase_center);
    for (new, old) in [1, 3, 0, 2].into_iter().enumerate() {
        assert_eq!(block.vis[(30, 0, new)], set.data.vis[(30, 0, old)]);
    }
}

#[test]
fn more_than_255_antennas_are_numbered_without_baseline() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("many.uvfits");
    let layout = common::spiral(300, 100.0, LayoutFrame::EastNorthUp(common::site()));
    let header = common::header(layout, SpectralWindow::band(5e9, 1e8, 1).unwrap(), &[Polarization::RR]);
    let mut rows = UvCoverage::empty();
    for (a, b) in [(0, 299), (255, 256), (298, 299)] {
        let uvw = ndarray::Array2::from_elem((1, 3), f64::from(a));
        rows.append(&UvCoverage::new(uvw, vec![a], vec![b], vec![2_460_000.5], vec![1.0], vec![0]).unwrap()).unwrap();
    }
    let set = VisibilitySet::new(header, VisibilityBlock::zeros(rows, 1, 1)).unwrap();
    save(&path, &set, UvfitsOptions::default());
    let block = UvfitsReader::open(&path).unwrap().read(0..3).unwrap();
    assert_eq!((block.coverage.ant1, block.coverage.ant2), (set.data.coverage.ant1, set.data.coverage.ant2));
}

/// Visibilities of a source at the zenith of the first time, as an array without a phase centre sees it pass: at that phase centre they
/// are all 1, on the baselines that the phase centre sees.
#[test]
fn a_drift_scan_is_phased_to_the_zenith_of_its_first_time_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("z.uvfits");
    let mut set = common::earth();
    set.header.phase_centers = vec![PhaseCenter::unprojected("zenith")];
    let said = save(&path, &set, UvfitsOptions::default());
    assert!(said.iter().any(|n| n.contains("does not follow the sky")), "{said:?}");
    let center = UvfitsReader::open(&path).unwrap().header().phase_centers[0].clone();
    assert_eq!(center.name, format!("zenith_at_jd{:.6}", set.data.coverage.time_jd[0]));
    let (ra, dec) = center.ra_dec_rad().unwrap();
    let (ants, freq) = (set.header.layout.antennas().to_vec(), set.header.spectrum.freq_hz().to_vec());
    let mut expected = Vec::new();
    for row in 0..set.data.n_rows() {
        let c = &mut set.data.coverage;
        let [a, b] = [c.ant1[row], c.ant2[row]].map(|k| ants[k as usize].position_m);
        let enu = [0, 1, 2].map(|k| b[k] - a[k]);
        c.uvw_m.row_mut(row).assign(&ndarray::arr1(&enu));
        expected.push(common::project(enu, &common::site(), c.time_jd[row], ra, dec));
        for (chan, f) in freq.iter().enumerate() {
            let phase = std::f64::consts::TAU * expected[row][2] * f / SPEED_OF_LIGHT_M_S;
            set.data.vis.slice_mut(ndarray::s![row, chan, ..]).fill(num_complex::Complex::new(phase.cos() as f32, phase.sin() as f32));
        }
    }
    std::fs::remove_file(&path).unwrap();
    save(&path, &set, UvfitsOptions::default());
    let mut reader = UvfitsReader::open(&path).unwrap();
    assert!(reader.header().history.iter().any(|l| l.contains("does not follow the sky")), "{:?}", reader.header().history);
    let block = reader.read(0..set.data.n_rows()).unwrap();
    for (row, uvw) in expected.iter().enumerate() {
        for k in 0..3 {
            assert!((block.coverage.uvw_m[(row, k)] - uvw[k]).abs() < 6e-5, "row {row}: {uvw:?}");
        }
    }
    // The phase of w is known to a few 1e-7 of its hundreds of turns.
    assert!(block.vis.iter().all(|v| (v - 1.0).norm() < 2e-5), "{}", block.vis.iter().map(|v| (v - 1.0).norm()).fold(0.0, f32::max));
    assert_eq!(block.flags, set.data.flags);
}

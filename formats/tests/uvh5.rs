//! UVH5: sets that cittert writes are read back unchanged, old and unusual files are read, and damaged files are refused.

use super::common;
use cittert_arrays::*;
use cittert_formats::Compression;
use cittert_formats::uvh5::{Uvh5Reader, Uvh5Writer};
use cittert_formats::{ColumnSink, CreateOptions, VisColumn};
use std::path::{Path, PathBuf};

fn save(dir: &Path, name: &str, set: &VisibilitySet, step: usize, compression: Compression) -> PathBuf {
    let path = dir.join(name);
    let mut writer = Uvh5Writer::create(
        &path,
        &set.header,
        &CreateOptions { overwrite: true, compression: Some(compression), ..CreateOptions::default() },
    )
    .unwrap();
    let n = set.data.n_rows();
    for start in (0..n).step_by(step) {
        writer.write(&set.data.rows(start..(start + step).min(n)).unwrap()).unwrap();
    }
    assert!(std::fs::read(&path).is_err(), "the file is there before it is complete");
    writer.complete().unwrap();
    path
}

/// Same header and data; positions to `tolerance_m`.
fn assert_same(a: &VisibilitySet, b: &Uvh5Reader, tolerance_m: f64) {
    let (ha, hb) = (&a.header, b.header());
    for (x, y) in ha.layout.antennas().iter().zip(hb.layout.antennas()) {
        assert_eq!((&x.name, x.number, x.diameter_m, x.sensitivity), (&y.name, y.number, y.diameter_m, y.sensitivity));
        assert_eq!(x.receiver, y.receiver);
        assert!((0..3).all(|k| (x.position_m[k] - y.position_m[k]).abs() <= tolerance_m), "{x:?} {y:?}");
    }
    assert_eq!((&ha.layout.name, &ha.layout.pattern), (&hb.layout.name, &hb.layout.pattern));
    assert_eq!((&ha.spectrum, &ha.polarizations, ha.unit), (&hb.spectrum, &hb.polarizations, hb.unit));
    assert_eq!((&ha.telescope, &ha.instrument, &ha.history), (&hb.telescope, &hb.instrument, &hb.history));
    assert_eq!((ha.pedestal_k, ha.scene_pedestal_k), (hb.pedestal_k, hb.scene_pedestal_k));
    assert_eq!((ha.scene_width_rad, ha.antenna_temperature_k), (hb.scene_width_rad, hb.antenna_temperature_k));
    assert_eq!(ha.near_field, hb.near_field);
    assert_eq!(ha.phase_centers[0].kind, hb.phase_centers[0].kind);
    assert_eq!(b.n_rows(), a.data.n_rows());
    assert_eq!(b.read(0..a.data.n_rows()).unwrap(), a.data);
}

#[test]
fn a_set_comes_back_whatever_the_blocks_and_the_compression() {
    let dir = tempfile::tempdir().unwrap();
    let set = common::earth();
    for (step, compression) in [(1000, Compression::None), (37, Compression::Gzip(4)), (64, Compression::Lzf)] {
        let path = save(dir.path(), "a.uvh5", &set, step, compression);
        let reader = Uvh5Reader::open(&path).unwrap();
        assert_same(&set, &reader, 1e-9);
        assert_eq!(reader.read(13..59).unwrap(), set.data.rows(13..59).unwrap());
        assert!(reader.read(0..100_000).is_err());
        std::fs::remove_file(path).unwrap();
    }
}

#[test]
fn runs_of_rows_that_are_read_side_by_side_are_those_that_are_read_one_by_one() {
    let dir = tempfile::tempdir().unwrap();
    let set = common::earth();
    let n = set.data.n_rows();
    for (k, compression) in [Compression::None, Compression::Lzf].into_iter().enumerate() {
        let mut reader = Uvh5Reader::open(&save(dir.path(), &format!("{k}.uvh5"), &set, 50, compression)).unwrap();
        let runs: Vec<_> = (0..20).map(|k| k * n / 20..(k * n / 20 + 1 + k % 3).min(n)).chain([0..n, 5..5]).collect();
        let blocks = reader.read_runs(&runs).unwrap();
        assert_eq!(blocks.len(), runs.len());
        for (block, rows) in blocks.iter().zip(runs) {
            assert_eq!(block, &reader.read_rows(rows).unwrap());
        }
        // Of several errors, each names its own rows.
        let error = reader.read_runs(&[0..1, n..n + 1]).unwrap_err().to_string();
        assert!(error.contains(&n.to_string()), "{error}");
    }
}

#[test]
fn the_pattern_of_the_elements_comes_back() {
    use cittert_arrays::pattern::{PatternSample, SampledPattern};
    let dir = tempfile::tempdir().unwrap();
    let mut set = common::boresight();
    set.header.antenna_temperature_k = Some(264.7);
    set.header.near_field = cittert_arrays::NearField::of_parts(Some("plane 10.5"), [Some(0.1), Some(-0.05), Some(31.25)]).unwrap();
    let receivers: Vec<Sensitivity> = (0..set.header.layout.n_ant())
        .map(|k| if k % 3 == 1 { Sensitivity::SefdJy(4e8 * k as f64) } else { Sensitivity::TsysK(100.0 * k as f64) })
        .collect();
    set.header.layout = set.header.layout.with_receivers(&receivers);
    let mut samples = Vec::new();
    for (k, power) in (0..24).zip([1.0, 1.1, 0.9, 1.0, 0.5, 0.6, 0.4, 0.5, 0.1, 0.0, 0.2, 0.1].into_iter().cycle()) {
        let (freq_hz, theta_rad, phi_rad) = (90e9 + 8e9 * (k / 12) as f64, 0.1 * (k / 4 % 3) as f64, f64::from(k % 4));
        samples.push(PatternSample { freq_hz, theta_rad, phi_rad, power });
    }
    let table = ElementPattern::Sampled(SampledPattern::of_samples(&samples).unwrap().into());
    for pattern in ["airy diameter_m=0.01 blockage=0.25".parse().unwrap(), "gaussian fwhm_deg=9".parse().unwrap(), table] {
        set.header.layout.pattern = pattern;
        let path = save(dir.path(), "p.uvh5", &set, 1000, Compression::None);
        assert_same(&set, &Uvh5Reader::open(&path).unwrap(), 1e-9);
        std::fs::remove_file(path).unwrap();
    }
}

#[test]
fn a_file_depends_on_its_content_alone() {
    let (dir, set) = (tempfile::tempdir().unwrap(), common::earth());
    let bytes = |name: &str| std::fs::read(save(dir.path(), name, &set, 50, Compression::Lzf)).unwrap();
    let first = bytes("a.uvh5");
    // Times of objects in HDF5 are whole seconds.
    std::thread::sleep(std::time::Duration::from_millis(1100));
    assert!(first == bytes("b.uvh5"), "the same set gives other bytes a second later");
}

#[test]
fn blocks_are_appended_to_a_finished_file() {
    let dir = tempfile::tempdir().unwrap();
    let set = common::earth();
    let first = VisibilitySet::new(set.header.clone(), set.data.rows(0..100).unwrap()).unwrap();
    let path = save(dir.path(), "grow.uvh5", &first, 60, Compression::None);
    let options = CreateOptions { compression: Some(Compression::Lzf), ..CreateOptions::default() };
    let begun = std::fs::read(&path).unwrap();
    let mut writer = Uvh5Writer::append(&path, &set.header, &options).unwrap();
    writer.write(&set.data.rows(100..200).unwrap()).unwrap();
    drop(writer);
    assert_eq!(std::fs::read(&path).unwrap(), begun, "a run that is given up leaves the old file");
    let mut writer = Uvh5Writer::append(&path, &set.header, &options).unwrap();
    writer.write(&set.data.rows(100..270).unwrap()).unwrap();
    assert_eq!(Uvh5Reader::open(&path).unwrap().n_rows(), 100, "the old file stays until the new one is complete");
    writer.complete().unwrap();
    assert_same(&set, &Uvh5Reader::open(&path).unwrap(), 1e-9);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn rows_of_another_kind_are_not_appended() {
    let dir = tempfile::tempdir().unwrap();
    let set = common::earth();
    let path = save(dir.path(), "one.uvh5", &set, 300, Compression::None);
    let refused = |change: &dyn Fn(&mut VisibilityHeader), options: CreateOptions, place: &str| {
        let mut header = set.header.clone();
        change(&mut header);
        let text = Uvh5Writer::append(&path, &header, &options).map(|_| ()).unwrap_err().to_string();
        assert!(["one.uvh5", place, "expected", "found"].iter().all(|w| text.contains(w)), "{text}");
    };
    let plain = CreateOptions::default;
    refused(&|h| h.spectrum = SpectralWindow::band(1.5e9, 4e6, 4).unwrap(), plain(), "channels");
    refused(&|h| h.unit = VisUnit::KelvinSr, plain(), "unit");
    refused(&|h| h.phase_centers[0] = PhaseCenter::sidereal("CYGA", 1.0, 0.3).unwrap(), plain(), "phase centres");
    refused(&|h| h.polarizations.swap(0, 1), plain(), "polarisations");
    let model = CreateOptions { columns: vec![VisColumn::Model], ..plain() };
    refused(&|_| (), model, "columns beside the data");
}

#[test]
fn model_and_residual_stand_beside_the_data() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("beside.uvh5");
    let set = common::earth();
    let columns = vec![VisColumn::Model, VisColumn::Residual];
    let options = CreateOptions { columns: columns.clone(), compression: Some(Compression::Gzip(3)), ..CreateOptions::default() };
    let (model, left) = (set.data.vis.mapv(|v| v * 0.5), set.data.vis.mapv(|v| v * 0.25));
    let mut writer = Uvh5Writer::create(&path, &set.header, &options).unwrap();
    let rows = |r: std::ops::Range<usize>| (set.data.rows(r.clone()).unwrap(), ndarray::s![r, .., ..]);
    let (block, part) = rows(0..99);
    assert!(writer.write(&block).unwrap_err().to_string().contains("columns beside the data"), "a column that was promised must come");
    writer.write_columns(&block, &[model.slice(part), left.slice(part)]).unwrap();
    writer.complete().unwrap();
    let mut writer = Uvh5Writer::append(&path, &set.header, &options).unwrap();
    let (block, part) = rows(99..270);
    writer.write_columns(&block, &[model.slice(part), left.slice(part)]).unwrap();
    writer.complete().unwrap();
    assert_eq!(Uvh5Reader::columns(&path).unwrap(), columns);
    for (column, vis) in [(VisColumn::Data, &set.data.vis), (VisColumn::Model, &model), (VisColumn::Residual, &left)] {
        let mut source = cittert_formats::open_column(&path, column).unwrap();
        assert_eq!(source.read_rows(0..270).unwrap().vis, vis);
    }
    let text = cittert_formats::open_column(&path, VisColumn::Corrected).map(|_| ()).unwrap_err().to_string();
    assert!(text.contains("Data/corrected") && text.contains("beside.uvh5"), "{text}");
}

#[test]
fn a_boresight_layout_keeps_its_frame_and_every_digit() {
    let dir = tempfile::tempdir().unwrap();
    let mut set = common::boresight();
    let mut antennas = set.header.layout.antennas().to_vec();
    antennas[0].sensitivity = Some(Sensitivity::TsysK(500.0));
    antennas[1].diameter_m = None;
    antennas[2].position_error_m = Some([1e-4, 2e-4, 3e-4]);
    set.header.layout = ArrayLayout::new("imager", LayoutFrame::Boresight, antennas).unwrap();
    set.header.layout.source = Some("a test".into());
    let reader = Uvh5Reader::open(&save(dir.path(), "b.uvh5", &set, 20, Compression::None)).unwrap();
    assert_same(&set, &reader, 0.0);
    assert_eq!(reader.header().layout, set.header.layout);
    assert!(reader.header().is_boresight());
}

#[test]
fn weights_that_differ_from_samples_only_late_are_kept_for_all_rows() {
    let dir = tempfile::tempdir().unwrap();
    let mut set = common::earth();
    let last = set.data.n_rows() - 1;
    set.data.weights[(last, 0, 0)] = 123.0;
    set.data.weights[(last, 1, 0)] = f32::INFINITY;
    let reader = Uvh5Reader::open(&save(dir.path(), "w.uvh5", &set, 50, Compression::None)).unwrap();
    assert_eq!(reader.read(0..last + 1).unwrap().weights, set.data.weights);
}

#[test]
fn several_windows_and_phase_centres_survive() {
    let dir = tempfile::tempdir().unwrap();
    let mut set = common::earth();
    set.header.spectrum = SpectralWindow::with_windows(vec![1.4e9, 1.401e9, 1.6e9, 1.7e9], vec![1e6; 4], vec![0, 0, 1, 2]).unwrap();
    let mut second = PhaseCenter::sidereal("3C48", 0.4, 0.57).unwrap();
    second.id = 7;
    second.frame = "fk5".into();
    set.header.phase_centers.push(second.clone());
    for k in 200..set.data.n_rows() {
        set.data.coverage.phase_center[k] = 1;
    }
    let reader = Uvh5Reader::open(&save(dir.path(), "m.uvh5", &set, 64, Compression::None)).unwrap();
    assert_same(&set, &reader, 1e-9);
    assert_eq!(reader.header().phase_centers[1], second);
}

/// HERA writes visibilities as a compound of two 32-bit integers.
#[test]
fn integer_visibilities_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let set = common::earth();
    let path = save(dir.path(), "i.uvh5", &set, 64, Compression::None);
    let whole = |(r, c, p): (usize, usize, usize)| num_complex::Complex::new((r * 8 + c) as i32, -(p as i32) - 3);
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        file.unlink("Data/visdata").unwrap();
        let values = ndarray::Array3::from_shape_fn(set.data.vis.raw_dim(), whole);
        file.group("Data").unwrap().new_dataset_builder().with_data(&values).create("visdata").unwrap();
    }
    let block = Uvh5Reader::open(&path).unwrap().read(0..set.data.n_rows()).unwrap();
    assert!(block.vis.indexed_iter().all(|(at, v)| (v.re, v.im) == (whole(at).re as f32, whole(at).im as f32)));
}

#[test]
fn broken_files_are_refused_and_named() {
    let dir = tempfile::tempdir().unwrap();
    let set = common::earth();
    let good = std::fs::read(save(dir.path(), "g.uvh5", &set, 50, Compression::None)).unwrap();
    let path = dir.path().join("bad.uvh5");
    let refused = |bytes: &[u8], word: &str| {
        std::fs::write(&path, bytes).unwrap();
        let text = Uvh5Reader::open(&path).map(|_| ()).unwrap_err().to_string();
        assert!(text.contains("bad.uvh5") && text.contains(word), "{text}");
    };
    refused(&good[..good.len() / 2], "truncated");
    refused(&good[..100], "truncated");
    refused(b"\x89PNG\r\n\x1a\n", "\\x89PNG");
    refused(b"", "empty");
    assert!(Uvh5Reader::open(dir.path()).map(|_| ()).unwrap_err().to_string().contains("directory"));
}

#[test]
fn a_file_that_claims_a_trillion_rows_is_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let path = save(dir.path(), "t.uvh5", &common::earth(), 50, Compression::None);
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        file.dataset("Header/Nblts").unwrap().write_scalar(&1_000_000_000_000_i64).unwrap();
        for (name, shape) in [
            ("Header/ant_1_array", vec![1_000_000_000_000_usize]),
            ("Header/ant_2_array", vec![1_000_000_000_000]),
            ("Header/time_array", vec![1_000_000_000_000]),
            ("Header/integration_time", vec![1_000_000_000_000]),
            ("Header/phase_center_id_array", vec![1_000_000_000_000]),
            ("Header/uvw_array", vec![1_000_000_000_000, 3]),
            ("Data/visdata", vec![1_000_000_000_000, 4, 2]),
        ] {
            file.dataset(name).unwrap().resize(shape).unwrap();
        }
    }
    let text = Uvh5Reader::open(&path).map(|_| ()).unwrap_err().to_string();
    assert!(text.contains("bytes stored"), "{text}");
}

#[test]
fn a_missing_item_and_a_wrong_shape_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let change = |name: &str, work: &dyn Fn(&hdf5::File)| {
        let path = save(dir.path(), name, &common::earth(), 50, Compression::None);
        work(&hdf5::File::open_rw(&path).unwrap());
        Uvh5Reader::open(&path).map(|_| ()).unwrap_err().to_string()
    };
    for item in ["Header/freq_array", "Header/antenna_positions", "Header/uvw_array", "Data/flags", "Header/Npols"] {
        let text = change("m.uvh5", &|f| f.unlink(item).unwrap());
        assert!(text.contains(item), "{item}: {text}");
        std::fs::remove_file(dir.path().join("m.uvh5")).unwrap();
    }
    let text = change("s.uvh5", &|f| f.dataset("Header/time_array").unwrap().resize(3).unwrap());
    assert!(text.contains("time_array") && text.contains("[270]") && text.contains("[3]"), "{text}");
    std::fs::remove_file(dir.path().join("s.uvh5")).unwrap();
    let text = change("c.uvh5", &|f| f.dataset("Header/Nfreqs").unwrap().write_scalar(&-5_i64).unwrap());
    assert!(text.contains("Nfreqs") && text.contains("-5"), "{text}");
}

/// Write fixed texts as the telescope's own writers do: variable length.
fn text(file: &hdf5::File, name: &str, value: &str) {
    let value: hdf5::types::VarLenUnicode = value.parse().unwrap();
    file.new_dataset::<hdf5::types::VarLenUnicode>().create(name).and_then(|d| d.write_scalar(&value)).unwrap();
}

#[test]
fn files_of_the_first_versions_read_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let set = common::earth();
    let path = save(dir.path(), "old.uvh5", &set, 50, Compression::None);
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        // An axis of spectral windows, a single channel width, one phase centre by name, texts of variable length.
        for name in ["Data/visdata", "Data/flags", "Data/nsamples"] {
            let (n, c, p) = (270, 4, 2);
            if name == "Data/flags" {
                let all: ndarray::Array3<bool> = file.dataset(name).unwrap().read().unwrap();
                file.unlink(name).unwrap();
                file.new_dataset_builder().with_data(all.into_shape_with_order((n, 1, c, p)).unwrap().view()).create(name).unwrap();
            } else if name == "Data/visdata" {
                let all: ndarray::Array3<num_complex::Complex<f64>> = file.dataset(name).unwrap().read().unwrap();
                file.unlink(name).unwrap();
                file.new_dataset_builder().with_data(all.into_shape_with_order((n, 1, c, p)).unwrap().view()).create(name).unwrap();
            } else {
                let all: ndarray::Array3<f32> = file.dataset(name).unwrap().read().unwrap();
                file.unlink(name).unwrap();
                file.new_dataset_builder().with_data(all.into_shape_with_order((n, 1, c, p)).unwrap().view()).create(name).unwrap();
            }
        }
        let freq: Vec<f64> = file.dataset("Header/freq_array").unwrap().read_raw().unwrap();
        for name in [
            "freq_array",
            "channel_width",
            "phase_center_catalog",
            "phase_center_id_array",
            "telescope_name",
            "spw_array",
            "flex_spw_id_array",
        ] {
            file.unlink(&format!("Header/{name}")).unwrap();
        }
        let freq = ndarray::Array2::from_shape_vec((1, 4), freq).unwrap();
        file.new_dataset_builder().with_data(freq.view()).create("Header/freq_array").unwrap();
        file.new_dataset::<f64>().create("Header/channel_width").and_then(|d| d.write_scalar(&1e6)).unwrap();
        text(&file, "Header/telescope_name", "SPIRAL");
        text(&file, "Header/phase_type", "phased");
        text(&file, "Header/object_name", "CYGA");
        text(&file, "Header/phase_center_frame", "icrs");
        let (ra, dec) = set.header.phase_centers[0].ra_dec_rad().unwrap();
        for (name, value) in [("phase_center_ra", ra), ("phase_center_dec", dec), ("phase_center_epoch", 2000.0)] {
            file.new_dataset::<f64>().create(format!("Header/{name}").as_str()).and_then(|d| d.write_scalar(&value)).unwrap();
        }
    }
    assert_same(&set, &Uvh5Reader::open(&path).unwrap(), 1e-9);
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        file.unlink("Header/phase_type").unwrap();
        text(&file, "Header/phase_type", "drift");
        for name in ["latitude", "longitude", "altitude"] {
            file.unlink(&format!("Header/{name}")).unwrap();
        }
        let xyz = ndarray::Array1::from_vec(common::site().to_ecef_m().to_vec());
        file.new_dataset_builder().with_data(xyz.view()).create("Header/telescope_location").unwrap();
    }
    let reader = Uvh5Reader::open(&path).unwrap();
    assert_eq!(reader.header().phase_centers[0].kind, PhaseCenterKind::Unprojected);
    let site = reader.header().layout.site().unwrap();
    assert!((site.latitude_rad - common::site().latitude_rad).abs() < 1e-12 && (site.altitude_m - 2124.0).abs() < 1e-6);
}

#[test]
fn a_catalogue_in_json_is_understood() {
    let dir = tempfile::tempdir().unwrap();
    let path = save(dir.path(), "json.uvh5", &common::earth(), 50, Compression::None);
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        file.unlink("Header/phase_center_catalog").unwrap();
        file.create_group("Header/phase_center_catalog").unwrap();
        let entry = r#"{"cat_id": 0, "cat_type": "sidereal", "cat_lon": 1.5, "cat_lat": -0.5, "cat_frame": "fk5", "cat_epoch": 2000.0}"#;
        text(&file, "Header/phase_center_catalog/3C273", entry);
    }
    let reader = Uvh5Reader::open(&path).unwrap();
    let center = &reader.header().phase_centers[0];
    assert_eq!((center.name.as_str(), center.frame.as_str(), center.ra_dec_rad()), ("3C273", "fk5", Some((1.5, -0.5))));
    reader.read(0..3).unwrap();
}

#[test]
fn flags_that_are_plain_integers_are_read() {
    let dir = tempfile::tempdir().unwrap();
    let set = common::earth();
    let path = save(dir.path(), "int.uvh5", &set, 50, Compression::None);
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        file.unlink("Data/flags").unwrap();
        file.new_dataset_builder().with_data(set.data.flags.mapv(u8::from).view()).create("Data/flags").unwrap();
    }
    assert_eq!(Uvh5Reader::open(&path).unwrap().read(0..270).unwrap().flags, set.data.flags);
}

/// A chunk in the middle of a compressed file that does not inflate: the rows before and behind it are read, those in it are refused
/// with the file, the dataset and the rows.
#[test]
fn damage_in_the_middle_of_compressed_data_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let mut set = common::earth();
    // Noise, so that the chunks stay large.
    set.data.vis.indexed_iter_mut().for_each(|((r, c, p), v)| *v *= ((r * 31 + c * 7 + p) as f32 * 0.731).sin());
    let path = save(dir.path(), "hurt.uvh5", &set, 30, Compression::Gzip(6));
    let offset = {
        let file = hdf5::File::open(&path).unwrap();
        let vis = file.dataset("Data/visdata").unwrap();
        assert_eq!(vis.chunk().unwrap()[0], 30);
        vis.chunk_info(4).unwrap()
    };
    let mut bytes = std::fs::read(&path).unwrap();
    let at = usize::try_from(offset.addr).unwrap();
    bytes[at + 40..at + 80].fill(0xff);
    std::fs::write(&path, bytes).unwrap();
    let reader = Uvh5Reader::open(&path).unwrap();
    assert_eq!(reader.read(0..100).unwrap(), set.data.rows(0..100).unwrap());
    assert_eq!(reader.read(160..270).unwrap(), set.data.rows(160..270).unwrap());
    let text = reader.read(100..200).unwrap_err().to_string();
    assert!(
        ["hurt.uvh5", "Data/visdata, rows 100 to 199", "expected", "found a chunk that does not inflate", "at [120, 0, 0]"]
            .iter()
            .all(|w| text.contains(w)),
        "{text}"
    );
}

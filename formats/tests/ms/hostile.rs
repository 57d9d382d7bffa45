//! Directories that are missing, cut short or no Measurement Sets give an error that names them, and no abort.

use crate::{common, temp, write};
use cittert_arrays::VisibilitySource;
use cittert_formats::ms::{MsSource, MsWriter, is_measurement_set};
use cittert_formats::{CreateOptions, VisColumn};
use std::fs;
use std::path::Path;

fn error(path: &Path) -> String {
    let e = match MsSource::open(path, VisColumn::Data) {
        Err(e) => e.to_string(),
        Ok(mut source) => {
            let n = source.n_rows();
            source.read(0..n).map(|_| ()).expect_err("a broken set was read").to_string()
        }
    };
    assert!(e.contains("a.ms"), "the error names no file: {e}");
    e
}

#[test]
fn what_is_no_measurement_set_is_said() {
    let (dir, path) = temp();
    assert!(error(&path).contains("cannot open"));
    fs::write(&path, b"x").unwrap();
    assert!(error(&path).contains("it is a file"));
    fs::remove_file(&path).unwrap();
    fs::create_dir(&path).unwrap();
    assert!(error(&path).contains("without table.dat"));
    fs::remove_dir(&path).unwrap();
    write(&path, &common::earth(), 1000);
    // A subtable is a table, but no Measurement Set.
    let table = dir.path().join("b.ms");
    fs::rename(path.join("FIELD"), &table).unwrap();
    assert!(!is_measurement_set(&table));
    assert!(MsSource::open(&table, VisColumn::Data).unwrap_err().to_string().contains("without MS_VERSION"));
}

#[test]
fn a_missing_subtable_is_named() {
    let (dir, path) = temp();
    write(&path, &common::earth(), 1000);
    assert!(is_measurement_set(&path));
    for name in ["ANTENNA", "FIELD", "SPECTRAL_WINDOW", "POLARIZATION", "DATA_DESCRIPTION", "OBSERVATION"] {
        let away = dir.path().join(name);
        fs::rename(path.join(name), &away).unwrap();
        assert!(error(&path).contains(name));
        fs::rename(&away, path.join(name)).unwrap();
    }
}

#[test]
fn a_missing_column_is_named_with_those_that_are_there() {
    let (_dir, path) = temp();
    write(&path, &common::earth(), 1000);
    let e = MsSource::open(&path, VisColumn::Corrected).unwrap_err().to_string();
    assert!(e.contains("CORRECTED_DATA") && e.contains("only DATA"), "{e}");
}

/// Every file of a set cut short, at several lengths.
#[test]
fn files_cut_short_are_errors() {
    let (dir, path) = temp();
    write(&path, &common::earth(), 1000);
    let mut files = Vec::new();
    for folder in [path.clone(), path.join("ANTENNA"), path.join("SPECTRAL_WINDOW"), path.join("FIELD")] {
        for file in fs::read_dir(&folder).unwrap() {
            let file = file.unwrap().path();
            let name = file.file_name().unwrap().to_string_lossy().into_owned();
            // Locks and remarks are not needed; f0 is the main file of each storage manager.
            if file.is_file() && (name == "table.dat" || name == "table.f0") {
                files.push(file);
            }
        }
    }
    assert!(files.len() >= 8, "{files:?}");
    for file in files {
        let whole = fs::read(&file).unwrap();
        for keep in [0, 5, whole.len() / 4, whole.len() / 2] {
            fs::write(&file, &whole[..keep]).unwrap();
            error(&path);
        }
        fs::write(&file, whole).unwrap();
    }
    let mut source = MsSource::open(&path, VisColumn::Data).unwrap();
    source.read(0..1).unwrap();
    drop(dir);
}

#[test]
fn an_abandoned_set_leaves_the_old_one_and_nothing_else() {
    let (dir, path) = temp();
    let set = common::earth();
    write(&path, &set, 1000);
    let e = MsWriter::create(&path, &set.header, &CreateOptions::default()).unwrap_err().to_string();
    assert!(e.contains("exists already"), "{e}");
    let mut writer = MsWriter::create(&path, &set.header, &CreateOptions { overwrite: true, ..CreateOptions::default() }).unwrap();
    writer.write(&set.data).unwrap();
    drop(writer);
    let writer = MsWriter::create(&path, &set.header, &CreateOptions { overwrite: true, ..CreateOptions::default() }).unwrap();
    assert!(writer.complete().unwrap_err().to_string().contains("number of rows"));
    MsSource::open(&path, VisColumn::Data).unwrap();
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    let mut writer = MsWriter::create(&path, &set.header, &CreateOptions { overwrite: true, ..CreateOptions::default() }).unwrap();
    writer.write(&set.data.rows(0..7).unwrap()).unwrap();
    writer.complete().unwrap();
    assert_eq!(MsSource::open(&path, VisColumn::Data).unwrap().n_rows(), 7);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn a_range_past_the_end_is_refused() {
    let (_dir, path) = temp();
    write(&path, &common::earth(), 1000);
    let mut source = MsSource::open(&path, VisColumn::Data).unwrap();
    let n = source.n_rows();
    assert!(source.read(0..n + 1).unwrap_err().to_string().contains("out of range"));
}

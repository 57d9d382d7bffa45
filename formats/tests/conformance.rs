//! What every row of the table of formats keeps: it knows its own files by their content and no others, reads back what it wrote, puts
//! nothing in place of what is there, and says what is wrong with a damaged file by its name.

use crate::common;
use cittert_arrays::{
    ArrayLayout, BrightnessUnit, GainTable, Image, LayoutFrame, Polarization, Sensitivity, SkyFrame, SkyGrid, Source, SpectralWindow,
    VisibilitySet,
};
use cittert_formats::layouts::{ReadContext, read_layout};
use cittert_formats::{Contents, CreateOptions, FORMATS, Format, Holds, format_of};
use ndarray::Array4;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn set() -> VisibilitySet {
    common::earth()
}

fn layout() -> ArrayLayout {
    let plain = common::spiral(5, 300.0, LayoutFrame::EastNorthUp(common::site()));
    // Some forms want a system temperature of every antenna.
    let mut antennas = plain.antennas().to_vec();
    antennas.iter_mut().for_each(|a| a.sensitivity = Some(Sensitivity::TsysK(100.0)));
    ArrayLayout::new("SPIRAL", plain.frame, antennas).unwrap()
}

fn image() -> Image {
    let grid = SkyGrid::new(6, 4, 5e-4, SkyFrame::Boresight).unwrap();
    let data = Array4::from_shape_fn((1, 1, 4, 6), |(_, _, i, j)| 6.0 * i as f64 + j as f64);
    Image::new(grid, SpectralWindow::band(94e9, 8e9, 1).unwrap(), vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap()
}

fn gains() -> GainTable {
    let spectrum = SpectralWindow::band(1.4e9, 4e6, 2).unwrap();
    GainTable::unity(layout(), spectrum, vec!["X".into()], vec![2_460_000.75], vec![60.0]).unwrap()
}

fn sources() -> Vec<Source> {
    vec![Source::point(1e-3, -2e-3, 1.5), Source::point(0.0, 0.0, 0.25)]
}

/// Write what the format holds.
fn write(format: &dyn Format, path: &Path, overwrite: bool) -> Result<(), String> {
    let text = |e: &dyn std::fmt::Display| e.to_string();
    match format.holds() {
        Holds::Visibilities(f) => {
            let set = set();
            let options = CreateOptions { overwrite, ..CreateOptions::default() };
            let mut out = f.create(path, &set.header, &options).map_err(|e| text(&e))?.unwrap();
            out.sink.write_block(&set.data).and_then(|()| out.sink.finish()).map_err(|e| text(&e))
        }
        Holds::Images(f) => (f.write)(path, &image(), overwrite).map_err(|e| text(&e)),
        Holds::Gains(f) => (f.write)(path, &gains(), overwrite).map_err(|e| text(&e)),
        Holds::Sources(f) => (f.write)(path, &sources(), overwrite).map_err(|e| text(&e)),
        Holds::Layouts(f) => {
            let content = f.write(&layout()).map_err(|e| text(&e))?;
            cittert_formats::atomic::write_file(path, overwrite, content.as_bytes()).map_err(|e| text(&e))
        }
    }
}

/// True where the file holds what was written.
fn same(format: &dyn Format, path: &Path) -> bool {
    match format.holds() {
        Holds::Visibilities(f) => {
            let (set, mut back) = (set(), f.open(path).unwrap());
            let block = back.read_rows(0..back.n_rows()).unwrap();
            block.vis.shape() == set.data.vis.shape() && block.vis.iter().zip(&set.data.vis).all(|(a, b)| (a - b).norm() < 1e-5)
        }
        Holds::Images(f) => (f.read)(path).unwrap().data == image().data,
        Holds::Gains(f) => (f.read)(path).unwrap().gains == gains().gains,
        Holds::Sources(f) => (f.read)(path).unwrap() == sources(),
        Holds::Layouts(_) => {
            let (back, was) = (read_layout(path, Some(common::site())).unwrap(), layout());
            let apart = |(a, b): (&cittert_arrays::Antenna, &cittert_arrays::Antenna)| {
                (0..3).all(|k| (a.position_m[k] - b.position_m[k]).abs() < 1e-4)
            };
            back.n_ant() == was.n_ant() && back.antennas().iter().zip(was.antennas()).all(apart)
        }
    }
}

/// A file of each format, under its usual ending.
fn samples(folder: &Path) -> Vec<(&'static dyn Format, PathBuf)> {
    let one = |f: &&'static dyn Format| {
        let path = folder.join(format!("{}.{}", f.name().replace(' ', "-"), f.extensions()[0]));
        write(*f, &path, false).unwrap();
        (*f, path)
    };
    FORMATS.iter().map(one).collect()
}

#[test]
fn names_and_endings_tell_formats_apart() {
    let names: BTreeSet<&str> = FORMATS.iter().map(|f| f.name()).collect();
    assert_eq!(names.len(), FORMATS.len());
    for f in FORMATS.iter() {
        assert!(!f.extensions().is_empty() && !f.label().description.is_empty(), "{}", f.name());
        assert!(f.extensions().iter().all(|e| !e.starts_with('.') && *e == e.to_ascii_lowercase()), "{}", f.name());
    }
}

#[test]
fn every_format_knows_and_reads_what_it_wrote() {
    let dir = tempfile::tempdir().unwrap();
    for (format, path) in samples(dir.path()) {
        assert_eq!(format_of(&path).unwrap().name(), format.name());
        assert!(same(format, &path), "{}", format.name());
        assert!(Contents::of(&path).is_ok(), "{}", format.name());
        // The content decides: a name that says something else changes nothing. Texts of bare numbers need their ending.
        if !matches!(format.holds(), Holds::Layouts(_)) {
            let other = dir.path().join("renamed.txt");
            std::fs::rename(&path, &other).unwrap();
            assert_eq!(format_of(&other).unwrap().name(), format.name());
            assert!(same(format, &other), "{}", format.name());
            if other.is_dir() { std::fs::remove_dir_all(&other).unwrap() } else { std::fs::remove_file(&other).unwrap() }
        }
    }
}

#[test]
fn nothing_is_replaced_unasked() {
    let dir = tempfile::tempdir().unwrap();
    for (format, path) in samples(dir.path()) {
        let error = write(format, &path, false).unwrap_err();
        assert!(error.contains(&path.display().to_string()), "{}: {error}", format.name());
        assert!(same(format, &path), "{}", format.name());
        write(format, &path, true).unwrap();
        assert!(same(format, &path), "{}", format.name());
    }
}

#[test]
fn what_is_cut_short_is_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    for (format, path) in samples(dir.path()).into_iter().filter(|(_, p)| p.is_file()) {
        let whole = std::fs::read(&path).unwrap();
        for bytes in [&whole[..0], &whole[..whole.len() / 3]] {
            std::fs::write(&path, bytes).unwrap();
            let error = match format.holds() {
                Holds::Visibilities(f) => match f.open(&path) {
                    Ok(mut s) => s.read_rows(0..s.n_rows()).map(drop).map_err(|e| e.to_string()),
                    Err(e) => Err(e.to_string()),
                },
                Holds::Images(f) => (f.read)(&path).map(drop).map_err(|e| e.to_string()),
                Holds::Gains(f) => (f.read)(&path).map(drop).map_err(|e| e.to_string()),
                // A text that ends early may be whole: only nothing is surely too little.
                Holds::Sources(f) if bytes.is_empty() => (f.read)(&path).map(drop).map_err(|e| e.to_string()),
                Holds::Layouts(_) if bytes.is_empty() => read_layout(&path, None).map(drop).map_err(|e| e.to_string()),
                Holds::Sources(_) | Holds::Layouts(_) => continue,
            };
            let error = error.expect_err(format.name());
            assert!(error.contains(&path.display().to_string()), "{}: {error}", format.name());
        }
    }
}

#[test]
fn a_layout_reads_alike_as_text_and_as_file() {
    let dir = tempfile::tempdir().unwrap();
    for (format, path) in samples(dir.path()) {
        if let Holds::Layouts(f) = format.holds() {
            let text = std::fs::read_to_string(&path).unwrap();
            let context = ReadContext { name: "x".into(), site: Some(common::site()), folder: None };
            let (one, two) = (f.read(&text, &context).unwrap(), read_layout(&path, Some(common::site())).unwrap());
            assert_eq!(one.antennas(), two.antennas(), "{}", format.name());
        }
    }
}

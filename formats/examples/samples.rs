//! Write a small set of every kind into a folder, for other programs to read: `cargo run --example samples -- FOLDER`.

#[allow(clippy::unwrap_used)] // shared with the tests, where a panic is a failure
#[path = "../tests/common/mod.rs"]
mod common;

use cittert_arrays::{BrightnessUnit, GainTable, Image, Polarization, RestoringBeam, SkyFrame, SkyGrid, SpectralWindow};
use cittert_formats::CreateOptions;
use cittert_formats::calh5::write_gains;
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_formats::uvfits::{UvfitsOptions, UvfitsWriter};
use cittert_formats::uvh5::Uvh5Writer;
use ndarray::{Array4, s};
use num_complex::Complex64;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("give a folder")?;
    let folder = Path::new(&folder);
    for (name, set) in [("earth", common::earth()), ("boresight", common::boresight())] {
        let options = CreateOptions { overwrite: true, ..Default::default() };
        let mut writer = Uvh5Writer::create(&folder.join(format!("{name}.uvh5")), &set.header, &options)?;
        let n = set.data.n_rows();
        for start in (0..n).step_by(37) {
            writer.write(&set.data.rows(start..(start + 37).min(n))?)?;
        }
        writer.complete()?;
        let options = UvfitsOptions { overwrite: true, ..Default::default() };
        let mut writer = UvfitsWriter::create(&folder.join(format!("{name}.uvfits")), &set.header, options)?;
        writer.write(&set.data)?;
        writer.complete()?;
    }
    gains(folder)?;
    images(folder)
}

/// Gains of the array on the Earth with a reference antenna.
fn gains(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let header = common::earth().header;
    let mut table = GainTable::unity(header.layout, header.spectrum, vec!["X".into(), "Y".into()], vec![2_460_000.75], vec![60.0])?;
    table.gains.indexed_iter_mut().for_each(|((_, a, c, _), g)| *g = Complex64::from_polar(1.0 + 0.01 * a as f64, 0.1 * c as f64));
    table.refant = Some(0);
    write_gains(&folder.join("gains.calh5"), &table, true)?;
    table.refant = None;
    table.feeds = vec!["R".into(), "L".into()];
    write_gains(&folder.join("truth.calh5"), &table, true)?;
    let mut joined = GainTable::unity(table.layout, table.spectrum, vec!["I".into()], table.time_jd, table.interval_s)?;
    joined.gains.fill(Complex64::new(0.0, 1.0));
    write_gains(&folder.join("joined.calh5"), &joined, true)?;
    Ok(())
}

/// A picture of one bright cell, on the sky and along a boresight.
fn images(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let sky = SkyFrame::Sky { ra_rad: 1.0, dec_rad: 0.5, frame: "icrs".into() };
    for (name, frame, channels) in [("sky", sky.clone(), 1), ("cube", sky, 3), ("bore", SkyFrame::Boresight, 2)] {
        let grid = SkyGrid::new(64, 48, 5e-4, frame)?;
        let spectrum = SpectralWindow::band(94e9, 8e9, channels)?;
        let mut data = Array4::zeros((channels, 1, 48, 64));
        let (row, column) = (grid.row_of(0.005).round() as usize, grid.column_of(0.012).round() as usize);
        data.slice_mut(s![.., 0, row, column]).fill(1.0);
        let mut image = Image::new(grid, spectrum, vec![Polarization::I], data, BrightnessUnit::JyPerBeam)?;
        image.beams = (0..channels).map(|c| RestoringBeam { bmaj_rad: 2e-3 + 1e-4 * c as f64, bmin_rad: 1e-3, bpa_rad: 0.3 }).collect();
        image.object = "test".into();
        image.telescope = "SPIRAL".into();
        image.time_jd = Some(2_460_000.75);
        write_image(&folder.join(format!("{name}.fits")), &image, ImageOptions { overwrite: true, double: false })?;
    }
    Ok(())
}

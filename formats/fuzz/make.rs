//! Writes the binary part of the corpus: `cargo test -p cittert-formats --test fuzz write_the_corpus -- --ignored`.

use crate::common;
use cittert_arrays::{
    ArrayLayout, BrightnessUnit, GainTable, Image, LayoutFrame, Polarization, RestoringBeam, Sensitivity, SkyFrame, SkyGrid, SpectralWindow,
};
use cittert_formats::calh5::write_gains;
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_formats::layout_formats;
use cittert_formats::{Compression, CreateOptions, uvfits, uvh5};
use ndarray::Array4;
use std::path::Path;

#[test]
#[ignore = "writes into the source tree; run by hand where the formats change"]
fn write_the_corpus() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(crate::CORPUS);
    for folder in ["uvfits", "fits", "uvh5", "calh5", "layouts"] {
        std::fs::create_dir_all(root.join(folder)).unwrap();
    }
    let pols = [Polarization::XX, Polarization::YY];
    let layout = common::spiral(3, 30.0, LayoutFrame::EastNorthUp(common::site()));
    let earth = common::set(common::header(layout.clone(), SpectralWindow::band(1.4e9, 4e6, 2).unwrap(), &pols), 2);
    let bore = common::spiral(3, 0.5, LayoutFrame::Boresight);
    let bore = common::set(common::header(bore, SpectralWindow::band(94e9, 8e9, 1).unwrap(), &[Polarization::I]), 1);
    for (name, set) in [("earth", &earth), ("boresight", &bore)] {
        let mut out = uvfits::UvfitsWriter::create(
            &root.join(format!("uvfits/{name}.uvfits")),
            &set.header,
            uvfits::UvfitsOptions { overwrite: true, stokes_i: false },
        )
        .unwrap();
        out.write(&set.data).unwrap();
        out.complete().unwrap();
        let compression = if name == "earth" { Compression::None } else { Compression::Gzip(4) };
        let options = CreateOptions { overwrite: true, compression: Some(compression), ..CreateOptions::default() };
        let mut out = uvh5::Uvh5Writer::create(&root.join(format!("uvh5/{name}.uvh5")), &set.header, &options).unwrap();
        out.write(&set.data).unwrap();
        out.complete().unwrap();
    }
    let spectrum = SpectralWindow::band(94e9, 8e9, 2).unwrap();
    let gains = GainTable::unity(layout.clone(), spectrum.clone(), vec!["X".into()], vec![2_460_000.75], vec![60.0]).unwrap();
    write_gains(&root.join("calh5/gains.calh5"), &gains, true).unwrap();
    let sky = SkyFrame::Sky { ra_rad: 1.0, dec_rad: 0.5, frame: "icrs".into() };
    for (name, frame) in [("sky.fits", sky), ("boresight.fits", SkyFrame::Boresight)] {
        let grid = SkyGrid::new(6, 4, 5e-4, frame).unwrap();
        let data = Array4::<f64>::ones((2, 1, 4, 6));
        let mut image = Image::new(grid, spectrum.clone(), vec![Polarization::I], data, BrightnessUnit::JyPerBeam).unwrap();
        image.beams = vec![RestoringBeam { bmaj_rad: 2e-3, bmin_rad: 1e-3, bpa_rad: 0.3 }; 2];
        write_image(&root.join("fits").join(name), &image, ImageOptions { overwrite: true, double: false }).unwrap();
    }
    // Some forms want a system temperature of every antenna.
    let mut antennas = layout.antennas().to_vec();
    antennas.iter_mut().for_each(|a| a.sensitivity = Some(Sensitivity::TsysK(100.0)));
    let layout = ArrayLayout::new("SPIRAL", layout.frame, antennas).unwrap();
    for format in layout_formats() {
        let Ok(text) = format.write(&layout) else { panic!("{} cannot hold the layout", format.name()) };
        std::fs::write(root.join(format!("layouts/{}.{}", format.name(), format.extension())), text).unwrap();
    }
}

//! Writing images: four axes (RA---SIN, DEC--SIN, FREQ, STOKES), or linear direction cosines for a boresight image.

use super::header::HeaderWriter;
use super::input::padding;
use super::linear::LinearAxis;
use super::near_field::write_near_field;
use super::table::{Form, TableWriter};
use crate::atomic::AtomicFile;
use crate::{FormatError, Result};
use cittert_arrays::{BrightnessUnit, Image, RestoringBeam, SkyFrame};
use flate2::Compression;
use flate2::write::GzEncoder;
use ndarray::{Axis, s};
use rayon::prelude::*;
use std::io::{BufWriter, Write};
use std::path::Path;

/// Size of the pixels that all threads convert together, bytes.
const AT_ONCE: usize = 1 << 21;

/// Options of a new image.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ImageOptions {
    /// Replace an existing file.
    pub overwrite: bool,
    /// 64-bit floats (BITPIX -64) instead of 32-bit ones.
    pub double: bool,
}

/// Write an image or cube, compressed where the name ends in `.gz`.
///
/// The header holds one beam (BMAJ, BMIN, BPA). Beams that differ between channels are also written to a BEAMS table, and channels that are
/// not evenly spaced to a CHANNELS table.
///
/// # Errors
/// As [`AtomicFile::create`]; a full disk; polarisations that do not form a regular STOKES axis.
pub fn write_image<P: Copy + Into<f64> + Sync>(path: &Path, image: &Image<P>, options: ImageOptions) -> Result<()> {
    let header = header(path, image, options)?.finish();
    let out = AtomicFile::create(path, options.overwrite)?;
    let io = |e| FormatError::io(path, "write", e);
    let file = BufWriter::with_capacity(1 << 16, out.open()?);
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gz")) {
        // The gzip header has no time of writing, so that equal images give equal files.
        let mut packed = GzEncoder::new(file, Compression::default());
        write_content(&mut packed, &header, image, options).map_err(io)?;
        packed.finish().and_then(|mut file| file.flush()).map_err(io)?;
    } else {
        let mut file = file;
        write_content(&mut file, &header, image, options).map_err(io)?;
        file.flush().map_err(io)?;
    }
    out.commit()
}

/// Header, pixels and tables.
fn write_content<P: Copy + Into<f64> + Sync>(
    file: &mut (impl Write + Send),
    header: &[u8],
    image: &Image<P>,
    options: ImageOptions,
) -> std::io::Result<()> {
    file.write_all(header)?;
    let size = if options.double { 8 } else { 4 };
    let row = image.grid.n_l * size;
    let lines = (AT_ONCE / row.max(1)).clamp(1, image.grid.n_m);
    // In FITS order the channel axis runs before the STOKES axis, so the planes of one polarisation follow each other.
    let planes = (0..image.polarizations.len()).flat_map(|pol| (0..image.spectrum.n_chan()).map(move |chan| (chan, pol)));
    let parts: Vec<_> = planes.flat_map(|(chan, pol)| (0..image.grid.n_m).step_by(lines).map(move |first| (chan, pol, first))).collect();
    let convert = |part: Option<&(usize, usize, usize)>, bytes: &mut Vec<u8>| {
        let Some((chan, pol, first)) = part.copied() else { return };
        let n = lines.min(image.grid.n_m - first);
        bytes.resize(n * row, 0);
        let rows = image.plane(chan, pol).slice_move(s![first..first + n, ..]);
        bytes.par_chunks_exact_mut(row.max(1)).zip(rows.axis_iter(Axis(0)).into_par_iter()).for_each(|(to, from)| {
            if options.double {
                to.as_chunks_mut().0.iter_mut().zip(from).for_each(|(to, v)| *to = (*v).into().to_be_bytes());
            } else {
                to.as_chunks_mut().0.iter_mut().zip(from).for_each(|(to, v)| *to = ((*v).into() as f32).to_be_bytes());
            }
        });
    };
    let (mut now, mut next) = (Vec::new(), Vec::new());
    convert(parts.first(), &mut now);
    for k in 0..parts.len() {
        // The next part is converted while this one is written.
        rayon::join(|| file.write_all(&now), || convert(parts.get(k + 1), &mut next)).0?;
        std::mem::swap(&mut now, &mut next);
    }
    let len = (image.data.len() * size) as u64;
    file.write_all(&vec![0; padding(len) as usize])?;
    if several_beams(image) {
        file.write_all(&beams_table(&image.beams, image.polarizations.len()))?;
    }
    if !even_channels(image) {
        file.write_all(&channels_table(image))?;
    }
    Ok(())
}

/// True where the beams of the channels differ.
fn several_beams<P>(image: &Image<P>) -> bool {
    image.beams.windows(2).any(|b| b[0] != b[1])
}

/// Step of the channels in Hz: their spacing, or the width of a single one.
fn channel_step<P>(image: &Image<P>) -> f64 {
    match image.spectrum.freq_hz() {
        [first, second, ..] => second - first,
        _ => image.spectrum.width_hz()[0],
    }
}

/// True where the first frequency and the step give all channels and their widths.
fn even_channels<P>(image: &Image<P>) -> bool {
    let (step, first) = (channel_step(image), image.spectrum.freq_hz()[0]);
    let even = |(c, f): (usize, &f64)| (f - first - c as f64 * step).abs() <= 1e-6 * step.abs();
    step != 0.0
        && image.spectrum.freq_hz().iter().enumerate().all(even)
        && image.spectrum.width_hz().iter().all(|w| (w - step.abs()).abs() <= 1e-6 * step.abs())
}

fn header<P>(path: &Path, image: &Image<P>, options: ImageOptions) -> Result<HeaderWriter> {
    let grid = &image.grid;
    let mut h = HeaderWriter::default();
    h.logical("SIMPLE", true, "conforms to FITS standard");
    h.integer("BITPIX", if options.double { -64 } else { -32 }, "floating point");
    let lengths = [grid.n_l, grid.n_m, image.spectrum.n_chan(), image.polarizations.len()];
    h.integer("NAXIS", 4, "");
    for (k, n) in lengths.iter().enumerate() {
        h.integer(&format!("NAXIS{}", k + 1), *n as i64, "");
    }
    h.logical("EXTEND", true, "");
    for (k, axis) in axes(path, image)?.iter().enumerate() {
        axis.write(&mut h, k + 1);
    }
    match &grid.frame {
        SkyFrame::Sky { frame, .. } => {
            h.real("LONPOLE", 180.0, "");
            h.real("EQUINOX", if frame.eq_ignore_ascii_case("fk4") { 1950.0 } else { 2000.0 }, "");
            h.text("RADESYS", &frame.to_ascii_uppercase(), "");
        }
        SkyFrame::Boresight => h.text("CITFRAME", "BORESIGHT", "first axis to the right as seen along it"),
    }
    h.text("SPECSYS", "TOPOCENT", "");
    h.real("RESTFRQ", image.spectrum.mean_hz(), "Hz");
    h.text("BUNIT", image.unit.bunit(), "");
    let (btype, comment) = match image.unit {
        BrightnessUnit::Kelvin => ("Brightness temperature", ""),
        BrightnessUnit::JyPerBeam | BrightnessUnit::JyPerPixel => ("Intensity", ""),
        BrightnessUnit::One => ("Ratio", ""),
        BrightnessUnit::Metre => ("Range", ""),
        BrightnessUnit::Other => ("Unknown", ""),
    };
    h.text("BTYPE", btype, comment);
    if let Some(beam) = image.beams.first() {
        let note = if several_beams(image) { "deg, first channel; see the BEAMS table" } else { "deg" };
        h.real("BMAJ", beam.bmaj_rad.to_degrees(), note);
        h.real("BMIN", beam.bmin_rad.to_degrees(), note);
        h.real("BPA", beam.bpa_rad.to_degrees(), note);
        if several_beams(image) {
            h.logical("CASAMBM", true, "a BEAMS table follows");
        }
    }
    if let Some(iso) = image.time_jd.and_then(crate::time::fits_date) {
        h.text("DATE-OBS", &iso, "");
        h.real("MJD-OBS", image.time_jd.unwrap_or(0.0) - 2_400_000.5, "");
        h.text("TIMESYS", "UTC", "");
    }
    if !image.object.is_empty() {
        h.text("OBJECT", &image.object, "");
    }
    if !image.telescope.is_empty() {
        h.text("TELESCOP", &image.telescope, "");
    }
    if let Some(pedestal) = image.pedestal_k {
        h.real("CITPEDST", pedestal, "K, removed before imaging and added back");
    }
    if !image.pattern.is_none() {
        h.text("CITPATT", &image.pattern.to_string(), "");
    }
    if !image.seen_through.is_none() {
        h.text("CITSEEN", &image.seen_through.to_string(), "");
    }
    write_near_field(&mut h, &image.near_field);
    h.text("ORIGIN", "cittert", "");
    h.history(&image.history);
    Ok(h)
}

fn axes<P>(path: &Path, image: &Image<P>) -> Result<[LinearAxis; 4]> {
    let grid = &image.grid;
    let cell_deg = grid.cell_rad.to_degrees();
    let axis = |ctype: &str, cunit: &str, crpix: f64, crval: f64, cdelt: f64| LinearAxis {
        ctype: ctype.into(),
        cunit: cunit.into(),
        crpix,
        crval,
        cdelt,
    };
    let (mid_l, mid_m) = ((grid.n_l / 2 + 1) as f64, (grid.n_m / 2 + 1) as f64);
    let [x, y] = match &grid.frame {
        SkyFrame::Sky { ra_rad, dec_rad, .. } => {
            [axis("RA---SIN", "deg", mid_l, ra_rad.to_degrees(), -cell_deg), axis("DEC--SIN", "deg", mid_m, dec_rad.to_degrees(), cell_deg)]
        }
        SkyFrame::Boresight => [axis("LCOSINE", "deg", mid_l, 0.0, cell_deg), axis("MCOSINE", "deg", mid_m, 0.0, cell_deg)],
    };
    let numbers: Vec<i32> = image.polarizations.iter().map(|p| p.aips()).collect();
    let step = match numbers[..] {
        [first, second, ..] => second - first,
        _ => 1,
    };
    if numbers.windows(2).any(|w| w[1] - w[0] != step) || step == 0 {
        return Err(FormatError::unsupported(
            path,
            format!("polarisations {:?} do not form a regular STOKES axis: write them one by one", image.polarizations),
        ));
    }
    let first = numbers.first().copied().unwrap_or(1);
    Ok([
        x,
        y,
        axis("FREQ", "Hz", 1.0, image.spectrum.freq_hz()[0], channel_step(image)),
        axis("STOKES", "", 1.0, f64::from(first), f64::from(step)),
    ])
}

fn beams_table(beams: &[RestoringBeam], n_pol: usize) -> Vec<u8> {
    let columns = vec![
        ("BMAJ", Form::Float(1), "arcsec"),
        ("BMIN", Form::Float(1), "arcsec"),
        ("BPA", Form::Float(1), "deg"),
        ("CHAN", Form::Int(1), ""),
        ("POL", Form::Int(1), ""),
    ];
    let mut table = TableWriter::new("BEAMS", columns);
    for pol in 0..n_pol {
        for (chan, b) in beams.iter().enumerate() {
            let row = [b.bmaj_rad.to_degrees() * 3600.0, b.bmin_rad.to_degrees() * 3600.0, b.bpa_rad.to_degrees(), chan as f64, pol as f64];
            table.each(&row);
        }
    }
    table.finish(|h| {
        h.integer("NCHAN", beams.len() as i64, "");
        h.integer("NPOL", n_pol as i64, "");
    })
}

fn channels_table<P>(image: &Image<P>) -> Vec<u8> {
    let mut table = TableWriter::new("CHANNELS", vec![("FREQ", Form::Double(1), "Hz"), ("WIDTH", Form::Double(1), "Hz")]);
    for (freq, width) in image.spectrum.freq_hz().iter().zip(image.spectrum.width_hz()) {
        table.each(&[*freq, *width]);
    }
    table.finish(|_| {})
}

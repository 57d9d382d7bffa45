//! Reading images: any BITPIX, scaled integers, degenerate axes, in the primary header or an extension, plain or .fits.gz.

use super::header::Header;
use super::image_axes::{Axes, Kind, unit};
use super::input::{Input, padding};
use super::near_field::near_field;
use super::number::{Number, scaled};
use super::table::Table;
use crate::{FormatError, Result};
use cittert_arrays::{Image, RestoringBeam, SpectralWindow};
use ndarray::{ArrayD, Axis, Ix4, IxDyn};
use std::path::Path;

/// Largest number of pixels of one image: 8 GiB as 64-bit floats.
const MOST_PIXELS: u64 = 1 << 30;

/// Read the first image of a FITS file, columns running to the west (sky) or to the right (boresight) and rows up.
///
/// Values come in K, Jy/pixel or Jy/beam where BUNIT says so (prefixes and Jy/sr are converted). Blank pixels are NaN;
/// the caller must handle them.
///
/// # Errors
/// A file that is not FITS, is truncated or holds no image; no cell size; axes that do not form an (l, m) grid; or sizes that the file
/// cannot hold.
pub fn read_image(path: &Path) -> Result<Image> {
    let mut input = Input::open(path)?;
    let mut first = true;
    while let Some(header) = Header::read(&mut input, first)? {
        let image = first || header.text("XTENSION").is_some_and(|t| t.trim() == "IMAGE");
        first = false;
        if header.is_true("GROUPS") && header.get("NAXIS1").is_some() && header.integer("NAXIS1") == Some(0) {
            return Err(FormatError::not_a(path, "a FITS image", "it holds visibilities (UVFITS)"));
        }
        let bytes = header.data_bytes()?;
        if image && bytes > 0 {
            return read_here(&mut input, &header);
        }
        input.skip("data before the image", bytes + padding(bytes))?;
    }
    Err(FormatError::not_a(path, "a FITS image", "no header in it has image data"))
}

/// Read the image that follows `header`, and the tables that belong to it.
fn read_here(input: &mut Input, header: &Header) -> Result<Image> {
    let path = header.path();
    let axes = Axes::of(header)?;
    let values = pixels(input, header)?;
    let failed = |e| FormatError::values(path, e);
    let mut shape: Vec<usize> = axes.others.iter().rev().map(|o| o.0).collect();
    shape.extend([axes.grid.n_m, axes.grid.n_l]);
    let shape_text = format!("{shape:?}");
    let mut cube = ArrayD::from_shape_vec(IxDyn(&shape), values)
        .map_err(|e| FormatError::malformed(path, "image data", format!("an array of shape {shape_text}"), e.to_string()))?;
    // Reorder [.., axis 4, axis 3, m, l] to [chan, pol, m, l]. Other axes have length 1.
    let n_other = axes.others.len();
    let at = |kind| axes.others.iter().position(|o| o.1 == kind).map(|k| n_other - 1 - k);
    let mut order: Vec<usize> = [at(Kind::Channel), at(Kind::Polarization)].into_iter().flatten().collect();
    let degenerate = (0..n_other).filter(|k| !order.contains(k)).collect::<Vec<_>>();
    order = degenerate.into_iter().chain(order).chain([n_other, n_other + 1]).collect();
    cube = cube.permuted_axes(order);
    if axes.flip_l {
        cube.invert_axis(Axis(n_other + 1));
    }
    if axes.flip_m {
        cube.invert_axis(Axis(n_other));
    }
    let final_shape = (axes.spectrum.n_chan(), axes.polarizations.len(), axes.grid.n_m, axes.grid.n_l);
    let data = cube
        .as_standard_layout()
        .into_owned()
        .into_shape_with_order(final_shape)
        .and_then(|a| a.into_dimensionality::<Ix4>())
        .map_err(|e| FormatError::malformed(path, "image data", format!("an array of shape {shape_text}"), e.to_string()))?;
    let (unit, factor) = unit(header.text("BUNIT").unwrap_or(""), axes.grid.cell_sr());
    let data = if factor == 1.0 { data } else { data * factor };
    let mut image = Image::new(axes.grid, axes.spectrum, axes.polarizations, data, unit).map_err(failed)?;
    image.object = header.text("OBJECT").unwrap_or("").to_string();
    image.telescope = header.text("TELESCOP").unwrap_or("").to_string();
    image.time_jd =
        header.text("DATE-OBS").and_then(crate::time::jd_of_fits_date).or_else(|| header.real("MJD-OBS").map(|m| m + 2_400_000.5));
    image.pedestal_k = header.real("CITPEDST");
    let pattern = |key: &str| header.text(key).and_then(|t| t.parse().ok()).unwrap_or_default();
    (image.pattern, image.seen_through) = (pattern("CITPATT"), pattern("CITSEEN"));
    image.near_field = near_field(header);
    image.history = header.history.clone();
    if let (Some(major), Some(minor)) = (header.real("BMAJ"), header.real("BMIN")) {
        let beam = RestoringBeam {
            bmaj_rad: major.to_radians(),
            bmin_rad: minor.to_radians(),
            bpa_rad: header.real("BPA").unwrap_or(0.0).to_radians(),
        };
        image.beams = vec![beam; image.spectrum.n_chan()];
    }
    let bytes = header.data_bytes()?;
    let mut gap = vec![0; padding(bytes) as usize];
    if input.read_some(&mut gap)? == gap.len() {
        read_tables(input, &mut image)?;
    }
    Ok(image)
}

/// All pixels in the order of the file, scaled, with NaN for blanks. Memory is allocated as the pixels are read, not as the header claims.
fn pixels(input: &mut Input, header: &Header) -> Result<Vec<f64>> {
    let bytes = header.data_bytes()?;
    let number = Number::of(header)?;
    let count = bytes / number.bytes() as u64;
    if count > MOST_PIXELS {
        return Err(FormatError::unsupported(header.path(), format!("the image has {count} pixels; at most {MOST_PIXELS} are read")));
    }
    input.demand("image data", bytes)?;
    let (scale, zero) = (header.real("BSCALE").unwrap_or(1.0), header.real("BZERO").unwrap_or(0.0));
    let whole = !matches!(number, Number::Float | Number::Double);
    let blank = header.integer("BLANK").filter(|_| whole).map(|v| v as f64);
    let value = |v: f64| if Some(v) == blank { f64::NAN } else { scaled(v, scale, zero) };
    let mut values = Vec::new();
    let mut buffer = vec![0u8; 1 << 16];
    let mut left = bytes;
    while left > 0 {
        let n = left.min(buffer.len() as u64) as usize;
        input.read_exact("image data", &mut buffer[..n])?;
        left -= n as u64;
        values.extend((0..n / number.bytes()).map(|k| value(number.get(&buffer, k))));
    }
    Ok(values)
}

/// Read the tables BEAMS (a beam for each channel, as CASA writes it) and CHANNELS (centres and widths of uneven channels).
fn read_tables(input: &mut Input, image: &mut Image) -> Result<()> {
    let n_chan = image.spectrum.n_chan();
    while let Some(header) = Header::read(input, false)? {
        let bytes = header.data_bytes()?;
        let name = header.text("EXTNAME").unwrap_or("").trim().to_string();
        if header.text("XTENSION").map(str::trim) != Some("BINTABLE") || !["BEAMS", "CHANNELS"].contains(&name.as_str()) {
            input.skip("an extension behind the image", (bytes + padding(bytes)).min(bytes))?;
            let mut gap = vec![0; padding(bytes) as usize];
            input.read_some(&mut gap)?;
            continue;
        }
        let table = Table::read(input, header)?;
        if name == "BEAMS" {
            let unit = |k: usize| match table.header.text(&format!("TUNIT{k}")).map(str::trim) {
                Some("deg") => 1f64.to_radians(),
                _ => (1.0 / 3600f64).to_radians(),
            };
            let mut beams: Vec<Option<RestoringBeam>> = vec![None; n_chan];
            for row in 0..table.rows() {
                let chan = table.real(row, "CHAN").unwrap_or(row as f64) as usize;
                if let (Some(slot), Some(major), Some(minor)) = (beams.get_mut(chan), table.real(row, "BMAJ"), table.real(row, "BMIN")) {
                    let bpa_rad = table.real(row, "BPA").unwrap_or(0.0).to_radians();
                    slot.get_or_insert(RestoringBeam { bmaj_rad: major * unit(1), bmin_rad: minor * unit(2), bpa_rad });
                }
            }
            if let Some(all) = beams.into_iter().collect::<Option<Vec<_>>>() {
                image.beams = all;
            }
        } else if table.rows() == n_chan {
            let column = |name: &str| (0..n_chan).map(|r| table.real(r, name)).collect::<Option<Vec<f64>>>();
            if let (Some(freq), Some(width)) = (column("FREQ"), column("WIDTH")) {
                image.spectrum = SpectralWindow::new(freq, width).map_err(|e| FormatError::values(input.path(), e))?;
            }
        }
    }
    Ok(())
}

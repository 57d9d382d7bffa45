//! The axes of an image: grid, channels and polarisations from the keywords of the header.

use super::celestial::{Projection, recentre};
use super::header::Header;
use crate::{FormatError, Result};
use cittert_arrays::{BrightnessUnit, Polarization, SkyFrame, SkyGrid, SpectralWindow};

/// Frequency that is used for an image without a stated frequency, Hz. It is a placeholder.
const NO_FREQUENCY_HZ: f64 = 1.0;

/// The axes of an image.
pub(super) struct Axes {
    pub(super) grid: SkyGrid,
    pub(super) spectrum: SpectralWindow,
    pub(super) polarizations: Vec<Polarization>,
    /// The columns of the file run against those of the grid.
    pub(super) flip_l: bool,
    /// The rows of the file run against those of the grid.
    pub(super) flip_m: bool,
    /// Lengths of axes 3 and up, and whether each is channels, polarisations or neither.
    pub(super) others: Vec<(usize, Kind)>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Channel,
    Polarization,
    Degenerate,
}

/// Factor from the unit of axis `k` to rad (angles) or Hz (frequencies).
fn unit_factor(header: &Header, k: usize, default: f64) -> f64 {
    match header.text(&format!("CUNIT{k}")).unwrap_or("").trim().to_ascii_lowercase().as_str() {
        "deg" | "degree" | "degrees" => 1f64.to_radians(),
        "arcmin" => (1.0 / 60f64).to_radians(),
        "arcsec" => (1.0 / 3600f64).to_radians(),
        "mas" => (1.0 / 3.6e6_f64).to_radians(),
        "uas" => (1.0 / 3.6e9_f64).to_radians(),
        "rad" => 1.0,
        "hz" => 1.0,
        "khz" => 1e3,
        "mhz" => 1e6,
        "ghz" => 1e9,
        _ => default,
    }
}

/// Step of axis `k` (1 or 2) in the unit of the axis, from CDELT or the CD or PC matrix.
fn step(header: &Header, k: usize) -> Result<f64> {
    let other = 3 - k;
    let cd = header.real(&format!("CD{k}_{k}"));
    let (value, off) = match cd {
        Some(cd) => (cd, header.real(&format!("CD{k}_{other}")).unwrap_or(0.0)),
        None => {
            let Some(cdelt) = header.real(&format!("CDELT{k}")) else {
                return Err(FormatError::malformed(
                    header.path(),
                    format!("CDELT{k}"),
                    "the size of a cell (CDELT1 and CDELT2, or CD1_1 and CD2_2)",
                    "no such keyword",
                ));
            };
            let pc = header.real(&format!("PC{k}_{k}")).unwrap_or(1.0);
            let off = header.real(&format!("PC{k}_{other}")).unwrap_or(0.0) * cdelt;
            let turn = header.real(&format!("CROTA{k}")).unwrap_or(0.0).to_radians().sin() * cdelt;
            (cdelt * pc, if off == 0.0 { turn } else { off })
        }
    };
    if !(value.is_finite() && value != 0.0) {
        return Err(FormatError::malformed(
            header.path(),
            format!("step of axis {k}"),
            "a finite size of a cell other than 0",
            value.to_string(),
        ));
    }
    if off.abs() > 1e-6 * value.abs() {
        return Err(FormatError::unsupported(
            header.path(),
            "the axes of the image are rotated: regrid it so that rows run along declination",
        ));
    }
    Ok(value)
}

impl Axes {
    /// Read the axes from an image header.
    pub(super) fn of(header: &Header) -> Result<Self> {
        let path = header.path();
        let lengths = header.axes()?;
        let bad = |place: &str, expected: &str, found: String| FormatError::malformed(path, place, expected, found);
        if lengths.len() < 2 {
            return Err(bad("NAXIS", "at least 2 axes", lengths.len().to_string()));
        }
        let sides: Vec<usize> = lengths[..2].iter().map(|n| usize::try_from(*n).unwrap_or(usize::MAX)).collect();
        let (grid, flip_l, flip_m) = plane(header, (sides[0], sides[1]))?;
        let mut others = Vec::new();
        let mut spectrum = None;
        let mut polarizations = None;
        for (i, len) in lengths[2..].iter().enumerate() {
            let k = i + 3;
            let ctype = header.ctype(k);
            let n = usize::try_from(*len).unwrap_or(usize::MAX);
            if n == 0 || n > 1 << 20 {
                return Err(bad(&format!("NAXIS{k}"), "1 to 1048576", n.to_string()));
            }
            let kind = if ctype.starts_with("FREQ") && spectrum.is_none() {
                spectrum = Some(channels(header, k, n)?);
                Kind::Channel
            } else if ctype == "STOKES" && polarizations.is_none() {
                polarizations = Some(header.polarizations(k, n)?);
                Kind::Polarization
            } else if n == 1 {
                Kind::Degenerate
            } else {
                return Err(bad(&format!("CTYPE{k}"), "FREQ or STOKES on an axis longer than 1", format!("{ctype:?} of length {n}")));
            };
            others.push((n, kind));
        }
        let spectrum = match spectrum {
            Some(s) => s,
            None => {
                let rest = ["RESTFRQ", "RESTFREQ", "FREQ"].iter().find_map(|k| header.real(k)).filter(|f| *f > 0.0);
                let f = rest.unwrap_or(NO_FREQUENCY_HZ);
                SpectralWindow::new(vec![f], vec![f]).map_err(|e| FormatError::values(path, e))?
            }
        };
        Ok(Self { grid, spectrum, polarizations: polarizations.unwrap_or(vec![Polarization::I]), flip_l, flip_m, others })
    }
}

/// The grid of the first two axes, and whether columns and rows run against it.
fn plane(header: &Header, (n_l, n_m): (usize, usize)) -> Result<(SkyGrid, bool, bool)> {
    let path = header.path();
    let (x, y) = (header.ctype(1), header.ctype(2));
    let celestial = x.starts_with("RA") && y.starts_with("DEC");
    for name in [&x, &y] {
        let axis = name.get(..4).unwrap_or(name);
        if !celestial && ["RA--", "DEC-", "GLON", "GLAT", "ELON", "ELAT"].contains(&axis) {
            return Err(FormatError::unsupported(
                path,
                format!("axes 1 and 2 are {x:?} and {y:?}: only right ascension and declination, or linear axes, are read"),
            ));
        }
    }
    let factor = |k| unit_factor(header, k, 1f64.to_radians());
    let (dx, dy) = (step(header, 1)? * factor(1), step(header, 2)? * factor(2));
    if (dx.abs() - dy.abs()).abs() > 1e-5 * dx.abs() {
        return Err(FormatError::unsupported(
            path,
            format!("cells are not square ({:.6e} by {:.6e} rad): regrid the image", dx.abs(), dy.abs()),
        ));
    }
    let cell_rad = dy.abs();
    // On the sky columns should run to the west, elsewhere to the right; rows always to the north or up.
    let (flip_l, flip_m) = (if celestial { dx > 0.0 } else { dx < 0.0 }, dy < 0.0);
    let frame = if celestial {
        let pixel = |k: usize, n: usize, flip: bool| {
            let from_zero = header.real(&format!("CRPIX{k}")).unwrap_or(1.0) - 1.0;
            if flip { n as f64 - 1.0 - from_zero } else { from_zero }
        };
        let value = |k: usize| header.real(&format!("CRVAL{k}")).filter(|v| v.is_finite()).map(|v| v * factor(k));
        let (Some(ra), Some(dec)) = (value(1), value(2)) else {
            return Err(FormatError::malformed(
                path,
                "CRVAL1, CRVAL2",
                "right ascension and declination of the reference pixel",
                "no such numbers",
            ));
        };
        let slant = ["PV2_1", "PV2_2"].iter().any(|k| header.real(k).is_some_and(|v| v != 0.0));
        if slant {
            return Err(FormatError::unsupported(
                path,
                "a slant projection (PV2_1 or PV2_2, as NCP) is not read: reproject the image to SIN",
            ));
        }
        let projection = Projection::from_ctype(path, &x)?;
        let reference = (pixel(1, n_l, flip_l), pixel(2, n_m, flip_m));
        let (ra_rad, dec_rad) = recentre(path, projection, (n_l, n_m), reference, cell_rad, (ra, dec))?;
        SkyFrame::Sky { ra_rad, dec_rad, frame: equatorial_frame(header) }
    } else {
        SkyFrame::Boresight
    };
    let grid = SkyGrid::new(n_l, n_m, cell_rad, frame).map_err(|e| FormatError::values(path, e))?;
    Ok((grid, flip_l, flip_m))
}

/// `icrs`, `fk5` or `fk4` from RADESYS or the equinox.
fn equatorial_frame(header: &Header) -> String {
    let named = ["RADESYS", "RADECSYS"].iter().find_map(|k| header.text(k)).unwrap_or("").trim().to_ascii_lowercase();
    if !named.is_empty() {
        return named;
    }
    match ["EQUINOX", "EPOCH"].iter().find_map(|k| header.real(k)) {
        Some(e) if e < 1984.0 => "fk4".into(),
        Some(_) => "fk5".into(),
        None => "icrs".into(),
    }
}

/// Channels of axis `k`.
fn channels(header: &Header, k: usize, n: usize) -> Result<SpectralWindow> {
    let factor = unit_factor(header, k, 1.0);
    let (reference, pixel, step) = header.axis(k, (0.0, 1.0));
    let (reference, step) = (reference * factor, step * factor);
    let freq: Vec<f64> = (0..n).map(|c| reference + (c as f64 + 1.0 - pixel) * step).collect();
    let width = if step == 0.0 { reference } else { step.abs() };
    SpectralWindow::new(freq, vec![width; n]).map_err(|e| FormatError::values(header.path(), e))
}

/// The unit of BUNIT and the factor from the file's numbers to it.
pub(super) fn unit(bunit: &str, cell_sr: f64) -> (BrightnessUnit, f64) {
    let text: String = bunit.trim().chars().filter(|c| !c.is_whitespace()).collect();
    let lower = text.to_ascii_lowercase();
    let prefixed = |base: &str| -> Option<f64> {
        let prefix = lower.strip_suffix(base)?;
        // The prefixes M and m differ only by upper and lower case.
        Some(match (prefix, text.chars().next()) {
            ("", _) => 1.0,
            ("m", Some('m')) => 1e-3,
            ("m", _) => 1e6,
            ("u", _) => 1e-6,
            ("k", _) => 1e3,
            _ => return None,
        })
    };
    let table = [
        (["k", "kelvin", "k(tb)"], BrightnessUnit::Kelvin, 1.0),
        (["jy/pixel", "jypixel-1", "jy/pix"], BrightnessUnit::JyPerPixel, 1.0),
        (["jy/beam", "jybeam-1", "jybeam^-1"], BrightnessUnit::JyPerBeam, 1.0),
        (["jy/sr", "jysr-1", "jysr^-1"], BrightnessUnit::JyPerPixel, cell_sr),
    ];
    for (names, unit, factor) in table {
        if let Some(prefix) = names.iter().find_map(|n| prefixed(n)) {
            return (unit, prefix * factor);
        }
    }
    match lower.as_str() {
        "" => (BrightnessUnit::One, 1.0),
        "m" => (BrightnessUnit::Metre, 1.0),
        _ => (BrightnessUnit::Other, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_and_their_prefixes() {
        use BrightnessUnit::*;
        for (text, expected, factor) in [
            ("K", Kelvin, 1.0),
            ("mK", Kelvin, 1e-3),
            ("JY/BEAM", JyPerBeam, 1.0),
            ("mJy/beam", JyPerBeam, 1e-3),
            ("Jy beam-1", JyPerBeam, 1.0),
            ("Jy/pixel", JyPerPixel, 1.0),
            ("MJy/sr", JyPerPixel, 1e6 * 1e-8),
            ("", One, 1.0),
            ("m", Metre, 1.0),
            ("erg/s", Other, 1.0),
        ] {
            let (u, f) = unit(text, 1e-8);
            assert!(u == expected && (f - factor).abs() <= 1e-12 * factor, "{text}: {u:?} {f}");
        }
    }
}

//! Beam files of pyuvdata's UVBeam, and FITS tables.
//!
//! A beam file holds, from the slowest axis to the fastest, real and imaginary part (not in real power beams), component of the field,
//! spectral window, feed or polarisation product, frequency, zenith angle and azimuth. Azimuth runs from east to north: from +l to +m.
//! The pattern of Stokes I is the mean of the two parallel hands, or of |E|^2 of the two feeds, 1 at the zenith in each channel.
//!
//! # Reference
//! pyuvdata, "Beam FITS memo" (docs/references/beamfits_memo).

use super::columns;
use crate::fits::table::Table;
use crate::fits::{Header, Input, Number, padding, scaled};
use crate::{FormatError, Result};
use cittert_arrays::pattern::SampledPattern;
use ndarray::{Array3, ArrayD, IxDyn};
use std::f64::consts::TAU;
use std::path::Path;

/// Largest number of values that are read: 512 MiB as 64-bit floats.
const MOST: u64 = 1 << 26;

pub(super) fn read(path: &Path) -> Result<SampledPattern> {
    let mut input = Input::open(path)?;
    let mut first = true;
    while let Some(header) = Header::read(&mut input, first)? {
        if first && header.text("BTYPE").is_some() {
            return beam(&mut input, &header);
        }
        let table = header.text("XTENSION").is_some_and(|t| t.trim() == "BINTABLE");
        first = false;
        if table {
            let table = Table::read(&mut input, header)?;
            if let Some(found) = columns::of_table(path, &table)? {
                return Ok(found);
            }
        } else {
            let bytes = header.data_bytes()?;
            input.skip("data before the table of the pattern", bytes + padding(bytes))?;
        }
    }
    let expected = "the pattern of an antenna: a FITS table with the columns THETA_DEG and POWER, or a beam file of pyuvdata";
    Err(FormatError::not_a(path, expected, "a FITS file without either"))
}

/// The beam that follows a primary header.
fn beam(input: &mut Input, header: &Header) -> Result<SampledPattern> {
    let path = header.path();
    let kind = header.text("BTYPE").unwrap_or("").to_ascii_lowercase();
    if !["power", "efield"].contains(&kind.as_str()) {
        return Err(FormatError::malformed(path, "BTYPE", "power or efield", kind));
    }
    let coordinates = header.text("COORDSYS").unwrap_or("").to_ascii_lowercase();
    if coordinates != "az_za" {
        let what = format!("the beam has the coordinates {coordinates:?}: interpolate it to az_za in pyuvdata (UVBeam.interp) first");
        return Err(FormatError::unsupported(path, what));
    }
    let shape: Vec<usize> = header.axes()?.iter().rev().map(|n| *n as usize).collect();
    let values = values(input, header, &shape)?;
    let complex = shape.len() == 7;
    let (parts, shape) = match shape[..] {
        [parts @ 1..=2, fields, 1, pols, freqs, zas, azs] => (parts, [fields, pols, freqs, zas, azs]),
        [fields, 1, pols, freqs, zas, azs] => (1, [fields, pols, freqs, zas, azs]),
        _ => {
            let expected = "the axes AZIMUTH, ZENANGLE, FREQ, STOKES or FEEDIND, IF (of length 1), VECIND and COMPLEX";
            return Err(FormatError::malformed(path, "axes", expected, format!("{shape:?}")));
        }
    };
    let value = |part: usize, [field, pol, f, z, a]: [usize; 5]| {
        if complex { values[&[part, field, 0, pol, f, z, a][..]] } else { values[&[field, 0, pol, f, z, a][..]] }
    };
    let [fields, pols, freqs, zas, azs] = shape;
    let hands = hands(header, pols, &kind)?;
    let power = |f: usize, z: usize, a: usize| {
        let of = |pol: usize| match kind.as_str() {
            "power" => value(0, [0, pol, f, z, a]),
            _ => (0..fields).flat_map(|v| (0..parts).map(move |p| (p, v))).map(|(p, v)| value(p, [v, pol, f, z, a]).powi(2)).sum(),
        };
        hands.iter().map(|pol| of(*pol)).sum::<f64>() / hands.len() as f64
    };
    let axis = |k: usize, n: usize| {
        let (reference, pixel, step) = header.axis(k, (0.0, 1.0));
        (0..n).map(|i| reference + (i as f64 + 1.0 - pixel) * step).collect::<Vec<f64>>()
    };
    let theta: Vec<f64> = axis(2, zas).iter().map(|x| x.to_radians()).collect();
    let mut phi: Vec<f64> = axis(1, azs).iter().map(|x| x.to_radians()).collect();
    // Some writers repeat the first azimuth at the end of the turn.
    while phi.len() > 1 && phi[phi.len() - 1] - phi[0] > TAU - 1e-6 {
        phi.pop();
    }
    let table = Array3::from_shape_fn((freqs, zas, phi.len()), |(f, z, a)| power(f, z, a).max(0.0));
    SampledPattern::new(axis(3, freqs), theta, phi, table).map_err(|e| FormatError::values(path, e))
}

/// Indices of the two parallel hands or of Stokes I among the products of a power beam, or of all feeds of a field.
fn hands(header: &Header, count: usize, kind: &str) -> Result<Vec<usize>> {
    if kind == "efield" {
        return Ok((0..count).collect());
    }
    let products = header.polarizations(4, count)?;
    let found: Vec<usize> =
        (0..count).filter(|k| products[*k].is_parallel_hand() || products[*k] == cittert_arrays::Polarization::I).collect();
    if found.is_empty() {
        return Err(FormatError::malformed(
            header.path(),
            "STOKES",
            "a parallel hand (XX, YY, RR, LL) or Stokes I",
            format!("{products:?}"),
        ));
    }
    Ok(found)
}

fn values(input: &mut Input, header: &Header, shape: &[usize]) -> Result<ArrayD<f64>> {
    let (bytes, number) = (header.data_bytes()?, Number::of(header)?);
    let count = bytes / number.bytes() as u64;
    if count > MOST {
        return Err(FormatError::unsupported(header.path(), format!("the beam has {count} values; at most {MOST} are read")));
    }
    input.demand("values of the beam", bytes)?;
    let mut buffer = vec![0; bytes as usize];
    input.read_exact("values of the beam", &mut buffer)?;
    let (scale, zero) = (header.real("BSCALE").unwrap_or(1.0), header.real("BZERO").unwrap_or(0.0));
    let values = (0..count as usize).map(|k| scaled(number.get(&buffer, k), scale, zero)).collect();
    let wrong =
        |e: ndarray::ShapeError| FormatError::malformed(header.path(), "axes", format!("an array of shape {shape:?}"), e.to_string());
    ArrayD::from_shape_vec(IxDyn(shape), values).map_err(wrong)
}

//! The power pattern of the elements: a keyword that other programs carry, and for a table of samples a group beside it.

use super::names::{ANTENNA_GROUP, PATTERN_KEYWORD};
use crate::h5::{H5In, H5Out};
use crate::{FormatError, Result};
use cittert_arrays::ElementPattern;
use cittert_arrays::pattern::SampledPattern;
use ndarray::{Array1, Array3};

/// The group of a table, and the text of the keyword then.
const SAMPLED: &str = "sampled";

fn place(name: &str) -> String {
    format!("{ANTENNA_GROUP}/pattern/{name}")
}

pub(super) fn write(out: &H5Out, pattern: &ElementPattern) -> Result<()> {
    if pattern.is_none() {
        return Ok(());
    }
    out.text(&format!("Header/extra_keywords/{PATTERN_KEYWORD}"), &pattern.to_string())?;
    if let ElementPattern::Sampled(s) = pattern {
        for (name, axis) in [("freq_hz", s.freq_hz()), ("theta_rad", s.theta_rad()), ("phi_rad", s.phi_rad())] {
            out.array(&place(name), Array1::from_vec(axis.to_vec()).view())?;
        }
        out.array(&place("power"), s.samples().view())?;
    }
    Ok(())
}

pub(super) fn read(file: &H5In) -> Result<ElementPattern> {
    let keyword = format!("Header/extra_keywords/{PATTERN_KEYWORD}");
    let Some(text) = file.text(&keyword)? else { return Ok(ElementPattern::None) };
    if text.trim() != SAMPLED {
        return text.parse().map_err(|e| file.wrong(&keyword, "a pattern such as airy diameter_m=0.01", format!("{text:?}: {e}")));
    }
    let axis = |name: &str| -> Result<Vec<f64>> { Ok(file.reals(&place(name))?.ok_or_else(|| file.missing(&place(name)))?.1) };
    let (freq, theta, phi) = (axis("freq_hz")?, axis("theta_rad")?, axis("phi_rad")?);
    let shape = (freq.len(), theta.len(), phi.len());
    let power = file.list(&place("power"), shape.0.saturating_mul(shape.1).saturating_mul(shape.2))?;
    let power = Array3::from_shape_vec(shape, power).map_err(|e| file.wrong(&place("power"), "[freq, theta, phi]", e.to_string()))?;
    let table = SampledPattern::new(freq, theta, phi, power).map_err(|e| FormatError::values(file.path(), e))?;
    Ok(ElementPattern::Sampled(table.into()))
}

//! A layer of a stack.

use num_complex::Complex64;

/// Largest size of a permittivity. That of every metal is far smaller.
const MAX_PERMITTIVITY: f64 = 1e15;
/// Largest thickness of a layer. A thicker layer is a half-space.
const MAX_THICKNESS_M: f64 = 1e6;

/// One layer of a stack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer {
    /// Permittivity `eps' - j eps''`.
    pub eps: Complex64,
    /// Thickness, m; infinite for the last layer.
    pub thickness_m: f64,
    /// Physical temperature, K.
    pub temperature_k: f64,
}

/// The error in a layer, if there is one. `last` is true for the half-space at the bottom.
pub(super) fn check_layer(layer: &Layer, last: bool) -> Result<(), String> {
    let eps = layer.eps;
    if !(eps.re.is_finite() && eps.im.is_finite()) {
        return Err(format!("permittivity {eps} is not a finite number"));
    }
    if eps.im > 0.0 {
        return Err(format!("loss {} is negative; loss is given as a positive number", -eps.im));
    }
    if !(1e-6..=MAX_PERMITTIVITY).contains(&eps.norm()) {
        return Err(format!("permittivity {eps} must have a size between 1e-6 and {MAX_PERMITTIVITY:e}"));
    }
    if !(layer.temperature_k.is_finite() && layer.temperature_k > 0.0) {
        return Err(format!("temperature is {} K; it must be a finite number above 0 K", layer.temperature_k));
    }
    if last {
        if layer.thickness_m != f64::INFINITY {
            return Err(format!(
                "it is the last and has thickness {} m; the last layer is a half-space, leave \
                 thickness_m out or add a layer below",
                layer.thickness_m
            ));
        }
    } else if !(0.0..=MAX_THICKNESS_M).contains(&layer.thickness_m) {
        return Err(format!("thickness is {} m; every layer but the last needs one of 0 to {MAX_THICKNESS_M:e} m", layer.thickness_m));
    }
    Ok(())
}

//! Values with their unit, and labels of axes that show them.

use super::axes::{prefix, short, superscript};
use cittert_arrays::BrightnessUnit;

/// A value of an image with its unit, such as "213 µJy/beam".
pub(super) fn brightness(v: f64, unit: BrightnessUnit) -> String {
    let (factor, letter) = prefix_of(unit, v.abs());
    let shown = v / factor;
    // Three digits say what a reader of a picture needs.
    let step = if shown == 0.0 { 1.0 } else { 10_f64.powf(shown.abs().log10().floor() - 2.0) };
    format!("{} {letter}{}", short((shown / step).round() * step), unit.bunit()).trim_end().to_owned()
}

/// The prefix of a value: temperatures above 1000 K are not shown in kK, numbers without a unit have no prefix.
fn prefix_of(unit: BrightnessUnit, largest: f64) -> (f64, &'static str) {
    match unit {
        BrightnessUnit::One | BrightnessUnit::Other => (1.0, ""),
        BrightnessUnit::Kelvin if largest >= 1.0 => (1.0, ""),
        _ => prefix(largest),
    }
}

/// Divisor and label of a colour bar.
pub(super) fn value_unit(unit: BrightnessUnit, largest: f64) -> (f64, String) {
    let (label, base) = match unit {
        BrightnessUnit::Kelvin => ("Brightness temperature", "K"),
        BrightnessUnit::JyPerPixel | BrightnessUnit::JyPerBeam => ("Brightness", unit.bunit()),
        BrightnessUnit::Metre => ("Range", "m"),
        BrightnessUnit::One | BrightnessUnit::Other => {
            let label = if unit == BrightnessUnit::One { "Ratio" } else { "Pixel value, unit unknown" };
            if largest == 0.0 || (1e-3..1e4).contains(&largest) {
                return (1.0, label.into());
            }
            let exponent = largest.log10().floor() as i32;
            return (10_f64.powi(exponent), format!("{label} (10{})", superscript(exponent)));
        }
    };
    let (factor, letter) = prefix_of(unit, largest);
    (factor, format!("{label} ({letter}{base})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_three_digits_and_their_unit() {
        assert_eq!(brightness(2.1345e-4, BrightnessUnit::JyPerBeam), "213 \u{b5}Jy/beam");
        assert_eq!(brightness(312.4, BrightnessUnit::Kelvin), "312 K");
        assert_eq!(brightness(0.25, BrightnessUnit::One), "0.25");
    }
}

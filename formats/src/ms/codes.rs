//! Codes of polarisation products and celestial frames in Measurement Sets, and the names of their columns of visibilities.

use crate::VisColumn;
use Polarization::{I, LL, LR, Q, RL, RR, U, V, XX, XY, YX, YY};
use cittert_arrays::Polarization;

/// Code of the Stokes type in casacore, and product, in the order in which CASA stores the products of a row.
const PRODUCTS: [(i32, Polarization); 12] =
    [(1, I), (2, Q), (3, U), (4, V), (5, RR), (6, RL), (7, LR), (8, LL), (9, XX), (10, XY), (11, YX), (12, YY)];

/// Code of a product in casacore.
pub(super) fn code_of(product: Polarization) -> i32 {
    PRODUCTS.iter().find(|p| p.1 == product).map_or(0, |p| p.0)
}

/// The product with a code of casacore.
pub(super) fn product_of(code: i32) -> Option<Polarization> {
    PRODUCTS.iter().find(|p| p.0 == code).map(|p| p.1)
}

/// The product that a row holds when its antennas are exchanged: V_21 of RL is the conjugate of V_12 of LR.
pub(super) fn exchanged(product: Polarization) -> Polarization {
    match product {
        RL => LR,
        LR => RL,
        XY => YX,
        YX => XY,
        same => same,
    }
}

/// Frame of casacore, its name in a header in memory, and its epoch in years.
const FRAMES: [(&str, &str, f64); 5] =
    [("J2000", "fk5", 2000.0), ("ICRS", "icrs", 2000.0), ("B1950", "fk4", 1950.0), ("B1950_VLA", "fk4", 1979.0), ("APP", "gcrs", 2000.0)];

/// Name of a celestial frame in casacore; `None` where casacore does not know the frame.
pub(super) fn frame_code(frame: &str, epoch: Option<f64>) -> Option<&'static str> {
    let frame = if frame.is_empty() { "icrs" } else { frame };
    let found = FRAMES.iter().filter(|f| f.1.eq_ignore_ascii_case(frame));
    let mut fitting = found.filter(|f| epoch.is_none_or(|e| (e - f.2).abs() < 1.0));
    fitting.next().map(|f| f.0)
}

/// Name in memory and epoch of a celestial frame of casacore.
pub(super) fn frame_of(code: &str) -> Option<(&'static str, f64)> {
    FRAMES.iter().find(|f| f.0.eq_ignore_ascii_case(code)).map(|f| (f.1, f.2))
}

/// Name of a column of visibilities in the main table; `None` where a Measurement Set has no such column.
pub(super) fn name_of(column: VisColumn) -> Option<&'static str> {
    match column {
        VisColumn::Data => Some("DATA"),
        VisColumn::Model => Some("MODEL_DATA"),
        VisColumn::Corrected => Some("CORRECTED_DATA"),
        VisColumn::Residual => None,
    }
}

/// Seconds of the modified Julian day of a Julian date.
pub(super) fn mjd_seconds(jd: f64) -> f64 {
    (jd - 2_400_000.5) * 86_400.0
}

/// Julian date of seconds of the modified Julian day.
pub(super) fn jd_of(mjd_seconds: f64) -> f64 {
    mjd_seconds / 86_400.0 + 2_400_000.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_go_both_ways() {
        for (code, product) in PRODUCTS {
            assert_eq!(product_of(code), Some(product));
            assert_eq!(code_of(product), code);
            assert_eq!(exchanged(exchanged(product)), product);
        }
        assert_eq!(product_of(13), None);
        for (code, frame, epoch) in FRAMES {
            assert_eq!(frame_of(code), Some((frame, epoch)));
            assert_eq!(frame_code(frame, Some(epoch)), Some(code));
        }
        assert_eq!(frame_code("FK5", None), Some("J2000"));
        assert_eq!(frame_code("galactic", None), None);
    }

    #[test]
    fn times_go_both_ways() {
        for k in 0..1000 {
            let jd = 2_457_849.5 + 0.123_456_789 * f64::from(k);
            assert!((jd_of(mjd_seconds(jd)) - jd).abs() * 86_400.0 < 1e-4);
        }
    }
}

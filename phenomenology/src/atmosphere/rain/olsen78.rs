//! The rain power law of 1978, in frequency bands, without polarisation.
//!
//! # Reference
//! Olsen, Rogers & Hodge 1978, IEEE Trans. AP 26, 318.

use super::model::{PowerLaw, RainModel};

/// The Olsen power law, up to 25 mm/h.
#[derive(Debug, Clone, Copy)]
pub struct Olsen78;

/// (highest frequency in GHz, factor, exponent of frequency)
const K_BANDS: [(f64, f64, f64); 4] = [(2.9, 6.39e-5, 2.03), (54.0, 4.21e-5, 2.42), (180.0, 4.09e-2, 0.699), (f64::INFINITY, 3.38, -0.151)];

const ALPHA_BANDS: [(f64, f64, f64); 4] =
    [(8.5, 0.851, 0.158), (25.0, 1.41, -0.0779), (164.0, 2.63, -0.272), (f64::INFINITY, 0.616, 0.0126)];

fn banded(bands: &[(f64, f64, f64)], freq_ghz: f64) -> f64 {
    bands.iter().find(|(highest, _, _)| freq_ghz <= *highest).map_or(f64::NAN, |(_, factor, exponent)| factor * freq_ghz.powf(*exponent))
}

impl RainModel for Olsen78 {
    fn max_rate_mm_h(&self) -> f64 {
        25.0
    }

    fn power_laws(&self, freq_ghz: f64) -> [PowerLaw; 2] {
        let law = PowerLaw { k: banded(&K_BANDS, freq_ghz), alpha: banded(&ALPHA_BANDS, freq_ghz) };
        [law, law]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_nearly_meet_at_their_edges() {
        for bands in [&K_BANDS, &ALPHA_BANDS] {
            for (edge, _, _) in &bands[..3] {
                let (left, right) = (banded(bands, *edge), banded(bands, edge * (1.0 + 1e-12)));
                assert!((right / left - 1.0).abs() < 0.05, "{edge}: {left} {right}");
            }
        }
    }
}

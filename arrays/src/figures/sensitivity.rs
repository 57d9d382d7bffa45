//! Noise of a naturally weighted image: of a point source, and of the brightness in one beam.

use super::options::FigureOptions;
use crate::{ArrayLayout, Sensitivity, jy_per_kelvin_sr};
use std::f64::consts::{LN_2, PI};

/// SEFD of each antenna, Jy, from the options or from the layout: SEFD = 2 k Tsys / A with A = pi D^2 / 4. `None` where the SEFD, or Tsys with
/// a diameter, of an antenna is not known.
pub(super) fn sefd_jy(layout: &ArrayLayout, options: &FigureOptions, wavelength_m: f64) -> Option<Vec<f64>> {
    let given = options.sefd.map(|s| Sensitivity::SefdJy(s.si())).or(options.tsys.map(|t| Sensitivity::TsysK(t.si())));
    let one = |a: &crate::Antenna| match given.or(a.sensitivity)? {
        Sensitivity::SefdJy(sefd) => Some(sefd),
        Sensitivity::TsysK(tsys) => {
            let diameter = options.diameter.map(|d| d.si()).or(a.diameter_m)?;
            let area = PI / 4.0 * diameter * diameter;
            // 2 k Tsys / A is the flux density of Tsys over the antenna's solid angle, lambda^2 / A.
            Some(tsys * jy_per_kelvin_sr(crate::SPEED_OF_LIGHT_M_S / wavelength_m) * wavelength_m * wavelength_m / area)
        }
    };
    layout.antennas().iter().map(one).collect()
}

/// Rms of the image of a point, Jy: 1 / sqrt(sum over pairs of 2 B t / (SEFD1 SEFD2)), which is SEFD / sqrt(N (N - 1) B t) for equal antennas.
/// `inverse_square` is the sum of 1 / SEFD1 / SEFD2 over the pairs, 1 / Jy^2.
///
/// # Reference
/// Thompson, Moran & Swenson 2017, eq. 6.62 (one polarisation, no losses of the correlator).
pub(super) fn point_source_jy(inverse_square: f64, bandwidth_hz: f64, time_s: f64) -> f64 {
    1.0 / (2.0 * bandwidth_hz * time_s * inverse_square).sqrt()
}

/// Sum of 1 / SEFD1 / SEFD2 over the pairs.
pub(super) fn pairs(sefd_jy: &[f64]) -> f64 {
    let (sum, squares) = sefd_jy.iter().fold((0.0, 0.0), |(s, q), v| (s + 1.0 / v, q + 1.0 / (v * v)));
    0.5 * (sum * sum - squares)
}

/// Kelvin per Jy of a beam with these full widths at half maximum (rad): over the solid angle pi a b / (4 ln 2) of a Gaussian beam.
pub(super) fn kelvin_per_jy(freq_hz: f64, major_rad: f64, minor_rad: f64) -> f64 {
    1.0 / (jy_per_kelvin_sr(freq_hz) * PI * major_rad * minor_rad / (4.0 * LN_2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_antennas_have_the_noise_of_the_radiometer_equation() {
        // 27 antennas of 420 Jy, 1 GHz, 1 h: 420 / sqrt(27 * 26 * 1e9 * 3600) = 8.36e-6 Jy.
        let sum = pairs(&[420.0; 27]);
        let rms = point_source_jy(sum, 1e9, 3600.0);
        assert!((rms / (420.0 / (27.0 * 26.0 * 3.6e12_f64).sqrt()) - 1.0).abs() < 1e-12, "{rms}");
        // A filled aperture of N elements A in a square D: Omega_beam is about lambda^2 / D^2, so delta T is about Tsys / sqrt(B t) where N A = D^2.
        let (n, element, freq) = (100.0_f64, 0.01_f64, 94e9);
        let wavelength = crate::SPEED_OF_LIGHT_M_S / freq;
        let layout = ArrayLayout::generate(
            "rectangular",
            &crate::GenerateOptions {
                diameter: Some(crate::quantity::Length(element)),
                tsys: Some(crate::quantity::Temperature(600.0)),
                ..crate::GenerateOptions::new(100, crate::quantity::Length(9.0 * element * 2_f64.sqrt()))
            },
        )
        .unwrap();
        let sefd = sefd_jy(&layout, &FigureOptions::default(), wavelength).unwrap();
        let area = PI / 4.0 * element * element;
        let expected =
            600.0 / (n * (n - 1.0)).sqrt() / (1e9_f64 * 1.0).sqrt() * (wavelength * wavelength / area) / (PI * 1e-4 / (4.0 * LN_2));
        let found = point_source_jy(pairs(&sefd), 1e9, 1.0) * kelvin_per_jy(freq, 0.01, 0.01);
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    }
}

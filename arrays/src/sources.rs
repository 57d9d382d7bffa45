//! Analytic sources of emission: points and elliptical Gaussians.

use crate::{ArrayError, PhaseCenter, Result};
use serde::{Deserialize, Serialize};

/// Position of a source.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum SourcePosition {
    /// Direction cosines from the phase centre.
    DirectionCosines {
        /// Towards the east (sky) or the right (boresight).
        l: f64,
        /// Towards the north or up.
        m: f64,
    },
    /// A place on the sky, in the frame of the phase centre.
    RaDec {
        /// Right ascension, rad.
        ra_rad: f64,
        /// Declination, rad.
        dec_rad: f64,
    },
}

/// Shape of a source.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum SourceShape {
    /// A point.
    Point,
    /// Elliptical Gaussian by its full widths at half maximum.
    Gaussian {
        /// Major axis FWHM, rad.
        major_rad: f64,
        /// Minor axis FWHM, rad.
        minor_rad: f64,
        /// Position angle of the major axis from +m towards +l, rad.
        pa_rad: f64,
    },
}

/// A source with its flux density and spectrum S(f) = flux (f / ref_freq)^spectral_index.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Position.
    pub position: SourcePosition,
    /// Integrated flux density at the reference frequency, Jy.
    pub flux_jy: f64,
    /// Stokes Q, U and V at the reference frequency, Jy, with the spectrum of the flux density. For a place on the sky Q and U refer to the
    /// north there, otherwise to the direction of +m.
    pub polarized_jy: [f64; 3],
    /// Shape.
    pub shape: SourceShape,
    /// Exponent of the spectrum; 0 is flat.
    pub spectral_index: f64,
    /// Reference frequency, Hz; not needed for a flat spectrum.
    pub ref_freq_hz: Option<f64>,
}

impl Source {
    /// A point source at direction cosines (l, m) with a flat spectrum.
    #[must_use]
    pub fn point(l: f64, m: f64, flux_jy: f64) -> Self {
        Self {
            position: SourcePosition::DirectionCosines { l, m },
            flux_jy,
            polarized_jy: [0.0; 3],
            shape: SourceShape::Point,
            spectral_index: 0.0,
            ref_freq_hz: None,
        }
    }

    /// Flux density at a frequency, Jy.
    #[must_use]
    pub fn flux_at(&self, freq_hz: f64) -> f64 {
        self.on_spectrum(self.flux_jy, freq_hz)
    }

    /// Stokes Q, U and V at a frequency, Jy.
    #[must_use]
    pub fn polarized_at(&self, freq_hz: f64) -> [f64; 3] {
        self.polarized_jy.map(|x| self.on_spectrum(x, freq_hz))
    }

    /// True where the source is polarised.
    #[must_use]
    pub fn is_polarized(&self) -> bool {
        self.polarized_jy != [0.0; 3]
    }

    fn on_spectrum(&self, at_reference: f64, freq_hz: f64) -> f64 {
        match self.ref_freq_hz {
            Some(reference) if self.spectral_index != 0.0 => at_reference * (freq_hz / reference).powf(self.spectral_index),
            _ => at_reference,
        }
    }

    /// Direction cosines (l, m) from a phase centre, by the orthographic (SIN) projection.
    ///
    /// # Errors
    /// A place on the sky where the phase centre is not on the sky, or a source behind the horizon of the phase centre.
    ///
    /// # Reference
    /// Thompson, Moran & Swenson 2017, eq. 3.34.
    pub fn direction_cosines(&self, center: &PhaseCenter) -> Result<(f64, f64)> {
        let (l, m, n) = match self.position {
            SourcePosition::DirectionCosines { l, m } => (l, m, 1.0 - l * l - m * m),
            SourcePosition::RaDec { ra_rad, dec_rad } => {
                let (ra0, dec0) = center.ra_dec_rad().ok_or_else(|| {
                    ArrayError::Parse(
                        "a source is given by right ascension and declination, but the array looks along its boresight: give l_rad, m_rad"
                            .into(),
                    )
                })?;
                let (sin_d, cos_d) = dec_rad.sin_cos();
                let (sin_d0, cos_d0) = dec0.sin_cos();
                let (sin_a, cos_a) = (ra_rad - ra0).sin_cos();
                (cos_d * sin_a, sin_d * cos_d0 - cos_d * sin_d0 * cos_a, sin_d * sin_d0 + cos_d * cos_d0 * cos_a)
            }
        };
        ArrayError::unless(
            n > 0.0,
            "direction cosines of a source",
            format_args!("l = {l}, m = {m}"),
            "l^2 + m^2 < 1 (in front of the array)",
        )?;
        Ok((l, m))
    }

    /// Position angle, at the source, of the north of the phase centre carried there along the great circle, rad. It is 0 for sources given
    /// by direction cosines, whose Stokes parameters refer to the direction of +m already.
    #[must_use]
    pub fn carried_north_rad(&self, center: &PhaseCenter) -> f64 {
        let (SourcePosition::RaDec { ra_rad, dec_rad }, Some((ra0, dec0))) = (self.position, center.ra_dec_rad()) else { return 0.0 };
        // Half the convergence of the meridians, by one of Napier's analogies.
        let (sin, cos) = (0.5 * (ra_rad - ra0)).sin_cos();
        2.0 * (sin * (0.5 * (dec_rad + dec0)).sin()).atan2(cos * (0.5 * (dec_rad - dec0)).cos())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_east_of_the_centre_has_positive_l() {
        let center = PhaseCenter::sidereal("c", 1.0, 0.5).unwrap();
        let mut s = Source::point(0.0, 0.0, 1.0);
        s.position = SourcePosition::RaDec { ra_rad: 1.001, dec_rad: 0.501 };
        let (l, m) = s.direction_cosines(&center).unwrap();
        assert!((l - 0.001 * 0.501_f64.cos()).abs() < 1e-8 && (m - 0.001).abs() < 1e-6, "{l} {m}");
        s.position = SourcePosition::RaDec { ra_rad: 1.0 + std::f64::consts::PI, dec_rad: -0.5 };
        assert!(s.direction_cosines(&center).is_err());
    }

    #[test]
    fn the_north_of_the_centre_is_carried_along_the_great_circle() {
        let center = PhaseCenter::sidereal("c", 1.0, 0.5).unwrap();
        let at = |ra_rad: f64, dec_rad: f64| Source { position: SourcePosition::RaDec { ra_rad, dec_rad }, ..Source::point(0.0, 0.0, 1.0) };
        // Position angles of the great circle from the centre to the source, at both ends.
        for (ra, dec) in [(1.3, 0.9_f64), (0.4, -0.2), (1.0, 0.7), (1.2, 0.5)] {
            let (sin_a, cos_a) = f64::sin_cos(ra - 1.0);
            let at_center = (dec.cos() * sin_a).atan2(dec.sin() * 0.5_f64.cos() - dec.cos() * 0.5_f64.sin() * cos_a);
            let at_source = (0.5_f64.cos() * sin_a).atan2(0.5_f64.cos() * dec.sin() * cos_a - 0.5_f64.sin() * dec.cos());
            assert!((at(ra, dec).carried_north_rad(&center) - (at_source - at_center)).abs() < 1e-12, "{ra} {dec}");
        }
        assert_eq!(Source::point(0.1, 0.2, 1.0).carried_north_rad(&center), 0.0);
    }

    #[test]
    fn the_spectrum_is_a_power_law() {
        let s = Source { spectral_index: -0.7, ref_freq_hz: Some(1e9), ..Source::point(0.0, 0.0, 2.0) };
        assert!((s.flux_at(2e9) - 2.0 * 2f64.powf(-0.7)).abs() < 1e-12);
    }
}

//! Foam on the sea.
//!
//! Whitecaps and streaks hold so much air that they hardly reflect millimetre waves, and scatter what they do. A strong wind warms the sea by their
//! cover more than by its waves.

use super::error::{SurfaceError, bounded};

/// Emissivity of foam at the nadir, and in `v` at every angle.
const NADIR: f64 = 0.93;
/// Polynomial of the emissivity in `h` over that at the nadir, against the angle in degrees.
const ACROSS: [f64; 4] = [1.0, -1.748e-3, -7.336e-5, 1.044e-7];

/// Patches of foam among the facets of a sea.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foam {
    /// The fraction of the surface that is foam.
    pub cover: f64,
}

impl Foam {
    /// Checked cover.
    ///
    /// # Errors
    /// [`SurfaceError::Value`] unless it lies between 0 and 1.
    pub fn new(cover: f64) -> Result<Self, SurfaceError> {
        Ok(Self { cover: bounded("cover of foam", cover, 0.0, 1.0)? })
    }

    /// Foam of a wind-driven sea that is as warm as the air, from the speed of the wind in m/s at 10 m.
    ///
    /// # Errors
    /// [`SurfaceError::Value`] for winds outside 0 to 60 m/s.
    ///
    /// # Reference
    /// Monahan & O'Muircheartaigh 1986, Int. J. Remote Sens. 7, 627: `1.95e-5 U^2.55`.
    pub fn monahan86(wind_m_s: f64) -> Result<Self, SurfaceError> {
        Self::new(1.95e-5 * bounded("wind speed in m/s", wind_m_s, 0.0, 60.0)?.powf(2.55))
    }

    /// Reflectivity `[h, v]` of foam that covers everything, at an angle in radians. It does not depend on the frequency.
    ///
    /// # Reference
    /// Kazumori et al. 2008, Mon. Weather Rev. 136, 541: 0.93 at the nadir and in `v`, from AMSR-E (6.9-89 GHz); in `h` with the angles of
    /// Stogryn 1972, J. Geophys. Res. 77, 1658, which are fitted to 70 degrees.
    #[must_use]
    pub fn reflectivity(theta_rad: f64) -> [f64; 2] {
        let degrees = theta_rad.to_degrees();
        let across = ACROSS.iter().rev().fold(0.0, |sum, c| sum * degrees + c);
        [1.0 - NADIR * across, 1.0 - NADIR]
    }

    /// What foam reflects, `[h, v]`. All of it is diffuse.
    #[must_use]
    pub fn albedo(&self, theta_rad: f64) -> [f64; 2] {
        Self::reflectivity(theta_rad).map(|r| self.cover * r)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The power law of the cover at four winds, and the polynomial of the emissivity at four angles, both worked out by hand.
    #[test]
    fn cover_and_emissivity_are_those_of_the_references() {
        for (wind, cover) in [(5.0, 1.182e-3), (10.0, 6.919e-3), (20.0, 4.052e-2)] {
            assert!((Foam::monahan86(wind).unwrap().cover - cover).abs() < 5e-4 * cover, "{wind}");
        }
        assert_eq!(Foam::monahan86(0.0).unwrap().cover, 0.0);
        let at = |degrees: f64| Foam::reflectivity(degrees.to_radians()).map(|r| 1.0 - r);
        for (degrees, h) in [(0.0, 0.93), (30.0, 0.822_45), (53.0, 0.666_66), (70.0, 0.515_20)] {
            let [eh, ev] = at(degrees);
            assert!((eh - h).abs() < 5e-5 && (ev - 0.93).abs() < 1e-15, "{degrees}: {eh}");
        }
        // Beyond the fit both stay emissivities.
        assert!((0..900).map(|k| at(0.1 * f64::from(k))[0]).all(|e| e > 0.2 && e <= 0.93));
    }

    #[test]
    fn impossible_foam_is_refused() {
        assert!(
            Foam::new(1.1).is_err() && Foam::new(-0.1).is_err() && Foam::monahan86(61.0).is_err() && Foam::monahan86(f64::NAN).is_err()
        );
        assert!(Foam::monahan86(60.0).is_ok());
    }
}

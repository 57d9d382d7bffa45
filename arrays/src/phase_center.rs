//! Phase centres: a point of the sky, or a direction fixed to the array.

use crate::{ArrayError, Result};
use serde::{Deserialize, Serialize};

/// Kind of a phase centre, with its direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum PhaseCenterKind {
    /// A fixed point of the sky; uvw follow the Earth's rotation.
    Sidereal {
        /// Right ascension, rad.
        ra_rad: f64,
        /// Declination, rad.
        dec_rad: f64,
    },
    /// Not phased to the sky: uvw are baselines in the array's own frame, w along its zenith or boresight.
    Unprojected,
    /// A direction fixed to the Earth, away from the zenith (UVH5 `driftscan`).
    Driftscan {
        /// Azimuth east of north, rad.
        az_rad: f64,
        /// Elevation, rad.
        el_rad: f64,
    },
}

/// A phase centre with the name and number by which rows refer to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PhaseCenter {
    /// Catalogue number in the file (UVH5 `phase_center_id_array`).
    pub id: i64,
    /// Name of the field or source.
    pub name: String,
    /// Direction.
    pub kind: PhaseCenterKind,
    /// Celestial frame name, such as `icrs` or `fk5`; empty where it does not apply.
    pub frame: String,
    /// Epoch of the frame in years, such as 2000.0.
    pub epoch: Option<f64>,
}

impl PhaseCenter {
    /// A sidereal phase centre in ICRS.
    ///
    /// # Errors
    /// A non-finite right ascension, or or a declination beyond the poles.
    pub fn sidereal(name: &str, ra_rad: f64, dec_rad: f64) -> Result<Self> {
        ArrayError::unless(ra_rad.is_finite(), "right ascension", ra_rad, "a finite angle")?;
        ArrayError::unless(
            dec_rad.abs() <= std::f64::consts::FRAC_PI_2 + 1e-12,
            "declination",
            format_args!("{} deg", dec_rad.to_degrees()),
            "an angle between -90 and 90 deg",
        )?;
        let ra_rad = ra_rad.rem_euclid(std::f64::consts::TAU);
        Ok(Self {
            id: 0,
            name: name.into(),
            kind: PhaseCenterKind::Sidereal { ra_rad, dec_rad },
            frame: "icrs".into(),
            epoch: Some(2000.0),
        })
    }

    /// The boresight (or zenith) of an array whose uvw are its own x, y, z baselines.
    #[must_use]
    pub fn unprojected(name: &str) -> Self {
        Self { id: 0, name: name.into(), kind: PhaseCenterKind::Unprojected, frame: String::new(), epoch: None }
    }

    /// Right ascension and declination in rad, where the centre is sidereal.
    #[must_use]
    pub fn ra_dec_rad(&self) -> Option<(f64, f64)> {
        match self.kind {
            PhaseCenterKind::Sidereal { ra_rad, dec_rad } => Some((ra_rad, dec_rad)),
            _ => None,
        }
    }
}

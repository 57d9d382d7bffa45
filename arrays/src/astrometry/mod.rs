//! Sidereal time, and the apparent place of a catalogue direction, at a moment in UTC.
//!
//! The models are those of the IAU (precession 2006, nutation 2000A, Earth position by VSOP2000) as implemented in SOFA, with UT1 and
//! polar motion from the IERS series in [`eop`]. Refraction is not included. Apparent right ascension is counted from the equinox: the
//! hour angle is the local apparent sidereal time minus the apparent right ascension.
//!
//! # Reference
//! Capitaine, Wallace & Chapront 2003, A&A 412, 567 (precession); Mathews, Herring & Buffett 2002, JGR 107, B4 (nutation);
//! IERS Conventions 2010, chapter 5.

mod earth;
pub mod eop;
mod text;
mod utc;

pub use text::parse_direction;
pub use utc::{format_utc, parse_utc};

use crate::{ArrayError, Result, Site};
use sofars::astro::{IauAstrom, apco, atciqz, aticq, atioq, atoiq};
use sofars::erst::era00;
use sofars::pnp::sp00;
use sofars::ts::{taitt, utctai, utcut1};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Half the arc over which the position angle of a catalogue frame is measured, rad.
///
/// The reference implementation of the UVH5 memo uses this finite arc. The angle near a pole depends on it.
const FRAME_PA_OFFSET_RAD: f64 = PI / 360.0;

/// Rotation of ICRS into FK5 J2000: small angles about x, y and z, arcseconds.
///
/// # Reference
/// IERS Conventions 2003, chapter 5 (eta0, xi0, dalpha0).
const FK5_BIAS_ARCSEC: [f64; 3] = [-0.0199, 0.0091, -0.0229];

/// Apparent place of a catalogue direction at one time and site.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ApparentPlace {
    /// Apparent right ascension from the equinox of date, rad in 0 to 2 pi.
    pub ra_rad: f64,
    /// Apparent declination, rad.
    pub dec_rad: f64,
    /// Position angle of the north of the catalogue frame in the apparent frame, rad.
    pub frame_pa_rad: f64,
}

/// Local apparent sidereal time, rad in 0 to 2 pi, at a Julian date in UTC.
///
/// # Errors
/// A date that is not finite or not between 1901 and 2099.
pub fn lst_rad(time_jd_utc: f64, site: &Site) -> Result<f64> {
    Ok(LocalSky::at(time_jd_utc, site)?.lst_rad())
}

/// Apparent place of a catalogue direction; `frame` is `icrs` or `fk5` (J2000), in upper or lower case.
///
/// # Errors
/// A date that is not between 1901 and 2099; another frame; a direction that is not finite.
pub fn apparent_place(ra_rad: f64, dec_rad: f64, frame: &str, time_jd_utc: f64, site: &Site) -> Result<ApparentPlace> {
    LocalSky::at(time_jd_utc, site)?.apparent_place(ra_rad, dec_rad, frame)
}

/// Everything that is the same for all directions at one time and site. Make it once for all rows of an integration.
#[derive(Debug, Clone)]
pub struct LocalSky {
    astrom: IauAstrom,
    equation_of_origins_rad: f64,
    lst_rad: f64,
}

impl LocalSky {
    /// The sky of a site at a Julian date in UTC.
    ///
    /// # Errors
    /// A date that is not finite or not between 1901 and 2099; a site that is not finite.
    pub fn at(time_jd_utc: f64, site: &Site) -> Result<Self> {
        let bad = || {
            ArrayError::bad_value(
                "time",
                format_args!("JD {time_jd_utc}"),
                "a Julian date in UTC between 2415385.5 (1901) and 2487704.5 (2099)",
            )
        };
        if !(2_415_385.5..=2_487_704.5).contains(&time_jd_utc) {
            return Err(bad());
        }
        let orientation = eop::at(time_jd_utc);
        let (tai1, tai2) = utctai(time_jd_utc, 0.0).map_err(|_| bad())?;
        let (tt1, tt2) = taitt(tai1, tai2).map_err(|_| bad())?;
        let (ut1, ut2) = utcut1(time_jd_utc, 0.0, orientation.ut1_utc_s).map_err(|_| bad())?;
        let earth = earth::at(tt1, tt2).ok_or_else(bad)?;
        let rotation_rad = era00(ut1, ut2);
        let [x, y, s] = earth.pole;
        let mut astrom = IauAstrom::default();
        apco(
            tt1,
            tt2,
            &earth.barycentric,
            &earth.heliocentric_au,
            x,
            y,
            s,
            rotation_rad,
            site.longitude_rad,
            site.latitude_rad,
            site.altitude_m,
            orientation.pole_x_rad,
            orientation.pole_y_rad,
            sp00(tt1, tt2),
            0.0,
            0.0,
            &mut astrom,
        );
        let lst_rad = (rotation_rad - earth.equation_of_origins_rad + site.longitude_rad).rem_euclid(TAU);
        if !(lst_rad + site.latitude_rad + site.altitude_m).is_finite() {
            return Err(ArrayError::bad_value("site", format_args!("{site:?}"), "finite coordinates"));
        }
        Ok(Self { astrom, equation_of_origins_rad: earth.equation_of_origins_rad, lst_rad })
    }

    /// Local apparent sidereal time, rad in 0 to 2 pi.
    #[must_use]
    pub fn lst_rad(&self) -> f64 {
        self.lst_rad
    }

    /// Apparent place of a catalogue direction; `frame` is `icrs` or `fk5` (J2000).
    ///
    /// # Errors
    /// Another frame; a direction that is not finite.
    pub fn apparent_place(&self, ra_rad: f64, dec_rad: f64, frame: &str) -> Result<ApparentPlace> {
        ArrayError::unless(
            ra_rad.is_finite() && dec_rad.is_finite(),
            "direction",
            format_args!("{ra_rad}, {dec_rad} rad"),
            "a finite right ascension and declination",
        )?;
        let fk5 = is_fk5(frame)?;
        let (icrs_ra, icrs_dec) = if fk5 { turn(ra_rad, dec_rad, &transposed(fk5_from_icrs())) } else { (ra_rad, dec_rad) };
        let (cirs_ra, cirs_dec) = atciqz(icrs_ra, icrs_dec, &mut self.astrom.clone());
        let (_, _, _, dec, ra) = atioq(cirs_ra, cirs_dec, &self.astrom);
        let ra = (ra - self.equation_of_origins_rad).rem_euclid(TAU);

        let (south_ra, south_dec) = self.catalogue(ra, dec - FRAME_PA_OFFSET_RAD, fk5);
        let (north_ra, north_dec) = self.catalogue(ra, dec + FRAME_PA_OFFSET_RAD, fk5);
        let frame_pa_rad = -position_angle(south_ra, south_dec, north_ra, north_dec);
        Ok(ApparentPlace { ra_rad: ra, dec_rad: dec, frame_pa_rad })
    }

    /// Elevation of an apparent direction above the horizon, rad, without refraction.
    #[must_use]
    pub fn elevation_rad(&self, place: &ApparentPlace, site: &Site) -> f64 {
        let hour_angle = self.lst_rad - place.ra_rad;
        let (sin_lat, cos_lat) = site.latitude_rad.sin_cos();
        let (sin_dec, cos_dec) = place.dec_rad.sin_cos();
        (sin_lat * sin_dec + cos_lat * cos_dec * hour_angle.cos()).clamp(-1.0, 1.0).asin()
    }

    /// Catalogue coordinates of an apparent place. The declination may lie beyond a pole.
    fn catalogue(&self, ra: f64, dec: f64, fk5: bool) -> (f64, f64) {
        let (ra, dec) = if dec > FRAC_PI_2 {
            (ra + PI, PI - dec)
        } else if dec < -FRAC_PI_2 {
            (ra + PI, -PI - dec)
        } else {
            (ra, dec)
        };
        let (cirs_ra, cirs_dec) = atoiq("R", ra + self.equation_of_origins_rad, dec, &self.astrom);
        let (ra, dec) = aticq(cirs_ra, cirs_dec, &mut self.astrom.clone());
        if fk5 { turn(ra, dec, &fk5_from_icrs()) } else { (ra, dec) }
    }
}

fn is_fk5(frame: &str) -> Result<bool> {
    match frame.to_ascii_lowercase().as_str() {
        "icrs" => Ok(false),
        "fk5" => Ok(true),
        _ => Err(ArrayError::bad_value("celestial frame", frame, "icrs or fk5 (J2000)")),
    }
}

type Matrix = [[f64; 3]; 3];

/// Rotation of the axes about z, then y, then x.
fn fk5_from_icrs() -> Matrix {
    let [eta, xi, da] = FK5_BIAS_ARCSEC.map(|a| a / 3600.0 * PI / 180.0);
    // astropy's and SOFA's signs: R1(-eta0) R2(xi0) R3(dalpha0).
    let mut r = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    sofars::vm::rz(da, &mut r);
    sofars::vm::ry(xi, &mut r);
    sofars::vm::rx(-eta, &mut r);
    r
}

fn transposed(m: Matrix) -> Matrix {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| m[j][i]))
}

/// Spherical coordinates after a rotation.
fn turn(ra: f64, dec: f64, m: &Matrix) -> (f64, f64) {
    let v = [dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()];
    let [x, y, z] = m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]);
    (y.atan2(x).rem_euclid(TAU), z.atan2(x.hypot(y)))
}

/// Position angle of B seen from A, from north through east, rad.
fn position_angle(ra_a: f64, dec_a: f64, ra_b: f64, dec_b: f64) -> f64 {
    let dl = ra_b - ra_a;
    let y = dl.sin() * dec_b.cos();
    let x = dec_b.sin() * dec_a.cos() - dec_b.cos() * dec_a.sin() * dl.cos();
    if x == 0.0 && y == 0.0 { 0.0 } else { y.atan2(x) }
}

#[cfg(test)]
mod tests;

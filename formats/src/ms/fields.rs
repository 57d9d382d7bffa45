//! Phase centres as rows of FIELD: sidereal ones as they are, others as the point of the sky that they see.

use super::codes::frame_code;
use crate::{FormatError, Result};
use cittert_arrays::astrometry::LocalSky;
use cittert_arrays::{PhaseCenter, PhaseCenterKind, Site, VisibilityHeader};
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::{Path, PathBuf};

/// A row of FIELD.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) ra_rad: f64,
    pub(super) dec_rad: f64,
    /// casacore's name of the frame.
    pub(super) frame: &'static str,
    pub(super) source_id: i32,
}

/// How the rows of a phase centre at one time are turned towards their field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pointing {
    /// Row of FIELD.
    pub(super) field: i32,
    /// Position angle by which u and v are turned, rad.
    pub(super) turn_rad: f64,
    /// True where the visibilities still hold the phase of w at the phase centre.
    pub(super) stop_w: bool,
}

/// The fields of an output; those of arrays that do not follow the sky come into being with the times.
#[derive(Debug)]
pub(super) struct Fields {
    path: PathBuf,
    centers: Vec<PhaseCenter>,
    /// `None` in the boresight frame.
    site: Option<Site>,
    rows: Vec<Field>,
    known: HashMap<(u16, u64), Pointing>,
    last: Option<((u16, u64), Pointing)>,
    ids_from_header: bool,
}

/// Rows of the main table index FIELD; more fields than this make no sense and would fill the memory.
const MAX_FIELDS: usize = 65_536;

impl Fields {
    /// The phase centres of a set, and what must be said about them.
    ///
    /// # Errors
    /// A celestial frame that Measurement Sets do not know.
    pub(super) fn new(path: &Path, header: &VisibilityHeader, notes: &mut Vec<String>) -> Result<Self> {
        let centers = header.phase_centers.clone();
        let mut moving = false;
        for center in &centers {
            match center.kind {
                PhaseCenterKind::Sidereal { .. } => {
                    frame(path, center)?;
                }
                _ => moving = true,
            }
        }
        let site = header.layout.site();
        if moving {
            notes.push(match site {
                None => "the boresight is written as the zenith of an array at latitude 0, longitude 0: l grows to the east there, so \
                         other programs show the scene mirrored left to right against the view along the boresight"
                    .into(),
                Some(_) => "this set does not follow the sky: each time gets its own field, phased to where the array looks then".into(),
            });
        }
        let mut ids: Vec<i64> = centers.iter().map(|c| c.id).collect();
        ids.sort_unstable();
        ids.dedup();
        let ids_from_header = !moving && ids.len() == centers.len() && ids.iter().all(|i| (0..=i64::from(i32::MAX)).contains(i));
        let mut fields = Self { path: path.into(), centers, site, rows: Vec::new(), known: HashMap::new(), last: None, ids_from_header };
        if !moving {
            // Also the phase centres that no row uses keep their place.
            for k in 0..fields.centers.len() {
                let pointing = fields.make(k as u16, 0.0)?;
                fields.known.insert((k as u16, 0), pointing);
            }
        }
        Ok(fields)
    }

    /// All rows of FIELD so far.
    pub(super) fn rows(&self) -> &[Field] {
        &self.rows
    }

    /// The field of a phase centre at a time.
    ///
    /// # Errors
    /// A time without sidereal time, or too many fields.
    pub(super) fn at(&mut self, center: u16, time_jd: f64) -> Result<Pointing> {
        let follows = self.site.is_some() && !matches!(self.centers[usize::from(center)].kind, PhaseCenterKind::Sidereal { .. });
        let key = (center, if follows { time_jd.to_bits() } else { 0 });
        if let Some((_, pointing)) = self.last.filter(|l| l.0 == key) {
            return Ok(pointing);
        }
        let pointing = match self.known.get(&key) {
            Some(p) => *p,
            None => self.make(center, time_jd)?,
        };
        self.known.insert(key, pointing);
        self.last = Some((key, pointing));
        Ok(pointing)
    }

    fn make(&mut self, index: u16, time_jd: f64) -> Result<Pointing> {
        if self.rows.len() >= MAX_FIELDS {
            let what = format!("a set that does not follow the sky and has more than {MAX_FIELDS} times would need as many fields");
            return Err(FormatError::unsupported(&self.path, what));
        }
        let center = &self.centers[usize::from(index)];
        let field = self.rows.len() as i32;
        let name = if center.name.is_empty() { format!("field{field}") } else { center.name.clone() };
        let source_id = if self.ids_from_header { center.id as i32 } else { field };
        let still = Pointing { field, turn_rad: 0.0, stop_w: false };
        let (row, pointing) = match (center.kind, self.site) {
            (PhaseCenterKind::Sidereal { ra_rad, dec_rad }, _) => {
                (Field { name, ra_rad, dec_rad, frame: frame(&self.path, center)?, source_id }, still)
            }
            (kind, site) => {
                let at = site.unwrap_or(crate::uvh5::NOMINAL_SITE);
                let sky = LocalSky::at(time_jd, &at).map_err(|e| FormatError::values(&self.path, e))?;
                let (ra, dec) = apparent_direction(kind, at.latitude_rad, sky.lst_rad());
                if site.is_none() {
                    // A made-up sky: no reason to turn it.
                    (Field { name, ra_rad: ra, dec_rad: dec, frame: "ICRS", source_id }, still)
                } else {
                    let (ra_rad, dec_rad, turn_rad) = catalogue(&sky, ra, dec).map_err(|e| FormatError::values(&self.path, e))?;
                    (Field { name, ra_rad, dec_rad, frame: "ICRS", source_id }, Pointing { field, turn_rad, stop_w: true })
                }
            }
        };
        self.rows.push(row);
        Ok(pointing)
    }
}

fn frame(path: &Path, center: &PhaseCenter) -> Result<&'static str> {
    frame_code(&center.frame, center.epoch).ok_or_else(|| {
        let what = format!("phase centre {:?} is in the frame {:?}, which no Measurement Set knows", center.name, center.frame);
        FormatError::unsupported(path, what)
    })
}

/// Apparent right ascension and declination of a direction fixed to the Earth.
fn apparent_direction(kind: PhaseCenterKind, latitude_rad: f64, lst_rad: f64) -> (f64, f64) {
    let (az, el) = match kind {
        PhaseCenterKind::Driftscan { az_rad, el_rad } => (az_rad, el_rad),
        _ => (0.0, FRAC_PI_2),
    };
    let (sin_lat, cos_lat) = latitude_rad.sin_cos();
    let (north, east, up) = (el.cos() * az.cos(), el.cos() * az.sin(), el.sin());
    // Axes towards the meridian, the west and the pole.
    let (x, y, z) = (up * cos_lat - north * sin_lat, -east, up * sin_lat + north * cos_lat);
    ((lst_rad - y.atan2(x)).rem_euclid(TAU), z.atan2(x.hypot(y)))
}

fn unit(ra: f64, dec: f64) -> [f64; 3] {
    [dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()]
}

/// ICRS direction whose apparent place is the given one, and the position angle of its frame: what the sky moves the direction by
/// is taken off it, again and again; each round leaves less than a hundredth of the error.
fn catalogue(sky: &LocalSky, ra: f64, dec: f64) -> Result<(f64, f64, f64), cittert_arrays::ArrayError> {
    let want = unit(ra, dec);
    let mut v = want;
    let mut turn = 0.0;
    for _ in 0..12 {
        let (r, d) = (v[1].atan2(v[0]).rem_euclid(TAU), v[2].atan2(v[0].hypot(v[1])));
        let place = sky.apparent_place(r, d, "icrs")?;
        let got = unit(place.ra_rad, place.dec_rad);
        turn = place.frame_pa_rad;
        v = [0, 1, 2].map(|k| v[k] + want[k] - got[k]);
    }
    Ok((v[1].atan2(v[0]).rem_euclid(TAU), v[2].atan2(v[0].hypot(v[1])), turn))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_direction_is_found_whose_apparent_place_is_the_zenith() {
        for lat in [-1.2_f64, -0.536, 0.0, 0.6, 1.5] {
            let site = Site { latitude_rad: lat, longitude_rad: 0.37, altitude_m: 1000.0 };
            let sky = LocalSky::at(2_458_432.843, &site).unwrap();
            let (ra, dec) = apparent_direction(PhaseCenterKind::Unprojected, lat, sky.lst_rad());
            let offset = (ra - sky.lst_rad() + 3.0).rem_euclid(TAU) - 3.0;
            assert!(offset.abs() < 1e-12 && (dec - lat).abs() < 1e-12);
            let (r, d, _) = catalogue(&sky, ra, dec).unwrap();
            let place = sky.apparent_place(r, d, "icrs").unwrap();
            let (a, b) = (unit(place.ra_rad, place.dec_rad), unit(ra, dec));
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-12), "{lat}");
        }
    }

    #[test]
    fn a_direction_in_the_east_has_yet_to_culminate() {
        let kind = PhaseCenterKind::Driftscan { az_rad: FRAC_PI_2, el_rad: 0.3 };
        let (ra, dec) = apparent_direction(kind, 0.0, 1.0);
        // On the equator the east point is 6 h before the meridian: right ascension is larger than the sidereal time.
        assert!((ra - (1.0 + FRAC_PI_2 - 0.3)).abs() < 1e-12 && dec.abs() < 1e-12);
    }
}

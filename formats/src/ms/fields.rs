//! Phase centres as rows of FIELD: sidereal ones unchanged, others as the point of the sky in their direction.

use super::codes::frame_code;
use crate::drift::{apparent_direction, catalogue};
use crate::{FormatError, Result};
use cittert_arrays::astrometry::LocalSky;
use cittert_arrays::{PhaseCenter, PhaseCenterKind, Site, VisibilityHeader};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A row of FIELD.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) ra_rad: f64,
    pub(super) dec_rad: f64,
    /// Name of the frame in casacore.
    pub(super) frame: &'static str,
    pub(super) source_id: i32,
}

/// The field of a phase centre at one time, and the rotation of its rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pointing {
    /// Row of FIELD.
    pub(super) field: i32,
    /// Position angle by which u and v are rotated, rad.
    pub(super) turn_rad: f64,
    /// True where the visibilities still contain the phase of w at the phase centre.
    pub(super) stop_w: bool,
}

/// The fields of an output. For arrays that do not track the sky, each time adds a field.
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

/// Largest number of fields. More would use too much memory.
const MAX_FIELDS: usize = 65_536;

impl Fields {
    /// The phase centres of a set, and notes about changes to them.
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
            // Phase centres that no row uses keep their row too.
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
    /// A time outside the years 1901 to 2099, or too many fields.
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
                    // The site is nominal, so there is no position angle to correct.
                    (Field { name, ra_rad: ra, dec_rad: dec, frame: "ICRS", source_id }, still)
                } else {
                    let (ra_rad, dec_rad, turn_rad) = catalogue(&sky, ra, dec).map_err(|e| FormatError::values(&self.path, e))?;
                    // For a driftscan the phase of w towards its direction is already removed.
                    let stop_w = kind == PhaseCenterKind::Unprojected;
                    (Field { name, ra_rad, dec_rad, frame: "ICRS", source_id }, Pointing { field, turn_rad, stop_w })
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

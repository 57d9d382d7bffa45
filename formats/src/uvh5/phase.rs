//! Phase centres: the catalogue in the file, and the apparent place for each row.

use crate::h5::{H5In, H5Out};
use crate::{FormatError, Result};
use cittert_arrays::astrometry::{ApparentPlace, LocalSky};
use cittert_arrays::{ArrayError, PhaseCenter, PhaseCenterKind, Site};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Catalogue numbers of the phase centres. Where two have the same number, the index is used instead.
pub(super) fn ids(centers: &[PhaseCenter]) -> Vec<i64> {
    let own: Vec<i64> = centers.iter().map(|c| c.id).collect();
    let unique: std::collections::HashSet<_> = own.iter().collect();
    if unique.len() == own.len() { own } else { (0..centers.len() as i64).collect() }
}

/// Write `Header/phase_center_catalog`.
pub(super) fn write_catalog(out: &H5Out, centers: &[PhaseCenter]) -> Result<()> {
    out.scalar("Header/Nphase", centers.len() as i64)?;
    for (center, id) in centers.iter().zip(ids(centers)) {
        let key = |name: &str| format!("Header/phase_center_catalog/{id}/{name}");
        let (cat_type, lon, lat, frame) = match center.kind {
            PhaseCenterKind::Sidereal { ra_rad, dec_rad } => ("sidereal", ra_rad, dec_rad, center.frame.as_str()),
            PhaseCenterKind::Unprojected => ("unprojected", 0.0, FRAC_PI_2, "altaz"),
            PhaseCenterKind::Driftscan { az_rad, el_rad } => ("driftscan", az_rad, el_rad, "altaz"),
        };
        out.text(&key("cat_name"), &center.name)?;
        out.text(&key("cat_type"), cat_type)?;
        out.scalar(&key("cat_lon"), lon)?;
        out.scalar(&key("cat_lat"), lat)?;
        out.text(&key("cat_frame"), frame)?;
        match center.epoch.filter(|_| cat_type == "sidereal") {
            Some(epoch) => out.scalar(&key("cat_epoch"), epoch)?,
            None => out.none(&key("cat_epoch"))?,
        }
        out.text(&key("info_source"), "user")?;
        for name in ["cat_times", "cat_pm_ra", "cat_pm_dec", "cat_dist", "cat_vrad"] {
            out.none(&key(name))?;
        }
    }
    Ok(())
}

/// Read the phase centres of any version of the format.
pub(super) fn read_catalog(file: &H5In) -> Result<Vec<PhaseCenter>> {
    let group = "Header/phase_center_catalog";
    let mut centers = Vec::new();
    for name in file.members(group)? {
        let entry = format!("{group}/{name}");
        let center = match file.dataset(&format!("{entry}/cat_type")) {
            Ok(Some(_)) => from_group(file, &entry, &name)?,
            _ => from_json(file, &entry, &name)?,
        };
        centers.push(center);
    }
    if centers.is_empty() {
        centers.push(from_phase_type(file)?);
    }
    centers.sort_by_key(|c| c.id);
    Ok(centers)
}

fn from_group(file: &H5In, entry: &str, name: &str) -> Result<PhaseCenter> {
    let id = name.parse().map_err(|_| file.wrong(entry, "a whole number as name of the entry", name))?;
    let text = |key: &str| file.text(&format!("{entry}/{key}"));
    let lon_lat = |key: &str| file.require_real(&format!("{entry}/{key}"));
    let cat_type = text("cat_type")?.unwrap_or_default();
    let center = PhaseCenter {
        id,
        name: text("cat_name")?.unwrap_or_else(|| "unknown".into()),
        kind: kind(file, entry, &cat_type, || lon_lat("cat_lon"), || lon_lat("cat_lat"))?,
        frame: text("cat_frame")?.unwrap_or_default(),
        epoch: file.real(&format!("{entry}/cat_epoch"))?,
    };
    Ok(center)
}

/// Versions before 1.1 have one JSON text for each source, under the name of the source.
fn from_json(file: &H5In, entry: &str, name: &str) -> Result<PhaseCenter> {
    let json = file.text(entry)?.ok_or_else(|| file.wrong(entry, "a group or a text in JSON", "neither"))?;
    let value: serde_json::Value = serde_json::from_str(&json).map_err(|e| file.wrong(entry, "JSON", e.to_string()))?;
    // Moving sources have lists of positions. The first position is used.
    let number = |key: &str| value.get(key).and_then(|v| v.as_f64().or_else(|| v.get(0).and_then(serde_json::Value::as_f64)));
    let required = |key: &str| number(key).ok_or_else(|| file.wrong(entry, format!("a number {key}"), "none"));
    let text = |key: &str| value.get(key).and_then(|v| v.as_str()).unwrap_or_default().to_string();
    Ok(PhaseCenter {
        id: required("cat_id")? as i64,
        name: name.into(),
        kind: kind(file, entry, &text("cat_type"), || required("cat_lon"), || required("cat_lat"))?,
        frame: text("cat_frame"),
        epoch: number("cat_epoch"),
    })
}

fn kind(file: &H5In, entry: &str, cat_type: &str, lon: impl Fn() -> Result<f64>, lat: impl Fn() -> Result<f64>) -> Result<PhaseCenterKind> {
    Ok(match cat_type {
        "unprojected" => PhaseCenterKind::Unprojected,
        "driftscan" => PhaseCenterKind::Driftscan { az_rad: lon()?, el_rad: lat()? },
        "sidereal" | "ephem" | "near_field" => PhaseCenterKind::Sidereal { ra_rad: lon()?, dec_rad: lat()? },
        other => {
            return Err(file.wrong(
                &format!("{entry}/cat_type"),
                "sidereal, unprojected, driftscan, ephem or near_field",
                format!("{other:?}"),
            ));
        }
    })
}

/// Versions before 1.0 have one phase centre: `phased` or `drift`.
fn from_phase_type(file: &H5In) -> Result<PhaseCenter> {
    let phase_type = file.text("Header/phase_type")?.ok_or_else(|| file.missing("Header/phase_center_catalog"))?;
    let name = file.text("Header/object_name")?;
    if phase_type != "phased" {
        return Ok(PhaseCenter::unprojected(name.as_deref().unwrap_or("zenith")));
    }
    let (ra, dec) = (file.require_real("Header/phase_center_ra")?, file.require_real("Header/phase_center_dec")?);
    let center = PhaseCenter::sidereal(name.as_deref().unwrap_or("unknown"), ra, dec).map_err(|e| FormatError::values(file.path(), e))?;
    let frame = file.text("Header/phase_center_frame")?.unwrap_or_else(|| "icrs".into());
    Ok(PhaseCenter { frame, epoch: file.real("Header/phase_center_epoch")?, ..center })
}

/// The sky over the array at the time of a row. It is kept as long as the time does not change.
#[derive(Debug)]
pub(crate) struct Sky {
    site: Site,
    time_jd: f64,
    sky: Option<LocalSky>,
    places: Vec<Option<ApparentPlace>>,
}

impl Sky {
    /// The sky over a site.
    pub(crate) fn over(site: Site) -> Self {
        Self { site, time_jd: f64::NAN, sky: None, places: Vec::new() }
    }

    /// Sidereal time at `time_jd`, and the apparent place of phase centre `index`.
    pub(crate) fn at(&mut self, time_jd: f64, centers: &[PhaseCenter], index: usize) -> Result<(f64, ApparentPlace), ArrayError> {
        if time_jd != self.time_jd || self.sky.is_none() {
            self.sky = Some(LocalSky::at(time_jd, &self.site)?);
            self.time_jd = time_jd;
            self.places = vec![None; centers.len()];
        }
        let Some(sky) = &self.sky else { return Err(ArrayError::Parse("no sky".into())) };
        let lst = sky.lst_rad();
        if let Some(place) = self.places.get(index).copied().flatten() {
            return Ok((lst, place));
        }
        let center = centers.get(index).ok_or(ArrayError::OutOfRange { what: "phase centre", index, len: centers.len() })?;
        let (sin_lat, cos_lat) = self.site.latitude_rad.sin_cos();
        let place = match center.kind {
            PhaseCenterKind::Sidereal { ra_rad, dec_rad } if center.frame.eq_ignore_ascii_case("fk4") => {
                let (ra, dec) = fk5_of_fk4(ra_rad, dec_rad);
                sky.apparent_place(ra, dec, "fk5")?
            }
            PhaseCenterKind::Sidereal { ra_rad, dec_rad } => sky.apparent_place(ra_rad, dec_rad, &center.frame)?,
            PhaseCenterKind::Unprojected => ApparentPlace { ra_rad: lst, dec_rad: self.site.latitude_rad, frame_pa_rad: 0.0 },
            PhaseCenterKind::Driftscan { az_rad, el_rad } => {
                let (sin_el, cos_el) = el_rad.sin_cos();
                let (sin_az, cos_az) = az_rad.sin_cos();
                let hour_angle = (-cos_el * sin_az).atan2(sin_el * cos_lat - cos_el * sin_lat * cos_az);
                let dec_rad = (sin_el * sin_lat + cos_el * cos_lat * cos_az).asin();
                ApparentPlace { ra_rad: (lst - hour_angle).rem_euclid(TAU), dec_rad, frame_pa_rad: 0.0 }
            }
        };
        if let Some(slot) = self.places.get_mut(index) {
            *slot = Some(place);
        }
        Ok((lst, place))
    }
}

/// Convert a B1950 (FK4) direction without proper motion to J2000 (FK5), to about 0.1 arcsec.
///
/// # Reference
/// Aoki et al. 1983, A&A 128, 263 (rotation and E-terms of aberration).
fn fk5_of_fk4(ra: f64, dec: f64) -> (f64, f64) {
    const E_TERMS: [f64; 3] = [-1.625_57e-6, -0.319_19e-6, -0.138_43e-6];
    const ROTATION: [[f64; 3]; 3] = [
        [0.999_925_678_2, -0.011_182_061_1, -0.004_857_947_7],
        [0.011_182_061_0, 0.999_937_478_4, -0.000_027_176_5],
        [0.004_857_947_9, -0.000_027_147_4, 0.999_988_199_7],
    ];
    let s = [dec.cos() * ra.cos(), dec.cos() * ra.sin(), dec.sin()];
    let along: f64 = s.iter().zip(E_TERMS).map(|(a, b)| a * b).sum();
    let free = [0, 1, 2].map(|k| s[k] - E_TERMS[k] + along * s[k]);
    let [x, y, z] = ROTATION.map(|row| row[0] * free[0] + row[1] * free[1] + row[2] * free[2]);
    (y.atan2(x).rem_euclid(TAU), z.atan2(x.hypot(y)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn b1950_directions_become_j2000() {
        // 3C 273: B1950 12h26m33.246s +02d19m43.29s, J2000 12h29m06.700s +02d03m08.60s (radio catalogues).
        let deg = |h: f64, m: f64, s: f64| (h + m / 60.0 + s / 3600.0).to_radians();
        let (ra, dec) = fk5_of_fk4(15.0 * deg(12.0, 26.0, 33.246), deg(2.0, 19.0, 43.29));
        let (ra2, dec2) = (15.0 * deg(12.0, 29.0, 6.700), deg(2.0, 3.0, 8.60));
        let arcsec = 1f64.to_radians() / 3600.0;
        assert!((ra - ra2).abs() < 0.5 * arcsec && (dec - dec2).abs() < 0.5 * arcsec, "{} {}", (ra - ra2) / arcsec, (dec - dec2) / arcsec);
    }
}

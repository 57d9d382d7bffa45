//! The first hits of given rays, and the regions of given points, row by row.

use super::error::GeometryError;
use super::model::{Geometry, Hit};
use crate::space::Ray;
use crate::space::Vec3;
use serde::{Deserialize, Serialize};
use std::io::Read;

/// A ray; columns `ox,oy,oz,dx,dy,dz` in m. Other columns are ignored.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct RayRow {
    /// Start, m.
    pub ox: f64,
    /// Start, m.
    pub oy: f64,
    /// Start, m.
    pub oz: f64,
    /// Direction of any length.
    pub dx: f64,
    /// Direction.
    pub dy: f64,
    /// Direction.
    pub dz: f64,
}

/// A point; columns `x,y,z` in m.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct PointRow {
    /// East, m.
    pub x: f64,
    /// North, m.
    pub y: f64,
    /// Up, m.
    pub z: f64,
}

/// The first hit of a ray. The fields after `hit` are empty if it hits nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct RayAnswer {
    /// 1 if it hits.
    pub hit: u8,
    /// Distance, m.
    pub t: Option<f64>,
    /// Outward unit normal at the hit.
    pub nx: Option<f64>,
    /// Normal.
    pub ny: Option<f64>,
    /// Normal.
    pub nz: Option<f64>,
    /// Region, or `ground`.
    pub region: Option<String>,
    /// Body whose face it is.
    pub body: Option<String>,
    /// Number of the face, from 1.
    pub face: Option<u8>,
}

/// The region of a point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PointAnswer {
    /// 1 if the point lies in the region asked for, or in any solid region if none is asked for.
    pub inside: u8,
    /// The first listed region that holds it.
    pub region: Option<String>,
}

impl RayAnswer {
    /// A hit at the distance `t` on a region or on the ground.
    pub(crate) fn of(t: f64, n: Vec3, region: &str) -> Self {
        Self { hit: 1, t: Some(t), nx: Some(n.x), ny: Some(n.y), nz: Some(n.z), region: Some(region.to_owned()), ..Self::default() }
    }
}

impl RayRow {
    /// The ray.
    ///
    /// # Errors
    /// A number that is not finite, or a direction of length zero.
    pub fn ray(&self, row: usize) -> Result<Ray, GeometryError> {
        let (o, d) = (Vec3::new(self.ox, self.oy, self.oz), Vec3::new(self.dx, self.dy, self.dz));
        if !(o.is_finite() && d.is_finite() && d.norm2() > 0.0) {
            let message =
                format!("the ray from {:?} along {:?} needs finite numbers and a direction above length 0", o.to_array(), d.to_array());
            return Err(GeometryError::Row { row, message });
        }
        Ok(Ray::new(o, d))
    }
}

/// Reads rows of a CSV with a header.
///
/// # Errors
/// A missing column or a word that is no number, with its row.
pub fn read_rows<T: for<'de> Deserialize<'de>>(csv: impl Read) -> Result<Vec<T>, GeometryError> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(csv);
    reader.deserialize().enumerate().map(|(i, row)| row.map_err(|e| GeometryError::Row { row: i + 1, message: e.to_string() })).collect()
}

impl Geometry {
    /// The first hit of a ray on the border of one region, or of any region.
    #[must_use]
    pub fn probe(&self, region: Option<usize>, ray: &Ray) -> Option<Hit> {
        match region {
            Some(region) => self.nearest_border(region, ray),
            None => match self.region_at(ray.origin) {
                Some(inside) if !self.regions()[inside].source.void => self.nearest_border(inside, ray),
                _ => self.first_hit(ray, f64::INFINITY),
            },
        }
    }

    /// A hit as a row.
    #[must_use]
    pub fn answer(&self, ray: &Ray, hit: Option<Hit>) -> RayAnswer {
        let Some(hit) = hit else { return RayAnswer::default() };
        let n = self.normal(&hit, ray.at(hit.t));
        let region = &self.regions()[hit.region as usize].source.name;
        let body = Some(self.bodies()[hit.body as usize].name.clone());
        RayAnswer { body, face: Some(hit.face), ..RayAnswer::of(hit.t, n, region) }
    }

    /// The first hits of rays.
    ///
    /// # Errors
    /// An unknown region; a ray with a number that is not finite or without a direction.
    pub fn probe_rays(&self, region: Option<&str>, rays: &[RayRow]) -> Result<Vec<RayAnswer>, GeometryError> {
        let region = region.map(|name| self.region_index(name)).transpose()?;
        rays.iter()
            .enumerate()
            .map(|(i, row)| {
                let ray = row.ray(i + 1)?;
                Ok(self.answer(&ray, self.probe(region, &ray)))
            })
            .collect()
    }

    /// The regions of points.
    ///
    /// # Errors
    /// An unknown region, or a point that is not finite.
    pub fn probe_points(&self, region: Option<&str>, points: &[PointRow]) -> Result<Vec<PointAnswer>, GeometryError> {
        let region = region.map(|name| self.region_index(name)).transpose()?;
        points
            .iter()
            .enumerate()
            .map(|(i, row)| {
                let p = Vec3::new(row.x, row.y, row.z);
                if !p.is_finite() {
                    return Err(GeometryError::Row { row: i + 1, message: format!("the point {:?} is not finite", p.to_array()) });
                }
                let first = self.region_at(p);
                let inside = match region {
                    Some(r) => self.region_contains(r, p),
                    None => first.is_some_and(|r| !self.regions()[r].source.void),
                };
                let name = first.map(|r| self.regions()[r].source.name.clone());
                Ok(PointAnswer { inside: u8::from(inside), region: name })
            })
            .collect()
    }
}

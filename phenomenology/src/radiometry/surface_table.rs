//! Reflection and emission of a surface, tabulated against the angle of incidence.

use super::angle_table::AngleTable;
use super::diffuse_table::DiffuseTable;
use super::facet_table::FacetTable;
use super::options::TableOptions;
use super::response::{KELVIN, MIRROR_ANGLES, Response};
use crate::atmosphere::planck::{black_body_radiance, rayleigh_jeans_temperature_k};
use crate::surfaces::{Reflection, Roughness, Sky, Stack, SurfaceError, SurfaceModel};
use std::f64::consts::PI;

/// First number of intervals of a table of facets.
const FACET_ANGLES: usize = 32;
/// Number of azimuths that are tabulated if the slopes along and across differ, from along to across. The response is a polynomial in the
/// cosine of twice the azimuth, and degree 4 represents it to 0.1 K for sea slopes (test).
const AZIMUTHS: usize = 5;
/// Smallest cosine of incidence for which the facet integrals are evaluated. Beyond it the facets hide each other, and the integrals are
/// not valid; the value at this cosine is used.
const GRAZING_COSINE: f64 = 1e-4;

/// What a surface reflects from all directions except along the mirror ray, `[h, v]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scattered {
    /// Open sky that the level surface scatters to the observer, Rayleigh-Jeans temperature in K.
    pub sky_k: [f64; 2],
    /// Power reflectivity, over all directions that the radiation comes from.
    pub power: [f64; 2],
    /// The part of it that belongs to the diffuse lobe. Facets reflect the rest.
    pub diffuse: [f64; 2],
}

/// The table of one surface in one channel.
#[derive(Debug, Clone)]
pub struct SurfaceTable {
    kind: Kind,
    diffuse: Option<DiffuseTable>,
    /// Rayleigh-Jeans temperature of its top layer, K. It replaces radiation that is not followed any further.
    top_k: f64,
}

#[derive(Debug, Clone)]
enum Kind {
    Mirror(AngleTable<6>),
    /// A mirror with a diffuse lobe: the open sky in the lobe and its albedo after the numbers of the mirror. One table holds them all, so that
    /// their sum is exact between its nodes too.
    Matt(AngleTable<10>),
    /// One table for each azimuth: emission, scattered open sky, and reflectivity.
    Facets {
        tables: Vec<AngleTable<6>>,
        cos_twice: f64,
        sin_twice: f64,
        facets: Box<FacetTable>,
    },
}

/// The stack with its temperatures converted to Rayleigh-Jeans temperatures.
fn in_radiance(stack: &Stack) -> Result<Stack, SurfaceError> {
    let freq_ghz = stack.freq_hz() * 1e-9;
    stack.with_temperatures(|t| rayleigh_jeans_temperature_k(freq_ghz, black_body_radiance(freq_ghz, t)))
}

impl SurfaceTable {
    /// Tabulates a surface. `sky` gives the Rayleigh-Jeans temperature of the sky in K against the cosine of the zenith angle.
    /// `slope_azimuth_rad` is the direction of the first slope axis, from north over east.
    ///
    /// # Errors
    /// As [`SurfaceModel::response`].
    pub fn new(
        model: &SurfaceModel,
        slope_azimuth_rad: f64,
        sky: &(dyn Fn(f64) -> f64 + Sync),
        options: &TableOptions,
    ) -> Result<Self, SurfaceError> {
        let freq_ghz = model.stack.freq_hz() * 1e-9;
        let mut model = model.clone();
        model.stack = in_radiance(&model.stack)?;
        if let Some(canopy) = &mut model.canopy {
            canopy.temperature_k = rayleigh_jeans_temperature_k(freq_ghz, black_body_radiance(freq_ghz, canopy.temperature_k));
        }
        let top_k = model.canopy.map_or(model.stack.top_temperature_k(), |c| c.temperature_k);
        let by_zenith = |zenith: f64| sky(zenith.cos());
        let lobe = model.lobe()?;
        let diffuse = lobe.as_ref().map(|lobe| DiffuseTable::new(&model, lobe, &by_zenith, options)).transpose()?;
        let respond = |cos: f64, azimuth: f64| {
            let theta = cos.clamp(GRAZING_COSINE, 1.0).acos();
            model.response_with(lobe.as_ref(), theta, azimuth, Sky::Symmetric(&by_zenith))
        };
        let kind = match (model.roughness, &diffuse) {
            (Roughness::GeometricOptics(go), _) => {
                let scale = [1.0, 1.0, 1.0, 1.0, KELVIN, KELVIN];
                let azimuths = if go.slopes.is_isotropic() { 1 } else { AZIMUTHS };
                let tables = (0..azimuths)
                    .map(|k| {
                        AngleTable::new(options.facets_k, scale, (FACET_ANGLES, options.facet_intervals), |cos| {
                            let r = respond(cos, PI / 8.0 * k as f64)?;
                            let ([eh, ev], [sh, sv], [h, v]) = (r.emitted_k, r.scattered_sky_k, r.reflectivity);
                            Ok::<_, SurfaceError>([eh, ev, sh, sv, h, v])
                        })
                    })
                    .collect::<Result<Vec<_>, SurfaceError>>()?;
                let (sin_twice, cos_twice) = (2.0 * slope_azimuth_rad).sin_cos();
                let (sin, cos) = slope_azimuth_rad.sin_cos();
                let facets = Box::new(FacetTable::new(&model, &go, [sin, cos], options)?);
                Kind::Facets { tables, cos_twice, sin_twice, facets }
            }
            (_, Some(_)) => {
                let scale = [KELVIN, KELVIN, KELVIN, KELVIN, 1.0, 1.0, 1.0, 1.0, KELVIN, KELVIN];
                let (tolerance_k, angles) = match model.stack.volume() {
                    Some(_) => (options.facets_k, (FACET_ANGLES, options.facet_intervals)),
                    None => (options.mirror_k, MIRROR_ANGLES),
                };
                Kind::Matt(AngleTable::new(tolerance_k, scale, angles, |cos| {
                    let theta = cos.clamp(GRAZING_COSINE, 1.0).acos();
                    let r = respond(cos, 0.0)?;
                    let [h, v, re, im, eh, ev] = row_of(&model.reflection(theta)?, r.mirrored, r.emitted_k);
                    let [sh, sv] = [0, 1].map(|p| r.scattered_sky_k[p] - r.mirrored[p] * sky(theta.cos()));
                    Ok::<_, SurfaceError>([h, v, re, im, eh, ev, sh, sv, r.diffuse[0], r.diffuse[1]])
                })?)
            }
            (_, None) => {
                let dark = |_: f64| 0.0;
                let scale = [KELVIN, KELVIN, KELVIN, KELVIN, 1.0, 1.0];
                Kind::Mirror(AngleTable::new(options.mirror_k, scale, MIRROR_ANGLES, |cos| {
                    let theta = cos.min(1.0).acos();
                    let r = model.response_with(None, theta, 0.0, Sky::Symmetric(&dark))?;
                    Ok::<_, SurfaceError>(row_of(&model.reflection(theta)?, r.reflectivity, r.emitted_k))
                })?)
            }
        };
        Ok(Self { kind, diffuse, top_k })
    }

    /// Rayleigh-Jeans temperature of the top layer, K.
    #[must_use]
    #[inline]
    pub fn top_k(&self) -> f64 {
        self.top_k
    }

    /// Largest error of interpolation, K.
    #[must_use]
    pub fn error_k(&self) -> f64 {
        match &self.kind {
            Kind::Mirror(t) => t.error(),
            Kind::Matt(t) => t.error(),
            Kind::Facets { tables, .. } => tables.iter().map(AngleTable::error).fold(0.0, f64::max),
        }
    }

    /// The facets of the surface; `None` for a surface without facets.
    #[must_use]
    #[inline]
    pub fn facets(&self) -> Option<&FacetTable> {
        match &self.kind {
            Kind::Mirror(_) | Kind::Matt(_) => None,
            Kind::Facets { facets, .. } => Some(facets),
        }
    }

    /// The diffuse lobe of the surface; `None` for a surface without one.
    #[must_use]
    #[inline]
    pub fn diffuse(&self) -> Option<&DiffuseTable> {
        self.diffuse.as_ref()
    }

    /// Whether the surface reflects radiation from other directions than along the mirror ray.
    #[must_use]
    #[inline]
    pub fn scatters(&self) -> bool {
        self.diffuse.is_some() || self.facets().is_some()
    }

    /// Emission and mirror reflection at a cosine of incidence, and what the surface scatters. The ray runs along a direction with the
    /// components `x` and `y` in the plane of the surface: east and north on level ground.
    #[must_use]
    #[inline]
    pub fn at(&self, cos: f64, x: f64, y: f64) -> (Response, Option<Scattered>) {
        match &self.kind {
            Kind::Mirror(table) => (Response::of(&table.at(cos)), None),
            Kind::Matt(table) => {
                let row = table.at(cos);
                let diffuse = [row[8], row[9]];
                (Response::of(&row), Some(Scattered { sky_k: [row[6], row[7]], power: diffuse, diffuse }))
            }
            Kind::Facets { tables, cos_twice, sin_twice, .. } => {
                let [eh, ev, sh, sv, h, v] = match tables.as_slice() {
                    [only] => only.at(cos),
                    several => {
                        let size = x * x + y * y;
                        let twice = if size > 1e-24 { ((y * y - x * x) * cos_twice + 2.0 * x * y * sin_twice) / size } else { 0.0 };
                        between_azimuths(several, cos, twice)
                    }
                };
                let diffuse = self.diffuse.as_ref().map_or([0.0; 2], |d| d.albedo(cos));
                let response = Response { power: [0.0; 2], cross: [0.0; 2], emitted_k: [eh, ev] };
                (response, Some(Scattered { sky_k: [sh, sv], power: [h, v], diffuse }))
            }
        }
    }
}

fn row_of(smooth: &Reflection, power: [f64; 2], emitted_k: [f64; 2]) -> [f64; 6] {
    let r = smooth.with_powers(power[0], power[1]);
    [power[0], power[1], r.cross.re, r.cross.im, emitted_k[0], emitted_k[1]]
}

/// The polynomial through the tables at `cos(k pi/4)`, in its barycentric form.
fn between_azimuths(tables: &[AngleTable<6>], cos: f64, cos_twice: f64) -> [f64; 6] {
    let last = tables.len() - 1;
    let mut sum = [0.0; 6];
    let mut weights = 0.0;
    for (k, table) in tables.iter().enumerate() {
        let off = cos_twice - (PI * k as f64 / last as f64).cos();
        if off.abs() < 1e-12 {
            return table.at(cos);
        }
        let end = if k == 0 || k == last { 0.5 } else { 1.0 };
        let w = if k.is_multiple_of(2) { end } else { -end } / off;
        weights += w;
        for (s, v) in sum.iter_mut().zip(table.at(cos)) {
            *s += w * v;
        }
    }
    sum.map(|s| s / weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dielectrics::{Extrapolation, Material};
    use crate::surfaces::StackDescription;

    fn sea(roughness: &str) -> SurfaceModel {
        let m = Material::by_name("sea-water").unwrap();
        let stack = StackDescription::of_material(m, m.state(), None).resolve(94e9, Extrapolation::Refuse).unwrap();
        SurfaceModel::new(stack, roughness.parse().unwrap())
    }

    fn sky(cos: f64) -> f64 {
        270.0 - 230.0 * (-0.2 / cos.max(1e-6)).exp()
    }

    #[test]
    fn mirrors_are_tabulated_to_a_hundredth_of_a_kelvin() {
        let model = sea("smooth");
        let table = SurfaceTable::new(&model, 0.0, &sky, &TableOptions::default()).unwrap();
        let radiant = in_radiance(&model.stack).unwrap();
        for k in 0..900 {
            let theta = (f64::from(k) * 0.0999).to_radians();
            let (r, rough) = table.at(theta.cos(), 0.0, 0.0);
            assert!(rough.is_none());
            let direct = radiant.emission_k(theta).unwrap();
            let powers = radiant.reflection(theta).unwrap().powers();
            for p in 0..2 {
                assert!((r.emitted_k[p] - direct[p]).abs() < 0.005, "{k}");
                assert!((r.power[p] - powers[p]).abs() < 2e-5, "{k}");
            }
        }
    }

    #[test]
    fn facets_are_tabulated_to_a_tenth_of_a_kelvin() {
        let model = sea("sea:10");
        let table = SurfaceTable::new(&model, 0.3, &sky, &TableOptions::default()).unwrap();
        let mut radiant = model.clone();
        radiant.stack = in_radiance(&model.stack).unwrap();
        let by_zenith = |z: f64| sky(z.cos());
        for (zenith, azimuth) in [(3.0_f64, 0.4_f64), (31.0, 1.3), (52.5, 0.9), (66.0, 2.9), (78.0, 5.1), (84.3, 0.0)] {
            let (s, c) = azimuth.sin_cos();
            let (r, scattered) = table.at(zenith.to_radians().cos(), s, c);
            let direct = radiant.response(zenith.to_radians(), azimuth - 0.3, Sky::Symmetric(&by_zenith)).unwrap();
            for p in 0..2 {
                let seen = r.emitted_k[p] + scattered.unwrap().sky_k[p];
                let want = direct.emitted_k[p] + direct.scattered_sky_k[p];
                assert!((seen - want).abs() < 0.1, "{zenith} {azimuth}: {seen} {want}");
                assert!((scattered.unwrap().power[p] - direct.reflectivity[p]).abs() < 4e-4);
            }
        }
    }
}

//! A scene with everything that rays need at given frequencies.

use super::face::Face;
use super::memory::Kept;
use super::options::{RenderOptions, Scale};
use super::weather::Weather;
use crate::atmosphere::PathTable;
use crate::atmosphere::planck::{black_body_radiance, planck_of_rayleigh_jeans_k, rayleigh_jeans_temperature_k};
use crate::dielectrics::Extrapolation;
use crate::error::{Result, SceneError};
use crate::geometry::{At, Hit};
use crate::radiometry::{SkyLookup, SurfaceTable, TableOptions};
use crate::solids::SolidScene;
use crate::space::{Ray, Vec3};
use crate::surfaces::{StackDescription, Substance, SurfaceModel};
use crate::terrain::{GroundHit, Terrain};
use cittert_arrays::Polarization;
use rayon::prelude::*;

/// A scene with tables of surfaces, sky and air.
#[derive(Debug)]
pub struct Tracer<'a> {
    pub(super) scene: &'a SolidScene,
    pub(super) freqs_ghz: Vec<f64>,
    pub(super) options: RenderOptions,
    /// Antenna row of each plane. // [pol]
    pub(super) antenna: Vec<[f64; 4]>,
    /// // [cover][chan]
    pub(super) surfaces: Vec<Vec<SurfaceTable>>,
    pub(super) sky: SkyLookup,
    pub(super) air: Option<PathTable>,
    pub(super) weather: Option<Weather<'a>>,
    pub(super) altitude_km: f64,
    /// Temperature of the black ground that rays meet if they go down past a scene without ground, RJ, K. // [chan]
    pub(super) below_k: Vec<f64>,
    /// Height of the highest sky table, m.
    pub(super) top_m: f64,
    /// Distance from a surface at which a reflected ray starts, m. It keeps the ray from hitting the same surface again.
    pub(super) eps: f64,
    /// Smallest upward component of the normal of a surface that counts as level.
    pub(super) level: f64,
    /// Number of the table of the sky that level surfaces scatter.
    pub(super) open_level: usize,
    /// Memory of frames.
    pub(super) memory: Kept,
}

/// The first point that a ray hits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Distance, m.
    pub range_m: f64,
    /// Cosine of the angle of incidence.
    pub cos_incidence: f64,
    /// Number of the cover (surface and temperature).
    pub cover: u32,
    /// Number of the region; `None` for the ground.
    pub region: Option<u32>,
    /// Body and face.
    pub face: (u32, u8),
}

/// What a ray hits first, before the values of a [`Spot`] are computed.
#[derive(Debug, Clone, Copy)]
pub(super) enum First {
    Sky,
    /// The ground, with its cover.
    Ground(GroundHit, u32),
    Solid(Hit),
}

impl First {
    /// What it is.
    #[inline]
    pub(super) fn identity(&self) -> Face {
        match self {
            Self::Sky => Face::SKY,
            Self::Ground(_, cover) => Face::of_ground(*cover),
            Self::Solid(hit) => Face::of_solid(hit.region, hit.body, hit.face),
        }
    }
}

/// A hit, with the values that the tracer needs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    pub t: f64,
    pub point: Vec3,
    /// Unit normal towards the ray.
    pub normal: Vec3,
    pub cover: u32,
    pub region: Option<u32>,
    pub face: (u32, u8),
}

impl Spot {
    /// What was hit.
    #[inline]
    pub(super) fn identity(&self) -> Face {
        match self.region {
            Some(region) => Face::of_solid(region, self.face.0, self.face.1),
            None => Face::of_ground(self.cover),
        }
    }
}

impl<'a> Tracer<'a> {
    /// Tabulates sky, surfaces and air of a scene at frequencies in Hz.
    ///
    /// # Errors
    /// No frequency; a frequency, surface or sky that cannot be computed; an option outside its range.
    pub fn new(scene: &'a SolidScene, freqs_hz: &[f64], options: &RenderOptions) -> Result<Self> {
        let antenna = options.antenna_rows()?;
        Face::check(scene.geometry.regions().len(), scene.geometry.bodies().len())?;
        SceneError::unless(!freqs_hz.is_empty(), "frequencies", "empty", "at least one")?;
        let freqs_ghz: Vec<f64> = freqs_hz.iter().map(|f| f * 1e-9).collect();
        let bounds = scene.geometry.bounds();
        let camera_m = scene.camera().map_or(0.0, |c| c.position_m[2]);
        let (low_m, high_m) = scene.terrain.as_ref().map_or((0.0, 0.0), Terrain::range_m);
        let roof_m = if bounds.is_empty() { 0.0 } else { bounds.max.z };
        let altitude_km = scene.air.altitude_km;
        let top_m = high_m.max(camera_m).max(roof_m).max(options.highest_m);
        let ground_m = scene.terrain.as_ref().map_or(0.0, Terrain::plane_m);
        // A ray that leaves a cloud sees the sky of the table at its top.
        let tops: Vec<f64> = scene.weather.iter().flat_map(crate::solids::Weather::tops_m).filter(|z| *z > low_m).collect();
        let highest_m = tops.iter().copied().fold(top_m, f64::max);
        let mut heights: Vec<f64> = [low_m, ground_m, top_m].iter().chain(&tops).map(|z| altitude_km + 1e-3 * z).collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup_by(|b, a| *b - *a < 1e-6);
        let (sky, air) = match &scene.air.atmosphere {
            None => (SkyLookup::uniform(scene.air.background_k, &freqs_ghz), None),
            Some(atmosphere) => {
                let path = PathTable::new(atmosphere, &freqs_ghz)?.with_max_rise(options.tables.path_rise_km)?;
                (SkyLookup::new(atmosphere, scene.air.geometry, &freqs_ghz, &heights, &options.tables)?, Some(path))
            }
        };
        let weather = scene.weather.as_ref().map(|w| Weather::new(w, &freqs_ghz)).transpose()?;
        let below = scene.air.atmosphere.as_ref().map_or(scene.air.background_k, |a| a.profile().surface().temperature_k());
        let below_k = freqs_ghz.iter().map(|f| rayleigh_jeans_temperature_k(*f, black_body_radiance(*f, below))).collect();
        let (level, _) = sky.level_above(altitude_km + 1e-3 * ground_m)?;
        let surfaces = tables(scene, freqs_hz, &sky, level, &options.tables)?;
        let eps = scene.geometry.eps().max(1e-9 * (top_m - low_m).abs()).max(1e-9);
        Ok(Self {
            scene,
            freqs_ghz,
            options: options.clone(),
            antenna,
            surfaces,
            sky,
            air,
            weather,
            altitude_km,
            below_k,
            top_m: highest_m,
            eps,
            level: options.level_deg.to_radians().cos(),
            open_level: level,
            memory: Kept::default(),
        })
    }

    /// Refuses a camera above the tables of the sky.
    pub(super) fn check_height(&self, position: Vec3) -> Result<()> {
        if position.z <= self.top_m + 1e-3 {
            return Ok(());
        }
        Err(SceneError::bad_value(
            "height of the camera",
            format_args!("{} m", position.z),
            "at most the highest_m the tracer was made for",
        ))
    }

    /// Frequencies of the channels, GHz.
    #[must_use]
    pub fn freqs_ghz(&self) -> &[f64] {
        &self.freqs_ghz
    }

    /// Largest error of the tables of surfaces, K.
    #[must_use]
    pub fn table_error_k(&self) -> f64 {
        self.surfaces.iter().flatten().map(SurfaceTable::error_k).fold(0.0, f64::max)
    }

    /// A Rayleigh-Jeans temperature in the temperature scale of the picture.
    pub(super) fn scaled(&self, channel: usize, pol: usize, rj_k: f64) -> f64 {
        let additive = matches!(self.options.polarizations[pol], Polarization::Q | Polarization::U | Polarization::V);
        if additive || self.options.scale == Scale::RayleighJeans {
            rj_k
        } else {
            planck_of_rayleigh_jeans_k(self.freqs_ghz[channel], rj_k)
        }
    }

    /// The first point that a ray hits; `None` for the sky.
    #[inline]
    pub(super) fn spot(&self, ray: &Ray) -> Result<Option<Spot>> {
        self.spot_at(ray, &self.first(ray, |limit| self.scene.geometry.first_hit(ray, limit), Terrain::cover))
    }

    /// The nearer one of the ground and of the first solid before a distance. `cover` finds the cover of a point of the ground.
    #[inline]
    pub(super) fn first(&self, ray: &Ray, solid: impl FnOnce(f64) -> Option<Hit>, cover: impl FnOnce(&Terrain, f64, f64) -> u32) -> First {
        let ground = self.scene.terrain.as_ref().and_then(|t| t.hit(ray, self.eps, f64::INFINITY).map(|g| (t, g)));
        let limit = ground.map_or(f64::INFINITY, |(_, g)| g.t);
        match (solid(limit), ground) {
            (Some(hit), _) if hit.t < limit => First::Solid(hit),
            (_, Some((terrain, g))) => {
                let point = ray.at(g.t);
                First::Ground(g, cover(terrain, point.x, point.y))
            }
            _ => First::Sky,
        }
    }

    /// The values of a hit; `None` for the sky.
    #[inline]
    pub(super) fn spot_at(&self, ray: &Ray, first: &First) -> Result<Option<Spot>> {
        match first {
            First::Sky => Ok(None),
            First::Ground(g, cover) => {
                Ok(Some(Spot { t: g.t, point: ray.at(g.t), normal: g.normal, cover: *cover, region: None, face: (0, 0) }))
            }
            First::Solid(hit) => {
                let point = ray.at(hit.t);
                let n = self.scene.geometry.normal(hit, point);
                let normal = if n.dot(ray.direction) > 0.0 { -n } else { n };
                let cover = self.scene.covers.of_face(hit.region, hit.body, hit.face).ok_or_else(|| self.uncovered(hit))?;
                Ok(Some(Spot { t: hit.t, point, normal, cover, region: Some(hit.region), face: (hit.body, hit.face) }))
            }
        }
    }

    /// The error for a face without a surface.
    #[cold]
    fn uncovered(&self, hit: &Hit) -> SceneError {
        let region = &self.scene.geometry.regions()[hit.region as usize].source;
        let body = &self.scene.geometry.bodies()[hit.body as usize].name;
        SceneError::at(region.line, format!("region `{}` has no surface on face {} of body `{body}`", region.name, hit.face))
    }
}

/// Tables of all covers. // [cover][chan]
fn tables(scene: &SolidScene, freqs_hz: &[f64], sky: &SkyLookup, level: usize, options: &TableOptions) -> Result<Vec<Vec<SurfaceTable>>> {
    let extrapolation = if scene.file().extrapolate { Extrapolation::Documented } else { Extrapolation::Refuse };
    let jobs: Vec<(usize, usize)> = (0..scene.covers.list().len()).flat_map(|c| (0..freqs_hz.len()).map(move |f| (c, f))).collect();
    let done: Vec<SurfaceTable> = jobs
        .par_iter()
        .map(|&(cover, channel)| {
            let cover = &scene.covers.list()[cover];
            let source = &scene.surfaces[cover.surface];
            let named = |e| SceneError::Surface { at: At(source.line), name: source.name.clone(), source: Box::new(e) };
            let stack = at_temperature(&source.stack, cover.temperature_k).resolve(freqs_hz[channel], extrapolation).map_err(named)?;
            let mut model = SurfaceModel::new(stack, source.roughness);
            model.canopy = source.canopy;
            SurfaceTable::new(&model, source.slope_azimuth_rad, &|cos| sky.rj_k(level, channel, cos), options).map_err(named)
        })
        .collect::<Result<_>>()?;
    Ok(done.chunks(freqs_hz.len()).map(<[SurfaceTable]>::to_vec).collect())
}

/// A stack with all its layers at one temperature, if one is given.
fn at_temperature(stack: &StackDescription, temperature_k: Option<f64>) -> StackDescription {
    let mut stack = stack.clone();
    if let Some(t) = temperature_k {
        for layer in &mut stack.layers {
            layer.temperature_k = t;
            if let Substance::Material { state, .. } = &mut layer.substance {
                state.temperature_k = t;
            }
        }
    }
    stack
}

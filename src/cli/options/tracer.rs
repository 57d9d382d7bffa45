//! How the tracer of a scene of solids works: planes, temperature scale, smoothing of edges, limits of reflection.

use crate::cli::failure::Result;
use cittert_arrays::Polarization;
use cittert_arrays::quantity::Temperature;
use cittert_phenomenology::trace::Scale;
use cittert_phenomenology::{RenderOptions, SolidScene};
use clap::{Args, ValueEnum};

/// Options of the tracer.
#[derive(Debug, Clone, Args)]
pub struct TracerArgs {
    /// Planes: I (mean of h and v), XX (h, electric field along l), YY (v), Q, U, V.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "I")]
    pub pol: Vec<Polarization>,
    /// Scale of the temperatures.
    #[arg(long, value_enum, default_value_t = ScaleName::Planck)]
    scale: ScaleName,
    /// Rays along each side of a pixel on an edge, 1 to 16; 1 sends one ray through every pixel.
    #[arg(long, value_name = "N", default_value_t = 4)]
    antialias: usize,
    /// Smallest temperature difference between neighbouring pixels that counts as an edge.
    #[arg(long, value_name = "TEMP", default_value = "2K")]
    edge: Temperature,
    /// Largest number of reflections of a ray.
    #[arg(long, value_name = "N", default_value_t = 8)]
    max_bounces: usize,
    /// A ray ends when its weight is below this.
    #[arg(long, value_name = "X", default_value_t = 1e-3)]
    min_weight: f64,
    /// Give all materials, the air and space this temperature. The image must then have this temperature everywhere.
    #[arg(long, value_name = "TEMP")]
    isothermal: Option<Temperature>,
}

/// How radiance is expressed as a temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ScaleName {
    /// The black body that has this radiance.
    Planck,
    /// Linear in radiance (Rayleigh-Jeans).
    Rj,
}

impl TracerArgs {
    /// As options of a rendering.
    #[must_use]
    pub fn options(&self, per_channel: bool) -> RenderOptions {
        RenderOptions {
            polarizations: self.pol.clone(),
            per_channel,
            scale: if self.scale == ScaleName::Rj { Scale::RayleighJeans } else { Scale::Planck },
            antialias: self.antialias,
            edge_k: self.edge.si(),
            max_bounces: self.max_bounces,
            min_weight: self.min_weight,
            ..RenderOptions::default()
        }
    }

    /// The scene, or the same scene with one temperature.
    ///
    /// # Errors
    /// A temperature outside the range of the air.
    pub fn scene(&self, scene: SolidScene) -> Result<SolidScene> {
        Ok(match self.isothermal {
            Some(t) => scene.isothermal(t.si())?,
            None => scene,
        })
    }
}

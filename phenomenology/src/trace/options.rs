//! Options of a rendering.

use crate::error::{Result, SceneError};
use crate::radiometry::TableOptions;
use cittert_arrays::Polarization;

/// The temperature scale of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// The temperature of the black body that has this radiance.
    #[default]
    Planck,
    /// Rayleigh-Jeans temperature, which is linear in radiance. Visibilities are sums of this quantity.
    RayleighJeans,
}

/// Options of a rendering.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderOptions {
    /// Planes of the picture. `I` is the mean of h and v, `XX` is h (electric field along l), `YY` is v. Q, U and V are always
    /// Rayleigh-Jeans temperatures.
    pub polarizations: Vec<Polarization>,
    /// Whether every channel gets its own temperatures. Otherwise the picture holds one channel at the mean frequency.
    pub per_channel: bool,
    /// Temperature scale of I, XX and YY.
    pub scale: Scale,
    /// Number of rays along each side of a pixel that lies on an edge. With 1 every pixel has one ray. This option limits the accuracy of
    /// small pictures: at 64 x 64 pixels the airport changes by 5.9 K rms with 2 rays, and by 2.6 K rms with 8.
    pub antialias: usize,
    /// Difference between neighbouring pixels above which they lie on an edge, K. At 2 K an edge that is missed changes a pixel by at
    /// most 1 K.
    pub edge_k: f64,
    /// Largest number of reflections of a ray. It matters for metal bodies with many faces: at 64 x 64 pixels the T-72 changes by 2.9 K rms
    /// with 4 reflections and by 2.0 K rms with 16. The other scenes change by less than 0.5 K rms.
    pub max_bounces: usize,
    /// Weight below which a ray is not followed any further. At 1e-3 and contrasts of 200 K the error is at most 0.2 K, in few pixels.
    pub min_weight: f64,
    /// Greatest height of any camera that will use the tracer, m. The height of the scene's own camera is always covered.
    pub highest_m: f64,
    /// Tilt up to which a surface of facets counts as level, degrees. Only level facets scatter the tabulated sky; on a slope the
    /// reflected ray is followed. A tilt of 2.56 degrees is well below the rms slope of any facets in use.
    pub level_deg: f64,
    /// Rms noise of objects that rough surfaces mirror, K. It sets the number of facets that are drawn for a pixel.
    pub speckle_k: f64,
    /// Whether the picture tells what its temperatures come from.
    pub causes: bool,
    /// Accuracy of the tables of sky, surfaces and air.
    pub tables: TableOptions,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            polarizations: vec![Polarization::I],
            per_channel: false,
            scale: Scale::Planck,
            antialias: 4,
            edge_k: 2.0,
            max_bounces: 8,
            min_weight: 1e-3,
            highest_m: 0.0,
            level_deg: 2.56,
            speckle_k: 0.5,
            causes: false,
            tables: TableOptions::default(),
        }
    }
}

impl RenderOptions {
    /// Checks the ranges, and returns the antenna row of each plane.
    pub(super) fn antenna_rows(&self) -> Result<Vec<[f64; 4]>> {
        let side = self.antialias;
        SceneError::unless((1..=16).contains(&side), "antialias", side, "1 to 16 rays along the side of a pixel")?;
        SceneError::unless(self.max_bounces <= 1000, "max_bounces", self.max_bounces, "at most 1000")?;
        SceneError::unless((0.0..1.0).contains(&self.min_weight), "min_weight", self.min_weight, "0 to below 1")?;
        SceneError::unless(self.highest_m.is_finite(), "highest_m", self.highest_m, "a finite height in m")?;
        SceneError::unless((0.0..=90.0).contains(&self.level_deg), "level_deg", self.level_deg, "0 to 90 deg")?;
        SceneError::unless((0.05..=1e3).contains(&self.speckle_k), "speckle_k", self.speckle_k, "0.05 to 1000 K")?;
        self.tables.check()?;
        SceneError::unless(self.edge_k >= 0.0, "edge_k", self.edge_k, "0 K or more")?;
        let some = !self.polarizations.is_empty();
        SceneError::unless(some, "polarizations", "empty", "at least one of I, Q, U, V, XX (h), YY (v)")?;
        // The Stokes vector is (T_v + T_h, T_v - T_h, U, V).
        self.polarizations
            .iter()
            .map(|p| match p {
                Polarization::I => Ok([0.5, 0.0, 0.0, 0.0]),
                Polarization::XX => Ok([0.5, -0.5, 0.0, 0.0]),
                Polarization::YY => Ok([0.5, 0.5, 0.0, 0.0]),
                Polarization::Q => Ok([0.0, -0.5, 0.0, 0.0]),
                Polarization::U => Ok([0.0, 0.0, 0.5, 0.0]),
                Polarization::V => Ok([0.0, 0.0, 0.0, 0.5]),
                other => Err(SceneError::bad_value("polarization", other, "one of I, Q, U, V, XX (h), YY (v)")),
            })
            .collect()
    }
}

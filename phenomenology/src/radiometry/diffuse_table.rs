//! Draws and weights of the diffuse lobe of a surface.

use super::angle_table::AngleTable;
use super::options::TableOptions;
use super::response::{KELVIN, MIRROR_ANGLES};
use crate::space::Vec3;
use crate::surfaces::{DiffuseLobe, Roughness, SurfaceError, SurfaceModel};
use std::f64::consts::TAU;

/// The diffuse lobe of one surface in one channel.
#[derive(Debug, Clone)]
pub struct DiffuseTable {
    /// Albedo `[h, v]` against the cosine of the angle.
    albedo: AngleTable<2>,
    mean: f64,
    /// Mean of the open sky over the lobe of a level surface, Rayleigh-Jeans temperature in K.
    sky_k: f64,
}

impl DiffuseTable {
    /// Tabulates the lobe of a surface. `sky` gives the Rayleigh-Jeans temperature of the sky in K against the zenith angle in radians.
    ///
    /// # Errors
    /// As [`SurfaceModel::diffuse_albedo`].
    pub fn new(model: &SurfaceModel, lobe: &DiffuseLobe, sky: &dyn Fn(f64) -> f64, options: &TableOptions) -> Result<Self, SurfaceError> {
        // The albedo of leaves over facets is an integral at every angle.
        let slow = matches!(model.roughness, Roughness::GeometricOptics(_)) || model.stack.volume().is_some();
        let (tolerance_k, angles) =
            if slow { (options.facets_k, (32, options.facet_intervals)) } else { (options.mirror_k, MIRROR_ANGLES) };
        let albedo = AngleTable::new(tolerance_k, [KELVIN; 2], angles, |cos| model.diffuse_albedo(cos.min(1.0).acos()))?;
        Ok(Self { albedo, mean: lobe.mean_albedo(), sky_k: lobe.mean_sky(sky) })
    }

    /// A direction from the surface, `z` along its normal, drawn with the density of its cosine. The numbers lie between 0 and 1.
    #[must_use]
    #[inline]
    pub fn draw([radius, turn, ..]: [f64; 5]) -> Vec3 {
        let (sin, cos) = libm::sincos(TAU * turn);
        let across = radius.sqrt();
        Vec3::new(across * cos, across * sin, (1.0 - radius).max(0.0).sqrt())
    }

    /// Power `[h, v]` that the lobe reflects to an observer at a cosine, from a sky of 1.
    #[must_use]
    #[inline]
    pub fn albedo(&self, cos: f64) -> [f64; 2] {
        self.albedo.at(cos)
    }

    /// Weights of the polarisations `[h, v]` of the source at a cosine, for a drawn direction and an albedo of the observer of 1.
    #[must_use]
    #[inline]
    pub fn source(&self, cos: f64) -> [f64; 2] {
        self.albedo.at(cos).map(|a| 0.5 * a / self.mean)
    }

    /// The temperature that a tilted surface is taken to see before drawn rays correct it: the mean sky over the part of its hemisphere above
    /// the horizon, and `below_k` under it, Rayleigh-Jeans temperature in K. `up` is the upward component of its normal.
    #[must_use]
    #[inline]
    pub fn surroundings_k(&self, up: f64, below_k: f64) -> f64 {
        let above = 0.5 * (1.0 + up);
        above * self.sky_k + (1.0 - above) * below_k
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::{Canopy, Stack};
    use num_complex::Complex64;

    /// The mean over drawn directions is the integral of the lobe.
    #[test]
    fn draws_follow_the_lobe() {
        let stack = Stack::half_space(Complex64::new(5.0, -1.5), 290.0, 94e9).unwrap();
        let mut model = SurfaceModel::new(stack, "qh:0.2,1.2,0".parse().unwrap());
        model.canopy = Some(Canopy::new(1.2, 0.06, 290.0).unwrap());
        let lobe = model.lobe().unwrap().unwrap();
        let sky = |zenith: f64| 50.0 + 200.0 * zenith;
        let table = DiffuseTable::new(&model, &lobe, &sky, &TableOptions::default()).unwrap();
        let (mut power, mut seen_k) = (0.0, 0.0);
        let steps = 400;
        for k in 0..steps {
            let d = DiffuseTable::draw([(f64::from(k) + 0.5) / f64::from(steps), 0.3, 0.0, 0.0, 0.0]);
            assert!((d.norm() - 1.0).abs() < 1e-14);
            let [h, v] = table.source(d.z);
            power += (h + v) / f64::from(steps);
            seen_k += (h + v) * sky(d.z.acos()) / f64::from(steps);
        }
        assert!((power - 1.0).abs() < 1e-4, "{power}");
        assert!((seen_k - table.surroundings_k(1.0, 0.0)).abs() < 0.02, "{seen_k}");
        assert!((table.surroundings_k(0.0, 290.0) - 0.5 * (seen_k + 290.0)).abs() < 0.02);
    }
}

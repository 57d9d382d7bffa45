//! The diffuse lobe: what canopies, small-scale roughness and scattering inside reflect from the whole sky.

use super::error::SurfaceError;
use super::quadrature::gauss_legendre_on;

/// Nodes of the integral over the cosine of the source.
const NODES: usize = 48;

/// A diffuse reflection with a given albedo at each angle.
///
/// The fraction of the power that comes from one direction is a product of the albedos of the two directions over their mean. It is the same
/// for the reverse path, and its integral over the sky is the albedo of the observer. Scattering many times leaves no polarisation, so the
/// products hold for every pair of polarisations.
///
/// # Reference
/// Minnaert 1941, Astrophys. J. 93, 403 (products of functions of the two angles are reciprocal).
#[derive(Debug, Clone, PartialEq)]
pub struct DiffuseLobe {
    mean: f64,
    /// Zenith angles in radians, and the share of the lobe around them; the shares add up to 1.
    shares: Vec<(f64, f64)>,
}

impl DiffuseLobe {
    /// The lobe of a surface with the albedo `[h, v]` at a zenith angle in radians. `None` if it reflects nothing diffusely.
    ///
    /// # Errors
    /// The errors of `albedo`.
    pub fn new(albedo: impl Fn(f64) -> Result<[f64; 2], SurfaceError>) -> Result<Option<Self>, SurfaceError> {
        let mut shares = Vec::with_capacity(NODES);
        for (mu, weight) in gauss_legendre_on(NODES, 0.0, 1.0) {
            let theta = mu.acos();
            let [h, v] = albedo(theta)?;
            shares.push((theta, mu * weight * (h + v)));
        }
        let mean: f64 = shares.iter().map(|(_, share)| share).sum();
        if mean <= 0.0 {
            return Ok(None);
        }
        shares.iter_mut().for_each(|(_, share)| *share /= mean);
        Ok(Some(Self { mean, shares }))
    }

    /// Mean of the albedo over directions, weighted by their cosine.
    #[must_use]
    pub fn mean_albedo(&self) -> f64 {
        self.mean
    }

    /// Bidirectional reflectance `[observer pol][source pol]` times pi, for directions of these albedos `[h, v]`.
    #[must_use]
    pub fn factors(&self, observer: [f64; 2], source: [f64; 2]) -> [[f64; 2]; 2] {
        observer.map(|o| source.map(|s| 0.5 * o * s / self.mean))
    }

    /// Mean brightness of the sky, weighted by the lobe, in the unit of `sky`: brightness against zenith angle in radians, mean over azimuth.
    #[must_use]
    pub fn mean_sky(&self, sky: &dyn Fn(f64) -> f64) -> f64 {
        self.shares.iter().map(|&(theta, share)| share * sky(theta)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::{Canopy, Roughness, Stack, SurfaceModel};
    use num_complex::Complex64;

    fn surfaces() -> Vec<SurfaceModel> {
        let stack = || Stack::half_space(Complex64::new(5.0, -1.5), 290.0, 94e9).unwrap();
        let rough = |text: &str| SurfaceModel::new(stack(), text.parse::<Roughness>().unwrap());
        let grass = SurfaceModel { canopy: Some(Canopy::new(1.2, 0.06, 290.0).unwrap()), ..rough("qh:0.2,1.2,0") };
        let sea = SurfaceModel { canopy: Some(Canopy::new(0.3, 0.1, 290.0).unwrap()), ..rough("go:0.2,0.2") };
        let foam = rough("sea:20,foam");
        vec![rough("qh:0.1,0.5,1"), rough("choudhury:0.2mm"), rough("wegmuller:0.3mm"), grass, sea, foam]
    }

    /// The integral over all sources, on another rule than that of the lobe, is the albedo.
    #[test]
    fn the_lobe_keeps_energy_and_is_reciprocal() {
        for surface in surfaces() {
            let lobe = surface.lobe().unwrap().unwrap();
            let albedo = |theta: f64| surface.diffuse_albedo(theta).unwrap();
            for theta in [0.0_f64, 0.5, 1.1] {
                let here = albedo(theta);
                let mut sums = [0.0; 2];
                for (mu, weight) in gauss_legendre_on(160, 0.0, 1.0) {
                    let there = albedo(mu.acos());
                    let (to, from) = (lobe.factors(here, there), lobe.factors(there, here));
                    for p in 0..2 {
                        sums[p] += 2.0 * mu * weight * (to[p][0] + to[p][1]);
                        assert!((0..2).all(|q| (to[p][q] - from[q][p]).abs() < 1e-15));
                    }
                }
                for p in 0..2 {
                    assert!((sums[p] / here[p] - 1.0).abs() < 1e-4, "{surface:?} {theta}: {sums:?} {here:?}");
                }
            }
        }
    }

    #[test]
    fn smooth_surfaces_and_facets_have_no_lobe() {
        for text in ["smooth", "qh:0,0,0", "go:0.1,0.1", "sea:12"] {
            let stack = Stack::half_space(Complex64::new(5.0, -1.5), 290.0, 94e9).unwrap();
            assert_eq!(SurfaceModel::new(stack, text.parse().unwrap()).lobe().unwrap(), None, "{text}");
        }
    }

    /// A rough surface turns into a mirror towards grazing incidence, and mixed polarisations never mirror.
    #[test]
    fn the_share_of_the_mirror_grows_towards_grazing() {
        let surface = &surfaces()[0];
        let share = |degrees: f64| {
            let r = surface.response(degrees.to_radians(), 0.0, crate::surfaces::Sky::Symmetric(&|_| 0.0)).unwrap();
            r.mirrored[0] / r.reflectivity[0]
        };
        assert!(share(0.0) < 0.62 && share(60.0) > share(0.0) && share(89.9) > 0.88 && share(89.9) < 0.91, "{}", share(89.9));
    }
}

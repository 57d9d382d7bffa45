//! What a layer does to the radiation inside it, at one frequency.

use super::matrix::Matrix;
use super::microstructure::Microstructure;
use super::phase::{Coupling, Powers, coupling};
use super::streams::MediumStreams;
use crate::surfaces::coherent::{coherent_absorption, coherent_reflection};
use crate::surfaces::fresnel::AIR;
use crate::surfaces::layer::Layer;
use num_complex::Complex64;

/// Absorption and scattering of a medium without preferred direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatterer {
    /// Coefficient of absorption of power, 1/m.
    pub absorption_per_m: f64,
    /// Where it scatters, and how much.
    pub phase: Phase,
}

/// The law of scattering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    /// Equal power in every direction and polarisation.
    Isotropic {
        /// Coefficient of scattering, 1/m.
        scattering_per_m: f64,
    },
    /// Dipoles.
    Rayleigh {
        /// Coefficient of scattering, 1/m.
        scattering_per_m: f64,
    },
    /// Dipoles times the spectrum of a granular medium.
    Granular {
        /// Power without the spectrum, 1/m^4.
        strength: f64,
        /// Wavenumber in the medium, 1/m.
        wavenumber: f64,
        /// Volume fraction of the grains.
        fraction: f64,
        /// Their arrangement.
        grains: Microstructure,
    },
    /// Flat leaves of all orientations.
    Leaves {
        /// Leaf area (one side) in a volume, m2/m3.
        area_per_m: f64,
        /// Permittivity of a leaf.
        eps: Complex64,
        /// Its thickness, m.
        thickness_m: f64,
        /// Wavenumber of free space, 1/m.
        k0: f64,
    },
}

impl Phase {
    /// Powers at the cosine of a scattering angle.
    fn powers(&self, cos: f64) -> Powers {
        let dipole = |factor: f64| [factor, factor * cos * cos, factor * cos];
        match *self {
            // The two polarisations are not coherent with each other; see `coupling`.
            Self::Isotropic { scattering_per_m } => [scattering_per_m; 3],
            Self::Rayleigh { scattering_per_m } => dipole(1.5 * scattering_per_m),
            Self::Granular { strength, wavenumber, fraction, grains } => {
                let change = wavenumber * (2.0 * (1.0 - cos)).max(0.0).sqrt();
                dipole(strength * grains.spectrum(fraction, change))
            }
            Self::Leaves { area_per_m, eps, thickness_m, k0 } => {
                // A mirror turns a ray by 180 degrees minus twice the angle of incidence.
                let cos_incidence = ((1.0 - cos) * 0.5).max(1e-12).sqrt();
                let r = coherent_reflection(&leaf(eps, thickness_m), k0, cos_incidence);
                [r.power_h, r.power_v, r.cross.re].map(|p| 0.5 * area_per_m * p)
            }
        }
    }
}

impl Scatterer {
    /// Leaves of all orientations: each is a plane slab that mirrors, passes and absorbs.
    ///
    /// Leaves with normals in all directions meet a ray `area/2` times on a metre, and their mirrored rays go into all directions alike, but
    /// for the reflectivity. The part that passes a leaf goes on as if there were none.
    ///
    /// # Reference
    /// Wegmueller, Maetzler & Njoku 1995, IEEE Trans. Geosci. Remote Sens. 33, 1084-1093, treat leaves as slabs in the same way.
    #[must_use]
    pub fn leaves(area_per_m: f64, eps: Complex64, thickness_m: f64, k0: f64) -> Self {
        let slab = leaf(eps, thickness_m);
        let absorbed: f64 = crate::surfaces::quadrature::gauss_legendre_on(24, 0.0, 1.0)
            .into_iter()
            .map(|(mu, w)| 2.0 * mu * w * coherent_absorption(&slab, k0, mu)[0].iter().sum::<f64>() * 0.5)
            .sum();
        Self { absorption_per_m: 0.5 * area_per_m * absorbed, phase: Phase::Leaves { area_per_m, eps, thickness_m, k0 } }
    }

    /// Coupling of the streams of the medium.
    pub(super) fn coupling(&self, streams: &MediumStreams) -> Coupling {
        if let Phase::Isotropic { scattering_per_m } = self.phase {
            let n = 2 * streams.mu.len();
            let mut all = Matrix::zeros(n, n);
            for i in 0..n {
                for j in 0..n {
                    all[(i, j)] = 0.25 * scattering_per_m * streams.weight[j / 2];
                }
            }
            return Coupling { forward: all.clone(), backward: all };
        }
        coupling(streams, |cos| self.phase.powers(cos))
    }

    /// Coefficient of scattering of unpolarised radiation, 1/m.
    #[must_use]
    pub fn scattering_per_m(&self) -> f64 {
        match self.phase {
            Phase::Isotropic { scattering_per_m } | Phase::Rayleigh { scattering_per_m } => scattering_per_m,
            _ => crate::surfaces::quadrature::gauss_legendre_on(48, -1.0, 1.0)
                .into_iter()
                .map(|(cos, w)| {
                    let [s1, s2, _] = self.phase.powers(cos);
                    0.25 * w * (s1 + s2)
                })
                .sum(),
        }
    }
}

/// A leaf as a slab in air.
fn leaf(eps: Complex64, thickness_m: f64) -> [Layer; 2] {
    [Layer { eps, thickness_m, temperature_k: 1.0 }, Layer { eps: AIR, thickness_m: f64::INFINITY, temperature_k: 1.0 }]
}

//! Geometric optics of a rough surface, with the treatment of multiple scattering.

use super::foam::Foam;
use super::quadrature::legendre_12;
use super::second_bounce::second_bounce;
use super::shadowing::Shadowing;
use super::slopes::Slopes;
use super::stack::Stack;
use super::wagner_lynch::{FacetIntegrals, FacetSurface, Rules, Sky, View, facet_integrals};

/// Treatment of the power that does not leave the surface after one reflection.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Closure {
    /// The power is lost. Emissivity and reflectivity add up to less than 1.
    Single,
    /// The surface absorbs the power, so it counts as emission. A reflectivity above 1, which Wagner shadowing can give, is set to 1.
    ReEmit,
    /// A second reflection is followed. The surface absorbs the rest.
    #[default]
    SecondBounce,
}

/// A rough surface in the limit of geometric optics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeometricOptics {
    /// Slopes of the facets.
    pub slopes: Slopes,
    /// Shadowing function.
    pub shadowing: Shadowing,
    /// Treatment of multiple scatter.
    pub closure: Closure,
    /// Patches of foam among the facets. The facets themselves do not know them; [`SurfaceModel`](super::SurfaceModel) does.
    pub foam: Option<Foam>,
}

/// Emission and reflection of a surface in one direction, `[h, v]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceResponse {
    /// Emissivity.
    pub emissivity: [f64; 2],
    /// Reflectivity, over all directions the power comes from.
    pub reflectivity: [f64; 2],
    /// The part of the reflectivity along the mirror ray.
    pub mirrored: [f64; 2],
    /// The part of the reflectivity of the [diffuse lobe](super::DiffuseLobe). The rest is that of facets.
    pub diffuse: [f64; 2],
    /// Brightness the surface emits, K.
    pub emitted_k: [f64; 2],
    /// Sky brightness that it scatters to the observer, K.
    pub scattered_sky_k: [f64; 2],
}

impl SurfaceResponse {
    /// Brightness of surface and sky together, K.
    #[must_use]
    pub fn brightness_k(&self) -> [f64; 2] {
        [0, 1].map(|p| self.emitted_k[p] + self.scattered_sky_k[p])
    }
}

impl GeometricOptics {
    /// Facets with Smith shadowing and the default closure, without foam.
    #[must_use]
    pub fn new(slopes: Slopes) -> Self {
        Self { slopes, shadowing: Shadowing::default(), closure: Closure::default(), foam: None }
    }

    fn surface<'a>(&'a self, stack: &'a Stack) -> FacetSurface<'a> {
        FacetSurface { stack, slopes: &self.slopes, shadowing: self.shadowing }
    }

    /// The integrals over visible facets: emission and one reflection, without closure.
    ///
    /// Angles in radians, checked by the caller: zenith 0 to below 90 degrees; azimuth of the
    /// observer from the first slope axis.
    #[must_use]
    pub fn integrals(&self, stack: &Stack, theta_rad: f64, azimuth_rad: f64, sky: Sky<'_>) -> FacetIntegrals {
        let view = View::new(&self.slopes, theta_rad, azimuth_rad, sky);
        facet_integrals(self.surface(stack), &view, sky, Rules::default())
    }

    /// Response of the facets, with the closure of this surface.
    ///
    /// Angles as in [`GeometricOptics::integrals`].
    #[must_use]
    pub fn response(&self, stack: &Stack, theta_rad: f64, azimuth_rad: f64, sky: Sky<'_>) -> SurfaceResponse {
        let view = View::new(&self.slopes, theta_rad, azimuth_rad, sky);
        let once = facet_integrals(self.surface(stack), &view, sky, Rules::default());
        let mut reflectivity = once.reflectivity;
        let mut scattered_sky_k = once.scattered_sky_k;
        if self.closure == Closure::Single {
            let (emissivity, emitted_k) = (once.emissivity, once.emitted_k);
            return SurfaceResponse { emissivity, reflectivity, mirrored: [0.0; 2], diffuse: [0.0; 2], emitted_k, scattered_sky_k };
        }
        if self.closure == Closure::SecondBounce {
            let twice = second_bounce(self.surface(stack), &view, sky, once.escaping, legendre_12());
            for p in 0..2 {
                reflectivity[p] += twice.reflectivity[p];
                scattered_sky_k[p] += twice.scattered_sky_k[p];
            }
        }
        // Near grazing angles, Wagner shadowing can give a reflectivity above 1.
        for p in 0..2 {
            if reflectivity[p] > 1.0 {
                scattered_sky_k[p] /= reflectivity[p];
                reflectivity[p] = 1.0;
            }
        }
        let emissivity = reflectivity.map(|r| 1.0 - r);
        // Layers may have different temperatures. Multiply scattered power is absorbed in the same layers as the visible facets emit from.
        let emitted_k = [0, 1].map(|p| {
            let mean_k = if once.emissivity[p] > 1e-9 { once.emitted_k[p] / once.emissivity[p] } else { stack.top_temperature_k() };
            emissivity[p] * mean_k
        });
        SurfaceResponse { emissivity, reflectivity, mirrored: [0.0; 2], diffuse: [0.0; 2], emitted_k, scattered_sky_k }
    }
}

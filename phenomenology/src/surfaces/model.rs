//! A surface of a scene at one frequency: layers, roughness and a canopy.

use super::choudhury79::QhRoughness;
use super::error::{SurfaceError, bounded, cos_incidence};
use super::fresnel::Reflection;
use super::geometric_optics::SurfaceResponse;
use super::roughness::Roughness;
use super::stack::Stack;
use super::tau_omega::Canopy;
use super::volume_response::volume_response;
use super::wagner_lynch::Sky;
use super::wegmuller_matzler99::wegmuller_matzler99;
use crate::constants::SPEED_OF_LIGHT_M_S;
use std::f64::consts::TAU;

/// A surface at one frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceModel {
    /// Its layers.
    pub stack: Stack,
    /// Its roughness.
    pub roughness: Roughness,
    /// Vegetation on it.
    pub canopy: Option<Canopy>,
}

impl SurfaceModel {
    /// A surface without canopy.
    #[must_use]
    pub fn new(stack: Stack, roughness: Roughness) -> Self {
        Self { stack, roughness, canopy: None }
    }

    /// Reflection at an angle of incidence: amplitudes and powers with roughness, without the canopy.
    ///
    /// For facets, the powers are the sums over all directions that scatter to the observer, and the phases are those of a smooth surface.
    ///
    /// # Errors
    /// [`SurfaceError::Angle`], or an angle beyond the fit of the roughness.
    pub fn reflection(&self, theta_rad: f64) -> Result<Reflection, SurfaceError> {
        let cos = cos_incidence(theta_rad)?;
        self.check_roughness()?;
        let smooth = self.stack.reflection_cos(cos);
        match self.roughness {
            Roughness::Smooth => Ok(smooth),
            Roughness::Qh(qh) => Ok(qh.apply(&smooth, cos)),
            Roughness::Choudhury { rms_height_m } => Ok(QhRoughness::choudhury79(self.k0(), rms_height_m).apply(&smooth, cos)),
            Roughness::WegmullerMatzler { rms_height_m } => wegmuller_matzler99(&smooth, theta_rad, self.k0() * rms_height_m),
            Roughness::GeometricOptics(go) => {
                let cold = |_: f64| 0.0;
                let r = go.response(&self.stack, theta_rad, 0.0, Sky::Symmetric(&cold));
                Ok(smooth.with_powers(r.reflectivity[0], r.reflectivity[1]))
            }
        }
    }

    /// Emissivity, reflectivity, emission and scattered sky towards an observer.
    ///
    /// `azimuth_rad` is the azimuth of the observer from the first slope axis. It matters only for facets of unequal slopes. Specular
    /// surfaces reflect the sky in the mirror direction.
    ///
    /// # Errors
    /// [`SurfaceError::Angle`], [`SurfaceError::Azimuth`], or an angle beyond the fit of the
    /// roughness.
    pub fn response(&self, theta_rad: f64, azimuth_rad: f64, sky: Sky<'_>) -> Result<SurfaceResponse, SurfaceError> {
        let cos = cos_incidence(theta_rad)?;
        if bounded("azimuth", azimuth_rad, -1e6, 1e6).is_err() {
            return Err(SurfaceError::Azimuth { degrees: azimuth_rad.to_degrees() });
        }
        self.check_roughness()?;
        let mut response = match (volume_response(&self.stack, cos, azimuth_rad, sky), self.roughness) {
            (Some(response), _) => response,
            (None, Roughness::GeometricOptics(go)) => go.response(&self.stack, theta_rad, azimuth_rad, sky),
            (None, _) => self.specular_response(theta_rad, cos, sky_at_mirror(sky, theta_rad, azimuth_rad))?,
        };
        if let Some(canopy) = self.canopy {
            let sky_k = sky_at_mirror(sky, theta_rad, azimuth_rad);
            response = under_canopy(&canopy, &response, cos, sky_k);
        }
        Ok(response)
    }

    /// The part of the reflection of a stack that scatters that goes along the mirror ray, through the canopy: powers `[h, v]`; 0 for other stacks.
    ///
    /// # Errors
    /// [`SurfaceError::Angle`].
    pub fn mirrored_by_volume(&self, theta_rad: f64) -> Result<[f64; 2], SurfaceError> {
        let cos = cos_incidence(theta_rad)?;
        let through = self.canopy.map_or(1.0, |c| (-2.0 * c.tau_np / cos.max(1e-9)).exp());
        Ok(self.stack.volume().map_or([0.0; 2], |volume| volume.budget(cos).mirrored.map(|r| r * through)))
    }

    /// Brightness `[h, v]` that the surface emits, K. Each layer has its own temperature.
    ///
    /// # Errors
    /// As [`SurfaceModel::response`].
    pub fn emission_k(&self, theta_rad: f64, azimuth_rad: f64) -> Result<[f64; 2], SurfaceError> {
        let cold = |_: f64| 0.0;
        let response = self.response(theta_rad, azimuth_rad, Sky::Symmetric(&cold))?;
        Ok(response.emitted_k)
    }

    /// Brightness `[h, v]` of surface and sky, K.
    ///
    /// # Errors
    /// As [`SurfaceModel::response`].
    pub fn brightness_k(&self, theta_rad: f64, azimuth_rad: f64, sky: Sky<'_>) -> Result<[f64; 2], SurfaceError> {
        Ok(self.response(theta_rad, azimuth_rad, sky)?.brightness_k())
    }

    /// Refuses roughness on a stack that scatters, for which there is no model.
    fn check_roughness(&self) -> Result<(), SurfaceError> {
        if self.stack.volume().is_none() || self.roughness == Roughness::Smooth {
            return Ok(());
        }
        let message = "the surface has roughness and layers that scatter; give it one of them, because no model here has both";
        Err(SurfaceError::Refused(message.to_owned()))
    }

    fn k0(&self) -> f64 {
        TAU * self.stack.freq_hz() / SPEED_OF_LIGHT_M_S
    }

    fn specular_response(&self, theta_rad: f64, cos: f64, sky_k: f64) -> Result<SurfaceResponse, SurfaceError> {
        let reflection = self.reflection(theta_rad)?;
        let reflectivity = reflection.powers();
        let emissivity = reflection.emissivities();
        let (smooth, mut emitted) = self.stack.local_cos(cos);
        let mut absorbed = smooth.emissivities();
        if let Roughness::Qh(qh) = self.roughness {
            emitted = qh.mix(emitted);
            absorbed = qh.mix(absorbed);
        }
        // The emission that roughness adds has the same mean temperature as the smooth emission.
        let emitted_k = [0, 1].map(|p| {
            let mean_k = if absorbed[p] > 1e-9 { emitted[p] / absorbed[p] } else { self.stack.top_temperature_k() };
            emissivity[p] * mean_k
        });
        Ok(SurfaceResponse { emissivity, reflectivity, emitted_k, scattered_sky_k: reflectivity.map(|r| r * sky_k) })
    }
}

/// Sky brightness in the mirror direction, on the side of the surface opposite to the observer.
fn sky_at_mirror(sky: Sky<'_>, theta_rad: f64, azimuth_rad: f64) -> f64 {
    match sky {
        Sky::Symmetric(t) => t(theta_rad),
        Sky::Full(t) => {
            let (s, c) = (azimuth_rad + std::f64::consts::PI).sin_cos();
            t(theta_rad, s.atan2(c))
        }
    }
}

/// The response through a canopy. The sky that leaves scatter is taken at the mirror angle.
fn under_canopy(canopy: &Canopy, ground: &SurfaceResponse, cos: f64, sky_k: f64) -> SurfaceResponse {
    let mut out = *ground;
    for p in 0..2 {
        let b = canopy.budget(ground.reflectivity[p], cos);
        out.emissivity[p] = b.canopy + ground.emissivity[p] * b.ground;
        out.emitted_k[p] = b.canopy * canopy.temperature_k + ground.emitted_k[p] * b.ground;
        out.reflectivity[p] = b.mirrored_sky + b.scattered_sky;
        out.scattered_sky_k[p] = ground.scattered_sky_k[p] * b.ground * b.ground + b.scattered_sky * sky_k;
    }
    out
}

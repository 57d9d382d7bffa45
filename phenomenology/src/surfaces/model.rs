//! A surface of a scene at one frequency: layers, roughness and a canopy.

use super::choudhury79::QhRoughness;
use super::diffuse::DiffuseLobe;
use super::error::{SurfaceError, bounded, cos_incidence};
use super::foam::Foam;
use super::fresnel::Reflection;
use super::geometric_optics::{GeometricOptics, SurfaceResponse};
use super::roughness::Roughness;
use super::stack::Stack;
use super::tau_omega::Canopy;
use super::volume_response::volume_response;
use super::wagner_lynch::Sky;
use super::wegmuller_matzler99::{WEGMULLER_MAX_RAD, wegmuller_matzler99};
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
                let [h, v] = self.facet_response(go, theta_rad, 0.0, Sky::Symmetric(&cold), 0.0).reflectivity;
                Ok(smooth.with_powers(h, v))
            }
        }
    }

    /// Emissivity, reflectivity, emission and scattered sky towards an observer.
    ///
    /// `azimuth_rad` is the azimuth of the observer from the first slope axis. It matters only for facets of unequal slopes. What is mirrored
    /// shows the sky in the mirror direction, and the [diffuse lobe](Self::lobe) shows the whole sky.
    ///
    /// # Errors
    /// [`SurfaceError::Angle`], [`SurfaceError::Azimuth`], or an angle beyond the fit of the
    /// roughness.
    pub fn response(&self, theta_rad: f64, azimuth_rad: f64, sky: Sky<'_>) -> Result<SurfaceResponse, SurfaceError> {
        self.response_with(self.lobe()?.as_ref(), theta_rad, azimuth_rad, sky)
    }

    /// [`Self::response`] for many angles: `lobe` is what [`Self::lobe`] gave.
    ///
    /// # Errors
    /// As [`Self::response`].
    pub fn response_with(
        &self,
        lobe: Option<&DiffuseLobe>,
        theta_rad: f64,
        azimuth_rad: f64,
        sky: Sky<'_>,
    ) -> Result<SurfaceResponse, SurfaceError> {
        let cos = cos_incidence(theta_rad)?;
        if bounded("azimuth", azimuth_rad, -1e6, 1e6).is_err() {
            return Err(SurfaceError::Azimuth { degrees: azimuth_rad.to_degrees() });
        }
        self.check_roughness()?;
        let lobe_k = lobe.map_or(0.0, |lobe| lobe.mean_sky(&|zenith| sky.mean(zenith)));
        let mut response = match (volume_response(&self.stack, cos, azimuth_rad, sky), self.roughness) {
            (Some(response), _) => response,
            (None, Roughness::GeometricOptics(go)) => self.facet_response(go, theta_rad, azimuth_rad, sky, lobe_k),
            (None, _) => self.plane_response(theta_rad, cos, sky.mirrored(theta_rad, azimuth_rad), lobe_k)?,
        };
        if let Some(canopy) = self.canopy {
            response = under_canopy(&canopy, &response, cos, lobe_k);
        }
        Ok(response)
    }

    /// The diffuse lobe of canopy, foam, small-scale roughness and layers that scatter; `None` for a surface that has none of them.
    ///
    /// # Errors
    /// Roughness on a stack that scatters.
    pub fn lobe(&self) -> Result<Option<DiffuseLobe>, SurfaceError> {
        self.check_roughness()?;
        let rough = match self.roughness {
            Roughness::Smooth => false,
            Roughness::GeometricOptics(go) => go.foam.is_some_and(|foam| foam.cover > 0.0),
            _ => true,
        };
        if rough || self.stack.volume().is_some() || self.canopy.is_some_and(|c| c.omega > 0.0) {
            return DiffuseLobe::new(|theta| self.diffuse_albedo(theta));
        }
        Ok(None)
    }

    /// Power `[h, v]` that the diffuse lobe reflects to an observer from a sky of 1. Beyond the fit of a roughness it stays the same.
    ///
    /// # Errors
    /// [`SurfaceError::Angle`].
    pub fn diffuse_albedo(&self, theta_rad: f64) -> Result<[f64; 2], SurfaceError> {
        let theta_rad = match self.roughness {
            Roughness::WegmullerMatzler { .. } => theta_rad.min(WEGMULLER_MAX_RAD),
            _ => theta_rad,
        };
        let cos = cos_incidence(theta_rad)?;
        let of_ground = match (self.stack.volume(), self.roughness) {
            (Some(volume), _) => volume.budget(cos).diffuse,
            (None, Roughness::GeometricOptics(go)) => go.foam.map_or([0.0; 2], |foam| foam.albedo(theta_rad)),
            (None, _) => self.plane_parts(theta_rad, cos)?.1,
        };
        let Some(canopy) = self.canopy else { return Ok(of_ground) };
        let whole = self.reflection(theta_rad)?.powers();
        Ok([0, 1].map(|p| {
            let b = canopy.budget(whole[p], cos);
            of_ground[p] * b.ground * b.ground + b.scattered_sky
        }))
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

    /// Response of facets and the foam among them. `lobe_k` is the sky that foam scatters, K.
    fn facet_response(&self, go: GeometricOptics, theta_rad: f64, azimuth_rad: f64, sky: Sky<'_>, lobe_k: f64) -> SurfaceResponse {
        let facets = go.response(&self.stack, theta_rad, azimuth_rad, sky);
        match go.foam {
            Some(foam) => among_foam(&foam, &facets, theta_rad, self.stack.top_temperature_k(), lobe_k),
            None => facets,
        }
    }

    /// Reflection into all directions, and the power `[h, v]` of it that is diffuse, of a surface without facets.
    ///
    /// The models of small-scale roughness give a power only. Its mirrored part is what a surface of Gaussian heights reflects coherently, and
    /// what roughness moves from the other polarisation is diffuse.
    ///
    /// # Reference
    /// Ament 1953, Proc. IRE 41, 142: the coherent share is `exp(-(2 k s cos)^2)`, `s` the rms height.
    fn plane_parts(&self, theta_rad: f64, cos: f64) -> Result<(Reflection, [f64; 2]), SurfaceError> {
        let reflection = self.reflection(theta_rad)?;
        let (height, unmixed) = match self.roughness {
            Roughness::Smooth | Roughness::GeometricOptics(_) => return Ok((reflection, [0.0; 2])),
            Roughness::Qh(qh) => {
                (qh.h, QhRoughness { q: 0.0, ..qh }.apply(&self.stack.reflection_cos(cos), cos).powers().map(|r| r * (1.0 - qh.q)))
            }
            Roughness::Choudhury { rms_height_m } | Roughness::WegmullerMatzler { rms_height_m } => {
                ((2.0 * self.k0() * rms_height_m).powi(2), self.stack.reflection_cos(cos).powers())
            }
        };
        let coherent = (-height * cos * cos).exp();
        let whole = reflection.powers();
        Ok((reflection, [0, 1].map(|p| whole[p] - coherent * unmixed[p].min(whole[p]))))
    }

    fn plane_response(&self, theta_rad: f64, cos: f64, mirror_k: f64, lobe_k: f64) -> Result<SurfaceResponse, SurfaceError> {
        let (reflection, diffuse) = self.plane_parts(theta_rad, cos)?;
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
        let mirrored = [0, 1].map(|p| reflectivity[p] - diffuse[p]);
        let scattered_sky_k = [0, 1].map(|p| mirrored[p] * mirror_k + diffuse[p] * lobe_k);
        Ok(SurfaceResponse { emissivity, reflectivity, mirrored, diffuse, emitted_k, scattered_sky_k })
    }
}

/// The response of facets with patches of foam among them. The foam has the temperature `foam_k` and scatters the sky `lobe_k`.
fn among_foam(foam: &Foam, facets: &SurfaceResponse, theta_rad: f64, foam_k: f64, lobe_k: f64) -> SurfaceResponse {
    let open = 1.0 - foam.cover;
    let albedo = foam.albedo(theta_rad);
    let emitted = albedo.map(|a| foam.cover - a);
    let with = |of_facets: [f64; 2], of_foam: [f64; 2]| [0, 1].map(|p| open * of_facets[p] + of_foam[p]);
    SurfaceResponse {
        emissivity: with(facets.emissivity, emitted),
        reflectivity: with(facets.reflectivity, albedo),
        mirrored: with(facets.mirrored, [0.0; 2]),
        diffuse: with(facets.diffuse, albedo),
        emitted_k: with(facets.emitted_k, emitted.map(|e| e * foam_k)),
        scattered_sky_k: with(facets.scattered_sky_k, albedo.map(|a| a * lobe_k)),
    }
}

/// The response through a canopy. `lobe_k` is the sky that the leaves scatter, K.
fn under_canopy(canopy: &Canopy, ground: &SurfaceResponse, cos: f64, lobe_k: f64) -> SurfaceResponse {
    let mut out = *ground;
    for p in 0..2 {
        let b = canopy.budget(ground.reflectivity[p], cos);
        out.emissivity[p] = b.canopy + ground.emissivity[p] * b.ground;
        out.emitted_k[p] = b.canopy * canopy.temperature_k + ground.emitted_k[p] * b.ground;
        let through = b.ground * b.ground;
        out.reflectivity[p] = b.mirrored_sky + b.scattered_sky;
        out.mirrored[p] = ground.mirrored[p] * through;
        out.diffuse[p] = ground.diffuse[p] * through + b.scattered_sky;
        out.scattered_sky_k[p] = ground.scattered_sky_k[p] * through + b.scattered_sky * lobe_k;
    }
    out
}

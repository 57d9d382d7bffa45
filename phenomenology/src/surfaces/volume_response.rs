//! What a surface that scatters inside shows to an observer under a real sky.

use super::geometric_optics::SurfaceResponse;
use super::stack::Stack;
use super::wagner_lynch::Sky;
use std::f64::consts::{PI, TAU};

/// Azimuths over which a sky that depends on azimuth is averaged.
const AZIMUTHS: usize = 16;

/// The response of a stack that scatters, at a cosine of incidence.
///
/// The mirrored part shows the sky in the mirror direction, and the diffuse part the whole sky, weighted by the solution of the equation of
/// transfer. Emissivity and reflectivity add up to 1, so an isothermal enclosure shows its temperature.
pub(super) fn volume_response(stack: &Stack, cos: f64, azimuth_rad: f64, sky: Sky<'_>) -> Option<SurfaceResponse> {
    let volume = stack.volume()?;
    let budget = volume.budget(cos);
    let theta = cos.acos();
    let (mirror_k, mean): (f64, Box<dyn Fn(f64) -> f64>) = match sky {
        Sky::Symmetric(t) => (t(theta), Box::new(t)),
        Sky::Full(t) => {
            let wrapped = |azimuth: f64| azimuth.sin().atan2(azimuth.cos());
            let mean = move |zenith: f64| {
                (0..AZIMUTHS).map(|k| t(zenith, wrapped(TAU * k as f64 / AZIMUTHS as f64))).sum::<f64>() / AZIMUTHS as f64
            };
            (t(theta, wrapped(azimuth_rad + PI)), Box::new(mean))
        }
    };
    let diffuse_k = volume.diffuse_sky_k(cos, &mean);
    let reflectivity = [0, 1].map(|p| budget.mirrored[p] + budget.diffuse[p]);
    Some(SurfaceResponse {
        emissivity: reflectivity.map(|r| 1.0 - r),
        reflectivity,
        emitted_k: stack.emission_cos(cos),
        scattered_sky_k: [0, 1].map(|p| budget.mirrored[p] * mirror_k + diffuse_k[p]),
    })
}

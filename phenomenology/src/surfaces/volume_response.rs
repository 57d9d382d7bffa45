//! What a surface that scatters inside shows to an observer under a real sky.

use super::geometric_optics::SurfaceResponse;
use super::stack::Stack;
use super::wagner_lynch::Sky;

/// The response of a stack that scatters, at a cosine of incidence.
///
/// The mirrored part shows the sky in the mirror direction, and the diffuse part the whole sky, weighted by the solution of the equation of
/// transfer. Emissivity and reflectivity add up to 1, so an isothermal enclosure shows its temperature.
pub(super) fn volume_response(stack: &Stack, cos: f64, azimuth_rad: f64, sky: Sky<'_>) -> Option<SurfaceResponse> {
    let volume = stack.volume()?;
    let budget = volume.budget(cos);
    let mirror_k = sky.mirrored(cos.acos(), azimuth_rad);
    let diffuse_k = volume.diffuse_sky_k(cos, &|zenith| sky.mean(zenith));
    let reflectivity = [0, 1].map(|p| budget.mirrored[p] + budget.diffuse[p]);
    Some(SurfaceResponse {
        emissivity: reflectivity.map(|r| 1.0 - r),
        reflectivity,
        mirrored: budget.mirrored,
        diffuse: budget.diffuse,
        emitted_k: stack.emission_cos(cos),
        scattered_sky_k: [0, 1].map(|p| budget.mirrored[p] * mirror_k + diffuse_k[p]),
    })
}

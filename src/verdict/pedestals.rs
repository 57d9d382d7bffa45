//! Whether the constant that was removed from a scene is the right one.

use super::finding::Finding;
use cittert_arrays::VisibilityHeader;

/// Largest departure of the pedestal from the right one, relative to the larger of the two.
const OFF: f64 = 0.05;
/// A departure by less than this does not matter, K.
const SMALL_K: f64 = 1.0;

/// A pedestal that does not suit the scene, where the set knows which one does.
///
/// No baseline measures the zero spacing, so an image keeps most of the difference as an error of its level, with a step at the edges of the frame.
/// The visibilities alone rarely show it.
#[must_use]
pub fn of_pedestal(header: &VisibilityHeader) -> Option<Finding> {
    let right = header.scene_pedestal_k?;
    let removed = header.pedestal_k.unwrap_or(0.0);
    let off = (removed - right).abs();
    (off > SMALL_K.max(OFF * removed.abs().max(right.abs()))).then(|| {
        let why = if right == 0.0 { "the background of the scene is cold" } else { "it is the mean of the scene" };
        let says = format!(
            "a constant of {removed:.1} K was removed from the scene, and {right:.1} K is right because {why}: the level of the image is wrong by up to {off:.1} K"
        );
        Finding::new("pedestal", says, "simulate with --pedestal auto")
    })
}

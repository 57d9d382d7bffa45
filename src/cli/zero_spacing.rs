//! Where the mean of an image is known from: total power, or nothing.

use super::context::Context;
use crate::imaging::{Imager, MeanFrom};
use serde_json::{Value, json};

/// Say where the mean of the image is known from, and return it for the results. `given` is true where the user states the flux.
pub(super) fn of(imager: &Imager<'_>, given: bool, context: &Context) -> Value {
    let from = if given { MeanFrom::Given } else { imager.mean_from() };
    if !given {
        imager.say_mean(&context.console);
    }
    let zero = imager.zero_spacing(0);
    json!({
        "from": from.name(), "known": from != MeanFrom::Unknown, "zero_spacing": zero.map(|z| z.value),
        "zero_spacing_sigma": zero.map(|z| z.sigma), "n_autocorrelations_used": imager.survey().total_power.used,
    })
}

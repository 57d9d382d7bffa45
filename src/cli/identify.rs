//! `identify`: count the unknowns that a calibration of an array can and cannot determine.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Result};
use super::options::load_layout;
use crate::calibrate::{IdentifyOptions, identify};
use clap::Args;
use serde_json::json;
use std::fmt::Write;

/// Options of `identify`.
#[derive(Debug, Args)]
pub struct IdentifyArgs {
    /// Name of a built-in layout, or a layout file.
    #[arg(value_name = "LAYOUT")]
    layout: String,
    #[command(flatten)]
    how: IdentifyOptions,
}

/// Count the unknowns and the observables, and name the combinations that no observable determines.
///
/// # Errors
/// A layout that cannot be read, or one too large for dense matrices.
pub fn run(args: &IdentifyArgs, _context: &Context) -> Result<Outcome> {
    let layout = load_layout(&args.layout)?;
    let r = identify(&layout, &args.how).context(format!("layout {}", args.layout))?;
    let modes: Vec<_> = r.modes.iter().map(|m| json!({ "name": m.name, "dimensions": m.dimensions })).collect();
    let json = json!({
        "layout": layout.name, "n_antennas": r.antennas, "n_baselines": r.baselines, "unique_baselines": r.unique_baselines,
        "gain_unknowns": r.gain_unknowns, "sky_unknowns": r.sky_unknowns, "observables": r.observables, "rank": r.rank,
        "null_dimensions": r.null_dimensions, "modes": modes, "closure_phases": r.closure_phases,
        "closure_amplitudes": r.closure_amplitudes, "condition": r.condition,
    });
    let mut text = format!(
        "{}: {} antennas, {} baselines, {} of them different\n\
         unknowns      {} of the antennas, {} of the sky\nobservables   {}\nrank          {} (condition {:.3e})\nnull space    {} dimensions\n",
        layout.name,
        r.antennas,
        r.baselines,
        r.unique_baselines,
        r.gain_unknowns,
        r.sky_unknowns,
        r.observables,
        r.rank,
        r.condition,
        r.null_dimensions
    );
    for m in &r.modes {
        // Writing to a String does not fail.
        let _ = writeln!(text, "  {:3} {}", m.dimensions, m.name);
    }
    let _ = write!(text, "independent closure phases {}, closure amplitudes {}", r.closure_phases, r.closure_amplitudes);
    Ok(Outcome::new(json, text))
}

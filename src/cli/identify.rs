//! `identify`: count the unknowns that a calibration of an array can and cannot determine.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Result};
use super::options::load_layout;
use crate::calibrate::{GainMode, IdentifyOptions, ModelKnowledge, identify};
use cittert_arrays::quantity::{Frequency, Length};
use clap::{Args, ValueEnum};
use serde_json::json;
use std::fmt::Write;

/// Options of `identify`.
#[derive(Debug, Args)]
pub struct IdentifyArgs {
    /// Name of a built-in layout, or a layout file.
    #[arg(value_name = "LAYOUT")]
    layout: String,
    /// Which part of the gains is solved for.
    #[arg(long, value_enum, default_value_t = GainMode::AmpPhase)]
    mode: GainMode,
    /// What is known about the sky.
    #[arg(long, value_enum, default_value_t = Knowledge::Free)]
    model: Knowledge,
    /// Frequency.
    #[arg(long, value_name = "FREQ", default_value = "1GHz")]
    freq: Frequency,
    /// Bandwidth over which delays are measured.
    #[arg(long, value_name = "FREQ", default_value = "100MHz")]
    bandwidth: Frequency,
    /// Baselines that differ by less than this count as the same.
    #[arg(long, value_name = "LENGTH", default_value = "0.1mm")]
    redundancy: Length,
}

/// What is known about the sky.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Knowledge {
    /// Everything.
    Known,
    /// The sky is one point of unknown position and flux.
    Point,
    /// Nothing: the visibility of every different baseline is an unknown.
    Free,
}

/// Count the unknowns and the observables, and name the combinations that no observable determines.
///
/// # Errors
/// A layout that cannot be read, or one too large for dense matrices.
pub fn run(args: &IdentifyArgs, _context: &Context) -> Result<Outcome> {
    let layout = load_layout(&args.layout)?;
    let model = match args.model {
        Knowledge::Known => ModelKnowledge::Known,
        Knowledge::Point => ModelKnowledge::UnknownPoint,
        Knowledge::Free => ModelKnowledge::FreeImage,
    };
    let options = IdentifyOptions {
        mode: args.mode,
        model,
        freq_hz: args.freq.si(),
        bandwidth_hz: args.bandwidth.si(),
        redundancy_m: args.redundancy.si(),
    };
    let r = identify(&layout, &options).context(format!("layout {}", args.layout))?;
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

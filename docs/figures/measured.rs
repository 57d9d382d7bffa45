//! Pictures of published measurements against the models.

use crate::{Drawn, Figure};
use cittert_phenomenology::measured::MEASURED_SETS;

/// One picture for each set: the model against the measurement as dots, and the line where both are equal.
pub(crate) fn draw() -> Drawn {
    for set in MEASURED_SETS.iter().filter(|s| s.name != "sea") {
        let comparison = set.comparison()?;
        let log = set.name == "opacity";
        let values = || comparison.points.iter().flat_map(|p| [p.measured, p.model]);
        let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
        let margin = if log { 0.0 } else { 0.05 * (high - low) };
        let unit = if set.unit == "1" { String::new() } else { format!(" [{}]", set.unit) };
        let title = format!("{}: bias {:.3}, rms {:.3}{unit}", set.describes, comparison.bias(), comparison.rms());
        let mut figure = Figure::new(&title, &format!("measured{unit}"), &format!("model{unit}")).log(log, log);
        figure.ours("equal", vec![(low - margin, low - margin), (high + margin, high + margin)]);
        figure.theirs(comparison.points.iter().map(|p| (p.measured, p.model)).collect());
        figure.save(&format!("measured-{}", set.name))?;
    }
    Ok(())
}

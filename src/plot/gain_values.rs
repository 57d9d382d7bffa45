//! The gains that a picture shows: one channel and one feed of a table, with the truth where it is known.

use crate::calibrate::GainDifferences;
use cittert_arrays::GainTable;
use ndarray::Array2;

/// The part of a gain that a picture shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GainQuantity {
    /// Phase, deg.
    #[default]
    Phase,
    /// Amplitude.
    Amplitude,
}

/// Values \[time, ant\] of the middle channel and the first feed; NaN where no gain is known.
pub(super) struct GainValues {
    pub(super) quantity: GainQuantity,
    pub(super) names: Vec<String>,
    pub(super) minutes: Vec<f64>,
    pub(super) solved: Array2<f64>,
    /// The truth, with the phases and scales of the solution that calibration cannot determine.
    pub(super) truth: Option<Array2<f64>>,
    /// Solved less true.
    pub(super) difference: Option<Array2<f64>>,
    /// Which channel and feed these are, where there are several.
    pub(super) part: String,
}

impl GainValues {
    pub(super) fn of(table: &GainTable, differences: Option<&GainDifferences>, quantity: GainQuantity) -> Self {
        let (n_time, n_ant, n_chan, n_feed) = table.gains.dim();
        let chan = n_chan / 2;
        let array = |value: &dyn Fn((usize, usize, usize, usize)) -> f64| {
            Array2::from_shape_fn((n_time, n_ant), |(t, a)| if table.flags[(t, a, chan, 0)] { f64::NAN } else { value((t, a, chan, 0)) })
        };
        let solved = array(&|at| match quantity {
            GainQuantity::Phase => table.gains[at].arg().to_degrees(),
            GainQuantity::Amplitude => table.gains[at].norm(),
        });
        let truth = differences.map(|d| {
            array(&|at| match quantity {
                GainQuantity::Phase => wrapped(table.gains[at].arg().to_degrees() - d.phase_rad[at].to_degrees()),
                GainQuantity::Amplitude => table.gains[at].norm() / d.log_amplitude[at].exp(),
            })
        });
        let difference = differences.map(|d| match quantity {
            GainQuantity::Phase => array(&|at| d.phase_rad[at].to_degrees()),
            GainQuantity::Amplitude => array(&|at| table.gains[at].norm() * (1.0 - (-d.log_amplitude[at]).exp())),
        });
        let first = table.time_jd.first().copied().unwrap_or_default();
        let mut part = Vec::new();
        if n_chan > 1 {
            part.push(format!("channel {} of {n_chan}", chan + 1));
        }
        if n_feed > 1 {
            part.push(format!("feed {}", table.feeds[0]));
        }
        Self {
            quantity,
            names: table.layout.antennas().iter().map(|a| a.name.clone()).collect(),
            minutes: table.time_jd.iter().map(|t| (t - first) * 1440.0).collect(),
            solved,
            truth,
            difference,
            part: part.join(", "),
        }
    }

    /// Name of the quantity with its unit.
    pub(super) fn label(&self) -> &'static str {
        match self.quantity {
            GainQuantity::Phase => "Phase (deg)",
            GainQuantity::Amplitude => "Amplitude",
        }
    }

    /// Ends of an axis that shows these values: round and symmetric for phases.
    pub(super) fn ends(&self, values: &[&Array2<f64>]) -> (f64, f64) {
        let finite = || values.iter().flat_map(|v| v.iter()).copied().filter(|v| v.is_finite());
        match self.quantity {
            GainQuantity::Phase => {
                let most = finite().fold(0.0_f64, |m, v| m.max(v.abs()));
                let reach = if most > 90.0 { 180.0 } else { (1.15 * most).max(1e-3) };
                (-reach, reach)
            }
            GainQuantity::Amplitude => {
                let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
                let margin = (0.1 * (high - low)).max(1e-3);
                if low <= high { (low - margin, high + margin) } else { (0.0, 2.0) }
            }
        }
    }

    /// Rms of what is left, where the truth is known.
    pub(super) fn rms(&self) -> Option<f64> {
        let finite: Vec<f64> = self.difference.as_ref()?.iter().copied().filter(|v| v.is_finite()).collect();
        let n = finite.len();
        (n > 0).then(|| (finite.iter().map(|v| v * v).sum::<f64>() / n as f64).sqrt())
    }
}

/// An angle between -180 and 180 deg.
fn wrapped(deg: f64) -> f64 {
    deg - 360.0 * (deg / 360.0).round()
}

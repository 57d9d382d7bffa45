//! What the data do not say about gains.

use super::finding::Finding;
use crate::calibrate::{FlagReason, SolveReport};

/// Fraction of the gains that may stay without a solution.
const WITHOUT: f64 = 0.1;

/// Gains that could not be solved, if they are many. Antennas without data do not count.
#[must_use]
pub fn of_gains(report: &SolveReport) -> Option<Finding> {
    let tried = report.flagged.iter().filter(|(why, _)| **why != FlagReason::NoData);
    let lost: usize = tried.clone().map(|(_, n)| n).sum();
    (lost as f64 > WITHOUT * (lost + report.solved) as f64).then(|| {
        let why: Vec<String> = tried.map(|(why, n)| format!("{n} with {}", why.name())).collect();
        let says =
            format!("{lost} of {} gains have no solution ({}), and their data stay as they were", lost + report.solved, why.join(", "));
        Finding::new("undetermined", says, "use a longer --solint, or flag these antennas")
    })
}

/// Directions in the space of the gains along which the image changes and the data fit equally well. `from_model` is true where a given model
/// fixes the position and the flux scale; `amplitudes` is true where amplitudes are solved.
#[must_use]
pub fn not_determined(from_model: bool, amplitudes: bool) -> Vec<&'static str> {
    let mut free = vec!["the common phase of all antennas"];
    if !from_model {
        free.push("a phase gradient over the array, which shifts the image");
        if amplitudes {
            free.push("a common factor of the amplitudes, which is the flux scale");
        }
    }
    free
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_gains_without_a_solution_are_named() {
        let report = |solved, why, n| SolveReport { solved, flagged: [(why, n)].into(), ..SolveReport::default() };
        assert_eq!(of_gains(&report(95, FlagReason::LowSnr, 5)), None);
        assert_eq!(of_gains(&report(50, FlagReason::NoData, 50)), None);
        let found = of_gains(&report(80, FlagReason::Singular, 20)).unwrap();
        assert!(found.name == "undetermined" && found.says.contains("20 of 100") && found.says.contains("not separable"), "{found:?}");
    }

    #[test]
    fn a_model_fixes_position_and_flux() {
        assert_eq!(not_determined(true, true).len(), 1);
        assert_eq!(not_determined(false, false).len(), 2);
        assert!(not_determined(false, true)[2].contains("flux scale"));
    }
}

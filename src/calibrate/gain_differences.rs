//! The difference of each solved gain from the true one, without the phases and scales that calibration cannot determine.

use super::degeneracy::{CompareOptions, solutions};
use crate::Result;
use cittert_arrays::GainTable;
use ndarray::Array4;

/// Differences of a table from the truth, with the axes of the table. Gains without a partner have NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct GainDifferences {
    /// Phase of the gain less that of the truth, rad \[solint, ant, chan, feed\].
    pub phase_rad: Array4<f64>,
    /// Logarithm of the amplitude over that of the truth \[solint, ant, chan, feed\].
    pub log_amplitude: Array4<f64>,
}

/// The differences of `found` from `truth`: antennas by name, intervals by time, channels by frequency, feeds by name. The common phase of
/// each solution is removed, and what `options` say.
///
/// # Errors
/// The shapes within a table do not agree, or a feed has no partner.
pub fn gain_differences(found: &GainTable, truth: &GainTable, options: CompareOptions) -> Result<GainDifferences> {
    let mut out = GainDifferences {
        phase_rad: Array4::from_elem(found.gains.dim(), f64::NAN),
        log_amplitude: Array4::from_elem(found.gains.dim(), f64::NAN),
    };
    let mut slope = [0.0; 2];
    for solution in solutions(found, truth)?.0 {
        let [t, c, f] = solution.at;
        let phases = solution.phases(options.gradient, &mut slope);
        for ((a, z), phase) in solution.antennas.iter().zip(&solution.ratio).zip(phases) {
            out.phase_rad[(t, *a, c, f)] = phase;
            out.log_amplitude[(t, *a, c, f)] = z.norm().ln();
        }
    }
    if options.flux_scale {
        let (sum, n) = out.log_amplitude.iter().filter(|v| v.is_finite()).fold((0.0, 0_usize), |(s, n), v| (s + v, n + 1));
        let mean = sum / n.max(1) as f64;
        out.log_amplitude.mapv_inplace(|v| v - mean);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::super::degeneracy::compare_gains;
    use super::*;
    use crate::closure::testdata::{Scene, T0_JD, cis, random_phases};

    /// The differences agree with what `compare_gains` sums up, and hold the errors that were put in.
    #[test]
    fn the_differences_are_those_that_the_comparison_sums_up() {
        let header = Scene::point(12, 1).header();
        let times = vec![T0_JD, T0_JD + 1e-3];
        let mut truth = GainTable::unity(header.layout, header.spectrum, vec!["I".into()], times, vec![80.0; 2]).unwrap();
        let (phase, error) = (random_phases(24, 3.0, 1), random_phases(24, 0.1, 2));
        let mut found = truth.clone();
        for ((t, a, _, _), g) in truth.gains.indexed_iter_mut() {
            *g = cis(phase[t * 12 + a]);
            found.gains[(t, a, 0, 0)] = 1.5 * *g * cis(error[t * 12 + a] + 2.0 + 0.01 * found.layout.antennas()[a].position_m[0]);
        }
        found.flags[(0, 3, 0, 0)] = true;
        let options = CompareOptions { gradient: true, flux_scale: true };
        let (each, all) = (gain_differences(&found, &truth, options).unwrap(), compare_gains(&found, &truth, options).unwrap());
        let finite: Vec<f64> = each.phase_rad.iter().copied().filter(|v| v.is_finite()).collect();
        assert_eq!((finite.len(), all.compared, all.flagged), (23, 23, 1));
        let rms = (finite.iter().map(|v| v * v).sum::<f64>() / 23.0).sqrt();
        assert!((rms - all.rms_phase_rad).abs() < 1e-9 && rms > 0.01 && rms < 0.2, "{rms} {}", all.rms_phase_rad);
        assert!(each.phase_rad[(0, 3, 0, 0)].is_nan());
        assert!(each.log_amplitude.iter().filter(|v| v.is_finite()).all(|v| v.abs() < 1e-12));
    }
}

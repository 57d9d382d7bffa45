//! A test whether the phases of a set can be calibrated.
//!
//! A baseline that is too short to resolve the field measures its total flux with a phase near 0. Where strong visibilities on such
//! baselines have other phases, the phases of the antennas are not calibrated, and an image of the data has no meaning.

use super::model::sees_unpolarized;
use super::over_ranks::of_all;
use crate::Result;
use crate::memory::MemoryBudget;
use cittert_arrays::{SPEED_OF_LIGHT_M_S, VisibilitySource, for_each_block};
use std::f64::consts::PI;

/// Largest phase that a positive source inside the field can have on a baseline that counts as unresolved, rad.
const SMALL_PHASE: f64 = 0.1;
/// Visibilities below this many sigmas do not count.
const SIGNIFICANT: f64 = 5.0;
/// Smallest number of visibilities for a decision.
const FEWEST: u64 = 10;

/// The visibilities of the baselines that do not resolve a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unresolved {
    /// Number of significant visibilities on such baselines.
    pub count: u64,
    /// Mean of cos(phase), weighted by amplitude: 1 for calibrated phases, 0 for arbitrary ones.
    pub coherence: f64,
}

impl Unresolved {
    /// True where the phases are certainly not calibrated.
    #[must_use]
    pub fn is_incoherent(&self) -> bool {
        self.count >= FEWEST && self.coherence < 0.5
    }
}

/// True if a baseline of this length in wavelengths resolves a field. Its visibilities may then have any phase.
#[must_use]
pub fn resolves(length_wl: f64, half_field_rad: f64) -> bool {
    2.0 * PI * length_wl * half_field_rad > SMALL_PHASE
}

/// Read a set and test the baselines that do not resolve a field of `half_field_rad` around the phase centre.
///
/// # Errors
/// The source cannot be read.
pub fn unresolved_phases(source: &mut dyn VisibilitySource, half_field_rad: f64) -> Result<Unresolved> {
    let header = source.header();
    let freq_hz = header.spectrum.freq_hz().to_vec();
    let pols: Vec<usize> = (0..header.polarizations.len()).filter(|p| sees_unpolarized(header.polarizations[*p])).collect();
    let (mut count, mut real, mut amplitude) = (0.0, 0.0, 0.0);
    let own = for_each_block(source, MemoryBudget::default().block(), |_, block| -> Result<()> {
        for row in 0..block.n_rows() {
            if block.coverage.ant1[row] == block.coverage.ant2[row] {
                continue;
            }
            let uv_m = block.coverage.uvw_m[(row, 0)].hypot(block.coverage.uvw_m[(row, 1)]);
            for (chan, f) in freq_hz.iter().enumerate() {
                if resolves(uv_m * f / SPEED_OF_LIGHT_M_S, half_field_rad) {
                    continue;
                }
                for &pol in &pols {
                    let w = f64::from(block.usable_weight(row, chan, pol));
                    let v = block.vis[(row, chan, pol)];
                    let size = f64::from(v.norm());
                    if w > 0.0 && size * w.sqrt() > SIGNIFICANT {
                        count += 1.0;
                        real += f64::from(v.re);
                        amplitude += size;
                    }
                }
            }
        }
        Ok(())
    });
    let sums = of_all(&*source.ranks(), own.map(|()| vec![count, real, amplitude]))?;
    let sum = |k: usize| sums.iter().filter_map(|of_one| of_one.get(k)).sum::<f64>();
    let (count, real, amplitude) = (sum(0) as u64, sum(1), sum(2));
    Ok(Unresolved { count, coherence: if amplitude > 0.0 { real / amplitude } else { 1.0 } })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closure::testdata::{Scene, cis};
    use crate::fixtures::in_processes;

    #[test]
    fn arbitrary_phases_on_short_baselines_are_seen() {
        let scene = Scene { sigma: 0.05, ..Scene::point(6, 3) };
        let mut good = scene.set(|_, _, _, _| cis(0.0));
        assert!(!unresolved_phases(&mut good, 1e-9).unwrap().is_incoherent());
        let mut bad = scene.set(|_, a, _, _| cis(2.1 * a as f64));
        let seen = unresolved_phases(&mut bad, 1e-9).unwrap();
        assert!(seen.is_incoherent(), "{seen:?}");
        for several in in_processes(3, &bad, |source| unresolved_phases(source, 1e-9).unwrap()) {
            assert!(several.count == seen.count && (several.coherence - seen.coherence).abs() < 1e-12, "{several:?}");
        }
        // If the baselines resolve the field, the phases can have any value.
        assert_eq!(unresolved_phases(&mut bad, 0.9).unwrap().count, 0);
    }
}

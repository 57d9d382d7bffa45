//! Closure phases and closure amplitudes of a set, which antenna gains do not change.
//!
//! They are formed in each integration and then averaged: the bispectrum V_ab V_bc V_ca by its vector mean, the logarithm of the
//! amplitude ratio by its weighted mean. Gains may therefore change from one integration to the next. Channels are kept, averaged after
//! the quantities are formed, or averaged before. The last is more sensitive, but then gains must not change over the band.
//!
//! # Reference
//! Jennison 1958, MNRAS 118, 276; Twiss, Carter & Little 1960, Observatory 80, 153; Rogers et al. 1974, ApJ 193, 293;
//! Blackburn et al. 2020, ApJ 894, 31 (errors).

use super::collect::{ClosureKey, collect, each_combination, sample};
use super::options::ClosureOptions;
use super::sets::{quadrangles, triangles};
use crate::progress::Observer;
use crate::{ChainError, Result, ensure};
use cittert_arrays::VisibilitySource;
use num_complex::Complex64;

/// Standard deviation of a uniformly random phase, pi / sqrt(3) rad.
const UNKNOWN_PHASE_RAD: f64 = 1.813_799_364_234_218;

/// arg(V_ab V_bc V_ca) for antennas a, b, c.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosurePhase {
    /// Where and when.
    pub key: ClosureKey,
    /// The antennas a < b < c.
    pub antennas: [usize; 3],
    /// The phase, rad.
    pub phase_rad: f64,
    /// Its standard deviation, rad. It is at most pi / sqrt(3), that of a uniformly random phase.
    pub sigma_rad: f64,
    /// Cube root of the modulus of the mean bispectrum, in the unit of the visibilities.
    pub amplitude: f64,
}

/// ln(|V_ab| |V_cd| / (|V_ac| |V_bd|)) for antennas a, b, c, d.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosureAmplitude {
    /// Where and when.
    pub key: ClosureKey,
    /// The antennas a, b, c, d.
    pub antennas: [usize; 4],
    /// Logarithm of the closure amplitude.
    pub log_amplitude: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// Form the closure phases of a set and give them to `emit` one by one, in order of time.
///
/// # Errors
/// There are fewer than 3 antennas, an interval is shorter than an integration, the rows of a set larger than the memory are not in order
/// of time, or the source or `emit` fails.
pub fn closure_phases(
    source: &mut dyn VisibilitySource,
    options: &ClosureOptions,
    observer: &dyn Observer,
    mut emit: impl FnMut(ClosurePhase) -> Result<()>,
) -> Result<()> {
    let n = source.header().layout.n_ant();
    ensure!(n >= 3, ChainError::NoData(format!("closure phases need at least 3 antennas, the array has {n}")));
    collect(source, options, observer, &mut |header, bin| {
        each_combination(header, options, bin, triangles, &mut |mut key, [a, b, c], blocks| {
            let (mut sum, mut variance, mut weight) = (Complex64::new(0.0, 0.0), 0.0, 0.0);
            for samples in blocks {
                let sides = [sample(n, samples, a, b), sample(n, samples, b, c), sample(n, samples, c, a)];
                let [Some(x), Some(y), Some(z)] = sides else { continue };
                let power = [x, y, z].map(|s| s.vis().norm_sqr());
                let clean = [x, y, z].map(|s| (s.vis().norm_sqr() - 2.0 * s.variance()).max(0.0));
                let w = 1.0 / (x.variance() + y.variance() + z.variance());
                sum += w * x.vis() * y.vis() * z.vis();
                // Half the variance of a product of noisy complex numbers: the part perpendicular to its direction.
                variance += w * w * (power.iter().product::<f64>() - clean.iter().product::<f64>()) / 2.0;
                weight += w;
                key.samples += 1;
            }
            if key.samples == 0 || sum.norm_sqr() == 0.0 {
                return Ok(());
            }
            emit(ClosurePhase {
                key,
                antennas: [a, b, c],
                phase_rad: sum.arg(),
                sigma_rad: (variance.sqrt() / sum.norm()).min(UNKNOWN_PHASE_RAD),
                amplitude: (sum.norm() / weight).cbrt(),
            })
        })
    })
}

/// Form the logarithms of the closure amplitudes of a set and give them to `emit` one by one, in order of time. They need no correction
/// for noise bias: the mean of ln|V| over complex Gaussian noise is ln|S| up to terms exp(-SNR^2 / 2).
///
/// # Errors
/// Fewer than 4 antennas, otherwise as [`closure_phases`].
pub fn closure_amplitudes(
    source: &mut dyn VisibilitySource,
    options: &ClosureOptions,
    observer: &dyn Observer,
    mut emit: impl FnMut(ClosureAmplitude) -> Result<()>,
) -> Result<()> {
    let n = source.header().layout.n_ant();
    ensure!(n >= 4, ChainError::NoData(format!("closure amplitudes need at least 4 antennas, the array has {n}")));
    collect(source, options, observer, &mut |header, bin| {
        each_combination(header, options, bin, quadrangles, &mut |mut key, [a, b, c, d], blocks| {
            let (mut sum, mut weight) = (0.0, 0.0);
            for samples in blocks {
                let sides = [sample(n, samples, a, b), sample(n, samples, c, d), sample(n, samples, a, c), sample(n, samples, b, d)];
                let [Some(x), Some(y), Some(z), Some(t)] = sides else { continue };
                let log = 0.5 * (x.vis().norm_sqr() * y.vis().norm_sqr() / (z.vis().norm_sqr() * t.vis().norm_sqr())).ln();
                let w = 1.0 / [x, y, z, t].iter().map(|s| s.variance() / s.vis().norm_sqr()).sum::<f64>();
                sum += w * log;
                weight += w;
                key.samples += 1;
            }
            if key.samples == 0 {
                return Ok(());
            }
            emit(ClosureAmplitude { key, antennas: [a, b, c, d], log_amplitude: sum / weight, sigma: weight.sqrt().recip() })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::options::ClosureChannels;
    use super::super::testdata::{Scene, cis, random_phases};
    use super::super::time::SolutionInterval;
    use super::*;
    use crate::progress::Silent;
    use cittert_arrays::VisibilitySet;

    fn phases(mut set: VisibilitySet, options: ClosureOptions) -> Vec<ClosurePhase> {
        let mut out = Vec::new();
        closure_phases(&mut set, &options, &Silent, |c| {
            out.push(c);
            Ok(())
        })
        .unwrap();
        out
    }

    fn amplitudes(mut set: VisibilitySet, options: ClosureOptions) -> Vec<ClosureAmplitude> {
        let mut out = Vec::new();
        closure_amplitudes(&mut set, &options, &Silent, |c| {
            out.push(c);
            Ok(())
        })
        .unwrap();
        out
    }

    fn scene() -> Scene {
        Scene { n_chan: 2, sources: vec![(0.0, 0.0, 1.0), (2e-4, 1e-4, 0.5), (-1e-4, 2e-4, 0.3)], ..Scene::point(7, 6) }
    }

    #[test]
    fn antenna_errors_leave_the_closures_alone() {
        let phase = random_phases(6 * 7, 3.0, 5);
        let gain = |t: usize, a: usize| Complex64::from_polar(1.0 + 0.4 * (a as f64).sin(), phase[t * 7 + a]);
        for all in [false, true] {
            for channels in [ClosureChannels::Each, ClosureChannels::AverageClosures, ClosureChannels::AverageVisibilities] {
                let options = ClosureOptions { all, channels, solint: SolutionInterval::Seconds(30.0) };
                let (clean, dirty) = (scene().set(|_, _, _, _| cis(0.0)), scene().set(|t, a, _, _| gain(t, a)));
                let (a, b) = (phases(clean.clone(), options), phases(dirty.clone(), options));
                let each = if channels == ClosureChannels::Each { 2 } else { 1 };
                assert_eq!(a.len(), 2 * each * if all { 35 } else { 15 });
                for (x, y) in a.iter().zip(&b) {
                    assert_eq!(x.antennas, y.antennas);
                    assert!(cis(x.phase_rad - y.phase_rad).arg().abs() < 1e-5);
                }
                assert!(a.iter().any(|x| x.phase_rad.abs() > 0.2), "the scene has closure phases");
                let (a, b) = (amplitudes(clean, options), amplitudes(dirty, options));
                assert_eq!(a.len(), 2 * each * if all { 105 } else { 14 });
                assert!(a.iter().zip(&b).all(|(x, y)| (x.log_amplitude - y.log_amplitude).abs() < 1e-5));
            }
        }
    }

    #[test]
    fn errors_are_those_of_the_scatter() {
        for (solint, sigma) in [(SolutionInterval::Integration, 0.1), (SolutionInterval::Seconds(100.0), 0.5)] {
            let options = ClosureOptions { solint, channels: ClosureChannels::AverageClosures, ..ClosureOptions::default() };
            let run = Scene { sigma, n_chan: 4, ..Scene::point(6, 200) }.set(|_, _, _, _| cis(0.0));
            let p = phases(run.clone(), options);
            let pull = (p.iter().map(|c| (c.phase_rad / c.sigma_rad).powi(2)).sum::<f64>() / p.len() as f64).sqrt();
            assert!((pull - 1.0).abs() < 0.15, "{solint:?}: {pull}");
            if sigma < 0.2 {
                let a = amplitudes(run, options);
                let pull = (a.iter().map(|c| (c.log_amplitude / c.sigma).powi(2)).sum::<f64>() / a.len() as f64).sqrt();
                assert!((pull - 1.0).abs() < 0.15, "{pull}");
            }
        }
    }

    #[test]
    fn flagged_data_are_left_out_and_small_arrays_refused() {
        let mut set = Scene::point(5, 1).set(|_, _, _, _| cis(0.0));
        set.data.flags[(0, 0, 0)] = true;
        let p = phases(set.clone(), ClosureOptions { all: true, ..ClosureOptions::default() });
        assert_eq!(p.len(), 7);
        assert!(p.iter().all(|c| !(c.antennas[0] == 0 && c.antennas[1] == 1)));
        assert_eq!(phases(set, ClosureOptions::default()).len(), 5);
        let mut two = Scene::point(2, 1).set(|_, _, _, _| cis(0.0));
        assert!(closure_phases(&mut two, &ClosureOptions::default(), &Silent, |_| Ok(())).unwrap_err().to_string().contains("3 antennas"));
    }
}

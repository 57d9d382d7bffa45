//! Complex gains of the antennas at every time, given the image.
//!
//! Amplitudes are the posterior means of the log gains (see [`StationAmplitudes`](super::station_term::StationAmplitudes)); phases maximise
//! sum w Re(V conj(M) e^(-i(phi_p - phi_q))), one antenna after the other. Each step is the exact maximum for its antenna.

use super::samples::Samples;
use super::station_term::LogGains;
use crate::{ChainError, Result};
use num_complex::Complex64;

/// Gains of all antennas; the data have g_p conj(g_q) times the model.
#[derive(Debug, Clone, PartialEq)]
pub struct StationGains {
    /// Gains \[moment, antenna\]; `None` where an antenna has no data.
    pub gains: Vec<Vec<Option<Complex64>>>,
}

/// Sweeps over the antennas of a moment.
const SWEEPS: usize = 200;
/// Change of a phase below which it has converged, rad.
const SETTLED_RAD: f64 = 1e-10;

impl StationGains {
    /// Solve for the phases, and take the amplitudes from `log` where they are given.
    #[must_use]
    pub fn solve(samples: &Samples, model: &[Complex64], log: Option<&LogGains>) -> Self {
        let n = samples.n_ant();
        let gains = samples.moments().iter().enumerate().map(|(t, moment)| {
            let mut phasor: Vec<Option<Complex64>> = vec![None; n];
            // Weighted products of data and conjugate model, for both antennas of each baseline.
            let mut links: Vec<Vec<(usize, Complex64)>> = vec![Vec::new(); n];
            for k in moment.clone() {
                let (p, q) = samples.pairs()[k];
                let z = samples.vis()[k] * model[k].conj() / samples.sigma()[k].powi(2);
                links[p].push((q, z));
                links[q].push((p, z.conj()));
            }
            // Antennas are added one by one, starting from the best one, so that every phase starts near its solution.
            let order: Vec<usize> = samples.by_information(moment).into_iter().filter(|a| !links[*a].is_empty()).collect();
            let mut left = order.clone();
            while !left.is_empty() {
                let strength = |a: usize| -> f64 { links[a].iter().filter(|(b, _)| phasor[*b].is_some()).map(|(_, z)| z.norm()).sum() };
                let next = left.iter().enumerate().max_by(|(i, a), (j, b)| strength(**a).total_cmp(&strength(**b)).then(j.cmp(i)));
                let Some(i) = next.map(|(i, _)| i) else { break };
                let a = left.remove(i);
                phasor[a] = Some(direction(&links[a], &phasor).unwrap_or(Complex64::new(1.0, 0.0)));
            }
            for _ in 0..SWEEPS {
                let mut moved = 0.0_f64;
                for a in order.iter().skip(1) {
                    if let (Some(old), Some(new)) = (phasor[*a], direction(&links[*a], &phasor)) {
                        moved = moved.max((new - old).norm());
                        phasor[*a] = Some(new);
                    }
                }
                if moved < SETTLED_RAD {
                    break;
                }
            }
            // An antenna without a usable amplitude keeps the amplitude 1.
            let size = |a: usize| log.and_then(|l| l.mean[t][a]).map_or(1.0, f64::exp);
            phasor.iter().enumerate().map(|(a, p)| p.map(|p| p * size(a))).collect()
        });
        Self { gains: gains.collect() }
    }

    /// Visibilities divided by the gains, and their errors.
    ///
    /// # Errors
    /// A visibility of an antenna without a gain.
    pub fn corrected(&self, samples: &Samples) -> Result<(Vec<Complex64>, Vec<f64>)> {
        let (mut vis, mut sigma) = (samples.vis().to_vec(), samples.sigma().to_vec());
        for (t, moment) in samples.moments().iter().enumerate() {
            for k in moment.clone() {
                let (p, q) = samples.pairs()[k];
                let (Some(gp), Some(gq)) = (self.gains[t][p], self.gains[t][q]) else {
                    return Err(ChainError::Incompatible(format!("baseline {p}-{q} has data and no gains in moment {t}")));
                };
                let g = gp * gq.conj();
                vis[k] /= g;
                sigma[k] /= g.norm();
            }
        }
        Ok((vis, sigma))
    }
}

/// The phase of an antenna that fits its data best, given the others.
fn direction(links: &[(usize, Complex64)], phasor: &[Option<Complex64>]) -> Option<Complex64> {
    let sum: Complex64 = links.iter().filter_map(|(b, z)| phasor[*b].map(|p| z * p)).sum();
    (sum.norm_sqr() > 0.0).then(|| sum / sum.norm())
}

#[cfg(test)]
mod tests {
    use super::super::samples::fixture::{corrupted, samples, with};
    use super::*;

    #[test]
    fn injected_gains_come_back_and_leave_the_model() {
        let s = samples(7, 4);
        let truth = |t: usize, a: usize| Complex64::from_polar(1.0, (t * 3 + a * a) as f64);
        let bad = with(&s, corrupted(&s, s.vis(), truth));
        let (vis, _) = StationGains::solve(&bad, s.vis(), None).corrected(&bad).unwrap();
        for (v, m) in vis.iter().zip(s.vis()) {
            assert!((v - m).norm() < 1e-6, "{v} {m}");
        }
    }
}

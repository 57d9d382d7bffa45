//! The frequencies within each channel at which a scene is observed, and their weights for each pair of antennas.
//!
//! The panels between the corners of all responses are integrated by Gauss-Legendre rules. A panel has as few nodes as bring the response to the
//! largest delay of the scene within [`ACCURACY`], or is halved.

use super::receiver::Receivers;
use crate::linalg::gauss_legendre;
use crate::values::need;
use crate::{ChainError, Result};
use cittert_arrays::{ArrayLayout, Image, SPEED_OF_LIGHT_M_S, SpectralWindow};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Error of a panel relative to the power of the band.
const ACCURACY: f64 = 2e-7;
/// Numbers of nodes that a panel may have.
const RULES: [usize; 8] = [1, 2, 3, 4, 6, 8, 12, 16];
/// Nodes of the rule by which the others are judged.
const FINE: usize = 24;
/// Most nodes in a channel.
const MOST: usize = 4096;
/// Most halvings of a panel.
const DEEPEST: usize = 24;

/// Nodes and weights for every channel.
#[derive(Debug, Clone)]
pub(crate) struct BandNodes {
    /// Frequencies, Hz \[chan\]\[node\].
    pub(crate) freq_hz: Vec<Vec<f64>>,
    /// Response of an antenna times the root of the weight of the node, so that the sum of its square is 1 \[ant\]\[chan\]\[node\].
    response: Vec<Vec<Vec<Complex64>>>,
    /// Part of the amplitude that jitter leaves \[ant\]\[chan\]\[node\].
    coherence: Vec<Vec<Vec<f64>>>,
}

/// The largest delay between two antennas of a layout within the scene, relative to the phase centre.
pub(crate) fn largest_delay_s<'a>(
    layout: &ArrayLayout,
    images: impl Iterator<Item = &'a Image>,
    sources: impl Iterator<Item = (f64, f64)>,
) -> f64 {
    let corners = images.flat_map(|i| {
        let g = &i.grid;
        let (n_l, n_m) = (g.n_l as f64, g.n_m as f64);
        [(-0.5, -0.5), (n_l - 0.5, -0.5), (-0.5, n_m - 0.5), (n_l - 0.5, n_m - 0.5)].map(|(c, r)| (g.l_at(c), g.m_at(r)))
    });
    let most = corners.chain(sources).map(|(l, m)| l.hypot(m).min(1.0)).fold(0.0, f64::max);
    // The distance between two directions at this angle.
    let chord = (2.0 * (1.0 - (1.0 - most * most).sqrt())).sqrt();
    let at: Vec<[f64; 3]> = layout.antennas().iter().map(|a| a.position_m).collect();
    let length = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let longest = at.iter().enumerate().flat_map(|(k, a)| at[..k].iter().map(move |b| length(*a, *b))).fold(0.0, f64::max);
    longest * chord / SPEED_OF_LIGHT_M_S
}

/// Responses of the antennas in one channel.
struct Channel<'a> {
    receivers: &'a Receivers,
    layout: &'a ArrayLayout,
    channel: (f64, f64),
    middle_hz: f64,
    delays_s: Vec<f64>,
    /// Power of each antenna.
    power: Vec<f64>,
}

impl Channel<'_> {
    fn response(&self, ant: usize, freq_hz: f64) -> Complex64 {
        self.receivers.response(self.layout, ant, freq_hz, self.channel, self.middle_hz)
    }

    /// The integrals over a panel by one rule: each antenna with itself and with the next, for each delay.
    fn integrals(&self, (low, high): (f64, f64), rule: &[(f64, f64)]) -> Vec<Complex64> {
        let n_ant = self.layout.n_ant();
        let mut sums = vec![Complex64::ZERO; 2 * n_ant * self.delays_s.len()];
        for (x, w) in rule {
            let freq = 0.5 * (low + high) + 0.5 * (high - low) * x;
            let weight = 0.5 * (high - low) * w;
            let h: Vec<Complex64> = (0..n_ant).map(|ant| self.response(ant, freq)).collect();
            for (d, delay) in self.delays_s.iter().enumerate() {
                let turn = Complex64::cis(TAU * (freq - self.channel.0) * delay) * weight;
                for ant in 0..n_ant {
                    let at = 2 * (d * n_ant + ant);
                    sums[at] += turn * h[ant].norm_sqr();
                    sums[at + 1] += turn * h[ant] * h[(ant + 1) % n_ant].conj();
                }
            }
        }
        sums
    }

    /// Append the nodes of a panel.
    fn add(&self, panel: (f64, f64), rules: &[Vec<(f64, f64)>], fine: &[(f64, f64)], depth: usize, nodes: &mut Vec<(f64, f64)>) {
        let truth = self.integrals(panel, fine);
        let n_ant = self.layout.n_ant();
        let good = |rule: &&Vec<(f64, f64)>| {
            self.integrals(panel, rule).iter().zip(&truth).enumerate().all(|(k, (a, b))| {
                let ant = k / 2 % n_ant;
                let scale = if k % 2 == 0 { self.power[ant] } else { (self.power[ant] * self.power[(ant + 1) % n_ant]).sqrt() };
                (a - b).norm() <= ACCURACY * scale
            })
        };
        let (low, high) = panel;
        match rules.iter().find(good) {
            Some(rule) => nodes.extend(rule.iter().map(|(x, w)| (0.5 * (low + high) + 0.5 * (high - low) * x, 0.5 * (high - low) * w))),
            None if depth < DEEPEST && nodes.len() <= MOST => {
                let half = 0.5 * (low + high);
                self.add((low, half), rules, fine, depth + 1, nodes);
                self.add((half, high), rules, fine, depth + 1, nodes);
            }
            None => nodes.extend(fine.iter().map(|(x, w)| (0.5 * (low + high) + 0.5 * (high - low) * x, 0.5 * (high - low) * w))),
        }
    }
}

impl BandNodes {
    /// Nodes for receivers and a scene whose delays reach to `delay_s`. `equal` holds the equal sub-channels that are used where the receivers
    /// have no shapes.
    ///
    /// # Errors
    /// A receiver is wrong, or a channel needs more than 4096 nodes.
    pub(crate) fn new(
        receivers: &Receivers,
        layout: &ArrayLayout,
        spectrum: &SpectralWindow,
        delay_s: f64,
        equal: Vec<Vec<f64>>,
    ) -> Result<Self> {
        receivers.check(layout)?;
        let middle_hz = Receivers::middle_hz(spectrum);
        let n_ant = layout.n_ant();
        let mut out = Self { freq_hz: Vec::new(), response: vec![Vec::new(); n_ant], coherence: vec![Vec::new(); n_ant] };
        if !receivers.shaped {
            for list in &equal {
                let share = (1.0 / list.len() as f64).sqrt();
                out.response.iter_mut().for_each(|response| response.push(vec![Complex64::from(share); list.len()]));
            }
            out.freq_hz = equal;
            return Ok(out.with_jitter(receivers, middle_hz));
        }
        let rules: Vec<Vec<(f64, f64)>> = RULES.iter().map(|n| gauss_legendre(*n)).collect();
        let fine = gauss_legendre(FINE);
        for (center, width) in spectrum.freq_hz().iter().zip(spectrum.width_hz()).map(|(f, w)| (*f, *w)) {
            let mut channel = Channel {
                receivers,
                layout,
                channel: (center, width),
                middle_hz,
                delays_s: [0.0, 0.37, 0.71, 1.0].iter().flat_map(|x| [x * delay_s, -x * delay_s]).skip(1).collect(),
                power: vec![1.0; n_ant],
            };
            let panels = panels(&channel)?;
            // First the powers, by a rule that is fine enough for any shape, then the nodes that these powers need.
            let split = |(a, b): &(f64, f64)| {
                let (a, step) = (*a, (b - a) / 16.0);
                (0..16).map(move |k| (a + step * f64::from(k), a + step * f64::from(k + 1)))
            };
            let parts: Vec<(f64, f64)> = panels.iter().flat_map(split).collect();
            channel.power = (0..n_ant)
                .map(|ant| {
                    let of = |(low, high): &(f64, f64)| {
                        let at = |(x, w): &(f64, f64)| w * channel.response(ant, 0.5 * (low + high) + 0.5 * (high - low) * x).norm_sqr();
                        0.5 * (high - low) * rules[5].iter().map(at).sum::<f64>()
                    };
                    parts.iter().map(of).sum()
                })
                .collect();
            if let Some(ant) = channel.power.iter().position(|p| !(*p > 0.0)) {
                return Err(ChainError::Incompatible(format!(
                    "the receiver of antenna {:?} has no response in the channel at {:.6} GHz",
                    layout.antennas()[ant].name,
                    center / 1e9
                )));
            }
            let mut nodes = Vec::new();
            panels.iter().for_each(|p| channel.add(*p, &rules, &fine, 0, &mut nodes));
            let expected = format!("at most {MOST}: use narrower channels, a smaller scene or smoother bands");
            need("number of frequencies in a channel", nodes.len(), nodes.len() <= MOST, expected)?;
            for (ant, response) in out.response.iter_mut().enumerate() {
                let h: Vec<Complex64> = nodes.iter().map(|(f, w)| channel.response(ant, *f) * w.sqrt()).collect();
                let scale = h.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt();
                response.push(h.into_iter().map(|h| h / scale).collect());
            }
            out.freq_hz.push(nodes.into_iter().map(|n| n.0).collect());
        }
        Ok(out.with_jitter(receivers, middle_hz))
    }

    fn with_jitter(mut self, receivers: &Receivers, middle_hz: f64) -> Self {
        for (ant, coherence) in self.coherence.iter_mut().enumerate() {
            *coherence = self.freq_hz.iter().map(|list| list.iter().map(|f| receivers.coherence(ant, *f, middle_hz)).collect()).collect();
        }
        self
    }

    /// Weight of a node of a channel for a pair of antennas. The power of one antenna does not fall by jitter: what it loses of its signal is noise.
    pub(crate) fn weight(&self, (ant1, ant2): (usize, usize), chan: usize, node: usize) -> Complex64 {
        let left = if ant1 == ant2 { 1.0 } else { self.coherence[ant1][chan][node] * self.coherence[ant2][chan][node] };
        self.response[ant1][chan][node] * self.response[ant2][chan][node].conj() * left
    }
}

/// The panels of a channel, between the corners of all responses and above 0 Hz.
fn panels(channel: &Channel<'_>) -> Result<Vec<(f64, f64)>> {
    let mut corners = Vec::new();
    for ant in 0..channel.layout.n_ant() {
        corners.extend(channel.receivers.corners(channel.layout, ant, channel.channel, channel.middle_hz)?);
    }
    let least = 1e-3 * channel.channel.0;
    corners.iter_mut().for_each(|f| *f = f.max(least));
    corners.sort_by(f64::total_cmp);
    // Corners that nearly coincide are one.
    let same = 1e-9 * channel.channel.1;
    corners.dedup_by(|b, a| *b - *a <= same);
    Ok(corners.windows(2).map(|w| (w[0], w[1])).collect())
}

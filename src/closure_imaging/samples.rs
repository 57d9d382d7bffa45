//! The data of a sparse array for the closure terms: visibilities of pairs of antennas, grouped by time and channel.

use crate::closure::{ClosureSet, Links};
use crate::{ChainError, Result, ensure};
use num_complex::Complex64;

/// Visibilities of pairs of antennas, grouped by moment. Gains are constant within a moment and independent from moment to moment.
///
/// A moment is one averaging interval of one channel. The order of the entries is the order of the model visibilities that the
/// terms are given.
#[derive(Debug, Clone)]
pub struct Samples {
    n_ant: usize,
    /// Antennas p < q \[n\].
    pairs: Vec<(usize, usize)>,
    vis: Vec<Complex64>,
    sigma: Vec<f64>,
    /// Entries of each moment; a baseline occurs once at most.
    moments: Vec<std::ops::Range<usize>>,
}

/// The closure quantities of all moments, each of `K` antennas and `M` baselines.
#[derive(Debug, Clone)]
pub(super) struct Formed<const M: usize> {
    /// Where the visibilities of the baselines are in the list.
    pub(super) sides: Vec<[usize; M]>,
    /// 1 / variance, times the number of independent closures of the moment divided by the number of those that are formed.
    pub(super) weight: Vec<f64>,
    /// How many of the closures are independent.
    pub(super) independent: usize,
}

impl Samples {
    /// Visibilities \[n\] of the antennas p < q of `pairs` \[n\] out of `n_ant`, with standard deviations `sigma` \[n\] of their real
    /// and imaginary parts; `moments` cuts the list into runs of one time and channel.
    ///
    /// # Errors
    /// Lists of different lengths, antennas out of order or range, a baseline twice in a moment, moments that do not follow each
    /// other, data that are not finite, sigma that is not positive.
    pub fn new(
        n_ant: usize,
        pairs: Vec<(usize, usize)>,
        (vis, sigma): (Vec<Complex64>, Vec<f64>),
        moments: Vec<std::ops::Range<usize>>,
    ) -> Result<Self> {
        let wrong = ChainError::Incompatible;
        let (n, n_vis, n_sigma) = (pairs.len(), vis.len(), sigma.len());
        let told = || format!("{n} baselines, {n_vis} visibilities and {n_sigma} errors: as many of each are needed");
        ensure!(n_vis == n && n_sigma == n, wrong(told()));
        if let Some((p, q)) = pairs.iter().find(|(p, q)| p >= q || *q >= n_ant) {
            return Err(wrong(format!("baseline {p}-{q} of {n_ant} antennas, expected two antennas in order")));
        }
        if let Some((v, s)) = vis.iter().zip(&sigma).find(|(v, s)| !(**s > 0.0 && s.is_finite() && v.re.is_finite() && v.im.is_finite())) {
            return Err(wrong(format!("visibility {v} with error {s}, expected finite data with positive errors")));
        }
        let mut end = 0;
        for m in &moments {
            let follows = m.start == end && m.end >= m.start;
            ensure!(follows, wrong(format!("a moment covers the data {}..{}, the one before ended at {end}", m.start, m.end)));
            end = m.end;
            ensure!(m.end <= n, wrong(format!("a moment covers the data {}..{} of {n}", m.start, m.end)));
            let mut seen = pairs[m.clone()].to_vec();
            seen.sort_unstable();
            if let Some(w) = seen.windows(2).find(|w| w[0] == w[1]) {
                return Err(wrong(format!("baseline {}-{} occurs twice in a moment", w[0].0, w[0].1)));
            }
        }
        ensure!(end == n, wrong(format!("the moments cover {end} of {n} data")));
        Ok(Self { n_ant, pairs, vis, sigma, moments })
    }

    /// Number of visibilities.
    #[must_use]
    pub fn len(&self) -> usize {
        self.vis.len()
    }

    /// True without any.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.vis.is_empty()
    }

    /// Number of antennas of the array, with or without data.
    #[must_use]
    pub fn n_ant(&self) -> usize {
        self.n_ant
    }

    /// Antennas p < q \[n\].
    #[must_use]
    pub fn pairs(&self) -> &[(usize, usize)] {
        &self.pairs
    }

    /// Visibilities \[n\].
    #[must_use]
    pub fn vis(&self) -> &[Complex64] {
        &self.vis
    }

    /// Standard deviations of real and imaginary part \[n\].
    #[must_use]
    pub fn sigma(&self) -> &[f64] {
        &self.sigma
    }

    /// Entries of each moment.
    #[must_use]
    pub fn moments(&self) -> &[std::ops::Range<usize>] {
        &self.moments
    }

    /// Square of the error of amplitude over amplitude: the variance of ln|V| and of arg V to first order \[n\].
    pub(crate) fn relative_variance(&self, k: usize) -> f64 {
        self.sigma[k] * self.sigma[k] / self.vis[k].norm_sqr()
    }

    /// Multiply the data of some entries, and their errors, by a positive factor.
    pub(crate) fn scale(&mut self, which: &[bool], factor: f64) {
        for ((v, s), w) in self.vis.iter_mut().zip(&mut self.sigma).zip(which) {
            if *w {
                *v *= factor;
                *s *= factor;
            }
        }
    }

    /// The closures of all moments on the entries that `used` \[n\] admits. `find` forms them of linked antennas, `baselines` names the
    /// baselines of each. The variance of a closure is the sum of sigma^2 / |V|^2 over its baselines.
    ///
    /// # Errors
    /// A closure on a baseline without data.
    pub(super) fn formed<const K: usize, const M: usize>(
        &self,
        used: &[bool],
        set: ClosureSet,
        find: impl Fn(&Links, ClosureSet, &[usize]) -> Vec<[usize; K]>,
        baselines: fn([usize; K]) -> [(usize, usize); M],
    ) -> Result<Formed<M>> {
        let mut out = Formed { sides: Vec::new(), weight: Vec::new(), independent: 0 };
        let n = self.n_ant;
        for moment in &self.moments {
            let (at, order) = (self.index(moment, used), self.by_information(moment));
            let mut links = Links::new(n);
            (0..n * n).filter(|i| at[*i].is_some()).for_each(|i| links.set(i / n, i % n));
            let minimal = find(&links, ClosureSet::Minimal, &order);
            let independent = minimal.len();
            out.independent += independent;
            let formed = if set == ClosureSet::All { find(&links, set, &order) } else { minimal };
            let share = independent as f64 / formed.len().max(1) as f64;
            for antennas in &formed {
                let mut sides = [0; M];
                for (side, (p, q)) in sides.iter_mut().zip(baselines(*antennas)) {
                    let missing = || ChainError::Incompatible(format!("a closure on baseline {p}-{q}, which has no data"));
                    *side = at[p.min(q) * n + p.max(q)].ok_or_else(missing)?;
                }
                out.weight.push(share / sides.iter().map(|k| self.relative_variance(*k)).sum::<f64>());
                out.sides.push(sides);
            }
        }
        Ok(out)
    }

    /// Where each baseline \[p * n_ant + q\] of a moment is, for the entries that `used` admits and whose amplitude is not 0.
    fn index(&self, moment: &std::ops::Range<usize>, used: &[bool]) -> Vec<Option<usize>> {
        let mut at = vec![None; self.n_ant * self.n_ant];
        for k in moment.clone() {
            if used[k] && self.vis[k].norm_sqr() > 0.0 {
                let (p, q) = self.pairs[k];
                at[p * self.n_ant + q] = Some(k);
            }
        }
        at
    }

    /// Antennas in descending order of the information on their baselines. Closures around the first one have the smallest errors.
    pub(crate) fn by_information(&self, moment: &std::ops::Range<usize>) -> Vec<usize> {
        let mut sum = vec![0.0; self.n_ant];
        for k in moment.clone() {
            // The information of a baseline has an upper limit where systematic errors exceed the noise.
            let information = 1.0 / (self.relative_variance(k) + 1e-4);
            let (p, q) = self.pairs[k];
            sum[p] += information;
            sum[q] += information;
        }
        let mut order: Vec<usize> = (0..self.n_ant).collect();
        order.sort_by(|a, b| sum[*b].total_cmp(&sum[*a]).then(a.cmp(b)));
        order
    }
}

#[cfg(test)]
pub(crate) mod fixture {
    use super::*;

    /// Data of `n` antennas at `times` times. The source consists of a few Gaussians; the data are deterministic and never zero.
    pub(crate) fn samples(n: usize, times: usize) -> Samples {
        let (mut pairs, mut vis, mut moments) = (Vec::new(), Vec::new(), Vec::new());
        for t in 0..times {
            let start = pairs.len();
            for p in 0..n {
                for q in p + 1..n {
                    if (p + q + t) % 7 != 6 {
                        let x = (p * 3 + q * 5 + t * 2) as f64;
                        pairs.push((p, q));
                        vis.push(Complex64::from_polar(0.2 + 0.9 * (0.37 * x).sin().powi(2), 1.3 * x));
                    }
                }
            }
            moments.push(start..pairs.len());
        }
        let sigma = (0..pairs.len()).map(|k| 0.01 + 0.002 * (k % 5) as f64).collect();
        Samples::new(n, pairs, (vis, sigma), moments).unwrap()
    }

    /// A model that is not the data.
    pub(crate) fn model(s: &Samples) -> Vec<Complex64> {
        s.vis()
            .iter()
            .enumerate()
            .map(|(k, v)| v * Complex64::from_polar(1.0 + 0.2 * (k as f64).sin(), 0.4 * (2.0 * k as f64).cos()))
            .collect()
    }

    /// The samples with other data.
    pub(crate) fn with(s: &Samples, vis: Vec<Complex64>) -> Samples {
        Samples::new(s.n_ant(), s.pairs().to_vec(), (vis, s.sigma().to_vec()), s.moments().to_vec()).unwrap()
    }

    /// Each visibility times g_p conj(g_q) of a gain for each moment and antenna.
    pub(crate) fn corrupted(s: &Samples, vis: &[Complex64], gain: impl Fn(usize, usize) -> Complex64) -> Vec<Complex64> {
        let mut out = vis.to_vec();
        for (t, m) in s.moments().iter().enumerate() {
            for k in m.clone() {
                let (p, q) = s.pairs()[k];
                out[k] = vis[k] * gain(t, p) * gain(t, q).conj();
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_lists_are_refused() {
        let one = Complex64::new(1.0, 0.0);
        let make = |pairs: Vec<(usize, usize)>, v: Complex64, s: f64, end: usize| {
            let n = pairs.len();
            Samples::new(3, pairs, (vec![v; n], vec![s; n]), std::iter::once(0..end).collect())
        };
        assert!(make(vec![(0, 1), (1, 2)], one, 1.0, 2).is_ok());
        for (bad, word) in [
            (make(vec![(1, 0)], one, 1.0, 1), "in order"),
            (make(vec![(0, 3)], one, 1.0, 1), "3 antennas"),
            (make(vec![(0, 1), (0, 1)], one, 1.0, 2), "twice"),
            (make(vec![(0, 1)], one, 0.0, 1), "positive errors"),
            (make(vec![(0, 1)], Complex64::new(f64::NAN, 0.0), 1.0, 1), "finite"),
            (make(vec![(0, 1), (1, 2)], one, 1.0, 1), "cover 1 of 2"),
        ] {
            assert!(bad.unwrap_err().to_string().contains(word), "{word}");
        }
    }
}

//! Noise that depends on the scene: every field of an antenna holds the scene and its receiver, and the noise of the baselines of one integration
//! is drawn from the joint distribution of their products.

use super::fields::Fields;
use crate::random::stream;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Polarization, VisibilityBlock, VisibilityHeader};
use ndarray::parallel::prelude::*;
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::{Complex, Complex64};

/// The fields of each antenna, and which of them each product of the set correlates.
#[derive(Debug, Clone)]
pub(super) struct SceneNoise {
    seed: u64,
    /// Number of fields of an antenna.
    fields: usize,
    /// Fields of the first and the second antenna \[pol\].
    pairs: Vec<(usize, usize)>,
}

impl SceneNoise {
    /// For the products of a set.
    ///
    /// # Errors
    /// Products that do not tell the power of each feed.
    pub(super) fn new(products: &[Polarization], seed: u64) -> Result<Self> {
        if products == [Polarization::I] {
            return Ok(Self { seed, fields: 1, pairs: vec![(0, 0)] });
        }
        let pairs: Option<Vec<(usize, usize)>> = products.iter().map(|p| p.feeds()).collect();
        let wrong = || {
            let list: Vec<&str> = products.iter().map(|p| p.name()).collect();
            ChainError::bad_option("pols", list.join(","), "I, or products of feeds, for noise that depends on the scene")
        };
        let pairs = pairs.ok_or_else(wrong)?;
        let used = |feed: usize| pairs.iter().any(|p| p.0 == feed || p.1 == feed);
        let powered = |feed: usize| pairs.contains(&(feed, feed));
        ensure!((0..2).all(|f| !used(f) || powered(f)), {
            let list: Vec<&str> = products.iter().map(|p| p.name()).collect();
            ChainError::bad_option("pols", list.join(","), "the parallel hand of every feed, for noise that depends on the scene")
        });
        // A single hand is the only field.
        if pairs.len() == 1 {
            return Ok(Self { seed, fields: 1, pairs: vec![(0, 0)] });
        }
        Ok(Self { seed, fields: 2, pairs })
    }

    /// Replace the expected visibilities of one integration by a draw, and set the weights. `zero` is the zero spacing \[chan, pol\] and `receivers`
    /// the power of the receivers \[ant, chan\], both in the unit of the set.
    ///
    /// # Errors
    /// A baseline is missing, an integration time is not positive, the scene is negative, or single precision cannot hold the weights.
    pub(super) fn apply(
        &self,
        header: &VisibilityHeader,
        block: &mut VisibilityBlock,
        (zero, receivers): (ArrayView2<'_, Complex64>, ArrayView2<'_, f64>),
        first_row: u64,
    ) -> Result<()> {
        let coverage = &block.coverage;
        let mut antennas: Vec<u32> = coverage.ant1.iter().chain(&coverage.ant2).copied().collect();
        antennas.sort_unstable();
        antennas.dedup();
        let n = antennas.len();
        let place = |a: u32| antennas.partition_point(|x| *x < a);
        let rows: Vec<(usize, usize)> = coverage.ant1.iter().zip(&coverage.ant2).map(|(a, b)| (place(*a), place(*b))).collect();
        let mut seen: Vec<(usize, usize)> = rows.iter().filter(|(p, q)| p != q).map(|(p, q)| (*p.min(q), *p.max(q))).collect();
        seen.sort_unstable();
        seen.dedup();
        let lengths = &coverage.integration_s;
        let same = lengths.iter().all(|t| *t == lengths[0]);
        ensure!(
            seen.len() == n * n.saturating_sub(1) / 2 && same,
            ChainError::Incompatible(
                "noise that depends on the scene needs every baseline of each integration, all of the same length".into()
            )
        );
        let (width, time) = (header.spectrum.width_hz(), lengths[0]);
        let n_chan = header.spectrum.n_chan() as u64;
        let chans = block.vis.axis_iter_mut(Axis(1)).into_par_iter().zip(block.weights.axis_iter_mut(Axis(1)));
        chans.enumerate().try_for_each(|(chan, (mut vis, mut weights))| {
            let mut c = Array2::<Complex64>::zeros((self.fields * n, self.fields * n));
            let mut put = |a: usize, b: usize, v: Complex64| {
                c[(a, b)] = v;
                c[(b, a)] = v.conj();
            };
            for (pol, (f, g)) in self.pairs.iter().enumerate() {
                for (k, antenna) in antennas.iter().enumerate() {
                    let own = if f == g { receivers[(*antenna as usize, chan)] } else { 0.0 };
                    let seen = if f == g { zero[(chan, pol)].re.into() } else { zero[(chan, pol)] };
                    put(f * n + k, g * n + k, seen + own);
                }
                for (row, (p, q)) in rows.iter().enumerate().filter(|(_, (p, q))| p != q) {
                    let v = vis[(row, pol)];
                    put(f * n + p, g * n + q, Complex64::new(v.re.into(), v.im.into()));
                }
            }
            let fields = Fields::new(c, width[chan] * time)?;
            let drawn = fields.draw(&mut stream(self.seed, "noise of fields", first_row * n_chan + chan as u64))?;
            for (row, (p, q)) in rows.iter().enumerate() {
                for (pol, (f, g)) in self.pairs.iter().enumerate() {
                    let (a, b) = (f * n + p, g * n + q);
                    let v = drawn[(a, b)];
                    let weight = (1.0 / fields.variance(a, b)) as f32;
                    vis[(row, pol)] = Complex::new(v.re as f32, if a == b { 0.0 } else { v.im as f32 });
                    weights[(row, pol)] = weight;
                    ensure!(weight.is_normal(), {
                        let expected =
                            "a noise whose 1/sigma^2 single precision can hold: check Tsys or SEFD, diameter, efficiency and time";
                        ChainError::bad_option("noise", format!("{:e} per visibility", fields.variance(a, b).sqrt()), expected)
                    });
                }
            }
            Ok(())
        })
    }
}

/// Runs of rows of one time.
pub(super) fn integrations(time_jd: &[f64]) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for (row, t) in time_jd.iter().enumerate() {
        match runs.last_mut() {
            Some(run) if time_jd[run.start] == *t => run.end = row + 1,
            _ => runs.push(row..row + 1),
        }
    }
    runs
}

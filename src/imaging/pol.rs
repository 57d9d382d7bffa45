//! Combines the polarisation products of a set into the product that is imaged.

use crate::processor::for_this_processor;
use crate::{ChainError, Result};
use cittert_arrays::feeds::{Feeds, stokes_terms};
use cittert_arrays::{Polarization, Ranks, UvCoverage, VisibilityBlock, VisibilityHeader};
use ndarray::Axis;
use num_complex::{Complex, Complex32};
use std::ops::Range;

/// The linear combination of the products of a set that gives one product.
#[derive(Debug, Clone)]
pub struct PolSelector {
    /// The product that is imaged.
    pub target: Polarization,
    terms: Vec<(usize, Complex32)>,
    /// If one hand of Stokes I is unusable, the other hand replaces it. This is exact for an unpolarised source.
    either_hand: bool,
    /// Feeds for which the combination differs from row to row, and the place of each product of two feeds in the set.
    turning: Option<(Feeds, [[Option<usize>; 2]; 2])>,
}

/// The combination of products for one row; none where all rows have the same.
pub(crate) type RowTerms = Vec<(usize, Complex32)>;

/// Coefficients that are smaller do not count: rounding leaves them where a product has no part in a combination.
const SMALLEST_COEFFICIENT: f64 = 1e-9;

/// Numbers of used and unused visibilities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DataCounts {
    /// Visibilities of the product, used or not.
    pub total: u64,
    /// Visibilities that are used.
    pub used: u64,
    /// Not used: flagged in the file.
    pub flagged: u64,
    /// Not used: the weight is zero, negative or not finite.
    pub bad_weight: u64,
    /// Not used: the visibility or a uvw is not finite, or the square of the visibility is not.
    pub not_finite: u64,
    /// Not imaged: autocorrelations, which measure the total power of one antenna.
    pub autocorrelations: u64,
    /// Used, but only one of the two hands is usable.
    pub one_hand: u64,
}

impl DataCounts {
    /// The sum of two counts.
    #[must_use]
    pub fn plus(self, o: Self) -> Self {
        Self {
            total: self.total + o.total,
            used: self.used + o.used,
            flagged: self.flagged + o.flagged,
            bad_weight: self.bad_weight + o.bad_weight,
            not_finite: self.not_finite + o.not_finite,
            autocorrelations: self.autocorrelations + o.autocorrelations,
            one_hand: self.one_hand + o.one_hand,
        }
    }

    /// Replace the counts by their sums over all processes.
    pub(super) fn share(&mut self, ranks: &dyn Ranks) {
        let counts = [
            &mut self.total,
            &mut self.used,
            &mut self.flagged,
            &mut self.bad_weight,
            &mut self.not_finite,
            &mut self.autocorrelations,
            &mut self.one_hand,
        ];
        // Doubles hold whole numbers up to 2^53.
        let mut sums = counts.each_ref().map(|n| **n as f64);
        ranks.sum(&mut sums);
        counts.into_iter().zip(sums).for_each(|(n, sum)| *n = sum as u64);
    }

    /// How many visibilities of the product are not used, by reason. `product` is its name.
    #[must_use]
    pub fn left_out(&self, product: &str) -> String {
        let mut text = format!(
            "{} of {} visibilities of {product} are flagged, {} have a weight that is not positive and finite, {} are not finite or above 1e19",
            self.flagged, self.total, self.bad_weight, self.not_finite
        );
        if self.autocorrelations > 0 {
            text += &format!(", {} are autocorrelations", self.autocorrelations);
        }
        text
    }
}

/// The reason why a visibility of the set cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fault {
    Flag,
    Weight,
    Value,
}

impl PolSelector {
    /// The combination of the products `available` in a set that gives `target`.
    ///
    /// Circular hands: I = (RR + LL) / 2, V = (RR - LL) / 2, Q = (RL + LR) / 2, U = (LR - RL) / 2i. Linear: I = (XX + YY) / 2,
    /// Q = (XX - YY) / 2, U = (XY + YX) / 2, V = (YX - XY) / 2i, in the conventions of [`cittert_arrays::feeds`]. If the set has only one parallel
    /// hand, Stokes I is that hand.
    ///
    /// # Errors
    /// The set does not have the products that `target` needs.
    ///
    /// # Reference
    /// Thompson, Moran & Swenson 2017, sect. 4.7.
    pub fn new(target: Polarization, available: &[Polarization]) -> Result<Self> {
        use Polarization::{I, LL, LR, Q, RL, RR, U, V, XX, XY, YX, YY};
        let find = |p: Polarization| available.iter().position(|a| *a == p);
        let one = Complex::new(1.0, 0.0);
        let selector = |terms, either_hand| Ok(Self { target, terms, either_hand, turning: None });
        if let Some(index) = find(target) {
            return selector(vec![(index, one)], false);
        }
        let half = Complex::new(0.5, 0.0);
        // 1 / 2i
        let half_i = Complex::new(0.0, -0.5);
        // Circular first, then linear: each is two products with their coefficients.
        let ways: &[[(Polarization, Complex32); 2]] = match target {
            I => &[[(RR, half), (LL, half)], [(XX, half), (YY, half)]],
            Q => &[[(RL, half), (LR, half)], [(XX, half), (YY, -half)]],
            U => &[[(RL, -half_i), (LR, half_i)], [(XY, half), (YX, half)]],
            V => &[[(RR, half), (LL, -half)], [(XY, -half_i), (YX, half_i)]],
            _ => &[],
        };
        for [a, b] in ways {
            if let (Some(ia), Some(ib)) = (find(a.0), find(b.0)) {
                return selector(vec![(ia, a.1), (ib, b.1)], target == I);
            }
        }
        if target == I
            && let Some(index) = available.iter().position(|p| p.is_parallel_hand())
        {
            return selector(vec![(index, one)], false);
        }
        let names: Vec<&str> = available.iter().map(|p| p.name()).collect();
        let expected = format!("a product that can be made of the products of the set: {}", names.join(", "));
        Err(ChainError::bad_option("polarization", target.name(), expected))
    }

    /// The combination for a set with a header. Where feeds turn, or X points east, Stokes parameters are made of the products by the angles of the
    /// feeds in each row.
    ///
    /// # Errors
    /// As [`PolSelector::new`], and feeds of unknown mounts.
    pub fn of(target: Polarization, header: &VisibilityHeader) -> Result<Self> {
        use Polarization::{I, Q, U, V};
        let plain = Self::new(target, &header.polarizations)?;
        let feeds = Feeds::of(header)?;
        let stokes = [I, Q, U, V].contains(&target) && !header.polarizations.contains(&target);
        // Stokes I of feeds that are turned alike, and V of circular ones, are the sum and the difference of the parallel hands.
        let hands = target == I || (target == V && header.polarizations.contains(&Polarization::RR));
        if !stokes || feeds.are_plain() || (hands && feeds.alike()) {
            return Ok(plain);
        }
        let mut at = [[None; 2]; 2];
        for (index, product) in header.polarizations.iter().enumerate() {
            if let Some((j, k)) = product.feeds() {
                at[j][k] = Some(index);
            }
        }
        Ok(Self { turning: Some((feeds, at)), ..plain })
    }

    /// The combinations for the rows of a coverage \[row\]; none where all rows have the same.
    ///
    /// # Errors
    /// The set lacks a product that the turned feeds need, or a time is out of range.
    pub(crate) fn by_row(&self, coverage: &UvCoverage) -> Result<Option<Vec<RowTerms>>> {
        let Some((feeds, at)) = &self.turning else { return Ok(None) };
        let mut rows = Vec::with_capacity(coverage.n_rows());
        let mut last: Option<([f64; 2], RowTerms)> = None;
        for row in 0..coverage.n_rows() {
            let angles = if feeds.turn() {
                let all = feeds.angles(coverage.time_jd[row], coverage.phase_center[row])?;
                [coverage.ant1[row], coverage.ant2[row]].map(|a| all[a as usize])
            } else {
                [0.0; 2]
            };
            if let Some((_, terms)) = last.as_ref().filter(|l| l.0 == angles) {
                rows.push(terms.clone());
                continue;
            }
            let [first, second] = angles.map(|a| feeds.matrix(a));
            let all = stokes_terms(self.target, &first, &second).ok_or_else(|| ChainError::Internal("feeds that are alike".into()))?;
            let mut terms = RowTerms::new();
            for ((j, k), c) in all.into_iter().filter(|(_, c)| c.norm() > SMALLEST_COEFFICIENT) {
                let expected = "a product that the set can give: its feeds turn, so that Q, U and V of linear feeds need all four products";
                let index = at[j][k].ok_or_else(|| ChainError::bad_option("polarization", self.target.name(), expected))?;
                terms.push((index, Complex::new(c.re as f32, c.im as f32)));
            }
            rows.push(terms.clone());
            last = Some((angles, terms));
        }
        Ok(Some(rows))
    }

    /// Combine a row of a block into visibilities and weights \[chan\]. Both are 0 for a visibility that cannot be used.
    /// `own` is the combination of the row, from [`PolSelector::by_row`].
    pub(crate) fn row(
        &self,
        block: &VisibilityBlock,
        (row, own): (usize, Option<&RowTerms>),
        unit: bool,
        out: (&mut [Complex32], &mut [f32]),
    ) -> DataCounts {
        if block.coverage.ant1[row] == block.coverage.ant2[row] { autocorrelation(out) } else { self.combine(block, (row, own), unit, out) }
    }

    /// As [`PolSelector::row`], for the values of a row of this coverage.
    pub(super) fn row_of(
        &self,
        (coverage, row): (&UvCoverage, usize),
        (values, own): (RowValues<'_>, Option<&RowTerms>),
        unit: bool,
        out: (&mut [Complex32], &mut [f32]),
    ) -> DataCounts {
        if coverage.ant1[row] == coverage.ant2[row] {
            return autocorrelation(out);
        }
        let finite_uvw = coverage.uvw_m.row(row).iter().all(|x| x.is_finite());
        self.combine_values((values, finite_uvw), own, unit, out)
    }

    /// Number of products that are combined.
    pub(super) fn terms(&self) -> usize {
        self.terms.len()
    }

    /// As [`PolSelector::row`], for an autocorrelation too.
    pub(super) fn combine(
        &self,
        block: &VisibilityBlock,
        (row, own): (usize, Option<&RowTerms>),
        unit: bool,
        out: (&mut [Complex32], &mut [f32]),
    ) -> DataCounts {
        let finite_uvw = block.coverage.uvw_m.row(row).iter().all(|x| x.is_finite());
        let (vis, weights, flags) =
            (block.vis.index_axis(Axis(0), row), block.weights.index_axis(Axis(0), row), block.flags.index_axis(Axis(0), row));
        let (vis, weights, flags) = (vis.as_standard_layout(), weights.as_standard_layout(), flags.as_standard_layout());
        let values = RowValues {
            vis: vis.as_slice().unwrap_or_default(),
            weights: weights.as_slice().unwrap_or_default(),
            flags: flags.as_slice().unwrap_or_default(),
        };
        self.combine_values((values, finite_uvw), own, unit, out)
    }

    /// Combine the values of a row.
    fn combine_values(
        &self,
        (values, finite_uvw): (RowValues<'_>, bool),
        own: Option<&RowTerms>,
        unit: bool,
        (vis, weight): (&mut [Complex32], &mut [f32]),
    ) -> DataCounts {
        let n = vis.len() as u64;
        if own.is_none() && finite_uvw && whole_row(&self.terms, values, unit, (vis, weight)) {
            return DataCounts { total: n, used: n, ..DataCounts::default() };
        }
        let mut counts = DataCounts { total: n, ..DataCounts::default() };
        let n_pol = values.vis.len() / vis.len().max(1);
        let values = |of_channel: Range<usize>| {
            let RowValues { vis, weights, flags } = values;
            let vis = vis.get(of_channel.clone()).unwrap_or_default();
            (vis, weights.get(of_channel.clone()).unwrap_or_default(), flags.get(of_channel).unwrap_or_default())
        };
        for (c, (v, w)) in vis.iter_mut().zip(weight).enumerate() {
            let (of_vis, of_weights, of_flags) = values(c * n_pol..(c + 1) * n_pol);
            let part = |pol: usize| -> std::result::Result<(Complex32, f32), Fault> {
                if of_flags[pol] {
                    return Err(Fault::Flag);
                }
                let (v, w) = (of_vis[pol], of_weights[pol]);
                if !(w > 0.0 && w.is_finite()) {
                    return Err(Fault::Weight);
                }
                // Sums of larger values would overflow.
                let finite = v.norm_sqr().is_finite() && finite_uvw;
                if finite { Ok((v, if unit { 1.0 } else { w })) } else { Err(Fault::Value) }
            };
            let combined = match self.terms.as_slice() {
                _ if own.is_some() => sum_of(own.map_or(&[], Vec::as_slice), part),
                [(a, ca)] => part(*a).map(|(v, w)| (*ca * v, w)),
                [(a, ca), (b, cb), ..] => match (part(*a), part(*b)) {
                    // The variance of the mean is 1/w = (1/wa + 1/wb) / 4.
                    (Ok((va, wa)), Ok((vb, wb))) => Ok((*ca * va + *cb * vb, 4.0 * wa / (wa + wb) * wb)),
                    (Ok(hand), Err(_)) | (Err(_), Ok(hand)) if self.either_hand => {
                        counts.one_hand += 1;
                        Ok(hand)
                    }
                    (Err(e), _) | (_, Err(e)) => Err(e),
                },
                [] => Err(Fault::Flag),
            };
            (*v, *w) = combined.unwrap_or_default();
            match combined {
                Ok(_) => counts.used += 1,
                Err(Fault::Flag) => counts.flagged += 1,
                Err(Fault::Weight) => counts.bad_weight += 1,
                Err(Fault::Value) => counts.not_finite += 1,
            }
        }
        counts
    }
}

/// The values of one row \[chan, pol\].
#[derive(Debug, Clone, Copy)]
pub(super) struct RowValues<'a> {
    pub(super) vis: &'a [Complex32],
    pub(super) weights: &'a [f32],
    pub(super) flags: &'a [bool],
}

/// Leave out an autocorrelation.
fn autocorrelation((vis, weight): (&mut [Complex32], &mut [f32])) -> DataCounts {
    vis.fill(Complex32::default());
    weight.fill(0.0);
    let total = vis.len() as u64;
    DataCounts { total, autocorrelations: total, ..DataCounts::default() }
}

for_this_processor!(
    /// Combine a row of which every value is used, with real coefficients. The result is false, and the output has no meaning, for any other row.
    whole_row, whole_row_loops(terms: &[(usize, Complex32)], row: RowValues<'_>, unit: bool, out: (&mut [Complex32], &mut [f32])) -> bool
);

#[inline(always)]
fn whole_row_loops(terms: &[(usize, Complex32)], row: RowValues<'_>, unit: bool, out: (&mut [Complex32], &mut [f32])) -> bool {
    let n_pol = row.vis.len() / out.0.len().max(1);
    let shaped = [row.vis.len(), row.weights.len(), row.flags.len()].iter().all(|n| *n == n_pol * out.0.len());
    if !shaped || out.0.len() != out.1.len() || row.flags.iter().fold(false, |any, f| any | f) {
        return false;
    }
    match (terms, n_pol) {
        ([a], 1) => whole::<1>([*a, (0, Complex32::default())], 1, row, unit, out),
        ([a], 2) => whole::<2>([*a, (0, Complex32::default())], 1, row, unit, out),
        ([a], 4) => whole::<4>([*a, (0, Complex32::default())], 1, row, unit, out),
        ([a, b], 2) => whole::<2>([*a, *b], 2, row, unit, out),
        ([a, b], 4) => whole::<4>([*a, *b], 2, row, unit, out),
        _ => false,
    }
}

/// [`whole_row`] of one or two terms, of `N` products.
#[inline(always)]
fn whole<const N: usize>(
    [(a, ca), (b, cb)]: [(usize, Complex32); 2],
    terms: usize,
    row: RowValues<'_>,
    unit: bool,
    (vis, weight): (&mut [Complex32], &mut [f32]),
) -> bool {
    if a >= N || b >= N || ca.im != 0.0 || cb.im != 0.0 {
        return false;
    }
    let (all_vis, all_weights) = (row.vis.as_chunks::<N>().0, row.weights.as_chunks::<N>().0);
    let (ca, cb) = (ca.re, cb.re);
    let mut good = true;
    let usable = |w: f32, v: Complex32| (w > 0.0) & (w < f32::INFINITY) & (v.re * v.re + v.im * v.im < f32::INFINITY);
    let of = |w: f32| if unit { 1.0 } else { w };
    for (((v, w), of_vis), of_weights) in vis.iter_mut().zip(weight).zip(all_vis).zip(all_weights) {
        let (va, wa) = (of_vis[a], of_weights[a]);
        good &= usable(wa, va);
        if terms == 1 {
            (*v, *w) = (Complex32::new(ca * va.re, ca * va.im), of(wa));
            continue;
        }
        let (vb, wb) = (of_vis[b], of_weights[b]);
        good &= usable(wb, vb);
        let (wa, wb) = (of(wa), of(wb));
        // The variance of the mean is 1/w = (1/wa + 1/wb) / 4.
        (*v, *w) = (Complex32::new(ca * va.re + cb * vb.re, ca * va.im + cb * vb.im), 4.0 * wa / (wa + wb) * wb);
    }
    good
}

/// A sum of products, and its weight: the variances of the products add up with the squares of their coefficients.
fn sum_of(
    terms: &[(usize, Complex32)],
    part: impl Fn(usize) -> std::result::Result<(Complex32, f32), Fault>,
) -> std::result::Result<(Complex32, f32), Fault> {
    let (mut sum, mut variance) = (Complex32::default(), 0.0);
    for (index, c) in terms {
        let (v, w) = part(*index)?;
        sum += *c * v;
        variance += c.norm_sqr() / w;
    }
    if variance > 0.0 { Ok((sum, variance.recip())) } else { Err(Fault::Weight) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    fn block(values: [Complex32; 4]) -> VisibilityBlock {
        let coverage = UvCoverage::new(array![[1.0, 2.0, 3.0]], vec![0], vec![1], vec![0.0], vec![1.0], vec![0]).unwrap();
        let mut b = VisibilityBlock::zeros(coverage, 1, 4);
        values.iter().enumerate().for_each(|(p, v)| b.vis[(0, 0, p)] = *v);
        b
    }

    fn combine(s: &PolSelector, b: &VisibilityBlock) -> (Complex32, f32, DataCounts) {
        let (mut v, mut w) = ([Complex32::default()], [0.0]);
        let own = s.by_row(&b.coverage).unwrap();
        let counts = s.row(b, (0, own.as_ref().map(|o| &o[0])), false, (&mut v, &mut w));
        (v[0], w[0], counts)
    }

    #[test]
    fn all_stokes_parameters_come_back_from_circular_and_from_linear_hands() {
        use Polarization::{I, LL, LR, Q, RL, RR, U, V, XX, XY, YX, YY};
        let (i, q, u, v) = (10.0_f32, 1.0, 2.0, 3.0);
        let re = |x| Complex::new(x, 0.0);
        let circular = [re(i + v), re(i - v), Complex::new(q, -u), Complex::new(q, u)];
        let linear = [re(i + q), re(i - q), Complex::new(u, -v), Complex::new(u, v)];
        for (products, values) in [([RR, LL, RL, LR], circular), ([XX, YY, XY, YX], linear)] {
            for (stokes, expected) in [(I, i), (Q, q), (U, u), (V, v)] {
                let s = PolSelector::new(stokes, &products).unwrap();
                let (got, w, _) = combine(&s, &block(values));
                assert!((got - re(expected)).norm() < 1e-6 && w == 2.0, "{stokes}: {got} {w}");
            }
        }
    }

    /// A row in which every value is used is combined faster, to the same values.
    #[test]
    fn a_whole_row_gives_the_values_of_a_row_with_a_gap() {
        use Polarization::{I, LL, LR, Q, RL, RR, V};
        let mut noise = crate::fixtures::Noise(9);
        for products in [vec![RR], vec![RR, LL], vec![RR, RL, LR, LL]] {
            let n = products.len();
            let coverage = UvCoverage::new(array![[1.0, 2.0, 3.0]], vec![0], vec![1], vec![0.0], vec![1.0], vec![0]).unwrap();
            let mut b = VisibilityBlock::zeros(coverage, 21, n);
            b.vis.mapv_inplace(|_| Complex::new(noise.next() as f32, noise.next() as f32));
            b.weights.mapv_inplace(|_| 1.0 + noise.next().abs() as f32);
            for target in [RR, LL, I, V, Q] {
                let Ok(s) = PolSelector::new(target, &products) else { continue };
                let run = |b: &VisibilityBlock, unit: bool| {
                    let (mut v, mut w) = (vec![Complex::default(); 21], vec![0.0; 21]);
                    let counts = s.row(b, (0, None), unit, (&mut v, &mut w));
                    (v, w, counts)
                };
                for unit in [false, true] {
                    let (v, w, counts) = run(&b, unit);
                    let mut gap = b.clone();
                    gap.flags.index_axis_mut(Axis(1), 20).fill(true);
                    let (v2, w2, counts2) = run(&gap, unit);
                    assert!(v[..20] == v2[..20] && w[..20] == w2[..20], "{target} of {products:?}");
                    assert_eq!((counts.used, counts.total, counts2.used, counts2.flagged), (21, 21, 20, 1));
                    assert!(v.iter().all(|v| v.norm() > 0.0) && w.iter().all(|w| *w >= 1.0));
                }
            }
        }
    }

    #[test]
    fn what_cannot_be_used_has_no_weight_and_is_counted() {
        use Polarization::{LL, LR, RL, RR};
        let s = PolSelector::new(RR, &[RR, LL, RL, LR]).unwrap();
        let good = block([Complex::new(1.0, 0.0); 4]);
        for weight in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let mut b = good.clone();
            b.weights[(0, 0, 0)] = weight;
            let (v, w, c) = combine(&s, &b);
            assert_eq!((v, w, c.bad_weight, c.used), (Complex32::default(), 0.0, 1, 0));
        }
        let mut b = good.clone();
        b.vis[(0, 0, 0)].im = f32::NAN;
        assert_eq!(combine(&s, &b).2.not_finite, 1);
        b.vis[(0, 0, 0)] = Complex::new(3e38, 0.0);
        assert_eq!(combine(&s, &b).2.not_finite, 1);
        b.flags[(0, 0, 0)] = true;
        assert_eq!(combine(&s, &b).2.flagged, 1);
        let stokes = PolSelector::new(Polarization::I, &[RR, LL, RL, LR]).unwrap();
        let (v, w, c) = combine(&stokes, &b);
        assert_eq!((v, w, c.one_hand, c.used), (Complex::new(1.0, 0.0), 1.0, 1, 1));
        assert!(PolSelector::new(Polarization::XX, &[RR, LL]).unwrap_err().to_string().contains("RR, LL"));
    }
}

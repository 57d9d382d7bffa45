//! The visibilities that a verdict looks at, with what a model predicts of them.

use crate::Result;
use crate::calibrate::{ModelVisibilities, of_all, sees_unpolarized};
use crate::mem::HandsSum;
use crate::memory::MemoryBudget;
use bytemuck::{Pod, Zeroable};
use cittert_arrays::{Polarization, Ranks, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource, found_shared, place_among};
use ndarray::Array3;
use num_complex::{Complex32, Complex64};
use rayon::prelude::*;
use std::ops::Range;

/// About so many visibilities are looked at. A larger set is sampled in runs of rows, so that the verdict costs little beside the fit.
const MOST: usize = 1 << 20;
/// Size in bytes of a visibility, its weight, its number of samples, its flag and its prediction.
const BYTES_PER_SAMPLE: usize = 25;
/// Values whose samples are made together.
const TOGETHER: usize = 1 << 16;
/// Number of runs of rows of a set that is sampled.
const RUNS: usize = 64;

/// The visibilities of a set in lists of a few megabytes, which find a place in the memory that the image has left.
pub(super) type Samples = Vec<Vec<Sample>>;

/// One visibility.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Sample {
    pub(super) pair: [u32; 2],
    /// Squared length, wavelengths.
    pub(super) length2: f64,
    pub(super) weight: f64,
    /// Squared moduli of residual and model.
    pub(super) left2: f64,
    pub(super) model2: f64,
    /// Real and imaginary part of the residual times the conjugate of the model.
    pub(super) along: f64,
    pub(super) across: f64,
    /// Offset from the middle of the band, over its frequency.
    pub(super) off: f64,
}

impl Sample {
    /// The squared residual in units of the noise of a real part, halved: 1 is expected.
    pub(super) fn misfit(&self) -> f64 {
        0.5 * self.weight * self.left2
    }

    /// Squared modulus of the data.
    pub(super) fn data2(&self) -> f64 {
        (self.model2 + self.left2 + 2.0 * self.along).max(0.0)
    }
}

/// The rows of a set that are looked at.
fn runs(n_rows: usize, per_row: usize, block: usize) -> Vec<Range<usize>> {
    let total = n_rows.saturating_mul(per_row);
    let (count, length) = if total <= MOST { (1, n_rows) } else { (RUNS, (MOST / per_row.max(1) / RUNS).max(1)) };
    let step = n_rows / count;
    (0..count)
        .flat_map(|k| {
            let (from, to) = (k * step, (k * step + length).min(n_rows));
            (from..to).step_by(block.max(1)).map(move |first| first..(first + block.max(1)).min(to))
        })
        .collect()
}

/// About so many rows of a set are looked at, of `per_row` visibilities each.
pub(super) fn rows_looked_at(n_rows: usize, per_row: usize) -> usize {
    n_rows.min((MOST / per_row.max(1)).max(RUNS))
}

/// Samples of the rows of all processes, and what the parallel hands of these rows tell of the noise. The samples are those that one process would take. Process 0
/// gets all of them, and the others none.
///
/// # Errors
/// The data cannot be read, or the model cannot be evaluated, in any process.
pub(super) fn look(data: &mut dyn VisibilitySource, model: &mut dyn ModelVisibilities) -> Result<(Samples, HandsSum)> {
    let ranks = data.ranks();
    let mut hands = HandsSum::new(data.header());
    let (own, ended) = match own_samples(data, model, &mut hands) {
        Ok(own) => (own, Ok(Vec::new())),
        Err(e) => (Samples::new(), Err(e)),
    };
    // No process waits for samples of one that has failed.
    of_all(&*ranks, ended)?;
    hands.share(&*ranks);
    Ok((gathered(&*ranks, own), hands))
}

/// The samples of the rows of this process.
fn own_samples(data: &mut dyn VisibilitySource, model: &mut dyn ModelVisibilities, hands: &mut HandsSum) -> Result<Samples> {
    let mut samples = Samples::new();
    for_each_looked_at(data, |header, blocks| {
        // Each block has sums of its own, which are added in the order of the blocks.
        let sum_of = |(_, block): &(usize, VisibilityBlock)| {
            let mut sum = HandsSum::new(header);
            sum.add(block);
            sum
        };
        let sums: Vec<HandsSum> = blocks.par_iter().map(sum_of).collect();
        sums.iter().for_each(|sum| hands.include(sum));
        add(&mut samples, header, blocks, model)
    })?;
    Ok(samples)
}

/// Give `visit` those rows of this process that are looked at: some blocks at once, each with the index of its first row.
///
/// # Errors
/// The data cannot be read, or `visit` fails.
pub(super) fn for_each_looked_at(
    data: &mut dyn VisibilitySource,
    mut visit: impl FnMut(&VisibilityHeader, &[(usize, VisibilityBlock)]) -> Result<()>,
) -> Result<()> {
    let header = data.header().clone();
    let per_row = header.spectrum.n_chan() * header.polarizations.len();
    let rows_at_once = MemoryBudget::default().block() / (per_row * BYTES_PER_SAMPLE).max(1);
    let (first, total) = place_among(&*data.ranks(), data.n_rows());
    let own = first..first + data.n_rows();
    let inside = |rows: Range<usize>| rows.start.max(own.start)..rows.end.min(own.end);
    let all: Vec<Range<usize>> = runs(total, per_row, rows_at_once).into_iter().map(inside).filter(|rows| !rows.is_empty()).collect();
    let all: Vec<Range<usize>> = all.into_iter().map(|rows| rows.start - first..rows.end - first).collect();
    let mut rest = &all[..];
    while !rest.is_empty() {
        let ends = rest.iter().scan(0, |rows, run| {
            *rows += run.len();
            Some(*rows)
        });
        let (now, later) = rest.split_at(ends.take_while(|rows| *rows <= rows_at_once).count().max(1));
        let blocks: Vec<_> = now.iter().map(|run| run.start).zip(data.read_runs(now)?).collect();
        visit(&header, &blocks)?;
        rest = later;
    }
    Ok(())
}

/// The samples of all processes, in their order, in process 0.
fn gathered(ranks: &dyn Ranks, own: Samples) -> Samples {
    if ranks.rank() > 0 {
        ranks.send(0, bytemuck::cast_slice(&own.concat()));
        return Samples::new();
    }
    let of_others = (1..ranks.size()).map(|process| bytemuck::pod_collect_to_vec(&ranks.awaited(process)));
    own.into_iter().chain(of_others).filter(|list| !list.is_empty()).collect()
}

/// Add the samples of blocks, each with the index of its first row.
fn add(
    samples: &mut Samples,
    header: &VisibilityHeader,
    blocks: &[(usize, VisibilityBlock)],
    model: &mut dyn ModelVisibilities,
) -> Result<()> {
    let runs: Vec<(usize, &UvCoverage)> = blocks.iter().map(|(first, block)| (*first, &block.coverage)).collect();
    let predicted = model.predict_runs(header, &runs)?;
    blocks.iter().zip(&predicted).for_each(|((_, block), predicted)| add_block(samples, header, block, predicted));
    Ok(())
}

/// The other parallel hand of each product, where the set has it.
fn other_hands(polarizations: &[Polarization]) -> Vec<Option<usize>> {
    use Polarization::{LL, RR, XX, YY};
    let other = |p: &Polarization| match p {
        RR => Some(LL),
        LL => Some(RR),
        XX => Some(YY),
        YY => Some(XX),
        _ => None,
    };
    polarizations.iter().map(|p| other(p).and_then(|o| polarizations.iter().position(|q| *q == o))).collect()
}

/// The image is one of total intensity. So two parallel hands make one sample, their mean: what differs between them is polarisation, which such
/// an image does not have to explain.
fn add_block(samples: &mut Samples, header: &VisibilityHeader, block: &VisibilityBlock, predicted: &Array3<Complex32>) {
    let wide = |v: Complex32| Complex64::new(f64::from(v.re), f64::from(v.im));
    let freq_hz = header.spectrum.freq_hz();
    let middle_hz = freq_hz.iter().sum::<f64>() / freq_hz.len().max(1) as f64;
    let others = other_hands(&header.polarizations);
    let weight_of = |at: (usize, usize, usize)| {
        let weight = f64::from(block.usable_weight(at.0, at.1, at.2));
        if weight > 0.0 && predicted[at].is_finite() { weight } else { 0.0 }
    };
    let sample = |row: usize, c: usize, p: usize| {
        let pair = (block.coverage.ant1[row], block.coverage.ant2[row]);
        let own = weight_of((row, c, p));
        if pair.0 == pair.1 || own == 0.0 || !sees_unpolarized(header.polarizations[p]) {
            return None;
        }
        let (v, m) = (wide(block.vis[(row, c, p)]), wide(predicted[(row, c, p)]));
        let (v, m, weight) = match others[p].map(|q| (q, weight_of((row, c, q)))) {
            Some((q, w)) if w > 0.0 => {
                if q < p {
                    return None;
                }
                let mean = |a: Complex64, b: Complex32| 0.5 * (a + wide(b));
                // The mean has a quarter of the sum of the variances.
                (mean(v, block.vis[(row, c, q)]), mean(m, predicted[(row, c, q)]), 4.0 / (own.recip() + w.recip()))
            }
            _ => (v, m, own),
        };
        let (uvw, turned) = (block.coverage.uvw_m.row(row), (v - m) * m.conj());
        let per_m = freq_hz[c] / cittert_arrays::SPEED_OF_LIGHT_M_S;
        Some(Sample {
            pair: [pair.0.min(pair.1), pair.0.max(pair.1)],
            length2: (uvw[0] * uvw[0] + uvw[1] * uvw[1]) * per_m * per_m,
            weight,
            left2: (v - m).norm_sqr(),
            model2: m.norm_sqr(),
            along: turned.re,
            // The visibility of a baseline in the other direction is the conjugate.
            across: if pair.0 > pair.1 { -turned.im } else { turned.im },
            off: freq_hz[c] / middle_hz - 1.0,
        })
    };
    let (n_row, n_chan, n_pol) = block.vis.dim();
    let of_row = |row: usize| (0..n_chan).flat_map(move |c| (0..n_pol).map(move |p| (row, c, p)));
    let step = (TOGETHER / (n_chan * n_pol).max(1)).max(1);
    for first in (0..n_row).step_by(step) {
        let rows = first..(first + step).min(n_row);
        let list =
            found_shared(rows, n_chan * n_pol, |rows, list| list.extend(rows.flat_map(of_row).filter_map(|(row, c, p)| sample(row, c, p))));
        samples.extend((!list.is_empty()).then_some(list));
    }
}

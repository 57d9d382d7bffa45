//! What the first pass over a set finds: numbers of visibilities, coverage and weights.

use super::pol::DataCounts;
use super::reduction::ReducedBlock;
use super::total_power::TotalPower;
use crate::fourier::UvwExtent;
use cittert_arrays::{Ranks, SPEED_OF_LIGHT_M_S};
use ndarray::{ArrayView1, Axis};
use rayon::prelude::*;

/// Number of factors of two of baseline lengths that are told apart. No baseline has 2^48 wavelengths.
const OCTAVES: usize = 48;

/// How the exponent of 1 is stored in a number of double precision.
const EXPONENT_OF_ONE: usize = 1023;

/// Weights of the rows that are measured together on one thread.
const VALUES: usize = 1 << 16;

/// The results of the first pass.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Survey {
    /// Numbers of used and unused visibilities.
    pub counts: DataCounts,
    /// Largest u, v and w.
    pub extent: UvwExtent,
    /// Shortest and longest projected baseline of used rows over all channels, wavelengths.
    pub uv_range_wl: (f64, f64),
    /// Shortest of these baselines in each factor of two, wavelengths: entry k is that between 2^k and 2^(k + 1), or infinite.
    pub shortest_by_octave_wl: Vec<f64>,
    /// Sum of the weights of the data in each channel \[chan\].
    pub channel_weight: Vec<f64>,
    /// Sums over the autocorrelations whose receivers are stated.
    pub total_power: TotalPower,
    /// Middle between the first and the last time, Julian date.
    pub time_jd: Option<f64>,
    /// Index of the phase centre of the rows.
    pub phase_center: usize,
}

impl Survey {
    /// The survey of no rows yet, of a set with so many channels.
    pub(super) fn new(n_chan: usize, total_power: TotalPower) -> Self {
        Self {
            channel_weight: vec![0.0; n_chan],
            uv_range_wl: (f64::INFINITY, 0.0),
            shortest_by_octave_wl: vec![f64::INFINITY; OCTAVES],
            total_power,
            ..Self::default()
        }
    }

    /// Note the length of a projected baseline, m over the speed of light, in a band, Hz.
    pub(super) fn see(&mut self, length: f64, (low_hz, high_hz): (f64, f64)) {
        self.uv_range_wl = (self.uv_range_wl.0.min(length * low_hz), self.uv_range_wl.1.max(length * high_hz));
        // The exponent of a number is its logarithm to base 2, rounded down.
        let exponent = ((length * low_hz).to_bits() >> 52 & 0x7ff) as usize;
        let octave = exponent.saturating_sub(EXPONENT_OF_ONE).min(OCTAVES - 1);
        let shortest = &mut self.shortest_by_octave_wl[octave];
        *shortest = shortest.min(length * low_hz);
    }

    /// Add the baselines and weights of rows. The sums do not depend on the number of threads.
    pub(super) fn measure(&mut self, rows: &ReducedBlock, band_hz: (f64, f64)) {
        let weight = rows.weight.view();
        let n_chan = weight.ncols();
        let any = |weights: ArrayView1<'_, f32>| weights.iter().any(|w| *w > 0.0);
        // Where all rows have the same weights, they are summed at once.
        let same = rows.weight.of_every_row().map(|row| (row, any(row.view())));
        let step = (VALUES / n_chan.max(1)).max(1);
        let parts = rows.uvw_m.axis_chunks_iter(Axis(0), step).into_par_iter().zip(weight.axis_chunks_iter(Axis(0), step));
        let parts = parts.map(|(uvw_m, weight)| {
            let mut part = Self::new(n_chan, TotalPower::default());
            for (uvw, weights) in uvw_m.rows().into_iter().zip(weight.rows()) {
                if same.map_or_else(|| any(weights), |(_, used)| used) {
                    part.see((uvw[0] * uvw[0] + uvw[1] * uvw[1]).sqrt() / SPEED_OF_LIGHT_M_S, band_hz);
                    if same.is_none() {
                        weights.iter().zip(&mut part.channel_weight).for_each(|(w, sum)| *sum += f64::from(*w));
                    }
                }
            }
            if let Some((row, true)) = same {
                part.channel_weight = row.iter().map(|w| f64::from(*w) * uvw_m.nrows() as f64).collect();
            }
            part
        });
        for part in parts.collect::<Vec<_>>() {
            let (nearest, farthest) = part.uv_range_wl;
            self.uv_range_wl = (self.uv_range_wl.0.min(nearest), self.uv_range_wl.1.max(farthest));
            self.shortest_by_octave_wl.iter_mut().zip(&part.shortest_by_octave_wl).for_each(|(a, b)| *a = a.min(*b));
            self.channel_weight.iter_mut().zip(&part.channel_weight).for_each(|(a, b)| *a += b);
        }
    }

    /// Make the results of the rows of this process, and the first and last of their times, those of all rows.
    pub(super) fn share(&mut self, ranks: &dyn Ranks, times: &mut (f64, f64)) {
        self.counts.share(ranks);
        self.total_power.share(ranks);
        ranks.sum(&mut self.channel_weight);
        self.extent = self.extent.shared(ranks);
        let mut largest = vec![self.uv_range_wl.1, times.1, -self.uv_range_wl.0, -times.0];
        let n = largest.len();
        largest.extend(self.shortest_by_octave_wl.iter().map(|x| -x));
        ranks.largest(&mut largest);
        self.uv_range_wl = (-largest[2], largest[0]);
        *times = (-largest[3], largest[1]);
        self.shortest_by_octave_wl.iter_mut().zip(&largest[n..]).for_each(|(x, negative)| *x = -negative);
    }
}

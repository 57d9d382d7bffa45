//! Where a time and a frequency are in a gain table.

use cittert_arrays::GainTable;
use num_complex::Complex64;

/// Interval that holds a time (the shortest of several), or the one with the nearest middle.
pub(crate) fn interval_of(table: &GainTable, time_jd: f64) -> usize {
    let holds = |i: &usize| (table.time_jd[*i] - time_jd).abs() * 86_400.0 <= table.interval_s[*i] / 2.0 + 1e-3;
    (0..table.time_jd.len())
        .filter(holds)
        .min_by(|a, b| table.interval_s[*a].total_cmp(&table.interval_s[*b]))
        .unwrap_or_else(|| table.interval_at(time_jd))
}

pub(crate) fn known(table: &GainTable, at: (usize, usize, usize, usize)) -> Option<Complex64> {
    let g = table.gains[at];
    (!table.flags[at] && g.norm_sqr() > 0.0 && g.norm_sqr().is_finite()).then_some(g)
}

pub(crate) fn nearest_channel(table: &GainTable, freq_hz: f64) -> usize {
    let s = &table.spectrum;
    // The distance from the edge of the channel comes first, so that a wide channel that contains the frequency is preferred to a channel
    // with a near centre.
    let distance = |c: &usize| {
        let d = (s.freq_hz()[*c] - freq_hz).abs();
        ((d - s.width_hz()[*c] / 2.0).max(0.0), d)
    };
    let nearer = |a: &usize, b: &usize| {
        let (a, b) = (distance(a), distance(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    };
    // A spectral window has at least one channel.
    (0..s.n_chan()).min_by(nearer).unwrap_or(0)
}

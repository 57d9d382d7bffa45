//! The reference antenna, whose phase is zero, and its substitutes where it has no solution.

use cittert_arrays::GainTable;
use ndarray::Array4;
use num_complex::Complex64;

/// Antennas in the order in which they are used as reference. The requested antennas come first, if they are solved in any interval. The
/// others follow in order of the number and quality of their solutions.
pub(crate) fn reference_priority(flags: &Array4<bool>, quality: &Array4<f64>, wished: &[usize]) -> Vec<usize> {
    let n_ant = flags.dim().1;
    let score = |a: usize| {
        let solved = flags.index_axis(ndarray::Axis(1), a);
        let good = solved.iter().zip(quality.index_axis(ndarray::Axis(1), a)).filter(|(f, _)| !**f);
        good.fold((0_usize, 0.0), |(n, q), (_, snr)| (n + 1, q + snr))
    };
    let scores: Vec<(usize, f64)> = (0..n_ant).map(score).collect();
    let mut order: Vec<usize> = wished.iter().copied().filter(|a| scores[*a].0 > 0).collect();
    let mut others: Vec<usize> = (0..n_ant).filter(|a| scores[*a].0 > 0 && !order.contains(a)).collect();
    others.sort_by(|a, b| scores[*b].0.cmp(&scores[*a].0).then(scores[*b].1.total_cmp(&scores[*a].1)).then(a.cmp(b)));
    order.extend(others);
    order
}

/// Refer the phases of each solution to the first antenna of `priority` that is solved in it. The first choice gets the phase zero. A
/// substitute keeps the phase of its last solution, so that the phases of the other antennas do not jump. Returns the number of solutions
/// (interval and feed) with a substitute.
pub(crate) fn reference_phases(table: &mut GainTable, quality: &Array4<f64>, priority: &[usize]) -> usize {
    let (n_time, n_ant, n_chan, n_feed) = table.gains.dim();
    let mut substitutes = 0;
    for feed in 0..n_feed {
        let mut substituted = vec![false; n_time];
        for chan in 0..n_chan {
            let mut last: Vec<Option<Complex64>> = vec![None; n_ant];
            for t in 0..n_time {
                let solved = |a: &usize| !table.flags[(t, *a, chan, feed)];
                let Some(first) = priority.first() else { return 0 };
                let chosen = if solved(first) {
                    Some(*first)
                } else {
                    // A substitute with an earlier phase is preferred. Among several, the one with the best present solution is used.
                    let best = |known: bool| {
                        priority
                            .iter()
                            .copied()
                            .filter(|a| solved(a) && (last[*a].is_some() || !known))
                            .max_by(|a, b| quality[(t, *a, chan, feed)].total_cmp(&quality[(t, *b, chan, feed)]))
                    };
                    best(true).or_else(|| best(false))
                };
                let Some(chosen) = chosen else { continue };
                substituted[t] |= chosen != *first;
                let due = if chosen == *first { Complex64::new(1.0, 0.0) } else { last[chosen].unwrap_or(Complex64::new(1.0, 0.0)) };
                let now = table.gains[(t, chosen, chan, feed)];
                let turn = due * (now / now.norm()).conj();
                for (a, last) in last.iter_mut().enumerate() {
                    if !table.flags[(t, a, chan, feed)] {
                        let g = table.gains[(t, a, chan, feed)] * turn;
                        table.gains[(t, a, chan, feed)] = g;
                        *last = Some(g / g.norm());
                    }
                }
            }
        }
        substitutes += substituted.iter().filter(|s| **s).count();
    }
    substitutes
}

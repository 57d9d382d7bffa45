//! What a calibration can determine: its unknowns, its independent observables, and the modes that no observable measures.
//!
//! The logarithm of a visibility is linear in the logarithms of the gains, so one Jacobian holds for all values. Phases and amplitudes
//! separate. The visibilities of a free image are unknowns too, one for each different baseline. They are eliminated first: a baseline
//! that occurs once gives no information about gains, and baselines that repeat give the differences of their gains. The rank follows
//! from the singular values. Each known degeneracy is projected on the null space, and named if it lies in it.
//!
//! # Reference
//! Pearson & Readhead 1984, ARA&A 22, 97 (closure and its counts); Wieringa 1992, Exp. Astron. 2, 203 and Liu et al. 2010,
//! MNRAS 408, 1029 (redundant baselines).

use super::options::GainMode;
use crate::closure::pairs_of;
use crate::linalg::{Matrix, dot, numerical_rank, singular_values, triangularise};
use crate::{ChainError, Result};
use cittert_arrays::quantity::{Frequency, Length};
use cittert_arrays::{ArrayLayout, SPEED_OF_LIGHT_M_S};
use std::f64::consts::TAU;

/// What is known about the sky.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum ModelKnowledge {
    /// Everything.
    Known,
    /// The sky is one point of unknown position and flux.
    #[cfg_attr(feature = "cli", value(name = "point"))]
    UnknownPoint,
    /// Nothing: the visibility of every different baseline is an unknown.
    #[cfg_attr(feature = "cli", value(name = "free"))]
    FreeImage,
}

/// Options of [`identify`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct IdentifyOptions {
    /// Which part of the gains is solved for.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t = IdentifyOptions::default().mode))]
    pub mode: GainMode,
    /// What is known about the sky.
    #[cfg_attr(feature = "cli", arg(long, value_enum, default_value_t = IdentifyOptions::default().model))]
    pub model: ModelKnowledge,
    /// Frequency.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ", default_value_t = IdentifyOptions::default().freq))]
    pub freq: Frequency,
    /// Bandwidth over which delays are measured.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ", default_value_t = IdentifyOptions::default().bandwidth))]
    pub bandwidth: Frequency,
    /// Baselines that differ by less than this count as the same.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH", default_value = "0.1mm"))]
    pub redundancy: Length,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        let (mode, model) = (GainMode::AmpPhase, ModelKnowledge::FreeImage);
        Self { mode, model, freq: Frequency(1e9), bandwidth: Frequency(1e8), redundancy: Length(1e-4) }
    }
}

/// A direction in the space of unknowns on which no observable depends.
#[derive(Debug, Clone, PartialEq)]
pub struct DegenerateMode {
    /// Its name, such as "common phase" or "image shift along l".
    pub name: String,
    /// Number of dimensions of the null space with this name.
    pub dimensions: usize,
}

/// Counts of a calibration problem. All numbers are of real quantities, for one integration.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Antennas.
    pub antennas: usize,
    /// Pairs of antennas.
    pub baselines: usize,
    /// Different baselines.
    pub unique_baselines: usize,
    /// Unknowns of the antennas.
    pub gain_unknowns: usize,
    /// Unknowns of the sky.
    pub sky_unknowns: usize,
    /// Measured phases and amplitudes that depend on the unknowns.
    pub observables: usize,
    /// Rank of the Jacobian: independent combinations of unknowns that are measured.
    pub rank: usize,
    /// Dimensions of the null space: number of unknowns minus rank.
    pub null_dimensions: usize,
    /// The null space by name; the dimensions add up to `null_dimensions`.
    pub modes: Vec<DegenerateMode>,
    /// Independent closure phases: number of baselines minus the rank of the antenna phases in them.
    pub closure_phases: usize,
    /// Independent closure amplitudes.
    pub closure_amplitudes: usize,
    /// Largest over smallest singular value that counts.
    pub condition: f64,
}

/// One half of the problem: phases or amplitudes. The unknowns of a free image are eliminated.
struct Half {
    rank: usize,
    null: Vec<Vec<f64>>,
    largest: f64,
    smallest: f64,
}

/// Count unknowns, observables and null space of calibrating an array in one integration.
///
/// # Errors
/// Fewer than 2 antennas, more than 256 (the matrices are dense), or a frequency or bandwidth that is not positive.
pub fn identify(layout: &ArrayLayout, options: &IdentifyOptions) -> Result<Identifiability> {
    let n = layout.n_ant();
    if !(2..=256).contains(&n) {
        return Err(ChainError::BadOption { option: "antennas", value: n.to_string(), expected: "2 to 256".into() });
    }
    let (freq_hz, bandwidth_hz) = (options.freq.si(), options.bandwidth.si());
    for (option, value) in [("freq", freq_hz), ("bandwidth", bandwidth_hz)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(ChainError::BadOption { option, value: value.to_string(), expected: "a positive frequency".into() });
        }
    }
    let position: Vec<[f64; 3]> = layout.antennas().iter().map(|a| a.position_m).collect();
    let group = redundant_groups(&position, options.redundancy.si());
    let unique = group.iter().map(|g| g.0 + 1).max().unwrap_or(0);
    let baselines = layout.n_baselines();
    let delay = options.mode == GainMode::Delay;
    // Two frequencies measure a phase and a delay; x is the offset from the middle of the band in half bandwidths.
    let channels: Vec<f64> = if delay { vec![-1.0, 1.0] } else { vec![0.0] };
    let point = options.model == ModelKnowledge::UnknownPoint;
    let free = options.model == ModelKnowledge::FreeImage;

    // Phases: the columns are antenna phases, then delays, then the position of the point.
    let per_antenna = channels.len();
    let turns = |x: f64, k: usize, p: usize| TAU * (freq_hz + x * bandwidth_hz / 2.0) / SPEED_OF_LIGHT_M_S * position[p][k];
    let scale = scale_of(&position, freq_hz);
    let columns = per_antenna * n + if point { 2 } else { 0 };
    // The part of antenna p in the rows of its baselines, at offset x.
    let phase_part = |x: f64, p: usize| {
        let mut part = vec![0.0; columns];
        for (i, power) in [1.0, x].iter().take(per_antenna).enumerate() {
            part[i * n + p] = *power;
        }
        if point {
            (0..2).for_each(|k| part[per_antenna * n + k] = -turns(x, k, p) / scale);
        }
        part
    };
    let mut stack = RowStack::new(columns);
    for x in &channels {
        let parts: Vec<Vec<f64>> = (0..n).map(|p| phase_part(*x, p)).collect();
        if free { stack.add_groups(&parts, &group, -1.0) } else { stack.add_differences(&parts) }
    }
    let phase = stack.decompose();
    let mut named = Vec::new();
    let mut candidates = phase_candidates(n, &channels, &turns, scale, point);
    if !point && !free {
        candidates.retain(|(name, _)| name.starts_with("common"));
    }
    let left = name_modes(&phase.null, candidates, &mut named);
    if left > 0 {
        let name = if free { "antenna phases that the free image absorbs" } else { "phases between separate groups of antennas" };
        named.push(DegenerateMode { name: name.into(), dimensions: left });
    }

    // Amplitudes: the columns are log amplitudes, if they are solved, then the log flux of the point.
    let gains = options.mode == GainMode::AmpPhase;
    let columns = if gains { n } else { 0 } + usize::from(point);
    let amplitude_part = |p: usize| {
        let mut part = vec![0.0; columns];
        if gains {
            part[p] = 1.0;
        }
        if point {
            part[columns - 1] = 0.5;
        }
        part
    };
    let parts: Vec<Vec<f64>> = (0..n).map(amplitude_part).collect();
    let mut stack = RowStack::new(columns);
    if free {
        stack.add_groups(&parts, &group, 1.0)
    } else {
        stack.add_sums(&parts)
    }
    let amplitude = stack.decompose();
    if columns > 0 {
        let mut flux = vec![1.0; columns];
        if point && gains {
            flux[columns - 1] = -2.0;
        }
        let candidates = if point || free { vec![("flux scale".to_owned(), flux)] } else { Vec::new() };
        let left = name_modes(&amplitude.null, candidates, &mut named);
        if left > 0 {
            let name = if free { "antenna amplitudes that the free image absorbs" } else { "amplitudes traded between antennas" };
            named.push(DegenerateMode { name: name.into(), dimensions: left });
        }
    }

    let sky_visibilities = if free { unique * channels.len() } else { 0 };
    // The amplitudes of a free image are unknowns in every mode. Each one is measured by one datum.
    let amplitude_unknowns = columns + if free { unique * channels.len() } else { 0 };
    let phase_unknowns = per_antenna * n + if point { 2 } else { 0 } + sky_visibilities;
    let unknowns = phase_unknowns + amplitude_unknowns;
    let sky_unknowns = 2 * sky_visibilities + if point { 3 } else { 0 };
    let amplitude_data = if gains || point || free { baselines * channels.len() } else { 0 };
    let rank = phase.rank + amplitude.rank + 2 * sky_visibilities;
    let units: Vec<Vec<f64>> = (0..n).map(|p| (0..n).map(|q| if p == q { 1.0 } else { 0.0 }).collect()).collect();
    let (mut differences, mut sums) = (RowStack::new(n), RowStack::new(n));
    differences.add_differences(&units);
    sums.add_sums(&units);
    let (largest, smallest) = (phase.largest.max(amplitude.largest), phase.smallest.min(amplitude.smallest));
    Ok(Identifiability {
        antennas: n,
        baselines,
        unique_baselines: unique,
        gain_unknowns: unknowns - sky_unknowns,
        sky_unknowns,
        observables: baselines * channels.len() + amplitude_data,
        rank,
        null_dimensions: unknowns - rank,
        modes: named,
        closure_phases: baselines - differences.decompose().rank,
        closure_amplitudes: baselines - sums.decompose().rank,
        condition: if smallest.is_finite() && smallest > 0.0 { largest / smallest } else { 1.0 },
    })
}

/// For each pair p < q: the number of its group of equal baselines, and -1 if the pair measures the reversed baseline of the group.
fn redundant_groups(position: &[[f64; 3]], tolerance_m: f64) -> Vec<(usize, f64)> {
    let mut seen: Vec<[f64; 3]> = Vec::new();
    // Groups by the length of their baseline, so that only groups of the same length are compared.
    let mut by_length: Vec<(f64, usize)> = Vec::new();
    pairs_of(position.len())
        .map(|(p, q)| {
            let d = [0, 1, 2].map(|k| position[q][k] - position[p][k]);
            let length = dot(&d, &d).sqrt();
            let from = by_length.partition_point(|(l, _)| *l < length - tolerance_m);
            let near = by_length[from..].iter().take_while(|(l, _)| *l <= length + tolerance_m);
            let off = |g: usize, sign: f64| (0..3).map(|k| (seen[g][k] - sign * d[k]).powi(2)).sum::<f64>().sqrt();
            let same = near.flat_map(|(_, g)| [(*g, 1.0), (*g, -1.0)]).find(|(g, sign)| off(*g, *sign) < tolerance_m);
            same.unwrap_or_else(|| {
                seen.push(d);
                let at = by_length.partition_point(|(l, _)| *l < length);
                by_length.insert(at, (length, seen.len() - 1));
                (seen.len() - 1, 1.0)
            })
        })
        .collect()
}

/// A typical phase across the array, rad. It gives the columns similar sizes.
fn scale_of(position: &[[f64; 3]], freq_hz: f64) -> f64 {
    let mean = [0, 1, 2].map(|k| position.iter().map(|p| p[k]).sum::<f64>() / position.len() as f64);
    let spread = position.iter().map(|p| (0..3).map(|k| (p[k] - mean[k]).powi(2)).sum::<f64>()).sum::<f64>() / position.len() as f64;
    (TAU * freq_hz / SPEED_OF_LIGHT_M_S * spread.sqrt()).max(f64::MIN_POSITIVE)
}

/// Rows of a Jacobian. All pairs of n antennas make n (n - 1) / 2 rows. These rows are not kept. Fewer rows with the same normal matrix are
/// kept instead; they have the same singular values and the same null space.
pub(super) struct RowStack {
    columns: usize,
    rows: Vec<Vec<f64>>,
    /// Rows that were added.
    seen: usize,
}

impl RowStack {
    pub(super) fn new(columns: usize) -> Self {
        Self { columns, rows: Vec::new(), seen: 0 }
    }

    fn push(&mut self, row: Vec<f64>) {
        self.seen += 1;
        self.rows.push(row);
        // The triangle has the same normal matrix as all rows before it.
        if self.rows.len() >= 4 * self.columns.max(16) {
            let mut m = self.matrix();
            triangularise(&mut m);
            self.rows = (0..self.columns).map(|r| (0..self.columns).map(|c| if c < r { 0.0 } else { m[(r, c)] }).collect()).collect();
        }
    }

    fn matrix(&self) -> Matrix {
        let mut m = Matrix::zeros(self.rows.len().max(1), self.columns);
        self.rows.iter().enumerate().for_each(|(i, r)| m.row_mut(i).copy_from_slice(r));
        m
    }

    /// The rows a_p - a_q of all pairs: their normal matrix is n sum (a_p - mean)(a_p - mean)^T.
    pub(super) fn add_differences(&mut self, parts: &[Vec<f64>]) {
        let n = parts.len() as f64;
        let mean: Vec<f64> = (0..self.columns).map(|c| parts.iter().map(|a| a[c]).sum::<f64>() / n).collect();
        for a in parts {
            self.push(a.iter().zip(&mean).map(|(a, m)| (a - m) * n.sqrt()).collect());
        }
    }

    /// The rows a_p + a_q of all pairs: their normal matrix is (n - 2) sum a_p a_p^T + (sum a_p)(sum a_p)^T.
    pub(super) fn add_sums(&mut self, parts: &[Vec<f64>]) {
        let factor = (parts.len() as f64 - 2.0).max(0.0).sqrt();
        for a in parts {
            self.push(a.iter().map(|a| a * factor).collect());
        }
        self.push((0..self.columns).map(|c| parts.iter().map(|a| a[c]).sum()).collect());
    }

    /// The rows a_p + sign a_q minus the mean of their group of equal baselines, because a free image absorbs that mean. Phases (sign -1)
    /// of reversed baselines get the opposite sign.
    fn add_groups(&mut self, parts: &[Vec<f64>], group: &[(usize, f64)], sign: f64) {
        struct Member {
            group: usize,
            turn: f64,
            pair: (usize, usize),
        }
        let mut members: Vec<Member> =
            pairs_of(parts.len()).zip(group).map(|(pair, (g, turn))| Member { group: *g, turn: *turn, pair }).collect();
        members.sort_by_key(|m| m.group);
        for group in members.chunk_by(|a, b| a.group == b.group).filter(|g| g.len() > 1) {
            let row = |m: &Member| {
                let turn = if sign < 0.0 { m.turn } else { 1.0 };
                parts[m.pair.0].iter().zip(&parts[m.pair.1]).map(|(a, b)| turn * (a + sign * b)).collect::<Vec<f64>>()
            };
            let mut mean = vec![0.0; self.columns];
            for m in group {
                mean.iter_mut().zip(row(m)).for_each(|(s, r)| *s += r / group.len() as f64);
            }
            for m in group {
                self.push(row(m).iter().zip(&mean).map(|(r, m)| r - m).collect());
            }
        }
    }

    /// Rank, null space and extreme singular values.
    fn decompose(&self) -> Half {
        if self.columns == 0 {
            return Half { rank: 0, null: Vec::new(), largest: 0.0, smallest: f64::INFINITY };
        }
        let (sigma, vectors) = singular_values(self.matrix());
        let rank = numerical_rank(&sigma, self.seen);
        Half {
            rank,
            null: (rank..self.columns).map(|i| vectors.row(i).to_vec()).collect(),
            largest: sigma.first().copied().unwrap_or(0.0),
            smallest: if rank > 0 { sigma[rank - 1] } else { f64::INFINITY },
        }
    }

    #[cfg(test)]
    pub(super) fn singular_values(&self) -> Vec<f64> {
        singular_values(self.matrix()).0
    }
}

/// Directions that are known to be degenerate, by name.
fn phase_candidates(
    n: usize,
    channels: &[f64],
    turns: &dyn Fn(f64, usize, usize) -> f64,
    scale: f64,
    point: bool,
) -> Vec<(String, Vec<f64>)> {
    let blocks = channels.len();
    let columns = blocks * n + if point { 2 } else { 0 };
    let mut out = Vec::new();
    for (i, name) in ["common phase", "common delay"].iter().take(blocks).enumerate() {
        let mut v = vec![0.0; columns];
        v[i * n..(i + 1) * n].fill(1.0);
        out.push(((*name).to_owned(), v));
    }
    let axes = ["image shift along l", "image shift along m", "phase gradient along the line of sight"];
    for (k, name) in axes.iter().enumerate().take(if point { 2 } else { 3 }) {
        let mut v = vec![0.0; columns];
        for p in 0..n {
            // Split into the value at the middle of the band and the change over half of it.
            let (low, high) = (turns(-1.0, k, p), turns(1.0, k, p));
            v[p] = if blocks == 2 { (low + high) / 2.0 } else { turns(0.0, k, p) };
            if blocks == 2 {
                v[n + p] = (high - low) / 2.0;
            }
        }
        if point {
            v[blocks * n + k] = scale;
        }
        out.push(((*name).to_owned(), v));
    }
    out
}

/// Name the candidates that lie in the null space (to 1e-6 of their length) and are independent of the earlier ones. Returns the number of
/// dimensions without a name.
fn name_modes(null: &[Vec<f64>], candidates: Vec<(String, Vec<f64>)>, named: &mut Vec<DegenerateMode>) -> usize {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for (name, v) in candidates {
        let length = dot(&v, &v).sqrt();
        let inside: f64 = null.iter().map(|u| dot(u, &v).powi(2)).sum();
        if length == 0.0 || (length * length - inside).abs() > 1e-6 * length * length {
            continue;
        }
        let mut rest = v.clone();
        for _ in 0..2 {
            for b in &basis {
                let along = dot(b, &rest);
                rest.iter_mut().zip(b).for_each(|(r, b)| *r -= along * b);
            }
        }
        let size = dot(&rest, &rest).sqrt();
        // A gradient along an axis in which the array has no extent is a combination of other modes.
        if size > 1e-6 * length && basis.len() < null.len() {
            rest.iter_mut().for_each(|r| *r /= size);
            basis.push(rest);
            named.push(DegenerateMode { name, dimensions: 1 });
        }
    }
    null.len() - basis.len()
}

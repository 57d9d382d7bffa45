//! The side lobes of an array of which one antenna moves at a time.
//!
//! A move changes one phasor of each sum, so it costs a few operations for each direction, however many antennas there are. A search mostly tries
//! moves that are worse than it accepts. The rows of directions are therefore looked at in the order of their highest lobe, and the first direction
//! that is too high ends the look: the answer is the same as after all directions.

use super::lobes::{LobeField, LobeGrid, MovedAntenna};
use super::views::View;

/// The beam of an array on a grid, and the move that is tried.
#[derive(Debug, Clone)]
pub struct MovingLobes {
    views: Vec<View>,
    fields: Vec<LobeField>,
    moved: Vec<MovedAntenna>,
    xy: Vec<[f64; 2]>,
    /// The highest power of each row \[i\], and the rows in the order in which they are looked at.
    peaks: Vec<f64>,
    tried_peaks: Vec<f64>,
    order: Vec<usize>,
    row: [Vec<f64>; 2],
    tried: Option<(usize, [f64; 2])>,
}

impl MovingLobes {
    /// For antennas at `xy`.
    #[must_use]
    pub fn new(views: &[View], grid: &LobeGrid, xy: &[[f64; 2]]) -> Self {
        let mut seen = Vec::new();
        let field = |view: &View| {
            let mut field = LobeField::new(grid.clone());
            view.project(xy, &mut seen);
            field.set(&seen);
            field
        };
        let fields: Vec<LobeField> = views.iter().map(field).collect();
        let row = fields.first().map(LobeField::row_of_zeros).unwrap_or_default();
        let rows = fields.first().map_or(0, LobeField::rows);
        let moved = vec![MovedAntenna::default(); views.len()];
        let (peaks, tried_peaks, order) = (vec![0.0; rows], vec![0.0; rows], (0..rows).collect());
        let mut out = Self { views: views.to_vec(), fields, moved, xy: xy.to_vec(), peaks, tried_peaks, order, row, tried: None };
        // A move to the same place computes all peaks.
        if let Some(first) = xy.first() {
            out.try_move(0, *first, f64::INFINITY);
            out.accept();
        }
        out
    }

    /// The positions.
    #[must_use]
    pub fn xy(&self) -> &[[f64; 2]] {
        &self.xy
    }

    fn beam(&self, power: f64) -> f64 {
        let n = self.xy.len() as f64;
        (power - n) / (n * (n - 1.0))
    }

    /// The highest side lobe on the grid.
    #[must_use]
    pub fn highest(&self) -> f64 {
        self.beam(self.peaks.iter().copied().fold(0.0, f64::max))
    }

    /// The highest side lobe on the grid if antenna `k` moved; `None` if it is above `limit`.
    pub fn try_move(&mut self, k: usize, to: [f64; 2], limit: f64) -> Option<f64> {
        let n = self.xy.len() as f64;
        let most = limit * n * (n - 1.0) + n;
        self.tried = None;
        let (mut new, mut old) = (Vec::new(), Vec::new());
        for ((view, field), moved) in self.views.iter().zip(&self.fields).zip(&mut self.moved) {
            view.project(&[to], &mut new);
            view.project(&self.xy[k..=k], &mut old);
            moved.set(field.grid(), new[0], old[0]);
        }
        let mut highest = 0.0_f64;
        for at in 0..self.order.len() {
            let i = self.order[at];
            self.row.iter_mut().for_each(|r| r.fill(0.0));
            for ((view, field), moved) in self.views.iter().zip(&self.fields).zip(&self.moved) {
                field.add_row_power(i, moved, view.weight, &mut self.row);
            }
            let peak = self.fields[0].row_peak(i, &self.row);
            if peak > most {
                // This row is looked at first next time: a lobe that stops one move often stops the next.
                self.order[..=at].rotate_right(1);
                return None;
            }
            self.tried_peaks[i] = peak;
            highest = highest.max(peak);
        }
        self.tried = Some((k, to));
        Some(self.beam(highest))
    }

    /// Make the move that was tried last. A move that was not looked at to the end is not made.
    pub fn accept(&mut self) {
        let Some((k, to)) = self.tried.take() else { return };
        for (field, moved) in self.fields.iter_mut().zip(&self.moved) {
            field.move_antenna(moved);
        }
        self.xy[k] = to;
        std::mem::swap(&mut self.peaks, &mut self.tried_peaks);
        let peaks = &self.peaks;
        self.order.sort_by(|a, b| peaks[*b].total_cmp(&peaks[*a]).then(a.cmp(b)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::stream;
    use rand::RngExt;

    /// The move of 10,000 antennas, one after the other, leaves the same field as one computation of the result.
    #[test]
    fn ten_thousand_moves_leave_what_a_full_computation_gives() {
        let mut random = stream(3, "moves", 0);
        let mut place = || [random.random::<f64>() - 0.5, random.random::<f64>() - 0.5];
        let grid = LobeGrid::new(1.3, 8.0, 0.4);
        let views = View::band(0.1, 2);
        let xy: Vec<[f64; 2]> = (0..12).map(|_| place()).collect();
        let mut moving = MovingLobes::new(&views, &grid, &xy);
        let mut limits = stream(3, "limits", 0);
        for m in 0..10_000 {
            // Every third move has a limit that it may fail.
            let limit = if m % 3 == 0 { limits.random::<f64>() } else { f64::INFINITY };
            if moving.try_move(m % 12, place(), limit).is_some() {
                moving.accept();
            }
        }
        let full = MovingLobes::new(&views, &grid, moving.xy());
        assert!((moving.highest() - full.highest()).abs() < 1e-12, "{} {}", moving.highest(), full.highest());
        for (a, b) in moving.peaks.iter().zip(&full.peaks) {
            assert!((a - b).abs() < 1e-10 * 144.0, "{a} {b}");
        }
    }

    #[test]
    fn the_highest_lobe_is_that_of_the_brute_force_sum_and_limits_are_exact() {
        let xy = [[0.1, 0.2], [-0.3, 0.05], [0.4, -0.4], [0.0, 0.45], [-0.2, -0.33]];
        let grid = LobeGrid::new(1.0, 6.0, 0.3);
        let mut moving = MovingLobes::new(&View::snapshot(), &grid, &xy);
        let brute = |xy: &[[f64; 2]]| {
            let mut highest = f64::NEG_INFINITY;
            for i in 0..20 {
                for j in -20..20 {
                    let direction = [(f64::from(i) + 0.5) * 0.3, (f64::from(j) + 0.5) * 0.3];
                    if (1.0..6.0).contains(&direction[0].hypot(direction[1])) {
                        highest = highest.max(super::super::array_factor::beam(xy, direction));
                    }
                }
            }
            highest
        };
        assert!((moving.highest() - brute(&xy)).abs() < 1e-12);
        let mut other = xy;
        other[2] = [0.21, -0.37];
        let truth = brute(&other);
        assert!(moving.try_move(2, other[2], truth - 1e-9).is_none());
        let found = moving.try_move(2, other[2], truth + 1e-9).unwrap();
        assert!((found - truth).abs() < 1e-12);
    }
}

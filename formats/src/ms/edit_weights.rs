//! Changes of the weights in a copy of a Measurement Set: WEIGHT_SPECTRUM, WEIGHT, and SIGMA and SIGMA_SPECTRUM, which belong to them.
//! Weights that did not change keep their bytes.

use super::edit::{Cells, MsEdit, NO_FRAME};
use super::index::Run;
use super::read::Channels;
use super::schema;
use super::table::{Kind, Manager};
use super::write::tile;
use crate::Result;
use cittert_arrays::{VisibilityBlock, VisibilitySource};
use ndarray::Array3;

/// Number of rows whose weights are copied together.
const STEP: usize = 4096;

/// The weights of a run of rows in memory, before and after the change, in the order of the file: \[row, chan, pol\].
struct Change {
    n_chan: usize,
    n_pol: usize,
    old: Vec<f32>,
    new: Vec<f32>,
    flags: Vec<bool>,
}

impl Change {
    fn of(cells: &Cells, block: &VisibilityBlock, before: &VisibilityBlock) -> Self {
        let pick = |weights: &Array3<f32>| -> Vec<f32> {
            let weights = weights.as_standard_layout();
            let weights = weights.as_slice().unwrap_or_default();
            cells.places.iter().map(|k| weights[*k]).collect()
        };
        let flags = block.flags.as_standard_layout();
        let flags = flags.as_slice().unwrap_or_default();
        let [n_pol, n_chan] = cells.shape;
        let flags = cells.places.iter().map(|k| flags[*k]).collect();
        Self { n_chan, n_pol, old: pick(&before.weights), new: pick(&block.weights), flags }
    }

    fn any(&self) -> bool {
        self.old.iter().zip(&self.new).any(|(o, n)| o.to_bits() != n.to_bits())
    }

    /// Places of the channels of a row and product that are in use.
    fn in_use(&self, row: usize, pol: usize) -> impl Iterator<Item = usize> + '_ {
        let at = move |chan: usize| (row * self.n_chan + chan) * self.n_pol + pol;
        (0..self.n_chan).map(at).filter(|k| !self.flags[*k] && self.old[*k] > 0.0 && self.old[*k].is_finite() && self.new[*k].is_finite())
    }

    /// True where the channels of a row differ in their weight, so that WEIGHT alone cannot hold it.
    fn varies(&self) -> bool {
        let rows = self.old.len() / (self.n_chan * self.n_pol).max(1);
        (0..rows).flat_map(|row| (0..self.n_pol).map(move |pol| (row, pol))).any(|(row, pol)| {
            let mut weights = self.in_use(row, pol).map(|k| self.new[k].to_bits());
            let first = weights.next();
            weights.any(|w| Some(w) != first)
        })
    }

    /// The mean weight of a row and product, after the change and relative to the one before; `None` where no channel is in use.
    fn mean(&self, row: usize, pol: usize) -> Option<(f64, f64)> {
        let (mut old, mut new, mut n) = (0.0, 0.0, 0.0);
        for k in self.in_use(row, pol) {
            old += f64::from(self.old[k]);
            new += f64::from(self.new[k]);
            n += 1.0;
        }
        (n > 0.0).then(|| (new / n, new / old))
    }
}

impl MsEdit {
    /// Write the weights of a run of rows that changed.
    pub(super) fn put_weights(&mut self, cells: &Cells, block: &VisibilityBlock, before: &VisibilityBlock) -> Result<()> {
        let (run, window) = (cells.run, cells.window);
        let change = Change::of(cells, block, before);
        if !change.any() {
            return Ok(());
        }
        if !self.has_spectrum(run, window)? && change.varies() {
            self.add_spectrum()?;
        }
        let spectrum = self.has_spectrum(run, window)?;
        if spectrum {
            self.put_spectrum(run, window, &change)?;
        }
        let (set, n_pol) = (&mut self.set, change.n_pol);
        let mut weight = vec![0.0_f32; run.rows * n_pol];
        set.main.get_into("WEIGHT", run.start, &[n_pol], &mut weight)?;
        let has_sigma = set.main.column_ndim("SIGMA", Kind::Float)?.is_some();
        let mut sigma = vec![0.0_f32; if has_sigma { run.rows * n_pol } else { 0 }];
        set.main.get_into("SIGMA", run.start, &[n_pol], &mut sigma)?;
        for row in 0..run.rows {
            for pol in 0..n_pol {
                let Some((mean, ratio)) = change.mean(row, pol).filter(|(_, ratio)| *ratio != 1.0) else { continue };
                let k = row * n_pol + pol;
                // Without a spectrum this is the weight of each channel. Otherwise WEIGHT keeps its relation to the spectrum.
                let scaled = if spectrum { f64::from(weight[k]) * ratio } else { mean / f64::from(set.weight_factor) };
                weight[k] = scaled as f32;
                if let Some(s) = sigma.get_mut(k).filter(|_| ratio > 0.0) {
                    *s = (f64::from(*s) / ratio.sqrt()) as f32;
                }
            }
        }
        set.main.put("WEIGHT", run.start, &[n_pol], &weight)?;
        if has_sigma { set.main.put("SIGMA", run.start, &[n_pol], &sigma) } else { Ok(()) }
    }

    /// Whether the reader takes the weights of a run from WEIGHT_SPECTRUM.
    fn has_spectrum(&self, run: Run, window: Channels) -> Result<bool> {
        let cell = [self.set.order.len(), window.n];
        Ok(self.set.has_spectrum && self.set.main.cell_shape("WEIGHT_SPECTRUM", run.start)?.as_deref() == Some(&cell))
    }

    fn put_spectrum(&mut self, run: Run, window: Channels, change: &Change) -> Result<()> {
        let (set, cell) = (&mut self.set, [change.n_pol, window.n]);
        let mut weights = vec![0.0_f32; change.old.len()];
        set.main.get_into("WEIGHT_SPECTRUM", run.start, &cell, &mut weights)?;
        let changed = |k: usize| change.old[k].to_bits() != change.new[k].to_bits();
        for k in (0..weights.len()).filter(|k| changed(*k)) {
            weights[k] = change.new[k] / set.weight_factor;
        }
        set.main.put("WEIGHT_SPECTRUM", run.start, &cell, &weights)?;
        let has_sigma = set.main.column_ndim("SIGMA_SPECTRUM", Kind::Float)?.is_some()
            && set.main.cell_shape("SIGMA_SPECTRUM", run.start)?.as_deref() == Some(&cell);
        if !has_sigma {
            return Ok(());
        }
        let mut sigma = vec![0.0_f32; change.old.len()];
        set.main.get_into("SIGMA_SPECTRUM", run.start, &cell, &mut sigma)?;
        for k in (0..sigma.len()).filter(|k| changed(*k) && change.old[*k] > 0.0 && change.new[*k] > 0.0) {
            sigma[k] = (f64::from(sigma[k]) * (f64::from(change.old[k]) / f64::from(change.new[k])).sqrt()) as f32;
        }
        set.main.put("SIGMA_SPECTRUM", run.start, &cell, &sigma)
    }

    /// Add WEIGHT_SPECTRUM, with WEIGHT for every channel. A set that has the column gets the cells that it lacks.
    fn add_spectrum(&mut self) -> Result<()> {
        let (n_pol, n_rows) = (self.set.order.len(), self.set.n_rows());
        if !self.set.has_spectrum {
            let manager = Manager::TiledShape(tile(n_pol, self.longest_window()));
            let column = schema::main_column("WEIGHT_SPECTRUM");
            schema::add(&mut self.set.main, &column, &manager, "CittertWEIGHT_SPECTRUM", NO_FRAME)?;
            self.set.has_spectrum = true;
        }
        for k in 0..self.set.windows.len() {
            let window = self.set.windows[k];
            let step = (STEP * 64 / window.n.max(1)).max(1);
            for start in (0..n_rows).step_by(step) {
                for run in self.set.index.runs(start..(start + step).min(n_rows), k).into_iter().filter(|run| run.rows > 0) {
                    if self.has_spectrum(run, window)? {
                        continue;
                    }
                    let mut weight = vec![0.0_f32; run.rows * n_pol];
                    self.set.main.get_into("WEIGHT", run.start, &[n_pol], &mut weight)?;
                    let spectrum: Vec<f32> = weight.chunks(n_pol).flat_map(|w| w.repeat(window.n)).collect();
                    self.set.main.put("WEIGHT_SPECTRUM", run.start, &[n_pol, window.n], &spectrum)?;
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_that_differ_between_channels_in_use_need_a_spectrum() {
        let mut c = Change { n_chan: 2, n_pol: 1, old: vec![2.0, 2.0], new: vec![8.0, 8.0], flags: vec![false, false] };
        assert!(c.any() && !c.varies());
        assert_eq!(c.mean(0, 0), Some((8.0, 4.0)));
        c.new[1] = 2.0;
        assert!(c.varies());
        // A channel without a gain keeps its weight and is flagged: its weight does not matter.
        c.flags[1] = true;
        assert!(!c.varies());
        assert_eq!(c.mean(0, 0), Some((8.0, 4.0)));
        c.flags[0] = true;
        assert_eq!(c.mean(0, 0), None);
    }
}

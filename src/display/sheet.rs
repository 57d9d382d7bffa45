//! Panels side by side in one frame of a film.

use super::tone::Tone;
use crate::{ChainError, Result, ensure};
use ndarray::{Array2, ArrayView2};

/// Columns between two panels.
const GAP: usize = 4;
/// The level of what is no panel.
const EMPTY: u8 = 0;

/// Where the panels of a frame are. All panels have one size, and each may have a picture of its name above.
#[derive(Debug, Clone)]
pub struct Sheet {
    panels: usize,
    /// Columns and rows of a panel.
    size: (usize, usize),
    /// Levels above the panels, as wide as the sheet. // [row from the top, column]
    head: Array2<u8>,
}

impl Sheet {
    /// Room for a number of panels of so many columns and rows.
    #[must_use]
    pub fn new(panels: usize, size: (usize, usize)) -> Self {
        let sheet = Self { panels, size, head: Array2::zeros((0, 0)) };
        Self { head: Array2::from_elem((0, sheet.width()), EMPTY), ..sheet }
    }

    /// The same with a picture above each panel, as wide as it. // [panel][row from the top, column]
    ///
    /// # Errors
    /// Pictures of another number or of several sizes.
    pub fn with_names(mut self, names: &[Array2<u8>]) -> Result<Self> {
        let rows = names.first().map_or(0, Array2::nrows);
        let fit = names.len() == self.panels && names.iter().all(|n| n.dim() == (rows, self.size.0));
        ensure!(fit, ChainError::Internal("names of panels that do not fit them".into()));
        let mut head = Array2::from_elem((rows, self.width()), EMPTY);
        for (k, name) in names.iter().enumerate() {
            head.slice_mut(ndarray::s![.., self.columns(k)]).assign(name);
        }
        self.head = head;
        Ok(self)
    }

    /// Columns of the sheet.
    #[must_use]
    pub fn width(&self) -> usize {
        self.panels * self.size.0 + self.panels.saturating_sub(1) * GAP
    }

    /// Rows of the sheet.
    #[must_use]
    pub fn height(&self) -> usize {
        self.head.nrows() + self.size.1
    }

    fn columns(&self, panel: usize) -> std::ops::Range<usize> {
        let first = panel * (self.size.0 + GAP);
        first..first + self.size.0
    }

    /// The levels of a frame, the upper row first. A plane of another size than the panel is brought to it by its nearest pixels.
    /// // [m, l] to \[row from the top, column\]
    ///
    /// # Errors
    /// Planes of another number, or without pixels.
    pub fn levels(&self, planes: &[ArrayView2<'_, f64>], tone: Tone) -> Result<Vec<u8>> {
        ensure!(planes.len() == self.panels, ChainError::Internal(format!("{} planes for {} panels", planes.len(), self.panels)));
        let (columns, rows) = self.size;
        let mut out = Array2::from_elem((self.height(), self.width()), EMPTY);
        out.slice_mut(ndarray::s![..self.head.nrows(), ..]).assign(&self.head);
        for (k, plane) in planes.iter().enumerate() {
            let (n_m, n_l) = plane.dim();
            ensure!(n_m > 0 && n_l > 0, ChainError::NoData(format!("a panel of {n_l} x {n_m} pixels shows nothing")));
            let mut panel = out.slice_mut(ndarray::s![self.head.nrows().., self.columns(k)]);
            for ((row, column), level) in panel.indexed_iter_mut() {
                *level = tone.level(plane[[n_m - 1 - row * n_m / rows, column * n_l / columns]]);
            }
        }
        Ok(out.into_raw_vec_and_offset().0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::array;

    #[test]
    fn panels_stand_side_by_side_with_the_last_row_on_top() {
        let tone = Tone { black: 0.0, white: 255.0 };
        let (a, b) = (array![[1.0, 2.0], [3.0, 4.0]], array![[9.0]]);
        let sheet = Sheet::new(2, (2, 2));
        assert_eq!((sheet.width(), sheet.height()), (8, 2));
        assert_eq!(sheet.levels(&[a.view(), b.view()], tone).unwrap(), [3, 4, 0, 0, 0, 0, 9, 9, 1, 2, 0, 0, 0, 0, 9, 9]);
        let named = sheet.with_names(&[array![[7, 8]], array![[5, 6]]]).unwrap();
        assert_eq!(named.height(), 3);
        assert_eq!(named.levels(&[a.view(), b.view()], tone).unwrap()[..8], [7, 8, 0, 0, 0, 0, 5, 6]);
        assert!(named.levels(&[a.view()], tone).is_err());
        assert!(named.levels(&[a.view(), Array2::zeros((0, 3)).view()], tone).unwrap_err().to_string().contains("3 x 0 pixels"));
        // Three pixels fall on two as the first and the second.
        let wide = array![[1.0, 2.0, 3.0]];
        assert_eq!(Sheet::new(1, (2, 2)).levels(&[wide.view()], tone).unwrap(), [1, 2, 1, 2]);
        assert!(Sheet::new(1, (2, 2)).with_names(&[array![[7]]]).is_err());
    }
}

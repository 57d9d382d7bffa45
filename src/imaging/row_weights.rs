//! Weights of the rows of a block. Where all rows have the same, as most simulated data do, one row is held.

use bytemuck::cast_slice;
use ndarray::{Array1, Array2, ArrayView2, Axis};
use std::mem::MaybeUninit;
use std::sync::OnceLock;

/// Weights \[row, chan\].
#[derive(Debug, Clone)]
pub enum RowWeights {
    /// Those of every row \[chan\], and the number of rows.
    Same(Array1<f32>, usize),
    /// Those of each row \[row, chan\].
    Each(Array2<f32>),
}

impl RowWeights {
    /// The weights \[row, chan\]. The weights of a row are contiguous; rows may lie at the same place.
    #[must_use]
    pub fn view(&self) -> ArrayView2<'_, f32> {
        match self {
            // A row can always be repeated.
            Self::Same(row, n) => row.broadcast((*n, row.len())).unwrap_or_else(|| row.view().insert_axis(Axis(0))),
            Self::Each(all) => all.view(),
        }
    }

    /// The weights of every row \[chan\], where one row is held.
    pub(super) fn of_every_row(&self) -> Option<&Array1<f32>> {
        match self {
            Self::Same(row, _) => Some(row),
            Self::Each(_) => None,
        }
    }
}

impl From<Array2<f32>> for RowWeights {
    fn from(all: Array2<f32>) -> Self {
        Self::Each(all)
    }
}

/// The weights of the row that was read first \[chan\]. Those of every other row are compared with them.
pub(super) type Common = OnceLock<Vec<f32>>;

/// Memory of the weights of some rows. It is not touched, and the system need not give it, as long as the rows have the common weights.
pub(super) struct PlaceOfWeights<'a> {
    memory: &'a mut [MaybeUninit<f32>],
    written: bool,
}

impl<'a> PlaceOfWeights<'a> {
    pub(super) fn new(memory: &'a mut [MaybeUninit<f32>]) -> Self {
        Self { memory, written: false }
    }

    /// Set the weights of a row of this place.
    pub(super) fn set(&mut self, row: usize, weights: &[f32], common: &Common) {
        // Bytes are compared many at once.
        let same = cast_slice::<f32, u8>(common.get_or_init(|| weights.to_vec())) == cast_slice::<f32, u8>(weights);
        if same && !self.written {
            return;
        }
        self.written(common)[row * weights.len()..(row + 1) * weights.len()].copy_from_slice(weights);
    }

    /// True if a row has other weights than the common ones.
    pub(super) fn differs(&self) -> bool {
        self.written
    }

    /// All weights of this place, which are the common ones where they were not set. They are 0 if there are no common ones.
    pub(super) fn written(&mut self, common: &Common) -> &mut [f32] {
        if !self.written {
            let common = common.get().map_or(&[0.0][..], Vec::as_slice);
            for row in self.memory.chunks_mut(common.len().max(1)) {
                row.iter_mut().zip(common).for_each(|(w, value)| *w = MaybeUninit::new(*value));
            }
            self.written = true;
        }
        // SAFETY: all elements were written above, now or before, and the slice is borrowed as long as this place.
        unsafe { std::slice::from_raw_parts_mut(self.memory.as_mut_ptr().cast(), self.memory.len()) }
    }
}

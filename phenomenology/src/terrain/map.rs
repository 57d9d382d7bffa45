//! A map of the surfaces of the ground.

/// A map with one cover for each cell.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceMap {
    origin: [f64; 2],
    cell: f64,
    columns: usize,
    /// Rows from north to south; `None` keeps the surface of the ground. // [row, column]
    covers: Vec<Option<u32>>,
}

impl SurfaceMap {
    /// A map with its south-west corner and the side of a cell in m. `covers` holds rows of `columns` cells, from north to south.
    #[must_use]
    pub fn new(origin_m: [f64; 2], cell_m: f64, columns: usize, covers: Vec<Option<u32>>) -> Self {
        Self { origin: origin_m, cell: cell_m, columns, covers }
    }

    /// The cover of a point, if the map has one there.
    #[must_use]
    #[inline]
    pub fn cover(&self, x: f64, y: f64) -> Option<u32> {
        let rows = self.covers.len() / self.columns;
        let (u, v) = (((x - self.origin[0]) / self.cell).floor(), ((y - self.origin[1]) / self.cell).floor());
        if !(u >= 0.0 && v >= 0.0 && u < self.columns as f64 && v < rows as f64) {
            return None;
        }
        let row = rows - 1 - v as usize;
        self.covers[row * self.columns + u as usize]
    }
}

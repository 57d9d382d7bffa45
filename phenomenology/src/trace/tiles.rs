//! The rows of a picture, divided into tiles that threads can fill at the same time.

use super::mesh_options::TILE;

/// The rows of each tile of a picture with this many columns of `states` values: tiles from the left to the right, row by row. The last ones are
/// cut by the border of the picture.
pub(super) fn tiles<T>(values: &mut [T], columns: usize, states: usize) -> Vec<Vec<&mut [T]>> {
    let across = columns.div_ceil(TILE);
    let mut tiles: Vec<Vec<&mut [T]>> = Vec::new();
    for (row, line) in values.chunks_exact_mut(columns * states).enumerate() {
        if row % TILE == 0 {
            tiles.extend((0..across).map(|_| Vec::with_capacity(TILE)));
        }
        let first = tiles.len() - across;
        tiles[first..].iter_mut().zip(line.chunks_mut(TILE * states)).for_each(|(tile, part)| tile.push(part));
    }
    tiles
}

/// Copies the values of a tile, whose rows are `TILE * states` long, into the picture.
pub(super) fn fill<T: Copy>(rows: &mut [&mut [T]], tile: &[T], states: usize) {
    for (row, from) in rows.iter_mut().zip(tile.chunks_exact(TILE * states)) {
        row.copy_from_slice(&from[..row.len()]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_value_once() {
        let (columns, rows, states) = (TILE + 5, 2 * TILE + 3, 2);
        let mut values = vec![0; columns * rows * states];
        let mut parts = tiles(&mut values, columns, states);
        assert_eq!(parts.len(), 6);
        for (k, part) in parts.iter_mut().enumerate() {
            let tile: Vec<usize> = (0..TILE * TILE * states).map(|at| 1 + k * TILE * TILE * states + at).collect();
            fill(part, &tile, states);
        }
        for (at, value) in values.iter().enumerate() {
            let (row, column, state) = (at / (columns * states), at / states % columns, at % states);
            let tile = row / TILE * 2 + column / TILE;
            assert_eq!(*value, 1 + ((tile * TILE + row % TILE) * TILE + column % TILE) * states + state);
        }
    }
}

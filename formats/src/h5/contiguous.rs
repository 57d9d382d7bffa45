//! Rows of a dataset without filters whose chunks are narrower than a row, read tile by tile.
//!
//! The default chunks of h5py hold a few channels of one polarisation. The library copies such a chunk into a wider array value by value,
//! which takes longer than everything else. Into an array of the shape of the chunk it copies the chunk at once. Each column of chunks is
//! therefore read alone and copied to its place here.

use bytemuck::{Pod, zeroed_vec};
use hdf5::{Dataset, H5Type, Hyperslab, Selection, SliceOrIndex};
use ndarray::{ArrayD, IxDyn};
use std::ops::Range;

/// Smallest size of a tile for which this pays off, bytes.
const LEAST_BYTES: usize = 1 << 14;

/// The columns of chunks, as ranges of all axes but the first. `None` where whole rows are read faster.
pub(super) fn tiles<T>(dataset: &Dataset, rows: usize) -> Option<Vec<Vec<Range<usize>>>> {
    let (shape, chunk) = (dataset.shape(), dataset.chunk()?);
    let split = |k: usize| chunk[k] < shape[k];
    if shape.len() < 2 || chunk.len() != shape.len() || chunk.contains(&0) || !(1..shape.len()).any(split) {
        return None;
    }
    let row = shape[1..].iter().try_fold(1_usize, |n, s| n.checked_mul(*s))?;
    let count = (1..shape.len()).try_fold(1_usize, |n, k| n.checked_mul(shape[k].div_ceil(chunk[k])))?;
    if rows.checked_mul(row)?.checked_mul(size_of::<T>())? / LEAST_BYTES < count {
        return None;
    }
    let mut out = vec![Vec::new()];
    for (n, step) in shape.iter().zip(&chunk).skip(1) {
        let part = |before: &Vec<Range<usize>>| -> Vec<Vec<Range<usize>>> {
            let ranges = (0..*n).step_by(*step).map(|from| from..(from + step).min(*n));
            ranges.map(|r| before.iter().cloned().chain(std::iter::once(r)).collect()).collect()
        };
        out = out.iter().flat_map(part).collect();
    }
    Some(out)
}

/// Read rows of a dataset from tiles of the other axes.
pub(super) fn read<T: H5Type + Pod>(dataset: &Dataset, rows: Range<usize>, tiles: &[Vec<Range<usize>>]) -> hdf5::Result<ArrayD<T>> {
    let mut shape = dataset.shape();
    shape[0] = rows.len();
    let row: usize = shape[1..].iter().product();
    let mut out = zeroed_vec(rows.len() * row);
    for tile in tiles {
        let mut parts = vec![SliceOrIndex::from(rows.clone())];
        parts.extend(tile.iter().cloned().map(SliceOrIndex::from));
        let values: ArrayD<T> = dataset.read_slice::<T, _, IxDyn>(Selection::new(Hyperslab::from(parts)))?;
        // The places of the values of one row.
        let mut places = vec![0];
        for (n, range) in shape[1..].iter().zip(tile) {
            places = places.iter().flat_map(|p| range.clone().map(move |k| p * n + k)).collect();
        }
        scatter(values.as_slice().unwrap_or_default(), &places, &mut out, row);
    }
    ArrayD::from_shape_vec(shape, out).map_err(|e| hdf5::Error::from(e.to_string()))
}

/// Copy the values of each row of a tile to their places in rows of `row` values. Plain loops are fastest, because a row has few values.
fn scatter<T: Copy>(values: &[T], places: &[usize], out: &mut [T], row: usize) {
    let n = places.len();
    let mut at = 0;
    let mut first = 0;
    while at + n <= values.len() && first + row <= out.len() {
        let to = &mut out[first..first + row];
        for k in 0..n {
            to[places[k]] = values[at + k];
        }
        at += n;
        first += row;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::Array3;

    #[test]
    fn tiles_give_what_whole_rows_give() {
        let folder = tempfile::tempdir().unwrap();
        let file = hdf5::File::create(folder.path().join("x.h5")).unwrap();
        let values = Array3::from_shape_fn((5000, 13, 3), |(i, j, k)| (i * 100 + j * 7 + k) as f64);
        for chunk in [(700, 4, 1), (5000, 13, 1), (64, 5, 2), (1, 13, 3), (3, 1, 1)] {
            let name = format!("{chunk:?}");
            let dataset = file.new_dataset::<f64>().shape(values.dim()).chunk(chunk).create(name.as_str()).unwrap();
            dataset.write(&values).unwrap();
            let found = tiles::<f32>(&dataset, 4000);
            assert_eq!(found.is_some(), chunk.1 < 13 && chunk.0 > 3 || chunk.2 == 1 && chunk.1 == 13, "{name}: {found:?}");
            let Some(found) = found else { continue };
            let read: ArrayD<f32> = read(&dataset, 900..4900, &found).unwrap();
            assert_eq!(read.shape(), [4000, 13, 3]);
            assert!(read.indexed_iter().all(|(at, v)| *v == values[(at[0] + 900, at[1], at[2])] as f32), "{name}");
        }
    }
}

//! The places of chunks against those that the library tells.

use super::*;
use hdf5::{Extent, Extents, SimpleExtents};
use hdf5_sys::h5::{haddr_t, hsize_t};
use ndarray::Array3;
use std::path::Path;

unsafe extern "C" {
    fn H5Dget_num_chunks(dataset: hid_t, space: hid_t, n: *mut hsize_t) -> herr_t;
    fn H5Dget_chunk_info(
        dataset: hid_t,
        space: hid_t,
        index: hsize_t,
        offset: *mut hsize_t,
        skipped: *mut u32,
        address: *mut haddr_t,
        bytes: *mut hsize_t,
    ) -> herr_t;
}

const SHAPE: (usize, usize, usize) = (331, 7, 3);

/// The format of a file, and with it the index of its chunks.
#[derive(Debug, Clone, Copy)]
enum Version {
    Earliest,
    /// With object headers of the second version.
    V18,
    /// As this crate writes: the first axis may grow.
    V110,
}

/// A file with one dataset, of which all rows but the last tenth are written.
fn written(path: &Path, shape: (usize, usize, usize), chunk: (usize, usize, usize), packed: bool, version: Version) {
    let file = hdf5::File::with_options()
        .with_fapl(|p| match version {
            Version::Earliest => p,
            Version::V18 => p.libver_v18(),
            Version::V110 => p.libver_v110(),
        })
        .create(path)
        .unwrap();
    let builder = if packed { file.new_dataset_builder().deflate(4) } else { file.new_dataset_builder() };
    let first = if matches!(version, Version::V110) { Extent::resizable(shape.0) } else { Extent::fixed(shape.0) };
    let extents = SimpleExtents::new([first, Extent::fixed(shape.1), Extent::fixed(shape.2)]);
    let dataset = builder.empty::<f64>().chunk(chunk).shape(Extents::new(extents)).create("x").unwrap();
    // Attributes make an object header of several blocks.
    for k in 0..20 {
        dataset.new_attr::<f64>().shape(9).create(format!("attribute {k}").as_str()).unwrap();
    }
    let rows = shape.0 - shape.0 / 10;
    let values = Array3::from_shape_fn((rows, shape.1, shape.2), |(i, j, k)| (i * j + k) as f64);
    dataset.write_slice(&values, (0..rows, .., ..)).unwrap();
}

fn of(path: &Path, rows: Range<usize>) -> Option<Places> {
    let dataset = hdf5::File::open(path).unwrap().dataset("x").unwrap();
    Places::of(&dataset, (&dataset.shape(), &dataset.chunk().unwrap()), 8, &rows)
}

/// Compare the places of some rows with what the library tells of some chunks.
fn compare(path: &Path, chunk: (usize, usize, usize), all_rows: &[Range<usize>]) {
    let dataset = hdf5::File::open(path).unwrap().dataset("x").unwrap();
    let (shape, space, mut n) = (dataset.shape(), dataset.space().unwrap(), 0);
    // SAFETY: the pointers are to numbers of these types; the lock of the library is held.
    assert!(hdf5::sync::sync(|| unsafe { H5Dget_num_chunks(dataset.id(), space.id(), &mut n) }) >= 0);
    let across = shape[2].div_ceil(chunk.2);
    let columns = shape[1].div_ceil(chunk.1) * across;
    let mut known = std::collections::BTreeMap::new();
    for index in (0..n).step_by(1 + n as usize / 300) {
        let (mut at, mut skipped, mut address, mut bytes) = ([0; 3], 0, 0, 0);
        let status = hdf5::sync::sync(|| unsafe {
            H5Dget_chunk_info(dataset.id(), space.id(), index, at.as_mut_ptr(), &mut skipped, &mut address, &mut bytes)
        });
        assert!(status >= 0);
        let at = at.map(|k| k as usize);
        known.insert((at[0], at[1] / chunk.1 * across + at[2] / chunk.2), Place { address, bytes: bytes as u32, skipped });
    }
    let written = shape[0] - shape[0] / 10;
    for rows in all_rows {
        let found = of(path, rows.clone()).unwrap_or_else(|| panic!("{} has no places", path.display()));
        for first in (rows.start / chunk.0 * chunk.0..rows.end).step_by(chunk.0) {
            for column in 0..columns {
                let own = found.get(first, column).unwrap();
                assert!(known.get(&(first, column)).is_none_or(|place| *place == own), "{} {chunk:?} {rows:?}", path.display());
                assert_eq!(own.bytes == 0, first >= written, "{} {chunk:?} {first}", path.display());
            }
        }
    }
}

#[test]
fn places_are_those_of_the_library() {
    let folder = tempfile::tempdir().unwrap();
    for chunk in [(1, 1, 1), (5, 7, 3), (64, 2, 1), (331, 7, 3), (2, 3, 2)] {
        for (packed, version) in [false, true].into_iter().flat_map(|p| [Version::Earliest, Version::V18, Version::V110].map(|v| (p, v))) {
            let path = folder.path().join(format!("{chunk:?} {packed} {version:?}.h5"));
            written(&path, SHAPE, chunk, packed, version);
            compare(&path, chunk, &[0..331, 0..1, 100..200, 330..331, 290..320]);
        }
    }
}

/// So many chunks that the data blocks of an extensible array have pages, of which some are not written.
#[test]
fn places_in_a_long_array_are_those_of_the_library() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.h5");
    written(&path, (190_000, 1, 1), (1, 1, 1), false, Version::V110);
    compare(&path, (1, 1, 1), &[0..190_000, 131_000..135_000, 170_000..172_000]);
}

/// Values in another file format, and files that may change, are left to the library.
#[test]
fn other_files_have_no_places() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("latest.h5");
    let file = hdf5::File::with_options().with_fapl(|p| p.libver_latest()).create(&path).unwrap();
    file.new_dataset::<f64>().shape(SHAPE).chunk((5, 7, 3)).create("x").unwrap().write(&Array3::<f64>::ones(SHAPE)).unwrap();
    drop(file);
    assert!(of(&path, 0..331).is_none());
    let path = folder.path().join("open.h5");
    written(&path, SHAPE, (5, 7, 3), false, Version::Earliest);
    assert!(of(&path, 0..331).is_some());
    let dataset = hdf5::File::open_rw(&path).unwrap().dataset("x").unwrap();
    assert!(Places::of(&dataset, (&dataset.shape(), &[5, 7, 3]), 8, &(0..331)).is_none());
}

#[test]
fn a_tree_that_is_not_sound_is_left_to_the_library() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.h5");
    written(&path, SHAPE, (1, 7, 3), false, Version::Earliest);
    let sound = std::fs::read(&path).unwrap();
    // Nodes of the tree of chunks: the root and its children.
    let nodes: Vec<usize> = (0..sound.len() - 6).filter(|k| sound[*k..*k + 5] == *b"TREE\x01").collect();
    let root = *nodes.iter().find(|k| sound[**k + 5] > 0).unwrap();
    let key = 8 + 8 * 4;
    let first_child = root + 24 + key;
    let with = |at: usize, bytes: &[u8]| {
        let mut file = sound.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        std::fs::write(&path, file).unwrap();
        of(&path, 0..331).is_none()
    };
    assert!(!with(0, &sound[..1]));
    assert!(with(root, b"TREX"));
    assert!(with(root + 4, &[0]), "a node of a group");
    assert!(with(root + 5, &[9]), "another level");
    assert!(with(first_child, &(root as u64).to_le_bytes()), "a child that is its own parent");
    assert!(with(first_child, &u64::MAX.to_le_bytes()), "a child beyond the file");
    assert!(with(first_child, &sound[first_child + key + 8..first_child + key + 16]), "a child that comes twice");
    let leaf = nodes.iter().copied().find(|k| sound[*k + 5] == 0).unwrap();
    assert!(with(leaf + 6, &u16::MAX.to_le_bytes()), "more entries than the file holds");
    assert!(with(leaf + 24, &[0; 4]), "a chunk of no bytes");
    assert!(with(leaf + 24 + 16, &[1]), "a chunk that begins within another");
}

#[test]
fn an_array_that_is_not_sound_is_left_to_the_library() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.h5");
    written(&path, SHAPE, (1, 7, 3), true, Version::V110);
    let sound = std::fs::read(&path).unwrap();
    let find = |signature: &[u8]| (0..sound.len() - 4).find(|k| sound[*k..*k + 4] == *signature).unwrap();
    let with = |at: usize, bytes: &[u8]| {
        let mut file = sound.clone();
        file[at..at + bytes.len()].copy_from_slice(bytes);
        std::fs::write(&path, file).unwrap();
        of(&path, 0..331).is_none()
    };
    let (head, index, data) = (find(b"EAHD"), find(b"EAIB"), find(b"EADB"));
    assert!(!with(0, &sound[..1]));
    for (at, bytes, what) in [
        (head + 5, &[7][..], "another kind"),
        (head + 6, &[3], "elements too small for an address"),
        (head + 7, &[200], "more elements than there are numbers"),
        (head + 9, &[0], "data blocks of no elements"),
        (head + 10, &[1], "no data blocks in the index block"),
        (head + 11, &[60], "pages of 2^60 elements"),
        (head + 60, &[0xff; 7], "an index block beyond the file"),
        (index, b"EAIX", "no index block"),
        (index + 6, &[1], "an index block of another array"),
        (data + 6, &[1], "a data block of another array"),
    ] {
        assert!(with(at, bytes), "{what}");
    }
}

use super::*;
use crate::h5::convert::values;
use hdf5::H5Type;
use ndarray::{Array4, Axis, IxDyn, s};
use num_complex::Complex;
use std::os::unix::fs::FileExt;

type Filters = fn(hdf5::DatasetBuilder) -> hdf5::DatasetBuilder;

fn whole<T: H5Type + bytemuck::Pod>(dataset: &Dataset, rows: Range<usize>) -> hdf5::Result<Vec<T>> {
    let chunks = Chunks::anywhere(dataset)?.unwrap().located(rows.clone());
    let row: usize = dataset.shape()[1..].iter().product();
    values(dataset, rows.len() * row, |out, form| chunks.read(rows, (out, form)))
}

#[test]
fn chunks_give_what_the_library_gives() {
    let folder = tempfile::tempdir().unwrap();
    let file = hdf5::File::create(folder.path().join("x.h5")).unwrap();
    let array = Array4::from_shape_fn((61, 13, 5, 3), |(i, j, k, l)| (i * 1000 + j * 70 + k * 8 + l) as f64 * 0.25);
    let all: [Filters; 6] = [
        |b| b,
        |b| b.deflate(3),
        |b| b.shuffle().deflate(5),
        |b| b.lzf(),
        |b| b.fletcher32().shuffle().lzf(),
        |b| b.shuffle().deflate(1).fletcher32(),
    ];
    for (k, filters) in all.into_iter().enumerate() {
        for chunk in [(61, 13, 5, 3), (7, 4, 2, 1), (1, 13, 5, 3), (16, 13, 2, 3), (3, 5, 5, 3), (61, 1, 1, 1), (10, 13, 5, 2)] {
            let name = format!("{k} {chunk:?}");
            let reals = filters(file.new_dataset_builder()).empty::<f64>().shape(array.dim()).chunk(chunk).create(&*format!("r{name}"));
            let reals = reals.unwrap();
            reals.write(&array).unwrap();
            let complex = filters(file.new_dataset_builder()).empty::<Complex<f32>>().shape(array.dim()).chunk(chunk);
            let complex = complex.create(&*format!("c{name}")).unwrap();
            complex.write(&array.mapv(|v| Complex::new(v as f32, -2.0 * v as f32))).unwrap();
            let flags = filters(file.new_dataset_builder()).empty::<bool>().shape(array.dim()).chunk(chunk);
            let flags = flags.create(&*format!("f{name}")).unwrap();
            flags.write(&array.mapv(|v| v % 0.75 == 0.0)).unwrap();
            for rows in [0..61, 5..6, 9..40, 60..61, 30..30] {
                let part = array.slice(s![rows.clone(), .., .., ..]);
                assert_eq!(whole::<f64>(&reals, rows.clone()).unwrap(), part.iter().copied().collect::<Vec<_>>(), "{name}");
                assert_eq!(whole::<f32>(&reals, rows.clone()).unwrap(), part.iter().map(|v| *v as f32).collect::<Vec<_>>(), "{name}");
                let found = whole::<Complex<f32>>(&complex, rows.clone()).unwrap();
                assert!(found.iter().zip(&part).all(|(f, v)| *f == Complex::new(*v as f32, -2.0 * *v as f32)), "{name}");
                let found = whole::<i8>(&flags, rows).unwrap();
                assert!(found.iter().zip(&part).all(|(f, v)| (*f == 1) == (v % 0.75 == 0.0)), "{name}");
                assert_eq!(found.len(), part.len());
            }
            let doubles: Vec<Complex<f64>> = whole(&complex, 2..9).unwrap();
            assert!(doubles.iter().zip(array.slice(s![2..9, .., .., ..])).all(|(f, v)| f.re == *v && f.im == -2.0 * v), "{name}");
        }
    }
    // Of a file that does not change, the chunks are read without the library.
    file.close().unwrap();
    let file = hdf5::File::open(folder.path().join("x.h5")).unwrap();
    for name in file.member_names().unwrap().iter().filter(|name| name.starts_with('r')) {
        let reals = file.dataset(name).unwrap();
        for rows in [0..61, 5..6, 9..40, 60..61, 30..30] {
            assert!(Chunks::of(&reals, rows.clone()).unwrap().unwrap().located.is_some(), "{name}");
            let part = array.slice(s![rows.clone(), .., .., ..]);
            assert_eq!(whole::<f64>(&reals, rows).unwrap(), part.iter().copied().collect::<Vec<_>>(), "{name}");
        }
    }
}

/// Of a file that does not change, rows of a dataset in one piece are read like chunks. One that was never written has no place.
#[test]
fn a_dataset_without_chunks_gives_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.h5");
    let array = Array4::from_shape_fn((2001, 33, 2, 1), |(i, j, k, _)| (i * 100 + j * 3 + k) as f64 * 0.5);
    {
        let file = hdf5::File::create(&path).unwrap();
        file.new_dataset::<f64>().shape(array.dim()).create("r").unwrap().write(&array).unwrap();
        let pairs = array.mapv(|v| Complex::new(v, -v));
        file.new_dataset::<Complex<f64>>().shape(array.dim()).create("c").unwrap().write(&pairs).unwrap();
        file.new_dataset::<f64>().shape((4, 3)).create("never").unwrap();
        assert!(Chunks::anywhere(&file.dataset("r").unwrap()).unwrap().is_none());
    }
    let file = hdf5::File::open(&path).unwrap();
    let (reals, pairs) = (file.dataset("r").unwrap(), file.dataset("c").unwrap());
    assert!(Chunks::anywhere(&reals).unwrap().is_some_and(|c| c.chunk[0] < 1000));
    for rows in [0..2001, 5..6, 490..1500, 2000..2001, 30..30] {
        let part = array.slice(s![rows.clone(), .., .., ..]);
        assert_eq!(whole::<f64>(&reals, rows.clone()).unwrap(), part.iter().copied().collect::<Vec<_>>());
        let found = whole::<Complex<f32>>(&pairs, rows).unwrap();
        assert!(found.iter().zip(&part).all(|(f, v)| *f == Complex::new(*v as f32, -*v as f32)));
        assert_eq!(found.len(), part.len());
    }
    assert!(Chunks::anywhere(&file.dataset("never").unwrap()).unwrap().is_none());
    // The bytes themselves are read, not a copy of the library.
    let bytes = std::fs::File::options().write(true).open(&path).unwrap();
    bytes.write_all_at(&7.5_f64.to_ne_bytes(), reals.offset().unwrap() + 8 * 66 * 1000).unwrap();
    assert_eq!(whole::<f64>(&reals, 1000..1001).unwrap()[0], 7.5);
}

#[test]
fn what_was_never_written_is_the_fill_value() {
    let folder = tempfile::tempdir().unwrap();
    let file = hdf5::File::create(folder.path().join("x.h5")).unwrap();
    let dataset = file.new_dataset::<i32>().deflate(2).fill_value(-7).shape((40, 6)).chunk((8, 4)).create("x").unwrap();
    dataset.write_slice(&ndarray::Array2::from_elem((8, 4), 3), s![8..16, 0..4]).unwrap();
    let library: ndarray::Array<i32, IxDyn> = dataset.read_dyn().unwrap();
    assert_eq!(library.sum_axis(Axis(1)).iter().max(), Some(&(4 * 3 - 2 * 7)));
    assert_eq!(whole::<i32>(&dataset, 0..40).unwrap(), library.iter().copied().collect::<Vec<_>>());
}

#[test]
fn a_chunk_with_less_in_it_than_its_size_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = hdf5::File::create(folder.path().join("x.h5")).unwrap();
    let dataset = file.new_dataset::<f64>().deflate(2).shape((100, 20)).chunk((50, 20)).create("x").unwrap();
    let mut short = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::new(4));
    std::io::Write::write_all(&mut short, &[1; 30]).unwrap();
    let (short, offset): (Vec<u8>, [hsize_t; 2]) = (short.finish().unwrap(), [50, 0]);
    let (id, text) = (dataset.id(), short.as_ptr().cast());
    // SAFETY: the bytes and the offset outlive the call; the lock of the library is held.
    let status = hdf5::sync::sync(|| unsafe { hdf5_sys::h5d::H5Dwrite_chunk(id, H5P_DEFAULT, 0, offset.as_ptr(), short.len(), text) });
    assert!(status >= 0);
    assert!(whole::<f64>(&dataset, 0..50).is_ok());
    let error = whole::<f64>(&dataset, 0..100).unwrap_err().to_string();
    assert!(error.contains("8000 bytes, at [50, 0]"), "{error}");
}

//! HDF5 files whose data are in another file: such a file is refused, and the other file is never opened.
//!
//! This is a program of its own with one test: it holds HDF5 files open to change them, and a process that another test forks at that moment
//! would inherit their locks.

#![cfg(test)] // so that clippy takes the helpers for tests too

mod common;

use cittert_arrays::VisibilitySink;
use cittert_formats::{create_visibilities, open_visibilities};
use common::boresight;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

const VISDATA: &str = "Data/visdata";

/// A small UVH5 file.
fn whole(path: &Path) {
    let set = boresight();
    let mut sink: Box<dyn VisibilitySink> = create_visibilities(path, &set.header, true).unwrap().sink;
    sink.write_block(&set.data).unwrap();
    sink.finish().unwrap();
}

/// The error of opening a file, which must come soon: an open pipe would wait for ever.
fn refusal(path: &Path) -> String {
    let start = Instant::now();
    let text = open_visibilities(path).err().expect("the file was read").to_string();
    assert!(start.elapsed() < Duration::from_secs(20), "{:?}", start.elapsed());
    text
}

#[test]
fn other_files_are_never_opened() {
    data_in_another_file();
    links_to_another_file();
}

fn data_in_another_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    assert!(Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
    std::fs::write(at("raw"), vec![0_u8; 1 << 16]).unwrap();
    for target in ["pipe", "raw"] {
        let path = at(&format!("{target}.uvh5"));
        whole(&path);
        let file = hdf5::File::open_rw(&path).unwrap();
        let data = file.dataset(VISDATA).unwrap();
        let (shape, dtype) = (data.shape(), data.dtype().unwrap());
        file.unlink(VISDATA).unwrap();
        let bytes = shape.iter().product::<usize>() * dtype.size();
        let builder = file.new_dataset_builder().external(at(target).to_str().unwrap(), 0, bytes);
        builder.empty_as(dtype.to_descriptor().unwrap()).shape(shape).create(VISDATA).unwrap();
        drop((data, file));
        let text = refusal(&path);
        assert!(text.contains("another file") && text.contains(".uvh5"), "{text}");
    }
}

fn links_to_another_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    assert!(Command::new("mkfifo").arg(at("pipe")).status().unwrap().success());
    whole(&at("other.uvh5"));
    for target in ["pipe", "other.uvh5"] {
        let path = at(&format!("link-{target}.uvh5"));
        whole(&path);
        let file = hdf5::File::open_rw(&path).unwrap();
        file.unlink(VISDATA).unwrap();
        file.link_external(at(target).to_str().unwrap(), VISDATA, VISDATA).unwrap();
        drop(file);
        let text = refusal(&path);
        assert!(text.contains("another file"), "{text}");
    }
}

//! Edits change what they name and nothing else: every other byte of content of the file is as it was.

use super::common;
use cittert_arrays::*;
use cittert_formats::uvfits::{UvfitsOptions, UvfitsReader, UvfitsWriter};
use cittert_formats::uvh5::{Uvh5Reader, Uvh5Writer};
use cittert_formats::{CreateOptions, Edit, FormatError, VisColumn, edit_visibilities};
use hdf5::types::{FixedAscii, TypeDescriptor};
use ndarray::{Array1, Array3};
use num_complex::Complex;
use std::collections::BTreeMap;
use std::path::Path;

/// Everything in an HDF5 file by its path: type, filters, attributes, and the values as text.
fn content(path: &Path) -> BTreeMap<String, String> {
    fn values(d: &hdf5::Dataset) -> String {
        if d.space().unwrap().is_null() {
            return "none".into();
        }
        match d.dtype().unwrap().to_descriptor().unwrap() {
            TypeDescriptor::Compound(_) => format!("{:?}", d.read_raw::<Complex<f64>>().unwrap()),
            TypeDescriptor::FixedAscii(_) => format!("{:?}", d.read_raw::<FixedAscii<512>>().unwrap()),
            TypeDescriptor::Boolean => format!("{:?}", d.read_raw::<bool>().unwrap()),
            _ => format!("{:?}", d.read_raw::<f64>().unwrap()),
        }
    }
    fn visit(group: &hdf5::Group, name: &str, all: &mut BTreeMap<String, String>) {
        for member in group.member_names().unwrap() {
            let name = format!("{name}/{member}");
            if let Ok(d) = group.dataset(&member) {
                let attributes: Vec<_> =
                    d.attr_names().unwrap().into_iter().map(|a| (d.attr(&a).unwrap().read_raw::<f64>().unwrap(), a)).collect();
                let kind = d.dtype().unwrap().to_descriptor().unwrap();
                all.insert(name, format!("{kind:?} {:?} {:?} {attributes:?} {}", d.shape(), d.filters(), values(&d)));
            } else {
                visit(&group.group(&member).unwrap(), &name, all);
            }
        }
    }
    let file = hdf5::File::open(path).unwrap();
    let mut all = BTreeMap::new();
    visit(&file, "", &mut all);
    all
}

/// What differs between two files.
fn changed(a: &BTreeMap<String, String>, b: &BTreeMap<String, String>) -> Vec<String> {
    let names: std::collections::BTreeSet<_> = a.keys().chain(b.keys()).collect();
    names.into_iter().filter(|n| a.get(*n) != b.get(*n)).cloned().collect()
}

/// A file with objects that no reader of cittert knows.
fn with_extras(path: &Path, set: &VisibilitySet) {
    let options = CreateOptions { compression: Some(cittert_formats::Compression::Gzip(3)), ..CreateOptions::default() };
    let mut writer = Uvh5Writer::create(path, &set.header, &options).unwrap();
    writer.write(&set.data).unwrap();
    writer.complete().unwrap();
    let file = hdf5::File::open_rw(path).unwrap();
    let keywords = file.create_group("Header/extra_keywords").unwrap();
    keywords.new_dataset::<i64>().create("run").unwrap().write_scalar(&17_i64).unwrap();
    keywords.new_dataset::<FixedAscii<8>>().create("observer").unwrap().write_scalar(&FixedAscii::<8>::from_ascii("me").unwrap()).unwrap();
    file.new_dataset::<FixedAscii<4>>()
        .create("Header/x_orientation")
        .unwrap()
        .write_scalar(&FixedAscii::<4>::from_ascii("east").unwrap())
        .unwrap();
    file.create_group("Mine").unwrap();
    file.new_dataset_builder().deflate(1).with_data(&Array1::<f64>::linspace(0.0, 1.0, 1000)).create("Mine/numbers").unwrap();
    file.dataset("Data/visdata").unwrap().new_attr::<f64>().create("mine").unwrap().write_scalar(&2.5).unwrap();
}

/// Send all rows through an edit, changed by `change`, with one column of `model`.
fn edit(from: &Path, to: &Path, edit: &Edit, set: &VisibilitySet, model: Option<&Array3<Complex<f32>>>) -> Result<(), FormatError> {
    let mut sink = edit_visibilities(from, to, edit)?.unwrap().sink;
    let n = set.data.n_rows();
    for start in (0..n).step_by(37) {
        let range = start..(start + 37).min(n);
        let block = set.data.rows(range.clone()).unwrap();
        let view = model.map(|m| m.slice(ndarray::s![range, .., ..]));
        sink.write_columns(&block, view.as_slice())?;
    }
    sink.finish().map_err(|e| FormatError::values(to, e))
}

fn options(columns: &[VisColumn], data: bool) -> Edit {
    Edit { overwrite: true, data, columns: columns.to_vec(), history: vec!["edited".into()] }
}

#[test]
fn a_column_of_uvh5_is_added_and_replaced_and_all_else_stays() {
    let dir = tempfile::tempdir().unwrap();
    let (path, other) = (dir.path().join("a.uvh5"), dir.path().join("b.uvh5"));
    let set = common::earth();
    with_extras(&path, &set);
    let before = content(&path);
    let mut model = set.data.vis.mapv(|v| 2.0 * v);
    edit(&path, &path, &options(&[VisColumn::Model], false), &set, Some(&model)).unwrap();
    let after = content(&path);
    assert_eq!(changed(&before, &after), ["/Data/model", "/Header/history"]);
    let read = |path: &Path, c| Uvh5Reader::open_column(path, c).unwrap().read(0..set.data.n_rows()).unwrap().vis;
    assert_eq!(read(&path, VisColumn::Model), model);
    let header = Uvh5Reader::open(&path).unwrap().header().clone();
    assert_eq!(header.history, [set.header.history.clone(), vec!["edited".into()]].concat());
    // Once more into another file: the input is as it was, and only the column differs.
    model.fill(Complex::new(1.0, -1.0));
    edit(&path, &other, &options(&[VisColumn::Model], false), &set, Some(&model)).unwrap();
    assert_eq!(content(&path), after);
    assert_eq!(changed(&after, &content(&other)), ["/Data/model", "/Header/history"]);
    assert_eq!((read(&other, VisColumn::Model), read(&other, VisColumn::Data)), (model, set.data.vis.clone()));
    assert!(matches!(edit_visibilities(&path, &other, &Edit::default()), Err(FormatError::Exists { .. })));
}

#[test]
fn data_of_uvh5_change_with_their_flags_and_weights_alone() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.uvh5");
    let mut set = common::earth();
    with_extras(&path, &set);
    let before = content(&path);
    edit(&path, &path, &options(&[], true), &set, None).unwrap();
    assert_eq!(changed(&before, &content(&path)), ["/Header/history"], "rows that did not change keep their bytes");
    set.data.vis[(5, 1, 0)] = Complex::new(8.0, 9.0);
    edit(&path, &path, &options(&[], true), &set, None).unwrap();
    assert_eq!(changed(&before, &content(&path)), ["/Data/visdata", "/Header/history"]);
    set.data.flags[(6, 1, 0)] = true;
    set.data.weights[(200, 0, 1)] = 0.125;
    edit(&path, &path, &options(&[], true), &set, None).unwrap();
    assert_eq!(changed(&before, &content(&path)), ["/Data/flags", "/Data/visdata", "/Data/weights", "/Header/history"]);
    assert_eq!(Uvh5Reader::open(&path).unwrap().read(0..set.data.n_rows()).unwrap(), set.data);
    // Given up, or without some rows: the file stays.
    let now = std::fs::read(&path).unwrap();
    let mut sink = edit_visibilities(&path, &path, &options(&[], true)).unwrap().unwrap().sink;
    sink.write_block(&set.data.rows(0..10).unwrap()).unwrap();
    assert!(sink.finish().unwrap_err().to_string().contains("10 rows"));
    assert!(std::fs::read(&path).unwrap() == now && std::fs::read_dir(dir.path()).unwrap().count() == 1);
}

/// Visibilities of 64 bits keep their digits where they do not change, and integers make room for numbers of any size.
#[test]
fn other_types_of_visibilities_hold_what_changes() {
    #[derive(hdf5::H5Type, Clone, Copy)]
    #[repr(C)]
    struct Whole {
        r: i32,
        i: i32,
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.uvh5");
    let mut set = common::earth();
    with_extras(&path, &set);
    let shape = set.data.vis.dim();
    let fine = Array3::from_shape_fn(shape, |(r, c, p)| Complex::new(1.0 / (1.0 + (r + c + p) as f64), 1e-9));
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        file.unlink("Data/visdata").unwrap();
        file.new_dataset_builder().with_data(&fine).create("Data/visdata").unwrap();
    }
    set.data.vis = fine.mapv(|v| Complex::new(v.re as f32, v.im as f32));
    set.data.vis[(3, 0, 0)] = Complex::new(7.0, 0.0);
    edit(&path, &path, &options(&[], true), &set, None).unwrap();
    let back = hdf5::File::open(&path).unwrap().dataset("Data/visdata").unwrap().read::<Complex<f64>, ndarray::Ix3>().unwrap();
    assert_eq!(back.indexed_iter().filter(|(at, v)| **v != fine[*at]).map(|(at, v)| (at, v.re)).collect::<Vec<_>>(), [((3, 0, 0), 7.0)]);
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        file.unlink("Data/visdata").unwrap();
        file.new_dataset_builder().with_data(&Array3::from_elem(shape, Whole { r: 3, i: -2 })).create("Data/visdata").unwrap();
    }
    set.data.vis.fill(Complex::new(3.0, -2.0));
    set.data.vis[(4, 0, 0)] = Complex::new(0.5, 0.25);
    edit(&path, &path, &options(&[], true), &set, None).unwrap();
    assert_eq!(Uvh5Reader::open(&path).unwrap().read(0..shape.0).unwrap().vis, set.data.vis);
}

#[test]
fn groups_of_uvfits_that_change_are_the_only_bytes_that_change() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.uvfits");
    let mut set = common::earth();
    let mut writer = UvfitsWriter::create(&path, &set.header, UvfitsOptions::default()).unwrap();
    writer.write(&set.data).unwrap();
    writer.complete().unwrap();
    // A table that no reader of cittert knows, without its padding.
    let mut bytes = std::fs::read(&path).unwrap();
    let cards =
        ["XTENSION= 'BINTABLE'", "BITPIX  =                    8", "NAXIS   =                    2", "NAXIS1  =                    4"];
    let more = [
        "NAXIS2  =                    1",
        "PCOUNT  =                    0",
        "GCOUNT  =                    1",
        "TFIELDS =                    0",
        "END",
    ];
    let mut header: Vec<u8> = cards.iter().chain(&more).flat_map(|c| format!("{c:<80}").into_bytes()).collect();
    header.resize(2880, b' ');
    bytes.extend(header);
    bytes.extend(b"mine");
    std::fs::write(&path, &bytes).unwrap();
    set.data = UvfitsReader::open(&path).unwrap().read(0..set.data.n_rows()).unwrap();
    let block = |b: &[u8]| b.chunks(80).position(|c| c.starts_with(b"END ")).unwrap() * 80 / 2880 * 2880 + 2880;
    let (start, old) = (block(&bytes), bytes.clone());
    edit(&path, &path, &options(&[], true), &set, None).unwrap();
    let new = std::fs::read(&path).unwrap();
    assert!(new[block(&new)..] == old[start..], "groups and tables stay");
    set.data.vis[(7, 2, 1)] = Complex::new(-1.5, 2.5);
    set.data.flags[(8, 2, 1)] = true;
    set.data.weights[(9, 2, 1)] = 4.25;
    edit(&path, &path, &options(&[], true), &set, None).unwrap();
    let new = std::fs::read(&path).unwrap();
    let numbers = |b: &[u8], at: usize| b[at..].chunks_exact(4).map(<[u8]>::to_vec).collect::<Vec<_>>();
    let differing = numbers(&old, start).iter().zip(&numbers(&new, block(&new))).filter(|(a, b)| a != b).count();
    assert_eq!(differing, 4, "two parts of a visibility, a flag and a weight");
    let mut reader = UvfitsReader::open(&path).unwrap();
    let back = reader.read(0..set.data.n_rows()).unwrap();
    assert_eq!((&back.vis, &back.flags, &back.weights), (&set.data.vis, &set.data.flags, &set.data.weights));
    assert_eq!(reader.header().history.iter().filter(|l| *l == "edited").count(), 2);
}

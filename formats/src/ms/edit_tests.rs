//! Edits of a Measurement Set that holds what no reader of cittert knows: an additional column, keyword and subtable.

use super::codes::name_of;
use super::keywords::Place;
use super::table::{Column, Kind, Manager, Table};
use super::{MeasurementSet, MsSource, MsWriter, schema};
use crate::format::VisibilityFormat;
use crate::{CreateOptions, Edit, VisColumn};
use cittert_arrays::*;
use ndarray::{Array2, Array3};
use num_complex::Complex;
use std::path::Path;

/// Two windows, two times, three antennas, and all four products.
fn set() -> VisibilitySet {
    let site = Site { latitude_rad: 0.5, longitude_rad: 0.1, altitude_m: 0.0 };
    let ants = (0..3).map(|k| Antenna::new(format!("A{k}"), k, [f64::from(k) * 100.0, 0.0, 0.0])).collect();
    let header = VisibilityHeader {
        layout: ArrayLayout::new("t", LayoutFrame::EastNorthUp(site), ants).unwrap(),
        spectrum: SpectralWindow::with_windows(vec![1e9, 1.1e9, 2e9, 2.1e9], vec![1e6; 4], vec![0, 0, 1, 1]).unwrap(),
        polarizations: vec![Polarization::RR, Polarization::LL, Polarization::RL, Polarization::LR],
        phase_centers: vec![PhaseCenter::sidereal("p", 1.0, 0.5).unwrap()],
        unit: VisUnit::Jy,
        telescope: "t".into(),
        instrument: String::new(),
        pedestal_k: None,
        scene_pedestal_k: None,
        scene_width_rad: None,
        antenna_temperature_k: None,
        near_field: Default::default(),
        annotations: Default::default(),
        history: vec!["first".into()],
    };
    let n = 6;
    let times = (0..n).map(|r| 2.46e6 + (r / 3) as f64 * 1e-3).collect();
    let (ant1, ant2) = ([0, 0, 1].repeat(2), [1, 2, 2].repeat(2));
    let uvw = Array2::from_shape_fn((n, 3), |(r, k)| (r * 3 + k) as f64);
    let rows = UvCoverage::new(uvw, ant1, ant2, times, vec![1.0; n], vec![0; n]).unwrap();
    let mut data = VisibilityBlock::zeros(rows, 4, 4);
    data.vis = Array3::from_shape_fn((n, 4, 4), |(r, c, p)| Complex::new((r * 16 + c * 4 + p) as f32, 0.5));
    data.weights.fill(4.0);
    VisibilitySet::new(header, data).unwrap()
}

/// Write the set with extras.
fn with_extras(path: &Path, set: &VisibilitySet) {
    let mut writer = MsWriter::create(path, &set.header, &CreateOptions::default()).unwrap();
    writer.write(&set.data).unwrap();
    writer.complete().unwrap();
    let mut main = Table::open_to_change(path, path).unwrap();
    let [table, units, measure, comment] = [(); 4].map(|()| String::new());
    let mine = Column { table, name: "MINE".into(), kind: Kind::Double, ndim: -1, length: None, units, measure, comment };
    main.add_columns(&[&mine], &Manager::Standard, "Mine").unwrap();
    main.put("MINE", 0, &[], &(0..12).map(f64::from).collect::<Vec<_>>()).unwrap();
    main.put_keyword_text(Place::table("MY_KEYWORD"), &["kept"], true).unwrap();
    let mut sub = schema::create_subtable(path, path, "STATE", "ICRS").unwrap();
    sub.add_rows(1).unwrap();
    sub.put_text("OBS_MODE", 0, &["MINE"], true).unwrap();
    sub.flush().unwrap();
    main.put_table_keyword("MY_TABLE", &sub).unwrap();
    main.flush().unwrap();
}

/// The bytes of the columns that an edit may change.
#[derive(Debug, PartialEq)]
struct Cells {
    data: Vec<Complex<f32>>,
    flags: Vec<bool>,
    weight: Vec<f32>,
    sigma: Vec<f32>,
    mine: Vec<f64>,
    uvw: Vec<f64>,
}

fn cells(path: &Path) -> Cells {
    let t = Table::open(path).unwrap();
    let mut c = Cells {
        data: vec![Complex::default(); 96],
        flags: vec![false; 96],
        weight: vec![0.0; 48],
        sigma: vec![0.0; 48],
        mine: t.scalars("MINE", 0, 12).unwrap(),
        uvw: vec![0.0; 36],
    };
    t.get_into("DATA", 0, &[4, 2], &mut c.data).unwrap();
    t.get_into("FLAG", 0, &[4, 2], &mut c.flags).unwrap();
    t.get_into("WEIGHT", 0, &[4], &mut c.weight).unwrap();
    t.get_into("SIGMA", 0, &[4], &mut c.sigma).unwrap();
    t.get_into("UVW", 0, &[3], &mut c.uvw).unwrap();
    assert_eq!(t.keyword_text(Place::table("MY_KEYWORD"), 0).unwrap().as_deref(), Some("kept"));
    assert_eq!(Table::open(&path.join("STATE")).unwrap().get_text("OBS_MODE", 0, 0).unwrap(), "MINE");
    c
}

fn edit(path: &Path, to: &Path, edit: &Edit, set: &VisibilitySet, model: &[Array3<Complex<f32>>]) {
    let mut sink = MeasurementSet.edit(path, to, edit).unwrap().unwrap().sink;
    for start in (0..6).step_by(4) {
        let range = start..(start + 4).min(6);
        let views: Vec<_> = model.iter().map(|m| m.slice(ndarray::s![range.clone(), .., ..])).collect();
        sink.write_columns(&set.data.rows(range).unwrap(), &views).unwrap();
    }
    sink.finish().unwrap();
}

fn read(path: &Path, column: VisColumn) -> VisibilityBlock {
    MsSource::open(path, column).unwrap().read(0..6).unwrap()
}

fn options(columns: &[VisColumn], data: bool) -> Edit {
    Edit { overwrite: true, data, columns: columns.to_vec(), history: vec!["edited".into()] }
}

#[test]
fn columns_are_added_and_replaced_and_all_else_stays() {
    let dir = tempfile::tempdir().unwrap();
    let (path, other) = (dir.path().join("a.ms"), dir.path().join("b.ms"));
    let set = set();
    with_extras(&path, &set);
    let before = cells(&path);
    let model = set.data.vis.mapv(|v| 3.0 * v.conj());
    edit(&path, &path, &options(&[VisColumn::Model], false), &set, std::slice::from_ref(&model));
    assert_eq!(cells(&path), before);
    assert_eq!(read(&path, VisColumn::Model).vis, model);
    assert_eq!(MsSource::open(&path, VisColumn::Data).unwrap().header().history, ["first", "edited"]);
    assert_eq!(Table::open(&path).unwrap().keyword_text(Place::column("MODEL_DATA", "QuantumUnits"), 0).unwrap().as_deref(), Some("Jy"));
    let both = [model.mapv(|v| v + 1.0), model.clone()];
    edit(&path, &other, &options(&[VisColumn::Model, VisColumn::Corrected], false), &set, &both);
    assert_eq!((cells(&other), read(&path, VisColumn::Model).vis), (before, model));
    assert_eq!([VisColumn::Model, VisColumn::Corrected].map(|c| read(&other, c).vis), both);
    assert!(MeasurementSet.edit(&path, &other, &options(&[VisColumn::Residual], false)).is_err(), "{:?}", name_of(VisColumn::Residual));
}

#[test]
fn data_change_with_their_flags_and_weights_alone() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.ms");
    let mut set = set();
    with_extras(&path, &set);
    let before = cells(&path);
    edit(&path, &path, &options(&[], true), &set, &[]);
    assert_eq!(cells(&path), before, "rows that did not change keep their bytes");
    // One row of the second window: RL, which is the second product of the file.
    set.data.vis[(4, 3, 2)] = Complex::new(100.0, -1.0);
    set.data.weights.slice_mut(ndarray::s![4, 2.., 2]).fill(16.0);
    set.data.flags[(1, 0, 3)] = true;
    edit(&path, &path, &options(&[], true), &set, &[]);
    let after = cells(&path);
    let at = |a: &[f32], b: &[f32]| (0..a.len()).filter(|k| a[*k] != b[*k]).collect::<Vec<_>>();
    // Windows alternate in blocks of six rows: row 10 of the table is row 4 of the second window.
    assert_eq!(at(&before.weight, &after.weight), [4 * 10 + 1]);
    assert_eq!(at(&before.sigma, &after.sigma), [4 * 10 + 1]);
    assert_eq!((after.weight[41], after.sigma[41]), (16.0, 0.25));
    assert_eq!((0..96).filter(|k| before.data[*k] != after.data[*k]).collect::<Vec<_>>(), [10 * 8 + 4 + 1]);
    assert_eq!(after.data[85], Complex::new(100.0, 1.0), "the set on the disk has the conjugate");
    assert_eq!((0..96).filter(|k| before.flags[*k] != after.flags[*k]).collect::<Vec<_>>(), [8 + 2]);
    assert_eq!((&after.mine, &after.uvw), (&before.mine, &before.uvw));
    assert!(Table::open(&path).unwrap().column_ndim("WEIGHT_SPECTRUM", Kind::Float).unwrap().is_none());
}

#[test]
fn weights_that_come_to_differ_between_channels_get_a_spectrum() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.ms");
    let mut set = set();
    with_extras(&path, &set);
    set.data.weights[(5, 1, 0)] = 1.0;
    edit(&path, &path, &options(&[], true), &set, &[]);
    assert_eq!(read(&path, VisColumn::Data).weights, set.data.weights);
    // With a spectrum, WEIGHT follows the mean of the channels.
    assert_eq!(cells(&path).weight[4 * 5], 2.5);
    set.data.weights.mapv_inplace(|w| 4.0 * w);
    edit(&path, &path, &options(&[], true), &set, &[]);
    assert_eq!(read(&path, VisColumn::Data).weights, set.data.weights);
    assert_eq!((cells(&path).weight[4 * 5], cells(&path).weight[0], cells(&path).sigma[0]), (10.0, 16.0, 0.25));
}

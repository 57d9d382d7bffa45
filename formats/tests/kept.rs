//! Properties of an observation that are only carried: what comes back from each format, and what is said to be lost.

use super::common;
use cittert_arrays::*;
use cittert_formats::{CreateOptions, losses, visibility_formats};
use std::path::{Path, PathBuf};

/// A set with a keyword of each kind, mounts, stations and feeds.
fn annotated() -> VisibilitySet {
    let mut set = common::earth();
    let n = set.header.layout.n_ant();
    let about = &mut set.header.annotations;
    let values = [
        ("foo", Keyword::Integer(-3)),
        ("large", Keyword::Integer(1 << 30)),
        ("ratio", Keyword::Real(0.1)),
        ("ready", Keyword::Logical(true)),
        ("note", Keyword::Text("it's a text".into())),
        ("observer", Keyword::Text("A. Nobody".into())),
        ("project", Keyword::Text("P1".into())),
        ("nothing", Keyword::Empty),
        ("much_longer", Keyword::Integer(1)),
    ];
    about.keywords = values.map(|(key, value)| (key.to_string(), value)).into();
    about.x_orientation = Some(XOrientation::North);
    about.mounts = (0..n).map(|k| if k % 2 == 0 { "alt-az" } else { "equatorial" }.to_string()).collect();
    about.stations = (0..n).map(|k| format!("W{k}")).collect();
    set
}

fn write(folder: &Path, format: &dyn cittert_formats::VisibilityFormat, set: &VisibilitySet) -> PathBuf {
    let path = folder.join(format!("a.{}", format.extensions()[0]));
    let mut out = format.create(&path, &set.header, &CreateOptions::default()).unwrap().unwrap();
    out.sink.write_block(&set.data).unwrap();
    out.sink.finish().unwrap();
    path
}

#[test]
fn annotations_come_back_from_every_format_and_what_does_not_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let set = annotated();
    let uvh5 = dir.path().join("source.uvh5");
    for format in visibility_formats() {
        let path = write(dir.path(), format, &set);
        if format.name() == "UVH5" {
            std::fs::copy(&path, &uvh5).unwrap();
        }
        let back = format.open(&path).unwrap().header().clone();
        let mut expected = set.header.annotations.clone();
        let mut lost: Vec<&str> = Vec::new();
        match format.name() {
            "UVFITS" => {
                let short = expected.keywords.into_iter().filter(|(key, value)| key.len() <= 8 && *value != Keyword::Empty);
                expected.keywords = short.map(|(key, value)| (key.to_ascii_uppercase(), value)).collect();
                expected.stations.clear();
                lost.extend(["keyword much_longer", "keyword nothing", "stations"]);
                assert!(back.history.iter().any(|line| line == "keyword much_longer = 1"), "{:?}", back.history);
            }
            "Measurement Set" => {
                expected.keywords.remove("nothing");
                lost.push("keyword nothing");
            }
            _ => {}
        }
        assert_eq!(back.annotations, expected, "{}", format.name());
        let named = losses(&uvh5, &path, &set.header).unwrap();
        assert_eq!(named.len(), lost.len(), "{named:?}");
        for (line, what) in named.iter().zip(&lost) {
            assert!(line.starts_with(&format!("lost in {}: {what}", format.name())), "{line}");
        }
    }
}

#[test]
fn a_set_without_annotations_gets_none() {
    let dir = tempfile::tempdir().unwrap();
    for set in [common::earth(), common::boresight()] {
        for format in visibility_formats() {
            let folder = tempfile::tempdir_in(dir.path()).unwrap();
            let path = write(folder.path(), format, &set);
            let mut back = format.open(&path).unwrap().header().annotations.clone();
            // UVFITS and Measurement Sets have no mount that means an unknown one.
            back.mounts.retain(|mount| mount != "alt-az");
            assert_eq!(back, Annotations::default(), "{}", format.name());
            assert_eq!(losses(&path, &path, &set.header).unwrap().iter().filter(|l| l.contains("keyword")).count(), 0);
        }
    }
}

#[test]
fn what_nobody_knows_in_a_file_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let set = common::earth();
    let (path, to) = (dir.path().join("a.uvh5"), dir.path().join("b.uvfits"));
    let uvh5 = visibility_formats().find(|f| f.name() == "UVH5").unwrap();
    write(dir.path(), uvh5, &set);
    assert_eq!(losses(&path, &to, &set.header).unwrap(), Vec::<String>::new());
    let file = hdf5::File::open_rw(&path).unwrap();
    file.create_group("Mine").unwrap().new_attr::<i32>().create("mine").unwrap().write_scalar(&1).unwrap();
    file.new_dataset_builder().with_data(&[1.0, 2.0]).create("Mine/numbers").unwrap();
    file.create_group("Header/extra_keywords").unwrap().new_dataset_builder().with_data(&[1, 2]).create("list").unwrap();
    file.new_dataset::<f64>().create("Header/dut1").unwrap().write_scalar(&0.1).unwrap();
    file.new_dataset::<f64>().create("Header/phase_center_catalog/0/mine").unwrap().write_scalar(&0.1).unwrap();
    drop(file);
    let found = losses(&path, &to, &set.header).unwrap();
    let expected = [
        "dataset Header/dut1",
        "keyword list (it is not one number or text)",
        "dataset Mine/numbers",
        "mine of the phase centres (their names and directions are kept)",
        "attribute mine of Mine",
    ];
    assert_eq!(found, expected.map(|line| format!("lost in UVFITS: {line}")));
}

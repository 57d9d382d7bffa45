use super::*;
use cittert_arrays::{Antenna, BUILTIN_LAYOUTS, LayoutFrame, Sensitivity};
use cittert_arrays::{ArrayLayout, Site};
use std::fs;
use std::path::Path;
use std::path::PathBuf;

fn shared() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/layouts")
}

fn context(name: &str) -> ReadContext {
    ReadContext { name: name.into(), site: None, folder: None }
}

fn sample(frame: LayoutFrame) -> ArrayLayout {
    let antennas = (0..4)
        .map(|i| {
            let x = f64::from(i);
            Antenna {
                diameter_m: Some(12.5),
                sensitivity: Some(Sensitivity::SefdJy(300.25)),
                position_error_m: Some([0.001, 0.002, 0.003]),
                ..Antenna::new(format!("N{i}"), i as u32, [1_234.567_891_2 * x, -9_876.543_21 + x * x, 0.123_456_78 * x])
            }
        })
        .collect();
    ArrayLayout::new("TEST", frame, antennas).unwrap()
}

fn vla() -> LayoutFrame {
    LayoutFrame::EastNorthUp(Site { latitude_rad: 0.594_8, longitude_rad: -1.878_3, altitude_m: 2114.89 })
}

/// Largest distance between the antennas of two layouts: on the Earth where both are, else in their own frame, m.
fn apart(a: &ArrayLayout, b: &ArrayLayout) -> f64 {
    let own = |l: &ArrayLayout| l.antennas().iter().map(|a| a.position_m).collect::<Vec<_>>();
    let (p, q) = match (a.ecef_m(), b.ecef_m()) {
        (Some(p), Some(q)) => (p, q),
        _ => (own(a), own(b)),
    };
    assert_eq!(p.len(), q.len());
    p.iter().zip(&q).map(|(p, q)| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()).fold(0.0, f64::max)
}

#[test]
fn every_format_reads_back_what_it_wrote_and_knows_its_own_text() {
    for format in layout_formats() {
        let layout = sample(vla());
        let text = format.write(&layout).unwrap();
        let found = sniff_layout(&text, format.extension()).unwrap();
        assert_eq!(found.name(), format.name());
        let back = format.read(&text, &context("TEST")).unwrap_or_else(|e| panic!("{}: {e}", format.name()));
        assert!(apart(&layout, &back) < 1e-6, "{}: {}", format.name(), apart(&layout, &back));
        let lost = format.loses(&layout).join("; ");
        let same =
            |what: &str, equal: bool| assert!(equal || lost.contains(what), "{}: {what} changed, but only lost: {lost}", format.name());
        for (a, b) in layout.antennas().iter().zip(back.antennas()) {
            same("names", a.name == b.name);
            same("numbers", a.number == b.number);
            same("diameters", a.diameter_m == b.diameter_m);
            same("SEFD", a.sensitivity == b.sensitivity);
            same("position errors", a.position_error_m == b.position_error_m);
        }
        let moved = |a: Site, b: Site| (a.latitude_rad - b.latitude_rad).abs() > 1e-15 || (a.longitude_rad - b.longitude_rad).abs() > 1e-15;
        same("site", !moved(layout.site().unwrap(), back.site().unwrap()));
        assert_eq!(back.name, "TEST", "{}", format.name());
    }
}

#[test]
fn boresight_layouts_survive_or_are_refused() {
    let layout = sample(LayoutFrame::Boresight);
    for format in layout_formats() {
        match format.write(&layout) {
            Ok(text) => {
                let back = format.read(&text, &context("x")).unwrap();
                assert_eq!(back.frame, LayoutFrame::Boresight, "{}", format.name());
                assert!(apart(&layout, &back) < 1e-6);
            }
            Err(e) => assert!(e.to_string().contains("boresight"), "{}: {e}", format.name()),
        }
    }
}

#[test]
fn every_real_file_is_read_and_converted_within_a_tenth_of_a_millimetre() {
    let mut read = 0;
    for entry in fs::read_dir(shared()).unwrap().filter(|e| !e.as_ref().unwrap().path().ends_with("README.md")) {
        let path = entry.unwrap().path();
        let layout = read_layout(&path, None).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let lines = fs::read_to_string(&path).unwrap().lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty()).count();
        assert_eq!(layout.n_ant(), lines, "{}", path.display());
        for format in layout_formats() {
            match format.write(&layout) {
                Ok(text) => {
                    let back = format.read(&text, &context("x")).unwrap_or_else(|e| panic!("{} {}: {e}", path.display(), format.name()));
                    assert!(apart(&layout, &back) < 1e-4, "{} {}: {}", path.display(), format.name(), apart(&layout, &back));
                }
                Err(e) => assert!(matches!(e, LayoutError::Cannot { .. }), "{e}"),
            }
        }
        read += 1;
    }
    assert!(read >= 15);
}

#[test]
fn built_in_layouts_are_those_of_the_files_they_name() {
    for (name, file) in
        [("vla-a", "vla.a.cfg"), ("alma-cycle8.5", "alma.cycle8.5.cfg"), ("vlba", "vlba.cfg"), ("sma-compact", "sma.compact.cfg")]
    {
        let (built, read) = (ArrayLayout::builtin(name).unwrap(), read_layout(&shared().join(file), None).unwrap());
        assert!(apart(&built, &read) < 1e-3, "{name}: {}", apart(&built, &read));
    }
    let (built, read) = (ArrayLayout::builtin("eht-2017").unwrap(), read_layout(&shared().join("EHT2017.ehtim.txt"), None).unwrap());
    assert!(apart(&built, &read) < 1e-6);
    assert!(built.antennas().iter().zip(read.antennas()).all(|(a, b)| a.sensitivity == b.sensitivity && a.name == b.name));
    assert!(BUILTIN_LAYOUTS.len() >= 12);
}

#[test]
fn geocentric_numbers_are_taken_as_they_stand() {
    let layout = read_layout(&shared().join("vla.a.cfg"), None).unwrap();
    let p = layout.ecef_m().unwrap()[0];
    let expected = [-1_601_614.061_201, -5_042_001.676_547, 3_554_652.455_603];
    assert!((0..3).all(|k| (p[k] - expected[k]).abs() < 1e-7), "{p:?}");
    assert_eq!((layout.antennas()[0].name.as_str(), layout.antennas()[0].diameter_m), ("W08", Some(25.0)));
    assert_eq!(layout.name, "VLA");
    assert_eq!(layout.site(), known_site("VLA"));
}

#[test]
fn local_coordinates_are_about_the_observatory_or_the_cofa() {
    let text = "# observatory=ALMA\n# coordsys=LOC (local tangent plane)\n10 20 3 12. A001\n-5 0 1 7. A002\n";
    let layout = sniff_layout(text, "").unwrap().read(text, &context("x")).unwrap();
    assert_eq!((layout.site(), layout.antennas()[0].position_m), (known_site("ALMA"), [10.0, 20.0, 3.0]));
    let text = text.replace("ALMA\n", "NOWHERE\n# COFA=-67.75,-23.02\n");
    let site = sniff_layout(&text, "").unwrap().read(&text, &context("x")).unwrap().site().unwrap();
    assert!((site.longitude_rad.to_degrees() + 67.75).abs() < 1e-12 && site.altitude_m == 0.0);
    let e = sniff_layout("# coordsys=LOC\n1 2 3 4 A\n", "").unwrap().read("# coordsys=LOC\n1 2 3 4 A\n", &context("x")).unwrap_err();
    assert!(e.to_string().contains("COFA"), "{e}");
}

#[test]
fn utm_coordinates_become_places() {
    let text = "# observatory=TEST\n# coordsys=UTM\n# zone=19\n# datum=WGS84\n# hemisphere=S\n627850.0 7453350.0 5050.0 12 A1\n628850.0 7453350.0 5050.0 12 A2\n";
    let layout = sniff_layout(text, "cfg").unwrap().read(text, &context("x")).unwrap();
    let site = layout.site().unwrap();
    assert!((site.latitude_rad.to_degrees() + 23.02).abs() < 0.01 && (site.longitude_rad.to_degrees() + 67.75).abs() < 0.01, "{site:?}");
    assert!((site.altitude_m - 5050.0).abs() < 1e-6);
    // The grid's scale here is 0.9998, and 5 km of height add 8e-4.
    let d = layout.extent().longest_m;
    assert!((d / 1000.0 - (1.0 + 0.000_2 + 5050.0 / 6.37e6)).abs() < 1e-4, "{d}");
    let e = sniff_layout(text, "").unwrap().read(&text.replace("WGS84", "MARS1"), &context("x")).unwrap_err().to_string();
    assert!(e.contains("line 4") && e.contains("MARS1") && e.contains("SAM56"), "{e}");
}

#[test]
fn miriad_units_and_axes_follow_baseunit() {
    let site = Site { latitude_rad: 0.5, longitude_rad: 0.0, altitude_m: 0.0 };
    let with_site = ReadContext { name: "m".into(), site: Some(site), folder: None };
    // 10 ns of light time along y are 2.998 m east in either system.
    let equatorial = sniff_layout("0 10 0\n1 0 0\n", "ant").unwrap().read("0 10 0\n1 0 0\n", &with_site).unwrap();
    let east = equatorial.antennas()[0].position_m;
    assert!((east[0] - 2.997_924_58).abs() < 1e-9 && east[1].abs() < 1e-12 && east[2].abs() < 1e-12);
    let up = equatorial.antennas()[1].position_m.map(|v| v / 0.299_792_458);
    assert!((up[1] + 0.5_f64.sin()).abs() < 1e-12 && (up[2] - 0.5_f64.cos()).abs() < 1e-12, "{up:?}");
    let text = "# baseunit = -10\n1 2 3\n0 0 0\n";
    let local = sniff_layout(text, "").unwrap().read(text, &with_site).unwrap().antennas()[0].position_m.map(|v| v / 2.997_924_58);
    assert!((0..3).all(|k| (local[k] - [2.0, 1.0, 3.0][k]).abs() < 1e-12), "{local:?}");
}

#[test]
fn an_oskar_model_finds_its_position_file() {
    let dir = tempfile::tempdir().unwrap();
    let model = dir.path().join("ska.tm");
    fs::create_dir(&model).unwrap();
    fs::write(model.join("layout.txt"), "# x, y\n1.5, 2.5\n-1,0,0.5,0.01,-0.02\n").unwrap();
    let e = read_layout(&model, None).unwrap_err();
    assert!(std::error::Error::source(&e).unwrap().to_string().contains("site"), "{e}");
    fs::write(model.join("position.txt"), "116.7644482 -26.82472208 365.0\n").unwrap();
    let layout = read_layout(&model, None).unwrap();
    assert_eq!((layout.name.as_str(), layout.antennas()[0].position_m), ("ska.tm", [1.5, 2.5, 0.0]));
    assert_eq!(layout.antennas()[1].position_error_m, Some([0.01, 0.02, 0.0]));
    assert!((layout.site().unwrap().latitude_rad.to_degrees() + 26.824_722_08).abs() < 1e-12);
}

#[test]
fn station_tables_with_one_sefd_and_a_head_line_are_read() {
    let text = "site X Y Z SEFD\nPV 5088967.9 -301681.6 3825015.8 1400 # Spain\nALMA 2225061.164 -5440057.37 -2481681.15 0\n";
    let layout = sniff_layout(text, "txt").unwrap().read(text, &context("e")).unwrap();
    let sefd: Vec<_> = layout.antennas().iter().map(|a| a.sensitivity).collect();
    assert_eq!(sefd, [Some(Sensitivity::SefdJy(1400.0)), None]);
    assert!(layout.site().unwrap().altitude_m > 0.0, "on the ground, although the middle of the two is deep in the Earth");
}

/// Each bad text with what its message must say.
#[test]
fn bad_texts_are_refused_with_line_expected_and_found() {
    let cfg = "# observatory=VLA\n# coordsys=XYZ\n";
    let good = "-1601614.06 -5042001.67 3554652.45 25. W08\n";
    for (text, wanted) in [
        (format!("{cfg}{good}nan -5042001.67 3554652.45 25. W16\n"), "line 4"),
        (format!("{cfg}{good}1e999 -5042001.67 3554652.45 25. W16\n"), "line 4"),
        (format!("{cfg}{good}-1601614.06 -5042001.67\n"), "line 4"),
        (format!("{cfg}{good}-1601614.06 -5042001.67 3554652.45 -25. W16\n"), "line 4"),
        (format!("{cfg}{good}{}", good.replace("W08", "W09")), "same place"),
        (format!("{cfg}{good}{}", good.replace("3554652", "3554650")), "used twice"),
        (format!("{cfg}1 2 3 25 W1\n"), "geocentric"),
        (cfg.to_owned(), "number of antennas"),
        ("# coordsys=ABC\n1 2 3 4 A\n".to_owned(), "line 1"),
        (good.to_owned(), "coordsys"),
        ("# coordsys=UTM\n1 2 3 4 A\n".to_owned(), "zone"),
        ("# coordsys=UTM\n# zone=99\n1 2 3 4 A\n".to_owned(), "line 2"),
        ("#NAME X Y Z SEFDR SEFDL\nPV 5088967.9 -301681.6 3825015.8\n".to_owned(), "line 2"),
        ("PV 5088967.9 -301681.6 3825015.8 1400\nISS 0 0 0 1400\n".to_owned(), "spacecraft"),
        ("PV 5088967.9 -301681.6 3825015.8 1400 -1\n".to_owned(), "line 1"),
        ("Name Number BeamID E N U\nA 0 0 1 2\n".to_owned(), "line 2"),
        ("Name Number BeamID E N U\nA x 0 1 2 3\n".to_owned(), "line 2"),
        ("# latitude_deg = 3\n1 2 3\n".to_owned(), "longitude_deg"),
        ("# latitude_deg = 91\n# longitude_deg = 3\n1 2 3\n".to_owned(), "latitude"),
        ("# baseunit = 0\n1 2 3\n".to_owned(), "line 1"),
        ("name = \"x\"\nframe = \"boresight\"\ncolour = 3\n".to_owned(), "line 3"),
        ("hello world\n".to_owned(), "none of the known"),
        ("<html>".to_owned(), "none of the known"),
    ] {
        let e = sniff_layout(&text, "").and_then(|f| f.read(&text, &context("x"))).unwrap_err().to_string();
        assert!(e.contains(wanted), "{text:?}: {e}");
    }
}

#[test]
fn files_that_are_no_layouts_are_refused_with_their_path() {
    let dir = tempfile::tempdir().unwrap();
    let cause = |path: &Path| {
        let e = read_layout(path, None).unwrap_err();
        assert!(e.to_string().contains(&path.display().to_string()), "{e}");
        std::error::Error::source(&e).unwrap().to_string()
    };
    assert!(cause(dir.path()).contains("folder"));
    assert!(cause(&dir.path().join("missing.cfg")).contains("No such file"));
    let file = dir.path().join("x.cfg");
    fs::write(&file, " \n").unwrap();
    assert!(cause(&file).contains("empty"));
    fs::write(&file, [0x89, b'P', b'N', b'G', 0, 0xff]).unwrap();
    assert!(cause(&file).contains("not text"));
}

#[test]
fn what_a_format_must_have_is_asked_for() {
    let bare = ArrayLayout::new("T", vla(), vec![Antenna::new("a b", 0, [0.0; 3]), Antenna::new("c", 1, [9.0; 3])]).unwrap();
    for (format, wanted) in [("casa-cfg", "no diameter"), ("ehtim", "neither an SEFD")] {
        let e = layout_format(format).unwrap().write(&bare).unwrap_err().to_string();
        assert!(e.contains(wanted) && e.contains("a b"), "{e}");
    }
    let pyuvsim = layout_format("csv").unwrap();
    assert!(pyuvsim.loses(&bare).join(" ").contains("blanks"));
    let back = pyuvsim.read(&pyuvsim.write(&bare).unwrap(), &context("x")).unwrap();
    assert_eq!(back.antennas()[0].name, "a_b");
}

proptest::proptest! {
    /// Whatever is cut out of a good text or put into it, a reader answers; it does not panic.
    #[test]
    fn damaged_texts_are_read_or_refused(format in 0..layout_formats().count(), cut in 0..400_usize, len in 0..40_usize, put in "[ -~\n]{0,12}") {
        let mut text = layout_formats().nth(format).unwrap().write(&sample(vla())).unwrap();
        let start = cut.min(text.len());
        let end = (start + len).min(text.len());
        text.replace_range(start..end, &put);
        for f in layout_formats() {
            if let Ok(layout) = f.read(&text, &context("x")) {
                proptest::prop_assert!(layout.n_ant() > 0);
            }
        }
    }
}

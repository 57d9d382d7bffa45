//! Every kind of layout: its number of elements, aperture, spacing, seed and refusals.

use super::*;
use crate::quantity::{Angle, Length, Temperature};

const APERTURE_M: f64 = 0.7;

/// Number of elements that the kind can have.
fn some_count(kind: &LayoutKind) -> usize {
    match kind.name {
        "sierpinski" | "fractal" => 27,
        "koch" => 48,
        "hexagonal" => 37,
        "difference-ring" | "difference-line" => 24,
        "difference-grid" => 20,
        "rectangular" => 48,
        "ring" | "multi-ring" | "reuleaux" | "fermat" | "random" | "poisson-disc" | "thinned-rectangular" | "thinned-hexagonal" => 50,
        "y" | "log-spiral" => 27,
        "cross" | "mills-cross" => 41,
        _ => 28,
    }
}

fn options(kind: &LayoutKind) -> GenerateOptions {
    GenerateOptions::new(some_count(kind), Length(APERTURE_M))
}

fn positions(layout: &ArrayLayout) -> Vec<[f64; 3]> {
    layout.antennas().iter().map(|a| a.position_m).collect()
}

#[test]
fn every_kind_has_its_elements_its_aperture_and_its_source() {
    for kind in LAYOUT_KINDS {
        let o = GenerateOptions { rotation: Some(Angle(0.3)), ..options(kind) };
        let layout = kind.layout(&o).unwrap();
        let extent = layout.extent();
        assert_eq!(extent.n_antennas, o.elements, "{}", kind.name);
        assert!((extent.longest_m / APERTURE_M - 1.0).abs() < 1e-12, "{}: {}", kind.name, extent.longest_m);
        let mean = [0, 1, 2].map(|k| positions(&layout).iter().map(|p| p[k]).sum::<f64>());
        assert!(mean.iter().all(|m| m.abs() < 1e-12), "{}: {mean:?}", kind.name);
        let source = layout.source.as_deref().unwrap();
        for part in [kind.name, "aperture 0.7m", "seed 1", "rotation", kind.source] {
            assert!(source.contains(part), "{source}: {part}");
        }
        // The file gives the same layout back.
        assert_eq!(ArrayLayout::from_toml(&layout.to_toml()).unwrap(), layout, "{}", kind.name);
    }
}

#[test]
fn a_seed_gives_one_layout_and_only_random_kinds_need_it() {
    for kind in LAYOUT_KINDS {
        let make = |seed| positions(&kind.layout(&GenerateOptions { seed, ..options(kind) }).unwrap());
        assert_eq!(make(5), make(5), "{}", kind.name);
        assert_eq!(make(5) != make(6), kind.options().any(|o| o == "seed"), "{}", kind.name);
    }
}

/// Bits of the first release: the same seed must give the same layout for ever, on every machine.
#[test]
fn random_layouts_do_not_change_from_release_to_release() {
    let first = |kind: &str, n| {
        let layout = ArrayLayout::generate(kind, &GenerateOptions::new(n, Length(1.0))).unwrap();
        let bits = positions(&layout).iter().flatten().fold(0_u64, |h, v| h.rotate_left(5) ^ v.to_bits());
        format!("{bits:016x}")
    };
    assert_eq!([first("random", 12), first("poisson-disc", 12), first("thinned-hexagonal", 12), first("fractal", 27)], BITS);
}
const BITS: [&str; 4] = ["641d114b99e14f53", "d02868bf8543222c", "cb85580b8bbac898", "e49051e944fb9233"];

#[test]
fn random_kinds_keep_the_spacing() {
    for (kind, n) in [("random", 100), ("poisson-disc", 100)] {
        let o = GenerateOptions { spacing: Some(Length(0.04)), ..GenerateOptions::new(n, Length(APERTURE_M)) };
        for seed in 0..5 {
            let layout = ArrayLayout::generate(kind, &GenerateOptions { seed, ..o.clone() }).unwrap();
            assert!(layout.extent().shortest_m >= 0.04, "{kind}: {}", layout.extent().shortest_m);
        }
    }
    // Without a wish the points of a Poisson disc are spread far wider than those drawn one by one.
    let least = |kind| ArrayLayout::generate(kind, &GenerateOptions::new(100, Length(1.0))).unwrap().extent().shortest_m;
    assert!(least("poisson-disc") > 0.07 && least("random") < 0.02, "{} {}", least("poisson-disc"), least("random"));
}

#[test]
fn more_elements_than_fit_with_the_spacing_are_refused() {
    for kind in LAYOUT_KINDS {
        let o = GenerateOptions { spacing: Some(Length(0.3)), ..options(kind) };
        let e = kind.layout(&o).unwrap_err().to_string();
        assert!(e.contains("spacing") && (e.contains("at most")), "{}: {e}", kind.name);
    }
    // Not more than any arrangement holds, but more than random places do.
    let o = GenerateOptions { spacing: Some(Length(0.1)), ..GenerateOptions::new(85, Length(1.0)) };
    for kind in ["random", "poisson-disc"] {
        let e = ArrayLayout::generate(kind, &o).unwrap_err().to_string();
        assert!(e.starts_with("elements is 85, expected at most ") && e.contains("at random"), "{kind}: {e}");
    }
    // The diameter is the spacing where none is given.
    let o = GenerateOptions { diameter: Some(Length(0.2)), ..GenerateOptions::new(50, Length(1.0)) };
    let e = ArrayLayout::generate("ring", &o).unwrap_err().to_string();
    assert!(e.starts_with("diameter is 20cm, expected at most 6.279cm"), "{e}");
}

#[test]
fn a_number_that_a_kind_cannot_have_names_the_nearest() {
    let refused = |kind: &str, n, arms| {
        let o = GenerateOptions { arms, ..GenerateOptions::new(n, Length(1.0)) };
        ArrayLayout::generate(kind, &o).unwrap_err().to_string()
    };
    for (kind, n, arms, nearest) in [
        ("y", 29, None, "28 or 30"),
        ("y", 32, Some(5), "31 or 35"),
        ("t", 30, None, "28 or 31"),
        ("cross", 10, None, "9 or 12"),
        ("ring", 2, None, "3"),
        ("hexagonal", 40, None, "37 or 61"),
        ("rectangular", 47, None, "45 or 48"),
        ("koch", 50, None, "48 or 192"),
        ("sierpinski", 100, None, "81 or 243"),
        ("difference-ring", 23, None, "20 or 24"),
        ("difference-grid", 23, None, "20 or 24"),
        ("coprime", 23, Some(3), "22 or 25"),
        ("golomb", 30, None, "28 or 31"),
    ] {
        let e = refused(kind, n, arms);
        assert!(e.starts_with(&format!("elements is {n}, expected {nearest}, the nearest that the kind {kind:?} has")), "{e}");
    }
}

#[test]
fn bad_options_are_refused_by_name() {
    let good = GenerateOptions::new(27, Length(1.0));
    for (kind, o, words) in [
        ("ring", GenerateOptions { arms: Some(3), ..good.clone() }, "arms is 3, expected no such option"),
        ("y", GenerateOptions { rings: Some(3), ..good.clone() }, "takes arms and exponent"),
        ("y", GenerateOptions { arms: Some(0), ..good.clone() }, "arms is 0, expected 1 to 100"),
        ("y", GenerateOptions { arms: Some(2), elements: 26, ..good.clone() }, "arms is 2, expected at least 3"),
        ("y", GenerateOptions { exponent: Some(f64::NAN), ..good.clone() }, "exponent is NaN"),
        ("fermat", GenerateOptions { elements: 1, ..good.clone() }, "elements is 1, expected 2 to 10,000"),
        ("fermat", GenerateOptions { elements: usize::MAX, ..good.clone() }, "expected 2 to 10,000"),
        ("fermat", GenerateOptions { aperture: Length(0.0), ..good.clone() }, "aperture is 0m"),
        ("fermat", GenerateOptions { spacing: Some(Length(-1.0)), ..good.clone() }, "spacing is -1m"),
        ("fermat", GenerateOptions { spacing: Some(Length(2.0)), ..good.clone() }, "at most the aperture, 1m"),
        ("golomb", GenerateOptions { arms: Some(4), elements: 29, ..good.clone() }, "on opposite arms baselines repeat"),
        ("log-spiral", GenerateOptions { inner: Some(0.0), ..good.clone() }, "inner is 0"),
        ("thinned-rectangular", GenerateOptions { columns: Some(5), ..good.clone() }, "at most 25, the places of the grid"),
        ("fractal", GenerateOptions { arms: Some(6), elements: 36, ..good.clone() }, "2 to 5 branches"),
        ("multi-ring", GenerateOptions { rings: Some(0), ..good.clone() }, "rings is 0"),
        ("spiral", good.clone(), "no kind of layout; the kinds are y, t, u"),
    ] {
        let e = ArrayLayout::generate(kind, &o).unwrap_err().to_string();
        assert!(e.contains(words), "{kind}: {e}");
    }
}

/// Number of different baselines, in units of a whole step of the marks.
fn unique(layout: &ArrayLayout, tolerance_m: f64) -> usize {
    let freq = crate::SPEED_OF_LIGHT_M_S / (10.0 * tolerance_m);
    layout.figures(freq).unwrap().unique_baselines
}

#[test]
fn arms_of_golomb_rulers_repeat_no_baseline() {
    for (arms, n) in [(1, 12), (2, 17), (3, 28), (5, 26)] {
        let o = GenerateOptions { arms: Some(arms), ..GenerateOptions::new(n, Length(1.0)) };
        let layout = ArrayLayout::generate("golomb", &o).unwrap();
        assert_eq!(unique(&layout, 1e-4), n * (n - 1) / 2, "{arms} arms");
    }
    // Steps on the ring of a difference set of 31 places: every chord comes once in every direction.
    let ring = ArrayLayout::generate("difference-ring", &GenerateOptions::new(6, Length(1.0))).unwrap();
    assert_eq!(unique(&ring, 1e-4), 15);
}

#[test]
fn the_vla_is_a_y() {
    let vla = ArrayLayout::builtin("vla-a").unwrap();
    let made = ArrayLayout::generate("y", &GenerateOptions::new(27, Length(vla.extent().longest_m))).unwrap();
    // Pads stand within a few percent of the law, and the arms are turned and unequal by as much.
    let ratio = made.extent().shortest_m / vla.extent().shortest_m;
    assert!((ratio - 1.0).abs() < 0.1, "{ratio}");
}

#[test]
fn elements_carry_what_the_options_say() {
    let o = GenerateOptions { diameter: Some(Length(0.01)), tsys: Some(Temperature(600.0)), ..GenerateOptions::new(100, Length(1.0)) };
    let layout = ArrayLayout::generate("fermat", &o).unwrap();
    let a = &layout.antennas()[0];
    assert_eq!((a.name.as_str(), a.diameter_m, a.sensitivity), ("E001", Some(0.01), Some(crate::Sensitivity::TsysK(600.0))));
}

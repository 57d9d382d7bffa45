//! Data and sizes with which an imager can make little or no image.

use crate::program::Scratch;
use cittert_arrays::{VisibilityBlock, for_each_block};
use cittert_formats::{create_visibilities, open_visibilities};

const IMAGE: &str = "--size 64 --cell 1mrad --weighting natural";

/// A point of 1 Jy at the centre, observed without noise. `change` is applied to all of its data.
fn changed(s: &Scratch, change: impl Fn(&mut VisibilityBlock)) {
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0,0,1\n");
    s.ok("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 1GHz -o whole.uvh5");
    let mut source = open_visibilities(&s.path("whole.uvh5")).unwrap();
    let mut sink = create_visibilities(&s.path("v.uvh5"), source.header(), false).unwrap().sink;
    for_each_block(source.as_mut(), 64 << 20, |_, mut block| -> Result<(), cittert_arrays::ArrayError> {
        change(&mut block);
        sink.write_block(&block)
    })
    .unwrap();
    sink.finish().unwrap();
}

#[test]
fn a_set_without_usable_data_is_refused() {
    let s = Scratch::new();
    changed(&s, |b| b.flags.fill(true));
    for reader in ["dirty v.uvh5 -o d.fits", "clean v.uvh5 -o c"] {
        s.fails(&format!("{reader} {IMAGE}"), 1, &["no usable visibility", "are flagged"]);
    }
    let s = Scratch::new();
    changed(&s, |b| {
        b.weights.fill(0.0);
        b.nsamples.fill(0.0);
    });
    for reader in ["dirty v.uvh5 -o d.fits", "clean v.uvh5 -o c"] {
        s.fails(&format!("{reader} {IMAGE}"), 1, &["no usable visibility", "weight that is not positive"]);
    }
}

#[test]
fn one_visibility_is_a_fringe_of_its_amplitude() {
    let s = Scratch::new();
    changed(&s, |b| {
        b.flags.fill(true);
        b.flags.slice_mut(ndarray::s![3, 0, ..]).fill(false);
    });
    let said = s.json(&format!("dirty v.uvh5 -o d.fits {IMAGE}"));
    assert_eq!(said["n_used"], 1);
    let (peak, rms) = (said["peak"].as_f64().unwrap(), said["rms"].as_f64().unwrap());
    assert!((peak - 1.0).abs() < 1e-4, "{said}");
    assert!(rms > 0.5 && rms <= 1.0001, "{said}");
}

#[test]
fn data_that_are_not_finite_are_counted_and_left_out() {
    let s = Scratch::new();
    changed(&s, |b| {
        b.vis[(0, 0, 0)].re = f32::NAN;
        b.vis[(1, 0, 0)].im = f32::INFINITY;
        b.vis[(2, 0, 0)].re = f32::NEG_INFINITY;
    });
    let said = s.json(&format!("dirty v.uvh5 -o d.fits {IMAGE}"));
    assert!(said["n_not_finite"].as_u64().unwrap() > 0, "{said}");
    assert!((said["peak"].as_f64().unwrap() - 1.0).abs() < 1e-4, "{said}");
    let text = s.ok(&format!("dirty v.uvh5 -o e.fits {IMAGE}"));
    assert!(text.err.contains("not finite"), "{}", text.err);
}

#[test]
fn baselines_far_outside_the_grid_warn_and_stay_finite() {
    let s = Scratch::new();
    changed(&s, |b| b.coverage.uvw_m.row_mut(0).iter_mut().for_each(|x| *x *= 1e6));
    let said = s.ok(&format!("--json dirty v.uvh5 -o d.fits {IMAGE}"));
    assert!(said.err.contains("too coarse"), "{}", said.err);
    let json: serde_json::Value = serde_json::from_str(&said.out).unwrap();
    assert!((json["peak"].as_f64().unwrap() - 1.0).abs() < 1e-3, "{json}");
}

#[test]
fn a_cell_too_coarse_is_warned_of_with_the_number_to_use() {
    let s = Scratch::new();
    changed(&s, |_| ());
    let said = s.ok("dirty v.uvh5 -o d.fits --size 64 --cell 20mrad");
    assert!(said.err.contains("too coarse") && said.err.contains("use at most"), "{}", said.err);
}

#[test]
fn images_of_one_row_are_refused() {
    let s = Scratch::new();
    changed(&s, |_| ());
    for size in ["1x64", "64x1", "1"] {
        let said = s.run(&format!("dirty v.uvh5 -o d.fits --cell 1mrad --size {size}"));
        assert!(said.code == 1 || said.code == 2, "{size}: {}", said.err);
        assert!(!said.err.contains("panicked") && said.err.contains('1'), "{size}: {}", said.err);
        assert!(!s.path("d.fits").exists());
    }
}

#[test]
fn a_mask_and_a_box_keep_components_inside() {
    let s = Scratch::new();
    changed(&s, |_| ());
    for (k, region) in ["--box=-2mrad,-2mrad,2mrad,2mrad", "--mask c0-model.fits"].iter().enumerate() {
        s.ok(&format!("clean v.uvh5 {IMAGE} {region} -o c{k}"));
        let components = std::fs::read_to_string(s.path(&format!("c{k}-components.csv"))).unwrap();
        let inside = |line: &str| line.split(',').take(2).all(|x| x.parse::<f64>().unwrap().abs() <= 2e-3);
        assert!(components.lines().count() > 1 && components.lines().skip(1).all(inside), "{components}");
    }
    s.fails(&format!("clean v.uvh5 {IMAGE} --box=9rad,9rad,9rad,9rad -o d"), 1, &["no pixel", "box"]);
}

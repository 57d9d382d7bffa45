//! `plot`: what it draws of each kind of file, and what it refuses.

use crate::program::Scratch;

/// Texts of an SVG.
fn texts(svg: &str) -> Vec<String> {
    svg.split("<text ").skip(1).filter_map(|t| Some(t.split_once('>')?.1.split_once('<')?.0.to_owned())).collect()
}

/// A set of two points, its images, and gains with their truth.
fn scratch() -> Scratch {
    let s = Scratch::new();
    s.write("s.csv", "l_rad,m_rad,flux_jy\n0.0,0.0,1000000.0\n0.02,0.01,300000.0\n");
    s.ok("simulate --layout mm-y --scene s.csv --freq 94GHz --bandwidth 4GHz --noise -o v.uvh5");
    s.ok("clean v.uvh5 --size 256 --cell 1mrad --weighting briggs --robust 0 --niter 300 -o c");
    s.ok("corrupt v.uvh5 --phase-rms 30deg -o x.uvh5 --gains true.calh5");
    s.ok("selfcal x.uvh5 --size 256 --cell 1mrad --solint inf --rounds 2 --start point -o sc");
    s
}

#[test]
fn pictures_say_what_they_show() {
    let s = scratch();
    let shown = |command: &str| {
        s.ok(&format!("plot {command} -o p.svg --overwrite"));
        texts(&std::fs::read_to_string(s.path("p.svg")).unwrap())
    };
    let image = shown("c-image.fits");
    assert!(image.iter().any(|t| t.starts_with("H\u{f6}gbom CLEAN image of ")), "{image:?}");
    assert!(image.iter().any(|t| t.contains("94.00 GHz") && t.contains("Briggs 0")), "{image:?}");
    assert!(image.iter().any(|t| t.contains("times the noise of")) && image.iter().any(|t| t.contains("of 256 x 256 pixels")), "{image:?}");
    assert!(!shown("c-image.fits --full").iter().any(|t| t.contains("of 256 x 256 pixels")));
    let beam = shown("c-psf.fits");
    assert!(beam.iter().any(|t| t == "Dirty beam") && beam.iter().any(|t| t == "Level (dB)"), "{beam:?}");
    assert!(beam.iter().any(|t| t.contains("Full width at half maximum")), "{beam:?}");
    assert!(shown("c-psf.fits --what image").iter().any(|t| t == "Ratio"));
    let residual = shown("c-residual.fits");
    assert!(residual.iter().any(|t| t.starts_with("Multiples of the noise of ")), "{residual:?}");
    assert!(residual.contains(&"5".into()) && residual.contains(&"\u{2212}5".into()), "{residual:?}");
    let gains = shown("sc.calh5 --truth true.calh5");
    assert!(gains.iter().any(|t| t == "Solved and true gain phases") && gains.iter().any(|t| t.contains("deg rms")), "{gains:?}");
    let model = shown("v.uvh5 --what model --model s.csv");
    let told = model.iter().find(|t| t.contains("times the noise; 1 is")).unwrap();
    let ratio: f64 = told.split("Data less model is ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    // The model is the truth, so noise is left: 435 visibilities give its rms to 1 / sqrt(2 * 870), and three times that is 7 per cent.
    assert!((ratio - 1.0).abs() < 0.07, "{told}");
    let both = shown("c-dirty.fits c-image.fits --title Before --title After");
    assert!(both.contains(&"Before".into()) && both.contains(&"After".into()), "{both:?}");
}

#[test]
fn options_that_do_not_suit_a_file_are_refused() {
    let s = scratch();
    s.fails("plot c-image.fits --range 3,1 -o p.png", 2, &["--range", "LOW,HIGH"]);
    s.fails("plot v.uvh5 --range 1,3 -o p.png", 2, &["v.uvh5", "for images"]);
    s.fails("plot c-image.fits --what uv -o p.png", 2, &["--what uv", "residual"]);
    s.fails("plot c-image.fits --truth true.calh5 -o p.png", 2, &["--truth", "gain tables"]);
    s.fails("plot v.uvh5 --model s.csv -o p.png", 2, &["--what model"]);
    s.fails("plot c-image.fits c-dirty.fits --title a --title b --title c -o p.png", 2, &["3 titles for 2 files"]);
    s.fails("plot c-residual.fits --what psf -o p.png", 1, &["c-residual.fits", "peak in the middle"]);
    s.fails("plot v.uvh5 --what model -o p.png", 1, &["model"]);
    s.ok("plot c-image.fits --range=-1,3 --stretch asinh -o p.png");
}

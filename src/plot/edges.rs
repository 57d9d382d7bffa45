//! No text of any picture reaches over an edge of the picture.

use super::canvas::Canvas;
use super::picture::Picture;
use super::shape::{Align, Shape};
use super::{CurveOptions, GainPlot, ImagePlot, Series, VisPlot, Wish, curves, gains, image, images, layout, psf, uv_coverage};
use crate::closure::testdata::Scene;
use cittert_arrays::{BrightnessUnit, GainTable, Image, Polarization, SkyFrame, SkyGrid, SpectralWindow};
use ndarray::Array4;

const LONG: &str = "A dirty image of a very long name of an object that an observer gave to a field, which nobody has shortened since\n\
                    The array with the longest name of all arrays that were ever built on this or any other planet, 8.40 GHz, Briggs 0";

/// Texts that lie partly outside of a picture.
fn cut(picture: &Picture) -> Vec<String> {
    let canvas = &picture.0;
    let (w, h) = canvas.size();
    let measure = Canvas::new(100, 100).unwrap();
    let mut out = Vec::new();
    for shape in canvas.shapes() {
        let Shape::Text { at: (x, y), text, em, align, upwards, .. } = shape else { continue };
        let length = measure.text_width(text, *em);
        let back = match align {
            Align::Left => 0.0,
            Align::Center => 0.5 * length,
            Align::Right => length,
        };
        // Letters reach 0.76 em above and 0.24 em below the base line.
        let (x0, x1, y0, y1) = if *upwards {
            (x - 0.76 * em, x + 0.24 * em, y + back - length, y + back)
        } else {
            (x - back, x - back + length, y - 0.76 * em, y + 0.24 * em)
        };
        if x0 < 0.0 || y0 < 0.0 || x1 > w as f64 || y1 > h as f64 {
            out.push(format!("{text:?} of {w} x {h} lies at {x0:.0} to {x1:.0}, {y0:.0} to {y1:.0}"));
        }
    }
    out
}

fn picture_of(unit: BrightnessUnit, factor: f64) -> Image {
    let grid = SkyGrid::new(64, 48, 1e-5, SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() }).unwrap();
    let value = |r: usize, c: usize| factor * (if (r, c) == (24, 32) { 1.0 } else { 1e-3 * ((r * 37 + c * 11) % 17) as f64 });
    let data = Array4::from_shape_fn((1, 1, 48, 64), |(_, _, r, c)| value(r, c));
    Image::new(grid, SpectralWindow::band(1e9, 1e6, 1).unwrap(), vec![Polarization::I], data, unit).unwrap()
}

#[test]
fn no_text_is_cut_off_at_an_edge() {
    let scene = Scene::point(27, 3);
    let set = scene.set(|_, _, _, _| num_complex::Complex64::new(1.0, 0.0));
    let coverage = &set.data.coverage;
    let header = &set.header;
    let times = vec![2_460_000.0, 2_460_000.1, 2_460_000.3];
    let table = GainTable::unity(header.layout.clone(), header.spectrum.clone(), vec!["I".into()], times, vec![60.0; 3]).unwrap();
    let mut once = table.clone();
    once.time_jd.truncate(1);
    once.interval_s.truncate(1);
    once.gains = table.gains.slice(ndarray::s![..1, .., .., ..]).to_owned();
    once.flags = table.flags.slice(ndarray::s![..1, .., .., ..]).to_owned();
    let mut visibilities = VisPlot::new(header);
    visibilities.add(&set.data);
    let mut found = Vec::new();
    for (width, height) in [(900, 800), (400, 300), (1500, 420), (420, 900)] {
        let options = ImagePlot { title: LONG.into(), width, height, ..ImagePlot::default() };
        for unit in [BrightnessUnit::JyPerBeam, BrightnessUnit::Kelvin, BrightnessUnit::One, BrightnessUnit::Other, BrightnessUnit::Metre] {
            for factor in [1.0, 123_456.7, 3.21e-9] {
                found.extend(cut(&image(&picture_of(unit, factor), &options).unwrap()));
            }
        }
        let one = picture_of(BrightnessUnit::One, 1.0);
        found.extend(cut(&psf(&one, &options).unwrap()));
        found.extend(cut(
            &images(&[(&one, LONG), (&one, "b"), (&one, LONG)], &ImagePlot { wish: Wish::default(), ..options.clone() }).unwrap()
        ));
        for gain_table in [&table, &once] {
            found.extend(cut(&gains(gain_table, &GainPlot { title: LONG.into(), width, height, ..GainPlot::default() }).unwrap()));
        }
        found.extend(cut(&layout(&header.layout, LONG, width, height).unwrap()));
        found.extend(cut(&uv_coverage(coverage, &header.spectrum, LONG, width, height).unwrap()));
        found.extend(cut(&visibilities.draw(LONG, width, height).unwrap()));
        let line = Series { name: "a line".into(), points: vec![(1e-7, 3.0), (2e5, 4e9)], errors: Vec::new() };
        for log in [false, true] {
            let labels = CurveOptions {
                title: LONG.into(),
                x_label: LONG.replace('\n', " "),
                y_label: LONG.replace('\n', " "),
                ..CurveOptions::default()
            };
            let options = CurveOptions { log_x: log, log_y: log, width, height, ..labels };
            found.extend(cut(&curves(std::slice::from_ref(&line), &options).unwrap()));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

//! Closure imaging: the error of the image relative to the scene, after a shift onto it. Ten antennas observe each scene for a part of a
//! day.

use crate::scenes::{CELL, Case, Random, SIDE, cases, error_of, grid};
use crate::table::{Group, Knob, measure};
use cittert::arrays::SkyFrame;
use cittert::closure_imaging::Samples;
use cittert::closure_imaging::{ClosureImagingControl, ClosureImagingOptions, SmallDft, SparseSet, reconstruct};
use cittert::fidelity::{find_shift, shifted};
use cittert::imaging::DataCounts;
use cittert::progress::Silent;
use ndarray::Array2;
use num_complex::Complex64;

/// Antennas that take part: every third of the case, and a companion next to the first one that measures the total flux.
const ANTENNAS: usize = 9;
const MOMENTS: usize = 8;
/// Lengths of the baselines in wavelengths a metre of the layout.
const WAVES: f64 = 300.0;

fn observed(case: &Case) -> SparseSet {
    let mut places: Vec<[f64; 2]> = case.places.iter().step_by(3).take(ANTENNAS).map(|p| [p[0] * WAVES, p[1] * WAVES]).collect();
    places.push([places[0][0] + 0.02, places[0][1]]);
    let n = places.len();
    let (mut pairs, mut uv, mut moments) = (Vec::new(), Vec::new(), Vec::new());
    for t in 0..MOMENTS {
        let (sin, cos) = (0.35 * t as f64).sin_cos();
        let start = pairs.len();
        for p in 0..n {
            for q in p + 1..n {
                let (x, y) = (places[q][0] - places[p][0], places[q][1] - places[p][1]);
                pairs.push((p, q));
                uv.push([x * cos - y * sin, 0.8 * (x * sin + y * cos)]);
            }
        }
        moments.push(start..pairs.len());
    }
    let image: Vec<f64> = case.scene.iter().copied().collect();
    let mut vis = SmallDft::new(&grid(), &uv).forward(&image);
    let mut random = Random(5);
    let mut sigma = Vec::with_capacity(vis.len());
    for m in &moments {
        let gain: Vec<Complex64> = (0..n).map(|_| Complex64::from_polar(1.0 + 0.1 * random.next(), 3.0 * random.next())).collect();
        for k in m.clone() {
            let (p, q): (usize, usize) = pairs[k];
            vis[k] *= gain[p] * gain[q].conj();
            sigma.push((1e-3 * case.scene.sum()).hypot(0.02 * vis[k].norm()));
            vis[k] += Complex64::new(random.next(), random.next()) * sigma[k];
        }
    }
    let samples = Samples::new(n, pairs, (vis, sigma), moments).unwrap();
    let names = (0..n).map(|a| a.to_string()).collect();
    SparseSet { samples, uv, times_jd: vec![0.0; MOMENTS], names, phase_center: 0, counts: DataCounts::default() }
}

fn error(case: &Case, tuning: &ClosureImagingControl) -> f64 {
    let options = ClosureImagingOptions { rounds: 3, iterations: 50, tuning: *tuning, ..ClosureImagingOptions::default() };
    let found = reconstruct(&observed(case), SkyFrame::Boresight, &options, &Silent).unwrap();
    // The image has its own cell and size: it is brought to the grid of the scene.
    let (cells, ratio) = (&found.model, CELL / found.grid.cell_rad);
    let (rows, columns) = cells.dim();
    let at = |i: usize, n: usize| (i as f64 - (SIDE / 2) as f64) * ratio + (n / 2) as f64;
    let image = Array2::from_shape_fn((SIDE, SIDE), |(i, j)| {
        let (y, x) = (at(i, rows).round(), at(j, columns).round());
        let inside = (0.0..rows as f64).contains(&y) && (0.0..columns as f64).contains(&x);
        if inside { cells[(y as usize, x as usize)] * ratio * ratio } else { 0.0 }
    });
    let by = find_shift(image.view(), case.scene.view()).unwrap();
    error_of(&shifted(image.view(), by), &case.scene)
}

pub fn group() -> Group {
    let d = ClosureImagingControl::default();
    let knobs: Vec<Knob<ClosureImagingControl>> = vec![
        Knob { name: "ClosureImagingControl::cells", default: d.cells.to_string(), set: |t, x| t.cells *= x },
        Knob { name: "ClosureImagingControl::field", default: d.field.to_string(), set: |t, x| t.field *= x },
        Knob { name: "ClosureImagingControl::largest", default: d.largest.to_string(), set: |t, x| t.largest = (128.0 * x) as usize },
        Knob { name: "ClosureImagingControl::co_located", default: d.co_located.to_string(), set: |t, x| t.co_located *= x },
        Knob { name: "ClosureImagingControl::gap", default: d.gap.to_string(), set: |t, x| t.gap *= x },
        Knob { name: "ClosureImagingControl::usual_prior", default: d.usual_prior.to_string(), set: |t, x| t.usual_prior *= x },
        Knob { name: "ClosureImagingControl::least_prior", default: d.least_prior.to_string(), set: |t, x| t.least_prior *= x },
        Knob { name: "ClosureImagingControl::largest_prior", default: d.largest_prior.to_string(), set: |t, x| t.largest_prior *= x },
        Knob {
            name: "ClosureImagingControl::fluxes",
            default: "1 to 0.3".into(),
            set: |t, x| t.fluxes.iter_mut().for_each(|f| *f = f.powf(x)),
        },
        Knob {
            name: "ClosureImagingControl::trial_rounds",
            default: d.trial_rounds.to_string(),
            set: |t, x| t.trial_rounds = (2.0 * x) as usize,
        },
        Knob {
            name: "ClosureImagingControl::trial_iterations",
            default: d.trial_iterations.to_string(),
            set: |t, x| t.trial_iterations = (40.0 * x) as usize,
        },
        Knob { name: "ClosureImagingControl::decrease", default: d.decrease.to_string(), set: |t, x| t.decrease *= x },
    ];
    measure("closure imaging", &cases(), &knobs, error)
}

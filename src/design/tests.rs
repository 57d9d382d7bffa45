//! Whole searches: layouts of few elements against what is known, and bad input.

use super::*;
use crate::progress::Silent;
use cittert_arrays::quantity::{Angle, Duration, Frequency, Length};
use std::collections::BTreeMap;

fn optimised(options: &DesignOptions) -> (Problem, Searched) {
    let problem = options.problem(&Ground::default()).unwrap();
    let method = options.method_for(&problem).unwrap();
    let one = |k: u64, elite: &[Found]| attempt(&problem, method, None, options.seed, k, elite, &Silent);
    let found = search(options.control().unwrap(), BTreeMap::new(), &one, &|_| Ok(()), &Silent).unwrap();
    (problem, found)
}

/// The peak on a grid of a fiftieth of a wavelength over the aperture, by plain sums.
fn brute_force(xy: &[[f64; 2]], inner: f64, outer: f64) -> f64 {
    let steps = (outer / 0.02) as i32;
    let mut highest = f64::NEG_INFINITY;
    for j in 0..=steps {
        for i in -steps..=steps {
            let direction = [0.02 * f64::from(i), 0.02 * f64::from(j)];
            if (inner..=outer).contains(&direction[0].hypot(direction[1])) {
                highest = highest.max(beam(xy, direction));
            }
        }
    }
    highest
}

#[test]
fn peak_side_lobes_are_those_of_a_brute_force_search_and_the_beam_keeps_its_width() {
    let options =
        DesignOptions { elements: Some(16), aperture: Some(Length(3.0)), within: 6.0, restarts: Some(4), ..DesignOptions::default() };
    let (problem, found) = optimised(&options);
    let truth = brute_force(&found.best.xy, 1.3, 6.0);
    // The grid misses a little of the top: half of the curvature of the narrowest lobe times the square of half a diagonal.
    assert!(found.best.score >= truth - 1e-9 && found.best.score < truth + 4e-3 * truth, "{} {truth}", found.best.score);
    let [narrow, wide] = problem.limits.width(&found.best.xy);
    assert!(narrow > 0.8 && wide <= 1.2, "{narrow} {wide}");
    // Random layouts of 16 elements have lobes of 0.4 and more.
    assert!(found.best.score < 0.15, "{}", found.best.score);
}

#[test]
fn a_symmetric_layout_is_symmetric_and_threads_do_not_matter() {
    let options = DesignOptions {
        elements: Some(15),
        aperture: Some(Length(1.0)),
        symmetry: 3,
        within: 5.0,
        restarts: Some(9),
        ..DesignOptions::default()
    };
    let run = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| optimised(&options).1);
    let found = run(1);
    assert_eq!(found, run(3));
    for p in &found.best.xy {
        let (s, c) = (std::f64::consts::TAU / 3.0).sin_cos();
        let turned = [c * p[0] - s * p[1], s * p[0] + c * p[1]];
        assert!(found.best.xy.iter().any(|q| (q[0] - turned[0]).hypot(q[1] - turned[1]) < 1e-12));
    }
}

/// Positions on a circle of which the chords are multiples of half a wavelength: every choice is tried.
#[test]
fn chosen_pads_have_as_many_different_baselines_as_the_best_of_all_choices() {
    for (pads, choose) in [(12_u32, 6_usize), (16, 8)] {
        let ring = ring_of_half_wavelengths(pads as usize);
        let options = DesignOptions {
            objective: "redundancy".parse().unwrap(),
            freq: Some(Frequency(299_792_458.0)),
            restarts: Some(8),
            ..DesignOptions::default()
        };
        let (problem, chosen) = options.problem_of_pads(&ring, choose, &Ground::default()).unwrap();
        let one = |k: u64, elite: &[Found]| attempt_pads(&problem, &chosen, 1, k, elite, &Silent);
        let found = search(options.control().unwrap(), BTreeMap::new(), &one, &|_| Ok(()), &Silent).unwrap();
        let mut best = 0;
        for set in 0_u32..1 << pads {
            if set.count_ones() as usize == choose {
                let xy: Vec<[f64; 2]> = (0..pads).filter(|k| set >> k & 1 == 1).map(|k| chosen.places[k as usize]).collect();
                best = best.max(baselines::unique_baselines(&xy, problem.setting.tolerance));
            }
        }
        let unique = ((1.0 - found.best.score) * (choose * (choose - 1) / 2) as f64).round() as usize;
        assert_eq!(unique, best, "{choose} of {pads}");
    }
}

/// Places on a circle, each a chord of half a wavelength (1 m at 299.8 MHz) or a multiple of it after the one before.
fn ring_of_half_wavelengths(n: usize) -> Vec<[f64; 2]> {
    let chords: Vec<f64> = (0..n).map(|k| 0.5 * [1.0, 2.0, 1.0, 3.0][k % 4]).collect();
    // The radius for which the arcs close the circle.
    let (mut low, mut high) = (0.75, 100.0 * n as f64);
    for _ in 0..200 {
        let r = f64::midpoint(low, high);
        let sum: f64 = chords.iter().map(|c| 2.0 * (c / (2.0 * r)).min(1.0).asin()).sum();
        if sum > std::f64::consts::TAU { low = r } else { high = r }
    }
    let mut angle = 0.0_f64;
    let place = |c: &f64| {
        let (s, co) = angle.sin_cos();
        angle += 2.0 * (c / (2.0 * low)).asin();
        [low * co, low * s]
    };
    chords.iter().map(place).collect()
}

fn refused(options: &DesignOptions, ground: &Ground) -> String {
    let message = options.problem(ground).and_then(|p| {
        options.method_for(&p)?;
        options.control()?;
        attempt(&p, &METHODS[0], None, 1, 0, &[], &Silent).map(drop)
    });
    message.err().map_or_else(|| panic!("{options:?} was not refused"), |e| e.to_string())
}

#[test]
fn bad_input_gives_one_clear_message() {
    let good = DesignOptions { elements: Some(20), aperture: Some(Length(1.0)), within: 5.0, ..DesignOptions::default() };
    let square = |a: f64, b: f64| Polygon::new("q", vec![[a, a], [b, a], [b, b], [a, b]]).unwrap();
    let none = Ground::default();
    let cases: [(DesignOptions, Ground, &str); 16] = [
        (DesignOptions { elements: None, ..good.clone() }, none.clone(), "elements"),
        (DesignOptions { aperture: None, ..good.clone() }, none.clone(), "aperture"),
        (DesignOptions { aperture: Some(Length(-1.0)), ..good.clone() }, none.clone(), "aperture"),
        (DesignOptions { spacing: Length(0.5), ..good.clone() }, none.clone(), "more do not fit"),
        (DesignOptions { spacing: Length(0.25), ..good.clone() }, none.clone(), "keep their spacing"),
        (DesignOptions { beam: Some(5.0), ..good.clone() }, none.clone(), "beam"),
        (DesignOptions { beam: Some(0.4), ..good.clone() }, none.clone(), "narrower"),
        (DesignOptions { within: 1.0, ..good.clone() }, none.clone(), "within"),
        (DesignOptions { symmetry: 3, ..good.clone() }, none.clone(), "symmetry"),
        (DesignOptions { bandwidth: Some(Frequency(1e9)), ..good.clone() }, none.clone(), "freq"),
        (DesignOptions { channels: 4, ..good.clone() }, none.clone(), "channels"),
        (DesignOptions { declination: Some(Angle(0.5)), ..good.clone() }, none.clone(), "declination"),
        (DesignOptions { method: Some("magic".into()), ..good.clone() }, none.clone(), "method"),
        (DesignOptions { time: Some(Duration(0.0)), ..good.clone() }, none.clone(), "time"),
        (
            DesignOptions { spacing: Length(0.1), ..good.clone() },
            Ground { fixed: vec![[0.1, 0.0], [0.1, 0.05]], ..Ground::default() },
            "fixed elements 1 and 2",
        ),
        (good.clone(), Ground { outside: vec![square(-2.0, 2.0)], ..Ground::default() }, "no ground"),
    ];
    for (options, ground, word) in cases {
        let message = refused(&options, &ground);
        assert!(message.contains(word), "{word:?} is not in {message:?}");
    }
    let far = Ground { fixed: vec![[3.0, 0.0]], ..Ground::default() };
    assert!(refused(&good, &far).contains("fixed element 1"));
    let unknown = "beauty".parse::<Objectives>().unwrap_err().to_string();
    assert!(unknown.contains("beauty") && unknown.contains("psl") && unknown.contains("cable"), "{unknown}");
    for wrong in ["psl=0", "psl=-1", "psl=nan", "psl,psl", ""] {
        assert!(wrong.parse::<Objectives>().is_err(), "{wrong}");
    }
    assert!(good.problem_of_pads(&[], 3, &none).unwrap_err().to_string().contains("0 pads"));
    let pads = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let options = DesignOptions { elements: None, ..good };
    assert!(options.problem_of_pads(&pads, 4, &none).unwrap_err().to_string().contains("choose"));
    assert!(options.problem_of_pads(&pads, 2, &far).unwrap_err().to_string().contains("stands on no pad"));
}

//! Laws that hold for all objectives.

use super::*;
use crate::design::peaks::Ring;
use crate::design::profile::Profile;
use crate::design::views::View;
use crate::random::stream;
use rand::RngExt;

fn setting() -> Setting {
    // Two channels of a short track: gradients pass through the matrices of the views.
    let views = View::track(0.6, 0.3, [-0.5, 0.7], 2, &View::band(0.1, 2));
    Setting { views, ring: Ring { inner: 1.3, outer: 7.0 }, tolerance: 1e-3, density: Profile::gaussian(0.8), scene: None, coverage: None }
}

fn layout(n: usize) -> Vec<[f64; 2]> {
    let mut random = stream(11, "layout", n as u64);
    (0..n).map(|_| [random.random::<f64>() - 0.5, random.random::<f64>() - 0.5]).collect()
}

#[test]
fn gradients_are_those_of_differences() {
    for kind in OBJECTIVES.iter().filter(|k| k.gradient) {
        for (n, doublings) in [(5, 3), (9, 5)] {
            let (xy, mut objective) = (layout(n), (kind.make)(&setting()).unwrap());
            let mut f = |xy: &[[f64; 2]]| objective.smooth(xy, doublings, 1.0, &mut vec![[0.0; 2]; n]).unwrap();
            let mut by_difference = vec![[0.0; 2]; n];
            for k in 0..n {
                for i in 0..2 {
                    // Four points: the error is of fourth order in the step.
                    let mut at = |step: f64| {
                        let mut moved = xy.clone();
                        moved[k][i] += step;
                        f(&moved)
                    };
                    let h = 2e-4;
                    by_difference[k][i] = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h);
                }
            }
            let weight = 2.5;
            let mut gradient = vec![[1.0; 2]; n];
            objective.smooth(&xy, doublings, weight, &mut gradient).unwrap();
            let largest = by_difference.iter().flatten().fold(0.0_f64, |a, g| a.max(g.abs()));
            for (g, d) in gradient.iter().flatten().zip(by_difference.iter().flatten()) {
                let error = ((g - 1.0) / weight - d).abs() / largest;
                assert!(error < 1e-6, "{} of {n}: {} {d}, relative {error:e}", kind.name, (g - 1.0) / weight);
            }
        }
    }
}

#[test]
fn figures_do_not_change_when_the_layout_is_shifted_and_elements_change_places() {
    for kind in OBJECTIVES.iter().filter(|k| !["coverage", "scene"].contains(&k.name)) {
        let (xy, mut objective) = (layout(10), (kind.make)(&setting()).unwrap());
        let value = objective.value(&xy).unwrap();
        let shifted: Vec<[f64; 2]> = xy.iter().rev().map(|p| [p[0] + 0.25, p[1] - 0.125]).collect();
        let other = objective.value(&shifted).unwrap();
        assert!((value - other).abs() < 1e-9 * value.abs().max(1.0), "{}: {value} {other}", kind.name);
        assert!(value.is_finite() && value > 0.0 || kind.name == "redundancy", "{}: {value}", kind.name);
    }
}

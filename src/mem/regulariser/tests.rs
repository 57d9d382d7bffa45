//! Tests that all penalties share.

use super::*;
use ndarray::{ArcArray2, Array2};

const FORMS: [Entropy; 3] = [Entropy::Relative, Entropy::GullSkilling, Entropy::Log];

/// Every penalty, with its name and whether its second derivative is exact. That of total variation is a bound.
fn all(prior: &ArcArray2<f32>) -> Vec<(String, bool, Box<dyn Regulariser>)> {
    let variation = |softening: f64| -> Box<dyn Regulariser> { Box::new(TotalVariation::new(softening).unwrap()) };
    let mut all: Vec<(String, bool, Box<dyn Regulariser>)> =
        vec![("total variation".into(), false, variation(0.3)), ("l1".into(), true, Box::new(L1))];
    let parts: Vec<(f64, Box<dyn Regulariser>)> =
        vec![(1.0, Box::new(Entropy::Relative.of(prior.clone()))), (0.4, variation(0.2)), (2.0, Box::new(L1))];
    all.push(("sum".into(), false, Box::new(WeightedSum(parts))));
    for form in FORMS {
        all.push((format!("{form:?}"), true, Box::new(form.of(prior.clone()))));
    }
    all
}

fn at(r: &dyn Regulariser, image: &Array2<f64>) -> (f64, Array2<f64>, Array2<f64>) {
    let (mut g, mut c) = (Array2::zeros(image.dim()), Array2::zeros(image.dim()));
    let value = r.add(image, 1.0, &mut g, &mut c);
    (value, g.mapv(f64::from), c.mapv(f64::from))
}

#[test]
fn gradients_and_stiffnesses_agree_with_finite_differences() {
    let prior = ArcArray2::from_shape_fn((4, 5), |(i, j)| 1.0 + 0.1 * (i * 3 + j) as f32);
    let image = Array2::from_shape_fn((4, 5), |(i, j)| 0.5 + ((i * 5 + j * 7) % 6) as f64 * 0.4);
    for (name, exact, r) in all(&prior) {
        let (value, gradient, stiffness) = at(&*r, &image);
        for ((i, j), v) in image.indexed_iter() {
            let h = 1e-4 * v;
            let moved = |x: f64| {
                let mut m = image.clone();
                m[(i, j)] += x;
                at(&*r, &m)
            };
            let slope = (8.0 * (moved(h).0 - moved(-h).0) - (moved(2.0 * h).0 - moved(-2.0 * h).0)) / (12.0 * h);
            let g = gradient[(i, j)];
            assert!((slope - g).abs() < 1e-7 * (1.0 + g.abs()), "{name} at {i} {j}: {slope} {g}");
            let far = 1e-3 * v;
            let bend = v * (moved(far).0 - 2.0 * value + moved(-far).0) / (far * far);
            let c = stiffness[(i, j)];
            assert!(c >= bend - 1e-5 && (!exact || (bend - c).abs() < 1e-5 * (1.0 + c)), "{name} at {i} {j}: {bend} {c}");
        }
    }
}

#[test]
fn entropies_are_best_at_their_prior_and_know_black_pixels() {
    let prior = ArcArray2::from_shape_fn((3, 4), |(i, j)| 1.0 + (i + j) as f32);
    let image = prior.mapv(f64::from);
    for form in FORMS {
        let (r, name) = (form.of(prior.clone()), format!("{form:?}"));
        let (best, gradient, _) = at(&r, &image);
        assert!(gradient.iter().all(|g| g.abs() < 1e-12), "{name}");
        for factor in [0.5, 1.5] {
            assert!(at(&r, &(&image * factor)).0 > best, "{name}");
        }
        let (value, gradient, stiffness) = at(&r, &Array2::zeros((3, 4)));
        assert!(value.is_finite() && gradient.iter().chain(&stiffness).all(|x| !x.is_nan()), "{name}");
    }
    assert_eq!(at(&Entropy::GullSkilling.of(prior), &image).0, 0.0);
}

#[test]
fn bad_priors_and_softenings_are_refused() {
    for v in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        let mut prior = ArcArray2::ones((2, 3));
        prior[(1, 2)] = v;
        let text = check_prior(&prior, None).unwrap_err().to_string();
        assert!(text.contains("prior") && text.contains("column 2, row 1"), "{text}");
        let mut inside = Array2::from_elem((2, 3), true);
        inside[(1, 2)] = false;
        assert!(check_prior(&prior, Some(&inside)).is_ok());
    }
    assert!(TotalVariation::new(0.0).is_err());
}

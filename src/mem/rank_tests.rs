//! Several processes that share a set make the image of maximum entropy of one process.

use super::statistics::powers_by_length;
use super::*;
use crate::fixtures::{in_processes, positions, snapshot};
use crate::imaging::{ImageSize, Imager, ImagingOptions};
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{Polarization, VisUnit, VisibilitySource};

#[test]
fn the_image_does_not_depend_on_the_number_of_processes() {
    let sources = [(0.012, 0.005, 1.0), (-0.004, 0.009, 0.4)];
    let set = snapshot(&positions(24, 0.5, 0.01, 3), &[94e9, 95e9], &[Polarization::I], &sources, (0.05, VisUnit::Jy));
    // A noise in Jy needs the median of the weights, from two more passes.
    for noise in ["weights", "0.05Jy"] {
        let run = |source: &mut dyn VisibilitySource| {
            let options = MemOptions { noise: Some(noise.parse().unwrap()), ..MemOptions::default() };
            let believed = options.believed_noise(source, &Silent).unwrap();
            let imaging = ImagingOptions { size: Some(ImageSize::square(64)), cell: Some(Angle(1e-3)), ..ImagingOptions::default() };
            let mut imager = Imager::new(source, imaging, &Silent).unwrap();
            let plan = options.plan(&imager, MemInputs::default(), believed).unwrap();
            mem(&mut imager, &plan, &Silent).unwrap().model.data
        };
        let one = in_processes(1, &set, run).remove(0);
        let top = one.iter().fold(0.0_f64, |t, v| t.max(*v));
        for size in [2, 3] {
            for other in in_processes(size, &set, run) {
                let difference = one.iter().zip(&other).fold(0.0_f64, |d, (a, b)| d.max((a - b).abs())) / top;
                assert!(difference < 1e-6, "{noise}, {size} processes: {difference:e}");
            }
        }
    }
}

#[test]
fn the_hands_of_all_processes_tell_the_noise() {
    let hands = [Polarization::XX, Polarization::YY];
    let set = snapshot(&positions(12, 0.5, 0.01, 3), &[94e9, 95e9], &hands, &[(0.0, 0.0, 1.0)], (0.2, VisUnit::Jy));
    let run = |source: &mut dyn VisibilitySource| noise_from_hands(source).unwrap();
    let one = in_processes(1, &set, run)[0];
    for other in in_processes(4, &set, run) {
        assert_eq!(one.weights_are_counts, other.weights_are_counts);
        assert!((one.factor.unwrap() / other.factor.unwrap() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn powers_are_those_of_the_visibilities_of_all_processes() {
    let set = snapshot(&positions(24, 0.5, 0.01, 3), &[94e9, 95e9], &[Polarization::I], &[(0.012, 0.005, 1.0)], (0.05, VisUnit::Jy));
    let run = |source: &mut dyn VisibilitySource| {
        let imaging = ImagingOptions { size: Some(ImageSize::square(64)), cell: Some(Angle(1e-3)), ..ImagingOptions::default() };
        let mut imager = Imager::new(source, imaging, &Silent).unwrap();
        powers_by_length((&mut imager, 0), 1.0, |u, v| u.hypot(v), &Silent).unwrap()
    };
    let one = in_processes(1, &set, run).remove(0);
    let counted: f64 = one.iter().map(|bin| bin.count).sum();
    assert_eq!(counted, 2.0 * 276.0);
    for size in [2, 5] {
        for other in in_processes(size, &set, run) {
            assert_eq!(one.len(), other.len());
            for (a, b) in one.iter().zip(&other) {
                assert_eq!(a.count, b.count);
                for (a, b) in [(a.length, b.length), (a.power, b.power), (a.noise, b.noise), (a.known, b.known)] {
                    assert!((a - b).abs() <= 1e-12 * a.abs(), "{size} processes: {a} and {b}");
                }
            }
        }
    }
}

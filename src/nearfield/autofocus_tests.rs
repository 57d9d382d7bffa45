//! The range from the data alone.

use super::*;
use crate::fixtures::{Noise, positions};
use crate::progress::Silent;
use crate::simulate::{SimulateOptions, SkyModel, simulate_set};
use cittert_arrays::{
    Antenna, ArrayLayout, CoveragePlan, LayoutFrame, PhaseCenter, SkyFrame, Source, SpectralWindow, Track, VisUnit, VisibilitySet,
};
use num_complex::Complex;

/// A dozen points on a plane, seen by 20 elements of an aperture of 0.6 m at 94 GHz; without a range in the far field.
fn set(range: Option<&str>, sigma: f64) -> VisibilitySet {
    let antennas = positions(20, 0.3, 0.0, 4).iter().enumerate().map(|(k, p)| Antenna::new(format!("a{k}"), k as u32, *p)).collect();
    let layout = ArrayLayout::new("test", LayoutFrame::Boresight, antennas).unwrap();
    let center = PhaseCenter::unprojected("boresight");
    let rows = CoveragePlan::track(&layout, &center, &Track::new(2_460_000.5, 1.0, 1.0)).unwrap().coverage().unwrap();
    let mut noise = Noise(11);
    let sources = (0..12).map(|_| Source::point(0.07 * noise.next(), 0.07 * noise.next(), 1.0 + noise.next().abs())).collect();
    let options = SimulateOptions { range: range.map(|r| r.parse().unwrap()), ..SimulateOptions::default() };
    let header = options.header(layout, SpectralWindow::band(94e9, 4e9, 4).unwrap(), center, VisUnit::Jy);
    let mut set = simulate_set(header, &rows, &SkyModel::of_sources(sources), &options, &Silent).unwrap();
    set.data.vis.mapv_inplace(|v| {
        let mut part = || (sigma * (noise.next() + noise.next() + noise.next())) as f32;
        v + Complex::new(part(), part())
    });
    set
}

fn find(set: &mut VisibilitySet) -> Result<FoundRange> {
    let grid = SkyGrid::new(96, 96, 1.8e-3, SkyFrame::Boresight).unwrap();
    find_range(set, &grid, 1.5, MemoryBudget::default(), &Silent)
}

#[test]
fn the_range_of_a_scene_of_points_is_found_within_its_uncertainty() {
    for (text, range, sigma) in [("8m", 8.0, 0.3), ("3m", 3.0, 0.3), ("8m", 8.0, 3.0)] {
        let found = find(&mut set(Some(text), sigma)).unwrap();
        let off = (found.range_m - range).abs();
        assert!(off < 4.0 * found.sigma_m + 1e-3 * range && found.sigma_m < 0.03 * range, "{text}: {} +- {}", found.range_m, found.sigma_m);
    }
}

#[test]
fn data_that_do_not_tell_the_range_are_refused() {
    let say = |set: &mut VisibilitySet| find(set).unwrap_err().to_string();
    assert!(say(&mut set(None, 0.3)).contains("needs no focus"));
    assert!(say(&mut set(Some("8m"), 100.0)).contains("do not tell the range"));
    let mut empty = set(Some("8m"), 0.0);
    empty.data.flags.fill(true);
    assert!(say(&mut empty).contains("no usable visibility"));
}

#[test]
fn the_top_of_a_parabola_is_exact_and_no_valley_has_one() {
    let x = [0.0, 0.5, 1.0, 1.5, 2.0];
    let top = parabola_top(&x, &x.map(|x| 3.0 - 2.0 * (x - 0.8_f64).powi(2))).unwrap();
    assert!((top - 0.8).abs() < 1e-12);
    assert_eq!(parabola_top(&x, &x.map(|x| (x - 0.8_f64).powi(2))), None);
    assert_eq!(parabola_top(&x, &x.map(|x| -(x - 5.0_f64).powi(2))), None);
}

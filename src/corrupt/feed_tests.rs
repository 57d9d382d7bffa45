//! Tests of errors between the two feeds of an antenna.

use super::*;
use crate::progress::Silent;
use crate::simulate::{Method, SimulateOptions, SkyModel, simulate_set};
use cittert_arrays::feeds::{FourProducts, Jones, leakage_matrix, products};
use cittert_arrays::{
    Antenna, ArrayLayout, GainTable, LayoutFrame, PhaseCenter, Polarization, Source, SpectralWindow, UvCoverage, VisUnit, VisibilityBlock,
    VisibilitySet,
};
use ndarray::Array2;
use num_complex::Complex64;

fn set(pols: &[&str]) -> VisibilitySet {
    let antennas = (0..4_u32).map(|k| Antenna::new(format!("A{k}"), k, [f64::from(k * k), f64::from(k), 0.0])).collect();
    let layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap();
    let pairs: Vec<(u32, u32)> = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b))).collect();
    let n = pairs.len();
    let uvw = Array2::from_shape_fn((n, 3), |(r, k)| (r * 3 + k) as f64 * 0.3);
    let (ant1, ant2) = pairs.into_iter().unzip();
    let coverage = UvCoverage::new(uvw, ant1, ant2, vec![2.46e6; n], vec![10.0; n], vec![0; n]).unwrap();
    let pols: Vec<Polarization> = pols.iter().map(|p| p.parse().unwrap()).collect();
    let options = SimulateOptions { method: Method::Dft, pols, ..SimulateOptions::default() };
    let header = options.header(layout, SpectralWindow::band(1e9, 1e6, 2).unwrap(), PhaseCenter::unprojected("b"), VisUnit::Jy);
    let source = Source { polarized_jy: [0.2, -0.1, 0.05], ..Source::point(0.01, 0.02, 1.0) };
    simulate_set(header, &coverage, &SkyModel::of_sources(vec![source]), &options, &Silent).unwrap()
}

fn corrupted(set: &VisibilitySet, errors: Vec<Error>) -> (VisibilitySet, GainTable) {
    let options = CorruptOptions { seed: 3, errors, per_feed: false };
    let empty = VisibilityBlock::zeros(UvCoverage::empty(), 2, 4);
    let mut out = VisibilitySet::new(corrupted_header(&set.header, &options), empty).unwrap();
    let table = corrupt(&mut set.clone(), &mut out, &options, &Silent).unwrap();
    (out, table)
}

fn leakage(rms: f64) -> Error {
    Error::Leakage(LeakageError { rms })
}

fn cross(phase_rad: f64) -> Error {
    Error::CrossPhase(CrossPhase { phase_rad })
}

fn phases() -> Error {
    Error::Phase(PhaseError { rms_rad: 1.0, variation: Variation::Constant })
}

#[test]
fn the_truth_in_the_table_makes_the_corrupted_data() {
    for pols in [["XX", "YY", "XY", "YX"], ["RR", "RL", "LR", "LL"]] {
        let truth = set(&pols);
        let (out, table) = corrupted(&truth, vec![phases(), leakage(0.1), cross(0.7)]);
        let four = FourProducts::of(&truth.header.polarizations).unwrap();
        let d = table.leakages.as_ref().unwrap();
        for row in 0..out.data.n_rows() {
            let ants = [out.data.coverage.ant1[row] as usize, out.data.coverage.ant2[row] as usize];
            let [a, b]: [Jones; 2] = ants.map(|ant| {
                let leak = leakage_matrix([d[[0, ant, 0, 0]], d[[0, ant, 0, 1]]]);
                let g = [table.gains[[0, ant, 0, 0]], table.gains[[0, ant, 0, 1]]];
                [[g[0] * leak[0][0], g[0] * leak[0][1]], [g[1] * leak[1][0], g[1] * leak[1][1]]]
            });
            let expected = products(&a, &four.get(&truth.data.vis, (row, 1)), &b);
            let got = four.get(&out.data.vis, (row, 1));
            for (e, g) in expected.iter().flatten().zip(got.iter().flatten()) {
                assert!((e - g).norm() < 1e-6, "{e} {g}");
            }
        }
        let rms = (d.iter().map(Complex64::norm_sqr).sum::<f64>() / d.len() as f64).sqrt();
        assert!((0.05..0.2).contains(&rms), "{rms}");
        assert!((table.gains[[0, 2, 0, 0]] / table.gains[[0, 2, 0, 1]] - Complex64::cis(0.7)).norm() < 1e-12);
    }
}

// Phases are drawn for both feeds together, as without the other errors.
#[test]
fn other_errors_stay_the_same_for_both_feeds() {
    let truth = set(&["XX", "YY", "XY", "YX"]);
    let (_, alone) = corrupted(&truth, vec![phases()]);
    let (_, with) = corrupted(&truth, vec![phases(), leakage(0.1)]);
    assert_eq!((alone.feeds.len(), with.feeds.len()), (1, 2));
    for feed in 0..2 {
        assert_eq!(alone.gains.index_axis(ndarray::Axis(3), 0), with.gains.index_axis(ndarray::Axis(3), feed));
    }
}

#[test]
fn sets_without_all_products_are_refused() {
    let truth = set(&["RR", "LL"]);
    let options = CorruptOptions { seed: 3, errors: vec![leakage(0.1)], per_feed: false };
    let mut out = VisibilitySet::new(truth.header.clone(), VisibilityBlock::zeros(UvCoverage::empty(), 2, 2)).unwrap();
    let e = corrupt(&mut truth.clone(), &mut out, &options, &Silent).unwrap_err().to_string();
    assert!(e.contains("four products"), "{e}");
}

//! Tests of leakages: recovery within their noise, and what the data cannot tell.

use super::*;
use crate::corrupt::{CorruptOptions, CrossPhase, Error, LeakageError, corrupt, corrupted_header};
use crate::progress::Silent;
use crate::simulate::{Method, SimulateOptions, SkyModel, simulate_set};
use cittert_arrays::astrometry::LocalSky;
use cittert_arrays::feeds::Mount;
use cittert_arrays::{
    Antenna, ArrayLayout, CoveragePlan, GainTable, LayoutFrame, PhaseCenter, Polarization, Sensitivity, Site, Source, SpectralWindow,
    Track, UvCoverage, VisUnit, VisibilityBlock, VisibilitySet,
};
use num_complex::Complex64;

const SITE: Site = Site { latitude_rad: 0.6, longitude_rad: -1.2, altitude_m: 2000.0 };
const START: f64 = 2_460_800.25;

fn layout(n: u32) -> ArrayLayout {
    let at = |k: u32| [f64::from(k * k) * 30.0 - 40.0, f64::from(k * 7 % 5) * 25.0, f64::from(k)];
    let antenna = |k| Antenna { sensitivity: Some(Sensitivity::SefdJy(400.0)), ..Antenna::new(format!("A{k}"), k, at(k)) };
    ArrayLayout::new("t", LayoutFrame::EastNorthUp(SITE), (0..n).map(antenna).collect()).unwrap()
}

fn empty(set: &VisibilitySet) -> VisibilitySet {
    let none = VisibilityBlock::zeros(UvCoverage::empty(), set.header.spectrum.n_chan(), set.header.polarizations.len());
    VisibilitySet::new(set.header.clone(), none).unwrap()
}

/// A track of six hours on a source in the middle, in ten integrations.
fn observed(polarized_jy: [f64; 3], products: &str, mount: Option<Mount>, seed: Option<u64>) -> VisibilitySet {
    let lst = LocalSky::at(START, &SITE).unwrap().lst_rad();
    let center = PhaseCenter::sidereal("c", lst + 0.7, 0.35).unwrap();
    let pols: Vec<Polarization> = products.split(',').map(|p| p.parse().unwrap()).collect();
    let noise = seed.is_some();
    let options = SimulateOptions { method: Method::Dft, pols, mount, noise, seed: seed.unwrap_or(1), ..SimulateOptions::default() };
    let plan = CoveragePlan::track(&layout(6), &center, &Track::new(START, 21_600.0, 2_160.0)).unwrap();
    let header = options.header(layout(6), SpectralWindow::band(1.4e9, 2e6, 1).unwrap(), center, VisUnit::Jy);
    let sky = SkyModel::of_sources(vec![Source { polarized_jy, ..Source::point(0.0, 0.0, 1.0) }]);
    simulate_set(header, &plan.blocks(10_000).next().unwrap().unwrap(), &sky, &options, &Silent).unwrap()
}

/// The set with errors, and the truth.
fn leaking(set: &VisibilitySet, seed: u64, rms: f64, phase_rad: f64) -> (VisibilitySet, GainTable) {
    let errors = vec![Error::Leakage(LeakageError { rms }), Error::CrossPhase(CrossPhase { phase_rad })];
    let options = CorruptOptions { seed, errors, per_feed: false };
    let mut out = empty(set);
    out.header = corrupted_header(&set.header, &options);
    let truth = corrupt(&mut set.clone(), &mut out, &options, &Silent).unwrap();
    (out, truth)
}

const BOTH: [FeedTerm; 2] = [FeedTerm::Leakage, FeedTerm::CrossPhase];
const POLARIZED: [f64; 3] = [0.12, -0.09, 0.02];

fn solved(data: &VisibilitySet, model: &VisibilitySet, terms: &[FeedTerm]) -> LeakageSolution {
    solve_leakages(&mut data.clone(), &mut SetModel(&mut model.clone()), terms, &Silent).unwrap()
}

#[test]
fn leakages_and_the_cross_phase_come_back_within_their_noise() {
    for products in ["XX,YY,XY,YX", "RR,RL,LR,LL"] {
        let model = observed(POLARIZED, products, Some(Mount::AltAz), None);
        let (mut sum, mut n) = (0.0, 0.0);
        for seed in 0..20 {
            let (data, truth) = leaking(&observed(POLARIZED, products, Some(Mount::AltAz), Some(seed + 1)), seed, 0.05, 0.8);
            let found = solved(&data, &model, &BOTH);
            assert!(found.undetermined.is_empty(), "{:?}", found.undetermined);
            assert!((found.reduced_chi2 - 1.0).abs() < 0.2, "{}", found.reduced_chi2);
            let d = truth.leakages.unwrap();
            for ant in 0..6 {
                for feed in 0..2 {
                    let off = found.leakages[ant][feed] - d[[0, ant, 0, feed]];
                    let sigma = found.sigma[ant][feed];
                    assert!(sigma[0] > 0.0 && sigma[0] < 0.05, "{sigma:?}");
                    sum += (off.re / sigma[0]).powi(2) + (off.im / sigma[1]).powi(2);
                    n += 2.0;
                }
            }
            sum += ((found.cross_phase_rad - 0.8) / found.cross_sigma_rad).powi(2);
            n += 1.0;
        }
        // 500 pulls, of which those of one set are correlated.
        let rms = f64::sqrt(sum / n);
        println!("{products}: rms pull {rms:.3} of {n}");
        assert!((0.9..1.1).contains(&rms), "{products}: {rms}");
    }
}

#[test]
fn without_noise_they_come_back_exactly_and_calibrate_the_data() {
    for products in ["XX,YY,XY,YX", "RR,RL,LR,LL"] {
        let model = observed(POLARIZED, products, Some(Mount::AltAz), None);
        let (data, truth) = leaking(&model, 5, 0.1, -2.6);
        let found = solved(&data, &model, &BOTH);
        assert!((found.cross_phase_rad + 2.6).abs() < 1e-5, "{}", found.cross_phase_rad);
        let feeds = if products.starts_with('X') { "X+Y" } else { "R+L" };
        let unity = GainTable::unity(truth.layout.clone(), truth.spectrum.clone(), vec![feeds.into()], vec![START], vec![1e5]);
        let table = found.put_into(&unity.unwrap()).unwrap();
        let largest = table
            .leakages
            .as_ref()
            .unwrap()
            .indexed_iter()
            .map(|((_, a, c, f), d)| (d - truth.leakages.as_ref().unwrap()[[0, a, c, f]]).norm());
        assert!(largest.fold(0.0, f64::max) < 1e-5);
        let options = ApplyOptions { anywhere: true, ..ApplyOptions::default() };
        let mut out = empty(&data);
        apply(&mut data.clone(), &table, options, &mut out, &Silent).unwrap();
        let off = out.data.vis.iter().zip(&model.data.vis).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{off}");
        // The other way round they make the data leak again.
        let mut again = empty(&data);
        apply(&mut out, &table, ApplyOptions { direction: Direction::Corrupt, ..options }, &mut again, &Silent).unwrap();
        let off = again.data.vis.iter().zip(&data.data.vis).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
        assert!(off < 1e-5, "{off}");
    }
}

#[test]
fn what_the_source_does_not_tell_is_left_out_and_said() {
    // An unpolarised source: the sum of the leakages, and the phase.
    let model = observed([0.0; 3], "RR,RL,LR,LL", Some(Mount::AltAz), None);
    let (data, truth) = leaking(&model, 5, 0.03, 0.0);
    let found = solved(&data, &model, &BOTH);
    let said = found.undetermined.join("; ");
    assert!(said.contains("a sum of the leakages") && (said.contains("unpolarised") || said.contains("phase")), "{said}");
    // Differences of leakages come back all the same.
    let d = truth.leakages.unwrap();
    let found = solved(&data, &model, &[FeedTerm::Leakage]);
    let shift = (0..6).map(|a| d[[0, a, 0, 0]] - found.leakages[a][0]).sum::<Complex64>() / 6.0;
    for ant in 0..6 {
        assert!((found.leakages[ant][0] + shift - d[[0, ant, 0, 0]]).norm() < 2e-4);
        assert!((found.leakages[ant][1] - shift.conj() - d[[0, ant, 0, 1]]).norm() < 2e-4);
    }
    let free: Complex64 = (0..6).map(|a| found.leakages[a][0] - found.leakages[a][1].conj()).sum();
    // The direction that is left out is known to the rounding of the data.
    assert!(free.norm() < 1e-6, "{free}");
    // A polarised source and feeds that keep their angle: the phase is told together with leakages only.
    let model = observed(POLARIZED, "RR,RL,LR,LL", None, None);
    let (data, _) = leaking(&model, 5, 0.03, 0.0);
    let said = solved(&data, &model, &BOTH).undetermined.join("; ");
    assert!(said.contains("do not tell them apart"), "{said}");
}

#[test]
fn sets_of_two_products_are_refused() {
    let two = observed(POLARIZED, "RR,LL", Some(Mount::AltAz), None);
    let e = solve_leakages(&mut two.clone(), &mut SetModel(&mut two.clone()), &BOTH, &Silent).unwrap_err().to_string();
    assert!(e.contains("four products"), "{e}");
}

//! Sets that are cut in any way and joined again are the same to the last bit.

use super::JoinedSource;
use crate::{FormatError, Result};
use cittert_arrays::pattern::Gaussian;
use cittert_arrays::*;
use ndarray::{Array2, Array3, Axis};
use num_complex::Complex;
use proptest::prelude::*;
use std::path::PathBuf;

/// Order of the rows of a set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RowOrder {
    /// Time, then first and second antenna.
    Sorted,
    /// Time, then second and first antenna.
    SortedBySecond,
    /// First and second antenna, then time.
    Baselines,
    /// Time, then baselines in any order.
    AnyBaselines,
}

#[derive(Debug, Clone)]
pub(super) struct Plan {
    order: RowOrder,
    /// Numbers of antennas, times and channels.
    sizes: (usize, usize, usize),
    products: Vec<Polarization>,
    down: bool,
    seed: u64,
    /// Numbers of parts in time, channels, products and baselines.
    pub(super) cuts: [usize; 4],
}

fn noise(seed: u64, k: usize) -> f32 {
    let mut x = seed.wrapping_add(1 + k as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((x >> 40) as f32) / 1e6
}

fn layout(n: usize) -> ArrayLayout {
    let place = |k: usize| [30.0 * k as f64, (7 * k * k % 23) as f64, 0.0];
    ArrayLayout::new("T", LayoutFrame::Boresight, (0..n).map(|k| Antenna::new(format!("A{k}"), k as u32 + 1, place(k))).collect()).unwrap()
}

pub(super) fn set(plan: &Plan) -> VisibilitySet {
    let (n_ant, n_times, n_chan) = plan.sizes;
    let layout = layout(n_ant);
    let mut pairs: Vec<(usize, usize)> = (0..n_ant).flat_map(|a| (a + 1..n_ant).map(move |b| (a, b))).collect();
    match plan.order {
        RowOrder::SortedBySecond => pairs.sort_by_key(|p| (p.1, p.0)),
        RowOrder::AnyBaselines => pairs.sort_by_key(|p| noise(plan.seed, 1000 + p.0 * 50 + p.1).to_bits()),
        _ => {}
    }
    let mut rows: Vec<(usize, (usize, usize))> = (0..n_times).flat_map(|t| pairs.iter().map(move |p| (t, *p))).collect();
    if plan.order == RowOrder::Baselines {
        rows.sort_by_key(|(t, p)| (*p, *t));
    }
    let time = |t: usize| 2_460_000.5 + t as f64 * 10.0 / 86_400.0;
    let at = |a: usize| layout.antennas()[a].position_m;
    let n = rows.len();
    let coverage = UvCoverage::new(
        Array2::from_shape_fn((n, 3), |(r, k)| at(rows[r].1.1)[k] - at(rows[r].1.0)[k]),
        rows.iter().map(|r| r.1.0 as u32).collect(),
        rows.iter().map(|r| r.1.1 as u32).collect(),
        rows.iter().map(|r| time(r.0)).collect(),
        vec![10.0; n],
        vec![0; n],
    )
    .unwrap();
    let mut freq: Vec<f64> = (0..n_chan).map(|c| 1e9 + 1e6 * c as f64).collect();
    if plan.down {
        freq.reverse();
    }
    let shape = (n, n_chan, plan.products.len());
    let at = |(r, c, p): (usize, usize, usize)| (r * n_chan + c) * 4 + p;
    let data = VisibilityBlock::new(
        coverage,
        Array3::from_shape_fn(shape, |i| Complex::new(noise(plan.seed, 2 * at(i)), noise(plan.seed, 2 * at(i) + 1))),
        Array3::from_shape_fn(shape, |i| noise(plan.seed + 1, at(i))),
        Array3::from_shape_fn(shape, |i| at(i) % 7 == 0),
        Array3::from_shape_fn(shape, |i| (at(i) % 3) as f32),
    )
    .unwrap();
    let header = VisibilityHeader {
        spectrum: SpectralWindow::new(freq, vec![1e6; n_chan]).unwrap(),
        polarizations: plan.products.clone(),
        phase_centers: vec![PhaseCenter::unprojected("boresight")],
        unit: VisUnit::KelvinSr,
        telescope: "T".into(),
        instrument: "T".into(),
        pedestal_k: Some(250.0),
        scene_pedestal_k: None,
        scene_width_rad: None,
        antenna_temperature_k: None,
        near_field: Default::default(),
        annotations: Annotations::default(),
        history: vec!["made".into()],
        layout,
    };
    VisibilitySet::new(header, data).unwrap()
}

/// A part of a set.
fn part(set: &VisibilitySet, rows: &[usize], channels: &[usize], products: &[usize]) -> VisibilitySet {
    let mut header = set.header.clone();
    let s = &set.header.spectrum;
    header.spectrum =
        SpectralWindow::new(channels.iter().map(|c| s.freq_hz()[*c]).collect(), channels.iter().map(|c| s.width_hz()[*c]).collect())
            .unwrap();
    header.polarizations = products.iter().map(|p| set.header.polarizations[*p]).collect();
    fn cut<T: Clone>(a: &Array3<T>, rows: &[usize], channels: &[usize], products: &[usize]) -> Array3<T> {
        a.select(Axis(0), rows).select(Axis(1), channels).select(Axis(2), products)
    }
    let d = &set.data;
    let data = VisibilityBlock::new(
        d.coverage.select(rows).unwrap(),
        cut(&d.vis, rows, channels, products),
        cut(&d.weights, rows, channels, products),
        cut(&d.flags, rows, channels, products),
        cut(&d.nsamples, rows, channels, products),
    );
    VisibilitySet::new(header, data.unwrap()).unwrap()
}

/// Groups of the numbers below `n`: runs for an axis that keeps together, otherwise scattered.
fn groups(n: usize, parts: usize, scattered: bool, seed: u64) -> Vec<Vec<usize>> {
    let parts = parts.clamp(1, n);
    let mut out = vec![Vec::new(); parts];
    for k in 0..n {
        let g = if scattered && k >= parts { noise(seed, 77 + k).to_bits() as usize % parts } else { k * parts / n };
        out[if scattered && k < parts { k } else { g }].push(k);
    }
    out
}

/// The parts of a set, cut by time, channel, product and baseline, in any order.
pub(super) fn parts(plan: &Plan, set: &VisibilitySet) -> Vec<VisibilitySet> {
    let c = &set.data.coverage;
    let (n_ant, n_times, n_chan) = plan.sizes;
    let time = |r: usize| ((c.time_jd[r] - 2_460_000.5) * 8640.0).round() as usize;
    let pair = |r: usize| c.ant1[r] as usize * n_ant + c.ant2[r] as usize;
    let mut out = Vec::new();
    let [by_time, by_chan, by_product, by_baseline] = plan.cuts;
    let by_baseline = if plan.order == RowOrder::AnyBaselines { 1 } else { by_baseline };
    let (times, baselines) = (groups(n_times, by_time, true, plan.seed), groups(n_ant * n_ant, by_baseline, true, plan.seed + 5));
    for (t, b) in times.iter().flat_map(|t| baselines.iter().map(move |b| (t, b))) {
        let rows: Vec<usize> = (0..c.n_rows()).filter(|r| t.contains(&time(*r)) && b.contains(&pair(*r))).collect();
        if rows.is_empty() {
            continue;
        }
        for channels in groups(n_chan, by_chan, true, plan.seed + 2) {
            for products in groups(set.header.polarizations.len(), by_product, false, plan.seed) {
                out.push(part(set, &rows, &channels, &products));
            }
        }
    }
    // The order of names is none of those of the set.
    out.sort_by_key(|p| noise(plan.seed, p.data.n_rows() * 100 + p.header.spectrum.n_chan()).to_bits());
    out
}

fn joined(parts: Vec<VisibilitySet>) -> Result<JoinedSource> {
    let names = (0..parts.len()).map(|k| PathBuf::from(format!("part{k:04}.uvh5"))).collect();
    JoinedSource::of(names, Box::new(move |k| Ok(Box::new(parts[k].clone()))), &Alone)
}

fn error(parts: Vec<VisibilitySet>) -> String {
    joined(parts).err().map(|e| e.to_string()).unwrap_or_default()
}

pub(super) fn plan() -> Plan {
    let products = vec![Polarization::XX, Polarization::YY, Polarization::XY, Polarization::YX];
    Plan { order: RowOrder::Sorted, sizes: (4, 4, 4), products, down: false, seed: 3, cuts: [1; 4] }
}

pub(super) fn plans() -> impl Strategy<Value = Plan> {
    let orders = [RowOrder::Sorted, RowOrder::SortedBySecond, RowOrder::Baselines, RowOrder::AnyBaselines];
    let all = [Polarization::XX, Polarization::YY, Polarization::XY, Polarization::YX];
    ((0..4_usize), (3..6_usize, 2..6_usize, 1..6_usize), (1..5_usize, any::<bool>(), any::<u64>()), prop::array::uniform4(1..4_usize))
        .prop_map(move |(order, sizes, (n, down, seed), cuts)| Plan {
            order: orders[order],
            sizes,
            products: all[..n].to_vec(),
            down,
            seed: seed % 1_000_000,
            cuts,
        })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_set_that_was_cut_and_joined_is_the_same(plan in plans(), step in 1..30_usize) {
        let whole = set(&plan);
        let mut back = joined(parts(&plan, &whole)).unwrap();
        // One time or one baseline in a file tells nothing of the order of the whole.
        let rows = plan.order == RowOrder::Sorted || plan.cuts[0] == 1 && plan.cuts[3] == 1
            || plan.order == RowOrder::AnyBaselines;
        // Nor does one channel in a file tell that they go down.
        let known = rows && (!plan.down || plan.cuts[1] == 1 || plan.cuts[1] < plan.sizes.2);
        prop_assert_eq!(back.n_rows(), whole.data.n_rows());
        if known {
            prop_assert_eq!(back.header().spectrum.clone(), whole.header.spectrum.clone());
            prop_assert_eq!(&back.header().polarizations, &whole.header.polarizations);
            prop_assert_eq!(back.read_rows(0..whole.data.n_rows()).unwrap(), whole.data.clone());
            // In blocks, forwards and backwards.
            let mut starts: Vec<usize> = (0..whole.data.n_rows()).step_by(step).collect();
            starts.extend(starts.clone().into_iter().rev());
            for start in starts {
                let range = start..(start + step).min(whole.data.n_rows());
                prop_assert_eq!(back.read_coverage(range.clone()).unwrap(), whole.data.coverage.rows(range.clone()).unwrap());
                prop_assert_eq!(back.read_rows(range.clone()).unwrap(), whole.data.rows(range).unwrap());
            }
        }
        prop_assert!(back.notes().iter().all(|n| !n.contains("in no file")), "{:?}", back.notes());
        // All data are there, whatever the order.
        let sum = |b: &VisibilityBlock| b.vis.iter().map(|v| f64::from(v.re)).sum::<f64>();
        let read = back.read_rows(0..whole.data.n_rows()).unwrap();
        prop_assert!((sum(&read) - sum(&whole.data)).abs() < 1e-6 * sum(&whole.data));
    }
}

#[test]
fn every_order_of_rows_survives_cuts_in_time_and_channels() {
    for order in [RowOrder::SortedBySecond, RowOrder::Baselines, RowOrder::AnyBaselines] {
        for cuts in [[2, 1, 1, 1], [1, 2, 1, 1], [1, 3, 4, 1], [2, 2, 2, 1]] {
            let plan = Plan { order, cuts, ..plan() };
            let whole = set(&plan);
            let back = joined(parts(&plan, &whole)).unwrap().read_rows(0..whole.data.n_rows()).unwrap();
            assert_eq!(back, whole.data, "{plan:?}");
        }
    }
}

#[test]
fn products_in_the_order_of_casa_keep_it() {
    use Polarization::{XX, XY, YX, YY};
    let plan = Plan { products: vec![XX, XY, YX, YY], cuts: [1, 1, 2, 1], ..plan() };
    let whole = set(&plan);
    assert_eq!(joined(parts(&plan, &whole)).unwrap().header().polarizations, [XX, XY, YX, YY]);
    // Single products have the order in which their files follow one another, or else that of AIPS.
    let plan = Plan { cuts: [1, 1, 4, 1], ..plan };
    let mut parts = parts(&plan, &whole);
    assert_eq!(joined(parts.clone()).unwrap().header().polarizations, [XX, XY, YX, YY]);
    parts.reverse();
    assert_eq!(joined(parts).unwrap().header().polarizations, [XX, YY, XY, YX]);
}

#[test]
fn data_that_no_file_holds_are_flagged_and_told() {
    let plan = Plan { cuts: [2, 2, 1, 1], ..plan() };
    let whole = set(&plan);
    let mut parts = parts(&plan, &whole);
    let lost = parts.remove(1);
    let mut back = joined(parts).unwrap();
    let note = back.notes().join("\n");
    let share = 100.0 * lost.data.vis.len() as f64 / whole.data.vis.len() as f64;
    assert!(note.contains(&format!("{share:.3} % of the joined set is in no file")), "{note}");
    let read = back.read_rows(0..whole.data.n_rows()).unwrap();
    let empty = read.nsamples.iter().zip(&read.flags).zip(&read.weights).filter(|((n, f), w)| **n == 0.0 && **f && **w == 0.0).count();
    assert!(empty >= lost.data.vis.len());
    let good = |b: &VisibilityBlock| b.flags.iter().filter(|f| !**f).count();
    assert_eq!(good(&read), good(&whole.data) - good(&lost.data));
}

#[test]
fn gaps_in_time_and_in_the_band_are_told() {
    let whole = set(&plan());
    let of_time = |t: usize| (6 * t..6 * (t + 1)).collect::<Vec<_>>();
    let pol = [0, 1, 2, 3];
    let back = joined(vec![part(&whole, &of_time(0), &[0], &pol), part(&whole, &of_time(3), &[0], &pol)]).unwrap();
    assert_eq!(back.notes().len(), 1);
    assert!(back.notes()[0].contains("1 gaps in time between files, the longest of 30s"), "{:?}", back.notes());
    let all: Vec<usize> = (0..24).collect();
    let back = joined(vec![part(&whole, &all, &[0], &pol), part(&whole, &all, &[3], &pol)]).unwrap();
    assert!(back.notes()[0].contains("the band has 1 gaps between files, together 2MHz"), "{:?}", back.notes());
    let back = joined(vec![part(&whole, &all, &[0, 1], &pol), part(&whole, &all, &[2, 3], &pol)]).unwrap();
    assert!(back.notes().is_empty(), "{:?}", back.notes());
}

#[test]
fn data_in_two_files_are_refused_by_both_names() {
    let whole = set(&plan());
    let all: Vec<usize> = (0..24).collect();
    let (a, b) = (part(&whole, &all[..14], &[0, 1], &[0]), part(&whole, &all[12..], &[1, 2], &[0, 1]));
    let e = error(vec![a, b]);
    for word in ["part0000.uvh5 and part0001.uvh5", "A0-A1", "2023-02-25T00:00:20", "1.001GHz", "XX", "leave one of them out"] {
        assert!(e.contains(word), "{word}: {e}");
    }
    let e = error(vec![whole.clone(), part(&whole, &all, &[0], &[0]), whole.clone()]);
    assert!(e.contains("part0000.uvh5 and part000"), "{e}");
}

#[test]
fn headers_that_do_not_agree_are_named_with_what_differs() {
    let whole = set(&plan());
    let (a, b) = (part(&whole, &[0, 1, 2], &[0], &[0]), part(&whole, &[3, 4, 5], &[0], &[0]));
    type Change = fn(&mut VisibilityHeader);
    let changes: [(&str, Change); 10] = [
        ("the unit is K str in the first and Jy", |h| h.unit = VisUnit::Jy),
        ("the pedestal that was removed is 250 K in the first and none", |h| h.pedestal_k = None),
        ("the pattern of the elements is", |h| {
            h.layout.pattern = ElementPattern::Gaussian(Gaussian { fwhm_rad: 0.1, ref_freq_hz: None });
        }),
        ("the telescope is T in the first and U", |h| h.telescope = "U".into()),
        ("the phase centre is boresight (not phased to the sky) in the first and F (RA", |h| {
            h.phase_centers = vec![PhaseCenter::sidereal("F", 1.0, 0.5).unwrap()];
        }),
        ("the position of the antenna \"A2\" is", |h| {
            let mut antennas = h.layout.antennas().to_vec();
            antennas[2].position_m[1] += 0.01;
            h.layout = ArrayLayout::new("T", LayoutFrame::Boresight, antennas).unwrap();
        }),
        ("the antenna \"A3\" is in the first alone", |h| {
            h.layout = ArrayLayout::new("T", LayoutFrame::Boresight, h.layout.antennas()[..3].to_vec()).unwrap();
        }),
        ("the antenna \"A4\" is in the second alone", |h| h.layout = layout(5)),
        ("the frame of the array is boresight in the first and at", |h| {
            let site = Site { latitude_rad: 0.5, longitude_rad: 0.1, altitude_m: 3.0 };
            h.layout = ArrayLayout::new("T", LayoutFrame::EastNorthUp(site), h.layout.antennas().to_vec()).unwrap();
        }),
        ("Hz is 1000000 Hz wide in the first and 2000000", |h| {
            h.spectrum = SpectralWindow::new(h.spectrum.freq_hz().to_vec(), vec![2e6]).unwrap();
        }),
    ];
    for (says, change) in changes {
        let mut b = b.clone();
        change(&mut b.header);
        let e = error(vec![a.clone(), b]);
        assert!(e.contains("part0000.uvh5 and part0001.uvh5") && e.contains(says), "{says}: {e}");
    }
    let mut first = a.clone();
    let mut second = b.clone();
    (first.header.annotations.x_orientation, second.header.annotations.x_orientation) =
        (Some(XOrientation::East), Some(XOrientation::North));
    assert!(error(vec![first, second]).contains("the direction of the X feeds is East in the first and North"));
    assert!(joined(vec![a, b]).is_ok());
}

#[test]
fn what_one_file_leaves_out_is_taken_from_another() {
    let whole = set(&plan());
    let (mut a, mut b) = (part(&whole, &[0, 1, 2], &[0], &[0]), part(&whole, &[3, 4, 5], &[0], &[0]));
    b.header.scene_width_rad = Some(0.2);
    a.header.annotations.keywords = [("OBSERVER".into(), Keyword::Text("me".into())), ("DAY".into(), Keyword::Integer(1))].into();
    b.header.annotations.keywords = [("PROJECT".into(), Keyword::Text("p".into())), ("DAY".into(), Keyword::Integer(2))].into();
    b.header.annotations.mounts = vec!["fixed".into(); 4];
    b.header.history.push("cut".into());
    // The antennas of the second file are in another order.
    let mut antennas = b.header.layout.antennas().to_vec();
    antennas.reverse();
    antennas[0].diameter_m = Some(12.0);
    b.header.layout = ArrayLayout::new("T", LayoutFrame::Boresight, antennas).unwrap();
    for ants in [&mut b.data.coverage.ant1, &mut b.data.coverage.ant2] {
        ants.iter_mut().for_each(|a| *a = 3 - *a);
    }
    let mut c = joined(vec![a, b]).unwrap();
    let h = c.header().clone();
    assert_eq!((h.scene_width_rad, h.layout.antennas()[3].diameter_m), (Some(0.2), Some(12.0)));
    assert_eq!(h.annotations.keywords.keys().collect::<Vec<_>>(), ["OBSERVER", "PROJECT"]);
    assert_eq!((h.annotations.mounts.len(), h.history.len()), (4, 3));
    assert!(c.notes()[0].contains("DAY") && c.notes()[0].contains("part0001.uvh5"), "{:?}", c.notes());
    let rows = c.read_rows(0..6).unwrap();
    assert_eq!(rows.coverage, whole.data.coverage.rows(0..6).unwrap());
}

#[test]
fn a_row_with_other_uvw_in_another_file_is_refused() {
    let whole = set(&plan());
    let rows: Vec<usize> = (0..6).collect();
    let (a, mut b) = (part(&whole, &rows, &[0], &[0]), part(&whole, &rows, &[1], &[0]));
    b.data.coverage.uvw_m[(2, 1)] += 0.1;
    let e = joined(vec![a, b]).unwrap().read_rows(0..6).unwrap_err().to_string();
    assert!(e.contains("part0001.uvh5") && e.contains("A0-A3") && e.contains("0.1000 m"), "{e}");
}

/// More files than a process may have open, with one time each.
#[test]
fn hundreds_of_files_are_one_set() {
    let plan = Plan { sizes: (3, 300, 1), cuts: [300, 1, 1, 1], ..plan() };
    let whole = set(&plan);
    let mut back = joined(parts(&plan, &whole)).unwrap();
    assert_eq!(back.read_rows(0..900).unwrap(), whole.data);
    assert_eq!(back.read_rows(450..451).unwrap(), whole.data.rows(450..451).unwrap());
}

#[test]
fn a_file_that_changed_since_is_refused() {
    let whole = set(&plan());
    let rows: Vec<usize> = (0..6).collect();
    let parts = [part(&whole, &rows, &[0], &[0]), part(&whole, &rows, &[1], &[0])];
    let shorter = part(&whole, &rows[..5], &[1], &[0]);
    let first = JoinedSource::of(vec!["a".into(), "b".into()], Box::new(move |k| Ok(Box::new(parts[k].clone()))), &Alone).unwrap();
    let mut later = first.beside(Box::new(move |_| Ok(Box::new(shorter.clone()))));
    let e = later.read_rows(0..6).unwrap_err().to_string();
    assert!(e.contains("6 rows, as at the beginning") && e.contains("5 rows"), "{e}");
    assert!(matches!(super::refuse_twice(&["/".into(), "/.".into()]), Err(FormatError::Apart { .. })));
}

use super::*;
use crate::{Antenna, LayoutFrame};
use std::f64::consts::FRAC_PI_2;

const GOLDEN: &str = include_str!("../../tests/data/track_uvw.csv");

fn layout(frame: LayoutFrame, positions: &[[f64; 3]]) -> ArrayLayout {
    let antennas = positions.iter().enumerate().map(|(i, p)| Antenna::new(format!("A{i}"), i as u32, *p)).collect();
    ArrayLayout::new("test", frame, antennas).unwrap()
}

fn numbers(line: &str, prefix: &str) -> Option<[f64; 3]> {
    let v: Vec<f64> = line.strip_prefix(prefix)?.split_whitespace().map(|v| v.parse().unwrap()).collect();
    Some([v[0], v[1], v[2]])
}

fn vla() -> (ArrayLayout, PhaseCenter) {
    let site = GOLDEN.lines().find_map(|l| numbers(l, "# site ")).unwrap();
    let positions: Vec<[f64; 3]> = GOLDEN.lines().filter_map(|l| numbers(l, "# ant ")).collect();
    let site = Site { latitude_rad: site[0], longitude_rad: site[1], altitude_m: site[2] };
    (layout(LayoutFrame::EastNorthUp(site), &positions), PhaseCenter::sidereal("c", 5.233_686, 0.710_940).unwrap())
}

#[test]
fn uvw_of_a_vla_track_are_those_of_pyuvdata() {
    let (layout, center) = vla();
    let c = CoveragePlan::track(&layout, &center, &Track::new(2_460_827.75, 6.0 * 3600.0, 3600.0)).unwrap().coverage().unwrap();
    let golden: Vec<&str> = GOLDEN.lines().filter(|l| !l.starts_with('#') && !l.starts_with("time")).collect();
    assert_eq!(c.n_rows(), golden.len());
    for (i, line) in golden.iter().enumerate() {
        let g: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
        assert_eq!((c.time_jd[i], c.ant1[i], c.ant2[i]), (g[0], g[1] as u32, g[2] as u32));
        for k in 0..3 {
            // 30 km times the 0.1 mas to which apparent places agree, and the file's 0.1 um.
            assert!((c.uvw_m[[i, k]] - g[3 + k]).abs() < 2e-5, "row {i}: {} for {}", c.uvw_m[[i, k]], g[3 + k]);
        }
    }
}

#[test]
fn a_boresight_snapshot_is_the_baselines_as_they_stand() {
    let l = layout(LayoutFrame::Boresight, &[[0.0, 0.0, 0.0], [1.0, 2.0, 0.5], [-3.0, 1.0, 0.0]]);
    let c = CoveragePlan::snapshot(&l, 2_460_000.5, 0.01).unwrap().coverage().unwrap();
    assert_eq!((c.ant1, c.ant2), (vec![0, 0, 1], vec![1, 2, 2]));
    assert_eq!(c.uvw_m.row(2).to_vec(), vec![-4.0, -1.0, -0.5]);
    assert_eq!(c.time_jd[0], 2_460_000.5);
}

#[test]
fn baseline_lengths_survive_any_rotation() {
    let (layout, center) = vla();
    let c = CoveragePlan::track(&layout, &center, &Track::new(2_460_827.75, 86_400.0, 7200.0)).unwrap().coverage().unwrap();
    for i in 0..c.n_rows() {
        let (a, b) = (layout.antennas()[c.ant1[i] as usize].position_m, layout.antennas()[c.ant2[i] as usize].position_m);
        let length = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
        assert!((c.uvw_m.row(i).dot(&c.uvw_m.row(i)).sqrt() / length - 1.0).abs() < 1e-12);
    }
}

#[test]
fn blocks_and_ranges_are_runs_of_the_whole() {
    let (layout, center) = vla();
    let mut track = Track::new(2_460_827.75, 86_400.0, 3600.0);
    track.elevation_limit_rad = Some(0.3);
    track.autocorrelations = true;
    let plan = CoveragePlan::track(&layout, &center, &track).unwrap();
    let whole = plan.coverage().unwrap();
    for target in [1, 40, 1000] {
        let mut joined = UvCoverage::empty();
        for block in plan.blocks(target) {
            let block = block.unwrap();
            assert!(block.n_rows() > 0);
            joined.append(&block).unwrap();
        }
        assert_eq!(joined, whole);
    }
    assert_eq!(plan.rows(7..29).unwrap(), whole.rows(7..29).unwrap());
    assert!(plan.rows(0..plan.n_rows() + 1).is_err());
    assert!(plan.times_jd().count() < 24, "the source sets");
}

#[test]
fn antennas_below_their_own_horizon_take_no_part() {
    // Three antennas around the equator: a source at the zenith of the first is on the horizon of the second and below the third's.
    let site = Site { latitude_rad: 0.0, longitude_rad: 0.0, altitude_m: 0.0 };
    let at = |lon: f64| {
        let p = Site { longitude_rad: lon, ..site }.to_ecef_m();
        let c = site.to_ecef_m();
        site.ecef_offset_to_enu([0, 1, 2].map(|k| p[k] - c[k]))
    };
    let l = layout(LayoutFrame::EastNorthUp(site), &[at(0.0), at(0.001), at(FRAC_PI_2 + 0.1)]);
    let jd = 2_460_000.5;
    let sky = LocalSky::at(jd, &site).unwrap();
    let center = PhaseCenter::sidereal("zenith", sky.lst_rad(), 0.0).unwrap();
    let mut track = Track::new(jd, 10.0, 10.0);
    track.elevation_limit_rad = Some(0.1);
    let c = CoveragePlan::track(&l, &center, &track).unwrap().coverage().unwrap();
    assert_eq!((c.ant1, c.ant2), (vec![0], vec![1]));
    let below = PhaseCenter::sidereal("nadir", sky.lst_rad() + std::f64::consts::PI, 0.0).unwrap();
    let e = CoveragePlan::track(&l, &below, &track).unwrap_err().to_string();
    assert!(e.contains("elevation"), "{e}");
}

#[test]
fn a_source_that_never_rises_is_refused_and_one_that_sets_is_counted() {
    let (layout, center) = vla();
    let south = PhaseCenter::sidereal("south", 1.0, -89_f64.to_radians()).unwrap();
    let day = Track::new(2_460_827.75, 86_400.0, 3600.0);
    let e = CoveragePlan::track(&layout, &south, &day).unwrap_err().to_string();
    assert!(e.contains("-89.00 deg") && e.contains("34.08 deg") && e.contains("limit of 0 deg") && e.contains("never rises"), "{e}");
    // 40.7 deg north is below the horizon of the VLA for 7.3 of 24 hours: cos(hour angle) = -tan(34.08 deg) tan(40.73 deg).
    let share = CoveragePlan::track(&layout, &center, &day).unwrap().share_below_horizon();
    assert!((share - 0.302).abs() < 0.05, "{share}");
    let limited = Track { elevation_limit_rad: Some(0.1), ..day };
    assert_eq!(CoveragePlan::track(&layout, &center, &limited).unwrap().share_below_horizon(), 0.0);
}

#[test]
fn a_boresight_layout_cannot_track_the_sky() {
    let l = layout(LayoutFrame::Boresight, &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
    let e = CoveragePlan::track(&l, &vla().1, &Track::new(2_460_000.5, 10.0, 1.0)).unwrap_err().to_string();
    assert!(e.contains("boresight") && e.contains("site"), "{e}");
}

#[test]
fn a_drift_scan_at_the_zenith_is_the_horizon_frame() {
    let (layout, _) = vla();
    let mut center = PhaseCenter::unprojected("z");
    center.kind = PhaseCenterKind::Driftscan { az_rad: 0.3, el_rad: FRAC_PI_2 };
    let c = CoveragePlan::track(&layout, &center, &Track::new(2_460_000.5, 10.0, 10.0)).unwrap().coverage().unwrap();
    let straight = CoveragePlan::snapshot(&layout, 2_460_000.5, 10.0).unwrap().coverage().unwrap();
    assert!(c.uvw_m.iter().zip(&straight.uvw_m).all(|(a, b)| (a - b).abs() < 1e-6));
    center.kind = PhaseCenterKind::Driftscan { az_rad: FRAC_PI_2, el_rad: 0.0 };
    let east = CoveragePlan::track(&layout, &center, &Track::new(2_460_000.5, 10.0, 10.0)).unwrap().coverage().unwrap();
    assert!((0..east.n_rows()).all(|i| (east.uvw_m[[i, 2]] - straight.uvw_m[[i, 0]]).abs() < 1e-6), "w runs along the view");
}

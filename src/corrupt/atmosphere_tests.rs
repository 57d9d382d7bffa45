//! Tests of the air over the array, with air of a known formula.

use super::*;
use crate::Result;
use crate::progress::Silent;
use cittert_arrays::{
    Antenna, ArrayLayout, GainTable, LayoutFrame, PhaseCenter, Polarization, SPEED_OF_LIGHT_M_S, Site, SpectralWindow, UvCoverage, VisUnit,
    VisibilityBlock, VisibilityHeader, VisibilitySet,
};
use ndarray::Array2;
use num_complex::Complex;
use std::sync::Arc;

/// Plane air: 2.3 m of dry path with a scale height of 8 km, and wet path that falls with the frequency, 2 km.
#[derive(Debug)]
struct PlaneAir;

struct PlanePaths(Vec<f64>, Vec<f64>);

fn wet_overhead_m(height_m: f64, freq_hz: f64) -> f64 {
    0.2 * (1.0 - freq_hz / 1e12) * (-height_m / 2e3).exp()
}

fn dry_overhead_m(height_m: f64) -> f64 {
    2.3 * (-height_m / 8e3).exp()
}

impl AirModel for PlaneAir {
    fn paths(&self, heights_m: &[f64], freq_hz: &[f64]) -> Result<Box<dyn AirPaths>> {
        Ok(Box::new(PlanePaths(heights_m.to_vec(), freq_hz.to_vec())))
    }
}

impl AirPaths for PlanePaths {
    fn toward(&self, place: usize, zenith_rad: f64) -> Result<Vec<ExcessPath>> {
        let (height, secant) = (self.0[place], 1.0 / zenith_rad.cos());
        let path = |f: &f64| ExcessPath { wet_m: wet_overhead_m(height, *f) * secant, other_m: dry_overhead_m(height) * secant };
        Ok(self.1.iter().map(path).collect())
    }
}

impl AirSource for PlaneAir {
    fn air(&self, _name: &str) -> Result<Arc<dyn AirModel>> {
        Ok(Arc::new(Self))
    }
}

const TOWARD: [f64; 3] = [0.48, -0.36, 0.8];
const SITE: Site = Site { latitude_rad: 0.6, longitude_rad: 0.0, altitude_m: 500.0 };

/// A set of antennas at the given places, `times` integrations of `step_s`, towards one direction.
fn set(places: &[[f64; 3]], times: usize, step_s: f64, frame: LayoutFrame) -> VisibilitySet {
    let antennas = places.iter().zip(0..).map(|(p, k)| Antenna::new(format!("A{k}"), k, *p)).collect();
    let header = VisibilityHeader {
        layout: ArrayLayout::new("t", frame, antennas).unwrap(),
        spectrum: SpectralWindow::band(9e10, 2e9, 3).unwrap(),
        polarizations: vec![Polarization::RR],
        phase_centers: vec![PhaseCenter::unprojected("b")],
        unit: VisUnit::Jy,
        telescope: "t".into(),
        instrument: "t".into(),
        pedestal_k: None,
        scene_pedestal_k: None,
        scene_width_rad: None,
        antenna_temperature_k: None,
        near_field: Default::default(),
        annotations: Default::default(),
        history: Vec::new(),
    };
    let n = places.len() as u32;
    let pairs: Vec<(u32, u32)> = (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b))).collect();
    let rows: Vec<(usize, (u32, u32))> = (0..times).flat_map(|t| pairs.iter().map(move |p| (t, *p))).collect();
    let apart = |(a, b): (u32, u32), k: usize| places[b as usize][k] - places[a as usize][k];
    let w = |pair: (u32, u32)| (0..3).map(|k| apart(pair, k) * TOWARD[k]).sum();
    let uvw = Array2::from_shape_fn((rows.len(), 3), |(r, k)| if k == 2 { w(rows[r].1) } else { apart(rows[r].1, k) });
    let (ant1, ant2) = rows.iter().map(|r| r.1).unzip();
    let time = rows.iter().map(|r| 2_460_000.5 + r.0 as f64 * step_s / 86_400.0).collect();
    let m = rows.len();
    let coverage = UvCoverage::new(uvw, ant1, ant2, time, vec![step_s; m], vec![0; m]).unwrap();
    let mut data = VisibilityBlock::zeros(coverage, 3, 1);
    data.vis.fill(Complex::new(2.0, 0.0));
    VisibilitySet::new(header, data).unwrap()
}

fn truth(set: &VisibilitySet, error: Atmosphere, seed: u64) -> Result<GainTable> {
    let options = CorruptOptions { seed, errors: vec![Error::Atmosphere(error)], per_feed: false };
    let mut source = set.clone();
    let mut out = VisibilitySet::new(corrupted_header(&set.header, &options), set.data.rows(0..0).unwrap()).unwrap();
    corrupt(&mut source, &mut out, &options, &Silent)
}

fn air() -> Air {
    Air { name: "plane".into(), model: Arc::new(PlaneAir) }
}

pub(super) fn still() -> Atmosphere {
    Atmosphere { air: air(), turbulence: None, radiometer: None }
}

fn turbulence(fraction: f64, wind_m_s: f64) -> Option<Turbulence> {
    Some(Turbulence { fraction, wind: Wind { wind_m_s, ..Wind::default() } })
}

/// Dry and wet path of a place, m. The ground falls by 3 mm at 200 m from the origin, and the vertical leans by 3e-5 rad.
fn excess_m([x, y, z]: [f64; 3], freq_hz: f64) -> f64 {
    let radius = 6_370_950.0 + SITE.altitude_m;
    let height = SITE.altitude_m + z + (x * x + y * y) / (2.0 * radius);
    let secant = 1.0 / (TOWARD[2] + (x * TOWARD[0] + y * TOWARD[1]) / radius);
    (dry_overhead_m(height) + wet_overhead_m(height, freq_hz)) * secant
}

/// Path of a gain, m, where it is within half a wavelength.
fn path_m(table: &GainTable, time: usize, ant: usize, chan: usize) -> f64 {
    table.gains[[time, ant, chan, 0]].arg() * SPEED_OF_LIGHT_M_S / (std::f64::consts::TAU * table.spectrum.freq_hz()[chan])
}

#[test]
fn heights_and_elevations_give_each_antenna_its_path_in_each_channel() {
    let places = [[0.0, 0.0, 0.0], [100.0, 0.0, 1.5], [0.0, 200.0, -2.0], [3.0, 4.0, 0.5]];
    let table = truth(&set(&places, 2, 10.0, LayoutFrame::EastNorthUp(SITE)), still(), 1).unwrap();
    for (ant, place) in places.iter().enumerate() {
        for (chan, f) in table.spectrum.freq_hz().iter().enumerate() {
            let want = excess_m(*place, *f) - excess_m([0.0; 3], *f);
            let got = path_m(&table, 0, ant, chan);
            // The direction comes out of w, to 1e-7 where the array is as flat as this one.
            assert!((got - want).abs() < 1e-3 * want.abs() + 1e-8, "antenna {ant} channel {chan}: {got} {want}");
        }
    }
}

// Over 100 km the ground falls by 785 m from the plane of the layout, and the vertical leans by 0.9 degrees.
#[test]
fn the_earth_is_round_under_a_large_array() {
    let far = [100e3, 0.0, 0.0];
    let (height, vertical) = atmosphere::height_and_vertical(far, 0.0);
    assert!((height - 100e3_f64.powi(2) / (2.0 * 6_370_950.0)).abs() < 0.1, "{height}");
    assert!((atmosphere::zenith_rad(vertical, [0.0, 0.0, 1.0]) - (100e3_f64 / 6_370_950.0).atan()).abs() < 1e-12);
    assert!(atmosphere::zenith_rad([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]) == 0.0);
    let (height, _) = atmosphere::height_and_vertical([3.0, 4.0, 12.0], 5000.0);
    assert!((height - 5012.0 - 25.0 / (2.0 * 6_375_962.0)).abs() < 1e-9);
}

// Kolmogorov with the outer scale: the rms path difference at one outer scale is the stated part of the wet path at the zenith, times sec z,
// and phases have the frequency dependence of the wet path. Antennas at one height, so that turbulence is all there is.
#[test]
fn turbulence_is_the_stated_fraction_of_the_wet_path_in_every_channel() {
    let (scale, fraction) = (10_000.0, 0.002);
    let places = [[0.0; 3], [30.0, 0.0, 0.0], [300.0, 0.0, 0.0], [scale, 0.0, 0.0]].map(|[x, y, _]| {
        // On the sphere, so that all stand at the height of the site.
        [x, y, -x * x / (2.0 * (6_370_950.0 + 500.0))]
    });
    let calm = truth(&set(&places, 1, 10.0, LayoutFrame::EastNorthUp(SITE)), still(), 0).unwrap();
    let mut squares = [[0.0; 3]; 4];
    let screens = 400;
    let one = set(&places, 1, 10.0, LayoutFrame::EastNorthUp(SITE));
    for seed in 0..screens {
        let rough = truth(&one, Atmosphere { turbulence: turbulence(fraction, 10.0), ..still() }, seed).unwrap();
        let x = |ant: usize, chan: usize| {
            let gain = rough.gains[[0, ant, chan, 0]] / calm.gains[[0, ant, chan, 0]];
            gain.arg() * SPEED_OF_LIGHT_M_S / (std::f64::consts::TAU * rough.spectrum.freq_hz()[chan])
        };
        for (ant, squares) in squares.iter_mut().enumerate() {
            for (chan, square) in squares.iter_mut().enumerate() {
                *square += (x(ant, chan) - x(0, chan)).powi(2) / screens as f64;
            }
        }
        let wet = |chan: usize| wet_overhead_m(500.0, rough.spectrum.freq_hz()[chan]);
        assert!((x(1, 0) / x(1, 2) * wet(2) / wet(0) - 1.0).abs() < 1e-6);
    }
    let stated = fraction * wet_overhead_m(500.0, 9e10) / TOWARD[2];
    // A variance of Gaussian numbers from 400 draws is known to sqrt(2/400) = 7 per cent; four times that is allowed.
    let ratio = squares[3][1] / (stated * stated);
    assert!((ratio - 1.0).abs() < 0.28, "{ratio}");
    // Between 30 and 300 m, far below the outer scale, the exponent of von Karman is 1.63 to 1.6, that of Kolmogorov 5/3. Ratios of variances of
    // correlated numbers scatter less than the variances; 0.1 allows for 26 per cent.
    let exponent = (squares[2][1] / squares[1][1]).log10();
    assert!((exponent - 1.62).abs() < 0.1, "{exponent}");
}

#[test]
fn a_radiometer_leaves_its_stated_error() {
    let places = [[0.0; 3], [100.0, 0.0, 40.0], [0.0, 200.0, 0.0], [70.0, 40.0, 0.0]];
    let clean = set(&places, 500, 10.0, LayoutFrame::EastNorthUp(SITE));
    let (rms_m, averaging_s) = (2e-4, 10.0);
    // At 1 THz this air has no wet path.
    let dry = |ant: usize| excess_m(places[ant], 1e12) - excess_m([0.0; 3], 1e12);
    let residual_rms = |averaging_s: f64, turbulence: Option<Turbulence>| {
        let radiometer = Some(Radiometer { rms_m, averaging_s });
        let table = truth(&clean, Atmosphere { turbulence, radiometer, ..still() }, 3).unwrap();
        let wave = SPEED_OF_LIGHT_M_S / table.spectrum.freq_hz()[1];
        let mut sum = 0.0;
        for time in 0..500 {
            for ant in 0..4 {
                // The dry path of the antennas stays, to whole waves.
                let rest = path_m(&table, time, ant, 1) - dry(ant);
                sum += (rest - wave * (rest / wave).round()).powi(2) / 2000.0;
            }
        }
        sum.sqrt()
    };
    // 2000 draws know their rms to 1/sqrt(4000) = 1.6 per cent.
    let ratio = residual_rms(averaging_s, None) / rms_m;
    assert!((ratio - 1.0).abs() < 0.064, "{ratio}");
    // Ten measurements in an integration.
    let ratio = residual_rms(1.0, None) / rms_m * 10.0_f64.sqrt();
    assert!((ratio - 1.0).abs() < 0.064, "{ratio}");
    // A measurement of 0.01 s sees the air stand still; one of 100 s misses what the wind carries by within it.
    let quick = Radiometer { rms_m: 0.0, averaging_s: 0.01 };
    let slow = Radiometer { averaging_s: 100.0, ..quick };
    let left = |radiometer: Radiometer| {
        let table = truth(&clean, Atmosphere { turbulence: turbulence(0.05, 10.0), radiometer: Some(radiometer), ..still() }, 3).unwrap();
        let mean = (0..500).map(|time| path_m(&table, time, 2, 1)).sum::<f64>() / 500.0;
        (0..500).map(|time| (path_m(&table, time, 2, 1) - mean).powi(2) / 500.0).sum::<f64>().sqrt()
    };
    let (quick, slow) = (left(quick), left(slow));
    assert!(quick < 3e-6, "{quick}");
    assert!(slow > 30.0 * quick && slow < 3e-3, "{slow} {quick}");
}

#[test]
fn impossible_air_is_refused_with_one_message() {
    let places = [[0.0; 3], [100.0, 0.0, 0.0]];
    let boresight = truth(&set(&places, 1, 10.0, LayoutFrame::Boresight), still(), 1).unwrap_err().to_string();
    assert!(boresight.starts_with("the atmosphere plane needs an array at a site on the Earth"), "{boresight}");
    let fault = |turbulence: Option<Turbulence>, radiometer: Option<Radiometer>| {
        Atmosphere { turbulence, radiometer, ..still() }.check().unwrap_err().to_string()
    };
    assert!(fault(turbulence(-0.1, 10.0), None).contains("turbulence"));
    assert!(fault(turbulence(1.5, 10.0), None).contains("at most 1"));
    assert!(fault(turbulence(0.1, f64::NAN), None).contains("wind speed"));
    assert!(fault(None, Some(Radiometer { rms_m: -1e-3, averaging_s: 1.0 })).contains("radiometers"));
    assert!(fault(None, Some(Radiometer { rms_m: 1e-3, averaging_s: 0.0 })).contains("averaging time"));
    let options =
        |json: &str| serde_json::from_str::<ErrorOptions>(json).unwrap().errors(VisUnit::Jy, &PlaneAir).map_err(|e| e.to_string());
    assert!(options(r#"{"wvr-rms": "1mm"}"#).unwrap_err().contains("atmosphere is not, which turns this error on"));
    assert!(options(r#"{"turbulence": 0.1}"#).unwrap_err().contains("atmosphere is not, which turns this error on"));
    assert!(options(r#"{"atmosphere": "x", "wvr-averaging": "5s"}"#).unwrap_err().contains("wvr-rms"));
    assert!(options(r#"{"atmosphere": "x", "wind": "5m/s"}"#).unwrap_err().contains("troposphere or turbulence"));
    assert_eq!(options(r#"{"atmosphere": "x", "wind": "5m/s", "turbulence": 0.1}"#).unwrap().len(), 1);
}

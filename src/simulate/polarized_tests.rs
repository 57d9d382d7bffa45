//! Tests of polarised scenes against the fields themselves: monochromatic waves with exp(+i omega t), received by feeds as vectors.

use super::*;
use crate::imaging::PolSelector;
use crate::progress::Silent;
use cittert_arrays::astrometry::LocalSky;
use cittert_arrays::feeds::{Feeds, Mount, sky_angle_rad};
use cittert_arrays::{
    Antenna, ArrayLayout, BrightnessUnit, CoveragePlan, Image, LayoutFrame, PhaseCenter, Polarization, Site, SkyGrid, Source,
    SourcePosition, SpectralWindow, Track, VisUnit, VisibilityHeader, VisibilitySet, XOrientation,
};
use ndarray::Array4;
use num_complex::Complex64;
use std::f64::consts::{FRAC_PI_2, TAU};

const SITE: Site = Site { latitude_rad: 0.6, longitude_rad: -1.2, altitude_m: 2000.0 };
const LINEAR: [Polarization; 4] = [Polarization::XX, Polarization::XY, Polarization::YX, Polarization::YY];
const CIRCULAR: [Polarization; 4] = [Polarization::RR, Polarization::RL, Polarization::LR, Polarization::LL];

fn layout() -> ArrayLayout {
    let at = |k: u32| [f64::from(k * k) * 30.0 - 40.0, f64::from(k * 7 % 5) * 25.0, f64::from(k)];
    let antennas = (0..5).map(|k| Antenna::new(format!("A{k}"), k, at(k))).collect();
    ArrayLayout::new("t", LayoutFrame::EastNorthUp(SITE), antennas).unwrap()
}

/// A track of four hours in five integrations, with a set of the four products.
fn observed(sources: Vec<Source>, products: [Polarization; 4], options: SimulateOptions) -> (VisibilitySet, PhaseCenter) {
    let lst = LocalSky::at(2_460_800.25, &SITE).unwrap().lst_rad();
    let center = PhaseCenter::sidereal("c", lst + 0.3, 0.35).unwrap();
    let options = SimulateOptions { method: Method::Dft, pols: products.to_vec(), ..options };
    let plan = CoveragePlan::track(&layout(), &center, &Track::new(2_460_800.25, 14_400.0, 2_880.0)).unwrap();
    let spectrum = SpectralWindow::band(1.4e9, 2e7, 2).unwrap();
    let header = options.header(layout(), spectrum, center.clone(), VisUnit::Jy);
    let coverage = plan.blocks(10_000).next().unwrap().unwrap();
    (simulate_set(header, &coverage, &SkyModel::of_sources(sources), &options, &Silent).unwrap(), center)
}

/// Unit vectors of a place on the sky: towards it, north and east, with the axes towards the equinox, six hours, and the pole.
fn axes(ra: f64, dec: f64) -> [[f64; 3]; 3] {
    let ((sa, ca), (sd, cd)) = (ra.sin_cos(), dec.sin_cos());
    [[cd * ca, cd * sa, sd], [-sd * ca, -sd * sa, cd], [-sa, ca, 0.0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Waves whose coherency is that of Stokes I, Q, U, V, with XX + YY = 2 I: amplitudes to the north and to the east, by exp(+i omega t). Right circular: the angle of
/// the field grows from north through east.
fn waves([i, q, u, v]: [f64; 4]) -> Vec<[Complex64; 2]> {
    let p = (q * q + u * u + v * v).sqrt();
    let (angle, re) = (0.5 * u.atan2(q), |x: f64| Complex64::new(x, 0.0));
    // Elliptical polarisation of major axis `angle` with the ellipticity of V, and the unpolarised rest as two waves.
    let chi = 0.5 * (v / p).asin();
    let (major, minor) = (re(chi.cos()), Complex64::new(0.0, -chi.sin()));
    let ellipse = [major * angle.cos() - minor * angle.sin(), major * angle.sin() + minor * angle.cos()].map(|e| e * (2.0 * p).sqrt());
    let rest = (i - p).sqrt();
    vec![ellipse, [re(rest), re(0.0)], [re(0.0), re(rest)]]
}

/// Voltage patterns of the feeds as vectors on the sky at a source: the vector at the phase centre carried along the great circle.
fn carried(feed: [f64; 3], from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    let axis = [from[1] * to[2] - from[2] * to[1], from[2] * to[0] - from[0] * to[2], from[0] * to[1] - from[1] * to[0]];
    let (sine, cosine) = (dot(axis, axis).sqrt(), dot(from, to));
    if sine == 0.0 {
        return feed;
    }
    let k = axis.map(|x| x / sine);
    let cross = [k[1] * feed[2] - k[2] * feed[1], k[2] * feed[0] - k[0] * feed[2], k[0] * feed[1] - k[1] * feed[0]];
    let along = dot(k, feed) * (1.0 - cosine);
    [0, 1, 2].map(|n| feed[n] * cosine + cross[n] * sine + k[n] * along)
}

const SOURCES: [([f64; 2], [f64; 4]); 3] =
    [([0.0, 0.0], [1.0, 0.1, -0.3, 0.2]), ([0.02, -0.01], [2.0, -0.4, 0.2, -0.5]), ([-0.03, 0.015], [0.7, 0.3, 0.5, 0.1])];

fn sources(center: [f64; 2]) -> Vec<Source> {
    let of = |([d_ra, d_dec], stokes): ([f64; 2], [f64; 4])| Source {
        position: SourcePosition::RaDec { ra_rad: center[0] + d_ra, dec_rad: center[1] + d_dec },
        polarized_jy: [stokes[1], stokes[2], stokes[3]],
        ..Source::point(0.0, 0.0, stokes[0])
    };
    SOURCES.map(of).to_vec()
}

fn angle(mount: Option<Mount>, center: &PhaseCenter, time: f64) -> f64 {
    mount.map_or(0.0, |m| sky_angle_rad(m, center, time, &SITE).unwrap())
}

#[test]
fn products_are_those_of_the_waves_that_the_feeds_receive() {
    let lst = LocalSky::at(2_460_800.25, &SITE).unwrap().lst_rad();
    let (ra0, dec0) = (lst + 0.3, 0.35);
    for (mount, products, x_feeds) in [
        (None, LINEAR, None),
        (Some(Mount::AltAz), LINEAR, None),
        (Some(Mount::AltAz), LINEAR, Some(XOrientation::East)),
        (Some(Mount::NasmythLeft), CIRCULAR, None),
        (Some(Mount::Fixed), LINEAR, None),
        (None, CIRCULAR, None),
    ] {
        let (set, center) = observed(sources([ra0, dec0]), products, SimulateOptions { mount, x_feeds, ..SimulateOptions::default() });
        let [toward, north, east] = axes(ra0, dec0);
        let c = &set.data.coverage;
        let mut largest: f64 = 0.0;
        for row in 0..c.n_rows() {
            let turn = angle(mount, &center, c.time_jd[row]);
            let at = |a: f64| [0, 1, 2].map(|k| north[k] * a.cos() + east[k] * a.sin());
            let (x, y) = (at(turn), at(turn + FRAC_PI_2));
            let (x, y) = if x_feeds == Some(XOrientation::East) { (y, x) } else { (x, y) };
            for (chan, freq) in set.header.spectrum.freq_hz().iter().enumerate() {
                let mut truth = [[Complex64::ZERO; 2]; 2];
                for ([d_ra, d_dec], stokes) in SOURCES {
                    let [s, n, e] = axes(ra0 + d_ra, dec0 + d_dec);
                    let lmn = [dot(s, east), dot(s, north), dot(s, toward) - 1.0];
                    let path: f64 = (0..3).map(|k| c.uvw_m[[row, k]] * lmn[k]).sum();
                    let (fx, fy) = (carried(x, toward, s), carried(y, toward, s));
                    for wave in waves(stokes) {
                        let seen = |f: [f64; 3]| wave[0] * dot(f, n) + wave[1] * dot(f, e);
                        let (vx, vy) = (seen(fx), seen(fy));
                        let i = Complex64::i();
                        // By exp(+i omega t) right circular feeds add the north to i times the east.
                        let feeds = if products == CIRCULAR { [vx + i * vy, vx - i * vy].map(|v| v / 2f64.sqrt()) } else { [vx, vy] };
                        // Antenna 2 is closer to the source by the path: its wave is ahead.
                        let ahead = Complex64::cis(TAU * path * freq / 299_792_458.0);
                        for (j, k) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                            truth[j][k] += (feeds[j] * (feeds[k] * ahead).conj()).conj();
                        }
                    }
                }
                for (pol, (j, k)) in [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter().enumerate() {
                    let v = set.data.vis[(row, chan, pol)];
                    largest = largest.max((Complex64::new(v.re.into(), v.im.into()) - truth[j][k]).norm());
                }
            }
        }
        // Rounding to single precision of up to 3.7 Jy.
        assert!(largest < 1e-6, "{mount:?} {products:?}: {largest}");
    }
}

#[test]
fn the_feeds_of_an_alt_az_mount_turn_by_the_parallactic_angle_of_the_textbook() {
    // In the year of the frame's equinox, precession does not matter.
    let time = 2_451_545.3;
    let sky = LocalSky::at(time, &SITE).unwrap();
    let center = PhaseCenter::sidereal("c", sky.lst_rad() - 0.7, 0.2).unwrap();
    let (h, p, d) = (0.7_f64, SITE.latitude_rad, 0.2_f64);
    let q = (p.cos() * h.sin()).atan2(p.sin() * d.cos() - p.cos() * d.sin() * h.cos());
    let got = sky_angle_rad(Mount::AltAz, &center, time, &SITE).unwrap();
    // Nutation and aberration are below 2e-4 rad.
    assert!((got - q).abs() < 2e-4, "{got} {q}");
}

#[test]
fn feeds_along_the_horizon_see_the_angle_of_each_source_by_itself() {
    let lst = LocalSky::at(2_460_800.25, &SITE).unwrap().lst_rad();
    let options = SimulateOptions { mount: Some(Mount::AltAz), feed_basis: FeedBasis::Horizon, ..SimulateOptions::default() };
    let (ra, dec) = (lst + 0.3 + 0.04, 0.33);
    let position = SourcePosition::RaDec { ra_rad: ra, dec_rad: dec };
    let source = Source { position, polarized_jy: [0.3, -0.2, 0.1], ..Source::point(0.0, 0.0, 1.0) };
    let (set, center) = observed(vec![source], CIRCULAR, options.clone());
    let there = PhaseCenter::sidereal("s", ra, dec).unwrap();
    for row in 0..set.data.n_rows() {
        let turn = sky_angle_rad(Mount::AltAz, &there, set.data.coverage.time_jd[row], &SITE).unwrap();
        let (rr, rl, ll) = (set.data.vis[(row, 0, 0)], set.data.vis[(row, 0, 1)], set.data.vis[(row, 0, 3)]);
        let wide = |v: num_complex::Complex32| Complex64::new(v.re.into(), v.im.into());
        let intensity = 0.5 * (wide(rr) + wide(ll));
        let expected = Complex64::new(0.3, 0.2) * Complex64::cis(2.0 * turn);
        assert!((wide(rl) / intensity - expected).norm() < 1e-6, "{row}");
    }
    // The same source by its direction cosines, whose Stokes parameters refer to the north of the centre carried to it.
    let (l, m) = source.direction_cosines(&center).unwrap();
    let axis = source.carried_north_rad(&center);
    let linear = Complex64::new(0.3, -0.2) * Complex64::cis(-2.0 * axis);
    let same = Source { polarized_jy: [linear.re, linear.im, 0.1], ..Source::point(l, m, 1.0) };
    let (again, _) = observed(vec![same], CIRCULAR, options.clone());
    let largest = again.data.vis.iter().zip(&set.data.vis).map(|(a, b)| (a - b).norm()).fold(0.0, f32::max);
    assert!(largest < 1e-6, "{largest}");
    let image = scene(&center);
    let header = options.header(layout(), image.spectrum.clone(), center, VisUnit::Jy);
    let header = VisibilityHeader { polarizations: LINEAR.to_vec(), ..header };
    let e = Simulator::new(header, &SkyModel::of_image(image), &options, &Silent).err().unwrap().to_string();
    assert!(e.contains("source list"), "{e}");
}

/// Four Stokes planes with a pixel each.
fn scene(center: &PhaseCenter) -> Image {
    let grid = SkyGrid::new(32, 32, 1e-5, SkyGrid::frame_of(center)).unwrap();
    let mut data = Array4::zeros((1, 4, 32, 32));
    for (k, value) in [1.0, 0.2, -0.3, 0.1].into_iter().enumerate() {
        data[[0, k, 20, 11]] = value;
    }
    let planes = vec![Polarization::I, Polarization::Q, Polarization::U, Polarization::V];
    Image::new(grid, SpectralWindow::band(1.4e9, 2e7, 1).unwrap(), planes, data, BrightnessUnit::JyPerPixel).unwrap()
}

#[test]
fn stokes_planes_and_turned_products_come_back_as_stokes_parameters() {
    for (products, mount, x_feeds) in [
        (LINEAR, Mount::AltAz, XOrientation::East),
        (CIRCULAR, Mount::AltAz, XOrientation::North),
        (LINEAR, Mount::Fixed, XOrientation::North),
    ] {
        let lst = LocalSky::at(2_460_800.25, &SITE).unwrap().lst_rad();
        let center = PhaseCenter::sidereal("c", lst + 0.3, 0.35).unwrap();
        let x_feeds = (products == LINEAR).then_some(x_feeds);
        let options =
            SimulateOptions { method: Method::Dft, pols: products.to_vec(), mount: Some(mount), x_feeds, ..SimulateOptions::default() };
        let plan = CoveragePlan::track(&layout(), &center, &Track::new(2_460_800.25, 14_400.0, 2_880.0)).unwrap();
        let image = scene(&center);
        let header = options.header(layout(), image.spectrum.clone(), center, VisUnit::Jy);
        let coverage = plan.blocks(10_000).next().unwrap().unwrap();
        let set = simulate_set(header, &coverage, &SkyModel::of_image(image.clone()), &options, &Silent).unwrap();
        let (l, m) = (image.grid.l_at(11.0), image.grid.m_at(20.0));
        for (target, flux) in image.polarizations.iter().zip([1.0, 0.2, -0.3, 0.1]) {
            let selector = PolSelector::of(*target, &set.header).unwrap();
            let own = selector.by_row(&set.data.coverage).unwrap();
            for row in 0..set.data.n_rows() {
                let (mut vis, mut weight) = ([num_complex::Complex32::default()], [0.0]);
                selector.row(&set.data, (row, own.as_ref().map(|own| &own[row])), false, (&mut vis, &mut weight));
                let uvw = set.data.coverage.uvw_m.row(row).to_owned();
                let path = uvw[0] * l + uvw[1] * m + uvw[2] * ((1.0 - l * l - m * m).sqrt() - 1.0);
                let truth = Complex64::cis(TAU * path * 1.4e9 / 299_792_458.0) * flux;
                let got = Complex64::new(vis[0].re.into(), vis[0].im.into());
                assert!((got - truth).norm() < 1e-6, "{target}: {got} {truth}");
                // Q of linear feeds at 45 degrees is their U: the weight is that of two products in any case.
                assert!((weight[0] - 2.0).abs() < 1e-5, "{target}: {}", weight[0]);
            }
        }
        let two = VisibilityHeader { polarizations: vec![products[0], products[3]], ..set.header.clone() };
        assert!(PolSelector::of(Polarization::I, &two).unwrap().by_row(&set.data.coverage).unwrap().is_none());
        assert!(Feeds::of(&two).unwrap().turn());
    }
}

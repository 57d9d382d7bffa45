//! Small visibility sets of one off-centre point source, for tests and for other programs to read.
#![allow(dead_code)] // each test binary uses a part of it

use cittert_arrays::astrometry::LocalSky;
use cittert_arrays::*;
use ndarray::{Array2, Array3};
use num_complex::Complex;
use std::f64::consts::TAU;

/// Where the source is: direction cosines.
pub(crate) const SOURCE: (f64, f64) = (0.012, 0.005);
/// Its flux density, Jy.
pub(crate) const FLUX: f64 = 2.0;

/// The centre of the VLA.
pub(crate) fn site() -> Site {
    Site { latitude_rad: 34.0784_f64.to_radians(), longitude_rad: (-107.6177_f64).to_radians(), altitude_m: 2124.0 }
}

/// `n` antennas on a spiral of `radius_m`, numbered from 1.
pub(crate) fn spiral(n: usize, radius_m: f64, frame: LayoutFrame) -> ArrayLayout {
    let antennas = (0..n)
        .map(|k| {
            let (t, r) = (2.4 * k as f64, radius_m * ((k + 1) as f64 / n as f64).sqrt());
            let mut a = Antenna::new(format!("A{:02}", k + 1), k as u32 + 1, [r * t.cos(), r * t.sin(), 0.01 * r * (3.0 * t).sin()]);
            a.diameter_m = Some(12.0);
            a
        })
        .collect();
    ArrayLayout::new("SPIRAL", frame, antennas).unwrap()
}

/// The header of a set that looks at RA 19h59m, Dec +40d.
pub(crate) fn header(layout: ArrayLayout, spectrum: SpectralWindow, pols: &[Polarization]) -> VisibilityHeader {
    let phase_center = match layout.frame {
        LayoutFrame::Boresight => PhaseCenter::unprojected("boresight"),
        LayoutFrame::EastNorthUp(_) => PhaseCenter::sidereal("CYGA", 299.868_f64.to_radians(), 40.734_f64.to_radians()).unwrap(),
    };
    VisibilityHeader {
        layout,
        spectrum,
        polarizations: pols.to_vec(),
        phase_centers: vec![phase_center],
        unit: VisUnit::Jy,
        telescope: "SPIRAL".into(),
        instrument: "SPIRAL".into(),
        pedestal_k: None,
        scene_pedestal_k: None,
        scene_width_rad: None,
        antenna_temperature_k: None,
        near_field: Default::default(),
        annotations: Default::default(),
        history: vec!["made by a test".into(), "second line".into()],
    }
}

/// Baselines of every pair at `n_times` times 60 s apart, projected to the phase centre (or not).
pub(crate) fn coverage(header: &VisibilityHeader, n_times: usize) -> UvCoverage {
    let ants = header.layout.antennas();
    let mut rows = UvCoverage::empty();
    for t in 0..n_times {
        let time = 2_460_000.75 + t as f64 * 60.0 / 86_400.0;
        for i in 0..ants.len() {
            for j in i + 1..ants.len() {
                let d = [0, 1, 2].map(|k| ants[j].position_m[k] - ants[i].position_m[k]);
                let uvw = match (header.layout.site(), header.phase_centers[0].ra_dec_rad()) {
                    (Some(site), Some((ra, dec))) => project(d, &site, time, ra, dec),
                    _ => d,
                };
                let row = UvCoverage::new(
                    Array2::from_shape_vec((1, 3), uvw.to_vec()).unwrap(),
                    vec![i as u32],
                    vec![j as u32],
                    vec![time],
                    vec![60.0],
                    vec![0],
                );
                rows.append(&row.unwrap()).unwrap();
            }
        }
    }
    rows
}

/// uvw of a local baseline towards a catalogue direction (Thompson, Moran & Swenson 2017, eq. 4.1, then the turn to the catalogue's north).
pub(crate) fn project(enu: [f64; 3], site: &Site, time: f64, ra: f64, dec: f64) -> [f64; 3] {
    let sky = LocalSky::at(time, site).unwrap();
    let place = sky.apparent_place(ra, dec, "icrs").unwrap();
    let [x, y, z] = site.enu_to_ecef_offset(enu);
    let (sh, ch) = (sky.lst_rad() - site.longitude_rad - place.ra_rad).sin_cos();
    let (sd, cd) = place.dec_rad.sin_cos();
    let (u, v) = (sh * x + ch * y, -sd * ch * x + sd * sh * y + cd * z);
    let (sp, cp) = place.frame_pa_rad.sin_cos();
    [u * cp - v * sp, u * sp + v * cp, cd * ch * x - cd * sh * y + sd * z]
}

/// Visibilities of the source in the parallel hands (and Stokes I), with some flags, weights and samples.
pub(crate) fn set(header: VisibilityHeader, n_times: usize) -> VisibilitySet {
    let rows = coverage(&header, n_times);
    let (n, nc, np) = header.shape(rows.n_rows());
    let (l, m) = SOURCE;
    let n1 = (1.0 - l * l - m * m).sqrt() - 1.0;
    let vis = Array3::from_shape_fn((n, nc, np), |(r, c, p)| {
        let k = header.spectrum.freq_hz()[c] / SPEED_OF_LIGHT_M_S;
        let phase = TAU * k * (rows.uvw_m[(r, 0)] * l + rows.uvw_m[(r, 1)] * m + rows.uvw_m[(r, 2)] * n1);
        let pol = header.polarizations[p];
        let flux = if pol.is_parallel_hand() || pol == Polarization::I { FLUX } else { 0.0 };
        Complex::new((flux * phase.cos()) as f32, (flux * phase.sin()) as f32)
    });
    let flags = Array3::from_shape_fn((n, nc, np), |(r, c, _)| (r * 7 + c) % 53 == 0);
    let nsamples = Array3::from_shape_fn((n, nc, np), |(r, _, _)| 1.0 + (r % 3) as f32);
    let block = VisibilityBlock::new(rows, vis, nsamples.clone(), flags, nsamples).unwrap();
    VisibilitySet::new(header, block).unwrap()
}

/// An array on the Earth with two linear hands.
pub(crate) fn earth() -> VisibilitySet {
    let layout = spiral(10, 300.0, LayoutFrame::EastNorthUp(site()));
    set(header(layout, SpectralWindow::band(1.4e9, 4e6, 4).unwrap(), &[Polarization::XX, Polarization::YY]), 6)
}

/// A millimetre-wave imager that looks along its boresight.
pub(crate) fn boresight() -> VisibilitySet {
    let layout = spiral(12, 0.5, LayoutFrame::Boresight);
    let mut header = header(layout, SpectralWindow::band(94e9, 8e9, 4).unwrap(), &[Polarization::I]);
    header.unit = VisUnit::KelvinSr;
    header.pedestal_k = Some(280.0);
    header.scene_pedestal_k = Some(281.5);
    header.scene_width_rad = Some(0.25);
    set(header, 1)
}

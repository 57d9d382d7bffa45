//! The beam and its figures against closed forms and against sums without shortcuts.

use super::main_lobe::{Beam, HalfPower};
use super::plane::Plane;
use super::psf::Psf;
use super::side_lobes::{Field, SideLobes};
use super::*;
use crate::quantity::{Frequency, Length};
use crate::{GenerateOptions, LayoutKind, PhaseCenter, SPEED_OF_LIGHT_M_S, Track, Weighting};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Baselines that fill a disc of this radius (wavelengths) evenly: rings of equal area with equal steps.
fn uniform_disc(radius: f64) -> Psf {
    let (rings, steps) = (100, 120);
    let uv: Vec<[f64; 2]> = (0..rings * steps)
        .map(|k| {
            let r = radius * ((f64::from(k / steps) + 0.5) / f64::from(rings)).sqrt();
            let angle = PI * (f64::from(k % steps) + 0.5 * f64::from(k / steps % 2)) / f64::from(steps);
            [r * angle.cos(), r * angle.sin()]
        })
        .collect();
    let weights = vec![1.0; uv.len()];
    Psf::of_baselines(uv, weights)
}

#[test]
fn a_uniform_disc_has_the_beam_of_bessel() {
    let radius = 200.0;
    let psf = uniform_disc(radius);
    // 2 J1(x) / x with x = 2 pi B theta.
    for k in 1..60 {
        let theta = f64::from(k) * 0.05 / radius;
        let x = TAU * radius * theta;
        let truth = 2.0 * libm::j1(x) / x;
        assert!((psf.at(theta * 0.6, theta * 0.8) - truth).abs() < 5e-4, "{k}: {} {truth}", psf.at(theta * 0.6, theta * 0.8));
    }
    let beam = Beam::fit(&psf);
    let width = HalfPower::of(&psf, &beam);
    for found in [width.widest_rad, width.narrowest_rad, width.equivalent_rad] {
        assert!((found * radius / 0.7047 - 1.0).abs() < 1e-3, "{}", found * radius);
    }
    // The first side lobe: the lowest value of 2 J1(x) / x, -0.1323 at x = 5.136.
    let lobes = SideLobes::of(&psf, &Field::within(&beam, 3.0 / radius).unwrap());
    assert!((lobes.lowest + 0.132_279).abs() < 3e-4 && (lobes.peak - 0.132_279).abs() < 3e-4, "{lobes:?}");
}

fn plane(kind: &str, n: usize, freq_hz: f64) -> Plane {
    let layout = ArrayLayout::generate(kind, &GenerateOptions::new(n, Length(1.0))).unwrap();
    Plane::new(&layout, SPEED_OF_LIGHT_M_S / freq_hz)
}

/// The peak of a brute-force search: a fine grid of directions beyond the main lobe, and a pattern search around its highest points.
fn brute_peak(psf: &Psf, beam: &Beam, radius: f64) -> f64 {
    let edge = |angle: f64| {
        let (s, c) = angle.sin_cos();
        let mut r = 0.0;
        let mut last = 1.0;
        loop {
            r += beam.minor_rad / 100.0;
            let v = psf.at(r * c, r * s);
            if v > last {
                return r;
            }
            last = v;
        }
    };
    let edges: Vec<f64> = (0..=360).map(|k| edge(PI * f64::from(k) / 360.0)).collect();
    let beyond = |l: f64, m: f64| {
        let turn = m.atan2(l).rem_euclid(PI) / PI * 360.0;
        l.hypot(m) <= radius && l.hypot(m) > edges[turn as usize].max(edges[(turn as usize + 1).min(360)])
    };
    let step = beam.minor_rad / 6.0;
    let n = (radius / step) as i32 + 1;
    let mut found: Vec<(f64, f64, f64)> = (-n..=n)
        .flat_map(|i| (0..=n).map(move |j| (f64::from(i) * step, f64::from(j) * step)))
        .filter(|(l, m)| beyond(*l, *m))
        .map(|(l, m)| (psf.at(l, m).abs(), l, m))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let climb = |(value, l, m): &(f64, f64, f64)| {
        let (mut best, mut l, mut m, mut h) = (*value, *l, *m, step / 2.0);
        while h > 1e-7 * step {
            let next = [(h, 0.0), (-h, 0.0), (0.0, h), (0.0, -h)].map(|(a, b)| (l + a, m + b));
            match next
                .into_iter()
                .filter(|(a, b)| beyond(*a, *b))
                .map(|(a, b)| (psf.at(a, b).abs(), a, b))
                .max_by(|a, b| a.0.total_cmp(&b.0))
            {
                Some((v, a, b)) if v > best => (best, l, m) = (v, a, b),
                _ => h /= 2.0,
            }
        }
        best
    };
    found.iter().take(40).map(climb).fold(0.0, f64::max)
}

#[test]
fn the_peak_side_lobe_is_that_of_a_brute_force_search() {
    for (kind, n) in [("reuleaux", 24), ("fermat", 40), ("random", 30)] {
        let plane = plane(kind, n, 30e9);
        let psf = Psf::natural(&plane.views[0]);
        let beam = Beam::fit(&psf);
        let radius = 10.0 / plane.longest();
        let lobes = SideLobes::of(&psf, &Field::within(&beam, radius).unwrap());
        let truth = brute_peak(&psf, &beam, radius);
        assert!((lobes.peak - truth).abs() < 1e-6, "{kind}: {} {truth}", lobes.peak);
        assert!(lobes.lowest >= -1.0 / (n as f64 - 1.0) - 1e-12, "{kind}: {}", lobes.lowest);
    }
}

#[test]
fn far_side_lobes_of_an_irregular_array_have_the_rms_of_theory() {
    // Far from the centre the phases are random: the variance of the beam is 1 / (N (N - 1)) of pairs, so its rms is close to 1 / N.
    for n in [30, 60, 120] {
        let f = ArrayLayout::generate("random", &GenerateOptions::new(n, Length(1.0))).unwrap().figures(94e9).unwrap();
        assert!((f.rms_sidelobe * n as f64 - 1.0).abs() < 0.1, "{n}: {}", f.rms_sidelobe * n as f64);
        assert!(f.lowest_sidelobe >= -1.0 / (n as f64 - 1.0) - 1e-12);
    }
}

#[test]
fn a_band_smears_the_far_side_lobes() {
    let layout = ArrayLayout::generate("fermat", &GenerateOptions::new(64, Length(1.0))).unwrap();
    let band = FigureOptions { bandwidth: Some(Frequency(8e9)), channels: 8, ..FigureOptions::default() };
    let (one, wide) = (layout.figures(94e9).unwrap(), layout.figures_with(94e9, &band).unwrap());
    assert!(wide.rms_sidelobe < 0.9 * one.rms_sidelobe, "{} {}", wide.rms_sidelobe, one.rms_sidelobe);
    assert!((wide.bmaj_rad / one.bmaj_rad - 1.0).abs() < 0.01);
    assert!(wide.point_source_jy.is_none());
}

#[test]
fn uniform_weights_sharpen_and_briggs_weights_lie_between() {
    let layout = ArrayLayout::builtin("vla-a").unwrap();
    let width = |weighting, robust| {
        let o = FigureOptions { weighting, robust, uv_cell: Some(Length(300.0)), ..FigureOptions::default() };
        layout.figures_with(1.4e9, &o).unwrap().half_power_equivalent_rad
    };
    let (natural, uniform) = (width(Weighting::Natural, None), width(Weighting::Uniform, None));
    let briggs = width(Weighting::Briggs, Some(0.0));
    assert!(uniform < briggs && briggs < natural, "{uniform} {briggs} {natural}");
}

#[test]
fn losses_are_those_of_the_smaller_arrays() {
    // In a plain ring all losses of one antenna are alike; in a spiral they differ.
    for (kind, n) in [("ring", 15), ("fermat", 16), ("y", 12)] {
        let layout = ArrayLayout::generate(kind, &GenerateOptions::new(n, Length(0.3))).unwrap();
        let (freq, o) = (30e9, FigureOptions { uv_cell: Some(Length(0.02)), ..FigureOptions::default() });
        let losses = layout.figures_with_losses(freq, &o, true).unwrap();
        let wavelength = SPEED_OF_LIGHT_M_S / freq;
        let full = Plane::new(&layout, wavelength);
        let field = Field::within(&Beam::fit(&Psf::natural(&full.views[0])), o.within / full.longest()).unwrap();
        let mut worst = [[f64::NEG_INFINITY; 4]; 2];
        let mut sums = [0.0; 2];
        for i in 0..n {
            for j in i..n {
                let left: Vec<crate::Antenna> =
                    layout.antennas().iter().enumerate().filter(|(k, _)| *k != i && *k != j).map(|(_, a)| a.clone()).collect();
                let smaller = ArrayLayout::new("t", layout.frame, left).unwrap();
                let psf = Psf::natural(&Plane::new(&smaller, wavelength).views[0]);
                let lobes = SideLobes::of(&psf, &field);
                let f = smaller.figures_with(freq, &o).unwrap();
                let which = usize::from(j > i);
                let found = [10.0 * lobes.peak.log10(), lobes.rms, f.bmaj_rad, -f.uv_fill];
                worst[which] = [0, 1, 2, 3].map(|k| worst[which][k].max(found[k]));
                sums[which] += f.unique_baselines as f64;
                if i == j {
                    let (_, ranked) = losses.ranking.iter().find(|(k, _)| *k == i).unwrap();
                    let same = [ranked[3], ranked[4], ranked[0], -ranked[5]];
                    assert!(same.iter().zip(found).all(|(a, b)| (a - b).abs() < 1e-6), "{kind} {i}: {same:?} {found:?}");
                    assert_eq!(ranked[7], f.unique_baselines as f64);
                    assert!((ranked[2] / f.largest_scale_rad - 1.0).abs() < 1e-12);
                }
            }
        }
        for (summary, (worst, (sum, count))) in
            [losses.one, losses.two.unwrap()].iter().zip(worst.iter().zip(sums.iter().zip([n as f64, (n * (n - 1) / 2) as f64])))
        {
            let same = [summary.worst[3], summary.worst[4], summary.worst[0], -summary.worst[5]];
            assert!(same.iter().zip(worst).all(|(a, b)| (a - b).abs() < 1e-6), "{kind}: {same:?} {worst:?}");
            assert!((summary.mean[7] - sum / count).abs() < 1e-9);
        }
        // Noise: sqrt(N (N - 1) / ((N - 2) (N - 3))) of equal antennas.
        let (m, ratio) = (n as f64, losses.two.unwrap().worst[8]);
        assert!((ratio - (m * (m - 1.0) / ((m - 2.0) * (m - 3.0))).sqrt()).abs() < 1e-12, "{ratio}");
        assert!(losses.ranking.is_sorted_by(|a, b| a.1[3] >= b.1[3]) && losses.ranking.len() == n);
    }
}

#[test]
fn grids_have_ghosts_and_a_hole_around_the_zero_spacing() {
    let o = FigureOptions::default();
    let freq = SPEED_OF_LIGHT_M_S / 0.01;
    // 8 x 8 places of 2 cm, two wavelengths: ghosts at the direction cosine 1 / 2.
    let grid = ArrayLayout::generate("rectangular", &GenerateOptions::new(64, Length(0.14 * 2_f64.sqrt()))).unwrap();
    let f = grid.figures_with(freq, &o).unwrap();
    assert!((f.ghosts.alias_free_field_rad - 2.0 * 0.25_f64.asin()).abs() < 1e-9);
    assert_eq!((f.unique_baselines, f.redundancy), (112, 2016.0 / 112.0));
    assert!((f.ghosts.directions[0][0].hypot(f.ghosts.directions[0][1]) - 0.5).abs() < 1e-9);
    let spiral = ArrayLayout::generate("fermat", &GenerateOptions::new(64, Length(0.2))).unwrap().figures(freq).unwrap();
    assert!(spiral.ghosts.directions.is_empty() && (spiral.ghosts.alias_free_field_rad - PI).abs() < 1e-12);
    // The figures of every kind can be had.
    for name in ["golomb", "koch", "u", "t", "hexagonal", "difference-line"] {
        let kind = LayoutKind::find(name).unwrap();
        let n = [12, 13, 14, 19, 28, 48].into_iter().find(|n| kind.layout(&GenerateOptions::new(*n, Length(0.3))).is_ok()).unwrap();
        let f = kind.layout(&GenerateOptions::new(n, Length(0.3))).unwrap().figures(freq).unwrap();
        assert!(
            f.largest_hole_m > 0.0 && f.largest_hole_m <= 0.6 && f.half_power_rad[1] <= f.half_power_rad[0] && f.half_power_rad[0] <= PI
        );
        assert!(f.radial_uniformity > 0.09 && f.azimuthal_uniformity <= 1.0 && f.bpa_rad.abs() <= FRAC_PI_2 + 1e-12, "{name}");
    }
}

/// Every direction of a field by the sum over all rows of the track, without any shortcut.
#[test]
fn the_figures_of_a_track_are_those_of_the_sum_over_its_rows() {
    let layout = ArrayLayout::builtin("vla-d").unwrap();
    let center = PhaseCenter::sidereal("s", 5.23, 0.71).unwrap();
    let track = Track::hour_angles(&center, &layout.site().unwrap(), 2_460_828.0, [-1.2, 1.0], 1800.0).unwrap();
    let plan = CoveragePlan::track(&layout, &center, &track).unwrap();
    let (freq, o) = (1.4e9, FigureOptions { bandwidth: Some(Frequency(1e8)), within: 12.0, ..FigureOptions::default() });
    let (f, snapshot) = (layout.figures_over(freq, &o, &plan).unwrap(), layout.figures_with(freq, &o).unwrap());
    let rows = plan.coverage().unwrap();
    let wavelength = SPEED_OF_LIGHT_M_S / freq;
    let uv: Vec<[f64; 2]> = (0..rows.ant1.len()).map(|r| [0, 1].map(|k| rows.uvw_m[[r, k]] / wavelength)).collect();
    let n = uv.len();
    let psf = Psf::of_baselines(uv.clone(), vec![1.0; n]);
    let beam = Beam::fit(&psf);
    assert!((f.bmaj_rad / beam.major_rad - 1.0).abs() < 1e-9 && (f.bpa_rad - beam.pa_rad).abs() < 1e-9);
    let longest = uv.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
    let truth = brute_peak(&psf, &beam, 12.0 / longest);
    assert!((10.0 * truth.log10() - f.psl_within_db).abs() < 1e-4, "{} {}", 10.0 * truth.log10(), f.psl_within_db);
    assert!((f.largest_scale_rad * uv.iter().map(|p| p[0].hypot(p[1])).fold(f64::INFINITY, f64::min) - 1.0).abs() < 1e-12);
    // What the rotation of the Earth brings.
    assert!(
        f.psl_within_db < snapshot.psl_within_db - 1.0 && f.uv_fill > 1.5 * snapshot.uv_fill && f.largest_hole_m < snapshot.largest_hole_m
    );
    assert_eq!(f.n_integrations, plan.times_jd().count());
    assert!((f.time_s - 1800.0 * f.n_integrations as f64).abs() < 1e-6 && snapshot.n_integrations == 1);
}

#[test]
fn a_plan_of_one_integration_has_the_figures_of_the_snapshot() {
    let layout = ArrayLayout::generate(
        "fermat",
        &GenerateOptions { sefd: Some(crate::quantity::FluxDensity(1e5)), ..GenerateOptions::new(16, Length(0.3)) },
    )
    .unwrap();
    for weighting in [Weighting::Natural, Weighting::Uniform] {
        let o = FigureOptions { bandwidth: Some(Frequency(8e9)), channels: 3, weighting, ..FigureOptions::default() };
        let plan = CoveragePlan::snapshot(&layout, 2_460_828.0, o.time.si()).unwrap();
        let (one, over) = (layout.figures_with(94e9, &o).unwrap(), layout.figures_over(94e9, &o, &plan).unwrap());
        assert!((one.psl_db - over.psl_db).abs() < 1e-9 && (one.bmaj_rad / over.bmaj_rad - 1.0).abs() < 1e-9);
        assert!((one.uv_fill - over.uv_fill).abs() < 1e-12 && (one.time_s - over.time_s).abs() < 1e-9);
        // Nine times the time: a third of the noise, and nothing else changes where the sky stands still.
        let center = PhaseCenter::unprojected("boresight");
        let nine = CoveragePlan::track(&layout, &center, &Track::new(2_460_828.0, 9.0 * o.time.si(), o.time.si())).unwrap();
        let long = layout.figures_over(94e9, &o, &nine).unwrap();
        assert_eq!(long.n_integrations, 9);
        assert!((one.point_source_jy.unwrap() / long.point_source_jy.unwrap() - 3.0).abs() < 1e-9);
        let ratio = one.rms_sidelobe_within / long.rms_sidelobe_within;
        assert!((one.psl_within_db - long.psl_within_db).abs() < 1e-9 && (ratio - 1.0).abs() < 1e-9);
    }
}

#[test]
fn bad_options_are_refused_by_name() {
    let layout = ArrayLayout::builtin("mm-ring").unwrap();
    let good = FigureOptions::default();
    for (o, words) in [
        (FigureOptions { bandwidth: Some(Frequency(2e12)), ..good.clone() }, "bandwidth is 2THz"),
        (FigureOptions { channels: 8, ..good.clone() }, "channels is 8, expected 1, or a bandwidth"),
        (FigureOptions { robust: Some(0.0), ..good.clone() }, "robust is 0, expected no robustness"),
        (FigureOptions { weighting: Weighting::Briggs, robust: Some(3.0), ..good.clone() }, "robust is 3"),
        (FigureOptions { within: f64::NAN, ..good.clone() }, "within is NaN"),
        (FigureOptions { within: 0.1, ..good.clone() }, "within is 0.1, expected more than the main lobe, which is 0.7 wide"),
        (FigureOptions { uv_cell: Some(Length(0.0)), ..good.clone() }, "uv_cell is 0m"),
        (
            FigureOptions { weighting: Weighting::Uniform, bandwidth: Some(Frequency(1e9)), channels: 4000, ..good.clone() },
            "weighting is uniform, expected natural for",
        ),
    ] {
        let e = layout.figures_with(94e9, &o).unwrap_err().to_string();
        assert!(e.contains(words), "{e}");
    }
    let far = FigureOptions { within: 1e5, ..good.clone() };
    let e = ArrayLayout::builtin("vla-a").unwrap().figures_with(1.4e9, &far).unwrap_err().to_string();
    assert!(e.contains("within is 100000, expected at most") && e.contains("1000 beams"), "{e}");
    let pair = ArrayLayout::generate("fermat", &GenerateOptions::new(3, Length(0.3))).unwrap();
    let e = pair.figures_with_losses(94e9, &good, true).unwrap_err().to_string();
    assert!(e.starts_with("lost is 2, expected 0"), "{e}");
}

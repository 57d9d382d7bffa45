//! A dirty beam along its radius: the largest value and the rms over azimuth, the width of the main lobe, and the side lobes.

use cittert_arrays::{Image, SkyGrid};
use ndarray::ArrayView2;

/// A side lobe: its distance from the peak and its absolute value relative to the peak.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lobe {
    pub(super) radius_rad: f64,
    pub(super) level: f64,
}

/// One ring of the profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ring {
    pub(super) radius_rad: f64,
    /// Largest absolute value.
    pub(super) largest: f64,
    pub(super) rms: f64,
}

/// The profile of a dirty beam whose peak is 1.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Radial {
    pub(super) rings: Vec<Ring>,
    /// Full widths at half maximum: major and minor axis.
    pub(super) fwhm_rad: (f64, f64),
    /// The first maximum beyond the main lobe.
    pub(super) first: Option<Lobe>,
    /// The largest value beyond the main lobe.
    pub(super) highest: Option<Lobe>,
    /// Rms beyond the main lobe.
    pub(super) rms: f64,
}

/// A pixel as seen from the peak.
struct Pixel {
    radius_rad: f64,
    /// Distance in units of the full width of the main lobe in this direction.
    widths: f64,
    value: f64,
}

/// Rings in one width of the main lobe, in which its end is looked for.
const RINGS_IN_A_WIDTH: f64 = 12.0;
/// The main lobe ends beyond this many widths: half its maximum is at 0.5.
const INNERMOST_END: f64 = 0.6;

impl Radial {
    /// The profile of one plane of a dirty beam, out to half of the smaller side. The peak is in the middle.
    pub(super) fn of(image: &Image, chan: usize, pol: usize) -> Self {
        let plane = image.plane(chan, pol);
        let grid = &image.grid;
        let beam = if image.beams.len() == 1 { image.beams.first() } else { image.beams.get(chan) };
        let (axes, pa) = match beam {
            Some(b) if b.bmaj_rad > 0.0 && b.bmin_rad > 0.0 => ((b.bmaj_rad, b.bmin_rad), b.bpa_rad),
            _ => {
                let width = measured_width(plane, grid);
                ((width, width), 0.0)
            }
        };
        let (sin, cos) = pa.sin_cos();
        let pixels: Vec<Pixel> = plane
            .indexed_iter()
            .filter(|(_, v)| v.is_finite())
            .map(|((i, j), v)| {
                let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
                let (along, across) = ((l * sin + m * cos) / axes.0, (l * cos - m * sin) / axes.1);
                Pixel { radius_rad: l.hypot(m), widths: along.hypot(across), value: v.abs() }
            })
            .collect();
        let reach = 0.5 * grid.cell_rad * grid.n_l.min(grid.n_m) as f64;
        let rings = rings(&pixels, grid.cell_rad, reach);
        // A ring of the elliptical profile is at least one cell wide.
        let step = (1.0 / RINGS_IN_A_WIDTH).max(grid.cell_rad / axes.1);
        let profile = largest_of(pixels.iter().map(|p| (p.widths / step, p)), (reach / axes.0 / step) as usize + 1);
        let begin = ((INNERMOST_END / step) as usize).max(1);
        let level = |k: usize| profile[k].map_or(0.0, |p| p.value);
        let end = (begin..profile.len().saturating_sub(1)).find(|k| level(k + 1) > level(*k));
        let lobe = |p: &Pixel| Lobe { radius_rad: p.radius_rad, level: p.value };
        let (mut first, mut highest, mut rms) = (None, None, 0.0);
        if let Some(end) = end {
            let top = (end + 1..profile.len()).find(|k| k + 1 == profile.len() || level(k + 1) < level(*k));
            first = top.and_then(|k| profile[k]).map(lobe);
            let beyond = || pixels.iter().filter(|p| p.widths >= (end + 1) as f64 * step && p.radius_rad <= reach);
            highest = beyond().max_by(|a, b| a.value.total_cmp(&b.value)).map(lobe);
            let (sum, n) = beyond().fold((0.0, 0_usize), |(s, n), p| (s + p.value * p.value, n + 1));
            rms = (sum / n.max(1) as f64).sqrt();
        }
        Self { rings, fwhm_rad: axes, first, highest, rms }
    }
}

/// The profile in rings of one cell.
fn rings(pixels: &[Pixel], cell_rad: f64, reach: f64) -> Vec<Ring> {
    let n = (reach / cell_rad) as usize + 1;
    let mut sums = vec![(0.0_f64, 0.0_f64, 0_usize); n];
    for p in pixels {
        if let Some(ring) = sums.get_mut((p.radius_rad / cell_rad).round() as usize) {
            *ring = (ring.0.max(p.value), ring.1 + p.value * p.value, ring.2 + 1);
        }
    }
    let filled = sums.into_iter().enumerate().filter(|(_, s)| s.2 > 0);
    filled.map(|(k, s)| Ring { radius_rad: k as f64 * cell_rad, largest: s.0, rms: (s.1 / s.2 as f64).sqrt() }).collect()
}

/// The pixel with the largest value in each of `n` rings.
fn largest_of<'a>(pixels: impl Iterator<Item = (f64, &'a Pixel)>, n: usize) -> Vec<Option<&'a Pixel>> {
    let mut out: Vec<Option<&Pixel>> = vec![None; n];
    for (place, pixel) in pixels {
        if let Some(ring) = out.get_mut(place as usize)
            && ring.is_none_or(|p| pixel.value > p.value)
        {
            *ring = Some(pixel);
        }
    }
    out
}

/// The full width at half maximum from the number of pixels above half of the peak around it, for a beam whose axes are not known.
fn measured_width(plane: ArrayView2<'_, f64>, grid: &SkyGrid) -> f64 {
    let (r, c) = (grid.n_m / 2, grid.n_l / 2);
    let along = |step: &dyn Fn(usize) -> Option<(usize, usize)>| {
        (1..grid.n_l.max(grid.n_m)).find(|k| step(*k).and_then(|at| plane.get(at)).is_none_or(|v| *v < 0.5)).unwrap_or(1) as f64 - 0.5
    };
    let arms = [
        along(&|k| Some((r, c + k))),
        along(&|k| Some((r, c.checked_sub(k)?))),
        along(&|k| Some((r + k, c))),
        along(&|k| Some((r.checked_sub(k)?, c))),
    ];
    grid.cell_rad * 0.5 * arms.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{BrightnessUnit, Polarization, SkyFrame, SpectralWindow};
    use ndarray::Array4;

    /// (2 J1(x) / x)^2: the beam of a round aperture. Its half power is at x = 1.6163, its first side lobe of 0.01750 at x = 5.1356.
    fn airy(x: f64) -> f64 {
        if x < 1e-9 { 1.0 } else { (2.0 * libm::j1(x) / x).powi(2) }
    }

    #[test]
    fn the_beam_of_a_round_aperture_has_the_lobes_of_the_book() {
        let grid = SkyGrid::new(256, 256, 1e-4, SkyFrame::Boresight).unwrap();
        let scale = 0.25; // x of one cell
        let data = Array4::from_shape_fn((1, 1, 256, 256), |(_, _, r, c)| airy(scale * (r as f64 - 128.0).hypot(c as f64 - 128.0)));
        let band = SpectralWindow::band(1e9, 1e6, 1).unwrap();
        let image = Image::new(grid, band, vec![Polarization::I], data, BrightnessUnit::One).unwrap();
        let found = Radial::of(&image, 0, 0);
        // The width counts whole cells on each of four arms.
        assert!((found.fwhm_rad.0 / 1e-4 * scale - 2.0 * 1.6163).abs() <= scale, "{:?}", found.fwhm_rad);
        let (first, highest) = (found.first.unwrap(), found.highest.unwrap());
        assert!((first.level - 0.0175).abs() < 1e-4 && (highest.level - 0.0175).abs() < 1e-4, "{first:?} {highest:?}");
        assert!((first.radius_rad / 1e-4 * scale - 5.1356).abs() < scale, "{first:?}");
        assert!(found.rms < 0.0175 && found.rms > 1e-4);
        assert_eq!((found.rings[0].largest, found.rings[0].rms), (1.0, 1.0));
    }
}

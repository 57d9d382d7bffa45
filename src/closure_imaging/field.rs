//! Properties of the field that follow from the coverage and the amplitudes: its grid, the baselines that measure only its total flux, and
//! its size.

use super::gather::SparseSet;
use super::options::ClosureImagingOptions;
use super::tuning::ClosureImagingControl;
use crate::imaging::warn_coarse;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{SkyFrame, SkyGrid};

/// True for baselines between co-located antennas \[n\]. They measure the total flux and do not resolve the source.
///
/// They are recognised by a gap in the lengths: the shortest of all other baselines is many times longer.
#[must_use]
pub fn co_located(set: &SparseSet, tuning: &ClosureImagingControl) -> Vec<bool> {
    let lengths = set.lengths_wl();
    let mut sorted = lengths.clone();
    sorted.sort_by(f64::total_cmp);
    let longest = sorted.last().copied().unwrap_or(0.0);
    let gaps = sorted.windows(2).filter(|w| w[0] < tuning.co_located * longest && w[1] > tuning.gap * w[0]);
    let cut = gaps.max_by(|a, b| (a[1] / a[0].max(1e-3)).total_cmp(&(b[1] / b[0].max(1e-3)))).map(|w| w[0]);
    lengths.iter().map(|l| cut.is_some_and(|c| *l <= c)).collect()
}

/// Median of a list; `None` of an empty one.
pub(super) fn median(mut list: Vec<f64>) -> Option<f64> {
    list.sort_by(f64::total_cmp);
    list.get(list.len() / 2).copied()
}

/// The grid as given, or chosen from the coverage: cells of a sixth of 1 / (longest baseline) over most of the field that the shortest
/// baseline measures.
///
/// # Errors
/// All baselines have length 0, or the grid is not valid.
pub fn choose_grid(
    set: &SparseSet,
    short: &[bool],
    frame: SkyFrame,
    options: &ClosureImagingOptions,
    observer: &dyn Observer,
) -> Result<SkyGrid> {
    let (size, cell, tuning) = (options.size.map(|s| (s.columns, s.rows)), options.cell.map(|c| c.si()), &options.tuning);
    let lengths = set.lengths_wl();
    let longest = lengths.iter().fold(0.0_f64, |a, l| a.max(*l));
    let shortest = lengths.iter().zip(short).filter(|(_, s)| !**s).fold(f64::INFINITY, |a, (l, _)| a.min(*l));
    ensure!(longest > 0.0, ChainError::NoData("no baseline is longer than 0: nothing can be imaged".into()));
    let field = tuning.field / shortest.max(1e-9 * longest);
    let cell_rad =
        cell.unwrap_or_else(|| size.map_or(1.0 / (tuning.cells * longest), |(n, m)| (field / n.max(m) as f64).min(1.0 / (3.0 * longest))));
    let side = ((field / cell_rad).ceil() as usize).clamp(16, tuning.largest).next_multiple_of(2);
    let (n_l, n_m) = size.unwrap_or((side, side));
    let grid = SkyGrid::new(n_l, n_m, cell_rad, frame)?;
    if cell.is_none() || size.is_none() {
        let muas = cell_rad.to_degrees() * 3.6e9;
        observer.event(Event::Note(&format!("image of {n_l} x {n_m} cells of {muas:.3} microarcsec, chosen from the coverage")));
    }
    warn_coarse(cell_rad, longest, observer);
    Ok(grid)
}

/// Width of the circular Gaussian that the amplitudes of the shorter half of the baselines fit, rad; `None` if they do not decrease with
/// length. The fit is linear in ln|V| and u^2 + v^2, and a relative error of a tenth is added to the error of each amplitude in quadrature.
#[must_use]
pub fn fitted_fwhm(set: &SparseSet, short: &[bool]) -> Option<f64> {
    let lengths = set.lengths_wl();
    let longest = lengths.iter().fold(0.0_f64, |a, l| a.max(*l));
    let (mut s, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (k, l) in lengths.iter().enumerate() {
        let variance = set.samples.relative_variance(k);
        if short[k] || *l > 0.5 * longest || !variance.is_finite() {
            continue;
        }
        let (w, x, y) = (1.0 / (variance + 0.01), (l / longest).powi(2), set.samples.vis()[k].norm().ln());
        s += w;
        sx += w * x;
        sy += w * y;
        sxx += w * x * x;
        sxy += w * x * y;
    }
    let slope = (s * sxy - sx * sy) / (s * sxx - sx * sx);
    // |V| = exp(-pi^2 fwhm^2 q^2 / (4 ln 2))
    (slope < 0.0).then(|| (-slope * 4.0 * std::f64::consts::LN_2).sqrt() / (std::f64::consts::PI * longest))
}

/// A circular Gaussian of total flux `flux` \[m * l\] in the middle, with a thousandth of the flux one width up and to the left. For a
/// symmetric image the gradient of the closure phases is zero, and the solver would not move.
#[must_use]
pub fn gaussian(grid: &SkyGrid, fwhm_rad: f64, flux: f64) -> Vec<f64> {
    let middle = |n: usize| (n as f64 - 1.0) / 2.0;
    let k = 4.0 * std::f64::consts::LN_2 * (grid.cell_rad / fwhm_rad).powi(2);
    let off = fwhm_rad / grid.cell_rad;
    let at = |r: f64, c: f64| (-k * (r * r + c * c)).exp();
    let cell = |i: usize| {
        let (r, c) = ((i / grid.n_l) as f64 - middle(grid.n_m), (i % grid.n_l) as f64 - middle(grid.n_l));
        at(r, c) + 1e-3 * at(r - off, c + off) + 1e-12
    };
    let image: Vec<f64> = (0..grid.n_l * grid.n_m).map(cell).collect();
    let sum: f64 = image.iter().sum();
    image.into_iter().map(|v| v * flux / sum).collect()
}

/// An image \[m * l\] smoothed by a circular Gaussian. Flux that leaves the frame is lost.
#[must_use]
pub fn smoothed(image: &[f64], (n_l, n_m): (usize, usize), fwhm_cells: f64) -> Vec<f64> {
    let k = 4.0 * std::f64::consts::LN_2 / (fwhm_cells * fwhm_cells);
    let reach = n_l.max(n_m);
    let kernel: Vec<f64> = (0..reach).map(|d| (-k * (d * d) as f64).exp()).collect();
    let norm = 1.0 / (2.0 * kernel.iter().sum::<f64>() - kernel[0]);
    let along = |get: &dyn Fn(usize) -> f64, n: usize, i: usize| norm * (0..n).map(|j| get(j) * kernel[i.abs_diff(j)]).sum::<f64>();
    let rows: Vec<f64> = (0..n_l * n_m).map(|i| along(&|c| image[i / n_l * n_l + c], n_l, i % n_l)).collect();
    (0..n_l * n_m).map(|i| along(&|r| rows[r * n_l + i % n_l], n_m, i / n_l)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::samples::Samples;
    use super::*;
    use crate::imaging::DataCounts;
    use num_complex::Complex64;

    fn set(uv: Vec<[f64; 2]>, amplitude: impl Fn(f64) -> f64) -> SparseSet {
        let n = uv.len();
        let vis = uv.iter().map(|[u, v]| Complex64::new(amplitude(u.hypot(*v)), 0.0)).collect();
        let samples = Samples::new(2, vec![(0, 1); n], (vis, vec![1e-4; n]), (0..n).map(|k| k..k + 1).collect()).unwrap();
        let names = vec!["A".into(), "B".into()];
        SparseSet { samples, uv, times_jd: vec![0.0; n], names, phase_center: 0, counts: DataCounts::default() }
    }

    #[test]
    fn co_located_antennas_are_told_by_a_gap() {
        let tuning = ClosureImagingControl::default();
        let uv = |lengths: &[f64]| lengths.iter().map(|l| [*l, 0.0]).collect::<Vec<_>>();
        let eht = set(uv(&[1e5, 2e6, 1.3e9, 2e9, 4e9, 8e9]), |_| 1.0);
        assert_eq!(co_located(&eht, &tuning), [true, true, false, false, false, false]);
        let dense = set(uv(&[1e3, 3e3, 8e3, 2e4, 5e4]), |_| 1.0);
        assert!(co_located(&dense, &tuning).iter().all(|s| !s));
        let grid =
            choose_grid(&eht, &co_located(&eht, &tuning), SkyFrame::Boresight, &ClosureImagingOptions::default(), &crate::progress::Silent)
                .unwrap();
        assert!((grid.cell_rad * 6.0 * 8e9 - 1.0).abs() < 1e-12);
        assert!(grid.n_l.is_multiple_of(2) && (grid.n_l as f64 * grid.cell_rad * 1.3e9 - tuning.field).abs() < 0.1, "{}", grid.n_l);
    }

    #[test]
    fn a_gaussian_source_gives_its_width_and_flux() {
        let fwhm = 2e-10;
        let truth = |q: f64| 0.7 * (-(std::f64::consts::PI * fwhm * q).powi(2) / (4.0 * std::f64::consts::LN_2)).exp();
        let s = set((1..40).map(|k| [1e8 * f64::from(k), 5e7]).collect(), truth);
        let fitted = fitted_fwhm(&s, &[false; 39]).unwrap();
        assert!((fitted / fwhm - 1.0).abs() < 1e-3, "{fitted}");
        assert!(fitted_fwhm(&set((1..40).map(|k| [1e8 * f64::from(k), 0.0]).collect(), |q| q), &[false; 39]).is_none());
        let grid = SkyGrid::new(32, 30, 2e-11, SkyFrame::Boresight).unwrap();
        let image = gaussian(&grid, fwhm, 0.7);
        assert!((image.iter().sum::<f64>() - 0.7).abs() < 1e-12 && image.iter().all(|v| *v > 0.0));
        let wide = smoothed(&image, (32, 30), 3.0);
        assert!(wide.iter().sum::<f64>() <= 0.7 && wide[15 * 32 + 16] < image[15 * 32 + 16]);
    }
}

//! Exact visibilities of points and elliptical Gaussians.

use super::dft::{RESTART, n_minus_1};
use crate::Result;
use crate::fourier::phasor::{cos_sin_turns, uniform_step};
use cittert_arrays::{ArrayError, PhaseCenter, SPEED_OF_LIGHT_M_S, SkyGrid, Source, SourceShape};
use ndarray::parallel::prelude::*;
use ndarray::{Array2, ArrayView2, Axis, s};
use num_complex::Complex64;

/// A source relative to one phase centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    pub(crate) l: f64,
    pub(crate) m: f64,
    nm1: f64,
    /// Axes of the Gaussian as vectors in (l, m), scaled so that the visibility is exp(-(u.a)^2 - (u.b)^2); `None` for a point.
    axes: Option<[[f64; 2]; 2]>,
    pub(crate) source: Source,
}

impl Seen {
    /// Visibility of the source with a flux density of 1, at uvw in seconds of light time and a frequency.
    pub(super) fn phasor(&self, [u, v, w]: [f64; 3], freq_hz: f64, w_term: bool) -> Complex64 {
        let delay = u * self.l + v * self.m + if w_term { w * self.nm1 } else { 0.0 };
        let width = self.axes.map_or(0.0, |[a, b]| (u * a[0] + v * a[1]).powi(2) + (u * b[0] + v * b[1]).powi(2));
        let (cos, sin) = cos_sin_turns(delay * freq_hz);
        Complex64::new(cos, sin) * (-width * freq_hz * freq_hz).exp()
    }
}

impl AsRef<Seen> for Seen {
    fn as_ref(&self) -> &Seen {
        self
    }
}

/// Check the numbers of a source and find its direction cosines.
///
/// # Errors
/// A number is not finite, a width is negative, or the source is behind the horizon. `number` is the number of the source in the message,
/// starting at 1.
pub(crate) fn seen_from(source: &Source, number: usize, center: &PhaseCenter) -> Result<Seen> {
    let check = |what: &str, value: f64, good: bool, expected: &'static str| {
        if good {
            Ok(())
        } else {
            Err(ArrayError::BadValue { what: format!("{what} of source {number}"), value: value.to_string(), expected })
        }
    };
    check("flux density", source.flux_jy, source.flux_jy.is_finite(), "a finite number of Jy")?;
    for (what, value) in ["Stokes Q", "Stokes U", "Stokes V"].into_iter().zip(source.polarized_jy) {
        check(what, value, value.is_finite(), "a finite number of Jy")?;
    }
    check("spectral index", source.spectral_index, source.spectral_index.is_finite(), "a finite number")?;
    if let Some(f) = source.ref_freq_hz {
        check("reference frequency", f, f.is_finite() && f > 0.0, "a positive number of Hz")?;
    } else if source.spectral_index != 0.0 {
        check("reference frequency", f64::NAN, false, "a frequency, as the spectral index is not 0")?;
    }
    let (l, m) = source.direction_cosines(center).map_err(|e| ArrayError::Parse(format!("source {number}: {e}")))?;
    let axes = match source.shape {
        SourceShape::Point => None,
        SourceShape::Gaussian { major_rad, minor_rad, pa_rad } => {
            for (what, width) in [("major axis", major_rad), ("minor axis", minor_rad)] {
                check(what, width, width.is_finite() && width >= 0.0, "a finite width of at least 0 rad")?;
            }
            check("position angle", pa_rad, pa_rad.is_finite(), "a finite angle")?;
            // exp(-4 ln2 x^2 / FWHM^2) transforms into exp(-(pi FWHM u)^2 / (4 ln 2)).
            let scale = std::f64::consts::PI / (2.0 * std::f64::consts::LN_2.sqrt());
            let (sin, cos) = pa_rad.sin_cos();
            Some([[sin * major_rad * scale, cos * major_rad * scale], [cos * minor_rad * scale, -sin * minor_rad * scale]])
        }
    };
    let behind =
        || ArrayError::BadValue { what: format!("position of source {number}"), value: format!("{l}, {m}"), expected: "l^2 + m^2 <= 1" };
    let nm1 = n_minus_1(l, m).ok_or_else(behind)?;
    Ok(Seen { l, m, nm1, axes, source: *source })
}

/// Visibilities of sources at `uvw_m` \[row, 3\] as \[row, freq\]; `amplitude(source, freq)` gives the apparent flux density.
///
/// A Gaussian has the w phase of its centre. The change of n over the Gaussian is neglected, as usual in component lists.
pub(crate) fn sources_dft<S: AsRef<Seen> + Sync>(
    sources: &[S],
    uvw_m: ArrayView2<'_, f64>,
    freq_hz: &[f64],
    w_term: bool,
    amplitude: impl Fn(&S, f64) -> f64 + Sync,
) -> Array2<Complex64> {
    let flux = Array2::from_shape_fn((sources.len(), freq_hz.len()), |(s, c)| amplitude(&sources[s], freq_hz[c]));
    let step = uniform_step(freq_hz);
    let phasor = |turns: f64| {
        let (cos, sin) = cos_sin_turns(turns);
        Complex64::new(cos, sin)
    };
    let mut out = Array2::zeros((uvw_m.nrows(), freq_hz.len()));
    out.axis_iter_mut(Axis(0)).into_par_iter().zip(uvw_m.axis_iter(Axis(0)).into_par_iter()).for_each(|(mut row, uvw)| {
        let [u, v, w] = [uvw[0], uvw[1], uvw[2]].map(|x| x / SPEED_OF_LIGHT_M_S);
        for (source, flux) in sources.iter().map(AsRef::as_ref).zip(flux.rows()) {
            let delay = u * source.l + v * source.m + if w_term { w * source.nm1 } else { 0.0 };
            let width = source.axes.map_or(0.0, |[a, b]| (u * a[0] + v * a[1]).powi(2) + (u * b[0] + v * b[1]).powi(2));
            let turn = step.map(|s| phasor(delay * s));
            let mut now = Complex64::ZERO;
            for (c, freq) in freq_hz.iter().enumerate() {
                now = match turn {
                    Some(turn) if c % RESTART != 0 => now * turn,
                    _ => phasor(delay * freq),
                };
                let scale = if width > 0.0 { flux[c] * (-width * freq * freq).exp() } else { flux[c] };
                row[c] += now * scale;
            }
        }
    });
    out
}

/// Visibilities of sources at the centres of the cells of the Fourier grid. The cells differ from channel to channel.
pub(crate) fn snapped_sources<S: AsRef<Seen> + Sync>(
    grid: &SkyGrid,
    sources: &[S],
    uvw: ArrayView2<'_, f64>,
    freqs: &[f64],
    amplitude: impl Fn(&S, f64) -> f64 + Sync,
) -> Array2<Complex64> {
    let mut vis = Array2::zeros((uvw.nrows(), freqs.len()));
    for (c, freq) in freqs.iter().enumerate() {
        let cells = [1.0 / (grid.n_l as f64 * grid.cell_rad), 1.0 / (grid.n_m as f64 * grid.cell_rad)];
        let per_metre = freq / SPEED_OF_LIGHT_M_S;
        let snapped = Array2::from_shape_fn((uvw.nrows(), 3), |(row, axis)| match axis {
            2 => 0.0,
            axis => (uvw[[row, axis]] * per_metre / cells[axis]).round() * cells[axis] / per_metre,
        });
        vis.slice_mut(s![.., c..=c]).assign(&sources_dft(sources, snapped.view(), &[*freq], false, &amplitude));
    }
    vis
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::dft::image_dft;
    use cittert_arrays::{SkyFrame, SkyGrid};
    use ndarray::array;

    #[test]
    fn a_gaussian_agrees_with_the_sum_over_its_pixels() {
        let center = PhaseCenter::unprojected("b");
        let (maj, min, pa) = (0.010, 0.005, 0.6_f64);
        let mut source = Source::point(0.004, -0.003, 3.0);
        source.shape = SourceShape::Gaussian { major_rad: maj, minor_rad: min, pa_rad: pa };
        let seen = [seen_from(&source, 1, &center).unwrap()];
        let grid = SkyGrid::new(96, 96, 6e-4, SkyFrame::Boresight).unwrap();
        let (a, b) = (4.0 * std::f64::consts::LN_2 / maj.powi(2), 4.0 * std::f64::consts::LN_2 / min.powi(2));
        let mut plane = Array2::from_shape_fn((96, 96), |(r, c)| {
            let (x, y) = (grid.l_at(c as f64) - 0.004, grid.m_at(r as f64) + 0.003);
            // Position angle from +m towards +l.
            let (along, across) = (x * pa.sin() + y * pa.cos(), x * pa.cos() - y * pa.sin());
            (-a * along * along - b * across * across).exp()
        });
        plane *= 3.0 / plane.sum();
        let uvw = array![[10.0, 5.0, 0.0], [-3.0, 14.0, 0.0], [9.0, -9.0, 0.0]];
        let freq = [1e9, 1.5e9];
        let truth = image_dft(&grid, plane.view(), uvw.view(), &freq, false).unwrap();
        let vis = sources_dft(&seen, uvw.view(), &freq, true, |s, f| s.source.flux_at(f));
        for (a, b) in vis.iter().zip(&truth) {
            assert!((a - b).norm() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn a_point_has_the_closed_form_on_every_channel() {
        let center = PhaseCenter::unprojected("b");
        let seen = [seen_from(&Source::point(0.02, -0.01, 1.0), 1, &center).unwrap()];
        let freq: Vec<f64> = (0..100).map(|c| 1e9 + 5e6 * f64::from(c)).collect();
        let uvw = array![[40.0, -25.0, 12.0]];
        let vis = sources_dft(&seen, uvw.view(), &freq, true, |s, f| s.source.flux_at(f));
        let path = 40.0 * 0.02 + 25.0 * 0.01 + 12.0 * ((1.0_f64 - 0.0005).sqrt() - 1.0);
        for (v, f) in vis.iter().zip(&freq) {
            let truth = Complex64::cis(std::f64::consts::TAU * path * f / 299_792_458.0);
            assert!((v - truth).norm() < 1e-13, "{v} {truth}");
        }
    }

    #[test]
    fn broken_sources_are_named() {
        let center = PhaseCenter::unprojected("b");
        let say = |s: Source| seen_from(&s, 7, &center).unwrap_err().to_string();
        assert!(say(Source::point(f64::NAN, 0.0, 1.0)).contains("source 7"));
        assert!(say(Source::point(0.9, 0.9, 1.0)).contains("source 7"));
        assert!(say(Source::point(0.0, 0.0, f64::INFINITY)).contains("flux density of source 7"));
        assert!(say(Source { spectral_index: -0.7, ..Source::point(0.0, 0.0, 1.0) }).contains("reference frequency"));
    }
}

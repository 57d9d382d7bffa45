//! Exact Fourier sums. The faster methods are tested against them.
//!
//! V(u, v, w) = sum over cells of I(l, m) exp(+2 pi i (u l + v m + w (n - 1))), with u, v, w in wavelengths of each frequency.

use crate::fourier::phasor::{cos_sin_turns, uniform_step};
use crate::{ChainError, Result};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid};
use ndarray::parallel::prelude::*;
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::Complex64;

/// Number of cells that are summed together, a multiple of `LANES`. Their phases fit into the first cache.
const CHUNK: usize = 64;
/// Number of independent partial sums, so that the processor can do several additions at the same time.
const LANES: usize = 8;
/// Number of channels after which the phase recurrence starts again. Its error stays below 32 roundings, 1e-14.
pub(crate) const RESTART: usize = 32;

/// n - 1 for direction cosines, without loss of digits; `None` behind the horizon.
pub(crate) fn n_minus_1(l: f64, m: f64) -> Option<f64> {
    let r2 = l * l + m * m;
    (r2 <= 1.0).then(|| -r2 / (1.0 + (1.0 - r2).sqrt()))
}

/// The cells of a plane that are not zero.
pub(super) struct Cells {
    l: Vec<f64>,
    m: Vec<f64>,
    nm1: Vec<f64>,
    value: Vec<f64>,
}

impl Cells {
    /// Padded with zeros to a whole number of chunks. Cells behind the horizon are left out.
    pub(super) fn of(grid: &SkyGrid, plane: ArrayView2<'_, f64>) -> Self {
        let mut cells = Self { l: Vec::new(), m: Vec::new(), nm1: Vec::new(), value: Vec::new() };
        for ((row, column), &value) in plane.indexed_iter() {
            let (l, m) = (grid.l_at(column as f64), grid.m_at(row as f64));
            if value != 0.0
                && let Some(nm1) = n_minus_1(l, m)
            {
                cells.push(l, m, nm1, value);
            }
        }
        while !cells.value.len().is_multiple_of(CHUNK) {
            cells.push(0.0, 0.0, 0.0, 0.0);
        }
        cells
    }

    pub(super) fn len(&self) -> usize {
        self.value.len()
    }

    pub(super) fn values(&self) -> &[f64] {
        &self.value
    }

    /// Direction of each cell.
    pub(super) fn directions(&self) -> Vec<[f64; 3]> {
        (0..self.len()).map(|k| [self.l[k], self.m[k], 1.0 + self.nm1[k]]).collect()
    }

    /// Some of the cells: a whole number of chunks.
    pub(super) fn part(&self, range: std::ops::Range<usize>) -> Self {
        let of = |x: &[f64]| x[range.clone()].to_vec();
        Self { l: of(&self.l), m: of(&self.m), nm1: of(&self.nm1), value: of(&self.value) }
    }

    fn push(&mut self, l: f64, m: f64, nm1: f64, value: f64) {
        self.l.push(l);
        self.m.push(m);
        self.nm1.push(nm1);
        self.value.push(value);
    }
}

/// Exact visibilities of one image plane \[m, l\] (values per cell) at baselines `uvw_m` \[row, 3\] in metres, as \[row, freq\].
///
/// Without the w term, or if every w is 0, the sum is separable and several times faster. The result is the same to rounding.
///
/// # Errors
/// The plane has another shape than the grid, or the uvw are not \[row, 3\].
///
/// # Reference
/// Thompson, Moran & Swenson 2017, eq. 3.7, with the sign convention uvw = r2 - r1.
pub fn image_dft(
    grid: &SkyGrid,
    plane: ArrayView2<'_, f64>,
    uvw_m: ArrayView2<'_, f64>,
    freq_hz: &[f64],
    w_term: bool,
) -> Result<Array2<Complex64>> {
    check_shapes(grid, plane, uvw_m)?;
    let flat = !w_term || uvw_m.column(2).iter().all(|w| *w == 0.0);
    let mut out = Array2::zeros((uvw_m.nrows(), freq_hz.len()));
    let cells = Cells::of(grid, plane);
    if flat && cells.value.len() > 2 * (grid.n_l + grid.n_m) {
        separable(grid, plane, uvw_m, freq_hz, &mut out);
    } else {
        let step = uniform_step(freq_hz);
        out.axis_iter_mut(Axis(0)).into_par_iter().zip(uvw_m.axis_iter(Axis(0)).into_par_iter()).for_each(|(mut row, uvw)| {
            let w = if w_term { uvw[2] } else { 0.0 };
            sum_cells(&cells, &cells.value, [uvw[0], uvw[1], w], freq_hz, step, &mut |c, v| row[c] += v);
        });
    }
    Ok(out)
}

fn check_shapes(grid: &SkyGrid, plane: ArrayView2<'_, f64>, uvw_m: ArrayView2<'_, f64>) -> Result<()> {
    let mismatch = |what, expected, found: &[usize]| {
        Err(ChainError::Array(cittert_arrays::ArrayError::ShapeMismatch { what, expected, found: found.to_vec() }))
    };
    if plane.shape() != [grid.n_m, grid.n_l] {
        return mismatch("image plane", vec![grid.n_m, grid.n_l], plane.shape());
    }
    if uvw_m.ncols() != 3 {
        return mismatch("uvw", vec![uvw_m.nrows(), 3], uvw_m.shape());
    }
    Ok(())
}

/// The sum over the cells, with these values, for one baseline and all frequencies.
pub(super) fn sum_cells(
    cells: &Cells,
    values: &[f64],
    uvw: [f64; 3],
    freq_hz: &[f64],
    step: Option<f64>,
    add: &mut impl FnMut(usize, Complex64),
) {
    let mut delay = [0.0; CHUNK]; // in seconds of light time
    let (mut re, mut im) = ([0.0; CHUNK], [0.0; CHUNK]);
    let (mut step_re, mut step_im) = ([1.0; CHUNK], [0.0; CHUNK]);
    let uvw = uvw.map(|x| x / SPEED_OF_LIGHT_M_S);
    for start in (0..values.len()).step_by(CHUNK) {
        let range = start..start + CHUNK;
        let (l, m, nm1, value) = (&cells.l[range.clone()], &cells.m[range.clone()], &cells.nm1[range.clone()], &values[range]);
        for k in 0..CHUNK {
            delay[k] = uvw[0] * l[k] + uvw[1] * m[k] + uvw[2] * nm1[k];
        }
        if let Some(step) = step {
            for k in 0..CHUNK {
                (step_re[k], step_im[k]) = cos_sin_turns(delay[k] * step);
            }
        }
        for (c, freq) in freq_hz.iter().enumerate() {
            if step.is_none() || c % RESTART == 0 {
                for k in 0..CHUNK {
                    let (cos, sin) = cos_sin_turns(delay[k] * freq);
                    (re[k], im[k]) = (value[k] * cos, value[k] * sin);
                }
            } else {
                for k in 0..CHUNK {
                    (re[k], im[k]) = (re[k] * step_re[k] - im[k] * step_im[k], re[k] * step_im[k] + im[k] * step_re[k]);
                }
            }
            add(c, Complex64::new(lane_sum(&re), lane_sum(&im)));
        }
    }
}

fn lane_sum(values: &[f64; CHUNK]) -> f64 {
    let mut lanes = [0.0; LANES];
    for part in values.chunks_exact(LANES) {
        for (lane, v) in lanes.iter_mut().zip(part) {
            *lane += v;
        }
    }
    lanes.iter().sum()
}

/// The sum without w. Because exp(2 pi i (u l + v m)) = exp(2 pi i u l) exp(2 pi i v m), it needs one phasor for each row and each column instead
/// of one for each cell.
fn separable(grid: &SkyGrid, plane: ArrayView2<'_, f64>, uvw_m: ArrayView2<'_, f64>, freq_hz: &[f64], out: &mut Array2<Complex64>) {
    // A copy in row order, in which cells behind the horizon are 0.
    let visible = |at: (usize, usize)| n_minus_1(grid.l_at(at.1 as f64), grid.m_at(at.0 as f64)).is_some();
    let cells: Vec<f64> = plane.indexed_iter().map(|(at, v)| if visible(at) { *v } else { 0.0 }).collect();
    let lines: Vec<(usize, &[f64])> = cells.chunks_exact(grid.n_l).enumerate().filter(|(_, line)| line.iter().any(|v| *v != 0.0)).collect();
    out.axis_iter_mut(Axis(0)).into_par_iter().zip(uvw_m.axis_iter(Axis(0)).into_par_iter()).for_each(|(mut out, uvw)| {
        let (mut cos, mut sin) = (vec![0.0; grid.n_l], vec![0.0; grid.n_l]);
        for (c, freq) in freq_hz.iter().enumerate() {
            let (u, v) = (uvw[0] * freq / SPEED_OF_LIGHT_M_S, uvw[1] * freq / SPEED_OF_LIGHT_M_S);
            for column in 0..grid.n_l {
                (cos[column], sin[column]) = cos_sin_turns(u * grid.l_at(column as f64));
            }
            let mut sum = Complex64::ZERO;
            for (row, line) in &lines {
                let (re, im) = cos_sin_turns(v * grid.m_at(*row as f64));
                sum += Complex64::new(dot(line, &cos), dot(line, &sin)) * Complex64::new(re, im);
            }
            out[c] += sum;
        }
    });
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    let (parts_a, parts_b) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = parts_a.remainder().iter().zip(parts_b.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in parts_a.zip(parts_b) {
        for k in 0..LANES {
            lanes[k] += x[k] * y[k];
        }
    }
    rest + lanes.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;
    use ndarray::array;
    use proptest::prelude::*;

    fn sky(n: usize, cell: f64) -> SkyGrid {
        SkyGrid::new(n, n, cell, SkyFrame::Sky { ra_rad: 0.1, dec_rad: 0.2, frame: "icrs".into() }).unwrap()
    }

    /// The direct sum in 20 lines, independent of the code above.
    fn naive(grid: &SkyGrid, plane: &Array2<f64>, uvw: [f64; 3], freq: f64) -> Complex64 {
        let wavelength = 299_792_458.0 / freq;
        let mut sum = Complex64::ZERO;
        for ((row, column), t) in plane.indexed_iter() {
            let (l, m) = (grid.l_at(column as f64), grid.m_at(row as f64));
            let n = (1.0 - l * l - m * m).sqrt();
            let phase = std::f64::consts::TAU * (uvw[0] * l + uvw[1] * m + uvw[2] * (n - 1.0)) / wavelength;
            sum += Complex64::from_polar(*t, phase);
        }
        sum
    }

    #[test]
    fn one_source_has_the_closed_form_on_every_channel() {
        let grid = sky(64, 2e-4);
        let mut plane = Array2::zeros((64, 64));
        let (row, column) = (40, 17);
        plane[[row, column]] = 2.5;
        let (l, m) = (grid.l_at(17.0), grid.m_at(40.0));
        assert!(l > 0.0 && m > 0.0, "column 17 lies east of the centre");
        let uvw = array![[12.3, -45.6, 7.8], [-3.0, 4.0, -50.0], [0.0, 0.0, 0.0]];
        let freq: Vec<f64> = (0..100).map(|c| 1e9 + 5e6 * f64::from(c)).collect();
        let vis = image_dft(&grid, plane.view(), uvw.view(), &freq, true).unwrap();
        let nm1 = (1.0 - l * l - m * m).sqrt() - 1.0;
        for (r, b) in uvw.rows().into_iter().enumerate() {
            for (c, f) in freq.iter().enumerate() {
                let phase = std::f64::consts::TAU * (b[0] * l + b[1] * m + b[2] * nm1) * f / 299_792_458.0;
                let truth = Complex64::from_polar(2.5, phase);
                assert!((vis[[r, c]] - truth).norm() < 2.5e-13, "{r} {c} {:e}", (vis[[r, c]] - truth).norm());
            }
        }
    }

    #[test]
    fn the_separable_sum_and_the_cell_sum_are_the_naive_sum() {
        let grid = sky(31, 1e-3);
        let plane = Array2::from_shape_fn((31, 31), |(r, c)| ((r * 7 + c * 13) % 11) as f64 - 3.0);
        let uvw = array![[30.0, 20.0, 0.0], [-11.0, 70.0, 0.0]];
        let tilted = array![[30.0, 20.0, 60.0], [-11.0, 70.0, -33.0]];
        let freq = [1.0e9, 1.1e9, 1.25e9];
        let total = plane.iter().map(|v: &f64| v.abs()).sum::<f64>();
        for (uvw, w_term) in [(&uvw, true), (&tilted, true), (&tilted, false)] {
            let vis = image_dft(&grid, plane.view(), uvw.view(), &freq, w_term).unwrap();
            for (r, b) in uvw.rows().into_iter().enumerate() {
                for (c, f) in freq.iter().enumerate() {
                    let truth = naive(&grid, &plane, [b[0], b[1], if w_term { b[2] } else { 0.0 }], *f);
                    assert!((vis[[r, c]] - truth).norm() < 1e-13 * total, "{r} {c}");
                }
            }
        }
    }

    /// The order of the numbers in memory does not matter.
    #[test]
    fn a_transposed_plane_gives_the_sum_of_its_copy() {
        let grid = SkyGrid::new(12, 9, 1e-3, SkyFrame::Boresight).unwrap();
        let plane = Array2::from_shape_fn((12, 9), |(r, c)| (r * 9 + c) as f64).reversed_axes();
        let uvw = array![[30.0, 20.0, 0.0]];
        let vis = image_dft(&grid, plane.view(), uvw.view(), &[1e9], true).unwrap();
        let copy = Array2::from_shape_fn((9, 12), |at| plane[at]);
        assert_eq!(vis, image_dft(&grid, copy.view(), uvw.view(), &[1e9], true).unwrap());
        assert!(vis[[0, 0]].norm() > 1.0);
    }

    #[test]
    fn a_plane_of_another_shape_is_refused() {
        let e = image_dft(&sky(8, 1e-3), Array2::zeros((8, 9)).view(), Array2::zeros((1, 3)).view(), &[1e9], true).unwrap_err();
        assert!(e.to_string().contains("[8, 9]"), "{e}");
    }

    fn planes() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
        (prop::collection::vec(-5.0..5.0, 64), prop::collection::vec(-5.0..5.0, 64))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn the_sum_is_linear((a, b) in planes(), x in -3.0..3.0_f64, u in -60.0..60.0_f64, v in -60.0..60.0_f64, w in -60.0..60.0_f64) {
            let grid = sky(8, 5e-3);
            let (a, b) = (Array2::from_shape_vec((8, 8), a).unwrap(), Array2::from_shape_vec((8, 8), b).unwrap());
            let mixed = &a + &(&b * x);
            let go = |p: &Array2<f64>| image_dft(&grid, p.view(), array![[u, v, w]].view(), &[1e9], true).unwrap()[[0, 0]];
            prop_assert!((go(&mixed) - go(&a) - go(&b) * x).norm() < 1e-11);
        }

        #[test]
        fn the_opposite_baseline_sees_the_conjugate((a, _) in planes(), u in -60.0..60.0_f64, v in -60.0..60.0_f64, w in -60.0..60.0_f64) {
            let grid = sky(8, 5e-3);
            let a = Array2::from_shape_vec((8, 8), a).unwrap();
            let vis = image_dft(&grid, a.view(), array![[u, v, w], [-u, -v, -w]].view(), &[1e9, 1.3e9], true).unwrap();
            for c in 0..2 {
                prop_assert!((vis[[0, c]] - vis[[1, c]].conj()).norm() < 1e-12);
            }
        }

        #[test]
        fn parseval_holds_on_the_conjugate_grid((a, _) in planes()) {
            // Baselines on the 8 x 8 cells of the Fourier grid, 1 / (N cell) apart.
            let (grid, n, freq) = (sky(8, 5e-3), 8_i32, 1e9);
            let a = Array2::from_shape_vec((8, 8), a).unwrap();
            let du_m = 299_792_458.0 / freq / (8.0 * 5e-3);
            let uvw = Array2::from_shape_fn((64, 3), |(k, axis)| {
                let k = k as i32;
                [f64::from(k % n - n / 2) * du_m, f64::from(k / n - n / 2) * du_m, 0.0][axis]
            });
            let vis = image_dft(&grid, a.view(), uvw.view(), &[freq], true).unwrap();
            let power: f64 = vis.iter().map(|v| v.norm_sqr()).sum();
            let truth = 64.0 * a.iter().map(|v| v * v).sum::<f64>();
            prop_assert!((power - truth).abs() < 1e-11 * truth.max(1.0), "{power} {truth}");
        }
    }
}

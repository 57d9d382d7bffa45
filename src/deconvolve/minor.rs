//! The minor cycle: its input, its limits and its result.

use crate::finite::all_finite;
use crate::{ChainError, Result};
use ndarray::{Array2, ArrayView1, ArrayView2, Axis};
use rayon::prelude::*;

/// Scales of a deconvolver, for one beam.
#[derive(Debug, Clone, PartialEq)]
pub struct Scales {
    /// Widths in pixels, 0 for points. If empty, they are chosen from the beam and the size of the image.
    pub widths_px: Vec<f64>,
    /// How strongly small scales are preferred: a scale s competes with its peak times 1 - bias s / (largest scale).
    pub bias: f64,
    /// Width of the main lobe in pixels, for scales that are chosen.
    pub beam_px: f64,
}

impl Default for Scales {
    fn default() -> Self {
        Self { widths_px: Vec::new(), bias: 0.6, beam_px: 4.0 }
    }
}

/// A deconvolver that was made for one dirty beam.
pub trait Deconvolver: Send {
    /// Remove components from `cycle.residual` until a limit is reached.
    ///
    /// # Errors
    /// An array has another shape than the beam.
    fn minor(&mut self, cycle: Minor<'_>) -> Result<MinorReport>;

    /// Add components to a model in flux per pixel \[m, l\]. Components of an algorithm without scales are points.
    fn draw(&self, components: &[Component], model: &mut Array2<f64>) {
        for c in components {
            model[(c.row, c.column)] += c.flux;
        }
    }
}

/// The input of a minor cycle. All arrays are \[m, l\].
#[derive(Debug)]
pub struct Minor<'a> {
    /// Residual, flux per beam. The minor cycle updates it.
    pub residual: &'a mut Array2<f32>,
    /// The pixels where components are allowed. Without a mask all pixels are allowed.
    pub mask: Option<&'a Array2<bool>>,
    /// The limits at which the cycle stops.
    pub limits: MinorLimits,
}

/// The limits at which a minor cycle stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MinorLimits {
    /// Loop gain: the fraction of the peak that one component removes.
    pub gain: f64,
    /// Stop when the largest absolute residual within the mask is at most this level.
    pub level: f64,
    /// Stop after this number of components.
    pub iterations: usize,
    /// Accept negative components too.
    pub negative: bool,
}

impl MinorLimits {
    /// Why a cycle stops whose residual has this peak after some components; `None` while it goes on.
    pub(super) fn reached(&self, peak: f64, components: usize) -> Option<MinorStop> {
        match peak {
            0.0 => Some(MinorStop::Nothing),
            p if p <= self.level => Some(MinorStop::Level),
            _ => (components >= self.iterations).then_some(MinorStop::Iterations),
        }
    }
}

/// The reason why a minor cycle stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MinorStop {
    /// The peak is at or below the level.
    Level,
    /// All iterations are used.
    Iterations,
    /// The peak grew. The state with the lowest peak is kept.
    Diverged,
    /// The residual is 0 (or negative, without negative components) everywhere in the mask.
    Nothing,
}

/// One component.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Component {
    /// Row (m) of its centre.
    pub row: usize,
    /// Column (l) of its centre.
    pub column: usize,
    /// Integrated flux.
    pub flux: f64,
    /// Width of its scale in pixels; 0 for a point.
    pub scale_px: f64,
}

impl Component {
    /// A point component.
    pub(crate) fn point(row: usize, column: usize, flux: f64) -> Self {
        Self { row, column, flux, scale_px: 0.0 }
    }
}

/// The result of a minor cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct MinorReport {
    /// Why the cycle stopped.
    pub stop: MinorStop,
    /// The components in the order in which they were removed.
    pub components: Vec<Component>,
}

/// The largest pixel of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Peak {
    pub(crate) value: f64,
    pub(crate) row: usize,
    pub(crate) column: usize,
}

/// The pixel with the largest absolute value (without negative components: the largest value) within the mask. The first pixel wins a tie.
/// `None` if no pixel is above 0.
pub(crate) fn peak_of(image: ArrayView2<'_, f32>, mask: Option<&Array2<bool>>, negative: bool) -> Option<Peak> {
    let size = |v: f32| if negative { v.abs() } else { v };
    let larger = |best: Option<Peak>, (row, line): (usize, ArrayView1<'_, f32>)| {
        let mut largest = best.map_or(0.0, |b| size(b.value as f32));
        // Most rows have no larger pixel, and a maximum alone is found with vectors.
        if !(top(line, negative) > largest) {
            return best;
        }
        let mut best = best;
        for (column, v) in line.iter().enumerate() {
            if size(*v) > largest && mask.is_none_or(|m| m[(row, column)]) {
                largest = size(*v);
                best = Some(Peak { value: f64::from(*v), row, column });
            }
        }
        best
    };
    let first = |a: Option<Peak>, b: Option<Peak>| match (a, b) {
        (Some(x), Some(y)) if y.value.abs() > x.value.abs() => b,
        (None, _) => b,
        _ => a,
    };
    image.axis_iter(Axis(0)).into_par_iter().enumerate().fold(|| None, larger).reduce(|| None, first)
}

/// The largest value, or absolute value, of a row; 0 if none is above 0.
fn top(line: ArrayView1<'_, f32>, negative: bool) -> f32 {
    let Some(values) = line.as_slice() else {
        return line.iter().fold(0.0, |a, v| if negative { v.abs() } else { *v }.max(a));
    };
    let mut lanes = [0.0_f32; 32];
    let (whole, rest) = values.as_chunks::<32>();
    for values in whole {
        for k in 0..32 {
            let size = if negative { values[k].abs() } else { values[k] };
            lanes[k] = if size > lanes[k] { size } else { lanes[k] };
        }
    }
    rest.iter().map(|v| if negative { v.abs() } else { *v }).chain(lanes).fold(0.0, f32::max)
}

/// The size of the pixel of [`peak_of`]; 0 if there is none.
pub(crate) fn peak_size(image: ArrayView2<'_, f32>, mask: Option<&Array2<bool>>, negative: bool) -> f64 {
    peak_of(image, mask, negative).map_or(0.0, |p| p.value.abs())
}

/// Largest |value| of those pixels of a beam \[m, l\] whose (row, column) `counts`; 0 if there is none.
pub(crate) fn largest_where(beam: ArrayView2<'_, f32>, counts: impl Fn((usize, usize)) -> bool + Sync) -> f32 {
    let of_row = |(i, row): (usize, ArrayView1<'_, f32>)| {
        row.iter().enumerate().filter(|(j, _)| counts((i, *j))).fold(0.0_f32, |a, (_, v)| a.max(v.abs()))
    };
    beam.axis_iter(Axis(0)).into_par_iter().enumerate().map(of_row).reduce(|| 0.0, f32::max)
}

/// Check that a dirty beam is finite and has its peak of 1 at the centre pixel.
pub(super) fn check_beam(psf: ArrayView2<'_, f32>) -> Result<()> {
    let Some(center) = psf.get((psf.nrows() / 2, psf.ncols() / 2)) else {
        return Err(ChainError::Incompatible("a deconvolver needs a dirty beam of at least one pixel".into()));
    };
    if (center - 1.0).abs() <= 1e-6 && all_finite(&psf, f64::from) {
        return Ok(());
    }
    let message = format!("a deconvolver needs a finite dirty beam with its peak of 1 at the centre pixel, which has {center}");
    Err(ChainError::Incompatible(message))
}

/// Check that all arrays of a cycle have the shape of the beam.
pub(super) fn check_cycle(cycle: &Minor<'_>, shape: (usize, usize)) -> Result<()> {
    let mask = cycle.mask.map_or(shape, |m| m.dim());
    let residual = cycle.residual.dim();
    if [residual, mask].iter().any(|d| *d != shape) {
        let message = format!("residual {residual:?}, mask {mask:?} and beam {shape:?} must have one shape");
        return Err(ChainError::Incompatible(message));
    }
    Ok(())
}

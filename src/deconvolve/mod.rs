//! Deconvolvers: what turns a residual and a beam into components.
//!
//! Each is a minor cycle between two major cycles (see [`crate::imaging::major`]): it takes components off the residual until the peak is
//! down to a level or the iterations are used up. A new one is a file here and a row of [`TABLE`]; the names, help texts and
//! documentation iterate the table.

mod clark;
mod hogbom;
mod multiscale;
mod options;
#[cfg(test)]
mod tests;
mod tiles;

pub use options::{Algorithm, CleanOptions, SkyBox, by_name};

use crate::{ChainError, Result};
use ndarray::{Array2, ArrayView1, ArrayView2, Axis};
use rayon::prelude::*;

/// A deconvolver made for one beam.
pub trait Deconvolver: Send {
    /// Take components from `cycle.residual` until a limit is reached, and add them to `cycle.model`.
    ///
    /// # Errors
    /// Arrays of another shape than the beam's.
    fn minor(&mut self, cycle: Minor<'_>) -> Result<MinorReport>;
}

/// What a minor cycle works on. All arrays are \[m, l\].
#[derive(Debug)]
pub struct Minor<'a> {
    /// Residual, flux a beam; brought up to date on return.
    pub residual: &'a mut Array2<f64>,
    /// Model, flux a pixel.
    pub model: &'a mut Array2<f64>,
    /// Where components may be; everywhere if not given.
    pub mask: Option<&'a Array2<bool>>,
    /// When to stop.
    pub limits: MinorLimits,
}

/// When a minor cycle stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MinorLimits {
    /// Part of the peak that one component takes.
    pub gain: f64,
    /// Stop when the largest absolute residual within the mask is at most this.
    pub level: f64,
    /// Stop after so many components.
    pub iterations: usize,
    /// Take negative components too.
    pub negative: bool,
}

/// Why a minor cycle stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MinorStop {
    /// The peak is down to the level.
    Level,
    /// All iterations are used.
    Iterations,
    /// The peak grew; the best state was kept.
    Diverged,
    /// No pixel of the mask has anything to take.
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

/// What a minor cycle did.
#[derive(Debug, Clone, PartialEq)]
pub struct MinorReport {
    /// Number of components taken.
    pub iterations: usize,
    /// Largest absolute residual within the mask afterwards.
    pub peak: f64,
    /// Why it stopped.
    pub stop: MinorStop,
    /// What was taken, in order.
    pub components: Vec<Component>,
}

/// Makes a deconvolver for a dirty beam \[m, l\] with its peak of 1 at the centre pixel and a main lobe of so many pixels.
pub type Make = fn(ArrayView2<'_, f64>, &CleanOptions, f64) -> Result<Box<dyn Deconvolver>>;

/// A deconvolver by name.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line of help.
    pub summary: &'static str,
    /// Its paper.
    pub reference: &'static str,
    /// Makes it.
    pub make: Make,
}

/// All deconvolvers.
pub const TABLE: [Entry; 3] = [
    Entry {
        name: "hogbom",
        summary: "exact point components over the whole image",
        reference: "Högbom 1974, A&AS 15, 417",
        make: hogbom::make,
    },
    Entry {
        name: "clark",
        summary: "point components among the brightest pixels with a patch of the beam, corrected by FFT",
        reference: "Clark 1980, A&A 89, 377",
        make: clark::make,
    },
    Entry {
        name: "multiscale",
        summary: "components of several widths, for extended emission",
        reference: "Cornwell 2008, IEEE JSTSP 2, 793",
        make: multiscale::make,
    },
];

/// Growth of the peak above the smallest of the cycle at which a minor cycle has diverged.
const DIVERGED: f64 = 1.1;

/// Largest absolute value (or value, without negative components) within the mask, and where; ties go to the first pixel.
pub(crate) fn peak_of(image: ArrayView2<'_, f64>, mask: Option<&Array2<bool>>, negative: bool) -> Option<(f64, (usize, usize))> {
    let of_row = |(i, row): (usize, ArrayView1<'_, f64>)| {
        let mut best: Option<(f64, (usize, usize))> = None;
        let mut largest = 0.0;
        for (j, v) in row.iter().enumerate() {
            let size = if negative { v.abs() } else { *v };
            if size > largest && mask.is_none_or(|m| m[(i, j)]) {
                largest = size;
                best = Some((*v, (i, j)));
            }
        }
        best
    };
    let first = |a: Option<(f64, (usize, usize))>, b: Option<(f64, (usize, usize))>| match (a, b) {
        (Some(x), Some(y)) if y.0.abs() > x.0.abs() => b,
        (None, _) => b,
        _ => a,
    };
    image.axis_iter(Axis(0)).into_par_iter().enumerate().map(of_row).reduce(|| None, first)
}

fn check_beam(psf: ArrayView2<'_, f64>) -> Result<()> {
    let center = psf.get((psf.nrows() / 2, psf.ncols() / 2)).copied().unwrap_or(f64::NAN);
    if (center - 1.0).abs() <= 1e-6 && psf.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    let message = format!("a deconvolver needs a finite dirty beam with its peak of 1 at the centre pixel, which has {center}");
    Err(ChainError::Incompatible(message))
}

fn check_cycle(cycle: &Minor<'_>, shape: (usize, usize)) -> Result<()> {
    let mask = cycle.mask.map_or(shape, |m| m.dim());
    if [cycle.residual.dim(), cycle.model.dim(), mask].iter().any(|d| *d != shape) {
        let message = format!(
            "residual {:?}, model {:?}, mask {mask:?} and beam {shape:?} must have one shape",
            cycle.residual.dim(),
            cycle.model.dim()
        );
        return Err(ChainError::Incompatible(message));
    }
    Ok(())
}

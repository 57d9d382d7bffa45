//! The error-free observation of a point of the grid, and the image that its trials are held against.

use crate::imaging::major::{CleanOptions, clean};
use crate::imaging::{CleanProducts, Imager, ImagingOptions};
use crate::progress::Silent;
use crate::simulate::random::stream;
use crate::{ChainError, Result};
use cittert_arrays::{ArrayLayout, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySet, VisibilitySource};
use ndarray::{Array2, Axis};
use rand::RngExt;
use std::sync::{Arc, OnceLock};

/// Which antennas of the layout take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Antennas {
    /// All of them.
    All,
    /// The first so many, in the order of the layout.
    First(usize),
    /// So many, drawn anew for each seed.
    Random(usize),
}

/// An observation without errors, and how it is imaged. Trials share it.
#[derive(Debug)]
pub struct Base {
    /// Error-free, noise-free visibilities.
    pub set: VisibilitySet,
    /// How images are made.
    pub imaging: ImagingOptions,
    /// How they are cleaned.
    pub clean: CleanOptions,
    reference: OnceLock<Arc<Reference>>,
}

/// The image that the errors spoil.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The restored image of the error-free data, without a constant that images add back \[m, l\].
    pub image: Array2<f64>,
    /// True where the model, seen with the beam, exceeds 1e-3 of its peak \[m, l\].
    pub on_source: Array2<bool>,
    /// Imaging with the size and cell that were chosen.
    pub imaging: ImagingOptions,
}

/// Part of the peak above which a pixel belongs to the source.
pub const ON_SOURCE: f64 = 1e-3;

impl Base {
    /// A base of error-free data.
    #[must_use]
    pub fn new(set: VisibilitySet, imaging: ImagingOptions, clean: CleanOptions) -> Self {
        Self { set, imaging, clean, reference: OnceLock::new() }
    }

    /// The base with some of the antennas alone.
    ///
    /// # Errors
    /// Fewer than two antennas, or more than the layout has; no row left.
    pub fn with(&self, antennas: Antennas, seed: u64) -> Result<Self> {
        let n_ant = self.set.header.layout.n_ant();
        let chosen: Vec<usize> = match antennas {
            Antennas::All => (0..n_ant).collect(),
            Antennas::First(n) => (0..checked(n, n_ant)?).collect(),
            Antennas::Random(n) => draw(checked(n, n_ant)?, n_ant, seed),
        };
        Ok(Self::new(subset(&self.set, &chosen)?, self.imaging.clone(), self.clean.clone()))
    }

    /// The image of the error-free data, made when it is first asked for.
    ///
    /// # Errors
    /// Whatever keeps an image from being made; an image without a source.
    pub fn reference(&self) -> Result<Arc<Reference>> {
        if let Some(r) = self.reference.get() {
            return Ok(r.clone());
        }
        let mut set = self.set.clone();
        let products = image(&mut set, &self.imaging, &self.clean)?;
        let restored = plane(&products);
        let grid = &products.restored.grid;
        let model = &restored - &products.residual.plane(0, 0);
        let peak = model.iter().copied().fold(0.0, f64::max);
        if !(peak > 0.0) {
            return Err(ChainError::NoData(
                "the image of the error-free data shows no source: check the scene, the size of the image and the number of components"
                    .into(),
            ));
        }
        let imaging = ImagingOptions { size: Some((grid.n_l, grid.n_m)), cell_rad: Some(grid.cell_rad), ..self.imaging.clone() };
        let made = Arc::new(Reference { on_source: model.mapv(|v| v.abs() > ON_SOURCE * peak), image: restored, imaging });
        Ok(self.reference.get_or_init(|| made).clone())
    }
}

fn checked(n: usize, n_ant: usize) -> Result<usize> {
    if (2..=n_ant).contains(&n) {
        return Ok(n);
    }
    Err(ChainError::BadOption { option: "number of antennas", value: n.to_string(), expected: format!("2 to the {n_ant} of the layout") })
}

/// Indices of `n` of `n_ant` antennas, growing: the start of a shuffle.
fn draw(n: usize, n_ant: usize, seed: u64) -> Vec<usize> {
    let mut rng = stream(seed, "antennas of a study", 0);
    let mut all: Vec<usize> = (0..n_ant).collect();
    for k in 0..n {
        let other = rng.random_range(k..n_ant);
        all.swap(k, other);
    }
    all.truncate(n);
    all.sort_unstable();
    all
}

/// The rows between chosen antennas, with the layout of these alone.
fn subset(set: &VisibilitySet, chosen: &[usize]) -> Result<VisibilitySet> {
    let header = &set.header;
    if chosen.len() == header.layout.n_ant() {
        return Ok(set.clone());
    }
    let mut place = vec![None; header.layout.n_ant()];
    chosen.iter().enumerate().for_each(|(new, old)| place[*old] = u32::try_from(new).ok());
    let from = &set.data;
    let at = |a: u32| place.get(a as usize).copied().flatten();
    let rows: Vec<usize> =
        (0..from.n_rows()).filter(|r| at(from.coverage.ant1[*r]).is_some() && at(from.coverage.ant2[*r]).is_some()).collect();
    if rows.is_empty() {
        return Err(ChainError::NoData(format!("no baseline is left between the {} antennas chosen", chosen.len())));
    }
    let mut coverage: UvCoverage = from.coverage.select(&rows)?;
    for ant in coverage.ant1.iter_mut().chain(&mut coverage.ant2) {
        *ant = at(*ant).unwrap_or_default();
    }
    let data = VisibilityBlock::new(
        coverage,
        from.vis.select(Axis(0), &rows),
        from.weights.select(Axis(0), &rows),
        from.flags.select(Axis(0), &rows),
        from.nsamples.select(Axis(0), &rows),
    )?;
    let antennas = chosen.iter().map(|k| header.layout.antennas()[*k].clone()).collect();
    let layout = ArrayLayout::new(header.layout.name.clone(), header.layout.frame, antennas)?;
    Ok(VisibilitySet::new(VisibilityHeader { layout, ..header.clone() }, data)?)
}

/// Image and clean a set.
pub(super) fn image(set: &mut dyn VisibilitySource, imaging: &ImagingOptions, options: &CleanOptions) -> Result<CleanProducts> {
    let mut imager = Imager::new(set, imaging.clone(), &Silent)?;
    clean(&mut imager, options, &Silent)
}

/// The restored image without the constant that was added back \[m, l\].
pub(super) fn plane(products: &CleanProducts) -> Array2<f64> {
    let constant = products.restored.pedestal_k.unwrap_or(0.0);
    products.restored.plane(0, 0).mapv(|v| v - constant)
}

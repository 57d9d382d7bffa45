//! The error-free observation of a point of the grid, and the image with which its trials are compared.

use crate::imaging::major::{CleanOptions, clean};
use crate::imaging::{BeamShape, CleanProducts, Imager, ImagingOptions};
use crate::mem::{MemOptions, MemPlan, Uncertainty, mem};
use crate::progress::Silent;
use crate::random::stream;
use crate::simulate::SkyModel;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::quantity::Angle;
use cittert_arrays::{ArrayLayout, Image, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySet, VisibilitySource};
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
    /// This number of antennas, drawn again for each seed.
    Random(usize),
}

/// How the images of a study are deconvolved, and with what they are compared.
#[derive(Debug, Clone)]
pub enum Deconvolution {
    /// CLEAN, compared with the restored image of the error-free data.
    Clean(Box<CleanOptions>),
    /// Maximum entropy: the unconvolved image, compared with the scene itself on the same grid \[m, l\], in the unit of the image.
    Mem(Array2<f64>),
}

/// An image of a trial.
pub(super) struct Seen {
    /// The restored image of CLEAN, or the unconvolved image of maximum entropy, without a constant that was added back \[m, l\].
    pub(super) image: Array2<f64>,
    /// Peak of the restored image, without a constant that was added back.
    pub(super) restored_peak: f64,
    /// Rms of the residual image.
    pub(super) residual_rms: f64,
}

/// An observation without errors, and the options of its image. Trials share it.
#[derive(Debug)]
pub struct Base {
    /// Error-free, noise-free visibilities.
    pub set: VisibilitySet,
    /// How images are made.
    pub imaging: ImagingOptions,
    /// How they are deconvolved.
    pub deconvolution: Deconvolution,
    /// The scene, for errors that change what each baseline sees of it.
    pub scene: Option<Arc<SkyModel>>,
    reference: OnceLock<Arc<Reference>>,
}

/// The image without errors.
#[derive(Debug, Clone)]
pub struct Reference {
    /// The restored image of the error-free data, without a constant that images add back, or the scene \[m, l\].
    pub image: Array2<f64>,
    /// True where the model, convolved with the beam, or the scene exceeds 1e-3 of its peak \[m, l\].
    pub on_source: Array2<bool>,
    /// Imaging with the size and cell that were chosen.
    pub imaging: ImagingOptions,
    /// The restoring beam of the image.
    pub beam: Option<BeamShape>,
}

/// Standard deviation of data without noise for maximum entropy, over the rms of the visibilities. Its image fits the data to their noise, so
/// data without noise need a scale. Thermal noise among the errors of a study replaces it.
const NO_NOISE: f64 = 0.01;
/// Largest number of evaluations of maximum entropy for data with gain errors. No image explains such data, so the solver would not end.
const HOPELESS: usize = 40;
/// Fraction of the peak above which a pixel belongs to the source.
pub const ON_SOURCE: f64 = 1e-3;

impl Base {
    /// A base of error-free data.
    #[must_use]
    pub fn new(mut set: VisibilitySet, imaging: ImagingOptions, deconvolution: Deconvolution) -> Self {
        if matches!(deconvolution, Deconvolution::Mem(_)) {
            weigh(&mut set);
        }
        Self { set, imaging, deconvolution, scene: None, reference: OnceLock::new() }
    }

    /// The base with the scene of which its set holds the visibilities.
    #[must_use]
    pub fn observing(mut self, scene: SkyModel) -> Self {
        self.scene = Some(Arc::new(scene));
        self
    }

    /// The base with only some of the antennas.
    ///
    /// # Errors
    /// There are fewer than two antennas, more than the layout has, or no row between them.
    pub fn with(&self, antennas: Antennas, seed: u64) -> Result<Self> {
        let n_ant = self.set.header.layout.n_ant();
        let chosen: Vec<usize> = match antennas {
            Antennas::All => (0..n_ant).collect(),
            Antennas::First(n) => (0..checked(n, n_ant)?).collect(),
            Antennas::Random(n) => draw(checked(n, n_ant)?, n_ant, seed),
        };
        let part = Self::new(subset(&self.set, &chosen)?, self.imaging.clone(), self.deconvolution.clone());
        Ok(Self { scene: self.scene.clone(), ..part })
    }

    /// The image of the error-free data. It is made at the first call.
    ///
    /// # Errors
    /// The image cannot be made, or shows no source.
    pub fn reference(&self) -> Result<Arc<Reference>> {
        if let Some(r) = self.reference.get() {
            return Ok(r.clone());
        }
        let made = Arc::new(match &self.deconvolution {
            Deconvolution::Clean(options) => self.cleaned(options)?,
            Deconvolution::Mem(scene) => {
                let peak = scene.iter().copied().fold(0.0, f64::max);
                Reference {
                    on_source: scene.mapv(|v| v > ON_SOURCE * peak),
                    image: scene.clone(),
                    imaging: self.imaging.clone(),
                    beam: None,
                }
            }
        });
        Ok(self.reference.get_or_init(|| made).clone())
    }

    /// The restored image of the error-free data.
    fn cleaned(&self, options: &CleanOptions) -> Result<Reference> {
        let mut set = self.set.clone();
        let products = clean(&mut Imager::new(&mut set, self.imaging.clone(), &Silent)?, options, &Silent)?;
        let restored = plane(&products.restored);
        let grid = &products.restored.grid;
        let model = &restored - &products.residual.plane(0, 0);
        let peak = model.iter().copied().fold(0.0, f64::max);
        if !(peak > 0.0) {
            return Err(ChainError::NoData(
                "the image of the error-free data shows no source: check the scene, the size of the image and the number of components"
                    .into(),
            ));
        }
        let imaging = self.imaging.on_grid(grid);
        let beam = products.beams.first().map(|b| BeamShape {
            major: Angle(b.bmaj_rad),
            minor: Angle(b.bmin_rad),
            position_angle: Angle(b.bpa_rad),
        });
        Ok(Reference { on_source: model.mapv(|v| v.abs() > ON_SOURCE * peak), image: restored, imaging, beam })
    }
}

/// Give all visibilities the weight of a noise of [`NO_NOISE`].
fn weigh(set: &mut VisibilitySet) {
    let power = set.data.vis.iter().map(|v| f64::from(v.norm_sqr())).sum::<f64>() / set.data.vis.len().max(1) as f64;
    if power > 0.0 {
        set.data.weights.fill((1.0 / (NO_NOISE * NO_NOISE * power)) as f32);
    }
}

fn checked(n: usize, n_ant: usize) -> Result<usize> {
    need("number of antennas", n, (2..=n_ant).contains(&n), format!("2 to the {n_ant} of the layout"))?;
    Ok(n)
}

/// Indices of `n` random antennas of `n_ant`, in ascending order. They are the first `n` of a random permutation.
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

/// The rows between chosen antennas, with the layout of only these antennas.
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
    ensure!(!rows.is_empty(), ChainError::NoData(format!("no baseline is left between the {} antennas chosen", chosen.len())));
    let mut coverage: UvCoverage = from.coverage.select(&rows)?;
    for ant in coverage.ant1.iter_mut().chain(&mut coverage.ant2) {
        *ant = at(*ant).ok_or_else(|| ChainError::Incompatible(format!("a row names antenna {ant}, which is not among those chosen")))?;
    }
    let data = VisibilityBlock::new(
        coverage,
        from.vis.select(Axis(0), &rows),
        from.weights.select(Axis(0), &rows),
        from.flags.select(Axis(0), &rows),
        from.nsamples.select(Axis(0), &rows),
    )?;
    let antennas = chosen.iter().map(|k| header.layout.antennas()[*k].clone()).collect();
    let mut layout = ArrayLayout::new(header.layout.name.clone(), header.layout.frame, antennas)?;
    layout.pattern.clone_from(&header.layout.pattern);
    Ok(VisibilitySet::new(VisibilityHeader { layout, ..header.clone() }, data)?)
}

/// Image a set as it is.
pub(super) fn image(set: &mut dyn VisibilitySource, imaging: &ImagingOptions, how: &Deconvolution) -> Result<Seen> {
    let mut imager = Imager::new(set, imaging.clone(), &Silent)?;
    match how {
        Deconvolution::Clean(options) => Ok(seen(&clean(&mut imager, options, &Silent)?, how)),
        Deconvolution::Mem(_) => {
            let options = MemOptions { niter: HOPELESS, uncertainty: Uncertainty::None, ..MemOptions::default() };
            let products = mem(&mut imager, &MemPlan { options, ..MemPlan::default() }, &Silent)?;
            let residual = &products.residual.data;
            let residual_rms = (residual.iter().map(|v| v * v).sum::<f64>() / residual.len() as f64).sqrt();
            Ok(Seen { image: products.model.plane(0, 0).to_owned(), restored_peak: peak(&plane(&products.restored)), residual_rms })
        }
    }
}

/// The image of a trial from the products of self-calibration.
pub(super) fn seen(products: &CleanProducts, how: &Deconvolution) -> Seen {
    let restored = plane(&products.restored);
    let restored_peak = peak(&restored);
    let image = match how {
        Deconvolution::Clean(_) => restored,
        // The scene, with which these images are compared, is in absolute temperatures.
        Deconvolution::Mem(_) => products.model.plane(0, 0).to_owned(),
    };
    Seen { image, restored_peak, residual_rms: products.statistics.residual_rms }
}

fn peak(plane: &Array2<f64>) -> f64 {
    plane.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// An image without the constant that was added back \[m, l\].
fn plane(image: &Image) -> Array2<f64> {
    let constant = image.pedestal_k.unwrap_or(0.0);
    image.plane(0, 0).mapv(|v| v - constant)
}

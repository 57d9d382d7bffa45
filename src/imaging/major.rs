//! Major cycles: a minor cycle on the image, followed by the exact residual from the visibilities.
//!
//! The channels of an image are cleaned one after the other. Several processes clean them side by side.
//!
//! # Reference
//! Schwab 1984, AJ 89, 1076 (Cotton-Schwab).

use super::channel_cycles::{ChannelRun, With};
use super::cleaned::{Channel, Cleaned};
use super::clock::Clock;
use super::continued::{Continue, Tools};
use super::imager::Imager;
use super::minor_cycles::minor_cycles;
use crate::memory::{ImageWork, check_images};
use crate::progress::Observer;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::Ranks;
use ndarray::Array2;

pub use super::cleaned::{CleanProducts, CleanStatistics, StopReason};
pub use super::components::CleanComponent;
pub use crate::deconvolve::CleanOptions;

/// Clean all output channels of an imager.
///
/// # Errors
/// An option is out of range, the mask has another shape than the image, no Gaussian fits the beam, or the source fails.
pub fn clean(imager: &mut Imager<'_>, opts: &CleanOptions, observer: &dyn Observer) -> Result<CleanProducts> {
    clean_from(imager, opts, &mut None, Continue::default(), observer)
}

/// As [`clean`], but starting from an earlier model. `tools` are kept for the next call. They are made if there are none, or if the data have
/// other weights than before. The products contain only the components of this run.
///
/// # Errors
/// As [`clean`]; also if a model has another shape than the image.
pub fn clean_from(
    imager: &mut Imager<'_>,
    opts: &CleanOptions,
    tools: &mut Option<Tools>,
    from: Continue<'_>,
    observer: &dyn Observer,
) -> Result<CleanProducts> {
    let (channels, clock) = channels_from(imager, opts, tools, from, observer)?;
    CleanProducts::of(Cleaned { channels, clock }, imager)
}

/// [`clean`] up to the last residual. Its images are made one after the other by [`Cleaned::deliver`].
///
/// # Errors
/// As [`clean`].
pub(crate) fn cleaned(imager: &mut Imager<'_>, opts: &CleanOptions, observer: &dyn Observer) -> Result<Cleaned> {
    let (channels, clock) = channels_from(imager, opts, &mut None, Continue::default(), observer)?;
    Ok(Cleaned { channels, clock })
}

fn channels_from(
    imager: &mut Imager<'_>,
    opts: &CleanOptions,
    tools: &mut Option<Tools>,
    from: Continue<'_>,
    observer: &dyn Observer,
) -> Result<(Vec<Channel>, Clock)> {
    check(imager, opts)?;
    let mut clock = Clock::default();
    let n = imager.channels().len();
    if !from.models.is_empty() && (from.models.len() != n || from.models.iter().any(|m| m.dim() != (imager.grid().n_m, imager.grid().n_l)))
    {
        return Err(ChainError::Incompatible("the model to continue from has another shape than the image".into()));
    }
    let tools = match tools {
        Some(made) if made.fit(imager) => made,
        other => other.insert(clock.time("psf", || Tools::new(imager, opts, observer))?),
    };
    let level = threshold(imager, opts)?;
    let ranks = imager.ranks();
    // Several processes share out the minor cycles of the channels, which then go side by side.
    let (shared, side_by_side) = if ranks.size() > 1 && n > 1 && from.exact { (Some(&*ranks), n) } else { (None, 1) };
    let mut channels = Vec::with_capacity(n);
    for tools in tools.all.chunks_mut(side_by_side) {
        let with = &mut With { imager: &mut *imager, observer, clock: &mut clock };
        let first = channels.len();
        let begin = |(k, tool)| ChannelRun::begin(first + k, opts, (tool, from), level, with);
        let mut runs = tools.iter_mut().enumerate().map(begin).collect::<Result<Vec<_>>>()?;
        cycles(&mut runs, shared, with)?;
        for run in runs {
            channels.push(run.finish(with)?);
        }
    }
    Ok((channels, clock))
}

/// The major cycles of some channels, side by side. Their minor cycles are those of all processes, or shared among `shared`.
fn cycles(runs: &mut [ChannelRun<'_>], shared: Option<&dyn Ranks>, with: &mut With<'_, '_>) -> Result<()> {
    let mut going: Vec<&mut ChannelRun<'_>> = runs.iter_mut().collect();
    while !going.is_empty() {
        let mut next = Vec::with_capacity(going.len());
        for run in going {
            if run.goes_on(with)? {
                next.push(run);
            }
        }
        let before: Vec<usize> = next.iter().map(|run| run.n_components()).collect();
        let stops = with.clock.time("minor", || match shared {
            Some(ranks) => minor_cycles(&mut next, ranks),
            None => next.iter_mut().map(|run| run.descend()).collect(),
        })?;
        going = Vec::with_capacity(next.len());
        for (run, minor) in next.into_iter().zip(before.into_iter().zip(stops)) {
            if run.after(minor, with)? {
                going.push(run);
            }
        }
    }
    Ok(())
}

fn check(imager: &Imager<'_>, o: &CleanOptions) -> Result<()> {
    o.check()?;
    check_images((imager.grid().n_l, imager.grid().n_m), ImageWork::Clean)?;
    let level = threshold(imager, o)?;
    need("threshold", level, level >= 0.0 && level.is_finite(), "a level of 0 or more")?;
    let loaded = o.region.is_some() || (o.mask.is_none() && o.boxes.is_empty());
    ensure!(loaded, ChainError::Incompatible("the mask and the boxes of CLEAN must be loaded for the grid of the image first".into()));
    let shape = (imager.grid().n_m, imager.grid().n_l);
    let mask = o.region.as_ref().map_or(shape, Array2::dim);
    need("mask", format!("{mask:?}"), mask == shape, format!("a mask of the shape of the image, {shape:?}"))
}

/// The threshold in the unit of the images; 0 if there is none.
fn threshold(imager: &Imager<'_>, opts: &CleanOptions) -> Result<f64> {
    opts.threshold.map_or(Ok(0.0), |level| level.in_unit("threshold", imager.header().unit))
}

//! The first pass over a set: what it shows of the data, and the grid of the image that follows.

use super::ImagingOptions;
use super::data::Data;
use super::near::{Near, warn_invalid};
use super::one_pass::OnePass;
use super::pol::PolSelector;
use super::size::choose_grid;
use crate::Result;
use crate::memory::{ImageWork, check_images};
use crate::progress::Observer;
use crate::values::need;
use cittert_arrays::{SkyGrid, VisibilitySource};
use std::ops::Range;

/// What the first pass over a source decides.
pub(super) struct Opened<'a> {
    pub(super) data: Data<'a>,
    pub(super) grid: SkyGrid,
    pub(super) channels: Vec<Range<usize>>,
    pub(super) near: Option<Near>,
}

impl<'a> Opened<'a> {
    /// Read the source once. `image` is made meanwhile, if it can be.
    pub(super) fn new(
        source: &'a mut dyn VisibilitySource,
        options: &ImagingOptions,
        image: Option<&mut OnePass>,
        observer: &dyn Observer,
    ) -> Result<Self> {
        options.check()?;
        let channels = share(source.header().spectrum.n_chan(), options.channels_out)?;
        let selector = PolSelector::of(options.pol, source.header())?;
        let surface = options.surface_of(&source.header().near_field)?;
        let processes = source.ranks().size();
        let alone = "one process: exact images of scenes near the array are not shared out";
        need("number of processes", processes, surface.is_none() || processes == 1, alone)?;
        let data = Data::open(source, selector, (options.unit_weights, surface.is_some(), options.memory), image, observer)?;
        let grid = choose_grid(data.survey(), data.header(), options, observer)?;
        let near = match surface {
            Some(surface) => Some(Near::new(data.header(), (surface, options.no_w), &grid, observer)?),
            None => warn_invalid(data.header(), &grid, observer).map(|()| None)?,
        };
        check_images((grid.n_l, grid.n_m), ImageWork::Transform)?;
        Ok(Self { data, grid, channels, near })
    }
}

/// The channels of each output channel.
pub(super) fn share(n_chan: usize, parts: usize) -> Result<Vec<Range<usize>>> {
    need("channels_out", parts, (1..=n_chan).contains(&parts), format!("1 to the {n_chan} channels of the set"))?;
    Ok((0..parts).map(|k| n_chan * k / parts..n_chan * (k + 1) / parts).collect())
}

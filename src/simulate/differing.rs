//! Antennas that differ: simulations through patterns and receivers of their own.

use super::Method;
use super::band::{BandNodes, Receivers, largest_delay_s};
use super::engine::Simulator;
use super::through::AntennaPatterns;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::pattern::Pointings;

impl Simulator<'_> {
    /// Let the pattern of each antenna point elsewhere or be of another width. The common pattern is that of the elements. Images are then
    /// exact sums, whatever the method.
    ///
    /// # Errors
    /// Elements without a pattern, method mask, a scene near the array or one that contains a pattern already, or pointings of another array.
    pub fn with_pointings(mut self, pointings: Pointings) -> Result<Self> {
        pointings.check(self.header.layout.n_ant())?;
        let no = |why: &str| ChainError::Incompatible(format!("patterns that differ by antenna {why}"));
        ensure!(!self.pattern.is_none(), no("need a pattern: give one with --element, --element-file or in the layout"));
        ensure!(self.options.method != Method::Mask, no("are no part of method mask: use degrid or dft"));
        ensure!(!self.is_near(), no("are known for the far field only: leave out the range, or the errors of pointing and width"));
        ensure!(self.scene_noise.is_none(), no("have no noise of the scene: leave out scene-noise"));
        let dimmed = self.sky.images.iter().any(|i| !i.pattern.is_none());
        ensure!(!dimmed, no("cannot be put over a scene that contains the pattern already: give the scene itself"));
        self.header.history.push("simulate: patterns that differ by antenna".into());
        self.through = Some(AntennaPatterns::new(self.pattern.clone(), pointings));
        Ok(self)
    }

    /// Observe with these receivers. Where they have shapes, the frequencies within each channel are chosen by them.
    ///
    /// # Errors
    /// Receivers of another array, wrong shapes, sub-channels beside shapes, or a scene near the array.
    pub fn with_receivers(mut self, receivers: &Receivers) -> Result<Self> {
        let text = "bands and sampling errors of receivers are known for the far field only: leave out the range, or these errors";
        ensure!(!self.is_near(), ChainError::Incompatible(text.into()));
        let sub = self.options.subchannels;
        need("subchannels", sub, sub == 1 || !receivers.shaped, "1: the shape of a band chooses the frequencies in each channel itself")?;
        let (layout, spectrum) = (&self.header.layout, &self.header.spectrum);
        let delay = largest_delay_s(layout, self.sky.images.iter(), self.sources.iter().flatten().map(|s| (s.l, s.m)));
        let nodes = BandNodes::new(receivers, layout, spectrum, delay, std::mem::take(&mut self.freq_hz))?;
        self.freq_hz.clone_from(&nodes.freq_hz);
        let most = self.freq_hz.iter().map(Vec::len).max().unwrap_or(0);
        self.header.history.push(format!("simulate: bands of the receivers, up to {most} frequencies in a channel"));
        self.band = Some(nodes);
        Ok(self)
    }
}

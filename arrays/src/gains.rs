//! Antenna gains.

use crate::{ArrayError, ArrayLayout, Result, SpectralWindow};
use ndarray::{Array3, Array4, Axis};
use num_complex::Complex64;

/// Complex gains of the antennas in the convention V_corrupt = g1 conj(g2) V, for uvw = r2 - r1.
///
/// `gains` and `flags` are \[solint, ant, chan, feed\]; the channel axis has length 1 where one gain serves the whole band.
#[derive(Debug, Clone, PartialEq)]
pub struct GainTable {
    /// The array; the antenna axis follows its order.
    pub layout: ArrayLayout,
    /// Channels of the chan axis; one channel as wide as the band where a gain serves all of it.
    pub spectrum: SpectralWindow,
    /// Names of the feeds: `R`, `L`, `X`, `Y`; or one entry for polarisations that share their gains, such as `R+L`, or `I` \[feed\].
    pub feeds: Vec<String>,
    /// Middle of each solution interval, Julian date UTC \[solint\].
    pub time_jd: Vec<f64>,
    /// Length of each solution interval, s \[solint\].
    pub interval_s: Vec<f64>,
    /// Gains \[solint, ant, chan, feed\].
    pub gains: Array4<Complex64>,
    /// True where no gain is known \[solint, ant, chan, feed\].
    pub flags: Array4<bool>,
    /// Leakages, where they are known: the part of the field of the other feed that a feed receives, in the shape of the gains. They act before the
    /// gains, so V_corrupt = G1 D1 V D2^H G2^H with D = \[\[1, d\], \[d', 1\]\].
    pub leakages: Option<Array4<Complex64>>,
    /// Signal to noise (or other quality) of each gain \[solint, ant, chan, feed\], where known.
    pub quality: Option<Array4<f64>>,
    /// Reduced chi^2 of each interval \[solint, chan, feed\], where known.
    pub total_quality: Option<Array3<f64>>,
    /// Index of the reference antenna, whose phase is 0.
    pub refant: Option<usize>,
    /// Phase only, amplitude and phase, delay, or injected truth, in words.
    pub mode: String,
    /// History of the table, oldest first.
    pub history: Vec<String>,
}

impl GainTable {
    /// Unflagged unit gains.
    ///
    /// # Errors
    /// No interval, no feed or more than the four elements of a Jones matrix, or times and intervals of different lengths.
    pub fn unity(
        layout: ArrayLayout,
        spectrum: SpectralWindow,
        feeds: Vec<String>,
        time_jd: Vec<f64>,
        interval_s: Vec<f64>,
    ) -> Result<Self> {
        if time_jd.is_empty() || time_jd.len() != interval_s.len() || feeds.is_empty() || feeds.len() > 4 {
            return Err(ArrayError::ShapeMismatch {
                what: "solution intervals and feeds",
                expected: vec![time_jd.len().max(1), 1],
                found: vec![interval_s.len(), feeds.len()],
            });
        }
        let shape = (time_jd.len(), layout.n_ant(), spectrum.n_chan(), feeds.len());
        Ok(Self {
            layout,
            spectrum,
            feeds,
            time_jd,
            interval_s,
            gains: Array4::from_elem(shape, Complex64::new(1.0, 0.0)),
            flags: Array4::from_elem(shape, false),
            leakages: None,
            quality: None,
            total_quality: None,
            refant: None,
            mode: "unity".into(),
            history: Vec::new(),
        })
    }

    /// Check that all arrays are \[solint, ant, chan, feed\].
    ///
    /// # Errors
    /// The first array of another shape.
    pub fn check(&self) -> Result<()> {
        let expected = [self.time_jd.len(), self.layout.n_ant(), self.spectrum.n_chan(), self.feeds.len()];
        let quality = self.quality.as_ref().map_or(expected.as_slice(), |q| q.shape());
        let leakages = self.leakages.as_ref().map_or(expected.as_slice(), |l| l.shape());
        for (what, shape) in
            [("gains", self.gains.shape()), ("gain flags", self.flags.shape()), ("leakages", leakages), ("gain quality", quality)]
        {
            ArrayError::unless_shape(what, shape, &expected)?;
        }
        Ok(())
    }

    /// The same gains with one entry for each feed, where one entry such as `R+L` holds the gains of both feeds.
    #[must_use]
    pub fn with_each_feed(&self) -> Self {
        let names: Vec<String> = self.feeds.iter().flat_map(|f| f.split('+')).map(String::from).collect();
        if names.len() == self.feeds.len() {
            return self.clone();
        }
        self.choose_feeds(names, &[0, 0])
    }

    /// Turn the first of two feeds of all antennas so that the two feeds of the reference antenna have the same phase.
    ///
    /// The parallel hands do not tell the phase between the feeds, so that a product of two solutions can have any.
    pub fn turn_feeds_together(&mut self) {
        let Some(refant) = self.refant.filter(|_| self.feeds.len() == 2) else { return };
        for mut interval in self.gains.outer_iter_mut() {
            for mut chan in interval.axis_iter_mut(Axis(1)) {
                let between = chan[[refant, 0]] * chan[[refant, 1]].conj();
                if between.norm() > 0.0 {
                    let back = between.conj() / between.norm();
                    chan.column_mut(0).mapv_inplace(|g| g * back);
                }
            }
        }
    }

    /// The same gains with one entry for both feeds, named such as `R+L`, if gains, flags and qualities of the two feeds are equal.
    #[must_use]
    pub fn with_equal_feeds_joined(&self) -> Self {
        if self.feeds.len() < 2 || self.leakages.is_some() {
            return self.clone();
        }
        let joined = self.choose_feeds(vec![self.feeds.join("+")], &[0]);
        if joined.with_each_feed() == *self { joined } else { self.clone() }
    }

    fn choose_feeds(&self, feeds: Vec<String>, from: &[usize]) -> Self {
        Self {
            feeds,
            gains: self.gains.select(Axis(3), from),
            flags: self.flags.select(Axis(3), from),
            quality: self.quality.as_ref().map(|q| q.select(Axis(3), from)),
            total_quality: self.total_quality.as_ref().map(|q| q.select(Axis(2), from)),
            ..self.clone()
        }
    }

    /// Index of the solution interval that holds a time, or the nearest one.
    #[must_use]
    pub fn interval_at(&self, time_jd: f64) -> usize {
        let distance = |i: &usize| (self.time_jd[*i] - time_jd).abs();
        (0..self.time_jd.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }
}

//! The receiver of each antenna: the shape of its band, how it is out of tune, and the jitter of its sampler.

use super::shape::BandShape;
use crate::values::need;
use crate::{Result, ensure};
use cittert_arrays::{ArrayLayout, SpectralWindow, band_response};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Most samples of a table that are ends of panels each.
const MOST_CORNERS: usize = 33;

/// The receiver of one antenna.
#[derive(Debug, Clone, PartialEq)]
pub struct Receiver {
    /// Response over a channel.
    pub shape: BandShape,
    /// Distance of its band from where it should be, Hz.
    pub offset_hz: f64,
    /// Width of its band over what it should be.
    pub width: f64,
    /// Standard deviation of the instants of its sampler, s.
    pub jitter_s: f64,
}

impl Default for Receiver {
    fn default() -> Self {
        Self { shape: BandShape::Flat, offset_hz: 0.0, width: 1.0, jitter_s: 0.0 }
    }
}

/// The receivers of an array.
#[derive(Debug, Clone, PartialEq)]
pub struct Receivers {
    /// One for each antenna.
    pub of: Vec<Receiver>,
    /// True if shapes and mistuning are those of `of`; otherwise channels are averaged as without receivers, and only jitter acts.
    pub shaped: bool,
    /// Frequency at which the middle of the band is sampled, Hz. `None`: the sky frequency itself.
    pub sampler_hz: Option<f64>,
}

impl Receivers {
    /// Flat and well tuned receivers.
    #[must_use]
    pub fn nominal(n_ant: usize) -> Self {
        Self { of: vec![Receiver::default(); n_ant], shaped: false, sampler_hz: None }
    }

    /// Check the numbers for an array.
    ///
    /// # Errors
    /// A shape is wrong, a width is not positive, or the number of antennas is another one.
    pub fn check(&self, layout: &ArrayLayout) -> Result<()> {
        cittert_arrays::ArrayError::unless_shape("receivers", &[self.of.len()], &[layout.n_ant()])?;
        for (receiver, antenna) in self.of.iter().zip(layout.antennas()) {
            receiver.shape.check()?;
            if let BandShape::Table(table) = &receiver.shape {
                table.samples(&antenna.name)?;
            }
            let w = receiver.width;
            need("relative width of a band", w, (0.1..=10.0).contains(&w), "0.1 to 10: make the rms of the widths smaller")?;
            need("offset of a band", receiver.offset_hz, receiver.offset_hz.is_finite(), "a finite frequency")?;
        }
        Ok(())
    }

    /// Response of an antenna at a frequency in a channel (its middle and width) of a band.
    pub(super) fn response(&self, layout: &ArrayLayout, ant: usize, freq_hz: f64, channel: (f64, f64), middle_hz: f64) -> Complex64 {
        let r = &self.of[ant];
        let (center, width) = channel;
        match &r.shape {
            BandShape::Table(table) => {
                let samples = table.samples(&layout.antennas()[ant].name).unwrap_or_default();
                let about = if table.relative { center } else { middle_hz };
                let tuned = (freq_hz - about - r.offset_hz) / r.width;
                let inside = table.relative || (freq_hz - center).abs() <= 0.5 * width;
                if inside { band_response(samples, if table.relative { tuned } else { about + tuned }) } else { Complex64::ZERO }
            }
            shape => shape.response((freq_hz - center - r.offset_hz) / (width * r.width)),
        }
    }

    /// Frequencies of a channel between which the responses of an antenna have no corners. The first and the last are the ends of what counts.
    pub(super) fn corners(&self, layout: &ArrayLayout, ant: usize, (center, width): (f64, f64), middle_hz: f64) -> Result<Vec<f64>> {
        let r = &self.of[ant];
        let (low, high) = (center - 0.5 * width, center + 0.5 * width);
        Ok(match &r.shape {
            BandShape::Table(table) => {
                let samples = table.samples(&layout.antennas()[ant].name)?;
                let about = if table.relative { center } else { middle_hz };
                let placed =
                    |f: f64| if table.relative { about + f * r.width + r.offset_hz } else { about + (f - about) * r.width + r.offset_hz };
                let all: Vec<f64> = samples.iter().map(|s| placed(s.0)).collect();
                // Between many samples the corners are small, and the halving of panels finds those that matter.
                let sparse = |all: Vec<f64>| if all.len() <= MOST_CORNERS { all } else { vec![all[0], all[all.len() - 1]] };
                if table.relative {
                    sparse(all)
                } else {
                    let ends = [all[0].max(low), all[all.len() - 1].min(high)];
                    ensure!(
                        ends[0] < ends[1],
                        crate::ChainError::Incompatible(format!(
                            "the table of the band ends before the channel at {:.6} GHz, whose response it should tell",
                            center / 1e9
                        ))
                    );
                    let inner = all.into_iter().filter(|f| *f > ends[0] && *f < ends[1]);
                    sparse([ends[0]].into_iter().chain(inner).chain([ends[1]]).collect())
                }
            }
            shape => {
                let reach = shape.reach();
                let at = |x: f64| center + r.offset_hz + x * r.width * width;
                [-reach, -0.5, 0.5, reach].map(at).to_vec()
            }
        })
    }

    /// What the jitter leaves of the signal of an antenna at a frequency: the mean of exp(2 pi i f t) over Gaussian t is
    /// exp(-(2 pi f sigma)^2 / 2).
    pub(crate) fn coherence(&self, ant: usize, freq_hz: f64, middle_hz: f64) -> f64 {
        let f = self.sampler_hz.map_or(freq_hz, |sampler| sampler + freq_hz - middle_hz);
        (-0.5 * (TAU * f * self.of[ant].jitter_s).powi(2)).exp()
    }

    /// Middle of the band.
    pub(super) fn middle_hz(spectrum: &SpectralWindow) -> f64 {
        spectrum.mean_hz()
    }
}

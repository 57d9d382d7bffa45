//! The uniform background that elements with a pattern see: its brightness by total power, or by a fit to the visibilities.

use super::Imager;
use super::split::{BackgroundChoice, Split};
use crate::Result;
use crate::progress::{Event, Observer, Quiet};
use crate::values::{bad_value, need};
use cittert_arrays::{Ranks, SPEED_OF_LIGHT_M_S, VisUnit};
use ndarray::{Array2, Zip};
use num_complex::Complex64;

/// A fit is doubtful if the shortest baseline sees less than this part of the zero spacing of a uniform background.
const SEEN: f64 = 0.5;

/// The brightness of a uniform background.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Background {
    /// Brightness, K or Jy/pixel.
    pub level: f64,
    /// Where it comes from.
    pub from: BackgroundFrom,
}

/// Where the brightness of a background comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BackgroundFrom {
    /// Total power: autocorrelations, or the antenna temperature that the set states.
    TotalPower,
    /// A fit to the visibilities.
    Fit {
        /// Part of the zero spacing of a uniform background that the shortest baseline sees.
        seen: f64,
    },
    /// The user.
    Given,
}

impl Background {
    /// The background behind the elements of an output channel, as total power tells it, or as it fits the visibilities best. `one` is the flux a
    /// pixel \[m, l\] that the elements see of a unit of brightness; only pixels `inside` a mask count. `None` if the fit is not positive.
    ///
    /// # Errors
    /// No visibility counts, or the source cannot be read.
    pub fn of(
        (imager, channel): (&mut Imager<'_>, usize),
        one: &Array2<f64>,
        inside: Option<&Array2<bool>>,
        observer: &dyn Observer,
    ) -> Result<Option<Self>> {
        let mut masked = one.clone();
        if let Some(inside) = inside {
            Zip::from(&mut masked).and(inside).for_each(|v, inside| *v *= f64::from(u8::from(*inside)));
        }
        let total = masked.sum();
        let header = imager.header();
        match imager.options().background {
            BackgroundChoice::None => return Ok(None),
            BackgroundChoice::Kelvin(t) if header.unit == VisUnit::KelvinSr => {
                need("background", t, t.si() > 0.0 && t.si().is_finite(), "a positive temperature")?;
                return Ok(Some(Self { level: t.si(), from: BackgroundFrom::Given }));
            }
            BackgroundChoice::Kelvin(t) => return bad_value("background", t, "auto or none: the visibilities are not in K sr"),
            BackgroundChoice::Auto => {}
        }
        let solid_angle = header.layout.pattern.solid_angle_sr(header.spectrum.mean_hz()).filter(|_| header.unit == VisUnit::KelvinSr);
        let stated = header.antenna_temperature_k.zip(solid_angle);
        // Autocorrelations of amplitudes that are not calibrated know less than a calibrated radiometer.
        if let Some(zero) = imager.zero_spacing(channel).filter(|z| stated.is_none() || z.is_calibrated()) {
            let level = zero.value / total;
            return Ok(Some(Self { level, from: BackgroundFrom::TotalPower }).filter(|b| b.level > 0.0 && b.level.is_finite()));
        }
        if let Some((t, omega)) = stated {
            let level = t * omega / total;
            return Ok(Some(Self { level, from: BackgroundFrom::TotalPower }).filter(|b| b.level > 0.0 && b.level.is_finite()));
        }
        let Some((level, seen)) = imager.fitted_background(channel, &masked, observer)? else { return Ok(None) };
        let level = level + header_pedestal(imager);
        Ok(Some(Self { level, from: BackgroundFrom::Fit { seen } }).filter(|b| b.level > 0.0))
    }

    /// What the elements see in all, if total power tells it. `one` is the flux a pixel \[m, l\] that they see of a unit of brightness.
    #[must_use]
    pub fn total(&self, one: &Array2<f64>, inside: Option<&Array2<bool>>) -> Option<f64> {
        let sum = || match inside {
            None => one.sum(),
            Some(inside) => one.iter().zip(inside).filter(|(_, inside)| **inside).map(|(v, _)| v).sum(),
        };
        (self.from == BackgroundFrom::TotalPower).then(|| self.level * sum())
    }

    /// Tell the user where the background comes from, and whether it is doubtful.
    pub fn say(&self, imager: &Imager<'_>, observer: &dyn Observer) {
        let unit = if imager.header().unit == VisUnit::KelvinSr { "K" } else { "Jy/pixel" };
        let from = match self.from {
            BackgroundFrom::TotalPower => "as total power tells",
            BackgroundFrom::Fit { .. } => "as fits the visibilities best",
            BackgroundFrom::Given => "as given",
        };
        let pattern = &imager.header().layout.pattern;
        let pattern = if pattern.is_none() { String::new() } else { format!(" ({pattern})") };
        observer.event(Event::Note(&format!("the elements{pattern} see a background of {:.2} {unit}, {from}", self.level)));
        if let BackgroundFrom::Fit { seen } = self.from
            && seen < SEEN
        {
            observer.event(Event::Warning(&format!(
                "no baseline is short enough to see more than {:.1} % of a uniform background, so its level of {:.1} {unit} is doubtful, and with it that of \
                 the image: give it if it is known (--prior, or --background)",
                100.0 * seen,
                self.level
            )));
        }
    }
}

/// The constant that was removed from the scene before the pattern, K; 0 without one.
fn header_pedestal(imager: &Imager<'_>) -> f64 {
    imager.header().pedestal_k.filter(|_| imager.header().unit == VisUnit::KelvinSr).unwrap_or(0.0)
}

impl Imager<'_> {
    /// Leave the background of elements with a pattern in the data.
    pub(crate) fn keep_background(&mut self) {
        self.split = Split::Off;
    }

    /// Find the backgrounds of elements with a pattern, unless this was done before. Only sets in K sr have one.
    pub(super) fn find_backgrounds(&mut self, observer: &dyn Observer) -> Result<()> {
        if !matches!(self.split, Split::Pending) {
            return Ok(());
        }
        self.split = Split::Off;
        let header = self.header();
        let known = self.zero_spacing(0).is_some() || !header.layout.pattern.is_none();
        if header.unit != VisUnit::KelvinSr || !known || header.pedestal_k.is_some() {
            return Ok(());
        }
        let mut out = Vec::new();
        for k in 0..self.channels().len() {
            let seen = self.seen_of_one_kelvin(k);
            let found = if self.sum_of_weights(k) > 0.0 { Background::of((&mut *self, k), &seen, None, observer)? } else { None };
            if let Some(background) = found.as_ref().filter(|_| k == 0) {
                background.say(self, observer);
                observer.event(Event::Note(
                    "the background is taken out of the visibilities before the image is made, and put back into the image",
                ));
            }
            out.push(found.map(|b| seen * b.level));
        }
        self.split = Split::Out(out);
        Ok(())
    }

    /// Flux a pixel \[m, l\] that elements with a pattern see of 1 K.
    fn seen_of_one_kelvin(&self, channel: usize) -> Array2<f64> {
        let grid = self.grid();
        let mut seen = self.pattern_of(channel).unwrap_or_else(|| Array2::ones((grid.n_m, grid.n_l)));
        let cell = |row: usize, column: usize| {
            let n2 = 1.0 - grid.l_at(column as f64).powi(2) - grid.m_at(row as f64).powi(2);
            if n2 > 0.0 { grid.cell_sr() / n2.sqrt() } else { 0.0 }
        };
        seen.indexed_iter_mut().for_each(|((row, column), v)| *v *= cell(row, column));
        seen
    }

    /// The background of an output channel that is taken out of the data, flux a pixel \[m, l\].
    pub(super) fn background_of(&self, channel: usize) -> Option<&Array2<f64>> {
        if let Split::Out(all) = &self.split { all.get(channel)?.as_ref() } else { None }
    }

    /// The least-squares fit of a uniform brightness to the data of an output channel, in the unit of brightness of `one`, and the part of its
    /// zero spacing that the shortest baseline sees. Chi squared is a parabola of the brightness, so its values at three brightnesses give the
    /// minimum.
    fn fitted_background(&mut self, channel: usize, one: &Array2<f64>, observer: &dyn Observer) -> Result<Option<(f64, f64)>> {
        let quiet = Quiet(observer);
        let range = self.channels()[channel].clone();
        let weight: f64 = self.survey().channel_weight[range].iter().sum();
        let mut at = |level: f64| -> Result<f64> { Ok(self.chi_squared(channel, (one * level).into(), &quiet)?.chi2) };
        let dark = at(0.0)?;
        // The rms amplitude of the data sets the scale, so that the three values differ by more than their rounding.
        let scale = (dark / weight).sqrt() / one.sum();
        if !(scale > 0.0 && scale.is_finite()) {
            return Ok(None);
        }
        let (above, below) = (at(scale)?, at(-scale)?);
        let curvature = above + below - 2.0 * dark;
        let level = (curvature > 0.0).then(|| 0.5 * scale * (below - above) / curvature);
        level.map(|level| Ok((level, self.seen_by_the_shortest(channel, one, &quiet)?))).transpose()
    }

    /// The part of the zero spacing of an image \[m, l\] that the shortest baseline of an output channel sees.
    fn seen_by_the_shortest(&mut self, channel: usize, one: &Array2<f64>, observer: &dyn Observer) -> Result<f64> {
        let range = self.channels()[channel].clone();
        let per_m: Vec<f64> = self.header().spectrum.freq_hz().iter().map(|f| f / SPEED_OF_LIGHT_M_S).collect();
        let mut shortest = [f64::INFINITY, 0.0];
        self.for_each_weighed(observer, |block| {
            let weight = block.weight.view();
            for (row, uvw) in block.uvw_m.rows().into_iter().enumerate() {
                for chan in range.clone().filter(|c| weight[(row, *c)] > 0.0) {
                    let uv = [uvw[0] * per_m[chan], uvw[1] * per_m[chan]];
                    if uv[0].hypot(uv[1]) < shortest[0].hypot(shortest[1]) {
                        shortest = uv;
                    }
                }
            }
            Ok(())
        })?;
        let shortest = shortest_of_all(&*self.ranks(), shortest);
        let grid = self.grid();
        let sum: Complex64 = one
            .indexed_iter()
            .map(|((row, column), v)| {
                let turns = shortest[0] * grid.l_at(column as f64) + shortest[1] * grid.m_at(row as f64);
                Complex64::from_polar(*v, std::f64::consts::TAU * turns)
            })
            .sum();
        Ok(sum.norm() / one.sum())
    }
}

/// The shorter baseline (u, v) of all processes, from that of this process. Of several that are as short, the one with the largest u and v counts:
/// the part of the zero spacing does not depend on the sign of both.
fn shortest_of_all(ranks: &dyn Ranks, own: [f64; 2]) -> [f64; 2] {
    if ranks.size() == 1 {
        return own;
    }
    let own = if own[0] < 0.0 { own.map(|x| -x) } else { own };
    let length = own[0].hypot(own[1]);
    let mut least = [-length];
    ranks.largest(&mut least);
    let mut u = [if length == -least[0] { own[0] } else { f64::NEG_INFINITY }];
    ranks.largest(&mut u);
    let mut v = [if length == -least[0] && own[0] == u[0] { own[1] } else { f64::NEG_INFINITY }];
    ranks.largest(&mut v);
    [u[0], v[0]]
}

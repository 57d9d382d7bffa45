//! Images of scenes near the array, by the exact transform in place of the Fourier transform.
//!
//! The imager and everything above it stay as they are: residuals, beams and gradients come from spherical waves to the surface that the options name. The
//! rows are summed for every pair of antennas first, so that the cost of a pass is that of the transform, whatever the number of integrations.
//!
//! A dirty image is the weighted mean of what the visibilities say of the flux at a pixel: sum w Re(V conj(h)) / sum w |h|^2, where h is the visibility of
//! a point of flux 1 there. In the far field |h| = 1, and this is the usual dirty image.

use super::imager::Imager;
use super::near::Prepared;
use super::session::{Gridded, ResidualWeights, Residue};
use crate::fourier::Real;
use crate::nearfield::{Pairs, PathTransform, Point};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::SkyGrid;
use ndarray::{Array2, CowArray, Ix2};
use num_complex::{Complex32, Complex64};

impl Imager<'_> {
    /// The transform of an output channel: the kept one of the whole image, or a new one.
    fn prepared(&mut self, field: Option<&SkyGrid>, channel: usize) -> Result<Prepared> {
        let mean_hz = self.mean_hz(channel);
        let (memory, freq_hz) = (self.options().memory, self.header().spectrum.freq_hz()[self.channels()[channel].clone()].to_vec());
        let grid = field.unwrap_or(self.grid()).clone();
        let near = self.near.as_mut().ok_or_else(|| ChainError::Internal("the image is not one of the near field".into()))?;
        if field.is_none()
            && let Some((of, kept)) = near.kept.take()
            && of == channel
        {
            return Ok(kept);
        }
        let all = (0..grid.n_m * grid.n_l)
            .filter_map(|k| Some((Point::on(&near.surface, grid.l_at((k % grid.n_l) as f64), grid.m_at((k / grid.n_l) as f64))?, k)));
        let (points, pixels) = all.unzip();
        let transform = PathTransform::new(near.elements.clone().relative_at(mean_hz), points, &freq_hz, memory)?;
        Ok(Prepared { transform, pixels, gain: None })
    }

    fn keep(&mut self, channel: usize, prepared: Prepared) {
        if let Some(near) = &mut self.near {
            near.kept = Some((channel, prepared));
        }
    }

    /// Sum over the rows of an output channel for every pair: `of` gets the antennas, the channel, the visibility, its weight and its imaging weight.
    fn pair_sums(
        &mut self,
        channel: usize,
        observer: &dyn Observer,
        mut of: impl FnMut([usize; 2], usize, Complex32, [f32; 2]) -> Complex64 + Send,
    ) -> Result<Pairs> {
        let range = self.channels()[channel].clone();
        let mut sums = Pairs::zeros(range.len(), self.header().layout.n_ant());
        self.for_each_weighed(observer, |block| {
            let (weight, imaging) = (block.weight.view(), block.imaging());
            for (row, pair) in block.antennas.iter().enumerate() {
                let pair = pair.map(|a| a as usize);
                for (c, chan) in range.clone().enumerate() {
                    let at = (row, chan);
                    sums.add(c, pair[0], pair[1], of(pair, c, block.vis[at], [weight[at], imaging[at]]));
                }
            }
            Ok(())
        })?;
        Ok(sums)
    }

    /// The sum of the imaging weights over sum w |h|^2 at each point.
    fn gain(&mut self, channel: usize, prepared: &Prepared, observer: &dyn Observer) -> Result<Vec<f64>> {
        let n = self.header().layout.n_ant();
        let mut weights = Array2::zeros((n, n));
        self.pair_sums(channel, observer, |[a, b], _, _, [_, imaging]| {
            weights[(a, b)] += f64::from(imaging.max(0.0));
            Complex64::default()
        })?;
        let sum: f64 = weights.iter().sum();
        Ok(prepared.transform.power(weights.view()).into_iter().map(|p| if p > 0.0 { sum / p } else { 0.0 }).collect())
    }

    fn single_suffices(&self) -> bool {
        self.options().grid_options().single_precision_suffices()
    }

    fn predicted(&self, prepared: &Prepared, model: &[f64], observer: &dyn Observer) -> Result<Pairs> {
        let value = |_: usize, k: usize| model[k];
        if self.single_suffices() {
            prepared.transform.predict::<f32>(value, observer)
        } else {
            prepared.transform.predict::<f64>(value, observer)
        }
    }

    /// The adjoint of sums over the rows, on the grid, times a factor at each point.
    fn imaged<P: Real>(
        &self,
        prepared: &Prepared,
        (sums, gain): (&Pairs, Option<&[f64]>),
        grid: &SkyGrid,
        observer: &dyn Observer,
    ) -> Result<Array2<P>> {
        let t = &prepared.transform;
        let all = if self.single_suffices() { t.adjoint::<f32>(sums, observer)? } else { t.adjoint::<f64>(sums, observer)? };
        let mut out = Array2::from_elem((grid.n_m, grid.n_l), P::default());
        for (k, (value, pixel)) in all.iter().zip(&prepared.pixels).enumerate() {
            out[(pixel / grid.n_l, pixel % grid.n_l)] = P::of(value * gain.map_or(1.0, |g| g[k]));
        }
        Ok(out)
    }

    /// As `Imager::gridded`: the dirty image, or the beam as the image of a point of flux 1 in the middle.
    pub(super) fn near_gridded<P: Real>(
        &mut self,
        (field, channel): (Option<&SkyGrid>, usize),
        what: Gridded,
        observer: &dyn Observer,
    ) -> Result<Array2<P>> {
        let mut prepared = self.prepared(field, channel)?;
        let grid = field.unwrap_or(self.grid()).clone();
        let middle = (grid.n_m / 2) * grid.n_l + grid.n_l / 2;
        let point = match what {
            Gridded::Visibilities => None,
            Gridded::Beam => {
                let flux: Vec<f64> = prepared.pixels.iter().map(|k| f64::from(u8::from(*k == middle))).collect();
                Some(self.predicted(&prepared, &flux, observer)?)
            }
        };
        let name = if point.is_some() { "beam" } else { "spherical waves" };
        observer.event(Event::Phase { name, total: Some(self.survey().counts.total), unit: "vis" });
        let sums = self.pair_sums(channel, observer, |[a, b], c, vis, [_, imaging]| {
            let w = f64::from(imaging.max(0.0));
            point.as_ref().map_or_else(|| wide(vis), |p| p.at(c, a, b)) * w
        })?;
        let gain = match prepared.gain.take() {
            Some(gain) => gain,
            None => self.gain(channel, &prepared, observer)?,
        };
        let mut image = self.imaged::<P>(&prepared, (&sums, Some(&gain)), &grid, observer)?;
        let sum = self.sum_of_weights(channel);
        if sum > 0.0 {
            image.mapv_inplace(|v| P::of(v.to64() / sum));
        }
        prepared.gain = Some(gain);
        if field.is_none() {
            self.keep(channel, prepared);
        }
        observer.event(Event::Done);
        Ok(image)
    }

    /// As `Imager::residual_sum`: the residuals with these weights over `scale`, imaged, and what they leave of chi squared. With imaging weights the image is that
    /// of `near_gridded` before its division by the sum of weights; with the weights of the data it is the exact adjoint.
    pub(super) fn near_residual<P: Real>(
        &mut self,
        (channel, weights, scale): (usize, ResidualWeights, f64),
        model: CowArray<'_, f64, Ix2>,
        observer: &dyn Observer,
    ) -> Result<(Residue, Array2<P>)> {
        let grid = self.grid().clone();
        check_model(&model, &grid)?;
        let mut prepared = self.prepared(None, channel)?;
        let flux: Vec<f64> = prepared.pixels.iter().map(|k| model[(k / grid.n_l, k % grid.n_l)]).collect();
        drop(model);
        observer.event(Event::Phase { name: "residual", total: Some(self.survey().counts.total), unit: "vis" });
        let predicted = self.predicted(&prepared, &flux, observer)?;
        let mut left = Residue::default();
        let sums = self.pair_sums(channel, observer, |[a, b], c, vis, [weight, imaging]| {
            let d = wide(vis) - predicted.at(c, a, b);
            if weight > 0.0 {
                left.chi2 += f64::from(weight) * d.norm_sqr();
                left.used += 1;
            }
            let w = if weights == ResidualWeights::Imaging { imaging } else { weight };
            d * (f64::from(w.max(0.0)) / scale)
        })?;
        ensure!(left.used > 0, ChainError::NoData(format!("output channel {channel} has no usable visibility, and therefore no residual")));
        let image = if weights == ResidualWeights::Imaging {
            let gain = match prepared.gain.take() {
                Some(gain) => gain,
                None => self.gain(channel, &prepared, observer)?,
            };
            let image = self.imaged(&prepared, (&sums, Some(&gain)), &grid, observer)?;
            prepared.gain = Some(gain);
            image
        } else {
            self.imaged(&prepared, (&sums, None), &grid, observer)?
        };
        self.keep(channel, prepared);
        observer.event(Event::Done);
        Ok((left, image))
    }
}

fn wide(v: Complex32) -> Complex64 {
    Complex64::new(v.re.into(), v.im.into())
}

/// The same checks as those of a Fourier transform of a model.
fn check_model(model: &CowArray<'_, f64, Ix2>, grid: &SkyGrid) -> Result<()> {
    cittert_arrays::ArrayError::unless_shape("model", model.shape(), &[grid.n_m, grid.n_l])?;
    if let Some(((row, column), v)) = model.indexed_iter().find(|(_, v)| !v.is_finite()) {
        let what = format!("pixel (column {column}, row {row}) of the model");
        return Err(cittert_arrays::ArrayError::BadValue { what, value: v.to_string(), expected: "a finite number" }.into());
    }
    Ok(())
}

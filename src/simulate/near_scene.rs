//! The parts of a scene near the array, and the focus of sets in the far field.

use super::engine::{Simulator, products};
use super::method::Method;
use super::near::{Near, Part};
use super::sky::{apparent_plane, from_jy, unit_factor};
use crate::nearfield::{Elements, Pairs, PathTransform, Point, Surface, boresight_turn};
use crate::progress::{Event, Observer};
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{BrightnessUnit, ElementPattern, Polarization, SourceShape, UvCoverage};
use ndarray::Array3;
use num_complex::Complex64;

/// Points with their fluxes: \[point\] in all channels, or \[sub-channel, point\].
struct Lit {
    points: Vec<Point>,
    flux: Vec<Vec<f64>>,
}

impl Simulator<'_> {
    /// The visibilities of the scene on this surface.
    ///
    /// # Errors
    /// A layout on the Earth, a scene nearer than the farthest element, a method or a source that has no near field.
    pub(super) fn near_field(&self, surface: &Surface, observer: &dyn Observer) -> Result<Near> {
        let o = &self.options;
        need("method", o.method.name(), o.method != Method::Mask, "dft or degrid: a scene in the near field is an exact sum, not a grid")?;
        need("no-w", o.no_w, !o.no_w, "false: the near field has no w term that could be left out")?;
        let elements = Elements::new(&self.header.layout, self.header.near_field.focus)?;
        for image in &self.sky.images {
            surface.check(&image.grid)?;
        }
        let gaussian = self.sky.sources.iter().position(|s| s.shape != SourceShape::Point);
        let text = |k: usize| format!("source {} is a Gaussian, which has no closed form in the near field: draw it as an image", k + 1);
        ensure!(gaussian.is_none(), ChainError::Incompatible(text(gaussian.unwrap_or(0))));
        let polarized = self.sky.sources.iter().position(|s| s.is_polarized());
        let text = |k: usize| {
            format!(
                "source {} is polarised, and sources near the array are summed in intensity alone: draw it as images of Stokes parameters",
                k + 1
            )
        };
        ensure!(polarized.is_none(), ChainError::Incompatible(text(polarized.unwrap_or(0))));
        let total = self.planes.len() + usize::from(!self.sky.sources.is_empty());
        observer.event(Event::Phase { name: "spherical waves", total: Some(total as u64), unit: "planes" });
        let mut parts = Vec::new();
        for plane in &self.planes {
            let image = &self.sky.images[plane.image];
            let pedestal = if self.header.pedestal_k.is_some() && image.unit == BrightnessUnit::Kelvin { self.pedestal_k } else { 0.0 };
            let at = (plane.image_chan, plane.pol);
            // Each element has its own angle to a point, so that the pattern is no factor of the image.
            let bright = apparent_plane(image, at, &ElementPattern::None, image.spectrum.mean_hz(), pedestal, o.one_over_n);
            let lit = bright.indexed_iter().filter(|(_, v)| **v != 0.0);
            let lit = lit.filter_map(|((r, c), v)| Some((Point::on(surface, image.grid.l_at(c as f64), image.grid.m_at(r as f64))?, *v)));
            let (points, flux) = lit.unzip();
            let unit = |f: f64| unit_factor(image.unit, self.header.unit, f);
            let elements = elements.clone().relative(!image.pattern.is_none());
            let terms = products(image.polarizations[plane.pol], &self.basis);
            let pairs = self.pairs(elements, Lit { points, flux: vec![flux] }, (&plane.chans, &unit), observer)?;
            parts.push(Part { chans: plane.chans.clone(), pairs, terms });
            observer.event(Event::Advance(1));
        }
        if let Some(sources) = self.sources.first().filter(|s| !s.is_empty()) {
            let chans: Vec<usize> = (0..self.freq_hz.len()).collect();
            let points = sources.iter().filter_map(|s| Point::on(surface, s.l, s.m)).collect();
            let flux = self.freq_hz.iter().flatten().map(|f| sources.iter().map(|s| s.source.flux_at(*f)).collect()).collect();
            let unit = |f: f64| from_jy(self.header.unit, f);
            let pairs = self.pairs(elements, Lit { points, flux }, (&chans, &unit), observer)?;
            parts.push(Part { chans, pairs, terms: products(Polarization::I, &self.basis) });
        }
        observer.event(Event::Done);
        Ok(Near { parts })
    }

    /// The visibilities of points in some channels of the set, averaged over their sub-channels.
    fn pairs(
        &self,
        elements: Elements,
        lit: Lit,
        (chans, unit): (&[usize], &dyn Fn(f64) -> f64),
        observer: &dyn Observer,
    ) -> Result<Pairs> {
        let (n_ant, sub) = (elements.len(), self.options.subchannels);
        let freqs: Vec<f64> = chans.iter().flat_map(|c| self.freq_hz[*c].iter().copied()).collect();
        let transform = PathTransform::new(elements, lit.points, &freqs, self.memory)?;
        let single = lit.flux.len() == 1;
        let fine = transform.predict::<f64>(|c, k| lit.flux[if single { 0 } else { c }][k], observer)?;
        let mut out = Pairs::zeros(chans.len(), n_ant);
        for (c, freq) in freqs.iter().enumerate() {
            let factor = unit(*freq) / sub as f64;
            (0..n_ant).for_each(|a| (0..n_ant).for_each(|b| out.add(c / sub, a, b, fine.at(c, a, b) * factor)));
        }
        Ok(out)
    }

    /// Turn far-field visibilities from the boresight to the focus of the set.
    pub(super) fn turn_to_focus(&self, coverage: &UvCoverage, sum: &mut Array3<Complex64>) {
        let Some(focus) = self.header.near_field.focus.filter(|f| !f.is_on_axis()) else { return };
        for (row, uvw) in coverage.uvw_m.rows().into_iter().enumerate() {
            for (chan, freq) in self.header.spectrum.freq_hz().iter().enumerate() {
                let turn = boresight_turn(focus, [uvw[0], uvw[1], uvw[2]], *freq).conj();
                sum.slice_mut(ndarray::s![row, chan, ..]).mapv_inplace(|v| v * turn);
            }
        }
    }
}

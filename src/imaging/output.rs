//! Planes as images with units, beams and history.
//!
//! A set in Jy gives images in Jy/beam and models in Jy/pixel. A set in `K str` gives kelvin. The flux per beam divided by the solid angle of
//! the restoring beam is the brightness averaged over the beam. The flux of a model pixel divided by the solid angle of a cell is brightness.
//! Models and restored images are also multiplied by n, because the solid angle of a cell of direction cosines is larger by 1/n towards the
//! edge. A constant that the simulation removed from the scene (the pedestal) is added back to dirty, model and restored images.

use super::beam_fit::fit_beam;
use super::imager::Imager;
use super::options::BeamShape;
use crate::fourier::Real;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{BrightnessUnit, Image, RestoringBeam, SkyGrid, SpectralWindow, VisUnit};
use ndarray::{Array2, Array4, ArrayView2, Axis, Zip};

/// The content of a plane. It determines the unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The dirty beam.
    Psf,
    /// Flux per beam, with the scene.
    Dirty,
    /// Flux per beam, without the model.
    Residual,
    /// Flux per pixel.
    Model,
    /// The restored image.
    Restored,
}

/// Where the pattern of the elements is below this part of its peak, an image that is divided by it shows mostly noise.
pub const PATTERN_LIMIT: f64 = 0.2;

impl Imager<'_> {
    /// The power pattern of the elements at the pixels \[m, l\], at the mean frequency of an output channel; `None` where they have none.
    #[must_use]
    pub fn pattern_of(&self, channel: usize) -> Option<Array2<f64>> {
        let pattern = &self.header().layout.pattern;
        (!pattern.is_none()).then(|| pattern.plane(self.grid(), self.mean_hz(channel)))
    }

    /// The mean frequency of the data of an output channel, Hz.
    pub(super) fn mean_hz(&self, channel: usize) -> f64 {
        let range = self.channels()[channel].clone();
        let (freq, weight) = (&self.header().spectrum.freq_hz()[range.clone()], &self.survey().channel_weight[range]);
        let sum: f64 = weight.iter().sum();
        let mean = freq.iter().zip(weight).map(|(f, w)| f * w).sum::<f64>() / sum;
        if sum > 0.0 { mean } else { freq[0] }
    }

    /// The restoring beam for a dirty beam: the beam of the options, or a fitted one.
    ///
    /// # Errors
    /// No Gaussian fits the main lobe.
    pub fn beam_of<P: Real>(&self, psf: ArrayView2<'_, P>) -> Result<RestoringBeam> {
        let fit = self.options().beam.map(BeamShape::restoring).or_else(|| fit_beam(self.grid(), psf));
        fit.ok_or_else(|| ChainError::NoData("no Gaussian fits the main lobe of the dirty beam: give a beam, or a smaller cell".into()))
    }

    /// Make an image of the planes \[m, l\] of all output channels, in their precision. Files have single precision, so that planes in single
    /// precision lose nothing before they are written.
    pub(crate) fn image<P: Real>(&self, planes: Vec<Array2<P>>, kind: Kind, beams: &[RestoringBeam]) -> Result<Image<P>> {
        let grid = self.grid();
        let header = self.header();
        let kelvin = header.unit == VisUnit::KelvinSr;
        let made = |(k, plane): (usize, Array2<P>)| -> Result<Array2<P>> {
            let mut plane = if kelvin { in_kelvin(grid, plane, kind, beams.get(k), header.pedestal_k)? } else { plane };
            if matches!(kind, Kind::Dirty | Kind::Model | Kind::Restored)
                && let Some(background) = self.background_of(k)
            {
                // Flux a pixel as brightness: the background has no structure that the beam could smooth.
                let cell = |at: (usize, usize)| {
                    let n2 = 1.0 - grid.l_at(at.1 as f64).powi(2) - grid.m_at(at.0 as f64).powi(2);
                    background[at] * n2.max(0.0).sqrt() / grid.cell_sr()
                };
                plane.indexed_iter_mut().for_each(|(at, v)| *v = P::of(v.to64() + cell(at)));
            }
            Ok(plane)
        };
        let single = planes.len() == 1;
        let mut data = Array4::from_elem(if single { (0, 0, 0, 0) } else { (planes.len(), 1, grid.n_m, grid.n_l) }, P::default());
        for (k, plane) in planes.into_iter().enumerate() {
            let plane = made((k, plane))?;
            if single {
                // The plane becomes the image without a copy.
                data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
            } else {
                data.index_axis_mut(Axis(0), k).index_axis_mut(Axis(0), 0).assign(&plane);
            }
        }
        let unit = match (kind, kelvin) {
            (Kind::Psf, _) => BrightnessUnit::One,
            (_, true) => BrightnessUnit::Kelvin,
            (Kind::Model, false) => BrightnessUnit::JyPerPixel,
            (_, false) => BrightnessUnit::JyPerBeam,
        };
        let mut image = Image::new(grid.clone(), self.spectrum_out()?, vec![self.options().pol], data, unit)?;
        image.beams = if kind == Kind::Model { Vec::new() } else { beams.to_vec() };
        image.telescope.clone_from(&header.telescope);
        image.object = header.phase_centers.get(self.survey().phase_center).map_or(String::new(), |p| p.name.clone());
        image.time_jd = self.survey().time_jd;
        let shows_scene = matches!(kind, Kind::Dirty | Kind::Model | Kind::Restored);
        image.pedestal_k = header.pedestal_k.filter(|_| kelvin && shows_scene);
        if kind != Kind::Psf {
            image.pattern.clone_from(&header.layout.pattern);
        }
        image.near_field.clone_from(&header.near_field);
        image.history.clone_from(&header.history);
        Ok(image)
    }

    /// A spectral window with one channel for each output channel.
    pub(super) fn spectrum_out(&self) -> Result<SpectralWindow> {
        let s = &self.header().spectrum;
        let part = |r: &std::ops::Range<usize>| SpectralWindow::new(s.freq_hz()[r.clone()].to_vec(), s.width_hz()[r.clone()].to_vec());
        let parts = self.channels().iter().map(part).collect::<std::result::Result<Vec<_>, _>>()?;
        let centers = parts.iter().map(SpectralWindow::mean_hz).collect();
        Ok(SpectralWindow::new(centers, parts.iter().map(SpectralWindow::extent_hz).collect())?)
    }
}

fn in_kelvin<P: Real>(
    grid: &SkyGrid,
    mut plane: Array2<P>,
    kind: Kind,
    beam: Option<&RestoringBeam>,
    pedestal: Option<f64>,
) -> Result<Array2<P>> {
    let solid_angle = match (kind, beam) {
        (Kind::Psf, _) => return Ok(plane),
        (Kind::Model, _) => grid.cell_sr(),
        (_, Some(beam)) => beam.solid_angle_sr(),
        (_, None) => return Err(ChainError::Internal("an image in kelvin has no restoring beam".into())),
    };
    let raw = matches!(kind, Kind::Dirty | Kind::Residual);
    let constant = if kind == Kind::Residual { 0.0 } else { pedestal.unwrap_or(0.0) };
    Zip::indexed(&mut plane).par_for_each(|(i, j), v| {
        let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
        let n = if raw { 1.0 } else { (1.0 - l * l - m * m).max(0.0).sqrt() };
        *v = P::of(v.to64() * n / solid_angle + constant);
    });
    Ok(plane)
}

/// Dirty beams of all output channels, and their restoring beams. The list of restoring beams is empty, with a warning, if one cannot be fitted.
///
/// # Errors
/// As [`Imager::psf`].
pub fn psf_image(imager: &mut Imager<'_>, observer: &dyn Observer) -> Result<(Image<f32>, Vec<RestoringBeam>)> {
    let planes = (0..imager.channels().len()).map(|k| imager.psf_in::<f32>(k, observer)).collect::<Result<Vec<_>>>()?;
    let beams: Vec<Option<RestoringBeam>> = planes.iter().map(|p| imager.beam_of(p.view()).ok()).collect();
    let all: Option<Vec<RestoringBeam>> = beams.into_iter().collect();
    if all.is_none() {
        observer.event(Event::Warning("no Gaussian fits the main lobe of the dirty beam: no restoring beam is recorded"));
    }
    let beams = all.unwrap_or_default();
    Ok((imager.image(planes, Kind::Psf, &beams)?, beams))
}

/// Dirty images of all output channels. A set in `K str` needs the beam for the conversion to kelvin, so the beam is made and fitted first.
/// For a set in Jy this is done if `with_beam` is true.
///
/// # Errors
/// As [`Imager::dirty`] and [`Imager::psf`]; also if the set is in `K str` and no Gaussian fits the beam.
pub fn dirty_image(imager: &mut Imager<'_>, with_beam: bool, observer: &dyn Observer) -> Result<Image<f32>> {
    let kelvin = imager.header().unit == VisUnit::KelvinSr;
    let mut beams = Vec::new();
    if with_beam || kelvin {
        for k in 0..imager.channels().len() {
            match imager.restoring_beam(k, observer)? {
                Ok(beam) => beams.push(beam),
                Err(e) if kelvin => return Err(e),
                Err(e) => observer.event(Event::Warning(&e.to_string())),
            }
        }
        if beams.len() != imager.channels().len() {
            beams.clear();
        }
    }
    let planes = (0..imager.channels().len()).map(|k| imager.dirty_in::<f32>(k, observer)).collect::<Result<Vec<_>>>()?;
    imager.image(planes, Kind::Dirty, &beams)
}

//! Planes as images with units, beams and history.
//!
//! A set in Jy gives Jy/beam, and models in Jy/pixel. A set in `K str` gives kelvin: a flux a beam divided by the solid angle of the
//! restoring beam is the brightness averaged over it, a model's flux divided by the solid angle of a cell is brightness. Models and
//! restored images are multiplied by n as well, because a cell of direction cosines sees 1/n of solid angle more towards the edge.
//! A constant that was taken from the scene before it was observed is added back to whatever shows the scene.

use super::{BeamShape, Imager, fit_beam};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{BrightnessUnit, Image, RestoringBeam, SkyGrid, SpectralWindow, VisUnit};
use ndarray::{Array2, Array4, Axis};

/// What a plane shows, and so its unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The dirty beam.
    Psf,
    /// Flux a beam with the scene in it.
    Dirty,
    /// Flux a beam without it.
    Residual,
    /// Flux a pixel.
    Model,
    /// The restored image.
    Restored,
}

/// What was chosen and found on the way to an image.
#[derive(Debug, Clone, PartialEq)]
pub struct ImagingInfo {
    /// Where the pixels are.
    pub grid: SkyGrid,
    /// The beam of each output channel, where one could be fitted or was given.
    pub beams: Vec<RestoringBeam>,
    /// What became of the data.
    pub counts: super::DataCounts,
    /// Shortest and longest baseline, wavelengths.
    pub uv_range_wl: (f64, f64),
    /// Sum of the weights of the image.
    pub sum_of_weights: Vec<f64>,
}

impl Imager<'_> {
    /// The restoring beam of a dirty beam: as given in the options, or fitted.
    ///
    /// # Errors
    /// A main lobe that no Gaussian fits.
    pub fn beam_of(&self, psf: &Array2<f64>) -> Result<RestoringBeam> {
        let fit = self.options().beam.map(BeamShape::restoring).or_else(|| fit_beam(self.grid(), psf.view()));
        fit.ok_or_else(|| ChainError::NoData("no Gaussian fits the main lobe of the dirty beam: give a beam, or a smaller cell".into()))
    }

    /// Facts for a report.
    #[must_use]
    pub fn info(&self, beams: Vec<RestoringBeam>) -> ImagingInfo {
        ImagingInfo {
            grid: self.grid().clone(),
            beams,
            counts: self.survey().counts,
            uv_range_wl: self.survey().uv_range_wl,
            sum_of_weights: (0..self.channels().len()).map(|k| self.sum_of_weights(k)).collect(),
        }
    }

    /// Planes \[m, l\] of all output channels as an image.
    pub(crate) fn image(&self, planes: Vec<Array2<f64>>, kind: Kind, beams: &[RestoringBeam]) -> Result<Image> {
        let grid = self.grid();
        let header = self.header();
        let kelvin = header.unit == VisUnit::KelvinSr;
        let mut data = Array4::zeros((planes.len(), 1, grid.n_m, grid.n_l));
        for (k, plane) in planes.into_iter().enumerate() {
            let plane = if kelvin { in_kelvin(grid, plane, kind, beams.get(k), header.pedestal_k) } else { plane };
            data.index_axis_mut(Axis(0), k).index_axis_mut(Axis(0), 0).assign(&plane);
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
        image.history.clone_from(&header.history);
        Ok(image)
    }

    fn spectrum_out(&self) -> Result<SpectralWindow> {
        let s = &self.header().spectrum;
        let part = |r: &std::ops::Range<usize>| SpectralWindow::new(s.freq_hz()[r.clone()].to_vec(), s.width_hz()[r.clone()].to_vec());
        let parts = self.channels().iter().map(part).collect::<std::result::Result<Vec<_>, _>>()?;
        let centers = parts.iter().map(SpectralWindow::mean_hz).collect();
        Ok(SpectralWindow::new(centers, parts.iter().map(SpectralWindow::extent_hz).collect())?)
    }
}

fn in_kelvin(grid: &SkyGrid, mut plane: Array2<f64>, kind: Kind, beam: Option<&RestoringBeam>, pedestal: Option<f64>) -> Array2<f64> {
    let solid_angle = match kind {
        Kind::Psf => return plane,
        Kind::Model => grid.cell_sr(),
        _ => beam.map_or(f64::NAN, RestoringBeam::solid_angle_sr),
    };
    let raw = matches!(kind, Kind::Dirty | Kind::Residual);
    let constant = if kind == Kind::Residual { 0.0 } else { pedestal.unwrap_or(0.0) };
    for ((i, j), v) in plane.indexed_iter_mut() {
        let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
        let n = if raw { 1.0 } else { (1.0 - l * l - m * m).max(0.0).sqrt() };
        *v = *v * n / solid_angle + constant;
    }
    plane
}

/// Dirty beams of all output channels, and their fitted beams where a fit is possible.
///
/// # Errors
/// As [`Imager::psf`].
pub fn psf_image(imager: &mut Imager<'_>, observer: &dyn Observer) -> Result<(Image, Vec<RestoringBeam>)> {
    let planes = (0..imager.channels().len()).map(|k| imager.psf(k, observer)).collect::<Result<Vec<_>>>()?;
    let beams: Vec<Option<RestoringBeam>> = planes.iter().map(|p| imager.beam_of(p).ok()).collect();
    let all: Option<Vec<RestoringBeam>> = beams.into_iter().collect();
    if all.is_none() {
        observer.event(Event::Warning("no Gaussian fits the main lobe of the dirty beam: no restoring beam is recorded"));
    }
    let beams = all.unwrap_or_default();
    Ok((imager.image(planes, Kind::Psf, &beams)?, beams))
}

/// Dirty images of all output channels. For a set in `K str` the beam is needed to give kelvin, so it is made and fitted first;
/// for one in Jy that is done where `with_beam` asks for it.
///
/// # Errors
/// As [`Imager::dirty`] and [`Imager::psf`]; a set in `K str` whose beam no Gaussian fits.
pub fn dirty_image(imager: &mut Imager<'_>, with_beam: bool, observer: &dyn Observer) -> Result<Image> {
    let kelvin = imager.header().unit == VisUnit::KelvinSr;
    let mut beams = Vec::new();
    if with_beam || kelvin {
        for k in 0..imager.channels().len() {
            let psf = if imager.options().beam.is_some() { Array2::zeros((0, 0)) } else { imager.psf_core(k, observer)? };
            match imager.beam_of(&psf) {
                Ok(beam) => beams.push(beam),
                Err(e) if kelvin => return Err(e),
                Err(e) => observer.event(Event::Warning(&e.to_string())),
            }
        }
        if beams.len() != imager.channels().len() {
            beams.clear();
        }
    }
    let planes = (0..imager.channels().len()).map(|k| imager.dirty(k, observer)).collect::<Result<Vec<_>>>()?;
    imager.image(planes, Kind::Dirty, &beams)
}

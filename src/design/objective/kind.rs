//! The form of an objective.

use crate::Result;
use crate::design::peaks::Ring;
use crate::design::profile::Profile;
use crate::design::views::View;
use std::fmt;
use std::sync::Arc;

/// A figure of merit of a layout. Each thread has its own, with the memory that it needs.
pub trait Objective: Send {
    /// The figure of a layout; smaller is better.
    ///
    /// # Errors
    /// The chain behind the figure fails.
    fn value(&mut self, xy: &[[f64; 2]]) -> Result<f64>;

    /// A smooth function that tends to the figure as `doublings` grows, with its gradient by the positions added to `gradient`, times `weight`.
    /// `None` for an objective without gradient.
    fn smooth(&mut self, xy: &[[f64; 2]], doublings: u32, weight: f64, gradient: &mut [[f64; 2]]) -> Option<f64> {
        let _ = (xy, doublings, weight, gradient);
        None
    }
}

/// A figure of a layout that is computed outside of this folder.
#[derive(Clone)]
pub struct LayoutFigure(pub Arc<FigureFunction>);

/// Positions in apertures to the figure.
pub type FigureFunction = dyn Fn(&[[f64; 2]]) -> Result<f64> + Send + Sync;

impl fmt::Debug for LayoutFigure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LayoutFigure")
    }
}

impl PartialEq for LayoutFigure {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// What objectives know about the observation. The unit of length is the aperture, that of directions the wavelength over the aperture.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// The views of the observation.
    pub views: Vec<View>,
    /// Where side lobes count.
    pub ring: Ring,
    /// Two baselines are equal if they differ by at most this.
    pub tolerance: f64,
    /// The target density of baselines.
    pub density: Profile,
    /// The error of the image of a scene, if one is given.
    pub scene: Option<LayoutFigure>,
    /// The part of the u-v plane that stations on given sites leave empty over a track, if the elements are chosen among sites.
    pub coverage: Option<LayoutFigure>,
}

/// A kind of objective.
pub struct ObjectiveKind {
    /// Its name on the command line.
    pub name: &'static str,
    /// What it measures, in a line.
    pub about: &'static str,
    /// True if it has a gradient.
    pub gradient: bool,
    /// Makes one.
    pub make: fn(&Setting) -> Result<Box<dyn Objective>>,
}

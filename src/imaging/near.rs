//! What images of scenes near the array are made with, and a warning where a Fourier image of such a scene is not valid.

use crate::Result;
use crate::nearfield::{Elements, PathTransform, RangeChoice, Surface, Validity};
use crate::progress::{Event, Observer};
use crate::values::need;
use cittert_arrays::{SkyGrid, VisibilityHeader};

/// Pixels along each side of the map by which a Fourier image is judged.
const JUDGED_SIDE: usize = 48;

/// The surface of an image, and the transform of the output channel that was imaged last.
#[derive(Debug)]
pub(super) struct Near {
    pub(super) surface: Surface,
    pub(super) elements: Elements,
    pub(super) kept: Option<(usize, Prepared)>,
}

/// The transform of an output channel on a grid.
#[derive(Debug)]
pub(super) struct Prepared {
    pub(super) transform: PathTransform,
    /// Number of each point among the pixels, row after row. Pixels behind the horizon have no point.
    pub(super) pixels: Vec<usize>,
    /// Sum of the imaging weights over sum w |h|^2 at each point, once it is known.
    pub(super) gain: Option<Vec<f64>>,
}

impl Near {
    /// For the images of a set on a grid.
    ///
    /// # Errors
    /// A set of an array on the Earth, a surface that does not fit the grid or is nearer than the farthest element.
    pub(super) fn new(
        header: &VisibilityHeader,
        (surface, no_w): (Surface, bool),
        grid: &SkyGrid,
        observer: &dyn Observer,
    ) -> Result<Self> {
        need("no-w", no_w, !no_w, "false: the near field has no w term that could be left out")?;
        let elements = Elements::new(&header.layout, header.near_field.focus)?;
        surface.check(grid)?;
        elements.check_distance(surface.nearest_m())?;
        let adds = 8.0 * (elements.len() as f64).powi(2) * (grid.n_l * grid.n_m * header.spectrum.n_chan()) as f64;
        let range = surface.scene_range();
        observer.event(Event::Note(&format!(
            "the image is made by spherical waves from a scene at {range}: {adds:.1e} multiply-adds for each pass over image and data"
        )));
        Ok(Self { surface, elements, kept: None })
    }
}

/// Warn where a Fourier image of a set in the near field is not valid.
pub(super) fn warn_invalid(header: &VisibilityHeader, grid: &SkyGrid, observer: &dyn Observer) -> Result<()> {
    let near = &header.near_field;
    let (false, Ok(surface), Ok(elements)) = (near.is_far(), RangeChoice::Auto.surface_of(near), Elements::new(&header.layout, None))
    else {
        return Ok(());
    };
    let most = grid.n_l.max(grid.n_m);
    let side = |n: usize| (n * JUDGED_SIDE / most).clamp(2, n);
    let coarse = SkyGrid::new(side(grid.n_l), side(grid.n_m), grid.cell_rad * (most as f64 / side(most) as f64), grid.frame.clone())?;
    let map = Validity::new(&elements, near.focus, &surface, &coarse, header.spectrum.range_hz().1)?;
    if map.valid == map.pixels {
        return Ok(());
    }
    let percent = 100.0 * (map.pixels - map.valid) as f64 / map.pixels as f64;
    let (what, advice) = match near.focus {
        None => ("the set is not focused, and its scene is near", "focus it (cittert focus), or give --range auto"),
        Some(_) => ("beyond the surroundings of the focus a Fourier image is blurred", "give --range auto for an exact image"),
    };
    observer.event(Event::Warning(&format!(
        "{what}: in {percent:.0} % of the image the residual phase exceeds pi/8, from {:.3} rad off the focus, and reaches {:.1} rad: {advice}",
        map.radius_rad,
        map.largest_rad()
    )));
    Ok(())
}

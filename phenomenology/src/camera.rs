//! The camera: its position and direction, and the ray of every pixel.

use crate::error::SceneError;
use crate::space::Vec3;
use cittert_arrays::{SkyFrame, SkyGrid};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Projection of directions on the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Projection {
    /// Direction cosines, the coordinates in which an interferometer measures.
    #[default]
    Sin,
    /// Straight lines stay straight, as in a photograph.
    Pinhole,
}

/// `[camera]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Position, m: east, north, up.
    pub position_m: [f64; 3],
    /// Point at the centre of the picture, m. It replaces heading and pitch.
    pub look_at_m: Option<[f64; 3]>,
    /// Direction of view, degrees from north over east.
    #[serde(default)]
    pub heading_deg: f64,
    /// Elevation of the direction of view, degrees.
    #[serde(default)]
    pub pitch_deg: f64,
    /// Roll of the camera to the right, degrees.
    #[serde(default)]
    pub roll_deg: f64,
    /// Full angle across the wider side of the picture, degrees.
    #[serde(default = "default_fov_deg")]
    pub fov_deg: f64,
    /// Columns and rows.
    #[serde(default = "default_size_px")]
    pub size_px: [usize; 2],
    /// Projection.
    #[serde(default)]
    pub projection: Projection,
}

fn default_fov_deg() -> f64 {
    30.0
}

fn default_size_px() -> [usize; 2] {
    [512, 512]
}

/// The three axes of a camera, unit vectors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axes {
    /// To the right of the picture.
    pub right: Vec3,
    /// To the top of the picture.
    pub up: Vec3,
    /// To the centre of the picture.
    pub forward: Vec3,
}

impl Camera {
    /// The axes of the camera.
    ///
    /// # Errors
    /// Numbers that are not finite; a point to look at that is the position of the camera.
    pub fn axes(&self) -> Result<Axes, SceneError> {
        let angles = [self.heading_deg, self.pitch_deg, self.roll_deg];
        let position = Vec3::from(self.position_m);
        let finite = position.is_finite() && angles.iter().all(|a| a.is_finite());
        let value = format_args!("at {:?} m with angles {angles:?} deg", self.position_m);
        SceneError::unless(finite, "[camera]", value, "finite numbers")?;
        let (heading, pitch) = match self.look_at_m {
            None => (self.heading_deg.to_radians(), self.pitch_deg.to_radians()),
            Some(target) => {
                let d = Vec3::from(target) - position;
                let value = format_args!("looking at {target:?} from there");
                SceneError::unless(d.is_finite() && d.norm() > 0.0, "[camera]", value, "a finite point away from the camera")?;
                (d.x.atan2(d.y), d.z.atan2(d.x.hypot(d.y)))
            }
        };
        let ((sh, ch), (sp, cp), (sr, cr)) = (heading.sin_cos(), pitch.sin_cos(), self.roll_deg.to_radians().sin_cos());
        let forward = Vec3::new(sh * cp, ch * cp, sp);
        let right = Vec3::new(ch, -sh, 0.0);
        let up = Vec3::new(-sh * sp, -ch * sp, cp);
        Ok(Axes { right: right * cr - up * sr, up: up * cr + right * sr, forward })
    }

    /// The same camera with a square picture of `side_px` pixels on each side, over the same field of view.
    #[must_use]
    pub fn with_side(&self, side_px: usize) -> Self {
        Self { size_px: [side_px, side_px], ..self.clone() }
    }

    /// The same camera with the projection of an interferometer.
    #[must_use]
    pub fn in_direction_cosines(&self) -> Self {
        Self { projection: Projection::Sin, ..self.clone() }
    }

    /// The grid of the picture: direction cosines for [`Projection::Sin`], tangents for [`Projection::Pinhole`].
    ///
    /// # Errors
    /// A size or field of view out of range.
    pub fn grid(&self) -> Result<SkyGrid, SceneError> {
        let [columns, rows] = self.size_px;
        let widest = columns.max(rows) as f64;
        let limit = if self.projection == Projection::Sin { 180.0 } else { 179.0 };
        SceneError::unless(
            self.fov_deg > 0.0 && self.fov_deg <= limit,
            "fov_deg of [camera]",
            self.fov_deg,
            "above 0 and at most 180 deg (179 for pinhole)",
        )?;
        let half = (0.5 * self.fov_deg).to_radians();
        let reach = if self.projection == Projection::Sin { half.sin() } else { half.tan().min(0.999) };
        Ok(SkyGrid::new(columns, rows, 2.0 * reach / widest, SkyFrame::Boresight)?)
    }

    /// Factor between a tangent and its coordinate on the grid. A grid reaches 0.999 at most, and the tangent of a wide pinhole camera
    /// exceeds it.
    fn stretch(&self) -> f64 {
        let tan = (0.5 * self.fov_deg).to_radians().tan();
        tan / tan.min(0.999)
    }
}

/// A camera with the directions of its pixels.
#[derive(Debug, Clone)]
pub struct View {
    /// Position of the camera, where all rays start, m.
    pub position: Vec3,
    axes: Axes,
    grid: SkyGrid,
    projection: Projection,
    scale: f64,
    /// Place of the first pixel of a part of a picture, relative to that of a picture of the same size around the axis.
    shift: [f64; 2],
}

impl View {
    /// The view of a camera on a grid of direction cosines. The projection of the camera is not used.
    ///
    /// # Errors
    /// As [`Camera::axes`].
    pub fn on_grid(camera: &Camera, grid: &SkyGrid) -> Result<Self, SceneError> {
        let position = Vec3::from(camera.position_m);
        Ok(Self { position, axes: camera.axes()?, grid: grid.clone(), projection: Projection::Sin, scale: 1.0, shift: [0.0; 2] })
    }

    /// The view of a camera with its own size, field of view and projection.
    ///
    /// # Errors
    /// As [`Camera::axes`] and [`Camera::grid`].
    pub fn of_camera(camera: &Camera) -> Result<Self, SceneError> {
        let position = Vec3::from(camera.position_m);
        let scale = if camera.projection == Projection::Pinhole { camera.stretch() } else { 1.0 };
        Ok(Self { position, axes: camera.axes()?, grid: camera.grid()?, projection: camera.projection, scale, shift: [0.0; 2] })
    }

    /// The same view with pixels that are wider by this factor, so that there are fewer: two on each side, or more. It must not be a part of another.
    ///
    /// # Errors
    /// A factor that is not finite.
    pub fn with_wider_pixels(&self, factor: f64) -> Result<Self, SceneError> {
        let fewer = |n: usize| (n as f64 / factor).round().max(2.0) as usize;
        let grid = SkyGrid::new(fewer(self.grid.n_l), fewer(self.grid.n_m), self.grid.cell_rad * factor, self.grid.frame.clone())?;
        Ok(Self { grid, ..self.clone() })
    }

    /// A part of the view: so many columns and rows from this column and row on. Its grid has the pixels of the part, and its rays are those of the whole.
    ///
    /// # Errors
    /// Fewer than two columns or rows.
    pub fn part(&self, [column, row]: [usize; 2], [columns, rows]: [usize; 2]) -> Result<Self, SceneError> {
        let grid = SkyGrid::new(columns, rows, self.grid.cell_rad, self.grid.frame.clone())?;
        let moved = |first: usize, part: usize, whole: usize| first as f64 + (part / 2) as f64 - (whole / 2) as f64;
        let shift = [moved(column, columns, self.grid.n_l) + self.shift[0], moved(row, rows, self.grid.n_m) + self.shift[1]];
        Ok(Self { grid, shift, ..self.clone() })
    }

    /// The grid.
    #[must_use]
    pub fn grid(&self) -> &SkyGrid {
        &self.grid
    }

    /// Direction of a pixel with fractional coordinates. `None` outside the visible hemisphere.
    #[must_use]
    #[inline]
    pub fn direction(&self, column: f64, row: f64) -> Option<Vec3> {
        self.along(column, row).map(|along| self.unit(along))
    }

    /// A vector along the direction of a pixel, whose length saves a square root where it does not matter.
    #[must_use]
    #[inline]
    pub(crate) fn along(&self, column: f64, row: f64) -> Option<Vec3> {
        // On the sky l increases to the east, which is to the left in the picture.
        let [right, up] = self.shift;
        let (x, y) = (self.grid.l_sign() * self.grid.l_at(column + right) * self.scale, self.grid.m_at(row + up) * self.scale);
        let across = self.axes.right * x + self.axes.up * y;
        match self.projection {
            Projection::Sin => {
                let rest = 1.0 - x * x - y * y;
                (rest > 0.0).then(|| across + self.axes.forward * rest.sqrt())
            }
            Projection::Pinhole => Some(across + self.axes.forward),
        }
    }

    /// The direction of a vector that [`View::along`] gave.
    #[must_use]
    #[inline]
    pub(crate) fn unit(&self, along: Vec3) -> Vec3 {
        match self.projection {
            Projection::Sin => along,
            Projection::Pinhole => along.unit(),
        }
    }

    /// Direction of the horizontal polarisation of a ray: along l to the right, and perpendicular to the ray.
    #[must_use]
    #[inline]
    pub fn reference(&self, direction: Vec3) -> Vec3 {
        let right = self.axes.right;
        let across = right - direction * right.dot(direction);
        if across.norm2() > 1e-12 { across.unit() } else { self.axes.forward }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position_m: [0.0, 0.0, 10.0],
            look_at_m: None,
            heading_deg: 90.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 60.0,
            size_px: [64, 32],
            projection: Projection::Pinhole,
        }
    }

    fn near(a: Vec3, b: Vec3) -> bool {
        (a - b).norm() < 1e-12
    }

    #[test]
    fn heading_east_has_south_to_the_right() {
        let a = camera().axes().unwrap();
        assert!(near(a.forward, Vec3::new(1.0, 0.0, 0.0)) && near(a.right, Vec3::new(0.0, -1.0, 0.0)) && near(a.up, Vec3::UP));
        let looking = Camera { look_at_m: Some([5.0, 0.0, 10.0]), ..camera() }.axes().unwrap();
        assert!(near(looking.forward, a.forward) && near(looking.right, a.right));
        let down = Camera { pitch_deg: -90.0, ..camera() }.axes().unwrap();
        assert!(near(down.forward, -Vec3::UP) && near(down.up, Vec3::new(1.0, 0.0, 0.0)));
        // Leaning to the right, the horizon rises on the right: right of the picture points down.
        let leaning = Camera { roll_deg: 90.0, ..camera() }.axes().unwrap();
        assert!(near(leaning.right, -Vec3::UP));
    }

    #[test]
    fn the_edge_of_both_projections_is_half_the_field() {
        for projection in [Projection::Sin, Projection::Pinhole] {
            let c = Camera { projection, ..camera() };
            let v = View::of_camera(&c).unwrap();
            let d = v.direction(64.0, 16.0).unwrap();
            assert!((d.dot(c.axes().unwrap().forward).acos().to_degrees() - 30.0).abs() < 1e-9);
            assert!(near(v.direction(32.0, 16.0).unwrap(), c.axes().unwrap().forward));
        }
    }

    #[test]
    fn wide_pinholes_keep_their_field() {
        let c = Camera { fov_deg: 120.0, ..camera() };
        let d = View::of_camera(&c).unwrap().direction(64.0, 16.0).unwrap();
        assert!((d.dot(c.axes().unwrap().forward).acos().to_degrees() - 60.0).abs() < 1e-9);
    }

    #[test]
    fn impossible_cameras_are_refused() {
        assert!(Camera { heading_deg: f64::NAN, ..camera() }.axes().is_err());
        assert!(Camera { look_at_m: Some([0.0, 0.0, 10.0]), ..camera() }.axes().is_err());
        assert!(Camera { fov_deg: 0.0, ..camera() }.grid().is_err());
    }

    #[test]
    fn a_part_of_a_view_has_its_rays() {
        let camera = Camera { size_px: [101, 64], ..camera() };
        let whole = View::of_camera(&camera).unwrap();
        let part = whole.part([33, 40], [32, 24]).unwrap();
        assert_eq!((part.grid().n_l, part.grid().n_m), (32, 24));
        for (column, row) in [(0.0, 0.0), (31.0, 23.0), (4.25, 7.5)] {
            let (a, b) = (part.direction(column, row).unwrap(), whole.direction(column + 33.0, row + 40.0).unwrap());
            assert!((a - b).norm() < 1e-15, "{a:?} {b:?}");
        }
        assert!(whole.part([0, 0], [0, 4]).is_err());
        let wide = whole.with_wider_pixels(2.0).unwrap();
        assert_eq!((wide.grid().n_l, wide.grid().n_m, wide.grid().cell_rad), (51, 32, 2.0 * whole.grid().cell_rad));
    }
}

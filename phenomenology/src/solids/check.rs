//! Checks of the position of a camera.

use super::scene::SolidScene;
use crate::camera::Camera;
use crate::error::{Result, SceneError};
use crate::space::Vec3;

impl SolidScene {
    /// The same scene with another camera.
    ///
    /// # Errors
    /// A camera inside a solid or under the ground, or with impossible numbers.
    pub fn with_camera(mut self, camera: Camera) -> Result<Self> {
        self.file.camera = Some(toml::Spanned::new(0..0, camera));
        self.camera_line = 0;
        self.check_camera()?;
        Ok(self)
    }

    /// Checks that the camera of the file is outside all solids.
    pub(super) fn check_camera(&self) -> Result<()> {
        let Some(camera) = &self.file.camera else { return Ok(()) };
        self.check_camera_line(camera.get_ref(), self.camera_line)
    }

    /// Checks that a camera is outside all solids and that its picture has a grid.
    ///
    /// # Errors
    /// A camera inside a solid, under the ground, or with impossible numbers.
    pub fn check_camera_at(&self, camera: &Camera) -> Result<()> {
        self.check_camera_line(camera, 0)
    }

    fn check_camera_line(&self, camera: &Camera, line: usize) -> Result<()> {
        camera.axes().and_then(|_| camera.grid()).map_err(|e| SceneError::at(line, e.to_string()))?;
        self.check_position_at(Vec3::from(camera.position_m), line)
    }

    /// Checks that a position is outside all solids and above the ground.
    pub(crate) fn check_position(&self, position: Vec3) -> Result<()> {
        self.check_position_at(position, self.camera_line)
    }

    fn check_position_at(&self, position: Vec3, line: usize) -> Result<()> {
        let position_m = position.to_array();
        if let Some(ground) = &self.terrain {
            let ground_m = ground.height_m(position.x, position.y);
            if position.z <= ground_m {
                let message = format!("the camera at {position_m:?} m lies under the ground, which is at {ground_m} m there; raise it");
                return Err(SceneError::at(line, message));
            }
        }
        if let Some(region) = self.geometry.region_at(position) {
            let source = &self.geometry.regions()[region].source;
            if !source.void {
                let message = format!("the camera at {position_m:?} m lies inside region `{}`; move it out", source.name);
                return Err(SceneError::at(line, message));
            }
        }
        Ok(())
    }
}

//! The path of a moving camera.

use crate::camera::Camera;
use crate::error::{Result, SceneError};
use serde::{Deserialize, Serialize};

/// Position of the camera and the point it looks at, at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeyFrame {
    /// Time, s.
    pub time_s: f64,
    /// Position of the camera, m.
    pub position_m: [f64; 3],
    /// Point at the centre of the picture, m.
    pub look_at_m: [f64; 3],
}

/// The path of a camera: key frames in order of time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Flight {
    /// Path of the scene, relative to the file of the flight.
    pub scene: Option<String>,
    /// Number of frames per second.
    pub frames_per_second: f64,
    /// Key frames.
    pub key: Vec<KeyFrame>,
}

/// Largest number of frames of a flight.
const MAX_FRAMES: f64 = 1e5;

impl Flight {
    /// Read from TOML.
    ///
    /// # Errors
    /// TOML that does not parse or has unknown keys (with the line); fewer than two key frames, times that do not rise, numbers
    /// that are not finite, too many frames.
    pub fn from_toml(text: &str) -> Result<Self> {
        let flight: Self = toml::from_str(text)?;
        flight.check()?;
        Ok(flight)
    }

    /// Refuse a flight that cannot be flown.
    ///
    /// # Errors
    /// As [`Flight::from_toml`].
    pub fn check(&self) -> Result<()> {
        let finite = |k: &KeyFrame| k.time_s.is_finite() && k.position_m.iter().chain(&k.look_at_m).all(|x| x.is_finite());
        let rising = self.key.len() >= 2 && self.key.iter().all(finite) && self.key.windows(2).all(|w| w[1].time_s > w[0].time_s);
        let keys = format_args!("{} frames", self.key.len());
        SceneError::unless(rising, "[[key]] of the flight", keys, "two or more with rising times and finite numbers")?;
        let rate = self.frames_per_second;
        let some = rate > 0.0 && rate * self.duration_s() <= MAX_FRAMES;
        SceneError::unless(some, "frames_per_second", rate, "above 0, and at most 100000 frames in all")?;
        Ok(())
    }

    /// Time from the first to the last key frame, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match (self.key.first(), self.key.last()) {
            (Some(a), Some(b)) => b.time_s - a.time_s,
            _ => 0.0,
        }
    }

    /// The given camera at one time on straight lines between the key frames. Before the first key frame and after the last, it stands still.
    ///
    /// # Errors
    /// As [`Flight::from_toml`], for a flight that was built by hand.
    pub fn camera_at(&self, camera: &Camera, time_s: f64) -> Result<Camera> {
        self.check()?;
        let next = self.key.iter().position(|f| f.time_s > time_s).unwrap_or(self.key.len() - 1).max(1);
        let (a, b) = (&self.key[next - 1], &self.key[next]);
        let w = ((time_s - a.time_s) / (b.time_s - a.time_s)).clamp(0.0, 1.0);
        let mix = |p: [f64; 3], q: [f64; 3]| std::array::from_fn(|i| p[i] + w * (q[i] - p[i]));
        Ok(Camera { position_m: mix(a.position_m, b.position_m), look_at_m: Some(mix(a.look_at_m, b.look_at_m)), ..camera.clone() })
    }

    /// The time of every frame, s.
    #[must_use]
    pub fn times_s(&self) -> Vec<f64> {
        let start = self.key.first().map_or(0.0, |f| f.time_s);
        let last = (self.duration_s() * self.frames_per_second + 1e-9).floor() as usize;
        (0..=last).map(|k| start + k as f64 / self.frames_per_second).collect()
    }

    /// A camera for every frame, see [`Flight::camera_at`].
    ///
    /// # Errors
    /// As [`Flight::from_toml`], for a flight that was built by hand.
    pub fn cameras(&self, camera: &Camera) -> Result<Vec<Camera>> {
        self.check()?;
        self.times_s().into_iter().map(|t| self.camera_at(camera, t)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Projection;

    const PATH: &str = "frames_per_second = 2\n[[key]]\ntime_s = 0\nposition_m = [0, 0, 10]\nlook_at_m = [100, 0, 0]\n\
        [[key]]\ntime_s = 2\nposition_m = [20, 0, 10]\nlook_at_m = [100, 0, 0]\n[[key]]\ntime_s = 3\nposition_m = [20, 5, 10]\nlook_at_m = [100, 50, 0]\n";

    #[test]
    fn cameras_follow_the_key_frames() {
        let camera = Camera {
            position_m: [0.0; 3],
            look_at_m: None,
            heading_deg: 0.0,
            pitch_deg: 0.0,
            roll_deg: 0.0,
            fov_deg: 30.0,
            size_px: [8, 8],
            projection: Projection::Sin,
        };
        let cameras = Flight::from_toml(PATH).unwrap().cameras(&camera).unwrap();
        assert_eq!(cameras.len(), 7);
        assert_eq!(cameras[1].position_m, [5.0, 0.0, 10.0]);
        assert_eq!(cameras[5].look_at_m, Some([100.0, 25.0, 0.0]));
        assert_eq!(cameras[6].position_m, [20.0, 5.0, 10.0]);
        let at = |t| Flight::from_toml(PATH).unwrap().camera_at(&camera, t).unwrap().position_m;
        assert_eq!((at(-1.0), at(0.25), at(9.0)), ([0.0, 0.0, 10.0], [2.5, 0.0, 10.0], [20.0, 5.0, 10.0]));
    }

    #[test]
    fn flights_that_cannot_be_are_refused() {
        assert!(Flight::from_toml(&PATH.replace("time_s = 2", "time_s = 4")).is_err());
        assert!(Flight::from_toml(&PATH.replace("second = 2", "second = 0")).is_err());
        assert!(Flight::from_toml(&PATH.replace("look_at_m", "look")).unwrap_err().to_string().contains("line 5"));
    }
}

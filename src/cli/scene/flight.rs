//! A camera that moves through a scene: its options, and its frames.

use super::image::{MeshArgs, frequency};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::options::{TracerArgs, read_scene, scene_text};
use cittert_arrays::SpectralWindow;
use cittert_arrays::quantity::Frequency;
use cittert_phenomenology::camera::Camera;
use cittert_phenomenology::trace::{Flight, Frame, MeshOptions, Picture};
use cittert_phenomenology::{RenderOptions, Scene, SceneError, SolidScene, Tracer, View};
use clap::Args;
use ndarray::Array2;
use std::path::{Path, PathBuf};

/// The path of a camera, its scene and how frames are traced.
#[derive(Debug, Args)]
pub(in crate::cli) struct FlightArgs {
    /// Path of the camera: key frames with time_s, position_m and look_at_m, and frames_per_second (TOML).
    #[arg(value_name = "PATH.toml")]
    pub(in crate::cli) path: PathBuf,
    /// Scene of solids [default: the scene that the path file names, in the folder of the path file].
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// Pixels along each side of a frame; 0 takes the number of pixels of the scene's camera.
    #[arg(long, value_name = "N", default_value_t = 256)]
    size: usize,
    /// Frequency [default: the one that the scene states, or 94GHz].
    #[arg(long, value_name = "FREQ")]
    freq: Option<Frequency>,
    #[command(flatten)]
    tracer: TracerArgs,
    #[command(flatten)]
    mesh: MeshArgs,
}

/// A flight that is ready to be traced.
#[derive(Debug)]
pub(in crate::cli) struct Flown {
    pub(in crate::cli) flight: Flight,
    /// The camera, which the path moves.
    pub(in crate::cli) base: Camera,
    pub(in crate::cli) freq: Frequency,
    scene: SolidScene,
    options: RenderOptions,
    mesh: MeshOptions,
    /// Names of the path and of the scene, for messages.
    named: [String; 2],
}

impl FlightArgs {
    /// The path of the camera, and the file of its scene. `command` is the one that asks, for messages.
    ///
    /// # Errors
    /// A path that is wrong or names no scene, or more than one plane.
    pub(in crate::cli) fn read(&self, command: &str) -> Result<(Flight, PathBuf)> {
        ensure!(self.tracer.pol.len() == 1, Failure::usage(format!("{command} renders one plane; give one --pol")));
        let flight = Flight::from_toml(&scene_text(&self.path)?).context(self.path.display())?;
        let scene = match (&self.scene, &flight.scene) {
            (Some(path), _) => path.clone(),
            (None, Some(name)) => self.path.parent().unwrap_or(Path::new("")).join(name),
            (None, None) => {
                return Err(Failure::usage(format!(
                    "{}: the path file names no scene; write scene = \"...\" in it, or give --scene",
                    self.path.display()
                )));
            }
        };
        Ok((flight, scene))
    }

    /// Read the scene. With `in_direction_cosines` the camera has this projection, whatever the scene says.
    ///
    /// # Errors
    /// A file that is no scene of solids, or has no camera.
    pub(in crate::cli) fn open(&self, flight: Flight, path: &Path, in_direction_cosines: bool, context: &Context) -> Result<Flown> {
        let scene = match read_scene(path)? {
            Scene::Solids(scene) => self.tracer.scene(*scene).context(path.display())?,
            _ => return Err(Failure::usage(format!("{}: this is not a scene of solids, which a flight needs", path.display()))),
        };
        let base = scene.camera().context(path.display())?;
        let base = if self.size == 0 { base.clone() } else { base.with_side(self.size) };
        let base = if in_direction_cosines { base.in_direction_cosines() } else { base };
        let highest_m = flight.key.iter().map(|key| key.position_m[2]).fold(0.0, f64::max);
        let options = RenderOptions { highest_m, ..self.tracer.options(false) };
        let freq = frequency(self.freq, scene.file().freq_hz, context);
        let mesh = self.mesh.options(options.antialias > 1);
        let named = [self.path.display().to_string(), path.display().to_string()];
        Ok(Flown { flight, base, freq, scene, options, mesh, named })
    }
}

impl Flown {
    /// A camera for every frame.
    ///
    /// # Errors
    /// A camera inside of a solid.
    pub(in crate::cli) fn cameras(&self) -> Result<Vec<Camera>> {
        let cameras = self.flight.cameras(&self.base).context(&self.named[0])?;
        for (k, camera) in cameras.iter().enumerate() {
            self.scene.check_camera_at(camera).context(format!("{}: frame {k}", self.named[0]))?;
        }
        Ok(cameras)
    }

    /// The tracer of the scene.
    ///
    /// # Errors
    /// A frequency or a height outside of the tables.
    pub(in crate::cli) fn tracer(&self) -> Result<Tracer<'_>> {
        Tracer::new(&self.scene, &[self.freq.si()], &self.options).context(&self.named[1])
    }

    /// Refuse a camera inside of a solid.
    ///
    /// # Errors
    /// The camera is inside of a solid.
    pub(in crate::cli) fn check(&self, camera: &Camera) -> Result<(), SceneError> {
        self.scene.check_camera_at(camera)
    }

    /// What a camera sees, in the real-time mode.
    ///
    /// # Errors
    /// A ray that leaves the tables.
    pub(in crate::cli) fn frame(&self, tracer: &Tracer<'_>, camera: &Camera) -> Result<Frame, SceneError> {
        tracer.frame(&View::of_camera(camera)?, &self.mesh)
    }

    /// What a camera sees, with every pixel traced.
    ///
    /// # Errors
    /// A ray that leaves the tables.
    pub(in crate::cli) fn picture(&self, tracer: &Tracer<'_>, camera: &Camera, band: &SpectralWindow) -> Result<Picture, SceneError> {
        tracer.picture(&View::of_camera(camera)?, band, None)
    }

    /// Numbers of the surfaces that a camera sees, from 1, and their names. 0 is the sky. // [m, l]
    ///
    /// # Errors
    /// A ray that leaves the tables.
    pub(in crate::cli) fn surfaces(
        &self,
        tracer: &Tracer<'_>,
        camera: &Camera,
        band: &SpectralWindow,
    ) -> Result<(Array2<u32>, Vec<String>), SceneError> {
        let picture = self.picture(tracer, camera, band)?;
        Ok((picture.material, picture.material_names))
    }

    /// The name of the scene.
    pub(in crate::cli) fn name(&self) -> &str {
        self.scene.name()
    }
}

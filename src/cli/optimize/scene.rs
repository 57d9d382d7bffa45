//! The scene whose image the objective `scene` judges.

use crate::cli::context::Context;
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::options::SceneArgs;
use crate::design::{DesignOptions, LayoutFigure, SceneChain, SceneTestOptions};
use crate::simulate::SceneOptions;
use cittert_arrays::quantity::Frequency;
use cittert_arrays::{PhaseCenter, Sensitivity, SpectralWindow};
use clap::Args;
use std::path::PathBuf;

/// The scene and its test.
#[derive(Debug, Args)]
pub struct SceneTestArgs {
    /// Scene that the objective scene images: FITS image, grey-scale PNG or scene description (TOML).
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    how: SceneOptions,
    #[command(flatten)]
    test: SceneTestOptions,
}

impl SceneTestArgs {
    /// The file that is read.
    pub(super) fn file(&self) -> Option<PathBuf> {
        self.scene.clone()
    }

    /// Diameter in m and sensitivity of new elements, where they are given.
    pub(super) fn of_new(&self) -> (Option<f64>, Option<Sensitivity>) {
        (self.test.diameter.map(|d| d.si()), self.test.tsys.map(|t| Sensitivity::TsysK(t.si())))
    }

    /// All that the error depends on.
    pub(super) fn fingerprint(&self) -> Result<String> {
        let content = self.scene.as_ref().map(|p| std::fs::metadata(p).map(|m| (m.len(), m.modified().ok())).ok());
        Ok(format!(" {:?} {content:?} {} {}", self.scene, serde_json::to_string(&self.how)?, serde_json::to_string(&self.test)?))
    }

    /// The error of the image as a function of the layout; `None` where no objective needs it.
    pub(super) fn error(&self, design: &DesignOptions, aperture_m: f64, context: &Context) -> Result<Option<LayoutFigure>> {
        let wanted = design.objective.0.iter().any(|(name, _)| name == "scene");
        ensure!(
            wanted || self.scene.is_none(),
            Failure::usage("--scene is given, but scene is none of the objectives: add it to --objective")
        );
        if !wanted {
            return Ok(None);
        }
        let (Some(scene), Some(freq)) = (&self.scene, design.freq) else {
            return Err(Failure::usage("the objective scene needs --scene and --freq"));
        };
        // Without a bandwidth the channel is narrow, so that nothing smears.
        let width = design.bandwidth.unwrap_or(Frequency(1e-3 * freq.si()));
        let spectrum = SpectralWindow::band(freq.si(), width.si(), design.channels)?;
        let args = SceneArgs { scene: scene.clone(), how: self.how.clone() };
        let loaded = args.load(&PhaseCenter::unprojected("boresight"), &spectrum, context)?;
        let chain = SceneChain::new(loaded.sky, spectrum, self.test.clone(), aperture_m).map_err(Failure::call)?;
        Ok(Some(chain.error()))
    }
}

//! `scene render`: render a scene into a FITS image in K.

use super::image::{RenderArgs, frequency, outcome};
use super::solids;
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::options::{SceneArgs, read_scene_and_pictures};
use crate::simulate::SceneOptions;
use cittert_arrays::{PhaseCenter, SpectralWindow};
use cittert_phenomenology::Scene;
use std::path::PathBuf;

/// Render a scene description, or read a picture, into a FITS image in K.
///
/// # Errors
/// A scene that is wrong, or an error of the file system.
pub(super) fn run(args: &RenderArgs, context: &Context) -> Result<Outcome> {
    let model_error = args.model_error_files();
    let maps = args.maps().into_iter().chain(args.drawings()).flatten().chain(&args.error_map).chain(model_error.iter().flatten());
    let outputs: Vec<&PathBuf> = [&args.out.output].into_iter().chain(maps).collect();
    args.out.claim(&outputs, [&args.scene])?;
    let center = center(args)?;
    let described = args.scene.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let (scene, pictures) = if described { read_scene_and_pictures(&args.scene).map(|(s, p)| (Some(s), p))? } else { (None, Vec::new()) };
    args.out.claim(&outputs, &pictures)?;
    let freq = frequency(args.freq, scene.as_ref().and_then(Scene::freq_hz), context);
    let spectrum = SpectralWindow::band(freq.si(), args.bandwidth.si(), args.channels).context("--freq, --bandwidth and --channels")?;
    if let Some(Scene::Solids(scene)) = scene {
        return solids::run(args, *scene, (&center, &spectrum), context);
    }
    check_plain(args)?;
    let loaded = scene_args(args).load(&center, &spectrum, context)?;
    let Some(mut image) = loaded.sky.images.into_iter().next() else {
        return Err(Failure::message(format!("{}: a source list has no pixels to render", args.scene.display())));
    };
    args.out.image(&args.out.output, &mut image, context)?;
    Ok(outcome(&image, &loaded.name, args))
}

/// The centre of the image.
///
/// # Errors
/// A text that is no direction.
pub(super) fn center(args: &RenderArgs) -> Result<PhaseCenter> {
    Ok(match &args.phase_center {
        Some(text) => PhaseCenter::parse(text)?,
        None => PhaseCenter::unprojected("boresight"),
    })
}

/// Refuse what only the tracer makes, for a scene without solids.
///
/// # Errors
/// An option of the tracer.
pub(super) fn check_plain(args: &RenderArgs) -> Result<()> {
    let only = "only a scene of solids has maps, drawings, rendered channels and a real-time mode";
    ensure!(!args.asks_tracer(), Failure::usage(format!("{}: {only}", args.scene.display())));
    Ok(())
}

/// A scene without solids, as the options of other commands.
pub(super) fn scene_args(args: &RenderArgs) -> SceneArgs {
    SceneArgs {
        scene: args.scene.clone(),
        how: SceneOptions {
            scene_cell: args.scene_cell,
            scene_size: args.scene_size,
            scene_channels: false,
            scene_min: args.scene_min,
            scene_max: args.scene_max,
        },
    }
}

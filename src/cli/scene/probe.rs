//! `scene probe`: the surfaces that rays hit and the regions in which points lie.

use super::table::csv_text;
use crate::cli::context::Outcome;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::cli::options::{pictures_beside, scene_text};
use cittert_phenomenology::geometry::probe::{PointRow, RayRow, read_rows};
use cittert_phenomenology::solids::read_probe_with;
use clap::Args;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Options of `scene probe`.
#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("what").required(true).args(["rays", "points"])))]
pub(crate) struct ProbeArgs {
    /// Scene of solids (TOML), or a bare text of bodies and regions.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Probe this region alone.
    #[arg(long, value_name = "ID")]
    region: Option<String>,
    /// CSV file with the columns ox,oy,oz,dx,dy,dz in m.
    #[arg(long, value_name = "CSV")]
    rays: Option<PathBuf>,
    /// CSV file with the columns x,y,z in m.
    #[arg(long, value_name = "CSV")]
    points: Option<PathBuf>,
}

/// Print one row for each ray (hit, t, nx, ny, nz, region, body, face) or point (inside, region).
///
/// # Errors
/// A scene or a CSV file that cannot be read, an unknown region.
pub(super) fn run(args: &ProbeArgs) -> Result<Outcome> {
    let named = args.scene.display();
    let scene = read_probe_with(&scene_text(&args.scene)?, &pictures_beside(&args.scene)).context(&named)?;
    let region = args.region.as_deref();
    match (&args.rays, &args.points) {
        (Some(path), _) => table(&scene.rays(region, &rows::<RayRow>(path)?).context(path.display())?),
        (None, Some(path)) => table(&scene.points(region, &rows::<PointRow>(path)?).context(path.display())?),
        (None, None) => Err(Failure::usage("give --rays or --points")),
    }
}

fn rows<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>> {
    cittert_formats::refuse_special(path)?;
    let file = File::open(path).map_err(|e| Failure::message(format!("{}: cannot open: {e}", path.display())))?;
    read_rows(file).context(path.display())
}

fn table(rows: &[impl Serialize]) -> Result<Outcome> {
    Ok(Outcome::new(serde_json::json!({ "rows": rows }), csv_text(rows)?))
}

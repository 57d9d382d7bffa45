//! `scene probe`: what rays hit and where points lie.

use crate::cli::context::Outcome;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::cli::options::{pictures_beside, scene_text};
use cittert_phenomenology::geometry::probe::{PointRow, RayRow, read_rows};
use cittert_phenomenology::solids::read_probe_with;
use clap::Args;
use serde::Serialize;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Options of `scene probe`.
#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("what").required(true).args(["rays", "points"])))]
pub(crate) struct ProbeArgs {
    /// Scene of solids (TOML), or a bare text of bodies and regions.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Only this region.
    #[arg(long, value_name = "ID")]
    region: Option<String>,
    /// CSV with the columns ox,oy,oz,dx,dy,dz in m.
    #[arg(long, value_name = "CSV")]
    rays: Option<PathBuf>,
    /// CSV with the columns x,y,z in m.
    #[arg(long, value_name = "CSV")]
    points: Option<PathBuf>,
}

/// Print one row for each ray (hit, t, nx, ny, nz, region, body, face) or point (inside, region).
///
/// # Errors
/// A scene or a CSV that cannot be read, an unknown region.
pub(super) fn run(args: &ProbeArgs) -> Result<Outcome> {
    let named = |path: &Path| format!("{}", path.display());
    let scene = read_probe_with(&scene_text(&args.scene)?, &pictures_beside(&args.scene)).context(named(&args.scene))?;
    let region = args.region.as_deref();
    let open = |path: &Path| File::open(path).map_err(|e| Failure::message(format!("{}: cannot open: {e}", path.display())));
    if let Some(path) = &args.rays {
        let rays: Vec<RayRow> = read_rows(open(path)?).context(named(path))?;
        return table(&scene.rays(region, &rays).context(named(&args.scene))?);
    }
    let Some(path) = &args.points else { return Err(Failure::usage("give --rays or --points")) };
    let points: Vec<PointRow> = read_rows(open(path)?).context(named(path))?;
    table(&scene.points(region, &points).context(named(&args.scene))?)
}

fn table(rows: &[impl Serialize]) -> Result<Outcome> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let failed = |e: &dyn std::fmt::Display| Failure::message(format!("the table cannot be written: {e}"));
    for row in rows {
        writer.serialize(row).map_err(|e| failed(&e))?;
    }
    let bytes = writer.into_inner().map_err(|e| failed(&e))?;
    let text = String::from_utf8(bytes).map_err(|e| failed(&e))?;
    Ok(Outcome::new(serde_json::json!({ "rows": rows }), text))
}

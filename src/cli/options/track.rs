//! Where and when the array looks.

use crate::cli::failure::{Context as _, Failure, Result};
use cittert_arrays::astrometry::parse_utc;
use cittert_arrays::quantity::{Angle, Duration};
use cittert_arrays::{ArrayLayout, BuiltinLayout, CoveragePlan, LayoutFrame, PhaseCenter, Site, Track};
use clap::Args;
use std::path::Path;

/// A track over the sky, or one look along the boresight.
#[derive(Debug, Clone, Args)]
pub struct TrackArgs {
    /// Phase centre, such as 19h59m28s,+40d44m02s or 299.87deg,40.73deg (a boresight layout needs none).
    #[arg(long, value_name = "RA,DEC", allow_hyphen_values = true)]
    pub phase_center: Option<String>,
    /// Start of the observation, ISO UTC (with --hour-angle: the date near which to observe).
    #[arg(long, value_name = "UTC")]
    pub start: Option<String>,
    /// Length of the observation [default: one integration].
    #[arg(long, value_name = "TIME", conflicts_with = "hour_angle")]
    pub duration: Option<Duration>,
    /// Hour angles of start and end, such as -2h,2h.
    #[arg(long, value_name = "FROM,TO", allow_hyphen_values = true)]
    pub hour_angle: Option<String>,
    /// Length of one integration.
    #[arg(long, value_name = "TIME", default_value = "10s")]
    pub integration: Duration,
    /// Antennas that see the phase centre below this elevation take no part.
    #[arg(long, value_name = "ANGLE")]
    pub elevation_limit: Option<Angle>,
}

/// Date of a boresight look for which none is given: any will do, it only fills the time column.
const ANY_DATE: &str = "2025-06-01T00:00:00";

impl TrackArgs {
    /// Phase centre and rows.
    ///
    /// # Errors
    /// A layout on the Earth without phase centre or start, a text that cannot be read, a source that never rises.
    pub fn plan(&self, layout: &ArrayLayout) -> Result<(PhaseCenter, CoveragePlan)> {
        let integration_s = self.integration.si();
        let site = match (layout.frame, &self.phase_center) {
            (LayoutFrame::EastNorthUp(site), Some(_)) => site,
            (LayoutFrame::Boresight, Some(_)) => {
                return Err(Failure::usage(format!(
                    "--phase-center: layout {:?} looks along its boresight and has no place on the Earth; leave the option out",
                    layout.name
                )));
            }
            (LayoutFrame::EastNorthUp(_), None) => {
                return Err(Failure::usage(format!(
                    "layout {:?} stands on the Earth: give --phase-center (such as 19h59m28s,+40d44m02s) and --start or --hour-angle",
                    layout.name
                )));
            }
            (LayoutFrame::Boresight, None) => return self.boresight(layout, integration_s),
        };
        let center = PhaseCenter::parse(self.phase_center.as_deref().unwrap_or_default()).context("--phase-center")?;
        let track = self.track(&center, &site, integration_s)?;
        Ok((center.clone(), CoveragePlan::track(layout, &center, &track)?))
    }

    fn boresight(&self, layout: &ArrayLayout, integration_s: f64) -> Result<(PhaseCenter, CoveragePlan)> {
        if self.hour_angle.is_some() || self.elevation_limit.is_some() {
            return Err(Failure::usage(format!(
                "--hour-angle and --elevation-limit need a place on the Earth; layout {:?} looks along its boresight",
                layout.name
            )));
        }
        let start = parse_utc(self.start.as_deref().unwrap_or(ANY_DATE)).context("--start")?;
        let center = PhaseCenter::unprojected("boresight");
        let track = Track::new(start, self.duration.map_or(integration_s, |d| d.si()), integration_s);
        Ok((center.clone(), CoveragePlan::track(layout, &center, &track)?))
    }

    fn track(&self, center: &PhaseCenter, site: &Site, integration_s: f64) -> Result<Track> {
        let start = self.start.as_deref().map(|t| parse_utc(t).context("--start")).transpose()?;
        let mut track = match (&self.hour_angle, start) {
            (Some(text), start) => {
                let near = match start {
                    Some(jd) => jd,
                    None => parse_utc(ANY_DATE)?,
                };
                Track::hour_angles(center, site, near, hour_angles(text)?, integration_s)?
            }
            (None, Some(start)) => Track::new(start, self.duration.map_or(integration_s, |d| d.si()), integration_s),
            (None, None) => return Err(Failure::usage("a track needs --start (such as 2025-06-01T01:30:00) or --hour-angle (such as -2h,2h)")),
        };
        track.elevation_limit_rad = self.elevation_limit.map(|a| a.si());
        Ok(track)
    }
}

/// `-2h,2h` in rad.
fn hour_angles(text: &str) -> Result<[f64; 2]> {
    let part = |t: &str| t.parse::<Duration>().map(|d| d.si() / 43_200.0 * std::f64::consts::PI);
    let Some((from, to)) = text.split_once(',') else {
        return Err(Failure::usage(format!("--hour-angle is {text:?}, expected two times such as -2h,2h")));
    };
    match (part(from), part(to)) {
        (Ok(from), Ok(to)) => Ok([from, to]),
        (Err(e), _) | (_, Err(e)) => Err(Failure::usage(format!("--hour-angle: {e}"))),
    }
}

/// A built-in layout by name, or a layout file.
///
/// # Errors
/// Neither a name nor a file, or a file that is no layout.
pub fn load_layout(name: &str) -> Result<ArrayLayout> {
    let path = Path::new(name);
    if BuiltinLayout::find(name).is_none() && path.exists() {
        return Ok(cittert_formats::layouts::read_layout(path, None)?);
    }
    ArrayLayout::builtin(name).context(format!("{name:?} is neither a layout file nor a built-in layout"))
}

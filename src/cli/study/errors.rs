//! The errors of a study from their sections.

use crate::cli::failure::{Context as _, Failure, Result};
use crate::corrupt::{
    AmplitudeError, BandpassError, BaselineOffset, DelayError, Dropout, Error, PhaseError, PositionError, ThermalNoise, Troposphere,
    Variation, WrongFlags,
};
use cittert_arrays::Sensitivity;
use cittert_arrays::quantity::{Angle, Duration, FluxDensity, Frequency, Length, Temperature};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InTime<T> {
    rms: T,
    varies: Option<String>,
    time: Option<Duration>,
}

impl<T> InTime<T> {
    fn variation(&self) -> Result<Variation> {
        let time_s = || self.time.map(|t| t.si()).ok_or_else(|| Failure::message("needs a time, such as time = \"60s\""));
        Ok(match self.varies.as_deref() {
            None | Some("constant") => Variation::Constant,
            Some("integration") => Variation::Integration,
            Some("interval") => Variation::Interval { length_s: time_s()? },
            Some("walk") => Variation::RandomWalk { time_s: time_s()? },
            Some("jumps") => Variation::Jumps { mean_s: time_s()? },
            Some("coherent") => Variation::Coherent { time_s: time_s()? },
            Some(other) => {
                let all = "constant, integration, interval, walk, jumps or coherent";
                return Err(Failure::message(format!("varies is {other:?}, expected {all}")));
            }
        })
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Screen {
    rms: Angle,
    baseline: Option<Length>,
    /// m/s.
    wind_m_s: Option<f64>,
    wind_to: Option<Angle>,
    height: Option<Length>,
    outer_scale: Option<Length>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Bandpass {
    ripple: f64,
    period: Frequency,
    mismatch: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Rms<T> {
    rms: T,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Silence {
    fraction: f64,
    time: Duration,
    #[serde(default)]
    noticed: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Noise {
    sefd: Option<FluxDensity>,
    tsys: Option<Temperature>,
    diameter: Option<Length>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Flags {
    #[serde(default)]
    good_flagged: f64,
    #[serde(default)]
    bad_unflagged: f64,
}

/// All errors, in the order of their names; `text` is the file, for the lines of messages.
///
/// # Errors
/// An unknown kind, an unknown or missing key, a number without its unit, a parameter outside its range.
pub(super) fn errors(sections: &BTreeMap<String, toml::Table>, text: &str) -> Result<Vec<Error>> {
    let place =
        |name: &str| match text.lines().position(|l| l.trim().strip_prefix("[errors.").is_some_and(|l| l.trim_end() == format!("{name}]")))
        {
            Some(line) => format!("errors.{name} (line {})", line + 1),
            None => format!("errors.{name}"),
        };
    sections
        .iter()
        .map(|(name, section)| {
            let mut section = section.clone();
            let kind = match section.remove("kind") {
                Some(toml::Value::String(kind)) => kind,
                Some(other) => return Err(Failure::message(format!("errors.{name}: kind is {other}, expected a name"))),
                None => name.clone(),
            };
            let error = one(&kind, section).context(place(name))?;
            error.model().check().context(place(name))?;
            Ok(error)
        })
        .collect()
}

fn read<T: DeserializeOwned>(section: toml::Table) -> Result<T> {
    Ok(toml::Value::Table(section).try_into()?)
}

fn one(kind: &str, section: toml::Table) -> Result<Error> {
    Ok(match kind {
        "phase" => {
            let s: InTime<Angle> = read(section)?;
            Error::Phase(PhaseError { rms_rad: s.rms.si(), variation: s.variation()? })
        }
        "amplitude" => {
            let s: InTime<f64> = read(section)?;
            Error::Amplitude(AmplitudeError { rms: s.rms, variation: s.variation()? })
        }
        "delay" => {
            let s: InTime<Duration> = read(section)?;
            Error::Delay(DelayError { rms_s: s.rms.si(), variation: s.variation()? })
        }
        "position" => Error::Position(PositionError { rms_m: Some(read::<Rms<Length>>(section)?.rms.si()) }),
        "troposphere" => {
            let (s, d) = (read::<Screen>(section)?, Troposphere::default());
            Error::Troposphere(Troposphere {
                rms_rad: s.rms.si(),
                baseline_m: s.baseline.map_or(d.baseline_m, |x| x.si()),
                wind_m_s: s.wind_m_s.unwrap_or(d.wind_m_s),
                wind_to_rad: s.wind_to.map_or(d.wind_to_rad, |x| x.si()),
                height_m: s.height.map_or(d.height_m, |x| x.si()),
                outer_scale_m: s.outer_scale.map_or(d.outer_scale_m, |x| x.si()),
            })
        }
        "bandpass" => {
            let s: Bandpass = read(section)?;
            Error::Bandpass(BandpassError { ripple: s.ripple, period_hz: s.period.si(), mismatch: s.mismatch })
        }
        "baseline" => Error::Baseline(BaselineOffset { rms: read::<Rms<FluxDensity>>(section)?.rms.si() }),
        "dropout" => {
            let s: Silence = read(section)?;
            Error::Dropout(Dropout { fraction: s.fraction, mean_s: s.time.si(), noticed: s.noticed })
        }
        "noise" => {
            let s: Noise = read(section)?;
            let sensitivity = match (s.sefd, s.tsys) {
                (Some(_), Some(_)) => return Err(Failure::message("give sefd or tsys, not both")),
                (Some(v), None) => Some(Sensitivity::SefdJy(v.si())),
                (None, t) => t.map(|t| Sensitivity::TsysK(t.si())),
            };
            Error::Noise(ThermalNoise { sensitivity, diameter_m: s.diameter.map(|d| d.si()), data_have_noise: false })
        }
        "flags" => {
            let s: Flags = read(section)?;
            Error::Flags(WrongFlags { good_flagged: s.good_flagged, bad_unflagged: s.bad_unflagged })
        }
        other => {
            let all = Error::TABLE.map(|t| t.0).join(", ");
            return Err(Failure::message(format!("{other:?} is no kind of error, expected one of {all} (as the name, or as kind)")));
        }
    })
}

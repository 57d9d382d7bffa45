//! Errors to inject.

use crate::cli::failure::{Failure, Result};
use crate::corrupt::{
    AmplitudeError, BandpassError, BaselineOffset, DelayError, Dropout, Error, PhaseError, PositionError, ThermalNoise, Troposphere,
    Variation, WrongFlags,
};
use cittert_arrays::quantity::{Angle, Duration, FluxDensity, Frequency, Length, Temperature};
use cittert_arrays::{Sensitivity, VisUnit};
use clap::Args;

/// One option or more for each kind of error.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Errors")]
pub struct ErrorArgs {
    /// Rms of the antenna phases.
    #[arg(long, value_name = "ANGLE")]
    phase_rms: Option<Angle>,
    /// Rms of ln |gain|.
    #[arg(long, value_name = "X")]
    amp_rms: Option<f64>,
    /// Rms of the antenna delays, such as 1ns.
    #[arg(long, value_name = "TIME")]
    delay_rms: Option<Duration>,
    /// How phases, amplitudes and delays change: constant, integration, interval:TIME, walk:TIME, jumps:TIME or coherent:TIME.
    #[arg(long, value_name = "KIND[:TIME]", default_value = "constant")]
    variation: String,
    /// The same for phases alone.
    #[arg(long, value_name = "KIND[:TIME]")]
    phase_variation: Option<String>,
    /// The same for amplitudes alone.
    #[arg(long, value_name = "KIND[:TIME]")]
    amp_variation: Option<String>,
    /// The same for delays alone.
    #[arg(long, value_name = "KIND[:TIME]")]
    delay_variation: Option<String>,
    /// Different errors for the two feeds of an antenna.
    #[arg(long)]
    pub per_feed: bool,
    /// Rms of each coordinate of the antennas' places, or layout for the uncertainties in the layout.
    #[arg(long, value_name = "LENGTH|layout")]
    position_rms: Option<String>,
    /// A turbulent atmosphere: rms phase between two antennas at --troposphere-baseline.
    #[arg(long, value_name = "ANGLE")]
    troposphere: Option<Angle>,
    /// Distance at which --troposphere holds.
    #[arg(long, value_name = "LENGTH", default_value = "1km")]
    troposphere_baseline: Length,
    /// Speed of the wind that carries the screen, such as 10m/s.
    #[arg(long, value_name = "SPEED", default_value = "10m/s", value_parser = speed)]
    wind: f64,
    /// Direction that the wind blows to, from north towards east.
    #[arg(long, value_name = "ANGLE", default_value = "45deg", allow_hyphen_values = true)]
    wind_to: Angle,
    /// Height of the screen.
    #[arg(long, value_name = "LENGTH", default_value = "1km")]
    screen_height: Length,
    /// Outer scale of the turbulence.
    #[arg(long, value_name = "LENGTH", default_value = "10km")]
    outer_scale: Length,
    /// Size of the standing wave over the band, 0 to below 1.
    #[arg(long, value_name = "X")]
    bandpass_ripple: Option<f64>,
    /// Period of the standing wave.
    #[arg(long, value_name = "FREQ", default_value = "100MHz")]
    bandpass_period: Frequency,
    /// Rms of the mismatch of each channel.
    #[arg(long, value_name = "X")]
    bandpass_mismatch: Option<f64>,
    /// Rms of a constant added to each baseline, such as 10mJy (or 1e-6Ksr for a set in K sr).
    #[arg(long, value_name = "FLUX")]
    baseline_offset: Option<String>,
    /// Part of the time that an antenna is silent, 0 to below 1.
    #[arg(long, value_name = "X")]
    dropout: Option<f64>,
    /// Mean length of a silence.
    #[arg(long, value_name = "TIME", default_value = "60s")]
    dropout_length: Duration,
    /// The array notices silences and flags the data.
    #[arg(long)]
    dropout_noticed: bool,
    /// Part of the good data that is flagged.
    #[arg(long, value_name = "X")]
    flag_good: Option<f64>,
    /// Part of the flagged data that loses its flag.
    #[arg(long, value_name = "X")]
    unflag_bad: Option<f64>,
    /// Add thermal noise by the layout's SEFD or Tsys.
    #[arg(long)]
    noise: bool,
    /// SEFD of every antenna (implies --noise).
    #[arg(long, value_name = "FLUX", conflicts_with = "tsys")]
    sefd: Option<FluxDensity>,
    /// System temperature of every antenna (implies --noise).
    #[arg(long, value_name = "TEMP")]
    tsys: Option<Temperature>,
    /// Diameter of every antenna, for noise from Tsys.
    #[arg(long, value_name = "LENGTH")]
    diameter: Option<Length>,
    /// The data have noise already: its variance is added to that of the new noise in the weights.
    #[arg(long)]
    data_have_noise: bool,
}

/// `10m/s` in m/s.
fn speed(text: &str) -> std::result::Result<f64, String> {
    let expected = || format!("{text:?} is no speed, expected one such as 10m/s or 36km/h");
    let (length, time) = text.split_once('/').ok_or_else(expected)?;
    let time = format!("1{time}").parse::<Duration>().map_err(|_| expected())?;
    Ok(length.parse::<Length>().map_err(|_| expected())?.si() / time.si())
}

/// `coherent:5min` and its like.
fn variation(option: &str, text: &str) -> Result<Variation> {
    let (kind, time) = text.split_once(':').map_or((text, None), |(k, t)| (k, Some(t)));
    let expected =
        "constant, integration, interval:TIME, walk:TIME (the rms is reached after TIME), jumps:TIME (mean distance) or coherent:TIME";
    let wrong = || Failure::usage(format!("--{option} is {text:?}, expected {expected}"));
    let seconds = || -> Result<f64> {
        let time = time.ok_or_else(|| Failure::usage(format!("--{option} {kind} needs a time, such as {kind}:60s")))?;
        Ok(time.parse::<Duration>().map_err(|e| Failure::usage(format!("--{option}: {e}")))?.si())
    };
    Ok(match (kind, time) {
        ("constant", None) => Variation::Constant,
        ("integration", None) => Variation::Integration,
        ("interval", _) => Variation::Interval { length_s: seconds()? },
        ("walk" | "random-walk", _) => Variation::RandomWalk { time_s: seconds()? },
        ("jumps", _) => Variation::Jumps { mean_s: seconds()? },
        ("coherent", _) => Variation::Coherent { time_s: seconds()? },
        _ => return Err(wrong()),
    })
}

/// An offset in the unit of the set.
fn offset(text: &str, unit: VisUnit) -> Result<f64> {
    let wrong = |e: String| Failure::usage(format!("--baseline-offset: {e}"));
    if unit != VisUnit::KelvinSr {
        return Ok(text.parse::<FluxDensity>().map_err(|e| wrong(e.to_string()))?.si());
    }
    let number = text.strip_suffix("Ksr").and_then(|t| t.trim().parse::<f64>().ok());
    number.ok_or_else(|| wrong(format!("the set is in K sr, {text:?} is not; expected a number such as 1e-6Ksr")))
}

impl ErrorArgs {
    /// The errors that are asked for, for a set in `unit`.
    ///
    /// # Errors
    /// A text that cannot be read.
    pub fn list(&self, unit: VisUnit) -> Result<Vec<Error>> {
        let varied = |option: &str, own: &Option<String>| match own {
            Some(text) => variation(option, text),
            None => variation("variation", &self.variation),
        };
        let mut out = Vec::new();
        if let Some(a) = self.phase_rms {
            out.push(Error::Phase(PhaseError { rms_rad: a.si(), variation: varied("phase-variation", &self.phase_variation)? }));
        }
        if let Some(rms) = self.amp_rms {
            out.push(Error::Amplitude(AmplitudeError { rms, variation: varied("amp-variation", &self.amp_variation)? }));
        }
        if let Some(t) = self.delay_rms {
            out.push(Error::Delay(DelayError { rms_s: t.si(), variation: varied("delay-variation", &self.delay_variation)? }));
        }
        match self.position_rms.as_deref() {
            None => {}
            Some("layout") => out.push(Error::Position(PositionError { rms_m: None })),
            Some(text) => {
                let rms = text.parse::<Length>().map_err(|e| Failure::usage(format!("--position-rms: {e}; or layout")))?;
                out.push(Error::Position(PositionError { rms_m: Some(rms.si()) }));
            }
        }
        if let Some(rms) = self.troposphere {
            out.push(Error::Troposphere(Troposphere {
                rms_rad: rms.si(),
                baseline_m: self.troposphere_baseline.si(),
                wind_m_s: self.wind,
                wind_to_rad: self.wind_to.si(),
                height_m: self.screen_height.si(),
                outer_scale_m: self.outer_scale.si(),
            }));
        }
        if self.bandpass_ripple.is_some() || self.bandpass_mismatch.is_some() {
            out.push(Error::Bandpass(BandpassError {
                ripple: self.bandpass_ripple.unwrap_or(0.0),
                period_hz: self.bandpass_period.si(),
                mismatch: self.bandpass_mismatch.unwrap_or(0.0),
            }));
        }
        if let Some(text) = &self.baseline_offset {
            out.push(Error::Baseline(BaselineOffset { rms: offset(text, unit)? }));
        }
        if let Some(fraction) = self.dropout {
            out.push(Error::Dropout(Dropout { fraction, mean_s: self.dropout_length.si(), noticed: self.dropout_noticed }));
        }
        let sensitivity = self.sefd.map(|s| Sensitivity::SefdJy(s.si())).or(self.tsys.map(|t| Sensitivity::TsysK(t.si())));
        if self.noise || sensitivity.is_some() {
            let diameter_m = self.diameter.map(|d| d.si());
            out.push(Error::Noise(ThermalNoise { sensitivity, diameter_m, data_have_noise: self.data_have_noise }));
        }
        if self.flag_good.is_some() || self.unflag_bad.is_some() {
            let (good_flagged, bad_unflagged) = (self.flag_good.unwrap_or(0.0), self.unflag_bad.unwrap_or(0.0));
            out.push(Error::Flags(WrongFlags { good_flagged, bad_unflagged }));
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variations_and_speeds_are_read() {
        assert_eq!(variation("v", "coherent:5min").unwrap(), Variation::Coherent { time_s: 300.0 });
        assert_eq!(variation("v", "integration").unwrap(), Variation::Integration);
        for bad in ["walk", "walk:5", "sometimes", "constant:5s"] {
            assert_eq!(variation("v", bad).unwrap_err().exit_code(), 2, "{bad}");
        }
        assert!((speed("36km/h").unwrap() - 10.0).abs() < 1e-12);
        assert!(speed("10").is_err() && speed("m/s").is_err());
    }

    #[test]
    fn offsets_have_the_unit_of_the_set() {
        assert!((offset("10mJy", VisUnit::Jy).unwrap() - 0.01).abs() < 1e-15);
        assert_eq!(offset("2e-6Ksr", VisUnit::KelvinSr).unwrap(), 2e-6);
        assert!(offset("10mJy", VisUnit::KelvinSr).is_err() && offset("3", VisUnit::Jy).is_err());
    }
}

//! Injects known errors into visibilities, so that the result of a calibration can be compared with the true gains.
//!
//! Errors of an antenna are gains in the convention V_corrupt = g1 conj(g2) V, and leakages between its feeds. Their product is returned as a
//! [`cittert_arrays::GainTable`]: the true gains. Other errors change only the data. Each kind of error has one file and one row in
//! this one, with the options that turn it on. The row makes the variant of [`Error`], its place in [`Error::TABLE`], and its part of [`ErrorOptions`], which are the options of
//! `corrupt` and of that section in the files of `run` and `study`. Each draw uses a random stream of its own, so an error does not change when another error is added.
//!
//! The order is fixed: what changes the view of the scene, gains, then offsets, then noise, then flags.

mod air;
mod amplitude;
mod atmosphere;
#[cfg(test)]
mod atmosphere_tests;
mod band;
mod bandpass;
mod baseline;
mod context;
mod corruption;
mod cross_phase;
mod delay;
mod dropout;
mod engine;
#[cfg(test)]
mod engine_tests;
#[cfg(test)]
mod feed_tests;
mod flags;
mod jitter;
mod leakage;
mod noise;
mod phase;
mod pointing;
mod position;
mod radiometer;
mod scene;
#[cfg(test)]
mod scene_tests;
mod screen;
mod shared;
mod troposphere;
mod variation;
mod width;

pub use air::{Air, AirModel, AirPaths, AirSource, ExcessPath};
pub use amplitude::AmplitudeError;
pub use atmosphere::{Atmosphere, AtmosphereOptions, Turbulence};
pub use band::{BandError, BandErrorOptions};
pub use bandpass::BandpassError;
pub use baseline::BaselineOffset;
pub use context::Context;
pub use corruption::Corruption;
pub use cross_phase::CrossPhase;
pub use delay::DelayError;
pub use dropout::Dropout;
pub use engine::{GainedSink, Truth, corrupt, corrupt_with, corrupted_header, true_gains, true_scene_errors};
pub use flags::WrongFlags;
pub use jitter::{JitterError, JitterOptions};
pub use leakage::LeakageError;
pub use noise::ThermalNoise;
pub use phase::PhaseError;
pub use pointing::{PointingError, PointingOptions};
pub use position::{PositionError, PositionRms};
pub use radiometer::Radiometer;
pub use scene::SceneErrors;
pub use screen::{Wind, WindOptions};
pub use troposphere::Troposphere;
pub use variation::Variation;
pub use width::{WidthError, WidthOptions};

use crate::{ChainError, Result, ensure};
use amplitude::AmplitudeOptions;
use bandpass::BandpassOptions;
use baseline::BaselineOptions;
use cittert_arrays::VisUnit;
use cross_phase::CrossPhaseOptions;
use delay::DelayOptions;
use dropout::DropoutOptions;
use flags::FlagOptions;
use leakage::LeakageOptions;
use noise::ThermalNoiseOptions;
use phase::PhaseOptions;
use position::PositionOptions;
use serde::{Deserialize, Serialize};
use shared::Shared;
use troposphere::TroposphereOptions;

fn without_effect(kind: &str, by: &str) -> ChainError {
    ChainError::Incompatible(format!(
        "an option of the error {kind} is given, but {by} is not, which turns this error on: give it too, or leave the option out"
    ))
}

macro_rules! kinds {
    ($($(#[doc = $doc:literal])* $field:ident: $variant:ident($model:ty, $options:ty) = $name:literal by $by:literal;)*) => {
        /// One error to inject.
        #[derive(Debug, Clone, PartialEq, Serialize)]
        #[serde(tag = "kind", rename_all = "kebab-case")]
        pub enum Error {
            $($(#[doc = $doc])* $variant($model),)*
        }

        impl Error {
            /// Every kind with its name and one line of help, in the order in which they act.
            pub const TABLE: &[(&str, &str)] = &[$(($name, concat!($($doc),*)),)*];

            /// Name of the kind.
            #[must_use]
            pub fn name(&self) -> &'static str {
                match self { $(Self::$variant(_) => $name,)* }
            }

            /// The model of the error.
            #[must_use]
            pub fn model(&self) -> &dyn Corruption {
                match self { $(Self::$variant(e) => e,)* }
            }
        }

        /// Errors of antennas and data: options for each kind.
        #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
        #[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
        #[cfg_attr(feature = "cli", command(next_help_heading = "Errors"))]
        pub struct ErrorOptions {
            /// Seed of every random draw [default: that of the run, or 1].
            #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
            pub seed: Option<u64>,
            /// How phases, amplitudes and delays change in time: constant, integration, interval:TIME, walk:TIME, jumps:TIME or coherent:TIME.
            #[cfg_attr(feature = "cli", arg(long, value_name = "KIND[:TIME]", default_value_t = ErrorOptions::default().variation))]
            pub variation: Variation,
            /// Draw different errors for the two feeds of an antenna.
            #[cfg_attr(feature = "cli", arg(long))]
            pub per_feed: bool,
            $(
                /// Options of this kind.
                #[serde(flatten)]
                #[cfg_attr(feature = "cli", command(flatten))]
                pub $field: $options,
            )*
            /// The wind and the screen of turbulence.
            #[serde(flatten)]
            #[cfg_attr(feature = "cli", command(flatten))]
            pub wind: WindOptions,
        }

        impl ErrorOptions {
            /// The errors that the options select, for a set in `unit`. The air over the array is looked up in `airs`.
            ///
            /// # Errors
            /// A value outside its range or in another unit than the set, an option of an error that no option turns on, or an unknown atmosphere.
            pub fn errors(&self, unit: VisUnit, airs: &dyn AirSource) -> Result<Vec<Error>> {
                let mut all = Vec::new();
                let shared = Shared { variation: self.variation, unit, wind: &self.wind, airs };
                $(
                    let error = self.$field.error(&shared)?;
                    let idle = error.is_none() && self.$field != <$options>::default();
                    ensure!(!idle, without_effect($name, $by));
                    all.extend(error.map(Error::$variant));
                )*
                let calm = self.wind != WindOptions::default() && !all.iter().any(|e: &Error| e.model().blows());
                ensure!(!calm, without_effect("troposphere", "troposphere or turbulence"));
                all.iter().try_for_each(|e: &Error| e.model().check())?;
                Ok(all)
            }
        }
    };
}

kinds! {
    /// phases of the antennas: constant, per integration, walking, jumping or with a coherence time
    phase: Phase(PhaseError, PhaseOptions) = "phase" by "phase-rms";
    /// amplitudes of the antennas, with the same choices in time
    amplitude: Amplitude(AmplitudeError, AmplitudeOptions) = "amplitude" by "amp-rms";
    /// delays of the antennas: a phase slope over the channels
    delay: Delay(DelayError, DelayOptions) = "delay" by "delay-rms";
    /// antennas that do not stand where the layout says
    position: Position(PositionError, PositionOptions) = "position" by "position-rms";
    /// a Kolmogorov screen of water vapour carried over the array by the wind
    troposphere: Troposphere(Troposphere, TroposphereOptions) = "troposphere" by "troposphere";
    /// the air over the array: paths by height and elevation, turbulence of the water vapour, radiometers
    atmosphere: Atmosphere(Atmosphere, AtmosphereOptions) = "atmosphere" by "atmosphere";
    /// standing waves and mismatch of the receivers over the band
    bandpass: Bandpass(BandpassError, BandpassOptions) = "bandpass" by "bandpass-ripple or bandpass-mismatch";
    /// bands of the receivers with a shape, out of tune: fringe washing; needs the scene
    band: Band(BandError, BandErrorOptions) = "band" by "band-shape, band-offset-rms or band-width-rms";
    /// samplers whose clocks tremble
    jitter: Jitter(JitterError, JitterOptions) = "jitter" by "jitter-rms";
    /// antennas that do not point to the phase centre; needs the scene
    pointing: Pointing(PointingError, PointingOptions) = "pointing" by "pointing-rms";
    /// patterns of antennas that are wider or narrower than the common one; needs the scene
    width: Width(WidthError, WidthOptions) = "width" by "width-rms";
    /// a phase between the two feeds, the same at all antennas
    cross_phase: CrossPhase(CrossPhase, CrossPhaseOptions) = "cross-phase" by "cross-phase";
    /// parts of the field of the other feed that each feed receives
    leakage: Leakage(LeakageError, LeakageOptions) = "leakage" by "leakage-rms";
    /// constants added to the visibilities of each baseline
    baseline: Baseline(BaselineOffset, BaselineOptions) = "baseline" by "baseline-offset";
    /// antennas that fall silent for a while
    dropout: Dropout(Dropout, DropoutOptions) = "dropout" by "dropout";
    /// thermal noise of the receivers, on top
    noise: Noise(ThermalNoise, ThermalNoiseOptions) = "noise" by "noise, sefd or tsys";
    /// flags on good data, and missing flags on bad data
    flags: Flags(WrongFlags, FlagOptions) = "flags" by "flag-good or unflag-bad";
}

/// Which errors to inject.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CorruptOptions {
    /// Seed of all random numbers.
    pub seed: u64,
    /// The errors. Several of one kind add up, each with random numbers of its own.
    pub errors: Vec<Error>,
    /// Draw different errors for the two feeds of an antenna. Otherwise both have the same.
    pub per_feed: bool,
}

//! The sections of injected errors and of self-calibration, and the steps that they stand for.

use super::config::{CleanSection, Config, Typed, words};
use super::steps::{DIR, Step, plot, relative, strings};
use cittert_arrays::quantity::{Angle, Duration, FluxDensity, Frequency, Length, Temperature};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Options of `corrupt`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct CorruptSection {
    /// Seed of the errors; that of the run if left out.
    pub seed: Option<u64>,
    /// Rms of the antenna phases.
    pub phase_rms: Option<Typed<Angle>>,
    /// Rms of ln |gain|.
    pub amp_rms: Option<f64>,
    /// Rms of the antenna delays.
    pub delay_rms: Option<Typed<Duration>>,
    /// How errors change: `constant`, `integration`, `interval:TIME`, `walk:TIME`, `jumps:TIME` or `coherent:TIME`.
    pub variation: Option<String>,
    /// The same for phases alone.
    pub phase_variation: Option<String>,
    /// The same for amplitudes alone.
    pub amp_variation: Option<String>,
    /// The same for delays alone.
    pub delay_variation: Option<String>,
    /// Different errors for the two feeds of an antenna.
    #[serde(default)]
    pub per_feed: bool,
    /// Rms of each coordinate of the antennas' places, or `layout`.
    pub position_rms: Option<String>,
    /// A turbulent atmosphere: rms phase between two antennas at `troposphere-baseline`.
    pub troposphere: Option<Typed<Angle>>,
    /// Distance at which `troposphere` holds.
    pub troposphere_baseline: Option<Typed<Length>>,
    /// Speed of the wind, such as `10m/s`.
    pub wind: Option<String>,
    /// Direction that the wind blows to, from north towards east.
    pub wind_to: Option<Typed<Angle>>,
    /// Height of the screen.
    pub screen_height: Option<Typed<Length>>,
    /// Outer scale of the turbulence.
    pub outer_scale: Option<Typed<Length>>,
    /// Size of the standing wave over the band.
    pub bandpass_ripple: Option<f64>,
    /// Period of the standing wave.
    pub bandpass_period: Option<Typed<Frequency>>,
    /// Rms of the mismatch of each channel.
    pub bandpass_mismatch: Option<f64>,
    /// Rms of a constant added to each baseline, such as `10mJy` or `1e-6Ksr`.
    pub baseline_offset: Option<String>,
    /// Part of the time that an antenna is silent.
    pub dropout: Option<f64>,
    /// Mean length of a silence.
    pub dropout_length: Option<Typed<Duration>>,
    /// The array notices silences and flags the data.
    #[serde(default)]
    pub dropout_noticed: bool,
    /// Part of the good data that is flagged.
    pub flag_good: Option<f64>,
    /// Part of the flagged data that loses its flag.
    pub unflag_bad: Option<f64>,
    /// Add thermal noise by the layout's SEFD or Tsys.
    #[serde(default)]
    pub noise: bool,
    /// SEFD of every antenna.
    pub sefd: Option<Typed<FluxDensity>>,
    /// System temperature of every antenna.
    pub tsys: Option<Typed<Temperature>>,
    /// Diameter of every antenna, for noise from Tsys.
    pub diameter: Option<Typed<Length>>,
    /// The data have noise already.
    #[serde(default)]
    pub data_have_noise: bool,
}

/// Options of `selfcal`. Those of its deconvolver that are left out are those of the first `[[clean]]` with the same algorithm.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SelfcalSection {
    /// `data` or `point`: what the first gains are solved against.
    pub start: Option<String>,
    /// A model to solve the first gains against, instead of `start`: FITS image or source list (relative to the configuration).
    pub model: Option<String>,
    /// Rounds at most.
    pub rounds: Option<usize>,
    /// Begin with solutions four and two times as long.
    #[serde(default)]
    pub shrink: bool,
    /// A round counts as better when the dynamic range grows by this part.
    pub improvement: Option<f64>,
    /// Rounds that are not better after which a stage ends.
    pub patience: Option<usize>,
    /// `phase`, `amp-phase` or `delay`.
    pub mode: Option<String>,
    /// A time, `int` or `inf`.
    pub solint: Option<String>,
    /// Reference antennas by name, separated by commas.
    pub refant: Option<String>,
    /// Gains with a lower signal to noise are flagged.
    pub minsnr: Option<f64>,
    /// Antennas with fewer baselines are flagged.
    pub min_baselines: Option<usize>,
    /// `band`, `window` or `each`.
    pub solve_channels: Option<String>,
    /// `per-feed` or `joined`.
    pub feeds: Option<String>,
    /// `none`, `student` or `huber`.
    pub outliers: Option<String>,
    /// `nearest` or `linear`.
    pub interp: Option<String>,
    /// Name in the table of deconvolvers; that of the first `[[clean]]` if left out.
    pub deconvolver: Option<String>,
    /// Loop gain.
    pub gain: Option<f64>,
    /// Largest number of components.
    pub niter: Option<usize>,
    /// Peak at which to stop.
    pub threshold: Option<String>,
    /// Stop at this multiple of the robust noise.
    pub nsigma: Option<f64>,
    /// Fraction of the peak removed between major cycles.
    pub mgain: Option<f64>,
    /// Depth of a minor cycle in units of the largest side lobe.
    pub cyclefactor: Option<f64>,
    /// Grow a mask around what exceeds this multiple of the noise.
    pub auto_mask: Option<f64>,
    /// Take positive components only.
    #[serde(default)]
    pub no_negative: bool,
    /// The prior of `mem`.
    pub prior: Option<String>,
}

const SECTION: &str = "Errors and self-calibration";

/// The image of the error-free data, the corrupted and the self-calibrated set and their images, and how far each is from the truth.
/// `image` are the words of every image, `clean` the deconvolution of the error-free data, `truth` the image of the scene.
pub(super) fn steps(config: &Config, folder: &Path, image: &[String], clean: &CleanSection, truth: Option<&str>) -> Vec<Step> {
    let mut all = Vec::new();
    let mut set = "vis.uvh5";
    // All three with the colours of the first.
    let picture = |name: &str, caption: &str| {
        let mut step = plot(SECTION, &format!("{name}-image.fits"), &format!("{name}-like.png"), &[], caption);
        step.words.extend([format!("--like={DIR}/clean-image.fits"), format!("--title={}", caption.trim_end_matches('.'))]);
        step
    };
    let compare = |name: &str, shift: bool| {
        let truth = truth?;
        let mut w = vec!["compare".to_owned(), format!("{DIR}/{name}-image.fits"), truth.to_owned(), "--convolve".into()];
        w.extend(shift.then(|| "--shift".to_owned()));
        Some(Step::new(SECTION, format!("compare {name}"), format!("compare.{name}"), w))
    };
    all.push(picture("clean", "Image of the data without errors."));
    if let Some(section) = &config.corrupt {
        let mut w = strings(&["corrupt", "{dir}/vis.uvh5", "-o", "{dir}/corrupted.uvh5", "--gains", "{dir}/truth.calh5"]);
        w.extend(words(section));
        w.extend(section.seed.is_none().then(|| format!("--seed={}", config.seed)));
        all.push(Step::new(SECTION, "corrupt", "corrupt", w));
        set = "corrupted.uvh5";
        let mut w = strings(&["clean", "{dir}/corrupted.uvh5", "--startmod=never"]);
        w.extend(image.iter().cloned().chain(words(clean)));
        w.extend(["-o".into(), format!("{DIR}/corrupted")]);
        all.push(Step::new(SECTION, "clean the corrupted data", "clean.corrupted", w));
        all.push(picture("corrupted", "Image of the corrupted data."));
        all.extend(compare("corrupted", false));
    }
    if let Some(section) = &config.selfcal {
        let mut w = vec!["selfcal".to_owned(), format!("{DIR}/{set}")];
        w.extend(image.iter().cloned().chain(deconvolver(section, &config.clean, clean)));
        w.extend(words(section).into_iter().map(|word| match word.strip_prefix("--model=") {
            Some(model) => format!("--model={}", relative(model, folder)),
            None => word,
        }));
        w.extend(["-o".into(), format!("{DIR}/selfcal")]);
        all.push(Step::new(SECTION, "self-calibrate", "selfcal", w));
        all.push(picture("selfcal", "Image after self-calibration."));
        all.extend(compare("selfcal", true));
        if config.corrupt.is_some() {
            // A model made of the data themselves leaves the place of the sky open, and with amplitudes its flux.
            let mut w = strings(&["compare", "{dir}/selfcal.calh5", "{dir}/truth.calh5"]);
            let free = section.model.is_none() && section.start.as_deref() != Some("point");
            w.extend(free.then(|| "--gradient".to_owned()));
            w.extend((section.mode.as_deref() == Some("amp-phase")).then(|| "--flux-scale".to_owned()));
            all.push(Step::new(SECTION, "compare gains", "compare.gains", w));
        }
        all.push(plot(SECTION, "selfcal.calh5", "selfcal-gains.png", &[], "Phases of the gains that self-calibration found."));
    }
    if config.corrupt.is_some() {
        all.push(plot(SECTION, "truth.calh5", "true-gains.png", &[], "Phases of the gains that were put in."));
    }
    all
}

/// Words of the deconvolution that the section leaves open: of the first `[[clean]]` of the same algorithm.
fn deconvolver(section: &SelfcalSection, all: &[CleanSection], first: &CleanSection) -> Vec<String> {
    let like = match &section.deconvolver {
        None => Some(first),
        Some(name) => all.iter().find(|c| &c.algorithm == name),
    };
    let own = words(section);
    let key = |w: &str| w.split('=').next().unwrap_or(w).to_owned();
    let taken = |w: &String| own.iter().any(|o| key(o) == key(w)) || (section.deconvolver.is_some() && key(w) == "--algorithm");
    like.map(words).unwrap_or_default().into_iter().filter(|w| !taken(w)).collect()
}

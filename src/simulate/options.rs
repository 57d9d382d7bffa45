//! Options of observations: band, track, method and noise. One type a group for the library, the command line and the files of `run` and
//! `study`.

use super::element::Element;
use super::polarized::FeedBasis;
use super::{ElementPattern, Method, NoiseOptions, Pedestal};
use crate::nearfield::RangeChoice;
use crate::values::{bad_value, by_text, need, word_or_quantity};
use crate::{ChainError, Result, ensure};
use cittert_arrays::astrometry::parse_utc;
use cittert_arrays::feeds::{Feeds, Mount};
use cittert_arrays::pattern::{Airy, CosPower, Gaussian};
use cittert_arrays::quantity::{Angle, Duration, FluxDensity, Frequency, Length, Temperature};
use cittert_arrays::{
    ArrayError, ArrayLayout, CoveragePlan, LayoutFrame, NearField, PhaseCenter, Polarization, Sensitivity, Site, SpectralWindow, Track,
    VisUnit, VisibilityHeader, XOrientation,
};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// The band of the receiver and its channels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct BandOptions {
    /// Centre of the band.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ"))]
    pub freq: Frequency,
    /// Full width of the band.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ"))]
    pub bandwidth: Frequency,
    /// Number of equal channels in the band.
    #[serde(default = "one_channel")]
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = one_channel()))]
    pub channels: usize,
}

fn one_channel() -> usize {
    1
}

impl BandOptions {
    /// The channels.
    ///
    /// # Errors
    /// Zero channels, a width that is not positive, a band that reaches below 0 Hz.
    pub fn spectrum(&self) -> Result<SpectralWindow> {
        Ok(SpectralWindow::band(self.freq.si(), self.bandwidth.si(), self.channels)?)
    }
}

/// Where and when the array observes: a track over the sky, or one look along the boresight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct TrackOptions {
    /// Phase centre, such as 19h59m28s,+40d44m02s or 299.87deg,40.73deg. A boresight layout has none.
    #[cfg_attr(feature = "cli", arg(long, value_name = "RA,DEC", allow_hyphen_values = true))]
    pub phase_center: Option<Direction>,
    /// Start of the observation, ISO UTC. With an hour angle: a date near the observation.
    #[cfg_attr(feature = "cli", arg(long, value_name = "UTC"))]
    pub start: Option<UtcTime>,
    /// Length of the observation [default: one integration].
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME", conflicts_with = "hour_angle"))]
    pub duration: Option<Duration>,
    /// Hour angles of the start and the end, such as -2h,2h.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FROM,TO", allow_hyphen_values = true))]
    pub hour_angle: Option<HourAngles>,
    /// Length of one integration.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME", default_value_t = TrackOptions::default().integration))]
    pub integration: Duration,
    /// Antennas that see the phase centre below this elevation take no part.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub elevation_limit: Option<Angle>,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self { phase_center: None, start: None, duration: None, hour_angle: None, integration: Duration(10.0), elevation_limit: None }
    }
}

/// Date of a boresight look without a start. It only fills the time column.
const ANY_DATE: &str = "2025-06-01T00:00:00";

/// A phase centre and the rows of coverage around it.
#[derive(Debug, Clone)]
pub struct PlannedTrack {
    /// The phase centre.
    pub center: PhaseCenter,
    /// The rows.
    pub plan: CoveragePlan,
}

impl TrackOptions {
    /// The phase centre and the rows.
    ///
    /// # Errors
    /// A layout on the Earth without a phase centre or a start, a boresight layout with options that need a place on the Earth, a source
    /// that never rises.
    pub fn plan(&self, layout: &ArrayLayout) -> Result<PlannedTrack> {
        let (center, track) = match (layout.frame, &self.phase_center) {
            (LayoutFrame::EastNorthUp(site), Some(center)) => (center.center.clone(), self.track(&center.center, &site)?),
            (LayoutFrame::EastNorthUp(_), None) => {
                let expected = "a direction such as 19h59m28s,+40d44m02s, with a start or an hour angle";
                return bad_value("phase-center", "missing", format!("{expected}: layout {:?} stands on the Earth", layout.name));
            }
            (LayoutFrame::Boresight, _) => {
                let given = [
                    ("phase-center", "no phase centre", self.phase_center.as_ref().map(ToString::to_string)),
                    ("hour-angle", "no hour angle", self.hour_angle.map(|a| a.to_string())),
                    ("elevation-limit", "no elevation limit", self.elevation_limit.map(|a| a.to_string())),
                ];
                for (field, why, value) in given {
                    let expected = format!(
                        "{why}: layout {:?} looks along its boresight. To put it on the Earth, give its file frame = \"enu\" and a [site]",
                        layout.name
                    );
                    need(field, value.as_deref().unwrap_or_default(), value.is_none(), expected)?;
                }
                let start = self.start.as_ref().map_or_else(|| parse_utc(ANY_DATE), |t| Ok(t.jd))?;
                (PhaseCenter::unprojected("boresight"), self.from(start))
            }
        };
        let plan = CoveragePlan::track(layout, &center, &track)?;
        Ok(PlannedTrack { center, plan })
    }

    fn from(&self, start_jd: f64) -> Track {
        Track::new(start_jd, self.duration.unwrap_or(self.integration).si(), self.integration.si())
    }

    fn track(&self, center: &PhaseCenter, site: &Site) -> Result<Track> {
        let mut track = match (&self.hour_angle, &self.start) {
            (Some(angles), start) => {
                let near = start.as_ref().map_or_else(|| parse_utc(ANY_DATE), |t| Ok(t.jd))?;
                Track::hour_angles(center, site, near, angles.rad(), self.integration.si())?
            }
            (None, Some(start)) => self.from(start.jd),
            (None, None) => {
                return bad_value("start", "missing", "a time such as 2025-06-01T01:30:00, or an hour angle such as -2h,2h");
            }
        };
        track.elevation_limit_rad = self.elevation_limit.map(|a| a.si());
        Ok(track)
    }
}

/// Pixels and temperatures of a scene whose file does not give them.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct SceneOptions {
    /// Size of a pixel of a PNG or a scene description.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub scene_cell: Option<Angle>,
    /// Number of pixels along each side of a scene description. Without a scene cell they cover the field of view of its camera.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub scene_size: Option<usize>,
    /// Compute the temperatures of a scene of solids for every channel instead of for the centre of the band.
    #[cfg_attr(feature = "cli", arg(long))]
    pub scene_channels: bool,
    /// Temperature of black in a PNG.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP"))]
    pub scene_min: Option<Temperature>,
    /// Temperature of white in a PNG.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP"))]
    pub scene_max: Option<Temperature>,
}

/// How a scene becomes visibilities, and their noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct SimulateOptions {
    /// Transform of images: degrid (to the accuracy of epsilon), dft (exact sum, slow) or mask (nearest cell of the FFT of the scene).
    #[cfg_attr(feature = "cli", arg(long, value_name = "METHOD", value_enum, hide_possible_values = true, default_value_t = SimulateOptions::default().method))]
    pub method: Method,
    /// Accuracy of degrid, relative to the total flux.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = SimulateOptions::default().epsilon))]
    pub epsilon: f64,
    /// Number of frequencies that are averaged in each channel. More than 1 gives bandwidth smearing.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = SimulateOptions::default().subchannels))]
    pub subchannels: usize,
    /// Power pattern of each element: layout (the one that the layout states, if any), none, airy (of the given diameter or that of the antennas),
    /// gaussian (of the given width) or cos^N.
    #[cfg_attr(feature = "cli", arg(long, value_name = "KIND", default_value_t = SimulateOptions::default().element))]
    pub element: Element,
    /// File with the power pattern of each element, in place of that of the layout: CSV, FITS table or beam file of pyuvdata.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FILE"))]
    pub element_file: Option<PathBuf>,
    /// Diameter of an airy element.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub element_diameter: Option<Length>,
    /// Full width at half maximum of a gaussian element.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub element_width: Option<Angle>,
    /// Constant that is subtracted from a scene in kelvin before the transform: auto (the mean of a warm scene, but nothing from elements with a
    /// pattern), none or a temperature.
    #[cfg_attr(feature = "cli", arg(long, value_name = "auto|none|TEMP", default_value_t = SimulateOptions::default().pedestal))]
    pub pedestal: Pedestal,
    /// Simulate the near field, a scene at this distance: a plane across the boresight (10m), a sphere around the array (sphere:10m), a FITS image of
    /// distances in m, or auto (the distances of a traced scene) [default: the far field].
    #[cfg_attr(feature = "cli", arg(long, value_name = "RANGE"))]
    pub range: Option<RangeChoice>,
    /// Measure total power: write the autocorrelation of each antenna, which is the zero spacing of the scene plus the power of the receiver. The set
    /// states what the receivers add.
    #[cfg_attr(feature = "cli", arg(long))]
    pub autos: bool,
    /// Leave out the antenna temperature that the set otherwise states: there is no calibrated radiometer beside the array.
    #[cfg_attr(feature = "cli", arg(long))]
    pub no_antenna_temperature: bool,
    /// Leave out the w term. Method mask never has it.
    #[cfg_attr(feature = "cli", arg(long))]
    pub no_w: bool,
    /// Unit of the visibilities: jy, or ksr for K sr [default: ksr for scenes in kelvin, else jy].
    #[cfg_attr(feature = "cli", arg(long, value_name = "jy|ksr", value_enum, hide_possible_values = true))]
    pub unit: Option<DataUnit>,
    /// Polarisation products of the set, such as RR,LL or XX,YY or I.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = SimulateOptions::default().pols))]
    pub pols: Vec<Polarization>,
    /// Mount of the antennas, with which their feeds turn on the sky: alt-az, alt-az+nasmyth-r, alt-az+nasmyth-l, equatorial or fixed [default: that
    /// of the layout, or feeds that do not turn].
    #[cfg_attr(feature = "cli", arg(long, value_name = "MOUNT"))]
    pub mount: Option<Mount>,
    /// Direction of the X feeds: north or east. At antennas that turn, north is the direction to the zenith [default: north].
    #[cfg_attr(feature = "cli", arg(long, value_name = "DIRECTION"))]
    pub x_feeds: Option<XOrientation>,
    /// Field that a feed receives beside the phase centre: great-circle (that at the phase centre, carried along the great circle) or horizon (across and
    /// along the vertical circle of each direction, for source lists and the mount alt-az).
    #[cfg_attr(feature = "cli", arg(long, value_name = "BASIS", value_enum, hide_possible_values = true, default_value_t = SimulateOptions::default().feed_basis))]
    pub feed_basis: FeedBasis,
    /// Add thermal noise by the SEFD or system temperature of each antenna, the channel width and the integration time.
    #[cfg_attr(feature = "cli", arg(long))]
    pub noise: bool,
    /// Noise of Gaussian fields that hold scene and receivers: its variance grows with what the antennas see, and baselines share it. Tsys and SEFD are
    /// then those of the receivers alone. It turns the noise on.
    #[cfg_attr(feature = "cli", arg(long))]
    pub scene_noise: bool,
    /// SEFD of every antenna. It turns the noise on.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FLUX", conflicts_with = "tsys"))]
    pub sefd: Option<FluxDensity>,
    /// System temperature of every antenna. It turns the noise on.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP"))]
    pub tsys: Option<Temperature>,
    /// Effective over geometric area of an antenna, for noise from system temperatures.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = SimulateOptions::default().aperture_efficiency))]
    pub aperture_efficiency: f64,
    /// Seed of the noise.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = SimulateOptions::default().seed))]
    pub seed: u64,
    /// Divide brightness temperature by n, as dOmega = dl dm / n.
    #[serde(skip)]
    #[cfg_attr(feature = "cli", arg(skip = true))]
    pub one_over_n: bool,
}

impl Default for SimulateOptions {
    fn default() -> Self {
        Self {
            method: Method::Degrid,
            epsilon: 1e-7,
            subchannels: 1,
            element: Element::Layout,
            element_file: None,
            element_diameter: None,
            element_width: None,
            pedestal: Pedestal::Auto,
            range: None,
            autos: false,
            no_antenna_temperature: false,
            no_w: false,
            unit: None,
            pols: vec![Polarization::I],
            mount: None,
            x_feeds: None,
            feed_basis: FeedBasis::GreatCircle,
            noise: false,
            scene_noise: false,
            sefd: None,
            tsys: None,
            aperture_efficiency: 1.0,
            seed: 1,
            one_over_n: true,
        }
    }
}

impl SimulateOptions {
    /// The power pattern of the elements of a layout. The pattern of an element file stands in the layout.
    ///
    /// # Errors
    /// A gaussian element without a width, an airy one without a diameter here and in the layout, numbers out of range, an element file beside
    /// another element.
    pub fn pattern(&self, layout: &ArrayLayout) -> Result<ElementPattern> {
        let pattern = match (self.element, self.element_diameter, self.element_width) {
            (Element::Layout, _, _) => layout.pattern.clone(),
            (Element::None, _, _) => ElementPattern::None,
            (Element::Airy, Some(d), _) => ElementPattern::Airy(Airy { diameter_m: d.si(), blockage: 0.0 }),
            (Element::Airy, None, _) => ElementPattern::Airy(Airy { diameter_m: layout.shared_diameter_m()?, blockage: 0.0 }),
            (Element::Gaussian, _, Some(w)) => ElementPattern::Gaussian(Gaussian { fwhm_rad: w.si(), ref_freq_hz: None }),
            (Element::Gaussian, _, None) => return bad_value("element-width", "missing", "an angle, the width of the gaussian element"),
            (Element::CosPower(exponent), _, _) => ElementPattern::CosPower(CosPower { exponent }),
        };
        pattern.check()?;
        let file = self.element_file.as_ref().map_or(String::new(), |f| f.display().to_string());
        let unused = self.element_file.is_some() && self.element != Element::Layout;
        need("element-file", file, !unused, "no file, or the element layout, whose pattern it replaces")?;
        let diameter = self.element_diameter.map_or(String::new(), |d| d.to_string());
        let unused = self.element_diameter.is_some() && self.element != Element::Airy;
        need("element-diameter", diameter, !unused, "no diameter, or the element airy, which alone uses it")?;
        let width = self.element_width.map_or(String::new(), |w| w.to_string());
        let unused = self.element_width.is_some() && self.element != Element::Gaussian;
        need("element-width", width, !unused, "no width, or the element gaussian, which alone uses it")?;
        Ok(pattern)
    }

    /// The noise, if the options select any.
    ///
    /// # Errors
    /// Both an SEFD and a system temperature.
    pub fn noise_options(&self) -> Result<Option<NoiseOptions>> {
        let sensitivity = sensitivity(self.sefd, self.tsys)?;
        let asked = self.noise || self.scene_noise || sensitivity.is_some();
        let noise = NoiseOptions { sensitivity, aperture_efficiency: self.aperture_efficiency, ..NoiseOptions::seeded(self.seed) };
        Ok(asked.then_some(noise))
    }

    /// The header of the set: visibilities of a scene whose own unit is `unit`.
    #[must_use]
    pub fn header(&self, layout: ArrayLayout, spectrum: SpectralWindow, center: PhaseCenter, unit: VisUnit) -> VisibilityHeader {
        let mut header = VisibilityHeader {
            telescope: layout.name.clone(),
            instrument: layout.name.clone(),
            layout,
            spectrum,
            polarizations: self.pols.clone(),
            phase_centers: vec![center],
            unit: self.unit.map_or(unit, DataUnit::vis_unit),
            pedestal_k: None,
            scene_pedestal_k: None,
            scene_width_rad: None,
            antenna_temperature_k: None,
            near_field: NearField::default(),
            annotations: Default::default(),
            history: Vec::new(),
        };
        self.state_feeds(&mut header);
        header
    }

    /// Say in the header how the feeds stand and turn, where this matters.
    fn state_feeds(&self, header: &mut VisibilityHeader) {
        use Polarization::{XX, XY, YX, YY};
        let has = |some: &[Polarization]| some.iter().any(|p| self.pols.contains(p));
        header.layout.mount = self.mount.or(header.layout.mount);
        let mount = header.layout.mount.filter(|_| header.layout.site().is_some() && self.pols.iter().any(|p| p.feeds().is_some()));
        if let Some(mount) = mount {
            Feeds::state(header, mount);
        }
        let linear = has(&[XX, YY, XY, YX]);
        if linear && (has(&[XY, YX]) || self.x_feeds.is_some() || mount.is_some()) {
            header.annotations.x_orientation = Some(self.x_feeds.unwrap_or(XOrientation::North));
        }
    }
}

/// The sensitivity that two options give.
pub(crate) fn sensitivity(sefd: Option<FluxDensity>, tsys: Option<Temperature>) -> Result<Option<Sensitivity>> {
    match (sefd, tsys) {
        (Some(_), Some(t)) => bad_value("tsys", t, "an SEFD or a system temperature, not both"),
        (Some(s), None) => Ok(Some(Sensitivity::SefdJy(s.si()))),
        (None, tsys) => Ok(tsys.map(|t| Sensitivity::TsysK(t.si()))),
    }
}

/// Unit of simulated visibilities.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
#[cfg_attr(feature = "cli", value(rename_all = "lower"))]
pub enum DataUnit {
    /// Jansky.
    Jy,
    /// Kelvin times steradian.
    Ksr,
}

impl DataUnit {
    fn vis_unit(self) -> VisUnit {
        match self {
            Self::Jy => VisUnit::Jy,
            Self::Ksr => VisUnit::KelvinSr,
        }
    }
}

word_or_quantity!(
    Pedestal,
    "auto" => Auto,
    "none" => None,
    Kelvin(Temperature),
    "auto, none, or a temperature such as \"290K\"."
);

/// A direction on the sky, with the text that it was read from.
#[derive(Debug, Clone, PartialEq)]
pub struct Direction {
    text: String,
    /// The phase centre there.
    pub center: PhaseCenter,
}
by_text!(Direction, "string", "RA,DEC in ICRS, such as \"19h59m28s,+40d44m02s\" or \"299.87deg,40.73deg\".");

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Direction {
    type Err = ArrayError;

    fn from_str(text: &str) -> std::result::Result<Self, ArrayError> {
        Ok(Self { text: text.to_owned(), center: PhaseCenter::parse(text)? })
    }
}

/// A time in UTC, with the text that it was read from.
#[derive(Debug, Clone, PartialEq)]
pub struct UtcTime {
    text: String,
    /// Julian date.
    pub jd: f64,
}
by_text!(UtcTime, "string", "A time in UTC, ISO 8601, such as \"2025-06-01T01:30:00\".");

impl fmt::Display for UtcTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for UtcTime {
    type Err = ArrayError;

    fn from_str(text: &str) -> std::result::Result<Self, ArrayError> {
        Ok(Self { text: text.to_owned(), jd: parse_utc(text)? })
    }
}

/// Hour angles of the start and the end of a track, written as times: -2h,2h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HourAngles {
    /// At the start.
    pub from: Duration,
    /// At the end.
    pub to: Duration,
}
by_text!(HourAngles, "string", "Two hour angles FROM,TO as times, such as \"-2h,2h\".");

impl HourAngles {
    /// Both in rad.
    fn rad(self) -> [f64; 2] {
        [self.from, self.to].map(|t| t.si() / 43_200.0 * std::f64::consts::PI)
    }
}

impl fmt::Display for HourAngles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.from, self.to)
    }
}

impl FromStr for HourAngles {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (from, to) = text.split_once(',').ok_or_else(|| format!("{text:?} is not two times FROM,TO such as -2h,2h"))?;
        let part = |t: &str| t.parse::<Duration>().map_err(|e| e.to_string());
        Ok(Self { from: part(from)?, to: part(to)? })
    }
}

/// Check the numbers that every method needs.
pub(super) fn check(options: &SimulateOptions) -> Result<()> {
    need("subchannels", options.subchannels, (1..=1024).contains(&options.subchannels), "1 to 1024")?;
    need("epsilon", options.epsilon, (1e-12..=0.1).contains(&options.epsilon), "1e-12 to 0.1")?;
    ensure!(!options.pols.is_empty(), ChainError::NoData("pols is empty, expected one polarisation product or more".into()));
    Ok(())
}

//! Options of layout design.

use super::freedom::Freedom;
use super::limits::Limits;
use super::method::{METHODS, MethodKind};
use super::objective::{OBJECTIVES, Setting};
use super::pads::Pads;
use super::peaks::Ring;
use super::polygon::Polygon;
use super::problem::Problem;
use super::profile::Density;
use super::region::Region;
use super::search::SearchControl;
use super::views::View;
use crate::values::{bad_value, by_text, need};
use crate::{ChainError, Result, ensure};
use cittert_arrays::quantity::{Angle, Duration, Frequency, Length};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, WITHIN};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::fmt;
use std::str::FromStr;

/// Objectives with their weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Objectives(pub Vec<(String, f64)>);
by_text!(Objectives, "string", "Names of objectives with commas between, each with =WEIGHT where it is not 1.");

impl fmt::Display for Objectives {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one = |(name, weight): &(String, f64)| if *weight == 1.0 { name.clone() } else { format!("{name}={weight}") };
        f.write_str(&self.0.iter().map(one).collect::<Vec<_>>().join(","))
    }
}

impl FromStr for Objectives {
    type Err = ChainError;

    /// Read a list such as `psl,cable=0.1`.
    ///
    /// # Errors
    /// An unknown name, one that occurs twice, a weight that is not positive.
    fn from_str(text: &str) -> Result<Self> {
        let bad = |expected: String| bad_value("objective", format!("{text:?}"), expected);
        let mut out: Vec<(String, f64)> = Vec::new();
        for part in text.split(',').map(str::trim) {
            let (name, weight) = part.split_once('=').map_or((part, Ok(1.0)), |(n, w)| (n.trim(), w.trim().parse::<f64>()));
            if !OBJECTIVES.iter().any(|o| o.name == name) {
                let known: Vec<&str> = OBJECTIVES.iter().map(|o| o.name).collect();
                return bad(format!("one or more of {}, with commas between and =WEIGHT where it is not 1", known.join(", ")));
            }
            let Some(weight) = weight.ok().filter(|w| *w > 0.0 && w.is_finite()) else {
                return bad(format!("a positive weight for {name}"));
            };
            need("objective", format!("{text:?}"), out.iter().all(|(n, _)| n != name), format!("{name} once"))?;
            out.push((name.to_owned(), weight));
        }
        Ok(Self(out))
    }
}

/// Options of layout design.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct DesignOptions {
    /// Number of elements, with the fixed ones.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub elements: Option<usize>,
    /// Diameter of the disc in which the elements stand [default: that of the given layout or polygons].
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub aperture: Option<Length>,
    /// What to make small: a list of objectives, each with =WEIGHT where it is not 1.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LIST", default_value_t = DesignOptions::default().objective))]
    pub objective: Objectives,
    /// Smallest distance of two elements.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH", default_value_t = DesignOptions::default().spacing))]
    pub spacing: Length,
    /// Elements stand only at multiples of this length from the centre, along both axes.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub position_grid: Option<Length>,
    /// Largest full width of the beam at half of its maximum, over all azimuths, in wavelengths over the aperture; 0 allows any width
    /// [default: 1.2 for elements that move, any for pads].
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub beam: Option<f64>,
    /// Distance from the beam at which side lobes begin, in wavelengths over the aperture.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = DesignOptions::default().first_minimum))]
    pub first_minimum: f64,
    /// Distance from the centre to which side lobes count, in wavelengths over the aperture.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X", default_value_t = DesignOptions::default().within))]
    pub within: f64,
    /// Centre of the band. It is needed with a bandwidth, and by objectives that compare lengths with the wavelength.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ"))]
    pub freq: Option<Frequency>,
    /// Full width of the band.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ", requires = "freq"))]
    pub bandwidth: Option<Frequency>,
    /// Number of equal channels in the band. The beam is the mean over them.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = DesignOptions::default().channels))]
    pub channels: usize,
    /// Observe a source of this declination while the Earth turns, instead of one moment at the zenith or along the boresight.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE", allow_hyphen_values = true))]
    pub declination: Option<Angle>,
    /// Latitude of the array [default: that of the site of the given layout].
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE", requires = "declination", allow_hyphen_values = true))]
    pub latitude: Option<Angle>,
    /// Length of the track, half of it before the source culminates and half after.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME", default_value_t = DesignOptions::default().track))]
    pub track: Duration,
    /// Number of moments of the track for which the beam is computed.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = DesignOptions::default().moments))]
    pub moments: usize,
    /// Stations that see the source below this elevation take no part in the objective coverage [default: 10deg].
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE", requires = "declination"))]
    pub elevation_limit: Option<Angle>,
    /// Density of baselines that the objective density compares with: uniform, gaussian=FWHM in apertures, or pairs LENGTH:DENSITY with lengths in
    /// apertures and commas between.
    #[cfg_attr(feature = "cli", arg(long, value_name = "DENSITY", default_value_t = DesignOptions::default().density))]
    pub density: Density,
    /// Order of the rotational symmetry of the layout; 1 for none.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = DesignOptions::default().symmetry))]
    pub symmetry: usize,
    /// Method of each attempt [default: descent where the objectives have gradients, else annealing].
    #[cfg_attr(feature = "cli", arg(long, value_name = "METHOD"))]
    pub method: Option<String>,
    /// Seed of the random numbers.
    #[cfg_attr(feature = "cli", arg(long, value_name = "N", default_value_t = DesignOptions::default().seed))]
    pub seed: u64,
    /// Number of attempts. Half of them begin at random layouts, half at the best so far with some elements moved [default: 64, or as many as the
    /// time allows].
    #[cfg_attr(feature = "cli", arg(long, value_name = "N"))]
    pub restarts: Option<u64>,
    /// Begin no attempts that would probably end later than this. The result then depends on the speed of the machine; it names the number of
    /// attempts, which as --restarts gives the same layout everywhere.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME"))]
    pub time: Option<Duration>,
}

impl Default for DesignOptions {
    fn default() -> Self {
        Self {
            elements: None,
            aperture: None,
            objective: Objectives(vec![("psl".into(), 1.0)]),
            spacing: Length(0.0),
            position_grid: None,
            beam: None,
            first_minimum: 1.3,
            within: WITHIN,
            freq: None,
            bandwidth: None,
            channels: 1,
            declination: None,
            latitude: None,
            track: Duration(6.0 * 3600.0),
            moments: 12,
            elevation_limit: None,
            density: Density::Gaussian(1.0),
            symmetry: 1,
            method: None,
            seed: 1,
            restarts: None,
            time: None,
        }
    }
}

/// Attempts where neither a number nor a time is given.
const ATTEMPTS: u64 = 64;
/// Largest width of the beam of elements that move, where none is given, in wavelengths over the aperture.
const BEAM: f64 = 1.2;
/// Limits of the width of the beam below this cannot be met.
const NARROWEST: f64 = 0.65;
/// Densest packing of equal circles, Lagrange 1773.
const DENSEST: f64 = 0.906_899_682_117_089;

/// Places that a user gives, m.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ground {
    /// Elements that stay where they are.
    pub fixed: Vec<[f64; 2]>,
    /// Polygons of which an element must be in at least one.
    pub inside: Vec<Polygon>,
    /// Polygons in which no element may stand.
    pub outside: Vec<Polygon>,
}

impl DesignOptions {
    /// The unit of length of the search, m: the aperture.
    ///
    /// # Errors
    /// No aperture, or one that is not positive.
    pub fn aperture_m(&self, ground: &Ground) -> Result<f64> {
        let reach = ground.inside.iter().map(Polygon::reach).fold(0.0, f64::max);
        match self.aperture {
            Some(a) => {
                need("aperture", a, a.si() > 0.0 && a.si().is_finite(), "a positive length")?;
                Ok(a.si())
            }
            None if reach > 0.0 => Ok(2.0 * reach),
            None => bad_value("aperture", "missing", "the diameter of the disc in which the elements stand, such as 0.6m"),
        }
    }

    /// The observation, for an aperture in m.
    ///
    /// # Errors
    /// A value that is out of its range.
    pub fn setting(&self, aperture_m: f64) -> Result<Setting> {
        need("first-minimum", self.first_minimum, self.first_minimum > 0.0, "a positive number of wavelengths over the aperture")?;
        let good = self.within > self.first_minimum && self.within <= 1000.0;
        need("within", self.within, good, format!("more than the first minimum, {}, and at most 1000", self.first_minimum))?;
        need("channels", self.channels, (1..=256).contains(&self.channels), "1 to 256")?;
        let relative = match (self.freq, self.bandwidth) {
            (Some(f), _) if !(f.si() > 0.0) => return bad_value("freq", f, "a positive frequency"),
            (Some(f), Some(b)) => {
                need(
                    "bandwidth",
                    b,
                    b.si() > 0.0 && b.si() < 2.0 * f.si(),
                    format!("a positive width that does not reach below 0 Hz around {f}"),
                )?;
                b.si() / f.si()
            }
            (None, Some(_)) => return bad_value("freq", "missing", "the centre of the band"),
            _ => 0.0,
        };
        need("channels", self.channels, self.channels == 1 || relative > 0.0, "1, or a bandwidth")?;
        let band = View::band(relative, self.channels);
        let views = match (self.declination, self.latitude) {
            (None, None) => band,
            (Some(dec), Some(lat)) => {
                need("declination", dec, dec.si().abs() <= PI / 2.0, "-90deg to 90deg")?;
                need("latitude", lat, lat.si().abs() <= PI / 2.0, "-90deg to 90deg")?;
                need("track", self.track, self.track.si() >= 0.0 && self.track.si() <= 86_400.0, "0h to 24h")?;
                need("moments", self.moments, (1..=1000).contains(&self.moments), "1 to 1000")?;
                let half = self.track.si() / 86_400.0 * PI;
                View::track(lat.si(), dec.si(), [-half, half], self.moments, &band)
            }
            _ => return bad_value("declination", "alone", "a declination and a latitude, or neither"),
        };
        let ring = Ring { inner: self.first_minimum, outer: self.within };
        // A tenth of a wavelength, as in the figures of layouts; without a wavelength a thousandth of the aperture.
        let tolerance = self.freq.map_or(1e-3, |f| 0.1 * SPEED_OF_LIGHT_M_S / f.si() / aperture_m);
        Ok(Setting { views, ring, tolerance, density: self.density.profile(), scene: None, coverage: None })
    }

    fn beam_limit(&self, default: Option<f64>) -> Result<Option<f64>> {
        if let Some(beam) = self.beam {
            let good = beam >= 0.0 && beam < 2.0 * self.first_minimum;
            let expected = format!(
                "{NARROWEST} or more, or 0 for no limit: a ring of elements, whose beam is narrower than that of other layouts, has 0.72"
            );
            need("beam", beam, beam == 0.0 || !(beam < NARROWEST), expected)?;
            need("beam", beam, good, format!("less than twice the first minimum, {}, or 0 for no limit", self.first_minimum))?;
        }
        Ok(self.beam.or(default).filter(|b| *b > 0.0))
    }

    /// The problem of choosing among pads (m), and the pads with the aperture as the unit of length. The aperture is the longest distance of two
    /// pads. Pads that coincide with fixed places are always chosen.
    ///
    /// # Errors
    /// A value that is out of its range, no pads, more to choose than there are, a fixed place without a pad.
    pub fn problem_of_pads(&self, pads_m: &[[f64; 2]], choose: usize, ground: &Ground) -> Result<(Problem, Pads)> {
        let distance = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let longest = pads_m.iter().flat_map(|a| pads_m.iter().map(move |b| distance(a, b))).fold(0.0, f64::max);
        ensure!(longest > 0.0, ChainError::Incompatible(format!("{} pads: there is nothing to choose", pads_m.len())));
        let aperture_m = self.aperture.map_or(longest, |a| a.si());
        need("aperture", Length(aperture_m), aperture_m > 0.0, "a positive length")?;
        need(
            "elements",
            self.elements.unwrap_or(choose),
            self.elements.is_none_or(|n| n == choose),
            format!("the number to choose, {choose}"),
        )?;
        need("symmetry", self.symmetry, self.symmetry == 1, "1 for pads")?;
        if let Some(grid) = self.position_grid {
            return bad_value("position-grid", grid, "none for pads: they stand where they stand");
        }
        need(
            "method",
            self.method.as_deref().unwrap_or("exchange"),
            self.method.as_deref().is_none_or(|m| m == "exchange"),
            "exchange for pads",
        )?;
        let at_pad = |(k, p): (usize, &[f64; 2])| {
            let found = pads_m.iter().position(|q| distance(p, q) <= 1e-6 * longest);
            found.ok_or_else(|| ChainError::Incompatible(format!("the fixed element {} stands on no pad", k + 1)))
        };
        let kept = ground.fixed.iter().enumerate().map(at_pad).collect::<Result<_>>()?;
        let places: Vec<[f64; 2]> = pads_m.iter().map(|p| p.map(|v| v / aperture_m)).collect();
        let reach = places.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
        let pads = Pads { places, choose, kept };
        pads.check()?;
        let setting = self.setting(aperture_m)?;
        let spacing = self.spacing.si() / aperture_m;
        need("spacing", self.spacing, spacing >= 0.0 && spacing.is_finite(), "a length of 0 m or more")?;
        // All pads are ground.
        let region = Region::disc(2.0 * reach);
        let limits = Limits { region, spacing, beam: self.beam_limit(None)?, views: setting.views.clone() };
        Ok((Problem { freedom: Freedom::all(choose), limits, grid: None, setting, terms: self.terms()? }, pads))
    }

    /// The problem of placing elements freely, with the aperture as the unit of length.
    ///
    /// # Errors
    /// A value that is out of its range, more elements than fit, fixed elements that are too near each other or outside.
    pub fn problem(&self, ground: &Ground) -> Result<Problem> {
        let aperture_m = self.aperture_m(ground)?;
        let Some(elements) = self.elements else {
            return bad_value("elements", "missing", "the number of elements");
        };
        need("elements", elements, (2..=3000).contains(&elements), "2 to 3000")?;
        need("spacing", self.spacing, self.spacing.si() >= 0.0 && self.spacing.si().is_finite(), "a length of 0 m or more")?;
        let fixed: Vec<[f64; 2]> = ground.fixed.iter().map(|p| p.map(|v| v / aperture_m)).collect();
        need("elements", elements, elements > fixed.len(), format!("more than the {} fixed ones", fixed.len()))?;
        let free = elements - fixed.len();
        let even = self.symmetry >= 1 && free.is_multiple_of(self.symmetry);
        need("symmetry", self.symmetry, even, format!("a divisor of the number of free elements, {free}"))?;
        let scaled = |all: &[Polygon]| all.iter().map(|p| p.scaled(1.0 / aperture_m)).collect();
        let region = Region { radius: 0.5, inside: scaled(&ground.inside), outside: scaled(&ground.outside) };
        let setting = self.setting(aperture_m)?;
        let spacing = self.spacing.si() / aperture_m;
        // Circles around the elements do not overlap, and lie in the ground widened by half of the spacing.
        let widened = PI * (0.5 + 0.5 * spacing).powi(2);
        let most = (DENSEST * widened / (PI * (0.5 * spacing).powi(2))).floor();
        if spacing > 0.0 && (elements as f64) > most.max(1.0) {
            let expected =
                format!("at most {most}: more do not fit into a disc of {} with a spacing of {}", Length(aperture_m), self.spacing);
            return bad_value("elements", elements, expected);
        }
        let limits = Limits { region, spacing, beam: self.beam_limit(Some(BEAM))?, views: setting.views.clone() };
        for (k, p) in fixed.iter().enumerate() {
            let stands = limits.region.contains(*p, 1e-9);
            ensure!(stands, ChainError::Incompatible(format!("the fixed element {} stands where no element may stand", k + 1)));
        }
        for (k, p) in fixed.iter().enumerate() {
            let near = fixed[..k].iter().position(|q| (p[0] - q[0]).hypot(p[1] - q[1]) < spacing);
            if let Some(j) = near {
                let text =
                    format!("the fixed elements {} and {} are nearer to each other than the spacing, {}", j + 1, k + 1, self.spacing);
                return Err(ChainError::Incompatible(text));
            }
        }
        if let Some(grid) = self.position_grid {
            let good = grid.si() > 0.0 && grid.si() < 0.25 * aperture_m;
            need("position-grid", grid, good, format!("a positive length below a quarter of the aperture, {}", Length(aperture_m)))?;
            let kept = [1, 2, 4].contains(&self.symmetry);
            need("symmetry", self.symmetry, kept, "1, 2 or 4 with a position grid: a square grid has no other symmetry")?;
        }
        let grid = self.position_grid.map(|g| g.si() / aperture_m);
        let terms = self.terms()?;
        let problem =
            Problem { freedom: Freedom { free: free / self.symmetry, symmetry: self.symmetry, fixed }, limits, grid, setting, terms };
        Ok(problem)
    }

    /// The objectives as rows of the table.
    ///
    /// # Errors
    /// An unknown objective.
    pub fn terms(&self) -> Result<Vec<(usize, f64)>> {
        let row = |(name, weight): &(String, f64)| match OBJECTIVES.iter().position(|o| o.name == name) {
            Some(k) => Ok((k, *weight)),
            None => bad_value("objective", name, OBJECTIVES.iter().map(|o| o.name).collect::<Vec<_>>().join(", ")),
        };
        self.objective.0.iter().map(row).collect()
    }

    /// The method of each attempt.
    ///
    /// # Errors
    /// An unknown method, or one that needs gradients that an objective does not have.
    pub fn method_for(&self, problem: &Problem) -> Result<&'static MethodKind> {
        let smooth = problem.has_gradient();
        let name = self.method.as_deref().unwrap_or(if smooth { "descent" } else { "annealing" });
        let Some(method) = METHODS.iter().find(|m| m.name == name) else {
            return bad_value("method", name, METHODS.iter().map(|m| m.name).collect::<Vec<_>>().join(", "));
        };
        if method.gradient && !smooth {
            let rough: Vec<&str> = problem.kinds().filter(|(k, _)| !k.gradient).map(|(k, _)| k.name).collect();
            return bad_value("method", name, format!("a method without gradients, which {} does not have", rough.join(", ")));
        }
        Ok(method)
    }

    /// How long to search.
    ///
    /// # Errors
    /// No attempt, a time that is not positive.
    pub fn control(&self) -> Result<SearchControl> {
        if let Some(n) = self.restarts {
            need("restarts", n, (1..=10_000_000).contains(&n), "1 to 10000000")?;
        }
        if let Some(t) = self.time {
            need("time", t, t.si() > 0.0, "a positive time")?;
        }
        let attempts = self.restarts.unwrap_or(if self.time.is_some() { 10_000_000 } else { ATTEMPTS });
        Ok(SearchControl { attempts, time: self.time.map(|t| std::time::Duration::from_secs_f64(t.si().min(1e9))) })
    }
}

//! The range in which side lobes count: from the first minimum to a number of wavelengths over the aperture.

use super::FigureOptions;
use super::main_lobe::Beam;
use super::plane::Plane;
use super::psf::Psf;
use super::side_lobes::{Field, SideLobes};
use crate::{ArrayError, ArrayLayout, Result, Weighting};

/// How the aperture of a layout is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ApertureFrom {
    /// The options give it.
    Options,
    /// The layout states for which aperture it was designed.
    Layout,
    /// The layout states none, so its longest baseline counts.
    LongestBaseline,
}

impl ApertureFrom {
    /// The length that counts, in words.
    #[must_use]
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Options | Self::Layout => "aperture",
            Self::LongestBaseline => "longest baseline",
        }
    }
}

/// The aperture D in the unit lambda / D of distances from the centre of the beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aperture {
    /// Its diameter, m.
    pub diameter_m: f64,
    /// How it is known.
    pub from: ApertureFrom,
}

impl Aperture {
    /// The aperture of a layout whose longest baseline, as the source sees it, is `longest_m`: that of the options, else that of the layout, else
    /// the longest baseline.
    pub(super) fn of(layout: &ArrayLayout, options: &FigureOptions, longest_m: f64) -> Self {
        match (options.aperture, layout.aperture_m) {
            (Some(given), _) => Self { diameter_m: given.si(), from: ApertureFrom::Options },
            (None, Some(stated)) => Self { diameter_m: stated, from: ApertureFrom::Layout },
            (None, None) => Self { diameter_m: longest_m, from: ApertureFrom::LongestBaseline },
        }
    }
}

/// Most phasors that are summed for the side lobes of the whole field: half a second.
const MOST_SUMS: f64 = 3e8;

/// The range in which side lobes count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reach {
    /// Wavelengths over the aperture.
    pub(super) within: f64,
    /// The aperture in wavelengths.
    pub(super) aperture: f64,
}

impl Reach {
    /// The distance from the centre, rad.
    pub(super) fn radius_rad(self) -> f64 {
        self.within / self.aperture
    }

    /// The whole field: as far as the horizon, or where the sums would take long, as far as [`MOST_SUMS`] allow, but never less than this range.
    pub(super) fn whole(self, psf: &Psf, beam: &Beam) -> Self {
        let points = (MOST_SUMS / (2.0 * psf.n_terms() as f64)).sqrt().min(Field::MOST_POINTS - 1.0).floor();
        let radius_rad = (points * Field::step(beam)).min(1.0).max(self.radius_rad());
        Self { within: radius_rad * self.aperture, ..self }
    }

    /// The field out to this distance.
    pub(super) fn field(self, beam: &Beam) -> Result<Field> {
        Field::within(beam, self.radius_rad()).ok_or_else(|| ArrayError::BadOption {
            option: "within",
            value: self.within.to_string(),
            expected: format!("at most {:.0} for this array: 1000 beams", 1000.0 * beam.minor_rad * self.aperture),
        })
    }

    /// The side lobes out to this distance.
    pub(super) fn side_lobes(self, psf: &Psf, beam: &Beam) -> Result<SideLobes> {
        let lobes = SideLobes::of(psf, &self.field(beam)?);
        let main = beam.major_rad * self.aperture;
        let expected = format!("more than the main lobe, which is {main:.1} wide at half of its peak");
        ArrayError::need("within", self.within, lobes.peak > 0.0, expected)?;
        Ok(lobes)
    }
}

/// The side lobes of the mean beam of several views with natural weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamLobes {
    /// Largest side lobe of either sign over the main lobe.
    pub peak: f64,
    /// Root mean square of the beam outside the main lobe over its peak.
    pub rms: f64,
}

impl BeamLobes {
    /// Side lobes from the first minimum to `within` wavelengths over an aperture of so many wavelengths, as in [`crate::LayoutFigures`]. Each view
    /// holds the antennas (wavelengths) as the source sees them in one channel and integration.
    ///
    /// # Errors
    /// A distance that is not positive, within the main lobe, or so large that the sums would take minutes; a view of fewer than two antennas.
    pub fn of_views(views: Vec<Vec<[f64; 2]>>, within: f64, aperture: f64) -> Result<Self> {
        let least = views.iter().map(Vec::len).min().unwrap_or(0);
        ArrayError::unless(least >= 2, "number of antennas", least, "2 or more for side lobes")?;
        for (option, value) in [("within", within), ("aperture", aperture)] {
            ArrayError::need(option, value, value.is_finite() && value > 0.0, "a positive number")?;
        }
        let psf = Psf::weighted(&Plane::of(views), &[1.0], Weighting::Natural, 0.0, 1.0);
        let lobes = Reach { within, aperture }.side_lobes(&psf, &Beam::fit(&psf))?;
        Ok(Self { peak: lobes.peak, rms: lobes.rms })
    }
}

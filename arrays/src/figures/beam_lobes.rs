//! The range in which side lobes count: from the first minimum to a number of wavelengths over the longest baseline.

use super::main_lobe::Beam;
use super::plane::Plane;
use super::psf::Psf;
use super::side_lobes::{Field, SideLobes};
use crate::{ArrayError, Result, Weighting};

/// The side lobes of the mean beam of several views with natural weights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamLobes {
    /// Largest side lobe of either sign over the main lobe.
    pub peak: f64,
    /// Root mean square of the beam outside the main lobe over its peak.
    pub rms: f64,
    /// Longest baseline of all views, wavelengths.
    pub longest_wavelengths: f64,
}

impl BeamLobes {
    /// Side lobes from the first minimum to `within` wavelengths over the longest baseline, as in [`crate::LayoutFigures`]. Each view holds the antennas
    /// (wavelengths) as the source sees them in one channel and integration.
    ///
    /// # Errors
    /// A distance that is not positive, within the main lobe, or so large that the sums would take minutes; a view of fewer than two antennas.
    pub fn of_views(views: Vec<Vec<[f64; 2]>>, within: f64) -> Result<Self> {
        let least = views.iter().map(Vec::len).min().unwrap_or(0);
        ArrayError::unless(least >= 2, "number of antennas", least, "2 or more for side lobes")?;
        ArrayError::need(
            "within",
            within,
            within.is_finite() && within > 0.0,
            "a positive number of wavelengths over the longest baseline",
        )?;
        let plane = Plane::of(views);
        let psf = Psf::weighted(&plane, &[1.0], Weighting::Natural, 0.0, 1.0);
        let beam = Beam::fit(&psf);
        let lobes = side_lobes_within(&psf, &beam, within, plane.longest())?;
        Ok(Self { peak: lobes.peak, rms: lobes.rms, longest_wavelengths: plane.longest() })
    }
}

/// The field out to `x` wavelengths over the longest baseline.
pub(super) fn field_within(beam: &Beam, x: f64, longest: f64) -> Result<Field> {
    let most = 1000.0 * beam.minor_rad * longest;
    Field::within(beam, x / longest).ok_or_else(|| ArrayError::BadOption {
        option: "within",
        value: x.to_string(),
        expected: format!("at most {most:.0} for this array: 1000 beams"),
    })
}

/// Side lobes out to `x` wavelengths over the longest baseline.
pub(super) fn side_lobes_within(psf: &Psf, beam: &Beam, x: f64, longest: f64) -> Result<SideLobes> {
    let lobes = SideLobes::of(psf, &field_within(beam, x, longest)?);
    let main = beam.major_rad * longest;
    ArrayError::need("within", x, lobes.peak > 0.0, format!("more than the main lobe, which is {main:.1} wide at half of its peak"))?;
    Ok(lobes)
}

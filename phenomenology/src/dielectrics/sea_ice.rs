//! Sea ice: brine pockets in fresh ice.

use super::brine_volume::brine_volume_cox_weeks83;
use super::error::DielectricError;
use super::maetzler06::ice_permittivity_maetzler06;
use super::mixing::{NEEDLE, SPHERE, maxwell_garnett04, polder_van_santen46};
use super::model::{Bands, Formula, Model, Query, Range, SAME_FORMULA};
use super::state::Parameter;
use super::stogryn_desargant85::brine_permittivity_stogryn_desargant85;
use num_complex::Complex64;

const REFERENCE: &str = "host Maetzler 2006, brine Stogryn & Desargant 1985, brine volume \
     Cox & Weeks 1983 and Lepparanta & Manninen 1988";

const fn row(name: &'static str, describes: &'static str, formula: Formula) -> Model {
    const RANGES: &[Range] = &[Range::new(Parameter::Temperature, 243.15, 273.15), Range::new(Parameter::Salinity, 0.0, 40.0)];
    Model { name, describes, reference: REFERENCE, bands: Bands::fixed(1.0, 1000.0), ranges: RANGES, extension: SAME_FORMULA, formula }
}

/// Table row: spherical pockets, the default.
pub(super) const SPHERES: Model =
    row("sea-ice-spheres", "sea ice, spherical brine pockets (Polder & van Santen 1946)", |q| by_shape(q, BrinePockets::Spheres));

/// Table row: spherical pockets far apart.
pub(super) const MAXWELL_GARNETT: Model =
    row("sea-ice-maxwell-garnett", "sea ice, spherical brine pockets (Maxwell Garnett 1904)", |q| by_shape(q, BrinePockets::SpheresApart));

/// Table row: randomly oriented needles.
pub(super) const NEEDLES: Model =
    row("sea-ice-needles", "sea ice, random brine needles (Polder & van Santen 1946)", |q| by_shape(q, BrinePockets::Needles));

fn by_shape(q: &Query<'_>, pockets: BrinePockets) -> Result<Complex64, DielectricError> {
    sea_ice_permittivity(q.freq_ghz(), q.state.temperature_k, q.state.salinity_psu, pockets)
}

/// Shape and mixing of the brine pockets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BrinePockets {
    /// Spheres, Polder & van Santen.
    Spheres,
    /// Spheres, Maxwell Garnett.
    SpheresApart,
    /// Randomly oriented needles, Polder & van Santen.
    Needles,
}

/// Permittivity of sea ice, frequency in GHz, temperature in K, bulk salinity in psu.
///
/// Needles raise the loss above that of spheres: 1.1 to 2 times at 35 GHz and beyond, up to 8 times at 10 GHz, where the contrast between
/// brine and ice is largest.
///
/// # Errors
/// [`DielectricError::NoConvergence`] of the mixing formula.
pub fn sea_ice_permittivity(
    freq_ghz: f64,
    temperature_k: f64,
    salinity_psu: f64,
    pockets: BrinePockets,
) -> Result<Complex64, DielectricError> {
    let host = ice_permittivity_maetzler06(freq_ghz, temperature_k);
    let brine = brine_permittivity_stogryn_desargant85(freq_ghz, temperature_k);
    let volume = brine_volume_cox_weeks83(temperature_k, salinity_psu);
    match pockets {
        BrinePockets::Spheres => polder_van_santen46(host, brine, volume, SPHERE),
        BrinePockets::SpheresApart => Ok(maxwell_garnett04(host, brine, volume)),
        BrinePockets::Needles => polder_van_santen46(host, brine, volume, NEEDLE),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn needles_are_lossier_than_spheres() {
        for f in [35.0, 94.0, 220.0] {
            for t in [253.15, 263.15] {
                let s = sea_ice_permittivity(f, t, 6.0, BrinePockets::Spheres).unwrap();
                let n = sea_ice_permittivity(f, t, 6.0, BrinePockets::Needles).unwrap();
                let m = sea_ice_permittivity(f, t, 6.0, BrinePockets::SpheresApart).unwrap();
                let ratio = n.im / s.im;
                assert!((1.1..2.2).contains(&ratio), "{f} GHz {t} K ratio {ratio}");
                assert!((m - s).norm() < 0.05 * s.norm());
            }
        }
    }

    #[test]
    fn ice_without_salt_is_fresh_ice() {
        let eps = sea_ice_permittivity(37.0, 260.0, 0.0, BrinePockets::Spheres).unwrap();
        assert!((eps - ice_permittivity_maetzler06(37.0, 260.0)).norm() < 1e-12);
    }
}

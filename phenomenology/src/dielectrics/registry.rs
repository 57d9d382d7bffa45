//! The permittivity models, one row each.

use super::error::{DielectricError, unknown};
use super::model::Model;
use super::{
    conductor, constant, dobson85, hallikainen86, hufford91, klein_swift77, liebe91, maetzler06, maetzler96, meissner_wentz04, mironov09,
    p2040, polder_van_santen46, sea_ice, stogryn_desargant85, stogryn95, turner16, ulaby_el_rayes87, ulaby86,
};

/// Every permittivity model.
pub static MODELS: &[Model] = &[
    liebe91::MODEL,
    turner16::MODEL,
    stogryn95::MODEL,
    klein_swift77::MODEL,
    meissner_wentz04::MODEL,
    maetzler06::MODEL,
    hufford91::MODEL,
    stogryn_desargant85::MODEL,
    sea_ice::SPHERES,
    sea_ice::MAXWELL_GARNETT,
    sea_ice::NEEDLES,
    maetzler96::MODEL,
    hallikainen86::MODEL,
    polder_van_santen46::MODEL,
    dobson85::MODEL,
    ulaby86::MODEL,
    ulaby86::DOUBLE_DEBYE,
    mironov09::MODEL,
    constant::FROZEN_SOIL,
    p2040::MODEL,
    ulaby_el_rayes87::MODEL,
    conductor::MODEL,
    constant::PAINT,
];

/// The permittivity model of this name.
///
/// # Errors
/// [`DielectricError::Unknown`] with the known names.
pub fn model_by_name(name: &str) -> Result<&'static Model, DielectricError> {
    let wanted = name.trim().to_ascii_lowercase().replace('_', "-");
    MODELS.iter().find(|m| m.name == wanted).ok_or_else(|| unknown("permittivity model", name, MODELS.iter().map(|m| m.name)))
}

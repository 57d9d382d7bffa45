//! Materials of constant permittivity: paint and frozen soil.

use super::error::DielectricError;
use super::model::{Bands, Model, Query, Range, no_constants, permittivity_of};
use super::spec::Constants;
use super::state::Parameter;
use num_complex::Complex64;

const HELD: &str = "the same constant is held";

/// Table row: paint.
pub(super) const PAINT: Model = Model {
    name: "paint-constant",
    describes: "dried paint film, 3 - j0.05; lay 50-300 um of it over metal as a stack",
    reference: "stand-in value for dried paint at millimetre waves",
    bands: Bands::fixed(1.0, 1000.0),
    ranges: &[],
    extension: HELD,
    formula: fixed,
};

/// Table row: frozen soil.
pub(super) const FROZEN_SOIL: Model = Model {
    name: "frozen-soil-constant",
    describes: "frozen soil, 5 - j0.5, the usual stand-in",
    reference: "stand-in value for frozen ground",
    bands: Bands::fixed(1.0, 100.0),
    ranges: &[Range::new(Parameter::Temperature, 200.0, 273.15)],
    extension: HELD,
    formula: fixed,
};

fn fixed(q: &Query<'_>) -> Result<Complex64, DielectricError> {
    match q.constants {
        Constants::Fixed(real, loss) => Ok(permittivity_of(real, loss)),
        _ => Err(no_constants(q.material, &PAINT)),
    }
}

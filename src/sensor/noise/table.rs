//! The table of noise parts, in the order in which they act.

use super::part::NoiseKind;
use super::{flicker, gain, pattern, quantize, thermal};

/// All parts.
pub const NOISE: &[NoiseKind] = &[
    NoiseKind { name: "thermal", make: thermal::make, about: "radiometer equation", source: "Dicke 1946; Ulaby & Long 2014, sec. 7-4" },
    NoiseKind {
        name: "1/f",
        make: flicker::make,
        about: "1/f noise of each detector in time",
        source: "a sum of relaxations: van der Ziel 1950",
    },
    NoiseKind {
        name: "gain drift",
        make: gain::make,
        about: "random walk of the gain of each detector between calibrations",
        source: "Ulaby & Long 2014, sec. 7-5",
    },
    NoiseKind {
        name: "fixed pattern",
        make: pattern::make,
        about: "offsets and gains of detectors that stay the same",
        source: "own definition",
    },
    NoiseKind { name: "quantisation", make: quantize::make, about: "levels of the digitiser", source: "Bennett 1948" },
];

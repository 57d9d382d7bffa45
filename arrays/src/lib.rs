//! The shared vocabulary of cittert: antenna arrays, and the labelled data arrays measured with them.
//!
//! This crate does no transforms, no gridding and no input or output. The constructors check the invariants (`VisibilityBlock::new`
//! checks every shape), so the algorithms that use these types need no checks of their own.
//!
//! | type | holds | shapes and units |
//! |---|---|---|
//! | [`ArrayLayout`] | antennas, site or boresight frame | m |
//! | [`GenerateOptions`], [`LAYOUT_KINDS`] | what a generated layout is made of | m |
//! | [`LayoutFigures`] | beam, side lobes, coverage of a layout at a frequency | rad, dB |
//! | [`ElementPattern`], [`pattern::PATTERN_KINDS`] | power pattern of every element | |
//! | [`LocalSky`] | sidereal time and apparent places at one moment and site | rad |
//! | [`SpectralWindow`] | channel centres and widths | Hz \[chan\] |
//! | [`UvCoverage`] | uvw, antenna pairs, times | m \[blt, 3\], s |
//! | [`CoveragePlan`] | the rows of a snapshot or track, computed on request | |
//! | [`VisibilityHeader`] | layout, channels, polarisations, phase centres, unit, history | |
//! | [`VisibilityBlock`] | a run of rows | `Complex<f32>` \[blt, chan, pol\] |
//! | [`VisibilitySet`] | header and one block in memory | |
//! | [`NearField`] | where the scene of a set lies, and the point to which it is phased | m |
//! | [`GainTable`] | antenna gains | `Complex<f64>` \[solint, ant, chan, feed\] |
//! | [`SkyGrid`], [`Image`] | brightness on a grid of direction cosines | \[chan, pol, m, l\] |

mod annotations;
mod as_text;
pub mod astrometry;
mod band_table;
mod beam;
mod block_bytes;
mod builtin;
mod constants;
mod coverage;
mod error;
pub mod feeds;
mod figures;
mod gains;
mod generate;
mod geodesy;
mod image;
mod in_turn;
mod layout;
mod layout_toml;
mod near_field;
mod part;
pub mod pattern;
mod phase_center;
mod polarization;
pub mod quantity;
pub mod random;
mod ranks;
mod receiver;
mod sources;
mod spectrum;
mod stream;
mod uv_grid;
mod visibility;
mod weighting;

pub use annotations::{Annotations, Keyword, XOrientation};
pub use astrometry::{ApparentPlace, LocalSky, apparent_place, lst_rad};
pub use band_table::{BandSample, BandTable, band_response};
pub use beam::RestoringBeam;
pub use builtin::{BUILTIN_LAYOUTS, BuiltinLayout};
pub use constants::{BOLTZMANN_J_PER_K, JANSKY_W_M2_HZ, SPEED_OF_LIGHT_M_S, jy_per_kelvin_sr};
pub use coverage::{CoveragePlan, Track, UvCoverage};
pub use error::{ArrayError, BoxError, Result};
pub use figures::{
    Aperture, ApertureFrom, BeamLobes, FigureOptions, GhostLobe, GhostMap, Ghosts, LOSS_FIGURES, LayoutExtent, LayoutFigures, LossFigures,
    LossSummary, Losses, Shadowing, WITHIN,
};
pub use gains::GainTable;
pub use generate::{GenerateOptions, LAYOUT_KINDS, LayoutKind};
pub use image::{BrightnessUnit, Image, SkyFrame, SkyGrid};
pub use in_turn::{InTurn, PartsSink};
pub use layout::{Antenna, ArrayLayout, LayoutFrame, Sensitivity, Site};
pub use near_field::{FocusPoint, NearField, SceneRange};
pub use part::Part;
pub use pattern::ElementPattern;
pub use phase_center::{PhaseCenter, PhaseCenterKind};
pub use polarization::Polarization;
pub use ranks::{Alone, Letters, Ranks, Underway, place_among};
pub use sources::{Source, SourcePosition, SourceShape};
pub use spectrum::SpectralWindow;
pub use stream::{PartSource, RowPart, VisibilitySink, VisibilitySource, for_each_block, rows_of_block};
pub use uv_grid::UvGrid;
pub use visibility::{VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySet, append_shared, found_shared};
pub use weighting::Weighting;

//! Design of sparse arrays: layouts that are optimised for the side lobes of their beam and for other figures of merit.
//!
//! | file | what it holds |
//! |---|---|
//! | `objective` | figures of merit with their gradients, one file and one row of a table each |
//! | `method` | ways from a start to a good layout, one file and one row of a table each |
//! | `search`, `attempt`, `start` | many attempts in parallel, from random layouts and from the best ones |
//! | `front` | weightings of two objectives, and the layouts that none beats in both |
//! | `journal` | attempts as lines of a file, to continue an interrupted search |
//! | `limits`, `region`, `polygon`, `freedom` | where elements may stand, and which of them move |
//! | `lobes`, `kernels`, `views`, `beam_map`, `lobe_norm` | the beam on a grid of directions, its p-norm, and their gradients |
//! | `moving_lobes`, `movable`, `grid` | an array of which one antenna moves at a time, and positions on a grid |
//! | `pads`, `baselines`, `sites` | a choice among pads, or among sites on the Earth |
//! | `scene_chain` | from a layout to the error of an image: the objective `scene` |
//! | `peaks`, `polish`, `minimax` | the tops of the side lobes, and the layout in which the highest is lowest |
//!
//! The unit of length is the aperture, the unit of directions the wavelength over the aperture.

mod array_factor;
mod attempt;
mod baselines;
mod beam_map;
mod freedom;
mod front;
mod grid;
pub mod journal;
mod kernels;
mod limits;
mod lobe_norm;
mod lobes;
mod method;
mod minimax;
mod movable;
mod moving_lobes;
mod objective;
mod options;
mod pads;
mod peaks;
mod polish;
mod polygon;
mod problem;
mod profile;
mod region;
mod repair;
mod scene_chain;
mod search;
mod sites;
mod start;
mod views;

pub use array_factor::{array_factor, beam};
pub use attempt::attempt;
pub use freedom::Freedom;
pub use front::{front, weightings};
pub use limits::Limits;
pub use lobes::{LobeField, LobeGrid, LobeMap, MovedAntenna};
pub use method::{Beginning, METHODS, MethodKind, Work};
pub use moving_lobes::MovingLobes;
pub use objective::{FigureFunction, LayoutFigure, OBJECTIVES, Objective, ObjectiveKind, Setting};
pub use options::{DesignOptions, Ground, Objectives};
pub use pads::{Pads, attempt_pads};
pub use peaks::{Lobe, PeakFinder, Ring};
pub use polish::{PolishControl, polish};
pub use polygon::Polygon;
pub use problem::{Evaluator, Problem};
pub use profile::{Density, Profile};
pub use region::Region;
pub use scene_chain::{Deconvolver, SceneChain, SceneTestOptions};
pub use search::{Found, SearchControl, Searched, search};
pub use sites::SiteTracks;
pub use views::View;

#[cfg(test)]
mod tests;

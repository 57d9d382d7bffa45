//! What a command will take: seconds and bytes of each of its stages, from the work that it will do and the speed of a machine.
//!
//! The numbers of operations come from the code that does the work: the grid that the imager would choose, the plan of its transform, and some rows
//! of the set, cut and sorted as for gridding. The arrays that the code holds at once give the bytes. Only the seconds of one operation are measured:
//! `make bench-book` fits them to whole runs ([`Speeds`]), and a short test scales them to the machine at hand ([`Scale`]).
//!
//! | file | what it holds |
//! |---|---|
//! | `term` | the table of operations whose time is measured |
//! | `speeds` | seconds of each operation on one machine |
//! | `scale` | how much faster or slower this machine is |
//! | `stage` | a stage of a command, and the forecast of a command |
//! | `held` | the arrays of an image of a set, bytes |
//! | `image` | stages of `dirty`, `beam` and `grid` |
//! | `cleaned` | stages of `clean` |
//! | `calibrated` | stages of `selfcal` |
//! | `joint` | stages of `selfcal` with a joint solution of image and gains |
//! | `between` | stages of `selfcal --solve` |
//! | `entropy` | stages of `mem` |
//! | `closures` | stages of `mem` from closure quantities |
//! | `judged` | the verdict on an image |
//! | `rehearsed` | what a rehearsal has shown of a command |
//! | `sampled` | stages of `simulate` and `predict` |
//! | `waves` | spherical waves of scenes near the array |
//! | `converted` | stages of `convert`, `applycal` and `corrupt` |
//! | `traced` | stages of `scene render`, `scene fly`, `film` and a study of frame rates |
//! | `chained` | stages of `run`: commands one after the other, and pictures |
//! | `trials` | stages of `study` |
//! | `cluster` | the same work shared by several machines, and what breaks first |

mod between;
mod calibrated;
mod chained;
mod cleaned;
mod closures;
mod cluster;
mod converted;
mod entropy;
mod held;
mod image;
mod joint;
mod judged;
mod one_pass;
mod rehearsed;
mod sampled;
mod scale;
mod speeds;
mod stage;
mod term;
mod traced;
mod trials;
mod waves;

pub use between::{BetweenWork, between, settled};
pub use calibrated::{CalibrationWork, selfcal};
pub use chained::{Shown, chain, shown};
pub use cleaned::{CleanWork, clean};
pub use closures::{ClosureWork, closures};
pub use cluster::{Cluster, Limit, Shared, Span};
pub use converted::{Conversion, Gained, convert, gained};
pub use entropy::{EntropyWork, entropy};
pub use image::{InputFormat, beam, dirty, grid};
pub use joint::{JointTimes, joint};
pub use rehearsed::{Course, Pace, Tried};
pub use sampled::{SampledWork, predict, simulate};
pub use scale::Scale;
pub use speeds::Speeds;
pub use stage::{Forecast, Stage};
pub use term::{Kind, Term};
pub use traced::{Filmed, Rated, Traced, film, rates, render, timed};
pub use trials::{Trials, study};
pub use waves::{WavePasses, Waves, without_transforms};

//! Display: films of what a moving camera sees, and the frame rate at which it sees best.
//!
//! | file | what it does |
//! |---|---|
//! | `receiver` | the noise that the dwell of a frame rate leaves |
//! | `aperture` | one frame of a filled aperture |
//! | `interferometer` | one frame of an array of antennas |
//! | `marked` | the target of a study |
//! | `motion` | how fast the picture moves, and the mean of an exposure |
//! | `rates` | signal to noise, contrast of a target and blur against the frame rate |
//! | `options` | options of films and studies |
//! | `tone` | kelvin to levels of grey, the same in all frames of a film |
//! | `sheet` | panels side by side |
//! | `roll` | frames in order, several at once, in constant memory |
//! | `film` | the formats of films |
//!
//! The noise of a camera follows from its frame rate, and so does its motion blur. Somewhere between them is the best rate:
//!
//! ```
//! use cittert::arrays::quantity::{Frequency, Temperature};
//! use cittert::arrays::{BrightnessUnit, Image, Polarization, SkyFrame, SkyGrid, SpectralWindow};
//! use cittert::display::{Aperture, RateStudy, ReceiverOptions};
//! use cittert::progress::Silent;
//! use ndarray::Array4;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // Waves of 20 K that move by 30 pixels a second.
//! let grid = SkyGrid::new(64, 64, 1e-3, SkyFrame::Boresight)?;
//! let still = |t: f64| {
//!     let wave = |x: f64, y: f64| 280.0 + 10.0 * (0.8 * (x - 30.0 * t)).sin() * (0.7 * y).cos();
//!     let data = Array4::from_shape_fn((1, 1, 64, 64), |(_, _, m, l)| wave(l as f64, m as f64));
//!     let band = SpectralWindow::band(94e9, 1e9, 1)?;
//!     Ok(Image::new(grid.clone(), band, vec![Polarization::I], data, BrightnessUnit::Kelvin)?)
//! };
//! // 64 receivers of 500 K and 1 GHz that share the pixels.
//! let receivers = ReceiverOptions { tsys: Some(Temperature(500.0)), bandwidth: Frequency(1e9), detectors: Some(64) };
//! let camera = |rate_hz: f64| Aperture::of_receivers(&receivers, rate_hz, &grid);
//!
//! let rates_hz = vec![2.0, 8.0, 32.0, 128.0, 512.0];
//! let study = RateStudy { rates_hz, at_s: 0.0, seeds: 4, seed: 1, target: None, steps: None, psf: None };
//! let found = study.run(&still, &camera, &Silent)?;
//! assert_eq!(found.rows[found.best].rate_hz, 32.0);
//! # Ok(())
//! # }
//! ```

mod aperture;
#[cfg(feature = "cli")]
pub mod film;
mod interferometer;
mod marked;
mod motion;
mod options;
mod rates;
mod receiver;
mod roll;
mod sheet;
mod tone;

pub use aperture::{Aperture, Run};
pub use interferometer::{ArrayImage, Interferometer};
pub use marked::{Marked, Pixels};
pub use motion::{exposed, speed};
pub use options::{Colors, FilmOptions, Levels, PanelKind, RateOptions};
pub use rates::{RateFigures, RateRow, RateStudy};
pub use receiver::{ReceiverOptions, add_noise};
pub use roll::Stages;
pub use sheet::Sheet;
pub use tone::{Palette, Tone};

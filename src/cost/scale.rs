//! Three short tests that say how fast a machine is: gridding, a Fourier transform, and moving memory.
//!
//! Each takes some thousandths of a second and is run many times. The mean counts, without the slowest tenth, because other programs slow a command down as they slow
//! these runs down. A processor that is shared with another machine is often at one of two speeds for a tenth of a second or less, between which a median would jump.
//! The tests take turns for the same reason, a few runs at a time.

use super::term::Kind;
use crate::Result;
use crate::fourier::{Convolver, GridOptions, Transform, UvwExtent};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyFrame, SkyGrid};
use ndarray::Array2;
use num_complex::Complex32;
use serde::{Deserialize, Serialize};
use std::hint::black_box;
use std::time::Instant;

/// Seconds that the short tests take on one thread.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Scale {
    /// Gridding.
    pub grid_s: f64,
    /// Convolution of an image.
    pub fourier_s: f64,
    /// Copies of memory that is larger than the caches.
    pub stream_s: f64,
}

/// Rounds of all tests, and runs of each test in a round.
const ROUNDS: usize = 8;
const TURNS: usize = 4;
/// Side of the image that is convolved, pixels.
const SIDE: usize = 512;
const ROWS: usize = 6000;
const CHANNELS: usize = 16;
/// Values that are copied.
const VALUES: usize = 1 << 22;

impl Scale {
    /// How far the times of two machines differ: the sum of the squared logarithms of their ratios.
    pub(super) fn distance(&self, other: &Self) -> f64 {
        let pairs = [(self.grid_s, other.grid_s), (self.fourier_s, other.fourier_s), (self.stream_s, other.stream_s)];
        pairs.iter().map(|(a, b)| (a / b).ln().powi(2)).sum()
    }

    /// Run the tests, on one thread.
    ///
    /// # Errors
    /// No thread can be made.
    pub fn measure() -> Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let pool = pool.map_err(|e| crate::ChainError::Internal(format!("no thread for the tests of speed: {e}")))?;
        pool.install(|| {
            let (mut grid, mut fourier, mut stream) = (gridding()?, convolution(), copies());
            for _ in 0..ROUNDS {
                grid.round()?;
                fourier.round()?;
                stream.round()?;
            }
            Ok(Self { grid_s: grid.typical(), fourier_s: fourier.typical(), stream_s: stream.typical() })
        })
    }

    /// Seconds of the test of this kind; 1 where there is none.
    #[must_use]
    pub fn of(&self, kind: Kind) -> f64 {
        match kind {
            Kind::Grid => self.grid_s,
            Kind::Fourier => self.fourier_s,
            Kind::Stream => self.stream_s,
            Kind::Same => 1.0,
        }
    }
}

/// One of the short tests, and its times.
struct Test {
    work: Box<dyn FnMut() -> Result<()>>,
    times: Vec<f64>,
}

impl Test {
    fn new(work: impl FnMut() -> Result<()> + 'static) -> Self {
        Self { work: Box::new(work), times: Vec::with_capacity(ROUNDS * TURNS) }
    }

    fn round(&mut self) -> Result<()> {
        for _ in 0..TURNS {
            let start = Instant::now();
            (self.work)()?;
            self.times.push(start.elapsed().as_secs_f64());
        }
        Ok(())
    }

    /// The mean without the slowest tenth.
    fn typical(mut self) -> f64 {
        self.times.sort_by(f64::total_cmp);
        let kept = &self.times[..self.times.len() - self.times.len() / 10];
        kept.iter().sum::<f64>() / kept.len() as f64
    }
}

/// Rows on a spiral, so that tiles are visited as in a long track.
fn gridding() -> Result<Test> {
    let uvw_m = Array2::from_shape_fn((ROWS, 3), |(r, k)| {
        let (radius, angle) = (3000.0 * (r as f64 + 1.0) / ROWS as f64, r as f64 * 0.01);
        [radius * angle.cos(), radius * angle.sin(), 0.1 * radius][k]
    });
    let freq_hz: Vec<f64> = (0..CHANNELS).map(|c| 1e9 + 2e6 * c as f64).collect();
    let cell_rad = 0.25 * SPEED_OF_LIGHT_M_S / (freq_hz[CHANNELS - 1] * 3000.0);
    let grid = SkyGrid::new(SIDE, SIDE, cell_rad, SkyFrame::Boresight)?;
    let transform = Transform::<f32>::new(&grid, &freq_hz, UvwExtent::of(uvw_m.view()), &GridOptions::default(), (ROWS * CHANNELS) as u64)?;
    let rows = transform.sort(uvw_m.view())?;
    let mut gridder = transform.gridder();
    Ok(Test::new(move || gridder.add_sorted(&rows, |r, out| out.fill(Complex32::new(1.0, r as f32)))))
}

fn convolution() -> Test {
    let image = Array2::from_shape_fn((SIDE, SIDE), |(i, j)| ((i * 7 + j * 3) % 11) as f32);
    let convolver = Convolver::<f32>::new((SIDE, SIDE), SIDE / 2);
    let kernel = convolver.kernel(image.view());
    Test::new(move || {
        drop(black_box(convolver.convolve(image.view(), &kernel)));
        Ok(())
    })
}

fn copies() -> Test {
    let from = vec![1.0_f64; VALUES];
    let mut to = vec![0.0_f64; VALUES];
    Test::new(move || {
        to.copy_from_slice(black_box(&from));
        black_box(&mut to);
        Ok(())
    })
}

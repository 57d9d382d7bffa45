//! Phasing a set to a point: the visibilities of a source there get phase 0.
//!
//! The phase is that of two spherical waves, one to each antenna, so it is a difference of two numbers that belong to the antennas. Closure phases stay as they
//! are, and gains can be solved and applied before or after.

use super::paths::{Elements, Point};
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{
    FocusPoint, SPEED_OF_LIGHT_M_S, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySink, VisibilitySource, for_each_block,
};
use ndarray::Array2;
use num_complex::{Complex, Complex64};
use std::f64::consts::TAU;

/// Part of the shortest wavelength by which a baseline may differ from the positions of its antennas.
const TOLERANCE: f64 = 0.05;

/// Turns visibilities from the point to which they are phased to another one.
#[derive(Debug, Clone)]
pub struct Focusing {
    header: VisibilityHeader,
    /// Phasors \[chan, antenna\]: those of antenna 1 times the conjugate of those of antenna 2 turn a visibility.
    turn: Array2<Complex64>,
    positions_m: Vec<[f64; 3]>,
}

impl Focusing {
    /// From the point to which a set is phased to another one; without a point, to the direction of the boresight.
    ///
    /// # Errors
    /// A layout on the Earth, a point nearer than the farthest element.
    pub fn new(header: &VisibilityHeader, to: Option<FocusPoint>) -> Result<Self> {
        let before = Elements::new(&header.layout, header.near_field.focus)?;
        Elements::new(&header.layout, to)?;
        let point = to.map_or(Point { toward: [0.0, 0.0, 1.0], curvature: 0.0 }, Point::from);
        // The delay of the new point in the old phasing.
        let delay: Vec<f64> = (0..before.len()).map(|a| before.delay(a, point).0).collect();
        let freq = header.spectrum.freq_hz();
        let turn =
            Array2::from_shape_fn((freq.len(), delay.len()), |(c, a)| Complex64::from_polar(1.0, -TAU * (freq[c] * delay[a]).fract()));
        let mut header = header.clone();
        header.near_field.focus = to;
        Ok(Self { header, turn, positions_m: before.positions_m().to_vec() })
    }

    /// The header of the result.
    #[must_use]
    pub fn header(&self) -> &VisibilityHeader {
        &self.header
    }

    /// Turn the visibilities of a block. `first_row` is the index of its first row in the set.
    ///
    /// # Errors
    /// A baseline that is not the difference of the positions of its antennas.
    pub fn apply(&self, block: &mut VisibilityBlock, first_row: usize) -> Result<()> {
        check_baselines(&block.coverage, &self.positions_m, self.header.spectrum.range_hz().1, first_row)?;
        for ((row, chan, _), v) in block.vis.indexed_iter_mut() {
            let (a, b) = (block.coverage.ant1[row] as usize, block.coverage.ant2[row] as usize);
            if a != b {
                *v = turned(*v, self.turn[(chan, a)] * self.turn[(chan, b)].conj());
            }
        }
        Ok(())
    }

    /// Focus all rows of a source, which has the header that this was made for, and append them to a sink.
    ///
    /// # Errors
    /// As [`Focusing::apply`]; the source or the sink fails, or the observer asks to stop.
    pub fn run(
        &self,
        source: &mut dyn VisibilitySource,
        sink: &mut dyn VisibilitySink,
        bytes: usize,
        observer: &dyn Observer,
    ) -> Result<()> {
        observer.event(Event::Phase { name: "focusing", total: Some(source.n_rows() as u64), unit: "rows" });
        for_each_block::<ChainError>(source, bytes, |first, mut block| {
            ensure!(!observer.cancelled(), ChainError::Cancelled);
            self.apply(&mut block, first)?;
            observer.event(Event::Advance(block.n_rows() as u64));
            Ok(sink.write_block(&block)?)
        })?;
        observer.event(Event::Done);
        Ok(())
    }
}

fn turned(v: Complex<f32>, by: Complex64) -> Complex<f32> {
    let v = Complex64::new(v.re.into(), v.im.into()) * by;
    Complex::new(v.re as f32, v.im as f32)
}

/// Check that the baselines are those of the layout: the phases follow from its positions.
fn check_baselines(coverage: &UvCoverage, positions_m: &[[f64; 3]], freq_hz: f64, first_row: usize) -> Result<()> {
    let most = TOLERANCE * SPEED_OF_LIGHT_M_S / freq_hz;
    for (row, uvw) in coverage.uvw_m.rows().into_iter().enumerate() {
        let (a, b) = (coverage.ant1[row] as usize, coverage.ant2[row] as usize);
        let far = (0..3).map(|k| (uvw[k] - (positions_m[b][k] - positions_m[a][k])).abs()).fold(0.0, f64::max);
        let text = format!(
            "the uvw of row {} differ by {far:.3e} m from the positions of its antennas in the layout: a near field needs positions in the frame of the boresight that agree with the uvw",
            first_row + row
        );
        ensure!(!(far > most), ChainError::Incompatible(text));
    }
    Ok(())
}

/// The factor that turns a visibility that is phased to a focus back to the direction of the boresight, as if the waves were plane: that of a pair with this uvw,
/// m, at a frequency, Hz. Fourier images keep the boresight at their centre wherever the focus is.
#[must_use]
pub fn boresight_turn(focus: FocusPoint, uvw_m: [f64; 3], freq_hz: f64) -> Complex64 {
    let [l, m, n] = focus.direction();
    let depth = -(l * l + m * m) / (1.0 + n);
    let turns = (uvw_m[0] * l + uvw_m[1] * m + uvw_m[2] * depth) * freq_hz / SPEED_OF_LIGHT_M_S;
    Complex64::from_polar(1.0, TAU * turns.fract())
}

//! Errors that change what each baseline sees of the scene: they are no gains, and need the scene.
//!
//! The visibilities of the scene with the errors, less those without, are added to the data. Noise and whatever else the data hold stays.

use super::context::Context;
use super::corruption::Corruption;
use crate::progress::{Observer, Silent};
use crate::simulate::{Pedestal, Receivers, SimulateOptions, Simulator, SkyModel};
use crate::{ChainError, Result};
use cittert_arrays::pattern::Pointings;
use cittert_arrays::quantity::Temperature;
use cittert_arrays::{BrightnessUnit, VisUnit, VisibilityBlock, VisibilityHeader};
use num_complex::{Complex, Complex64};

/// What the errors do to the patterns and the bands of the antennas.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SceneErrors {
    /// Where the antennas point, and how wide their patterns are, if an error concerns them.
    pub pointings: Option<Pointings>,
    /// The receivers, if an error concerns them.
    pub receivers: Option<Receivers>,
}

impl SceneErrors {
    /// Draw the errors.
    pub(super) fn draw<'a>(
        header: &VisibilityHeader,
        time_jd: &[f64],
        errors: impl Iterator<Item = (&'a dyn Corruption, Context<'a>)>,
    ) -> Result<Self> {
        let n_ant = header.layout.n_ant();
        let (mut pointings, mut receivers) = (Pointings::nominal(time_jd.to_vec(), n_ant), Receivers::nominal(n_ant));
        let (straight, tuned) = (pointings.clone(), receivers.clone());
        let (mut turned, mut received) = (false, false);
        for (error, context) in errors {
            error.pointings(&context, &mut pointings)?;
            error.receivers(&context, &mut receivers)?;
            turned |= pointings != straight;
            received |= receivers != tuned;
        }
        pointings.check(n_ant)?;
        Ok(Self { pointings: turned.then_some(pointings), receivers: received.then_some(receivers) })
    }

    /// Let a simulation have these errors.
    ///
    /// # Errors
    /// As [`Simulator::with_pointings`] and [`Simulator::with_receivers`].
    pub fn put_into<'a>(&self, mut simulator: Simulator<'a>) -> Result<Simulator<'a>> {
        if let Some(pointings) = &self.pointings {
            simulator = simulator.with_pointings(pointings.clone())?;
        }
        if let Some(receivers) = &self.receivers {
            simulator = simulator.with_receivers(receivers)?;
        }
        Ok(simulator)
    }
}

/// The scene with the errors and without.
pub(super) struct SceneChange<'a> {
    with: Simulator<'a>,
    without: Simulator<'a>,
}

impl<'a> SceneChange<'a> {
    /// For the rows of a set with this header.
    pub(super) fn new(header: &VisibilityHeader, errors: &SceneErrors, sky: &'a SkyModel) -> Result<Self> {
        let make = || {
            let mut header = header.clone();
            if header.unit == VisUnit::Uncalibrated {
                header.unit = VisUnit::Jy;
            }
            let of_image = sky.images.iter().any(|i| i.unit == BrightnessUnit::Kelvin);
            let pedestal = header.pedestal_k.filter(|_| of_image).map_or(Pedestal::None, |t| Pedestal::Kelvin(Temperature(t)));
            Simulator::new(header, sky, &SimulateOptions { pedestal, ..SimulateOptions::default() }, &Silent)
        };
        let mut without = make()?;
        if let Some(p) = &errors.pointings {
            // The same sum as that with the errors, so that errors of 0 change nothing.
            without = without.with_pointings(Pointings::nominal(vec![p.time_jd[0]], header.layout.n_ant()))?;
        }
        Ok(Self { with: errors.put_into(make()?)?, without })
    }

    /// Add the change to a block.
    pub(super) fn add(&mut self, block: &mut VisibilityBlock, first_row: u64, observer: &dyn Observer) -> Result<()> {
        let mut rows = block.coverage.clone();
        let lost: Vec<bool> = rows.uvw_m.rows().into_iter().map(|uvw| uvw.iter().any(|x| !x.is_finite())).collect();
        for row in (0..rows.n_rows()).filter(|r| lost[*r]) {
            rows.uvw_m.row_mut(row).fill(0.0);
        }
        let with = self.with.block(rows.clone(), first_row, observer)?.vis;
        let without = self.without.block(rows, first_row, observer)?.vis;
        for (((row, _, _), v), (a, b)) in block.vis.indexed_iter_mut().zip(with.iter().zip(&without)) {
            if !lost[row] {
                let wide = |v: Complex<f32>| Complex64::new(v.re.into(), v.im.into());
                let sum = wide(*v) + (wide(*a) - wide(*b));
                *v = Complex::new(sum.re as f32, sum.im as f32);
            }
        }
        Ok(())
    }
}

/// The refusal of errors that need a scene where there is none.
pub(super) fn without_scene(kind: &str) -> ChainError {
    ChainError::bad_option(
        "scene",
        "missing".to_owned(),
        format!("the scene that was observed, or a model image: the error {kind} changes what each baseline sees of it"),
    )
}

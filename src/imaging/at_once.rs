//! Images that each process makes of its own rows with all planes at once, and that are summed.

use super::imager::Imager;
use super::over_ranks::finished;
use super::reduction::ReducedBlock;
use super::session::{Gridded, ResidualWeights, Residue, Session};
use crate::Result;
use crate::fourier::Real;
use crate::progress::Observer;
use ndarray::{Array2, CowArray, Ix2};

impl Imager<'_> {
    /// The sum over all processes of their images.
    pub(super) fn gridded_at_once<T: Real, P: Real>(
        &mut self,
        session: &mut Session<T>,
        what: Gridded,
        observer: &dyn Observer,
    ) -> Result<Array2<P>> {
        let mut gridder = session.transform.gridder();
        let (cached, mut number) = (self.is_cached(), 0);
        let add = |block: &ReducedBlock| {
            session.grid((number, cached), block, what, |rows, weighed| match &weighed.equal {
                Some(vis) => gridder.add_equal(rows, vis),
                None => gridder.add_sorted(rows, weighed.values),
            })?;
            number += 1;
            Ok(())
        };
        match what {
            Gridded::Beam => self.for_each_weight(observer, add)?,
            Gridded::Visibilities => self.for_each_weighed(observer, add)?,
        }
        Ok(finished(&*self.ranks(), gridder))
    }

    /// The sum over all processes of their residuals, and what those of this process leave of chi squared.
    pub(super) fn residual_at_once<T: Real, P: Real>(
        &mut self,
        session: &mut Session<T>,
        weights: (ResidualWeights, f64),
        model: CowArray<'_, f64, Ix2>,
        observer: &dyn Observer,
    ) -> Result<(Residue, Array2<P>)> {
        let degridder = session.transform.degridder(model.view())?;
        drop(model);
        let mut gridder = session.transform.gridder();
        let (cached, mut left, mut number) = (self.is_cached(), Residue::default(), 0);
        self.for_each_weighed(observer, |block| {
            left += session.residual((number, cached), block, weights, |rows, turn| gridder.add_residual(rows, &degridder, turn))?;
            number += 1;
            Ok(())
        })?;
        drop(degridder);
        Ok((left, finished(&*self.ranks(), gridder)))
    }
}

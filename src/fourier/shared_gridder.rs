//! Gridding by several processes while they read a set: each holds the rows of the grid of its own tiles, and no process keeps a visibility.

use super::fft::{rows_to_pixels, used_rows};
use super::gridder::grid_units;
use super::own_columns::{OwnColumns, StripeRows};
use super::owners::Owners;
use super::parcels::{OpenLetters, traded};
use super::plan::Plan;
use super::plane_rows::PlaneRows;
use super::real::Real;
use super::sorted_rows::FoldedRows;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Letters, Ranks, Underway};
use ndarray::Array2;
use num_complex::Complex;
use rayon::prelude::*;
use std::sync::Arc;

/// Sums the weighted visibilities of many blocks of rows, which several processes read, into one image.
///
/// All processes add their blocks at the same time. The nodes of a block go to the processes that hold the tiles that they lie in. At the end each process
/// transforms its rows along u, and gives the columns of the image in them to the processes that transform these along v.
///
/// ```text
/// for each block { fold; letters; fill them with nodes; add }; finish
/// ```
#[derive(Debug)]
pub struct SharedGridder<T: Real> {
    plan: Arc<Plan<T>>,
    owners: Owners,
    /// The planes. Only rows of this process have memory.
    planes: PlaneRows<T>,
    /// The nodes of the last block, which is gridded when the next one has been given.
    last: Option<Box<dyn Underway>>,
    /// Those of the block before, which this process has gridded. Others may not have got theirs yet.
    before: Option<Box<dyn Underway>>,
    inbox: Letters,
}

impl<T: Real> SharedGridder<T> {
    pub(super) fn on(plan: Arc<Plan<T>>, owners: Owners) -> Self {
        let mut planes = PlaneRows::unfilled(plan.n_rows, plan.planes(), plan.columns.width);
        let mut stripes = planes.stripes_mut();
        let per_row = plan.planes() * plan.columns.width;
        let mut held: Vec<usize> = vec![0; stripes.len()];
        owners.held(plan.table.support, owners.rank()).into_iter().for_each(|(s, rows)| held[s] = rows * per_row);
        stripes.par_iter_mut().zip(held).for_each(|(stripe, len)| {
            **stripe = Vec::with_capacity(len);
            stripe.resize(len, Complex::new(T::default(), T::default()));
        });
        Self { plan, owners, planes, last: None, before: None, inbox: Letters::default() }
    }

    /// Letters for the nodes of rows that were folded by the transform of this gridder. They lie in the memory of those of the block before the last, which all processes
    /// must have got first.
    ///
    /// # Errors
    /// The rows were folded by another transform.
    pub fn letters(&mut self, rows: FoldedRows) -> Result<OpenLetters<T>> {
        let memory = self.before.take().map(Underway::back).unwrap_or_default();
        OpenLetters::new(Arc::clone(&self.plan), &self.owners, rows, memory)
    }

    /// Add the nodes of letters of this gridder, each times `factor`. All processes call it as often; one that has no rows left gives `None`. The nodes are on
    /// their way while this process grids those of the call before, so that a process that is slow for one block stops no other.
    ///
    /// # Errors
    /// A message of another process is damaged.
    pub fn add(&mut self, given: Option<(OpenLetters<T>, T)>, ranks: &dyn Ranks) -> Result<()> {
        let letters = match given {
            Some((mut open, factor)) => {
                if factor != T::one() {
                    open.scale(factor);
                }
                open.letters
            }
            None => {
                let mut none = self.before.take().map(Underway::back).unwrap_or_default();
                none.set_lengths(std::iter::repeat_n(0, self.owners.size()));
                none
            }
        };
        let begun = ranks.give(letters);
        self.grid_last(ranks)?;
        self.last = Some(begun);
        Ok(())
    }

    /// Grid what is still on its way, after the last block. All processes call it together.
    ///
    /// # Errors
    /// As [`SharedGridder::add`].
    pub fn grid_last(&mut self, ranks: &dyn Ranks) -> Result<()> {
        let (plan, Some(last)) = (&self.plan, self.last.take()) else { return Ok(()) };
        ranks.got(&mut self.inbox);
        let traded = traded(plan, (last.letters(), &self.inbox), &self.owners)?;
        let own = traded.rows.colours.iter().flatten().all(|unit| self.owners.of(unit.v) == self.owners.rank());
        ensure!(own, ChainError::Internal("a process got visibilities of tiles that it does not hold".into()));
        grid_units(plan, (&traded.rows, &traded.nodes), (&self.planes, 0..plan.planes()), 0..plan.tiles_v())?;
        self.before = Some(last);
        Ok(())
    }

    /// The image \[m, l\] of everything that was added by all processes. All get the same bits.
    ///
    /// # Errors
    /// As [`SharedGridder::add`].
    pub fn finish<P: Real>(mut self, ranks: &dyn Ranks) -> Result<Array2<P>> {
        self.grid_last(ranks)?;
        self.before.take().map(Underway::back);
        self.inbox = Letters::default();
        let plan = &self.plan;
        let per_row = plan.planes() * plan.columns.width;
        let held: Vec<Vec<StripeRows>> = (0..self.owners.size()).map(|process| self.owners.held(plan.table.support, process)).collect();
        let mut columns = OwnColumns::new(plan, (self.owners.rank(), self.owners.size()));
        let mut stripes = self.planes.stripes_mut();
        for k in 0..held.iter().map(Vec::len).max().unwrap_or(0) {
            let stripe_of = |process: usize| held[process].get(k).map(|(s, rows)| (*s, used_rows(plan, *s).min(*rows)));
            let of_each: Vec<Option<StripeRows>> = (0..held.len()).map(stripe_of).collect();
            let own = of_each[self.owners.rank()].map(|(s, rows)| rows_to_pixels(plan, &std::mem::take(stripes[s])[..rows * per_row]));
            columns.trade(plan, (&own.unwrap_or_default(), &of_each), ranks);
        }
        Ok(columns.image(plan, ranks))
    }
}

//! Images that several processes make together, of data that stay in memory: band by band of v.

use super::imager::Imager;
use super::session::{Gridded, ResidualWeights, Residue, Session};
use crate::Result;
use crate::fourier::{Bands, Nodes, Real};
use crate::progress::{Event, Observer};
use cittert_arrays::SkyGrid;
use ndarray::{Array2, CowArray, Ix2};
use num_complex::Complex;

/// Reports several passes over the rows as one.
struct OnePass<'a> {
    observer: &'a dyn Observer,
    passes: usize,
}

impl Observer for OnePass<'_> {
    fn event(&self, event: Event<'_>) {
        self.observer.event(if let Event::Advance(n) = event { Event::Advance(n / self.passes.max(1) as u64) } else { event });
    }

    fn cancelled(&self) -> bool {
        self.observer.cancelled()
    }
}

impl Imager<'_> {
    /// The bands in which an image is made: where several processes share the set, all of them have their rows in memory, and enough memory for a band.
    /// The small field of a beam needs none.
    pub(super) fn bands<T: Real>(&self, session: &Session<T>, field: Option<&SkyGrid>) -> Option<Bands> {
        let ranks = self.ranks();
        if field.is_some() || ranks.size() == 1 {
            return None;
        }
        self.all_have(session.transform.bands(&*ranks).filter(|_| self.is_cached()))
    }

    /// The bands in which residuals are made: those of an image, where the nodes of all rows of every process, which wait between prediction and gridding, take
    /// no more memory than is saved.
    pub(super) fn residual_bands<T: Real>(&mut self, session: &mut Session<T>) -> Result<Option<Bands>> {
        let Some(bands) = self.bands(session, None) else { return Ok(None) };
        let (mut number, mut nodes) = (0, 0);
        self.for_each_weighed(&crate::progress::Silent, |block| {
            nodes += session.with_sorted((number, true), block, |rows| Ok(rows.n_nodes()))?;
            number += 1;
            Ok(())
        })?;
        let held = bands.bytes() + nodes * size_of::<Complex<T>>();
        Ok(self.all_have((held <= 2 * session.transform.plane_bytes()).then_some(bands)))
    }

    /// What this process has, if all have it.
    fn all_have(&self, bands: Option<Bands>) -> Option<Bands> {
        let mut without = [f64::from(u8::from(bands.is_none()))];
        self.ranks().largest(&mut without);
        bands.filter(|_| without[0] == 0.0)
    }

    /// The sum of the images of all processes, each of which transforms its own columns.
    pub(super) fn gridded_by_bands<T: Real, P: Real>(
        &mut self,
        session: &mut Session<T>,
        bands: &Bands,
        what: Gridded,
        observer: &dyn Observer,
    ) -> Result<Array2<P>> {
        let ranks = self.ranks();
        let one_pass = OnePass { observer, passes: bands.count() };
        let mut gridder = session.transform.band_gridder(bands);
        for _ in 0..bands.count() {
            let mut number = 0;
            self.for_each_weighed(&one_pass, |block| {
                session.grid((number, true), block, what, |rows, values| gridder.add_sorted(rows, values))?;
                number += 1;
                Ok(())
            })?;
            gridder.close(&*ranks);
        }
        Ok(gridder.finish(&*ranks))
    }

    /// The residuals of all processes, and what those of this process leave of chi squared. All rows are predicted before the first is gridded, so that the
    /// planes of the model and those of the residual are not in memory together.
    pub(super) fn residual_by_bands<T: Real, P: Real>(
        &mut self,
        (session, bands): (&mut Session<T>, &Bands),
        weights: (ResidualWeights, f64),
        model: CowArray<'_, f64, Ix2>,
        observer: &dyn Observer,
    ) -> Result<(Residue, Array2<P>)> {
        let ranks = self.ranks();
        let one_pass = OnePass { observer, passes: 2 * bands.count() + 1 };
        let mut degridder = session.transform.band_degridder(bands, model.view())?;
        drop(model);
        let mut nodes: Vec<Nodes<T>> = Vec::new();
        for _ in 0..bands.count() {
            degridder.open(&*ranks);
            let mut number = 0;
            self.for_each_weighed(&one_pass, |block| {
                let transform = session.transform.clone();
                session.with_sorted((number, true), block, |rows| {
                    if nodes.len() == number {
                        nodes.push(transform.nodes(rows));
                    }
                    degridder.add_to(rows, &mut nodes[number])
                })?;
                number += 1;
                Ok(())
            })?;
        }
        drop(degridder);
        let (mut left, mut number) = (Residue::default(), 0);
        self.for_each_weighed(&one_pass, |block| {
            left += session.residual((number, true), block, weights, |rows, subtract| nodes[number].turn(rows, subtract))?;
            number += 1;
            Ok(())
        })?;
        let mut gridder = session.transform.band_gridder(bands);
        for _ in 0..bands.count() {
            let mut number = 0;
            self.for_each_weighed(&one_pass, |block| {
                session.with_sorted((number, true), block, |rows| gridder.add_nodes(rows, &nodes[number]))?;
                number += 1;
                Ok(())
            })?;
            gridder.close(&*ranks);
        }
        drop(nodes);
        Ok((left, gridder.finish(&*ranks)))
    }
}

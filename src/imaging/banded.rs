//! Images that several processes make together, of data that stay in memory: band by band of v.

use super::imager::Imager;
use super::session::{Gridded, Session};
use crate::Result;
use crate::fourier::{BandGridder, Real};
use crate::progress::{Event, Observer};
use cittert_arrays::SkyGrid;
use ndarray::Array2;

/// Reports the passes over the rows of all bands as one.
struct OnePass<'a> {
    observer: &'a dyn Observer,
    bands: u64,
}

impl Observer for OnePass<'_> {
    fn event(&self, event: Event<'_>) {
        self.observer.event(if let Event::Advance(n) = event { Event::Advance(n / self.bands) } else { event });
    }

    fn cancelled(&self) -> bool {
        self.observer.cancelled()
    }
}

impl Imager<'_> {
    /// The gridder of a transform by bands: where several processes share the set, all of them have their rows in memory and enough of it for a band.
    /// The small field of a beam needs none.
    pub(super) fn band_gridder<T: Real>(&self, session: &Session<T>, field: Option<&SkyGrid>) -> Option<BandGridder<T>> {
        let ranks = self.ranks();
        if field.is_some() || ranks.size() == 1 {
            return None;
        }
        let gridder = session.transform.band_gridder(&*ranks).filter(|_| self.is_cached());
        let mut hindered = [f64::from(u8::from(gridder.is_none()))];
        ranks.largest(&mut hindered);
        gridder.filter(|_| hindered[0] == 0.0)
    }

    /// The sum of the images of all processes, each of which transforms its own columns.
    pub(super) fn gridded_by_bands<T: Real, P: Real>(
        &mut self,
        session: &mut Session<T>,
        mut gridder: BandGridder<T>,
        what: Gridded,
        observer: &dyn Observer,
    ) -> Result<Array2<P>> {
        let ranks = self.ranks();
        let one_pass = OnePass { observer, bands: gridder.bands() as u64 };
        for _ in 0..gridder.bands() {
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
}

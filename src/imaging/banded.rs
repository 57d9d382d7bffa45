//! Images that several processes make together, of data that stay in memory: band by band of v.

use super::imager::Imager;
use super::over_ranks::SMALL_PLANES;
use super::session::{Gridded, ResidualWeights, Residue, Session};
use crate::Result;
use crate::fourier::{Bands, Nodes, Real};
use crate::progress::{Event, Observer, Silent};
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
    /// The bands in which an image is made: where several processes share the set, all of them have their rows and the order of these in memory, and enough
    /// memory for a band. Small planes and the small field of a beam need none.
    pub(super) fn bands<T: Real>(&mut self, session: &mut Session<T>, field: Option<&SkyGrid>) -> Result<Option<Bands>> {
        Ok(self.bands_and_nodes(session, field)?.map(|(bands, _)| bands))
    }

    /// The bands in which residuals are made: those of an image, where the nodes of all rows of every process, which wait between prediction and gridding, take
    /// no more memory than is saved.
    pub(super) fn residual_bands<T: Real>(&mut self, session: &mut Session<T>) -> Result<Option<Bands>> {
        let Some((bands, nodes)) = self.bands_and_nodes(session, None)? else { return Ok(None) };
        let held = bands.bytes() + nodes * size_of::<Complex<T>>();
        Ok(self.all_have((held <= 2 * session.transform.plane_bytes()).then_some(bands)))
    }

    /// The bands of an image, and the number of nodes of the rows of this process.
    fn bands_and_nodes<T: Real>(&mut self, session: &mut Session<T>, field: Option<&SkyGrid>) -> Result<Option<(Bands, usize)>> {
        let ranks = self.ranks();
        if field.is_some() || ranks.size() == 1 || session.transform.plane_bytes() <= SMALL_PLANES {
            return Ok(None);
        }
        let (mut bands, mut nodes, mut blocks) = (session.transform.bands(&*ranks).filter(|_| self.is_cached()), 0, 0);
        if bands.is_some() {
            self.for_each_weighed(&Silent, |block| {
                nodes += session.with_sorted((blocks, true), block, |rows| Ok(rows.n_nodes()))?;
                blocks += 1;
                Ok(())
            })?;
            // Rows whose order is not kept would be sorted again for each band.
            bands = bands.filter(|_| session.keeps(blocks));
        }
        Ok(self.all_have(bands).map(|bands| (bands, nodes)))
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
                session.grid((number, true), block, what, |rows, weighed| gridder.add_sorted(rows, weighed.values))?;
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

#[cfg(test)]
mod tests {
    use crate::fixtures::{in_processes, positions, snapshot};
    use crate::imaging::{ImageSize, Imager, ImagingOptions};
    use crate::progress::Silent;
    use cittert_arrays::quantity::Angle;
    use cittert_arrays::{Polarization, VisUnit, VisibilitySource};
    use ndarray::Array2;

    fn options(side: usize) -> ImagingOptions {
        let size = Some(ImageSize::square(side));
        ImagingOptions { cell: Some(Angle(1e-3)), size, epsilon: 1e-7, ..ImagingOptions::default() }
    }

    /// An image is made by bands only if every process can do so, and small ones are not. In double precision several processes make the images of one to
    /// rounding.
    #[test]
    fn all_processes_grid_by_bands_or_none() {
        let set = snapshot(&positions(24, 0.5, 0.01, 3), &[94e9], &[Polarization::I], &[(0.0, 0.0, 1.0)], (0.05, VisUnit::Jy));
        let run = |source: &mut dyn VisibilitySource| {
            let mut imager = Imager::new(source, options(640), &Silent).unwrap();
            let mut session = imager.session::<f64>(0).unwrap();
            let bands = imager.residual_bands(&mut session).unwrap();
            let own = bands.clone().filter(|_| imager.ranks().rank() != 1);
            let with_one_that_cannot = imager.all_have(own).is_some();
            let dirty = imager.dirty(0, &Silent).unwrap();
            let model = Array2::from_shape_fn(dirty.dim(), |(i, j)| if (i * 7 + j) % 971 == 0 { 0.1 } else { 0.0 });
            let residual = imager.residual(0, model.view(), &Silent).unwrap();
            (bands.is_some(), with_one_that_cannot, [dirty, residual.image], residual.chi2_per_datum)
        };
        let one = in_processes(1, &set, run).remove(0);
        let several = in_processes(3, &set, run);
        for (by_bands, with_one_that_cannot, images, chi2) in &several {
            assert_eq!((one.0, *by_bands, *with_one_that_cannot), (false, true, false));
            assert_eq!(images, &several[0].2);
            for (image, expected) in images.iter().zip(&one.2) {
                let top = expected.iter().fold(0.0_f64, |top, v| top.max(v.abs()));
                assert!(image.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1e-11 * top));
            }
            assert!((chi2 / one.3 - 1.0).abs() < 1e-11);
        }
        let small = in_processes(2, &set, |source| {
            let mut imager = Imager::new(source, options(64), &Silent).unwrap();
            let mut session = imager.session::<f64>(0).unwrap();
            imager.bands(&mut session, None).unwrap().is_some()
        });
        assert_eq!(small, [false, false]);
    }
}

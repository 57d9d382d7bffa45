//! A set that is read in parts gives the images of a set that is read in blocks.

use super::*;
use crate::fixtures::{positions, snapshot};
use crate::memory::MemoryBudget;
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{
    Part, PartSource, Polarization, Result, RowPart, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySet, VisibilitySource, Weighting,
};
use ndarray::Axis;
use num_complex::Complex32;
use rayon::prelude::*;
use std::ops::Range;

/// A set that hands over its rows in parts, last part first, on several threads.
struct InParts(VisibilitySet);

impl VisibilitySource for InParts {
    fn header(&self) -> &VisibilityHeader {
        self.0.header()
    }

    fn n_rows(&self) -> usize {
        self.0.n_rows()
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock> {
        self.0.read_rows(range)
    }

    fn in_parts(&mut self) -> Option<&mut dyn PartSource> {
        Some(self)
    }
}

impl PartSource for InParts {
    fn read_parts(&mut self, range: Range<usize>, step: usize, take: &(dyn Fn(RowPart<'_>) + Sync)) -> Result<()> {
        let block = self.0.read_rows(range.clone())?;
        let n = block.vis.len() / range.len();
        let (vis, weights, flags) = (block.vis.as_slice().unwrap(), block.weights.as_slice().unwrap(), block.flags.as_slice().unwrap());
        let starts: Vec<usize> = (0..range.len()).step_by(step).rev().collect();
        starts.into_par_iter().for_each(|start| {
            let rows = start..(start + step).min(range.len());
            let of = rows.start * n..rows.end * n;
            take(RowPart { rows, vis: &vis[of.clone()], weights: &weights[of.clone()], flags: &flags[of] });
        });
        Ok(())
    }
}

/// Channels of the set: so many that an eighth of the smallest budget does not hold it.
const CHANNELS: u32 = 200;

/// Two hands, with every reason not to use a visibility.
fn set() -> VisibilitySet {
    let pols = [Polarization::RR, Polarization::LL];
    let freq: Vec<f64> = (0..CHANNELS).map(|c| 94e9 + 2e6 * f64::from(c)).collect();
    let sources = [(0.012, 0.005, 1.0), (-0.004, 0.009, 0.4)];
    let mut set = snapshot(&positions(40, 0.5, 0.01, 3), &freq, &pols, &sources, (0.05, VisUnit::Jy));
    let data = &mut set.data;
    data.flags[(7, 0, 0)] = true;
    data.flags[(300, 3, 1)] = true;
    (data.flags[(301, 3, 0)], data.flags[(301, 3, 1)]) = (true, true);
    data.weights[(100, 1, 0)] = 0.0;
    (data.weights[(101, 1, 0)], data.weights[(101, 1, 1)]) = (f32::NAN, f32::INFINITY);
    data.vis[(555, 2, 1)] = Complex32::new(f32::NAN, 0.0);
    data.vis[(556, 2, 0)] = Complex32::new(3e38, 0.0);
    data.coverage.uvw_m[(600, 1)] = f64::NAN;
    data.coverage.ant2[602] = data.coverage.ant1[602];
    data.weights.iter_mut().enumerate().for_each(|(k, w)| *w *= 1.0 + (k % 5) as f32);
    set
}

/// The set with the weights and flags of its first row in every row.
fn even_set() -> VisibilitySet {
    let mut set = set();
    let data = &mut set.data;
    (data.vis[(555, 2, 1)], data.vis[(556, 2, 0)]) = (Complex32::new(1.0, 0.5), Complex32::new(0.5, 1.0));
    (data.coverage.uvw_m[(600, 1)], data.coverage.ant2[602]) = (0.25, data.coverage.ant1[602] + 1);
    let (weights, flags) = (data.weights.index_axis(Axis(0), 0).to_owned(), data.flags.index_axis(Axis(0), 0).to_owned());
    data.weights.outer_iter_mut().for_each(|mut w| w.assign(&weights));
    data.flags.outer_iter_mut().for_each(|mut f| f.assign(&flags));
    data.flags.slice_mut(ndarray::s![.., 11, ..]).fill(true);
    set
}

/// Rows with the same weights hold one row of them, also where each has an unusable channel. One other row is enough to hold all.
#[test]
fn weights_that_all_rows_share_are_held_once() {
    let mut odd = even_set();
    odd.data.flags[(333, 5, 0)] = true;
    for (set, shared) in [(even_set(), true), (odd, false)] {
        for weighting in [Weighting::Natural, Weighting::Briggs] {
            let options = ImagingOptions { cell: Some(Angle(1e-3)), weighting, ..ImagingOptions::default() };
            let (mut blocks, mut parts) = (set.clone(), InParts(set.clone()));
            let mut plain = Imager::new(&mut blocks, options.clone(), &Silent).unwrap();
            let mut imager = Imager::new(&mut parts, options.clone(), &Silent).unwrap();
            let mut all = Vec::new();
            plain
                .for_each_weighed(&Silent, |block| {
                    all.push((block.weight.view().to_owned(), block.imaging().to_owned()));
                    Ok(())
                })
                .unwrap();
            let mut all = all.into_iter();
            imager
                .for_each_weighed(&Silent, |block| {
                    assert_eq!(matches!(block.weight, RowWeights::Same(..)), shared);
                    let (weight, imaging) = all.next().unwrap();
                    assert!(block.weight.view() == weight && block.imaging() == imaging);
                    Ok(())
                })
                .unwrap();
            assert!(all.next().is_none());
            assert_eq!(imager.survey(), plain.survey());
            assert_eq!(imager.dirty(0, &Silent).unwrap(), plain.dirty(0, &Silent).unwrap());
            let model = ndarray::Array2::from_elem((plain.grid().n_m, plain.grid().n_l), 1e-3);
            let [a, b] = [&mut plain, &mut imager].map(|i| i.residual(0, model.view(), &Silent).unwrap());
            assert!(a.image == b.image && a.chi2_per_datum == b.chi2_per_datum);
            let found = Outlook::of(&mut InParts(set.clone()), &options, None, &Silent).unwrap().0;
            assert!(found.alike || !shared);
        }
    }
}

#[test]
fn parts_and_blocks_give_the_same_bytes() {
    for weighting in [Weighting::Natural, Weighting::Briggs] {
        for pol in [Polarization::I, Polarization::V, Polarization::LL] {
            let run = |source: &mut dyn VisibilitySource, threads: usize, memory: MemoryBudget| {
                let options = ImagingOptions { cell: Some(Angle(1e-3)), weighting, pol, memory, ..ImagingOptions::default() };
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut imager = Imager::new(source, options, &Silent).unwrap();
                    let image = imager.dirty(0, &Silent).unwrap();
                    (imager.survey().clone(), image)
                })
            };
            // The second budget keeps no data, and reads several blocks.
            for memory in [MemoryBudget::default(), MemoryBudget::new(16 << 20).unwrap()] {
                for (mut source, even) in [(set(), false), (even_set(), true)] {
                    let (survey, image) = run(&mut source, 1, memory);
                    assert!(
                        survey.counts.used > 0
                            && (even || survey.counts.not_finite > 0 && survey.counts.autocorrelations == u64::from(CHANNELS))
                    );
                    for threads in [1, 3] {
                        let (found, same) = run(&mut InParts(source.clone()), threads, memory);
                        assert_eq!(found, survey);
                        assert_eq!(same, image, "{weighting:?} {pol:?} {threads} {even}");
                    }
                }
            }
        }
    }
}

/// An image that is made while the set is read is that of the kept visibilities, with any memory and on any number of threads, whichever row comes first.
#[test]
fn an_image_in_one_pass_is_that_of_the_kept_visibilities() {
    let large = |mut set: VisibilitySet| {
        set.data.weights.mapv_inplace(|w| 3e30 * w);
        set
    };
    // Some telescopes give a tiny weight to what should not count. These rows are read first, so that the image fails and is made anew.
    let tiny = |mut set: VisibilitySet| {
        set.data.weights.fill(1e4);
        set.data.weights.slice_mut(ndarray::s![-128.., .., ..]).fill(1e-34);
        set
    };
    for (source, exact) in [(set(), true), (even_set(), true), (large(set()), true), (tiny(even_set()), false)] {
        let options = |epsilon, memory| {
            let (cell, size) = (Some(Angle(1e-3)), Some(ImageSize { columns: 96, rows: 64 }));
            ImagingOptions { cell, size, epsilon, memory, weighting: Weighting::Natural, ..ImagingOptions::default() }
        };
        let mut images = Vec::new();
        for (threads, memory) in [(1, MemoryBudget::default()), (3, MemoryBudget::default()), (3, MemoryBudget::new(16 << 20).unwrap())] {
            let options = options(ImagingOptions::default().epsilon, memory);
            let (mut kept, mut read) = (InParts(source.clone()), InParts(source.clone()));
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            images.push(pool.install(|| {
                let mut plain = Imager::new(&mut kept, options.clone(), &Silent).unwrap();
                let mut once = Imager::of_one_image(&mut read, options.clone(), &Silent).unwrap();
                assert_eq!(once.survey(), plain.survey());
                let [of_plain, of_once] = [&mut plain, &mut once].map(|i| i.psf(0, &Silent).unwrap());
                assert_eq!(of_once, of_plain);
                let [of_plain, of_once] = [&mut plain, &mut once].map(|i| i.dirty(0, &Silent).unwrap());
                let peak = of_plain.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
                let error = (&of_once - &of_plain).iter().fold(0.0_f64, |a, v| a.max(v.abs()));
                assert!(error < 3e-6 * peak, "{error} of {peak}");
                of_once
            }));
        }
        assert!(!exact || images[0] == images[1]);
        // With less memory there are more blocks, of which the sums are made in another order.
        let error = (&images[2] - &images[0]).iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        assert!(error < 3e-6 * images[0].iter().fold(0.0_f64, |a, v| a.max(v.abs())));
    }
}

/// Several processes make such an image together, each of a part of the planes where these are large, and it is that of one process. Their blocks of rows need
/// not be as many, nor their first weights as large; where a weight is far larger than the first, all of them read the set again.
#[test]
fn several_processes_make_an_image_in_one_pass() {
    let far_apart = |mut set: VisibilitySet| {
        let n = set.n_rows();
        set.data.weights.slice_mut(ndarray::s![..n / 3, .., ..]).mapv_inplace(|w| 1e-3 * w);
        set
    };
    let tiny = |mut set: VisibilitySet| {
        set.data.weights.slice_mut(ndarray::s![..5, .., ..]).fill(1e-34);
        set
    };
    // Few visibilities make a beam that is bright everywhere. Transforms in single precision then have rounding errors of 5e-7 of the peak, and the largest of five
    // million such errors, in either image, is 3e-6.
    for (side, source, bound) in [(96_u16, set(), 3e-6), (2304, far_apart(set()), 6e-6), (2304, tiny(even_set()), 6e-6)] {
        let options = ImagingOptions {
            cell: Some(Angle(1e-3 * 96.0 / f64::from(side))),
            size: Some(ImageSize::square(side.into())),
            weighting: Weighting::Natural,
            ..ImagingOptions::default()
        };
        let mut whole = InParts(source.clone());
        let mut plain = Imager::new(&mut whole, options.clone(), &Silent).unwrap();
        let (beam, image) = (plain.psf(0, &Silent).unwrap(), plain.dirty(0, &Silent).unwrap());
        for size in [2, 3] {
            let made = crate::fixtures::as_processes(size, |ranks| {
                // The first process has few rows, and so the fewest blocks.
                let n = source.n_rows();
                let first = |rank: usize| n * rank * rank / (size * size);
                let data = source.data.rows(first(ranks.rank())..first(ranks.rank() + 1)).unwrap();
                let own = VisibilitySet { data, ..source.clone() };
                let mut part = Part::own(Box::new(InParts(own)), ranks);
                let mut imager = Imager::of_one_image(&mut part, options.clone(), &Silent).unwrap();
                (imager.psf(0, &Silent).unwrap(), imager.dirty(0, &Silent).unwrap())
            });
            assert!(made.iter().all(|images| *images == made[0]));
            for (found, expected) in [(&made[0].0, &beam), (&made[0].1, &image)] {
                let peak = expected.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
                let error = (found - expected).iter().fold(0.0_f64, |a, v| a.max(v.abs()));
                assert!(error < bound * peak, "{side} {size}: {error} of {peak}");
            }
        }
    }
}

/// The visibilities of such an image are not there for a second one, and the error says so.
#[test]
fn what_was_not_kept_is_not_taken_for_nothing() {
    let size = Some(ImageSize { columns: 64, rows: 64 });
    let natural = ImagingOptions { cell: Some(Angle(1e-3)), size, weighting: Weighting::Natural, ..ImagingOptions::default() };
    let mut source = InParts(set());
    let mut once = Imager::of_one_image(&mut source, natural.clone(), &Silent).unwrap();
    once.dirty(0, &Silent).unwrap();
    let model = ndarray::Array2::zeros((64, 64));
    for error in [once.dirty(0, &Silent).unwrap_err(), once.residual(0, model.view(), &Silent).unwrap_err()] {
        assert!(error.to_string().contains("not kept"), "{error}");
    }
    // Where the image needs more than that, the visibilities are kept.
    let briggs = ImagingOptions { weighting: Weighting::Briggs, ..natural.clone() };
    let cubes = ImagingOptions { channels_out: 2, ..natural.clone() };
    let fine = ImagingOptions { epsilon: 1e-7, ..natural.clone() };
    let chosen = ImagingOptions { size: None, ..natural };
    for options in [briggs, cubes, fine, chosen] {
        let mut source = InParts(set());
        let mut imager = Imager::of_one_image(&mut source, options, &Silent).unwrap();
        assert_eq!(imager.dirty(0, &Silent).unwrap(), imager.dirty(0, &Silent).unwrap());
    }
}

/// A set in parts, and the number of rows that were read of it.
struct Counted(InParts, usize);

impl VisibilitySource for Counted {
    fn header(&self) -> &VisibilityHeader {
        self.0.header()
    }

    fn n_rows(&self) -> usize {
        self.0.n_rows()
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock> {
        self.0.read_rows(range)
    }

    fn in_parts(&mut self) -> Option<&mut dyn PartSource> {
        Some(self)
    }
}

impl PartSource for Counted {
    fn read_parts(&mut self, range: Range<usize>, step: usize, take: &(dyn Fn(RowPart<'_>) + Sync)) -> Result<()> {
        self.1 += range.len();
        self.0.read_parts(range, step, take)
    }
}

/// Of a set that does not stay in memory, the visibilities are read once for the weights and once for an image, or once for both. Passes for the
/// density, the sum of the weights and the beam read places only, and give what the visibilities beside them would give.
#[test]
fn weights_that_all_rows_share_are_not_read_again() {
    let size = Some(ImageSize { columns: 64, rows: 64 });
    for (weighting, once, passes) in [(Weighting::Briggs, false, 2), (Weighting::Natural, false, 2), (Weighting::Natural, true, 1)] {
        let memory = MemoryBudget::new(16 << 20).unwrap();
        let options = ImagingOptions { cell: Some(Angle(1e-3)), size, weighting, memory, ..ImagingOptions::default() };
        let (mut all, mut counted) = (even_set(), Counted(InParts(even_set()), 0));
        let make = if once { Imager::of_one_image } else { Imager::new };
        let n_rows = all.n_rows();
        let mut plain = Imager::new(&mut all, options.clone(), &Silent).unwrap();
        let mut imager = make(&mut counted, options.clone(), &Silent).unwrap();
        let [beam, same] = [&mut plain, &mut imager].map(|i| i.psf(0, &Silent).unwrap());
        assert!((&beam - &same).iter().all(|d| d.abs() < 1e-6), "{weighting:?}");
        let [image, same] = [&mut plain, &mut imager].map(|i| i.dirty(0, &Silent).unwrap());
        let peak = image.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        assert!((&image - &same).iter().all(|d| d.abs() < 3e-6 * peak), "{weighting:?}");
        drop(imager);
        assert_eq!(counted.1, passes * n_rows, "{weighting:?}");
    }
}

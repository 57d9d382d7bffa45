//! Chi squared and its Hessian from passes over a set, so that the memory does not depend on the number of visibilities.

use super::beam::{BeamHessian, SHRINK};
use super::data_term::DataTerm;
use crate::fourier::{GridOptions, Real, Transform, UvwExtent};
use crate::imaging::{ImageMisfit, Imager, finished};
use crate::progress::{Observer, Quiet};
use crate::{ChainError, Result, ensure};
use ndarray::{ArrayView2, CowArray, Ix2, s};
use num_complex::{Complex, Complex64};

/// Chi squared of an output channel of an imager.
pub(super) struct Passes<'i, 's> {
    imager: &'i mut Imager<'s>,
    channel: usize,
    /// 1/sigma^2 over the weight of a visibility.
    factor: f64,
    used: u64,
    observer: &'i dyn Observer,
}

impl<'i, 's> Passes<'i, 's> {
    /// `used` visibilities of an output channel count; their weights times `factor` are 1/sigma^2.
    pub(super) fn new((imager, channel): (&'i mut Imager<'s>, usize), (factor, used): (f64, u64), observer: &'i dyn Observer) -> Self {
        Self { imager, channel, factor, used, observer }
    }
}

impl DataTerm for Passes<'_, '_> {
    fn data(&self) -> f64 {
        2.0 * self.used as f64
    }

    fn misfit(&mut self, image: CowArray<'_, f64, Ix2>) -> Result<ImageMisfit> {
        let ImageMisfit { chi2, gradient } = self.imager.chi_squared(self.channel, image, &Quiet(self.observer))?;
        Ok(ImageMisfit { chi2: self.factor * chi2, gradient: gradient * self.factor })
    }

    fn predict(&mut self, _image: ArrayView2<'_, f64>) -> Result<&[Complex64]> {
        Err(ChainError::Internal("the model visibilities of a set that is read in passes are not in memory".into()))
    }
}

impl BeamHessian {
    /// The Hessian of half of chi squared for the data of an output channel whose weights, times `factor`, are 1/sigma^2.
    ///
    /// # Errors
    /// No visibility has a weight above 0, or the source cannot be read.
    pub fn in_passes(at: (&mut Imager<'_>, usize), factor: f64, observer: &dyn Observer) -> Result<Self> {
        // Steps follow the Hessian, and those of several processes must not differ where double precision is asked for.
        if at.0.options().grid_options().single_precision_suffices() {
            Self::gridded::<f32>(at, factor, observer)
        } else {
            Self::gridded::<f64>(at, factor, observer)
        }
    }

    fn gridded<T: Real>((imager, channel): (&mut Imager<'_>, usize), factor: f64, observer: &dyn Observer) -> Result<Self> {
        let range = imager.channels()[channel].clone();
        let sum: f64 = imager.survey().channel_weight[range.clone()].iter().sum();
        ensure!(sum > 0.0, ChainError::NoData("no visibility has a weight above 0".into()));
        let grid = imager.grid().clone();
        let freq_hz = imager.header().spectrum.freq_hz()[range.clone()].to_vec();
        let extent = imager.survey().extent;
        let stretched = UvwExtent { u_m: extent.u_m / SHRINK, v_m: extent.v_m / SHRINK, w_m: 0.0 };
        let options = GridOptions { memory: imager.options().memory, ..Self::grid_options() };
        let transform = Transform::<T>::new(&Self::field(&grid), &freq_hz, stretched, &options, imager.n_transformed(channel))?;
        let mut gridder = transform.gridder();
        imager.for_each_weighed(&Quiet(observer), |block| {
            let rows = transform.sort(Self::stretch(block.uvw_m.view()).view())?;
            let weight = block.weight.view();
            let weight = weight.slice(s![.., range.clone()]);
            gridder.add_sorted(&rows, |row, out| {
                out.iter_mut().zip(weight.row(row)).for_each(|(o, w)| *o = Complex::new(T::of(f64::from(*w) / sum), T::of(0.0)));
            })
        })?;
        Ok(Self::of_beam(&grid, finished(&*imager.ranks(), gridder), factor * sum))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{positions, snapshot};
    use crate::imaging::ImagingOptions;
    use crate::mem::ChiSquared;
    use crate::misfit::Visibilities;
    use crate::progress::Silent;
    use cittert_arrays::{Polarization, VisUnit};
    use ndarray::Array2;

    #[test]
    fn passes_give_what_a_list_of_the_same_visibilities_gives() {
        let places = positions(12, 30.0, 0.0, 3);
        let freq: Vec<f64> = (0..5).map(|c| 1e9 + 1e7 * f64::from(c)).collect();
        let mut set = snapshot(&places, &freq, &[Polarization::I], &[(2e-3, 1e-3, 5.0)], (0.2, VisUnit::Jy));
        set.data.weights[(3, 2, 0)] = 0.0;
        set.data.flags[(4, 1, 0)] = true;
        let epsilon = 1e-9;
        for memory in [None, Some("16MiB")] {
            let mut options = ImagingOptions {
                size: Some("24x20".parse().unwrap()),
                cell: Some("1mrad".parse().unwrap()),
                epsilon,
                ..ImagingOptions::default()
            };
            options.memory = memory.map_or(options.memory, |m| m.parse().unwrap());
            let data = set.data.clone();
            let mut imager = Imager::new(&mut set, options, &Silent).unwrap();
            let grid = imager.grid().clone();
            let shown = |weight: f32, flag: bool| if flag { 0.0 } else { 3.0 * weight };
            let weight: Vec<f32> = data.weights.iter().zip(&data.flags).map(|(w, f)| shown(*w, *f)).collect();
            let used = weight.iter().filter(|w| **w > 0.0).count() as u64;
            let uvw = data.coverage.uvw_m.clone();
            let list = BeamHessian::of_list(&grid, &freq, uvw.view(), &weight).unwrap();
            let hessian = BeamHessian::in_passes((&mut imager, 0), 3.0, &Silent).unwrap();
            assert!((hessian.diagonal() / list.diagonal() - 1.0).abs() < 1e-6);
            let image = Array2::from_shape_fn((grid.n_m, grid.n_l), |(i, j)| ((i * 5 + j * 3) % 7) as f64);
            let mut a = image.mapv(|v| v as f32);
            let mut b = a.clone();
            hessian.apply_to(&mut a);
            list.apply_to(&mut b);
            assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-3), "Hessian");
            let grid_options = imager.options().grid_options();
            let term = Visibilities::new(data.vis.iter().copied().collect(), weight).unwrap();
            let mut listed = ChiSquared::new(&grid, &freq, uvw.view(), &grid_options, Box::new(term)).unwrap();
            let mut passes = ChiSquared::in_passes((&mut imager, 0), (3.0, used), &Silent).unwrap();
            assert_eq!(passes.expected(), listed.expected());
            let (a, b) = (passes.evaluate(image.view().into()).unwrap(), listed.evaluate(image.view().into()).unwrap());
            assert!((a.chi2 / b.chi2 - 1.0).abs() < 1e-7, "{} {}", a.chi2, b.chi2);
            let top = b.gradient.iter().fold(0.0_f64, |t, v| t.max(v.abs()));
            assert!(a.gradient.iter().zip(&b.gradient).all(|(a, b)| (a - b).abs() < 1e-7 * top));
            assert!(passes.predict(image.view()).is_err());
        }
    }
}

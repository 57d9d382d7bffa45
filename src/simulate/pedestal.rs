//! The pedestal: a constant brightness temperature that is subtracted from the scene before the transform.
//!
//! An interferometer does not measure the zero spacing, so a warm background only adds the side lobes of a bright square. The header records the
//! constant, and the images add it back. Elements with a pattern see no such square: the pattern ends their field, and a constant that is taken
//! away before the pattern leaves visibilities that no instrument measures. Nothing is subtracted then, unless a temperature is given. Nor is it where
//! autocorrelations measure the total power of the whole scene.

use super::dft::n_minus_1;
use super::sky::{SkyModel, holds_intensity};
use crate::Result;
use crate::values::need;
use cittert_arrays::quantity::Temperature;
use cittert_arrays::{BrightnessUnit, Image, VisUnit};

/// The constant that is subtracted from a scene in kelvin.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Pedestal {
    /// The mean of the scene if its background is warm and the elements have no pattern, otherwise nothing.
    #[default]
    Auto,
    /// Nothing.
    None,
    /// This temperature.
    Kelvin(Temperature),
}

/// A background is warm if nine tenths of the frame are above this fraction of the mean.
const WARM: f64 = 0.1;

/// The constant that is subtracted, and the one that suits the scene.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Chosen {
    /// The constant that is subtracted, K.
    pub(crate) pedestal_k: Option<f64>,
    /// The mean of the scene if its background is warm and the elements have no pattern, otherwise 0, K. `None` if the scene is not an image in kelvin.
    pub(crate) scene_pedestal_k: Option<f64>,
}

/// The constant to subtract, if any. `whole` is true where the elements have a pattern or total power is measured, which need the whole scene.
///
/// # Errors
/// The temperature is not finite, or a temperature is given but the scene or the set is not in kelvin.
pub(crate) fn choose(choice: Pedestal, sky: &SkyModel, unit: VisUnit, whole: bool) -> Result<Chosen> {
    let warm: Vec<&Image> = sky.images.iter().filter(|i| i.unit == BrightnessUnit::Kelvin).collect();
    let fits = unit == VisUnit::KelvinSr && warm.len() == 1;
    let mean = warm.first().filter(|_| fits && !whole).and_then(|image| mean_if_warm(image));
    let scene_pedestal_k = fits.then(|| mean.unwrap_or(0.0));
    let pedestal_k = match choice {
        Pedestal::None => None,
        Pedestal::Kelvin(t) => {
            need("pedestal", t, t.si().is_finite(), "a finite temperature, auto or none")?;
            need("pedestal", t, fits, "none, unless one scene image in K is observed in K sr")?;
            Some(t.si())
        }
        Pedestal::Auto => mean,
    };
    Ok(Chosen { pedestal_k, scene_pedestal_k })
}

/// Mean over the frame with the weights 1 / n. The zero spacing of the rest of the scene is then 0.
fn mean_if_warm(image: &Image) -> Option<f64> {
    let pol = image.polarizations.iter().position(|p| holds_intensity(*p))?;
    let (mut sum, mut weight, mut values) = (0.0, 0.0, Vec::with_capacity(image.grid.n_l * image.grid.n_m));
    for chan in 0..image.spectrum.n_chan() {
        values.clear();
        for ((row, column), t) in image.plane(chan, pol).indexed_iter() {
            let (l, m) = (image.grid.l_at(column as f64), image.grid.m_at(row as f64));
            if let Some(n) = n_minus_1(l, m).map(|x| x + 1.0).filter(|n| *n > 0.0) {
                let w = 1.0 / n;
                sum += w * t;
                weight += w;
                values.push(*t);
            }
        }
    }
    let mean = sum / weight;
    let tenth = values.len() / 10;
    let (_, low, _) = (tenth < values.len()).then(|| values.select_nth_unstable_by(tenth, f64::total_cmp))?;
    (mean > 0.0 && *low > WARM * mean).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Polarization, SkyFrame, SkyGrid, SpectralWindow};
    use ndarray::Array4;

    fn scene(background: f64) -> SkyModel {
        let grid = SkyGrid::new(8, 8, 1e-3, SkyFrame::Boresight).unwrap();
        let mut data = Array4::from_elem((1, 1, 8, 8), background);
        data[[0, 0, 3, 3]] = background + 64.0;
        let spectrum = SpectralWindow::band(94e9, 1e9, 1).unwrap();
        SkyModel::of_image(Image::new(grid, spectrum, vec![Polarization::I], data, BrightnessUnit::Kelvin).unwrap())
    }

    #[test]
    fn a_warm_background_gives_its_mean_and_a_cold_one_nothing() {
        let both = |choice, sky: &SkyModel, unit| choose(choice, sky, unit, false);
        let go = |choice, sky: &SkyModel, unit| both(choice, sky, unit).map(|c| c.pedestal_k);
        let t = go(Pedestal::Auto, &scene(250.0), VisUnit::KelvinSr).unwrap().unwrap();
        assert!((t - 251.0).abs() < 1e-3, "{t}");
        for choice in [Pedestal::Auto, Pedestal::None, Pedestal::Kelvin(Temperature(90.0))] {
            assert_eq!(both(choice, &scene(250.0), VisUnit::KelvinSr).unwrap().scene_pedestal_k, Some(t), "{choice:?}");
        }
        assert_eq!(both(Pedestal::Auto, &scene(0.0), VisUnit::KelvinSr).unwrap(), Chosen { pedestal_k: None, scene_pedestal_k: Some(0.0) });
        assert_eq!(both(Pedestal::Auto, &scene(250.0), VisUnit::Jy).unwrap(), Chosen::default());
        assert_eq!(go(Pedestal::Auto, &scene(0.0), VisUnit::KelvinSr).unwrap(), None);
        assert_eq!(go(Pedestal::Auto, &scene(250.0), VisUnit::Jy).unwrap(), None);
        assert_eq!(go(Pedestal::None, &scene(250.0), VisUnit::KelvinSr).unwrap(), None);
        assert_eq!(go(Pedestal::Kelvin(Temperature(200.0)), &scene(250.0), VisUnit::KelvinSr).unwrap(), Some(200.0));
        assert!(go(Pedestal::Kelvin(Temperature(200.0)), &scene(250.0), VisUnit::Jy).is_err());
        let seen = choose(Pedestal::Auto, &scene(250.0), VisUnit::KelvinSr, true).unwrap();
        assert_eq!(seen, Chosen { pedestal_k: None, scene_pedestal_k: Some(0.0) }, "nothing is subtracted before a pattern");
        assert!(go(Pedestal::Kelvin(Temperature(f64::NAN)), &scene(250.0), VisUnit::KelvinSr).is_err());
    }
}

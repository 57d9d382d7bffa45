//! Enhancement of images with their grid and unit.

use super::chain::StepList;
use super::psf::Psf;
use super::step::Setting;
use crate::memory::{ImageWork, check_images};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{BrightnessUnit, Image, SkyGrid};
use ndarray::{Array4, s};

/// One image from frames of one scene. Every plane of channel and polarisation goes through the steps. The unit stays; upsampling divides Jy/pixel
/// by the number of new pixels, so that the total flux stays too.
///
/// # Errors
/// No image, images on several grids or in several units, blank pixels, an image that becomes too large, or an error of a step.
pub fn enhance(images: &[Image], steps: &StepList, psf: Option<&Psf>) -> Result<Image> {
    let Some((first, others)) = images.split_first() else { return Err(ChainError::NoData("there is no image to enhance".into())) };
    for other in others {
        let alike = other.grid == first.grid && other.unit == first.unit && other.data.dim() == first.data.dim();
        ensure!(
            alike,
            ChainError::Incompatible(format!(
                "the frames differ: {} and {}. Frames of one scene have one grid, one unit and the same channels",
                told(first),
                told(other)
            ))
        );
    }
    let grid = &first.grid;
    let chain = steps.chain(&Setting { unit: first.unit, cell_rad: grid.cell_rad, psf })?;
    let factor = chain.factor();
    let (n_l, n_m) = (grid.n_l * factor, grid.n_m * factor);
    let larger = SkyGrid::new(n_l, n_m, grid.cell_rad / factor as f64, grid.frame.clone())?;
    check_images((n_l, n_m), ImageWork::Clean)?;
    let (channels, pols, ..) = first.data.dim();
    let mut data = Array4::zeros((channels, pols, n_m, n_l));
    let share = if first.unit == BrightnessUnit::JyPerPixel { 1.0 / (factor * factor) as f64 } else { 1.0 };
    for (chan, pol) in (0..channels).flat_map(|chan| (0..pols).map(move |pol| (chan, pol))) {
        let out = chain.apply(images.iter().map(|image| image.plane(chan, pol).to_owned()).collect())?;
        data.slice_mut(s![chan, pol, .., ..]).assign(&(out * share));
    }
    let mut out = Image::new(larger, first.spectrum.clone(), first.polarizations.clone(), data, first.unit)?;
    (out.beams, out.object, out.telescope) = (first.beams.clone(), first.object.clone(), first.telescope.clone());
    (out.time_jd, out.pedestal_k, out.history) = (first.time_jd, first.pedestal_k, first.history.clone());
    out.pattern.clone_from(&first.pattern);
    out.seen_through.clone_from(&first.seen_through);
    Ok(out)
}

fn told(image: &Image) -> String {
    let (channels, pols, ..) = image.data.dim();
    let (grid, unit) = (&image.grid, image.unit.bunit());
    format!("{} x {} pixels of {:.6e} rad in {unit:?} with {} planes", grid.n_l, grid.n_m, grid.cell_rad, channels * pols)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;
    use cittert_arrays::{Polarization, SkyFrame, SpectralWindow};
    use ndarray::Axis;

    fn image(n: usize, seed: u64, unit: BrightnessUnit) -> Image {
        let grid = SkyGrid::new(n, n, 1e-3, SkyFrame::Boresight).unwrap();
        let data = (noise(n, n, seed) + 280.0).insert_axis(Axis(0)).insert_axis(Axis(0));
        Image::new(grid, SpectralWindow::band(94e9, 1e9, 1).unwrap(), vec![Polarization::I], data, unit).unwrap()
    }

    fn steps(text: &str) -> StepList {
        text.parse().unwrap()
    }

    #[test]
    fn upsampling_keeps_the_field_the_mean_and_the_flux() {
        for (unit, share) in [(BrightnessUnit::Kelvin, 1.0), (BrightnessUnit::JyPerPixel, 9.0)] {
            let before = image(32, 1, unit);
            let after = enhance(std::slice::from_ref(&before), &steps("bicubic=3"), None).unwrap();
            assert_eq!((after.grid.n_l, after.unit), (96, unit));
            assert!((after.grid.cell_rad - 1e-3 / 3.0).abs() < 1e-18);
            // The reference pixel of both grids is the same direction, and the same brightness.
            assert_eq!((after.grid.l_at(48.0), before.grid.l_at(16.0)), (0.0, 0.0));
            assert!((after.plane(0, 0)[[48, 48]] * share - before.plane(0, 0)[[16, 16]]).abs() < 1e-9);
        }
    }

    #[test]
    fn frames_are_averaged_where_the_chain_says_so_and_refused_otherwise() {
        let frames = [image(16, 1, BrightnessUnit::Kelvin), image(16, 2, BrightnessUnit::Kelvin)];
        let out = enhance(&frames, &steps("median=3,average"), None).unwrap();
        assert_eq!(out.data.dim(), (1, 1, 16, 16));
        let message = |frames: &[Image], text: &str| enhance(frames, &steps(text), None).unwrap_err().to_string();
        assert!(message(&frames, "median=3").contains("2 frames are left") && message(&frames, "median=3").contains("average"));
        let mixed = [image(16, 1, BrightnessUnit::Kelvin), image(20, 2, BrightnessUnit::Kelvin)];
        assert!(message(&mixed, "average").contains("16 x 16 pixels"));
        let mut blank = image(16, 1, BrightnessUnit::Kelvin);
        blank.plane_mut(0, 0)[[3, 4]] = f64::NAN;
        assert!(message(&[blank], "clahe").contains("1 of 256 pixels are blank"));
    }

    #[test]
    fn levels_need_the_unit_of_the_image() {
        let message = |unit, text: &str| enhance(&[image(16, 1, unit)], &steps(text), None).unwrap_err().to_string();
        assert!(message(BrightnessUnit::Kelvin, "tv=0.5").contains("0.5K"), "{}", message(BrightnessUnit::Kelvin, "tv=0.5"));
        assert!(message(BrightnessUnit::JyPerBeam, "tv=0.5K").contains("flux density"));
        assert!(message(BrightnessUnit::Kelvin, "bandpass=290K:280K").contains("low limit"));
        assert!(message(BrightnessUnit::Kelvin, "richardson-lucy").contains("PSF"));
        assert!(enhance(&[image(16, 1, BrightnessUnit::One)], &steps("tv=0.5"), None).is_ok());
        let psf = Psf::new(noise(5, 5, 3).mapv(f64::abs).view(), 1e-3).unwrap();
        // After an upsampling, the PSF must have the smaller cell.
        let late = enhance(&[image(16, 1, BrightnessUnit::Kelvin)], &steps("bilinear=2,richardson-lucy=3"), Some(&psf));
        assert!(late.unwrap_err().to_string().contains("cells of"));
        assert!(enhance(&[image(16, 1, BrightnessUnit::Kelvin)], &steps("richardson-lucy=3,bilinear=2"), Some(&psf)).is_ok());
    }
}

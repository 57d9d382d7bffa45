//! Brings an image and its truth onto the same grid, unit and beam, and compares them.

use super::alignment::check_alignment;
use super::convolve::convolve;
use super::region::Region;
use super::regrid::regrid;
use super::resolution::{missing, smooth};
use super::scores::{Fidelity, compare_planes_through};
use super::shift::{find_shift, shifted};
use crate::{ChainError, Result};
use cittert_arrays::{BrightnessUnit, Image, RestoringBeam, SkyGrid, jy_per_kelvin_sr};
use ndarray::{Array2, ArrayView2};
use std::borrow::Cow;

/// A pixel is blank after a smoothing or a shift if blank pixels have more than this share of its weight.
const MOST_BLANK: f64 = 0.01;

/// The field of view of elements with a pattern ends where their power is half of that in the middle.
const FIELD: f64 = 0.5;

/// Options of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CompareOptions {
    /// The pixels that are compared.
    pub region: Region,
    /// Convolve the truth with this beam first. The brightness of a uniform sky does not change.
    pub beam: Option<RestoringBeam>,
    /// Bring image and truth to a round Gaussian beam of this full width at half maximum first, rad: the image from its restoring beam, where it has
    /// one, and the truth from its pixels. The truth is then not convolved with `beam`.
    pub resolution_rad: Option<f64>,
    /// Shift the image onto the truth first.
    pub shift: bool,
}

/// An image and its truth on the same grid, how they got there, and the scores of the image.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The scores.
    pub scores: Fidelity,
    /// The image \[m, l\].
    pub image: Array2<f64>,
    /// The truth on the grid and in the unit of the image \[m, l\].
    pub truth: Array2<f64>,
    /// The grid that the truth had, if it was another one.
    pub regridded_from: Option<SkyGrid>,
    /// The unit that the truth had, if it was converted.
    pub converted_from: Option<BrightnessUnit>,
    /// The shift (l, m) of the image in rad, if it was asked for.
    pub shift_rad: Option<(f64, f64)>,
    /// Which of the two was multiplied by the pattern of the elements that the other one contains.
    pub dimmed: Option<Dimmed>,
    /// The scores where the elements see at least half of the power, if image or truth name their pattern and the region has pixels on both sides of that limit.
    pub field: Option<Field>,
    /// Number of pixels of the region that are left out, because the image or the truth has no value there.
    pub n_blank: usize,
    /// Number of pixels that are compared.
    pub n_compared: usize,
}

/// The pixels where the power pattern of the elements is at least half.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Field {
    /// Their scores. `peak_over_robust_rms` is that of the whole image.
    pub scores: Fidelity,
    /// Their number.
    pub n_compared: usize,
}

/// Compare the first plane of an image with the first plane of its truth, on the grid and in the unit of the image.
///
/// # Errors
/// One image has a place on the sky and the other has none. A unit that can only be converted with a beam or a frequency that an image lacks.
/// No pixel with a value in both, or a truth that is zero everywhere.
pub fn compare(image: &Image, truth: &Image, options: &CompareOptions) -> Result<Comparison> {
    let dimmed = Dimmed::of(image, truth);
    let (image_seen, truth_seen) = seen(image, truth, dimmed);
    let (image, truth) = (image_seen.as_ref(), truth_seen.as_ref());
    let grid = &image.grid;
    let mut region = options.region.mask(grid.n_m, grid.n_l)?;
    let mut expected = match (options.resolution_rad, options.beam) {
        (Some(fwhm), _) => {
            let beam = missing(None, fwhm, truth.grid.cell_rad)?;
            keeping_blanks(truth.plane(0, 0), |plane| smooth(plane, &truth.grid, &beam))?
        }
        (None, Some(beam)) => keeping_blanks(truth.plane(0, 0), |plane| convolve(plane, &truth.grid, &beam))?,
        (None, None) => truth.plane(0, 0).to_owned(),
    };
    let factor = conversion(truth, image)?;
    if factor != 1.0 {
        expected *= factor;
    }
    let other_grid = check_alignment(grid, &truth.grid).is_err();
    if other_grid {
        expected = regrid(expected.view(), &truth.grid, grid)?;
    }
    let (mut found, mut shift_rad) = (image.plane(0, 0).to_owned(), None);
    if let Some(fwhm) = options.resolution_rad {
        let beam = missing(image.beams.first(), fwhm, grid.cell_rad)?;
        found = keeping_blanks(found.view(), |plane| smooth(plane, grid, &beam))?;
    }
    if options.shift {
        let by = find_shift(without_blanks(found.view()).view(), without_blanks(expected.view()).view())?;
        found = keeping_blanks(found.view(), |plane| Ok(shifted(plane, by)))?;
        shift_rad = Some((grid.l_at(by.1) - grid.l_at(0.0), grid.m_at(by.0) - grid.m_at(0.0)));
    }
    let pattern = if image.pattern.is_none() { &truth.pattern } else { &image.pattern };
    let power = (!pattern.is_none()).then(|| pattern.plane(grid, image.spectrum.mean_hz()));
    let inside = region.iter().filter(|on| **on).count();
    ndarray::Zip::from(&mut region).and(&found).and(&expected).for_each(|on, i, t| *on &= i.is_finite() && t.is_finite());
    let n_compared = region.iter().filter(|on| **on).count();
    let scores_in = |region: &Array2<bool>| compare_planes_through(found.view(), expected.view(), power.as_ref().map(|p| p.view()), region);
    let scores = scores_in(&region)?;
    let mut field = None;
    // An image of brightness shows nothing where the elements saw nothing, although it does not contain their pattern.
    let patterns = [&image.pattern, &truth.pattern, &image.seen_through, &truth.seen_through];
    if let Some(pattern) = patterns.into_iter().find(|pattern| !pattern.is_none()) {
        let power = pattern.plane(grid, image.spectrum.mean_hz());
        let seen = ndarray::Zip::from(&region).and(&power).map_collect(|on, a| *on && *a >= FIELD);
        let n_seen = seen.iter().filter(|on| **on).count();
        if n_seen > 0 && n_seen < n_compared {
            // A truth that is zero in the whole field has no relative error there.
            field = scores_in(&seen).ok().map(|scores| Field { scores, n_compared: n_seen });
        }
    }
    Ok(Comparison {
        scores,
        field,
        image: found,
        truth: expected,
        regridded_from: other_grid.then(|| truth.grid.clone()),
        converted_from: (truth.unit != image.unit && convertible(truth.unit) && convertible(image.unit)).then_some(truth.unit),
        shift_rad,
        dimmed,
        n_blank: inside - n_compared,
        n_compared,
    })
}

/// The one of two images that was multiplied by the pattern of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimmed {
    /// The image.
    Image,
    /// The truth.
    Truth,
}

impl Dimmed {
    fn of(image: &Image, truth: &Image) -> Option<Self> {
        match (image.pattern.is_none(), truth.pattern.is_none()) {
            (false, true) => Some(Self::Truth),
            (true, false) => Some(Self::Image),
            _ => None,
        }
    }
}

/// Image and truth as the elements see both, if they see one of them.
fn seen<'a>(image: &'a Image, truth: &'a Image, dimmed: Option<Dimmed>) -> (Cow<'a, Image>, Cow<'a, Image>) {
    let through = |one: &Image, other: &Image| {
        let mut out = one.clone();
        let power = other.pattern.plane(&one.grid, other.spectrum.mean_hz());
        out.data.indexed_iter_mut().for_each(|((_, _, row, column), v)| *v *= power[(row, column)]);
        Cow::Owned(out)
    };
    match dimmed {
        None => (Cow::Borrowed(image), Cow::Borrowed(truth)),
        Some(Dimmed::Image) => (through(image, truth), Cow::Borrowed(truth)),
        Some(Dimmed::Truth) => (Cow::Borrowed(image), through(truth, image)),
    }
}

/// True for units of brightness, which can be converted into each other.
fn convertible(unit: BrightnessUnit) -> bool {
    use BrightnessUnit::{JyPerBeam, JyPerPixel, Kelvin};
    matches!(unit, JyPerBeam | JyPerPixel | Kelvin)
}

/// The factor from the numbers of one image to those of another. It is 1 where a unit is not one of brightness.
fn conversion(from: &Image, to: &Image) -> Result<f64> {
    let same = from.unit == to.unit && from.unit != BrightnessUnit::JyPerPixel;
    if same || !convertible(from.unit) || !convertible(to.unit) {
        return Ok(1.0);
    }
    Ok(jy_per_sr(from, to)? / jy_per_sr(to, from)?)
}

/// Brightness in Jy/sr of the number 1 in the unit of an image.
fn jy_per_sr(image: &Image, other: &Image) -> Result<f64> {
    let lacks = |what: &str| {
        Err(ChainError::Incompatible(format!(
            "one image is in {} and the other in {}: the conversion needs {what}",
            image.unit.bunit(),
            other.unit.bunit()
        )))
    };
    match (image.unit, image.beams.first(), image.spectrum.freq_hz().first()) {
        (BrightnessUnit::JyPerBeam, Some(beam), _) => Ok(1.0 / beam.solid_angle_sr()),
        (BrightnessUnit::JyPerBeam, None, _) => lacks("the restoring beam of the image in Jy/beam (BMAJ, BMIN, BPA)"),
        // An image whose file states no frequency has the placeholder 1 Hz.
        (BrightnessUnit::Kelvin, _, Some(freq)) if *freq > 1.0 => Ok(jy_per_kelvin_sr(*freq)),
        (BrightnessUnit::Kelvin, ..) => lacks("the frequency of the image in K"),
        _ => Ok(1.0 / image.grid.cell_sr()),
    }
}

/// A plane with the mean of its values in place of blank pixels.
fn without_blanks(plane: ArrayView2<'_, f64>) -> Array2<f64> {
    let (n, sum) = plane.iter().filter(|v| v.is_finite()).fold((0_u64, 0.0), |(n, s), v| (n + 1, s + v));
    let mean = if n == 0 { 0.0 } else { sum / n as f64 };
    plane.mapv(|v| if v.is_finite() { v } else { mean })
}

/// Do linear work on a plane with its mean in place of blank pixels, and blank the pixels that they have reached.
fn keeping_blanks(plane: ArrayView2<'_, f64>, work: impl Fn(ArrayView2<'_, f64>) -> Result<Array2<f64>>) -> Result<Array2<f64>> {
    let blank = plane.mapv(|v| if v.is_finite() { 0.0 } else { 1.0 });
    if blank.iter().all(|v| *v == 0.0) {
        return work(plane);
    }
    let mut out = work(without_blanks(plane).view())?;
    ndarray::Zip::from(&mut out).and(&work(blank.view())?).for_each(|v, share| {
        if share.abs() > MOST_BLANK {
            *v = f64::NAN;
        }
    });
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Polarization, SkyFrame, SpectralWindow};

    const CELL: f64 = 1e-5;

    fn image(n: usize, ra_rad: f64, unit: BrightnessUnit, value: impl Fn(f64, f64) -> f64) -> Image {
        let grid = SkyGrid::new(n, n, CELL, SkyFrame::Sky { ra_rad, dec_rad: 0.3, frame: "icrs".into() }).unwrap();
        let data = ndarray::Array4::from_shape_fn((1, 1, n, n), |(_, _, r, c)| value(grid.l_at(c as f64), grid.m_at(r as f64)));
        let spectrum = SpectralWindow::band(8e9, 1e8, 1).unwrap();
        Image::new(grid, spectrum, vec![Polarization::I], data, unit).unwrap()
    }

    fn blob(l: f64, m: f64) -> f64 {
        0.1 + (-(l * l + m * m) / (2.0 * 9.0 * CELL * CELL)).exp()
    }

    #[test]
    fn a_centre_a_thirtieth_of_a_pixel_away_is_regridded() {
        let by = CELL / 30.0;
        let a = image(64, 1.0, BrightnessUnit::JyPerBeam, blob);
        let b = image(48, 1.0 + by / 0.3_f64.cos(), BrightnessUnit::JyPerBeam, |l, m| blob(l + by, m));
        let found = compare(&a, &b, &CompareOptions::default()).unwrap();
        assert!(found.scores.error_over_grey_card < 1e-3, "{:?}", found.scores);
        assert_eq!(found.regridded_from.as_ref().map(|g| g.n_l), Some(48));
        // The smaller image lacks 8 pixels on each side, and the kernel reaches over its edge in at most three more.
        assert!(found.n_compared >= 42 * 42 && found.n_compared <= 48 * 48, "{}", found.n_compared);
        assert_eq!(found.n_compared + found.n_blank, 64 * 64);
    }

    #[test]
    fn an_image_that_contains_a_pattern_is_compared_with_what_the_elements_see() {
        let scene = image(32, 1.0, BrightnessUnit::Kelvin, blob);
        let mut seen = scene.clone();
        seen.pattern =
            cittert_arrays::ElementPattern::Gaussian(cittert_arrays::pattern::Gaussian { fwhm_rad: 20.0 * CELL, ref_freq_hz: None });
        let power = seen.pattern.plane(&seen.grid, 8e9);
        seen.data.indexed_iter_mut().for_each(|((_, _, r, c), v)| *v *= power[(r, c)]);
        for (image, truth, dimmed) in [(&seen, &scene, Dimmed::Truth), (&scene, &seen, Dimmed::Image)] {
            let found = compare(image, truth, &CompareOptions::default()).unwrap();
            assert!(found.scores.nrmse < 1e-12 && found.dimmed == Some(dimmed), "{:?}", found.scores);
        }
        assert_eq!(compare(&seen, &seen, &CompareOptions::default()).unwrap().dimmed, None);
    }

    #[test]
    fn the_field_of_the_elements_has_scores_of_its_own() {
        let mut truth = image(64, 1.0, BrightnessUnit::Kelvin, |_, _| 100.0);
        truth.pattern =
            cittert_arrays::ElementPattern::Gaussian(cittert_arrays::pattern::Gaussian { fwhm_rad: 21.0 * CELL, ref_freq_hz: None });
        let power = truth.pattern.plane(&truth.grid, 8e9);
        truth.data.indexed_iter_mut().for_each(|((_, _, r, c), v)| *v *= power[(r, c)]);
        // An error of 1 K where the elements see half of the power, and of 80 K where they see nothing.
        let mut found = truth.clone();
        found.data.indexed_iter_mut().for_each(|((_, _, r, c), v)| *v += if power[(r, c)] >= 0.5 { 1.0 } else { 80.0 });
        let all = compare(&found, &truth, &CompareOptions::default()).unwrap();
        let field = all.field.unwrap();
        // A circle with a radius of 10.5 pixels.
        assert!((field.n_compared as f64 / (10.5_f64.powi(2) * std::f64::consts::PI) - 1.0).abs() < 0.02, "{}", field.n_compared);
        assert!((field.scores.rms_difference - 1.0).abs() < 1e-9 && field.scores.nrmse < 0.014, "{:?}", field.scores);
        assert!(all.scores.nrmse > 2.0 && all.n_compared == 64 * 64, "{:?}", all.scores);
        // An image of brightness that was seen through the pattern says so.
        let scene = image(64, 1.0, BrightnessUnit::Kelvin, |_, _| 100.0);
        let mut guessed = image(64, 1.0, BrightnessUnit::Kelvin, |_, _| 101.0);
        assert_eq!(compare(&guessed, &scene, &CompareOptions::default()).unwrap().field, None);
        guessed.seen_through.clone_from(&truth.pattern);
        guessed.data.indexed_iter_mut().filter(|((_, _, r, c), _)| power[(*r, *c)] < 0.5).for_each(|(_, v)| *v = 0.0);
        let all = compare(&guessed, &scene, &CompareOptions::default()).unwrap();
        assert!((all.field.unwrap().scores.nrmse - 0.01).abs() < 1e-12 && all.scores.nrmse > 0.9 && all.dimmed.is_none(), "{all:?}");
        // Inside a disc that the elements see as a whole, and without a pattern, there is no second table.
        let inner = CompareOptions { region: Region::Disc { radius: 0.1 }, ..CompareOptions::default() };
        assert_eq!(compare(&found, &truth, &inner).unwrap().field, None);
        let plain = image(64, 1.0, BrightnessUnit::Kelvin, blob);
        assert_eq!(compare(&plain, &plain, &CompareOptions::default()).unwrap().field, None);
    }

    #[test]
    fn units_of_brightness_are_converted() {
        let beam = RestoringBeam { bmaj_rad: 4.0 * CELL, bmin_rad: 3.0 * CELL, bpa_rad: 0.2 };
        let kelvin = image(32, 1.0, BrightnessUnit::Kelvin, blob);
        let per_sr = jy_per_kelvin_sr(8e9);
        let per_pixel = image(32, 1.0, BrightnessUnit::JyPerPixel, |l, m| blob(l, m) * per_sr * CELL * CELL);
        let mut per_beam = image(32, 1.0, BrightnessUnit::JyPerBeam, |l, m| blob(l, m) * per_sr * beam.solid_angle_sr());
        let e = compare(&kelvin, &per_beam, &CompareOptions::default()).unwrap_err().to_string();
        assert!(e.contains("Jy/beam") && e.contains("BMAJ") && !e.contains("JyPerBeam"), "{e}");
        per_beam.beams.push(beam);
        for (image, truth) in [(&kelvin, &per_pixel), (&kelvin, &per_beam), (&per_beam, &per_pixel), (&per_pixel, &kelvin)] {
            let found = compare(image, truth, &CompareOptions::default()).unwrap();
            assert!(found.scores.nrmse < 1e-12 && found.converted_from == Some(truth.unit), "{:?}", found.scores);
        }
    }

    #[test]
    fn blank_borders_are_left_out_of_every_step() {
        let mut a = image(64, 1.0, BrightnessUnit::Kelvin, blob);
        let clean = a.clone();
        a.data.indexed_iter_mut().filter(|((_, _, r, c), _)| r.min(c) < &6 || r.max(c) >= &58).for_each(|(_, v)| *v = f64::NAN);
        let beam = Some(RestoringBeam { bmaj_rad: 4.0 * CELL, bmin_rad: 3.0 * CELL, bpa_rad: 0.2 });
        let found = compare(&a, &clean, &CompareOptions { shift: true, ..CompareOptions::default() }).unwrap();
        let (l, m) = found.shift_rad.unwrap();
        assert!(found.n_blank >= 64 * 64 - 52 * 52 && l.hypot(m) < 0.02 * CELL, "{} {l} {m}", found.n_blank);
        assert!(found.scores.error_over_grey_card < 0.01, "{:?}", found.scores);
        // As the truth, a blank border also blanks the pixels within the beam.
        let sharp = compare(&clean, &a, &CompareOptions::default()).unwrap();
        let smooth = compare(&clean, &a, &CompareOptions { beam, ..CompareOptions::default() }).unwrap();
        assert_eq!(sharp.n_blank, 64 * 64 - 52 * 52);
        assert!(smooth.n_blank > sharp.n_blank && smooth.n_compared > 40 * 40, "{}", smooth.n_blank);
    }
}

//! `dirty`: the dirty image.

use super::context::{Context, Outcome};
use super::failure::Result;
use super::forecast::{Plan, Planner, Told};
use super::options::ImageOfArgs;
use super::text::{angle, number};
use super::zero_spacing;
use crate::cost::{self, WavePasses};
use crate::fidelity::robust_rms;
use crate::imaging::{CorrectionOptions, Imager, ImagingOptions, dirty_image};
use crate::progress::Observer;
use cittert_arrays::VisibilitySource;
use clap::Args;
use ndarray::{ArrayView1, ArrayView2, Axis};
use rayon::prelude::*;
use serde_json::json;
use std::borrow::Cow;
use std::path::Path;

/// Options of `dirty`.
#[derive(Debug, Args)]
pub struct DirtyArgs {
    #[command(flatten)]
    of: ImageOfArgs,
    #[command(flatten)]
    correction: CorrectionOptions,
}

/// Make the dirty image and write it as FITS.
///
/// # Errors
/// The file or an option is wrong, or an error of the file system.
pub fn run(args: &DirtyArgs, context: &Context) -> Result<Outcome> {
    let (mut image, counts, mean) = args.of.imaged_once("imaging", context, |imager| {
        args.correction.check(&imager.header().layout.pattern)?;
        let mean = zero_spacing::of(imager, false, context);
        Ok((dirty_image(imager, true, &context.console)?, imager.survey().counts, mean))
    })?;
    let mut corrected = args.correction.pbcor.then(|| args.correction.corrected(&image));
    corrected.as_mut().unwrap_or(&mut image).history.push(context.history());
    let (out, to_write) = (&args.of.out, corrected.as_ref().unwrap_or(&image));
    let path = out.output.as_path();
    // One thread waits for the system while the file is written. The others look at the pixels.
    let (written, Pixels { peak, rms, robust_rms }) = rayon::join(|| out.signed_image(path, to_write), || Pixels::of(image.plane(0, 0)));
    written?;
    let g = &image.grid;
    let json = json!({
        "output": path, "size": [g.n_l, g.n_m], "cell_rad": g.cell_rad, "unit": image.unit.bunit(),
        "peak": peak, "rms": rms, "robust_rms": robust_rms,
        "n_visibilities": counts.total, "n_used": counts.used, "n_flagged": counts.flagged,
        "n_bad_weight": counts.bad_weight, "n_not_finite": counts.not_finite, "n_autocorrelations": counts.autocorrelations, "mean": mean,
    });
    let text = format!(
        "{}: {} x {} pixels of {}, peak {} {}, rms {}",
        path.display(),
        g.n_l,
        g.n_m,
        angle(g.cell_rad),
        number(peak),
        image.unit.bunit(),
        number(rms)
    );
    Ok(Outcome::new(json, text).wrote(path))
}

/// What is told of the pixels of an image.
struct Pixels {
    /// The value that is farthest from 0.
    peak: f64,
    rms: f64,
    robust_rms: f64,
}

impl Pixels {
    fn of(plane: ArrayView2<'_, f32>) -> Self {
        let lines: Vec<(f32, f64)> = plane.axis_iter(Axis(0)).into_par_iter().map(peak_and_squares).collect();
        let peak = lines.iter().map(|l| l.0).fold(0.0, farther).into();
        Self { peak, rms: (lines.iter().map(|l| l.1).sum::<f64>() / plane.len() as f64).sqrt(), robust_rms: robust_rms(plane) }
    }
}

/// The value that is farther from 0.
fn farther(a: f32, b: f32) -> f32 {
    if b.abs() > a.abs() { b } else { a }
}

/// The value of a line of an image that is farthest from 0, and the sum of the squares. Several values are looked at together, because each would wait
/// for the one before.
fn peak_and_squares(line: ArrayView1<'_, f32>) -> (f32, f64) {
    const LANES: usize = 16;
    let line = line.to_slice().map_or_else(|| Cow::Owned(line.to_vec()), Cow::Borrowed);
    let (whole, rest) = line.as_chunks::<LANES>();
    // Zeros change neither.
    let mut last = [0.0; LANES];
    last[..rest.len()].copy_from_slice(rest);
    let (mut low, mut high, mut squares) = ([0.0_f32; LANES], [0.0_f32; LANES], [0.0_f64; LANES]);
    for values in whole.iter().chain([&last]) {
        for (k, v) in values.iter().enumerate() {
            low[k] = low[k].min(*v);
            high[k] = high[k].max(*v);
            squares[k] += f64::from(*v).powi(2);
        }
    }
    (high.into_iter().chain(low).fold(0.0, farther), squares.iter().sum())
}

impl Plan for DirtyArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        let perform = |source: &mut dyn VisibilitySource, imaging: ImagingOptions, (path, watch): (&Path, &dyn Observer)| {
            let mut imager = Imager::of_one_image(source, imaging, watch)?;
            let image = dirty_image(&mut imager, true, watch)?;
            let (written, _) = rayon::join(|| self.of.out.signed_image(path, &image), || Pixels::of(image.plane(0, 0)));
            written
        };
        self.of.planned("dirty", planner, (cost::dirty, WavePasses::of_dirty), Some(&perform))
    }

    fn output(&self) -> &std::path::Path {
        &self.of.out.output
    }
}

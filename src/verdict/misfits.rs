//! What the residual visibilities say about a fit.

use super::finding::Finding;
use super::residuals::{OUTLIER, Residuals};

/// The square of the residuals, in terms of noise, above which an image does not explain the data. The limit allows for weights that are
/// wrong by a quarter and for the faint structure that a deconvolution to three times the noise of the image leaves.
const CHI2: f64 = 1.5;
/// Power beyond that of the noise that a deconvolution leaves at a very high signal to noise ratio, because pixels and components describe the sky
/// only so well. The image explains the amplitudes to 7 % then, and less noise would not make it better.
const LIMITED: f64 = 0.005;
/// Power that a fit may leave where the noise is not known.
const UNEXPLAINED: f64 = 0.05;
/// Fraction of samples that stand out by chance is nothing; so many point to interference or to damaged records.
const INTERFERENCE: f64 = 1e-3;
/// Power that interference leaves unexplained at least, where the noise is not known.
const DAMAGED: f64 = 0.01;
/// An antenna whose baselines typically fit worse than all others by this factor has something of its own that is wrong.
const ANTENNA: f64 = 2.5;
/// The square of the residuals above which antennas are compared, and a source outside the image is looked for.
const BEYOND_NOISE: f64 = 1.1;
/// More antennas than this fraction are no exception.
const FEW: f64 = 0.25;
/// Fraction of the flux on the shortest baselines that an image of a positive sky must hold at least.
const LEAST_FLUX: f64 = 0.8;
/// Factor by which a source is brighter at zero spacing than on the shortest baselines, above which the baselines miss much of it.
const MISSED: f64 = 1.5;

/// Errors of antennas are named where they explain at least this part of what the image leaves. Their samples may then stand out like interference. A source that
/// the image lacks looks like them in 0 to 4 % of snapshots of 6 antennas, and in none of 10 and more (400 random ones each).
const ERRORS: f64 = 0.6;
/// A spectral index is named where it explains at least this part of what the image leaves.
const SPECTRAL: f64 = 0.2;

/// Findings about the residuals of a fit. `antenna` names an antenna by its index. `flux` is the sum of the model over the image in the unit
/// of the data, where the zero spacing of the data is that of a positive sky.
#[must_use]
pub fn of_residuals(r: &Residuals, antenna: &dyn Fn(usize) -> String, flux: Option<f64>) -> Vec<Finding> {
    let mut all = Vec::new();
    let poor = if r.noise_known { r.mean > CHI2 && r.unexplained > LIMITED } else { r.unexplained > UNEXPLAINED };
    // Without noise a good fit leaves residuals that differ much from sample to sample, and all of them are small.
    let outliers = r.outliers > INTERFERENCE && (r.noise_known || r.unexplained > DAMAGED);
    let errors = (poor || outliers) && r.errors.share() > ERRORS;
    if errors {
        let (amplitudes, phases) = (r.errors.amplitudes, r.errors.phases);
        let says = format!(
            "{:.0} % of what the image leaves are errors of antennas: amplitudes that vary by {:.1} %, and phases by {:.1} deg",
            100.0 * r.errors.share().min(1.0),
            100.0 * amplitudes.sigma,
            phases.sigma.to_degrees()
        );
        all.push(if amplitudes.share > phases.share {
            let next = "solve for the amplitudes too: selfcal --mode amp-phase; if it solved for them, give a shorter --solint";
            Finding::new("amplitudes", says, next)
        } else {
            Finding::new("phases", says, "self-calibrate the visibilities; if they are self-calibrated, give a shorter --solint")
        });
    }
    if outliers && !errors {
        let says = format!(
            "{:.2} % of the visibilities lie more than {:.0} times as far from the model as the others of the same baselines: interference, or damaged \
             records",
            100.0 * r.outliers,
            OUTLIER.sqrt()
        );
        all.push(Finding::new("interference", says, "flag these visibilities, or solve with --outliers clip"));
    }
    let odd: Vec<&(usize, f64)> = r.antennas.iter().filter(|a| a.1 > ANTENNA).collect();
    let beyond = if r.noise_known { r.mean > BEYOND_NOISE } else { poor };
    if beyond && !odd.is_empty() && (odd.len() as f64) <= (FEW * r.antennas.len() as f64).max(2.0) {
        let names: Vec<String> = odd.iter().take(6).map(|a| antenna(a.0)).collect();
        let says = format!(
            "the baselines of {} fit {:.1} times worse than the others: their gains are wrong, or their names, positions or cables are swapped",
            names.join(", "),
            odd.iter().map(|a| a.1).fold(f64::INFINITY, f64::min)
        );
        all.push(Finding::new("antennas", says, "check these antennas, flag them, or self-calibrate"));
    }
    if poor {
        let says = if r.noise_known {
            format!(
                "the image leaves {:.3} times the power of the noise in the visibilities, 1 is expected: it leaves {:.2} % of the signal unexplained",
                r.mean,
                100.0 * r.unexplained
            )
        } else {
            format!("the image leaves {:.1} % of the power of the visibilities unexplained", 100.0 * r.unexplained)
        };
        let next = "for extended scenes use mem, or clean deeper; otherwise check the calibration, the size of the image and the coordinates (order of antennas, sign \
                    of u, v, w and of time)";
        all.push(Finding::new("chi_squared", says, next));
        all.extend(spectral(r).map(|says| Finding::new("spectrum", says, "image the band in parts, each with fluxes of its own")));
    }
    all.extend(flux.and_then(|flux| short_spacings(r, flux)));
    all
}

/// True if the residuals show more than noise and what pixels and components cannot describe, so that a source may be missing.
#[must_use]
pub fn something_is_left(r: &Residuals) -> bool {
    if r.noise_known { r.mean > BEYOND_NOISE && r.unexplained > LIMITED } else { r.unexplained > UNEXPLAINED }
}

/// What a good fit leaves of data with so little noise that pixels and components describe the sky less well than the data show it.
#[must_use]
pub fn left_beyond_noise(r: &Residuals) -> Option<String> {
    let beyond = r.noise_known && r.mean > CHI2;
    beyond.then(|| {
        let spectrum = spectral(r).map_or(String::new(), |says| format!("; {says}"));
        format!(
            "but for {:.2} % of their power: the residual has {:.1} times the power of the noise{spectrum}",
            100.0 * r.unexplained,
            r.mean
        )
    })
}

/// What a spectral index of the sources explains, and how many output channels leave less of it than the noise.
fn spectral(r: &Residuals) -> Option<String> {
    let s = r.spectrum;
    // Within an N-th of the band a spectrum leaves an N^2-th of the power.
    let left = s.share * (r.mean - if r.noise_known { 1.0 } else { 0.0 });
    let enough = if r.noise_known { (2.0 * left).sqrt().ceil() as usize } else { 4 };
    (s.share > SPECTRAL && s.channels > 1).then(|| {
        format!(
            "{:.0} % of what is left is the spectrum of the sources, whose index is about {:.1}: --channels-out {} images the band in parts",
            100.0 * s.share.min(1.0),
            s.index,
            enough.clamp(2, s.channels)
        )
    })
}

/// Flux that the array does not measure, or the image does not hold.
fn short_spacings(r: &Residuals, flux: f64) -> Option<Finding> {
    let (data, _) = r.shortest;
    let (length, all) = (r.decay.0, r.zero_spacing());
    // Where noise dominates the short baselines their amplitude says nothing.
    if !(r.signal > 1.0) {
        return None;
    }
    let missed = all / data;
    // A positive image of a compact source can hold the flux that its shortest baselines have lost.
    if missed > MISSED && flux < LEAST_FLUX * all {
        let says = format!(
            "the shortest baselines, {length:.0} wavelengths long, resolve the source already: from their decay its flux is about {missed:.1} times what they see, \
             and structure larger than {} is missing from the image",
            angle(0.6 / length)
        );
        return Some(Finding::new(
            "short_spacings",
            says,
            "add shorter spacings or the total power, or image with a smooth prior (mem --flux)",
        ));
    }
    (flux < LEAST_FLUX * data).then(|| {
        let says = format!(
            "the image holds a flux of {flux:.4}, and the shortest baselines see {data:.4}: it lacks {:.0} % of the source",
            100.0 * (1.0 - flux / data)
        );
        Finding::new("missing_flux", says, "clean deeper, with multiscale for extended emission, or use mem")
    })
}

pub(super) fn angle(rad: f64) -> String {
    match rad.to_degrees() {
        d if d >= 0.1 => format!("{d:.2} deg"),
        d if d >= 0.1 / 3600.0 => format!("{:.1} arcsec", d * 3600.0),
        d => format!("{:.1} uas", d * 3.6e9),
    }
}

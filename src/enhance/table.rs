//! The table of steps. A new step is a file beside this one and a row here: the help, the book and the shared tests follow.

use super::step::{Parameter, Range, StepKind};
use super::{average, band_limited, bandpass, bicubic, bilateral, bilinear, clahe, equalize, hybrid, lanczos, laplacian, median, nl_means};
use super::{richardson_lucy, sobel, total_variation, unsharp, wiener, wiener_deconvolution};

const fn parameter(name: &'static str, range: Range, default: Option<&'static str>, about: &'static str) -> Parameter {
    Parameter { name, range, default, about }
}

const WINDOW: Parameter = parameter("window", Range::Odd(3, 255), Some("3"), "width of the window, pixels");
const FACTOR: Parameter = parameter("factor", Range::Whole(2, 16), Some("2"), "pixels for each pixel along each axis");
const CLIP: Parameter = parameter("clip", Range::Real(1.0, 1000.0), Some("2"), "largest count in a bin over that of an even histogram");
const TILES: Parameter = parameter("tiles", Range::Whole(1, 64), Some("8"), "number of parts along each axis");
const BLUR: Parameter = parameter("sigma", Range::Real(0.3, 50.0), Some("1.5"), "standard deviation of the Gaussian, pixels");
const AMOUNT: Parameter = parameter("amount", Range::Real(0.0, 100.0), Some("0.8"), "multiple of the difference that is added");

const fn kind(
    name: &'static str,
    parameters: &'static [Parameter],
    make: fn(&super::step::Given<'_>) -> crate::Result<Box<dyn super::step::Step>>,
    about: &'static str,
    source: &'static str,
) -> StepKind {
    StepKind { name, parameters, about, source, needs_psf: false, make }
}

/// All steps.
pub const STEPS: &[StepKind] = &[
    kind("average", &[], average::make, "mean of several frames of one scene, pixel by pixel", "mean of independent measurements"),
    kind("median", &[WINDOW], median::make, "median over a square window", "Tukey 1977; Huang, Yang & Tang 1979"),
    kind(
        "wiener",
        &[WINDOW, parameter("noise", Range::PositiveLevel, Some(""), "standard deviation of the noise; from the image if left out")],
        wiener::make,
        "mean over a square window where it is as even as the noise, unchanged pixels at edges",
        "Lee 1980, as in SciPy",
    ),
    kind(
        "bilateral",
        &[
            parameter("sigma", Range::Real(0.3, 50.0), None, "standard deviation of the weights over the distance, pixels"),
            parameter("contrast", Range::PositiveLevel, None, "standard deviation of the weights over the difference in brightness"),
            parameter("window", Range::Odd(3, 255), Some(""), "width of the disc, pixels; 4 sigma if left out"),
        ],
        bilateral::make,
        "mean of near pixels of similar brightness",
        "Tomasi & Manduchi 1998, with the disc of OpenCV",
    ),
    kind(
        "nl-means",
        &[
            parameter("strength", Range::PositiveLevel, None, "difference of patches at which their weight is 1/e; about the noise"),
            parameter("patch", Range::Odd(3, 31), Some("5"), "width of a patch, pixels"),
            parameter("reach", Range::Whole(1, 50), Some("6"), "distance over which patches are looked for, pixels"),
            parameter(
                "noise",
                Range::PositiveLevel,
                Some(""),
                "standard deviation of the noise that the distances of patches contain; 0 if left out",
            ),
        ],
        nl_means::make,
        "mean of pixels whose surroundings look alike",
        "Buades, Coll & Morel 2005",
    ),
    kind(
        "tv",
        &[
            parameter("weight", Range::PositiveLevel, None, "weight of the total variation; about the noise"),
            parameter("iterations", Range::Whole(1, 10_000), Some("300"), "most iterations"),
        ],
        total_variation::make,
        "least total variation near the image: flat parts with sharp edges",
        "Rudin, Osher & Fatemi 1992; Chambolle 2004",
    ),
    kind("bilinear", &[FACTOR], bilinear::make, "upsampling on straight lines; no overshoot", "linear interpolation"),
    kind(
        "bicubic",
        &[FACTOR, parameter("slope", Range::Real(-1.0, 0.0), Some("-0.5"), "slope a of the kernel; OpenCV has -0.75")],
        bicubic::make,
        "upsampling by cubic convolution",
        "Keys 1981",
    ),
    kind(
        "lanczos",
        &[FACTOR, parameter("lobes", Range::Whole(1, 16), Some("3"), "half width of the kernel, pixels")],
        lanczos::make,
        "upsampling by a windowed sinc",
        "Duchon 1979",
    ),
    kind("fourier", &[FACTOR], band_limited::make, "upsampling by the cosine series of the image", "Fraser 1989"),
    kind(
        "bandpass",
        &[
            parameter("low", Range::Level, None, "values below it become it"),
            parameter("high", Range::Level, None, "values above it become it"),
        ],
        bandpass::make,
        "temperature bandpass: values outside of the band get its limits",
        "clipping",
    ),
    kind(
        "equalize",
        &[],
        equalize::make,
        "global histogram equalisation: brightness by rank, in the range of the image",
        "Gonzalez & Woods 2018",
    ),
    kind(
        "clahe",
        &[CLIP, TILES],
        clahe::make,
        "local histogram equalisation of limited contrast, in the range of the image",
        "Zuiderveld 1994",
    ),
    kind(
        "hybrid",
        &[parameter("local", Range::Real(0.0, 1.0), Some("0.5"), "weight of the local part"), CLIP, TILES],
        hybrid::make,
        "weighted mean of clahe and equalize",
        "own definition",
    ),
    kind(
        "unsharp",
        &[BLUR, AMOUNT, parameter("threshold", Range::PositiveLevel, Some(""), "differences below it are left alone; 0 if left out")],
        unsharp::make,
        "sharpening by the difference from a smoothed image",
        "Gonzalez & Woods 2018, as in scikit-image",
    ),
    kind(
        "laplacian",
        &[parameter("amount", Range::Real(0.0, 100.0), Some("0.5"), "multiple of the Laplacian that is subtracted")],
        laplacian::make,
        "sharpening by the second derivative",
        "Gonzalez & Woods 2018",
    ),
    kind(
        "sobel",
        &[
            BLUR,
            AMOUNT,
            parameter("edge", Range::PositiveLevel, Some(""), "gradient of an edge, a pixel; three times the median gradient if left out"),
        ],
        sobel::make,
        "sharpening as unsharp, at edges only",
        "Sobel & Feldman 1968; own weights",
    ),
    StepKind {
        needs_psf: true,
        ..kind(
            "wiener-deconvolution",
            &[parameter("noise", Range::Real(1e-12, 1e3), Some("0.01"), "power of the noise over that of the scene")],
            wiener_deconvolution::make,
            "division by the spectrum of the PSF where the scene stands above the noise",
            "Wiener 1949",
        )
    },
    StepKind {
        needs_psf: true,
        ..kind(
            "richardson-lucy",
            &[parameter("iterations", Range::Whole(1, 10_000), Some("10"), "number of iterations")],
            richardson_lucy::make,
            "most likely image without negative values behind the PSF",
            "Richardson 1972; Lucy 1974",
        )
    },
];

//! Generated layouts: one file for each kind, and one row for it in the table [`LAYOUT_KINDS`].

mod coprime;
mod cross;
mod difference_set;
mod fermat;
mod fractal;
mod golomb;
mod hexagonal;
mod kind;
mod log_spiral;
mod mills_cross;
mod minimum_redundancy;
mod multi_ring;
mod options;
mod poisson_disc;
mod random_disc;
mod rectangular;
mod reuleaux;
mod ring;
mod shape;
mod singer;
mod spaced;
mod tee;
mod thinned;
mod u_shape;
mod y;

pub use kind::LayoutKind;
pub use options::GenerateOptions;

use crate::{ArrayError, ArrayLayout, Result};
use kind::row;
use shape::Takes::{Arms, Columns, Exponent, Inner, Rings, Seed, Turns};

/// All kinds of layouts that can be generated.
#[rustfmt::skip]
pub const LAYOUT_KINDS: &[LayoutKind] = &[
    row("y", "Straight arms, distances growing as a power, 1.716 as in the VLA", &[Arms(3), Exponent(1.716)],
        "Chow 1972; Napier, Thompson & Ekers 1983", y::has, y::points),
    row("t", "A bar and a stem, distances growing as a power", &[Exponent(1.0)],
        "Guilloteau et al. 1992 (the T of Plateau de Bure)", tee::has, tee::points),
    row("u", "Three sides of a square, equal spacings", &[], "Rautiainen et al. 2008 (HUT-2D)", u_shape::has, u_shape::points),
    row("cross", "Four arms at right angles, distances growing as a power", &[Exponent(1.716)], "Christiansen & Mathewson 1958", cross::has, cross::points),
    row("mills-cross", "Two lines of equal spacings at right angles", &[], "Mills & Little 1953", mills_cross::has, mills_cross::points),
    row("ring", "Equal steps along a circle", &[], "Wild 1961 (Culgoora)", ring::has, ring::points),
    row("multi-ring", "Concentric rings, elements in proportion to the radius", &[Rings(3)],
        "Stearns & Stewart 1965; Haupt 2008", multi_ring::has, multi_ring::points),
    row("reuleaux", "Equal steps along a Reuleaux triangle", &[], "Keto 1997", reuleaux::has, reuleaux::points),
    row("log-spiral", "Arms along logarithmic spirals", &[Arms(3), Turns(0.5), Inner(0.1)], "Conway 1998", log_spiral::has, log_spiral::points),
    row("fermat", "Golden-angle spiral, distances growing as a power", &[Exponent(0.5)], "Vogel 1979", fermat::has, fermat::points),
    row("random", "Random places of a disc, at least the spacing apart", &[Seed], "Lo 1964", random_disc::has, random_disc::points),
    row("poisson-disc", "Random places of a disc, as far apart as their number allows", &[Seed], "Bridson 2007", poisson_disc::has, poisson_disc::points),
    row("golomb", "Arms along Golomb rulers, optimal to 27 marks: no baseline repeats", &[Arms(3)], "Babcock 1953; Singer 1938", golomb::has, golomb::points),
    row("minimum-redundancy", "Arms along minimum-redundancy rulers: no spacing is missing", &[Arms(3)],
        "Leech 1956; Wichmann 1963; Moffet 1968; Ishiguro 1980", minimum_redundancy::has, minimum_redundancy::points),
    row("coprime", "Arms with two uniform lines of coprime spacings", &[Arms(3)], "Vaidyanathan & Pal 2011", coprime::has, coprime::points),
    row("hexagonal", "Full hexagon of a triangular grid", &[], "Sharp 1961", hexagonal::has, hexagonal::points),
    row("rectangular", "Full rectangular grid of square cells", &[Columns], "uniform planar array", rectangular::has, rectangular::points),
    row("thinned-rectangular", "Random places of a square grid", &[Columns, Seed], "Willey 1962", thinned::has, thinned::square),
    row("thinned-hexagonal", "Random places of a triangular grid", &[Rings(0), Seed], "Willey 1962", thinned::has, thinned::triangular),
    row("difference-ring", "Perfect difference set on a ring", &[], "Singer 1938", difference_set::has, difference_set::ring),
    row("difference-line", "Perfect difference set on a line", &[], "Singer 1938; Leeper 1999", difference_set::has, difference_set::line),
    row("difference-grid", "Perfect difference set folded onto a grid", &[],
        "Singer 1938; MacWilliams & Sloane 1976", difference_set::has_grid, difference_set::grid),
    row("sierpinski", "Sierpinski's triangle", &[], "Puente-Baliarda & Pous 1996", fractal::has_sierpinski, fractal::sierpinski),
    row("koch", "Corners of Koch's snowflake", &[], "Puente-Baliarda & Pous 1996", fractal::has_koch, fractal::koch),
    row("fractal", "Random fractal: polygons of randomly turned polygons", &[Arms(3), Seed], "Kim & Jaggard 1986", fractal::has_random, fractal::random),
];

impl LayoutKind {
    /// The kind of that name.
    ///
    /// # Errors
    /// There is none.
    pub fn find(name: &str) -> Result<&'static Self> {
        LAYOUT_KINDS.iter().find(|k| k.name == name).ok_or_else(|| {
            let names: Vec<&str> = LAYOUT_KINDS.iter().map(|k| k.name).collect();
            ArrayError::Name(format!("{name:?} is no kind of layout; the kinds are {}", names.join(", ")))
        })
    }
}

impl ArrayLayout {
    /// A layout of a kind, in the aperture plane around its mean. Its longest baseline is the aperture.
    ///
    /// # Errors
    /// An unknown kind, and the errors of [`LayoutKind::layout`].
    pub fn generate(kind: &str, options: &GenerateOptions) -> Result<Self> {
        LayoutKind::find(kind)?.layout(options)
    }
}

#[cfg(test)]
mod tests;

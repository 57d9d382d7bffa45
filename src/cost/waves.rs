//! The stage of scenes near the array: spherical waves between the points of a scene and all pairs of antennas, in place of Fourier transforms.

use super::cleaned::{CleanWork, cycles};
use super::entropy::{EntropyWork, evaluations};
use super::held::{DOUBLE, SINGLE};
use super::speeds::Speeds;
use super::stage::{Forecast, Stage};
use super::term::Term;
use crate::fourier::TransformSize;
use crate::imaging::{Field, Outlook, PassCounts};

/// Bytes of a point, of its number among the pixels, and of its gain, which stay between passes.
const POINT: f64 = 32.0;
const NUMBER: f64 = 8.0;
const GAIN: f64 = 8.0;
/// Pixels along each side of the field in which the main lobe of the beam is looked for.
const CORE: f64 = 32.0;
/// Of the tiles of points that a model of CLEAN may light up, so many do: the sources of an image lie together.
const LIT: f64 = 0.5;

/// Spherical waves as this machine makes them: seconds of a point in all channels together.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Waves {
    /// From a point among others with flux to all pairs.
    pub lit_s: f64,
    /// From a point without flux among others without flux.
    pub dark_s: f64,
    /// From all pairs back to a point.
    pub back_s: f64,
    /// The gain of a point.
    pub gain_s: f64,
    /// From a point to all pairs in double precision, as simulations take it.
    pub exact_s: f64,
    /// Bytes of the tables of pairs, and of the phasors of all threads.
    pub table_bytes: f64,
    /// Points of a tile.
    pub tile: f64,
}

/// How many points take part in each direction, over all passes, and how many times the rows are summed over.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WavePasses {
    /// Points with flux on the way to pairs.
    pub lit: f64,
    /// Points without flux.
    pub dark: f64,
    /// Points on the way back.
    pub back: f64,
    /// Points whose gain is found.
    pub gains: f64,
    /// Points of the model by which the fit is judged.
    pub exact: f64,
    /// Passes over the rows.
    pub rows: f64,
}

impl WavePasses {
    /// What [`WavePasses::of_clean`] assumes.
    pub const LIT_TILES: &str = "the components lie together, in half of the image: points of tiles without any take less time";

    /// The beam of a field with so many points: a point of flux 1, and its image.
    fn beam(points: f64) -> Self {
        Self { dark: points, back: points, gains: points, rows: 2.0, ..Self::default() }
    }

    fn and(self, o: Self) -> Self {
        Self {
            lit: self.lit + o.lit,
            dark: self.dark + o.dark,
            back: self.back + o.back,
            gains: self.gains + o.gains,
            exact: self.exact + o.exact,
            rows: self.rows + o.rows,
        }
    }

    /// The small field in which the restoring beam is fitted, or the whole image where it is as small.
    fn core(outlook: &Outlook) -> Self {
        Self::beam(outlook.pixels().min(CORE * CORE))
    }

    /// Those of a dirty image.
    #[must_use]
    pub fn of_dirty(outlook: &Outlook) -> Self {
        Self::core(outlook).and(Self { back: outlook.pixels(), gains: outlook.pixels(), rows: 2.0, ..Self::default() })
    }

    /// Those of a beam.
    #[must_use]
    pub fn of_beam(outlook: &Outlook) -> Self {
        Self::beam(outlook.pixels())
    }

    /// Those of CLEAN, whose model lights up some tiles of points.
    #[must_use]
    pub fn of_clean(outlook: &Outlook, work: &CleanWork, (waves, speeds): (&Waves, &Speeds)) -> Self {
        let (points, n) = (outlook.pixels(), cycles(work, speeds));
        let lit = (LIT * points).min(work.components * waves.tile);
        let images = Self { back: points, rows: 1.0, ..Self::default() };
        let cycles = Self { lit: n * lit, dark: n * (points - lit), back: n * points, rows: n, ..Self::default() };
        let exact = if work.judged.is_some() { work.components.min(points) } else { 0.0 };
        Self::beam(points).and(images).and(cycles).and(Self { exact, ..Self::default() })
    }

    /// Those of maximum entropy: the flux of the data, the evaluations, and the residual in the end.
    #[must_use]
    pub fn of_entropy(outlook: &Outlook, work: &EntropyWork, speeds: &Speeds) -> Self {
        let (points, n) = (outlook.pixels(), evaluations(work, speeds));
        let flux = Self { dark: points, back: points, rows: 1.0, ..Self::default() };
        let fits = Self { lit: n * points, back: n * points, rows: n, ..Self::default() };
        let residual = Self { lit: points, back: points, gains: points, rows: 2.0, ..Self::default() };
        let exact = if work.judged.is_some() { points } else { 0.0 };
        Self::core(outlook).and(flux).and(fits).and(residual).and(Self { exact, ..Self::default() })
    }
}

/// An outlook without the Fourier transforms, in whose place spherical waves come.
#[must_use]
pub fn without_transforms(outlook: &Outlook) -> Outlook {
    let of = &outlook.image;
    let size = TransformSize { groups: 1, ..TransformSize::default() };
    let pass = PassCounts { visibilities: of.pass.visibilities, ..PassCounts::default() };
    Outlook { image: Field { size, pass, real_bytes: of.real_bytes, bands: None }, core: None, ..outlook.clone() }
}

impl Waves {
    /// Time of all passes but the sums over rows, s.
    fn seconds(&self, p: &WavePasses) -> f64 {
        p.lit * self.lit_s + p.dark * self.dark_s + p.back * self.back_s + p.gains * self.gain_s + p.exact * self.exact_s
    }

    /// The stage of some points whose visibilities are simulated.
    pub(super) fn simulated(&self, points: f64) -> Stage {
        let stage = Stage::new("spherical waves", points * (POINT + DOUBLE) + self.table_bytes);
        // Each of several processes makes them all, because all pairs are made at once.
        Stage { timed_s: points * self.exact_s, whole: true, ..stage }
    }

    /// The forecast of an image of an outlook without transforms, with these passes of spherical waves.
    #[must_use]
    pub fn put_into(&self, mut forecast: Forecast, outlook: &Outlook, passes: &WavePasses) -> Forecast {
        let points = outlook.pixels();
        let stays = points * (POINT + NUMBER + GAIN);
        // The verdict comes when the points are forgotten.
        let before = ["start", "read", "weights", "test of phases", "weights of the test", "verdict"];
        let beside = |s: &Stage| !before.contains(&s.name);
        let images = forecast.stages.iter().filter(|s| beside(s)).map(|s| s.bytes).fold(0.0, f64::max);
        forecast.stages.iter_mut().filter(|s| beside(s)).for_each(|s| s.bytes += stays);
        // A pass holds the fluxes or the sums of all points as well.
        let stage = Stage::new("spherical waves", images + stays + points * (DOUBLE + SINGLE) + self.table_bytes);
        let timed_s = self.seconds(passes);
        let at = forecast.stages.iter().position(|s| s.name == "write").unwrap_or(forecast.stages.len());
        for again in forecast.stages.iter_mut().filter(|s| s.name == "second image") {
            again.timed_s += timed_s;
            again.bytes = again.bytes.max(stage.bytes);
        }
        let sums = [(Term::Weigh, passes.rows * outlook.visibilities())];
        forecast.stages.insert(at, Stage { timed_s, ..stage }.doing(sums));
        forecast
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_point_takes_its_time_in_each_pass() {
        let waves = Waves { lit_s: 1e-3, dark_s: 1e-4, back_s: 2e-3, gain_s: 1e-5, exact_s: 4e-3, table_bytes: 1e6, tile: 64.0 };
        let cycle = WavePasses { lit: 100.0, dark: 900.0, back: 1000.0, rows: 1.0, ..WavePasses::default() };
        assert!((waves.seconds(&cycle) - 2.19).abs() < 1e-12);
        let two = cycle.and(cycle).and(WavePasses { exact: 5.0, gains: 1000.0, ..WavePasses::default() });
        assert!((waves.seconds(&two) - 2.0 * 2.19 - 0.03).abs() < 1e-12 && two.rows == 2.0);
        let (small, large) = (waves.simulated(1000.0), waves.simulated(4000.0));
        assert!((small.timed_s - 4.0).abs() < 1e-12 && (large.timed_s - 16.0).abs() < 1e-12);
        assert_eq!(large.bytes - small.bytes, 3000.0 * (POINT + DOUBLE));
    }
}

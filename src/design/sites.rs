//! Stations on given sites: the part of the u-v plane that none of their baselines crosses while the Earth turns.
//!
//! The views of [`super::View`] see a layout as a plane. Stations far apart stand on a sphere, and do not see the source at the same time. Here every
//! pair of sites is followed over the whole track with its true place on the Earth, and only while both see the source. The cells that each pair
//! crosses are kept, so that the figure of a choice is a union of sets.

use super::objective::LayoutFigure;
use super::options::DesignOptions;
use super::views::View;
use crate::values::{bad_value, need};
use crate::{ChainError, Result, ensure};
use cittert_arrays::quantity::{Angle, Duration};
use cittert_arrays::{ArrayLayout, CoveragePlan, PhaseCenter, Track};
use std::f64::consts::PI;
use std::sync::Arc;

/// Cells from the centre of the u-v plane to the longest baseline.
const CELLS: usize = 32;
/// Default of the lowest elevation.
const LOWEST: Angle = Angle(10.0 * PI / 180.0);
/// A date of the track. The precession of the source within a few years moves no baseline by a cell.
const DATE_JD: f64 = 2_460_827.5;

/// The cells of the u-v plane that each pair of sites crosses.
#[derive(Debug)]
pub struct SiteTracks {
    places: Vec<[f64; 2]>,
    /// Sets of cells of each pair \[second site, first site\], 64 cells a word.
    pairs: Vec<Vec<u64>>,
    /// Cells within the longest baseline of all sites.
    cells: usize,
}

/// Place of a pair in a list of all pairs.
fn pair(a: usize, b: usize) -> usize {
    let (low, high) = (a.min(b), a.max(b));
    high * (high - 1) / 2 + low
}

/// The cell of (u, v) in units of the longest baseline, folded to v >= 0; `None` outside of it.
fn cell([u, v]: [f64; 2]) -> Option<usize> {
    let n = CELLS as f64;
    let (u, v) = if v < 0.0 || (v == 0.0 && u < 0.0) { (-u, -v) } else { (u, v) };
    let (x, y) = ((u * n).floor(), (v * n).floor());
    let centre = (x + 0.5).hypot(y + 0.5);
    (centre <= n).then(|| (x + n) as usize + y as usize * 2 * CELLS)
}

impl SiteTracks {
    /// Follow all pairs of sites over the track of these options. `places` are the positions \[site\]\[east, north\] by which a search knows them.
    ///
    /// # Errors
    /// Sites that are not on the Earth, no declination, a source that fewer than two sites see.
    pub fn new(sites: &ArrayLayout, places: Vec<[f64; 2]>, options: &DesignOptions) -> Result<Self> {
        let Some(site) = sites.site() else {
            return bad_value("pads", &sites.name, "sites on the Earth, which the objective coverage needs");
        };
        let Some(declination) = options.declination else {
            return bad_value("declination", "missing", "the declination of the source, which the objective coverage needs");
        };
        need("track", options.track, options.track.si() > 0.0 && options.track.si() <= 86_400.0, "more than 0 h and at most 24 h")?;
        need("moments", options.moments, (1..=10_000).contains(&options.moments), "1 to 10000")?;
        let limit = options.elevation_limit.unwrap_or(LOWEST);
        need("elevation-limit", limit, (0.0..PI / 2.0).contains(&limit.si()), "0deg to 90deg")?;
        let center = PhaseCenter::sidereal("design", 0.0, declination.si())?;
        let half = options.track.si() / 86_400.0 * PI;
        // A sidereal day is shorter by 1/366 than the 24 hours of the clock.
        let step = Duration(options.track.si() / 1.002_738 / options.moments as f64);
        let mut track = Track::hour_angles(&center, &site, DATE_JD, [-half, half], step.si())?;
        track.elevation_limit_rad = Some(limit.si());
        let plan = CoveragePlan::track(sites, &center, &track)?;
        let relative = options.bandwidth.zip(options.freq).map_or(0.0, |(b, f)| b.si() / f.si());
        let scales: Vec<f64> = View::band(relative, options.channels).iter().map(|v| v.matrix[0][0]).collect();
        let views: Vec<Vec<(usize, [f64; 2])>> = plan.views().collect();
        let between = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
        let lengths = views.iter().flat_map(|v| v.iter().flat_map(|a| v.iter().map(|b| between(a.1, b.1)))).map(|[u, v]| u.hypot(v));
        let longest = lengths.fold(0.0, f64::max) * scales.iter().copied().fold(1.0, f64::max);
        ensure!(longest > 0.0, ChainError::Incompatible("no two of these sites see the source at the same time".into()));
        let n = sites.n_ant();
        let mut pairs = vec![vec![0_u64; (2 * CELLS * (CELLS + 1)).div_ceil(64)]; n * (n - 1) / 2];
        for view in &views {
            for (k, (a, place_a)) in view.iter().enumerate() {
                for (b, place_b) in &view[..k] {
                    let [u, v] = between(*place_a, *place_b);
                    for at in scales.iter().filter_map(|s| cell([s * u / longest, s * v / longest])) {
                        pairs[pair(*a, *b)][at / 64] |= 1 << (at % 64);
                    }
                }
            }
        }
        let n = CELLS as i64;
        let inside = |x: i64, y: i64| (x as f64 + 0.5).hypot(y as f64 + 0.5) <= CELLS as f64;
        let cells = (0..n).map(|y| (-n..n).filter(|x| inside(*x, y)).count()).sum();
        Ok(Self { places, pairs, cells })
    }

    /// The share of the cells within the longest baseline of all sites that no pair of these sites crosses.
    ///
    /// # Errors
    /// A place that is none of the sites.
    pub fn empty(&self, xy: &[[f64; 2]]) -> Result<f64> {
        let index = |p: &[f64; 2]| self.places.iter().position(|q| (p[0] - q[0]).hypot(p[1] - q[1]) <= 1e-9);
        let chosen: Option<Vec<usize>> = xy.iter().map(index).collect();
        let Some(chosen) = chosen else {
            return Err(ChainError::Incompatible(
                "an element stands on none of the sites, whose tracks the objective coverage knows".into(),
            ));
        };
        let mut all = vec![0_u64; self.pairs.first().map_or(0, Vec::len)];
        for (k, a) in chosen.iter().enumerate() {
            for b in &chosen[..k] {
                all.iter_mut().zip(&self.pairs[pair(*a, *b)]).for_each(|(sum, part)| *sum |= part);
            }
        }
        let filled: u32 = all.iter().map(|word| word.count_ones()).sum();
        Ok(1.0 - f64::from(filled) / self.cells as f64)
    }

    /// The same as a function for the objective.
    #[must_use]
    pub fn figure(self) -> LayoutFigure {
        LayoutFigure(Arc::new(move |xy: &[[f64; 2]]| self.empty(xy)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Antenna, LayoutFrame, Site};

    fn sites(latitude_deg: f64, places: &[[f64; 3]]) -> ArrayLayout {
        let antennas = places.iter().enumerate().map(|(k, p)| Antenna::new(format!("S{k}"), k as u32, *p)).collect();
        let site = Site { latitude_rad: latitude_deg.to_radians(), longitude_rad: 0.0, altitude_m: 0.0 };
        ArrayLayout::new("sites", LayoutFrame::EastNorthUp(site), antennas).unwrap()
    }

    fn of(sites: &ArrayLayout, declination_deg: f64, hours: f64) -> Result<SiteTracks> {
        let options = DesignOptions {
            declination: Some(Angle(declination_deg.to_radians())),
            track: Duration(hours * 3600.0),
            moments: 400,
            ..DesignOptions::default()
        };
        SiteTracks::new(sites, sites.antennas().iter().map(|a| [a.position_m[0], a.position_m[1]]).collect(), &options)
    }

    #[test]
    fn an_east_west_baseline_under_the_pole_draws_a_circle() {
        let two = sites(60.0, &[[0.0, 0.0, 0.0], [1000.0, 0.0, 0.0]]);
        let tracks = of(&two, 90.0, 24.0).unwrap();
        // The circle has the radius of the longest baseline, so it crosses the outermost cells of half a circle: about 2 x 32 steps along each axis.
        let filled = (1.0 - tracks.empty(&[[0.0, 0.0], [1000.0, 0.0]]).unwrap()) * tracks.cells as f64;
        assert!((tracks.cells as f64 - PI * 512.0).abs() < 20.0, "{}", tracks.cells);
        assert!(filled > 50.0 && filled < 130.0, "{filled}");
        // Half a circle is drawn in 12 hours, so 8 hours draw two thirds of it.
        let part = of(&two, 90.0, 8.0).unwrap();
        let third = (1.0 - part.empty(&[[0.0, 0.0], [1000.0, 0.0]]).unwrap()) * part.cells as f64;
        assert!(third > 0.5 * filled && third < 0.8 * filled, "{third} of {filled}");
    }

    #[test]
    fn a_site_on_the_other_side_of_the_earth_adds_nothing() {
        let radius = 6_371_000.0;
        let three = sites(0.0, &[[0.0, 0.0, 0.0], [500_000.0, 0.0, -20_000.0], [0.0, 1000.0, -2.0 * radius]]);
        let tracks = of(&three, 0.0, 4.0).unwrap();
        let place = |k: usize| [three.antennas()[k].position_m[0], three.antennas()[k].position_m[1]];
        let near = tracks.empty(&[place(0), place(1)]).unwrap();
        assert_eq!(tracks.empty(&[place(0), place(1), place(2)]).unwrap(), near);
        assert_eq!(tracks.empty(&[place(0), place(2)]).unwrap(), 1.0);
        assert!(near < 1.0);
        assert!(tracks.empty(&[[7.0, 7.0], place(0)]).is_err());
        assert!(of(&three, -90.0, 4.0).is_err(), "no site on the equator sees the pole 10 degrees above its horizon");
    }
}

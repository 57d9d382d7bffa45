//! The range of a scene by the sharpness of its image.
//!
//! The image at the right distance has the highest peaks. Its sum of squares does not tell: it is that of the visibilities, whatever their phases (Parseval). The
//! sum of fourth powers over the square of the sum of squares does. It is scanned over 1/distance, in which the phase at the edge of the aperture is linear, so
//! that a peak has the same width at all distances. A parabola through its top gives the distance, and the scatter of the tops of images without an eighth of the
//! baselines each (the jackknife) its uncertainty.
//!
//! # Reference
//! Muller & Buffington 1974, J. Opt. Soc. Am. 64, 1200 (sharpness); Paxman & Marron 1988, Proc. SPIE 976, 37 (fourth powers);
//! Efron & Stein 1981, Ann. Stat. 9, 586 (jackknife).

use super::pairs::Pairs;
use super::paths::{Elements, Point};
use super::surface::Surface;
use super::transform::PathTransform;
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result, ensure};
use cittert_arrays::{Polarization, SPEED_OF_LIGHT_M_S, SkyGrid, VisibilitySource, for_each_block};
use ndarray::Array2;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Channels that are looked at, spread over the band.
const CHANNELS: usize = 4;
/// Groups of baselines of the jackknife.
const GROUPS: usize = 8;
/// Phase at the edge of the aperture between two distances of the scan, rad. The sharpness of a point falls to a half over 1.6 rad.
const SCAN_RAD: f64 = 0.8;
/// The same around the top.
const TOP_RAD: f64 = 0.4;
/// Distances around the top.
const TOP: usize = 7;
/// Robust standard deviations by which the top must rise above the other distances.
const SIGNIFICANT: f64 = 7.0;
/// Largest uncertainty of the phase at the edge of the aperture, rad.
const UNCERTAIN_RAD: f64 = 1.0;

/// The range that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundRange {
    /// Distance of the plane across the boresight, m.
    pub range_m: f64,
    /// Its standard deviation, m.
    pub sigma_m: f64,
    /// How far the top rises above the other distances, in their robust standard deviations.
    pub significance: f64,
    /// The distances that were tried, m, with the sharpness there, farthest first.
    pub scan: Vec<(f64, f64)>,
}

/// Visibilities summed over time for some channels, in groups of baselines.
struct Gathered {
    freq_hz: Vec<f64>,
    groups: Vec<Pairs>,
}

/// Find the distance at which the image of a set on `grid` is sharpest, no nearer than `nearest_m`.
///
/// # Errors
/// A layout on the Earth, a grid on the sky, data without visibilities of total intensity; data that do not tell the range: the scene is in the far field, too
/// near, or has no detail.
pub fn find_range(
    source: &mut dyn VisibilitySource,
    grid: &SkyGrid,
    nearest_m: f64,
    memory: MemoryBudget,
    observer: &dyn Observer,
) -> Result<FoundRange> {
    let header = source.header().clone();
    let elements = Elements::new(&header.layout, header.near_field.focus)?;
    elements.check_distance(nearest_m)?;
    let gathered = gather(source, elements.len(), observer)?;
    // Radius of the aperture about the middle of its elements.
    let count = elements.len() as f64;
    let middle = [0, 1].map(|k| elements.positions_m().iter().map(|r| r[k]).sum::<f64>() / count);
    let reach = elements.positions_m().iter().map(|r| (r[0] - middle[0]).hypot(r[1] - middle[1])).fold(0.0, f64::max);
    let highest = gathered.freq_hz.iter().copied().fold(0.0, f64::max);
    // Phase at the edge of the aperture for 1/distance = 1/m.
    let rad_m = TAU * highest / SPEED_OF_LIGHT_M_S * reach * reach / 2.0;
    ensure!(rad_m > 0.0, ChainError::NoData("the elements of the array are in one place: no distance can be found".into()));
    let step = SCAN_RAD / rad_m;
    let steps = (1.0 / nearest_m / step).floor() as usize;
    ensure!(
        steps >= 4,
        ChainError::NoData(format!(
            "the array is too small to tell distances beyond {nearest_m} m: the phase of the waves at its edge changes by {:.1} rad from there to infinity",
            rad_m / nearest_m
        ))
    );
    observer.event(Event::Phase { name: "autofocus", total: Some((steps + 1 + TOP) as u64), unit: "ranges" });
    let image = Sharp { elements, grid, gathered: &gathered, memory };
    let mut scan = Vec::new();
    for k in 0..=steps {
        scan.push((k as f64 * step, image.sharpness(k as f64 * step, observer)?));
        observer.event(Event::Advance(1));
    }
    let top = scan.iter().enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1)).map_or(0, |t| t.0);
    let mut others: Vec<f64> = scan.iter().map(|s| s.1).collect();
    let median = median_of(&mut others);
    let mut apart: Vec<f64> = others.iter().map(|s| (s - median).abs()).collect();
    let spread = 1.4826 * median_of(&mut apart);
    let significance = (scan[top].1 - median) / spread.max(f64::MIN_POSITIVE);
    let farthest = |curvature: f64| curvature.recip();
    let tell = |why: String| Err(ChainError::NoData(format!("the data do not tell the range: {why}. Give a distance if it is known")));
    if significance < SIGNIFICANT {
        return tell(format!(
            "the sharpest image, at {:.4} m, rises only {significance:.1} standard deviations above those at other distances (needed: {SIGNIFICANT}); the scene has too little detail, too much noise, or several distances",
            farthest(scan[top].0)
        ));
    }
    if top == steps {
        return tell(format!("the image gets sharper up to the nearest distance that was tried, {nearest_m} m"));
    }
    let around: Vec<f64> = (0..TOP).map(|k| scan[top].0 + (k as f64 - (TOP / 2) as f64) * TOP_RAD / rad_m).collect();
    let mut curves: Vec<Vec<f64>> = vec![Vec::new(); GROUPS + 1];
    for curvature in &around {
        for (curve, value) in curves.iter_mut().zip(image.without_groups(*curvature, observer)?) {
            curve.push(value);
        }
        observer.event(Event::Advance(1));
    }
    observer.event(Event::Done);
    let tops: Option<Vec<f64>> = curves.iter().map(|curve| parabola_top(&around, curve)).collect();
    let Some(tops) = tops else { return tell("the sharpness has no single top".into()) };
    let (curvature, parts) = (tops[0], &tops[1..]);
    let mean = parts.iter().sum::<f64>() / GROUPS as f64;
    let sigma = ((GROUPS - 1) as f64 / GROUPS as f64 * parts.iter().map(|t| (t - mean).powi(2)).sum::<f64>()).sqrt();
    if sigma * rad_m > UNCERTAIN_RAD {
        return tell(format!(
            "images without an eighth of the baselines are sharpest at distances that differ by {:.0} %",
            100.0 * sigma / curvature.abs()
        ));
    }
    if curvature < 3.0 * sigma || curvature * rad_m < TOP_RAD {
        return tell(format!(
            "the scene is farther than {:.4} m, where its waves are plane for this array, and needs no focus",
            farthest(curvature.max(0.0) + 2.0 * sigma + TOP_RAD / rad_m)
        ));
    }
    let range_m = curvature.recip();
    let scan = scan.into_iter().map(|(c, s)| (farthest(c), s)).collect();
    Ok(FoundRange { range_m, sigma_m: sigma * range_m * range_m, significance, scan })
}

fn median_of(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The place of the top of the parabola of least squares through a curve; `None` where it has none within the curve.
fn parabola_top(x: &[f64], y: &[f64]) -> Option<f64> {
    let n = x.len();
    let (center, half) = (0.5 * (x[0] + x[n - 1]), 0.5 * (x[n - 1] - x[0]));
    let scaled: Vec<f64> = x.iter().map(|x| (x - center) / half).collect();
    // The points are even and symmetric, so that odd moments vanish.
    let moment = |p: i32| scaled.iter().map(|t| t.powi(p)).sum::<f64>();
    let with = |p: i32| scaled.iter().zip(y).map(|(t, y)| t.powi(p) * y).sum::<f64>();
    let (m0, m2, m4) = (moment(0), moment(2), moment(4));
    let slope = with(1) / m2;
    let bend = (m0 * with(2) - m2 * with(0)) / (m0 * m4 - m2 * m2);
    let top = -slope / (2.0 * bend);
    (bend < 0.0 && top.abs() <= 1.0).then_some(center + half * top)
}

/// The images of the data at trial distances.
struct Sharp<'a> {
    elements: Elements,
    grid: &'a SkyGrid,
    gathered: &'a Gathered,
    memory: MemoryBudget,
}

impl Sharp<'_> {
    fn transform(&self, curvature: f64) -> Result<PathTransform> {
        // A negative curvature continues the scan beyond infinity.
        let point = |l: f64, m: f64| Point::on(&Surface::Plane(1.0), l, m).map(|p| Point { curvature: p.curvature * curvature, ..p });
        let g = self.grid;
        let points = (0..g.n_m * g.n_l).filter_map(|k| point(g.l_at((k % g.n_l) as f64), g.m_at((k / g.n_l) as f64))).collect();
        PathTransform::new(self.elements.clone().relative_at(self.gathered.freq_hz[0]), points, &self.gathered.freq_hz, self.memory)
    }

    fn sharpness(&self, curvature: f64, observer: &dyn Observer) -> Result<f64> {
        let mut all = self.gathered.groups[0].clone();
        self.gathered.groups[1..].iter().for_each(|g| all.merge(g));
        Ok(peakedness(&self.transform(curvature)?.adjoint::<f32>(&all, observer)?))
    }

    /// The sharpness of the image of all baselines, and of those without each group.
    fn without_groups(&self, curvature: f64, observer: &dyn Observer) -> Result<Vec<f64>> {
        let transform = self.transform(curvature)?;
        let parts = self.gathered.groups.iter().map(|g| transform.adjoint::<f32>(g, observer)).collect::<Result<Vec<_>>>()?;
        let all: Vec<f64> = (0..transform.n_points()).map(|k| parts.iter().map(|p| p[k]).sum()).collect();
        let without = |part: &Vec<f64>| peakedness(&all.iter().zip(part).map(|(a, b)| a - b).collect::<Vec<_>>());
        Ok(std::iter::once(peakedness(&all)).chain(parts.iter().map(without)).collect())
    }
}

/// The sum of fourth powers over the square of the sum of squares, times the number of pixels, of an image without its mean.
fn peakedness(image: &[f64]) -> f64 {
    let n = image.len() as f64;
    let mean = image.iter().sum::<f64>() / n;
    let (two, four) = image.iter().map(|v| (v - mean).powi(2)).fold((0.0, 0.0), |(a, b), s| (a + s, b + s * s));
    if two > 0.0 { n * four / (two * two) } else { 0.0 }
}

/// Sum the visibilities of total intensity over time, for a few channels.
fn gather(source: &mut dyn VisibilitySource, n_ant: usize, observer: &dyn Observer) -> Result<Gathered> {
    let header = source.header();
    let n_chan = header.spectrum.n_chan();
    let count = CHANNELS.min(n_chan);
    let chans: Vec<usize> = (0..count).map(|k| (2 * k + 1) * n_chan / (2 * count)).collect();
    let freq_hz: Vec<f64> = chans.iter().map(|c| header.spectrum.freq_hz()[*c]).collect();
    let wanted = [Polarization::I, Polarization::XX, Polarization::YY, Polarization::RR, Polarization::LL];
    let pols: Vec<usize> = (0..header.polarizations.len()).filter(|p| wanted.contains(&header.polarizations[*p])).collect();
    ensure!(!pols.is_empty(), ChainError::NoData("the set holds no product of total intensity to focus on".into()));
    let mut groups = vec![Pairs::zeros(count, n_ant); GROUPS];
    let mut weight = Array2::<f64>::zeros((n_ant, n_ant));
    for_each_block::<ChainError>(source, MemoryBudget::default().block(), |_, block| {
        ensure!(!observer.cancelled(), ChainError::Cancelled);
        for row in 0..block.n_rows() {
            let (a, b) = (block.coverage.ant1[row] as usize, block.coverage.ant2[row] as usize);
            if a == b {
                continue;
            }
            // A hash of the pair, so that a group has baselines of all lengths and directions.
            let (low, high) = (a.min(b) as u64, a.max(b) as u64);
            let group = ((low.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ high.wrapping_mul(0xc2b2_ae3d_27d4_eb4f))
                .wrapping_mul(0xff51_afd7_ed55_8ccd)
                >> 40) as usize
                % GROUPS;
            for (c, chan) in chans.iter().enumerate() {
                for pol in &pols {
                    let w = f64::from(block.usable_weight(row, *chan, *pol));
                    if w > 0.0 {
                        let v = block.vis[(row, *chan, *pol)];
                        groups[group].add(c, a, b, Complex64::new(v.re.into(), v.im.into()) * w);
                        weight[(a, b)] += w;
                    }
                }
            }
        }
        Ok(())
    })?;
    ensure!(weight.iter().any(|w| *w > 0.0), ChainError::NoData("no usable visibility to focus on".into()));
    Ok(Gathered { freq_hz, groups })
}

#[cfg(test)]
#[path = "autofocus_tests.rs"]
mod tests;

//! Polarised scenes: Stokes parameters in the axes of the feeds, and the products that the feeds make of them.

use super::analytic::Seen;
use super::sky::SkyModel;
use crate::{ChainError, Result, ensure};
use cittert_arrays::feeds::{Feeds, Mount, coherency, products, sky_angle_rad};
use cittert_arrays::{ArrayLayout, PhaseCenter, Polarization, Source, SourcePosition, UvCoverage, VisibilityHeader};
use ndarray::{Array3, s};
use num_complex::{Complex, Complex64};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// The Stokes parameters in their order.
pub(super) const STOKES: [Polarization; 4] = [Polarization::I, Polarization::Q, Polarization::U, Polarization::V];

/// Which field a feed receives from a direction beside the phase centre.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum FeedBasis {
    /// The one at the phase centre, carried along the great circle.
    GreatCircle,
    /// X across and Y along the vertical circle of each direction.
    Horizon,
}

/// A source, and its Stokes Q + i U turned into the axes of the feeds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polarized {
    pub(super) seen: Seen,
    turn: Complex64,
}

impl AsRef<Seen> for Polarized {
    fn as_ref(&self) -> &Seen {
        &self.seen
    }
}

impl Polarized {
    /// Stokes parameter 1 to 3 (Q, U, V) at a frequency, Jy.
    pub(super) fn stokes(&self, k: usize, freq_hz: f64) -> f64 {
        let [q, u, v] = self.seen.source.polarized_at(freq_hz);
        let linear = Complex64::new(q, u) * self.turn;
        match k {
            1 => linear.re,
            2 => linear.im,
            _ => v,
        }
    }

    /// The sources for groups of rows. With feeds along the horizon every time is a group of its own.
    pub(super) fn at_rows(
        sources: &[Seen],
        center: &PhaseCenter,
        (rows, coverage): (&[usize], &UvCoverage),
        (basis, layout): (FeedBasis, &ArrayLayout),
    ) -> Result<Vec<(Vec<usize>, Vec<Self>)>> {
        let turned = |seen: &Seen, angle: f64| Self { seen: *seen, turn: Complex::cis(-2.0 * angle) };
        let site = match (basis, layout.site()) {
            (FeedBasis::Horizon, Some(site)) => site,
            _ => return Ok(vec![(rows.to_vec(), sources.iter().map(|s| turned(s, s.source.carried_north_rad(center))).collect())]),
        };
        let mut groups: Vec<(Vec<usize>, Vec<Self>)> = Vec::new();
        let mut place = std::collections::HashMap::new();
        for row in rows {
            let time = coverage.time_jd[*row];
            let group = *place.entry(time.to_bits()).or_insert(groups.len());
            if group == groups.len() {
                let angle = |s: &Seen| Ok(turned(s, horizon_angle(s, center, |at| sky_angle_rad(Mount::AltAz, at, time, &site))?));
                groups.push((Vec::new(), sources.iter().map(angle).collect::<Result<_>>()?));
            }
            groups[group].0.push(*row);
        }
        Ok(groups)
    }
}

/// Angle from the axis of a source's Stokes parameters to the vertical circle through it.
fn horizon_angle(seen: &Seen, center: &PhaseCenter, vertical: impl Fn(&PhaseCenter) -> cittert_arrays::Result<f64>) -> Result<f64> {
    let (ra_rad, dec_rad, axis) = match (seen.source.position, center.ra_dec_rad()) {
        (SourcePosition::RaDec { ra_rad, dec_rad }, _) => (ra_rad, dec_rad, 0.0),
        (SourcePosition::DirectionCosines { l, m }, Some((ra0, dec0))) => {
            let (n, (sin, cos)) = ((1.0 - l * l - m * m).max(0.0).sqrt(), dec0.sin_cos());
            let ra_rad = (ra0 + l.atan2(n * cos - m * sin)).rem_euclid(TAU);
            let dec_rad = (m * cos + n * sin).clamp(-1.0, 1.0).asin();
            let there = Source { position: SourcePosition::RaDec { ra_rad, dec_rad }, ..seen.source };
            (ra_rad, dec_rad, there.carried_north_rad(center))
        }
        _ => return Ok(0.0),
    };
    let at = PhaseCenter { frame: center.frame.clone(), ..PhaseCenter::sidereal(&center.name, ra_rad, dec_rad)? };
    Ok(vertical(&at)? - axis)
}

/// The products that are summed over the scene: those of the set where its feeds do not turn, otherwise the Stokes parameters.
///
/// # Errors
/// Turning feeds with a scene whose planes are products of feeds; feeds along the horizon with images, other mounts, or no place on the Earth.
pub(super) fn sky_basis(header: &VisibilityHeader, feeds: &Feeds, sky: &SkyModel, basis: FeedBasis) -> Result<Vec<Polarization>> {
    if basis == FeedBasis::Horizon {
        let alone = sky.images.is_empty() && feeds.mounts().iter().all(|m| *m == Mount::AltAz) && feeds.turn();
        let text = "the feed basis horizon is that of points and Gaussians seen by alt-az antennas: leave it out, or give a source list and the mount alt-az";
        ensure!(alone, ChainError::Incompatible(text.into()));
    }
    let unpolarized =
        sky.images.iter().flat_map(|i| &i.polarizations).all(|p| *p == Polarization::I) && !sky.sources.iter().any(Source::is_polarized);
    // A turn that is the same for all feeds leaves unpolarised light as it is.
    if feeds.are_plain() || (unpolarized && feeds.alike()) {
        return Ok(header.polarizations.clone());
    }
    let made = sky.images.iter().flat_map(|i| &i.polarizations).find(|p| !STOKES.contains(p));
    made.map_or(Ok(STOKES.to_vec()), |p| {
        Err(ChainError::Incompatible(format!(
            "the scene has a plane of {p}, but the feeds of the set turn: give the scene in Stokes parameters"
        )))
    })
}

/// What the feeds of every row make of Stokes parameters \[row, chan, stokes\]: the products \[row, chan, pol\].
///
/// # Reference
/// Smirnov 2011, A&A 527, A106, eq. 8.
pub(super) fn received(
    stokes: &Array3<Complex64>,
    coverage: &UvCoverage,
    feeds: &Feeds,
    (basis, wanted): (FeedBasis, &[Polarization]),
) -> Result<Array3<Complex64>> {
    let mut out = Array3::zeros((stokes.dim().0, stokes.dim().1, wanted.len()));
    for row in 0..coverage.n_rows() {
        // With a basis along the horizon the sources are in the axes of the feeds already.
        let matrices = match (feeds.turn(), basis) {
            (true, FeedBasis::GreatCircle) => {
                let angles = feeds.angles(coverage.time_jd[row], coverage.phase_center[row])?;
                [coverage.ant1[row], coverage.ant2[row]].map(|a| feeds.matrix(angles[a as usize]))
            }
            _ => [feeds.matrix(0.0); 2],
        };
        for chan in 0..stokes.dim().1 {
            let parameters = stokes.slice(s![row, chan, ..]);
            let all = [0, 1, 2, 3].map(|k| parameters[k]);
            let made = products(&matrices[0], &coherency(all), &matrices[1]);
            for (pol, product) in wanted.iter().enumerate() {
                out[[row, chan, pol]] = match product.feeds() {
                    Some((j, k)) => made[j][k],
                    None => STOKES.iter().position(|s| s == product).map_or(Complex64::ZERO, |k| all[k]),
                };
            }
        }
    }
    Ok(out)
}

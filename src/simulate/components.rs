//! The exact visibilities of the sources of a scene, one Stokes parameter after the other.

use super::Method;
use super::analytic::{Seen, snapped_sources, sources_dft};
use super::engine::{Simulator, products};
use super::polarized::{Polarized, STOKES};
use super::sky::from_jy;
use super::through::sources_through;
use crate::Result;
use cittert_arrays::{Polarization, UvCoverage};
use ndarray::{Array3, Axis, s};
use num_complex::Complex64;

impl Simulator<'_> {
    /// Add the visibilities of all sources \[row, chan, product\].
    ///
    /// # Errors
    /// A time at which the feeds cannot be turned.
    pub(super) fn add_sources(&self, coverage: &UvCoverage, sum: &mut Array3<Complex64>) -> Result<()> {
        let unit = self.header.unit;
        for (center, sources) in self.sources.iter().enumerate() {
            let rows: Vec<usize> = (0..coverage.n_rows()).filter(|r| usize::from(coverage.phase_center[*r]) == center).collect();
            let flux = |s: &Seen, f: f64| s.source.flux_at(f) * from_jy(unit, f);
            self.add_component(Polarization::I, (sources, &rows), coverage, flux, sum);
            let polarized: Vec<Seen> = sources.iter().filter(|s| s.source.is_polarized()).copied().collect();
            if polarized.is_empty() {
                continue;
            }
            let at = &self.header.phase_centers[center];
            for (rows, turned) in Polarized::at_rows(&polarized, at, (&rows, coverage), (self.options.feed_basis, &self.header.layout))? {
                for (k, stokes) in STOKES.into_iter().enumerate().skip(1) {
                    let flux = |s: &Polarized, f: f64| s.stokes(k, f) * from_jy(unit, f);
                    self.add_component(stokes, (&turned, &rows), coverage, flux, sum);
                }
            }
        }
        Ok(())
    }

    /// Add one Stokes parameter of sources to rows. `flux(source, freq)` is before the pattern.
    fn add_component<S: AsRef<Seen> + Sync>(
        &self,
        stokes: Polarization,
        (sources, rows): (&[S], &[usize]),
        coverage: &UvCoverage,
        flux: impl Fn(&S, f64) -> f64 + Sync,
        sum: &mut Array3<Complex64>,
    ) {
        let terms = products(stokes, &self.basis);
        if terms.is_empty() || sources.is_empty() {
            return;
        }
        let freqs: Vec<f64> = self.freq_hz.iter().flatten().copied().collect();
        let uvw = coverage.uvw_m.select(Axis(0), rows);
        let amplitude = |s: &S, f: f64| {
            let at = s.as_ref();
            flux(s, f) * self.pattern.power(at.l, at.m, f)
        };
        // In method mask the sources are sampled like the image: at the centre of the cell and without w.
        let snap = (self.options.method == Method::Mask).then(|| &self.sky.images[0].grid);
        let vis = match (&self.through, snap) {
            (Some(through), _) => sources_through(through, sources, (coverage, rows), &freqs, !self.options.no_w, flux),
            (None, None) => sources_dft(sources, uvw.view(), &freqs, !self.options.no_w, amplitude),
            (None, Some(grid)) => snapped_sources(grid, sources, uvw.view(), &freqs, amplitude),
        };
        for (row, vis) in rows.iter().zip(vis.axis_iter(Axis(0))) {
            let pair = (coverage.ant1[*row] as usize, coverage.ant2[*row] as usize);
            let mut first = 0;
            for chan in 0..self.freq_hz.len() {
                let sub = self.freq_hz[chan].len();
                let of = vis.slice(s![first..first + sub]);
                first += sub;
                let mean = match &self.band {
                    None => of.sum() / sub as f64,
                    Some(band) => of.iter().enumerate().map(|(j, v)| v * band.weight(pair, chan, j)).sum(),
                };
                for (pol, coefficient) in &terms {
                    sum[[*row, chan, *pol]] += mean * coefficient;
                }
            }
        }
    }
}

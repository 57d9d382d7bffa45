//! The data that pointings are fitted to, and the visibilities of the model times each product of two voltages.

use super::basis::{NODES, OffsetBasis, PRODUCTS, product};
use crate::calibrate::model::sees_unpolarized;
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer, Silent};
use crate::simulate::{Pedestal, SimulateOptions, Simulator, SkyModel};
use crate::values::need;
use crate::{ChainError, Result, ensure};
use cittert_arrays::pattern::{Pointing, Pointings};
use cittert_arrays::{
    ElementPattern, Image, Polarization, SpectralWindow, UvCoverage, VisUnit, VisibilityHeader, VisibilitySource, for_each_block,
};
use ndarray::{Array2, s};
use num_complex::{Complex, Complex64};

/// One baseline at one time: the weighted mean of the hands that see the model.
#[derive(Debug, Clone)]
pub(super) struct Row {
    pub(super) ants: [usize; 2],
    pub(super) time_jd: f64,
    /// \[chan\].
    pub(super) vis: Vec<Complex64>,
    /// \[chan\]; 0 where nothing is usable.
    pub(super) weight: Vec<f64>,
}

/// All rows of a source, flagged ones with weight 0, and their coverage.
pub(super) fn read(source: &mut dyn VisibilitySource) -> Result<(Vec<Row>, UvCoverage)> {
    let header = source.header().clone();
    let hands: Vec<usize> = (0..header.polarizations.len()).filter(|p| sees_unpolarized(header.polarizations[*p])).collect();
    ensure!(!hands.is_empty(), ChainError::Incompatible("no product of the set sees an unpolarised scene".into()));
    let n_chan = header.spectrum.n_chan();
    let bytes = source.n_rows().saturating_mul(n_chan).saturating_mul(24 + 8 * PRODUCTS);
    let most = MemoryBudget::default().kept_visibilities();
    let gib = |b: usize| format!("{:.1} GiB", b as f64 / f64::from(1 << 30));
    let expected = format!("at most {}: average the set in time or frequency, or raise --memory", gib(most));
    need("memory of the pointing solution", gib(bytes), bytes <= most, expected)?;
    let (mut rows, mut coverage) = (Vec::new(), Vec::new());
    for_each_block(source, MemoryBudget::default().block(), |_, block| -> Result<()> {
        for row in 0..block.n_rows() {
            let (mut vis, mut weight) = (vec![Complex64::ZERO; n_chan], vec![0.0; n_chan]);
            for (chan, (sum, weight)) in vis.iter_mut().zip(&mut weight).enumerate() {
                for pol in &hands {
                    let w = f64::from(block.usable_weight(row, chan, *pol));
                    let v = block.vis[(row, chan, *pol)];
                    if w > 0.0 && v.is_finite() {
                        *sum += Complex64::new(v.re.into(), v.im.into()) * w;
                        *weight += w;
                    }
                }
                if *weight > 0.0 {
                    *sum /= *weight;
                }
            }
            let lost = block.coverage.uvw_m.row(row).iter().any(|x| !x.is_finite());
            if lost || block.coverage.ant1[row] == block.coverage.ant2[row] {
                weight.fill(0.0);
            }
            let ants = [block.coverage.ant1[row] as usize, block.coverage.ant2[row] as usize];
            rows.push(Row { ants, time_jd: block.coverage.time_jd[row], vis, weight });
        }
        let mut rows = block.coverage;
        rows.uvw_m.iter_mut().filter(|x| !x.is_finite()).for_each(|x| *x = 0.0);
        coverage.push(rows);
        Ok(())
    })?;
    Ok((rows, joined(&coverage)?))
}

fn joined(parts: &[UvCoverage]) -> Result<UvCoverage> {
    let uvw: Vec<_> = parts.iter().map(|p| p.uvw_m.view()).collect();
    let uvw = ndarray::concatenate(ndarray::Axis(0), &uvw).map_err(|e| ChainError::NoData(format!("the set has no rows: {e}")))?;
    let of = |get: fn(&UvCoverage) -> &Vec<u32>| parts.iter().flat_map(|p| get(p).iter().copied()).collect();
    let times = |get: fn(&UvCoverage) -> &Vec<f64>| parts.iter().flat_map(|p| get(p).iter().copied()).collect();
    let centers = parts.iter().flat_map(|p| p.phase_center.iter().copied()).collect();
    Ok(UvCoverage::new(uvw, of(|p| &p.ant1), of(|p| &p.ant2), times(|p| &p.time_jd), times(|p| &p.integration_s), centers)?)
}

/// The scene before any pattern: an image that contains the pattern is divided by it, where it is not too weak.
pub(super) fn before_pattern(sky: &SkyModel) -> SkyModel {
    const WEAKEST: f64 = 0.02;
    let undimmed = |image: &Image| {
        let mut out = image.clone();
        let pattern = std::mem::take(&mut out.pattern);
        for (chan, freq) in image.spectrum.freq_hz().iter().enumerate() {
            let power = pattern.plane(&image.grid, *freq);
            let mut cube = out.data.slice_mut(s![chan, .., .., ..]);
            for mut plane in cube.outer_iter_mut() {
                plane.zip_mut_with(&power, |v, a| *v = if *a >= WEAKEST { *v / a } else { 0.0 });
            }
        }
        out
    };
    let images = sky.images.iter().map(|i| if i.pattern.is_none() { i.clone() } else { undimmed(i) }).collect();
    SkyModel { images, sources: sky.sources.clone(), surface: sky.surface.clone() }
}

/// Visibilities \[product of voltages\]\[row, chan\] of a scene on the rows of a set.
pub(super) struct Products {
    pub(super) of: Vec<Array2<Complex<f32>>>,
}

impl Products {
    /// Make them for a pattern and offsets.
    ///
    /// # Errors
    /// As [`Simulator::new`].
    pub(super) fn new(
        header: &VisibilityHeader,
        (pattern, basis): (&ElementPattern, &OffsetBasis),
        sky: &SkyModel,
        coverage: &UvCoverage,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let n_chan = header.spectrum.n_chan();
        let groups: Vec<Vec<usize>> =
            if pattern.varies_with_frequency() { (0..n_chan).map(|c| vec![c]).collect() } else { vec![(0..n_chan).collect()] };
        observer.event(Event::Phase { name: "predicting offsets", total: Some((groups.len() * PRODUCTS) as u64), unit: "planes" });
        let mut of = vec![Array2::zeros((coverage.n_rows(), n_chan)); PRODUCTS];
        for chans in &groups {
            let pick = |all: &[f64]| chans.iter().map(|c| all[*c]).collect::<Vec<f64>>();
            let spectrum = SpectralWindow::new(pick(header.spectrum.freq_hz()), pick(header.spectrum.width_hz()))?;
            let freq_hz = spectrum.freq_hz()[0];
            let mut plain = VisibilityHeader { spectrum, polarizations: vec![Polarization::I], ..header.clone() };
            plain.layout.pattern = ElementPattern::None;
            (plain.pedestal_k, plain.history) = (None, Vec::new());
            if plain.unit == VisUnit::Uncalibrated {
                plain.unit = VisUnit::Jy;
            }
            let voltages = Voltages::new(pattern, basis, freq_hz, sky, &plain)?;
            for k in 0..NODES {
                for l in 0..=k {
                    ensure!(!observer.cancelled(), ChainError::Cancelled);
                    let seen = voltages.product(sky, k, l);
                    let options = SimulateOptions { pedestal: Pedestal::None, ..SimulateOptions::default() };
                    let block = Simulator::new(plain.clone(), &seen, &options, &Silent)?.block(coverage.clone(), 0, &Silent)?;
                    for (column, chan) in chans.iter().enumerate() {
                        of[product(k, l)].column_mut(*chan).assign(&block.vis.slice(s![.., column, 0]));
                    }
                    observer.event(Event::Advance(1));
                }
            }
        }
        observer.event(Event::Done);
        Ok(Self { of })
    }
}

/// Voltages at the offsets of a basis, at the pixels of each image and at the sources.
struct Voltages {
    /// \[node\]\[image\]\[m, l\].
    images: Vec<Vec<Array2<f64>>>,
    /// \[node\]\[source\].
    sources: Vec<Vec<f64>>,
}

impl Voltages {
    fn new(pattern: &ElementPattern, basis: &OffsetBasis, freq_hz: f64, sky: &SkyModel, header: &VisibilityHeader) -> Result<Self> {
        let center = header.phase_centers.first().ok_or_else(|| ChainError::NoData("the set has no phase centre".into()))?;
        let places: Vec<(f64, f64)> = sky.sources.iter().map(|s| s.direction_cosines(center)).collect::<cittert_arrays::Result<_>>()?;
        let direction = |(l, m): (f64, f64)| [l, m, (1.0 - l * l - m * m).max(0.0).sqrt()];
        let (mut images, mut sources) = (Vec::new(), Vec::new());
        for [l, m] in basis.nodes() {
            let mut p = Pointings::nominal(vec![0.0], 1);
            p.antennas[[0, 0]] = Pointing { l, m, width: 1.0 };
            let at = |toward: Vec<[f64; 3]>| p.voltages(pattern, (0, 0), freq_hz, toward.into_iter()).collect::<Vec<f64>>();
            let plane = |image: &Image| {
                let g = &image.grid;
                let cells = (0..g.n_m * g.n_l).map(|k| direction((g.l_at((k % g.n_l) as f64), g.m_at((k / g.n_l) as f64)))).collect();
                Array2::from_shape_vec((g.n_m, g.n_l), at(cells)).unwrap_or_default()
            };
            images.push(sky.images.iter().map(plane).collect());
            sources.push(at(places.iter().map(|p| direction(*p)).collect()));
        }
        Ok(Self { images, sources })
    }

    /// The scene times the voltages of two offsets.
    fn product(&self, sky: &SkyModel, k: usize, l: usize) -> SkyModel {
        let mut out = sky.clone();
        for (index, image) in out.images.iter_mut().enumerate() {
            let seen = &self.images[k][index] * &self.images[l][index];
            image.data.outer_iter_mut().for_each(|mut cube| cube.outer_iter_mut().for_each(|mut plane| plane *= &seen));
        }
        for (index, source) in out.sources.iter_mut().enumerate() {
            source.flux_jy *= self.sources[k][index] * self.sources[l][index];
        }
        out
    }
}

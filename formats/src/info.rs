//! Summaries of files. Visibilities are read in one pass in constant memory. Numbers are in SI units; the key names the unit.

use cittert_arrays::{ArrayError, GainTable, Image, PhaseCenterKind, SkyFrame, VisibilitySource, for_each_block};
use serde::Serialize;
use std::collections::{BTreeMap, HashSet};

/// Size of the blocks of visibilities that are read, bytes.
const BLOCK_BYTES: usize = 1 << 24;

/// A phase centre in plain numbers.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct PhaseCenterInfo {
    /// Name of the field.
    pub name: String,
    /// `sidereal`, `unprojected` or `driftscan`.
    pub kind: &'static str,
    /// Celestial frame, such as `icrs`.
    pub frame: String,
    /// Right ascension (sidereal), rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ra_rad: Option<f64>,
    /// Declination (sidereal), rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dec_rad: Option<f64>,
    /// Azimuth (driftscan), rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub az_rad: Option<f64>,
    /// Elevation (driftscan), rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub el_rad: Option<f64>,
}

/// Summary of a set of visibilities.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VisibilityInfo {
    /// Name of the telescope.
    pub telescope: String,
    /// Name of the instrument.
    pub instrument: String,
    /// Names of all antennas of the array.
    pub antenna_names: Vec<String>,
    /// Number of antennas of the array.
    pub n_antennas: usize,
    /// Number of antennas that rows use.
    pub n_antennas_data: usize,
    /// Number of baseline-time rows.
    pub n_blts: usize,
    /// Number of different ordered antenna pairs.
    pub n_bls: usize,
    /// Number of different times.
    pub n_times: usize,
    /// Number of channels.
    pub n_freqs: usize,
    /// Number of polarisations.
    pub n_pols: usize,
    /// Names of the polarisations.
    pub polarizations: Vec<String>,
    /// Channel centres, Hz.
    pub freq_hz: Vec<f64>,
    /// Channel widths, Hz.
    pub channel_width_hz: Vec<f64>,
    /// Number of the spectral window of each channel.
    pub spectral_window: Vec<u32>,
    /// Mean length of an integration, s.
    pub integration_s: f64,
    /// First and last time, Julian date UTC.
    pub time_jd: [f64; 2],
    /// Unit of the visibilities.
    pub unit: String,
    /// `boresight` or `earth`.
    pub frame: &'static str,
    /// Phase centres.
    pub phase_centers: Vec<PhaseCenterInfo>,
    /// Constant brightness temperature that was removed from the scene, K.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pedestal_k: Option<f64>,
    /// Power pattern of the elements that the visibilities contain, as in layout files.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element_pattern: Option<String>,
    /// Surface on which the scene lies, as `plane METRES`, `sphere METRES` or `map NAME`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene_range: Option<String>,
    /// Point to which the visibilities are phased: l, m, and the distance in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus: Option<[f64; 3]>,
    /// Mean temperature that one element sees, by total power, K.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub antenna_temperature_k: Option<f64>,
    /// Longest baseline in the u-v plane, m.
    pub longest_baseline_m: f64,
    /// Shortest baseline between two antennas in the u-v plane, m.
    pub shortest_baseline_m: f64,
    /// Fraction of the data that are flagged.
    pub flagged_fraction: f64,
    /// Number of data that are not flagged, by polarisation.
    pub n_unflagged: BTreeMap<String, u64>,
    /// Mean |V| of the data that are not flagged, by polarisation.
    pub mean_abs_unflagged: BTreeMap<String, f64>,
    /// Number of data that are not flagged but have a weight or value that is not finite. Imaging ignores them.
    pub n_not_finite: u64,
    /// History of the data.
    pub history: Vec<String>,
}

impl VisibilityInfo {
    /// Read a source from end to end and sum it up.
    ///
    /// # Errors
    /// The first error of the source.
    pub fn of(source: &mut dyn VisibilitySource) -> Result<Self, ArrayError> {
        let header = source.header().clone();
        let n_pol = header.polarizations.len();
        let mut count = Count::new(n_pol);
        for_each_block::<ArrayError>(source, BLOCK_BYTES, |_, block| {
            count.add(&block);
            Ok(())
        })?;
        let names: Vec<String> = header.polarizations.iter().map(|p| p.name().to_string()).collect();
        let mean = (0..n_pol).map(|p| count.sum[p] / count.finite[p].max(1) as f64);
        let n_blts = source.n_rows();
        let all = (n_blts * header.spectrum.n_chan() * n_pol) as f64;
        let good: u64 = count.good.iter().sum();
        Ok(Self {
            antenna_names: header.layout.antennas().iter().map(|a| a.name.clone()).collect(),
            n_antennas: header.layout.n_ant(),
            n_antennas_data: count.antennas.len(),
            n_blts,
            n_bls: count.baselines.len(),
            n_times: count.times.len(),
            n_freqs: header.spectrum.n_chan(),
            n_pols: n_pol,
            freq_hz: header.spectrum.freq_hz().to_vec(),
            channel_width_hz: header.spectrum.width_hz().to_vec(),
            spectral_window: header.spectrum.spw().to_vec(),
            integration_s: count.integration_s / n_blts.max(1) as f64,
            time_jd: count.time_jd,
            unit: header.unit.name().to_string(),
            frame: if header.is_boresight() { "boresight" } else { "earth" },
            phase_centers: header.phase_centers.iter().map(phase_center).collect(),
            pedestal_k: header.pedestal_k,
            antenna_temperature_k: header.antenna_temperature_k,
            scene_range: header.near_field.scene.as_ref().map(ToString::to_string),
            focus: header.near_field.focus.map(|p| [p.l, p.m, p.range_m]),
            element_pattern: (!header.layout.pattern.is_none()).then(|| header.layout.pattern.to_string()),
            longest_baseline_m: count.longest_m,
            shortest_baseline_m: if count.shortest_m.is_finite() { count.shortest_m } else { 0.0 },
            flagged_fraction: if all > 0.0 { 1.0 - good as f64 / all } else { 0.0 },
            n_unflagged: names.iter().cloned().zip(count.good.iter().copied()).collect(),
            mean_abs_unflagged: names.iter().cloned().zip(mean).collect(),
            n_not_finite: count.not_finite,
            history: header.history.clone(),
            telescope: header.telescope,
            instrument: header.instrument,
            polarizations: names,
        })
    }
}

fn phase_center(c: &cittert_arrays::PhaseCenter) -> PhaseCenterInfo {
    let mut info = PhaseCenterInfo { name: c.name.clone(), kind: "unprojected", frame: c.frame.clone(), ..Default::default() };
    match c.kind {
        PhaseCenterKind::Sidereal { ra_rad, dec_rad } => {
            (info.kind, info.ra_rad, info.dec_rad) = ("sidereal", Some(ra_rad), Some(dec_rad));
        }
        PhaseCenterKind::Driftscan { az_rad, el_rad } => (info.kind, info.az_rad, info.el_rad) = ("driftscan", Some(az_rad), Some(el_rad)),
        PhaseCenterKind::Unprojected => {}
    }
    info
}

/// The sums of one pass over the data.
#[derive(Default)]
struct Count {
    baselines: HashSet<(u32, u32)>,
    antennas: HashSet<u32>,
    times: HashSet<u64>,
    time_jd: [f64; 2],
    integration_s: f64,
    longest_m: f64,
    shortest_m: f64,
    /// For each polarisation: number of data that are not flagged, number of these with a finite value, and the sum of |V| over the latter.
    good: Vec<u64>,
    finite: Vec<u64>,
    sum: Vec<f64>,
    not_finite: u64,
}

impl Count {
    fn new(n_pol: usize) -> Self {
        Self {
            time_jd: [f64::INFINITY, f64::NEG_INFINITY],
            shortest_m: f64::INFINITY,
            good: vec![0; n_pol],
            finite: vec![0; n_pol],
            sum: vec![0.0; n_pol],
            ..Self::default()
        }
    }

    fn add(&mut self, block: &cittert_arrays::VisibilityBlock) {
        let c = &block.coverage;
        for row in 0..c.n_rows() {
            let (a, b, t) = (c.ant1[row], c.ant2[row], c.time_jd[row]);
            self.baselines.insert((a, b));
            self.antennas.extend([a, b]);
            self.times.insert(t.to_bits());
            self.time_jd = [self.time_jd[0].min(t), self.time_jd[1].max(t)];
            self.integration_s += c.integration_s[row];
            let length = c.uvw_m[(row, 0)].hypot(c.uvw_m[(row, 1)]);
            self.longest_m = self.longest_m.max(length);
            if a != b {
                self.shortest_m = self.shortest_m.min(length);
            }
        }
        for (((_, _, pol), flag), (v, w)) in block.flags.indexed_iter().zip(block.vis.iter().zip(&block.weights)) {
            if *flag {
                continue;
            }
            self.good[pol] += 1;
            let finite = v.re.is_finite() && v.im.is_finite();
            if finite {
                self.finite[pol] += 1;
                let (re, im) = (f64::from(v.re), f64::from(v.im));
                // Squares of single precision stay within the range of double precision.
                self.sum[pol] += (re * re + im * im).sqrt();
            }
            if !(finite && w.is_finite()) {
                self.not_finite += 1;
            }
        }
    }
}

/// Summary of an image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImageInfo {
    /// Cells along l and m.
    pub size: [usize; 2],
    /// Size of a cell, rad.
    pub cell_rad: f64,
    /// `boresight`, or the name of the celestial frame.
    pub frame: String,
    /// Right ascension of the centre, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ra_rad: Option<f64>,
    /// Declination of the centre, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dec_rad: Option<f64>,
    /// Channel centres, Hz.
    pub freq_hz: Vec<f64>,
    /// Names of the polarisations.
    pub polarizations: Vec<String>,
    /// BUNIT.
    pub unit: String,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Root mean square of all values.
    pub rms: f64,
    /// Sum of all values.
    pub sum: f64,
    /// Values that are not finite.
    pub n_not_finite: usize,
    /// Beam of the first channel: major axis, minor axis (rad) and position angle (rad).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beam: Option<[f64; 3]>,
    /// Name of the object.
    pub object: String,
    /// Name of the telescope.
    pub telescope: String,
    /// History of the image.
    pub history: Vec<String>,
}

impl ImageInfo {
    /// Sum up an image.
    #[must_use]
    pub fn of(image: &Image) -> Self {
        let (frame, centre) = match &image.grid.frame {
            SkyFrame::Sky { ra_rad, dec_rad, frame } => (frame.clone(), Some((*ra_rad, *dec_rad))),
            SkyFrame::Boresight => ("boresight".into(), None),
        };
        let finite = || image.data.iter().filter(|v| v.is_finite());
        let n = finite().count();
        Self {
            size: [image.grid.n_l, image.grid.n_m],
            cell_rad: image.grid.cell_rad,
            frame,
            ra_rad: centre.map(|c| c.0),
            dec_rad: centre.map(|c| c.1),
            freq_hz: image.spectrum.freq_hz().to_vec(),
            polarizations: image.polarizations.iter().map(|p| p.name().to_string()).collect(),
            unit: image.unit.bunit().to_string(),
            range: finite().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], v| [lo.min(*v), hi.max(*v)]),
            rms: (finite().map(|v| v * v).sum::<f64>() / n.max(1) as f64).sqrt(),
            sum: finite().sum(),
            n_not_finite: image.data.len() - n,
            beam: image.beams.first().map(|b| [b.bmaj_rad, b.bmin_rad, b.bpa_rad]),
            object: image.object.clone(),
            telescope: image.telescope.clone(),
            history: image.history.clone(),
        }
    }
}

/// Summary of a gain table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GainInfo {
    /// Name of the telescope or layout.
    pub telescope: String,
    /// Names of the antennas.
    pub antenna_names: Vec<String>,
    /// Number of solution intervals.
    pub n_times: usize,
    /// Mean length of a solution interval, s.
    pub interval_s: f64,
    /// Channel centres, Hz.
    pub freq_hz: Vec<f64>,
    /// Names of the feeds.
    pub feeds: Vec<String>,
    /// Kind of the gains: phase, amplitude and phase, injected truth ...
    pub mode: String,
    /// Name of the reference antenna.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refant: Option<String>,
    /// Fraction of the gains that are flagged.
    pub flagged_fraction: f64,
    /// Mean amplitude of the gains that are not flagged.
    pub mean_amplitude: f64,
    /// Root mean square phase of the gains that are not flagged, rad.
    pub rms_phase_rad: f64,
    /// History of the table.
    pub history: Vec<String>,
}

impl GainInfo {
    /// Sum up a gain table.
    #[must_use]
    pub fn of(table: &GainTable) -> Self {
        let good = || table.gains.iter().zip(&table.flags).filter(|(g, f)| !**f && g.is_finite()).map(|(g, _)| g);
        let n = good().count().max(1) as f64;
        let flagged = table.flags.iter().filter(|f| **f).count() as f64;
        Self {
            telescope: table.layout.name.clone(),
            antenna_names: table.layout.antennas().iter().map(|a| a.name.clone()).collect(),
            n_times: table.time_jd.len(),
            interval_s: table.interval_s.iter().sum::<f64>() / table.interval_s.len().max(1) as f64,
            freq_hz: table.spectrum.freq_hz().to_vec(),
            feeds: table.feeds.clone(),
            mode: table.mode.clone(),
            refant: table.refant.and_then(|r| table.layout.antennas().get(r)).map(|a| a.name.clone()),
            flagged_fraction: flagged / table.flags.len().max(1) as f64,
            mean_amplitude: good().map(|g| g.norm()).sum::<f64>() / n,
            rms_phase_rad: (good().map(|g| g.arg().powi(2)).sum::<f64>() / n).sqrt(),
            history: table.history.clone(),
        }
    }
}

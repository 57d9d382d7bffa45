//! Changes to a set that UVFITS cannot hold as it is. Each change is noted for the user and in the history.

use crate::drift::{Drift, catalogue};
use crate::uvh5::{NOMINAL_SITE, site_of};
use cittert_arrays::astrometry::LocalSky;
use cittert_arrays::{ArrayError, PhaseCenter, PhaseCenterKind, Polarization, SpectralWindow, VisUnit, VisibilityHeader, jy_per_kelvin_sr};

/// One polarisation of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PolOut {
    /// AIPS number.
    pub(super) aips: i32,
    /// Index of the polarisation in the set; `None` fills a gap in the regular axis with flagged zeros.
    pub(super) from: Option<usize>,
    /// Factor on the weight.
    pub(super) weight: f32,
}

/// Channels as IFs of equal length.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Windows {
    pub(super) n_if: usize,
    pub(super) n_freq: usize,
    /// First channel of each IF, Hz.
    pub(super) first_hz: Vec<f64>,
    /// Step of the channels of each IF, Hz.
    pub(super) step_hz: Vec<f64>,
}

/// All decisions about one export.
#[derive(Debug, Clone)]
pub(super) struct Export {
    pub(super) pols: Vec<PolOut>,
    pub(super) windows: Windows,
    /// Factor on the visibilities of each channel.
    pub(super) jy: Vec<f64>,
    /// Numbers of the antennas in the file.
    pub(super) numbers: Vec<u32>,
    /// BUNIT.
    pub(super) unit: &'static str,
    pub(super) notes: Vec<String>,
}

impl Export {
    /// Decide how a set with this header is written. `stokes_i` keeps a set of Stokes I as it is.
    pub(super) fn of(header: &VisibilityHeader, stokes_i: bool) -> Self {
        let mut notes = Vec::new();
        moving_centers(header, &mut notes);
        let pols = polarizations(header, stokes_i, &mut notes);
        let windows = windows(&header.spectrum, &mut notes);
        let (jy, unit) = units(header, &mut notes);
        let numbers = numbers(header, &mut notes);
        if header.layout.antennas().iter().any(|a| a.sensitivity.is_some() || a.position_error_m.is_some()) {
            notes.push("SEFD, Tsys and position errors of the antennas are not kept".into());
        }
        Self { pols, windows, jy, numbers, unit, notes }
    }
}

/// Note the change of phase centres that are not points of the sky.
fn moving_centers(header: &VisibilityHeader, notes: &mut Vec<String>) {
    let moving = header.phase_centers.iter().any(|c| c.ra_dec_rad().is_none());
    if header.is_boresight() {
        let text = "the boresight became the zenith of an array at latitude 0, longitude 0 at the first time, and so a phase centre on the sky; \
                    east is right and north is up as seen from the sensor";
        notes.push(text.into());
    } else if moving {
        let text = "the set does not follow the sky: it was phased to the point where the array looked at the first time (ICRS), and uvw and \
                    visibilities were turned to it";
        notes.push(text.into());
    }
}

/// The sidereal phase centre of a boresight set: the zenith at `time_jd`.
pub(super) fn zenith(name: &str, time_jd: f64) -> Result<PhaseCenter, ArrayError> {
    let sky = LocalSky::at(time_jd, &NOMINAL_SITE)?;
    let (ra, dec, _) = catalogue(&sky, sky.lst_rad(), NOMINAL_SITE.latitude_rad)?;
    PhaseCenter::sidereal(name, ra, dec)
}

/// The phase centres as written, numbered from 1, and the phasing of the rows of an array that does not track the sky.
pub(super) fn phase_centers(header: &VisibilityHeader, time_jd: f64) -> Result<(Vec<PhaseCenter>, Option<Drift>), ArrayError> {
    let moving = header.phase_centers.iter().any(|c| c.ra_dec_rad().is_none());
    let drift = match header.layout.site().filter(|_| moving) {
        Some(site) => Some(Drift::new(&header.phase_centers, site, time_jd)?),
        None => None,
    };
    let on_the_sky = |c: &PhaseCenter| match c.kind {
        PhaseCenterKind::Sidereal { .. } => Ok(c.clone()),
        _ => zenith(&c.name, time_jd),
    };
    let mut centers = match &drift {
        Some(d) => d.centers.clone(),
        None => header.phase_centers.iter().map(on_the_sky).collect::<Result<Vec<_>, _>>()?,
    };
    centers.iter_mut().enumerate().for_each(|(k, c)| c.id = k as i64 + 1);
    Ok((centers, drift))
}

/// The polarisations of the file. STOKES must be a regular axis. Importers refuse Stokes I alone, so it becomes two equal hands.
fn polarizations(header: &VisibilityHeader, stokes_i: bool, notes: &mut Vec<String>) -> Vec<PolOut> {
    if header.polarizations == [Polarization::I] && !stokes_i {
        notes.push("Stokes I became two equal hands RR and LL of half the weight each (the sky is unpolarised)".into());
        return [-1, -2].map(|aips| PolOut { aips, from: Some(0), weight: 0.5 }).to_vec();
    }
    let mut present: Vec<(i32, usize)> = header.polarizations.iter().enumerate().map(|(k, p)| (p.aips(), k)).collect();
    present.sort_by_key(|p| p.0.abs());
    let step = present.get(1).map_or(1, |second| second.0 - present[0].0);
    if present.windows(2).all(|w| w[1].0 - w[0].0 == step) {
        return present.iter().map(|(aips, k)| PolOut { aips: *aips, from: Some(*k), weight: 1.0 }).collect();
    }
    // The numbers have a gap, or Stokes parameters and feed products are mixed: fill the axis from end to end.
    let (first, last) = (present.iter().map(|p| p.0).max().unwrap_or(1), present.iter().map(|p| p.0).min().unwrap_or(1));
    notes.push("the polarisations do not form a regular axis; the missing ones between them are written as flagged zeros".into());
    (last..=first)
        .rev()
        .filter(|n| *n != 0 || (first > 0 && last < 0))
        .map(|aips| PolOut { aips, from: present.iter().find(|p| p.0 == aips).map(|p| p.1), weight: 1.0 })
        .collect()
}

/// Divide the channels into IFs of equal length with evenly spaced channels as wide as their spacing. Where this is not possible, each
/// channel becomes one IF.
fn windows(spectrum: &SpectralWindow, notes: &mut Vec<String>) -> Windows {
    let (freq, width, spw) = (spectrum.freq_hz(), spectrum.width_hz(), spectrum.spw());
    let n = freq.len();
    let starts: Vec<usize> = (0..n).filter(|c| *c == 0 || spw[*c] != spw[*c - 1]).collect();
    let n_freq = n / starts.len();
    let equal = starts.iter().enumerate().all(|(k, s)| *s == k * n_freq) && n_freq * starts.len() == n;
    let step = |s: usize| if n_freq > 1 { freq[s + 1] - freq[s] } else { width[s] };
    let even = |s: &usize| {
        let d = step(*s);
        (*s..s + n_freq)
            .all(|c| (freq[c] - freq[*s] - (c - s) as f64 * d).abs() <= 1e-6 * d.abs() && (width[c] - d.abs()).abs() <= 1e-6 * d.abs())
    };
    if equal && starts.iter().all(even) {
        let first_hz = starts.iter().map(|s| freq[*s]).collect();
        return Windows { n_if: starts.len(), n_freq, first_hz, step_hz: starts.iter().map(|s| step(*s)).collect() };
    }
    notes.push(
        "the channels are not evenly spaced (or wider or narrower than their spacing): each became a spectral window (IF) of its own"
            .into(),
    );
    Windows { n_if: n, n_freq: 1, first_hz: freq.to_vec(), step_hz: width.to_vec() }
}

/// Factors to the unit of the file. K str becomes Jy: S = 2 k f^2 / c^2 times the integral of brightness temperature over solid angle.
fn units(header: &VisibilityHeader, notes: &mut Vec<String>) -> (Vec<f64>, &'static str) {
    if let Some(pedestal) = header.pedestal_k {
        notes.push(format!("a constant of {pedestal} K was removed from the scene before the transform; images of this file lack it"));
    }
    if !header.layout.pattern.is_none() && header.layout.pattern.parameters().is_none() {
        notes.push("the pattern of the elements is a table of samples, which UVFITS does not hold: keep it in UVH5".into());
    }
    let n = header.spectrum.n_chan();
    match header.unit {
        VisUnit::Jy => (vec![1.0; n], "Jy"),
        VisUnit::Uncalibrated => (vec![1.0; n], "uncalib"),
        VisUnit::KelvinSr => {
            let text = "K str became Jy: multiplied by 2 k f^2 / c^2 in each channel; weights became 1/Jy^2, or stayed near 1 where no noise is known";
            notes.push(text.into());
            (header.spectrum.freq_hz().iter().map(|f| jy_per_kelvin_sr(*f)).collect(), "Jy")
        }
    }
}

/// Antenna numbers in the file. Importers count antennas from 1, and BASELINE holds numbers up to 255.
fn numbers(header: &VisibilityHeader, notes: &mut Vec<String>) -> Vec<u32> {
    let own: Vec<u32> = header.layout.antennas().iter().map(|a| a.number).collect();
    let (least, most) = (own.iter().min().copied().unwrap_or(1), own.iter().max().copied().unwrap_or(1));
    let largest = if own.len() <= 255 { 255 } else { 65_535 };
    if least >= 1 && most <= largest {
        return own;
    }
    if least == 0 && most < largest {
        notes.push("antenna numbers were raised by 1, because importers count from 1".into());
        return own.iter().map(|n| n + 1).collect();
    }
    notes.push("antennas were renumbered from 1 in their order, because BASELINE holds numbers up to 255".into());
    (1..=own.len() as u32).collect()
}

/// Place of the array on the Earth.
pub(super) fn site(header: &VisibilityHeader) -> cittert_arrays::Site {
    site_of(&header.layout)
}

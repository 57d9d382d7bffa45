//! Delays read as gains. The gain of a delay has modulus 1 and phase 0 at frequency 0.
//!
//! The gain of a delay tau is exp(-2 pi i nu tau), which is the default sign of pyuvdata. Files written by cittert state the sign in the
//! keyword `cittert_delay_convention`.

use super::names::CONVENTION_KEYWORD;
use crate::h5::H5In;
use crate::{FormatError, Result};
use cittert_arrays::SpectralWindow;
use ndarray::{Array4, Ix4, s};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Largest phase step between two channels that are made for a delay, rad.
const FINE_RAD: f64 = 0.05;
/// Largest number of channels that are made for the delays of a spectral window.
const MOST_CHANNELS: usize = 4096;

/// The gains of delays \[ant, chan, time, jones\].
pub(super) struct DelayGains {
    pub(super) gains: Array4<Complex64>,
    pub(super) spectrum: SpectralWindow,
    /// For each channel, the index along the axis of the file, where flags and qualities are found.
    pub(super) own: Vec<usize>,
}

/// Channels of a set, window by window.
pub(super) fn windows(spectrum: &SpectralWindow) -> Vec<Vec<usize>> {
    let mut numbers: Vec<u32> = spectrum.spw().to_vec();
    numbers.sort_unstable();
    numbers.dedup();
    numbers.iter().map(|w| (0..spectrum.n_chan()).filter(|c| spectrum.spw()[*c] == *w).collect()).collect()
}

/// Centre and width of each window, Hz.
pub(super) fn extents(spectrum: &SpectralWindow) -> (Vec<f64>, Vec<f64>) {
    let (freq, width) = (spectrum.freq_hz(), spectrum.width_hz());
    let extent = |channels: &Vec<usize>| {
        let low = channels.iter().map(|c| freq[*c] - width[*c].abs() / 2.0).fold(f64::INFINITY, f64::min);
        let high = channels.iter().map(|c| freq[*c] + width[*c].abs() / 2.0).fold(0.0, f64::max);
        ((low + high) / 2.0, high - low)
    };
    windows(spectrum).iter().map(extent).unzip()
}

/// Read the delays of a file as gains: at `channels` where given, else at the channels of the file, else at channels made for the delays.
/// `ranges` are the spectral windows.
pub(super) fn read(file: &H5In, ranges: SpectralWindow, shape: [usize; 4], channels: Option<&SpectralWindow>) -> Result<DelayGains> {
    let dataset = file.numbers("Data/delays", &[&shape])?;
    let delays: Array4<f64> = file.rows::<_, Ix4>(&dataset, "Data/delays", 0..shape[0])?;
    let sign = match file.text(&format!("Header/extra_keywords/{CONVENTION_KEYWORD}"))?.as_deref() {
        None | Some("minus") => -1.0,
        Some("plus") => 1.0,
        Some(other) => return Err(file.wrong(CONVENTION_KEYWORD, "minus or plus", format!("{other:?}"))),
    };
    let spectrum = match channels {
        Some(c) => c.clone(),
        None if file.has("Header/freq_array") => crate::uvh5::read_spectrum(file)?,
        None => made(file, &ranges, &delays)?,
    };
    // A channel belongs to the window that contains it, else to the nearest window.
    let distance = |f: f64, w: usize| ((f - ranges.freq_hz()[w]).abs() - ranges.width_hz()[w].abs() / 2.0).max(0.0);
    let nearest = |f: &f64| (0..shape[1]).min_by(|a, b| distance(*f, *a).total_cmp(&distance(*f, *b))).unwrap_or(0);
    let own: Vec<usize> = spectrum.freq_hz().iter().map(nearest).collect();
    let gains = Array4::from_shape_fn((shape[0], own.len(), shape[2], shape[3]), |(a, c, t, j)| {
        Complex64::from_polar(1.0, (sign * TAU * spectrum.freq_hz()[c] * delays[(a, own[c], t, j)]) % TAU)
    });
    Ok(DelayGains { gains, spectrum, own })
}

/// Make channels so narrow that the phase of a gain changes little from one to the next.
fn made(file: &H5In, ranges: &SpectralWindow, delays: &Array4<f64>) -> Result<SpectralWindow> {
    let (mut freq, mut width, mut spw) = (Vec::new(), Vec::new(), Vec::new());
    for (w, (centre, range)) in ranges.freq_hz().iter().zip(ranges.width_hz()).enumerate() {
        let longest = delays.slice(s![.., w, .., ..]).iter().filter(|d| d.is_finite()).fold(0.0_f64, |m, d| m.max(d.abs()));
        let n = (TAU * longest * range.abs() / FINE_RAD).ceil().clamp(2.0, MOST_CHANNELS as f64) as usize;
        let step = range.abs() / n as f64;
        freq.extend((0..n).map(|k| centre - range.abs() / 2.0 + (k as f64 + 0.5) * step));
        width.extend(std::iter::repeat_n(step, n));
        spw.extend(std::iter::repeat_n(w as u32, n));
    }
    SpectralWindow::with_windows(freq, width, spw).map_err(|e| FormatError::values(file.path(), e))
}

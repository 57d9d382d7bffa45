//! What all rows share: channels, polarisations, units, history.

use super::{PEDESTAL_KEYWORD, layout, phase};
use crate::h5::{H5In, H5Out};
use crate::{FormatError, Result};
use cittert_arrays::{Polarization, SpectralWindow, VisUnit, VisibilityHeader};
use ndarray::Array1;

/// Write everything that does not depend on the rows.
pub(super) fn write(out: &H5Out, header: &VisibilityHeader) -> Result<()> {
    out.text("Header/version", "1.2")?;
    layout::write_telescope(out, &header.layout, &header.telescope, &header.instrument)?;
    write_spectrum(out, &header.spectrum)?;
    let pols = Array1::from_iter(header.polarizations.iter().map(|p| i64::from(p.aips())));
    out.scalar("Header/Npols", pols.len() as i64)?;
    out.array("Header/polarization_array", pols.view())?;
    out.text("Header/vis_units", header.unit.name())?;
    if header.unit != VisUnit::Uncalibrated {
        // Stokes I is half the sum of the parallel hands here, so a source of 1 Jy has XX = YY = 1 Jy.
        out.text("Header/pol_convention", "avg")?;
    }
    phase::write_catalog(out, &header.phase_centers)?;
    if let Some(pedestal) = header.pedestal_k {
        out.scalar(&format!("Header/extra_keywords/{PEDESTAL_KEYWORD}"), pedestal)?;
    }
    out.text("Header/history", &header.history.join("\n"))
}

/// Channels, as UVH5 and CalH5 share them.
pub(crate) fn write_spectrum(out: &H5Out, spectrum: &SpectralWindow) -> Result<()> {
    let mut windows: Vec<u32> = spectrum.spw().to_vec();
    windows.sort_unstable();
    windows.dedup();
    out.scalar("Header/Nfreqs", spectrum.n_chan() as i64)?;
    out.scalar("Header/Nspws", windows.len() as i64)?;
    out.array("Header/freq_array", Array1::from_vec(spectrum.freq_hz().to_vec()).view())?;
    out.array("Header/channel_width", Array1::from_vec(spectrum.width_hz().to_vec()).view())?;
    out.array("Header/spw_array", Array1::from_iter(windows.iter().map(|w| i64::from(*w))).view())?;
    out.array("Header/flex_spw_id_array", Array1::from_iter(spectrum.spw().iter().map(|w| i64::from(*w))).view())?;
    out.scalar("Header/flex_spw", windows.len() > 1)
}

/// Read everything that does not depend on the rows.
pub(super) fn read(file: &H5In) -> Result<VisibilityHeader> {
    let (layout, telescope) = layout::read_telescope(file)?;
    let spectrum = read_spectrum(file)?;
    if file.has("Header/flex_spw_polarization_array") {
        return Err(FormatError::unsupported(
            file.path(),
            "each spectral window has its own polarisation (flex_spw_polarization_array): split the file by polarisation first",
        ));
    }
    let n_pol = file.count("Header/Npols")?;
    let polarizations = file
        .list("Header/polarization_array", n_pol)?
        .into_iter()
        .map(|p| Polarization::from_aips(p as i32))
        .collect::<std::result::Result<Vec<_>, _>>()
        .map_err(|e| FormatError::values(file.path(), e))?;
    if polarizations.is_empty() {
        return Err(file.wrong("Header/Npols", "at least 1", "0"));
    }
    let history = file.text("Header/history")?.unwrap_or_default();
    Ok(VisibilityHeader {
        layout,
        spectrum,
        polarizations,
        phase_centers: phase::read_catalog(file)?,
        unit: VisUnit::from_name(&file.text("Header/vis_units")?.unwrap_or_default()),
        telescope,
        instrument: file.text("Header/instrument")?.unwrap_or_default(),
        pedestal_k: file.real(&format!("Header/extra_keywords/{PEDESTAL_KEYWORD}"))?,
        history: history.lines().map(String::from).collect(),
    })
}

/// Channels of any version of the format.
pub(crate) fn read_spectrum(file: &H5In) -> Result<SpectralWindow> {
    let n = file.count("Header/Nfreqs")?;
    let freq = file.list("Header/freq_array", n)?;
    let (shape, mut width) = file.reals("Header/channel_width")?.ok_or_else(|| file.missing("Header/channel_width"))?;
    if width.len() == 1 {
        width = vec![width[0]; n];
    }
    if width.len() != n {
        return Err(file.wrong("Header/channel_width", format!("one number, or {n}"), format!("shape {shape:?}")));
    }
    let windows = file.reals("Header/spw_array")?.map(|s| s.1).unwrap_or_default();
    let spw = match file.reals("Header/flex_spw_id_array")? {
        Some((_, ids)) if ids.len() == n => {
            // Numbers of windows may be anything; their order in spw_array is what we keep.
            ids.iter().map(|id| windows.iter().position(|w| w == id).unwrap_or(0) as u32).collect()
        }
        _ => vec![0; n],
    };
    SpectralWindow::with_windows(freq, width, spw).map_err(|e| FormatError::values(file.path(), e))
}

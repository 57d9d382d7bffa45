//! The header: channels, polarisations, units, history.

use super::names::{ANTENNA_TEMPERATURE_KEYWORD, PEDESTAL_KEYWORD, SCENE_PEDESTAL_KEYWORD, SCENE_WIDTH_KEYWORD};
use super::{annotations, layout, near_field, pattern, phase};
use crate::h5::{H5In, H5Out};
use crate::{FormatError, Result};
use cittert_arrays::{PhaseCenterKind, Polarization, SpectralWindow, VisUnit, VisibilityHeader};
use ndarray::Array1;

/// Write everything that does not depend on the rows.
pub(super) fn write(out: &H5Out, header: &VisibilityHeader) -> Result<()> {
    out.text("Header/version", "1.2")?;
    layout::write_telescope(out, &header.layout, &header.telescope, &header.instrument, &header.annotations.mounts)?;
    annotations::write(out, &header.annotations, header.layout.n_ant())?;
    pattern::write(out, &header.layout.pattern)?;
    near_field::write(out, &header.near_field)?;
    write_spectrum(out, &header.spectrum)?;
    let pols = Array1::from_iter(header.polarizations.iter().map(|p| i64::from(p.aips())));
    out.scalar("Header/Npols", pols.len() as i64)?;
    out.array("Header/polarization_array", pols.view())?;
    out.text("Header/vis_units", header.unit.name())?;
    if header.unit != VisUnit::Uncalibrated {
        // Stokes I is half the sum of the parallel hands, so a source of 1 Jy has XX = YY = 1 Jy.
        out.text("Header/pol_convention", "avg")?;
    }
    phase::write_catalog(out, &header.phase_centers)?;
    let simulated = [
        (PEDESTAL_KEYWORD, header.pedestal_k),
        (SCENE_PEDESTAL_KEYWORD, header.scene_pedestal_k),
        (SCENE_WIDTH_KEYWORD, header.scene_width_rad),
        (ANTENNA_TEMPERATURE_KEYWORD, header.antenna_temperature_k),
    ];
    for (key, value) in simulated {
        if let Some(value) = value {
            out.scalar(&format!("Header/extra_keywords/{key}"), value)?;
        }
    }
    out.text("Header/history", &header.history.join("\n"))
}

/// Write the channels; UVH5 and CalH5 share this part.
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
    let (mut layout, telescope) = layout::read_telescope(file)?;
    layout.pattern = pattern::read(file)?;
    let spectrum = read_spectrum(file)?;
    if file.has("Header/flex_spw_polarization_array") {
        return Err(FormatError::unsupported(
            file.path(),
            "each spectral window has its own polarisation (flex_spw_polarization_array): split the file by polarisation first",
        ));
    }
    let n_pol = file.count("Header/Npols")?;
    let product = |number: f64| match Polarization::from_aips(number as i32) {
        Ok(product) if number.fract() == 0.0 => Ok(product),
        _ => Err(file.wrong("Header/polarization_array", "numbers 1 to 4 or -1 to -8", number.to_string())),
    };
    let polarizations = file.list("Header/polarization_array", n_pol)?.into_iter().map(product).collect::<Result<Vec<_>>>()?;
    if polarizations.is_empty() {
        return Err(file.wrong("Header/Npols", "at least 1", "0"));
    }
    let history = file.text("Header/history")?.unwrap_or_default();
    let annotations = annotations::read(file, &layout)?;
    Ok(VisibilityHeader {
        layout,
        annotations,
        spectrum,
        polarizations,
        phase_centers: phase::read_catalog(file)?,
        unit: VisUnit::from_name(&file.text("Header/vis_units")?.unwrap_or_default()),
        telescope,
        instrument: file.text("Header/instrument")?.unwrap_or_default(),
        pedestal_k: file.real(&format!("Header/extra_keywords/{PEDESTAL_KEYWORD}"))?,
        scene_pedestal_k: file.real(&format!("Header/extra_keywords/{SCENE_PEDESTAL_KEYWORD}"))?,
        scene_width_rad: file.real(&format!("Header/extra_keywords/{SCENE_WIDTH_KEYWORD}"))?.filter(|w| *w > 0.0),
        antenna_temperature_k: file.real(&format!("Header/extra_keywords/{ANTENNA_TEMPERATURE_KEYWORD}"))?,
        near_field: near_field::read(file)?,
        history: history.lines().map(String::from).collect(),
    })
}

/// Read the channels of any version of the format.
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
    let spw = if file.reals("Header/flex_spw_id_array")?.is_none() {
        vec![0; n]
    } else {
        // The windows may have any numbers. The order in spw_array is kept.
        let windows = file.reals("Header/spw_array")?.ok_or_else(|| file.missing("Header/spw_array"))?.1;
        let index = |id: f64| {
            let found = windows.iter().position(|w| *w == id).map(|k| k as u32);
            found.ok_or_else(|| file.wrong("Header/flex_spw_id_array", "numbers of Header/spw_array", id.to_string()))
        };
        file.list("Header/flex_spw_id_array", n)?.into_iter().map(index).collect::<Result<_>>()?
    };
    SpectralWindow::with_windows(freq, width, spw).map_err(|e| FormatError::values(file.path(), e))
}

/// The first difference between two headers that changes the meaning of rows: its name and the two values.
pub(super) fn difference(a: &VisibilityHeader, b: &VisibilityHeader) -> Option<(&'static str, String, String)> {
    let text = |h: &VisibilityHeader| -> Vec<(&'static str, String)> {
        let antennas = h.layout.antennas();
        let names = antennas.iter().map(|x| format!("{}={}", x.number, x.name)).collect::<Vec<_>>().join(" ");
        // Positions are compared to 0.1 mm, directions to 1e-8 rad.
        let places = antennas.iter().map(|x| x.position_m.map(|v| format!("{:.4}", v + 0.0)).join(",")).collect::<Vec<_>>().join(" ");
        let centers = h.phase_centers.iter().map(|c| match c.kind {
            PhaseCenterKind::Sidereal { ra_rad, dec_rad } => format!("{} {:.8} {:.8} {}", c.name, ra_rad, dec_rad, c.frame),
            kind => format!("{} {kind:?}", c.name),
        });
        vec![
            ("frame", if h.is_boresight() { "boresight" } else { "earth" }.to_string()),
            ("antennas", names),
            ("positions of the antennas", places),
            ("channels", format!("{:?}", h.spectrum.freq_hz())),
            ("widths of channels", format!("{:?}", h.spectrum.width_hz())),
            ("polarisations", h.polarizations.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")),
            ("phase centres", centers.collect::<Vec<_>>().join("; ")),
            ("unit", h.unit.name().to_string()),
            ("pattern of the elements", h.layout.pattern.to_string()),
            ("range and focus", format!("{:?}", h.near_field)),
            ("receivers", format!("{:?}", antennas.iter().map(|a| a.receiver).collect::<Vec<_>>())),
            ("pedestal", format!("{:?}", h.pedestal_k)),
            ("pedestal that suits the scene", format!("{:?}", h.scene_pedestal_k)),
        ]
    };
    let short = |t: String| if t.chars().count() > 120 { format!("{}...", t.chars().take(120).collect::<String>()) } else { t };
    let pairs = text(a).into_iter().zip(text(b));
    pairs.filter(|((_, x), (_, y))| x != y).map(|((place, x), (_, y))| (place, short(x), short(y))).next()
}

//! Station tables of eht-imaging: `NAME X Y Z SEFD` or `NAME X Y Z SEFDR SEFDL FR_PAR FR_EL FR_OFF DR_RE DR_IM DL_RE DL_IM`,
//! geocentric metres and Jy.

use super::error::{LayoutError, ReadContext, Result};
use super::text::{self, Keeps, Line};
use crate::format::{Label, LayoutFormat};
use cittert_arrays::{Antenna, ArrayLayout, BOLTZMANN_J_PER_K, JANSKY_W_M2_HZ, Sensitivity};
use std::fmt::Write;

pub(crate) struct EhtimText;

const COLUMNS: &str = "NAME X Y Z SEFD, or NAME X Y Z SEFDR SEFDL and up to seven feed columns";

impl LayoutFormat for EhtimText {
    fn label(&self) -> Label {
        Label { name: "ehtim", extensions: &["txt"], description: "eht-imaging station table: names, geocentric positions, SEFDs" }
    }

    fn sniff(&self, text: &str, _: &str) -> bool {
        let named = |l: &Line<'_>| l.fields.len() >= 4 && l.fields[0].parse::<f64>().is_err() && l.fields[1].parse::<f64>().is_ok();
        text::lines(text).find(|l| !is_head(l)).is_some_and(|l| named(&l))
    }

    fn read(&self, text: &str, context: &ReadContext) -> Result<ArrayLayout> {
        let mut antennas = Vec::new();
        for l in text::lines(text).filter(|l| !is_head(l)) {
            if !(5..=13).contains(&l.fields.len()) {
                return Err(l.expected(COLUMNS));
            }
            let position_m = [l.number(1, "X")?, l.number(2, "Y")?, l.number(3, "Z")?];
            if position_m == [0.0; 3] {
                return Err(l.expected("a station on the ground (0, 0, 0 stands for a spacecraft, whose orbit is not read)"));
            }
            let right = l.number(4, "SEFDR")?;
            let left = if l.fields.len() > 5 { l.number(5, "SEFDL")? } else { right };
            if right < 0.0 || left < 0.0 {
                return Err(l.expected("SEFDs that are not negative (0 where unknown)"));
            }
            // The geometric mean of both hands is used. Zero means an ideal or unknown station.
            let sefd_jy = (right * left).sqrt();
            let sensitivity = (sefd_jy > 0.0).then_some(Sensitivity::SefdJy(sefd_jy));
            antennas.push(Antenna { sensitivity, ..Antenna::new(l.fields[0], antennas.len() as u32, position_m) });
        }
        Ok(ArrayLayout::from_ecef(context.name.clone(), context.site, antennas)?)
    }

    fn write(&self, layout: &ArrayLayout) -> Result<String> {
        let refuse = |reason: String| LayoutError::Cannot { format: "ehtim", reason };
        let Some(places) = layout.ecef_m() else {
            return Err(refuse("it is in the boresight frame, and a station table needs places on the Earth".into()));
        };
        let mut t = String::from("#NAME X Y Z SEFDR SEFDL FR_PAR_ANGLE FR_ELEV_ANGLE FR_OFFSET[d] DR_RE DR_IM DL_RE DL_IM\n");
        for (a, [x, y, z]) in layout.antennas().iter().zip(places) {
            let Some(sefd) = sefd_jy(a) else {
                return Err(refuse(format!("antenna {:?} has neither an SEFD nor a Tsys with a diameter", a.name)));
            };
            // Writing to a String cannot fail.
            let _ = writeln!(t, "{} {x:.7} {y:.7} {z:.7} {sefd} {sefd} 1 0 0 0 0 0 0", text::one_field(&a.name));
        }
        Ok(t)
    }

    fn loses(&self, layout: &ArrayLayout) -> Vec<String> {
        let mut lost = text::lost(layout, Keeps { names: true, sensitivities: true, ..Keeps::default() });
        if layout.antennas().iter().any(|a| matches!(a.sensitivity, Some(Sensitivity::TsysK(_)))) {
            lost.push("Tsys (it becomes the SEFD of a full aperture, efficiency 1)".into());
        }
        lost
    }
}

/// The optional head line without a `#`.
fn is_head(l: &Line<'_>) -> bool {
    l.number == 1 && (l.fields[0].eq_ignore_ascii_case("site") || l.fields[0].eq_ignore_ascii_case("name"))
}

/// The SEFD as given, or computed from Tsys for a circular aperture with the diameter of the antenna.
fn sefd_jy(a: &Antenna) -> Option<f64> {
    match (a.sensitivity?, a.diameter_m) {
        (Sensitivity::SefdJy(v), _) => Some(v),
        (Sensitivity::TsysK(t), Some(d)) => Some(2.0 * BOLTZMANN_J_PER_K * t / (std::f64::consts::PI * d * d / 4.0) / JANSKY_W_M2_HZ),
        (Sensitivity::TsysK(_), None) => None,
    }
}

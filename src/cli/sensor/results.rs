//! The figures of a sensor as JSON, text and CSV.

use crate::cli::text::angle;
use crate::fidelity::Fidelity;
use crate::sensor::{Ensquared, Modulation, Sensor};
use cittert_arrays::Image;
use cittert_arrays::quantity::{Duration, Frequency};
use serde_json::{Value, json};
use std::path::Path;

/// Points of the curves.
const POINTS: usize = 129;

/// What the sensor has made, and what it is like.
pub(super) struct Results<'a> {
    pub(super) sensor: &'a Sensor,
    /// Mean variance of each part of the noise, K^2.
    pub(super) parts: Vec<(&'static str, f64)>,
    pub(super) psf: Image,
    pub(super) image: Image,
    pub(super) nedt: Image,
    /// Scores of the image, and of the one beside it.
    pub(super) own: Fidelity,
    pub(super) other: Option<Fidelity>,
}

impl Results<'_> {
    /// Noise of a typical pixel, K: root of the mean variance.
    pub(super) fn nedt_k(&self) -> f64 {
        self.nedt.data.mapv(|v| v * v).mean().unwrap_or(0.0).sqrt()
    }

    /// Modulation at the highest frequency that the samples can show.
    pub(super) fn at_nyquist(&self) -> Modulation {
        self.sensor.modulation_at(0.5 / self.sensor.grid().cell_rad)
    }

    /// Energy in a square as wide as a sample.
    pub(super) fn in_pitch(&self) -> Ensquared {
        let pitch = self.sensor.grid().cell_rad;
        self.sensor.ensquared(&[pitch]).pop().unwrap_or(Ensquared { width_rad: pitch, optics: 0.0, total: 0.0 })
    }

    pub(super) fn modulation(&self) -> Vec<Modulation> {
        self.sensor.modulation(POINTS)
    }

    /// Energy in squares to 16 times the finest detail of the optics, or 4 times the width of the PSF.
    pub(super) fn ensquared(&self) -> Vec<Ensquared> {
        let [_, total] = self.sensor.widths_rad();
        let widest = (16.0 / self.sensor.cutoff()).max(4.0 * total[0].max(total[1]));
        let widths: Vec<f64> = (0..POINTS).map(|k| widest * k as f64 / (POINTS - 1) as f64).collect();
        self.sensor.ensquared(&widths)
    }

    pub(super) fn json(&self, prefix: &Path) -> Value {
        let (sensor, band) = (self.sensor, self.sensor.band());
        let [optics, total] = sensor.widths_rad();
        let (footprint, path) = sensor.smear_rad();
        let (nyquist, pitch) = (self.at_nyquist(), self.in_pitch());
        let grid = sensor.grid();
        let mut json = json!({
            "output": prefix,
            "unit": "K",
            "size": [grid.n_l, grid.n_m],
            "cell_rad": grid.cell_rad,
            "freq_hz": band.freq_hz,
            "bandwidth_hz": band.bandwidth_hz,
            "aperture_m2": sensor.optics().area_m2(),
            "strehl": sensor.optics().strehl((0.0, 0.0)),
            "optics_fwhm_l_rad": optics[0],
            "optics_fwhm_m_rad": optics[1],
            "fwhm_l_rad": total[0],
            "fwhm_m_rad": total[1],
            "cutoff_cycles_per_rad": sensor.cutoff(),
            "mtf_at_nyquist_l": nyquist.total()[0],
            "mtf_at_nyquist_m": nyquist.total()[1],
            "ensquared_in_pitch": pitch.total,
            "optics_ensquared_in_pitch": pitch.optics,
            "footprint_rad": footprint,
            "smear_l_rad": path.0,
            "smear_m_rad": path.1,
            "dwell_s": sensor.dwell_s(),
            "n_detectors": sensor.detectors(),
            "nedt_k": self.nedt_k(),
            "noise_parts_k": self.parts.iter().map(|(name, v)| (name.to_string(), v.sqrt().into())).collect::<serde_json::Map<_, _>>(),
            "truth": scores(&self.own),
        });
        if let Some(other) = &self.other {
            json["beside"] = scores(other);
        }
        json
    }

    /// Names and values, for people.
    pub(super) fn rows(&self) -> Vec<(String, String)> {
        let (sensor, band) = (self.sensor, self.sensor.band());
        let [optics, total] = sensor.widths_rad();
        let (footprint, path) = sensor.smear_rad();
        let grid = sensor.grid();
        let two = |w: [f64; 2]| format!("{} x {}", angle(w[0]), angle(w[1]));
        let mut rows = vec![
            ("image".to_owned(), format!("{} x {} samples of {}", grid.n_l, grid.n_m, angle(grid.cell_rad))),
            ("band".to_owned(), format!("{:.4} around {:.4}", Frequency(band.bandwidth_hz), Frequency(band.freq_hz))),
            ("open aperture".to_owned(), format!("{:.4} m2", sensor.optics().area_m2())),
            ("Strehl ratio".to_owned(), format!("{:.4}", sensor.optics().strehl((0.0, 0.0)))),
            ("width of the PSF, optics".to_owned(), two(optics)),
            ("width of the PSF, all".to_owned(), two(total)),
        ];
        let mut row = |name: &str, value: String| rows.push((name.to_owned(), value));
        if footprint > 0.0 {
            row("width of a detector", angle(footprint));
        }
        if path != (0.0, 0.0) {
            row("motion in a sample", angle(path.0.hypot(path.1)));
        }
        let nyquist = self.at_nyquist().total();
        row("MTF at half a cycle a sample", format!("{:.4} x {:.4}", nyquist[0], nyquist[1]));
        row("energy in a sample", format!("{:.1} %", 100.0 * self.in_pitch().total));
        row(
            "dwell",
            format!(
                "{:.4} with {} detector{}",
                Duration(sensor.dwell_s()),
                sensor.detectors(),
                if sensor.detectors() == 1 { "" } else { "s" }
            ),
        );
        row("noise", format!("{:.4} K", self.nedt_k()));
        for (name, variance) in &self.parts {
            row(&format!("  {name}"), format!("{:.4} K", variance.sqrt()));
        }
        rows
    }

    pub(super) fn text(&self) -> String {
        let mut lines: Vec<String> = self.rows().iter().map(|(name, value)| format!("{name:30} {value}")).collect();
        lines.push(String::new());
        lines.push(format!("{:30} {:>14} {:>14}", "against the truth", "sensor", if self.other.is_some() { "beside" } else { "" }));
        for (name, own, other) in self.score_rows() {
            lines.push(format!("{name:30} {own:>14} {other:>14}").trim_end().to_owned());
        }
        lines.join("\n")
    }

    /// Scores of the image and of the one beside it.
    pub(super) fn score_rows(&self) -> Vec<(&'static str, String, String)> {
        let row = |name, of: &dyn Fn(&Fidelity) -> String| (name, of(&self.own), self.other.as_ref().map(of).unwrap_or_default());
        vec![
            row("rms difference", &|s| format!("{:.3} K", s.rms_difference)),
            row("error over that of a grey card", &|s| format!("{:.4}", s.error_over_grey_card)),
            row("SSIM", &|s| format!("{:.4}", s.ssim)),
        ]
    }

    pub(super) fn mtf_csv(&self) -> String {
        let mut out = String::from("cycles_per_rad,optics_l,optics_m,footprint_l,footprint_m,motion_l,motion_m,total_l,total_m\n");
        for m in self.modulation() {
            let total = m.total();
            let values =
                [m.frequency, m.optics[0], m.optics[1], m.footprint[0], m.footprint[1], m.motion[0], m.motion[1], total[0], total[1]];
            out += &(values.map(|v| format!("{v:.9}")).join(",") + "\n");
        }
        out
    }

    pub(super) fn ensquared_csv(&self) -> String {
        let mut out = String::from("width_rad,optics,total\n");
        for e in self.ensquared() {
            out += &format!("{:.9e},{:.9},{:.9}\n", e.width_rad, e.optics, e.total);
        }
        out
    }
}

fn scores(s: &Fidelity) -> Value {
    json!({ "rms_difference": s.rms_difference, "error_over_grey_card": s.error_over_grey_card, "ssim": s.ssim, "nrmse": s.nrmse })
}

//! Thermal noise of the receivers.
//!
//! The real and the imaginary part of a visibility each have the standard deviation
//! sigma = sqrt(SEFD1 SEFD2 / (2 B t)) / eta_c for bandwidth B, integration time t and correlator efficiency eta_c.
//! With SEFD = 2 k Tsys / A_e and the Rayleigh-Jeans law this is, in K sr,
//! sigma = sqrt(Tsys1 Tsys2 / (2 B t)) lambda^2 / A_e / eta_c = sqrt(Tsys1 Tsys2 / (2 B t)) Omega_A / eta_c,
//! as the effective area and the solid angle of an antenna obey A_e Omega_A = lambda^2.

use super::sky::from_jy;
use crate::random::stream;
use crate::values::need;
use crate::{ChainError, Result};
use cittert_arrays::ElementPattern;
use cittert_arrays::{
    Antenna, ArrayLayout, BOLTZMANN_J_PER_K, Polarization, SPEED_OF_LIGHT_M_S, Sensitivity, VisUnit, VisibilityBlock, VisibilityHeader,
};
use ndarray::parallel::prelude::*;
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::Complex;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// How much noise to add. Fields that are `None` come from the layout.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct NoiseOptions {
    /// Seed of the random numbers.
    pub seed: u64,
    /// SEFD or Tsys of every antenna, instead of the layout's.
    pub sensitivity: Option<Sensitivity>,
    /// Diameter of every antenna, m, instead of the layout's; only used with Tsys.
    pub diameter_m: Option<f64>,
    /// Solid angle of every antenna, sr; only used with Tsys, and instead of a diameter.
    pub solid_angle_sr: Option<f64>,
    /// Effective over geometric area, 0 to 1; only used with Tsys and a diameter.
    pub aperture_efficiency: f64,
    /// Correlator efficiency, 0 to 1.
    pub correlator_efficiency: f64,
    /// True where Stokes I, Q, U, V are means of two receiver hands, which lowers their sigma by sqrt(2).
    /// False: a product named I is what one receiver measures.
    pub dual_hands: bool,
}

impl NoiseOptions {
    /// Noise of the receivers in the layout, lossless, with a seed.
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        Self {
            seed,
            sensitivity: None,
            diameter_m: None,
            solid_angle_sr: None,
            aperture_efficiency: 1.0,
            correlator_efficiency: 1.0,
            dual_hands: false,
        }
    }
}

/// The thermal noise of one set.
///
/// # Reference
/// Wrobel & Walker 1999, ASP Conf. 180, 171, eqs 9-5 and 9-14; Thompson, Moran & Swenson 2017, sect. 6.2.
#[derive(Debug, Clone)]
pub struct NoiseModel {
    options: NoiseOptions,
    /// SEFD in the unit of the set \[ant, chan\].
    sefd: Array2<f64>,
    width_hz: Vec<f64>,
    products: Vec<Polarization>,
}

impl NoiseModel {
    /// The noise of a set. `pattern` gives the solid angle if Tsys is known but no diameter.
    ///
    /// # Errors
    /// An antenna has neither SEFD nor Tsys, or Tsys without diameter and pattern. An efficiency is outside (0, 1]. The set is in correlator
    /// units.
    pub fn new(header: &VisibilityHeader, options: &NoiseOptions, pattern: &ElementPattern) -> Result<Self> {
        for (option, value) in
            [("aperture efficiency", options.aperture_efficiency), ("correlator efficiency", options.correlator_efficiency)]
        {
            need(option, value, value > 0.0 && value <= 1.0, "a number above 0 and at most 1")?;
        }
        let given = match options.sensitivity {
            Some(Sensitivity::SefdJy(v)) => Some(("SEFD", v)),
            Some(Sensitivity::TsysK(v)) => Some(("Tsys", v)),
            None => None,
        };
        let more = [("diameter for the noise", options.diameter_m), ("solid angle for the noise", options.solid_angle_sr)];
        for (option, value) in given.into_iter().chain(more.into_iter().filter_map(|(o, v)| Some((o, v?)))) {
            need(option, value, value.is_finite() && value > 0.0, "a positive, finite number")?;
        }
        if header.unit == VisUnit::Uncalibrated {
            return Err(ChainError::Incompatible(
                "the size of thermal noise is unknown in correlator units: use a set in Jy or K sr".into(),
            ));
        }
        let freq = header.spectrum.freq_hz();
        let mut sefd = Array2::zeros((header.layout.n_ant(), freq.len()));
        for (a, antenna) in header.layout.antennas().iter().enumerate() {
            for (c, f) in freq.iter().enumerate() {
                sefd[[a, c]] = sefd_jy(antenna, options, pattern, *f)? * from_jy(header.unit, *f);
            }
        }
        Ok(Self { options: *options, sefd, width_hz: header.spectrum.width_hz().to_vec(), products: header.polarizations.clone() })
    }

    /// SEFD of each antenna in the unit of the set \[ant, chan\]: the power of its receiver.
    pub(super) fn receivers(&self) -> ArrayView2<'_, f64> {
        self.sefd.view()
    }

    /// Standard deviation of the real and of the imaginary part of a visibility, in the unit of the set.
    /// An autocorrelation is real, and its standard deviation is larger by sqrt(2).
    #[must_use]
    pub fn sigma(&self, ant1: usize, ant2: usize, chan: usize, pol: usize, integration_s: f64) -> f64 {
        let hands = if self.options.dual_hands && self.products[pol].aips() > 0 { 2.0 } else { 1.0 };
        let auto = if ant1 == ant2 { 2.0 } else { 1.0 };
        let samples = 2.0 * self.width_hz[chan] * integration_s * hands / auto;
        (self.sefd[[ant1, chan]] * self.sefd[[ant2, chan]] / samples).sqrt() / self.options.correlator_efficiency
    }

    /// Add noise to a block and set its weights to 1 / sigma^2. `first_row` is the index of its first row in the set, so the noise of a row does
    /// not depend on the blocks.
    ///
    /// # Errors
    /// An integration time is not positive, or single precision cannot hold the noise or the weights.
    pub fn apply(&self, block: &mut VisibilityBlock, first_row: u64) -> Result<()> {
        if let Some((row, t)) = block.coverage.integration_s.iter().enumerate().find(|(_, t)| !(t.is_finite() && **t > 0.0)) {
            let value = format!("{t} s (row {})", first_row + row as u64);
            return Err(ChainError::bad_option("integration time", value, "a positive time, because thermal noise depends on it"));
        }
        let coverage = &block.coverage;
        let rows = block.vis.axis_iter_mut(Axis(0)).into_par_iter().zip(block.weights.axis_iter_mut(Axis(0)));
        rows.enumerate().try_for_each(|(row, (mut vis, mut weights))| {
            let (a1, a2) = (coverage.ant1[row] as usize, coverage.ant2[row] as usize);
            let mut rng = stream(self.options.seed, "thermal noise", first_row + row as u64);
            for ((chan, pol), v) in vis.indexed_iter_mut() {
                let sigma = self.sigma(a1, a2, chan, pol, coverage.integration_s[row]);
                let (re, im): (f64, f64) = (StandardNormal.sample(&mut rng), StandardNormal.sample(&mut rng));
                let im = if a1 == a2 { 0.0 } else { im };
                *v = Complex::new((f64::from(v.re) + sigma * re) as f32, (f64::from(v.im) + sigma * im) as f32);
                let weight = (1.0 / (sigma * sigma)) as f32;
                if !(weight.is_normal() && v.re.is_finite() && v.im.is_finite()) {
                    let expected = "a noise whose 1/sigma^2 single precision can hold: check Tsys or SEFD, diameter, efficiency and time";
                    return Err(ChainError::bad_option("noise", format!("{sigma:e} per visibility"), expected));
                }
                weights[[chan, pol]] = weight;
            }
            Ok(())
        })
    }
}

/// What the receiver of an antenna adds to its autocorrelation, as a number that holds for the whole band: an SEFD, or a temperature that fills the
/// solid angle of the pattern.
fn receiver(antenna: &Antenna, options: &NoiseOptions) -> Option<Sensitivity> {
    let stated = options.sensitivity.or(antenna.sensitivity)?;
    Some(match (stated, options.diameter_m.or(antenna.diameter_m)) {
        (Sensitivity::TsysK(t), Some(d)) => {
            let area = options.aperture_efficiency * std::f64::consts::PI * d * d / 4.0;
            Sensitivity::SefdJy(2.0 * BOLTZMANN_J_PER_K * t / area * 1e26)
        }
        (stated, _) => stated,
    })
}

/// What the receivers of a layout add to the autocorrelations: nothing without noise.
pub(super) fn receivers(layout: &ArrayLayout, options: Option<&NoiseOptions>) -> Vec<Sensitivity> {
    let of = |a: &Antenna| options.and_then(|o| receiver(a, o)).unwrap_or(Sensitivity::SefdJy(0.0));
    layout.antennas().iter().map(of).collect()
}

/// SEFD of an antenna at a frequency, Jy: the given one, or 2 k Tsys / A_e.
fn sefd_jy(antenna: &Antenna, options: &NoiseOptions, pattern: &ElementPattern, freq_hz: f64) -> Result<f64> {
    let tsys = match options.sensitivity.or(antenna.sensitivity) {
        Some(Sensitivity::SefdJy(v)) => return Ok(v),
        Some(Sensitivity::TsysK(t)) => t,
        None => {
            return Err(ChainError::Incompatible(format!(
                "antenna {:?} has neither an SEFD nor a Tsys: put one in the layout, or state one for all antennas",
                antenna.name
            )));
        }
    };
    let wavelength = SPEED_OF_LIGHT_M_S / freq_hz;
    let from_angle = |omega: f64| wavelength * wavelength / omega;
    let from_diameter = |d: f64| options.aperture_efficiency * std::f64::consts::PI * d * d / 4.0;
    let area = options
        .solid_angle_sr
        .map(from_angle)
        .or(options.diameter_m.or(antenna.diameter_m).map(from_diameter))
        .or(pattern.solid_angle_sr(freq_hz).map(from_angle));
    area.map(|a| 2.0 * BOLTZMANN_J_PER_K * tsys / a * 1e26).ok_or_else(|| {
        ChainError::Incompatible(format!(
            "antenna {:?} has a Tsys but neither a diameter nor an element pattern: its effective area is unknown. Give the layout a diameter, or the elements a pattern",
            antenna.name
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{LayoutFrame, PhaseCenter, SpectralWindow, UvCoverage};

    fn header(unit: VisUnit, sensitivity: Option<Sensitivity>, n_ant: u32) -> VisibilityHeader {
        let antennas = (0..n_ant).map(|k| Antenna {
            diameter_m: Some(0.1),
            sensitivity,
            ..Antenna::new(format!("A{k}"), k, [f64::from(k * k) + 1.0, f64::from(k % 3), 0.0])
        });
        VisibilityHeader {
            layout: ArrayLayout::new("t", LayoutFrame::Boresight, antennas.collect()).unwrap(),
            spectrum: SpectralWindow::band(94e9, 4e8, 2).unwrap(),
            polarizations: vec![Polarization::I],
            phase_centers: vec![PhaseCenter::unprojected("b")],
            unit,
            telescope: "t".into(),
            instrument: "t".into(),
            pedestal_k: None,
            scene_pedestal_k: None,
            scene_width_rad: None,
            antenna_temperature_k: None,
            near_field: Default::default(),
            annotations: Default::default(),
            history: Vec::new(),
        }
    }

    fn rows(n_ant: u32, times: usize) -> UvCoverage {
        let pairs: Vec<(u32, u32)> = (0..n_ant).flat_map(|a| (a + 1..n_ant).map(move |b| (a, b))).collect();
        let n = pairs.len() * times;
        let (a, b) = (0..n).map(|r| pairs[r % pairs.len()]).unzip();
        UvCoverage::new(Array2::zeros((n, 3)), a, b, vec![2_460_000.5; n], vec![0.5; n], vec![0; n]).unwrap()
    }

    #[test]
    fn sigma_is_the_radiometer_formula_in_both_units() {
        let jy =
            NoiseModel::new(&header(VisUnit::Jy, Some(Sensitivity::SefdJy(400.0)), 3), &NoiseOptions::seeded(1), &ElementPattern::None)
                .unwrap();
        // B t = 2e8 Hz x 0.5 s = 1e8.
        assert!((jy.sigma(0, 1, 0, 0, 0.5) - 400.0 / 2e8_f64.sqrt()).abs() < 1e-12);
        assert!((jy.sigma(1, 1, 0, 0, 0.5) - 400.0 / 1e8_f64.sqrt()).abs() < 1e-12);
        let k = NoiseModel::new(
            &header(VisUnit::KelvinSr, Some(Sensitivity::TsysK(600.0)), 3),
            &NoiseOptions { aperture_efficiency: 0.7, ..NoiseOptions::seeded(1) },
            &ElementPattern::None,
        )
        .unwrap();
        let lambda = 299_792_458.0 / 93.9e9_f64;
        let omega = lambda * lambda / (0.7 * std::f64::consts::PI * 0.0025);
        let truth = 600.0 * omega / 2e8_f64.sqrt();
        assert!((k.sigma(0, 1, 0, 0, 0.5) / truth - 1.0).abs() < 1e-12);
        // A stated solid angle takes the place of the diameter.
        let same = NoiseOptions { solid_angle_sr: Some(omega), ..NoiseOptions::seeded(1) };
        let k = NoiseModel::new(&header(VisUnit::KelvinSr, Some(Sensitivity::TsysK(600.0)), 3), &same, &ElementPattern::None).unwrap();
        assert!((k.sigma(0, 1, 0, 0, 0.5) / truth - 1.0).abs() < 1e-12);
    }

    #[test]
    fn noise_has_its_sigma_and_does_not_depend_on_blocks() {
        let h = header(VisUnit::Jy, Some(Sensitivity::SefdJy(400.0)), 8);
        let model = NoiseModel::new(&h, &NoiseOptions::seeded(7), &ElementPattern::None).unwrap();
        let mut whole = VisibilityBlock::zeros(rows(8, 200), 2, 1);
        let parts = [whole.rows(0..1234).unwrap(), whole.rows(1234..whole.n_rows()).unwrap()];
        model.apply(&mut whole, 0).unwrap();
        let sigma = 400.0 / 2e8_f64.sqrt();
        let n = whole.vis.len() as f64;
        for part in [|v: &Complex<f32>| f64::from(v.re), |v: &Complex<f32>| f64::from(v.im)] {
            let rms = (whole.vis.iter().map(|v| part(v).powi(2)).sum::<f64>() / n).sqrt();
            let mean = whole.vis.iter().map(part).sum::<f64>() / n;
            // Four standard errors of n = 11,200 numbers.
            assert!((rms / sigma - 1.0).abs() < 4.0 / (2.0 * n).sqrt(), "{}", rms / sigma);
            assert!(mean.abs() < 4.0 * sigma / n.sqrt());
        }
        assert!(whole.weights.iter().all(|w| (f64::from(*w) * sigma * sigma - 1.0).abs() < 1e-6));
        let mut first = 0;
        for mut part in parts {
            model.apply(&mut part, first as u64).unwrap();
            assert_eq!(part, whole.rows(first..first + part.n_rows()).unwrap());
            first += part.n_rows();
        }
    }

    #[test]
    fn a_naturally_weighted_image_of_nothing_has_the_rms_of_the_formula() {
        // The pixel at the phase centre is the weighted mean of the real parts: its rms over seeds is
        // SEFD / sqrt(N (N - 1) B t), with B the whole band and t the whole time.
        let n_ant = 8;
        let h = header(VisUnit::Jy, Some(Sensitivity::SefdJy(400.0)), n_ant);
        let coverage = rows(n_ant, 2);
        let seeds = 400;
        let mut sum = 0.0;
        for seed in 0..seeds {
            let mut block = VisibilityBlock::zeros(coverage.clone(), 2, 1);
            NoiseModel::new(&h, &NoiseOptions::seeded(seed), &ElementPattern::None).unwrap().apply(&mut block, 0).unwrap();
            let mean = block.vis.iter().map(|v| f64::from(v.re)).sum::<f64>() / block.vis.len() as f64;
            sum += mean * mean;
        }
        let rms = (sum / f64::from(seeds as u32)).sqrt();
        let truth = 400.0 / (f64::from(n_ant * (n_ant - 1)) * 4e8 * 1.0).sqrt();
        // Three standard errors of 400 trials are 10.6 per cent.
        assert!((rms / truth - 1.0).abs() < 3.0 / (2.0 * seeds as f64).sqrt(), "{}", rms / truth);
    }

    #[test]
    fn what_is_missing_is_named() {
        let none = header(VisUnit::Jy, None, 2);
        let e = NoiseModel::new(&none, &NoiseOptions::seeded(1), &ElementPattern::None).unwrap_err().to_string();
        assert!(e.contains("A0") && e.contains("SEFD"), "{e}");
        let mut bad = VisibilityBlock::zeros(rows(2, 1), 2, 1);
        bad.coverage.integration_s[0] = 0.0;
        let some = header(VisUnit::Jy, Some(Sensitivity::SefdJy(1.0)), 2);
        let model = NoiseModel::new(&some, &NoiseOptions::seeded(1), &ElementPattern::None).unwrap();
        assert!(model.apply(&mut bad, 0).unwrap_err().to_string().contains("integration time"));
        let odd = NoiseOptions { correlator_efficiency: 1.5, ..NoiseOptions::seeded(1) };
        assert!(NoiseModel::new(&some, &odd, &ElementPattern::None).is_err());
    }
}

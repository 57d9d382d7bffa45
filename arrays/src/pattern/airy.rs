//! A uniformly lit circular aperture, with a round blockage in its middle.

use super::shape::{Shape, Toward};
use crate::{ArrayError, Result, SPEED_OF_LIGHT_M_S};
use std::f64::consts::PI;

/// The power (F(x) - b^2 F(b x))^2 / (1 - b^2)^2 with F(x) = 2 J1(x) / x, x = pi D sin(theta) / lambda and the blockage b.
///
/// # Reference
/// Thompson, Moran & Swenson 2017, eq. 17.4 for the circular aperture; Born & Wolf 1999, sect. 8.6.2 for the annular one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Airy {
    /// Diameter, m.
    pub diameter_m: f64,
    /// Diameter of the blocked centre over that of the aperture, from 0 to below 1.
    pub blockage: f64,
}

impl Airy {
    /// The pattern of an aperture that is smaller by a factor.
    pub(super) fn widened(&self, factor: f64) -> Self {
        Self { diameter_m: self.diameter_m / factor, blockage: self.blockage }
    }
}

/// The diameter that all antennas share, from their names and diameters.
pub(crate) fn shared_diameter<'a>(mut antennas: impl Iterator<Item = (&'a str, Option<f64>)>) -> Result<f64, String> {
    let Some((_, Some(diameter_m))) = antennas.next() else { return Err("there is no antenna diameter".into()) };
    match antennas.find(|(_, d)| *d != Some(diameter_m)) {
        None => Ok(diameter_m),
        Some((name, other)) => {
            let other = other.map_or("none".to_owned(), |d| format!("{d} m"));
            Err(format!("antennas have different diameters ({diameter_m} m, and {other} for {name:?})"))
        }
    }
}

/// 2 J1(x) / x. Near the axis the quotient loses digits; the series is accurate to 1e-17 there.
fn disc(x: f64) -> f64 {
    if x < 1e-4 { 1.0 - x * x / 8.0 } else { 2.0 * libm::j1(x) / x }
}

impl Shape for Airy {
    fn check(&self) -> Result<()> {
        let good = self.diameter_m.is_finite() && self.diameter_m > 0.0;
        ArrayError::unless(good, "diameter of the element pattern", self.diameter_m, "a positive number of metres")?;
        let good = (0.0..=0.99).contains(&self.blockage);
        ArrayError::unless(good, "blockage of the element pattern", self.blockage, "a ratio of diameters from 0 to 0.99")
    }

    fn power(&self, toward: Toward, freq_hz: f64) -> f64 {
        self.voltage(toward, freq_hz).powi(2)
    }

    fn voltage(&self, toward: Toward, freq_hz: f64) -> f64 {
        let x = PI * self.diameter_m * toward.sin_theta * freq_hz / SPEED_OF_LIGHT_M_S;
        let b = self.blockage;
        if b == 0.0 { disc(x) } else { (disc(x) - b * b * disc(b * x)) / (1.0 - b * b) }
    }

    fn solid_angle_sr(&self, freq_hz: f64) -> f64 {
        // The product of effective area and solid angle is the square of the wavelength.
        let area = PI * self.diameter_m * self.diameter_m / 4.0 * (1.0 - self.blockage * self.blockage);
        (SPEED_OF_LIGHT_M_S / freq_hz).powi(2) / area
    }

    fn varies_with_frequency(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn the_integral_over_the_hemisphere_is_lambda_squared_over_the_area() {
        for blockage in [0.0, 0.3] {
            let airy = Airy { diameter_m: 40.0 * 0.299_792_458, blockage };
            let (steps, mut sum) = (200_000, 0.0);
            for k in 0..steps {
                let theta = (f64::from(k) + 0.5) / f64::from(steps) * FRAC_PI_2;
                let toward = Toward { l: theta.sin(), m: 0.0, sin_theta: theta.sin() };
                sum += airy.power(toward, 1e9) * theta.sin() * FRAC_PI_2 / f64::from(steps);
            }
            let ratio = sum * TAU / airy.solid_angle_sr(1e9);
            assert!((ratio - 1.0).abs() < 0.02, "{blockage}: {ratio}");
        }
    }

    #[test]
    fn a_blocked_aperture_is_the_difference_of_two_discs() {
        // The voltage of an annulus, summed over thin rings: the integral of J0(x r) r dr from b to 1, over (1 - b^2) / 2.
        let (b, x, n) = (0.4, 2.7, 20_000);
        let sum: f64 = (0..n)
            .map(|k| {
                let r = b + (1.0 - b) * (f64::from(k) + 0.5) / f64::from(n);
                libm::j0(x * r) * r
            })
            .sum();
        let voltage = sum * (1.0 - b) / f64::from(n) / ((1.0 - b * b) / 2.0);
        let sin_theta = x / PI * SPEED_OF_LIGHT_M_S / 1e9;
        let power = Airy { diameter_m: 1.0, blockage: b }.power(Toward { l: sin_theta, m: 0.0, sin_theta }, 1e9);
        assert!((power - voltage * voltage).abs() < 1e-9, "{power} {voltage}");
    }
}

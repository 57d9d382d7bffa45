//! exp(2 pi i x) for many phases. The code has no branches, so the compiler can use vector registers.

/// Adding and subtracting this number rounds an f64 below 2^51 to the nearest integer. The low bits of the sum are the low bits of the integer.
const ROUND: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52

/// cos(2 pi x) and sin(2 pi x) for x in turns, |x| < 2^48; the absolute error is below 3e-16.
///
/// # Reference
/// Taylor series of sine and cosine on |theta| <= pi / 4, to theta^17 and theta^16: the remainders are below 1e-17.
#[inline(always)]
pub(crate) fn cos_sin_turns(x: f64) -> (f64, f64) {
    let shifted = 4.0 * x + ROUND;
    let quadrant = shifted.to_bits();
    let theta = (x - 0.25 * (shifted - ROUND)) * std::f64::consts::TAU;
    let t = theta * theta;
    let sin = theta
        * (1.0
            + t * (-1.0 / 6.0
                + t * (1.0 / 120.0
                    + t * (-1.0 / 5040.0
                        + t * (1.0 / 362_880.0
                            + t * (-1.0 / 39_916_800.0 + t * (1.0 / 6_227_020_800.0 + t * (-1.0 / 1_307_674_368_000.0))))))));
    let cos = 1.0
        + t * (-0.5
            + t * (1.0 / 24.0
                + t * (-1.0 / 720.0
                    + t * (1.0 / 40_320.0
                        + t * (-1.0 / 3_628_800.0
                            + t * (1.0 / 479_001_600.0 + t * (-1.0 / 87_178_291_200.0 + t * (1.0 / 20_922_789_888_000.0))))))));
    let odd = quadrant & 1 == 1;
    let (c, s) = if odd { (sin, cos) } else { (cos, sin) };
    // Quadrants 1 and 2 negate the cosine, 2 and 3 the sine.
    let flip_c = ((quadrant + 1) & 2) << 62;
    let flip_s = (quadrant & 2) << 62;
    (f64::from_bits(c.to_bits() ^ flip_c), f64::from_bits(s.to_bits() ^ flip_s))
}

/// Distance between equally spaced values. `None` if they are not equally spaced to within rounding, or if there are fewer than two.
pub(crate) fn uniform_step(values: &[f64]) -> Option<f64> {
    let n = values.len();
    if n < 2 {
        return None;
    }
    let step = (values[n - 1] - values[0]) / (n - 1) as f64;
    let tolerance = 4.0 * f64::EPSILON * values.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    values.iter().enumerate().all(|(k, v)| (values[0] + step * k as f64 - v).abs() <= tolerance).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_library_in_every_quadrant() {
        let mut worst = 0.0_f64;
        for k in -40_000..=40_000 {
            let x = f64::from(k) / 9_973.0;
            // The library function gets the exactly reduced phase, because its own product 2 pi x would be rounded.
            let (s, c) = ((x - x.round()) * std::f64::consts::TAU).sin_cos();
            let (mc, ms) = cos_sin_turns(x);
            worst = worst.max((mc - c).abs()).max((ms - s).abs());
        }
        assert!(worst < 5e-16, "{worst:e}");
        assert_eq!(cos_sin_turns(0.0), (1.0, 0.0));
        let (c, s) = cos_sin_turns(123_456_789.25);
        assert!(c.abs() < 1e-15 && (s - 1.0).abs() < 1e-15);
    }

    #[test]
    fn equal_spacing_is_recognised() {
        let even: Vec<f64> = (0..32).map(|k| 90.125e9 + 0.25e9 * f64::from(k)).collect();
        assert_eq!(uniform_step(&even), Some(0.25e9));
        assert_eq!(uniform_step(&[1e9, 2e9, 3.001e9]), None);
        assert_eq!(uniform_step(&[1e9]), None);
    }
}

//! The two floating-point types the transforms run in.

use bytemuck::Pod;
use cittert_fourier_planner::num_traits::NumAssign;
use cittert_fourier_planner::{Fft, FftDirection, FftNum};
use ndarray::Array2;
use num_complex::Complex;
use std::any::Any;
use std::sync::Arc;

/// A floating-point type of the transforms: `f32` for requested errors down to 1e-5, `f64` for smaller ones.
pub trait Real: FftNum + NumAssign + PartialOrd + Default + Pod {
    /// From double precision.
    fn of(x: f64) -> Self;
    /// To double precision.
    fn to64(self) -> f64;
    /// `self * a + b`, as a fused multiply-add if `FUSED` is true. `FUSED` must be true only on machines with an instruction for it: on others
    /// it is a slow call.
    fn fma<const FUSED: bool>(self, a: Self, b: Self) -> Self;
    /// A plan for a transform of this length. The process makes each plan once.
    #[doc(hidden)]
    fn plan(len: usize, direction: FftDirection) -> Arc<dyn Fft<Self>>;
    /// Number of terms of the series of sine and cosine that give full precision on an eighth of a turn.
    #[doc(hidden)]
    const TRIG_TERMS: usize;
}

macro_rules! real {
    ($t:ty, $terms:expr, $plan:path) => {
        impl Real for $t {
            const TRIG_TERMS: usize = $terms;

            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }

            #[inline(always)]
            fn to64(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn fma<const FUSED: bool>(self, a: Self, b: Self) -> Self {
                if FUSED { self.mul_add(a, b) } else { self * a + b }
            }

            fn plan(len: usize, direction: FftDirection) -> Arc<dyn Fft<Self>> {
                $plan(len, direction)
            }
        }
    };
}
real!(f32, 5, cittert_fourier_planner::single);
real!(f64, 9, cittert_fourier_planner::double);

/// An image in another precision. An image that has this precision already is returned as it is.
pub(crate) fn in_precision<T: Real, P: Real>(image: Array2<T>) -> Array2<P> {
    let mut image = Some(image);
    let same = (&mut image as &mut dyn Any).downcast_mut::<Option<Array2<P>>>().and_then(Option::take);
    same.or_else(|| image.map(|i| i.mapv(|v| P::of(v.to64())))).unwrap_or_default()
}

/// True if the machine has AVX2 and fused multiply-add.
pub(crate) fn fused() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
    }
}

/// True if the machine has AVX-512 besides AVX2 and fused multiply-add.
pub(crate) fn wide() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        fused()
            && is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw")
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
    }
}

/// exp(2 pi i x) of a phase in turns, to the precision of `T`.
///
/// The phase is reduced to an eighth of a turn in double precision. The power series converges quickly there.
#[inline(always)]
pub(crate) fn cis_turns<T: Real>(turns: f64) -> Complex<T> {
    // Adding and subtracting 1.5 * 2^52 rounds to an integer without a call to a library function.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let quarters = turns * 4.0;
    let magic = quarters + ROUND;
    let nearest = magic - ROUND;
    let x = (quarters - nearest) * std::f64::consts::FRAC_PI_2;
    let x2 = x * x;
    let (mut s, mut c) = (1.0, 1.0);
    let mut k = T::TRIG_TERMS;
    while k > 0 {
        let even = (2 * k) as f64;
        c = 1.0 - c * x2 * (1.0 / (even * (even - 1.0)));
        s = 1.0 - s * x2 * (1.0 / (even * (even + 1.0)));
        k -= 1;
    }
    s *= x;
    // The low bits of the mantissa of the shifted number are the integer, the number of quarter turns: an odd one exchanges sine and cosine, and
    // their signs follow from it. Without branches, the compiler computes several phases at once.
    let quarter = magic.to_bits();
    let odd = (quarter & 1).wrapping_neg();
    let (s, c) = (s.to_bits(), c.to_bits());
    let re = ((c & !odd) | (s & odd)) ^ ((quarter.wrapping_add(1) & 2) << 62);
    let im = ((s & !odd) | (c & odd)) ^ ((quarter & 2) << 62);
    Complex::new(T::of(f64::from_bits(re)), T::of(f64::from_bits(im)))
}

/// exp(2 pi i `factor` x) for many x.
#[inline(always)]
fn cis_lanes<T: Real>(factor: f64, x: &[f64], out: &mut [Complex<T>]) {
    out.iter_mut().zip(x).for_each(|(o, x)| *o = cis_turns(factor * x));
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn cis_avx2<T: Real>(factor: f64, x: &[f64], out: &mut [Complex<T>]) {
    cis_lanes(factor, x, out);
}

/// exp(2 pi i `factor` x) for many x, to the precision of `T`.
pub(crate) fn cis_of_all<T: Real>(factor: f64, x: &[f64], out: &mut [Complex<T>]) {
    #[cfg(target_arch = "x86_64")]
    if fused() {
        // SAFETY: `fused` has found that the machine has AVX2 and FMA.
        unsafe { cis_avx2(factor, x, out) };
        return;
    }
    cis_lanes(factor, x, out);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_short_series_of_the_exponential_is_exact_to_rounding() {
        for i in -4000..4000 {
            let turns = f64::from(i) * 0.001_234_567;
            let (s, c) = (turns * std::f64::consts::TAU).sin_cos();
            let z: Complex<f64> = cis_turns(turns);
            assert!((z.re - c).abs() < 2e-14 && (z.im - s).abs() < 2e-14, "{turns}");
            let z: Complex<f32> = cis_turns(turns);
            assert!((z.re.to64() - c).abs() < 1e-7 && (z.im.to64() - s).abs() < 1e-7, "{turns}");
        }
    }
}

//! Measures the limits of the machine: bytes per second to and from memory, and multiply-adds per second.

use rustix::time::{ClockId, clock_gettime};
use std::hint::black_box;

/// Processor seconds of all threads that this process has or had.
pub(crate) fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// The smallest processor time of several runs, s, and the result of the last run. The smallest is used because other programs can only
/// increase the time.
pub(crate) fn least<R>(turns: usize, mut work: impl FnMut() -> R) -> (f64, R) {
    let mut best = f64::INFINITY;
    let mut timed = || {
        let start = cpu_s();
        let result = work();
        best = best.min(cpu_s() - start);
        result
    };
    let mut result = timed();
    for _ in 1..turns.max(1) {
        result = timed();
    }
    (best, result)
}

/// Bytes per second of a = b + s c on one thread, with arrays far larger than the caches. A write counts once.
pub(crate) fn triad() -> f64 {
    const N: usize = 1 << 24;
    let (mut a, b, c) = (vec![0.0_f32; N], vec![1.0_f32; N], vec![2.0_f32; N]);
    let (s, ()) = least(5, || {
        let k = black_box(3.0_f32);
        for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
            *a = *b + k * *c;
        }
        black_box(&mut a);
    });
    (3 * N * size_of::<f32>()) as f64 / s
}

const CHAINS: usize = 12;
const ROUNDS: usize = 4_000_000;

#[inline(always)]
fn chains<const FUSED: bool>() -> f32 {
    let mut sums = [[1.0_f32; 8]; CHAINS];
    let (a, b) = (black_box([0.999_f32; 8]), black_box([0.001_f32; 8]));
    for _ in 0..ROUNDS {
        for sum in &mut sums {
            for k in 0..8 {
                sum[k] = if FUSED { sum[k].mul_add(a[k], b[k]) } else { sum[k] * a[k] + b[k] };
            }
        }
    }
    sums.iter().flatten().sum()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn chains_avx2() -> f32 {
    chains::<true>()
}

/// Single-precision multiply-adds per second on one thread, with the instructions that the transforms use.
pub(crate) fn multiply_adds() -> f64 {
    let (s, _) = least(3, || {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the condition above says that the machine has AVX2 and FMA.
            return black_box(unsafe { chains_avx2() });
        }
        black_box(chains::<false>())
    });
    (8 * CHAINS * ROUNDS) as f64 / s
}

//! The inner loops of array factors: sums over antennas for one row of directions, and the gradient from one row.
//!
//! The same code is compiled for processors with and without wide registers. Results differ between the two by rounding.

/// Directions that are computed together: a register of eight numbers, or two of four.
pub(super) const LANES: usize = 8;

/// The phasors of the antennas for one row of a grid.
pub(super) struct Row<'a> {
    /// Cosine and sine along l \[antenna\].
    pub(super) across: [&'a [f64]; 2],
    /// Cosine and sine along m \[block\]\[antenna\]\[lane\].
    pub(super) up: [&'a [f64]; 2],
}

#[inline(always)]
fn fma<const FUSED: bool>(a: f64, b: &[f64; LANES], sum: &mut [f64; LANES]) {
    for (s, b) in sum.iter_mut().zip(b) {
        *s = if FUSED { a.mul_add(*b, *s) } else { a * b + *s };
    }
}

#[inline(always)]
fn fma_lanes<const FUSED: bool>(a: &[f64; LANES], b: &[f64; LANES], sum: &mut [f64; LANES]) {
    for (s, (a, b)) in sum.iter_mut().zip(a.iter().zip(b)) {
        *s = if FUSED { a.mul_add(*b, *s) } else { a * b + *s };
    }
}

#[inline(always)]
fn sum_with<const FUSED: bool>(row: &Row<'_>, out: [&mut [f64]; 4]) {
    let n = row.across[0].len();
    let (up_c, up_s) = (row.up[0].as_chunks::<LANES>().0, row.up[1].as_chunks::<LANES>().0);
    let [re_plus, im_plus, re_minus, im_minus] = out.map(|o| o.as_chunks_mut::<LANES>().0);
    let (across_c, across_s) = (&row.across[0][..n], &row.across[1][..n]);
    for b in 0..re_plus.len() {
        let (c, s) = (&up_c[b * n..(b + 1) * n], &up_s[b * n..(b + 1) * n]);
        let (mut cc, mut ss, mut cs, mut sc) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for k in 0..n {
            fma::<FUSED>(across_c[k], &c[k], &mut cc);
            fma::<FUSED>(across_s[k], &s[k], &mut ss);
            fma::<FUSED>(across_c[k], &s[k], &mut cs);
            fma::<FUSED>(across_s[k], &c[k], &mut sc);
        }
        for lane in 0..LANES {
            re_plus[b][lane] = cc[lane] - ss[lane];
            im_plus[b][lane] = sc[lane] + cs[lane];
            re_minus[b][lane] = cc[lane] + ss[lane];
            im_minus[b][lane] = sc[lane] - cs[lane];
        }
    }
}

#[inline(always)]
fn gradient_with<const FUSED: bool>(row: &Row<'_>, sums: [&[f64]; 8], l: f64, gradient: &mut [[f64; 2]]) {
    const FACTOR: f64 = -4.0 * std::f64::consts::PI;
    let n = gradient.len();
    let (up_c, up_s) = (row.up[0].as_chunks::<LANES>().0, row.up[1].as_chunks::<LANES>().0);
    let [rs, rd, is, id, mrs, mrd, mis, mid] = sums.map(|s| s.as_chunks::<LANES>().0);
    let blocks = rs.len();
    for (k, g) in gradient.iter_mut().enumerate() {
        let (mut t1, mut t2, mut t3, mut t4) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let (mut u1, mut u2, mut u3, mut u4) = ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for b in 0..blocks {
            let (c, s) = (&up_c[b * n + k], &up_s[b * n + k]);
            fma_lanes::<FUSED>(c, &rs[b], &mut t1);
            fma_lanes::<FUSED>(s, &id[b], &mut t2);
            fma_lanes::<FUSED>(s, &rd[b], &mut t3);
            fma_lanes::<FUSED>(c, &is[b], &mut t4);
            fma_lanes::<FUSED>(c, &mrd[b], &mut u1);
            fma_lanes::<FUSED>(s, &mis[b], &mut u2);
            fma_lanes::<FUSED>(s, &mrs[b], &mut u3);
            fma_lanes::<FUSED>(c, &mid[b], &mut u4);
        }
        let total = |a: [f64; LANES]| a.iter().sum::<f64>();
        let (c, s) = (row.across[0][k], row.across[1][k]);
        g[0] += FACTOR * l * (s * (total(t1) + total(t2)) + c * (total(t3) - total(t4)));
        g[1] += FACTOR * (s * (total(u1) + total(u2)) + c * (total(u3) - total(u4)));
    }
}

/// Two numbers of an antenna: cosine and sine of its phase along l.
pub(super) type Phasor = [f64; 2];

/// One row of the array factor: real and imaginary part for m > 0, then for m < 0.
pub(super) type RowParts<'a> = [&'a [f64]; 4];

#[inline(always)]
fn changed(
    parts: [&[f64; LANES]; 4],
    [new, old]: [Phasor; 2],
    up_new: [&[f64; LANES]; 2],
    up_old: [&[f64; LANES]; 2],
) -> [[f64; LANES]; 4] {
    let mut out = parts.map(|p| *p);
    for lane in 0..LANES {
        let (nc, ns, oc, os) = (up_new[0][lane], up_new[1][lane], up_old[0][lane], up_old[1][lane]);
        let cc = new[0] * nc - old[0] * oc;
        let ss = new[1] * ns - old[1] * os;
        let cs = new[0] * ns - old[0] * os;
        let sc = new[1] * nc - old[1] * oc;
        out[0][lane] += cc - ss;
        out[1][lane] += sc + cs;
        out[2][lane] += cc + ss;
        out[3][lane] += sc - cs;
    }
    out
}

#[inline(always)]
fn moved_power_with<const FUSED: bool>(row: RowParts<'_>, across: [Phasor; 2], up: [&[f64]; 4], weight: f64, power: [&mut [f64]; 2]) {
    let row = row.map(|r| r.as_chunks::<LANES>().0);
    let up = up.map(|u| u.as_chunks::<LANES>().0);
    let [plus, minus] = power.map(|p| p.as_chunks_mut::<LANES>().0);
    for b in 0..plus.len() {
        let parts = changed(row.map(|r| &r[b]), across, [&up[0][b], &up[1][b]], [&up[2][b], &up[3][b]]);
        for lane in 0..LANES {
            plus[b][lane] += weight * (parts[0][lane] * parts[0][lane] + parts[1][lane] * parts[1][lane]);
            minus[b][lane] += weight * (parts[2][lane] * parts[2][lane] + parts[3][lane] * parts[3][lane]);
        }
    }
}

#[inline(always)]
fn move_row_with<const FUSED: bool>(row: [&mut [f64]; 4], across: [Phasor; 2], up: [&[f64]; 4]) {
    let mut row = row.map(|r| r.as_chunks_mut::<LANES>().0);
    let up = up.map(|u| u.as_chunks::<LANES>().0);
    for b in 0..up[0].len() {
        let parts = changed([&row[0][b], &row[1][b], &row[2][b], &row[3][b]], across, [&up[0][b], &up[1][b]], [&up[2][b], &up[3][b]]);
        row.iter_mut().zip(parts).for_each(|(r, p)| r[b] = p);
    }
}

#[inline(always)]
fn products_with<const FUSED: bool>(left: &[f64], right: &[Vec<f64>], out: &mut [f64]) {
    let left = left.as_chunks::<LANES>().0;
    for (out, right) in out.iter_mut().zip(right) {
        let mut sum = [0.0; LANES];
        for (a, b) in left.iter().zip(right.as_chunks::<LANES>().0) {
            fma_lanes::<FUSED>(a, b, &mut sum);
        }
        *out = sum.iter().sum();
    }
}

/// Functions that take the fastest code that the processor has.
macro_rules! for_this_processor {
    ($(#[$doc:meta])+ $name:ident, $wide:ident, $widest:ident, $with:ident($($arg:ident: $type:ty),+)) => {
        /// # Safety
        /// The processor has these instructions.
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,fma")]
        unsafe fn $wide($($arg: $type),+) {
            $with::<true>($($arg),+);
        }

        /// # Safety
        /// The processor has these instructions.
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx512f,avx2,fma")]
        unsafe fn $widest($($arg: $type),+) {
            $with::<true>($($arg),+);
        }

        $(#[$doc])+
        pub(super) fn $name($($arg: $type),+) {
            #[cfg(target_arch = "x86_64")]
            {
                if std::arch::is_x86_feature_detected!("avx512f") {
                    // SAFETY: the processor was asked.
                    return unsafe { $widest($($arg),+) };
                }
                if std::arch::is_x86_feature_detected!("avx2") && std::arch::is_x86_feature_detected!("fma") {
                    // SAFETY: the processor was asked.
                    return unsafe { $wide($($arg),+) };
                }
            }
            $with::<false>($($arg),+);
        }
    };
}

for_this_processor!(
    /// The array factor in the directions of a row: real and imaginary part for m > 0, then for m < 0.
    sum, sum_wide, sum_widest, sum_with(row: &Row<'_>, out: [&mut [f64]; 4])
);
for_this_processor!(
    /// Add the gradient by the positions from one row. `sums` are, with w the derivative by |AF|^2: the sum of w Re AF over m and -m, its
    /// difference, the same of w Im AF, and these four times m.
    gradient, gradient_wide, gradient_widest, gradient_with(row: &Row<'_>, sums: [&[f64]; 8], l: f64, gradient: &mut [[f64; 2]])
);
for_this_processor!(
    /// The scalar products of one vector with others. The lengths are multiples of [`LANES`].
    products, products_wide, products_widest, products_with(left: &[f64], right: &[Vec<f64>], out: &mut [f64])
);
for_this_processor!(
    /// Add the power of a row, times a weight, as it would be if an antenna moved. `across`: the new and the old phasor of the antenna along l; `up`:
    /// cosines and sines along m at its new and at its old place.
    moved_power, moved_power_wide, moved_power_widest,
    moved_power_with(row: RowParts<'_>, across: [Phasor; 2], up: [&[f64]; 4], weight: f64, power: [&mut [f64]; 2])
);
for_this_processor!(
    /// Move an antenna: change the row of the array factor.
    move_row, move_row_wide, move_row_widest, move_row_with(row: [&mut [f64]; 4], across: [Phasor; 2], up: [&[f64]; 4])
);

//! The numbers that select the facets of a pixel: additive sequences, which fill the unit square evenly at every length.

use crate::space::Vec3;

/// Steps of the additive sequences of two and of three numbers: powers of `1/g` with `g^3 = g + 1`, and with `g^4 = g + 1`.
///
/// # Reference
/// Roberts 2018, The unreasonable effectiveness of quasirandom sequences.
const STEPS: [f64; 5] =
    [0.754_877_666_246_692_7, 0.569_840_290_998_053_2, 0.819_172_513_396_164_5, 0.671_043_606_703_789_3, 0.549_700_477_901_970_3];

/// The points of one pixel, or one share of them.
///
/// Each pixel moves the sequence by its own offset. The offset is a hash of the place of the pixel, so a picture is the same with any number
/// of threads, and neighbouring pixels have independent errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Points {
    hash: u64,
    /// Number of this share, and of all shares.
    share: usize,
    shares: usize,
    /// How many of the points are used.
    pub use_of: Use,
}

/// How many points of a pixel are used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Use {
    /// None: a surface scatters the open sky of its table.
    Nothing,
    /// The first of them search for objects. If they meet nothing but sky, the others are left out.
    Search,
    /// All.
    All,
}

impl Points {
    /// All points of the pixel at a column and row.
    pub(super) fn of_pixel(column: f64, row: f64) -> Self {
        Self { hash: mix(mix(column.to_bits()) ^ row.to_bits().rotate_left(32)), share: 0, shares: 1, use_of: Use::Search }
    }

    /// One of several shares of the points, for one of the rays of the pixel.
    pub(super) fn share(self, share: usize, shares: usize) -> Self {
        Self { share, shares, use_of: Use::All, ..self }
    }

    /// The same points, of which more or fewer are used.
    pub(super) fn using(self, use_of: Use) -> Self {
        Self { use_of, ..self }
    }

    /// A single point for a place that is not seen directly.
    pub(super) fn of_place(self, p: Vec3) -> Self {
        let hash = mix(mix(mix(self.hash ^ p.x.to_bits()) ^ p.y.to_bits().rotate_left(24)) ^ p.z.to_bits().rotate_left(48));
        Self { hash, share: 0, shares: 1, use_of: Use::All }
    }

    /// Number of points of this share, of `all` for the pixel.
    pub(super) fn count(&self, all: usize) -> usize {
        all.div_ceil(self.shares)
    }

    /// Point `k` of this share of `count` points.
    pub(super) fn at(&self, k: usize, count: usize) -> [f64; 5] {
        let place = (self.share * count + k) as f64;
        let mut hash = self.hash;
        STEPS.map(|step| {
            hash = mix(hash);
            let offset = ((hash >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
            (offset + place * step).fract()
        })
    }
}

/// splitmix64 (Steele et al. 2014).
fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_join_to_the_whole() {
        let all = Points::of_pixel(3.0, 7.0);
        let joined: Vec<_> = (0..4).flat_map(|s| (0..8).map(move |k| all.share(s, 4).at(k, 8))).collect();
        let whole: Vec<_> = (0..32).map(|k| all.at(k, 32)).collect();
        assert_eq!(joined, whole);
        assert_eq!(all.share(2, 16).count(100), 7);
        assert_ne!(all.at(0, 1), Points::of_pixel(3.0, 8.0).at(0, 1));
    }

    /// The error of an area falls faster than the square root of the number of points.
    #[test]
    fn points_fill_the_square_evenly() {
        for n in [64, 512] {
            let mut worst = 0.0_f64;
            for pixel in 0..50 {
                let points = Points::of_pixel(f64::from(pixel), 1.0);
                let inside = (0..n).filter(|k| matches!(points.at(*k, n), [x, y, ..] if x + 0.7 * y < 0.6)).count();
                // Area of the triangle below the line.
                worst = worst.max((inside as f64 / n as f64 - 0.6 * 0.6 / 1.4).abs());
            }
            assert!(worst < 1.2 * (n as f64).powf(-0.75), "{n}: {worst}");
        }
    }
}

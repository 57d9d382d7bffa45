//! A table of numbers against the angle of incidence.

use rayon::prelude::*;

/// Largest number of intervals. [`AngleTable::error`] gives the error that is left.
const LIMIT: usize = 1 << 15;

/// `N` numbers against the cosine of an angle, interpolated linearly in its fourth root.
///
/// The fourth root concentrates the nodes at grazing angles, where the reflection of metals changes fastest. It costs two square roots.
#[derive(Debug, Clone)]
pub struct AngleTable<const N: usize> {
    rows: Vec<[f64; N]>,
    intervals: f64,
    error: f64,
}

impl<const N: usize> AngleTable<N> {
    /// Tabulates `f(cos)`. The table begins with `first` intervals. The intervals are halved until the error in the middle of each is
    /// at most `tolerance`, or until there are `most` intervals. The factors `scale` multiply the error of each number, so that the
    /// numbers are comparable.
    ///
    /// # Errors
    /// The errors of `f`.
    pub fn new<E: Send>(
        tolerance: f64,
        scale: [f64; N],
        (first, most): (usize, usize),
        f: impl Fn(f64) -> Result<[f64; N], E> + Sync,
    ) -> Result<Self, E> {
        let at = |k: usize, n: usize| f(cosine(k as f64 / n as f64));
        let mut n = first.clamp(2, LIMIT);
        let mut rows = (0..=n).into_par_iter().map(|k| at(k, n)).collect::<Result<Vec<_>, E>>()?;
        loop {
            let middles = (0..n).into_par_iter().map(|k| at(2 * k + 1, 2 * n)).collect::<Result<Vec<_>, E>>()?;
            let mut error = 0.0_f64;
            for (pair, m) in rows.windows(2).zip(&middles) {
                for i in 0..N {
                    error = error.max((0.5 * (pair[0][i] + pair[1][i]) - m[i]).abs() * scale[i]);
                }
            }
            // The values in the middle become nodes too. That divides the error by four.
            let mut finer = Vec::with_capacity(2 * n + 1);
            for (row, m) in rows.iter().zip(&middles) {
                finer.push(*row);
                finer.push(*m);
            }
            finer.extend(rows.last().copied());
            rows = finer;
            n *= 2;
            if error <= 4.0 * tolerance || n >= most.min(LIMIT) {
                return Ok(Self { rows, intervals: n as f64, error: 0.25 * error });
            }
        }
    }

    /// The numbers at a cosine of 0 to 1.
    #[must_use]
    #[inline]
    pub fn at(&self, cos: f64) -> [f64; N] {
        let u = cos.clamp(0.0, 1.0).sqrt().sqrt() * self.intervals;
        let k = (u as usize).min(self.rows.len() - 2);
        let w = u - k as f64;
        let (a, b) = (&self.rows[k], &self.rows[k + 1]);
        std::array::from_fn(|i| a[i] + w * (b[i] - a[i]))
    }

    /// Largest error of interpolation, in the unit of the tolerance.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.error
    }
}

/// The cosine at a node. The reflection is not defined at exactly grazing incidence, so the first node lies slightly above it.
fn cosine(u: f64) -> f64 {
    u.powi(4).max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sharp_changes_near_grazing_are_resolved() {
        // The dip of a metal near its Brewster angle at a cosine of 7e-4.
        let dip = |c: f64| ((c - 7e-4) / (c + 7e-4)).powi(2);
        let table = AngleTable::<1>::new(1e-5, [1.0], (128, 1 << 15), |c| Ok::<_, ()>([dip(c)])).unwrap();
        assert!(table.error() <= 1e-5, "{}", table.error());
        for k in 1..5000 {
            let c = (f64::from(k) / 5000.0).powi(3);
            assert!((table.at(c)[0] - dip(c)).abs() < 1.5e-5, "{c}");
        }
    }
}

//! The views in which an array is observed: one for a snapshot, one for each channel of a band and each moment of a track.

/// How the array looks from the source at one moment and frequency, and the weight of this look in the mean beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Rows: the two coordinates across the line of sight, as sums of those of the layout, times the frequency over its mean.
    pub matrix: [[f64; 2]; 2],
    /// Weight in the mean over all views. The weights of an array add up to 1.
    pub weight: f64,
}

impl View {
    /// The array seen along the boresight (or at the zenith), at one frequency.
    #[must_use]
    pub fn snapshot() -> Vec<Self> {
        Self::band(0.0, 1)
    }

    /// The same in equal channels over a band of a width relative to its centre.
    #[must_use]
    pub fn band(relative_width: f64, channels: usize) -> Vec<Self> {
        let n = channels.max(1) as f64;
        let factor = |c: usize| 1.0 + relative_width * ((c as f64 + 0.5) / n - 0.5);
        (0..channels.max(1)).map(|c| Self { matrix: [[factor(c), 0.0], [0.0, factor(c)]], weight: 1.0 / n }).collect()
    }

    /// Antennas at east and north of a site, observed in equal steps of the hour angle from `from` to `to` (rad) towards a declination
    /// (rad), in the channels of `band`.
    ///
    /// # Reference
    /// Thompson, Moran & Swenson 2017, Interferometry and Synthesis in Radio Astronomy, equations 4.1 and 4.4.
    #[must_use]
    pub fn track(latitude: f64, declination: f64, [from, to]: [f64; 2], steps: usize, band: &[Self]) -> Vec<Self> {
        let (sin_lat, (sin_dec, cos_dec)) = (latitude.sin(), declination.sin_cos());
        let cos_lat = latitude.cos();
        let moments = (0..steps.max(1)).map(|k| from + (to - from) * (k as f64 + 0.5) / steps.max(1) as f64);
        let look = |hour: f64| {
            let (s, c) = hour.sin_cos();
            // East and north in the equatorial frame: (0, 1) and (-sin lat, 0, cos lat).
            [[c, -sin_lat * s], [sin_dec * s, sin_dec * sin_lat * c + cos_dec * cos_lat]]
        };
        let weight = 1.0 / steps.max(1) as f64;
        let seen = |hour: f64| band.iter().map(move |b| Self { matrix: product(b.matrix, look(hour)), weight: weight * b.weight });
        moments.flat_map(seen).collect()
    }

    /// The positions in this view.
    pub(super) fn project(&self, xy: &[[f64; 2]], seen: &mut Vec<[f64; 2]>) {
        let m = self.matrix;
        seen.clear();
        seen.extend(xy.iter().map(|p| [m[0][0] * p[0] + m[0][1] * p[1], m[1][0] * p[0] + m[1][1] * p[1]]));
    }

    /// The positions in this view, in a list of their own.
    #[must_use]
    pub fn of(&self, xy: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut seen = Vec::new();
        self.project(xy, &mut seen);
        seen
    }

    /// The direction in which the layout itself has the phases that this view has in `direction`.
    pub(super) fn direction(&self, [l, m]: [f64; 2]) -> [f64; 2] {
        let v = self.matrix;
        [v[0][0] * l + v[1][0] * m, v[0][1] * l + v[1][1] * m]
    }

    /// Add the gradient by the positions, given that by their view, times a factor.
    pub(super) fn add_back(&self, by_seen: &[[f64; 2]], factor: f64, gradient: &mut [[f64; 2]]) {
        let m = self.matrix.map(|row| row.map(|v| v * factor));
        for (g, s) in gradient.iter_mut().zip(by_seen) {
            g[0] += m[0][0] * s[0] + m[1][0] * s[1];
            g[1] += m[0][1] * s[0] + m[1][1] * s[1];
        }
    }
}

fn product(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    [0, 1].map(|i| [0, 1].map(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_source_at_the_zenith_sees_the_layout_as_it_is() {
        let view = View::track(0.7, 0.7, [0.0, 0.0], 1, &View::snapshot());
        assert_eq!(view.len(), 1);
        for (row, expected) in view[0].matrix.iter().zip([[1.0, 0.0], [0.0, 1.0]]) {
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{view:?}");
        }
    }

    #[test]
    fn around_the_pole_the_array_turns() {
        // Seen from the pole of a sphere, a source at the pole turns the array by the hour angle.
        let view = View::track(FRAC_PI_2, FRAC_PI_2, [1.0, 1.0], 1, &View::snapshot())[0].matrix;
        let (s, c) = 1.0_f64.sin_cos();
        for (row, expected) in view.iter().zip([[c, -s], [s, c]]) {
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{view:?}");
        }
        assert!((View::band(0.08, 8).iter().map(|v| v.matrix[0][0]).sum::<f64>() / 8.0 - 1.0).abs() < 1e-15);
    }
}

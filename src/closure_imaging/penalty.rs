//! Penalties on a small image: departure from the prior, roughness, departure of the total flux, departure of the centroid from the middle.
//!
//! Each is dimensionless: it is divided by powers of the total flux F and of the pixels in a resolution element. The same weights are
//! therefore suitable for any source, cell and array.

/// Weights of the penalties.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PenaltyWeights {
    /// Relative entropy, sum I ln(I / M) / F.
    pub entropy: f64,
    /// Total variation, sum of the lengths of the gradient times the pixels in a resolution over F.
    pub tv: f64,
    /// Total squared variation, the sum of their squares times the fourth power of the pixels in a resolution over F^2.
    pub tv2: f64,
    /// Departure of the total flux, squared, over F^2.
    pub flux: f64,
    /// Squared distance of the centroid from the middle, in units of the resolution. It is needed because closure phases do not determine
    /// the position.
    pub centroid: f64,
}

impl Default for PenaltyWeights {
    fn default() -> Self {
        Self { entropy: 0.5, tv: 0.05, tv2: 0.05, flux: 50.0, centroid: 0.5 }
    }
}

/// The sum of the penalties on images \[m, l\].
#[derive(Debug, Clone)]
pub(super) struct Penalty {
    pub weights: PenaltyWeights,
    /// Image that the entropy is relative to, all positive.
    pub prior: Vec<f64>,
    /// Total flux F.
    pub flux: f64,
    /// Columns and rows.
    pub shape: (usize, usize),
    /// Cells in a resolution.
    pub cells: f64,
}

/// Smoothing of the total variation near zero, as a fraction of the mean brightness. It is small enough not to change edges.
const CORNER: f64 = 1e-3;

impl Penalty {
    /// The penalty of an image, whose gradient is added to `gradient`.
    ///
    /// # Reference
    /// Chael et al. 2016, ApJ 829, 11, eqs. 26 to 30; EHT Collaboration 2019, ApJL 875, L4, appendix A.
    pub(super) fn add(&self, image: &[f64], gradient: &mut [f64]) -> f64 {
        let w = &self.weights;
        let f = self.flux;
        let mut value = 0.0;
        if w.entropy > 0.0 {
            let k = w.entropy / f;
            for ((i, m), g) in image.iter().zip(&self.prior).zip(gradient.iter_mut()) {
                let log = (i.max(f64::MIN_POSITIVE) / m).ln();
                value += k * i * log;
                *g += k * (log + 1.0);
            }
        }
        let (nx, ny) = self.shape;
        let (mut sum, mut mx, mut my) = (0.0, 0.0, 0.0);
        let (cx, cy) = ((nx as f64 - 1.0) / 2.0, (ny as f64 - 1.0) / 2.0);
        for (r, row) in image.chunks_exact(nx).enumerate() {
            for (c, i) in row.iter().enumerate() {
                sum += i;
                mx += i * (c as f64 - cx);
                my += i * (r as f64 - cy);
            }
        }
        let excess = (sum - f) / f;
        let (dx, dy) = (mx / (f * self.cells), my / (f * self.cells));
        value += w.flux * excess * excess + w.centroid * (dx * dx + dy * dy);
        for (r, row) in gradient.chunks_exact_mut(nx).enumerate() {
            for (c, g) in row.iter_mut().enumerate() {
                let pull = dx * (c as f64 - cx) + dy * (r as f64 - cy);
                *g += 2.0 * (w.flux * excess + w.centroid * pull / self.cells) / f;
            }
        }
        if w.tv > 0.0 || w.tv2 > 0.0 {
            value += self.variation(image, gradient);
        }
        value
    }

    /// Both variations of an image with a dark frame around it.
    fn variation(&self, image: &[f64], gradient: &mut [f64]) -> f64 {
        let (nx, ny) = self.shape;
        let f = self.flux;
        let corner = (CORNER * f / (nx * ny) as f64).powi(2);
        let (k1, k2) = (self.weights.tv * self.cells / f, self.weights.tv2 * self.cells.powi(4) / (f * f));
        let mut value = 0.0;
        // The image with a dark frame, so that every cell has neighbours.
        let wide = nx + 2;
        let mut framed = vec![0.0; wide * (ny + 2)];
        for (row, from) in framed.chunks_exact_mut(wide).skip(1).zip(image.chunks_exact(nx)) {
            row[1..=nx].copy_from_slice(from);
        }
        let mut push = vec![0.0; framed.len()];
        for r in 0..=ny {
            for k in r * wide..r * wide + nx + 1 {
                let (x, y) = (framed[k + 1] - framed[k], framed[k + wide] - framed[k]);
                let square = x * x + y * y;
                let length = (square + corner).sqrt();
                value += k1 * length + k2 * square;
                let slope = k1 / length + 2.0 * k2;
                push[k + 1] += slope * x;
                push[k + wide] += slope * y;
                push[k] -= slope * (x + y);
            }
        }
        for (row, from) in gradient.chunks_exact_mut(nx).zip(push.chunks_exact(wide).skip(1)) {
            row.iter_mut().zip(&from[1..]).for_each(|(g, p)| *g += p);
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gradients_agree_with_finite_differences() {
        let image: Vec<f64> = (0..30).map(|i| 0.3 + ((i * 7) % 11) as f64 * 0.1).collect();
        let base = Penalty {
            weights: PenaltyWeights { entropy: 0.0, tv: 0.0, tv2: 0.0, flux: 0.0, centroid: 0.0 },
            prior: (0..30).map(|i| 1.0 + 0.05 * i as f64).collect(),
            flux: 20.0,
            shape: (6, 5),
            cells: 2.5,
        };
        type Set = fn(&mut PenaltyWeights);
        let sets: [Set; 5] = [|w| w.entropy = 1.3, |w| w.tv = 0.7, |w| w.tv2 = 0.4, |w| w.flux = 9.0, |w| w.centroid = 3.0];
        for set in sets {
            let mut p = base.clone();
            set(&mut p.weights);
            let mut gradient = vec![0.0; 30];
            p.add(&image, &mut gradient);
            let largest = gradient.iter().fold(0.0_f64, |a, g| a.max(g.abs()));
            for k in 0..30 {
                let moved = |x: f64| {
                    let mut m = image.clone();
                    m[k] += x;
                    p.add(&m, &mut vec![0.0; 30])
                };
                let h = 1e-5;
                let slope = (8.0 * (moved(h) - moved(-h)) - (moved(2.0 * h) - moved(-2.0 * h))) / (12.0 * h);
                assert!((slope - gradient[k]).abs() < 1e-6 * largest, "{:?} {k}: {slope} {}", p.weights, gradient[k]);
            }
        }
    }
}

//! Sums over all closure quantities of one kind, and a sample of them.

/// Largest number of quantities in the sample.
const MOST_POINTS: usize = 20_000;

/// One quantity of the sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosurePoint {
    /// Julian date.
    pub time_jd: f64,
    /// The closure phase in rad, or the logarithm of the closure amplitude.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

/// Sums over the quantities of one kind.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ClosureTally {
    /// Number of quantities.
    pub count: u64,
    square: f64,
    chi2: f64,
    beyond: u64,
    /// Every `stride`-th quantity.
    points: Vec<ClosurePoint>,
    stride: u64,
}

impl ClosureTally {
    /// Add a quantity.
    pub fn add(&mut self, time_jd: f64, value: f64, sigma: f64) {
        self.stride = self.stride.max(1);
        if self.count.is_multiple_of(self.stride) {
            self.points.push(ClosurePoint { time_jd, value, sigma });
            if self.points.len() >= 2 * MOST_POINTS {
                // From here on every second quantity is kept, and half of those that were kept before.
                self.stride *= 2;
                self.points = self.points.iter().step_by(2).copied().collect();
            }
        }
        self.count += 1;
        self.square += value * value;
        if sigma > 0.0 {
            self.chi2 += (value / sigma).powi(2);
            self.beyond += u64::from(value.abs() > 3.0 * sigma);
        }
    }

    /// Root mean square of the values.
    #[must_use]
    pub fn rms(&self) -> f64 {
        (self.square / self.count.max(1) as f64).sqrt()
    }

    /// Chi squared per datum if the source were a point, whose closure quantities are 0.
    #[must_use]
    pub fn chi2_of_a_point(&self) -> f64 {
        self.chi2 / self.count.max(1) as f64
    }

    /// Fraction of the quantities that differ from those of a point by more than three standard deviations.
    #[must_use]
    pub fn beyond_3_sigma(&self) -> f64 {
        self.beyond as f64 / self.count.max(1) as f64
    }

    /// Median of the standard deviations of the sample; 0 without any.
    #[must_use]
    pub fn median_sigma(&self) -> f64 {
        let mut all: Vec<f64> = self.points.iter().map(|p| p.sigma).collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    }

    /// Evenly spread quantities, at most 20,000. More could not be distinguished in a picture.
    pub fn sample(&self) -> impl Iterator<Item = ClosurePoint> + '_ {
        self.points.iter().step_by(self.points.len().div_ceil(MOST_POINTS).max(1)).copied()
    }
}

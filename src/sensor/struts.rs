//! Struts that hold a secondary mirror or a feed: bars from the axis to the rim.

/// Evenly spaced struts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Struts {
    /// How many.
    pub(super) number: usize,
    /// Width, m.
    pub(super) width_m: f64,
    /// Direction of the first one, from the x axis towards the y axis, rad.
    pub(super) angle_rad: f64,
}

impl Struts {
    /// The part of the line at height `y` that each strut covers.
    pub(super) fn spans(&self, y: f64) -> impl Iterator<Item = (f64, f64)> {
        let of = *self;
        (0..of.number).filter_map(move |k| {
            let (sin, cos) = (of.angle_rad + std::f64::consts::TAU * k as f64 / of.number as f64).sin_cos();
            let half = 0.5 * of.width_m;
            // Across the strut: |y cos - x sin| <= half. Along it, outwards: x cos + y sin >= 0.
            let across = limits(-sin, y * cos, -half, half)?;
            let along = limits(cos, y * sin, 0.0, f64::INFINITY)?;
            let span = (across.0.max(along.0), across.1.min(along.1));
            (span.0 < span.1).then_some(span)
        })
    }

    /// The heights of the inner corners, m. Those are also the sides of a strut along the lines.
    pub(super) fn breaks_m(&self) -> impl Iterator<Item = f64> {
        let of = *self;
        (0..of.number).flat_map(move |k| {
            let y = 0.5 * of.width_m * (of.angle_rad + std::f64::consts::TAU * k as f64 / of.number as f64).cos();
            [-y, y]
        })
    }
}

/// The x for which `low <= slope x + offset <= high`.
fn limits(slope: f64, offset: f64, low: f64, high: f64) -> Option<(f64, f64)> {
    if slope.abs() < 1e-12 {
        return (low <= offset && offset <= high).then_some((f64::NEG_INFINITY, f64::INFINITY));
    }
    let (a, b) = ((low - offset) / slope, (high - offset) / slope);
    Some((a.min(b), a.max(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn struts_lie_in_their_directions() {
        let struts = Struts { number: 4, width_m: 0.2, angle_rad: 0.0 };
        let spans: Vec<_> = struts.spans(0.05).collect();
        assert!(spans[0].0.abs() < 1e-12 && spans[0].1 == f64::INFINITY && spans[2].1.abs() < 1e-12, "{spans:?}");
        let up: Vec<_> = struts.spans(1.0).collect();
        assert!(up.len() == 1 && (up[0].0 + 0.1).abs() < 1e-9 && (up[0].1 - 0.1).abs() < 1e-9, "{up:?}");
        let one = Struts { number: 1, width_m: 0.2, angle_rad: std::f64::consts::FRAC_PI_4 };
        assert_eq!(one.spans(-1.0).count(), 0);
        let (a, b) = one.spans(1.0).next().unwrap();
        assert!((b - a - 0.2 * 2.0_f64.sqrt()).abs() < 1e-12 && ((a + b) / 2.0 - 1.0).abs() < 1e-12);
    }
}

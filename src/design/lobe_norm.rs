//! The p-norm of the side lobes: a smooth function that tends to the highest side lobe as p grows.

use super::beam_map::BeamMap;
use super::lobes::LobeGrid;
use super::views::View;

/// Side lobes of some views of an array, on a grid of directions.
#[derive(Debug, Clone)]
pub struct LobeNorm {
    map: BeamMap,
}

impl LobeNorm {
    /// For an array that is observed in these views.
    #[must_use]
    pub fn new(views: &[View], grid: &LobeGrid) -> Self {
        Self { map: BeamMap::new(views, grid) }
    }

    /// The p-norm of |AF|^2 / (N (N - 1)), averaged over the views, with p = 2^doublings. The gradient by the positions is added to `gradient`.
    ///
    /// |AF|^2 / (N (N - 1)) is the beam plus the constant 1 / (N - 1). It is never negative, so its norm needs no absolute values.
    pub fn value(&mut self, xy: &[[f64; 2]], doublings: u32, gradient: &mut [[f64; 2]]) -> f64 {
        self.map.set(xy);
        let (mut largest, mut sum) = (f64::MIN_POSITIVE, 0.0);
        self.map.apply(|a| largest = largest.max(*a));
        let inverse = 1.0 / largest;
        self.map.apply(|a| {
            let ratio = *a * inverse;
            let power = (0..doublings).fold(ratio, |r, _| r * r);
            sum += power;
            // The derivative of the norm needs the power of p - 1.
            *a = power / ratio.max(1e-300);
        });
        let p = f64::from(doublings).exp2();
        let derivative = sum.powf(1.0 / p - 1.0);
        self.map.apply(|a| *a *= derivative);
        self.map.add_gradient(gradient);
        largest * sum.powf(1.0 / p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::array_factor::array_factor;

    /// The p-norm of M numbers lies between the largest and M^(1/p) times the largest.
    #[test]
    fn the_norm_tends_to_the_highest_power_on_the_grid() {
        let xy = [[0.1, 0.2], [-0.3, 0.05], [0.4, -0.4], [0.0, 0.45], [-0.2, -0.33], [0.31, 0.28]];
        let grid = LobeGrid::new(1.3, 6.0, 0.4);
        let power = |d| {
            let (re, im) = array_factor(&xy, d);
            (re * re + im * im) / 30.0
        };
        let highest = grid.directions().map(power).fold(0.0, f64::max);
        let mut norm = LobeNorm::new(&View::snapshot(), &grid);
        for doublings in [3, 6, 10] {
            let value = norm.value(&xy, doublings, &mut [[0.0; 2]; 6]);
            let most = (grid.len() as f64).powf(1.0 / f64::from(doublings).exp2());
            assert!(value >= highest * (1.0 - 1e-12) && value <= highest * most, "{doublings}: {value} {highest}");
        }
    }
}

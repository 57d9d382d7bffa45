//! A circle.

use super::shape::{MadeShape, Shape, positive};

#[derive(Debug)]
struct Circle {
    radius_m: f64,
}

impl Shape for Circle {
    fn half_box_m(&self) -> (f64, f64) {
        (self.radius_m, self.radius_m)
    }

    fn radius_m(&self) -> f64 {
        self.radius_m
    }

    fn spans(&self, y: f64) -> Vec<(f64, f64)> {
        let square = self.radius_m * self.radius_m - y * y;
        if square > 0.0 { vec![(-square.sqrt(), square.sqrt())] } else { Vec::new() }
    }

    fn breaks_m(&self) -> Vec<f64> {
        vec![-self.radius_m, self.radius_m]
    }
}

pub(super) fn make(sizes: &[f64]) -> MadeShape {
    let [diameter] = positive(sizes)?;
    Ok(Box::new(Circle { radius_m: diameter / 2.0 }))
}

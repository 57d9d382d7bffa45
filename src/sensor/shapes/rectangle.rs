//! A rectangle.

use super::shape::{MadeShape, Shape, positive};

#[derive(Debug)]
struct Rectangle {
    half_m: (f64, f64),
}

impl Shape for Rectangle {
    fn half_box_m(&self) -> (f64, f64) {
        self.half_m
    }

    fn radius_m(&self) -> f64 {
        self.half_m.0.hypot(self.half_m.1)
    }

    fn spans(&self, y: f64) -> Vec<(f64, f64)> {
        if y.abs() < self.half_m.1 { vec![(-self.half_m.0, self.half_m.0)] } else { Vec::new() }
    }

    fn breaks_m(&self) -> Vec<f64> {
        vec![-self.half_m.1, self.half_m.1]
    }
}

pub(super) fn make(sizes: &[f64]) -> MadeShape {
    let [width, height] = positive(sizes)?;
    Ok(Box::new(Rectangle { half_m: (width / 2.0, height / 2.0) }))
}

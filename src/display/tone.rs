//! Kelvin to levels and colours, the same in all frames of a film.

use crate::values::need;
use crate::{ChainError, Result, ensure};
use ndarray::ArrayView2;

/// Shares of the pixels that are darker than black and not brighter than white.
const SHARES: (f64, f64) = (0.005, 0.995);

/// Colours of the levels 0 to 255.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Palette(Box<[[u8; 3]; 256]>);

impl Palette {
    /// The colour of each level.
    #[must_use]
    pub fn new(color: impl Fn(u8) -> [u8; 3]) -> Self {
        Self(Box::new(std::array::from_fn(|level| color(level as u8))))
    }

    /// Black to white.
    #[must_use]
    pub fn grey() -> Self {
        Self::new(|level| [level; 3])
    }

    /// True if every level is its own grey.
    #[must_use]
    pub fn is_grey(&self) -> bool {
        *self == Self::grey()
    }

    /// The colour of a level: red, green, blue.
    #[must_use]
    pub fn color(&self, level: u8) -> [u8; 3] {
        self.0[usize::from(level)]
    }

    /// Red, green and blue of all levels.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        self.0.concat()
    }
}

/// The brightness that is drawn black and the one that is drawn white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// Level 0 and below.
    pub black: f64,
    /// Level 255 and above.
    pub white: f64,
}

impl Tone {
    /// Given limits, and percentiles of the pixels of frames where one is not given: the 0.5th and the 99.5th. Pixels without a value do not count.
    ///
    /// # Errors
    /// No pixel with a value, or given limits in the wrong order.
    pub fn of<'a>(frames: impl IntoIterator<Item = ArrayView2<'a, f64>>, black: Option<f64>, white: Option<f64>) -> Result<Self> {
        let mut values: Vec<f64> = frames.into_iter().flat_map(|frame| frame.iter().copied().collect::<Vec<_>>()).collect();
        values.retain(|v| v.is_finite());
        ensure!(!values.is_empty(), ChainError::NoData("no pixel of the frame has a value that could be drawn".into()));
        let mut at = |share: f64| {
            let k = ((share * values.len() as f64) as usize).min(values.len() - 1);
            *values.select_nth_unstable_by(k, f64::total_cmp).1
        };
        let (low, high) = (black.unwrap_or_else(|| at(SHARES.0)), white.unwrap_or_else(|| at(SHARES.1)));
        if black.is_some() || white.is_some() {
            need("white", high, high > low, format!("a brightness above that of black, which is {low}"))?;
        }
        // A frame of one brightness has no range of its own.
        Ok(Self { black: low, white: if high > low { high } else { low + 1.0 } })
    }

    /// The level of a brightness; 0 for one without a value.
    #[must_use]
    pub fn level(self, value: f64) -> u8 {
        (255.0 * ((value - self.black) / (self.white - self.black)).clamp(0.0, 1.0)).round() as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::{Array2, array};

    #[test]
    fn levels_are_in_proportion_and_clipped() {
        let tone = Tone { black: 100.0, white: 200.0 };
        assert_eq!([0.0, 100.0, 150.0, 200.0, 300.0, f64::NAN].map(|v| tone.level(v)), [0, 0, 128, 255, 255, 0]);
    }

    #[test]
    fn limits_are_percentiles_unless_they_are_given() {
        let frame = Array2::from_shape_fn((10, 100), |(r, c)| (100 * r + c) as f64);
        assert_eq!(Tone::of([frame.view()], None, None).unwrap(), Tone { black: 5.0, white: 995.0 });
        assert_eq!(Tone::of([frame.view()], Some(-3.0), None).unwrap(), Tone { black: -3.0, white: 995.0 });
        let flat = array![[7.0, f64::NAN], [7.0, 7.0]];
        assert_eq!(Tone::of([flat.view()], None, None).unwrap(), Tone { black: 7.0, white: 8.0 });
        let told = |black, white| Tone::of([frame.view()], black, white).unwrap_err().to_string();
        assert!(told(Some(300.0), Some(200.0)).contains("white is 200") && told(Some(2000.0), None).contains("2000"));
        assert!(Tone::of([array![[f64::NAN]].view()], None, None).is_err());
    }

    #[test]
    fn a_palette_of_greys_is_known_as_one() {
        assert!(Palette::grey().is_grey() && !Palette::new(|l| [l, l, 0]).is_grey());
        assert_eq!((Palette::grey().color(7), Palette::grey().bytes().len()), ([7; 3], 768));
    }
}

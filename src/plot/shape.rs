//! What pictures are made of: colours, rectangles and shapes.

/// A colour: red, green, blue.
pub(crate) type Rgb = [u8; 3];
/// Text and axes.
pub(crate) const INK: Rgb = [30, 30, 34];
/// Text of less weight.
pub(crate) const DIM: Rgb = [96, 98, 106];
/// Lines behind the data.
pub(crate) const FAINT: Rgb = [224, 224, 228];
/// Background.
pub(crate) const WHITE: Rgb = [255, 255, 255];

/// Which part of a text lies at the given point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Align {
    Left,
    Center,
    Right,
}

/// A rectangle in pixels, y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rect {
    pub(crate) x0: f64,
    pub(crate) y0: f64,
    pub(crate) x1: f64,
    pub(crate) y1: f64,
}

impl Rect {
    pub(crate) fn width(&self) -> f64 {
        self.x1 - self.x0
    }

    pub(crate) fn height(&self) -> f64 {
        self.y1 - self.y0
    }

    pub(crate) fn overlaps(&self, other: &Self) -> bool {
        self.x0 < other.x1 && other.x0 < self.x1 && self.y0 < other.y1 && other.y0 < self.y1
    }
}

/// One shape, in the order of drawing. All coordinates count pixels, y down.
#[derive(Debug, Clone)]
pub(super) enum Shape {
    Line {
        points: Vec<(f64, f64)>,
        color: Rgb,
        width: f64,
    },
    Polygon {
        points: Vec<(f64, f64)>,
        color: Rgb,
        alpha: f64,
    },
    Fill {
        area: Rect,
        color: Rgb,
    },
    /// A rectangle of pixels, the upper row first, with red, green and blue of each.
    Pixels {
        area: Rect,
        width: usize,
        height: usize,
        rgb: Vec<u8>,
    },
    Dot {
        at: (f64, f64),
        radius: f64,
        color: Rgb,
        alpha: f64,
        clip: Rect,
    },
    Text {
        at: (f64, f64),
        text: String,
        em: f64,
        align: Align,
        color: Rgb,
        upwards: bool,
    },
}

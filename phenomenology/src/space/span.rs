//! The part of a line inside a convex body.

/// The part of a line inside a convex body: the distances of its ends, of either sign, and the faces at the ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Distance at which the line enters.
    pub t_in: f64,
    /// Distance at which it leaves.
    pub t_out: f64,
    /// Face by which it enters, from 1.
    pub face_in: u8,
    /// Face by which it leaves, from 1.
    pub face_out: u8,
}

impl Span {
    /// The whole line.
    pub const ALL: Self = Self { t_in: f64::NEG_INFINITY, t_out: f64::INFINITY, face_in: 0, face_out: 0 };

    /// Keeps the part between two distances. Returns whether anything is left.
    #[inline]
    pub fn clip(&mut self, t_in: f64, face_in: u8, t_out: f64, face_out: u8) -> bool {
        if t_in > self.t_in {
            self.t_in = t_in;
            self.face_in = face_in;
        }
        if t_out < self.t_out {
            self.t_out = t_out;
            self.face_out = face_out;
        }
        self.t_in < self.t_out
    }

    /// Keeps the part between two parallel planes, where the coordinate `o + d t` along the ray lies in `lo` to `hi`. Returns whether
    /// anything is left.
    #[inline]
    pub fn slab(&mut self, o: f64, d: f64, lo: f64, hi: f64, faces: (u8, u8)) -> bool {
        if d == 0.0 {
            return o >= lo && o <= hi;
        }
        let inverse = 1.0 / d;
        let (a, b) = ((lo - o) * inverse, (hi - o) * inverse);
        if d > 0.0 { self.clip(a, faces.0, b, faces.1) } else { self.clip(b, faces.1, a, faces.0) }
    }

    /// Keeps the part where `o + d t <= limit`. Returns whether anything is left.
    #[inline]
    pub fn below(&mut self, o: f64, d: f64, limit: f64, face: u8) -> bool {
        if d == 0.0 {
            return o <= limit;
        }
        let t = (limit - o) / d;
        if d > 0.0 { self.clip(f64::NEG_INFINITY, 0, t, face) } else { self.clip(t, face, f64::INFINITY, 0) }
    }

    /// The same span with its distances moved by `dt`.
    #[must_use]
    #[inline]
    pub fn shifted(mut self, dt: f64) -> Self {
        self.t_in += dt;
        self.t_out += dt;
        self
    }
}

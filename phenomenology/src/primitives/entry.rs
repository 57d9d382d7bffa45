//! One row of the table of bodies: the code, the parameters and the faces of a body.

/// The meaning of a group of parameters. It is needed to move a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// Three coordinates of a point.
    Point,
    /// Three components of a vector.
    Vector,
    /// One length.
    Length,
    /// Lower and upper limit on each axis. A turned body with such limits becomes a BOX.
    Extents,
}

impl Group {
    /// Number of parameters in the group.
    pub(super) const fn len(self) -> usize {
        match self {
            Self::Point | Self::Vector => 3,
            Self::Length => 1,
            Self::Extents => 6,
        }
    }
}

/// One row of the table of bodies.
#[derive(Debug)]
pub struct PrimitiveEntry {
    /// Code of three letters.
    pub code: &'static str,
    /// Other codes that select the same body.
    pub aliases: &'static [&'static str],
    /// Names of its parameters in order, for messages and the book.
    pub parameters: &'static str,
    /// Meaning of the parameters.
    pub layout: &'static [Group],
    /// Names of its faces. The first face has number 1.
    pub faces: &'static [&'static str],
    /// Description in one line.
    pub describes: &'static str,
}

impl PrimitiveEntry {
    /// Number of parameters of the body.
    #[must_use]
    pub fn count(&self) -> usize {
        self.layout.iter().map(|g| g.len()).sum()
    }
}

/// Names of the faces of a body with an axis.
pub(super) const AXIAL_FACES: &[&str] = &["side", "base at V", "top at V+H"];

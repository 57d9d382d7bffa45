//! The table of bodies, and the one type that holds any of them.

use super::entry::PrimitiveEntry;
use super::fault::PrimitiveFault;
use super::{box_body, ell, rcc, rec, rpp, sph, trc, wed};
use crate::space::{Bounds, Ray, Span, Vec3};

/// A row of the table of bodies, and the function that builds the body from its parameters.
#[derive(Debug)]
pub struct Primitive {
    /// Code, parameters and faces.
    pub entry: PrimitiveEntry,
    pub(super) build: fn(&[f64]) -> Result<Solid, PrimitiveFault>,
}

impl Primitive {
    /// The row with this code or alias, in upper or lower case.
    #[must_use]
    pub fn by_code(code: &str) -> Option<&'static Self> {
        let is = |known: &str| known.eq_ignore_ascii_case(code);
        PRIMITIVES.iter().find(|p| is(p.entry.code) || p.entry.aliases.iter().any(|a| is(a)))
    }
}

macro_rules! solids {
    ($($doc:literal $variant:ident = $module:ident::$shape:ident;)*) => {
        /// The shape of a body, ready for rays.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Solid {$(
            #[doc = $doc]
            $variant($module::$shape),
        )*}

        /// Every body.
        pub static PRIMITIVES: &[Primitive] =
            &[$(Primitive { entry: $module::ENTRY, build: |p| $module::$shape::new(p).map(Solid::$variant) }),*];

        impl Solid {
            /// The part of a line inside the body. Distances may be negative.
            #[must_use]
            #[inline]
            pub fn intersect(&self, ray: &Ray) -> Option<Span> {
                match self {$(Self::$variant(s) => s.intersect(ray),)*}
            }

            /// Outward unit normal of a face at a point on it.
            #[must_use]
            pub fn normal(&self, face: u8, point: Vec3) -> Vec3 {
                match self {$(Self::$variant(s) => s.normal(face, point),)*}
            }

            /// A box along the axes that holds the body.
            #[must_use]
            pub fn bounds(&self) -> Bounds {
                match self {$(Self::$variant(s) => s.bounds(),)*}
            }

            /// Whether a point lies inside or on the body.
            #[must_use]
            pub fn contains(&self, point: Vec3) -> bool {
                match self {$(Self::$variant(s) => s.contains(point),)*}
            }
        }
    };
}

solids! {
    "Box along the axes." Rpp = rpp::Rpp;
    "Box of any orientation." Box = box_body::BoxBody;
    "Sphere." Sph = sph::Sph;
    "Circular cylinder." Rcc = rcc::Rcc;
    "Elliptic cylinder." Rec = rec::Rec;
    "Truncated cone." Trc = trc::Trc;
    "Ellipsoid of revolution." Ell = ell::Ell;
    "Wedge." Wed = wed::Wed;
}

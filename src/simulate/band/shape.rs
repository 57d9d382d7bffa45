//! Shapes of bands: the complex response of a receiver over a channel.

use crate::Result;
use crate::values::{by_text, need};
use cittert_arrays::BandTable;
use num_complex::Complex64;
use std::f64::consts::{LN_2, PI};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

/// Response over x, the distance from the middle of a channel in widths of the channel.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum BandShape {
    /// 1 within the channel and 0 beyond it.
    #[default]
    Flat,
    /// exp(-2 ln 2 x^2): half of the power at the edges of the channel.
    Gaussian,
    /// The maximally flat filter of some poles: half of the power at the edges.
    ///
    /// # Reference
    /// Butterworth 1930, Exp. Wireless 7, 536.
    Butterworth {
        /// Number of poles.
        order: u32,
    },
    /// The equal-ripple filter of the first kind: the ripple ends at the edges.
    ///
    /// # Reference
    /// Weinberg 1962, Network Analysis and Synthesis, sect. 11.3.
    Chebyshev {
        /// Number of poles.
        order: u32,
        /// Ripple of the power, dB.
        ripple_db: f64,
    },
    /// A measured response in a file that is still to be read.
    File(PathBuf),
    /// A measured response.
    Table(Arc<BandTable>),
}

/// Orders of filters. That of one pole has no end: its skirts hold a hundredth of its power at 16 widths of the channel.
const ORDERS: std::ops::RangeInclusive<u32> = 2..=16;
/// Part of the power that the skirts beyond [`BandShape::reach`] hold.
const LOST: f64 = 2e-5;

by_text!(BandShape, "string", "flat, gaussian, butterworth:ORDER, chebyshev:ORDER,RIPPLE (in dB) or the name of a CSV file");

impl fmt::Display for BandShape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flat => f.write_str("flat"),
            Self::Gaussian => f.write_str("gaussian"),
            Self::Butterworth { order } => write!(f, "butterworth:{order}"),
            Self::Chebyshev { order, ripple_db } => write!(f, "chebyshev:{order},{ripple_db}"),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Table(_) => f.write_str("table"),
        }
    }
}

impl FromStr for BandShape {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (kind, rest) = text.split_once(':').map_or((text, None), |(kind, rest)| (kind, Some(rest)));
        let order = |t: &str| t.parse().ok().ok_or_else(|| format!("{t:?} is not the order of a filter, such as 4"));
        match (kind, rest) {
            ("flat", None) => Ok(Self::Flat),
            ("gaussian", None) => Ok(Self::Gaussian),
            ("butterworth", Some(n)) => Ok(Self::Butterworth { order: order(n)? }),
            ("chebyshev", Some(both)) => {
                let (n, ripple) = both.split_once(',').ok_or("chebyshev needs its order and its ripple in dB, such as chebyshev:5,0.5")?;
                let number = ripple.trim_end_matches("dB").trim().parse();
                Ok(Self::Chebyshev { order: order(n)?, ripple_db: number.map_err(|_| format!("{ripple:?} is not a ripple in dB"))? })
            }
            _ if text.to_ascii_lowercase().ends_with(".csv") => Ok(Self::File(text.into())),
            _ => Err(format!(
                "{text:?} is no shape of a band: use flat, gaussian, butterworth:ORDER, chebyshev:ORDER,RIPPLE or a file NAME.csv"
            )),
        }
    }
}

impl BandShape {
    /// Check the numbers.
    ///
    /// # Errors
    /// An order outside 2 to 16, a ripple that is not positive, or a file that was not read.
    pub fn check(&self) -> Result<()> {
        match self {
            Self::Butterworth { order } | Self::Chebyshev { order, .. } if !ORDERS.contains(order) => {
                need("band-shape", self, false, "a filter of 2 to 16 poles; the skirts of a single pole have no end")
            }
            Self::Chebyshev { ripple_db, .. } => need("band-shape", self, (0.001..=6.0).contains(ripple_db), "a ripple of 0.001 to 6 dB"),
            Self::File(_) => need("band-shape", self, false, "a shape whose file was read"),
            _ => Ok(()),
        }
    }

    /// Response at a distance from the middle of the channel, in widths of the channel. The scale is arbitrary. Filters delay: the phase of
    /// their response grows with the frequency, in the convention V = H1 conj(H2).
    pub(super) fn response(&self, x: f64) -> Complex64 {
        let poles = |pole: &dyn Fn(f64) -> Complex64, order: u32| {
            let s = Complex64::new(0.0, -2.0 * x);
            (0..order).map(|k| pole(PI * (2.0 * f64::from(k) + 1.0) / (2.0 * f64::from(order)))).map(|p| -p / (s - p)).product()
        };
        match self {
            Self::Flat => Complex64::from(f64::from(x.abs() <= 0.5)),
            Self::Gaussian => Complex64::from((-2.0 * LN_2 * x * x).exp()),
            Self::Butterworth { order } => poles(&|t| Complex64::new(-t.sin(), t.cos()), *order),
            Self::Chebyshev { order, ripple_db } => {
                let a = (1.0 / epsilon_squared(*ripple_db).sqrt()).asinh() / f64::from(*order);
                poles(&|t| Complex64::new(-a.sinh() * t.sin(), a.cosh() * t.cos()), *order)
            }
            Self::File(_) | Self::Table(_) => Complex64::ZERO,
        }
    }

    /// Largest distance from the middle that counts, in widths of the channel.
    pub(super) fn reach(&self) -> f64 {
        // Far from the channel the power of n poles is (2 x)^(-2 n) / scale.
        let skirts = |order: u32, scale: f64| {
            let n = 2.0 * f64::from(order) - 1.0;
            (0.5 * (n * scale * LOST).powf(-1.0 / n)).max(0.6)
        };
        match self {
            Self::Gaussian => 2.4,
            Self::Butterworth { order } => skirts(*order, 1.0),
            Self::Chebyshev { order, ripple_db } => skirts(*order, epsilon_squared(*ripple_db) * 4_f64.powi(*order as i32 - 1)),
            Self::Flat | Self::File(_) | Self::Table(_) => 0.5,
        }
    }
}

fn epsilon_squared(ripple_db: f64) -> f64 {
    10_f64.powf(ripple_db / 10.0) - 1.0
}

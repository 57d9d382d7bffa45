//! The numbers of a file, big-endian.

use super::header::Header;
use crate::{FormatError, Result};

/// Type of numbers in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Number {
    Byte,
    Short,
    Int,
    Long,
    Float,
    Double,
}

impl Number {
    /// From BITPIX.
    pub(crate) fn of(header: &Header) -> Result<Self> {
        Ok(match header.require("BITPIX", -64..=64)? {
            8 => Self::Byte,
            16 => Self::Short,
            32 => Self::Int,
            64 => Self::Long,
            -32 => Self::Float,
            -64 => Self::Double,
            other => return Err(FormatError::malformed(header.path(), "BITPIX", "8, 16, 32, 64, -32 or -64", other.to_string())),
        })
    }

    /// From the letter of a TFORM; `None` for columns of anything else.
    pub(super) fn of_letter(letter: u8) -> Option<Self> {
        Some(match letter {
            b'B' => Self::Byte,
            b'I' => Self::Short,
            b'J' => Self::Int,
            b'K' => Self::Long,
            b'E' => Self::Float,
            b'D' => Self::Double,
            _ => return None,
        })
    }

    /// Bytes of one number.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::Byte => 1,
            Self::Short => 2,
            Self::Int | Self::Float => 4,
            Self::Long | Self::Double => 8,
        }
    }

    /// Number `k` of a buffer.
    pub(crate) fn get(self, buffer: &[u8], k: usize) -> f64 {
        let at = k * self.bytes();
        let b = &buffer[at..at + self.bytes()];
        match (self, b) {
            (Self::Byte, &[a]) => f64::from(a),
            (Self::Short, &[a, b]) => f64::from(i16::from_be_bytes([a, b])),
            (Self::Int, &[a, b, c, d]) => f64::from(i32::from_be_bytes([a, b, c, d])),
            (Self::Float, &[a, b, c, d]) => f64::from(f32::from_be_bytes([a, b, c, d])),
            (Self::Long, b) => b.try_into().map_or(f64::NAN, |b| i64::from_be_bytes(b) as f64),
            (_, b) => b.try_into().map_or(f64::NAN, f64::from_be_bytes),
        }
    }
}

/// A stored number as the physical value. Unscaled numbers keep every bit.
pub(crate) fn scaled(number: f64, scale: f64, zero: f64) -> f64 {
    if scale == 1.0 && zero == 0.0 { number } else { number * scale + zero }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_every_kind() {
        assert_eq!(Number::Short.get(&[0, 0, 0xff, 0xfe], 1), -2.0);
        assert_eq!(Number::Byte.get(&[7, 200], 1), 200.0);
        assert_eq!(Number::Int.get(&(-5i32).to_be_bytes(), 0), -5.0);
        assert_eq!(Number::Long.get(&(-5i64).to_be_bytes(), 0), -5.0);
        assert_eq!(Number::Float.get(&1.5f32.to_be_bytes(), 0), 1.5);
        assert_eq!(Number::Double.get(&0.1f64.to_be_bytes(), 0), 0.1);
    }
}

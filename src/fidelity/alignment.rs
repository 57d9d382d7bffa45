//! Whether two grids have the same direction at the same pixel, and where a direction of one lies in the other.

use crate::{ChainError, Result};
use cittert_arrays::{SkyFrame, SkyGrid};

/// Check that two grids have the same direction at the same pixel.
///
/// # Errors
/// The grids differ. The message gives the first difference with both values.
pub fn check_alignment(a: &SkyGrid, b: &SkyGrid) -> Result<()> {
    let differ = |what: &str, x: String, y: String| Err(ChainError::Incompatible(format!("the {what} differs: {x} against {y}")));
    if (a.n_l, a.n_m) != (b.n_l, b.n_m) {
        return differ("size", format!("{} x {} pixels", a.n_l, a.n_m), format!("{} x {} pixels", b.n_l, b.n_m));
    }
    let arcsec = |x: f64| format!("{:.6} arcsec", x.to_degrees() * 3600.0);
    // A hundredth of a cell at the edge of the frame.
    if (a.cell_rad - b.cell_rad).abs() * a.n_l.max(a.n_m) as f64 > 0.02 * a.cell_rad {
        return differ("cell", arcsec(a.cell_rad), arcsec(b.cell_rad));
    }
    match (centre(&a.frame), centre(&b.frame)) {
        (None, None) => Ok(()),
        (Some(_), Some(_)) if a.frame.is_b1950() != b.frame.is_b1950() => differ("equinox", in_words(&a.frame), in_words(&b.frame)),
        (Some((ra_rad, dec_rad)), Some((ra, dec))) => {
            let d_ra = (ra_rad - ra + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI;
            if (d_ra * dec.cos()).hypot(dec_rad - dec) > 0.01 * a.cell_rad {
                return differ("centre", in_words(&a.frame), in_words(&b.frame));
            }
            Ok(())
        }
        _ => differ("frame", in_words(&a.frame), in_words(&b.frame)),
    }
}

/// Right ascension and declination of the centre, rad; `None` for a boresight.
fn centre(frame: &SkyFrame) -> Option<(f64, f64)> {
    match frame {
        SkyFrame::Boresight => None,
        SkyFrame::Sky { ra_rad, dec_rad, .. } => Some((*ra_rad, *dec_rad)),
    }
}

/// The centre of a frame, as a message names it.
pub(super) fn in_words(frame: &SkyFrame) -> String {
    match frame {
        SkyFrame::Boresight => "a boresight, which has no place on the sky".into(),
        SkyFrame::Sky { ra_rad, dec_rad, frame } => {
            format!("RA {:.6} deg, Dec {:.6} deg ({frame})", ra_rad.to_degrees(), dec_rad.to_degrees())
        }
    }
}

/// Finds the pixel of one grid that looks in the direction of a pixel of another grid.
pub(super) struct Across<'a> {
    to: &'a SkyGrid,
    from: &'a SkyGrid,
    /// Turns (l, m, n) of `to` into those of `from`; `None` where both are equal.
    turn: Option<[[f64; 3]; 3]>,
}

impl<'a> Across<'a> {
    /// From the pixels of `to` to those of `from`.
    ///
    /// # Errors
    /// One of them has a place on the sky and the other has none, or their coordinates have different equinoxes.
    pub(super) fn new(to: &'a SkyGrid, from: &'a SkyGrid) -> Result<Self> {
        let turn = match (centre(&to.frame), centre(&from.frame)) {
            (None, None) => None,
            (Some(a), Some(b)) if to.frame.is_b1950() == from.frame.is_b1950() => (a != b).then(|| {
                let (rows, columns) = (axes(b), axes(a));
                rows.map(|row| columns.map(|column| (0..3).map(|k| row[k] * column[k]).sum()))
            }),
            _ => {
                return Err(ChainError::Incompatible(format!(
                    "one image is centred on {} and the other on {}: only images of the same coordinates can be compared",
                    in_words(&to.frame),
                    in_words(&from.frame)
                )));
            }
        };
        Ok(Self { to, from, turn })
    }

    /// The place (column, row) in `from` of a pixel of `to`; `None` behind the horizon of either.
    pub(super) fn place(&self, column: usize, row: usize) -> Option<(f64, f64)> {
        let (l, m) = (self.to.l_at(column as f64), self.to.m_at(row as f64));
        let (l, m) = match &self.turn {
            None => (l, m),
            Some(turn) => {
                let n2 = 1.0 - l * l - m * m;
                if n2 <= 0.0 {
                    return None;
                }
                let [l, m, n] = turn.map(|row| row[0] * l + row[1] * m + row[2] * n2.sqrt());
                if n <= 0.0 {
                    return None;
                }
                (l, m)
            }
        };
        Some((self.from.column_of(l), self.from.row_of(m)))
    }
}

/// Unit vectors to the east, to the north and to the centre itself.
fn axes((ra, dec): (f64, f64)) -> [[f64; 3]; 3] {
    let ((sin_a, cos_a), (sin_d, cos_d)) = (ra.sin_cos(), dec.sin_cos());
    [[-sin_a, cos_a, 0.0], [-sin_d * cos_a, -sin_d * sin_a, cos_d], [cos_d * cos_a, cos_d * sin_a, sin_d]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(ra_rad: f64, dec_rad: f64) -> SkyGrid {
        SkyGrid::new(16, 16, 1e-3, SkyFrame::Sky { ra_rad, dec_rad, frame: "icrs".into() }).unwrap()
    }

    #[test]
    fn differences_are_named_in_words() {
        let (a, boresight) = (sky(1.0, 0.3), SkyGrid::new(16, 16, 1e-3, SkyFrame::Boresight).unwrap());
        check_alignment(&a, &a).unwrap();
        let say = |b: &SkyGrid| check_alignment(&a, b).unwrap_err().to_string();
        assert!(say(&SkyGrid { n_l: 17, n_m: 17, ..a.clone() }).contains("17 x 17 pixels"));
        assert!(say(&SkyGrid { cell_rad: 1.1e-3, ..a.clone() }).contains("cell"));
        assert!(say(&sky(1.1, 0.3)).contains("RA 63.025357 deg"));
        assert!(say(&boresight).contains("a boresight, which has no place on the sky"));
        assert!(Across::new(&a, &boresight).err().unwrap().to_string().contains("boresight"));
    }

    #[test]
    fn a_place_keeps_its_direction() {
        let (a, b) = (sky(1.0, 0.3), sky(1.0 + 2e-3 / 0.3_f64.cos(), 0.3));
        let across = Across::new(&a, &b).unwrap();
        // The other centre lies 2e-3 rad further east, so a pixel of the first grid is two columns further west (right) in the second.
        // North turns with the centre by 2e-3 tan(dec), which moves the outer pixels by less than a hundredth of a pixel.
        for (column, row) in [(8, 8), (3, 8), (8, 3)] {
            let (x, y) = across.place(column, row).unwrap();
            assert!((x - column as f64 - 2.0).abs() < 0.01 && (y - row as f64).abs() < 0.01, "{column} {row}: {x} {y}");
        }
        assert_eq!(Across::new(&a, &a).unwrap().place(3, 5), Some((3.0, 5.0)));
        assert!(Across::new(&sky(1.0, 0.3), &sky(1.0 + std::f64::consts::PI, -0.3)).unwrap().place(8, 8).is_none());
    }
}

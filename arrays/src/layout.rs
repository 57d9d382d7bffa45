//! An array of antennas.

use crate::feeds::Mount;
use crate::pattern::airy::shared_diameter;
use crate::{ArrayError, ElementPattern, Result};
use serde::{Deserialize, Serialize};

/// Largest coordinate of an antenna, m: seven times the distance of the Earth from the Sun. A larger one is damaged.
const FARTHEST_M: f64 = 1e12;

/// Sensitivity of an antenna.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Sensitivity {
    /// System equivalent flux density, Jy.
    SefdJy(f64),
    /// System temperature, K.
    TsysK(f64),
}

/// One antenna or receiving element.
#[derive(Debug, Clone, PartialEq)]
pub struct Antenna {
    /// Unique name.
    pub name: String,
    /// Unique number, as in `antenna_numbers` of UVH5.
    pub number: u32,
    /// Position in the frame of its layout, m: x, y, z of the aperture plane, or east, north, up.
    pub position_m: [f64; 3],
    /// Diameter of the aperture, m.
    pub diameter_m: Option<f64>,
    /// Noise of the receiver.
    pub sensitivity: Option<Sensitivity>,
    /// One-sigma uncertainty of each coordinate, m.
    pub position_error_m: Option<[f64; 3]>,
    /// In the header of a set: what the receiver adds to the autocorrelations of this antenna. `None` where the set does not state it; its
    /// autocorrelations then tell nothing of the scene.
    pub receiver: Option<Sensitivity>,
}

impl Antenna {
    /// An antenna with a name, a number and a position only.
    #[must_use]
    pub fn new(name: impl Into<String>, number: u32, position_m: [f64; 3]) -> Self {
        Self { name: name.into(), number, position_m, diameter_m: None, sensitivity: None, position_error_m: None, receiver: None }
    }
}

/// A place on the Earth, geodetic on WGS84.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Site {
    /// Geodetic latitude, rad, north positive.
    pub latitude_rad: f64,
    /// Longitude, rad, east positive.
    pub longitude_rad: f64,
    /// Height above the ellipsoid, m.
    pub altitude_m: f64,
}

/// Frame of the coordinates of a layout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LayoutFrame {
    /// Aperture plane: x to the right as seen looking along the boresight, y up, z along the boresight.
    Boresight,
    /// East, north, up at a site.
    EastNorthUp(Site),
}

/// Antennas and the frame in which their positions are given.
#[derive(Debug, Clone, PartialEq)]
pub struct ArrayLayout {
    /// Name of the array or telescope.
    pub name: String,
    /// Meaning of the coordinates.
    pub frame: LayoutFrame,
    /// Where the positions come from.
    pub source: Option<String>,
    /// Diameter D of the aperture for which the array was designed, m: side lobes are counted to a number of lambda / D. Its longest baseline may be
    /// shorter.
    pub aperture_m: Option<f64>,
    /// Power pattern that all antennas share. In the header of a set: the pattern that its visibilities contain.
    pub pattern: ElementPattern,
    /// Mount of all antennas, where it is stated: the feeds turn with it.
    pub mount: Option<Mount>,
    antennas: Vec<Antenna>,
}

/// Antennas closer than this are taken as one antenna listed twice, m.
const COINCIDENT_M: f64 = 1e-6;

impl ArrayLayout {
    /// Antennas in the frame of the layout.
    ///
    /// # Errors
    /// No antenna, more than 65,535, names or numbers used twice, coordinates that are not finite, a diameter or noise that is
    /// not positive, two antennas at the same place, a site beyond the poles.
    pub fn new(name: impl Into<String>, frame: LayoutFrame, antennas: Vec<Antenna>) -> Result<Self> {
        let layout =
            Self { name: name.into(), frame, source: None, aperture_m: None, pattern: ElementPattern::None, mount: None, antennas };
        layout.check()?;
        Ok(layout)
    }

    /// As [`ArrayLayout::new`], for antenna tables read from measured data: several antennas may stand at one place
    /// (shared pads, placeholders in real files).
    ///
    /// # Errors
    /// As [`ArrayLayout::new`], except for antennas at the same place.
    pub fn from_data(name: impl Into<String>, frame: LayoutFrame, antennas: Vec<Antenna>) -> Result<Self> {
        let layout =
            Self { name: name.into(), frame, source: None, aperture_m: None, pattern: ElementPattern::None, mount: None, antennas };
        layout.check_values()?;
        Ok(layout)
    }

    fn check(&self) -> Result<()> {
        self.check_values()?;
        let mut by_x: Vec<usize> = (0..self.antennas.len()).collect();
        by_x.sort_by(|a, b| self.antennas[*a].position_m[0].total_cmp(&self.antennas[*b].position_m[0]));
        for (i, &a) in by_x.iter().enumerate() {
            for &b in &by_x[i + 1..] {
                let (a, b) = (&self.antennas[a], &self.antennas[b]);
                if b.position_m[0] - a.position_m[0] > COINCIDENT_M {
                    break;
                }
                let distance_m = (0..3).map(|k| (a.position_m[k] - b.position_m[k]).powi(2)).sum::<f64>().sqrt();
                if distance_m < COINCIDENT_M {
                    return Err(ArrayError::CoincidentAntennas { first: a.name.clone(), second: b.name.clone(), distance_m });
                }
            }
        }
        Ok(())
    }

    fn check_values(&self) -> Result<()> {
        let n = self.antennas.len();
        if n == 0 || n > 65_535 {
            return Err(ArrayError::bad_value("number of antennas", n, "1 to 65535"));
        }
        if let LayoutFrame::EastNorthUp(site) = self.frame {
            let finite = site.latitude_rad.is_finite() && site.longitude_rad.is_finite() && site.altitude_m.is_finite();
            if !finite || site.latitude_rad.abs() > std::f64::consts::FRAC_PI_2 + 1e-12 {
                return Err(ArrayError::bad_value(
                    "site latitude, longitude, altitude",
                    format_args!("{} deg, {} deg, {} m", site.latitude_rad.to_degrees(), site.longitude_rad.to_degrees(), site.altitude_m),
                    "finite numbers with the latitude between -90 and 90 deg",
                ));
            }
        }
        let mut names = std::collections::HashSet::new();
        let mut numbers = std::collections::HashSet::new();
        for a in &self.antennas {
            if !names.insert(a.name.as_str()) {
                return Err(ArrayError::Name(format!("antenna name {:?} is used twice", a.name)));
            }
            if !numbers.insert(a.number) {
                return Err(ArrayError::Name(format!("antenna number {} is used twice", a.number)));
            }
            if a.position_m.iter().any(|p| !(p.abs() <= FARTHEST_M)) {
                return Err(ArrayError::bad_value(
                    format_args!("position of antenna {:?}", a.name),
                    format_args!("{:?}", a.position_m),
                    "three finite numbers in metres, none of them beyond 1e12",
                ));
            }
            let noise = match a.sensitivity {
                Some(Sensitivity::SefdJy(v) | Sensitivity::TsysK(v)) => Some(v),
                None => None,
            };
            for (what, value) in [("diameter", a.diameter_m), ("SEFD or Tsys", noise)] {
                if let Some(v) = value.filter(|v| !(v.is_finite() && *v > 0.0)) {
                    return Err(ArrayError::bad_value(format_args!("{what} of antenna {:?}", a.name), v, "a positive, finite number"));
                }
            }
        }
        Ok(())
    }

    /// The antennas; the rows of a set hold indices into this list.
    #[must_use]
    pub fn antennas(&self) -> &[Antenna] {
        &self.antennas
    }

    /// The antennas, to set what is not checked.
    pub(crate) fn antennas_mut(&mut self) -> &mut [Antenna] {
        &mut self.antennas
    }

    /// Number of antennas.
    #[must_use]
    pub fn n_ant(&self) -> usize {
        self.antennas.len()
    }

    /// Number of pairs of different antennas, N (N - 1) / 2.
    #[must_use]
    pub fn n_baselines(&self) -> usize {
        self.n_ant() * (self.n_ant() - 1) / 2
    }

    /// The site, unless the layout is in the boresight frame.
    #[must_use]
    pub fn site(&self) -> Option<Site> {
        match self.frame {
            LayoutFrame::EastNorthUp(site) => Some(site),
            LayoutFrame::Boresight => None,
        }
    }

    /// The diameter that all antennas share, m.
    ///
    /// # Errors
    /// The layout has no diameters, or different ones.
    pub fn shared_diameter_m(&self) -> Result<f64> {
        let shared = shared_diameter(self.antennas.iter().map(|a| (a.name.as_str(), a.diameter_m)));
        shared.map_err(|why| ArrayError::Parse(format!("layout {:?}: {why}: state one diameter for the pattern", self.name)))
    }

    /// Index of the antenna of that name.
    #[must_use]
    pub fn index_of(&self, name: &str) -> Option<usize> {
        self.antennas.iter().position(|a| a.name == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_antennas_at_one_place_are_refused_by_name() {
        let a = |n: &str, i, x| Antenna::new(n, i, [x, 0.0, 0.0]);
        let e = ArrayLayout::new("t", LayoutFrame::Boresight, vec![a("A", 0, 0.0), a("B", 1, 1.0), a("C", 2, 0.0)]).unwrap_err();
        assert!(e.to_string().contains("\"A\"") && e.to_string().contains("\"C\""), "{e}");
    }

    #[test]
    fn different_diameters_are_refused() {
        let mut antennas: Vec<Antenna> = (0..3_u32).map(|k| Antenna::new(format!("A{k}"), k, [f64::from(k), 0.0, 0.0])).collect();
        let of = |antennas: &[Antenna]| ArrayLayout::new("t", LayoutFrame::Boresight, antennas.to_vec()).unwrap().shared_diameter_m();
        assert!(of(&antennas).is_err());
        antennas.iter_mut().for_each(|a| a.diameter_m = Some(2.0));
        assert_eq!(of(&antennas).unwrap(), 2.0);
        antennas[2].diameter_m = Some(3.0);
        assert!(of(&antennas).unwrap_err().to_string().contains("A2"));
    }

    #[test]
    fn a_position_that_is_not_a_number_is_refused() {
        let e = ArrayLayout::new("t", LayoutFrame::Boresight, vec![Antenna::new("A", 0, [f64::NAN, 0.0, 0.0])]).unwrap_err();
        assert!(e.to_string().contains("position of antenna"), "{e}");
    }
}

//! Antennas that stand in front of others.

use crate::{ArrayError, ArrayLayout, CoveragePlan, Result};
use std::collections::HashSet;

/// Rows that are looked at together.
const BLOCK_ROWS: usize = 65_536;

/// How much of a track is lost to shadows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shadowing {
    /// Fraction of the antennas and times at which another antenna blocks a part of the aperture.
    pub fraction: f64,
    /// Largest number of antennas that are shadowed at one time.
    pub most_at_once: usize,
}

impl ArrayLayout {
    /// Shadows on the antennas during a track. An antenna is shadowed where another one is nearer to the source, and the distance of the two as seen
    /// from the source is less than the mean of their diameters.
    ///
    /// # Errors
    /// An antenna without a diameter, and the errors of [`CoveragePlan::rows`].
    pub fn shadowing(&self, plan: &CoveragePlan) -> Result<Shadowing> {
        let diameter = |a: &crate::Antenna| {
            a.diameter_m.ok_or_else(|| {
                ArrayError::bad_value(
                    format_args!("diameter of antenna {:?}", a.name),
                    "not known",
                    "a diameter in the layout, as shadows need it",
                )
            })
        };
        let diameters: Vec<f64> = self.antennas().iter().map(diameter).collect::<Result<_>>()?;
        let (mut blocked, mut present, mut most) = (0, 0, 0);
        for block in plan.blocks(BLOCK_ROWS) {
            let block = block?;
            let mut row = 0;
            // Blocks hold whole integrations.
            while row < block.time_jd.len() {
                let (mut seen, mut dark) = (HashSet::new(), HashSet::new());
                let time = block.time_jd[row];
                while row < block.time_jd.len() && block.time_jd[row] == time {
                    let (a, b) = (block.ant1[row], block.ant2[row]);
                    seen.extend([a, b]);
                    let [u, v, w] = [0, 1, 2].map(|k| block.uvw_m[[row, k]]);
                    if a != b && u.hypot(v) < 0.5 * (diameters[a as usize] + diameters[b as usize]) && w != 0.0 {
                        // w = (r2 - r1) . s: antenna 2 is nearer to the source where it is positive.
                        dark.insert(if w > 0.0 { a } else { b });
                    }
                    row += 1;
                }
                blocked += dark.len();
                present += seen.len();
                most = most.max(dark.len());
            }
        }
        Ok(Shadowing { fraction: if present == 0 { 0.0 } else { blocked as f64 / present as f64 }, most_at_once: most })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Antenna, LayoutFrame, PhaseCenter, Site, Track};
    use std::f64::consts::TAU;

    /// Two antennas on an east-west line at the equator follow a source of declination 0: its elevation is 90 degrees minus the hour angle, so the
    /// western one is in the shadow of the eastern one while b sin(elevation) < d.
    #[test]
    fn shadows_begin_at_the_elevation_of_geometry() {
        let site = Site { latitude_rad: 0.0, longitude_rad: 0.0, altitude_m: 0.0 };
        let antenna = |i: u32, east: f64| Antenna { diameter_m: Some(25.0), ..Antenna::new(format!("A{i}"), i, [east, 0.0, 0.0]) };
        let layout = ArrayLayout::new("t", LayoutFrame::EastNorthUp(site), vec![antenna(0, 0.0), antenna(1, 50.0)]).unwrap();
        let center = PhaseCenter::sidereal("s", 1.0, 0.0).unwrap();
        // From rise to transit: shadowed up to the elevation asin(25 / 50) = 30 of 90 degrees, one antenna of two.
        let track = Track::hour_angles(&center, &site, 2_460_828.0, [-TAU / 4.0, 0.0], 10.0).unwrap();
        let s = layout.shadowing(&CoveragePlan::track(&layout, &center, &track).unwrap()).unwrap();
        // A declination of 0 at J2000 is off by 0.14 degrees at the date.
        assert!((s.fraction - 0.5 / 3.0).abs() < 2e-3, "{}", s.fraction);
        assert_eq!(s.most_at_once, 1);
        let bare = ArrayLayout::new(
            "t",
            LayoutFrame::EastNorthUp(site),
            vec![Antenna::new("x", 0, [0.0; 3]), Antenna::new("y", 1, [9.0, 0.0, 0.0])],
        )
        .unwrap();
        let e = bare.shadowing(&CoveragePlan::track(&bare, &center, &track).unwrap()).unwrap_err().to_string();
        assert!(e.contains("diameter of antenna \"x\" is not known"), "{e}");
    }
}

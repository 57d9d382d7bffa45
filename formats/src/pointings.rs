//! Where the antennas point, as CSV: a line for each antenna and interval, under `time_jd,antenna,pointing_l_rad,pointing_m_rad,width`, and where
//! they were measured `sigma_l_rad,sigma_m_rad`. The width is that of the pattern over the common one.

use crate::atomic::write_file;
use crate::lines::Lines;
use crate::{FormatError, Result};
use cittert_arrays::ArrayLayout;
use cittert_arrays::pattern::{Pointing, Pointings};
use ndarray::Array2;
use std::fmt::Write;
use std::path::Path;

const NAMES: [&str; 7] = ["time_jd", "antenna", "pointing_l_rad", "pointing_m_rad", "width", "sigma_l_rad", "sigma_m_rad"];

/// Write pointings of the antennas of a layout.
///
/// # Errors
/// An existing output that may not be overwritten, or an error of the file system.
pub fn write_pointings(path: &Path, layout: &ArrayLayout, pointings: &Pointings, overwrite: bool) -> Result<()> {
    let n = if pointings.sigma_rad.is_some() { NAMES.len() } else { 5 };
    let mut text = NAMES[..n].join(",") + "\n";
    for (time, jd) in pointings.time_jd.iter().enumerate() {
        for (ant, antenna) in layout.antennas().iter().enumerate() {
            let p = pointings.antennas[[time, ant]];
            // Writing to a String cannot fail.
            let _ = write!(text, "{jd:?},{},{:?},{:?},{:?}", crate::lines::quoted(&antenna.name), p.l, p.m, p.width);
            if let Some(sigma) = &pointings.sigma_rad {
                let [l, m] = sigma[[time, ant]];
                let _ = write!(text, ",{l:?},{m:?}");
            }
            text.push('\n');
        }
    }
    write_file(path, overwrite, text.as_bytes())
}

/// True for a file that begins with the columns of pointings.
#[must_use]
pub fn is_pointings(path: &Path) -> bool {
    crate::files::start_of(path).is_ok_and(|start| String::from_utf8_lossy(&start).lines().any(|l| l.contains("pointing_l_rad")))
}

/// Read pointings, with the names of the antennas in the order of their columns.
///
/// # Errors
/// A column or an antenna that is missing, a number that is none, or a direction that is no direction.
pub fn read_pointings(path: &Path) -> Result<(Vec<String>, Pointings)> {
    let mut lines = Lines::open(path, &NAMES)?;
    lines.require(&NAMES[1..4])?;
    let measured = lines.has("sigma_l_rad") && lines.has("sigma_m_rad");
    let mut rows: Vec<(f64, String, Pointing, [f64; 2])> = Vec::new();
    while lines.next()? {
        let p = Pointing { l: lines.number("pointing_l_rad")?, m: lines.number("pointing_m_rad")?, width: lines.number_or("width", 1.0)? };
        let sigma = if measured { [lines.number("sigma_l_rad")?, lines.number("sigma_m_rad")?] } else { [0.0; 2] };
        rows.push((lines.number_or("time_jd", 0.0)?, lines.text("antenna")?, p, sigma));
    }
    let mut times: Vec<f64> = rows.iter().map(|r| r.0).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    let mut names: Vec<String> = Vec::new();
    for row in &rows {
        if !names.contains(&row.1) {
            names.push(row.1.clone());
        }
    }
    let shape = (times.len(), names.len());
    let (mut found, mut sigma) = (Array2::from_elem(shape, None), Array2::from_elem(shape, [0.0; 2]));
    for (jd, name, p, s) in rows {
        let at = [times.partition_point(|t| *t < jd), names.iter().position(|n| *n == name).unwrap_or(0)];
        if found[at].replace(p).is_some() {
            return Err(FormatError::malformed(path, format!("antenna {name:?} at {jd}"), "one line", "two"));
        }
        sigma[at] = s;
    }
    if let Some(((time, ant), _)) = found.indexed_iter().find(|(_, p)| p.is_none()) {
        return Err(FormatError::malformed(path, format!("antenna {:?} at {}", names[ant], times[time]), "a line", "none"));
    }
    let antennas = found.mapv(Option::unwrap_or_default);
    let pointings = Pointings { time_jd: times, antennas, sigma_rad: measured.then_some(sigma) };
    pointings.check(names.len()).map_err(|e| FormatError::values(path, e))?;
    Ok((names, pointings))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Antenna, LayoutFrame};

    #[test]
    fn pointings_come_back_to_the_last_bit() {
        let antennas = ["A", "B, north"].iter().enumerate().map(|(k, n)| Antenna::new(*n, k as u32, [k as f64, 0.0, 0.0])).collect();
        let layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas).unwrap();
        let mut p = Pointings::nominal(vec![2_460_000.5, 2_460_000.500_1], 2);
        p.antennas[[1, 1]] = Pointing { l: 1.0 / 3.0, m: -1e-7 / 3.0, width: 1.05 };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.csv");
        for sigma in [None, Some(Array2::from_elem((2, 2), [1e-3 / 7.0, 2e-3]))] {
            p.sigma_rad = sigma;
            write_pointings(&path, &layout, &p, true).unwrap();
            assert!(is_pointings(&path));
            assert_eq!(read_pointings(&path).unwrap(), (vec!["A".to_owned(), "B, north".to_owned()], p.clone()));
        }
    }

    #[test]
    fn wrong_files_are_refused_with_the_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.csv");
        let say = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read_pointings(&path).unwrap_err().to_string()
        };
        assert!(say("antenna,pointing_l_rad\nA,0\n").contains("pointing_m_rad"));
        assert!(say("antenna,pointing_l_rad,pointing_m_rad\nA,0,x\n").contains("line 2, pointing_m_rad"));
        assert!(say("antenna,pointing_l_rad,pointing_m_rad\nA,0,0\nA,0,0\n").contains("one line"));
        assert!(say("time_jd,antenna,pointing_l_rad,pointing_m_rad\n1,A,0,0\n2,B,0,0\n").contains("a line"));
        assert!(say("antenna,pointing_l_rad,pointing_m_rad\nA,2,0\n").contains("at most 0.9"));
    }
}

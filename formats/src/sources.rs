//! Source lists: CSV with one header line whose names carry the units.
//!
//! Positions are `l_rad,m_rad` or `ra_deg,dec_deg`; then `flux_jy`; then, optional, `q_jy,u_jy,v_jy` (the other Stokes parameters),
//! `major_rad,minor_rad,pa_rad` (full widths at half maximum and position angle of a Gaussian) and `spectral_index,ref_freq_hz`. Lines that begin with `#` are comments.

use crate::atomic::write_file;
use crate::files::open_file;
use crate::format::{Format, Holds, Label, SourceFormat};
use crate::{FormatError, Result};
use cittert_arrays::{Source, SourcePosition, SourceShape};
use std::fmt::Write;
use std::path::Path;

/// Columns that a source list may have.
const COLUMNS: [&str; 13] = [
    "l_rad",
    "m_rad",
    "ra_deg",
    "dec_deg",
    "flux_jy",
    "q_jy",
    "u_jy",
    "v_jy",
    "major_rad",
    "minor_rad",
    "pa_rad",
    "spectral_index",
    "ref_freq_hz",
];
/// Those of the Stokes parameters beside I.
const POLARIZED: [&str; 3] = ["q_jy", "u_jy", "v_jy"];

/// Source lists in the table of formats.
pub(crate) struct SourceList;

impl Format for SourceList {
    fn label(&self) -> Label {
        Label {
            name: "source list",
            extensions: &["csv"],
            description: "points and Gaussians, a line each, under names of columns that carry the units",
        }
    }

    fn sniff(&self, _: &Path, start: &[u8]) -> bool {
        let text = String::from_utf8_lossy(start);
        let names = text.lines().find(|l| !l.trim_start().starts_with('#') && !l.trim().is_empty()).unwrap_or("");
        names.split(',').any(|n| n.trim() == "flux_jy")
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Sources(SourceFormat { read: read_sources, write: write_sources })
    }
}

/// The columns of a file.
struct Columns<'a> {
    path: &'a Path,
    /// Index in the file of each of [`COLUMNS`].
    at: [Option<usize>; COLUMNS.len()],
    equatorial: bool,
}

/// One line, with its number for errors.
struct Line<'a> {
    number: u64,
    record: &'a csv::StringRecord,
}

impl<'a> Columns<'a> {
    fn of(path: &'a Path, header: &csv::StringRecord, line: u64) -> Result<Self> {
        let bad = |expected: &str, found: String| FormatError::malformed(path, format!("line {line} (column names)"), expected, found);
        let mut at = [None; COLUMNS.len()];
        for (k, name) in header.iter().enumerate() {
            let name = name.trim();
            let Some(column) = COLUMNS.iter().position(|c| *c == name) else {
                return Err(bad(&format!("names out of {}", COLUMNS.join(", ")), format!("{name:?}")));
            };
            if at[column].replace(k).is_some() {
                return Err(bad("each column once", format!("{name:?} twice")));
            }
        }
        let has = |names: &[&str]| names.iter().all(|n| COLUMNS.iter().position(|c| c == n).is_some_and(|c| at[c].is_some()));
        let (direct, equatorial) = (has(&["l_rad", "m_rad"]), has(&["ra_deg", "dec_deg"]));
        if direct == equatorial || !has(&["flux_jy"]) {
            return Err(bad("l_rad, m_rad (or ra_deg, dec_deg) and flux_jy", header.iter().collect::<Vec<_>>().join(",")));
        }
        Ok(Self { path, at, equatorial })
    }

    /// The number in a column of a line; `None` where the column does not exist or the field is empty.
    fn number(&self, line: &Line<'_>, name: &str) -> Result<Option<f64>> {
        let at = COLUMNS.iter().position(|c| *c == name).and_then(|c| self.at[c]);
        let Some(text) = at.and_then(|k| line.record.get(k)).map(str::trim).filter(|t| !t.is_empty()) else { return Ok(None) };
        match text.parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(Some(v)),
            _ => Err(self.bad(line, name, "a finite number", format!("{text:?}"))),
        }
    }

    fn require(&self, line: &Line<'_>, name: &str) -> Result<f64> {
        self.number(line, name)?.ok_or_else(|| self.bad(line, name, "a finite number", "nothing".into()))
    }

    fn bad(&self, line: &Line<'_>, name: &str, expected: &str, found: String) -> FormatError {
        FormatError::malformed(self.path, format!("line {}, {name}", line.number), expected, found)
    }

    fn source(&self, line: &Line<'_>) -> Result<Source> {
        let position = if self.equatorial {
            let (ra, dec) = (self.require(line, "ra_deg")?, self.require(line, "dec_deg")?);
            if dec.abs() > 90.0 {
                return Err(self.bad(line, "dec_deg", "-90 to 90", dec.to_string()));
            }
            SourcePosition::RaDec { ra_rad: ra.to_radians().rem_euclid(std::f64::consts::TAU), dec_rad: dec.to_radians() }
        } else {
            let (l, m) = (self.require(line, "l_rad")?, self.require(line, "m_rad")?);
            if l * l + m * m >= 1.0 {
                return Err(self.bad(line, "l_rad, m_rad", "direction cosines with l^2 + m^2 < 1", format!("{l}, {m}")));
            }
            SourcePosition::DirectionCosines { l, m }
        };
        let widths = [self.number(line, "major_rad")?, self.number(line, "minor_rad")?];
        for (name, width) in ["major_rad", "minor_rad"].iter().zip(widths) {
            if let Some(w) = width.filter(|w| *w < 0.0) {
                return Err(self.bad(line, name, "a width of at least 0", w.to_string()));
            }
        }
        let shape = match (widths[0].filter(|w| *w > 0.0), widths[1].filter(|w| *w > 0.0)) {
            (None, None) => SourceShape::Point,
            (Some(major_rad), minor) => {
                let pa_rad = self.number(line, "pa_rad")?.unwrap_or(0.0);
                SourceShape::Gaussian { major_rad, minor_rad: minor.unwrap_or(if widths[1].is_some() { 0.0 } else { major_rad }), pa_rad }
            }
            (None, Some(w)) => {
                return Err(self.bad(line, "major_rad", "a major axis where there is a minor one", format!("minor_rad = {w} alone")));
            }
        };
        let spectral_index = self.number(line, "spectral_index")?.unwrap_or(0.0);
        let ref_freq_hz = self.number(line, "ref_freq_hz")?;
        if let Some(f) = ref_freq_hz.filter(|f| *f <= 0.0) {
            return Err(self.bad(line, "ref_freq_hz", "a positive frequency", f.to_string()));
        }
        if spectral_index != 0.0 && ref_freq_hz.is_none() {
            return Err(self.bad(line, "ref_freq_hz", "a reference frequency, as there is a spectral index", "nothing".into()));
        }
        let mut polarized_jy = [0.0; 3];
        for (value, name) in polarized_jy.iter_mut().zip(POLARIZED) {
            *value = self.number(line, name)?.unwrap_or(0.0);
        }
        Ok(Source { position, flux_jy: self.require(line, "flux_jy")?, polarized_jy, shape, spectral_index, ref_freq_hz })
    }
}

/// Read a source list.
///
/// # Errors
/// A column that is not known or is listed twice, a missing position or flux density, or a field that is not a finite number. Each error
/// names the line.
pub fn read_sources(path: &Path) -> Result<Vec<Source>> {
    let file = open_file(path)?;
    let mut reader = csv::ReaderBuilder::new().has_headers(false).comment(Some(b'#')).trim(csv::Trim::All).from_reader(file);
    let mut columns: Option<Columns<'_>> = None;
    let mut sources = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| {
            let line = e.position().map_or("text".into(), |p| format!("line {}", p.line()));
            FormatError::malformed(path, line, "as many fields as there are column names, in UTF-8", e.to_string())
        })?;
        let number = record.position().map_or(0, csv::Position::line);
        match &columns {
            None => columns = Some(Columns::of(path, &record, number)?),
            Some(c) => sources.push(c.source(&Line { number, record: &record })?),
        }
    }
    if columns.is_none() || sources.is_empty() {
        return Err(FormatError::malformed(path, "source list", "column names and at least one source", "none"));
    }
    Ok(sources)
}

/// Write a source list. Properties that no source has get no column.
///
/// # Errors
/// Positions on the sky mixed with direction cosines, an existing output that may not be overwritten, or an error of the file system.
pub fn write_sources(path: &Path, sources: &[Source], overwrite: bool) -> Result<()> {
    let equatorial = sources.iter().any(|s| matches!(s.position, SourcePosition::RaDec { .. }));
    let polarized = sources.iter().any(Source::is_polarized);
    let shapes = sources.iter().any(|s| s.shape != SourceShape::Point);
    let spectra = sources.iter().any(|s| s.spectral_index != 0.0);
    let mut text = String::from(if equatorial { "ra_deg,dec_deg,flux_jy" } else { "l_rad,m_rad,flux_jy" });
    text.push_str(if polarized { ",q_jy,u_jy,v_jy" } else { "" });
    text.push_str(if shapes { ",major_rad,minor_rad,pa_rad" } else { "" });
    text.push_str(if spectra { ",spectral_index,ref_freq_hz\n" } else { "\n" });
    for s in sources {
        let mut fields = match s.position {
            SourcePosition::RaDec { ra_rad, dec_rad } => vec![ra_rad.to_degrees(), dec_rad.to_degrees()],
            SourcePosition::DirectionCosines { l, m } if !equatorial => vec![l, m],
            SourcePosition::DirectionCosines { .. } => {
                return Err(FormatError::unsupported(path, "a list cannot mix right ascensions and direction cosines"));
            }
        };
        fields.push(s.flux_jy);
        if polarized {
            fields.extend(s.polarized_jy);
        }
        if shapes {
            fields.extend(match s.shape {
                SourceShape::Point => [0.0; 3],
                SourceShape::Gaussian { major_rad, minor_rad, pa_rad } => [major_rad, minor_rad, pa_rad],
            });
        }
        let fields: Vec<String> = fields.iter().map(|v| format!("{v:?}")).collect();
        text.push_str(&fields.join(","));
        if spectra {
            let reference = s.ref_freq_hz.map_or(String::new(), |f| format!("{f:?}"));
            // Writing to a String cannot fail.
            let _ = write!(text, ",{:?},{reference}", s.spectral_index);
        }
        text.push('\n');
    }
    write_file(path, overwrite, text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<Source>> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        read_sources(file.path())
    }

    #[test]
    fn points_and_gaussians_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let mut gaussian = Source::point(-0.004, 0.009, 0.25);
        gaussian.shape = SourceShape::Gaussian { major_rad: 1e-3, minor_rad: 1e-9, pa_rad: 0.1 };
        gaussian.spectral_index = -0.7;
        gaussian.ref_freq_hz = Some(94e9);
        let polarized = Source { polarized_jy: [0.1, -0.2, 0.03], ..gaussian };
        let point = Source::point(0.012, 0.005, 2.0);
        for list in [vec![point], vec![point, gaussian], vec![point, polarized]] {
            let path = dir.path().join("s.csv");
            write_sources(&path, &list, true).unwrap();
            assert_eq!(read_sources(&path).unwrap(), list);
        }
    }

    #[test]
    fn columns_may_come_in_any_order_with_comments_between() {
        let s = read("# mine\nflux_jy, dec_deg ,ra_deg\n# 3C 48\n16.0,33.16,24.42\n").unwrap();
        assert_eq!(s.len(), 1);
        let SourcePosition::RaDec { ra_rad, dec_rad } = s[0].position else { panic!("{s:?}") };
        assert_eq!((ra_rad, dec_rad), (24.42_f64.to_radians(), 33.16_f64.to_radians()));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        for (text, words) in [
            ("l_rad,m_rad,flux\n0,0,1\n", ["line 1", "\"flux\""]),
            ("l_rad,m_rad,flux_jy,flux_jy\n0,0,1,1\n", ["line 1", "twice"]),
            ("l_rad,m_rad\n0,0\n", ["line 1", "flux_jy"]),
            ("l_rad,m_rad,flux_jy\n0,0,1\n0,x,1\n", ["line 3, m_rad", "\"x\""]),
            ("l_rad,m_rad,flux_jy\n0,0,NaN\n", ["line 2, flux_jy", "NaN"]),
            ("l_rad,m_rad,flux_jy\n0,0\n", ["line 2", "fields"]),
            ("l_rad,m_rad,flux_jy\n0.9,0.9,1\n", ["line 2", "l^2 + m^2"]),
            ("ra_deg,dec_deg,flux_jy\n0,91,1\n", ["dec_deg", "91"]),
            ("l_rad,m_rad,flux_jy,spectral_index\n0,0,1,-1\n", ["ref_freq_hz", "spectral index"]),
            ("l_rad,m_rad,flux_jy\n", ["at least one source", ""]),
        ] {
            let e = read(text).unwrap_err().to_string();
            assert!(words.iter().all(|w| e.contains(w)), "{text:?}: {e}");
        }
    }
}

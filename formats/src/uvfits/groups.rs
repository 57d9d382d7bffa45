//! The parameters of a group: baseline, antennas, time, source.

use crate::fits::{Header, Number, scaled};
use crate::{FormatError, Result};
use cittert_arrays::SPEED_OF_LIGHT_M_S;

/// A parameter: the sum over its parts of number x scale + zero. Two parameters with the same name are two parts of one value.
#[derive(Debug, Clone)]
pub(super) struct Parameter {
    parts: Vec<Part>,
}

#[derive(Debug, Clone, Copy)]
struct Part {
    index: usize,
    scale: f64,
    zero: f64,
}

impl Parameter {
    /// Value in a group.
    pub(super) fn get(&self, number: Number, group: &[u8]) -> f64 {
        let part = |p: &Part| scaled(number.get(group, p.index), p.scale, p.zero);
        // A sum begun with 0.0 would turn -0.0 into 0.0.
        self.parts.iter().map(part).reduce(|a, b| a + b).unwrap_or(f64::NAN)
    }
}

/// Convention of uvw.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UvwKind {
    /// w along the phase centre, as in memory.
    Sin,
    /// w along the celestial pole; rotated by the declination on reading.
    Ncp,
}

/// The parameters of the groups of a file.
#[derive(Debug, Clone)]
pub(super) struct Parameters {
    /// Numbers before the array of a group.
    pub(super) count: usize,
    uvw: [Parameter; 3],
    /// Factor from the file's unit to metres.
    metres: f64,
    pub(super) kind: UvwKind,
    date: Parameter,
    baseline: Option<Parameter>,
    antennas: Option<[Parameter; 2]>,
    subarray: Option<Parameter>,
    pub(super) integration: Option<Parameter>,
    pub(super) source: Option<Parameter>,
    pub(super) freq_id: Option<Parameter>,
}

/// Antenna numbers and subarray of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Pair {
    pub(super) first: i64,
    pub(super) second: i64,
    pub(super) subarray: i64,
}

impl Parameters {
    /// Read PTYPEn, PSCALn, PZEROn; `frequency_hz` converts uvw in wavelengths to metres.
    pub(super) fn of(header: &Header, frequency_hz: f64) -> Result<Self> {
        let path = header.path();
        let count = header.require("PCOUNT", 0..=999)? as usize;
        let named: Vec<(String, Part)> = (0..count)
            .map(|index| {
                let key = |k: &str| format!("{k}{}", index + 1);
                let name = header.text(&key("PTYPE")).unwrap_or("").trim().to_ascii_uppercase();
                let (scale, zero) = (header.real(&key("PSCAL")).unwrap_or(1.0), header.real(&key("PZERO")).unwrap_or(0.0));
                (name, Part { index, scale, zero })
            })
            .collect();
        let find = |name: &str| {
            let parts: Vec<Part> = named.iter().filter(|p| p.0.trim_start_matches('_') == name).map(|p| p.1).collect();
            if parts.is_empty() { None } else { Some(Parameter { parts }) }
        };
        let missing = |what: &str| {
            let found = named.iter().map(|p| p.0.as_str()).collect::<Vec<_>>().join(" ");
            FormatError::malformed(path, "PTYPEn", what, format!("the parameters {found}"))
        };
        // UU, UU--, UU---SIN, UU---NCP, UU-L-SIN (wavelengths): the three must have the same end.
        let suffix = named.iter().find_map(|p| p.0.strip_prefix("UU")).ok_or_else(|| missing("UU, VV and WW with one suffix"))?.to_string();
        let mut uvw = Vec::new();
        for name in ["UU", "VV", "WW"] {
            uvw.push(find(&format!("{name}{suffix}")).ok_or_else(|| missing("UU, VV and WW with one suffix"))?);
        }
        let [u, v, w] = <[Parameter; 3]>::try_from(uvw).map_err(|_| missing("UU, VV and WW"))?;
        let kind = match suffix.trim_matches('-').trim_start_matches("L-") {
            "" | "SIN" | "L" => UvwKind::Sin,
            "NCP" => UvwKind::Ncp,
            _ => return Err(missing("UU, VV and WW without a suffix, or with ---SIN or ---NCP")),
        };
        let wavelengths = suffix.trim_start_matches('-').starts_with('L');
        let date = find("DATE").ok_or_else(|| missing("DATE"))?;
        let antennas = find("ANTENNA1").zip(find("ANTENNA2")).map(|(a, b)| [a, b]);
        let baseline = find("BASELINE");
        if antennas.is_none() && baseline.is_none() {
            return Err(missing("BASELINE, or ANTENNA1 and ANTENNA2"));
        }
        Ok(Self {
            count,
            uvw: [u, v, w],
            metres: if wavelengths { SPEED_OF_LIGHT_M_S / frequency_hz } else { SPEED_OF_LIGHT_M_S },
            kind,
            date,
            baseline,
            antennas,
            subarray: find("SUBARRAY"),
            integration: find("INTTIM"),
            source: find("SOURCE"),
            freq_id: find("FREQSEL"),
        })
    }

    /// Baseline in metres, second antenna minus first.
    pub(super) fn uvw_m(&self, number: Number, group: &[u8]) -> [f64; 3] {
        [0, 1, 2].map(|k| -self.uvw[k].get(number, group) * self.metres)
    }

    /// Time, Julian date: the sum of all DATE parameters.
    pub(super) fn time_jd(&self, number: Number, group: &[u8]) -> f64 {
        self.date.get(number, group)
    }

    /// Antenna numbers of the group.
    pub(super) fn pair(&self, number: Number, group: &[u8]) -> Pair {
        if let Some(antennas) = &self.antennas {
            let [first, second] = [0, 1].map(|k| antennas[k].get(number, group).round() as i64);
            let subarray = self.subarray.as_ref().map_or(1, |p| p.get(number, group).round() as i64);
            return Pair { first, second, subarray };
        }
        decode_baseline(self.baseline.as_ref().map_or(0.0, |p| p.get(number, group)))
    }
}

/// Antenna numbers of a BASELINE: 256 a1 + a2, or 2048 a1 + a2 + 65536, plus (subarray - 1) / 100.
fn decode_baseline(value: f64) -> Pair {
    let whole = (value + 0.0005).floor();
    let subarray = ((value - whole) * 100.0).round().max(0.0) as i64 + 1;
    let b = whole as i64;
    let (first, second) = if b >= 65_536 { ((b - 65_536) / 2048, (b - 65_536) % 2048) } else { (b / 256, b % 256) };
    Pair { first, second, subarray }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_conventions_of_baseline_are_decoded() {
        let pair = |first, second, subarray| Pair { first, second, subarray };
        assert_eq!(decode_baseline(262.0), pair(1, 6, 1));
        assert_eq!(decode_baseline(65_535.0), pair(255, 255, 1));
        assert_eq!(decode_baseline(2048.0 * 256.0 + 300.0 + 65_536.0), pair(256, 300, 1));
        assert_eq!(decode_baseline(f64::from(258.01_f32)), pair(1, 2, 2));
    }
}

//! The text of a scan pattern.

use super::kind::{Field, ScanKind};
use super::samples::Samples;
use super::table::SCANS;
use crate::values::by_text;
use crate::{Result, ensure};
use cittert_arrays::quantity::Angle;
use std::fmt;
use std::str::FromStr;

/// A pattern as it is written, such as `array` or `conical=20deg`.
#[derive(Debug, Clone)]
pub struct ScanPattern {
    kind: &'static ScanKind,
    size: Option<Angle>,
}
by_text!(ScanPattern, "string", "A scan pattern, such as \"array\" or \"conical=20deg\".");

impl ScanPattern {
    /// The samples of an image.
    ///
    /// # Errors
    /// A field that the pattern cannot cover.
    pub(in crate::sensor) fn samples(&self, field: Field) -> Result<Samples> {
        (self.kind.make)(Field { size_rad: self.size.map_or(0.0, |a| a.si()), ..field })
    }
}

impl Default for ScanPattern {
    fn default() -> Self {
        Self { kind: &SCANS[0], size: None }
    }
}

impl PartialEq for ScanPattern {
    fn eq(&self, other: &Self) -> bool {
        self.kind.name == other.kind.name && self.size == other.size
    }
}

impl fmt::Display for ScanPattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.kind.name)?;
        self.size.map_or(Ok(()), |size| write!(f, "={size}"))
    }
}

impl FromStr for ScanPattern {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, size) = text.trim().split_once('=').map_or((text.trim(), None), |(name, size)| (name.trim(), Some(size)));
        let syntax = |kind: &ScanKind| kind.size.map_or(kind.name.to_owned(), |size| format!("{}={size}", kind.name));
        let known = || SCANS.iter().map(syntax).collect::<Vec<_>>().join(", ");
        let kind = SCANS.iter().find(|s| s.name == name);
        let kind = kind.ok_or_else(|| format!("there is no scan pattern {name:?}; the patterns are {}", known()))?;
        ensure!(size.is_some() == kind.size.is_some(), format!("{text:?} is not a scan pattern, write {}", syntax(kind)));
        let size = size.map(str::parse::<Angle>).transpose().map_err(|e| format!("{name}: {e}"))?;
        ensure!(size.is_none_or(|s| s.si() > 0.0), format!("{name}: the angle must be above 0"));
        Ok(Self { kind, size })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_read_and_written() {
        for text in ["array", "raster", "conical=45deg", "pushbroom"] {
            assert_eq!(text.parse::<ScanPattern>().unwrap().to_string(), text);
        }
        for (text, says) in
            [("spiral", "conical=RADIUS"), ("conical", "conical=RADIUS"), ("raster=3deg", "write raster"), ("conical=0deg", "above 0")]
        {
            let e = text.parse::<ScanPattern>().unwrap_err();
            assert!(e.contains(says), "{e}");
        }
    }

    /// Every sample of every pattern is taken once, by one detector at a time, within the frame.
    #[test]
    fn no_detector_takes_two_samples_at_once_and_all_end_in_the_frame() {
        for text in ["array", "raster", "conical=5deg", "pushbroom"] {
            for beams in [1, 3] {
                let pattern: ScanPattern = text.parse().unwrap();
                let field = Field { dim: (20, 30), pitch_rad: 1e-3, frame_s: 1.0, efficiency: 0.8, beams, step: false, size_rad: 0.0 };
                let samples = pattern.samples(field).unwrap();
                let mut taken: Vec<(usize, f64)> = Vec::new();
                for r in 0..samples.rows {
                    for c in 0..samples.columns {
                        let (detector, start) = (samples.detector(r, c), samples.start_s(r, c));
                        assert!(detector < samples.detectors() && start >= 0.0 && start + samples.dwell_s <= 1.0 + 1e-12, "{text}");
                        taken.push((detector, start));
                    }
                }
                taken.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
                let apart = taken.windows(2).all(|w| w[0].0 != w[1].0 || w[1].1 - w[0].1 >= samples.dwell_s * (1.0 - 1e-9));
                assert!(apart, "{text} {beams}");
                let looked: f64 = samples.dwell_s * (samples.rows * samples.columns) as f64;
                assert!(looked <= 0.8 * samples.detectors() as f64 * (1.0 + 1e-9), "{text}: {looked}");
            }
        }
    }
}

//! The kinds of roughness, and their short names.

use super::choudhury79::QhRoughness;
use super::error::{SurfaceError, bounded};
use super::foam::Foam;
use super::geometric_optics::{Closure, GeometricOptics};
use super::shadowing::Shadowing;
use super::slopes::Slopes;
use std::str::FromStr;

/// Roughness of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Roughness {
    /// A smooth surface.
    #[default]
    Smooth,
    /// Wang & Choudhury: mixing Q, height H, power N.
    Qh(QhRoughness),
    /// Choudhury: damping by the rms height, m.
    Choudhury {
        /// Rms height, m.
        rms_height_m: f64,
    },
    /// Wegmueller & Maetzler, by the rms height, m.
    WegmullerMatzler {
        /// Rms height, m.
        rms_height_m: f64,
    },
    /// Gaussian facets.
    GeometricOptics(GeometricOptics),
}

/// A kind of roughness, as listings show it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RoughnessKind {
    /// Word before the colon.
    pub name: &'static str,
    /// How it is written.
    pub syntax: &'static str,
    /// What it is.
    pub describes: &'static str,
}

/// Every kind of roughness.
pub const ROUGHNESS_KINDS: &[RoughnessKind] = &[
    RoughnessKind { name: "smooth", syntax: "smooth", describes: "plane surface (Fresnel, or the stack)" },
    RoughnessKind { name: "qh", syntax: "qh:Q,H,N", describes: "Wang & Choudhury 1981: ((1-Q) R_p + Q R_q) exp(-H cos^N)" },
    RoughnessKind {
        name: "choudhury",
        syntax: "choudhury:0.5mm",
        describes: "Choudhury et al. 1979: R exp(-(2 k s cos)^2), by the rms height",
    },
    RoughnessKind {
        name: "wegmuller",
        syntax: "wegmuller:0.5mm",
        describes: "Wegmueller & Maetzler 1999, empirical, to 70 degrees, by the rms height",
    },
    RoughnessKind {
        name: "go",
        syntax: "go:su,sc[,single|reemit|second-bounce][,smith|wagner]",
        describes: "Wagner-Lynch facets by rms slopes along and across; a second bounce is followed unless told otherwise",
    },
    RoughnessKind {
        name: "sea",
        syntax: "sea:U[,foam][,single|reemit|second-bounce][,smith|wagner]",
        describes: "facets of a wind-driven sea (Cox & Munk 1954), wind in m/s; with foam by the wind (Monahan & O'Muircheartaigh 1986)",
    },
];

impl FromStr for Roughness {
    type Err = SurfaceError;

    fn from_str(text: &str) -> Result<Self, SurfaceError> {
        let fault = |message: String| SurfaceError::Refused(format!("roughness `{text}`: {message}"));
        let (kind, rest) = text.trim().split_once(':').unwrap_or((text.trim(), ""));
        let words: Vec<&str> = match rest {
            "" => Vec::new(),
            _ => rest.split(',').map(str::trim).collect(),
        };
        let number = |i: usize, what: &str| -> Result<f64, SurfaceError> {
            let word = words.get(i).ok_or_else(|| fault(format!("{what} is missing")))?;
            word.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| fault(format!("{what} is `{word}`, not a finite number")))
        };
        let exactly = |count: usize| {
            if words.len() > count { Err(fault(format!("`{}` is one value too many", words[count]))) } else { Ok(()) }
        };
        let height = || -> Result<f64, SurfaceError> {
            exactly(1)?;
            let word = words.first().ok_or_else(|| fault("the rms height is missing".to_owned()))?;
            let metres = length_m(word).ok_or_else(|| fault(format!("`{word}` is not a length such as 0.5mm, 1cm or 0.001m")))?;
            bounded("rms height in m", metres, 0.0, 10.0).map_err(|e| fault(e.to_string()))
        };
        // `foam` is what the word of this name puts among the facets.
        let facets = |slopes: Slopes, foam: Option<Foam>, words: &[&str]| -> Result<Self, SurfaceError> {
            let mut go = GeometricOptics::new(slopes);
            for word in words {
                match *word {
                    "foam" if foam.is_some() => go.foam = foam,
                    "foam" => return Err(fault("foam belongs to `sea:U`, because the wind makes it".to_owned())),
                    "single" | "none" => go.closure = Closure::Single,
                    "reemit" | "re-emit" => go.closure = Closure::ReEmit,
                    "second-bounce" | "double" => go.closure = Closure::SecondBounce,
                    "smith" => go.shadowing = Shadowing::Smith,
                    "wagner" => go.shadowing = Shadowing::Wagner,
                    other => {
                        let foam = if foam.is_some() { "foam, " } else { "" };
                        return Err(fault(format!("`{other}` is none of {foam}single, reemit, second-bounce, smith, wagner")));
                    }
                }
            }
            Ok(Self::GeometricOptics(go))
        };
        let explain = |e: SurfaceError| fault(e.to_string());
        match kind {
            "smooth" => exactly(0).map(|()| Self::Smooth),
            "qh" => {
                exactly(3)?;
                QhRoughness::new(number(0, "Q")?, number(1, "H")?, number(2, "N")?).map(Self::Qh).map_err(explain)
            }
            "choudhury" => Ok(Self::Choudhury { rms_height_m: height()? }),
            "wegmuller" => Ok(Self::WegmullerMatzler { rms_height_m: height()? }),
            "go" => {
                let slopes = Slopes::new(number(0, "slope su")?, number(1, "slope sc")?);
                facets(slopes.map_err(explain)?, None, &words[2..])
            }
            "sea" => {
                let wind_m_s = number(0, "wind speed")?;
                let slopes = Slopes::cox_munk54(wind_m_s).map_err(explain)?;
                facets(slopes, Some(Foam::monahan86(wind_m_s).map_err(explain)?), &words[1..])
            }
            _ => Err(fault(format!(
                "unknown kind `{kind}`; give one of {}",
                ROUGHNESS_KINDS.iter().map(|k| k.syntax).collect::<Vec<_>>().join("  ")
            ))),
        }
    }
}

/// A length with its unit, in m; none if the text is no length.
pub(super) fn length_m(text: &str) -> Option<f64> {
    let split = text.find(|c: char| c.is_ascii_alphabetic() && c != 'e' && c != 'E')?;
    let (number, unit) = text.split_at(split);
    let scale = match unit {
        "um" => 1e-6,
        "mm" => 1e-3,
        "cm" => 1e-2,
        "m" => 1.0,
        _ => return None,
    };
    number.trim().parse::<f64>().ok().map(|x| x * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_every_kind() {
        assert_eq!("smooth".parse::<Roughness>().unwrap(), Roughness::Smooth);
        let Roughness::Qh(qh) = "qh:0.1,0.5,2".parse().unwrap() else { panic!("qh") };
        assert_eq!((qh.q, qh.h, qh.n), (0.1, 0.5, 2.0));
        let height = Roughness::Choudhury { rms_height_m: 5e-4 };
        assert_eq!("choudhury:0.5mm".parse::<Roughness>().unwrap(), height);
        let Roughness::GeometricOptics(go) = "go:0.2,0.1,second-bounce,wagner".parse().unwrap() else { panic!("go") };
        assert_eq!((go.slopes.along, go.slopes.across), (0.2, 0.1));
        assert_eq!((go.closure, go.shadowing), (Closure::SecondBounce, Shadowing::Wagner));
        let Roughness::GeometricOptics(sea) = "sea:7".parse().unwrap() else { panic!("sea") };
        assert_eq!((sea.slopes, sea.foam), (Slopes::cox_munk54(7.0).unwrap(), None));
        let Roughness::GeometricOptics(sea) = "sea:12,foam,reemit".parse().unwrap() else { panic!("foam") };
        assert_eq!((sea.foam, sea.closure), (Some(Foam::monahan86(12.0).unwrap()), Closure::ReEmit));
    }

    #[test]
    fn says_what_is_wrong() {
        for (text, part) in [
            ("rough", "unknown kind `rough`"),
            ("qh:0.1,0.5", "N is missing"),
            ("qh:0.1,0.5,2,3", "one value too many"),
            ("qh:2,0.5,2", "Q of the roughness is 2"),
            ("go:0.1", "slope sc is missing"),
            ("go:0.1,steep", "`steep`, not a finite number"),
            ("go:0.1,,0.1", "``, not a finite number"),
            ("go:-0.1,0.1", "must lie in"),
            ("go:nan,0.1", "not a finite number"),
            ("go:0.1,0.1,triple", "`triple` is none of"),
            ("choudhury:3", "not a length"),
            ("wegmuller:-1mm", "rms height"),
            ("sea:-2", "wind speed"),
            ("sea:7,spray", "none of foam, single"),
            ("go:0.1,0.1,foam", "belongs to `sea:U`"),
        ] {
            let error = text.parse::<Roughness>().unwrap_err().to_string();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}

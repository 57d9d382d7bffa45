//! Which layout is the best, and by what.

use super::design::Design;
use crate::cli::run::labels::{angle, brightness, digits};

/// Beams are alike whose equivalent width is at most this multiple of the narrowest one. Side lobes can be traded for resolution, so those of
/// beams that are not alike say nothing about which layout is better.
const ALIKE: f64 = 1.2;

/// Side lobes that differ by less are told as equal, dB.
const TIE_DB: f64 = 0.1;

/// What the side lobes of one layout are judged by.
#[derive(Debug, Clone)]
pub(super) struct Beam {
    pub(super) name: String,
    /// Diameter of the circle with the area of the half-power contour, rad.
    pub(super) width_rad: f64,
    pub(super) psl_within_db: f64,
}

/// The error of the image of one layout.
#[derive(Debug, Clone)]
pub(super) struct ImageError {
    pub(super) name: String,
    pub(super) rms: f64,
    pub(super) unit: String,
    pub(super) over_grey_card: f64,
}

/// Layouts from the best to the worst.
#[derive(Debug, PartialEq)]
pub(super) struct Ranking {
    /// The key of the results by which they are ranked.
    pub(super) by: &'static str,
    pub(super) order: Vec<String>,
    /// Layouts that this measure cannot rank.
    pub(super) not_ranked: Vec<String>,
    /// Why the first one is the best, with the numbers.
    pub(super) reason: String,
}

impl Beam {
    pub(super) fn of(design: &Design) -> Self {
        Self { name: design.name.clone(), width_rad: design.figures.half_power_equivalent_rad, psl_within_db: design.figures.psl_within_db }
    }
}

/// By the error of the image of maximum entropy, which is compared with the truth at the resolution that all layouts have.
pub(super) fn by_images(mut all: Vec<ImageError>) -> Ranking {
    all.sort_by(|a, b| a.over_grey_card.total_cmp(&b.over_grey_card));
    let told = |e: &ImageError| format!("{} rms, {} of a grey card", brightness(e.rms, &e.unit), digits(e.over_grey_card));
    let reason = match all.split_first() {
        Some((best, others)) => {
            let others: Vec<String> = others.iter().map(|e| format!("{} has {}", e.name, told(e))).collect();
            let no_better = best.over_grey_card >= 1.0;
            let warning = if no_better { " No layout images the scene: a flat grey card has an error of 1." } else { "" };
            format!(
                "{} gives the best image: the error of its image of maximum entropy is the smallest, {} ({}).{warning}",
                best.name,
                told(best),
                others.join("; ")
            )
        }
        None => String::new(),
    };
    Ranking { by: "mem.error_over_grey_card", order: all.into_iter().map(|e| e.name).collect(), not_ranked: Vec::new(), reason }
}

/// By the peak side lobe, among the layouts whose beams are as narrow as the narrowest.
pub(super) fn by_beams(all: &[Beam]) -> Ranking {
    let narrowest = all.iter().map(|b| b.width_rad).fold(f64::INFINITY, f64::min);
    let (mut alike, wide): (Vec<&Beam>, Vec<&Beam>) = all.iter().partition(|b| b.width_rad <= ALIKE * narrowest);
    alike.sort_by(|a, b| a.psl_within_db.total_cmp(&b.psl_within_db));
    let db = |b: &Beam| format!("{:.1} dB", b.psl_within_db);
    let mut reason = match alike.as_slice() {
        [] => String::new(),
        [only] => format!(
            "{} has the narrowest beam, {} at half power, and no other layout comes within 20 % of it. Its peak side lobe is {}.",
            only.name,
            angle(only.width_rad),
            db(only)
        ),
        [best, others @ ..] => {
            let others: Vec<String> = others.iter().map(|b| format!("{} has {}", b.name, db(b))).collect();
            format!(
                "{} has the lowest peak side lobe of the {} layouts with beams alike, {} ({}). Their widths at half power are at most 20 % above \
                 the narrowest, {}.",
                best.name,
                alike.len(),
                db(best),
                others.join("; "),
                angle(narrowest)
            )
        }
    };
    if let [best, second, ..] = alike.as_slice()
        && second.psl_within_db - best.psl_within_db < TIE_DB
    {
        reason += &format!(" {} is as good: the two differ by less than {TIE_DB} dB.", second.name);
    }
    if !wide.is_empty() {
        let told: Vec<String> = wide.iter().map(|b| format!("{} ({}, {})", b.name, angle(b.width_rad), db(b))).collect();
        reason += &format!(" Not ranked, because the beam is wider and side lobes can be traded for resolution: {}.", told.join("; "));
    }
    let names = |list: &[&Beam]| list.iter().map(|b| b.name.clone()).collect();
    Ranking { by: "psl_within_db", order: names(&alike), not_ranked: names(&wide), reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beam(name: &str, width_rad: f64, psl_within_db: f64) -> Beam {
        Beam { name: name.into(), width_rad, psl_within_db }
    }

    #[test]
    fn side_lobes_are_ranked_among_beams_alike_only() {
        let found = by_beams(&[beam("a", 1e-3, -8.0), beam("wide", 2e-3, -20.0), beam("b", 1.19e-3, -10.0)]);
        assert_eq!((found.order, found.not_ranked), (vec!["b".to_owned(), "a".into()], vec!["wide".to_owned()]));
        assert!(found.reason.starts_with("b has the lowest peak side lobe of the 2 layouts with beams alike, -10.0 dB (a has -8.0 dB)"));
        assert!(found.reason.contains("Not ranked") && found.reason.contains("wide (6.88 arcmin, -20.0 dB)"), "{}", found.reason);
        assert!(!found.reason.contains("as good"));
        assert!(by_beams(&[beam("a", 1e-3, -8.0), beam("b", 1e-3, -8.05)]).reason.contains("a is as good"));
        let alone = by_beams(&[beam("a", 1e-3, -8.0), beam("wide", 2e-3, -20.0)]);
        assert!(alone.order == ["a"] && alone.reason.starts_with("a has the narrowest beam, 3.44 arcmin"), "{}", alone.reason);
    }

    #[test]
    fn images_are_ranked_by_their_error() {
        let error = |name: &str, rms: f64| ImageError { name: name.into(), rms, unit: "K".into(), over_grey_card: rms / 40.0 };
        let found = by_images(vec![error("a", 14.3), error("b", 10.3), error("c", 17.6)]);
        assert_eq!(found.order, ["b", "a", "c"]);
        assert!(found.reason.contains("10.3 K rms, 0.258 of a grey card (a has 14.3 K rms, 0.358"), "{}", found.reason);
        assert!(!found.reason.contains("No layout images") && by_images(vec![error("a", 50.0)]).reason.contains("No layout images"));
    }
}

//! The numbers of the page on measurements.

use super::{MEASURED_SETS, comparison};

/// Bias and rms of each set, as `docs/algorithms/measured.md` has them. A model that changes them changes the page too.
const ON_THE_PAGE: [(&str, f64, f64); 6] = [
    ("sky", -0.023, 0.158),
    ("opacity", 0.144, 0.188),
    ("soil", -16.151, 21.718),
    ("sea", -0.117, 0.117),
    ("snow", 0.004, 0.053),
    ("sea-ice", -0.020, 0.071),
];

#[test]
fn bias_and_rms_are_those_of_the_page() {
    assert_eq!(ON_THE_PAGE.len(), MEASURED_SETS.len());
    for (set, (name, bias, rms)) in MEASURED_SETS.iter().zip(ON_THE_PAGE) {
        let c = set.comparison().unwrap();
        for p in &c.points {
            println!("{}: {} measured {:.3} model {:.3}{}", set.name, p.name, p.measured, p.model, if p.fitted { " (fitted)" } else { "" });
        }
        println!("{}: bias {:.4} rms {:.4} {}", set.name, c.bias(), c.rms(), set.unit);
        assert_eq!(set.name, name);
        // Half of the last digit, and what rounding in another order may change.
        assert!((c.bias() - bias).abs() < 6e-4, "{name}: bias {}, the page has {bias}", c.bias());
        assert!((c.rms() - rms).abs() < 6e-4, "{name}: rms {}, the page has {rms}", c.rms());
    }
    let page = include_str!("../../../docs/algorithms/measured.md");
    for (name, bias, rms) in ON_THE_PAGE {
        assert!(page.contains(&format!("| `{name}` |")) && page.contains(&format!("| {bias:.3} | {rms:.3} |")), "the page lacks {name}");
    }
}

#[test]
fn fits_reach_their_measurement() {
    for set in ["sky", "snow"] {
        let fitted: Vec<_> = comparison(set).unwrap().points.into_iter().filter(|p| p.fitted).collect();
        assert!(fitted.len() >= 2 && fitted.iter().all(|p| (p.model / p.measured - 1.0).abs() < 2e-3), "{fitted:?}");
    }
}

#[test]
fn an_unknown_set_lists_the_known() {
    let message = comparison("moon").unwrap_err().to_string();
    assert!(message.contains("moon") && message.contains("sea-ice"), "{message}");
}

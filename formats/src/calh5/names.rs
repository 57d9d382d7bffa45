//! Names and numbers in a CalH5 file.

/// Keyword (in `extra_keywords`) for the kind of the gains.
pub(super) const MODE_KEYWORD: &str = "cittert_mode";
/// Keyword (in `extra_keywords`) of the sign of the phase of a delay.
pub(super) const CONVENTION_KEYWORD: &str = "cittert_delay_convention";
/// Seconds of a day.
pub(super) const DAY_S: f64 = 86_400.0;

/// Feeds and their Jones numbers; gains of Stokes I have the number 0.
pub(super) const JONES: [(&str, i64); 5] = [("I", 0), ("R", -1), ("L", -2), ("X", -5), ("Y", -6)];

//! Names and numbers in a CalH5 file.

/// Keyword (in `extra_keywords`) for the kind of the gains.
pub(super) const MODE_KEYWORD: &str = "cittert_mode";
/// Keyword (in `extra_keywords`) of the sign of the phase of a delay.
pub(super) const CONVENTION_KEYWORD: &str = "cittert_delay_convention";
/// Seconds of a day.
pub(super) const DAY_S: f64 = 86_400.0;

/// Feeds and elements of Jones matrices with their numbers; gains of Stokes I have the number 0.
pub(super) const JONES: [(&str, i64); 9] =
    [("I", 0), ("R", -1), ("L", -2), ("RL", -3), ("LR", -4), ("X", -5), ("Y", -6), ("XY", -7), ("YX", -8)];

//! Axes: ranges, round ticks and their labels, and units that suit the size of a value.

/// One axis: the values at its two ends (`from` is at the left or the bottom) and its label.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) log: bool,
    /// Distance between ticks; `None` chooses a round one, and an infinite one gives no ticks.
    pub(crate) step: Option<f64>,
    pub(crate) label: String,
}

impl Axis {
    pub(crate) fn linear(from: f64, to: f64, label: impl Into<String>) -> Self {
        Self { from, to, log: false, step: None, label: label.into() }
    }

    /// Place along the axis: 0 at `from`, 1 at `to`.
    pub(crate) fn place(&self, v: f64) -> f64 {
        if self.log { (v / self.from).log10() / (self.to / self.from).log10() } else { (v - self.from) / (self.to - self.from) }
    }

    /// Ticks with their labels, about `count` of them.
    pub(crate) fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        let (lo, hi) = (self.from.min(self.to), self.from.max(self.to));
        match self.step {
            Some(step) if step.is_infinite() => Vec::new(),
            Some(step) => ticks_of_step(lo, hi, step),
            None if self.log => log_ticks(lo, hi, count),
            None => linear_ticks(lo, hi, count),
        }
    }
}

/// Round values between two limits: steps of 1, 2 or 5 times a power of ten.
pub(crate) fn linear_ticks(lo: f64, hi: f64, count: usize) -> Vec<(f64, String)> {
    let span = hi - lo;
    if !(span > 0.0 && span.is_finite()) {
        return vec![(lo, short(lo))];
    }
    let rough = span / count.max(1) as f64;
    let decade = 10_f64.powf(rough.log10().floor());
    let off = |s: &f64| (s / rough).ln().abs();
    // One tick alone shows no scale.
    let scale = |s: &f64| (hi / s + 1e-6).floor() > (lo / s - 1e-6).ceil();
    let steps = [0.5, 1.0, 2.0, 5.0, 10.0].map(|k| k * decade).into_iter();
    let step = steps.filter(scale).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(decade);
    ticks_of_step(lo, hi, step)
}

fn ticks_of_step(lo: f64, hi: f64, step: f64) -> Vec<(f64, String)> {
    let decimals = (-(step * 1.0001).log10().floor()).max(0.0) as usize;
    let (first, last) = ((lo / step - 1e-6).ceil() as i64, (hi / step + 1e-6).floor() as i64);
    let largest = lo.abs().max(hi.abs());
    (first..=last)
        .map(|k| {
            let v = k as f64 * step;
            let text = if largest >= 1e6 || decimals > 5 { format!("{v:.2e}") } else { format!("{v:.decimals$}") };
            (v, text.replace('-', "\u{2212}"))
        })
        .collect()
}

/// Ticks of a logarithmic axis: powers of ten, or steps of 1, 2 and 5 where the axis is short.
fn log_ticks(lo: f64, hi: f64, count: usize) -> Vec<(f64, String)> {
    let decades = (hi / lo).log10();
    let (first, last) = ((lo.log10() - 1e-9).floor() as i32, (hi.log10() + 1e-9).ceil() as i32);
    let every = ((decades / count.max(1) as f64).ceil() as i32).max(1);
    let multiples: &[f64] = if 3.0 * decades <= count as f64 + 1.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let mut ticks = Vec::new();
    for exponent in (first..=last).filter(|e| e % every == 0) {
        for m in multiples {
            let v = m * 10_f64.powi(exponent);
            if v >= lo * (1.0 - 1e-9) && v <= hi * (1.0 + 1e-9) {
                let text = match exponent {
                    -3..=4 => short(v),
                    _ if *m == 1.0 => format!("10{}", superscript(exponent)),
                    _ => format!("{m}\u{b7}10{}", superscript(exponent)),
                };
                ticks.push((v, text));
            }
        }
    }
    ticks
}

/// A number with as few digits as it needs.
pub(crate) fn short(v: f64) -> String {
    if v == 0.0 {
        return "0".into();
    }
    let a = v.abs();
    let text = if (1e-4..1e6).contains(&a) {
        let decimals = (3 - a.log10().floor() as i32).clamp(0, 7) as usize;
        let t = format!("{v:.decimals$}");
        if t.contains('.') { t.trim_end_matches('0').trim_end_matches('.').to_owned() } else { t }
    } else {
        format!("{v:.2e}")
    };
    text.replace('-', "\u{2212}")
}

/// An exponent in superscript digits.
pub(crate) fn superscript(n: i32) -> String {
    const DIGITS: [char; 10] =
        ['\u{2070}', '\u{b9}', '\u{b2}', '\u{b3}', '\u{2074}', '\u{2075}', '\u{2076}', '\u{2077}', '\u{2078}', '\u{2079}'];
    n.to_string().chars().map(|c| c.to_digit(10).map_or('\u{207b}', |d| DIGITS[d as usize])).collect()
}

/// The power of 1000, with its prefix, that brings a value of this size to between 0.3 and 300.
pub(crate) fn prefix(largest: f64) -> (f64, &'static str) {
    const PREFIXES: [(f64, &str); 9] =
        [(1e-12, "p"), (1e-9, "n"), (1e-6, "\u{b5}"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"), (1e9, "G"), (1e12, "T")];
    if !(largest > 0.0 && largest.is_finite()) {
        return (1.0, "");
    }
    PREFIXES.into_iter().rev().find(|p| largest >= 0.3 * p.0).unwrap_or(PREFIXES[0])
}

/// As [`prefix`], but to between 1 and 1000.
pub(crate) fn whole_prefix(largest: f64) -> (f64, &'static str) {
    prefix(0.3 * largest)
}

/// The angular unit that suits a field of this half width: the size of the unit in radians, and its name.
pub(crate) fn angle_unit(half_width_rad: f64) -> (f64, &'static str) {
    let arcsec = std::f64::consts::PI / 648_000.0;
    for (unit, name) in [(3600.0 * arcsec, "deg"), (60.0 * arcsec, "arcmin"), (arcsec, "arcsec"), (1e-3 * arcsec, "mas")] {
        if half_width_rad >= 1.5 * unit {
            return (unit, name);
        }
    }
    (1e-6 * arcsec, "\u{b5}as")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let show = |lo, hi, n| linear_ticks(lo, hi, n).into_iter().map(|t| t.1).collect::<Vec<_>>();
        assert_eq!(show(0.0, 1.0, 5), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(show(-7.3, 7.3, 6), ["\u{2212}6", "\u{2212}4", "\u{2212}2", "0", "2", "4", "6"]);
        assert_eq!(show(-45.0, 45.0, 2), ["\u{2212}40", "\u{2212}20", "0", "20", "40"], "one tick is no scale");
        assert_eq!(show(0.0, 0.05, 5), ["0.00", "0.01", "0.02", "0.03", "0.04", "0.05"]);
        let log = Axis { from: 1e-6, to: 10.0, log: true, step: None, label: String::new() };
        assert_eq!(log.ticks(8).len(), 8);
        assert_eq!(log.ticks(8)[0].1, "10\u{207b}\u{2076}");
        assert!((log.place(1e-6)).abs() < 1e-12 && (log.place(10.0) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn units_fit_the_size() {
        assert_eq!(angle_unit(100.0 * std::f64::consts::PI / 648e9).1, "\u{b5}as");
        assert_eq!(angle_unit(0.01).1, "arcmin");
        assert_eq!(angle_unit(0.1).1, "deg");
        assert_eq!(prefix(2.5e-5), (1e-6, "\u{b5}"));
        assert_eq!(prefix(0.0), (1.0, ""));
        assert_eq!(short(0.25), "0.25");
        assert_eq!(short(-1500.0), "\u{2212}1500");
    }
}

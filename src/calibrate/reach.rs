//! Whether a gain table belongs to the times and the frequencies of a set.

use super::lookup::nearest_channel;
use crate::{ChainError, Result, ensure};
use cittert_arrays::{GainTable, SpectralWindow};

/// Largest distance of a channel from those of the table, relative to its frequency. Phases of cables and of the air grow with frequency, so over
/// a tenth of it they change by a tenth, which is as good as calibration from a neighbouring band is.
const FAR: f64 = 0.1;
/// Time after the last and before the first gain for which they may still serve, d. A table that spans more time may serve for as long again.
const DAY: f64 = 1.0;

/// First and last time for which the gains of a table may serve, and a check of the channels of a set.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    from_jd: f64,
    to_jd: f64,
}

impl Reach {
    /// The reach of a table that is applied to channels of `spectrum`.
    ///
    /// # Errors
    /// A channel is far from those of the table.
    pub(super) fn new(table: &GainTable, spectrum: &SpectralWindow) -> Result<Self> {
        for freq in spectrum.freq_hz() {
            let channel = nearest_channel(table, *freq);
            let (center, width) = (table.spectrum.freq_hz()[channel], table.spectrum.width_hz()[channel]);
            let far = (freq - center).abs() - width / 2.0 > FAR * freq;
            ensure!(
                !far,
                ChainError::FarGains(format!(
                    "the set has a channel at {:.6} GHz, and the nearest gains are those of {:.6} GHz",
                    freq * 1e-9,
                    center * 1e-9
                ))
            );
        }
        let half = |k: usize| table.interval_s[k] / 2.0 / 86_400.0;
        let edges = (0..table.time_jd.len()).map(|k| (table.time_jd[k] - half(k), table.time_jd[k] + half(k)));
        let (first, last) = edges.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), (from, to)| (a.min(from), b.max(to)));
        let more = DAY.max(last - first);
        Ok(Self { from_jd: first - more, to_jd: last + more })
    }

    /// Check the time of a row.
    ///
    /// # Errors
    /// The time is far from those of the table.
    pub(super) fn check(&self, time_jd: f64) -> Result<()> {
        let outside = (self.from_jd - time_jd).max(time_jd - self.to_jd);
        let near = !(outside > 0.0);
        ensure!(
            near,
            ChainError::FarGains(format!(
                "the set has data at JD {time_jd:.4}, and the gains may serve from JD {:.4} to {:.4}",
                self.from_jd, self.to_jd
            ))
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closure::testdata::{Scene, T0_JD};

    #[test]
    fn gains_of_another_month_or_of_another_band_are_refused() {
        let h = Scene::point(4, 1).header();
        let freq = h.spectrum.freq_hz()[0];
        let table = GainTable::unity(h.layout, h.spectrum, vec!["I".into()], vec![T0_JD], vec![300.0]).unwrap();
        let at = |factor: f64| Reach::new(&table, &SpectralWindow::new(vec![factor * freq], vec![1e6]).unwrap());
        let reach = at(1.05).unwrap();
        assert!(matches!(at(22.0 / 8.4), Err(ChainError::FarGains(_))));
        reach.check(T0_JD + 0.5).unwrap();
        reach.check(T0_JD - 0.5).unwrap();
        assert!(reach.check(T0_JD + 30.0).unwrap_err().to_string().contains("not solved for these data"));
        assert!(reach.check(T0_JD - 30.0).is_err());
    }

    #[test]
    fn a_table_of_ten_days_serves_for_ten_more() {
        let h = Scene::point(4, 1).header();
        let times = vec![T0_JD, T0_JD + 10.0];
        let table = GainTable::unity(h.layout, h.spectrum.clone(), vec!["I".into()], times, vec![300.0; 2]).unwrap();
        let reach = Reach::new(&table, &h.spectrum).unwrap();
        reach.check(T0_JD + 19.0).unwrap();
        assert!(reach.check(T0_JD + 21.0).is_err());
    }
}

//! How channels and polarisations are grouped into solutions.

use super::model::sees_unpolarized;
use super::options::{ChannelGroups, FeedGroups};
use crate::{ChainError, Result};
use cittert_arrays::{Polarization, SpectralWindow, VisibilityHeader};

/// Which group each channel belongs to, and the band of each group.
#[derive(Debug, Clone)]
pub(crate) struct ChannelPlan {
    pub(crate) group_of: Vec<usize>,
    pub(crate) spectrum: SpectralWindow,
}

impl ChannelPlan {
    pub(crate) fn new(spectrum: &SpectralWindow, groups: ChannelGroups) -> Result<Self> {
        let n = spectrum.n_chan();
        match groups {
            ChannelGroups::Channel => Ok(Self { group_of: (0..n).collect(), spectrum: spectrum.clone() }),
            ChannelGroups::Band => Self::merged(spectrum, vec![0; n], vec![0]),
            ChannelGroups::Window => {
                let mut windows: Vec<u32> = Vec::new();
                let group_of = spectrum
                    .spw()
                    .iter()
                    .map(|w| {
                        windows.iter().position(|x| x == w).unwrap_or_else(|| {
                            windows.push(*w);
                            windows.len() - 1
                        })
                    })
                    .collect();
                Self::merged(spectrum, group_of, windows)
            }
        }
    }

    fn merged(spectrum: &SpectralWindow, group_of: Vec<usize>, windows: Vec<u32>) -> Result<Self> {
        let mut edges = vec![(f64::INFINITY, 0.0_f64); windows.len()];
        for ((g, f), w) in group_of.iter().zip(spectrum.freq_hz()).zip(spectrum.width_hz()) {
            edges[*g] = (edges[*g].0.min(f - w / 2.0), edges[*g].1.max(f + w / 2.0));
        }
        let centers = edges.iter().map(|(lo, hi)| (lo + hi) / 2.0).collect();
        let widths = edges.iter().map(|(lo, hi)| hi - lo).collect();
        Ok(Self { group_of, spectrum: SpectralWindow::with_windows(centers, widths, windows)? })
    }

    pub(crate) fn n_groups(&self) -> usize {
        self.spectrum.n_chan()
    }
}

/// Which feed each polarisation product measures; cross hands and Stokes Q, U, V measure none.
#[derive(Debug, Clone)]
pub(crate) struct FeedPlan {
    pub(crate) names: Vec<String>,
    pub(crate) of_pol: Vec<Option<usize>>,
}

impl FeedPlan {
    pub(crate) fn new(header: &VisibilityHeader, groups: FeedGroups) -> Result<Self> {
        let pols = &header.polarizations;
        if !pols.iter().any(|p| sees_unpolarized(*p)) {
            let names: Vec<&str> = pols.iter().map(|p| p.name()).collect();
            return Err(ChainError::NoData(format!("no parallel hand or Stokes I to solve on: the set has {}", names.join(", "))));
        }
        if groups == FeedGroups::Joined || pols.contains(&Polarization::I) {
            return Ok(Self {
                names: vec![Polarization::shared_feed(pols).into()],
                of_pol: pols.iter().map(|p| sees_unpolarized(*p).then_some(0)).collect(),
            });
        }
        // One feed for each parallel hand in the set, in order of the feeds.
        let mut hands: Vec<Polarization> = pols.iter().copied().filter(|p| p.is_parallel_hand()).collect();
        hands.sort_by_key(|p| p.feeds());
        hands.dedup();
        let names = hands.iter().map(|p| p.name()[..1].to_owned()).collect();
        Ok(Self { names, of_pol: pols.iter().map(|p| hands.iter().position(|h| h == p)).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_keep_their_band() {
        let s = SpectralWindow::with_windows(vec![1e9, 1.1e9, 2e9, 2.1e9], vec![1e8; 4], vec![3, 3, 5, 5]).unwrap();
        let plan = ChannelPlan::new(&s, ChannelGroups::Window).unwrap();
        assert_eq!(plan.group_of, [0, 0, 1, 1]);
        assert_eq!(plan.spectrum.spw(), [3, 5]);
        assert!((plan.spectrum.freq_hz()[1] - 2.05e9).abs() < 1.0 && (plan.spectrum.width_hz()[1] - 2e8).abs() < 1.0);
    }
}

//! Constants of closure imaging, each with its reason.
//!
//! `docs/algorithms/heuristics.md` lists how much the image changes when each is halved and doubled.

/// Constants that choose the field, the prior and the total flux if the options do not give them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosureImagingControl {
    /// Cells in 1 / (longest baseline). Two cells sample the visibilities. With six the image can resolve structure of half a beam.
    pub cells: f64,
    /// Width of the field in units of 1 / (shortest baseline that resolves the source). At 1 the phase of a source at the edge changes by
    /// half a turn on that baseline. Wider structure is not measured.
    pub field: f64,
    /// Largest number of cells on a side that follows from the coverage. It is limited because the transform is direct.
    pub largest: usize,
    /// Fraction of the longest baseline below which antennas may be co-located.
    pub co_located: f64,
    /// Ratio of two successive baseline lengths that separates co-located antennas from the others.
    pub gap: f64,
    /// Width of the Gaussian prior in units of the resolution, where the amplitudes do not give one.
    pub usual_prior: f64,
    /// Smallest width of a prior that is fitted to the amplitudes, in units of the resolution.
    pub least_prior: f64,
    /// Largest width of such a prior.
    pub largest_prior: f64,
    /// Total fluxes that are tried, in units of the flux on the shortest baselines: all of it, or less where a part of it is on scales
    /// beyond the image. Steps of about 0.75 are finer than the width of the likelihood for amplitudes of 10 per cent. Where no
    /// co-located antennas measure the total flux, their inverses are tried.
    pub fluxes: [f64; 5],
    /// Rounds of the trial of a flux.
    pub trial_rounds: usize,
    /// Iterations of each of these rounds.
    pub trial_iterations: usize,
    /// Relative decrease of the objective in one iteration below which a round ends.
    pub decrease: f64,
}

impl Default for ClosureImagingControl {
    fn default() -> Self {
        Self {
            cells: 6.0,
            field: 0.8,
            largest: 128,
            co_located: 0.05,
            gap: 8.0,
            usual_prior: 1.6,
            least_prior: 1.0,
            largest_prior: 4.0,
            fluxes: [1.0, 0.75, 0.55, 0.4, 0.3],
            trial_rounds: 2,
            trial_iterations: 40,
            decrease: 1e-6,
        }
    }
}

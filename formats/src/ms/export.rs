//! The changes to a set for a Measurement Set: products, spectral windows, units; and the notes about them.

use super::codes::{code_of, exchanged};
use crate::{FormatError, Result};
use cittert_arrays::{Polarization, VisUnit, VisibilityHeader, jy_per_kelvin_sr};
use std::path::Path;

/// The source of one product of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Product {
    /// The product that is written.
    pub(super) product: Polarization,
    /// Index into the products of the header.
    pub(super) from: usize,
    /// The same for a row whose antennas are exchanged; `None` where the set has no such product.
    pub(super) exchanged: Option<usize>,
}

/// Channels of one spectral window.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Window {
    /// Indices into the channels of the header.
    pub(super) channels: Vec<usize>,
}

/// The conversion of a set to the output.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    pub(super) products: Vec<Product>,
    /// Weights of the output divided by weights of the set, for the same unit.
    pub(super) weight_factor: f64,
    pub(super) windows: Vec<Window>,
    /// Factor to the unit of the output \[chan\].
    pub(super) factor: Vec<f64>,
    pub(super) unit: VisUnit,
    /// Number in ANTENNA of each antenna of the layout.
    pub(super) antenna_rows: Vec<i32>,
    /// Notes for the user and for the history.
    pub(super) notes: Vec<String>,
}

/// Largest number of rows of ANTENNA without an antenna, for each row with an antenna.
const MAX_GAP: usize = 16;

impl Plan {
    /// Plan the output of a set with this header.
    ///
    /// # Errors
    /// Products of circular and of linear feeds in one set, or the same product twice.
    pub(super) fn new(path: &Path, header: &VisibilityHeader) -> Result<Self> {
        let mut notes = Vec::new();
        let (products, weight_factor) = products(path, &header.polarizations, &mut notes)?;
        let freq = header.spectrum.freq_hz();
        let (factor, unit) = match header.unit {
            VisUnit::KelvinSr => {
                notes.push("K str converted to Jy by 2 k nu^2 / c^2 at the frequency of each channel".into());
                (freq.iter().map(|f| jy_per_kelvin_sr(*f)).collect(), VisUnit::Jy)
            }
            other => (vec![1.0; freq.len()], other),
        };
        if let Some(pedestal) = header.pedestal_k {
            notes.push(format!("a constant {pedestal} K was removed from the scene before; images of this set lack it"));
        }
        notes.extend(pattern_without_a_line(header));
        let antenna_rows = antenna_rows(header, &mut notes);
        Ok(Self { products, weight_factor, windows: windows(header.spectrum.spw()), factor, unit, antenna_rows, notes })
    }
}

/// What is lost of a pattern of the elements that has no line of text.
fn pattern_without_a_line(header: &VisibilityHeader) -> Option<String> {
    let pattern = &header.layout.pattern;
    let lost = !pattern.is_none() && pattern.parameters().is_none();
    lost.then(|| "the pattern of the elements is a table of samples, which this format does not hold: keep it in UVH5".into())
}

fn products(path: &Path, have: &[Polarization], notes: &mut Vec<String>) -> Result<(Vec<Product>, f64)> {
    use Polarization::{I, LL, RR};
    if have == [I] {
        notes.push("Stokes I of an unpolarised source written as RR and LL, each with half its weight".into());
        return Ok(([RR, LL].map(|product| Product { product, from: 0, exchanged: Some(0) }).to_vec(), 0.5));
    }
    let code = |p: &Polarization| code_of(*p);
    if have.iter().any(|p| (5..=8).contains(&code(p))) && have.iter().any(|p| code(p) >= 9) {
        let what = "circular and linear products in one set have no place in a Measurement Set: write them one after the other";
        return Err(FormatError::unsupported(path, what));
    }
    let mut order: Vec<usize> = (0..have.len()).collect();
    order.sort_by_key(|k| code(&have[*k]));
    if let Some(pair) = order.windows(2).find(|w| have[w[0]] == have[w[1]]) {
        return Err(FormatError::unsupported(path, format!("the set has {} twice", have[pair[0]])));
    }
    let find = |product: Polarization| have.iter().position(|p| *p == product);
    Ok((order.into_iter().map(|from| Product { product: have[from], from, exchanged: find(exchanged(have[from])) }).collect(), 1.0))
}

fn windows(spw: &[u32]) -> Vec<Window> {
    let mut ids = spw.to_vec();
    ids.sort_unstable();
    ids.dedup();
    ids.into_iter().map(|id| Window { channels: (0..spw.len()).filter(|c| spw[*c] == id).collect() }).collect()
}

/// Rows of the antennas in ANTENNA. The number of an antenna is its row, unless this would leave too many rows empty.
fn antenna_rows(header: &VisibilityHeader, notes: &mut Vec<String>) -> Vec<i32> {
    let antennas = header.layout.antennas();
    let largest = antennas.iter().map(|a| a.number as usize).max().unwrap_or(0);
    if largest <= MAX_GAP * antennas.len() + 256 {
        return antennas.iter().map(|a| a.number as i32).collect();
    }
    notes.push(format!("antenna numbers up to {largest} would need as many rows: antennas are numbered from 0"));
    (0..antennas.len() as i32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use Polarization::{I, LL, LR, Q, RL, RR, U, V, XX};

    fn plan(have: &[Polarization]) -> Result<(Vec<Product>, f64)> {
        products(Path::new("x.ms"), have, &mut Vec::new())
    }

    #[test]
    fn products_come_in_casas_order_and_know_their_exchange() {
        let (p, factor) = plan(&[RR, LL, RL, LR]).unwrap();
        assert_eq!(p.iter().map(|p| p.product).collect::<Vec<_>>(), [RR, RL, LR, LL]);
        assert_eq!(p.iter().map(|p| p.from).collect::<Vec<_>>(), [0, 2, 3, 1]);
        assert_eq!(p.iter().map(|p| p.exchanged).collect::<Vec<_>>(), [Some(0), Some(3), Some(2), Some(1)]);
        assert_eq!(factor, 1.0);
        assert_eq!(plan(&[RR, RL]).unwrap().0[1].exchanged, None);
    }

    #[test]
    fn stokes_i_becomes_two_hands() {
        let (p, factor) = plan(&[I]).unwrap();
        assert_eq!((p[0].product, p[1].product, p[1].from, factor), (RR, LL, 0, 0.5));
        assert_eq!(plan(&[I, Q, U, V]).unwrap().0.len(), 4);
    }

    #[test]
    fn what_has_no_place_is_refused() {
        assert!(plan(&[RR, XX]).unwrap_err().to_string().contains("circular and linear"));
        assert!(plan(&[RR, RR]).unwrap_err().to_string().contains("RR twice"));
    }
}

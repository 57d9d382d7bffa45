//! The channels and products of a joined set, and where those of each file lie among them.

use super::sequence::{Order, merge};
use cittert_arrays::{Polarization, Result, SpectralWindow};
use std::cmp::Ordering;
use std::collections::HashMap;

/// Two channels are the same if their centres differ by less than this part of their width.
const SAME_CENTRE: f64 = 0.01;
/// Largest relative difference of the widths of one channel.
const SAME_WIDTH: f64 = 1e-6;
/// Two neighbours have a gap between them if their centres are further apart than this many widths.
const GAP_WIDTHS: f64 = 1.5;

/// A joined axis.
pub(super) struct Axis<T> {
    /// The whole axis.
    pub(super) all: T,
    /// Places of the items of each list in it.
    pub(super) places: Vec<Vec<usize>>,
}

/// Two lists, and what differs between them.
pub(super) struct Conflict {
    pub(super) lists: (usize, usize),
    pub(super) what: String,
}

/// A channel of the joined set, and the first list that has it.
#[derive(Debug, Clone, Copy)]
struct Channel {
    freq_hz: f64,
    width_hz: f64,
    spw: u32,
    list: usize,
}

/// The channels of all lists. They are sorted if the lists are, by window and frequency.
///
/// # Errors
/// Two lists state different widths of one channel, or hold the same channels in different orders.
pub(super) fn channels(lists: &[SpectralWindow]) -> std::result::Result<Axis<Result<SpectralWindow>>, Conflict> {
    let (table, keys) = same_channels(lists)?;
    let by = |sign: f64, windows: bool| {
        let table = &table;
        move |a: &usize, b: &usize| {
            let (a, b): (&Channel, &Channel) = (&table[*a], &table[*b]);
            let window = if windows { a.spw.cmp(&b.spw) } else { Ordering::Equal };
            window.then((sign * a.freq_hz).total_cmp(&(sign * b.freq_hz)))
        }
    };
    let (up, down, all_up, all_down) = (by(1.0, true), by(-1.0, true), by(1.0, false), by(-1.0, false));
    let orders: [Order<'_, usize>; 4] = [&up, &down, &all_up, &all_down];
    let order = merge(&keys, &orders).map_err(|crossed| Conflict {
        lists: (0, crossed.list),
        what: format!("they hold the channel at {} Hz in different orders of channels", table[crossed.item].freq_hz),
    })?;
    let all = SpectralWindow::with_windows(
        order.iter().map(|k| table[*k].freq_hz).collect(),
        order.iter().map(|k| table[*k].width_hz).collect(),
        order.iter().map(|k| table[*k].spw).collect(),
    );
    Ok(Axis { all, places: places(&order, &keys) })
}

/// A table of all different channels, and the channels of each list as indices into it.
fn same_channels(lists: &[SpectralWindow]) -> std::result::Result<(Vec<Channel>, Vec<Vec<usize>>), Conflict> {
    let mut all: Vec<(usize, usize)> = (0..lists.len()).flat_map(|k| (0..lists[k].n_chan()).map(move |c| (k, c))).collect();
    let freq = |at: &(usize, usize)| lists[at.0].freq_hz()[at.1];
    let width = |at: &(usize, usize)| lists[at.0].width_hz()[at.1];
    all.sort_by(|a, b| freq(a).total_cmp(&freq(b)).then(a.cmp(b)));
    // Channels at one frequency have one group.
    let mut group = Vec::with_capacity(all.len());
    let mut first = None::<(f64, f64)>;
    let mut n = 0;
    for at in &all {
        let (f, w) = (freq(at), width(at));
        if first.is_none_or(|(f0, w0)| f - f0 > SAME_CENTRE * w.min(w0)) {
            first = Some((f, w));
            n += 1;
        }
        group.push(n);
    }
    // A file may have one frequency in two windows. Then windows are told apart by their numbers.
    let windows = {
        let mut seen = std::collections::HashSet::new();
        all.iter().zip(&group).any(|(at, g)| !seen.insert((at.0, *g)))
    };
    let mut in_order: Vec<_> = all.iter().zip(group).collect();
    in_order.sort_by_key(|(at, _)| **at);
    let (mut table, mut known): (Vec<Channel>, HashMap<(usize, u32), usize>) = (Vec::new(), HashMap::new());
    let mut keys: Vec<Vec<usize>> = vec![Vec::new(); lists.len()];
    for (at, group) in in_order {
        let spw = lists[at.0].spw()[at.1];
        let channel = Channel { freq_hz: freq(at), width_hz: width(at), spw, list: at.0 };
        let k = *known.entry((group, if windows { spw } else { 0 })).or_insert(table.len());
        if k == table.len() {
            table.push(channel);
        }
        let (a, b) = (table[k], channel);
        if (a.width_hz - b.width_hz).abs() > SAME_WIDTH * a.width_hz {
            let what =
                format!("the channel at {} Hz is {} Hz wide in the first and {} Hz in the second", a.freq_hz, a.width_hz, b.width_hz);
            return Err(Conflict { lists: (a.list, b.list), what });
        }
        keys[at.0].push(k);
    }
    Ok((table, keys))
}

/// Sentences on gaps in a joined band, and on channels that overlap without being the same, where two lists meet.
pub(super) fn seams(all: &SpectralWindow, places: &[Vec<usize>]) -> Vec<String> {
    let mut order: Vec<usize> = (0..all.n_chan()).collect();
    order.sort_by(|a, b| all.freq_hz()[*a].total_cmp(&all.freq_hz()[*b]));
    let mut rank = vec![0; order.len()];
    order.iter().enumerate().for_each(|(r, c)| rank[*c] = r);
    // Neighbours within one list are as its file has them.
    let mut inside = vec![false; order.len()];
    for list in places {
        let mut ranks: Vec<usize> = list.iter().map(|c| rank[*c]).collect();
        ranks.sort_unstable();
        ranks.windows(2).filter(|w| w[1] == w[0] + 1).for_each(|w| inside[w[0]] = true);
    }
    let (mut missing_hz, mut gaps, mut overlaps, mut place) = (0.0, 0, 0, 0.0);
    for (r, pair) in order.windows(2).enumerate().filter(|(r, _)| !inside[*r]) {
        let step = all.freq_hz()[pair[1]] - all.freq_hz()[pair[0]];
        let width = f64::midpoint(all.width_hz()[pair[0]], all.width_hz()[pair[1]]);
        if step > GAP_WIDTHS * width {
            (missing_hz, gaps) = (missing_hz + step - width, gaps + 1);
            place = if gaps == 1 { all.freq_hz()[order[r]] } else { place };
        } else if step < (1.0 - 2.0 * SAME_CENTRE) * width {
            overlaps += 1;
        }
    }
    let mut notes = Vec::new();
    if gaps > 0 {
        let where_ = format!("the first above {:.9}", cittert_arrays::quantity::Frequency(place));
        notes.push(format!(
            "the band has {gaps} gaps between files, together {:.9} ({where_})",
            cittert_arrays::quantity::Frequency(missing_hz)
        ));
    }
    if overlaps > 0 {
        notes.push(format!("{overlaps} pairs of channels of different files overlap without being the same channel: all of them are read"));
    }
    notes
}

/// The products of all lists, in the order of AIPS (XX YY XY YX) or of CASA (XX XY YX YY) if all lists have it.
///
/// # Errors
/// Two lists hold the same products in other, different orders.
pub(super) fn products(lists: &[Vec<Polarization>]) -> std::result::Result<Axis<Vec<Polarization>>, Conflict> {
    let aips = |a: &Polarization, b: &Polarization| (a.aips() > 0, a.aips().abs()).cmp(&(b.aips() > 0, b.aips().abs()));
    let casa = |a: &Polarization, b: &Polarization| a.feeds().cmp(&b.feeds()).then(a.aips().abs().cmp(&b.aips().abs()));
    let orders: [Order<'_, Polarization>; 2] = [&aips, &casa];
    let all = merge(lists, &orders).map_err(|crossed| Conflict {
        lists: (0, crossed.list),
        what: format!("they hold {} in different orders of products", crossed.item),
    })?;
    Ok(Axis { places: places(&all, lists), all })
}

fn places<K: Copy + Eq + std::hash::Hash>(all: &[K], lists: &[Vec<K>]) -> Vec<Vec<usize>> {
    let place: HashMap<K, usize> = all.iter().enumerate().map(|(place, item)| (*item, place)).collect();
    lists.iter().map(|list| list.iter().filter_map(|item| place.get(item).copied()).collect()).collect()
}

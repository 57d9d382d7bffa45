//! The rows of several files that have one time (or, in files that are sorted by baselines, one baseline).

use super::rows::Row;
use super::sequence::{Crossed, Order, merge};
use std::collections::HashMap;

/// A row within a slot: number of its time, antennas, phase centre, and how many such rows its file has before it.
type Key = (u32, u32, u32, u16, u32);

/// Consecutive rows of a slot that the same files hold.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stretch {
    /// The files, sorted.
    pub(super) files: Vec<u32>,
    /// Number of rows.
    pub(super) rows: u32,
    /// The first of them.
    pub(super) first: Row,
}

/// The rows of a slot in their order in the joined set. Each file brings its rows in its own order.
///
/// # Errors
/// A file that holds the same rows as those before it in another order.
pub(super) fn stretches(lists: &[(u32, Vec<Row>)], same_days: f64) -> Result<Vec<Stretch>, Crossed<Row>> {
    let filled: Vec<&(u32, Vec<Row>)> = lists.iter().filter(|l| !l.1.is_empty()).collect();
    let Some((_, first)) = filled.first() else { return Ok(Vec::new()) };
    let alike = |a: &Row, b: &Row| (a.ant1, a.ant2, a.center) == (b.ant1, b.ant2, b.center) && (a.time_jd - b.time_jd).abs() <= same_days;
    // Files that are cut by channels or products have the same rows.
    if filled.iter().all(|(_, list)| list.len() == first.len() && list.iter().zip(first).all(|(a, b)| alike(a, b))) {
        return Ok(vec![Stretch { files: filled.iter().map(|l| l.0).collect(), rows: first.len() as u32, first: first[0] }]);
    }
    let keys = keys(&filled, same_days);
    let by_first = |a: &Key, b: &Key| a.cmp(b);
    let by_second = |a: &Key, b: &Key| (a.0, a.2, a.1, a.3, a.4).cmp(&(b.0, b.2, b.1, b.3, b.4));
    let orders: [Order<'_, Key>; 2] = [&by_first, &by_second];
    let place = |list: usize, key: Key| keys[list].iter().position(|k| *k == key).map_or(first[0], |at| filled[list].1[at]);
    let all = merge(&keys, &orders).map_err(|c| Crossed { list: filled[c.list].0 as usize, item: place(c.list, c.item) })?;
    let mut held: HashMap<Key, (Vec<u32>, Row)> = HashMap::with_capacity(all.len());
    for ((file, list), keys) in filled.iter().zip(&keys) {
        for (key, row) in keys.iter().zip(list) {
            held.entry(*key).or_insert_with(|| (Vec::new(), *row)).0.push(*file);
        }
    }
    let mut out: Vec<Stretch> = Vec::new();
    for (files, first) in all.iter().filter_map(|key| held.remove(key)) {
        match out.last_mut() {
            Some(last) if last.files == files => last.rows += 1,
            _ => out.push(Stretch { files, rows: 1, first }),
        }
    }
    Ok(out)
}

fn keys(lists: &[&(u32, Vec<Row>)], same_days: f64) -> Vec<Vec<Key>> {
    let mut times: Vec<f64> = lists.iter().flat_map(|l| &l.1).map(|row| row.time_jd).collect();
    times.sort_by(f64::total_cmp);
    times.dedup_by(|b, a| *b - *a <= same_days);
    let number = |time: f64| times.partition_point(|t| *t <= time).saturating_sub(1) as u32;
    let of_list = |list: &[Row]| {
        let mut seen: HashMap<(u32, u32, u32, u16), u32> = HashMap::new();
        let key = |row: &Row| {
            let like = (number(row.time_jd), row.ant1, row.ant2, row.center);
            let n = seen.entry(like).or_default();
            *n += 1;
            (like.0, like.1, like.2, like.3, *n - 1)
        };
        list.iter().map(key).collect()
    };
    lists.iter().map(|l| of_list(&l.1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(ant1: u32, ant2: u32) -> Row {
        Row { time_jd: 2_460_000.5, ant1, ant2, center: 0 }
    }

    fn found(lists: &[(u32, Vec<Row>)]) -> Vec<(Vec<u32>, u32)> {
        stretches(lists, 1e-8).unwrap().into_iter().map(|s| (s.files, s.rows)).collect()
    }

    #[test]
    fn rows_of_one_time_are_sorted_by_baseline() {
        let (a, b) = (vec![row(0, 1), row(1, 2)], vec![row(0, 2), row(1, 2)]);
        assert_eq!(found(&[(3, a.clone()), (7, b)]), [(vec![3], 1), (vec![7], 1), (vec![3, 7], 1)]);
        assert_eq!(found(&[(3, a.clone()), (7, a.clone()), (8, Vec::new())]), [(vec![3, 7], 2)]);
        // Two rows alike in a file are two rows.
        assert_eq!(found(&[(0, vec![row(0, 1), row(0, 1)]), (1, vec![row(0, 1)])]), [(vec![0, 1], 1), (vec![0], 1)]);
        let crossed = stretches(&[(0, vec![row(1, 2), row(0, 1)]), (1, vec![row(0, 1), row(1, 2), row(0, 3)])], 1e-8).unwrap_err();
        assert_eq!((crossed.list, crossed.item), (1, row(1, 2)));
    }

    #[test]
    fn times_that_were_rounded_are_the_same() {
        let mut late = row(0, 2);
        late.time_jd += 4e-10;
        assert_eq!(found(&[(0, vec![row(0, 1), row(1, 2)]), (1, vec![late])]), [(vec![0], 1), (vec![1], 1), (vec![0], 1)]);
    }
}

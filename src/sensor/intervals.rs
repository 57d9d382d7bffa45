//! Parts of a line: pairs of limits in ascending order, without overlap.

/// `spans` without the part between `from` and `to`.
pub(super) fn without(spans: &[(f64, f64)], (from, to): (f64, f64)) -> Vec<(f64, f64)> {
    let parts = |&(a, b): &(f64, f64)| [(a, b.min(from)), (a.max(to), b)];
    if from < to { spans.iter().flat_map(parts).filter(|s| s.0 < s.1).collect() } else { spans.to_vec() }
}

/// Add to each cell of a line the length of the spans in it, in cells. The line begins at `start`.
pub(super) fn add_cover(spans: &[(f64, f64)], start: f64, cell: f64, cells: &mut [f64]) {
    for &(a, b) in spans {
        let (a, b) = ((a - start) / cell, (b - start) / cell);
        let (first, last) = (a.floor().max(0.0) as usize, b.ceil().max(0.0) as usize);
        for (k, v) in cells.iter_mut().enumerate().take(last).skip(first) {
            *v += (b.min(k as f64 + 1.0) - a.max(k as f64)).max(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_cut_out_of_spans_and_cells_are_covered_by_what_is_left() {
        let spans = [(0.0, 2.0), (3.0, 5.0)];
        assert_eq!(without(&spans, (1.0, 3.5)), [(0.0, 1.0), (3.5, 5.0)]);
        assert_eq!(without(&spans, (-1.0, 9.0)), []);
        assert_eq!(without(&spans, (0.5, 1.5)), [(0.0, 0.5), (1.5, 2.0), (3.0, 5.0)]);
        assert_eq!(without(&spans, (1.5, 0.5)), spans);
        let mut cells = [0.0; 4];
        add_cover(&[(0.5, 1.25), (2.0, 9.0)], 0.0, 1.0, &mut cells);
        assert_eq!(cells, [0.5, 0.25, 1.0, 1.0]);
        add_cover(&[(-4.0, -3.0)], 0.0, 1.0, &mut cells);
        assert_eq!(cells, [0.5, 0.25, 1.0, 1.0]);
    }
}

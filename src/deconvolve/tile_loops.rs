//! The innermost loops of a tile of the residual: its peak, and the subtraction of components.

use super::minor::Component;
use crate::processor::for_this_processor;
use ndarray::ArcArray2;

/// Side of a tile in pixels: 4 kB, so that a tile and the part of the beam over it fit into the first cache.
pub(super) const SIDE: usize = 32;
/// Pixels of a tile.
pub(super) const AREA: usize = SIDE * SIDE;
/// Components that are subtracted from a line of a tile while it is in the registers.
const TOGETHER: usize = 4;

/// The pixels of a tile. They begin at a line of the cache, so that a vector never lies in two lines.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Pixels(pub(super) [f32; AREA]);

/// A dirty beam \[m, l\].
#[derive(Clone, Copy)]
pub(super) struct Beam<'a> {
    pub(super) values: &'a [f32],
    pub(super) n_m: usize,
    pub(super) n_l: usize,
}

impl<'a> Beam<'a> {
    /// The beam as the loops over a tile read it. It lies in memory row after row.
    pub(super) fn of(psf: &'a ArcArray2<f32>) -> Self {
        let (n_m, n_l) = psf.dim();
        Self { values: psf.as_slice().unwrap_or_default(), n_m, n_l }
    }
}

/// The largest |beam| over each tile for one component: that of tile (i, j) lies at (i, j) + `shift` \[row, column\], and is 0 outside.
pub(super) struct Bounds<'a> {
    pub(super) values: &'a [f64],
    pub(super) columns: usize,
    pub(super) shift: (i64, i64),
}

for_this_processor!(
    /// Largest value of a tile and its index. The value is 0 if no pixel is allowed. A tile whose allowed pixels are not above 0 may have a peak
    /// later: it gets the smallest positive number, so that its bound can grow.
    tile_peak, peak_loops(values: &Pixels, allowed: Option<&[bool]>, negative: bool) -> (f64, usize)
);
for_this_processor!(
    /// Raise the upper bounds of the peaks of all tiles by what a component of some size can add to them, and find the largest bound of each row
    /// of tiles.
    raise, raise_loops(uppers: (&mut [f64], &mut [f64]), bounds: &Bounds<'_>, size: f64)
);
for_this_processor!(
    /// Subtract components from a tile whose first pixel is `corner`.
    apply, apply_loops(beam: Beam<'_>, values: &mut Pixels, corner: (usize, usize), components: &[Component])
);

#[inline(always)]
fn peak_loops(values: &Pixels, allowed: Option<&[bool]>, negative: bool) -> (f64, usize) {
    let size = |v: f32| if negative { v.abs() } else { v };
    if let Some(allowed) = allowed {
        let inside = values.0.iter().zip(allowed).enumerate().filter(|(_, (_, a))| **a);
        let start = if allowed.contains(&true) { f64::MIN_POSITIVE } else { 0.0 };
        return inside.fold((start, 0), |best, (k, (v, _))| if f64::from(size(*v)) > best.0 { (f64::from(size(*v)), k) } else { best });
    }
    let rows = values.0.as_chunks::<SIDE>().0;
    let mut columns = [0.0_f32; SIDE];
    for row in rows {
        for k in 0..SIDE {
            let size = size(row[k]);
            columns[k] = if size > columns[k] { size } else { columns[k] };
        }
    }
    let top = columns.iter().fold(0.0_f32, |a, b| if *b > a { *b } else { a });
    if !(top > 0.0) {
        return (f64::MIN_POSITIVE, 0);
    }
    // A whole row is compared at once, and its pixels only where one is the peak.
    for (i, row) in rows.iter().enumerate() {
        let mut here = false;
        for v in row {
            here |= size(*v) == top;
        }
        if here {
            return (top.into(), i * SIDE + row.iter().position(|v| size(*v) == top).unwrap_or(0));
        }
    }
    (top.into(), 0)
}

#[inline(always)]
fn apply_loops(beam: Beam<'_>, values: &mut Pixels, corner: (usize, usize), components: &[Component]) {
    let mut rest = components;
    while !rest.is_empty() {
        if let Some((some, after)) = rest.split_first_chunk::<TOGETHER>()
            && let Some(first) = covering(beam, corner, some)
        {
            apply_some(beam, values, first, some);
            rest = after;
        } else if let Some((one, after)) = rest.split_first_chunk::<1>() {
            match covering(beam, corner, one) {
                Some(first) => apply_some(beam, values, first, one),
                None => apply_part(beam, values, corner, &one[0]),
            }
            rest = after;
        }
    }
}

/// Where the first pixel of the tile lies in the beam of each component, if all these beams cover the tile.
#[inline(always)]
fn covering<const N: usize>(beam: Beam<'_>, corner: (usize, usize), some: &[Component; N]) -> Option<[usize; N]> {
    let covers = |first: i64, n: usize| first >= 0 && first + SIDE as i64 <= n as i64;
    let mut first = [0; N];
    for k in 0..N {
        let (m, l) = over(beam, corner, &some[k]);
        if !covers(m, beam.n_m) || !covers(l, beam.n_l) {
            return None;
        }
        first[k] = m as usize * beam.n_l + l as usize;
    }
    Some(first)
}

/// Subtract `N` components whose beams cover the tile.
#[inline(always)]
fn apply_some<const N: usize>(beam: Beam<'_>, values: &mut Pixels, first: [usize; N], some: &[Component; N]) {
    let mut flux = [0.0_f32; N];
    for k in 0..N {
        flux[k] = some[k].flux as f32;
    }
    for (i, line) in values.0.as_chunks_mut::<SIDE>().0.iter_mut().enumerate() {
        let mut beams = [&[0.0; SIDE]; N];
        for k in 0..N {
            if let Some(own) = beam.values[first[k] + i * beam.n_l..].first_chunk() {
                beams[k] = own;
            }
        }
        if N == 1 {
            // The compiler makes vectors of a copy only.
            let mut new = *line;
            for j in 0..SIDE {
                new[j] -= flux[0] * beams[0][j];
            }
            *line = new;
            continue;
        }
        for j in 0..SIDE {
            let mut v = line[j];
            for k in 0..N {
                v -= flux[k] * beams[k][j];
            }
            line[j] = v;
        }
    }
}

/// Pixel (m, l) of the beam of a component at the first pixel of a tile.
#[inline(always)]
fn over(beam: Beam<'_>, (row, column): (usize, usize), c: &Component) -> (i64, i64) {
    ((row + beam.n_m / 2) as i64 - c.row as i64, (column + beam.n_l / 2) as i64 - c.column as i64)
}

/// Subtract a component whose beam ends within the tile.
#[inline(always)]
fn apply_part(beam: Beam<'_>, values: &mut Pixels, corner: (usize, usize), c: &Component) {
    let ((m0, l0), (n_m, n_l)) = (over(beam, corner, c), (beam.n_m as i64, beam.n_l as i64));
    let rows = (-m0).clamp(0, SIDE as i64) as usize..(n_m - m0).clamp(0, SIDE as i64) as usize;
    let columns = (-l0).clamp(0, SIDE as i64) as usize..(n_l - l0).clamp(0, SIDE as i64) as usize;
    if columns.is_empty() {
        return;
    }
    let flux = c.flux as f32;
    for i in rows {
        let from = ((m0 + i as i64) * n_l + l0 + columns.start as i64) as usize;
        let line = &mut values.0[i * SIDE + columns.start..i * SIDE + columns.end];
        for (v, b) in line.iter_mut().zip(&beam.values[from..from + columns.len()]) {
            *v -= flux * *b;
        }
    }
}

#[inline(always)]
fn raise_loops((upper, row_upper): (&mut [f64], &mut [f64]), bounds: &Bounds<'_>, size: f64) {
    let (t_l, b_l, (s_m, s_l)) = (upper.len() / row_upper.len().max(1), bounds.columns, bounds.shift);
    // The tiles of a row that lie within the bounds.
    let lo = (-s_l).clamp(0, t_l as i64) as usize;
    let hi = (b_l as i64 - s_l).clamp(lo as i64, t_l as i64) as usize;
    // Without such a tile `lo` is `hi`, and the range is empty.
    let first = ((lo as i64 + s_l) as usize).min(b_l);
    for (i, (row, top)) in upper.chunks_exact_mut(t_l).zip(row_upper).enumerate() {
        let Some(own) = usize::try_from(i as i64 + s_m).ok().and_then(|b| bounds.values.get(b * b_l..(b + 1) * b_l)) else { continue };
        for (u, bound) in row[lo..hi].iter_mut().zip(&own[first..first + hi - lo]) {
            // Tiles without an allowed pixel stay at 0.
            let more = size * bound;
            *u += if *u > 0.0 { more } else { 0.0 };
        }
        *top = largest(row);
    }
}

/// The largest of some numbers, or 0.
#[inline(always)]
pub(super) fn largest(values: &[f64]) -> f64 {
    let (eights, rest) = values.as_chunks::<8>();
    let mut top = [0.0_f64; 8];
    for eight in eights {
        for k in 0..8 {
            top[k] = if eight[k] > top[k] { eight[k] } else { top[k] };
        }
    }
    let larger = |a: f64, b: f64| if b > a { b } else { a };
    let pairs = [larger(top[0], top[4]), larger(top[1], top[5]), larger(top[2], top[6]), larger(top[3], top[7])];
    let top = larger(larger(pairs[0], pairs[2]), larger(pairs[1], pairs[3]));
    rest.iter().fold(top, |a, b| larger(a, *b))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any number of components, beams that cover the tile and beams that end within it: each pixel is what the plain sum gives, to the last bit.
    #[test]
    fn components_are_subtracted_one_after_the_other() {
        let (n_m, n_l) = (70, 90);
        let values: Vec<f32> = (0..n_m * n_l).map(|k| ((k * 7919) % 1013) as f32 * 1e-3 - 0.4).collect();
        let beam = Beam { values: &values, n_m, n_l };
        let corner = (32, 64);
        for n in [1, 3, 4, 9] {
            let at = |k: usize| Component::point(30 + (k * 17) % 40, 50 + (k * 29) % 40, 0.3 - 0.07 * k as f64);
            let components: Vec<Component> = (0..n).map(at).collect();
            let mut tile = Pixels(std::array::from_fn(|k| (k % 37) as f32));
            let expected: Vec<f32> = (0..AREA)
                .map(|k| {
                    let (row, column) = (corner.0 + k / SIDE, corner.1 + k % SIDE);
                    components.iter().fold(tile.0[k], |v, c| {
                        let (m, l) = (row + n_m / 2, column + n_l / 2);
                        let inside = m >= c.row && m - c.row < n_m && l >= c.column && l - c.column < n_l;
                        if inside { v - c.flux as f32 * values[(m - c.row) * n_l + l - c.column] } else { v }
                    })
                })
                .collect();
            apply(beam, &mut tile, corner, &components);
            assert!(tile.0.iter().zip(&expected).all(|(a, b)| a == b), "{n} components");
            let top = expected.iter().fold(0.0_f32, |a, v| a.max(v.abs()));
            let first = expected.iter().position(|v| v.abs() == top).unwrap();
            assert_eq!(tile_peak(&tile, None, true), (top.into(), first));
        }
    }

    #[test]
    fn bounds_are_raised_where_the_beam_reaches() {
        let values: Vec<f64> = (0..12).map(f64::from).collect();
        let bounds = Bounds { values: &values, columns: 4, shift: (1, -1) };
        let (mut upper, mut tops) = (vec![1.0; 15], vec![1.0; 3]);
        upper[6] = 0.0;
        raise((&mut upper, &mut tops), &bounds, 0.5);
        // Row 0 has the bounds 4 to 7 from column 1 on, row 1 those of 8 to 11, and row 2 lies outside.
        assert_eq!(upper[..5], [1.0, 3.0, 3.5, 4.0, 4.5]);
        assert_eq!(upper[5..10], [1.0, 0.0, 5.5, 6.0, 6.5]);
        assert_eq!((&upper[10..], &tops[..]), (&[1.0; 5][..], &[4.5, 6.5, 1.0][..]));
    }
}

//! The vertical grid of the integrations.

/// Steps of the grid: the height in km up to which a step is used, and the step in km.
///
/// Half of every step changes a sky temperature by less than 0.06 K.
const STEPS: [(f64, f64); 3] = [(5.0, 0.05), (15.0, 0.1), (f64::INFINITY, 0.25)];

/// Heights closer than this are one level, km.
const SAME_LEVEL_KM: f64 = 1e-7;

/// Levels from `from_km` to `to_km`: 50 m to 5 km, 100 m to 15 km, 250 m above, plus
/// every height in `extra_km` that lies between.
pub(super) fn grid_levels(from_km: f64, to_km: f64, extra_km: &[f64]) -> Vec<f64> {
    let mut levels = vec![from_km, to_km];
    levels.extend(extra_km.iter().copied().filter(|z| (from_km..to_km).contains(z)));
    // Multiples of the step, counted from zero height, so that two grids share levels.
    let mut start = from_km;
    for (limit, step) in STEPS {
        let end = limit.min(to_km);
        let mut i = (start / step).ceil();
        while i * step < end {
            levels.push(i * step);
            i += 1.0;
        }
        start = start.max(end);
    }
    levels.sort_by(f64::total_cmp);
    // Both ends stay exact. Of two nearly equal levels at the top, the lower one is removed.
    let mut kept: Vec<f64> = Vec::with_capacity(levels.len());
    for z in levels {
        match kept.last_mut() {
            Some(last) if z - *last < SAME_LEVEL_KM => {
                if z == to_km && kept.len() > 1 {
                    kept.pop();
                    kept.push(z);
                }
            }
            _ => kept.push(z),
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn full_grid_has_260_layers() {
        let levels = grid_levels(0.0, 30.0, &[]);
        assert_eq!(levels.len(), 261);
        assert_eq!((levels[0], levels[260]), (0.0, 30.0));
        assert!(levels.windows(2).all(|w| w[1] - w[0] > 0.049 && w[1] - w[0] < 0.2501));
    }

    #[test]
    fn extra_heights_are_levels_once() {
        let levels = grid_levels(0.0, 1.0, &[0.5, 0.333, 2.0, 0.333]);
        assert_eq!(levels.len(), 22);
        assert!(levels.contains(&0.333));
    }

    #[test]
    fn short_range_keeps_both_ends() {
        let levels = grid_levels(0.12, 0.13, &[]);
        assert_eq!(levels, vec![0.12, 0.13]);
        let crossing = grid_levels(-0.02, 0.07, &[]);
        assert_eq!(crossing.len(), 4);
        assert_eq!((crossing[0], crossing[3]), (-0.02, 0.07));
    }
}

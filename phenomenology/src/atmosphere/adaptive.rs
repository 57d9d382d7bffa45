//! Adaptive nodes of a table: intervals are halved until linear interpolation is accurate enough.

use super::error::PhysicsError;

/// Intervals below this width are not halved any more, degrees.
const MIN_WIDTH_DEG: f64 = 1e-4;
/// Largest number of nodes.
const LIMIT: usize = 8192;

/// Nodes in rising order and the values there.
#[derive(Debug, Clone)]
pub(super) struct Refined {
    pub(super) nodes: Vec<f64>,
    pub(super) values: Vec<Vec<f64>>,
    /// Largest error at the middle of an accepted interval. The middle is a node too.
    pub(super) worst_k: f64,
}

/// Halves the intervals between `start` nodes until `error_k(interpolated, exact)` at
/// every middle is within tolerance.
///
/// Every middle that is evaluated becomes a node, so the error that is left is about a quarter of `worst_k`.
pub(super) fn refine(
    start: &[f64],
    tolerance_k: f64,
    mut evaluate: impl FnMut(f64) -> Result<Vec<f64>, PhysicsError>,
    error_k: impl Fn(&[f64], &[f64]) -> f64,
) -> Result<Refined, PhysicsError> {
    let mut refined = Refined { nodes: Vec::new(), values: Vec::new(), worst_k: 0.0 };
    let Some((first, rest)) = start.split_first() else {
        return Err(PhysicsError::Empty { what: "node of the table" });
    };
    refined.nodes.push(*first);
    refined.values.push(evaluate(*first)?);
    // Right ends of the intervals that are not done, the leftmost on top.
    let mut pending: Vec<(f64, Vec<f64>)> = Vec::new();
    for &right in rest {
        let exact = evaluate(right)?;
        pending.push((right, exact));
        while let Some((right, exact)) = pending.pop() {
            let last = refined.nodes.len() - 1;
            let left = refined.nodes[last];
            let middle = 0.5 * (left + right);
            let at_middle = evaluate(middle)?;
            let between: Vec<f64> = refined.values[last].iter().zip(&exact).map(|(a, b)| 0.5 * (a + b)).collect();
            let error = error_k(&between, &at_middle);
            if error <= tolerance_k || right - left <= MIN_WIDTH_DEG {
                refined.worst_k = refined.worst_k.max(error);
                refined.nodes.extend([middle, right]);
                refined.values.extend([at_middle, exact]);
            } else {
                pending.push((right, exact));
                pending.push((middle, at_middle));
            }
            if refined.nodes.len() + pending.len() > LIMIT {
                let need = format!("the sky table needs more than {LIMIT} zenith angles for a tolerance of {tolerance_k} K");
                return Err(PhysicsError::Refused(format!("{need}; ask for a larger tolerance or a narrower range")));
            }
        }
    }
    Ok(refined)
}

/// Interval of `x` between rising nodes, as index and fraction. Outside the nodes it is the nearest end; callers check the range.
pub(super) fn bracket(nodes: &[f64], x: f64) -> (usize, f64) {
    let last = nodes.len() - 1;
    let right = nodes.partition_point(|node| *node <= x).clamp(1, last.max(1));
    let (left, right) = (right - 1, right.min(last));
    let width = nodes[right] - nodes[left];
    if width > 0.0 { (left, ((x - nodes[left]) / width).clamp(0.0, 1.0)) } else { (left, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE_K: f64 = 1e-4;

    fn worst(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn refined_table_interpolates_within_tolerance() {
        let f = |x: f64| 1.0 / (0.1 + x);
        let table = refine(&[0.0, 1.0], TOLERANCE_K, |x| Ok(vec![f(x)]), worst).unwrap();
        assert!(table.nodes.windows(2).all(|w| w[0] < w[1]));
        assert!(table.worst_k <= TOLERANCE_K);
        for i in 0..1000 {
            let x = f64::from(i) / 999.0;
            let (left, w) = bracket(&table.nodes, x);
            let y = table.values[left][0] * (1.0 - w) + table.values[left + 1][0] * w;
            assert!((y - f(x)).abs() < TOLERANCE_K, "{x}");
        }
    }

    #[test]
    fn a_step_stops_at_the_smallest_width_or_the_limit() {
        let step = |x: f64| Ok(vec![if x < 0.3 { 0.0 } else { 1.0 }]);
        assert!(refine(&[0.0, 1.0], TOLERANCE_K, step, worst).unwrap().worst_k >= 0.49);
        let wild = |x: f64| Ok(vec![(1e3 * x).sin()]);
        let message = refine(&[0.0, 100.0], TOLERANCE_K, wild, worst).unwrap_err().to_string();
        assert!(message.contains("more than 8192 zenith angles"), "{message}");
        assert!(refine(&[], TOLERANCE_K, step, worst).is_err());
    }
}

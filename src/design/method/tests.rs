//! What all methods do: keep to the limits, make the start better, and repeat themselves.

use super::*;
use crate::design::{DesignOptions, Ground, Polygon, attempt};
use crate::progress::Silent;
use cittert_arrays::quantity::Length;

fn options(objective: &str) -> DesignOptions {
    DesignOptions {
        elements: Some(12),
        aperture: Some(Length(2.0)),
        spacing: Length(0.2),
        within: 4.0,
        beam: Some(0.0),
        objective: objective.parse().unwrap(),
        ..DesignOptions::default()
    }
}

#[test]
fn every_method_keeps_the_limits_improves_its_start_and_repeats_itself() {
    let hole = Polygon::new("hole", vec![[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]]).unwrap();
    let ground = Ground { fixed: vec![[0.9, 0.0], [-0.5, 0.5]], inside: Vec::new(), outside: vec![hole] };
    for method in METHODS {
        let problem = options("psl").problem(&ground).unwrap();
        let found = attempt(&problem, method, None, 5, 0, &[], &Silent).unwrap();
        assert_eq!(found, attempt(&problem, method, None, 5, 0, &[], &Silent).unwrap(), "{}", method.name);
        assert!(problem.limits.worst(&found.xy) <= 1e-9, "{}: {}", method.name, problem.limits.worst(&found.xy));
        assert_eq!(found.xy.len(), 12);
        for fixed in [[0.45, 0.0], [-0.25, 0.25]] {
            assert!(found.xy.contains(&fixed), "{}", method.name);
        }
        let mut random = crate::random::stream(5, "layout design", 0);
        let start = crate::design::start::layout(&problem.freedom, &problem.limits, &mut random).unwrap();
        let before = problem.evaluator().unwrap().score(&problem.freedom.positions(&start)).unwrap();
        assert!(found.score < 0.9 * before, "{}: {before} {}", method.name, found.score);
    }
}

#[test]
fn objectives_without_gradient_are_annealed_and_sums_are_descended() {
    for (objective, name) in [("fill", "annealing"), ("rms,cable=0.01", "descent"), ("psl,robust", "descent")] {
        let options = options(objective);
        let problem = options.problem(&Ground::default()).unwrap();
        let method = options.method_for(&problem).unwrap();
        assert_eq!(method.name, name);
        let found = attempt(&problem, method, None, 2, 0, &[], &Silent).unwrap();
        assert!(problem.limits.worst(&found.xy) <= 1e-9, "{objective}");
    }
    let options = DesignOptions { method: Some("descent".into()), ..options("psl,fill") };
    let message = options.method_for(&options.problem(&Ground::default()).unwrap()).err().unwrap().to_string();
    assert!(message.contains("fill"), "{message}");
}

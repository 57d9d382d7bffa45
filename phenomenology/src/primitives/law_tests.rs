//! Laws that every body obeys.

use super::*;
use crate::space::{Ray, Similarity, Vec3};
use proptest::prelude::*;

/// One of each kind, none along the axes but the RPP.
fn zoo() -> Vec<Body> {
    let (a, b, c) = ([1.0, 0.5, 0.0], [-0.4, 0.8, 0.0], [0.0, 0.0, 0.7]);
    let edges = |v: [f64; 3]| [v, a, b, c].concat();
    [
        ("RPP", vec![-1.0, 0.5, -0.2, 0.9, -0.6, 1.1]),
        ("BOX", edges([-0.3, -0.4, -0.2])),
        ("SPH", vec![0.1, 0.2, -0.3, 0.9]),
        ("RCC", vec![-0.2, 0.1, -0.5, 0.3, 0.4, 1.2, 0.6]),
        ("REC", [[0.0, 0.0, -0.4], c, a, b].concat()),
        ("TRC", vec![0.1, -0.3, -0.5, 0.2, 0.3, 1.1, 0.9, 0.3]),
        ("TRC", vec![0.1, -0.3, -0.5, 0.2, 0.3, 1.1, 0.0, 0.8]),
        ("ELL", vec![-0.4, 0.1, 0.0, 0.5, 0.3, 0.2, 1.6]),
        ("WED", edges([-0.3, -0.4, -0.2])),
    ]
    .into_iter()
    .map(|(code, p)| Body::new(code, &p).unwrap())
    .collect()
}

fn vector(reach: f64) -> impl Strategy<Value = Vec3> {
    (-reach..reach, -reach..reach, -reach..reach).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

proptest! {
    // Points of the span pass the inside test, the ends of the span lie on the named faces, and the normals there point outward.
    #[test]
    fn span_inside_test_normals_and_bounds_agree(from in vector(6.0), to in vector(1.0)) {
        prop_assume!((to - from).norm() > 1e-3);
        let ray = Ray::new(from, to - from);
        for body in zoo() {
            let Some(span) = body.solid.intersect(&ray) else {
                for k in 0..200 {
                    prop_assert!(!body.solid.contains(ray.at(f64::from(k) * 0.06)), "{}", body.entry.code);
                }
                continue;
            };
            let gap = 1e-7 * (1.0 + (span.t_out - span.t_in));
            prop_assume!(span.t_out - span.t_in > 10.0 * gap);
            prop_assert!(body.solid.contains(ray.at(span.t_in + gap)), "{}", body.entry.code);
            prop_assert!(body.solid.contains(ray.at(0.5 * (span.t_in + span.t_out))));
            prop_assert!(body.solid.contains(ray.at(span.t_out - gap)));
            prop_assert!(!body.solid.contains(ray.at(span.t_in - gap)));
            prop_assert!(!body.solid.contains(ray.at(span.t_out + gap)));
            for (face, t, sign) in [(span.face_in, span.t_in, -1.0), (span.face_out, span.t_out, 1.0)] {
                prop_assert!(face >= 1 && usize::from(face) <= body.entry.faces.len());
                let n = body.solid.normal(face, ray.at(t));
                prop_assert!((n.norm() - 1.0).abs() < 1e-12);
                prop_assert!(n.dot(ray.direction) * sign >= -1e-6, "{} face {face}", body.entry.code);
                prop_assert!(body.solid.bounds().grown(1e-9).contains(ray.at(t)), "{}", body.entry.code);
            }
        }
    }

    // Moving body and ray together moves the hits along.
    #[test]
    fn a_moved_body_is_hit_by_the_moved_ray(from in vector(6.0), to in vector(0.8), shift in vector(50.0),
        angles in vector(180.0), scale in 0.1f64..10.0) {
        prop_assume!((to - from).norm() > 1e-3);
        let by = Similarity::new(shift, angles, scale).unwrap();
        let ray = Ray::new(from, to - from);
        let moved = Ray::new(by.point(from), by.vector(to - from));
        for body in zoo() {
            let there = body.transformed(&by).unwrap();
            match (body.solid.intersect(&ray), there.solid.intersect(&moved)) {
                (Some(a), Some(b)) => {
                    prop_assert!((a.t_in * scale - b.t_in).abs() < 1e-6 * scale.max(1.0), "{} {a:?} {b:?}", body.entry.code);
                    prop_assert!((a.t_out * scale - b.t_out).abs() < 1e-6 * scale.max(1.0));
                    if a.t_out - a.t_in > 1e-3 {
                        let n = by.vector(body.solid.normal(a.face_in, ray.at(a.t_in))).unit();
                        let m = there.solid.normal(b.face_in, moved.at(b.t_in));
                        prop_assert!(a.face_in != b.face_in || (n - m).norm() < 1e-5);
                    }
                }
                (None, None) => {}
                (Some(s), None) | (None, Some(s)) => prop_assert!(s.t_out - s.t_in < 1e-3 * scale.max(1.0), "{}", body.entry.code),
            }
        }
    }
}

#[test]
fn far_bodies_lose_no_digits() {
    let ray = Ray::new(Vec3::new(-1e6, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0));
    for (code, p) in [
        ("SPH", vec![0.0, 0.0, 0.0, 0.5]),
        ("RCC", vec![0.0, 0.0, -1.0, 0.0, 0.0, 2.0, 0.5]),
        ("TRC", vec![0.0, 0.0, -1.0, 0.0, 0.0, 2.0, 0.6, 0.4]),
        ("ELL", vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
    ] {
        let span = Body::new(code, &p).unwrap().solid.intersect(&ray).unwrap();
        assert!((span.t_in - (1e6 - 0.5)).abs() < 1e-8, "{code} {}", span.t_in);
    }
}

#[test]
fn bodies_without_volume_are_refused() {
    for (code, p, part) in [
        ("SPH", vec![0.0, 0.0, 0.0, 0.0], "radius R of the SPH is 0 m"),
        ("RCC", vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], "singular: H has length 0 m"),
        ("RCC", vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -1.0], "radius R of the RCC is -1 m"),
        ("TRC", vec![0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0], "above 0"),
        ("BOX", vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0], "H1 and H2 meet at 45.0000 deg"),
        ("RPP", vec![0.0, 1.0, 2.0, 1.0, 0.0, 1.0], "ymin = 2 m and ymax = 1 m"),
        ("ELL", vec![0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.5], "L must be larger"),
        ("SPH", vec![0.0, 0.0, 0.0], "takes 4 parameters (Vx Vy Vz R), not 3"),
        ("SPH", vec![0.0, f64::NAN, 0.0, 1.0], "parameter 2 of the SPH is NaN"),
        ("ARB", vec![], "unknown body type `ARB`"),
    ] {
        let message = Body::new(code, &p).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn a_cone_is_hit_at_its_apex_and_along_its_axis() {
    let cone = Body::new("TRC", &[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0]).unwrap();
    let down = Ray::new(Vec3::new(0.0, 0.0, 5.0), Vec3::new(0.0, 0.0, -1.0));
    let span = cone.solid.intersect(&down).unwrap();
    assert!((span.t_in - 4.0).abs() < 1e-12 && (span.t_out - 5.0).abs() < 1e-12);
    assert!(cone.solid.normal(span.face_in, down.at(span.t_in)).is_finite());
    // Beside the apex the mirrored nappe must not be seen.
    let above = Ray::new(Vec3::new(-5.0, 0.0, 1.5), Vec3::new(1.0, 0.0, 0.0));
    assert!(cone.solid.intersect(&above).is_none());
}

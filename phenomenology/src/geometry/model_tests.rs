//! Regions, order, holes and the text.

use super::probe::{PointRow, RayRow};
use super::*;
use crate::space::{Ray, Vec3};
use proptest::prelude::*;

fn geometry(text: &str) -> Geometry {
    let m = read_text(text, 1).unwrap();
    Geometry::new(m.bodies, m.regions).unwrap()
}

fn fault(text: &str) -> String {
    match read_text(text, 1).and_then(|m| Geometry::new(m.bodies, m.regions)) {
        Ok(_) => panic!("{text} was accepted"),
        Err(e) => e.to_string(),
    }
}

const DRILLED: &str = "
block RPP 0 4 0 4 0 4
RCC bore  2 2 -1   0 0 6   1
plug SPH 2 2 2 0.5
REGION body ; +block -bore ; steel
REGION ball ; +plug ; wood
";

#[test]
fn a_ray_passes_a_bore_and_meets_what_floats_in_it() {
    let g = geometry(DRILLED);
    let down = Ray::new(Vec3::new(2.0, 2.0, 10.0), Vec3::new(0.0, 0.0, -1.0));
    let hit = g.first_hit(&down, f64::INFINITY).unwrap();
    assert_eq!((hit.t, g.regions()[hit.region as usize].source.name.as_str()), (7.5, "ball"));
    // From the middle of the bore to its wall: the normal points back into the hole.
    let out = Ray::new(Vec3::new(2.0, 2.0, 3.0), Vec3::new(1.0, 0.0, 0.0));
    let hit = g.first_hit(&out, f64::INFINITY).unwrap();
    assert_eq!((hit.t, hit.subtracted), (1.0, true));
    assert_eq!(g.normal(&hit, out.at(1.0)), Vec3::new(-1.0, 0.0, 0.0));
    // From the side through the block into the bore and on: the entry counts, the exit shows from inside.
    let side = Ray::new(Vec3::new(-1.0, 2.0, 1.0), Vec3::new(1.0, 0.0, 0.0));
    assert_eq!(g.first_hit(&side, f64::INFINITY).unwrap().t, 1.0);
    let inside = Ray::new(Vec3::new(0.5, 2.0, 1.0), Vec3::new(1.0, 0.0, 0.0));
    assert_eq!(g.probe(None, &inside).unwrap().t, 0.5);
}

#[test]
fn the_first_listed_region_wins() {
    let text = "1 RPP 0 2 0 2 0 2\n2 RPP 1 3 0 2 0 2\n3 RPP 0 2 0 2 0 2\nREGION a ; +1\nREGION b ; +2\nREGION c ; +3\n";
    let g = geometry(text);
    let name = |x: f64| g.probe_points(None, &[PointRow { x, y: 1.0, z: 1.0 }]).unwrap()[0].region.clone();
    assert_eq!((name(1.5).as_deref(), name(2.5).as_deref(), name(3.5)), (Some("a"), Some("b"), None));
    // Regions a and c begin on the same face.
    let row = RayRow { ox: -1.0, oy: 1.0, oz: 1.0, dx: 2.0, dy: 0.0, dz: 0.0 };
    let answer = &g.probe_rays(None, &[row]).unwrap()[0];
    assert_eq!((answer.t, answer.region.as_deref(), answer.face), (Some(1.0), Some("a"), Some(1)));
}

#[test]
fn an_empty_region_cuts_what_is_listed_after_it() {
    let text = "1 RPP 0 4 0 4 0 4\n2 RPP 1 3 1 3 1 5\n3 RPP 1.5 2.5 1.5 2.5 0 5\nREGION room ; +2 -3 ; air\nREGION wall ; +1 ; concrete\n";
    let g = geometry(text);
    let down = |x: f64, y: f64| g.first_hit(&Ray::new(Vec3::new(x, y, 10.0), Vec3::new(0.0, 0.0, -1.0)), 1e9).map(|h| h.t);
    assert_eq!(down(0.5, 0.5), Some(6.0));
    assert_eq!(down(1.2, 1.2), Some(9.0));
    // The pillar 3 is kept out of the room, so the wall region still fills it.
    assert_eq!(down(2.0, 2.0), Some(6.0));
}

#[test]
fn coincident_faces_leave_no_film() {
    // A bore exactly as long as the block.
    let g = geometry("1 RPP 0 1 0 1 0 1\n2 RPP 0.25 0.75 0.25 0.75 0 1\nREGION a ; +1 -2\n");
    for k in 1..100 {
        let x = 0.25 + 0.005 * f64::from(k);
        let slanted = Ray::new(Vec3::new(x, 0.5, 3.0), Vec3::new(0.0, 1e-4, -1.0));
        assert!(g.first_hit(&slanted, f64::INFINITY).is_none_or(|h| h.subtracted), "{k}");
        let straight = Ray::new(Vec3::new(x, 0.5, 3.0), Vec3::new(0.0, 0.0, -1.0));
        assert!(g.first_hit(&straight, f64::INFINITY).is_none());
    }
}

#[test]
fn faults_have_their_line() {
    for (text, part) in [
        ("1 SPH 0 0 0 1\nREGION a ; +1 +2", "line 2: region `a` names unknown body `2`; known bodies: 1"),
        ("1 BOX 0 0 0 1 0 0 2 0 0 0 0 1\nREGION a ; +1", "line 1: body `1`: the BOX is singular"),
        ("\n# note\n1 SPH 0 0 0 0", "line 3: body `1`: radius R of the SPH is 0 m"),
        ("1 SPH 0 0 0 1\nREGION a ;", "line 2: region `a` names no body"),
        ("1 SPH 0 0 0 1\nREGION a ; -1", "line 2: region `a` has a term without a + body"),
        ("1 SPH 0 0 0 1\n1 SPH 0 0 0 2\nREGION a ; +1", "line 2: body `1` was already given at line 1"),
        ("1 SPH 0 0 0 1\nREGION a ; +1\nREGION a ; +1", "region `a` was already given at line 2"),
        ("1 TORUS 0 0 0 1 2", "line 1: body `1`: unknown body type `TORUS`"),
        ("1 SPH 0 0 zero 1", "line 1: `zero` is not a parameter of body `1` (SPH)"),
        ("0 0 0 1", "line 1: `0 0 0 1` is neither a body"),
        ("1 SPH 0 0 0 1\nREGION a ; 1", "line 2: region `a`: `1` in `1` needs a sign"),
        ("1 SPH 0 0 0", "line 1: body `1`: SPH takes 4 parameters (Vx Vy Vz R), not 3"),
    ] {
        let message = fault(text);
        assert!(message.contains(part), "{message}\nwanted {part}");
    }
    let g = geometry("1 SPH 0 0 0 1\nREGION a ; +1");
    assert!(g.probe_rays(Some("b"), &[]).unwrap_err().to_string().contains("no region `b`; known regions: a"));
    let bad = RayRow { ox: 0.0, oy: 0.0, oz: 0.0, dx: 0.0, dy: 0.0, dz: 0.0 };
    assert!(g.probe_rays(None, &[bad]).unwrap_err().to_string().starts_with("row 1: the ray"));
}

#[test]
fn text_round_trips_and_parameters_may_go_on() {
    let m = read_text(DRILLED, 1).unwrap();
    let sources: Vec<RegionSource> = m.regions.clone();
    let again = read_text(&write_text(&m.bodies, &sources, &m.surfaces), 1).unwrap();
    assert_eq!(again.surfaces, m.surfaces);
    assert!(again.bodies.iter().zip(&m.bodies).all(|(a, b)| a.body == b.body && a.name == b.name));
    assert!(again.regions.iter().zip(&m.regions).all(|(a, b)| a.expression == b.expression));
    let folded = read_text("1 RPP 0 1\n   0 1\n   0 1\nREGION a +1", 1).unwrap();
    assert_eq!(folded.bodies[0].body.parameters, [0.0, 1.0, 0.0, 1.0, 0.0, 1.0]);
    assert!(looks_like_bodies(DRILLED) && !looks_like_bodies("kind = \"solids\"\n"));
}

proptest! {
    // The fast search of the first entry and the full evaluation of stretches find the same border.
    #[test]
    fn both_ways_to_a_border_agree(ox in -6.0f64..6.0, oy in -6.0f64..6.0, oz in -6.0f64..6.0,
        tx in 0.0f64..4.0, ty in 0.0f64..4.0, tz in 0.0f64..4.0) {
        let g = geometry("1 RPP 0 4 0 4 0 4\n2 RCC 2 2 -1 0 0 6 1\n3 SPH 4 4 4 1.5\n4 TRC 0 0 0 3 0 0 1 0.5\n\
            REGION a ; +1 -2 -3 -4 OR +3 -1");
        let o = Vec3::new(ox, oy, oz);
        prop_assume!(!g.region_contains(0, o) && (Vec3::new(tx, ty, tz) - o).norm() > 1e-3);
        let ray = Ray::new(o, Vec3::new(tx, ty, tz) - o);
        let (fast, full) = (g.first_hit(&ray, f64::INFINITY), g.nearest_border(0, &ray));
        prop_assert_eq!(fast.is_some(), full.is_some());
        if let (Some(a), Some(b)) = (fast, full) {
            prop_assert!((a.t - b.t).abs() < 1e-9, "{a:?} {b:?}");
        }
    }
}

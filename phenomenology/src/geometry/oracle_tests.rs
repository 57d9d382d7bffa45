//! Rays and points of POV-Ray on the same solids.

use super::probe::{PointRow, RayRow, read_rows};
use super::{Geometry, read_text};
use crate::oracle_tests::text as oracle;
use serde::Deserialize;
use std::collections::BTreeMap;

fn geometry() -> Geometry {
    let model = read_text(&oracle("csg_bodies_regions.txt"), 1).unwrap();
    Geometry::new(model.bodies, model.regions).unwrap()
}

#[derive(Deserialize)]
struct Traced {
    region: String,
    hit: u8,
    t: Option<f64>,
    nx_unsigned: Option<f64>,
    ny_unsigned: Option<f64>,
    nz_unsigned: Option<f64>,
    #[serde(flatten)]
    ray: BTreeMap<String, f64>,
}

#[test]
fn rays_agree_with_pov_ray() {
    let geometry = geometry();
    let text = oracle("csg_rays_povray.csv");
    let rows: Vec<Traced> = read_rows(text.as_bytes()).unwrap();
    assert_eq!(rows.len(), 1280);
    let (mut flags, mut worst_t, mut worst_n) = (0, 0.0_f64, 0.0_f64);
    for row in &rows {
        let at = |k: &str| row.ray[k];
        let ray = RayRow { ox: at("ox"), oy: at("oy"), oz: at("oz"), dx: at("dx"), dy: at("dy"), dz: at("dz") };
        let answer = &geometry.probe_rays(Some(&row.region), &[ray]).unwrap()[0];
        if answer.hit != row.hit {
            flags += 1;
            continue;
        }
        if let (Some(t), Some(want)) = (answer.t, row.t) {
            worst_t = worst_t.max((t - want).abs());
            let n = [answer.nx, answer.ny, answer.nz].map(Option::unwrap);
            let m = [row.nx_unsigned, row.ny_unsigned, row.nz_unsigned].map(Option::unwrap);
            let facing: f64 = n[0] * ray.dx + n[1] * ray.dy + n[2] * ray.dz;
            let sign = if facing > 0.0 { -1.0 } else { 1.0 };
            for k in 0..3 {
                worst_n = worst_n.max((sign * n[k] - m[k]).abs());
            }
        }
    }
    println!("{flags} flags differ, t {worst_t:.2e}, normal {worst_n:.2e}");
    assert!(f64::from(flags) <= 0.002 * rows.len() as f64, "{flags} flags");
    assert!(worst_t < 1e-6 && worst_n < 1e-5, "t {worst_t:e}, normal {worst_n:e}");
}

#[derive(Deserialize)]
struct Placed {
    region: String,
    x: f64,
    y: f64,
    z: f64,
    inside: u8,
}

#[test]
fn points_agree_with_pov_ray() {
    let geometry = geometry();
    let text = oracle("csg_inside_povray.csv");
    let rows: Vec<Placed> = read_rows(text.as_bytes()).unwrap();
    assert_eq!(rows.len(), 1280);
    for row in rows {
        let point = PointRow { x: row.x, y: row.y, z: row.z };
        let answer = &geometry.probe_points(Some(&row.region), &[point]).unwrap()[0];
        assert_eq!(answer.inside, row.inside, "region {} at {} {} {}", row.region, row.x, row.y, row.z);
    }
}

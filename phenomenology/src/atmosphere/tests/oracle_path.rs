//! Upwelling paths against pyrtlib, and the constant-temperature form against both.

use super::{Worst, median, number, oracle};
use crate::atmosphere::*;

#[test]
fn upwelling_paths_match_and_constant_temperature_is_close() {
    let oracle = oracle("upwelling_path.csv");
    let (mut integral, mut tau) = (Worst::default(), Worst::default());
    let (mut short_worst, mut short, mut long) = (Worst::default(), Vec::new(), Vec::new());
    let mut pieces = Worst::default();
    for name in ["ussa", "trl", "sts", "saw"] {
        let air = Atmosphere::reference(name, "mpm89").unwrap();
        let freqs = [10.0, 19.0, 35.0, 37.0, 89.0, 94.0, 140.0, 183.0, 220.0, 340.0];
        let table = PathTable::new(&air, &freqs).unwrap();
        let stepped = table.clone().with_max_rise(0.2).unwrap();
        for row in oracle.iter().filter(|r| r[0] == name) {
            let v = |i| number(row, i);
            let what = || row.join(",");
            let ends = PathEnds::new(v(3), 0.0, PathExtent::ZenithDeg(v(4))).unwrap();
            let full = air.path(&[v(2)], &ends).unwrap()[0];
            integral.see((full.emission_rj_k() - v(6)).abs(), what);
            tau.see((full.tau_np / v(7) - 1.0).abs(), what);
            let channel = freqs.iter().position(|f| *f == v(2)).unwrap();
            let off = (table.radiation(channel, &ends).unwrap().emission_rj_k() - v(6)).abs();
            if v(3) <= 0.2 {
                short_worst.see(off, what);
                short.push(off);
            } else if v(3) == 5.0 {
                long.push(off);
            }
            let split = stepped.radiation(channel, &ends).unwrap();
            pieces.see((split.emission_rj_k() - v(6)).abs(), what);
        }
    }
    assert_eq!((short.len(), long.len()), (320, 160));
    integral.within("upwelling, RJ K", 0.1);
    tau.within("path tau, relative", 2e-3);
    let (near, far) = (median(&mut short), median(&mut long));
    println!("constant temperature: median {near:.2e} K to 0.2 km, {far:.2} K at 5 km");
    assert!(near <= 0.001, "{near}");
    short_worst.within("constant temperature to 0.2 km, K", 0.8);
    pieces.within("pieces of 0.2 km, any height, K", 0.8);
}

//! Delays and dispersion against sums and integrals made with other software (`tests/oracle/delay.py`).

use crate::atmosphere::*;
use crate::oracle_tests::{Table, text};

// Two programs that evaluate one published sum: what is left is rounding. The bar is 1e-4 of the dispersion, and where lines above and below
// cancel, of a thousandth of the largest in that air.
#[test]
fn dispersion_is_the_plain_complex_sum() {
    let table = Table::open("delay_dispersion_numpy.csv");
    let number = |row: &csv::StringRecord, name: &str| table.number(row, name);
    let state = |row: &csv::StringRecord| ["pressure_dry_hpa", "vapour_hpa", "temperature_k"].map(|name| number(row, name));
    let mut worst: f64 = 0.0;
    for row in &table.rows {
        let same = |r: &&csv::StringRecord| r[0] == row[0] && state(r) == state(row);
        let [dry, vapour, temperature] = state(row);
        let air = AirState::new(dry + vapour, temperature, vapour).unwrap();
        let n = gas_model(table.text(row, "model")).unwrap().spectrum(&air).refractivity(number(row, "freq_ghz"));
        for (got, name) in [(n.dry.re, "dry_ppm"), (n.wet.re, "wet_ppm")] {
            let want = number(row, name);
            let largest = table.rows.iter().filter(same).map(|r| number(r, name).abs()).fold(0.0, f64::max);
            let error = (got - want).abs() / want.abs().max(1e-3 * largest);
            worst = worst.max(error);
            assert!(error < 1e-4, "{row:?} {name}: {got} {want}");
        }
    }
    println!("{} rows, worst {worst:.1e} relative", table.rows.len());
}

// The refractivity of P.453 has no dispersion, so the delay is that at 3 GHz: above the relaxation of oxygen, below all lines.
#[test]
fn zenith_delays_are_those_of_p453_and_of_a_radiosonde() {
    let table = Table::open("delay_zenith_p453.csv");
    for row in &table.rows {
        let name = table.text(row, "atmosphere");
        let profile = match name.strip_prefix("sounding") {
            Some(_) => Profile::from_csv(name, &text(&format!("{name}.csv"))).unwrap(),
            None => reference_profile(name).unwrap(),
        };
        for model in GAS_MODELS {
            let air = Atmosphere::new(profile.clone(), gas_model(model.name).unwrap()).unwrap();
            let d = air.delay(&[3.0], &[0.0], Geometry::Plane).unwrap()[0].delay;
            let (dry, wet) = (d.dry_m * 1e3 - table.number(row, "dry_mm"), d.wet_m * 1e3 - table.number(row, "wet_mm"));
            println!("{name} {}: dry {:.2} mm {dry:+.2}, wet {:.2} mm {wet:+.2}", model.name, d.dry_m * 1e3, d.wet_m * 1e3);
            assert!(dry.abs() < 1.0, "{name} {}: dry {dry} mm", model.name);
            assert!(wet.abs() < 0.5, "{name} {}: wet {wet} mm", model.name);
            // The balloon knows the pressure at the ground, and so the hydrostatic delay: that of the dry air and of the mass of the vapour.
            let hydrostatic = table.text(row, "hydrostatic_mm");
            if !hydrostatic.is_empty() {
                let vapour_mass = 77.6 * 0.622 / (72.0 + 3.75e5 / 275.0) * d.wet_m * 1e3;
                let error = d.dry_m * 1e3 + vapour_mass - hydrostatic.parse::<f64>().unwrap();
                println!("{name}: hydrostatic {error:+.2} mm");
                assert!(error.abs() < 1.0, "{name}: hydrostatic {error} mm");
            }
        }
    }
}

// A profile that ends at 100 hPa has a tenth of its dry delay above the top.
#[test]
fn the_air_above_the_top_is_hydrostatic_wherever_the_top_is() {
    let whole = reference_profile("ussa").unwrap();
    let air = |top_km: f64| {
        let levels = whole.levels().iter().filter(|l| l.z_km <= top_km).copied().collect();
        Atmosphere::new(Profile::new("cut", levels).unwrap(), gas_model("mpm89").unwrap()).unwrap()
    };
    let dry_mm = |top_km: f64| air(top_km).delay(&[3.0], &[0.0], Geometry::Plane).unwrap()[0].delay.dry_m * 1e3;
    for top_km in [12.0, 16.0, 20.0, 25.0] {
        let error = dry_mm(top_km) - dry_mm(30.0);
        println!("top {top_km} km: {error:+.2} mm");
        assert!(error.abs() < 1.0, "{top_km} km: {error} mm");
    }
}

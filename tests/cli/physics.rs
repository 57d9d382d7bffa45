//! The tables of the physics: columns, units, combinations, and a few rows of the references.

use crate::program::{Scratch, oracle};
use std::collections::BTreeMap;

/// Rows of a CSV on stdout.
fn rows(s: &Scratch, line: &str) -> Vec<BTreeMap<String, String>> {
    let out = s.ok(line).out;
    csv::Reader::from_reader(out.as_bytes()).deserialize().map(Result::unwrap).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row.get(column).unwrap_or_else(|| panic!("no column {column} in {row:?}")).parse().unwrap_or_else(|_| panic!("{column} in {row:?}"))
}

/// Rows of a table of reference values.
fn reference(name: &str) -> Vec<BTreeMap<String, String>> {
    csv::Reader::from_path(oracle(name)).unwrap().deserialize().map(Result::unwrap).collect()
}

#[test]
fn attenuation_has_a_row_for_each_combination() {
    let s = Scratch::new();
    let line = "scene attenuation --model mpm89 --pressure 1013hPa --temperature 290K --vapour 7.5g/m3 --cloud 0.1g/m3 --rain 5mm/h";
    let r = rows(&s, &format!("{line} --freq 10GHz,35GHz,94GHz"));
    assert_eq!(r.iter().map(|r| number(r, "freq_ghz")).collect::<Vec<_>>(), [10.0, 35.0, 94.0]);
    let parts = ["oxygen", "water_vapour", "nitrogen", "droplets", "ice", "rain"].map(|p| number(&r[2], &format!("{p}_db_per_km")));
    assert!((number(&r[2], "attenuation_db_per_km") - parts.iter().sum::<f64>()).abs() < 1e-12);
    assert!(parts[3] > 0.3 && parts[5] > 3.0 && parts[4] == 0.0);
    let many =
        rows(&s, "scene attenuation --model mpm89,mpm93 --pressure 1000hPa,500hPa --humidity 10%,50%,90% --freq 22.235GHz,183.31GHz");
    assert_eq!(many.len(), 2 * 2 * 3 * 2);
    assert_eq!(many[1]["freq_ghz"], "183.31");
    // The defaults are mean air at sea level without cloud and rain.
    let plain = &rows(&s, "scene attenuation --freq 94GHz")[0];
    assert_eq!((plain["vapour_g_m3"].as_str(), plain["pressure_hpa"].as_str(), plain["rain_mm_h"].as_str()), ("7.5", "1013.25", "0"));
    assert!((0.3..0.5).contains(&number(plain, "attenuation_db_per_km")));
}

#[test]
fn gas_and_rain_meet_their_references() {
    let (gas, rain) = (reference("mpm_specific_attenuation_arts.csv"), reference("itu_p838_3_rain.csv"));
    let s = Scratch::new();
    let freqs = "10GHz,22.235GHz,60GHz,94GHz,183.31GHz,340GHz,1000GHz";
    for model in ["mpm89", "mpm93"] {
        let ours = rows(
            &s,
            &format!(
                "scene attenuation --model {model} --pressure 1013.25hPa --temperature 300.15K --vapour-pressure 30hPa --freq {freqs}"
            ),
        );
        let mut met = 0;
        for row in gas.iter().filter(|r| r["model"].eq_ignore_ascii_case(model) && r["e_hpa"] == "30") {
            let Some(mine) = ours.iter().find(|o| number(o, "freq_ghz") == number(row, "f_ghz")) else { continue };
            let ratio = number(mine, "attenuation_db_per_km") / number(row, "total_dbkm");
            assert!((ratio - 1.0).abs() < 1e-3, "{row:?} {ratio}");
            met += 1;
        }
        assert!(met >= 4, "{met}");
    }
    let ours = rows(&s, "scene attenuation --rain 5mm/h --elevation 30deg --tilt 45deg --freq 10GHz,35GHz,94GHz");
    let mut met = 0;
    for row in rain.iter().filter(|r| r["rain_mm_h"] == "5") {
        let Some(mine) = ours.iter().find(|o| number(o, "freq_ghz") == number(row, "f_ghz")) else { continue };
        for (a, b) in [
            ("rain_k_h", "k_h"),
            ("rain_alpha_v", "alpha_v"),
            ("rain_v_db_per_km", "gamma_v_dbkm"),
            ("rain_db_per_km", "gamma_el_tilt_dbkm"),
        ] {
            assert!((number(mine, a) / number(row, b) - 1.0).abs() < 1e-5, "{a} {row:?}");
        }
        met += 1;
    }
    assert!(met >= 2, "{met}");
}

#[test]
fn skies_meet_their_references() {
    let (clear, cloudy) = (reference("sky_tb_clear.csv"), reference("sky_tb_cloud_fog_rain.csv"));
    let s = Scratch::new();
    let ours = rows(&s, "scene sky --atmosphere ussa,trl --model mpm89,mpm93 --freq 94GHz,35GHz --zenith 0deg,60deg,85deg");
    assert_eq!(ours.len(), 2 * 2 * 2 * 3);
    for mine in &ours {
        let wanted = clear.iter().find(|r| {
            r["atmosphere"] == mine["atmosphere"]
                && r["gas_model"].eq_ignore_ascii_case(&mine["model"])
                && number(r, "f_ghz") == number(mine, "freq_ghz")
                && number(r, "zenith_deg") == number(mine, "zenith_deg")
        });
        let wanted = wanted.unwrap_or_else(|| panic!("{mine:?}"));
        for column in ["tb_planck_k", "tb_rj_k"] {
            assert!((number(mine, column) - number(wanted, column)).abs() < 0.15, "{mine:?} {wanted:?}");
        }
    }
    let layers = "--layer rain:0km-4km:25mm/h --layer cloud:1km-4km:0.3g/m3";
    let mine = &rows(&s, &format!("scene sky --atmosphere trl --freq 35GHz --zenith 30deg {layers}"))[0];
    let wanted = cloudy.iter().find(|r| r["case"].starts_with("rain_25") && number(r, "f_ghz") == 35.0 && number(r, "zenith_deg") == 30.0);
    assert!((number(mine, "tb_planck_k") - number(wanted.unwrap(), "tb_planck_k")).abs() < 0.3);
}

#[test]
fn a_profile_of_ones_own_scaled_to_the_weather() {
    let s = Scratch::new();
    s.write("mine.csv", "z_km,p_hpa,t_k,rh_liquid_pct\n0,1010,285,60\n10,270,225,20\n30,12,225,0\n");
    let tb = |more: &str| number(&rows(&s, &format!("scene sky --atmosphere mine.csv --freq 94GHz {more}"))[0], "tb_planck_k");
    let plain = tb("");
    assert!(tb("--surface-humidity 90%") > plain + 5.0);
    assert!(tb("--humidity 10%") < plain - 5.0);
    assert!((tb("--surface-temperature 285K --surface-pressure 1010hPa") - plain).abs() < 1e-6);
    assert!(tb("--height 5km") < plain);
    let grazing = |geometry| tb(&format!("--zenith 89deg --geometry {geometry}"));
    assert!(grazing("spherical") < grazing("plane"));
}

#[test]
fn an_isothermal_world_shows_its_temperature() {
    let s = Scratch::new();
    s.write("iso.csv", "z_km,p_hpa,t_k,rh_liquid_pct\n0,1000,280,50\n10,300,280,50\n30,20,280,0\n");
    for geometry in ["plane", "spherical"] {
        for r in rows(
            &s,
            &format!(
                "scene sky --atmosphere iso.csv --background 280K --freq 10GHz,60GHz,340GHz --zenith 0deg,85deg,89.5deg --geometry {geometry}"
            ),
        ) {
            assert!((number(&r, "tb_planck_k") - 280.0).abs() < 1e-6, "{r:?}");
        }
    }
    for rough in ["smooth", "qh:0.2,0.5,1", "go:0.1,0.2", "go:0.2,0.2,second-bounce"] {
        let line = format!(
            "scene emissivity --material sea-water --temperature 280K --sky 280K --freq 37GHz --angle 0deg,53deg,85deg --rough {rough}"
        );
        for r in rows(&s, &line) {
            for pol in ["h", "v"] {
                assert!((number(&r, &format!("brightness_{pol}_k")) - 280.0).abs() < 1e-6, "{r:?}");
                assert!((number(&r, &format!("emissivity_{pol}")) + number(&r, &format!("reflectivity_{pol}")) - 1.0).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn a_path_of_constant_temperature_is_close_to_its_integral() {
    let s = Scratch::new();
    let line = "scene path --atmosphere trl --freq 35GHz,94GHz --observer 0.2km,1km --zenith 0deg,60deg";
    let (full, fast) = (rows(&s, line), rows(&s, &format!("{line} --method constant")));
    assert_eq!(full.len(), 8);
    for (a, b) in full.iter().zip(&fast) {
        assert!((number(a, "tau_np") / number(b, "tau_np") - 1.0).abs() < 1e-3);
        let bar = if number(a, "observer_km") < 0.5 { 0.005 } else { 0.5 };
        assert!((number(a, "emission_rj_k") - number(b, "emission_rj_k")).abs() < bar, "{a:?} {b:?}");
    }
    let level = &rows(&s, "scene path --freq 94GHz --observer 1km --target 1km --length 10km")[0];
    assert_eq!((level["length_km"].as_str(), level["zenith_deg"].as_str()), ("10", "90"));
}

#[test]
fn delays_have_their_parts_and_follow_the_zenith_angle() {
    let s = Scratch::new();
    let r = rows(&s, "scene delay --atmosphere ussa,mls --freq 0Hz,94GHz --zenith 0deg,60deg --layer cloud:1km-2km:0.2g/m3");
    assert_eq!(r.len(), 8);
    for row in &r {
        let parts: f64 = ["dry_m", "wet_m", "liquid_m", "bending_m"].map(|p| number(row, p)).iter().sum();
        assert!((number(row, "excess_m") - parts).abs() < 1e-12 && number(row, "liquid_m") > 2e-4);
        assert!((number(row, "delay_ns") * 0.299_792_458 / parts - 1.0).abs() < 1e-12);
    }
    assert!((2.25..2.35).contains(&number(&r[0], "dry_m")) && (number(&r[1], "excess_m") / number(&r[0], "excess_m") - 2.0).abs() < 1e-9);
    assert_eq!((number(&r[0], "phase_rad"), number(&r[0], "dispersive_m"), number(&r[0], "freq_ghz")), (0.0, 0.0, 0.0));
    let bent = &rows(&s, "scene delay --freq 94GHz --zenith 85deg --geometry spherical")[0];
    assert!(number(bent, "bending_m") > 0.1 && number(bent, "refraction_deg") > 0.1);
    s.fails("scene delay --freq 94GHz --zenith 90deg", 1, &["zenith angle of a delay 90"]);
}

#[test]
fn permittivities_take_lists_and_units() {
    let s = Scratch::new();
    let r = rows(&s, "scene permittivity --material sea-water --freq 10GHz,37GHz --temperature 280K,290K --salinity 0,35");
    assert_eq!(r.len(), 8);
    assert_eq!((r[0]["model"].as_str(), r[7]["salinity_psu"].as_str()), ("stogryn95", "35"));
    let by_percent = rows(&s, "scene permittivity --model dobson85 --texture loam --moisture 30% --density 1.3g/cm3 --freq 10GHz");
    let by_share = rows(&s, "scene permittivity --material soil --sand 0.42 --clay 0.085 --moisture 0.3 --density 1300kg/m3 --freq 10GHz");
    assert_eq!(by_percent, by_share);
    let json = s.json("scene permittivity --material brick --freq 10GHz");
    assert_eq!(json["rows"][0]["material"], "brick");
    assert!(json["rows"][0]["eps_real"].as_f64().unwrap() > 3.0 && json["rows"][0]["salinity_psu"].is_null());
    let far = rows(&s, "scene permittivity --model klein-swift77 --freq 37GHz --extrapolate");
    assert_eq!(far[0]["extended"], "true");
}

#[test]
fn stack_files_permittivities_and_materials_make_the_same_surface() {
    let s = Scratch::new();
    s.write("stack.toml", "coherent = true\n[[layer]]\neps = [8.2, 13.9]\n");
    let line = "--freq 94GHz --angle 0deg,30deg,85deg";
    let of = |surface: &str| rows(&s, &format!("scene emissivity {surface} {line}"));
    let (file, eps) = (of("--stack stack.toml"), of("--eps 8.2,13.9"));
    for (a, b) in file.iter().zip(&eps) {
        assert_eq!(number(a, "reflectivity_h"), number(b, "reflectivity_h"));
    }
    let fresnel = reference("fresnel_halfspace_tmm.csv");
    for (mine, angle) in eps.iter().zip([0.0, 30.0, 85.0]) {
        let want = fresnel.iter().find(|r| r["name"] == "water_94" && number(r, "theta_deg") == angle).unwrap();
        assert!((number(mine, "reflectivity_h") - number(want, "r_h_power")).abs() < 1e-8, "{mine:?}");
        assert!((number(mine, "reflectivity_v") - number(want, "r_v_power")).abs() < 1e-8, "{mine:?}");
    }
    let coated = "[[layer]]\nmaterial = \"paint\"\nthickness_m = 2e-4\n[[layer]]\nmaterial = \"steel\"\n";
    s.write("coated.toml", format!("coherent = false\n{coated}"));
    assert!(of("--stack coated.toml").iter().all(|r| number(r, "emissivity_v") < 0.5));
}

#[test]
fn bistatic_coefficients_are_reciprocal() {
    let s = Scratch::new();
    let line = "scene bistatic --material sea-water --slopes 0.2,0.2 --freq 37GHz --azimuth 25deg";
    let one = &rows(&s, &format!("{line} --incidence 30deg --scattered 50deg"))[0];
    let other = &rows(&s, &format!("{line} --incidence 50deg --scattered 30deg"))[0];
    // gamma(s, i) cos i = gamma(i, s) cos s.
    let (a, b) = (number(one, "gamma_hv") * 30f64.to_radians().cos(), number(other, "gamma_vh") * 50f64.to_radians().cos());
    assert!((a / b - 1.0).abs() < 1e-6, "{a} {b}");
}

#[test]
fn list_names_everything_that_commands_take() {
    let s = Scratch::new();
    let all = s.json("scene list");
    for (kind, name) in [
        ("atmospheres", "stw"),
        ("gases", "mpm93"),
        ("rain", "olsen78"),
        ("layers", "fog"),
        ("geometries", "spherical"),
        ("materials", "sea-water"),
        ("models", "mironov09"),
        ("textures", "loam"),
        ("surfaces", "go"),
    ] {
        assert!(all[kind].as_array().unwrap().iter().any(|e| e["name"] == name), "{kind} {name}");
    }
    assert_eq!(all["atmospheres"].as_array().unwrap().len(), 10);
    let only = s.ok("scene list materials").out;
    assert!(only.contains("concrete") && !only.contains("mpm89"));
    // Every material gives a number with its defaults.
    for m in all["materials"].as_array().unwrap() {
        s.ok(&format!("scene permittivity --material {} --freq 60GHz --extrapolate", m["name"].as_str().unwrap()));
    }
}

#[test]
fn tables_can_be_drawn() {
    let s = Scratch::new();
    s.ok("scene attenuation --model mpm89,mpm93 --freq 10GHz,20GHz,60GHz,94GHz,183GHz --plot a.png");
    s.ok("scene emissivity --material sea-water --freq 37GHz --angle 0deg,20deg,40deg,60deg,80deg --plot e.png");
    assert_eq!(s.names(), ["a.png", "e.png"]);
    assert!(std::fs::read(s.path("a.png")).unwrap().starts_with(b"\x89PNG"));
}

const TALL: &str = r#"
name = "tall"
frame = "enu"
[site]
latitude_deg = 34.0
longitude_deg = -107.6
altitude_m = 0.0
[[antenna]]
name = "A"
position_m = [0.0, 0.0, 0.0]
[[antenna]]
name = "B"
position_m = [40.0, 0.0, 10.0]
[[antenna]]
name = "C"
position_m = [0.0, 40.0, 0.0]
"#;

// Of three antennas one stands 10 m above the others. Near the zenith the phase of its gain is that of the difference of two delays.
#[test]
fn corrupted_paths_are_those_of_scene_delay() {
    let s = Scratch::new();
    s.write("tall.toml", TALL);
    s.write("point.csv", "ra_deg,dec_deg,flux_jy\n100.0,34.0,1\n");
    let track = "--layout tall.toml --scene point.csv --phase-center 100deg,34deg --hour-angle 0h,0.005h";
    s.ok(&format!("simulate {track} --freq 1.4GHz --bandwidth 1MHz -o v.uvh5"));
    for atmosphere in ["ussa", "trl"] {
        let excess = |height: &str| {
            number(&rows(&s, &format!("scene delay --atmosphere {atmosphere} --freq 1.4GHz --height {height}"))[0], "excess_m")
        };
        let phase = std::f64::consts::TAU * 1.4e9 * (excess("0m") - excess("10m")) / 299_792_458.0;
        let put = s.json(&format!("corrupt v.uvh5 -o {atmosphere}.uvh5 --atmosphere {atmosphere}"));
        let rms = put["rms_phase_rad"].as_f64().unwrap() * 3.0_f64.sqrt();
        // The source passes within 0.2 degrees of the zenith. The vertical of antennas B and C leans by 6e-6 rad.
        assert!((rms / phase - 1.0).abs() < 2e-3, "{atmosphere}: {rms} {phase}");
        assert_eq!(put["errors"][0]["air"], atmosphere);
    }
    // The same in one step.
    let put = s.json(&format!("simulate {track} --freq 1.4GHz --bandwidth 1MHz --atmosphere ussa --gains g.calh5 -o a.uvh5"));
    assert_eq!(put["gains"], "g.calh5");
    let apart = s.json("compare g.calh5 ussa.calh5");
    assert!(apart["max_abs_phase_rad"].as_f64().unwrap() < 1e-6, "{apart}");
    s.ok("corrupt v.uvh5 -o w.uvh5 --atmosphere trl --turbulence 0.02 --wind 5m/s --wvr-rms 0.1mm --wvr-averaging 2s");
    s.fails("corrupt v.uvh5 -o x.uvh5 --atmosphere venus", 1, &["venus", "built-in atmospheres are ussa"]);
    s.fails("corrupt v.uvh5 -o x.uvh5 --wvr-rms 1mm", 1, &["atmosphere is not, which turns this error on"]);
    s.fails("corrupt v.uvh5 -o x.uvh5 --atmosphere ussa --turbulence -0.1", 1, &["turbulence", "-0.1"]);
    s.fails("corrupt v.uvh5 -o x.uvh5 --atmosphere ussa --wind 5m/s", 1, &["turbulence"]);
    s.write("l.csv", "l_rad,m_rad,flux_jy\n0,0,1\n");
    s.fails("simulate --layout mm-y --scene l.csv --freq 94GHz --bandwidth 1GHz --atmosphere ussa -o x.uvh5", 1, &["boresight"]);
    s.write("low.csv", "z_km,p_hpa,t_k,e_hpa\n1,900,280,5\n20,50,210,0.001\n");
    s.fails("corrupt v.uvh5 -o x.uvh5 --atmosphere low.csv", 1, &["low.csv", "observer height 0 km"]);
}

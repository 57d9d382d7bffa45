//! Each impossible physical input gives one clear message.

use crate::program::Scratch;

#[test]
fn directions_at_or_below_the_horizon_are_refused() {
    let s = Scratch::new();
    for zenith in ["90deg", "95deg", "-5deg"] {
        s.fails(&format!("scene sky --freq 94GHz --zenith {zenith}"), 1, &["zenith angle", zenith.trim_end_matches("deg"), "below 90 deg"]);
        s.fails(&format!("scene emissivity --material soil --freq 10GHz --angle {zenith}"), 1, &["angle is", "below 90"]);
    }
    s.fails("scene sky --freq 94GHz --zenith 90deg --geometry spherical", 1, &["zenith angle 90"]);
    s.fails("scene path --freq 94GHz --observer 5km --zenith 90deg", 1, &["zenith angle 90", "path length"]);
    s.fails("scene path --freq 94GHz --observer 5km --length 1km", 1, &["shorter than the height difference"]);
}

#[test]
fn impossible_air_is_named() {
    let s = Scratch::new();
    for (option, words) in [
        ("--vapour -1g/m3", ["vapour density -1", "0 to 500"]),
        ("--humidity -5%", ["relative humidity -5", "0 to 100"]),
        ("--humidity 110%", ["relative humidity 110", "0 to 100"]),
        ("--vapour-pressure 1100hPa", ["vapour pressure 1100", "total pressure"]),
        ("--temperature 0K", ["temperature 0 K", "150 to 350"]),
        ("--pressure -5hPa", ["pressure -5 hPa", "3 to 1200"]),
        ("--rain -5mm/h", ["rain rate -5", "0 to 300"]),
        ("--rain 30mm/h --rain-model olsen78", ["rain rate 30", "0 to 25"]),
        ("--cloud -0.1g/m3", ["liquid water density -0.1", "0 to 10"]),
        ("--ice 0.1g/m3", ["temperature of ice crystals", "273.16"]),
        ("--model mpm99", ["mpm99", "mpm89, mpm93"]),
    ] {
        s.fails(&format!("scene attenuation --freq 94GHz {option}"), 1, &words);
    }
    s.fails("scene attenuation --freq 2THz", 1, &["frequency 2000 GHz", "1 to 1000"]);
    s.fails("scene sky --freq 94GHz --humidity -5%", 1, &["relative humidity -5"]);
    s.fails("scene sky --freq 94GHz --temperature 0K", 1, &["temperature 0 K"]);
}

#[test]
fn bare_numbers_name_the_units() {
    let s = Scratch::new();
    for (line, units) in [
        ("attenuation --freq 94", "GHz"),
        ("attenuation --freq 94GHz --rain 5", "mm/h"),
        ("attenuation --freq 94GHz --pressure 1013", "hPa"),
        ("attenuation --freq 94GHz --vapour 7.5", "g/m3"),
        ("sky --freq 94GHz --zenith 30", "deg"),
        ("permittivity --material dry-snow --freq 10GHz --density 300", "kg/m3"),
        ("permittivity --material dry-snow --freq 10GHz --temperature 260", "K"),
    ] {
        s.fails(&format!("scene {line}"), 2, &["no unit", units]);
    }
}

#[test]
fn layers_that_overlap_or_stand_on_their_heads() {
    let s = Scratch::new();
    s.fails(
        "scene sky --freq 94GHz --layer cloud:0.5km-1.5km:0.2g/m3 --layer fog:1km-2km:0.1g/m3",
        1,
        &["overlap", "cloud:0.5km", "fog:1km"],
    );
    s.fails("scene sky --freq 94GHz --layer cloud:2km-1km:0.1g/m3", 2, &["base < top"]);
    s.fails("scene sky --freq 94GHz --layer soup:0km-1km:0.1g/m3", 2, &["soup", "cloud, fog, haze, ice, rain"]);
    s.fails("scene sky --freq 94GHz --layer rain:0km-1km:5g/m3", 2, &["mm/h"]);
}

#[test]
fn profiles_that_are_none() {
    let s = Scratch::new();
    s.write("order.csv", "z_km,p_hpa,t_k,e_hpa\n0,1013,288,8\n2,800,275,4\n1,900,280,5\n");
    s.fails("scene sky --freq 94GHz --atmosphere order.csv", 1, &["order.csv", "level 3", "follows"]);
    s.write("wet.csv", "z_km,p_hpa,t_k,rh_liquid_pct\n0,1013,288,-8\n2,800,275,4\n");
    s.fails("scene sky --freq 94GHz --atmosphere wet.csv", 1, &["wet.csv", "line 2", "relative humidity -8"]);
    s.write("short.csv", "z_km,p_hpa,t_k\n0,1013,288\n");
    s.fails("scene sky --freq 94GHz --atmosphere short.csv", 1, &["short.csv", "humidity"]);
    s.write("bytes.csv", [0xff, 0xfe, 0x00]);
    s.fails("scene sky --freq 94GHz --atmosphere bytes.csv", 1, &["bytes.csv"]);
    s.fails("scene sky --freq 94GHz --atmosphere mars", 1, &["mars", "ussa, trl"]);
    s.fails("scene sky --freq 94GHz --atmosphere .", 1, &["no profile"]);
}

#[test]
fn materials_that_cannot_be() {
    let s = Scratch::new();
    for (line, words) in [
        ("--material cheese", ["cheese", "sea-water"]),
        ("--material sea-water --model debye29", ["debye29", "stogryn95"]),
        ("--material sea-water --model dobson85", ["dobson85", "stogryn95"]),
        ("--material sea-water --moisture 0.2", ["no parameter", "salinity"]),
        ("--material sea-water --temperature 0K", ["0 K", "above 0 K"]),
        ("--material sea-water --salinity -3", ["salinity", "-3"]),
        ("--material soil --moisture 0.9", ["porosity 0.5120", "less moisture"]),
        ("--material soil --texture gravel", ["gravel", "sandy_loam"]),
        ("--model klein-swift77 --salinity 30", ["0.1-10 GHz", "--extrapolate"]),
    ] {
        s.fails(&format!("scene permittivity {line} --freq 37GHz"), 1, &words);
    }
    s.fails("scene permittivity --freq 37GHz", 2, &["--material", "--model"]);
}

#[test]
fn surfaces_that_cannot_be() {
    let s = Scratch::new();
    s.fails("scene emissivity --freq 37GHz", 2, &["--material, --stack and --eps"]);
    s.fails("scene emissivity --eps 3,-1 --freq 37GHz", 1, &["loss -1 is negative"]);
    s.fails("scene emissivity --eps 3 --freq 37GHz", 2, &["two numbers"]);
    s.fails("scene emissivity --material soil --freq 10GHz --rough qh:0.1", 2, &["H is missing"]);
    s.fails("scene emissivity --material soil --freq 10GHz --rough go:0,0", 2, &["slope"]);
    s.fails("scene emissivity --material soil --freq 10GHz --sky -5K", 1, &["-5 K"]);
    s.fails("scene emissivity --stack none.toml --freq 37GHz", 1, &["none.toml"]);
    s.write("bad.toml", "coherent = true\n[[layer]]\nmaterial = \"paint\"\nthickness_m = -1\n[[layer]]\nmaterial = \"steel\"\n");
    s.fails("scene emissivity --stack bad.toml --freq 37GHz", 1, &["bad.toml", "layer 1", "-1"]);
    s.fails("scene emissivity --stack bad.toml --model paint-constant --freq 37GHz", 2, &["--stack"]);
    s.fails("scene bistatic --eps 3,1 --slopes 0.1 --incidence 10deg --scattered 10deg --freq 37GHz", 2, &["two numbers"]);
}

#[test]
fn tables_out_of_proportion_and_pictures_without_a_place() {
    let s = Scratch::new();
    let many = vec!["10GHz"; 1100].join(",");
    let angles = vec!["1deg"; 1100].join(",");
    s.fails(&format!("scene sky --freq {many} --zenith {angles}"), 2, &["1000000 rows"]);
    s.fails("scene sky --freq 94GHz --plot nowhere/x.png", 1, &["nowhere", "does not exist"]);
    s.write("x.png", "mine");
    s.fails("scene sky --freq 94GHz --plot x.png", 1, &["x.png", "--overwrite"]);
    assert_eq!(std::fs::read(s.path("x.png")).unwrap(), b"mine");
}

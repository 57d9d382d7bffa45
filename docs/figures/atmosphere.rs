//! Pictures of absorption, sky and paths.

use crate::{Drawn, Figure, Points, linear, logarithmic, oracle, pick};
use cittert_phenomenology::atmosphere::{
    ATMOSPHERES, AirState, Atmosphere, Geometry, Layer, Parcel, PathEnds, PathExtent, PathTable, SkyRow, attenuation,
    crystal_attenuation_liebe93, droplet_attenuation_liebe93, gas_model, rain_attenuation, rain_model, reference_profile,
};

const FREQ: &str = "frequency [GHz]";
const DB: &str = "attenuation [dB/km]";

pub(crate) fn draw() -> Drawn {
    gas("mpm89", "MPM89")?;
    gas("mpm93", "MPM93")?;
    hydrosols()?;
    rain()?;
    profiles()?;
    clear_sky()?;
    refracted_sky()?;
    layers()?;
    paths()
}

fn gas(name: &str, label: &str) -> Drawn {
    let rows = oracle("mpm_specific_attenuation_arts.csv")?;
    let mut figure = Figure::new(&format!("{label} (lines) and the same model in ARTS (dots)"), FREQ, DB).log(true, true);
    for (p, t, e) in [(1013.25, 300.15, 30.0), (1013.25, 288.15, 0.01), (150.0, 220.0, 0.003)] {
        let texts = [p, t, e].map(|x: f64| x.to_string());
        let wanted = [("model", label), ("p_total_hpa", texts[0].as_str()), ("t_k", texts[1].as_str()), ("e_hpa", texts[2].as_str())];
        let dots = pick(&rows, &wanted, "f_ghz", "total_dbkm");
        // The dots lie at the centres of spectral lines, so the curve needs points there too.
        let mut freqs: Vec<f64> = logarithmic(1.0, 1000.0, 1200);
        freqs.extend(dots.iter().map(|d| d.0));
        freqs.sort_by(f64::total_cmp);
        let parcel = Parcel::clear(AirState::new(p, t, e)?);
        let ours = attenuation(gas_model(name)?.as_ref(), rain_model("p838")?.as_ref(), &parcel, &freqs)?;
        figure.ours(&format!("{p} hPa, {t} K, vapour {e} hPa"), ours.iter().map(|r| (r.freq_ghz, r.attenuation_db_per_km)).collect());
        figure.theirs(dots);
    }
    figure.save(&format!("gas-{name}"))
}

fn hydrosols() -> Drawn {
    let rows = oracle("mpm93_hydrosol_arts.csv")?;
    let mut figure = Figure::new("Droplets and ice, 0.1 g/m3 (lines), and ARTS (dots)", FREQ, DB).log(true, true);
    let freqs = logarithmic(1.0, 1000.0, 300);
    for (kind, name, t) in [
        ("liquid_mpm93_double_debye", "droplets", 303.15),
        ("liquid_mpm93_double_debye", "droplets", 253.15),
        ("ice_mpm93", "ice", 273.15),
        ("ice_mpm93", "ice", 253.15),
    ] {
        let model = if name == "ice" { crystal_attenuation_liebe93 } else { droplet_attenuation_liebe93 };
        let ours = freqs.iter().map(|f| Ok((*f, model(*f, t, 0.1)?))).collect::<Drawn<Points>>()?;
        figure.ours(&format!("{name}, {t} K"), ours);
        figure.theirs(pick(&rows, &[("kind", kind), ("t_k", &t.to_string())], "f_ghz", "gamma_dbkm"));
    }
    figure.save("droplets-ice")
}

fn rain() -> Drawn {
    let freqs = logarithmic(1.0, 1000.0, 300);
    let itu = oracle("itu_p838_3_rain.csv")?;
    let mut figure = Figure::new("Rain, P.838-3 (lines) and itur (dots)", FREQ, DB).log(true, true);
    let model = rain_model("p838")?;
    for (rate, text) in [(1.0, "1"), (5.0, "5"), (25.0, "25"), (100.0, "100")] {
        let ours = freqs.iter().map(|f| Ok((*f, rain_attenuation(model.as_ref(), *f, rate)?.horizontal_db_per_km)));
        figure.ours(&format!("{text} mm/h, horizontal"), ours.collect::<Drawn<Points>>()?);
        figure.theirs(pick(&itu, &[("rain_mm_h", text)], "f_ghz", "gamma_h_dbkm"));
    }
    figure.save("rain-p838")?;
    let arts = oracle("mpm93_hydrosol_arts.csv")?;
    let mut figure = Figure::new("Rain, Olsen 1978 (lines) and ARTS (dots)", FREQ, DB).log(true, true);
    let model = rain_model("olsen78")?;
    for (rate, text) in [(1.0, "1"), (5.0, "5"), (25.0, "25")] {
        let ours = freqs.iter().map(|f| Ok((*f, rain_attenuation(model.as_ref(), *f, rate)?.mean_db_per_km())));
        figure.ours(&format!("{text} mm/h"), ours.collect::<Drawn<Points>>()?);
        let wanted = [("kind", "rain_olsen1978_arts"), ("w_gm3_or_rain_mmh", text)];
        figure.theirs(pick(&arts, &wanted, "f_ghz", "gamma_dbkm"));
    }
    figure.save("rain-olsen78")
}

fn profiles() -> Drawn {
    for (part, title) in [(0, "tropical to sub-arctic (AFGL)"), (1, "sub-tropical and arctic (SMARTS)")] {
        let mut figure = Figure::new(&format!("Reference atmospheres: {title}"), "temperature [K]", "height [km]");
        for entry in ATMOSPHERES.iter().filter(|a| ["sts", "stw", "as", "aw"].contains(&a.name) == (part == 1)) {
            let profile = reference_profile(entry.name)?;
            let levels = profile.levels().iter().filter(|l| l.z_km <= 30.0);
            figure.ours(entry.name, levels.map(|l| (l.air.temperature_k(), l.z_km)).collect());
        }
        figure.save(&format!("atmosphere-profiles-{part}"))?;
    }
    Ok(())
}

fn sky_at(air: &Atmosphere, freqs: &[f64], zenith: f64, geometry: Geometry) -> Drawn<Vec<SkyRow>> {
    Ok(air.sky(freqs, &[zenith], geometry)?)
}

fn clear_sky() -> Drawn {
    let rows = oracle("sky_tb_clear.csv")?;
    let freqs = logarithmic(8.0, 360.0, 500);
    let mut figure = Figure::new("Clear sky (lines) and pyrtlib with the same gas model (dots)", FREQ, "brightness [K]").log(true, false);
    for (atmosphere, model, label, zenith) in [
        ("ussa", "mpm89", "MPM89", 0.0),
        ("ussa", "mpm89", "MPM89", 85.0),
        ("saw", "mpm89", "MPM89", 0.0),
        ("trl", "mpm89", "MPM89", 0.0),
        ("trl", "mpm93", "MPM93", 0.0),
    ] {
        let air = Atmosphere::reference(atmosphere, model)?;
        let ours = sky_at(&air, &freqs, zenith, Geometry::Plane)?;
        figure.ours(&format!("{atmosphere}, {label}, {zenith} deg"), ours.iter().map(|r| (r.freq_ghz, r.tb_planck_k)).collect());
        let wanted = [("atmosphere", atmosphere), ("gas_model", label), ("zenith_deg", &zenith.to_string())];
        figure.theirs(pick(&rows, &wanted, "f_ghz", "tb_planck_k"));
    }
    figure.save("sky-clear")
}

fn refracted_sky() -> Drawn {
    let rows = oracle("sky_tb_refracted_spherical.csv")?;
    let zeniths = linear(55.0, 89.9, 250);
    let title = "Spherical air with refraction (lines) and pyrtlib (dots), U.S. Standard";
    let mut figure = Figure::new(title, "zenith angle [deg]", "brightness [K]");
    let air = Atmosphere::reference("ussa", "mpm89")?;
    for freq in [10.0, 35.0, 94.0, 183.0] {
        let ours = air.sky(&[freq], &zeniths, Geometry::Spherical)?;
        figure.ours(&format!("{freq} GHz"), ours.iter().map(|r| (r.zenith_deg, r.tb_planck_k)).collect());
        let wanted = [("atmosphere", "ussa"), ("f_ghz", &freq.to_string())];
        figure.theirs(pick(&rows, &wanted, "zenith_at_surface_deg", "tb_planck_k"));
    }
    figure.save("sky-refracted")
}

fn layers() -> Drawn {
    let rows = oracle("sky_tb_cloud_fog_rain.csv")?;
    let freqs = logarithmic(8.0, 360.0, 300);
    let mut figure = Figure::new("Zenith sky with layers (lines) and pyrtlib (dots)", FREQ, "brightness [K]").log(true, false);
    for (atmosphere, case, texts) in [
        ("ussa", "fog_0_0.2km_0.2gm3", &["fog:0km-0.2km:0.2g/m3"][..]),
        ("ussa", "stratus_0.5_1.0km_0.3gm3", &["cloud:0.5km-1km:0.3g/m3"]),
        ("mls", "cumulus_1.0_3.0km_0.5gm3", &["cloud:1km-3km:0.5g/m3"]),
        ("mlw", "haze_0_1km_0.01gm3", &["haze:0km-1km:0.01g/m3"]),
        ("mls", "rain_5mmh_0_2km", &["rain:0km-2km:5mm/h"]),
        ("trl", "rain_25mmh_0_4km_cloud_1_4km_0.3", &["rain:0km-4km:25mm/h", "cloud:1km-4km:0.3g/m3"]),
    ] {
        let layers = texts.iter().map(|t| t.parse::<Layer>()).collect::<Result<Vec<_>, _>>()?;
        let air = Atmosphere::reference(atmosphere, "mpm89")?.with_layers(layers)?;
        let ours = sky_at(&air, &freqs, 0.0, Geometry::Plane)?;
        figure.ours(&format!("{atmosphere}, {}", texts.join(", ")), ours.iter().map(|r| (r.freq_ghz, r.tb_planck_k)).collect());
        let wanted = [("atmosphere", atmosphere), ("case", case), ("zenith_deg", "0")];
        figure.theirs(pick(&rows, &wanted, "f_ghz", "tb_planck_k"));
    }
    figure.save("sky-layers")
}

fn paths() -> Drawn {
    let rows = oracle("upwelling_path.csv")?;
    let heights = logarithmic(0.05, 5.0, 80);
    let air = Atmosphere::reference("ussa", "mpm89")?;
    let label = "height of the observer [km]";
    let title = "Emission of the air below, 60 deg: integral (lines) and pyrtlib (dots)";
    let mut integral = Figure::new(title, label, "emission, Rayleigh-Jeans [K]").log(true, true);
    let title = "Error of the constant-temperature path at 60 deg: integral (lines), pyrtlib (dots)";
    let mut constant = Figure::new(title, label, "error [K]").log(true, true);
    for freq in [10.0, 35.0, 94.0, 183.0] {
        let table = PathTable::new(&air, &[freq])?;
        let ends = |h: f64| PathEnds::new(h, 0.0, PathExtent::ZenithDeg(60.0));
        let full = |h: f64| -> Drawn<f64> { Ok(air.path(&[freq], &ends(h)?)?.first().map_or(f64::NAN, |p| p.emission_rj_k())) };
        let fast = |h: f64| -> Drawn<f64> { Ok(table.radiation(0, &ends(h)?)?.emission_rj_k()) };
        let name = format!("{freq} GHz");
        let wanted = [("atmosphere", "ussa"), ("zenith_deg", "60"), ("f_ghz", &freq.to_string())];
        let theirs = pick(&rows, &wanted, "height_km", "tup_rj_k");
        integral.ours(&name, heights.iter().map(|h| Ok((*h, full(*h)?))).collect::<Drawn<Points>>()?);
        integral.theirs(theirs.clone());
        let errors = heights.iter().map(|h| Ok((*h, (fast(*h)? - full(*h)?).abs()))).collect::<Drawn<Points>>()?;
        constant.ours(&name, errors.into_iter().filter(|e| e.1 > 1e-5).collect());
        // The reference has four decimals, so differences below 1 mK have no meaning.
        let errors = theirs.iter().map(|(h, t)| Ok((*h, (fast(*h)? - t).abs()))).collect::<Drawn<Points>>()?;
        constant.theirs(errors.into_iter().filter(|e| e.1 > 1e-3).collect());
    }
    integral.save("path-integral")?;
    constant.save("path-constant")
}

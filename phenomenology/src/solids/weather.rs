//! Clouds, fog banks, rain shafts and haze layers of a scene, from its tables `[[weather]]`.

use super::file::WeatherRow;
use crate::atmosphere::{Atmosphere, Hydrometeors, PhysicsError, RainModel, rain_model};
use crate::error::{Result, SceneError};
use crate::geometry::{At, NamedBody, RegionSource, Volumes};
use crate::space::Bounds;
use std::sync::Arc;

/// Distance between the heights at which the temperature of the water is stored, km. The absorption of droplets at 94 GHz changes by 2 %
/// for each kelvin, so within 0.1 km it is linear in height to 1e-4.
const LEVEL_KM: f64 = 0.1;
/// Frequency at which the phases of the water are checked when a scene is read, GHz. The ranges of temperature do not depend on it.
const CHECK_GHZ: f64 = 94.0;

/// A body of weather.
#[derive(Debug, Clone)]
pub struct WeatherSource {
    /// Name.
    pub name: String,
    /// Line of the file, 0 if there is none.
    pub line: usize,
    /// The water in it.
    pub water: Hydrometeors,
    /// Lowest and highest height in the air, m.
    pub heights_m: [f64; 2],
    /// Temperature of the water, which decides how it absorbs, at even steps from the lowest to the highest height, K.
    pub water_k: Vec<f64>,
    /// Temperature at which it emits, K; `None` for that of the air at each height.
    pub emits_k: Option<f64>,
}

/// All weather of a scene.
#[derive(Debug, Clone)]
pub struct Weather {
    /// Where it is. The number of a volume is its index in `bodies`.
    pub volumes: Volumes,
    /// What it holds. // \[volume\]
    pub bodies: Vec<WeatherSource>,
    /// The model of its rain.
    pub rain: Arc<dyn RainModel>,
}

impl Weather {
    /// The weather of the rows of a file, with their placed expressions. `None` if there are none.
    pub(super) fn new(rows: &[(RegionSource, WeatherRow)], bodies: &[NamedBody], air: Around<'_>, rain: &str) -> Result<Option<Self>> {
        if rows.is_empty() {
            return Ok(None);
        }
        let regions: Vec<RegionSource> = rows.iter().map(|r| r.0.clone()).collect();
        let volumes = Volumes::new(bodies, &regions)?;
        let rain = rain_model(rain)?;
        let bodies = rows
            .iter()
            .zip(volumes.bounds())
            .map(|((source, row), bounds)| {
                let RegionSource { name, line, .. } = source;
                source_of(source, row, bounds, air, rain.as_ref()).map_err(|e| match e {
                    Fault::Said(message) => SceneError::at(*line, format!("weather `{name}` {message}")),
                    Fault::Physics(cause) => SceneError::Weather { at: At(*line), name: name.clone(), source: Box::new(cause) },
                })
            })
            .collect::<Result<_>>()?;
        Ok(Some(Self { volumes, bodies, rain }))
    }

    /// Heights of the tops, m.
    pub(crate) fn tops_m(&self) -> impl Iterator<Item = f64> {
        self.bodies.iter().map(|b| b.heights_m[1])
    }

    /// Lets all water emit at one temperature in K. Its absorption stays as it is.
    pub(super) fn emit_at(&mut self, temperature_k: f64) {
        self.bodies.iter_mut().for_each(|b| b.emits_k = Some(temperature_k));
    }
}

/// The air around the weather.
#[derive(Debug, Clone, Copy)]
pub(super) struct Around<'a> {
    /// `None` in a vacuum.
    pub atmosphere: Option<&'a Atmosphere>,
    /// Height of the origin of the scene, km.
    pub altitude_km: f64,
}

/// What is wrong with a row.
enum Fault {
    Said(String),
    Physics(PhysicsError),
}

impl From<PhysicsError> for Fault {
    fn from(e: PhysicsError) -> Self {
        Self::Physics(e)
    }
}

fn source_of(
    source: &RegionSource,
    row: &WeatherRow,
    bounds: &Bounds,
    air: Around<'_>,
    rain: &dyn RainModel,
) -> Result<WeatherSource, Fault> {
    let water = Hydrometeors { liquid_g_m3: row.liquid_g_m3 + row.haze_g_m3, ice_g_m3: row.ice_g_m3, rain_mm_h: row.rain_mm_h };
    if water == Hydrometeors::default() {
        return Err(Fault::Said("holds nothing; give it liquid_g_m3, ice_g_m3, rain_mm_h or haze_g_m3".into()));
    }
    water.check(rain)?;
    if bounds.is_empty() {
        return Err(Fault::Said("fills no space; its bodies have nothing in common".into()));
    }
    let bottom_m = air.atmosphere.map_or(f64::NEG_INFINITY, |a| 1e3 * (a.profile().bottom_km() - air.altitude_km));
    // Below the profile there is its lowest air.
    let heights_m = [bounds.min.z, bounds.max.z].map(|z| z.max(bottom_m));
    let [low_km, high_km] = heights_m.map(|z| air.altitude_km + 1e-3 * z);
    if let Some(profile) = air.atmosphere.map(Atmosphere::profile).filter(|p| high_km > p.top_km()) {
        let top_m = 1e3 * (profile.top_km() - air.altitude_km);
        return Err(Fault::Said(format!("reaches a height of {} m, above the top of the air at {top_m} m; lower it", heights_m[1])));
    }
    let water_k = match (row.temperature_k, air.atmosphere) {
        (Some(t), _) => vec![t],
        (None, None) => return Err(Fault::Said("is in a vacuum, so it needs temperature_k".into())),
        (None, Some(atmosphere)) => {
            let profile = atmosphere.profile();
            let steps = ((high_km - low_km) / LEVEL_KM).ceil().max(1.0);
            (0..=steps as usize)
                .map(|k| {
                    let z_km = low_km + (high_km - low_km) * k as f64 / steps;
                    Ok(profile.air_at(z_km.clamp(profile.bottom_km(), profile.top_km()))?.temperature_k())
                })
                .collect::<Result<_, PhysicsError>>()?
        }
    };
    for t in &water_k {
        water.absorption_np_per_km(rain, CHECK_GHZ, *t)?;
    }
    Ok(WeatherSource { name: source.name.clone(), line: source.line, water, heights_m, water_k, emits_k: row.temperature_k })
}

#[cfg(test)]
mod tests {
    use crate::solids::SolidScene;
    use std::error::Error;

    const CLOUD: &str = r#"
kind = "solids"
name = "cloud"
[surface.soil]
layer = [{ material = "soil" }]
[ground]
surface = "soil"
[assembly.cloud]
body = [
  { name = "a", type = "ELL", data = [-50, 0, 0, 50, 0, 0, 140] },
  { name = "b", type = "SPH", data = [40, 0, 10, 60] },
]
weather = [{ name = "drops", is = "+a OR +b", liquid_g_m3 = 0.3 }]
[[instance]]
assembly = "cloud"
position_m = [0, 0, 800]
[[instance]]
assembly = "cloud"
position_m = [300, 0, 900]
scale = 2
[[body]]
name = "shaft"
type = "TRC"
data = [0, 0, -10, 0, 0, 760, 30, 45]
[[weather]]
name = "rain"
is = "+shaft"
rain_mm_h = 8
haze_g_m3 = 0.01
"#;

    fn fault(text: &str) -> String {
        let error = SolidScene::from_toml(text).err().unwrap_or_else(|| panic!("accepted:\n{text}"));
        let cause = error.source().map(|s| format!(": {s}")).unwrap_or_default();
        format!("{error}{cause}")
    }

    #[test]
    fn weather_is_placed_with_its_assembly_and_written_again() {
        let scene = SolidScene::from_toml(CLOUD).unwrap();
        let weather = scene.weather.as_ref().unwrap();
        let names: Vec<&str> = weather.bodies.iter().map(|b| b.name.as_str()).collect();
        assert_eq!(names, ["rain", "cloud_1.drops", "cloud_2.drops"]);
        assert!((weather.bodies[1].heights_m[1] - 870.0).abs() < 1e-9 && (weather.bodies[2].heights_m[1] - 1040.0).abs() < 1e-9);
        assert_eq!(weather.bodies[0].water.liquid_g_m3, 0.01);
        // Weather is no solid: it does not stop a ray.
        assert!(scene.geometry().bounds().is_empty());
        let again = SolidScene::from_toml(&scene.to_toml().unwrap()).unwrap();
        assert_eq!(again.weather.as_ref().unwrap().bodies[2].water_k, weather.bodies[2].water_k);
        let warm = scene.isothermal(280.0).unwrap();
        assert!(warm.weather.unwrap().bodies.iter().all(|b| b.emits_k == Some(280.0)));
    }

    #[test]
    fn a_body_may_reach_far_below_the_ground() {
        let deep = SolidScene::from_toml(&CLOUD.replace("[0, 0, -10, 0, 0, 760, 30, 45]", "[0, 0, -1e12, 0, 0, 1e12, 30, 45]")).unwrap();
        let rain = &deep.weather.as_ref().unwrap().bodies[0];
        assert_eq!((rain.heights_m, rain.water_k.len()), ([0.0, 0.0], 2));
        assert_eq!(rain.water_k[0], rain.water_k[1]);
    }

    #[test]
    fn every_fault_of_the_weather_names_its_line() {
        let change = |from: &str, to: &str| {
            assert!(CLOUD.contains(from), "{from}");
            fault(&CLOUD.replace(from, to))
        };
        for (from, to, part) in [
            ("is = \"+shaft\"", "is = \"+shift\"", "line 25: region `rain` names unknown body `shift`"),
            ("is = \"+shaft\"", "is = \"shaft\"", "line 25: weather `rain`: `shaft` in `shaft` needs a sign"),
            ("is = \"+shaft\"", "is = \"\"", "line 25: region `rain` names no body"),
            ("rain_mm_h = 8\nhaze_g_m3 = 0.01", "rain_mm_h = 0", "line 25: weather `rain` holds nothing; give it liquid_g_m3"),
            ("rain_mm_h = 8", "rain_mm_h = -8", "line 25: weather `rain`: rain rate -8 mm/h is outside"),
            ("rain_mm_h = 8", "rain_mm_h = nan", "line 25: weather `rain`: rain rate NaN mm/h is outside"),
            ("rain_mm_h = 8", "rain = 8", "line 28"),
            ("liquid_g_m3 = 0.3", "ice_g_m3 = 0.3", "line 13: weather `cloud_1.drops`: temperature of ice crystals 290.8"),
            ("liquid_g_m3 = 0.3", "liquid_g_m3 = 0.3, temperature_k = 200", "temperature of liquid droplets 200 K is outside"),
            ("[0, 0, 800]", "[0, 0, 30000]", "weather `cloud_1.drops` reaches a height of 30070 m, above the top of the air at 30000 m"),
        ] {
            let message = change(from, to);
            assert!(message.contains(part), "{message}\nwanted {part}");
        }
        let apart = change("is = \"+a OR +b\"", "is = \"+a +c\"");
        assert!(apart.contains("unknown body `cloud_1.c`"), "{apart}");
        let vacuum = fault(&CLOUD.replace("[ground]", "[atmosphere]\nvacuum = true\n[ground]"));
        assert!(vacuum.contains("weather `rain` is in a vacuum, so it needs temperature_k"), "{vacuum}");
    }
}

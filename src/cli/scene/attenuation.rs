//! `scene attenuation`: specific attenuation of air, cloud, ice and rain.

use super::table::{Picture, PlotArgs, Table};
use super::values::{check_rows, combinations, exact, ghz};
use crate::cli::context::Outcome;
use crate::cli::failure::{Failure, Result};
use crate::cli::options::NOTHING;
use cittert_arrays::quantity::{Angle, Density, Frequency, Percent, Pressure, RainRate, Temperature};
use cittert_phenomenology::atmosphere::{
    AirState, AttenuationRow, Humidity, ItuP838, Parcel, RainModel, attenuation, gas_model, rain_model,
};
use clap::Args;

/// Options of `scene attenuation`.
#[derive(Debug, Args)]
pub(crate) struct AttenuationArgs {
    /// Gas model: mpm89 or mpm93.
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_value = "mpm89")]
    model: Vec<String>,
    /// Frequencies, 1 to 1000 GHz.
    #[arg(long, value_name = "FREQ", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    freq: Vec<Frequency>,
    /// Total pressures, 3 to 1200 hPa.
    #[arg(long, value_name = "PRESSURE", value_delimiter = ',', default_value = "1013.25hPa", allow_hyphen_values = true)]
    pressure: Vec<Pressure>,
    /// Temperatures, 150 to 350 K.
    #[arg(long, value_name = "TEMP", value_delimiter = ',', default_value = "288.15K", allow_hyphen_values = true)]
    temperature: Vec<Temperature>,
    /// Densities of water vapour [default: 7.5g/m3, unless --humidity or --vapour-pressure is given].
    #[arg(long, alias = "vapor", value_name = "DENSITY", value_delimiter = ',', allow_hyphen_values = true, group = "water")]
    vapour: Vec<Density>,
    /// Relative humidities over liquid water, in place of --vapour.
    #[arg(long, value_name = "PERCENT", value_delimiter = ',', allow_hyphen_values = true, group = "water")]
    humidity: Vec<Percent>,
    /// Partial pressures of water vapour, in place of --vapour.
    #[arg(long, value_name = "PRESSURE", value_delimiter = ',', allow_hyphen_values = true, group = "water")]
    vapour_pressure: Vec<Pressure>,
    /// Densities of the droplets of cloud, fog or haze.
    #[arg(
        long,
        visible_aliases = ["fog", "haze"],
        value_name = "DENSITY",
        value_delimiter = ',',
        default_value = "0g/m3",
        allow_hyphen_values = true
    )]
    cloud: Vec<Density>,
    /// Densities of ice crystals.
    #[arg(long, value_name = "DENSITY", value_delimiter = ',', default_value = "0g/m3", allow_hyphen_values = true)]
    ice: Vec<Density>,
    /// Rain rates.
    #[arg(long, value_name = "RATE", value_delimiter = ',', default_value = "0mm/h", allow_hyphen_values = true)]
    rain: Vec<RainRate>,
    /// Rain model: p838 or olsen78.
    #[arg(long, value_name = "NAME", default_value = "p838")]
    rain_model: String,
    /// Elevation of the path, for rain seen in one polarisation (model p838).
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, requires = "tilt")]
    elevation: Option<Angle>,
    /// Tilt of the polarisation from the horizontal: 0deg is h, 90deg is v, 45deg is circular.
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, requires = "elevation")]
    tilt: Option<Angle>,
    #[command(flatten)]
    plot: PlotArgs,
}

/// Default density of water vapour, g/m3: the mean at sea level.
const DEFAULT_VAPOUR_G_M3: f64 = 7.5;

impl AttenuationArgs {
    fn humidities(&self) -> Vec<Humidity> {
        let vapour = self.vapour.iter().map(|v| Humidity::VapourDensity(exact(v.si() * 1e3)));
        let relative = self.humidity.iter().map(|h| Humidity::RelativePercent(exact(h.si())));
        let partial = self.vapour_pressure.iter().map(|e| Humidity::VapourPressure(exact(e.si() / 1e2)));
        let all: Vec<Humidity> = vapour.chain(relative).chain(partial).collect();
        if all.is_empty() { vec![Humidity::VapourDensity(DEFAULT_VAPOUR_G_M3)] } else { all }
    }

    fn parcels(&self) -> Result<Vec<Parcel>> {
        let humidities = self.humidities();
        let lengths = [self.pressure.len(), self.temperature.len(), humidities.len(), self.cloud.len(), self.ice.len(), self.rain.len()];
        check_rows(&[&lengths[..], &[self.model.len(), self.freq.len()]].concat())?;
        let parcel = |[pressure, temperature, humidity, cloud, ice, rain]: [usize; 6]| {
            let pressure_hpa = exact(self.pressure[pressure].si() / 1e2);
            Ok(Parcel {
                air: AirState::with_humidity(pressure_hpa, self.temperature[temperature].si(), humidities[humidity])?,
                liquid_g_m3: exact(self.cloud[cloud].si() * 1e3),
                ice_g_m3: exact(self.ice[ice].si() * 1e3),
                rain_mm_h: exact(self.rain[rain].si() * 3.6e6),
            })
        };
        combinations(lengths).map(parcel).collect()
    }

    /// Attenuation by rain along one path in one polarisation, dB/km; `None` if the options select the mean of both polarisations.
    fn tilted(&self, freq_ghz: f64, rate_mm_h: f64) -> Result<Option<f64>> {
        let (Some(elevation), Some(tilt)) = (self.elevation, self.tilt) else { return Ok(None) };
        if self.rain_model != "p838" {
            return Err(Failure::usage(format!("--elevation and --tilt need --rain-model p838, not {}", self.rain_model)));
        }
        let law = ItuP838::new()?.power_law(freq_ghz, exact(elevation.si().to_degrees()), exact(tilt.si().to_degrees()))?;
        Ok(Some(law.attenuation_db_per_km(rate_mm_h)))
    }

    fn outputs(&self, row: &AttenuationRow, parcel: &Parcel, rain: &dyn RainModel) -> Result<Vec<(&'static str, f64)>> {
        let mean = 0.5 * (row.rain_h_db_per_km + row.rain_v_db_per_km);
        let along = self.tilted(row.freq_ghz, parcel.rain_mm_h)?.unwrap_or(mean);
        let mut values: Vec<_> = row.columns().into_iter().skip(1).collect();
        // The total contains the rain of the selected polarisation.
        if along != mean {
            values[0].1 += along - mean;
        }
        let [h, v] = rain.power_laws(row.freq_ghz);
        values.extend([
            ("rain_db_per_km", along),
            ("rain_k_h", h.k),
            ("rain_alpha_h", h.alpha),
            ("rain_k_v", v.k),
            ("rain_alpha_v", v.alpha),
        ]);
        Ok(values)
    }
}

/// Print one row for each model, parcel of air and frequency.
///
/// # Errors
/// Values out of range, unknown names, a picture that cannot be written.
pub(super) fn run(args: &AttenuationArgs) -> Result<Outcome> {
    args.plot.claim(NOTHING)?;
    let rain = rain_model(&args.rain_model)?;
    let parcels = args.parcels()?;
    let freqs = ghz(&args.freq);
    let mut table = Table::default();
    for name in &args.model {
        let gas = gas_model(name)?;
        for parcel in &parcels {
            for row in attenuation(gas.as_ref(), rain.as_ref(), parcel, &freqs)? {
                let inputs = [
                    ("model", name.as_str().into()),
                    ("freq_ghz", row.freq_ghz.into()),
                    ("pressure_hpa", parcel.air.pressure_hpa().into()),
                    ("temperature_k", parcel.air.temperature_k().into()),
                    ("vapour_g_m3", exact(parcel.air.vapour_density_g_m3()).into()),
                    ("cloud_g_m3", parcel.liquid_g_m3.into()),
                    ("ice_g_m3", parcel.ice_g_m3.into()),
                    ("rain_mm_h", parcel.rain_mm_h.into()),
                ];
                table.push(inputs, args.outputs(&row, parcel, rain.as_ref())?)?;
            }
        }
    }
    let picture = Picture { title: "Specific attenuation", columns: &["attenuation_db_per_km"], label: "attenuation [dB/km]" };
    table.finish(&args.plot, &picture)
}

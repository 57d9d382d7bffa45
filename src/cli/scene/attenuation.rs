//! `scene attenuation`: specific attenuation of air and of what floats or falls in it.

use super::table::{Cell, Picture, PlotArgs, Table};
use super::values::{check_rows, exact, ghz};
use crate::cli::context::Outcome;
use crate::cli::failure::{Failure, Result};
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
    /// Frequencies, 1-1000 GHz.
    #[arg(long, value_name = "FREQ", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    freq: Vec<Frequency>,
    /// Total pressures, 3-1200 hPa.
    #[arg(long, value_name = "PRESSURE", value_delimiter = ',', default_value = "1013.25hPa", allow_hyphen_values = true)]
    pressure: Vec<Pressure>,
    /// Temperatures, 150-350 K.
    #[arg(long, value_name = "TEMP", value_delimiter = ',', default_value = "288.15K", allow_hyphen_values = true)]
    temperature: Vec<Temperature>,
    /// Densities of water vapour [default: 7.5g/m3, unless the humidity is given in another way].
    #[arg(long, alias = "vapor", value_name = "DENSITY", value_delimiter = ',', allow_hyphen_values = true, group = "water")]
    vapour: Vec<Density>,
    /// Relative humidities over liquid water, in place of --vapour.
    #[arg(long, value_name = "PERCENT", value_delimiter = ',', allow_hyphen_values = true, group = "water")]
    humidity: Vec<Percent>,
    /// Partial pressures of water vapour, in place of --vapour.
    #[arg(long, value_name = "PRESSURE", value_delimiter = ',', allow_hyphen_values = true, group = "water")]
    vapour_pressure: Vec<Pressure>,
    /// Densities of droplets of cloud, fog or haze.
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
    /// Elevation of the path, for rain seen in one polarisation (p838).
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, requires = "tilt")]
    elevation: Option<Angle>,
    /// Tilt of the polarisation from the horizontal: 0deg h, 90deg v, 45deg circular.
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, requires = "elevation")]
    tilt: Option<Angle>,
    #[command(flatten)]
    plot: PlotArgs,
}

const INPUTS: [&str; 8] = ["model", "freq_ghz", "pressure_hpa", "temperature_k", "vapour_g_m3", "cloud_g_m3", "ice_g_m3", "rain_mm_h"];
const MORE: [&str; 5] = ["rain_db_per_km", "rain_k_h", "rain_alpha_h", "rain_k_v", "rain_alpha_v"];

/// Vapour where none is given, g/m3: the mean at sea level.
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
        let lengths = [&self.cloud, &self.ice].map(Vec::len);
        check_rows(&[
            self.model.len(),
            self.freq.len(),
            self.pressure.len(),
            self.temperature.len(),
            humidities.len(),
            lengths[0],
            lengths[1],
            self.rain.len(),
        ])?;
        let mut all = Vec::new();
        for pressure in &self.pressure {
            for temperature in &self.temperature {
                for humidity in &humidities {
                    let air = AirState::with_humidity(exact(pressure.si() / 1e2), temperature.si(), *humidity)?;
                    for cloud in &self.cloud {
                        for ice in &self.ice {
                            all.extend(self.rain.iter().map(|rain| Parcel {
                                air,
                                liquid_g_m3: exact(cloud.si() * 1e3),
                                ice_g_m3: exact(ice.si() * 1e3),
                                rain_mm_h: exact(rain.si() * 3.6e6),
                            }));
                        }
                    }
                }
            }
        }
        Ok(all)
    }

    /// Rain along one path in one polarisation, dB/km; `None` for the mean of both.
    fn tilted(&self, freq_ghz: f64, rate_mm_h: f64) -> Result<Option<f64>> {
        let (Some(elevation), Some(tilt)) = (self.elevation, self.tilt) else { return Ok(None) };
        if self.rain_model != "p838" {
            return Err(Failure::usage(format!("--elevation and --tilt need --rain-model p838, not {}", self.rain_model)));
        }
        let law = ItuP838::new()?.power_law(freq_ghz, exact(elevation.si().to_degrees()), exact(tilt.si().to_degrees()))?;
        Ok(Some(law.attenuation_db_per_km(rate_mm_h)))
    }

    fn outputs(&self, row: &AttenuationRow, parcel: &Parcel, rain: &dyn RainModel) -> Result<Vec<f64>> {
        let mean = 0.5 * (row.rain_h_db_per_km + row.rain_v_db_per_km);
        let along = self.tilted(row.freq_ghz, parcel.rain_mm_h)?.unwrap_or(mean);
        let mut values = row.values()[1..].to_vec();
        // The total holds the rain of the polarisation that was asked for.
        if along != mean {
            values[0] += along - mean;
        }
        let [h, v] = rain.power_laws(row.freq_ghz);
        values.extend([along, h.k, h.alpha, v.k, v.alpha]);
        Ok(values)
    }
}

/// A row for each model, parcel of air and frequency.
///
/// # Errors
/// Values out of range, unknown names, a picture that cannot be written.
pub(super) fn run(args: &AttenuationArgs) -> Result<Outcome> {
    args.plot.check()?;
    let rain = rain_model(&args.rain_model)?;
    let parcels = args.parcels()?;
    let freqs = ghz(&args.freq);
    let outputs: Vec<&str> = AttenuationRow::COLUMNS[1..].iter().chain(&MORE).copied().collect();
    let mut table = Table::new(&INPUTS, &outputs);
    for name in &args.model {
        let gas = gas_model(name)?;
        for parcel in &parcels {
            for row in attenuation(gas.as_ref(), rain.as_ref(), parcel, &freqs)? {
                let air = &parcel.air;
                let numbers = [
                    row.freq_ghz,
                    air.pressure_hpa(),
                    air.temperature_k(),
                    exact(air.vapour_density_g_m3()),
                    parcel.liquid_g_m3,
                    parcel.ice_g_m3,
                    parcel.rain_mm_h,
                ];
                let inputs = std::iter::once(Cell::from(name.as_str())).chain(numbers.map(Cell::from)).collect();
                table.push(inputs, args.outputs(&row, parcel, rain.as_ref())?);
            }
        }
    }
    let picture = Picture { title: "Specific attenuation", columns: &["attenuation_db_per_km"], label: "attenuation [dB/km]" };
    table.finish(&args.plot, &picture)
}

//! What a surface is made of, as options: a material, a stack file, or a permittivity.

use super::material::MaterialArgs;
use super::table::Cell;
use crate::cli::failure::{Context as _, Failure, Result};
use cittert_phenomenology::dielectrics::{Parameter, permittivity_of};
use cittert_phenomenology::surfaces::{DEFAULT_TEMPERATURE_K, LayerDescription, StackDescription, Substance};
use clap::Args;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Largest stack file that is read.
const MAX_FILE_BYTES: u64 = 4 << 20;

/// Options that describe a surface.
#[derive(Debug, Args)]
pub(super) struct SurfaceArgs {
    /// Stack file: `coherent`, then [[layer]] from the top with `material` or `eps`, `thickness_m`, `temperature_k`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["material", "eps"])]
    stack: Option<PathBuf>,
    /// Relative permittivity of a half-space, real part and (positive) loss.
    #[arg(long, value_name = "REAL,LOSS", conflicts_with = "material", allow_hyphen_values = true)]
    eps: Option<Pair>,
    #[command(flatten)]
    pub(super) material: MaterialArgs,
}

/// Two numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair(pub(super) f64, pub(super) f64);

impl FromStr for Pair {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<f64> = text.split(',').filter_map(|t| t.trim().parse().ok()).filter(|x: &f64| x.is_finite()).collect();
        match (&numbers[..], text.split(',').count()) {
            ([a, b], 2) => Ok(Self(*a, *b)),
            _ => Err(format!("{text:?} is not two numbers with a comma between them")),
        }
    }
}

/// Columns that tell surfaces apart.
pub(super) const COLUMNS: [&str; 5] = ["surface", "temperature_k", "salinity_psu", "moisture", "density_kg_m3"];

/// One surface, and what stands in [`COLUMNS`].
pub(super) struct Surface {
    /// The layers.
    pub(super) description: StackDescription,
    /// The cells.
    pub(super) cells: Vec<Cell>,
}

impl SurfaceArgs {
    /// Every surface that was asked for.
    ///
    /// # Errors
    /// None or too much said, unknown names, a stack file that cannot be read.
    pub(super) fn surfaces(&self) -> Result<Vec<Surface>> {
        if let Some(path) = &self.stack {
            if !(self.material.is_silent() && self.material.temperature.is_empty()) {
                return Err(Failure::usage("with --stack the file says model, temperature and parameters of each layer"));
            }
            let description = read(path)?;
            return Ok(vec![one(description, &path.display().to_string(), Cell::Absent)]);
        }
        if let Some(Pair(real, loss)) = self.eps {
            return self.half_spaces(real, loss);
        }
        if self.material.material.is_none() && self.material.model.is_none() {
            return Err(Failure::usage("give one of --material, --stack and --eps"));
        }
        let sample = self.material.sample()?;
        let surface = |state: &cittert_phenomenology::dielectrics::MaterialState| {
            let value = |p: Parameter| sample.material.spec(p).map_or(Cell::Absent, |_| Cell::Number(state.get(p)));
            Surface {
                description: StackDescription::of_material(sample.material, *state, sample.model),
                cells: vec![
                    sample.material.name.into(),
                    state.temperature_k.into(),
                    value(Parameter::Salinity),
                    value(Parameter::Moisture),
                    value(Parameter::Density),
                ],
            }
        };
        Ok(sample.states.iter().map(surface).collect())
    }

    fn half_spaces(&self, real: f64, loss: f64) -> Result<Vec<Surface>> {
        if !self.material.is_silent() {
            return Err(Failure::usage("with --eps there is no material: leave --model and its parameters out"));
        }
        let given: Vec<f64> = self.material.temperature.iter().map(|t| t.si()).collect();
        let temperatures = if given.is_empty() { vec![DEFAULT_TEMPERATURE_K] } else { given };
        let half_space = |temperature_k: f64| {
            let layer = LayerDescription {
                substance: Substance::Fixed(permittivity_of(real, loss)),
                thickness_m: f64::INFINITY,
                temperature_k,
                place: String::new(),
            };
            one(StackDescription { coherent: true, layers: vec![layer] }, &format!("eps {real},{loss}"), temperature_k.into())
        };
        Ok(temperatures.into_iter().map(half_space).collect())
    }
}

fn one(description: StackDescription, name: &str, temperature: Cell) -> Surface {
    Surface { description, cells: vec![name.into(), temperature, Cell::Absent, Cell::Absent, Cell::Absent] }
}

fn read(path: &Path) -> Result<StackDescription> {
    let name = path.display();
    let facts = path.metadata().context(&name)?;
    if !facts.is_file() || facts.len() > MAX_FILE_BYTES {
        return Err(Failure::message(format!("{name}: no stack; give a TOML file of at most {} MiB", MAX_FILE_BYTES >> 20)));
    }
    let text = std::fs::read_to_string(path).context(&name)?;
    StackDescription::from_toml(&text).context(&name)
}

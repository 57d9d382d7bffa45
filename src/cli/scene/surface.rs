//! Options that describe a surface: a material, a stack file, or a permittivity.

use super::material::MaterialArgs;
use super::table::Cell;
use super::values::read_text;
use crate::cli::failure::{Context as _, Failure, Result};
use cittert_phenomenology::dielectrics::{MaterialState, Parameter, permittivity_of};
use cittert_phenomenology::surfaces::{DEFAULT_TEMPERATURE_K, LayerDescription, StackDescription, Substance};
use clap::Args;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Largest stack file that is read, bytes.
const MAX_FILE_BYTES: u64 = 4 << 20;

/// Options that describe a surface.
#[derive(Debug, Args)]
pub(super) struct SurfaceArgs {
    /// Stack file (TOML): `coherent`, then [[layer]] from the top, each with `material` or `eps`, `thickness_m` and `temperature_k`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["material", "eps"])]
    stack: Option<PathBuf>,
    /// Relative permittivity of a half-space, real part and (positive) loss.
    #[arg(long, value_name = "REAL,LOSS", conflicts_with = "material", allow_hyphen_values = true)]
    eps: Option<Pair>,
    #[command(flatten)]
    pub(super) material: MaterialArgs,
}

/// Two finite numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pair(pub(super) f64, pub(super) f64);

impl FromStr for Pair {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |t: &str| t.trim().parse().ok().filter(|x: &f64| x.is_finite());
        let pair = text.split_once(',').and_then(|(a, b)| Some(Self(number(a)?, number(b)?)));
        pair.ok_or_else(|| format!("{text:?} is not two numbers with a comma between them"))
    }
}

/// One surface, and the cells that name it in a table.
pub(super) struct Surface {
    /// The layers.
    pub(super) description: StackDescription,
    /// Name, temperature, salinity, moisture and density.
    pub(super) cells: [(&'static str, Cell); 5],
}

/// Columns that name a surface.
const COLUMNS: [&str; 5] = ["surface", "temperature_k", "salinity_psu", "moisture", "density_kg_m3"];

impl Surface {
    /// With the values of the first columns. The others are empty.
    fn new(description: StackDescription, values: Vec<Cell>) -> Self {
        let mut values = values.into_iter();
        Self { description, cells: COLUMNS.map(|name| (name, values.next().unwrap_or(Cell::Absent))) }
    }
}

impl SurfaceArgs {
    /// The file that is read, if any.
    pub(super) fn file(&self) -> Option<&Path> {
        self.stack.as_deref()
    }

    /// What describes the surface, for messages.
    pub(super) fn named(&self) -> String {
        self.stack.as_ref().map_or_else(|| "the surface".into(), |path| path.display().to_string())
    }

    /// Every surface that the options describe.
    ///
    /// # Errors
    /// No description or more than one, unknown names, a stack file that cannot be read.
    pub(super) fn surfaces(&self) -> Result<Vec<Surface>> {
        if let Some(path) = &self.stack {
            if !(self.material.is_silent() && self.material.temperature.is_empty()) {
                return Err(Failure::usage(
                    "--stack names a file that gives model, temperature and parameters of each layer; leave these options out",
                ));
            }
            let name = path.display().to_string();
            let description = StackDescription::from_toml(&read_text(path, "stack", MAX_FILE_BYTES)?).context(&name)?;
            return Ok(vec![Surface::new(description, vec![name.as_str().into()])]);
        }
        if let Some(eps) = self.eps {
            return self.half_spaces(eps);
        }
        if self.material.material.is_none() && self.material.model.is_none() {
            return Err(Failure::usage("give one of --material, --stack and --eps"));
        }
        let sample = self.material.sample()?;
        let surface = |state: &MaterialState| {
            let others = [Parameter::Salinity, Parameter::Moisture, Parameter::Density].map(|parameter| sample.cell(state, parameter));
            let first = [Cell::from(sample.material.name), state.temperature_k.into()];
            let description = StackDescription::of_material(sample.material, *state, sample.model);
            Surface::new(description, first.into_iter().chain(others).collect())
        };
        Ok(sample.states.iter().map(surface).collect())
    }

    fn half_spaces(&self, Pair(real, loss): Pair) -> Result<Vec<Surface>> {
        if !self.material.is_silent() {
            return Err(Failure::usage("--eps describes a surface without a material; leave --model and its parameters out"));
        }
        let half_space = |temperature_k: f64| {
            let layer = LayerDescription {
                substance: Substance::Fixed(permittivity_of(real, loss)),
                thickness_m: f64::INFINITY,
                temperature_k,
                scatter: None,
                porosity: 0.0,
                place: String::new(),
            };
            let name = format!("eps {real},{loss}");
            let cells = vec![name.as_str().into(), temperature_k.into()];
            Surface::new(StackDescription { coherent: true, layers: vec![layer] }, cells)
        };
        Ok(match &self.material.temperature[..] {
            [] => vec![half_space(DEFAULT_TEMPERATURE_K)],
            given => given.iter().map(|t| half_space(t.si())).collect(),
        })
    }
}

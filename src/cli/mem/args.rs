//! The options of `mem`.

use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::held_out::HoldOutArgs;
use crate::cli::options::{ColumnArgs, OutputArgs, SetArgs, SetFiles, prior_file, range_file};
use crate::cli::ranks;
use crate::closure_imaging::ClosureImagingOptions;
use crate::imaging::ImagingOptions;
use crate::mem::MemOptions;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Options of the image and of maximum entropy that act on images from closure quantities too.
const SHARED: [&str; 5] = ["size", "cell", "pol", "beam", "flux"];

/// Options of `mem`.
#[derive(Debug, Args)]
pub struct MemCommandArgs {
    #[command(flatten)]
    pub(super) input: SetArgs,
    #[command(flatten)]
    pub(super) column: ColumnArgs,
    #[command(flatten)]
    pub(super) imaging: ImagingOptions,
    #[command(flatten)]
    pub(super) mem: MemOptions,
    #[command(flatten)]
    pub(super) terms: ClosureImagingOptions,
    #[command(flatten)]
    pub(super) hold_out: HoldOutArgs,
    /// Write each step as one line of JSON to this file.
    #[arg(long, value_name = "FILE")]
    pub(super) log: Option<PathBuf>,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

impl MemCommandArgs {
    /// Refuse options that the kind of image does not use: images from closure quantities have options of their own.
    ///
    /// # Errors
    /// An option that would have no effect.
    pub(super) fn check_used(&self) -> Result<()> {
        if self.terms.terms.is_some() {
            let mut given = given_of(&self.imaging)?;
            given.extend(given_of(&self.mem)?);
            let by_default = |name: &str| name == "epsilon" && ranks::is_default_epsilon(self.imaging.epsilon);
            given.retain(|name| !SHARED.contains(&name.as_str()) && !by_default(name));
            given.extend(self.hold_out.is_given().then(|| "hold-out".to_owned()));
            refuse(&given, "no effect on images from closure quantities. Leave this out, or --terms")
        } else {
            refuse(&given_of(&self.terms)?, "this acts on images from closure quantities only, which --terms asks for")
        }
    }

    /// Claim the outputs of the command, and its log.
    ///
    /// # Errors
    /// As [`OutputArgs::claim`].
    pub(super) fn claim(&self, outputs: Vec<PathBuf>, input: &SetFiles) -> Result<()> {
        self.out.claim(outputs.iter().chain(&self.log), input.all().iter().map(PathBuf::as_path).chain(self.given()))
    }

    /// The images that are given beside the data: the mask and the prior.
    pub(super) fn given(&self) -> impl Iterator<Item = &Path> {
        let map = self.imaging.range.as_ref().and_then(range_file);
        self.mem.mask.as_deref().into_iter().chain(self.mem.prior.as_ref().and_then(prior_file).map(PathBuf::as_path)).chain(map)
    }
}

/// The names of the options that are not at their default.
fn given_of<T: Serialize + Default>(options: &T) -> Result<Vec<String>> {
    let (now, default) = (serde_json::to_value(options)?, serde_json::to_value(T::default())?);
    let entries = now.as_object().into_iter().flatten();
    Ok(entries.filter(|(name, value)| default.get(name) != Some(value)).map(|(name, _)| name.clone()).collect())
}

fn refuse(given: &[String], why: &str) -> Result<()> {
    let names = given.iter().map(|name| format!("--{name}")).collect::<Vec<_>>().join(", ");
    ensure!(given.is_empty(), Failure::usage(format!("{names}: {why}")));
    Ok(())
}

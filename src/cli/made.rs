//! The layout of a file of `run` or `study`: one by its name, or one that `layout make` makes.

use super::failure::{Context as _, Failure, Result};
use super::sections::{Options, Section};
use cittert_arrays::{ArrayLayout, GenerateOptions, LayoutKind};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Options of `layout make`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct MakeSection {
    /// Kind of the layout; `layout make --help` lists them.
    pub(super) kind: String,
    #[serde(flatten)]
    pub(super) options: GenerateOptions,
}

impl Options for MakeSection {
    const REQUIRED: &'static str = "kind = \"ring\"\nelements = 2\naperture = \"1m\"";
}

/// Where the antennas of a file stand.
#[derive(Debug, Clone, Copy)]
pub(super) enum Origin<'a> {
    /// A built-in layout or a layout file.
    Named(&'a str),
    /// A generated layout.
    Made(&'a Section<MakeSection>),
}

impl<'a> Origin<'a> {
    /// The one of the two that the section `[layout]` has.
    ///
    /// # Errors
    /// It has both or neither.
    pub(super) fn of(name: Option<&'a str>, make: Option<&'a Section<MakeSection>>) -> Result<Self> {
        match (name, make) {
            (Some(name), None) => Ok(Self::Named(name)),
            (None, Some(make)) => Ok(Self::Made(make)),
            _ => {
                Err(Failure::message("layout: give name, or make = { kind = \"fermat\", elements = 48, aperture = \"1m\" }, and not both"))
            }
        }
    }

    /// The layout in a sentence.
    pub(super) fn told(self) -> String {
        match self {
            Self::Named(name) => name.to_owned(),
            Self::Made(make) => format!("{} of {}", make.options.kind, make.options.options.elements),
        }
    }
}

impl MakeSection {
    /// The layout.
    ///
    /// # Errors
    /// A kind that there is not; as [`LayoutKind::layout`].
    pub(super) fn layout(&self) -> Result<ArrayLayout> {
        let made = LayoutKind::find(&self.kind).and_then(|kind| kind.layout(&self.options));
        made.context("layout.make")
    }
}

//! TOML layouts. The crate of arrays reads and writes the text, because the built-in layouts have this format.

use super::error::{LayoutError, ReadContext, Result};
use crate::format::{Label, LayoutFormat};
use crate::patterns::read_pattern;
use cittert_arrays::{ArrayError, ArrayLayout, LayoutFrame};

pub(crate) struct Native;

impl LayoutFormat for Native {
    fn label(&self) -> Label {
        Label {
            name: "toml",
            extensions: &["toml"],
            description: "the native format: names, positions, diameters, SEFD or Tsys, position errors, site or boresight frame",
        }
    }

    fn sniff(&self, text: &str, extension: &str) -> bool {
        let key = |line: &str| {
            let line = line.trim_start();
            line.starts_with("[[antenna]]") || line.strip_prefix("frame").is_some_and(|r| r.trim_start().starts_with('='))
        };
        extension == "toml" || text.lines().any(key)
    }

    fn read(&self, text: &str, context: &ReadContext) -> Result<ArrayLayout> {
        // A pattern may stand in a file beside the layout.
        let read = match &context.folder {
            None => ArrayLayout::from_toml(text),
            Some(folder) => {
                let beside = |file: &str| read_pattern(&folder.join(file)).map_err(|e| ArrayError::Parse(e.to_string()));
                ArrayLayout::from_toml_with(text, &beside)
            }
        };
        let layout = read.map_err(|e| match e {
            ArrayError::Parse(fault) => LayoutError::Missing(format!("expected TOML as in the page on layouts, found this: {fault}")),
            other => other.into(),
        })?;
        let Some(site) = context.site.filter(|_| layout.site().is_some()) else { return Ok(layout) };
        let mut moved = ArrayLayout::new(layout.name.clone(), LayoutFrame::EastNorthUp(site), layout.antennas().to_vec())?;
        (moved.source, moved.aperture_m, moved.pattern) = (layout.source, layout.aperture_m, layout.pattern);
        Ok(moved)
    }

    fn write(&self, layout: &ArrayLayout) -> Result<String> {
        Ok(layout.to_toml())
    }

    fn loses(&self, _: &ArrayLayout) -> Vec<String> {
        Vec::new()
    }
}

//! UVFITS in the table of formats.

use super::edit::UvfitsEdit;
use super::read::UvfitsReader;
use super::write::{UvfitsOptions, UvfitsWriter};
use super::{annotations, unread};
use crate::fits::is_random_groups;
use crate::format::{Format, Holds, Label, VisibilityFormat, refuse_options};
use crate::{ColumnSink, CreateOptions, Created, Edit, Result};
use cittert_arrays::{VisibilityHeader, VisibilitySource};
use std::path::Path;

pub(crate) struct Uvfits;

impl Format for Uvfits {
    fn label(&self) -> Label {
        Label {
            name: "UVFITS",
            extensions: &["uvfits", "uvf"],
            description: "FITS random groups with AIPS tables; Jy, and a phase centre on the sky",
        }
    }

    fn sniff(&self, _: &Path, start: &[u8]) -> bool {
        is_random_groups(start)
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Visibilities(self)
    }
}

impl VisibilityFormat for Uvfits {
    fn open(&self, path: &Path) -> Result<Box<dyn VisibilitySource>> {
        Ok(Box::new(UvfitsReader::open(path)?))
    }

    fn create(&self, path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Option<Created>> {
        refuse_options(self, path, options)?;
        let writer = UvfitsWriter::create(path, header, UvfitsOptions { overwrite: options.overwrite, stokes_i: false })?;
        let notes = writer.notes().to_vec();
        Ok(Some(Created { sink: Box::new(writer), notes }))
    }

    fn unread(&self, path: &Path, _: &dyn VisibilityFormat) -> Result<Vec<String>> {
        unread::lines(path)
    }

    fn loses(&self, header: &VisibilityHeader) -> Vec<String> {
        let about = &header.annotations;
        let mut lines: Vec<String> = annotations::lost_keywords(about).into_iter().map(|lost| lost.0).collect();
        lines.extend(
            annotations::lost_mounts(header).into_iter().map(|mount| format!("mount {mount:?} of antennas (UVFITS has no code for it)")),
        );
        if !about.stations.is_empty() {
            lines.push("stations (pads) of the antennas (their names are kept)".into());
        }
        if !header.layout.name.is_empty() && header.layout.name != header.telescope {
            lines.push(format!("name of the layout, {:?} (the telescope is kept)", header.layout.name));
        }
        if header.layout.antennas().iter().any(|a| a.sensitivity.is_some() || a.position_error_m.is_some()) {
            lines.push("SEFD, Tsys and position errors of the antennas".into());
        }
        lines
    }

    fn edit(&self, from: &Path, to: &Path, edit: &Edit) -> Result<Option<Created>> {
        let sink = UvfitsEdit::begin(from, to, edit)?;
        Ok(sink.map(|sink| Created { sink: Box::new(sink) as Box<dyn ColumnSink>, notes: Vec::new() }))
    }
}

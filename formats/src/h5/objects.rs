//! A list of all objects of an HDF5 file.

use super::failure::failed;
use super::read::{H5In, SOUND};
use crate::Result;
use hdf5::Group;

/// Largest depth of groups that are visited.
const DEEPEST: usize = 8;

/// A dataset or group of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Object {
    /// Path without a slash at its beginning; empty for the root.
    pub(crate) name: String,
    pub(crate) is_dataset: bool,
    /// True for a dataset with at least one value.
    pub(crate) has_values: bool,
    pub(crate) attributes: Vec<String>,
}

impl H5In {
    /// All objects, groups before what they hold.
    pub(crate) fn objects(&self) -> Result<Vec<Object>> {
        let mut all = Vec::new();
        if let Some(root) = self.group("") {
            visit(&root, "", 0, &mut all).map_err(|e| failed(self.path(), "list of objects", SOUND, &e))?;
        }
        Ok(all)
    }
}

fn visit(group: &Group, name: &str, depth: usize, all: &mut Vec<Object>) -> hdf5::Result<()> {
    all.push(Object { name: name.into(), is_dataset: false, has_values: false, attributes: group.attr_names()? });
    for member in group.member_names()? {
        let inner = if name.is_empty() { member.clone() } else { format!("{name}/{member}") };
        if let Ok(dataset) = group.dataset(&member) {
            let has_values = !dataset.space()?.is_null() && dataset.size() > 0;
            all.push(Object { name: inner, is_dataset: true, has_values, attributes: dataset.attr_names()? });
        } else if let (Ok(group), true) = (group.group(&member), depth < DEEPEST) {
            visit(&group, &inner, depth + 1, all)?;
        }
    }
    Ok(())
}

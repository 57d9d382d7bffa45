//! What a format of files implements: the traits, and the functions that read and write its content.

use crate::files::{START_BYTES, extension_of};
use crate::layouts::error::{LayoutError, ReadContext};
use crate::{CreateOptions, Created, Edit, FormatError, Result, VisColumn};
use cittert_arrays::{ArrayLayout, GainTable, Image, Source, VisibilityHeader, VisibilitySource};
use std::path::Path;

/// Names of a format.
#[derive(Debug, Clone, Copy)]
pub struct Label {
    /// Name, such as `UVH5`.
    pub name: &'static str,
    /// Endings of file names, without the dot; the first is the usual one.
    pub extensions: &'static [&'static str],
    /// One sentence: what the format is and what it can hold.
    pub description: &'static str,
}

/// A format of files.
pub trait Format: Sync {
    /// Name, endings and description.
    fn label(&self) -> Label;

    /// True where the content of the file has this format. `start` is the beginning of the file; it is empty for a directory.
    fn sniff(&self, path: &Path, start: &[u8]) -> bool;

    /// What files of this format hold, with the functions that read and write them.
    fn holds(&self) -> Holds<'_>;

    /// Name, such as `UVH5`.
    fn name(&self) -> &'static str {
        self.label().name
    }

    /// Endings of file names, without the dot; the first is the usual one.
    fn extensions(&self) -> &'static [&'static str] {
        self.label().extensions
    }
}

/// What a format holds, with the functions that read and write it.
#[derive(Clone, Copy)]
pub enum Holds<'a> {
    /// Visibilities.
    Visibilities(&'a dyn VisibilityFormat),
    /// Images and cubes.
    Images(ImageFormat),
    /// Antenna gains.
    Gains(GainFormat),
    /// Lists of sources.
    Sources(SourceFormat),
    /// Antenna layouts.
    Layouts(&'a dyn LayoutFormat),
}

impl Holds<'_> {
    /// The kind of content, in one word.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Visibilities(_) => "visibilities",
            Self::Images(_) => "images",
            Self::Gains(_) => "gains",
            Self::Sources(_) => "sources",
            Self::Layouts(_) => "layouts",
        }
    }
}

/// A format of visibilities on disk.
pub trait VisibilityFormat: Format {
    /// Open a file to read.
    ///
    /// # Errors
    /// An error in the file, with the place where it is.
    fn open(&self, path: &Path) -> Result<Box<dyn VisibilitySource>>;

    /// The columns beside the data that a file has.
    ///
    /// # Errors
    /// An error in the file.
    fn columns(&self, _path: &Path) -> Result<Vec<VisColumn>> {
        Ok(Vec::new())
    }

    /// Open a column of a file to read.
    ///
    /// # Errors
    /// A column that the file does not have, or as [`VisibilityFormat::open`].
    fn open_column(&self, path: &Path, column: VisColumn) -> Result<Box<dyn VisibilitySource>> {
        if column == VisColumn::Data {
            return self.open(path);
        }
        Err(FormatError::unsupported(path, format!("there is no column {:?}: {} has only \"data\"", column.name(), self.name())))
    }

    /// True where files of this format can have this column beside the data.
    fn keeps(&self, _column: VisColumn) -> bool {
        false
    }

    /// Begin a file for a set with this header; `None` where the format can only be read.
    ///
    /// # Errors
    /// An existing output that may not be overwritten, a header or options that the format cannot hold, or an error of the file system.
    fn create(&self, path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Option<Created>>;

    /// True where files of this format hold numbers of samples beside the weights.
    fn keeps_samples(&self) -> bool {
        false
    }

    /// What a file of this format holds that comes neither with its rows nor with its header, one line each. A conversion to the format `to`
    /// loses it.
    ///
    /// # Errors
    /// An error in the file.
    fn unread(&self, _path: &Path, _to: &dyn VisibilityFormat) -> Result<Vec<String>> {
        Ok(Vec::new())
    }

    /// What files of this format cannot hold of a set with this header, one line each.
    fn loses(&self, _header: &VisibilityHeader) -> Vec<String> {
        Vec::new()
    }

    /// Begin a copy of the file `from` of this format, in which only what `edit` names changes. The copy is `from` itself where `to` is the same
    /// path. It takes the blocks of all rows in their order. `None` where files of this format cannot be changed in this way.
    ///
    /// # Errors
    /// An existing output that may not be overwritten, a file that cannot hold the changes, or an error of the file system.
    fn edit(&self, _from: &Path, _to: &Path, _edit: &Edit) -> Result<Option<Created>> {
        Ok(None)
    }
}

/// Refuse the options that only UVH5 has, and columns that a format cannot hold.
pub(crate) fn refuse_options(format: &dyn VisibilityFormat, path: &Path, options: &CreateOptions) -> Result<()> {
    let name = format.name();
    let what = match options {
        CreateOptions { append: true, .. } => format!("rows are appended to UVH5 only, not to {name}: write another file"),
        CreateOptions { compression: Some(_), .. } => format!("{name} is not compressed: leave out the compression, or write UVH5"),
        CreateOptions { columns, .. } => match columns.iter().find(|c| !format.keeps(**c)) {
            Some(column) => {
                format!("{name} has no place for the column {:?} beside the data: write it as the data of a file", column.name())
            }
            None => return Ok(()),
        },
    };
    Err(FormatError::unsupported(path, what))
}

/// Functions of a format of images. Errors name the place in the file; `write` takes whether an existing output may be overwritten.
#[derive(Clone, Copy)]
pub struct ImageFormat {
    /// Read an image.
    pub read: fn(&Path) -> Result<Image>,
    /// Write an image.
    pub write: fn(&Path, &Image, bool) -> Result<()>,
}

/// Functions of a format of gain tables, as in [`ImageFormat`].
#[derive(Clone, Copy)]
pub struct GainFormat {
    /// Read a table.
    pub read: fn(&Path) -> Result<GainTable>,
    /// Write a table.
    pub write: fn(&Path, &GainTable, bool) -> Result<()>,
}

/// Functions of a format of source lists, as in [`ImageFormat`].
#[derive(Clone, Copy)]
pub struct SourceFormat {
    /// Read a list.
    pub read: fn(&Path) -> Result<Vec<Source>>,
    /// Write a list.
    pub write: fn(&Path, &[Source], bool) -> Result<()>,
}

/// A format of antenna layouts. All of them are texts.
pub trait LayoutFormat: Sync {
    /// Name (as for `--format`), endings and description.
    fn label(&self) -> Label;

    /// True where the text looks like this format. `extension` decides only where the text alone cannot.
    fn sniff(&self, text: &str, extension: &str) -> bool;

    /// Read the layout in a text.
    ///
    /// # Errors
    /// A text that does not have this format (the error says the line, what was expected and what was found), or a layout that is not
    /// valid.
    fn read(&self, text: &str, context: &ReadContext) -> Result<ArrayLayout, LayoutError>;

    /// The text of a layout. Coordinates have a precision of a micrometre or better.
    ///
    /// # Errors
    /// A layout that lacks something that the format needs.
    fn write(&self, layout: &ArrayLayout) -> Result<String, LayoutError>;

    /// The properties of this layout that the format cannot hold, in words for the user. Empty if it can hold all of them.
    fn loses(&self, layout: &ArrayLayout) -> Vec<String>;

    /// True for a directory of this format.
    fn is_folder(&self, _path: &Path) -> bool {
        false
    }

    /// Short name, such as `casa-cfg`.
    fn name(&self) -> &'static str {
        self.label().name
    }

    /// The usual ending of file names, without the dot.
    fn extension(&self) -> &'static str {
        self.label().extensions[0]
    }
}

impl<T: LayoutFormat> Format for T {
    fn label(&self) -> Label {
        LayoutFormat::label(self)
    }

    fn sniff(&self, path: &Path, start: &[u8]) -> bool {
        if path.is_dir() {
            return self.is_folder(path);
        }
        // The last line may be incomplete where the file is longer than `start`.
        let whole = if start.len() < START_BYTES { start.len() } else { start.iter().rposition(|b| *b == b'\n').unwrap_or(0) };
        let Ok(text) = std::str::from_utf8(&start[..whole]) else { return false };
        LayoutFormat::sniff(self, text, &extension_of(path))
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Layouts(self)
    }
}

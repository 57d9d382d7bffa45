//! Looks files up in the table of formats. A file is recognised by its content, not by its name.
//!
//! Reading, `info`, the command line, the table of the book and the conformance test all use [`FORMATS`].

use crate::files::{describe, extension_of, start_of};
use crate::format::{Format, Holds, ImageFormat, VisibilityFormat};
use crate::{CreateOptions, Created, Edit, FORMATS, FormatError, Result, VisColumn, h5};
use cittert_arrays::{Image, VisibilityHeader, VisibilitySource};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// All formats of visibilities.
pub fn visibility_formats() -> impl Iterator<Item = &'static dyn VisibilityFormat> {
    FORMATS.iter().filter_map(|f| visibilities(f.holds()))
}

fn visibilities<'a>(holds: Holds<'a>) -> Option<&'a dyn VisibilityFormat> {
    if let Holds::Visibilities(f) = holds { Some(f) } else { None }
}

fn images(holds: Holds<'_>) -> Option<ImageFormat> {
    if let Holds::Images(f) = holds { Some(f) } else { None }
}

/// The format of a file or directory, by its content.
///
/// # Errors
/// A file that is missing, empty or has no known format; the error says what it seems to be.
pub fn format_of(path: &Path) -> Result<&'static dyn Format> {
    one_of(path, "a file of a known format", |_| true, Some)
}

/// The format of a file of visibilities, by its content.
///
/// # Errors
/// A file that is missing, empty, or does not hold visibilities; the error says what it seems to be.
pub fn visibility_format(path: &Path) -> Result<&'static dyn VisibilityFormat> {
    one_of(path, "visibilities", |h| visibilities(h).is_some(), |f| visibilities(f.holds()))
}

/// The format of an image, by its content.
///
/// # Errors
/// A file that is missing, empty, or does not hold an image; the error says what it seems to be.
pub fn image_format(path: &Path) -> Result<ImageFormat> {
    one_of(path, "an image", |h| images(h).is_some(), |f| images(f.holds()))
}

/// The format of a file, as `pick` takes it. The error names the formats that are `expected`.
fn one_of<T>(path: &Path, expected: &str, wanted: fn(Holds<'_>) -> bool, pick: impl Fn(&'static dyn Format) -> Option<T>) -> Result<T> {
    let start = if path.is_dir() { Vec::new() } else { start_of(path)? };
    let known = FORMATS.iter().find(|f| f.sniff(path, &start));
    if let Some(found) = known.and_then(|f| pick(*f)) {
        return Ok(found);
    }
    #[cfg(not(feature = "ms"))]
    if path.join("table.dat").is_file() {
        return Err(FormatError::unsupported(
            path,
            "this is a Measurement Set, which this build does not read (feature `ms`): export it as UVFITS (CASA: exportuvfits) first",
        ));
    }
    if known.is_none() && start.starts_with(h5::SIGNATURE) {
        // A damaged file shows none of its datasets. Opening it gives the error that says so.
        h5::open(path, expected)?;
    }
    let found = match known {
        Some(f) => format!("{} ({})", f.name(), f.holds().name()),
        None if path.is_dir() => "a directory without a Measurement Set or an OSKAR telescope model".into(),
        None => describe(&start),
    };
    Err(FormatError::not_a(path, format!("{expected}: {}", names(|f| wanted(f.holds()))), format!("it is {found}")))
}

/// Open visibilities of any format.
///
/// # Errors
/// As [`visibility_format`], or whatever is wrong inside the file.
pub fn open_visibilities(path: &Path) -> Result<Box<dyn VisibilitySource>> {
    visibility_format(path)?.open(path)
}

/// Open one column of visibilities.
///
/// # Errors
/// As [`open_visibilities`]; a column that the file does not have.
pub fn open_column(path: &Path, column: VisColumn) -> Result<Box<dyn VisibilitySource>> {
    visibility_format(path)?.open_column(path, column)
}

/// Begin an output of visibilities; the ending of the name chooses the format.
///
/// # Errors
/// An ending that no format has, an existing output that may not be overwritten, a header that the format cannot hold.
pub fn create_visibilities(path: &Path, header: &VisibilityHeader, overwrite: bool) -> Result<Created> {
    create_visibilities_with(path, header, &CreateOptions { overwrite, ..CreateOptions::default() })
}

/// As [`create_visibilities`], with further options.
///
/// # Errors
/// As [`create_visibilities`]; an option that the format does not know.
pub fn create_visibilities_with(path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Created> {
    let unknown = || format_to_write(path).err().unwrap_or_else(|| FormatError::unsupported(path, "this format is only read"));
    format_to_write(path)?.create(path, header, options)?.ok_or_else(unknown)
}

/// Begin a copy of a file of visibilities, in which only what `edit` names changes. `None` where the name of the copy stands for another format,
/// or its format cannot be changed in this way: then a new file is written.
///
/// # Errors
/// As [`open_visibilities`], an existing output that may not be overwritten, or a file that cannot be changed in place.
pub fn edit_visibilities(from: &Path, to: &Path, edit: &Edit) -> Result<Option<Created>> {
    let format = visibility_format(from)?;
    // A file that is changed in place keeps its format, whatever its name is.
    if is_same(from, to) {
        let why = format!("this {} does not store its numbers in a way that can be changed in place: write another file", format.name());
        return format.edit(from, to, edit)?.map(Some).ok_or_else(|| FormatError::unsupported(from, why));
    }
    if format_to_write(to)?.name() == format.name() { format.edit(from, to, edit) } else { Ok(None) }
}

/// What a conversion of a file of visibilities loses, one line each: what is not read, and what the format of the output cannot hold. `header` is
/// that of the file.
///
/// # Errors
/// As [`open_visibilities`], or an ending that no format has.
pub fn losses(from: &Path, to: &Path, header: &VisibilityHeader) -> Result<Vec<String>> {
    let (from_format, to_format) = (visibility_format(from)?, format_to_write(to)?);
    let all = from_format.unread(from, to_format)?.into_iter().chain(to_format.loses(header));
    Ok(all.map(|line| format!("lost in {}: {line}", to_format.name())).collect())
}

/// The format of an output: that of the file for a file that is changed in place, otherwise that of the ending of the name.
///
/// # Errors
/// An ending that no format has.
pub fn format_of_output(from: &Path, to: &Path) -> Result<&'static dyn VisibilityFormat> {
    if is_same(from, to) { visibility_format(from) } else { format_to_write(to) }
}

/// Whether two paths lead to one file.
fn is_same(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| path.metadata().ok().map(|meta| (meta.dev(), meta.ino()));
    place(a).is_some_and(|a| Some(a) == place(b))
}

/// The format of visibilities that the ending of a name stands for.
///
/// # Errors
/// An ending that no format has.
pub fn format_to_write(path: &Path) -> Result<&'static dyn VisibilityFormat> {
    let end = extension_of(path);
    visibility_formats().find(|f| f.extensions().contains(&end.as_str())).ok_or_else(|| {
        let found = if end.is_empty() { "the name has no ending".into() } else { format!("the name ends in .{end}") };
        let expected = format!("a name that ends as one of {}", names(|f| visibilities(f.holds()).is_some()));
        FormatError::not_a(path, expected, found)
    })
}

/// Read an image of any format.
///
/// # Errors
/// As [`image_format`], or an error in the file.
pub fn open_image(path: &Path) -> Result<Image> {
    (image_format(path)?.read)(path)
}

/// Names of some formats with their usual endings, for messages.
fn names(wanted: impl Fn(&dyn Format) -> bool) -> String {
    let named = FORMATS.iter().filter(|f| wanted(**f)).map(|f| format!("{} (.{})", f.name(), f.extensions()[0]));
    named.collect::<Vec<_>>().join(", ")
}

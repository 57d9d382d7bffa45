//! Formats of visibilities and of images, and opening and creating files of them.

use crate::fits::{ImageOptions, read_image, write_image};
use crate::format::{Format, Holds, describe, image_formats, names, start_of, visibility_formats};
use crate::uvfits::{UvfitsOptions, UvfitsReader, UvfitsWriter};
use crate::uvh5::{Uvh5Options, Uvh5Reader, Uvh5Writer};
use crate::{ColumnSink, CreateOptions, FormatError, Result, VisColumn};
use cittert_arrays::{Image, VisibilityHeader, VisibilitySource};
use std::path::Path;

/// An output that was begun, and what the format could not keep of the header.
pub struct Created {
    /// Where to write the blocks.
    pub sink: Box<dyn ColumnSink>,
    /// What was changed or lost, one sentence each, for the user and for the history.
    pub notes: Vec<String>,
}

/// A format of visibilities on disk.
pub trait VisibilityFormat: Format {
    /// Open a file to read.
    ///
    /// # Errors
    /// Whatever is wrong with the file, with the place in it.
    fn open(&self, path: &Path) -> Result<Box<dyn VisibilitySource>>;

    /// Columns that a file has beside the data.
    ///
    /// # Errors
    /// Whatever is wrong with the file.
    fn columns(&self, _path: &Path) -> Result<Vec<VisColumn>> {
        Ok(Vec::new())
    }

    /// Open a column of a file to read.
    ///
    /// # Errors
    /// A column that there is not, or as [`VisibilityFormat::open`].
    fn open_column(&self, path: &Path, column: VisColumn) -> Result<Box<dyn VisibilitySource>> {
        if column == VisColumn::Data {
            return self.open(path);
        }
        Err(FormatError::unsupported(path, format!("there is no column {:?}: {} has only \"data\"", column.name(), self.name())))
    }

    /// True where a file may have this column beside the data.
    fn keeps(&self, _column: VisColumn) -> bool {
        false
    }

    /// Begin a file for sets with this header; `None` where the format is only read.
    ///
    /// # Errors
    /// An existing output that may not be overwritten, a header or options that the format cannot hold, or whatever the disk says.
    fn create(&self, path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Option<Created>>;
}

/// Refuse what only UVH5 can do, and columns that a format does not keep.
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

/// A format of images on disk.
pub trait ImageFormat: Format {
    /// Read an image.
    ///
    /// # Errors
    /// Whatever is wrong with the file, with the place in it.
    fn read(&self, path: &Path) -> Result<Image>;

    /// Write an image.
    ///
    /// # Errors
    /// An existing output that may not be overwritten, or whatever the disk says.
    fn write(&self, path: &Path, image: &Image, overwrite: bool) -> Result<()>;
}

pub(crate) struct Uvh5;

impl Format for Uvh5 {
    fn name(&self) -> &'static str {
        "UVH5"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["uvh5", "h5", "hdf5"]
    }

    fn description(&self) -> &'static str {
        "the native format (HDF5); holds everything, boresight sets too"
    }

    fn sniff(&self, path: &Path, start: &[u8]) -> bool {
        start.starts_with(crate::h5::SIGNATURE) && crate::h5::has(path, "Data/visdata")
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Visibilities(self)
    }
}

impl VisibilityFormat for Uvh5 {
    fn open(&self, path: &Path) -> Result<Box<dyn VisibilitySource>> {
        Ok(Box::new(Uvh5Reader::open(path)?))
    }

    fn columns(&self, path: &Path) -> Result<Vec<VisColumn>> {
        Uvh5Reader::columns(path)
    }

    fn open_column(&self, path: &Path, column: VisColumn) -> Result<Box<dyn VisibilitySource>> {
        Ok(Box::new(Uvh5Reader::open_column(path, column)?))
    }

    fn keeps(&self, _: VisColumn) -> bool {
        true
    }

    fn create(&self, path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Option<Created>> {
        let CreateOptions { overwrite, append, compression, columns } = options.clone();
        let how = Uvh5Options { overwrite, compression: compression.unwrap_or_default(), columns };
        let writer = if append { Uvh5Writer::append(path, header, how)? } else { Uvh5Writer::create(path, header, how)? };
        Ok(Some(Created { sink: Box::new(writer), notes: Vec::new() }))
    }
}

pub(crate) struct Uvfits;

impl Format for Uvfits {
    fn name(&self) -> &'static str {
        "UVFITS"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["uvfits", "uvf"]
    }

    fn description(&self) -> &'static str {
        "FITS random groups with AIPS tables; Jy, and a phase centre on the sky"
    }

    fn sniff(&self, _: &Path, start: &[u8]) -> bool {
        let card = |key: &str, value: &str| {
            start.chunks_exact(80).any(|c| {
                let text = String::from_utf8_lossy(c);
                text.starts_with(&format!("{key:<8}=")) && text[9..].split('/').next().is_some_and(|v| v.trim() == value)
            })
        };
        start.starts_with(b"SIMPLE  =") && card("GROUPS", "T") && card("NAXIS1", "0")
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
}

pub(crate) struct FitsImage;

impl Format for FitsImage {
    fn name(&self) -> &'static str {
        "FITS image"
    }

    fn extensions(&self) -> &'static [&'static str] {
        &["fits", "fit", "fts", "fits.gz"]
    }

    fn description(&self) -> &'static str {
        "images and cubes in K, Jy/pixel or Jy/beam, on the sky or along a boresight"
    }

    fn sniff(&self, path: &Path, start: &[u8]) -> bool {
        let fits = start.starts_with(b"SIMPLE  =") && !Uvfits.sniff(path, start);
        fits || (start.starts_with(&[0x1f, 0x8b]) && crate::fits::is_compressed_fits(path))
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Images(self)
    }
}

impl ImageFormat for FitsImage {
    fn read(&self, path: &Path) -> Result<Image> {
        read_image(path)
    }

    fn write(&self, path: &Path, image: &Image, overwrite: bool) -> Result<()> {
        write_image(path, image, ImageOptions { overwrite, double: false })
    }
}

pub(crate) fn visibility_names() -> String {
    names(visibility_formats().map(|f| (f.name(), f.extensions())))
}

pub(crate) fn image_names() -> String {
    names(image_formats().map(|f| (f.name(), f.extensions())))
}

/// The format of a file of visibilities, by its content.
///
/// # Errors
/// A file that is missing, empty, a directory, or of no known format; the error says what it seems to be.
pub fn visibility_format(path: &Path) -> Result<&'static dyn VisibilityFormat> {
    if path.join("table.dat").is_file() {
        #[cfg(feature = "ms")]
        return Ok(&crate::ms::MeasurementSet);
        #[cfg(not(feature = "ms"))]
        return Err(FormatError::unsupported(
            path,
            "this is a Measurement Set, which this build does not read (feature `ms`): export it as UVFITS (CASA: exportuvfits) first",
        ));
    }
    let start = start_of(path)?;
    visibility_formats().find(|f| f.sniff(path, &start)).ok_or_else(|| FormatError::NotA {
        path: path.into(),
        expected: format!("visibilities: {}", visibility_names()),
        found: format!("it is {}", describe(&start)),
    })
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
/// As [`open_visibilities`]; a column that there is not.
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

/// As [`create_visibilities`], with more to choose.
///
/// # Errors
/// As [`create_visibilities`]; an option that the format does not know.
pub fn create_visibilities_with(path: &Path, header: &VisibilityHeader, options: &CreateOptions) -> Result<Created> {
    let unknown = || format_to_write(path).err().unwrap_or_else(|| FormatError::unsupported(path, "this format is only read"));
    format_to_write(path)?.create(path, header, options)?.ok_or_else(unknown)
}

/// The format of visibilities that the ending of a name stands for.
///
/// # Errors
/// An ending that no format has.
pub fn format_to_write(path: &Path) -> Result<&'static dyn VisibilityFormat> {
    let end = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    visibility_formats().find(|f| f.extensions().contains(&end.as_str())).ok_or_else(|| FormatError::NotA {
        path: path.into(),
        expected: format!("a name that ends as one of {}", visibility_names()),
        found: if end.is_empty() { "the name has no ending".into() } else { format!("the name ends in .{end}") },
    })
}

/// The format of an image, by its content.
///
/// # Errors
/// A file that is missing, empty, a directory, or of no known format; the error says what it seems to be.
pub fn image_format(path: &Path) -> Result<&'static dyn ImageFormat> {
    let start = start_of(path)?;
    image_formats().find(|f| f.sniff(path, &start)).ok_or_else(|| FormatError::NotA {
        path: path.into(),
        expected: format!("an image: {}", image_names()),
        found: format!("it is {}", if Uvfits.sniff(path, &start) { "UVFITS (visibilities)".into() } else { describe(&start) }),
    })
}

/// Read an image of any format.
///
/// # Errors
/// As [`image_format`], or whatever is wrong inside the file.
pub fn open_image(path: &Path) -> Result<Image> {
    image_format(path)?.read(path)
}

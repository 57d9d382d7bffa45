//! The options of `convert`.

use super::cut::Cut;
use crate::cli::options::{ColumnArgs, SetArgs};
use cittert_formats::Compression;
use clap::Args;
use std::path::PathBuf;

/// Options of `convert`.
#[derive(Debug, Args)]
pub struct ConvertArgs {
    // A file of any kind, or files of visibilities.
    #[command(flatten)]
    pub(super) input: SetArgs,
    /// File to write. The ending of its name chooses the format.
    #[arg(value_name = "OUT", required = true)]
    pub(super) output: PathBuf,
    #[command(flatten)]
    pub(super) column: ColumnArgs,
    /// Write visibilities as several files, cut along axes: time, channel, baseline, pol. `time=20` makes 20 parts; without a number, each
    /// time is a part. The names of the files are OUT with the part before the ending, such as OUT-time03-polXX.uvh5.
    #[arg(long, value_name = "AXIS[=N]", value_delimiter = ',', conflicts_with = "append")]
    pub(super) split: Vec<Cut>,
    /// Compression of a UVH5 file: none, lzf, gzip, or gzip-1 to gzip-9.
    #[arg(long, value_name = "NAME", value_parser = compression)]
    pub(super) compression: Option<Compression>,
    /// Append rows to an existing UVH5 file with the same antennas, channels and phase centres.
    #[arg(long, conflicts_with = "overwrite")]
    pub(super) append: bool,
    /// Write the four products of feeds that turn with their mounts as feeds that keep their angle on the sky would have measured them, for imagers that
    /// do not turn them.
    #[arg(long, conflicts_with = "append")]
    pub(super) derotate: bool,
    /// Write gains that are pure delays as a table of delays.
    #[arg(long)]
    pub(super) delays: bool,
    /// Replace an output that exists.
    #[arg(long)]
    pub(super) overwrite: bool,
}

fn compression(name: &str) -> std::result::Result<Compression, String> {
    let level = |text: &str| text.parse::<u8>().ok().filter(|l| (1..=9).contains(l));
    match name {
        "none" => Ok(Compression::None),
        "lzf" => Ok(Compression::Lzf),
        "gzip" => Ok(Compression::Gzip(4)),
        _ => name
            .strip_prefix("gzip-")
            .and_then(level)
            .map(Compression::Gzip)
            .ok_or_else(|| "one of none, lzf, gzip, gzip-1 to gzip-9".into()),
    }
}

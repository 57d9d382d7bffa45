//! Write a small set of every kind into a folder, for other programs to read: `cargo run --example samples -- FOLDER`.

#[path = "../tests/common/mod.rs"]
mod common;

use cittert_formats::uvh5::{Uvh5Options, Uvh5Writer};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("give a folder")?;
    let folder = Path::new(&folder);
    for (name, set) in [("earth", common::earth()), ("boresight", common::boresight())] {
        let options = Uvh5Options { overwrite: true, ..Default::default() };
        let mut writer = Uvh5Writer::create(&folder.join(format!("{name}.uvh5")), &set.header, options)?;
        let n = set.data.n_rows();
        for start in (0..n).step_by(37) {
            writer.write(&set.data.rows(start..(start + 37).min(n))?)?;
        }
        writer.complete()?;
    }
    Ok(())
}

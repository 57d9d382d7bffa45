//! Convert visibilities from any format to that of the output's name: `cargo run --example convert -- IN OUT`.

use cittert_arrays::for_each_block;
use cittert_formats::{create_visibilities, open_visibilities};
use std::io::Write;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let names: Vec<String> = std::env::args().skip(1).collect();
    let [from, to] = &names[..] else { return Err("give an input and an output".into()) };
    let mut source = open_visibilities(Path::new(from))?;
    let mut created = create_visibilities(Path::new(to), source.header(), true)?;
    for note in &created.notes {
        writeln!(std::io::stderr(), "note: {note}")?;
    }
    for_each_block::<cittert_arrays::ArrayError>(source.as_mut(), 1 << 24, |_, block| created.sink.write_block(&block))?;
    created.sink.finish()?;
    Ok(())
}

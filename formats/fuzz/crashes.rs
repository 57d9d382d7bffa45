//! Files on which a reader once crashed, or computed for many seconds: refused by name or read, and soon.

use cittert_formats::Contents;
use cittert_formats::calh5::read_gains;
use std::path::Path;
use std::time::{Duration, Instant};

#[test]
fn files_that_once_crashed_a_reader_do_no_harm() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/crashes");
    let mut n = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let begun = Instant::now();
        let name = path.file_name().unwrap().to_string_lossy();
        let text = match Contents::of(&path) {
            Err(e) => e.to_string(),
            // What lies deeper is met by the reader.
            Ok(_) if name.starts_with("chunks-beyond") => read_gains(&path).unwrap_err().to_string(),
            // Its damage makes HDF5 slow, but changes nothing that is read.
            Ok(_) if name == "enum-of-many-members.calh5" => name.to_string(),
            Ok(contents) => panic!("{name}: {contents:?}"),
        };
        assert!(text.contains(&*name), "{text}");
        assert!(begun.elapsed() < Duration::from_secs(5), "{text}: {:?}", begun.elapsed());
        n += 1;
    }
    assert!(n >= 9, "{n} files");
}

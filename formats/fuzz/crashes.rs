//! Files on which a reader once crashed: each must be refused by name, at once.

use cittert_formats::Contents;
use std::path::Path;
use std::time::{Duration, Instant};

#[test]
fn files_that_once_crashed_a_reader_are_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/crashes");
    let mut n = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let begun = Instant::now();
        let text = Contents::of(&path).unwrap_err().to_string();
        assert!(text.contains(&*path.file_name().unwrap().to_string_lossy()), "{text}");
        assert!(begun.elapsed() < Duration::from_secs(5), "{text}: {:?}", begun.elapsed());
        n += 1;
    }
    assert!(n >= 2, "{n} files");
}

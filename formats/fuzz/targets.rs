//! One test for each kind of file.

use crate::harness::{Scratch, corpus, fuzz};
use cittert_arrays::VisibilitySource;
use cittert_formats::calh5::read_gains;
use cittert_formats::fits::read_image;
use cittert_formats::layout_formats;
use cittert_formats::layouts::{ReadContext, sniff_layout};
use cittert_formats::uvfits::UvfitsReader;
use cittert_formats::uvh5::Uvh5Reader;
use cittert_formats::{Contents, read_sources};

#[test]
fn uvfits() {
    let scratch = Scratch::new("x.uvfits");
    fuzz("uvfits", &corpus("uvfits"), 6000, 4000, |bytes| {
        let Ok(mut source) = UvfitsReader::open(scratch.file(bytes)) else { return false };
        let n = source.n_rows();
        source.read_rows(0..n.min(8)).is_ok() && source.read_rows(n.saturating_sub(1)..n).is_ok()
    });
}

#[test]
fn fits() {
    let scratch = Scratch::new("x.fits");
    fuzz("fits", &corpus("fits"), 2880, 4000, |bytes| read_image(scratch.file(bytes)).is_ok());
}

#[test]
fn uvh5() {
    let scratch = Scratch::new("x.uvh5");
    fuzz("uvh5", &corpus("uvh5"), 40_000, 300, |bytes| {
        let Ok(mut source) = Uvh5Reader::open(scratch.file(bytes)) else { return false };
        let n = source.n_rows();
        source.read_rows(0..n.min(8)).is_ok()
    });
}

#[test]
fn calh5() {
    let scratch = Scratch::new("x.calh5");
    fuzz("calh5", &corpus("calh5"), 40_000, 300, |bytes| read_gains(scratch.file(bytes)).is_ok());
}

#[test]
fn layouts() {
    for format in layout_formats() {
        let inputs: Vec<Vec<u8>> = corpus("layouts").into_iter().filter(|b| sniffed(b) == Some(format.name())).collect();
        assert!(!inputs.is_empty(), "no layout in the form {}", format.name());
        fuzz(&format!("layout-{}", format.name()), &inputs, usize::MAX, 3000, |bytes| {
            let Ok(text) = std::str::from_utf8(bytes) else { return false };
            format.sniff(text, format.extension());
            format.read(text, &ReadContext { name: "x".into(), site: cittert_formats::layouts::known_site("VLA"), folder: None }).is_ok()
        });
    }
}

/// The name of the format of a text.
fn sniffed(bytes: &[u8]) -> Option<&'static str> {
    std::str::from_utf8(bytes).ok().and_then(|t| sniff_layout(t, "txt").ok()).map(|f| f.name())
}

#[test]
fn sources() {
    let scratch = Scratch::new("x.csv");
    fuzz("sources", &corpus("sources"), usize::MAX, 3000, |bytes| read_sources(scratch.file(bytes)).is_ok());
}

/// Any of the files, found by its content.
#[test]
fn contents() {
    let scratch = Scratch::new("x");
    let inputs: Vec<Vec<u8>> = ["uvfits", "fits", "layouts", "sources"].iter().flat_map(|f| corpus(f)).collect();
    fuzz("contents", &inputs, 1000, 3000, |bytes| Contents::of(scratch.file(bytes)).is_ok());
}

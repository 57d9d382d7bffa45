//! Damaged descriptions of scenes and of runs; the harness is that of the formats.

/// Where the corpus lies.
#[cfg(test)]
const CORPUS: &str = "formats/fuzz/corpus";

#[cfg(test)]
#[path = "../../formats/fuzz/harness.rs"]
#[allow(dead_code)] // texts need no scratch file
mod harness;

#[cfg(test)]
mod targets {
    use crate::harness::{corpus, fuzz};
    use cittert_arrays::ArrayLayout;
    use std::path::Path;

    fn text(bytes: &[u8], read: impl Fn(&str) -> bool) -> bool {
        std::str::from_utf8(bytes).is_ok_and(read)
    }

    #[test]
    fn scenes() {
        use cittert_arrays::{SkyFrame, SkyGrid, SpectralWindow};
        let grid = SkyGrid::new(8, 8, 1e-2, SkyFrame::Boresight).unwrap();
        let spectrum = SpectralWindow::new(vec![94e9], vec![1e9]).unwrap();
        fuzz("scene", &corpus("scenes"), usize::MAX, 3000, |bytes| {
            text(bytes, |t| cittert_phenomenology::Scene::from_toml(t).is_ok_and(|s| s.render(&grid, &spectrum).is_ok()))
        });
    }

    #[test]
    fn runs() {
        fuzz("run", &corpus("runs"), usize::MAX, 1000, |bytes| text(bytes, |t| cittert::cli::run_commands(t, Path::new("x.toml")).is_ok()));
    }

    #[test]
    fn layouts() {
        fuzz("layout", &corpus("our-layouts"), usize::MAX, 3000, |bytes| text(bytes, |t| ArrayLayout::from_toml(t).is_ok()));
    }
}

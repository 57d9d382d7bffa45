//! The order of the modules of `src/`: a module uses only modules on lower floors.

use crate::project::sources;
use crate::ties::{Ties, ties};

/// The floors from the top down. Modules on one floor do not use each other. A module that does not exist (yet) is ignored.
const FLOORS: &[&[&str]] = &[
    &["cli"],
    &["study", "plot", "cost"],
    &["verdict", "design", "display"],
    &["calibrate"],
    &["closure_imaging", "mem"],
    &["imaging", "enhance", "sensor"],
    &["deconvolve"],
    &["corrupt"],
    &["simulate"],
    &["closure", "fidelity", "misfit", "nearfield"],
    &["fourier", "lbfgs", "linalg"],
    &["values", "memory", "pages"],
    &["progress", "error", "random", "finite", "processor"],
];

/// The floor of a module, counted from the top.
fn floor(module: &str) -> Option<usize> {
    FLOORS.iter().position(|f| f.contains(&module))
}

/// The module of `src/` to which a file belongs; none for `src/lib.rs` itself.
fn module(file: &str) -> Option<&str> {
    let name = file.strip_prefix("src/")?.split('/').next()?.trim_end_matches(".rs");
    (name != "lib").then_some(name)
}

/// One line for each tie that does not lead down.
fn broken(ties: &Ties) -> Vec<String> {
    let mut out = Vec::new();
    for (file, used) in ties {
        let Some(own) = module(file) else { continue };
        let Some(own_floor) = floor(own) else {
            out.push(format!("{file}: the module {own} has no floor: give it one in tests/tidy/floors.rs"));
            continue;
        };
        for (target, tie) in used {
            let Some(other) = module(target).filter(|m| *m != own) else { continue };
            if floor(other).is_some_and(|f| f <= own_floor) {
                out.push(format!("{file}:{} uses {} of {target}: {own} may not use {other}", tie.line, tie.path));
            }
        }
    }
    out
}

#[test]
fn modules_use_only_lower_floors() {
    let broken = broken(&ties(&sources(), "src/lib.rs"));
    assert!(broken.is_empty(), "\n{} ties do not lead to a lower floor:\n{}", broken.len(), broken.join("\n"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::planted;

    #[test]
    fn a_planted_look_upwards_is_found() {
        let files = planted(&[
            ("src/lib.rs", "mod cli; mod error; mod imaging; mod mem; mod closure_imaging; mod fresh;\npub use error::Error;"),
            ("src/cli/mod.rs", "use crate::mem::Mem;"),
            ("src/error.rs", "pub struct Error;"),
            ("src/imaging.rs", "use crate::mem::Mem;\nuse crate::Error;"),
            ("src/mem/mod.rs", "mod inner;\npub use inner::Mem;"),
            ("src/mem/inner.rs", "pub struct Mem;\nfn f() -> crate::Error { super::super::closure_imaging::g() }"),
            ("src/closure_imaging.rs", "pub fn g() {}"),
            ("src/fresh.rs", ""),
        ]);
        let told = broken(&ties(&files, "src/lib.rs"));
        assert_eq!(told.len(), 3, "{told:?}");
        assert!(told[0].contains("the module fresh has no floor"), "{told:?}");
        assert!(told[1].starts_with("src/imaging.rs:1") && told[1].ends_with("imaging may not use mem"), "{told:?}");
        assert!(told[2].starts_with("src/mem/inner.rs:2") && told[2].ends_with("mem may not use closure_imaging"), "{told:?}");
    }
}

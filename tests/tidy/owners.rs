//! External packages have owners: only these files may name them.

use crate::lexer::{Token, tokens};
use crate::project::{root, sources};

/// Only files whose path begins with one of `owners` (or ends with it, after a `*`) may name the package.
struct Rule {
    package: &'static str,
    owners: &'static [&'static str],
    text: &'static str,
}

const FFT: &str = "rustfft and ndrustfft belong to src/fourier/planner";
const JOINS: &str = "only src/cli joins the chain with formats and scenes";

const SERVER: &[&str] = &["src/cli/design/server"];
const SERVED: &str = "the server of the designer is in src/cli/design/server, and the rest of it knows no sockets";

const RULES: &[Rule] = &[
    Rule { package: "rustfft", owners: &["src/fourier/planner"], text: FFT },
    Rule { package: "ndrustfft", owners: &["src/fourier/planner"], text: FFT },
    Rule { package: "argmin", owners: &["src/mem", "src/design"], text: "argmin belongs to src/mem, and to src/design where it optimises" },
    Rule {
        package: "clap",
        owners: &["src/cli", "src/main.rs"],
        text: "clap belongs to src/cli; types of options name it only in attributes under the feature cli",
    },
    Rule { package: "cittert_formats", owners: &["src/cli", "src/lib.rs"], text: JOINS },
    Rule { package: "cittert_phenomenology", owners: &["src/cli"], text: JOINS },
    Rule {
        package: "hdf5",
        owners: &["formats/src/h5", "formats/src/uvh5", "formats/src/calh5"],
        text: "hdf5 belongs to the small modules of formats",
    },
    Rule { package: "mpi", owners: &["src/cli/ranks"], text: "mpi belongs to src/cli/ranks; algorithms know the trait Ranks" },
    Rule { package: "indicatif", owners: &["src/cli"], text: "progress bars belong to src/cli; algorithms report to an Observer" },
    Rule { package: "axum", owners: SERVER, text: SERVED },
    Rule { package: "tokio", owners: SERVER, text: SERVED },
    Rule { package: "getrandom", owners: &["src/cli/design/guard.rs"], text: "only the token of the designer is random without a seed" },
];

/// The lines that name a package: as the start of a path, or alone in a `use`.
fn lines(tokens: &[Token], package: &str) -> Vec<usize> {
    let text = |i: usize| tokens.get(i).map_or("", |t| t.text.as_str());
    let named = |i: &usize| {
        let starts = *i == 0 || !["::", "."].contains(&text(i - 1));
        text(*i) == package && starts && (text(i + 1) == "::" || (*i > 0 && text(i - 1) == "use"))
    };
    (0..tokens.len()).filter(named).map(|i| tokens[i].line).collect()
}

fn owns(owner: &str, file: &str) -> bool {
    owner.strip_prefix('*').map_or_else(|| file.starts_with(owner), |end| file.ends_with(end))
}

#[test]
fn packages_are_named_by_their_owners_only() {
    let mut files = sources();
    files.insert("src/main.rs".into(), std::fs::read_to_string(root().join("src/main.rs")).unwrap());
    let mut broken = Vec::new();
    for (file, text) in &files {
        let tokens = tokens(text);
        // Types of options derive their arguments where the command line is built in.
        let derived = |line: &usize| text.lines().nth(line - 1).is_some_and(|l| l.trim_start().starts_with("#[cfg_attr(feature = \"cli\""));
        for rule in RULES.iter().filter(|r| !r.owners.iter().any(|o| owns(o, file))) {
            let named = lines(&tokens, rule.package).into_iter().filter(|line| !derived(line));
            broken.extend(named.map(|line| format!("{file}:{line} names {}: {}", rule.package, rule.text)));
        }
    }
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

#[test]
fn the_rules_see_a_package_in_every_form() {
    let found = |source: &str| !lines(&tokens(source), "rustfft").is_empty();
    assert!(found("use rustfft::FftPlanner;"));
    assert!(found("let p = rustfft::FftPlanner::new();"));
    assert!(found("use rustfft as fft;"));
    assert!(!found("// rustfft::x"));
    assert!(!found("use ndrustfft::x;"));
    assert!(!found("let a = crate::rustfft::x;"));
}

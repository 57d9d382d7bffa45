//! The graph of a crate: which file uses which, and where.

use crate::parser::{Crate, Import, Mention};
use crate::project::Files;
use crate::resolve::Named;
use std::collections::BTreeMap;

/// The line of a file that names something of another file, and the path it names.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tie {
    pub line: usize,
    pub path: String,
}

/// For each file of a crate, the files that it uses, each with the first line that does so.
pub type Ties = BTreeMap<String, BTreeMap<String, Tie>>;

/// The ties of a crate. A declaration `mod child;` and the re-export of a name of a child are not ties, because they only pass the name on.
pub fn ties(files: &Files, root: &str) -> Ties {
    let all = Crate::read(files, root);
    let mut out = Ties::new();
    for (own, module) in all.modules.iter().enumerate() {
        let of_file = out.entry(module.file.clone()).or_default();
        let mut tie = |named: Named, of: &Mention, glob: bool| {
            let target = match named {
                Named::Item(m) => m,
                // A glob takes all items of a module.
                Named::Module(m) if glob && !all.modules[m].items.is_empty() => m,
                _ => return,
            };
            let file = &all.modules[target].file;
            if *file != module.file {
                let tie = Tie { line: of.line, path: of.path.join("::") };
                of_file.entry(file.clone()).or_insert(tie);
            }
        };
        let passed_on =
            |i: &&Import| i.public && i.of.path.first().is_some_and(|first| first == "self" || module.children.contains_key(first));
        for import in module.imports.iter().filter(|i| !passed_on(i)) {
            tie(all.resolve(own, &import.of.path), &import.of, import.name.is_none());
        }
        for mention in &module.mentions {
            let named = match mention.path.as_slice() {
                [name] => all.resolve_word(own, name),
                path => all.resolve(own, path),
            };
            tie(named, mention, false);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::planted;

    fn told(sources: &[(&str, &str)]) -> Vec<String> {
        let ties = ties(&planted(sources), "x/lib.rs");
        let lines = |(from, to): (&String, &BTreeMap<String, Tie>)| {
            to.iter().map(|(file, t)| format!("{from}:{} -> {file}: {}", t.line, t.path)).collect::<Vec<_>>()
        };
        ties.iter().flat_map(lines).collect()
    }

    #[test]
    fn uses_and_paths_are_ties_and_declarations_are_not() {
        let found = told(&[
            ("x/lib.rs", "pub mod a;\npub mod b;\npub use a::A;"),
            ("x/a.rs", "pub struct A;\nfn f() {\n    crate::b::g();\n}"),
            ("x/b.rs", "use super::*;\npub fn g() {}\n// crate::a::A\n#[cfg(test)] mod tests { use crate::a::A; }"),
        ]);
        assert_eq!(found, ["x/a.rs:3 -> x/b.rs: crate::b::g"]);
    }

    #[test]
    fn a_re_export_is_a_tie_where_the_name_is_used_as_well() {
        let parent = |rest| told(&[("x/lib.rs", rest), ("x/a.rs", "pub struct A;\npub fn f() {}")]);
        assert_eq!(parent("mod a;\npub use a::{A, f};\nfn g(a: A) { f() }"), ["x/lib.rs:3 -> x/a.rs: A"]);
        assert_eq!(parent("mod a;\npub(crate) use a::f;\nfn g() { f() }"), ["x/lib.rs:3 -> x/a.rs: f"]);
        assert_eq!(parent("mod a;\nuse a::A;"), ["x/lib.rs:2 -> x/a.rs: a::A"]);
        assert!(parent("mod a;\npub use a::A;").is_empty());
    }

    #[test]
    fn names_from_a_glob_tie_to_the_file_that_defines_them() {
        let found = told(&[
            ("x/lib.rs", "mod a; mod b; mod c;"),
            ("x/a.rs", "pub use crate::c::*;"),
            ("x/b.rs", "use crate::a::*;\nfn f(c: C) -> Other { c.d() }"),
            ("x/c.rs", "pub struct C;"),
        ]);
        assert_eq!(found, ["x/a.rs:1 -> x/c.rs: crate::c", "x/b.rs:2 -> x/c.rs: C"]);
    }
}

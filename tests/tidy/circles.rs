//! No two files of a crate use each other, neither directly nor through other files.

use crate::project::{CRATES, sources};
use crate::ties::{Ties, ties};
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// The files that `from` uses, directly or through others, each with the file through which it is reached first.
fn reached<'a>(ties: &'a Ties, from: &'a str) -> BTreeMap<&'a str, &'a str> {
    let (mut through, mut next) = (BTreeMap::new(), VecDeque::from([from]));
    while let Some(file) = next.pop_front() {
        for to in ties.get(file).into_iter().flat_map(BTreeMap::keys) {
            if !through.contains_key(to.as_str()) {
                through.insert(to.as_str(), file);
                next.push_back(to);
            }
        }
    }
    through
}

/// One text for each group of files that use each other: its files, and its shortest loop line by line.
fn circles(ties: &Ties) -> Vec<String> {
    let reached: BTreeMap<&str, BTreeMap<&str, &str>> = ties.keys().map(|f| (f.as_str(), reached(ties, f))).collect();
    let (mut out, mut told) = (Vec::new(), BTreeSet::new());
    for file in reached.keys() {
        let together = |other: &&str| reached[file].contains_key(other) && reached.get(other).is_some_and(|r| r.contains_key(file));
        let group: Vec<&str> = reached.keys().copied().filter(together).collect();
        if group.is_empty() || !told.insert(group.clone()) {
            continue;
        }
        let shortest = group.iter().map(|f| shortest_loop(&reached[f], f)).min_by_key(Vec::len).unwrap();
        let mut text = format!("{} files use each other: {}", group.len(), group.join(", "));
        for pair in shortest.windows(2) {
            let tie = &ties[pair[0]][pair[1]];
            text += &format!("\n    {}:{} uses {} of {}", pair[0], tie.line, tie.path, pair[1]);
        }
        out.push(text);
    }
    out
}

/// The files of the shortest loop from `file` back to it.
fn shortest_loop<'a>(through: &BTreeMap<&'a str, &'a str>, file: &'a str) -> Vec<&'a str> {
    let mut way = vec![file];
    loop {
        let last = through[way[way.len() - 1]];
        way.push(last);
        if last == file {
            way.reverse();
            return way;
        }
    }
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let files = sources();
    let found: Vec<String> = CRATES.iter().flat_map(|root| circles(&ties(&files, root))).collect();
    assert!(
        found.is_empty(),
        "\n{} circles; move what several files share into a file below all of them:\n{}",
        found.len(),
        found.join("\n")
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::planted;

    fn found(sources: &[(&str, &str)]) -> Vec<String> {
        circles(&ties(&planted(sources), "x/lib.rs"))
    }

    #[test]
    fn a_planted_circle_is_found_through_a_re_export() {
        let told = found(&[
            ("x/lib.rs", "mod a;\nmod b;\nmod c;"),
            ("x/a/mod.rs", "mod inner;\npub use inner::Inner;"),
            ("x/a/inner.rs", "\nuse crate::b::*;\npub struct Inner(B);"),
            ("x/b.rs", "pub struct B;\nfn f() { crate::c::g() }"),
            ("x/c.rs", "use super::a::Inner;\npub fn g() {}"),
        ]);
        assert_eq!(told.len(), 1);
        for words in [
            "3 files use each other: x/a/inner.rs, x/b.rs, x/c.rs",
            "x/a/inner.rs:2 uses crate::b of x/b.rs",
            "x/b.rs:2 uses crate::c::g of x/c.rs",
            "x/c.rs:1 uses super::a::Inner of x/a/inner.rs",
        ] {
            assert!(told[0].contains(words), "{words:?} is not in\n{}", told[0]);
        }
    }

    #[test]
    fn a_parent_that_uses_its_child_and_is_used_by_it_is_a_circle() {
        let parent = "mod b;\npub use b::B;\npub struct A;\nconst TABLE: &[B] = &[];";
        let tree = |child| found(&[("x/lib.rs", "mod a;"), ("x/a/mod.rs", parent), ("x/a/b.rs", child)]);
        assert!(tree("use super::A;\npub struct B(A);")[0].contains("x/a/mod.rs:4 uses B of x/a/b.rs"));
        assert!(tree("pub struct B;").is_empty());
    }

    #[test]
    fn a_parent_that_only_declares_and_re_exports_is_no_part_of_a_circle() {
        let told = found(&[
            ("x/lib.rs", "mod a;"),
            ("x/a/mod.rs", "mod b;\nmod c;\npub use b::B;\npub use c::C;"),
            ("x/a/b.rs", "use super::C;\npub struct B(C);"),
            ("x/a/c.rs", "pub struct C;\n#[cfg(test)]\nmod tests { use crate::a::B; }"),
        ]);
        assert!(told.is_empty(), "{told:?}");
    }
}

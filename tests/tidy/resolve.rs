//! Finds the file that defines what a path names: through imports, re-exports and globs.

use crate::parser::Crate;

/// What a path names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Named {
    /// A module of the crate.
    Module(usize),
    /// Something that this module defines.
    Item(usize),
    /// A name of another crate, a local variable, or a type parameter.
    Outside,
}

/// A module and a name that are being looked up, and whether as a module. A second look-up of the same would not end.
type Seen = Vec<(usize, String, bool)>;

impl Crate {
    /// What `path` names in the module `own`.
    pub fn resolve(&self, own: usize, path: &[String]) -> Named {
        self.walk(own, path, false, &mut Seen::new())
    }

    /// What the single word `name` names in the module `own`, if it comes from a glob import or a re-export. An explicit import that is no
    /// re-export is a tie of its own.
    pub fn resolve_word(&self, own: usize, name: &str) -> Named {
        let of_import = self.modules[own].imports.iter().find(|i| i.name.as_deref() == Some(name));
        match of_import {
            Some(import) if import.public => self.resolve(own, &import.of.path),
            Some(_) => Named::Outside,
            None => self.by_glob(own, name, false, &mut Seen::new()),
        }
    }

    /// `as_module`: the path is followed by `::`, so that a module is meant rather than a function of the same name.
    fn walk(&self, own: usize, path: &[String], as_module: bool, seen: &mut Seen) -> Named {
        let mut at = Named::Module(own);
        for (i, name) in path.iter().enumerate() {
            let last = i + 1 == path.len();
            let Named::Module(module) = at else { return at };
            at = match name.as_str() {
                "crate" => Named::Module(0),
                "self" => Named::Module(module),
                "super" => self.modules[module].parent.map_or(Named::Outside, Named::Module),
                "Self" => Named::Outside,
                name => match self.look_up(module, name, as_module || !last, seen) {
                    // A name that a macro defines.
                    Named::Outside if i > 0 => Named::Item(module),
                    found => found,
                },
            };
        }
        at
    }

    fn look_up(&self, module: usize, name: &str, as_module: bool, seen: &mut Seen) -> Named {
        let this = (module, name.to_owned(), as_module);
        if seen.contains(&this) {
            return Named::Outside;
        }
        seen.push(this);
        let m = &self.modules[module];
        let child = m.children.get(name).map(|c| Named::Module(*c));
        let item = m.items.contains(name).then_some(Named::Item(module));
        let found = if as_module { child.or(item) } else { item };
        let found = found.unwrap_or_else(|| {
            let named = |i: &&crate::parser::Import| i.name.as_deref() == Some(name);
            let mut imported = m.imports.iter().filter(named).map(|i| self.walk(module, &i.of.path, as_module, &mut seen.clone()));
            imported.find(|f| *f != Named::Outside).or(child).unwrap_or_else(|| self.by_glob(module, name, as_module, seen))
        });
        seen.pop();
        found
    }

    fn by_glob(&self, module: usize, name: &str, as_module: bool, seen: &mut Seen) -> Named {
        for glob in self.modules[module].imports.iter().filter(|i| i.name.is_none()) {
            let Named::Module(target) = self.walk(module, &glob.of.path, true, &mut seen.clone()) else { continue };
            let found = self.look_up(target, name, as_module, &mut seen.clone());
            if found != Named::Outside {
                return found;
            }
        }
        Named::Outside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::planted;

    const TREE: &[(&str, &str)] = &[
        ("x/lib.rs", "mod a; mod b; pub use a::x::X;"),
        (
            "x/a/mod.rs",
            "pub mod x; mod y; pub mod run; pub use x::X as Y; pub use y::*; pub use run::run; pub fn own() {} pub use crate::b::Loop;",
        ),
        ("x/a/x.rs", "pub struct X;"),
        ("x/a/y.rs", "pub enum Glob { One } pub use super::x::X as Deep;"),
        ("x/a/run.rs", "pub fn run() {} pub fn more() {}"),
        ("x/b.rs", "use crate::a; use super::a::Glob; pub use crate::a::Loop;"),
    ];

    /// The file and kind of what a path names in the module `b`.
    fn in_b(path: &str) -> String {
        let all = Crate::read(&planted(TREE), "x/lib.rs");
        let own = all.modules.iter().position(|m| m.file == "x/b.rs").unwrap();
        let path: Vec<String> = path.split("::").map(str::to_owned).collect();
        match all.resolve(own, &path) {
            Named::Module(m) => format!("module {}", all.modules[m].file),
            Named::Item(m) => format!("item {}", all.modules[m].file),
            Named::Outside => "outside".to_owned(),
        }
    }

    #[test]
    fn re_exports_lead_to_the_defining_file() {
        assert_eq!(in_b("crate::X"), "item x/a/x.rs");
        assert_eq!(in_b("a::Y"), "item x/a/x.rs");
        assert_eq!(in_b("super::a::Glob::One"), "item x/a/y.rs");
        assert_eq!(in_b("Glob::One"), "item x/a/y.rs");
        assert_eq!(in_b("a::Deep"), "item x/a/x.rs");
        assert_eq!(in_b("a::own"), "item x/a/mod.rs");
    }

    #[test]
    fn a_module_and_a_function_of_one_name_are_told_apart() {
        assert_eq!(in_b("a::run"), "item x/a/run.rs");
        assert_eq!(in_b("a::run::more"), "item x/a/run.rs");
        assert_eq!(in_b("crate::a::x"), "module x/a/x.rs");
    }

    #[test]
    fn names_of_macros_belong_to_their_module_and_other_crates_are_outside() {
        assert_eq!(in_b("a::made_by_a_macro"), "item x/a/mod.rs");
        assert_eq!(in_b("std::fs::read"), "outside");
        assert_eq!(in_b("a::Loop"), "item x/a/mod.rs");
    }
}

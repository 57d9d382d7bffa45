//! Reads the modules of a crate: what each defines, imports and mentions. Code for tests is left out.

use crate::lexer::{Token, closing, tokens, without_tests};
use crate::project::Files;
use std::collections::{BTreeMap, BTreeSet};

/// An imported or mentioned path, with its place.
#[derive(Debug, Clone)]
pub struct Mention {
    pub path: Vec<String>,
    pub line: usize,
}

/// One name (or all names, for `None`) that a `use` brings into a module.
#[derive(Debug)]
pub struct Import {
    pub name: Option<String>,
    /// True for a re-export: `pub use` or `pub(crate) use`.
    pub public: bool,
    pub of: Mention,
}

/// A module: a file, or a part of one in braces.
#[derive(Debug, Default)]
pub struct Module {
    /// The file's path from the root of the project.
    pub file: String,
    pub parent: Option<usize>,
    pub children: BTreeMap<String, usize>,
    /// Names of the items that the module defines.
    pub items: BTreeSet<String>,
    pub imports: Vec<Import>,
    pub mentions: Vec<Mention>,
}

/// The modules of a crate; the first is its root.
#[derive(Debug)]
pub struct Crate {
    pub modules: Vec<Module>,
}

const DEFINING: [&str; 8] = ["struct", "enum", "fn", "trait", "const", "static", "type", "union"];

impl Crate {
    /// Read a crate from its root file on.
    pub fn read(files: &Files, root: &str) -> Self {
        let mut all = Self { modules: Vec::new() };
        let folder = root.rsplit_once('/').map_or("", |(folder, _)| folder);
        all.read_file(files, root, folder, None);
        all
    }

    /// Read a file as a new module; its children lie in `folder`.
    fn read_file(&mut self, files: &Files, file: &str, folder: &str, parent: Option<usize>) -> usize {
        let text = files.get(file).unwrap_or_else(|| panic!("{file} is declared as a module and does not exist"));
        let own = self.add(file, parent);
        self.read_body(files, own, folder, &without_tests(&tokens(text)));
        own
    }

    fn add(&mut self, file: &str, parent: Option<usize>) -> usize {
        self.modules.push(Module { file: file.to_owned(), parent, ..Module::default() });
        self.modules.len() - 1
    }

    fn read_body(&mut self, files: &Files, own: usize, folder: &str, tokens: &[Token]) {
        let text = |i: usize| tokens.get(i).map_or("", |t| t.text.as_str());
        let is_name = |i: usize| tokens.get(i).is_some_and(Token::is_name);
        let (mut i, mut depth) = (0, 0);
        while i < tokens.len() {
            match text(i) {
                "{" => depth += 1,
                "}" => depth -= 1,
                "use" => {
                    let end = tokens[i..].iter().position(|t| t.text == ";").map_or(tokens.len(), |n| i + n);
                    let public = i > 0 && ["pub", ")"].contains(&text(i - 1));
                    self.modules[own].imports.extend(imports(&[], &tokens[i + 1..end], public));
                    i = end;
                }
                "mod" if is_name(i + 1) && text(i + 2) == ";" => {
                    let name = text(i + 1);
                    let (file, folder_of) = (format!("{folder}/{name}.rs"), format!("{folder}/{name}"));
                    let file = if files.contains_key(&file) { file } else { format!("{folder_of}/mod.rs") };
                    let child = self.read_file(files, &file, &folder_of, Some(own));
                    self.modules[own].children.insert(name.to_owned(), child);
                    i += 2;
                }
                "mod" if is_name(i + 1) && text(i + 2) == "{" => {
                    let (name, end) = (text(i + 1), closing(tokens, i + 2));
                    let child = self.add(&self.modules[own].file.clone(), Some(own));
                    self.read_body(files, child, &format!("{folder}/{name}"), &tokens[i + 3..end]);
                    self.modules[own].children.insert(name.to_owned(), child);
                    i = end;
                }
                word if depth == 0 && DEFINING.contains(&word) && is_name(i + 1) => {
                    self.modules[own].items.insert(text(i + 1).to_owned());
                }
                "macro_rules" if is_name(i + 2) => {
                    self.modules[own].items.insert(text(i + 2).to_owned());
                }
                _ if is_name(i) && (i == 0 || !["::", "."].contains(&text(i - 1))) => {
                    let (line, mut path) = (tokens[i].line, vec![text(i).to_owned()]);
                    while text(i + 1) == "::" && is_name(i + 2) {
                        i += 2;
                        path.push(text(i).to_owned());
                    }
                    // A name alone counts where it can only be a type, a constant, a function or a macro.
                    let called = ["(", "!", "::"].contains(&text(i + 1));
                    if path.len() > 1 || called || path[0].starts_with(char::is_uppercase) {
                        self.modules[own].mentions.push(Mention { path, line });
                    }
                }
                _ => {}
            }
            i += 1;
        }
    }
}

/// What the tree of a `use` brings into the module.
fn imports(prefix: &[String], tokens: &[Token], public: bool) -> Vec<Import> {
    let Some(first) = tokens.first() else { return Vec::new() };
    let (mut path, mut name, mut i) = (prefix.to_vec(), None, 0);
    while let Some(token) = tokens.get(i) {
        match token.text.as_str() {
            "::" => {}
            "*" => return vec![Import { name: None, public, of: Mention { path, line: token.line } }],
            "{" => {
                let inner = &tokens[i + 1..closing(tokens, i)];
                return branches(inner).into_iter().flat_map(|b| imports(&path, b, public)).collect();
            }
            "as" => {
                name = tokens.get(i + 1).map(|t| t.text.clone());
                break;
            }
            // `a::{self}` imports `a`.
            "self" if !path.is_empty() && i + 1 == tokens.len() && tokens.len() == 1 => {}
            word => path.push(word.to_owned()),
        }
        i += 1;
    }
    let name = name.or_else(|| path.last().cloned());
    vec![Import { name, public, of: Mention { path, line: first.line } }]
}

/// The parts of a list between its commas, not counting those in inner braces.
fn branches(tokens: &[Token]) -> Vec<&[Token]> {
    let (mut out, mut start, mut depth) = (Vec::new(), 0, 0);
    for (i, token) in tokens.iter().enumerate() {
        match token.text.as_str() {
            "{" => depth += 1,
            "}" => depth -= 1,
            "," if depth == 0 => {
                out.push(&tokens[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    out.push(&tokens[start..]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::planted;

    #[test]
    fn a_tree_of_imports_is_read_whole() {
        let found: Vec<String> = imports(&[], &tokens("a::{self, b as c, d::{e, f::*}, g}"), false)
            .iter()
            .map(|i| format!("{}={}", i.name.as_deref().unwrap_or("*"), i.of.path.join("::")))
            .collect();
        assert_eq!(found, ["a=a", "c=a::b", "e=a::d::e", "*=a::d::f", "g=a::g"]);
    }

    #[test]
    fn modules_are_found_in_files_folders_and_braces() {
        let files = planted(&[
            ("x/lib.rs", "mod a; pub mod b { pub mod c; pub fn f() {} }\n#[cfg(test)] mod d;"),
            ("x/a/mod.rs", "pub struct A { x: u8 } impl A { pub fn new() {} }"),
            ("x/b/c.rs", "pub const C: u8 = 1;"),
        ]);
        let all = Crate::read(&files, "x/lib.rs");
        let told: Vec<(&str, Vec<&String>)> = all.modules.iter().map(|m| (m.file.as_str(), m.items.iter().collect())).collect();
        assert_eq!(
            told,
            [
                ("x/lib.rs", vec![]),
                ("x/a/mod.rs", vec![&"A".to_owned()]),
                ("x/lib.rs", vec![&"f".to_owned()]),
                ("x/b/c.rs", vec![&"C".to_owned()])
            ]
        );
    }
}

//! The commands that the front page and the book show are run, in the order of each page, in a folder of their own.
//!
//! A block of code without a language, or with `sh`, `bash` or `console`, is run. HTML comments, which readers do not see, mark the rest:
//!
//! - `<!-- first: COMMANDS -->` runs commands that make the files that the next blocks need.
//! - `<!-- small: FROM => TO -->` replaces a text in all later commands of the page, so that the test takes seconds.
//! - `<!-- public data -->` before a block: it needs a file of a telescope, which this project does not contain, and is not run.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

/// A command line is run if its first word is one of these.
const RUN: [&str; 4] = ["cittert", "mkdir", "printf", "sed"];
/// Commands that build the program or read what it wrote. They are not run.
const NOT_RUN: [&str; 5] = ["make", "cargo", "man", "git", "mpirun"];

/// What a page wants to be run, in order.
#[derive(Debug, Default, PartialEq)]
struct Page {
    commands: Vec<String>,
    small: Vec<(String, String)>,
    skipped: usize,
}

impl Page {
    fn read(text: &str) -> Self {
        let (mut page, mut lines) = (Self::default(), text.lines().peekable());
        let mut public = false;
        while let Some(line) = lines.next() {
            let trimmed = line.trim_start();
            if let Some(rest) = trimmed.strip_prefix("<!-- ") {
                let mut comment = rest.to_owned();
                while !comment.contains("-->") {
                    let Some(next) = lines.next() else { break };
                    comment = comment + "\n" + next;
                }
                let comment = comment.split("-->").next().unwrap().trim();
                if let Some(commands) = comment.strip_prefix("first:") {
                    page.block(commands, false);
                } else if let Some((from, to)) = comment.strip_prefix("small:").and_then(|c| c.split_once("=>")) {
                    page.small.push((from.trim().to_owned(), to.trim().to_owned()));
                }
                public |= comment.starts_with("public data");
            } else if let Some(language) = trimmed.strip_prefix("```") {
                let body: Vec<&str> = lines.by_ref().take_while(|l| !l.trim_start().starts_with("```")).collect();
                if ["", "sh", "bash", "console"].contains(&language) {
                    page.block(&body.join("\n"), std::mem::take(&mut public));
                }
            } else if line.starts_with("    cittert ") {
                page.block(trimmed, std::mem::take(&mut public));
            }
        }
        page
    }

    /// The commands of a block: a line that ends in a backslash goes on in the next one.
    fn block(&mut self, text: &str, public: bool) {
        for command in text.replace("\\\n", " ").lines() {
            let command = command.trim().trim_start_matches("$ ").split("  #").next().unwrap();
            let first = command.split(' ').next().unwrap();
            if first.is_empty() || NOT_RUN.contains(&first) || !first.chars().all(|c| c.is_ascii_lowercase()) {
                continue;
            }
            if public {
                self.skipped += 1;
            } else if RUN.contains(&first) {
                let small = self.small.iter().fold(command.to_owned(), |c, (from, to)| c.replace(from, to));
                self.commands.push(small);
            }
        }
    }
}

/// All pages, with their path in the project.
fn pages() -> Vec<(String, Page)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut todo, mut found): (Vec<PathBuf>, Vec<(String, Page)>) = (vec![root.join("docs"), root.join("README.md")], Vec::new());
    while let Some(path) = todo.pop() {
        if path.is_dir() {
            todo.extend(std::fs::read_dir(&path).unwrap().map(|e| e.unwrap().path()));
        } else if path.extension().is_some_and(|e| e == "md") {
            let name = path.strip_prefix(root).unwrap().display().to_string();
            found.push((name, Page::read(&std::fs::read_to_string(&path).unwrap())));
        }
    }
    found.sort_by(|a, b| a.0.cmp(&b.0));
    found
}

/// Run the commands of a page; the first that fails, with what it said.
fn run(name: &str, page: &Page) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    for shared in ["docs", "phenomenology", "arrays", "tests"] {
        std::os::unix::fs::symlink(Path::new(env!("CARGO_MANIFEST_DIR")).join(shared), folder.path().join(shared)).unwrap();
    }
    let programs = Path::new(env!("CARGO_BIN_EXE_cittert")).parent().unwrap().to_owned();
    let path = std::env::join_paths([programs].into_iter().chain(std::env::split_paths(&std::env::var_os("PATH").unwrap()))).unwrap();
    for command in &page.commands {
        let mut shell = Command::new("sh");
        shell.args(["-c", command]).current_dir(folder.path()).env("PATH", &path).env("HOME", folder.path());
        let out = shell.output().unwrap();
        if !out.status.success() {
            return Err(format!("{name}: {command}\n{}", String::from_utf8_lossy(&out.stderr)));
        }
    }
    Ok(())
}

#[test]
fn the_commands_of_the_pages_work() {
    let pages = Mutex::new(pages());
    let failed = Mutex::new(Vec::new());
    let count: usize = pages.lock().unwrap().iter().map(|p| p.1.commands.len()).sum();
    assert!(count > 40, "only {count} commands were found");
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let Some((name, page)) = pages.lock().unwrap().pop() else { break };
                    if let Err(what) = run(&name, &page) {
                        failed.lock().unwrap().push(what);
                    }
                }
            });
        }
    });
    let failed = failed.into_inner().unwrap();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn blocks_and_marks_are_read() {
    let text = "<!-- small: --size 512 => --size 64 -->\n<!-- first:\nprintf x > a\ncittert info a\n-->\n```sh\n$ cittert clean a \\\n    --size 512 -o c  # a remark\nmake demo\n```\n\
                <!-- public data -->\n```\ncittert info b\n```\n    cittert info c\n\n```toml\ncittert = 1\n```\n";
    let page = Page::read(text);
    assert_eq!(page.commands, ["printf x > a", "cittert info a", "cittert clean a      --size 64 -o c", "cittert info c"]);
    assert_eq!(page.skipped, 1);
}

//! Names of files as users write them: themselves, patterns with `*`, `?` and `[...]`, and lists `@files.txt`.

use crate::cli::failure::{Failure, Result, ensure};
use std::path::{Component, Path, PathBuf};

/// Depth of a path that a pattern may have. It guards against nothing but a slip of the pen.
const DEEPEST: usize = 64;

/// The files that words stand for, in their order; those of a pattern sorted by name. A file that exists under the very word is meant by it.
///
/// # Errors
/// A pattern that no file has, a list that cannot be read or names no file.
pub(super) fn expanded(words: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for word in words {
        match word.to_str().and_then(|w| w.strip_prefix('@')).filter(|_| word.symlink_metadata().is_err()) {
            Some(list) => files.extend(of_list(Path::new(list))?),
            None => files.extend(of_word(word)?),
        }
    }
    Ok(files)
}

/// The files that a list names, one name or pattern a line. Blank lines and lines that begin with `#` are skipped. Names that do not begin at the
/// root are those of the present folder, or else of the folder of the list.
fn of_list(list: &Path) -> Result<Vec<PathBuf>> {
    let text = cittert_formats::read_text(list)?;
    let folder = list.parent().unwrap_or(Path::new(""));
    let mut files = Vec::new();
    let lines = text.lines().map(str::trim).enumerate().filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    for (k, line) in lines {
        let at = |why: String| Failure::message(format!("{}, line {}: {why}", list.display(), k + 1));
        ensure!(!line.starts_with('@') || Path::new(line).exists(), at(format!("{line}: a list cannot name another list")));
        let (here, beside) = (PathBuf::from(line), folder.join(line));
        let found = of_word(&here).ok().filter(|f| f.iter().all(|f| f.symlink_metadata().is_ok()));
        let found = match found {
            Some(found) => found,
            None => of_word(&beside).map_err(|e| at(e.to_string()))?,
        };
        if let Some(missing) = found.iter().find(|f| f.symlink_metadata().is_err()) {
            return Err(at(format!("{}: there is no such file", missing.display())));
        }
        files.extend(found);
    }
    ensure!(!files.is_empty(), Failure::message(format!("{}: this list names no file; expected one name a line", list.display())));
    Ok(files)
}

/// The files of a name or of a pattern.
fn of_word(word: &Path) -> Result<Vec<PathBuf>> {
    let is_pattern = word.to_str().is_some_and(|w| w.contains(['*', '?', '[']));
    if !is_pattern || word.symlink_metadata().is_ok() {
        return Ok(vec![word.to_owned()]);
    }
    let mut found = vec![PathBuf::new()];
    for component in word.components().take(DEEPEST) {
        let text = component.as_os_str().to_string_lossy();
        let Component::Normal(name) = component else {
            found.iter_mut().for_each(|path| path.push(component));
            continue;
        };
        if !text.contains(['*', '?', '[']) {
            found.iter_mut().for_each(|path| path.push(name));
            found.retain(|path| path.symlink_metadata().is_ok());
            continue;
        }
        let pattern: Vec<char> = text.chars().collect();
        found = found.iter().flat_map(|folder| matching(folder, &pattern)).collect();
    }
    found.sort();
    ensure!(!found.is_empty(), Failure::message(format!("{}: no file has such a name", word.display())));
    Ok(found)
}

/// The entries of a folder whose names match. Hidden files match only a pattern that begins with a point.
fn matching(folder: &Path, pattern: &[char]) -> Vec<PathBuf> {
    let place = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let Ok(entries) = std::fs::read_dir(place) else { return Vec::new() };
    let names = entries.flatten().filter_map(|e| e.file_name().into_string().ok());
    let is_meant = |name: &String| {
        let chars: Vec<char> = name.chars().collect();
        (chars[0] != '.' || pattern[0] == '.') && matches(pattern, &chars)
    };
    names.filter(is_meant).map(|name| folder.join(name)).collect()
}

/// Whether a name matches a pattern, as in shells. A bracket that is never closed is a character as others.
fn matches(pattern: &[char], name: &[char]) -> bool {
    // Where the last star is in the pattern, and where the name goes on behind what the star stands for.
    let (mut p, mut n, mut star) = (0, 0, None);
    while n < name.len() {
        if pattern.get(p) == Some(&'*') {
            star = Some((p, n));
            p += 1;
            continue;
        }
        match one(&pattern[p.min(pattern.len())..], name[n]) {
            Some(length) => (p, n) = (p + length, n + 1),
            None => match star {
                Some((at, from)) => {
                    star = Some((at, from + 1));
                    (p, n) = (at + 1, from + 1);
                }
                None => return false,
            },
        }
    }
    pattern[p.min(pattern.len())..].iter().all(|c| *c == '*')
}

/// Length of the beginning of a pattern that stands for this character; `None` if it does not.
fn one(pattern: &[char], c: char) -> Option<usize> {
    let first = *pattern.first()?;
    if first == '['
        && let Some(end) = pattern.iter().skip(2).position(|p| *p == ']').map(|k| k + 2)
    {
        let not = matches!(pattern[1], '!' | '^') && end > 2;
        let set = &pattern[1 + usize::from(not)..end];
        let (mut k, mut within) = (0, false);
        while k < set.len() {
            let is_range = k + 2 < set.len() && set[k + 1] == '-';
            within |= if is_range { (set[k]..=set[k + 2]).contains(&c) } else { set[k] == c };
            k += if is_range { 3 } else { 1 };
        }
        return (within != not).then_some(end + 1);
    }
    (first == '?' || first == c).then_some(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is(pattern: &str, name: &str) -> bool {
        matches(&pattern.chars().collect::<Vec<_>>(), &name.chars().collect::<Vec<_>>())
    }

    #[test]
    fn patterns_are_those_of_shells() {
        for (pattern, name) in [
            ("*", "a"),
            ("a*c", "abbc"),
            ("a*b*", "ab"),
            ("?.ms", "x.ms"),
            ("d[0-3]", "d2"),
            ("d[!0-3]x", "d7x"),
            ("[]a]", "]"),
            ("a[b", "a[b"),
            ("*é?", "aéb"),
        ] {
            assert!(is(pattern, name), "{pattern} {name}");
        }
        for (pattern, name) in
            [("a*c", "abb"), ("?", ""), ("d[0-3]", "d4"), ("d[!0-3]", "d1"), ("a", "ab"), ("", "a"), ("*.uvh5", "a.uvh5.bak")]
        {
            assert!(!is(pattern, name), "{pattern} {name}");
        }
    }

    #[test]
    fn words_stand_for_files_patterns_and_lists() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for name in ["b1.uvh5", "a1.uvh5", "a[1].uvh5", ".hidden.uvh5"] {
            std::fs::write(path(name), "x").unwrap();
        }
        assert_eq!(expanded(&[path("*1.uvh5")]).unwrap(), [path("a1.uvh5"), path("b1.uvh5")]);
        assert_eq!(expanded(&[path("a[1].uvh5")]).unwrap(), [path("a[1].uvh5")], "a file of that very name");
        assert_eq!(expanded(&[path("none.uvh5")]).unwrap(), [path("none.uvh5")], "opening it says that it is missing");
        let why = expanded(&[path("*.ms")]).unwrap_err().to_string();
        assert!(why.contains("*.ms: no file has such a name"), "{why}");
        let list = |text: &str| {
            std::fs::write(path("files.txt"), text).unwrap();
            expanded(&[PathBuf::from(format!("@{}", path("files.txt").display()))])
        };
        assert_eq!(list("# of today\n\n  b1.uvh5 \r\na1*\n").unwrap(), [path("b1.uvh5"), path("a1.uvh5")]);
        for (text, says) in [
            ("# nothing\n\n", "names no file"),
            ("b1.uvh5\n\nmissing.uvh5\n", "line 3"),
            ("@other.txt\n", "another list"),
            ("x*\n", "no file has such a name"),
        ] {
            let why = list(text).unwrap_err().to_string();
            assert!(why.contains("files.txt") && why.contains(says), "{why}");
        }
    }
}

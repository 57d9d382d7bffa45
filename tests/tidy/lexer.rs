//! Splits Rust source into tokens, without comments, literals of text, lifetimes and code under `#[cfg(test)]`.

/// An identifier, a number, `::`, or one character of punctuation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Token {
    pub text: String,
    pub line: usize,
}

impl Token {
    pub fn is_name(&self) -> bool {
        self.text.starts_with(|c: char| c.is_alphabetic() || c == '_')
    }
}

/// The tokens of a file.
pub fn tokens(source: &str) -> Vec<Token> {
    let c: Vec<char> = source.chars().collect();
    let at = |i: usize| c.get(i).copied().unwrap_or('\0');
    let (mut out, mut i, mut line) = (Vec::new(), 0, 1);
    while i < c.len() {
        let start = i;
        let mut token = None;
        match c[i] {
            '/' if at(i + 1) == '/' => i = end_of_line(&c, i),
            '/' if at(i + 1) == '*' => i = end_of_comment(&c, i),
            '"' => i = end_of_text(&c, i),
            '\'' if at(i + 1) == '\\' || at(i + 2) == '\'' => i = end_of_character(&c, i),
            '\'' => i = end_of_name(&c, i + 1),
            x if x.is_alphabetic() || x == '_' => {
                i = end_of_name(&c, i);
                let name: String = c[start..i].iter().collect();
                let hashes = c[i..].iter().take_while(|h| **h == '#').count();
                let quoted = at(i + hashes) == '"';
                match name.as_str() {
                    "r" | "br" | "cr" if quoted => i = end_of_raw_text(&c, i, hashes),
                    "b" | "c" if at(i) == '"' => i = end_of_text(&c, i),
                    "b" if at(i) == '\'' => i = end_of_character(&c, i),
                    "r" if hashes == 1 => {
                        i = end_of_name(&c, i + 1);
                        token = Some(c[start + 2..i].iter().collect());
                    }
                    _ => token = Some(name),
                }
            }
            x if x.is_ascii_digit() => {
                i = end_of_name(&c, i);
                token = Some(c[start..i].iter().collect());
            }
            ':' if at(i + 1) == ':' => {
                i += 2;
                token = Some("::".to_owned());
            }
            x => {
                i += 1;
                token = (!x.is_whitespace()).then(|| x.to_string());
            }
        }
        out.extend(token.map(|text| Token { text, line }));
        line += c[start..i.min(c.len())].iter().filter(|x| **x == '\n').count();
    }
    out
}

fn end_of_line(c: &[char], i: usize) -> usize {
    c[i..].iter().position(|x| *x == '\n').map_or(c.len(), |n| i + n)
}

fn end_of_name(c: &[char], i: usize) -> usize {
    c[i..].iter().position(|x| !(x.is_alphanumeric() || *x == '_')).map_or(c.len(), |n| i + n)
}

fn end_of_comment(c: &[char], mut i: usize) -> usize {
    let mut depth = 0;
    while i + 1 < c.len() {
        match (c[i], c[i + 1]) {
            ('/', '*') => (depth, i) = (depth + 1, i + 2),
            ('*', '/') => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            return i;
        }
    }
    c.len()
}

/// The end of a literal that begins with its quotation mark at `i`.
fn end_of_quoted(c: &[char], mut i: usize, mark: char) -> usize {
    i += 1;
    while i < c.len() && c[i] != mark {
        i += if c[i] == '\\' { 2 } else { 1 };
    }
    i + 1
}

fn end_of_text(c: &[char], i: usize) -> usize {
    end_of_quoted(c, i, '"')
}

/// `i` is the position of the first quotation mark.
fn end_of_character(c: &[char], i: usize) -> usize {
    end_of_quoted(c, i, '\'')
}

fn end_of_raw_text(c: &[char], i: usize, hashes: usize) -> usize {
    let mut k = i + hashes + 1;
    while k < c.len() && !(c[k] == '"' && c[k + 1..].iter().take(hashes).filter(|x| **x == '#').count() == hashes) {
        k += 1;
    }
    k + 1 + hashes
}

/// The tokens without the items that are compiled for tests only.
pub fn without_tests(tokens: &[Token]) -> Vec<Token> {
    let (mut out, mut i) = (Vec::new(), 0);
    while i < tokens.len() {
        if is_for_tests(&tokens[i..]) {
            i = end_of_item(tokens, i);
        } else {
            out.push(tokens[i].clone());
            i += 1;
        }
    }
    out
}

/// True at `#[cfg(test)]` and at `#[cfg(all(test, ...))]`.
fn is_for_tests(tokens: &[Token]) -> bool {
    let starts = |with: &[&str]| tokens.len() >= with.len() && tokens.iter().zip(with).all(|(t, w)| t.text == *w);
    starts(&["#", "[", "cfg", "(", "test", ")"]) || starts(&["#", "[", "cfg", "(", "all", "(", "test"])
}

/// The position after the item, field or statement that begins at `i` with its attributes.
fn end_of_item(tokens: &[Token], mut i: usize) -> usize {
    while i < tokens.len() && tokens[i].text == "#" {
        i = closing(tokens, i + 1) + 1;
    }
    const ITEMS: [&str; 15] = [
        "pub",
        "mod",
        "fn",
        "use",
        "struct",
        "enum",
        "impl",
        "trait",
        "const",
        "static",
        "type",
        "unsafe",
        "extern",
        "async",
        "macro_rules",
    ];
    let mut is_item = tokens.get(i).is_some_and(|t| ITEMS.contains(&t.text.as_str()));
    // A public field begins as an item does: `pub name: Type,`.
    if is_item && tokens[i].text == "pub" {
        let name = if tokens.get(i + 1).is_some_and(|t| t.text == "(") { closing(tokens, i + 1) + 1 } else { i + 1 };
        is_item = tokens.get(name + 1).is_some_and(|t| t.text != ":");
    }
    while i < tokens.len() {
        match tokens[i].text.as_str() {
            ";" => return i + 1,
            "," if !is_item => return i + 1,
            "{" => return closing(tokens, i) + 1,
            "}" => return i,
            "(" | "[" => i = closing(tokens, i) + 1,
            _ => i += 1,
        }
    }
    i
}

/// The position of the bracket that closes the one at `open`.
pub fn closing(tokens: &[Token], open: usize) -> usize {
    let mut depth = 0;
    for (i, token) in tokens.iter().enumerate().skip(open) {
        match token.text.as_str() {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return i;
        }
    }
    tokens.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(source: &str) -> Vec<String> {
        without_tests(&tokens(source)).into_iter().map(|t| t.text).collect()
    }

    #[test]
    fn comments_texts_and_lifetimes_are_left_out() {
        assert_eq!(
            words("a /* b /* c */ d */ \"e\\\" f\" 'g' '\\'' b'h' b\"i\" 'j: r#\"k\" l\"# r#m // n\nz::y"),
            ["a", ":", "m", "z", "::", "y"]
        );
    }

    #[test]
    fn lines_are_counted_through_comments_and_texts() {
        let lines: Vec<usize> = tokens("a\n/* x\n */ b \"p\nq\" c").iter().map(|t| t.line).collect();
        assert_eq!(lines, [1, 3, 4]);
    }

    #[test]
    fn code_for_tests_is_left_out() {
        assert_eq!(words("#[cfg(test)] mod tests { use a::b; } c"), ["c"]);
        assert_eq!(words("#[cfg(test)] #[path = \"x\"] mod tests; c"), ["c"]);
        assert_eq!(words("struct S { #[cfg(test)] pub(super) count: u64, b: u8 }"), ["struct", "S", "{", "b", ":", "u8", "}"]);
        assert_eq!(words("#[cfg(test)] fn f<A, B>(a: A) -> B { a.b() } c"), ["c"]);
        assert_eq!(words("#[cfg(unix)] mod a;").len(), 10);
    }
}

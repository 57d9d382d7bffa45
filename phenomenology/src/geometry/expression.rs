//! The boolean expression of a region.

use std::fmt;

/// A body with its sign.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Literal {
    /// Inside (`+`) or outside (`-`).
    pub inside: bool,
    /// Name of the body.
    pub body: String,
}

/// A union of terms; a term is the intersection of its literals.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Expression {
    /// The terms.
    pub terms: Vec<Vec<Literal>>,
}

/// Whether a character may be part of a name of a body.
fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_' || c == '.'
}

/// Whether a text may name a body or region.
pub(crate) fn is_valid_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(is_name) && !name.eq_ignore_ascii_case("OR")
}

impl Expression {
    /// The expression `+body`.
    #[must_use]
    pub fn of_body(body: &str) -> Self {
        Self { terms: vec![vec![Literal { inside: true, body: body.to_owned() }]] }
    }

    /// Reads an expression such as `+1 -7 OR +6 +4`. Blanks between literals may be left out.
    ///
    /// # Errors
    /// A text with a missing sign or name, an `OR` without a term on each side, or an unexpected character.
    pub fn parse(text: &str) -> Result<Self, String> {
        let mut terms = Vec::new();
        let mut term: Vec<Literal> = Vec::new();
        let mut rest = text.trim();
        while !rest.is_empty() {
            if let Some(after) = rest.strip_prefix(['+', '-']) {
                let after = after.trim_start();
                let end = after.find(|c| !is_name(c)).unwrap_or(after.len());
                let mut name = &after[..end];
                // `+1OR+2`: there is no blank between the number and the word.
                if let Some(digits) = name.strip_suffix("OR").filter(|d| !d.is_empty() && d.bytes().all(|b| b.is_ascii_digit())) {
                    name = digits;
                }
                if name.is_empty() || name.eq_ignore_ascii_case("OR") {
                    return Err(format!("a body is missing after `{}` in `{text}`", &rest[..1]));
                }
                term.push(Literal { inside: rest.starts_with('+'), body: name.to_owned() });
                rest = after[name.len()..].trim_start();
            } else if rest.get(..2).is_some_and(|w| w.eq_ignore_ascii_case("OR")) && !rest[2..].starts_with(is_name) {
                if term.is_empty() {
                    return Err(format!("`OR` without a body before it in `{text}`"));
                }
                terms.push(std::mem::take(&mut term));
                rest = rest[2..].trim_start();
                if rest.is_empty() {
                    return Err(format!("`OR` without a body after it in `{text}`"));
                }
            } else {
                let word = rest.split_whitespace().next().unwrap_or(rest);
                return Err(format!("`{word}` in `{text}` needs a sign: +body is inside, -body is outside, OR joins terms"));
            }
        }
        if !term.is_empty() {
            terms.push(term);
        }
        Ok(Self { terms })
    }

    /// The same expression with every body renamed.
    #[must_use]
    pub fn renamed(&self, name: impl Fn(&str) -> String) -> Self {
        let literal = |l: &Literal| Literal { inside: l.inside, body: name(&l.body) };
        Self { terms: self.terms.iter().map(|t| t.iter().map(literal).collect()).collect() }
    }
}

impl fmt::Display for Expression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, term) in self.terms.iter().enumerate() {
            if i > 0 {
                f.write_str(" OR ")?;
            }
            for (j, l) in term.iter().enumerate() {
                write!(f, "{}{}{}", if j > 0 { " " } else { "" }, if l.inside { '+' } else { '-' }, l.body)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_and_writes_the_same() {
        for text in ["+1", "+1 -7 OR +6 +4", "+hull -hatch.2 OR +turret_left", "-3 +12"] {
            assert_eq!(Expression::parse(text).unwrap().to_string(), text);
        }
        for tight in ["+1-7OR+6+4", " + 1 - 7 or +6 +4 "] {
            assert_eq!(Expression::parse(tight).unwrap().to_string(), "+1 -7 OR +6 +4");
        }
        assert!(Expression::parse("  ").unwrap().terms.is_empty());
    }

    #[test]
    fn faults_are_named() {
        for (text, part) in [
            ("1 +2", "`1` in `1 +2` needs a sign"),
            ("+1 OR", "without a body after"),
            ("OR +1", "without a body before"),
            ("+1 OR OR +2", "without a body before"),
            ("+", "a body is missing after `+`"),
            ("+1 & +2", "`&`"),
        ] {
            let message = Expression::parse(text).unwrap_err();
            assert!(message.contains(part), "{message}");
        }
    }
}

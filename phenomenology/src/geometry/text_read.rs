//! Reading the text of bodies and regions.
//!
//! ```text
//! # bodies: name, type, parameters (type and name may be exchanged; parameters may go on over further lines)
//! 1 RPP -1 1 -1 1 0 2
//! RCC 2  0 0 0  0 0 3  0.5
//! # regions: name, expression, and if wanted the surface
//! REGION wall ; +1 -2 ; concrete
//! ```

use super::error::GeometryError;
use super::expression::{Expression, is_valid_name};
use super::model::{NamedBody, RegionSource};
use crate::primitives::{Body, Primitive};

/// The bodies and regions of a text.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TextModel {
    /// Bodies in order.
    pub bodies: Vec<NamedBody>,
    /// Regions in order.
    pub regions: Vec<RegionSource>,
    /// Name of the surface of each region, if the text gives one. \[region\]
    pub surfaces: Vec<Option<String>>,
}

/// Names of surfaces that stand for empty space.
const VOID: [&str; 3] = ["air", "void", "vacuum"];

/// Whether the name of a surface stands for empty space.
pub(crate) fn is_void(surface: &str) -> bool {
    VOID.iter().any(|v| surface.eq_ignore_ascii_case(v))
}

/// Whether a text holds bodies and regions and not TOML: its first line with content is a body or a region.
#[must_use]
pub fn looks_like_bodies(text: &str) -> bool {
    let first = text.lines().map(without_comment).find(|l| !l.is_empty()).unwrap_or("");
    first.split_whitespace().take(2).any(|word| Primitive::by_code(word).is_some()) || starts_region(first)
}

/// Reads a text of bodies and regions. `first_line` is the number of its first line in the file.
///
/// # Errors
/// The line and the fault: a line that is neither a body nor a region, a body with wrong parameters, a wrong expression.
pub fn read_text(text: &str, first_line: usize) -> Result<TextModel, GeometryError> {
    let mut model = TextModel::default();
    let mut open: Option<OpenBody> = None;
    for (i, raw) in text.lines().enumerate() {
        let (line, content) = (first_line + i, without_comment(raw));
        if content.is_empty() || content.eq_ignore_ascii_case("END") {
            continue;
        }
        let fault = |message: String| GeometryError::at(line, message);
        let continues = content.split_whitespace().all(|w| w.parse::<f64>().is_ok());
        if continues {
            let Some(body) = open.as_mut() else {
                return Err(fault(format!("`{content}` is neither a body (name, type, parameters) nor a REGION")));
            };
            body.extend(content, line)?;
            continue;
        }
        if let Some(done) = open.take() {
            model.bodies.push(done.close()?);
        }
        if starts_region(content) {
            let (source, surface) = read_region(content, line)?;
            model.regions.push(source);
            model.surfaces.push(surface);
        } else {
            open = Some(OpenBody::start(content, line)?);
        }
    }
    if let Some(done) = open.take() {
        model.bodies.push(done.close()?);
    }
    Ok(model)
}

fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or("").trim()
}

fn starts_region(content: &str) -> bool {
    content.split_whitespace().next().is_some_and(|w| w.eq_ignore_ascii_case("REGION"))
}

/// A body whose parameters are still being read.
struct OpenBody {
    name: String,
    code: String,
    line: usize,
    parameters: Vec<f64>,
}

/// Largest number of parameters that is read for a body. It exceeds that of any body, so that a message can give the number found.
const MAX_PARAMETERS: usize = 64;

impl OpenBody {
    fn start(content: &str, line: usize) -> Result<Self, GeometryError> {
        let mut words = content.split_whitespace();
        let (first, second) = (words.next().unwrap_or(""), words.next().unwrap_or(""));
        let (name, code) = match (Primitive::by_code(first), Primitive::by_code(second)) {
            (_, Some(_)) => (first, second),
            (Some(_), None) => (second, first),
            // Neither word is a type. The second is taken as the type, and the message names it.
            (None, None) => (first, second),
        };
        if !is_valid_name(name) {
            return Err(GeometryError::at(line, format!("`{name}` cannot name a body; use letters, digits, `_` and `.`")));
        }
        let mut body = Self { name: name.to_owned(), code: code.to_owned(), line, parameters: Vec::new() };
        body.extend(&words.collect::<Vec<_>>().join(" "), line)?;
        Ok(body)
    }

    fn extend(&mut self, content: &str, line: usize) -> Result<(), GeometryError> {
        for word in content.split_whitespace() {
            let value = word.parse::<f64>().ok().filter(|_| self.parameters.len() < MAX_PARAMETERS);
            let fault = || GeometryError::at(line, format!("`{word}` is not a parameter of body `{}` ({})", self.name, self.code));
            self.parameters.push(value.ok_or_else(fault)?);
        }
        Ok(())
    }

    fn close(self) -> Result<NamedBody, GeometryError> {
        let body = Body::new(&self.code, &self.parameters).map_err(|fault| GeometryError::body(self.line, &self.name, fault))?;
        Ok(NamedBody { name: self.name, body, line: self.line })
    }
}

/// `REGION name ; expression ; surface`; the first semicolon may be left out.
fn read_region(content: &str, line: usize) -> Result<(RegionSource, Option<String>), GeometryError> {
    let fault = |message: String| GeometryError::at(line, message);
    let rest = content["REGION".len()..].trim_start();
    let end = rest.find(|c: char| c.is_whitespace() || matches!(c, ';' | '+')).unwrap_or(rest.len());
    let (name, rest) = (&rest[..end], rest[end..].trim_start());
    if !is_valid_name(name) {
        return Err(fault(format!("`{name}` cannot name a region; write `REGION name ; +1 -2 OR +3`")));
    }
    let rest = rest.strip_prefix(';').unwrap_or(rest);
    let mut parts = rest.split(';').map(str::trim);
    let expression = Expression::parse(parts.next().unwrap_or("")).map_err(|e| fault(format!("region `{name}`: {e}")))?;
    let surface = parts.next().filter(|s| !s.is_empty()).map(str::to_owned);
    if let Some(extra) = parts.next() {
        return Err(fault(format!("region `{name}`: `{extra}` is one part too many; write `REGION name ; expression ; surface`")));
    }
    if expression.terms.is_empty() {
        return Err(GeometryError::no_body(line, name));
    }
    let void = surface.as_deref().is_some_and(is_void);
    Ok((RegionSource { name: name.to_owned(), expression, void, line }, surface))
}

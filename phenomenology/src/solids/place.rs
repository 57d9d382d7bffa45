//! Places the assemblies of a scene: moves the bodies and makes the names unique.

use super::file::{AssemblyRow, BodyRow, FaceRow, InstanceRow, RegionRow, SceneFile, WeatherRow};
use crate::error::{Result, SceneError};
use crate::geometry::{Expression, GeometryError, NamedBody, RegionSource, is_valid_name, is_void};
use crate::primitives::Body;
use crate::space::{Similarity, Vec3};
use std::collections::BTreeMap;
use toml::Spanned;

/// Largest depth of nested assemblies.
const MAX_DEPTH: usize = 8;
/// Largest number of bodies of a scene.
const MAX_BODIES: usize = 1_000_000;

/// Surface and temperature of a region, as written.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Dress {
    pub surface: Option<String>,
    pub temperature_k: Option<f64>,
    /// Faces of bodies with their full names.
    pub faces: Vec<FaceRow>,
}

/// Bodies and regions of the whole scene.
#[derive(Debug, Default)]
pub(super) struct Placed {
    pub bodies: Vec<NamedBody>,
    pub regions: Vec<RegionSource>,
    /// Surface and temperature of each region. // [region]
    pub dresses: Vec<Dress>,
    /// Weather, with its place as the expression of a region.
    pub weather: Vec<(RegionSource, WeatherRow)>,
}

/// Finds the line of a position in a text.
#[derive(Debug)]
pub(super) struct Lines {
    /// Where each line ends.
    ends: Vec<usize>,
    /// A scene without a text (made in memory) has no lines.
    none: bool,
}

impl Lines {
    /// Of a text.
    pub(super) fn new(text: &str) -> Self {
        Self { ends: text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(at, _)| at).collect(), none: text.is_empty() }
    }

    /// Number of the line of a position, from 1. It is 0 without a text.
    pub(super) fn of(&self, offset: usize) -> usize {
        if self.none { 0 } else { 1 + self.ends.partition_point(|end| *end < offset) }
    }
}

struct Placer<'a> {
    text: &'a str,
    lines: Lines,
    assemblies: &'a BTreeMap<String, Spanned<AssemblyRow>>,
    out: Placed,
}

/// Everything of a file, placed.
pub(super) fn place(file: &SceneFile, text: &str) -> Result<Placed> {
    let mut placer = Placer { text, lines: Lines::new(text), assemblies: &file.assembly, out: Placed::default() };
    if let Some(inner) = &file.bodies_and_regions {
        placer.text_model(inner)?;
    }
    placer.rows(&file.body, &file.region, "", &Similarity::IDENTITY)?;
    placer.weather(&file.weather, "")?;
    placer.instances(&file.instance, "", &Similarity::IDENTITY, 0)?;
    Ok(placer.out)
}

impl Placer<'_> {
    fn line<T>(&self, row: &Spanned<T>) -> usize {
        self.lines.of(row.span().start)
    }

    fn text_model(&mut self, inner: &Spanned<String>) -> Result<()> {
        // The line break after the opening quotes is not part of the string.
        let opening = self.text.get(inner.span()).is_some_and(|s| s.starts_with("\"\"\"\n") || s.starts_with("'''\n"));
        let model = crate::geometry::read_text(inner.get_ref(), self.line(inner) + usize::from(opening))?;
        self.out.bodies.extend(model.bodies);
        for (region, surface) in model.regions.into_iter().zip(model.surfaces) {
            self.out.regions.push(region);
            self.out.dresses.push(Dress { surface, ..Dress::default() });
        }
        Ok(())
    }

    fn rows(&mut self, bodies: &[Spanned<BodyRow>], regions: &[Spanned<RegionRow>], prefix: &str, by: &Similarity) -> Result<()> {
        for row in bodies {
            let (line, row) = (self.line(row), row.get_ref());
            name_is_good(&row.name, line)?;
            let name = format!("{prefix}{}", row.name);
            let fault = |fault| GeometryError::body(line, &name, fault);
            let mut body = Body::new(&row.code, &row.data).map_err(fault)?;
            if *by != Similarity::IDENTITY {
                body = body.transformed(by).map_err(fault)?;
            }
            if self.out.bodies.len() >= MAX_BODIES {
                return Err(SceneError::at(line, format!("the scene has more than {MAX_BODIES} bodies")));
            }
            if let Some(surface) = &row.surface {
                let (expression, void) = (Expression::of_body(&name), is_void(surface));
                self.out.regions.push(RegionSource { name: name.clone(), expression, void, line });
                self.out.dresses.push(Dress { surface: Some(surface.clone()), temperature_k: row.temperature_k, faces: Vec::new() });
            } else if row.temperature_k.is_some() {
                let message = format!("body `{}` has temperature_k but no surface; give the temperature to its region", row.name);
                return Err(SceneError::at(line, message));
            }
            self.out.bodies.push(NamedBody { name, body, line });
        }
        for row in regions {
            let (line, row) = (self.line(row), row.get_ref());
            name_is_good(&row.name, line)?;
            let full = |name: &str| format!("{prefix}{name}");
            let expression =
                Expression::parse(&row.is).map_err(|e| SceneError::at(line, format!("region `{}`: {e}", row.name)))?.renamed(full);
            let void = row.surface.as_deref().is_some_and(is_void);
            self.out.regions.push(RegionSource { name: full(&row.name), expression, void, line });
            let faces = row.face.iter().map(|f| FaceRow { body: full(&f.body), ..f.clone() }).collect();
            self.out.dresses.push(Dress { surface: row.surface.clone(), temperature_k: row.temperature_k, faces });
        }
        Ok(())
    }

    fn weather(&mut self, rows: &[Spanned<WeatherRow>], prefix: &str) -> Result<()> {
        for row in rows {
            let (line, row) = (self.line(row), row.get_ref());
            name_is_good(&row.name, line)?;
            let expression = Expression::parse(&row.is).map_err(|e| SceneError::at(line, format!("weather `{}`: {e}", row.name)))?;
            let expression = expression.renamed(|name| format!("{prefix}{name}"));
            let source = RegionSource { name: format!("{prefix}{}", row.name), expression, void: false, line };
            self.out.weather.push((source, row.clone()));
        }
        Ok(())
    }

    fn instances(&mut self, rows: &[Spanned<InstanceRow>], prefix: &str, by: &Similarity, depth: usize) -> Result<()> {
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        for row in rows {
            let (line, row) = (self.line(row), row.get_ref());
            let assemblies = self.assemblies;
            let Some(assembly) = assemblies.get(&row.assembly) else {
                let known = crate::geometry::some_names("assemblies", assemblies.keys().map(String::as_str));
                return Err(SceneError::at(line, format!("instance of unknown assembly `{}`; {known}", row.assembly)));
            };
            if depth >= MAX_DEPTH {
                let message = format!("assembly `{}` is nested more than {MAX_DEPTH} deep; does it hold itself?", row.assembly);
                return Err(SceneError::at(line, message));
            }
            let inner = Similarity::new(Vec3::from(row.position_m), Vec3::from(row.rotate_deg), row.scale).ok_or_else(|| {
                let message = format!("instance of `{}`: scale is {}; it must be above 0, and all numbers finite", row.assembly, row.scale);
                SceneError::at(line, message)
            })?;
            let count = counts.entry(&row.assembly).or_insert(0);
            *count += 1;
            let name = row.name.clone().unwrap_or_else(|| format!("{}_{count}", row.assembly));
            name_is_good(&name, line)?;
            let (prefix, by) = (format!("{prefix}{name}."), inner.then(by));
            let assembly = assembly.get_ref();
            self.rows(&assembly.body, &assembly.region, &prefix, &by)?;
            self.weather(&assembly.weather, &prefix)?;
            self.instances(&assembly.instance, &prefix, &by, depth + 1)?;
        }
        Ok(())
    }
}

fn name_is_good(name: &str, line: usize) -> Result<()> {
    if is_valid_name(name) {
        Ok(())
    } else {
        Err(SceneError::at(line, format!("`{name}` cannot be a name; use letters, digits, `_` and `.`")))
    }
}

//! Makes a scene from its file.

use super::air::atmosphere;
use super::covers::Covers;
use super::file::{AtmosphereRow, GroundRow, HeightFieldRow, MapRow, PatchRow, SceneFile, SurfaceRow};
use super::images::{ReadGrey, resolve};
use super::place::{Lines, Placed, place};
use super::scene::{SolidScene, SurfaceSource};
use super::weather::{Around, Weather};
use crate::error::{Result, SceneError};
use crate::geometry::{At, Geometry, is_void};
use crate::surfaces::{Canopy, Roughness, StackDescription, SurfaceError};
use crate::terrain::{HeightField, Patch, Shape, SurfaceMap, Terrain, strip};
use std::collections::HashMap;
use toml::Spanned;

/// Largest number of nodes of a height field, and of cells of a map.
const MAX_CELLS: usize = 1 << 24;

impl SolidScene {
    /// Read from TOML.
    ///
    /// # Errors
    /// The line and the fault: TOML that does not parse, unknown keys, bodies with wrong parameters, unknown bodies, surfaces or
    /// assemblies, regions without material, an empty scene, a camera inside a solid or under the ground.
    pub fn from_toml(text: &str) -> Result<Self> {
        let file: SceneFile = toml::from_str(text)?;
        build(file, text)
    }

    /// As [`SolidScene::from_toml`]. `read` reads the pictures that the scene names.
    ///
    /// # Errors
    /// As [`SolidScene::from_toml`], and a picture that cannot be read.
    pub fn from_toml_with(text: &str, read: ReadGrey<'_>) -> Result<Self> {
        let mut file: SceneFile = toml::from_str(text)?;
        let lines = Lines::new(text);
        resolve(&mut file, read, &|offset| lines.of(offset))?;
        build(file, text)
    }
}

/// Makes the scene. `text` is the text of the file; error messages take line numbers from it. It is empty for a scene made in memory.
fn build(file: SceneFile, text: &str) -> Result<SolidScene> {
    if file.kind != "solids" {
        return Err(SceneError::bad_value("key `kind`", file.kind, "\"solids\""));
    }
    let lines = Lines::new(text);
    let line = |offset: usize| lines.of(offset);
    let surfaces = file
        .surface
        .iter()
        .map(|(name, row)| {
            let line = line(row.span().start);
            surface(name, row.get_ref(), line, text).map_err(|source| SceneError::Surface {
                at: At(line),
                name: name.clone(),
                source: Box::new(source),
            })
        })
        .collect::<Result<Vec<_>>>()?;
    let mut covers = Covers::new(surfaces.iter().map(|s| s.name.as_str()));
    let Placed { bodies, regions, dresses, weather } = place(&file, text)?;
    let sources = regions.clone();
    let geometry = Geometry::new(bodies, regions)?;
    let numbers: HashMap<&str, usize> = geometry.bodies().iter().enumerate().map(|(i, b)| (b.name.as_str(), i)).collect();
    for (region, dress) in sources.iter().zip(&dresses) {
        let user = format!("region `{}`", region.name);
        let main = match &dress.surface {
            Some(s) if is_void(s) => None,
            Some(s) => Some(covers.add(region.line, &user, s, dress.temperature_k)?),
            None => {
                let message = format!("{user} has no material; give it surface = \"...\" ({})", covers.known());
                return Err(SceneError::at(region.line, message));
            }
        };
        let mut faces = Vec::with_capacity(dress.faces.len());
        for f in &dress.faces {
            let Some(&body) = numbers.get(f.body.as_str()) else {
                return Err(SceneError::at(region.line, format!("{user} has a face of unknown body `{}`", f.body)));
            };
            let count = geometry.bodies()[body].body.entry.faces.len();
            let face = f.face.unwrap_or(0);
            if usize::from(face) > count || f.face == Some(0) {
                return Err(SceneError::at(region.line, format!("{user}: body `{}` has faces 1 to {count}, not {face}", f.body)));
            }
            let name = f.surface.as_deref().or(dress.surface.as_deref()).unwrap_or("");
            faces.push((body as u32, face, covers.add(region.line, &user, name, f.temperature_k.or(dress.temperature_k))?));
        }
        covers.push_region(main, faces);
    }
    drop(numbers);
    let terrain = file.ground.as_ref().map(|g| ground(g.get_ref(), line(g.span().start), &line, &mut covers)).transpose()?;
    if terrain.is_none() && !sources.iter().any(|r| !r.void) {
        return Err(SceneError::Empty);
    }
    let defaults = AtmosphereRow::default();
    let (row, at) = file.atmosphere.as_ref().map_or((&defaults, 0), |a| (a.get_ref(), line(a.span().start)));
    let air = atmosphere(row).map_err(|e| SceneError::air(At(at), e))?;
    let around = Around { atmosphere: air.atmosphere.as_ref(), altitude_km: air.altitude_km };
    let weather = Weather::new(&weather, geometry.bodies(), around, &row.rain)?;
    let camera_line = file.camera.as_ref().map_or(0, |c| line(c.span().start));
    let scene = SolidScene { file, geometry, covers, surfaces, terrain, air, weather, camera_line };
    scene.check_camera()?;
    Ok(scene)
}

fn surface(name: &str, row: &SurfaceRow, line: usize, text: &str) -> Result<SurfaceSource, SurfaceError> {
    let roughness = row.roughness.as_deref().map(str::parse).transpose()?.unwrap_or(Roughness::Smooth);
    if matches!(roughness, Roughness::WegmullerMatzler { .. }) {
        let fault = "it is fitted to 70 degrees only and a scene sees every angle; use qh, choudhury or go";
        return Err(SurfaceError::Refused(format!("roughness `{}`: {fault}", row.roughness.as_deref().unwrap_or_default())));
    }
    if !row.slope_azimuth_deg.is_finite() {
        return Err(SurfaceError::Azimuth { degrees: row.slope_azimuth_deg });
    }
    let stack = StackDescription::from_layers(text, row.coherent, row.layer.clone())?;
    if roughness != Roughness::Smooth && stack.layers.iter().any(|l| l.scatter.is_some()) {
        return Err(SurfaceError::Refused("it has roughness and a layer that scatters; give it one of them".to_owned()));
    }
    let canopy = row.canopy.map(|c| Canopy::new(c.tau_np, c.omega, c.temperature_k)).transpose()?;
    Ok(SurfaceSource { name: name.to_owned(), line, stack, roughness, slope_azimuth_rad: row.slope_azimuth_deg.to_radians(), canopy })
}

fn ground(row: &GroundRow, at: usize, line: &impl Fn(usize) -> usize, covers: &mut Covers) -> Result<Terrain> {
    if !row.height_m.is_finite() {
        return Err(SceneError::at(at, format!("height_m of the ground is {}; it must be finite", row.height_m)));
    }
    let cover = covers.add(at, "the ground", &row.surface, row.temperature_k)?;
    let mut patches = Vec::new();
    for p in &row.patch {
        let (at, p): (usize, &PatchRow) = (line(p.span().start), p.get_ref());
        let cover = covers.add(at, "a patch of the ground", &p.surface, p.temperature_k)?;
        patches.extend(shapes(p, at)?.into_iter().map(|s| Patch::new(s, cover)));
    }
    let map = row.map.as_ref().map(|m| surface_map(m.get_ref(), line(m.span().start), covers)).transpose()?;
    let field = row.height_field.as_ref().map(|f| height_field(f, line(f.span().start))).transpose()?;
    Ok(Terrain::new(row.height_m, field, cover, map, patches))
}

fn shapes(p: &PatchRow, at: usize) -> Result<Vec<Shape>> {
    let fault = |m: &str| Err(SceneError::at(at, format!("patch of `{}`: {m}", p.surface)));
    let finite = |points: &[[f64; 2]]| points.iter().flatten().all(|c| c.is_finite());
    match (&p.polygon_m, &p.strip_m, p.circle_m) {
        (Some(corners), None, None) if corners.len() >= 3 && finite(corners) => Ok(vec![Shape::Polygon(corners.clone())]),
        (Some(_), None, None) => fault("polygon_m needs at least three finite corners"),
        (None, Some(middle), None) => match p.width_m {
            Some(width) if width > 0.0 && width.is_finite() && middle.len() >= 2 && finite(middle) => {
                Ok(strip(middle, width).into_iter().map(Shape::Polygon).collect())
            }
            _ => fault("strip_m needs at least two finite points and width_m above 0"),
        },
        (None, None, Some([x, y, radius])) if radius > 0.0 && x.is_finite() && y.is_finite() && radius.is_finite() => {
            Ok(vec![Shape::Circle { center: [x, y], radius }])
        }
        (None, None, Some(_)) => fault("circle_m is [x, y, radius] with a radius above 0"),
        _ => fault("it needs one of polygon_m, strip_m with width_m, and circle_m"),
    }
}

fn surface_map(row: &MapRow, at: usize, covers: &mut Covers) -> Result<SurfaceMap> {
    if row.image.is_some() {
        return Err(SceneError::at(at, "the map is a picture, which can only be read beside the file of the scene"));
    }
    let columns = row.rows.first().map_or(0, |r| r.chars().count());
    let even = row.rows.iter().all(|r| r.chars().count() == columns);
    if columns == 0 || !even || columns * row.rows.len() > MAX_CELLS {
        return Err(SceneError::at(at, format!("the map needs rows of one length, in all 1 to {MAX_CELLS} cells")));
    }
    if !(row.cell_m > 0.0 && row.cell_m.is_finite() && row.origin_m.iter().all(|o| o.is_finite())) {
        return Err(SceneError::at(at, format!("the map has cell_m = {}; it must be above 0 and its origin finite", row.cell_m)));
    }
    let mut legend = Vec::new();
    for (key, surface) in &row.legend {
        let mut letters = key.chars();
        let (Some(c), None) = (letters.next(), letters.next()) else {
            return Err(SceneError::at(at, format!("legend `{key}` of the map; it must be one character")));
        };
        legend.push((c, covers.add(at, "the map of the ground", surface, None)?));
    }
    let cell = |c: char| match legend.iter().find(|l| l.0 == c) {
        Some(l) => Ok(Some(l.1)),
        None if c == ' ' || c == '.' => Ok(None),
        None => Err(SceneError::at(at, format!("the map has `{c}`, which is not in its legend"))),
    };
    let cells = row.rows.iter().flat_map(|r| r.chars()).map(cell).collect::<Result<Vec<_>>>()?;
    Ok(SurfaceMap::new(row.origin_m, row.cell_m, columns, cells))
}

fn height_field(row: &Spanned<HeightFieldRow>, at: usize) -> Result<HeightField> {
    let row = row.get_ref();
    if row.image.is_some() {
        return Err(SceneError::at(at, "the height field is a picture, which can only be read beside the file of the scene"));
    }
    let columns = row.rows_m.first().map_or(0, Vec::len);
    let even = row.rows_m.iter().all(|r| r.len() == columns) && columns * row.rows_m.len() <= MAX_CELLS;
    let heights = row.rows_m.iter().rev().flatten().copied().collect();
    HeightField::new(row.origin_m, row.cell_m, columns, heights)
        .filter(|_| even)
        .ok_or_else(|| SceneError::at(at, "the height field needs at least 2 x 2 finite heights in rows of one length, and cell_m above 0"))
}

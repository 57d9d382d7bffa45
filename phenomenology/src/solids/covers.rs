//! The surface and the temperature of every face.

use crate::error::SceneError;
use std::collections::BTreeMap;

/// A surface with a temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct Cover {
    /// Index of the surface.
    pub surface: usize,
    /// Temperature that replaces the one of the surface, K.
    pub temperature_k: Option<f64>,
}

/// The covers of a region.
#[derive(Debug, Clone, PartialEq, Default)]
struct OfRegion {
    main: Option<u32>,
    /// Body, face (0: all), cover.
    faces: Vec<(u32, u8, u32)>,
}

/// All covers, and the cover of every region and face.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Covers {
    list: Vec<Cover>,
    names: Vec<String>,
    by_name: BTreeMap<String, usize>,
    regions: Vec<OfRegion>,
}

impl Covers {
    /// No covers yet, for surfaces of these names.
    pub(super) fn new<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let names: Vec<String> = names.map(str::to_owned).collect();
        let by_name = names.iter().enumerate().map(|(i, n)| (n.clone(), i)).collect();
        Self { names, by_name, ..Self::default() }
    }

    /// Number of the cover with this surface and temperature. It is added if it is new.
    ///
    /// # Errors
    /// An unknown surface, or a temperature outside its range.
    pub(super) fn add(&mut self, line: usize, user: &str, surface: &str, temperature_k: Option<f64>) -> Result<u32, SceneError> {
        let Some(&surface) = self.by_name.get(surface) else {
            return Err(SceneError::at(line, format!("{user} uses unknown surface `{surface}`; {}", self.known())));
        };
        if let Some(t) = temperature_k
            && !(t > 0.0 && t <= 5000.0)
        {
            return Err(SceneError::at(line, format!("temperature_k of {user} is {t}; it must lie above 0 and up to 5000 K")));
        }
        let cover = Cover { surface, temperature_k };
        let at = self.list.iter().position(|c| *c == cover).unwrap_or_else(|| {
            self.list.push(cover);
            self.list.len() - 1
        });
        Ok(at as u32)
    }

    /// The names of the surfaces, for messages.
    pub(super) fn known(&self) -> String {
        crate::geometry::some_names("surfaces", self.names.iter().map(String::as_str))
    }

    /// Sets the covers of the next region.
    pub(super) fn push_region(&mut self, main: Option<u32>, faces: Vec<(u32, u8, u32)>) {
        self.regions.push(OfRegion { main, faces });
    }

    /// Removes all temperatures that replace those of the surfaces.
    pub(super) fn forget_temperatures(&mut self) {
        self.list.iter_mut().for_each(|c| c.temperature_k = None);
    }

    /// All covers.
    #[must_use]
    pub fn list(&self) -> &[Cover] {
        &self.list
    }

    /// Name of the surface of a cover.
    #[must_use]
    pub fn name(&self, cover: u32) -> &str {
        &self.names[self.list[cover as usize].surface]
    }

    /// Names of all surfaces; covers index into them.
    #[must_use]
    pub fn surface_names(&self) -> &[String] {
        &self.names
    }

    /// Cover of the faces of a region that have no cover of their own. `None` for an empty region.
    #[must_use]
    pub fn of_region(&self, region: usize) -> Option<u32> {
        self.regions.get(region).and_then(|r| r.main)
    }

    /// Cover of a face of a body that bounds a region. `None` for a face of an empty region.
    #[must_use]
    #[inline]
    pub fn of_face(&self, region: u32, body: u32, face: u8) -> Option<u32> {
        let region = self.regions.get(region as usize)?;
        let special = region.faces.iter().rev().find(|(b, f, _)| *b == body && (*f == 0 || *f == face));
        special.map(|s| s.2).or(region.main)
    }
}

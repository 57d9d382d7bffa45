//! Which surface and temperature every face has.

use crate::error::SceneError;
use crate::geometry::At;
use std::collections::BTreeMap;

/// A surface with the temperature it has somewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Cover {
    /// Index of the surface.
    pub surface: usize,
    /// Temperature instead of that of the surface, K.
    pub temperature_k: Option<f64>,
}

/// Covers of a region.
#[derive(Debug, Clone, PartialEq, Default)]
struct OfRegion {
    main: Option<u32>,
    /// Body, face (0: all), cover.
    faces: Vec<(u32, u8, u32)>,
}

/// All covers, and who has which.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Covers {
    list: Vec<Cover>,
    names: Vec<String>,
    by_name: BTreeMap<String, usize>,
    regions: Vec<OfRegion>,
}

impl Covers {
    /// For surfaces of these names.
    pub(super) fn new<'a>(names: impl Iterator<Item = &'a str>) -> Self {
        let names: Vec<String> = names.map(str::to_owned).collect();
        let by_name = names.iter().enumerate().map(|(i, n)| (n.clone(), i)).collect();
        Self { names, by_name, ..Self::default() }
    }

    /// Number of a cover; equal ones share it.
    ///
    /// # Errors
    /// [`SceneError::UnknownSurface`], or a temperature that cannot be.
    pub(super) fn add(&mut self, line: usize, user: &str, surface: &str, temperature_k: Option<f64>) -> Result<u32, SceneError> {
        let Some(&surface) = self.by_name.get(surface) else {
            return Err(SceneError::UnknownSurface { at: At(line), user: user.to_owned(), name: surface.to_owned(), known: self.known() });
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

    /// Gives the next region its covers.
    pub(super) fn push_region(&mut self, main: Option<u32>, faces: Vec<(u32, u8, u32)>) {
        self.regions.push(OfRegion { main, faces });
    }

    /// Leaves every cover at the temperature of its surface.
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
        self.list.get(cover as usize).map_or("", |c| self.names[c.surface].as_str())
    }

    /// Names of all surfaces; covers index into them.
    #[must_use]
    pub fn surface_names(&self) -> &[String] {
        &self.names
    }

    /// Cover of a region where nothing else is said.
    #[must_use]
    pub fn of_region(&self, region: usize) -> Option<u32> {
        self.regions.get(region).and_then(|r| r.main)
    }

    /// Cover of a face of a body that bounds a region.
    #[must_use]
    #[inline]
    pub fn of_face(&self, region: u32, body: u32, face: u8) -> Option<u32> {
        let region = self.regions.get(region as usize)?;
        let special = region.faces.iter().rev().find(|(b, f, _)| *b == body && (*f == 0 || *f == face));
        special.map(|s| s.2).or(region.main)
    }
}

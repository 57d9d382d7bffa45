//! The ground of a scene: a plane or a height field, with patches of several surfaces.

use super::height_field::HeightField;
use super::hit::GroundHit;
use super::map::SurfaceMap;
use super::patch::Patch;
use super::patch_index::{Few, PatchIndex};
use crate::space::{Ray, Vec3};

/// The ground of a scene.
#[derive(Debug, Clone)]
pub struct Terrain {
    height_m: f64,
    field: Option<HeightField>,
    cover: u32,
    map: Option<SurfaceMap>,
    patches: PatchIndex,
}

impl Terrain {
    /// A plane at a height in m with one cover. A map lies over it, and patches lie over the map. A later patch covers an earlier one.
    #[must_use]
    pub fn new(height_m: f64, field: Option<HeightField>, cover: u32, map: Option<SurfaceMap>, patches: Vec<Patch>) -> Self {
        Self { height_m, field, cover, map, patches: PatchIndex::new(patches) }
    }

    /// Height at a point, m.
    #[must_use]
    pub fn height_m(&self, x: f64, y: f64) -> f64 {
        self.field.as_ref().and_then(|f| f.height_m(x, y)).unwrap_or(self.height_m)
    }

    /// Height of the plane, m.
    #[must_use]
    pub fn plane_m(&self) -> f64 {
        self.height_m
    }

    /// Height of the ground if it is level everywhere, m.
    #[must_use]
    pub fn level_m(&self) -> Option<f64> {
        self.field.is_none().then_some(self.height_m)
    }

    /// Highest and lowest ground, m.
    #[must_use]
    pub fn range_m(&self) -> (f64, f64) {
        let (lo, hi) = self.field.as_ref().map_or((self.height_m, self.height_m), HeightField::range_m);
        (lo.min(self.height_m), hi.max(self.height_m))
    }

    /// The first point beyond `t_min` where a ray meets the ground.
    #[must_use]
    #[inline]
    pub fn hit(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<GroundHit> {
        if let Some(field) = &self.field {
            if let Some(hit) = field.hit(ray, t_min, t_max) {
                return Some(hit);
            }
            // Inside the area of the field there is no plane.
            let hit = self.plane_hit(ray, t_min, t_max)?;
            let p = ray.at(hit.t);
            return field.height_m(p.x, p.y).is_none().then_some(hit);
        }
        self.plane_hit(ray, t_min, t_max)
    }

    #[inline]
    fn plane_hit(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<GroundHit> {
        if ray.direction.z >= 0.0 {
            return None;
        }
        let t = (self.height_m - ray.origin.z) * ray.inverse.z;
        (t > t_min && t <= t_max).then_some(GroundHit { t, normal: Vec3::UP })
    }

    /// The cover of all points of a rectangle; `None` if it may have several.
    #[must_use]
    pub fn only_cover(&self, low: [f64; 2], high: [f64; 2]) -> Option<u32> {
        if self.map.is_some() {
            return None;
        }
        self.patches.only(low, high).map(|cover| cover.unwrap_or(self.cover))
    }

    /// The patches that may lie at the points of a rectangle between two corners in m; `None` if they are more than `most`.
    #[must_use]
    pub fn few_patches(&self, low: [f64; 2], high: [f64; 2], most: usize) -> Option<Few> {
        self.patches.few(low, high, most)
    }

    /// As [`Terrain::cover`] at a point where only these patches may lie.
    #[must_use]
    #[inline]
    pub fn cover_of(&self, few: &Few, x: f64, y: f64) -> u32 {
        self.patches.cover_of(few, x, y).or_else(|| self.map.as_ref().and_then(|m| m.cover(x, y))).unwrap_or(self.cover)
    }

    /// The cover of a point.
    #[must_use]
    #[inline]
    pub fn cover(&self, x: f64, y: f64) -> u32 {
        self.patches.cover(x, y).or_else(|| self.map.as_ref().and_then(|m| m.cover(x, y))).unwrap_or(self.cover)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::Shape;

    #[test]
    fn patches_lie_over_the_map_over_the_ground() {
        let map = SurfaceMap::new([0.0, 0.0], 10.0, 2, vec![Some(5), None, Some(6), Some(6)]);
        let circle = Patch::new(Shape::Circle { center: [5.0, 5.0], radius: 2.0 }, 8);
        let ground = Terrain::new(0.0, None, 1, Some(map), vec![circle]);
        assert_eq!(ground.cover(-1.0, 5.0), 1);
        assert_eq!(ground.cover(1.0, 19.0), 5);
        assert_eq!(ground.cover(11.0, 19.0), 1);
        assert_eq!(ground.cover(1.0, 1.0), 6);
        assert_eq!(ground.cover(5.5, 5.0), 8);
    }

    #[test]
    fn a_plane_is_met_from_above_only() {
        let ground = Terrain::new(-2.0, None, 0, None, Vec::new());
        let down = Ray::new(Vec3::new(0.0, 0.0, 8.0), Vec3::new(0.6, 0.0, -0.8));
        assert!((ground.hit(&down, 1e-9, 1e9).unwrap().t - 12.5).abs() < 1e-12);
        let up = Ray::new(Vec3::new(0.0, 0.0, 8.0), Vec3::new(0.6, 0.0, 0.8));
        assert!(ground.hit(&up, 1e-9, 1e9).is_none());
        assert!(ground.hit(&down, 1e-9, 12.0).is_none());
    }
}

//! What the rays of a block of pixels can meet.
//!
//! Most blocks of a picture show ground without any solid before it, and many others show one or two solids. A search for them once per block
//! spares every ray of the block the search of the tree of all solids. Level ground of a block is a mirror too: its mirrored rays are a bundle.

use super::tracer::{First, Spot, Tracer};
use crate::camera::View;
use crate::error::Result;
use crate::space::{Beam, Bounds, Ray, Vec3};
use crate::terrain::{Few, Terrain};
use rayon::prelude::*;

/// Side of a block, pixels.
pub(super) const SIDE: usize = 8;
/// Largest number of solids in the way of a block. Beyond it the tree is faster.
const MOST: usize = 32;

/// Largest number of patches of ground in a block. Beyond it the index of all patches is faster.
const MOST_PATCHES: usize = 6;

/// The only solids that a bundle of rays can meet, each after a distance in m before which no ray meets it, the nearest first. `None` if they are many.
type Way = Option<Box<[(f64, u32)]>>;

/// A block of pixels.
#[derive(Debug)]
pub(super) struct Block {
    /// The solids in the way of its rays.
    solids: Way,
    /// The solids in the way of the rays that its level ground mirrors.
    mirrored: Way,
    /// Whether its rays can meet nothing but level ground, whose mirror shows nothing but the sky.
    pub open: bool,
    /// The patches of the ground that its rays can meet; `None` if they are many or unknown.
    patches: Option<Few>,
    /// The cover of all of its pixels, if they are level ground with nothing before it and nothing but the sky in its mirror.
    pub ground: Option<u32>,
}

impl Block {
    /// A block of which nothing is known.
    const UNKNOWN: Self = Self { solids: None, mirrored: None, open: false, patches: None, ground: None };

    /// The cover of a point of the ground that a ray of the block meets.
    #[inline]
    pub(super) fn cover(&self, terrain: &Terrain, x: f64, y: f64) -> u32 {
        match &self.patches {
            Some(few) => terrain.cover_of(few, x, y),
            None => terrain.cover(x, y),
        }
    }

    /// Whether rays that its level ground mirrors meet nothing but the sky.
    #[inline]
    pub(super) fn mirrors_sky(&self) -> bool {
        self.mirrored.as_ref().is_some_and(|w| w.is_empty())
    }

    /// The solids in the way of rays that are mirrored at what was hit; `None` if nothing is known of them.
    #[inline]
    pub(super) fn mirrored_at(&self, spot: &Spot) -> Option<&[(f64, u32)]> {
        self.mirrored.as_deref().filter(|_| spot.region.is_none())
    }
}

/// The blocks of a picture.
#[derive(Debug)]
pub(super) struct Blocks {
    across: usize,
    /// // [m, l]
    blocks: Vec<Block>,
    unknown: Block,
}

impl Blocks {
    /// The block of a pixel.
    #[inline]
    pub(super) fn at(&self, column: usize, row: usize) -> &Block {
        let (column, row) = (column / SIDE, row / SIDE);
        if column < self.across { self.blocks.get(row * self.across + column).unwrap_or(&self.unknown) } else { &self.unknown }
    }
}

impl Tracer<'_> {
    /// The first point that a ray of a block of pixels hits; `None` for the sky.
    #[inline]
    pub(super) fn spot_in(&self, ray: &Ray, block: &Block) -> Result<Option<Spot>> {
        self.spot_at(ray, &self.first_in(ray, block))
    }

    /// What a ray of a block of pixels hits first.
    #[inline]
    pub(super) fn first_in(&self, ray: &Ray, block: &Block) -> First {
        let geometry = &self.scene.geometry;
        let solid = |limit| match block.solids.as_deref() {
            Some(solids) => geometry.first_hit_of(solids, ray, limit),
            None => geometry.first_hit(ray, limit),
        };
        self.first(ray, solid, |terrain, x, y| block.cover(terrain, x, y))
    }

    /// What a ray hits first, if these are the only solids that it can meet.
    #[inline]
    pub(super) fn first_of(&self, ray: &Ray, solids: Option<&[(f64, u32)]>) -> First {
        let geometry = &self.scene.geometry;
        let solid = |limit| match solids {
            Some(solids) => geometry.first_hit_of(solids, ray, limit),
            None => geometry.first_hit(ray, limit),
        };
        self.first(ray, solid, Terrain::cover)
    }

    /// The first point that a ray hits, if these are the only solids that it can meet; `None` for the sky.
    #[inline]
    pub(super) fn spot_of(&self, ray: &Ray, solids: Option<&[(f64, u32)]>) -> Result<Option<Spot>> {
        self.spot_at(ray, &self.first_of(ray, solids))
    }

    /// The blocks of a view.
    pub(super) fn blocks(&self, view: &View) -> Blocks {
        let (across, down) = (view.grid().n_l.div_ceil(SIDE), view.grid().n_m.div_ceil(SIDE));
        let blocks =
            (0..across * down).into_par_iter().map_init(Vec::new, |found, k| self.block(view, (k % across, k / across), found)).collect();
        Blocks { across, blocks, unknown: Block::UNKNOWN }
    }

    fn block(&self, view: &View, (column, row): (usize, usize), found: &mut Vec<(f64, u32)>) -> Block {
        let mut block = Block::UNKNOWN;
        let place = |corner: usize, k: usize| (corner * SIDE) as f64 - 0.5 + 0.5 * (k * SIDE) as f64;
        let directions = [0, 1, 2].map(|r| [0, 1, 2].map(|c| view.direction(place(column, c), place(row, r))));
        if directions.iter().flatten().any(Option::is_none) {
            return block;
        }
        let directions = directions.map(|line| line.map(Option::unwrap_or_default));
        let geometry = &self.scene.geometry;
        let (origin, around) = (Bounds::of_points([view.position]), held(&directions));
        let mut way = |origins: Bounds, directions: Bounds| -> Way {
            geometry.in_the_way(&Beam::new(origins, directions), MOST, found).then(|| found.as_slice().into())
        };
        block.solids = way(origin, around);
        // Places of a level plane, and the directions that it mirrors.
        if let Some(terrain) = &self.scene.terrain
            && let Some(level_m) = terrain.level_m().filter(|level_m| around.max.z < 0.0 && view.position.z > *level_m)
        {
            let places = directions.map(|line| line.map(|d| view.position + d * ((level_m - view.position.z) / d.z)));
            let mirrored = Bounds {
                min: Vec3::new(around.min.x, around.min.y, -around.max.z),
                max: Vec3::new(around.max.x, around.max.y, -around.min.z),
            };
            let places = held(&places);
            let [low, high] = [places.min, places.max].map(|p| [p.x, p.y]);
            block.mirrored = way(places, mirrored);
            block.patches = terrain.few_patches(low, high, MOST_PATCHES);
            block.open = [&block.solids, &block.mirrored].into_iter().all(|way| way.as_ref().is_some_and(|w| w.is_empty()));
            if block.open {
                block.ground = terrain.only_cover(low, high);
            }
        }
        block
    }
}

/// A box that holds a smooth surface through 3 x 3 points. It bends beyond them by at most a quarter of its second differences.
fn held(points: &[[Vec3; 3]; 3]) -> Bounds {
    let bend = |a: Vec3, b: Vec3, c: Vec3| (a + c - b * 2.0).norm();
    let lines = points.iter().map(|[a, b, c]| bend(*a, *b, *c));
    let columns = (0..3).map(|k| bend(points[0][k], points[1][k], points[2][k]));
    let most = lines.chain(columns).fold(0.0_f64, f64::max);
    Bounds::of_points(points.iter().flatten().copied()).grown(most + 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Projection};
    use crate::solids::SolidScene;
    use crate::space::Ray;
    use crate::trace::RenderOptions;
    use crate::trace::face::Face;

    /// Every ray of a block meets what the whole tree says that it meets.
    #[test]
    fn rays_of_a_block_meet_only_its_solids() {
        for name in ["airport", "t-72", "security"] {
            let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
            let scene = SolidScene::from_toml(&std::fs::read_to_string(path).unwrap()).unwrap();
            let tracer = Tracer::new(&scene, &[94e9], &RenderOptions::default()).unwrap();
            for projection in [Projection::Sin, Projection::Pinhole] {
                let camera = Camera { size_px: [100, 75], projection, ..scene.camera().unwrap().clone() };
                let view = View::of_camera(&camera).unwrap();
                let blocks = tracer.blocks(&view);
                let (mut few, mut skies, mut mirrors, mut even) = (0, 0, 0, 0);
                for (r, c) in (0..300).flat_map(|r| (0..400).map(move |c| (r, c))) {
                    let (x, y) = (0.25 * f64::from(c) - 0.375, 0.25 * f64::from(r) - 0.375);
                    let ray = Ray::from_unit(view.position, view.direction(x, y).unwrap());
                    let (block, spot) = (blocks.at(c as usize / 4, r as usize / 4), tracer.spot(&ray).unwrap());
                    let found = tracer.spot_in(&ray, block).unwrap();
                    assert_eq!(found.map(|s| (s.t, s.identity())), spot.map(|s| (s.t, s.identity())), "{name} {x} {y}");
                    few += usize::from(block.solids.is_some());
                    if let Some(cover) = block.ground {
                        even += 1;
                        assert_eq!(found.map(|s| s.identity()), Some(Face::of_ground(cover)), "{name} {x} {y}");
                    }
                    if let Some(spot) = spot
                        && let Some(solids) = block.mirrored_at(&spot)
                    {
                        let ray = tracer.mirror_ray(&ray, &spot);
                        let (found, spot) = (tracer.spot_of(&ray, Some(solids)).unwrap(), tracer.spot(&ray).unwrap());
                        assert_eq!(found.map(|s| (s.t, s.identity())), spot.map(|s| (s.t, s.identity())), "{name} {x} {y}");
                        skies += usize::from(spot.is_none());
                        mirrors += usize::from(spot.is_some());
                    }
                }
                assert!(
                    few > 12_000 && (skies.min(even) > 10_000 && mirrors > 200 || name != "airport"),
                    "{name}: {few} {skies} {mirrors} {even}"
                );
            }
        }
    }
}

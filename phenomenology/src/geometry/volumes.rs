//! Regions that rays pass through: the stretches of a ray inside each of them.
//!
//! A ray stops at a solid region and passes a volume. Volumes may overlap each other and the solids, so all of them count.

use super::bvh::Bvh;
use super::error::GeometryError;
use super::model::{NamedBody, RegionSource, bounds_of, index, terms_of};
use super::term::{Term, union};
use crate::primitives::Body;
use crate::space::{Bounds, Ray};

/// A part of a ray inside a volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passage {
    /// Distance at which the ray enters, m; 0 if it starts inside.
    pub from: f64,
    /// Distance at which it leaves, m.
    pub to: f64,
    /// Number of the volume.
    pub volume: u32,
}

/// Regions that rays pass through.
#[derive(Debug, Clone)]
pub struct Volumes {
    solids: Vec<Body>,
    /// Terms with the numbers of their volumes. // [leaf]
    leaves: Vec<(Term, u32)>,
    tree: Bvh,
    /// // [volume]
    bounds: Vec<Bounds>,
    eps: f64,
}

impl Volumes {
    /// Finds the bodies of the regions. The number of a region is its index.
    ///
    /// # Errors
    /// Names given twice, unknown bodies, regions without bodies or of infinite size.
    pub fn new(bodies: &[NamedBody], regions: &[RegionSource]) -> Result<Self, GeometryError> {
        let names = index(bodies.iter().map(|b| (b.name.as_str(), b.line)), "body")?;
        index(regions.iter().map(|r| (r.name.as_str(), r.line)), "region")?;
        let mut leaves = Vec::new();
        for (at, region) in regions.iter().enumerate() {
            leaves.extend(terms_of(region, &names, bodies)?.into_iter().map(|t| (t, at as u32)));
        }
        drop(names);
        let solids: Vec<Body> = bodies.iter().map(|b| b.body.clone()).collect();
        let boxes: Vec<Bounds> = leaves.iter().map(|(t, _)| bounds_of(t, &solids)).collect();
        let mut bounds = vec![Bounds::EMPTY; regions.len()];
        for ((_, volume), b) in leaves.iter().zip(&boxes).filter(|(_, b)| !b.is_empty()) {
            bounds[*volume as usize] = bounds[*volume as usize].union(*b);
        }
        let all = bounds.iter().filter(|b| !b.is_empty()).fold(Bounds::EMPTY, |a, b| a.union(*b));
        let reach = if all.is_empty() { 1.0 } else { all.size().norm().max(all.min.norm()).max(all.max.norm()) };
        let eps = 1e-9 * reach.clamp(1e-3, 1e9);
        let tree = Bvh::new(&boxes.iter().map(|b| if b.is_empty() { *b } else { b.grown(eps) }).collect::<Vec<_>>());
        Ok(Self { solids, leaves, tree, bounds, eps })
    }

    /// The box around each volume. // \[volume\]
    #[must_use]
    pub fn bounds(&self) -> &[Bounds] {
        &self.bounds
    }

    /// Writes every passage of a ray before `t_max` to `out`, sorted by volume and distance. The passages of one volume do not overlap.
    pub fn passages(&self, ray: &Ray, t_max: f64, out: &mut Vec<Passage>) {
        out.clear();
        self.tree.visit(ray, t_max, |leaf, limit| {
            let (term, volume) = &self.leaves[leaf as usize];
            for (a, b) in union(term.stretches(&self.solids, ray, self.eps), self.eps) {
                let (from, to) = (a.t.max(0.0), b.t.min(t_max));
                if to - from > self.eps {
                    out.push(Passage { from, to, volume: *volume });
                }
            }
            limit
        });
        out.sort_by(|a, b| a.volume.cmp(&b.volume).then(a.from.total_cmp(&b.from)));
        // Terms of one volume may overlap: their water counts once.
        out.dedup_by(|next, last| {
            let joined = next.volume == last.volume && next.from <= last.to + self.eps;
            if joined {
                last.to = last.to.max(next.to);
            }
            joined
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Expression;
    use crate::space::Vec3;

    fn volumes(regions: &[(&str, &str)]) -> Volumes {
        let body = |name: &str, code: &str, data: &[f64]| NamedBody { name: name.into(), body: Body::new(code, data).unwrap(), line: 0 };
        let bodies = [
            body("box", "RPP", &[0.0, 10.0, -1.0, 1.0, -1.0, 1.0]),
            body("ball", "SPH", &[10.0, 0.0, 0.0, 3.0]),
            body("hole", "RCC", &[4.0, 0.0, -5.0, 0.0, 0.0, 10.0, 0.5]),
        ];
        let regions: Vec<RegionSource> = regions
            .iter()
            .map(|(name, is)| RegionSource { name: (*name).into(), expression: Expression::parse(is).unwrap(), void: false, line: 0 })
            .collect();
        Volumes::new(&bodies, &regions).unwrap()
    }

    fn passages(v: &Volumes, x: f64, t_max: f64) -> Vec<(f64, f64, u32)> {
        let mut out = Vec::new();
        v.passages(&Ray::new(Vec3::new(x, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0)), t_max, &mut out);
        out.iter().map(|p| (p.from, p.to, p.volume)).collect()
    }

    #[test]
    fn terms_of_one_volume_join_and_volumes_overlap() {
        let v = volumes(&[("cloud", "+box -hole OR +ball"), ("core", "+ball")]);
        assert_eq!(passages(&v, -5.0, 100.0), [(5.0, 8.5, 0), (9.5, 18.0, 0), (12.0, 18.0, 1)]);
        assert_eq!(v.bounds()[0].max.x, 13.0);
        // A ray that starts inside, and one that ends inside.
        assert_eq!(passages(&v, 2.0, 4.0), [(0.0, 1.5, 0), (2.5, 4.0, 0)]);
        assert_eq!(passages(&v, 14.0, 4.0), []);
    }
}

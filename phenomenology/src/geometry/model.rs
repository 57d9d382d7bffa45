//! Bodies and regions, prepared for the intersection with rays.

use super::bvh::Bvh;
use super::error::{GeometryError, some_names};
use super::expression::Expression;
use super::term::{Crossing, Term, union};
use crate::primitives::Body;
use crate::space::Beam;
use crate::space::Bounds;
use crate::space::Ray;
use crate::space::Vec3;
use std::collections::HashMap;

/// Largest number of terms of a solid region after empty regions are cut away.
const MAX_TERMS: usize = 512;

/// A body with its name.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedBody {
    /// Name, unique in the geometry.
    pub name: String,
    /// The body.
    pub body: Body,
    /// Line of its file, 0 if there is none.
    pub line: usize,
}

/// A region as it is written: its bodies are names.
#[derive(Debug, Clone, PartialEq)]
pub struct RegionSource {
    /// Name, unique in the geometry.
    pub name: String,
    /// The bodies it is made of.
    pub expression: Expression,
    /// Whether it is empty space. An empty region is cut away from the solid regions listed after it.
    pub void: bool,
    /// Line of its file, 0 if there is none.
    pub line: usize,
}

/// A region.
#[derive(Debug, Clone)]
pub struct Region {
    /// Its source.
    pub source: RegionSource,
    terms: Vec<Term>,
}

/// The point where a ray hits a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance, m.
    pub t: f64,
    /// Index of the region.
    pub region: u32,
    /// Index of the body.
    pub body: u32,
    /// Face of the body, from 1.
    pub face: u8,
    /// Whether the body is subtracted, so that its normal points into the region.
    pub subtracted: bool,
}

/// All bodies and regions of a scene.
#[derive(Debug, Clone)]
pub struct Geometry {
    bodies: Vec<NamedBody>,
    regions: Vec<Region>,
    solids: Vec<Body>,
    /// Terms of solid regions, without the empty regions listed before them, and the numbers of the regions. // [leaf]
    leaves: Vec<(Term, u32)>,
    /// Boxes that hold them, enlarged a little, so that a ray in the plane of a face meets the box of its body. // [leaf]
    boxes: Vec<Bounds>,
    tree: Bvh,
    bounds: Bounds,
    eps: f64,
}

impl Geometry {
    /// Finds the bodies of the regions, cuts empty regions away and builds the tree.
    ///
    /// A point that lies in several regions belongs to the first of them in the list.
    ///
    /// # Errors
    /// Names given twice, unknown bodies, regions without bodies or of infinite size.
    pub fn new(bodies: Vec<NamedBody>, regions: Vec<RegionSource>) -> Result<Self, GeometryError> {
        let names = index(bodies.iter().map(|b| (b.name.as_str(), b.line)), "body")?;
        index(regions.iter().map(|r| (r.name.as_str(), r.line)), "region")?;
        let solids: Vec<Body> = bodies.iter().map(|b| b.body.clone()).collect();
        let regions = regions
            .into_iter()
            .map(|source| terms_of(&source, &names, &bodies).map(|terms| Region { source, terms }))
            .collect::<Result<Vec<_>, _>>()?;
        drop(names);

        let mut leaves: Vec<(Term, u32)> = Vec::new();
        for (at, region) in regions.iter().enumerate().filter(|(_, r)| !r.source.void) {
            let mut terms = region.terms.clone();
            for empty in regions[..at].iter().filter(|r| r.source.void).flat_map(|r| &r.terms) {
                terms = terms.into_iter().flat_map(|t| without(t, empty, &solids)).collect();
                if terms.len() > MAX_TERMS {
                    let RegionSource { name, line, .. } = &region.source;
                    let what = "terms after the empty regions listed before it are cut away";
                    return Err(GeometryError::at(*line, format!("region `{name}` has more than {MAX_TERMS} {what}")));
                }
            }
            leaves.extend(terms.into_iter().map(|t| (t, at as u32)));
        }
        let boxes: Vec<Bounds> = leaves.iter().map(|(t, _)| bounds_of(t, &solids)).collect();
        let bounds = boxes.iter().filter(|b| !b.is_empty()).fold(Bounds::EMPTY, |a, b| a.union(*b));
        let reach = if bounds.is_empty() { 1.0 } else { bounds.size().norm().max(bounds.min.norm()).max(bounds.max.norm()) };
        let eps = 1e-9 * reach.clamp(1e-3, 1e9);
        let boxes: Vec<Bounds> = boxes.into_iter().map(|b| if b.is_empty() { b } else { b.grown(eps) }).collect();
        let tree = Bvh::new(&boxes);
        Ok(Self { bodies, regions, solids, leaves, boxes, tree, bounds, eps })
    }

    /// The bodies.
    #[must_use]
    pub fn bodies(&self) -> &[NamedBody] {
        &self.bodies
    }

    /// The regions, in order.
    #[must_use]
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// The box around all solid regions. It is empty if there are none.
    #[must_use]
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Distance below which two crossings count as one, m. It is 1e-9 of the size of the scene.
    #[must_use]
    pub fn eps(&self) -> f64 {
        self.eps
    }

    /// Index of a region by name.
    ///
    /// # Errors
    /// [`GeometryError::UnknownRegion`] with the known names.
    pub fn region_index(&self, name: &str) -> Result<usize, GeometryError> {
        self.regions.iter().position(|r| r.source.name == name).ok_or_else(|| GeometryError::UnknownRegion {
            name: name.to_owned(),
            known: some_names("regions", self.regions.iter().map(|r| r.source.name.as_str())),
        })
    }

    /// The first solid region that a ray from empty space enters before `t_max`. If several regions begin at one point, the first in the
    /// list is returned.
    #[must_use]
    #[inline]
    pub fn first_hit(&self, ray: &Ray, t_max: f64) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.tree.visit(ray, t_max, |leaf, limit| self.nearer(leaf, ray, limit, &mut best));
        best
    }

    /// As [`Geometry::first_hit`], if the ray can meet only these leaves. Each comes after a distance in m before which the ray cannot meet it, and
    /// they are sorted by it.
    #[must_use]
    #[inline]
    pub fn first_hit_of(&self, leaves: &[(f64, u32)], ray: &Ray, t_max: f64) -> Option<Hit> {
        let (mut best, mut limit) = (None, t_max);
        for &(entry, leaf) in leaves {
            if entry > limit {
                break;
            }
            if self.boxes[leaf as usize].entry(ray, limit).is_some() {
                limit = self.nearer(leaf, ray, limit, &mut best);
            }
        }
        best
    }

    /// Finds the leaves (terms of solid regions) that rays of a beam may meet, in the order of [`Geometry::first_hit_of`]. Returns false if they are
    /// more than `most`.
    #[must_use]
    pub fn in_the_way(&self, beam: &Beam, most: usize, found: &mut Vec<(f64, u32)>) -> bool {
        // Boxes of the tree hold two leaves, and hold them loosely.
        if !self.tree.in_the_way(beam, most.saturating_mul(4), found) {
            return false;
        }
        found.retain_mut(|(entry, leaf)| beam.entry(&self.boxes[*leaf as usize]).map(|own| *entry = own).is_some());
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.len() <= most
    }

    /// Replaces the best hit by that of a leaf if it is nearer than `limit`. Returns the new limit.
    #[inline]
    fn nearer(&self, leaf: u32, ray: &Ray, limit: f64, best: &mut Option<Hit>) -> f64 {
        let (term, region) = &self.leaves[leaf as usize];
        if let Some(c) = term.entry(&self.solids, ray, self.eps, limit)
            && best.is_none_or(|b| c.t < b.t - self.eps || (c.t <= b.t + self.eps && *region < b.region))
        {
            *best = Some(Hit { t: c.t, region: *region, body: c.body, face: c.face, subtracted: c.subtracted });
        }
        best.map_or(limit, |b| b.t + self.eps)
    }

    /// The nearest border of one region along a ray that starts outside or inside. `None` if there is none.
    #[must_use]
    pub fn nearest_border(&self, region: usize, ray: &Ray) -> Option<Hit> {
        let terms = &self.regions[region].terms;
        let stretches = terms.iter().flat_map(|t| t.stretches(&self.solids, ray, self.eps)).collect();
        let crossing = union(stretches, self.eps).into_iter().flat_map(|(a, b)| [a, b]).find(|c| c.t > self.eps && c.t.is_finite())?;
        let Crossing { t, body, face, subtracted } = crossing;
        Some(Hit { t, region: region as u32, body, face, subtracted })
    }

    /// Outward unit normal of the region at a hit.
    #[must_use]
    #[inline]
    pub fn normal(&self, hit: &Hit, point: Vec3) -> Vec3 {
        let n = self.solids[hit.body as usize].solid.normal(hit.face, point);
        if hit.subtracted { -n } else { n }
    }

    /// Whether a region contains a point, regardless of the regions listed before it.
    #[must_use]
    pub fn region_contains(&self, region: usize, point: Vec3) -> bool {
        self.regions[region].terms.iter().any(|t| t.contains(&self.solids, point))
    }

    /// The first region in the list that contains a point.
    #[must_use]
    pub fn region_at(&self, point: Vec3) -> Option<usize> {
        (0..self.regions.len()).find(|r| self.region_contains(*r, point))
    }
}

pub(super) fn index<'a>(names: impl Iterator<Item = (&'a str, usize)>, what: &'static str) -> Result<HashMap<String, u32>, GeometryError> {
    let mut map: HashMap<String, u32> = HashMap::new();
    let mut lines = Vec::new();
    for (i, (name, line)) in names.enumerate() {
        if let Some(first) = map.insert(name.to_owned(), i as u32) {
            let first = lines[first as usize];
            return Err(GeometryError::at(line, format!("{what} `{name}` was already given at line {first}; names must differ")));
        }
        lines.push(line);
    }
    Ok(map)
}

pub(super) fn terms_of(source: &RegionSource, names: &HashMap<String, u32>, bodies: &[NamedBody]) -> Result<Vec<Term>, GeometryError> {
    let (line, region) = (source.line, &source.name);
    if source.expression.terms.is_empty() {
        return Err(GeometryError::no_body(line, region));
    }
    let mut terms = Vec::with_capacity(source.expression.terms.len());
    for literals in &source.expression.terms {
        let mut term = Term::default();
        for l in literals {
            let Some(&body) = names.get(&l.body) else {
                let known = some_names("bodies", bodies.iter().map(|b| b.name.as_str()));
                return Err(GeometryError::at(line, format!("region `{region}` names unknown body `{}`; {known}", l.body)));
            };
            if l.inside { &mut term.plus } else { &mut term.minus }.push(body);
        }
        if term.plus.is_empty() && !source.void {
            let message = format!("region `{region}` has a term without a + body, so it is infinite; add a + body that contains it");
            return Err(GeometryError::at(line, message));
        }
        terms.push(term);
    }
    Ok(terms)
}

pub(super) fn bounds_of(term: &Term, solids: &[Body]) -> Bounds {
    term.plus.iter().fold(Bounds::ALL, |b, i| b.intersection(solids[*i as usize].solid.bounds()))
}

/// A term with another one cut away: `T and not (a and not b)` is `T and not a, or T and b`.
fn without(term: Term, empty: &Term, solids: &[Body]) -> Vec<Term> {
    if bounds_of(&term, solids).intersection(bounds_of(empty, solids)).is_empty() {
        return vec![term];
    }
    let cut = empty.plus.iter().map(|b| {
        let mut t = term.clone();
        t.minus.push(*b);
        t
    });
    let kept = empty.minus.iter().map(|b| {
        let mut t = term.clone();
        t.plus.push(*b);
        t
    });
    cut.chain(kept).filter(|t| !bounds_of(t, solids).is_empty()).collect()
}

//! The intersection of a ray with one term of a region: the space inside some bodies and outside others.

use crate::primitives::Body;
use crate::space::{Ray, Span};

/// A crossing of the border of a term.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub t: f64,
    /// Index of the body.
    pub body: u32,
    /// Its face.
    pub face: u8,
    /// Whether the body is subtracted, so that its normal points into the region.
    pub subtracted: bool,
}

/// A stretch of a ray inside a term.
pub(super) type Stretch = (Crossing, Crossing);

/// The intersection of bodies and complements of bodies, by index.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Term {
    pub plus: Vec<u32>,
    pub minus: Vec<u32>,
}

impl Term {
    /// The stretch of a ray inside all bodies with a plus.
    #[inline]
    fn common(&self, bodies: &[Body], ray: &Ray) -> Option<Stretch> {
        let at = |t, body, face| Crossing { t, body, face, subtracted: false };
        let mut stretch = (at(f64::NEG_INFINITY, 0, 0), at(f64::INFINITY, 0, 0));
        for &body in &self.plus {
            let s = bodies[body as usize].solid.intersect(ray)?;
            if s.t_in > stretch.0.t {
                stretch.0 = at(s.t_in, body, s.face_in);
            }
            if s.t_out < stretch.1.t {
                stretch.1 = at(s.t_out, body, s.face_out);
            }
            if stretch.0.t >= stretch.1.t {
                return None;
            }
        }
        Some(stretch)
    }

    /// The first point beyond `eps` where a ray enters the term. A ray that starts inside the term must leave it first.
    #[inline]
    pub(super) fn entry(&self, bodies: &[Body], ray: &Ray, eps: f64, t_max: f64) -> Option<Crossing> {
        let (first, last) = self.common(bodies, ray)?;
        if last.t <= eps || first.t > t_max || last.t - first.t <= eps {
            return None;
        }
        if self.minus.is_empty() {
            return (first.t > eps).then_some(first);
        }
        let mut here = first;
        let mut in_solid_at_start = first.t <= eps;
        let mut t = first.t.max(eps);
        // In every pass the ray leaves one body or moves to the entry of one. A convex body is left only once, so the loop always returns.
        for _ in 0..=2 * self.minus.len() {
            let mut left: Option<Crossing> = None;
            let mut next_hole = f64::INFINITY;
            for &body in &self.minus {
                let Some(s) = bodies[body as usize].solid.intersect(ray) else { continue };
                if s.t_in <= t + eps && s.t_out > t + eps {
                    if left.is_none_or(|l| s.t_out > l.t) {
                        left = Some(Crossing { t: s.t_out, body, face: s.face_out, subtracted: true });
                    }
                } else if s.t_in > t + eps && s.t_out - s.t_in > eps {
                    next_hole = next_hole.min(s.t_in);
                }
            }
            match left {
                Some(l) => {
                    here = l;
                    t = l.t;
                    in_solid_at_start = false;
                }
                None if in_solid_at_start => t = next_hole,
                None => return (here.t > eps && here.t <= t_max).then_some(here),
            }
            if t >= last.t - eps {
                return None;
            }
        }
        None
    }

    /// Every stretch of a line inside the term.
    pub(super) fn stretches(&self, bodies: &[Body], ray: &Ray, eps: f64) -> Vec<Stretch> {
        let mut inside: Vec<Stretch> = self.common(bodies, ray).into_iter().collect();
        for &body in &self.minus {
            let Some(s) = bodies[body as usize].solid.intersect(ray) else { continue };
            inside = inside.into_iter().flat_map(|stretch| cut(stretch, body, &s)).collect();
        }
        inside.retain(|(a, b)| b.t - a.t > eps);
        inside
    }

    /// Whether a point lies in the term.
    pub(super) fn contains(&self, bodies: &[Body], p: crate::space::Vec3) -> bool {
        let has = |b: &u32| bodies[*b as usize].solid.contains(p);
        self.plus.iter().all(has) && !self.minus.iter().any(has)
    }
}

/// The parts of a stretch outside a body.
fn cut(stretch: Stretch, body: u32, s: &Span) -> impl Iterator<Item = Stretch> {
    let (a, b) = stretch;
    let at = |t, face| Crossing { t, body, face, subtracted: true };
    let before = (a.t < s.t_in).then(|| (a, if s.t_in < b.t { at(s.t_in, s.face_in) } else { b }));
    let after = (b.t > s.t_out).then(|| (if s.t_out > a.t { at(s.t_out, s.face_out) } else { a }, b));
    // If the body lies completely before or behind the stretch, both parts are the whole stretch. Only one is kept.
    let apart = s.t_out <= a.t || s.t_in >= b.t;
    before.into_iter().chain(after.filter(move |_| !apart || before.is_none()))
}

/// The union of stretches, sorted. Stretches that touch or overlap are joined.
pub(super) fn union(mut stretches: Vec<Stretch>, eps: f64) -> Vec<Stretch> {
    stretches.sort_by(|p, q| p.0.t.total_cmp(&q.0.t));
    let mut out: Vec<Stretch> = Vec::new();
    for s in stretches {
        match out.last_mut() {
            Some(last) if s.0.t <= last.1.t + eps => {
                if s.1.t > last.1.t {
                    last.1 = s.1;
                }
            }
            _ => out.push(s),
        }
    }
    out
}

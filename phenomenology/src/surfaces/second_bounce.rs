//! The second bounce on a surface of Gaussian facets.
//!
//! A mirror ray that does not leave the surface hits a second facet. The probability of a facet follows from the slopes alone: along a
//! ray of direction `r` it is proportional to the projected area `-n.r`. The second mirror ray leaves with the shadowing probability of
//! its direction. The heights of the two facets are assumed to be independent, as in bistatic shadowing.

use super::fresnel::Reflection;
use super::quadrature::{Rule, legendre_12, normal_8};
use super::shadowing::lambda_of_direction;
use super::wagner_lynch::{Facet, FacetSurface, REACH, Sky, View};

type Vector = [f64; 3];

/// Fraction of the power below which a blocked ray is not followed.
const NEGLIGIBLE: f64 = 1e-9;

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Unit vector across both, or any across `k` where they are parallel.
fn normal_to(n: Vector, k: Vector) -> Vector {
    let c = cross(n, k);
    let size = dot(c, c).sqrt();
    if size > 1e-12 { c.map(|x| x / size) } else { normal_to(if k[0].abs() < 0.9 { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] }, k) }
}

/// The field of a ray, as real vectors: `E = x + y`, and the powers and correlation of the two.
struct RayField {
    h: Vector,
    v: Vector,
    power_h: f64,
    power_v: f64,
    correlation: f64,
}

impl RayField {
    /// Field of the mirror ray for observed polarisation `e`, after the first facet.
    fn after(e: Vector, h: Vector, v_out: Vector, v_in: Vector, r: &Reflection) -> Self {
        let (along_h, along_v) = (dot(e, h), dot(e, v_out));
        Self {
            h,
            v: v_in,
            power_h: along_h * along_h * r.power_h,
            power_v: along_v * along_v * r.power_v,
            correlation: along_h * along_v * r.cross.re,
        }
    }

    /// Power along a unit vector.
    fn along(&self, e: Vector) -> f64 {
        let (x, y) = (dot(self.h, e), dot(self.v, e));
        self.power_h * x * x + self.power_v * y * y + 2.0 * self.correlation * x * y
    }
}

/// Contribution of the second reflection, `[h, v]`.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SecondBounce {
    pub reflectivity: [f64; 2],
    pub scattered_sky_k: [f64; 2],
}

/// Reflectivity and scattered sky by two reflections.
///
/// `escaping` is the power that leaves after one reflection if every facet is a perfect mirror. `rule` is the quadrature rule of the first
/// facets.
pub(super) fn second_bounce(surface: FacetSurface<'_>, view: &View, sky: Sky<'_>, escaping: f64, rule: &'static Rule) -> SecondBounce {
    let FacetSurface { slopes, shadowing, .. } = surface;
    let mut sums = SecondBounce::default();
    let seen = shadowing.single(view.lambda);
    let reach = REACH * view.frame.sigma_a;
    let top = reach.min(view.facing_limit());
    let (up_lo, up_hi) = view.upward_interval();
    let mut blocked_sum = 0.0;
    // The blocked fraction has a kink at the slope where mirror rays begin to point down.
    for (a, wa) in pieces(rule, -reach, top, [up_lo, 0.0, up_hi]) {
        let (lo, hi) = view.occurring_interval(a);
        let limit = view.upward_limit(a).unwrap_or(0.0);
        for (b, wb) in pieces(rule, lo, hi, [-limit, 0.5 * (lo + hi), limit]) {
            let f = view.facet(a, b, view.multiplicity() * wa * wb);
            let r = view.mirrored(&f);
            let leaving = if r[2] > 0.0 {
                let lambda = lambda_of_direction(slopes, view.to_surface(r));
                shadowing.bistatic(view.lambda, lambda, false)
            } else {
                0.0
            };
            let blocked = f.weight * (seen - leaving);
            blocked_sum += blocked;
            if blocked > NEGLIGIBLE {
                add_path(surface, view, sky, (&f, blocked), &mut sums);
            }
        }
    }
    // The rule here is coarser than that of the first reflection. The sum must not exceed the power that is left.
    let left = (seen * (1.0 + view.lambda) - escaping).max(0.0);
    if blocked_sum > left {
        let scale = left / blocked_sum;
        sums.reflectivity = sums.reflectivity.map(|x| x * scale);
        sums.scattered_sky_k = sums.scattered_sky_k.map(|x| x * scale);
    }
    sums
}

/// Nodes of a rule on the pieces of an interval. Cuts outside the interval have no effect.
fn pieces(rule: &'static Rule, lo: f64, hi: f64, cuts: [f64; 3]) -> impl Iterator<Item = (f64, f64)> {
    let mut edges = [lo, cuts[0].clamp(lo, hi), cuts[1].clamp(lo, hi), cuts[2].clamp(lo, hi), hi];
    edges.sort_by(f64::total_cmp);
    (0..4).filter(move |&i| edges[i + 1] - edges[i] > 1e-12 * (hi - lo)).flat_map(move |i| rule.on(edges[i], edges[i + 1]))
}

/// Follows the blocked ray of one facet to the second facets.
fn add_path(surface: FacetSurface<'_>, view: &View, sky: Sky<'_>, (first, blocked): (&Facet, f64), sums: &mut SecondBounce) {
    let FacetSurface { stack, slopes, shadowing } = surface;
    let s = [view.sin, 0.0, view.cos];
    let n = [-first.a / first.d, -first.b / first.d, 1.0 / first.d];
    let r = view.mirrored(first);
    let h = normal_to(n, s);
    let reflection = stack.reflection_cos(first.cos_chi);
    // Radiation travels along -r and then along s.
    let v_in = cross(h, r.map(|x| -x));
    let v_out = cross(h, s);
    let global_h = [0.0, 1.0, 0.0];
    let fields = [global_h, cross(global_h, s)].map(|e| RayField::after(e, h, v_out, v_in, &reflection));
    let r = view.to_surface(r);
    let fields = fields.map(|f| RayField { h: view.to_surface(f.h), v: view.to_surface(f.v), ..f });

    let horizontal = r[0].hypot(r[1]);
    let (cx, cy) = if horizontal > 1e-9 { (r[0] / horizontal, r[1] / horizontal) } else { (1.0, 0.0) };
    let frame = slopes.in_frame(cx, cy);
    let least = if horizontal > 1e-9 { r[2] / horizontal } else { -f64::INFINITY * -r[2].signum() };
    if least == f64::INFINITY {
        return; // a vertical ray meets no other facet
    }
    let span = REACH * frame.sigma_a;
    let (lo, hi) = if least > 0.0 { (least, least.hypot(span)) } else { (least.max(-span), span) };
    let reference = if least > 0.0 { least * least } else { 0.0 };

    let mut norm = 0.0;
    let mut power = [0.0; 2];
    let mut brightness = [0.0; 2];
    for (a, wa) in legendre_12().on(lo, hi) {
        let facing = a * horizontal - r[2];
        let density = (-0.5 * (a * a - reference) / (frame.sigma_a * frame.sigma_a)).exp();
        let (mean, sigma) = frame.b_given_a(a);
        for &(y, wy) in normal_8().points() {
            let b = mean + sigma * y;
            let weight = wa * wy * density * facing;
            norm += weight;
            let d = (1.0 + a * a + b * b).sqrt();
            let n2 = [-(a * cx - b * cy) / d, -(a * cy + b * cx) / d, 1.0 / d];
            let cos_chi = facing / d;
            let r2 = [0, 1, 2].map(|i| r[i] + 2.0 * cos_chi * n2[i]);
            if r2[2] <= 0.0 {
                continue;
            }
            let lambda = lambda_of_direction(slopes, r2);
            let leaves = weight * shadowing.single(lambda);
            let reflected = stack.reflection_cos(cos_chi.min(1.0));
            let h2 = normal_to(n2, r);
            let v2 = cross(h2, r);
            let zenith = r2[2].min(1.0).acos();
            let sky_k = match sky {
                Sky::Symmetric(t) => t(zenith),
                Sky::Full(t) => t(zenith, r2[1].atan2(r2[0])),
            };
            for p in 0..2 {
                let gamma = fields[p].along(h2) * reflected.power_h + fields[p].along(v2) * reflected.power_v;
                power[p] += leaves * gamma;
                brightness[p] += leaves * gamma * sky_k;
            }
        }
    }
    if norm > 0.0 {
        for p in 0..2 {
            sums.reflectivity[p] += blocked * power[p] / norm;
            sums.scattered_sky_k[p] += blocked * brightness[p] / norm;
        }
    }
}

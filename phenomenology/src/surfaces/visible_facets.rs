//! Draws of the facets that an observer sees, for tracing rays that a rough surface reflects.
//!
//! Slopes are drawn with the weight `W S1` of the [facet integrals](super::GeometricOptics::integrals), so the mean over draws is the
//! integral. In slopes divided by their rms values (a stretched surface, Heitz 2014) both slopes are standard normal, and only the slope along
//! the observer carries the factor of projection. Its distribution function is `c Phi(x) + h phi(x)`, which Newton's method inverts.
//! A mirror ray leaves the surface with the bistatic shadowing probability. A blocked ray is drawn on to a second facet
//! in the same way if the closure of the surface asks for it, and is absorbed otherwise. No ray falls back to the mean plane.

use super::geometric_optics::{Closure, GeometricOptics};
use super::shadowing::{Shadowing, shadow_lambda_v};
use super::slopes::Slopes;
use crate::space::Vec3;
use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2};

/// Cosine over stretched sine of an upward ray above which no facet blocks it: the probability is below 1e-17.
const CLEAR: f64 = 6.0 * SQRT_2;
/// Largest size of a standard normal slope.
const STEEPEST: f64 = 9.0;
/// Largest number of steps to invert a distribution function, and the accuracy of the slope.
const STEPS: (usize, f64) = (40, 1e-9);

/// Facets of a surface, with their first axis in a direction of its plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisibleFacets {
    slopes: Slopes,
    shadowing: Shadowing,
    closure: Closure,
    /// First slope axis in the plane of the surface.
    axis: [f64; 2],
}

/// The reflections of one ray on facets, in the frame of the surface: `z` is its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FacetPath {
    /// Unit normals of the facets, in the order of a ray that is followed backwards.
    pub normals: [Vec3; 2],
    /// Number of facets, 1 or 2.
    pub facets: usize,
    /// Direction in which the ray leaves, with `z > 0`.
    pub direction: Vec3,
    /// Weight of the draw, without the reflectivities of the facets.
    pub weight: f64,
}

impl VisibleFacets {
    /// The facets of a surface. `axis` is the unit vector along the first slope axis, in the plane of the surface.
    #[must_use]
    pub fn new(go: &GeometricOptics, axis: [f64; 2]) -> Self {
        Self { slopes: go.slopes, shadowing: go.shadowing, closure: go.closure, axis }
    }

    /// Rays from an observer, who is seen from the surface along the unit vector `to_observer`: through one facet, and, if the draw selects it,
    /// through a second. The numbers of `draw` lie between 0 and 1.
    ///
    /// # Reference
    /// Heitz 2014, J. Computer Graphics Techniques 3(2), 48, section 5 (visible normals by stretching); Heitz et al. 2016, ACM Trans. Graphics 35,
    /// 58 (further facets of the same surface).
    #[must_use]
    pub fn draw(&self, to_observer: Vec3, draw: [f64; 5]) -> [Option<FacetPath>; 2] {
        let s = self.stretched(to_observer);
        let Some(slope) = facing_slope(s.cos, s.sin, draw[0]) else { return [None; 2] };
        let first = self.normal(&s, slope, draw[1]);
        let ray = (-to_observer).mirrored(first);
        let lambda = s.lambda();
        let seen = self.shadowing.single(lambda);
        // The draws stand for `W/(1 + Lambda)`, the integrals for `W S1` and `W S12`.
        let all = seen * (1.0 + lambda);
        let leaving = if ray.z > 0.0 { self.shadowing.bistatic(lambda, self.stretched(ray).lambda(), false) / seen } else { 0.0 };
        let once = FacetPath { normals: [first; 2], facets: 1, direction: ray, weight: all * leaving };
        let twice = (self.closure == Closure::SecondBounce && draw[2] >= leaving).then(|| self.second(first, ray, all, [draw[3], draw[4]]));
        [(leaving > 0.0).then_some(once), twice.flatten()]
    }

    /// The path of a blocked ray through a second facet. `None` if it does not leave the surface from there.
    fn second(&self, first: Vec3, ray: Vec3, all: f64, draw: [f64; 2]) -> Option<FacetPath> {
        // The second facet faces the ray: it is seen along `-ray`.
        let back = self.stretched(-ray);
        let second = self.normal(&back, facing_slope(back.cos, back.sin, draw[0])?, draw[1]);
        let direction = ray.mirrored(second);
        let weight = if direction.z > 0.0 { all * self.shadowing.single(self.stretched(direction).lambda()) } else { 0.0 };
        (weight > 0.0).then_some(FacetPath { normals: [first, second], facets: 2, direction, weight })
    }

    /// A direction over the surface of unit slopes.
    fn stretched(&self, d: Vec3) -> Stretched {
        let [x, y] = self.axis;
        let (along, across) = (self.slopes.along * (d.x * x + d.y * y), self.slopes.across * (d.y * x - d.x * y));
        let sin = along.hypot(across);
        let azimuth = if sin > 1e-15 { [along / sin, across / sin] } else { [1.0, 0.0] };
        Stretched { cos: d.z, sin, azimuth }
    }

    /// The normal of the facet with a stretched slope towards a direction. `draw` gives its slope across.
    fn normal(&self, towards: &Stretched, slope: f64, draw: f64) -> Vec3 {
        let ([c, s], other) = (towards.azimuth, normal_quantile(draw));
        let (along, across) = (self.slopes.along * (slope * c - other * s), self.slopes.across * (slope * s + other * c));
        let [x, y] = self.axis;
        Vec3::new(-(along * x - across * y), -(along * y + across * x), 1.0).unit()
    }
}

/// A direction over a surface of unit slopes: cosine, horizontal length, and azimuth from the first slope axis.
struct Stretched {
    cos: f64,
    sin: f64,
    azimuth: [f64; 2],
}

impl Stretched {
    fn lambda(&self) -> f64 {
        if self.cos > CLEAR * self.sin { 0.0 } else { shadow_lambda_v(self.cos / (SQRT_2 * self.sin)) }
    }
}

/// The standard normal slope `x` at which a fraction `draw` of the projected area lies below: `c Phi(x) + h phi(x)` over its value at the
/// steepest facet that still faces the observer, `x = c/h`. `None` for a direction that meets no facet.
fn facing_slope(c: f64, h: f64, draw: f64) -> Option<f64> {
    if c <= -CLEAR * h {
        return None;
    }
    if c > 1e9 * h {
        return Some(normal_quantile(draw));
    }
    let last = c / h;
    let distribution = |x: f64| last * normal_below(x) + normal_density(x);
    let (mut lo, mut hi) = (-STEEPEST + last.min(0.0), last.min(STEEPEST));
    let target = draw * distribution(hi);
    // Far from grazing the slope is nearly normal.
    let mut x = if last > 1.0 { normal_quantile(draw) } else { hi - 1.0 };
    for _ in 0..STEPS.0 {
        if !(x > lo && x < hi) {
            x = 0.5 * (lo + hi);
        }
        let off = distribution(x) - target;
        if off > 0.0 {
            hi = x
        } else {
            lo = x
        }
        let step = off / (normal_density(x) * (last - x));
        x -= step;
        if step.abs() < STEPS.1 || hi - lo < STEPS.1 {
            break;
        }
    }
    Some(x.clamp(lo.min(hi), hi))
}

fn normal_below(x: f64) -> f64 {
    0.5 * libm::erfc(-x * FRAC_1_SQRT_2)
}

fn normal_density(x: f64) -> f64 {
    libm::exp(-0.5 * x * x) / (2.0 * PI).sqrt()
}

/// The number below which a standard normal variable lies with a probability, to a relative 1.2e-9.
///
/// # Reference
/// Acklam 2003, An algorithm for computing the inverse normal cumulative distribution function.
fn normal_quantile(probability: f64) -> f64 {
    const A: [f64; 6] = [
        -3.969_683_028_665_376e1,
        2.209_460_984_245_205e2,
        -2.759_285_104_469_687e2,
        1.383_577_518_672_69e2,
        -3.066_479_806_614_716e1,
        2.506_628_277_459_239,
    ];
    const B: [f64; 6] = [
        -5.447_609_879_822_406e1,
        1.615_858_368_580_409e2,
        -1.556_989_798_598_866e2,
        6.680_131_188_771_972e1,
        -1.328_068_155_288_572e1,
        1.0,
    ];
    const C: [f64; 6] = [
        -7.784_894_002_430_293e-3,
        -3.223_964_580_411_365e-1,
        -2.400_758_277_161_838,
        -2.549_732_539_343_734,
        4.374_664_141_464_968,
        2.938_163_982_698_783,
    ];
    const D: [f64; 5] = [7.784_695_709_041_462e-3, 3.224_671_290_700_398e-1, 2.445_134_137_142_996, 3.754_408_661_907_416, 1.0];
    let horner = |k: &[f64], x: f64| k.iter().fold(0.0, |sum, c| sum * x + c);
    let p = probability.clamp(1e-300, 1.0 - 1e-16);
    let tail = |p: f64| {
        let q = (-2.0 * libm::log(p)).sqrt();
        horner(&C, q) / horner(&D, q)
    };
    match p {
        p if p < 0.024_25 => tail(p),
        p if p > 1.0 - 0.024_25 => -tail(1.0 - p),
        p => {
            let q = p - 0.5;
            q * horner(&A, q * q) / horner(&B, q * q)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::{Sky, Stack};
    use num_complex::Complex64;

    /// Five numbers of an additive sequence (R5, Roberts 2018).
    fn numbers(k: u32) -> [f64; 5] {
        let g = 1.167_303_978_261_418_7_f64;
        std::array::from_fn(|d| (0.5 + f64::from(k) * g.powi(-(d as i32) - 1)).fract())
    }

    #[test]
    fn quantiles_invert_the_normal_distribution() {
        for p in [1e-12, 1e-4, 0.02, 0.024_25, 0.3, 0.5, 0.77, 0.98, 0.999_9] {
            assert!((normal_below(normal_quantile(p)) / p - 1.0).abs() < 1e-7, "{p}");
        }
    }

    #[test]
    fn slopes_invert_their_distribution_at_every_angle() {
        for ratio in [1e12, 1e3, 9.0, 3.0, 1.0, 0.1, 1e-3, 0.0, -0.5, -3.0, -7.0] {
            let of = |x: f64| ratio * normal_below(x) + normal_density(x);
            for draw in [1e-9, 0.01, 0.3, 0.5, 0.9, 0.999, 1.0 - 1e-9] {
                let x = facing_slope(ratio, 1.0, draw).unwrap();
                let last = of(ratio.min(STEEPEST));
                assert!(x <= ratio && (of(x) / last - draw).abs() < 1e-5, "{ratio} {draw}: {x} {}", of(x) / last);
            }
        }
        assert_eq!(facing_slope(-9.0, 1.0, 0.5), None);
    }

    /// The mean over draws is the integral over facets, with both polarisations, for one and two reflections.
    #[test]
    fn draws_have_the_mean_of_the_integrals() {
        let stack = Stack::half_space(Complex64::new(8.2, -13.9), 290.0, 94e9).unwrap();
        let sky = |zenith: f64| 280.0 * (1.0 - (-0.08 / zenith.cos().max(1e-9)).exp());
        for (along, across, degrees, shadowing, closure) in [
            (0.2, 0.2, 30.0_f64, Shadowing::Smith, Closure::ReEmit),
            (0.2, 0.2, 70.0, Shadowing::Smith, Closure::SecondBounce),
            (0.3, 0.1, 80.0, Shadowing::Smith, Closure::SecondBounce),
            (0.25, 0.15, 60.0, Shadowing::Wagner, Closure::ReEmit),
        ] {
            let mut go = GeometricOptics::new(Slopes::new(along, across).unwrap());
            (go.shadowing, go.closure) = (shadowing, closure);
            let (theta, azimuth) = (degrees.to_radians(), 0.7_f64);
            let want = go.response(&stack, theta, azimuth, Sky::Symmetric(&sky));
            // Slope axis along x; the observer stands at an azimuth from it.
            let facets = VisibleFacets::new(&go, [1.0, 0.0]);
            let s = Vec3::new(theta.sin() * azimuth.cos(), theta.sin() * azimuth.sin(), theta.cos());
            let n = 60_000;
            let (mut power, mut sky_k) = ([0.0; 2], [0.0; 2]);
            for k in 0..n {
                for path in facets.draw(s, numbers(k)).into_iter().flatten() {
                    let mut ray = -s;
                    let h = Vec3::new(0.0, 0.0, 1.0).cross(s).unit();
                    // Real and imaginary part of the field that the antenna receives in h and v.
                    let mut fields = [h, h.cross(s)].map(|e| [e, Vec3::ZERO]);
                    for normal in &path.normals[..path.facets] {
                        let r = stack.reflection_cos(-ray.dot(*normal));
                        let out = ray.mirrored(*normal);
                        let across = normal.cross(-ray).unit();
                        // Radiation travels along `-out`, and then along `-ray`.
                        let (v_in, v_out) = (across.cross(-out), across.cross(-ray));
                        for field in &mut fields {
                            let part = |e: Vec3, amplitude: Complex64| Complex64::new(field[0].dot(e), field[1].dot(e)) * amplitude;
                            let (h, v) = (part(across, r.r_h), part(v_out, r.r_v));
                            *field = [across * h.re + v_in * v.re, across * h.im + v_in * v.im];
                        }
                        ray = out;
                    }
                    assert!((ray - path.direction).norm() < 1e-12 && ray.z > 0.0);
                    for (p, field) in fields.iter().enumerate() {
                        let gamma = path.weight * (field[0].norm2() + field[1].norm2());
                        power[p] += gamma / f64::from(n);
                        sky_k[p] += gamma * sky(ray.z.acos()) / f64::from(n);
                    }
                }
            }
            for p in 0..2 {
                // The sequence has an error well below the 1/sqrt(n) of independent draws, 0.002 here.
                assert!((power[p] - want.reflectivity[p]).abs() < 1e-3, "{go:?} {degrees}: {power:?} {want:?}");
                assert!((sky_k[p] - want.scattered_sky_k[p]).abs() < 0.3, "{go:?} {degrees}: {sky_k:?} {want:?}");
            }
        }
    }
}

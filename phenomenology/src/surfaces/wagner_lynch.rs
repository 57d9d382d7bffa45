//! Emission and single scatter of a surface of Gaussian facets: geometric optics.
//!
//! The frame of an integral has its `x` axis along the azimuth of the observer. Facets have the slopes `a` along and `b` across it. The
//! direction of the observer is `(sin, 0, cos)` of the zenith angle.

use super::quadrature::{Rule, legendre_24, legendre_32};
use super::shadowing::{Shadowing, lambda_of_direction};
use super::slopes::{SlopeFrame, Slopes};
use super::stack::Stack;
use std::f64::consts::{PI, TAU};

/// Number of standard deviations up to which slopes are integrated. A fraction of 2e-11 of the facets lies beyond.
pub(super) const REACH: f64 = 6.7;

/// Sky brightness above a surface.
#[derive(Clone, Copy)]
pub enum Sky<'a> {
    /// Depends on zenith angle only (radians): K.
    Symmetric(&'a dyn Fn(f64) -> f64),
    /// Depends on zenith angle and azimuth (radians, from the first slope axis): K.
    Full(&'a dyn Fn(f64, f64) -> f64),
}

/// Azimuths over which a sky is averaged.
const AZIMUTHS: usize = 16;

impl Sky<'_> {
    /// Mean over azimuth at a zenith angle, K.
    #[must_use]
    pub fn mean(&self, zenith_rad: f64) -> f64 {
        match self {
            Self::Symmetric(t) => t(zenith_rad),
            Self::Full(t) => {
                let at = |k: usize| t(zenith_rad, wrapped(TAU * k as f64 / AZIMUTHS as f64));
                (0..AZIMUTHS).map(at).sum::<f64>() / AZIMUTHS as f64
            }
        }
    }

    /// Brightness in the mirror direction of an observer at an angle of incidence and an azimuth: on the other side of the surface, K.
    #[must_use]
    pub fn mirrored(&self, theta_rad: f64, azimuth_rad: f64) -> f64 {
        match self {
            Self::Symmetric(t) => t(theta_rad),
            Self::Full(t) => t(theta_rad, wrapped(azimuth_rad + PI)),
        }
    }
}

/// An azimuth between -pi and pi.
fn wrapped(azimuth_rad: f64) -> f64 {
    azimuth_rad.sin().atan2(azimuth_rad.cos())
}

/// Integrals over the facets seen from one direction, each `[h, v]`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FacetIntegrals {
    /// Emissivity of the visible facets.
    pub emissivity: [f64; 2],
    /// Brightness they emit, K.
    pub emitted_k: [f64; 2],
    /// Reflectivity by one reflection that leaves the surface.
    pub reflectivity: [f64; 2],
    /// Sky brightness scattered by one reflection, K.
    pub scattered_sky_k: [f64; 2],
    /// The same reflectivity if every facet were a perfect mirror.
    pub escaping: f64,
}

/// A direction of observation over a surface of facets.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    pub cos: f64,
    pub sin: f64,
    pub tan: f64,
    cos_azimuth: f64,
    sin_azimuth: f64,
    pub frame: SlopeFrame,
    /// `Lambda` of the observer.
    pub lambda: f64,
    /// Whether the integrand is symmetric in `b`, so that only `b >= 0` is integrated.
    mirrored: bool,
}

/// A surface of facets: the stack of each facet, the slopes, and the shadowing.
#[derive(Debug, Clone, Copy)]
pub(super) struct FacetSurface<'a> {
    pub stack: &'a Stack,
    pub slopes: &'a Slopes,
    pub shadowing: Shadowing,
}

/// One facet seen by the observer.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facet {
    /// Slope along the view.
    pub a: f64,
    /// Slope across.
    pub b: f64,
    /// `sqrt(1 + a^2 + b^2)`.
    pub d: f64,
    /// Projected weight, times the density of the slopes.
    pub weight: f64,
    /// Cosine of the local angle of incidence.
    pub cos_chi: f64,
}

impl View {
    /// The view of a surface under a sky.
    pub(super) fn new(slopes: &Slopes, theta_rad: f64, azimuth_rad: f64, sky: Sky<'_>) -> Self {
        let (sin, cos) = theta_rad.sin_cos();
        let (sin_azimuth, cos_azimuth) = azimuth_rad.sin_cos();
        let frame = slopes.in_frame(cos_azimuth, sin_azimuth);
        let mut view = Self {
            cos,
            sin,
            tan: sin / cos,
            cos_azimuth,
            sin_azimuth,
            frame,
            lambda: 0.0,
            mirrored: frame.covariance == 0.0 && matches!(sky, Sky::Symmetric(_)),
        };
        view.lambda = lambda_of_direction(slopes, view.to_surface([sin, 0.0, cos]));
        view
    }

    /// A direction of the turned frame in the frame of the slope axes.
    pub(super) fn to_surface(self, d: [f64; 3]) -> [f64; 3] {
        let (c, s) = (self.cos_azimuth, self.sin_azimuth);
        [c * d[0] - s * d[1], s * d[0] + c * d[1], d[2]]
    }

    /// The facet of slopes `a`, `b`, with the measure `area` of its cell in slope space.
    pub(super) fn facet(&self, a: f64, b: f64, area: f64) -> Facet {
        let (mean, sigma) = self.frame.b_given_a(a);
        let (x, y) = (a / self.frame.sigma_a, (b - mean) / sigma);
        let density = (-0.5 * (x * x + y * y)).exp() / (2.0 * PI * sigma * self.frame.sigma_a);
        let d = (1.0 + a * a + b * b).sqrt();
        let facing = (self.cos - a * self.sin).max(0.0);
        Facet { a, b, d, weight: area * density * facing / self.cos, cos_chi: (facing / d).min(1.0) }
    }

    /// Direction of the ray that the facet reflects to the observer.
    pub(super) fn mirrored(&self, f: &Facet) -> [f64; 3] {
        let twice = 2.0 * f.cos_chi / f.d;
        [-twice * f.a - self.sin, -twice * f.b, twice - self.cos]
    }

    /// `cos^2` of the angle between the observer's and the facet's h direction.
    fn cos2_psi(&self, f: &Facet) -> f64 {
        let along = self.sin + f.a * self.cos;
        let size = along * along + f.b * f.b;
        if size > 0.0 { along * along / size } else { 1.0 }
    }

    /// For a given `a`, the largest `|b|` for which the mirror ray points up. `None` if it points down for every `b`.
    pub(super) fn upward_limit(&self, a: f64) -> Option<f64> {
        let (lo, hi) = self.upward_interval();
        (a > lo && a < hi).then(|| ((a - lo) * (hi - a)).sqrt())
    }

    /// Slopes `a` for which some mirror ray points up: `-tan - sec` to `-tan + sec`. The upper limit is written in a form without
    /// cancellation at grazing angles.
    pub(super) fn upward_interval(&self) -> (f64, f64) {
        let sec = 1.0 / self.cos;
        (-self.tan - sec, 1.0 / (self.tan + sec))
    }

    /// Interval of the slopes `b` at a given `a`. The lower half is omitted if the integrand is symmetric.
    pub(super) fn occurring_interval(&self, a: f64) -> (f64, f64) {
        let (mean, sigma) = self.frame.b_given_a(a);
        if self.mirrored { (0.0, REACH * sigma) } else { (mean - REACH * sigma, mean + REACH * sigma) }
    }

    /// Factor for the omitted half of the slopes `b`.
    pub(super) fn multiplicity(&self) -> f64 {
        if self.mirrored { 2.0 } else { 1.0 }
    }

    /// Largest slope `a` whose facet faces the observer.
    pub(super) fn facing_limit(&self) -> f64 {
        if self.sin > 0.0 { self.cos / self.sin } else { f64::INFINITY }
    }
}

/// Quadrature rules of the two slope integrals. The convergence tests compare them with 160 points.
#[derive(Clone, Copy)]
pub(super) struct Rules {
    pub inner: &'static Rule,
    pub outer: &'static Rule,
}

impl Default for Rules {
    fn default() -> Self {
        Self { inner: legendre_24(), outer: legendre_32() }
    }
}

/// Integrals over the facets of a surface seen from a direction.
///
/// `sky` is evaluated in the direction of every mirror ray.
pub(super) fn facet_integrals(surface: FacetSurface<'_>, view: &View, sky: Sky<'_>, rules: Rules) -> FacetIntegrals {
    let mut sums = FacetIntegrals::default();
    emission(surface, view, rules, &mut sums);
    single_scatter(surface, view, sky, rules, &mut sums);
    sums
}

/// `E = int W S1 (1 - Gamma)` over all facets that face the observer.
///
/// # Reference
/// Wagner & Lynch (TRW, 1970s), after Wagner 1967 and Lynch & Wagner 1970, J. Math. Phys. 11, 3032.
fn emission(surface: FacetSurface<'_>, view: &View, rules: Rules, sums: &mut FacetIntegrals) {
    let seen = surface.shadowing.single(view.lambda);
    let reach = REACH * view.frame.sigma_a;
    for (a, wa) in rules.outer.on(-reach, reach.min(view.facing_limit())) {
        let (lo, hi) = view.occurring_interval(a);
        for (b, wb) in rules.inner.on(lo, hi) {
            let f = view.facet(a, b, view.multiplicity() * wa * wb);
            let weight = f.weight * seen;
            let (reflection, emitted) = surface.stack.local_cos(f.cos_chi);
            let c2 = view.cos2_psi(&f);
            let e = turn(c2, reflection.emissivities());
            let t = turn(c2, emitted);
            for p in 0..2 {
                sums.emissivity[p] += weight * e[p];
                sums.emitted_k[p] += weight * t[p];
            }
        }
    }
}

/// `r = int W S12 Gamma` over the facets whose mirror ray points up, and the same integral weighted with the sky.
fn single_scatter(surface: FacetSurface<'_>, view: &View, sky: Sky<'_>, rules: Rules, sums: &mut FacetIntegrals) {
    // Mirror rays point up for slopes inside a circle of radius sec around (-tan, 0). With a = hi - 2 sec sin^2 w the integrand is smooth
    // in w at the borders, and the nodes are dense at the upper border, where mirror rays are grazing.
    let sec = 1.0 / view.cos;
    let (_, up_hi) = view.upward_interval();
    let reach = REACH * view.frame.sigma_a;
    let w_of = |a: f64| (0.5 * (up_hi - a) / sec).clamp(0.0, 1.0).sqrt().asin();
    for (w, ww) in rules.outer.on(w_of(reach), w_of(-reach)) {
        let a = up_hi - 2.0 * sec * w.sin().powi(2);
        let wa = ww * 2.0 * sec * (2.0 * w).sin();
        let Some(limit) = view.upward_limit(a) else {
            continue;
        };
        let (lo, hi) = view.occurring_interval(a);
        let (lo, hi) = (lo.max(-limit), hi.min(limit));
        if hi <= lo {
            continue;
        }
        for (b, wb) in rules.inner.on(lo, hi) {
            let f = view.facet(a, b, wa * wb);
            let r = view.mirrored(&f);
            if r[2] <= 0.0 {
                continue;
            }
            let r_surface = view.to_surface(r);
            let lambda = lambda_of_direction(surface.slopes, r_surface);
            let seen = surface.shadowing.bistatic(view.lambda, lambda, false);
            let local = surface.stack.reflection_cos(f.cos_chi);
            let gamma = turn(view.cos2_psi(&f), local.powers());
            let zenith = r[2].min(1.0).acos();
            let sky_k = match sky {
                Sky::Symmetric(t) => t(zenith),
                Sky::Full(t) => t(zenith, r_surface[1].atan2(r_surface[0])),
            };
            let weight = f.weight * seen * view.multiplicity();
            sums.escaping += weight;
            for (p, g) in gamma.iter().enumerate() {
                sums.reflectivity[p] += weight * g;
                sums.scattered_sky_k[p] += weight * g * sky_k;
            }
        }
    }
}

/// A pair `[h, v]` of the facet in the h and v of the observer.
fn turn(cos2_psi: f64, local: [f64; 2]) -> [f64; 2] {
    let sin2 = 1.0 - cos2_psi;
    [cos2_psi * local[0] + sin2 * local[1], cos2_psi * local[1] + sin2 * local[0]]
}

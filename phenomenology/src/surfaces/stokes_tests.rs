//! Polarisation between a surface and the antenna, by products of Mueller matrices. The tracer is tested against it.
//!
//! The Stokes vector is `(I, Q, U, V)` with `I = T_v + T_h`, `Q = T_v - T_h`, `U = 2 Re<E_v E_h*>`, `V = 2 Im<E_h E_v*>`, for a reference
//! `h` across the ray and `v = h x k` along the propagation `k`. A ray is traced from the antenna outward. It carries the row vector that
//! converts a Stokes vector at the far end to antenna temperature.

use super::fresnel::Reflection;

/// A direction or reference vector.
pub type Vector = [f64; 3];

/// A 4 x 4 matrix acting on Stokes vectors, row by row.
pub type Mueller = [[f64; 4]; 4];

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Mueller matrix of a reflection, in the basis of its own plane of incidence.
#[must_use]
pub fn reflection_mueller(r: &Reflection) -> Mueller {
    let a = 0.5 * (r.power_v + r.power_h);
    let b = 0.5 * (r.power_v - r.power_h);
    let (re, im) = (r.cross.re, r.cross.im);
    [[a, b, 0.0, 0.0], [b, a, 0.0, 0.0], [0.0, 0.0, re, im], [0.0, 0.0, -im, re]]
}

/// Mueller matrix of a turn of the reference by `psi`: `h' = h cos + v sin`.
#[must_use]
pub fn rotation_mueller(psi_rad: f64) -> Mueller {
    let (s, c) = (2.0 * psi_rad).sin_cos();
    [[1.0, 0.0, 0.0, 0.0], [0.0, c, -s, 0.0], [0.0, s, c, 0.0], [0.0, 0.0, 0.0, 1.0]]
}

/// `row` times `matrix`.
fn row_times(row: [f64; 4], matrix: &Mueller) -> [f64; 4] {
    std::array::from_fn(|j| (0..4).map(|i| row[i] * matrix[i][j]).sum())
}

/// The polarisation an antenna receives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AntennaPolarisation {
    /// Along the reference vector.
    H,
    /// Across it.
    V,
}

/// The state of a ray traced from an antenna.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolarisedRay {
    /// Direction of tracing, unit; radiation travels against it.
    pub direction: Vector,
    /// Reference `h`, unit, across the direction.
    pub reference_h: Vector,
    /// Antenna temperature per unit of each Stokes parameter at this end.
    pub weight: [f64; 4],
}

impl PolarisedRay {
    /// A ray leaving an antenna. The reference is made perpendicular to the direction; `None` if
    /// the two are parallel.
    #[must_use]
    pub fn from_antenna(direction: Vector, reference_h: Vector, polarisation: AntennaPolarisation) -> Option<Self> {
        let along = dot(reference_h, direction) / dot(direction, direction);
        let across: Vector = std::array::from_fn(|i| reference_h[i] - along * direction[i]);
        let size = dot(across, across).sqrt();
        if size.is_nan() || size <= 1e-9 {
            return None;
        }
        let q = match polarisation {
            AntennaPolarisation::H => -0.5,
            AntennaPolarisation::V => 0.5,
        };
        Some(Self { direction, reference_h: across.map(|x| x / size), weight: [0.5, q, 0.0, 0.0] })
    }

    /// Antenna temperature of unpolarised radiation of brightness `t_k` at this end of the ray.
    #[must_use]
    pub fn unpolarised_k(&self, t_k: f64) -> f64 {
        2.0 * self.weight[0] * t_k
    }

    /// Antenna temperature of radiation with brightness `[h, v]` in the reference of this ray.
    #[must_use]
    pub fn polarised_k(&self, [h, v]: [f64; 2]) -> f64 {
        self.weight[0] * (v + h) + self.weight[1] * (v - h)
    }

    /// Turn the reference to the plane of incidence of a surface with this unit normal.
    ///
    /// At normal incidence there is no such plane and the reference stays.
    pub fn turn_to(&mut self, normal: Vector) {
        let k = self.direction.map(|x| -x);
        let across = cross(k, normal);
        let size = dot(across, across).sqrt();
        if size < 1e-12 {
            return;
        }
        let h_local = across.map(|x| x / size);
        let v = cross(self.reference_h, k);
        let psi = dot(h_local, v).atan2(dot(h_local, self.reference_h));
        // A Stokes vector in the local basis is turned back to the old one.
        self.weight = row_times(self.weight, &rotation_mueller(-psi));
        self.reference_h = h_local;
    }

    /// Reflect at a surface with unit normal and known reflection; the reference becomes the
    /// local `h`.
    pub fn reflect(&mut self, normal: Vector, reflection: &Reflection) {
        self.turn_to(normal);
        self.weight = row_times(self.weight, &reflection_mueller(reflection));
        let twice = 2.0 * dot(self.direction, normal);
        self.direction = std::array::from_fn(|i| self.direction[i] - twice * normal[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_complex::Complex64;
    use proptest::prelude::*;

    fn conductor() -> Reflection {
        Reflection::from_amplitudes(Complex64::new(-1.0, 0.0), Complex64::new(1.0, 0.0))
    }

    // A right-angled pair of mirrors sends a ray back. With the crease at 45 degrees to the
    // reference it swaps h and v; along or across the reference it leaves them.
    #[test]
    fn dihedral_at_45_degrees_swaps_h_and_v() {
        let half = 0.5f64.sqrt();
        for (crease_degrees, swaps) in [(45.0f64, true), (135.0, true), (0.0, false), (90.0, false)] {
            let (s, c) = crease_degrees.to_radians().sin_cos();
            // The ray goes along -z, h along x; the crease lies in the x-y plane.
            let across = [-s, c, 0.0];
            let n1 = [half * across[0], half * across[1], half];
            let n2 = [-half * across[0], -half * across[1], half];
            let mut ray = PolarisedRay::from_antenna([0.0, 0.0, -1.0], [1.0, 0.0, 0.0], AntennaPolarisation::H).unwrap();
            ray.reflect(n1, &conductor());
            ray.reflect(n2, &conductor());
            assert!((ray.direction[2] - 1.0).abs() < 1e-12);
            // Light a source polarised along x from behind the antenna, then one along y.
            let mut back = ray;
            let k = [0.0, 0.0, -1.0];
            let v = cross(ray.reference_h, k);
            let psi = dot([1.0, 0.0, 0.0], v).atan2(dot([1.0, 0.0, 0.0], ray.reference_h));
            back.weight = row_times(ray.weight, &rotation_mueller(-psi));
            back.reference_h = [1.0, 0.0, 0.0];
            let (along_x, along_y) = (back.polarised_k([1.0, 0.0]), back.polarised_k([0.0, 1.0]));
            let want = if swaps { (0.0, 1.0) } else { (1.0, 0.0) };
            assert!((along_x - want.0).abs() < 1e-12 && (along_y - want.1).abs() < 1e-12, "{crease_degrees}: {along_x} {along_y}");
        }
    }

    proptest! {
        // Emission at each hit and an isothermal background give exactly that temperature.
        #[test]
        fn isothermal_path_keeps_its_temperature(
            normals in proptest::collection::vec((-1.0f64..1.0, -1.0f64..1.0, -1.0f64..1.0), 1..6),
            loss in 0.1f64..20.0,
            tilt in 0.0f64..3.1,
        ) {
            let t0 = 287.3;
            let (s, c) = tilt.sin_cos();
            let mut ray = PolarisedRay::from_antenna(
                [0.0, 0.0, -1.0], [c, s, 0.0], AntennaPolarisation::V).unwrap();
            let mut sum = 0.0;
            for (x, y, z) in normals {
                let size = (x * x + y * y + z * z).sqrt();
                prop_assume!(size > 0.1);
                let mut n = [x / size, y / size, z / size];
                let mut cos = -dot(ray.direction, n);
                if cos < 0.0 {
                    n = n.map(|q| -q);
                    cos = -cos;
                }
                prop_assume!(cos > 1e-3);
                let r = super::super::fresnel::fresnel_cos(Complex64::new(4.0, -loss), cos.min(1.0));
                ray.turn_to(n);
                sum += ray.polarised_k(r.emissivities().map(|e| e * t0));
                ray.reflect(n, &r);
            }
            sum += ray.unpolarised_k(t0);
            prop_assert!((sum - t0).abs() < 1e-9, "{sum}");
        }

        #[test]
        fn mueller_of_a_reflection_never_over_polarises(cos in 0.01f64..1.0, re in 1.0f64..20.0, loss in 0.0f64..20.0) {
            let r = super::super::fresnel::fresnel_cos(Complex64::new(re, -loss), cos);
            let m = reflection_mueller(&r);
            for s in [[1.0, 1.0, 0.0, 0.0], [1.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, -1.0], [1.0, 0.6, 0.0, 0.8]] {
                let o: [f64; 4] = std::array::from_fn(|i| (0..4).map(|j| m[i][j] * s[j]).sum());
                let polarised = (o[1] * o[1] + o[2] * o[2] + o[3] * o[3]).sqrt();
                prop_assert!(polarised <= o[0] + 1e-12 && o[0] <= 1.0 + 1e-12);
            }
        }
    }
}

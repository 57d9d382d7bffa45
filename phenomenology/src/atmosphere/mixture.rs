//! A short piece of a path through several absorbers at once: air, and the water of clouds that lie in it.
//!
//! Extinctions add. The source is the mean of the sources, weighted by extinction, and changes in proportion to the optical depth between
//! the two ends of the piece. Scattering is neglected: what is lost is absorbed.

use super::transfer::PathRadiation;

/// Depth below which the series of the emission is used, Np. The closed form loses half of its digits there.
const THIN_NP: f64 = 1e-3;

/// The absorbers of a piece, added one by one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Mixture {
    tau_np: f64,
    near: f64,
    far: f64,
}

impl Mixture {
    /// Adds an absorber with its depth in Np and its black-body radiance at the end near the observer and at the far end.
    pub fn add(&mut self, tau_np: f64, near: f64, far: f64) {
        self.tau_np += tau_np;
        self.near += tau_np * near;
        self.far += tau_np * far;
    }

    /// Emission towards the observer and optical depth of the piece.
    ///
    /// # Reference
    /// Clough, Iacono & Moncet 1992, J. Geophys. Res. 97, 15761, eq. 13: a source that is linear in optical depth,
    /// `B_near (1 - e^-t) + (B_far - B_near) [1 - (1 + t) e^-t]/t`.
    #[must_use]
    pub fn radiation(&self, freq_ghz: f64) -> PathRadiation {
        let t = self.tau_np;
        if !(t > 0.0) {
            return PathRadiation { freq_ghz, tau_np: 0.0, emission: 0.0 };
        }
        let tilt = if t < THIN_NP { t * (0.5 - t * (1.0 / 3.0 - 0.125 * t)) } else { (1.0 - (1.0 + t) * (-t).exp()) / t };
        let (near, far) = (self.near / t, self.far / t);
        PathRadiation { freq_ghz, tau_np: t, emission: -(-t).exp_m1() * near + tilt * (far - near) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_emission_is_that_of_many_thin_slices() {
        for tau in [1e-4, 9.9e-4, 1.01e-3, 0.3, 2.0, 20.0] {
            let mut piece = Mixture::default();
            piece.add(0.25 * tau, 50.0, 60.0);
            piece.add(0.75 * tau, 62.0, 58.0);
            let n = 20_000;
            let mut slices = PathRadiation { freq_ghz: 94.0, tau_np: 0.0, emission: 0.0 };
            for k in 0..n {
                let s = (f64::from(k) + 0.5) / f64::from(n);
                let source = 0.25 * (50.0 + 10.0 * s) + 0.75 * (62.0 - 4.0 * s);
                let dt = tau / f64::from(n);
                slices = slices.then(&PathRadiation { freq_ghz: 94.0, tau_np: dt, emission: -(-dt).exp_m1() * source });
            }
            let got = piece.radiation(94.0);
            assert!((got.emission / slices.emission - 1.0).abs() < 1e-7, "{tau}: {} {}", got.emission, slices.emission);
            assert!((got.tau_np / slices.tau_np - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn absorbers_of_one_temperature_are_one_absorber() {
        let mut piece = Mixture::default();
        piece.add(0.7, 61.0, 61.0);
        piece.add(1.9, 61.0, 61.0);
        assert!((piece.radiation(94.0).seen_before(61.0) - 61.0).abs() < 1e-12);
        assert_eq!(Mixture::default().radiation(94.0).seen_before(3.0), 3.0);
    }
}

//! What the temperature of a pixel comes from: the emission of the surface in view, the sky, and other surfaces.

/// Where radiation comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Emitted by the first surface that the ray hits.
    Emission = 0,
    /// Emitted by other surfaces and the ground, and mirrored by the first one. What drawn facets of a rough surface meet counts here, with the
    /// difference to the sky whose place it takes.
    Surroundings = 1,
    /// The sky, direct or mirrored, and the air and weather along the ray.
    Sky = 2,
}

impl Cause {
    /// The cause of what a surface emits that a ray meets after a number of reflections.
    #[inline]
    pub(super) fn of_bounce(bounces: usize) -> Self {
        if bounces == 0 { Self::Emission } else { Self::Surroundings }
    }
}

/// Every cause, in the order of the planes of [`super::Picture::causes_k`].
pub const CAUSES: [Cause; 3] = [Cause::Emission, Cause::Surroundings, Cause::Sky];

/// The parts of the temperature of a ray, first plane and channel.
#[derive(Debug, Clone, Default)]
pub(super) struct Tally {
    /// RJ, K, in the order of [`CAUSES`]. Empty if nobody asks for the causes.
    pub parts: Vec<f64>,
    /// Part of the sum that has been credited, RJ, K.
    credited: f64,
}

impl Tally {
    /// A tally that counts, or one that does not.
    pub(super) fn new(counts: bool) -> Self {
        Self { parts: if counts { vec![0.0; CAUSES.len()] } else { Vec::new() }, credited: 0.0 }
    }

    /// Forgets the last ray.
    #[inline]
    pub(super) fn clear(&mut self) {
        self.parts.fill(0.0);
        self.credited = 0.0;
    }

    /// Credits a cause with what the sum has grown by since the last credit.
    #[inline]
    pub(super) fn credit(&mut self, cause: Cause, sum: f64) {
        if let Some(part) = self.parts.get_mut(cause as usize) {
            *part += sum - self.credited;
            self.credited = sum;
        }
    }
}

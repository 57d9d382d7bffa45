//! What a ray hits.

/// What a ray hits first: region, body and face, and surface. `None` is the sky.
pub(super) type Face = Option<(Option<u32>, (u32, u8), u32)>;

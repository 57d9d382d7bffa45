//! How far one image is from the truth.

/// The error of one image.
#[derive(Debug, Clone)]
pub(super) struct Score {
    pub(super) key: &'static str,
    pub(super) rms: f64,
    pub(super) unit: String,
    pub(super) nrmse: f64,
    pub(super) over_grey_card: f64,
}

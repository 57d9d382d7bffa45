//! Names of datasets and keywords in a UVH5 file, and the site of arrays that have none.

use crate::VisColumn;
use cittert_arrays::Site;

/// The site of a boresight layout, for programs that need a place on the Earth: on the equator at longitude 0. There east, north and up are
/// the axes y, z and x of the geocentric frame, so that positions keep all digits.
pub const NOMINAL_SITE: Site = Site { latitude_rad: 0.0, longitude_rad: 0.0, altitude_m: 0.0 };

/// Keyword (of `extra_keywords`) and value that mark a set in the boresight frame.
pub(super) const FRAME_KEYWORD: &str = "cittert_frame";
pub(super) const BORESIGHT: &str = "boresight";
/// Keyword of the temperature that was removed from the scene, K.
pub(super) const PEDESTAL_KEYWORD: &str = "pedestal_k";
pub(super) const SCENE_PEDESTAL_KEYWORD: &str = "scene_pedestal_k";
/// Keyword of the width of a simulated scene, rad.
pub(super) const SCENE_WIDTH_KEYWORD: &str = "scene_width_rad";
/// Keyword of the temperature that an element sees in all, K.
pub(super) const ANTENNA_TEMPERATURE_KEYWORD: &str = "antenna_temperature_k";
/// Keyword of the surface on which the scene lies.
pub(super) const SCENE_RANGE_KEYWORD: &str = "scene_range";
/// Keywords of the point to which the visibilities are phased: direction cosines and distance, m.
pub(super) const FOCUS_KEYWORDS: [&str; 3] = ["focus_l", "focus_m", "focus_range_m"];
/// Keyword of the power pattern of the elements.
pub(super) const PATTERN_KEYWORD: &str = "element_pattern";
/// Keyword of the name of the layout, where it differs from the name of the telescope.
pub(super) const LAYOUT_KEYWORD: &str = "cittert_layout";
/// Keyword of the source of the antenna positions.
pub(super) const SOURCE_KEYWORD: &str = "cittert_layout_source";
/// Group of the antenna properties for which UVH5 has no place.
pub(super) const ANTENNA_GROUP: &str = "Cittert";

/// Dataset of a column. Other programs know only `Data/visdata` and ignore the others.
pub(super) fn dataset_of(column: VisColumn) -> &'static str {
    match column {
        VisColumn::Data => "Data/visdata",
        VisColumn::Model => "Data/model",
        VisColumn::Corrected => "Data/corrected",
        VisColumn::Residual => "Data/residual",
    }
}

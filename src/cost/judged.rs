//! The verdict: a fit is compared with at most about a million visibilities, whose prediction is in memory at once.

use super::held::{DOUBLE, Held, SINGLE};
use super::stage::Stage;
use super::term::Term;
use crate::imaging::Field;

/// Most values by which a fit is judged.
const MOST: f64 = (1 << 20) as f64;
/// A row of the blocks that were read, and of their joint list.
const ROW: f64 = 100.0;
/// A value of the blocks, its prediction as it is summed, and the block that the sum becomes.
const RAW: f64 = 17.0;
const SUM: f64 = 16.0;
/// A prediction as the transform gives it, and as it is kept.
const PREDICTED: f64 = 16.0;
const KEPT: f64 = 8.0;
/// A sample by which a fit is judged, and its places in the lists of the statistics.
const SAMPLE: f64 = 64.0;
const LISTED: f64 = 28.0;

/// What is left of a visibility of all products, and of a row, while a source outside the image is sought.
const LEFT: f64 = 16.0;
const LEFT_ROW: f64 = 24.0;
/// A row of them that is gridded, and a visibility without its nodes.
const GRIDDED_ROW: f64 = 88.0;
const GRIDDED: f64 = 8.0;
/// The planes and the image of the widest field that is searched.
const WIDE: f64 = ((16 << 20) + (12 << 20)) as f64;
/// Pixels along a side of an image, up to which all baselines show the field around it. Fewer do around larger ones.
const ALL_SHOW: f64 = 768.0;

impl Held<'_> {
    /// Visibilities by which a fit is judged. Two hands count as one.
    fn judged(self) -> f64 {
        let products = self.outlook.shape.2 as f64;
        (self.outlook.visibilities() * products).min(MOST) / if products > 1.0 { 2.0 } else { 1.0 }
    }

    /// The verdict on an image, whose visibilities are predicted by this transform. `searched` is true where a source outside may be sought, and `beside` are the bytes
    /// that are held beside it.
    pub(super) fn verdict(self, (field, searched): (&Field, bool), beside: f64) -> Stage {
        let (_, channels, products) = self.outlook.shape;
        let (of_row, out) = ((channels * products) as f64, self.outlook.channels_out as f64);
        let rows = self.rows().min(MOST / of_row);
        let part = rows / self.rows().max(1.0);
        let (values, visibilities) = (rows * of_row, rows * channels as f64);
        let (planes, columns) = (field.size.plane_bytes as f64, field.size.column_bytes as f64);
        // Planes of a single group stay until the end. Several groups are made one after the other from the corrected image, which stays.
        let one = field.size.groups == 1;
        let stays = out * if one { planes } else { self.plane(SINGLE) };
        let (made, again) = if one { (columns, 0.0) } else { (0.0, planes + columns) };
        let nodes = part * (field.pass.sorted_bytes + (field.pass.nodes * 2.0 * SINGLE).max(self.sorting_bytes(field)));
        let blocks = ROW * rows + RAW * values;
        let predicting = blocks + SUM * values + made.max(again + nodes + PREDICTED * visibilities).max(RAW * values);
        // The search for a source outside.
        let (n_l, n_m) = (self.outlook.grid.n_l, self.outlook.grid.n_m);
        let shown = (ALL_SHOW / n_l.max(n_m) as f64).min(1.0);
        let left = shown * (LEFT * visibilities + LEFT_ROW * rows);
        let wide = shown * (GRIDDED_ROW * rows + GRIDDED * visibilities + part * field.pass.nodes * 2.0 * SINGLE) + WIDE;
        let (left, wide) = if searched { (left, wide) } else { (0.0, 0.0) };
        let n = self.judged();
        let listing = (blocks + KEPT * values + SAMPLE * n).max((SAMPLE + LISTED) * n);
        // The model, and what an antenna sees of it.
        let models = 2.0 * DOUBLE * self.plane(out);
        let stage = Stage::new("verdict", models + stays + listing.max(left + predicting.max(wide)) + beside);
        let (logs, points) = (field.size.point_logs * out, field.size.points * out);
        stage.doing([(Term::Judge, n), (Term::FromImage, logs), (Term::FromImagePoint, points)])
    }
}

//! How much results change when a constant that steers an algorithm is halved or doubled.
//!
//! Every constant of the option structs `MemTuning`, `SelfcalTuning`, `JointSchedule` and `ClosureImagingControl` is varied over three
//! scenes and two layouts. The largest change is compared with the table in `docs/algorithms/heuristics.md`; with `CITTERT_BLESS=1` the
//! table is written.

mod closure_imaging;
mod joint;
mod mem;
mod scenes;
mod selfcal;
mod table;

use table::{Row, compare};

#[test]
fn the_book_states_the_sensitivities() {
    let rows: Vec<Row> = [mem::rows(), selfcal::rows(), joint::rows(), closure_imaging::rows()].concat();
    compare(&rows);
}

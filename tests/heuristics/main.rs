//! How much results change when a constant that steers an algorithm is halved or doubled.
//!
//! Every constant of the option structs `MemTuning`, `SelfcalTuning`, `JointSchedule` and `ClosureImagingControl` is varied over three
//! scenes and two layouts. The largest change is compared with the table in `docs/algorithms/heuristics.md`; with `CITTERT_BLESS=1` the
//! table is written.

#[cfg(test)]
mod closure_imaging;
#[cfg(test)]
mod joint;
#[cfg(test)]
mod mem;
#[cfg(test)]
mod scenes;
#[cfg(test)]
mod selfcal;
#[cfg(test)]
mod table;

#[cfg(test)]
mod tests {
    use super::table::{Group, compare};
    use super::{closure_imaging, joint, mem, scenes, selfcal};

    #[test]
    fn the_book_states_the_sensitivities() {
        let mut groups: Vec<Group> = mem::groups();
        groups.extend([selfcal::group(), joint::group(), closure_imaging::group()]);
        let names: Vec<&str> = scenes::cases().iter().map(|c| c.name).collect();
        compare(&names, &groups);
    }
}

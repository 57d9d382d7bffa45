//! The memory budget of the process. Every block, cache and buffer of the chain takes a stated share of it.
//!
//! | what it holds | share of the budget | at most |
//! |---|---|---|
//! | one block of rows in a pass that reads a set once | 1/64 | 32 MiB |
//! | one block of rows when the imager reads the set again in every pass | 1/64 | 48 MiB |
//! | one block of rows when the imager keeps the set in memory | 1/32 | 96 MiB |
//! | visibilities that the imager keeps in memory | 1/8 | |
//! | the order of these rows on the grid | 1/16 | |
//! | the planes of one transform | 1/4 | |
//! | the same for at most 2^20 visibilities | 1/4 | 4 bytes for each pixel, but 64 MiB at least |
//! | planes kept for the next pass (two sets: model and image) of images of up to 2^24 pixels | 1/8 each | 256 MiB each |
//! | buffers of rows kept for the next pass | 1/64 | 64 MiB |
//! | one block of simulated rows | 1/64 | 64 MiB |
//! | transforms of scenes kept between blocks of rows | 1/4 | |
//! | model visibilities kept between rounds of self-calibration | 1/4 | |
//! | data of a joint solution of image and gains | 1/4 | |
//! | sums for pairs of antennas of scenes near the array, and the points of such a scene | 1/4 and 1/2 | |
//! | visibilities that wait for the rest of their integration | 1/16 | |
//! | gain tables, normal equations, gridded visibilities | all | |
//!
//! A block of rows has an upper limit because one block is read while the block before it is processed: a larger block only makes the first
//! read longer. The blocking of the numerical kernels (tiles, columns of a transform) does not depend on the budget: it fits the caches.
//!
//! The budget changes the memory and the time that a computation takes. Results agree within the rounding of sums in another order.

use crate::{ChainError, Result, ensure};
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

const MIB: u64 = 1 << 20;
const NO_LIMIT: u64 = u64::MAX;
/// The smallest budget. With less, a block would contain only a few rows of a usual set.
const LEAST: u64 = 16 * MIB;
/// The budget of a machine that does not say how much memory it has.
const UNKNOWN_MACHINE: u64 = 4 << 30;

/// Largest number of visibilities of a set that is gridded in one block.
const SMALL_SET: u64 = 1 << 20;
/// Bytes for each pixel of an image that the planes of the transform of a small set take.
const PLANES_OF_PIXEL: usize = 4;

/// Pixels above which no planes are kept for the next pass: they would stay beside the other arrays of a large image, and to clear new pages
/// takes little of the time of their transform.
const LARGE_IMAGE: usize = 1 << 24;

/// Budget of the process in bytes; 0 until it is set.
static CURRENT: AtomicU64 = AtomicU64::new(0);

/// How much memory the data and transforms of one computation may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct MemoryBudget {
    /// 0 for the budget of the process.
    bytes: u64,
}

impl Default for MemoryBudget {
    /// The budget of the process: the one that was [set](MemoryBudget::set), or half of what the machine has. It is looked up where it is used,
    /// because options are often made before the budget is set.
    fn default() -> Self {
        Self { bytes: 0 }
    }
}

impl MemoryBudget {
    /// A budget in bytes.
    ///
    /// # Errors
    /// Less than 16 MiB.
    pub fn new(bytes: u64) -> Result<Self> {
        ensure!(bytes >= LEAST, bad(format!("{bytes} bytes")));
        Ok(Self { bytes })
    }

    /// Half of the memory of the machine, or of what its control group allows to the process where that is less.
    #[must_use]
    pub fn of_machine() -> Self {
        static MACHINE: OnceLock<u64> = OnceLock::new();
        let bytes = *MACHINE.get_or_init(|| memory_of_machine().map_or(UNKNOWN_MACHINE, |all| (all / 2).max(LEAST)));
        Self { bytes }
    }

    /// Make this the budget of the process.
    pub fn set(self) {
        CURRENT.store(self.bytes, Ordering::Relaxed);
    }

    /// All of it, bytes.
    #[must_use]
    pub fn bytes(self) -> usize {
        let bytes = match (self.bytes, CURRENT.load(Ordering::Relaxed)) {
            (0, 0) => Self::of_machine().bytes,
            (0, current) => current,
            (own, _) => own,
        };
        usize::try_from(bytes).unwrap_or(usize::MAX)
    }

    fn share(self, part: usize, most: u64) -> usize {
        (self.bytes() / part).min(usize::try_from(most).unwrap_or(usize::MAX))
    }

    /// Bytes of the planes of one group in the transform of an image with this number of pixels and of about `n_vis` visibilities, if their
    /// number is known. A small set is gridded in one block, so that groups of planes cost little more than all planes at once. The planes then
    /// take no more than the images beside them.
    #[must_use]
    pub fn image_planes(self, pixels: usize, n_vis: Option<u64>) -> usize {
        if n_vis.is_some_and(|n| n <= SMALL_SET) {
            self.planes().min(pixels.saturating_mul(PLANES_OF_PIXEL).max(64 << 20))
        } else {
            self.planes()
        }
    }

    /// Bytes of one set of planes that is kept for the next pass over an image with this number of pixels.
    #[must_use]
    pub fn kept_planes_of(self, pixels: usize) -> usize {
        if pixels > LARGE_IMAGE { 0 } else { self.kept_planes() }
    }

    /// Size in bytes of one block of rows of the imager. `kept`: the rows stay in memory; otherwise every pass reads the file again.
    #[must_use]
    pub fn imaging_block(self, kept: bool) -> usize {
        if kept { self.share(32, 96 * MIB) } else { self.share(64, 48 * MIB) }
    }
}

/// Methods of a budget, each for one part of it: its doc, its name, the fraction of the budget, and its largest size in bytes.
macro_rules! shares {
    ($($(#[$doc:meta])+ $name:ident: 1 / $part:literal, at most $most:expr;)+) => {
        impl MemoryBudget {
            $(
                $(#[$doc])+
                #[must_use]
                pub fn $name(self) -> usize {
                    self.share($part, $most)
                }
            )+
        }
    };
}

shares! {
    /// Size in bytes of one block of rows in a pass that reads a set once.
    block: 1 / 64, at most 32 * MIB;
    /// Bytes of visibilities that the imager keeps in memory. It reads larger sets again in every pass.
    kept_visibilities: 1 / 8, at most NO_LIMIT;
    /// Bytes that the order of kept rows on the grid may take.
    sorted_rows: 1 / 16, at most NO_LIMIT;
    /// Bytes of the planes of one transform. A transform with more planes makes them in groups, once for every block of rows.
    planes: 1 / 4, at most NO_LIMIT;
    /// Bytes of one set of planes that is kept for the next pass, see also [`MemoryBudget::kept_planes_of`].
    kept_planes: 1 / 8, at most 256 * MIB;
    /// Bytes of the buffers of rows that are kept for the next pass. The blocks of a long file need buffers of many lengths, so without a
    /// limit unused buffers would accumulate.
    kept_buffers: 1 / 64, at most 64 * MIB;
    /// Size in bytes of the working memory for one block of simulated rows.
    simulated_block: 1 / 64, at most 64 * MIB;
    /// Bytes of the transforms of scenes that are kept between blocks of rows.
    kept_scenes: 1 / 4, at most NO_LIMIT;
    /// Bytes of model visibilities that are kept between rounds of self-calibration.
    kept_model: 1 / 4, at most NO_LIMIT;
    /// Bytes of the data of a joint solution of image and gains. Larger sets are averaged over time first.
    joint_data: 1 / 4, at most NO_LIMIT;
    /// Bytes of visibilities that wait for the rest of their integration.
    waiting_rows: 1 / 16, at most NO_LIMIT;
}

fn bad(value: String) -> ChainError {
    ChainError::bad_option("memory", value, "at least 16MiB, such as 500MB, 4GB or 4GiB")
}

impl FromStr for MemoryBudget {
    type Err = ChainError;

    /// A number with a unit: B, kB, MB, GB, TB (powers of 1000), KiB, MiB, GiB, TiB (powers of 1024).
    fn from_str(text: &str) -> Result<Self> {
        let digits = text.trim().find(|c: char| c.is_ascii_alphabetic()).ok_or_else(|| bad(format!("{text:?}")))?;
        let (number, unit) = text.trim().split_at(digits);
        let number: f64 = number.trim().parse().map_err(|_| bad(format!("{text:?}")))?;
        let (prefix, base) = match unit.strip_suffix("iB") {
            Some(prefix) => (prefix, 1024.0_f64),
            None => (unit.strip_suffix('B').ok_or_else(|| bad(format!("{text:?}")))?, 1000.0),
        };
        let powers = [("", 0), ("K", 1), ("M", 2), ("G", 3), ("T", 4)];
        let power = powers.iter().find(|(name, _)| name.eq_ignore_ascii_case(prefix)).ok_or_else(|| bad(format!("{text:?}")))?.1;
        let bytes = number * base.powi(power);
        ensure!(bytes >= LEAST as f64 && bytes < 1e18, bad(format!("{text:?}")));
        Self::new(bytes as u64)
    }
}

/// Memory per pixel that work on an image needs at least, bytes. The largest resident sizes that were measured at 4096 x 4096 and 8192 x 8192
/// pixels lie above it; a field with a w term and several scales need more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageWork {
    /// A dirty image, a beam or a grid.
    Transform = 8,
    /// CLEAN.
    Clean = 18,
    /// Maximum entropy.
    Entropy = 70,
}

/// Refuse images that the machine has no memory for, before the work begins.
///
/// # Errors
/// The work needs more than the memory of the machine.
pub fn check_images((n_l, n_m): (usize, usize), work: ImageWork) -> Result<()> {
    let needed = (n_l as f64) * (n_m as f64) * f64::from(work as u16);
    let Some(all) = memory_of_machine().map(|bytes| bytes as f64).filter(|all| needed > *all) else { return Ok(()) };
    let gib = |bytes: f64| format!("{:.0} GiB", bytes / f64::from(1 << 30));
    let expected = format!("images that fit into the memory: this needs at least {}, the machine has {}", gib(needed), gib(all));
    Err(ChainError::bad_option("image size", format!("{n_l} x {n_m} pixels"), expected))
}

/// Refuse a joint solution of image and gains whose data take this number of bytes, where the machine has no memory for them.
///
/// # Errors
/// The data need more than half of the memory of the machine; the other half belongs to the transforms and the system.
pub fn check_joint(needed: usize) -> Result<()> {
    let Some(all) = memory_of_machine().filter(|all| needed as u64 > all / 2) else { return Ok(()) };
    let gib = |bytes: u64| format!("{:.1} GiB", bytes as f64 / f64::from(1 << 30));
    Err(ChainError::Incompatible(format!(
        "the joint solution of image and gains keeps its data in memory. They take more than {}, and the machine has {}: use a longer --solint or a \
         smaller field, so that they can be averaged, or --deconvolver hogbom or multiscale",
        gib(all / 2),
        gib(all)
    )))
}

/// Bytes of memory that the process can take now without harm to others. `None` where the system does not say.
#[must_use]
pub fn free_memory() -> Option<u64> {
    Some(memory_of_machine()?.min(in_meminfo("MemAvailable:")?))
}

/// Bytes that the system tells under a name.
fn in_meminfo(name: &str) -> Option<u64> {
    let info = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = info.lines().find_map(|l| l.strip_prefix(name))?;
    Some(line.trim().trim_end_matches("kB").trim().parse::<u64>().ok()? * 1024)
}

/// Bytes of memory of the machine, or of the smallest limit of the control groups that the process is in.
fn memory_of_machine() -> Option<u64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let total = in_meminfo("MemTotal:")?;
    let groups = read("/proc/self/cgroup").unwrap_or_default();
    let group = groups.lines().find_map(|l| l.strip_prefix("0::")).unwrap_or("/");
    // A group is limited by its parents too.
    let parents = std::path::Path::new(group).ancestors().filter_map(|p| p.to_str());
    let files = parents.map(|p| format!("/sys/fs/cgroup{}/memory.max", p.trim_end_matches('/')));
    let files = files.chain(["/sys/fs/cgroup/memory/memory.limit_in_bytes".to_owned()]);
    let limits = files.filter_map(|f| read(&f)?.trim().parse::<u64>().ok());
    Some(limits.fold(total, u64::min))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_with_their_units() {
        let bytes = |text: &str| text.parse::<MemoryBudget>().map(|m| m.bytes);
        assert_eq!(bytes("4GB").unwrap(), 4_000_000_000);
        assert_eq!(bytes("1.5 GiB").unwrap(), 3 << 29);
        assert_eq!(bytes("64MiB").unwrap(), 64 << 20);
        for wrong in ["4", "GB", "4 XB", "-1GB", "1MB", "nanGB", "4Gi", "1e30GB"] {
            let message = bytes(wrong).unwrap_err().to_string();
            assert!(message.starts_with("memory is") && message.contains(wrong), "{message}");
        }
    }

    #[test]
    fn images_beyond_the_memory_are_refused_with_an_estimate() {
        assert!(check_images((4096, 2048), ImageWork::Transform).is_ok());
        assert!(check_joint(1 << 20).is_ok());
        let e = check_joint(1 << 60).unwrap_err().to_string();
        assert!(e.contains("joint solution") && e.contains("--deconvolver"), "{e}");
        let e = check_images((1 << 22, 1 << 22), ImageWork::Clean).unwrap_err().to_string();
        assert!(e.contains("4194304 x 4194304 pixels") && e.contains("294912 GiB"), "{e}");
    }

    #[test]
    fn the_budget_of_the_machine_is_at_most_half_of_its_memory() {
        let budget = MemoryBudget::of_machine();
        assert!(budget.bytes >= LEAST);
        if let Some(all) = memory_of_machine() {
            assert!(budget.bytes <= (all / 2).max(LEAST));
            assert!(free_memory().is_some_and(|free| 0 < free && free <= all));
        }
    }

    /// The command line sets the budget after it has made the options.
    #[test]
    fn options_follow_a_budget_that_is_set_after_they_were_made() {
        let (before, machine) = (MemoryBudget::default(), MemoryBudget::of_machine().bytes());
        assert_eq!(before.bytes(), machine);
        // One byte less does not disturb the tests that run at the same time.
        MemoryBudget::new(machine as u64 - 1).unwrap().set();
        assert_eq!(before.bytes(), machine - 1);
        assert_eq!(MemoryBudget::new(LEAST).unwrap().bytes(), LEAST as usize, "a budget of its own");
    }

    /// The shares that are in use at once while the imager makes a residual stay within the budget.
    #[test]
    fn the_shares_of_a_major_cycle_fit_into_the_budget() {
        for bytes in [LEAST, 1 << 30, 64 << 30] {
            let m = MemoryBudget::new(bytes).unwrap();
            let rows = m.kept_visibilities() + m.sorted_rows() + 2 * m.imaging_block(true) + m.kept_buffers();
            assert!(rows + 2 * m.planes() <= m.bytes());
        }
    }
}

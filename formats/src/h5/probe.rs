//! Opening HDF5 files after a trial in a child process.
//!
//! The HDF5 library of the system crashes or loops on some damaged files. A program cannot catch that in itself, but it can see that a child
//! process has crashed. The child visits every object of the file and reads what a reader would read first.

use super::child::{NO_MEMORY, UNSOUND, in_the_child, look_at};
use super::convert::values;
use super::flaws::{FLAWS, LINK_ELSEWHERE, flaw};
use super::places::raw::SIGNATURE;
use super::read::H5In;
use crate::files::{open_file, read_up_to};
use crate::{FormatError, Result};
use bytemuck::Pod;
use cittert_arrays::Ranks;
use hdf5::types::{FloatSize, TypeDescriptor};
use hdf5::{Dataset, Group, H5Type, IndexType, IterationOrder, LinkInfo, LinkType};
use ndarray::IxDyn;
use num_complex::Complex;
use std::collections::BTreeSet;
use std::fs::Metadata;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime};

/// A dataset of at most this number of elements is read whole. Of a larger dataset the first rows and the last row are read.
const SMALL: usize = 1 << 17;
/// Number of elements in the first rows that are read of a larger dataset.
const START: usize = 1 << 13;
/// Largest depth of groups, and largest number of objects, that are visited.
const DEEPEST: usize = 8;
const MOST_OBJECTS: usize = 10_000;
/// Number of sound files that are remembered. A set may have thousands of files, of which only some are open at a time.
const REMEMBERED: usize = 1 << 16;
/// The clock of file systems advances in steps of a few ms. A file that is younger than this may change without a change of its stamp.
const YOUNG: Duration = Duration::from_millis(50);

/// Identifies one state of a file: device, inode, size, time of change (s, ns).
type Stamp = [u64; 5];

/// Files that were found sound, so that a file that several readers open is tried only once.
static GOOD: Mutex<BTreeSet<Stamp>> = Mutex::new(BTreeSet::new());

/// Open a file to read. `expected` says what it should be, for the error.
pub(crate) fn open(path: &Path, expected: &str) -> Result<H5In> {
    let mut magic = [0u8; 8];
    let got = read_up_to(&mut open_file(path)?, &mut magic).map_err(|e| FormatError::io(path, "read", e))?;
    if magic[..got] != *SIGNATURE {
        return Err(FormatError::not_a(
            path,
            format!("{expected} (an HDF5 file, which begins with \"\\x89HDF\")"),
            format!("it begins with \"{}\"", magic[..got].escape_ascii()),
        ));
    }
    probe(path)?;
    H5In::open_unprobed(path)
}

/// True where the file is HDF5 and has a dataset of that name.
pub(crate) fn has(path: &Path, dataset: &str) -> bool {
    open(path, "").is_ok_and(|f| f.has(dataset))
}

/// Refuse a file that would crash the process that reads it.
fn probe(path: &Path) -> Result<()> {
    if in_the_child() {
        return Ok(());
    }
    let meta = std::fs::metadata(path).map_err(|e| FormatError::io(path, "open", e))?;
    let stamp = stamp(&meta);
    if GOOD.lock().unwrap_or_else(PoisonError::into_inner).contains(&stamp) {
        return Ok(());
    }
    if let Some(found) = in_a_child(path) {
        let expected = "a sound HDF5 file (make it again, or copy it anew from where it came)";
        return Err(FormatError::malformed(path, "HDF5 structure", expected, found));
    }
    if meta.modified().is_ok_and(|t| SystemTime::now().duration_since(t).is_ok_and(|age| age < YOUNG)) {
        return Ok(());
    }
    remember([stamp]);
    Ok(())
}

fn stamp(meta: &Metadata) -> Stamp {
    [meta.dev(), meta.ino(), meta.size(), meta.mtime().cast_unsigned(), meta.mtime_nsec().cast_unsigned()]
}

/// These files are sound.
fn remember(stamps: impl IntoIterator<Item = Stamp>) {
    let mut good = GOOD.lock().unwrap_or_else(PoisonError::into_inner);
    for stamp in stamps {
        if good.len() >= REMEMBERED {
            good.clear();
        }
        good.insert(stamp);
    }
}

/// Share the trials of files among processes that will all open them. A process trusts another where it sees the same file: its device has another number on each machine, but
/// everything else in its stamp is the same.
///
/// # Errors
/// A damaged file among those that this process tries.
pub(crate) fn probe_together(files: &[PathBuf], ranks: &dyn Ranks) -> Result<()> {
    if ranks.size() == 1 {
        return Ok(());
    }
    for file in files.iter().skip(ranks.rank()).step_by(ranks.size()) {
        let mut magic = [0u8; 8];
        // What is not HDF5, or not there, is said where it is opened.
        if open_file(file).is_ok_and(|mut f| read_up_to(&mut f, &mut magic).is_ok()) && magic == *SIGNATURE {
            probe(file)?;
        }
    }
    let own: Vec<Stamp> = GOOD.lock().unwrap_or_else(PoisonError::into_inner).iter().copied().collect();
    let of_all = ranks.exchange(bytemuck::cast_slice(&own).to_vec());
    let sound: BTreeSet<[u64; 4]> =
        of_all.iter().flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, Stamp>(bytes)).map(|[_, rest @ ..]| rest).collect();
    let seen = files.iter().filter_map(|file| std::fs::metadata(file).ok()).map(|meta| stamp(&meta));
    remember(seen.filter(|[_, rest @ ..]| sound.contains(rest)));
    Ok(())
}

/// The damage of a file that crashes a child process. Where no child can be started, the file is not tried.
fn in_a_child(path: &Path) -> Option<String> {
    let mut signal = look_at(path, look_through)?;
    if signal != 0 && signal < UNSOUND && signal != libc::SIGPROF {
        // An earlier file may have damaged the process without ending it. The next process is a fresh one.
        signal = look_at(path, look_through)?;
    }
    match signal {
        0 => None,
        NO_MEMORY => Some("sizes in it that no memory holds".into()),
        libc::SIGALRM | libc::SIGPROF => Some("damage on which HDF5 computes without end".into()),
        other => Some(match usize::try_from(other - UNSOUND).ok().and_then(|k| FLAWS.get(k)) {
            Some(flaw) => (*flaw).into(),
            None => format!("damage on which HDF5 crashes (signal {other})"),
        }),
    }
}

/// Open a file and visit everything in it. The result is the flaw of the first type that must not be read.
fn look_through(path: &Path) -> Option<usize> {
    let file = H5In::open_unprobed(path).ok()?;
    file.group("").and_then(|root| visit(&file, &root, "", 0, &mut 0))
}

/// Read the start of every dataset below a group. The result is the flaw of the first type that must not be read. Errors are ignored here,
/// because the program meets and reports them.
fn visit(file: &H5In, group: &Group, name: &str, depth: usize, seen: &mut usize) -> Option<usize> {
    if leads_elsewhere(group) {
        return Some(LINK_ELSEWHERE);
    }
    for member in group.member_names().unwrap_or_default() {
        *seen += 1;
        if *seen > MOST_OBJECTS || std::io::Error::last_os_error().raw_os_error() == Some(libc::ENOMEM) {
            return None;
        }
        let name = format!("{name}/{member}");
        let found = match group.dataset(&member) {
            Ok(dataset) => flaw(&dataset).or_else(|| {
                look(file, &dataset, &name);
                None
            }),
            Err(_) if depth >= DEEPEST => None,
            Err(_) => group.group(&member).ok().and_then(|inner| visit(file, &inner, &name, depth + 1, seen)),
        };
        if found.is_some() {
            return found;
        }
    }
    None
}

/// True where a member of a group is a link to another file. Such a link is never followed.
fn leads_elsewhere(group: &Group) -> bool {
    let external = |_: &str, link: LinkInfo| Ok((link.link_type == LinkType::External).then_some(()));
    group.find_link(IndexType::default(), IterationOrder::default(), external).is_ok_and(|found| found.is_some())
}

/// Convert one value of the type of a dataset.
fn convert_one<T: H5Type + Pod>(dataset: &Dataset) {
    drop(values::<T>(dataset, 1, |_, _| Ok(())));
}

/// Read the first rows and the last row of a dataset, and convert its type to every type that a reader of this crate asks for: the library also
/// crashes in the conversion of damaged types.
fn look(file: &H5In, dataset: &Dataset, name: &str) {
    let (Ok(shape), Ok(space)) = (file.shape(dataset, name), dataset.space()) else { return };
    if space.is_null() {
        return;
    }
    let Ok(dtype) = dataset.dtype().and_then(|d| d.to_descriptor()) else { return };
    let rows = shape.first().copied().unwrap_or(0);
    let row = shape.iter().skip(1).product::<usize>().max(1);
    let most = if dataset.size() <= SMALL { SMALL } else { START };
    let first = 0..(most / row).clamp(1, rows.max(1)).min(rows);
    let last = rows.saturating_sub(1).max(first.end)..rows;
    let whole = dataset.size() <= SMALL;
    let ends = || [first.clone(), last.clone()].into_iter().filter(|r| !r.is_empty());
    match dtype {
        TypeDescriptor::Compound(_) if file.demand_complex(dataset, name).is_ok() => {
            ends().for_each(|r| drop(file.rows::<Complex<f32>, IxDyn>(dataset, name, r)));
            if whole {
                drop(file.all::<Complex<f64>>(dataset));
            }
        }
        _ if file.number_kind(dataset, name).is_ok() && whole => {
            drop(file.all::<f64>(dataset));
            drop(file.all::<f32>(dataset));
            drop(file.all::<i64>(dataset));
            drop(file.all::<i8>(dataset));
        }
        // The rows are read once. What a conversion does with the type shows with one value.
        _ if file.number_kind(dataset, name).is_ok() => {
            ends().for_each(|r| match dtype {
                TypeDescriptor::Float(FloatSize::U4) => drop(file.rows::<f32, IxDyn>(dataset, name, r)),
                TypeDescriptor::Float(_) => drop(file.rows::<f64, IxDyn>(dataset, name, r)),
                TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) => drop(file.rows::<i64, IxDyn>(dataset, name, r)),
                _ => drop(file.rows::<i8, IxDyn>(dataset, name, r)),
            });
            convert_one::<f64>(dataset);
            convert_one::<f32>(dataset);
            convert_one::<i64>(dataset);
            convert_one::<i8>(dataset);
        }
        _ => drop(file.strings(dataset)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second of two processes. The first has found these sound.
    struct Second(Vec<Stamp>);

    impl Ranks for Second {
        fn rank(&self) -> usize {
            1
        }

        fn size(&self) -> usize {
            2
        }

        fn exchange(&self, own: Vec<u8>) -> Vec<Vec<u8>> {
            vec![bytemuck::cast_slice(&self.0).to_vec(), own]
        }
    }

    #[test]
    fn files_that_another_process_has_tried_are_not_tried_again() {
        let folder = tempfile::tempdir().unwrap();
        let make = |name: &str| {
            let path = folder.path().join(name);
            hdf5::File::create(&path).unwrap().new_dataset::<f64>().shape(3).create("x").unwrap();
            path
        };
        let [tried, own, changed] = ["tried", "own", "changed"].map(make);
        let text = folder.path().join("text");
        std::fs::write(&text, "no HDF5").unwrap();
        std::thread::sleep(2 * YOUNG);
        let of = |path: &Path| stamp(&std::fs::metadata(path).unwrap());
        let is_good = |path: &Path| GOOD.lock().unwrap().contains(&of(path));
        // Another machine gives the device another number. A file that it saw with another size is not the same one.
        let elsewhere = |path: &Path, larger: u64| {
            let [device, inode, size, s, ns] = of(path);
            [device + 1, inode, size + larger, s, ns]
        };
        let others = Second(vec![elsewhere(&tried, 0), elsewhere(&changed, 1)]);
        probe_together(&[tried.clone(), own.clone(), changed.clone(), text.clone()], &others).unwrap();
        assert!(is_good(&tried) && is_good(&own) && !is_good(&changed) && !is_good(&text));
        assert!(open(&changed, "").is_ok() && is_good(&changed));
    }
}

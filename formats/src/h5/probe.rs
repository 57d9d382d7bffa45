//! Look at a file in a child process first: the system's HDF5 library crashes or loops on some damaged files, and no handler can
//! catch that, but a parent can. The child visits every object and reads what a reader would read first.

use super::child::{NO_MEMORY, UNSOUND, look_at};
use super::read::H5In;
use super::types::{FLAWS, flaw};
use crate::rehearse::rehearse;
use crate::{FormatError, Result};
use hdf5::types::TypeDescriptor;
use hdf5::{Dataset, Group};
use ndarray::IxDyn;
use num_complex::Complex;
use std::collections::VecDeque;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime};

/// A dataset below this number of elements is read whole; of a larger one the first and the last row.
const SMALL: usize = 1 << 17;
/// Deepest nesting of groups that is looked at, and most objects.
const DEEPEST: usize = 8;
const MOST_OBJECTS: usize = 10_000;
/// Files remembered as good.
const REMEMBERED: usize = 16;
/// A file that changed so shortly ago may change again without a change of its stamp: the clock of file systems ticks every few ms.
const YOUNG: Duration = Duration::from_millis(50);

/// True in the child process, which reads what it looks at.
static CHILD: AtomicBool = AtomicBool::new(false);

/// What tells one state of a file from another: device, inode, size, time of change (s, ns).
type Stamp = (u64, u64, u64, i64, i64);

/// Files that were found good, so that a file is looked at once though it is sniffed and opened by several readers.
static GOOD: Mutex<VecDeque<Stamp>> = Mutex::new(VecDeque::new());

/// True in the child process.
pub(super) fn in_the_child() -> bool {
    CHILD.load(Relaxed)
}

/// Refuse a file that ends the process which reads it.
pub(super) fn probe(path: &Path) -> Result<()> {
    if in_the_child() {
        return Ok(());
    }
    let meta = std::fs::metadata(path).map_err(|e| FormatError::io(path, "open", e))?;
    let stamp = (meta.dev(), meta.ino(), meta.size(), meta.mtime(), meta.mtime_nsec());
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
    let mut good = GOOD.lock().unwrap_or_else(PoisonError::into_inner);
    if good.len() >= REMEMBERED {
        good.pop_front();
    }
    good.push_back(stamp);
    Ok(())
}

/// What was wrong, where a child dies of the file. Where no child can be started the file is not looked at.
fn in_a_child(path: &Path) -> Option<String> {
    let mut signal = look_at(path, look_through)?;
    if signal != 0 && signal < UNSOUND && signal != libc::SIGPROF {
        // An earlier file may have hurt the process without ending it: the next one has seen no other file.
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

/// Open a file and visit all that is in it, up to a type that must not be read.
fn look_through(path: &Path) -> Option<usize> {
    CHILD.store(true, Relaxed);
    let file = H5In::open_unseen(path).ok()?;
    let flaw = file.group("").and_then(|root| visit(&file, &root, "", 0, &mut 0));
    drop(file);
    if flaw.is_none() && std::io::Error::last_os_error().raw_os_error() != Some(libc::ENOMEM) {
        rehearse(path);
    }
    flaw
}

/// Read every dataset below a group as far as a reader would at first, up to a type that must not be read. Errors are for the parent to meet
/// and to word.
fn visit(file: &H5In, group: &Group, name: &str, depth: usize, seen: &mut usize) -> Option<usize> {
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

/// Read a dataset as what it is: whole, or its first and last row.
fn look(file: &H5In, dataset: &Dataset, name: &str) {
    let (Ok(shape), Ok(space)) = (file.shape(dataset, name), dataset.space()) else { return };
    let Ok(dtype) = dataset.dtype().and_then(|d| d.to_descriptor()) else { return };
    if space.is_null() {
        return;
    }
    let whole = dataset.size() <= SMALL;
    let rows = shape.first().copied().unwrap_or(0);
    let ends = if whole { [0..rows, 0..0] } else { [0..1, rows - 1..rows] };
    let ends = ends.into_iter().filter(|r| !r.is_empty());
    match dtype {
        TypeDescriptor::Compound(_) if file.demand_complex(dataset, name).is_ok() => {
            ends.for_each(|r| drop(file.rows::<Complex<f32>, IxDyn>(dataset, name, r)));
        }
        TypeDescriptor::Float(_) if whole => drop(file.all::<f64>(dataset)),
        TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) if whole => drop(file.all::<i64>(dataset)),
        TypeDescriptor::Boolean | TypeDescriptor::Enum(_) if whole => drop(file.all::<i8>(dataset)),
        _ if file.demand_numbers(dataset, name).is_ok() => ends.for_each(|r| drop(file.rows::<f64, IxDyn>(dataset, name, r))),
        _ => drop(file.strings(dataset)),
    }
}

//! Several outputs of one command that get their names together, when all of them are complete.
//!
//! The program begins a [`Together`] for each command. Until it is committed, finished outputs wait in their hidden folders. Writers of formats
//! know nothing of this: the outputs that a thread finishes while its `Together` is open belong to it.

use super::edit::EditLock;
use super::partial::{is_inside_of_one, replace_notes, take_notes, unfinished};
use super::publish::{Finished, sync_folder};
use crate::{FormatError, Result};
use std::cell::RefCell;
use std::fs;
use std::marker::PhantomData;
use std::path::{Path, PathBuf};

#[derive(Debug, Default)]
struct Open {
    finished: Vec<Finished>,
    removals: Vec<PathBuf>,
    private: bool,
    /// Held until the outputs have their names.
    locks: Vec<EditLock>,
}

thread_local! {
    static OPEN: RefCell<Option<Open>> = const { RefCell::new(None) };
}

/// The outputs of one command. Dropping it without [`Together::commit`] removes all that was written.
#[derive(Debug)]
pub struct Together {
    /// The outputs belong to the thread that writes them.
    _of_this_thread: PhantomData<*const ()>,
}

impl Together {
    /// From now on, outputs of this thread wait for [`Together::commit`]. Outputs inside of a folder that is itself being written do not wait.
    #[must_use]
    pub fn begin() -> Self {
        OPEN.with_borrow_mut(|open| *open = Some(Open::default()));
        Self { _of_this_thread: PhantomData }
    }

    /// Give all outputs their names, and remove the files that they make obsolete.
    ///
    /// # Errors
    /// An output that has appeared in the meantime and may not be replaced, or an error of the file system.
    pub fn commit(self) -> Result<()> {
        let mut open = OPEN.with_borrow_mut(Option::take).unwrap_or_default();
        open.finished.iter_mut().try_for_each(Finished::flushed)?;
        open.finished.iter().try_for_each(Finished::check)?;
        {
            // A signal waits until every output has its name.
            let _wait = unfinished();
            open.finished.iter().try_for_each(|f| f.publish(open.private))?;
            for path in &open.removals {
                fs::remove_file(path).map_err(|e| FormatError::io(path, "remove what an earlier run left at", e))?;
            }
        }
        open.finished.iter().for_each(|f| sync_folder(&f.target));
        Ok(())
    }
}

impl Drop for Together {
    fn drop(&mut self) {
        // The hidden folders remove themselves. They are dropped after the borrow has ended.
        drop(OPEN.with_borrow_mut(Option::take));
    }
}

/// Do two pieces of work of one command at the same time. What the second writes, perhaps on another thread, belongs to the open [`Together`] of this
/// thread, as if it had come after the first. The second must not lock a file ([`hold`]): the first may have locked it already.
pub fn beside<A: Send, B: Send>(first: impl FnOnce() -> A + Send, second: impl FnOnce() -> B + Send) -> (A, B) {
    let open = OPEN.with_borrow(|open| open.as_ref().map(|o| Open { private: o.private, ..Open::default() }));
    let aside = || {
        let aside = Aside::begin(open, Vec::new());
        let result = second();
        (result, aside.end())
    };
    let (first, (second, (theirs, notes))) = rayon::join(first, aside);
    OPEN.with_borrow_mut(|open| {
        if let (Some(open), Some(theirs)) = (open, theirs) {
            open.finished.extend(theirs.finished);
            open.removals.extend(theirs.removals);
            open.private |= theirs.private;
            open.locks.extend(theirs.locks);
        }
    });
    let mut all = take_notes();
    all.extend(notes);
    replace_notes(all);
    (first, second)
}

/// Do the work of a command on a thread of the pool, while this one waits. Its outputs and notes are those of this thread.
pub fn on_the_pool<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    let (open, notes) = (OPEN.take(), take_notes());
    let (result, (open, notes)) = rayon::scope(|_| {
        let aside = Aside::begin(open, notes);
        let result = work();
        (result, aside.end())
    });
    OPEN.set(open);
    replace_notes(notes);
    result
}

/// What a thread had open, while it works for the command of another.
struct Aside {
    own: Option<(Option<Open>, Vec<String>)>,
}

impl Aside {
    /// Begin with these outputs and notes of the other thread.
    fn begin(open: Option<Open>, notes: Vec<String>) -> Self {
        Self { own: Some((OPEN.replace(open), replace_notes(notes))) }
    }

    /// What the other thread has now.
    fn end(mut self) -> (Option<Open>, Vec<String>) {
        self.own.take().map_or_else(Default::default, |(open, notes)| (OPEN.replace(open), replace_notes(notes)))
    }
}

impl Drop for Aside {
    /// After a panic the thread has again what it had before.
    fn drop(&mut self) {
        if let Some((open, notes)) = self.own.take() {
            drop((OPEN.replace(open), replace_notes(notes)));
        }
    }
}

/// A finished output gets its name when the open [`Together`] is committed, or now where there is none.
pub(super) fn finish(finished: Finished) -> Result<()> {
    let now = is_inside_of_one(&finished.target);
    let left = OPEN.with_borrow_mut(|open| match open {
        Some(open) if !now => {
            open.finished.push(finished);
            None
        }
        _ => Some(finished),
    });
    left.map_or(Ok(()), publish_now)
}

/// Give an output its name without waiting for the others.
pub(super) fn publish_now(mut finished: Finished) -> Result<()> {
    finished.flushed()?;
    finished.check()?;
    let private = is_private();
    {
        let _wait = unfinished();
        finished.publish(private)?;
    }
    sync_folder(&finished.target);
    Ok(())
}

/// Remove a file when the open [`Together`] is committed, or now where there is none.
///
/// # Errors
/// An error of the file system.
pub fn remove_at_the_end(path: &Path) -> Result<()> {
    let waits = OPEN.with_borrow_mut(|open| open.as_mut().map(|o| o.removals.push(path.into())).is_some());
    if waits { Ok(()) } else { fs::remove_file(path).map_err(|e| FormatError::io(path, "remove", e)) }
}

/// Lock an existing file that is changed or replaced, until the open [`Together`] is committed. A file that it has locked already stays so. Where
/// there is none, the lock is released at once.
///
/// # Errors
/// As [`EditLock::take`].
pub fn hold(target: &Path) -> Result<()> {
    let is_held = |open: &Option<Open>| open.iter().flat_map(|o| &o.locks).any(|lock| lock.is_of(target));
    if OPEN.with_borrow(is_held) {
        return Ok(());
    }
    let lock = EditLock::take(target)?;
    OPEN.with_borrow_mut(|open| open.as_mut().map(|o| o.locks.push(lock)));
    Ok(())
}

/// Outputs of the open [`Together`] are for the user alone, because an input is.
pub fn keep_private() {
    OPEN.with_borrow_mut(|open| open.as_mut().map(|o| o.private = true));
}

/// Whether outputs are for the user alone.
#[must_use]
pub fn is_private() -> bool {
    OPEN.with_borrow(|open| open.as_ref().is_some_and(|o| o.private))
}

//! Several processes on one command, as `mpirun` starts them. Process 0 prints and writes; the others only compute.

mod defaults;
#[cfg(feature = "mpi")]
mod mpi;

pub(super) use defaults::{for_mpirun, is_default_epsilon};

use super::failure::{Failure, Result, ensure};
use crate::memory::MemoryBudget;
use cittert_arrays::{Alone, Ranks};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

/// The variables by which the mpirun of Open MPI, and that of MPICH, tell a process how many there are, its number, and how many run on its machine.
/// srun sets some of those of MPICH too, but not the last; what it starts are runs of their own.
const OPEN_MPI: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_LOCAL_SIZE"];
const MPICH: [&str; 3] = ["PMI_SIZE", "PMI_RANK", "MPI_LOCALNRANKS"];
/// An error that all processes find is told by process 0, for which the others wait this long.
const PATIENCE: Duration = Duration::from_secs(2);

static RANKS: OnceLock<Arc<dyn Ranks>> = OnceLock::new();

/// What mpirun says of this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Place {
    /// Number of processes that were started together.
    size: usize,
    rank: usize,
    /// Number of these on this machine.
    here: usize,
}

impl Place {
    /// `None` where mpirun has not started the process.
    fn read(variable: impl Fn(&str) -> Option<usize>) -> Option<Self> {
        let of = |names: [&str; 3]| Some(Self { size: variable(names[0])?, rank: variable(names[1])?, here: variable(names[2])? });
        of(OPEN_MPI).or_else(|| of(MPICH))
    }

    fn given() -> Option<Self> {
        Self::read(|name| std::env::var(name).ok()?.parse().ok())
    }

    fn own() -> Self {
        Self::given().unwrap_or(Self { size: 1, rank: 0, here: 1 })
    }
}

/// Join the other processes, if there are any.
///
/// # Errors
/// There are several, and the program is built without MPI.
pub(super) fn begin() -> Result<()> {
    let place = Place::own();
    let n = place.size;
    if n < 2 || RANKS.get().is_some() {
        return Ok(());
    }
    #[cfg(feature = "mpi")]
    let made = {
        if place.here == n {
            mpi::need_no_network();
        }
        mpi::join()?
    };
    #[cfg(not(feature = "mpi"))]
    let made: Arc<dyn Ranks> = Arc::new(Alone);
    let text = format!(
        "{n} processes were started together, but this cittert cannot share work among them: start it without mpirun, or build it with \
         --features mpi and the same MPI as mpirun"
    );
    ensure!(made.size() == n, Failure::usage(text));
    let _ = RANKS.set(made);
    Ok(())
}

/// All processes, as this one sees them.
pub(super) fn all() -> Arc<dyn Ranks> {
    RANKS.get().cloned().unwrap_or_else(|| Arc::new(Alone))
}

/// How many processes share the command.
pub(super) fn size() -> usize {
    all().size()
}

/// Whether mpirun has started this process, alone or with others.
pub(super) fn by_mpirun() -> bool {
    Place::given().is_some()
}

/// Whether this process only computes, and neither prints nor writes.
pub(super) fn is_silent() -> bool {
    RANKS.get().map_or_else(|| Place::own().rank, |ranks| ranks.rank()) > 0
}

/// Refuse several processes.
///
/// # Errors
/// There are several. `what` says what cannot be shared, and what to do.
pub(super) fn refuse_several(what: &str) -> Result<()> {
    let n = size();
    ensure!(n == 1, Failure::usage(format!("{n} processes share this command: {what}")));
    Ok(())
}

/// Share the processors and the memory of the machine among its processes, where the user says nothing. Processes that are bound to some of its
/// processors have these for themselves.
pub(super) fn share_machine(threads: Option<usize>, memory: Option<MemoryBudget>) -> (Option<usize>, Option<MemoryBudget>) {
    if size() == 1 {
        return (threads, memory);
    }
    let here = Place::own().here.max(1);
    let mine = std::thread::available_parallelism().map_or(1, usize::from);
    // SAFETY: the call only reads a number of the system.
    let bound = i64::try_from(mine).is_ok_and(|mine| mine < unsafe { libc::sysconf(libc::_SC_NPROCESSORS_ONLN) });
    let part = MemoryBudget::new((MemoryBudget::of_machine().bytes() / here) as u64).ok();
    (threads.or(Some(if bound { mine } else { (mine / here).max(1) })), memory.or(part))
}

/// Leave the other processes after a success.
pub fn end() {
    #[cfg(feature = "mpi")]
    if RANKS.get().is_some() {
        mpi::leave();
    }
}

/// Print a failure and end all processes. Returns only where this process is alone, or has only printed help.
pub fn fail(failure: &Failure) {
    let code = failure.exit_code();
    if is_silent() && (code == 0 || RANKS.get().is_none()) {
        return end();
    }
    if is_silent() {
        std::thread::sleep(PATIENCE);
        let host = std::fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let text = format!("process {} of {} on {}: {failure}", all().rank(), size(), host.trim());
        Failure::message(text).print();
    } else {
        failure.print();
    }
    #[cfg(feature = "mpi")]
    if RANKS.get().is_some() && code != 0 {
        mpi::abort(code);
    }
    end();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_srun_starts_are_runs_of_their_own() {
        let read = |set: &[(&str, usize)]| Place::read(|name| set.iter().find(|(n, _)| *n == name).map(|(_, v)| *v));
        assert_eq!(read(&[]), None);
        assert_eq!(read(&[("PMI_SIZE", 4), ("PMI_RANK", 2), ("SLURM_NTASKS", 4)]), None);
        let third = Some(Place { size: 4, rank: 2, here: 3 });
        assert_eq!(read(&[("PMI_SIZE", 4), ("PMI_RANK", 2), ("MPI_LOCALNRANKS", 3)]), third);
        assert_eq!(read(&[("OMPI_COMM_WORLD_SIZE", 4), ("OMPI_COMM_WORLD_RANK", 2), ("OMPI_COMM_WORLD_LOCAL_SIZE", 3)]), third);
    }
}

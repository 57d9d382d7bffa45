//! The time and memory that jobs ask for.
//!
//! A job that asks for too little is killed by Slurm, and one that asks for too much waits longer. A study measures a few of its own trials. For
//! commands with a forecast (`--dry-run`) that tells. All other commands are told.

use super::args::SlurmArgs;
use crate::cli::failure::{Failure, Result, ensure};

/// Other machines are slower, and trials differ.
const SAFETY: f64 = 2.0;
/// The memory of a forecast is that of arrays, which is known better.
const MEMORY_SAFETY: f64 = 1.25;
/// Time for the start of a job, s.
const START_S: f64 = 120.0;
/// Memory beyond what was measured: the program and its libraries on another machine, bytes.
const MARGIN_BYTES: u64 = 256 << 20;

/// What a job asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::cli) struct Need {
    /// Time limit, s.
    pub(in crate::cli) seconds: f64,
    /// Memory, bytes.
    pub(in crate::cli) bytes: u64,
}

/// What a few trials of a study took on this machine, one after the other.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::cli) struct Pilot {
    /// Time until the first trial: reading, and the observations that trials share, s.
    pub(in crate::cli) setup_s: f64,
    /// Longest time of a trial, s.
    pub(in crate::cli) trial_s: f64,
    /// Memory before the first trial, bytes.
    pub(in crate::cli) before_bytes: u64,
    /// Largest memory, bytes.
    pub(in crate::cli) peak_bytes: u64,
}

/// The need of a job that runs `trials` trials on as many processors as the options say. Stated values come before measured ones.
pub(in crate::cli) fn study(args: &SlurmArgs, pilot: &Pilot, trials: usize) -> Need {
    let turns = trials.div_ceil(args.slurm_cpus.max(1));
    let seconds = START_S + SAFETY * (pilot.setup_s + pilot.trial_s * turns as f64);
    // Trials that run side by side share the observations.
    let per_trial = pilot.peak_bytes.saturating_sub(pilot.before_bytes);
    let bytes = MARGIN_BYTES + pilot.peak_bytes + per_trial * (args.slurm_cpus.max(1) as u64 - 1);
    Need { seconds: args.slurm_time.map_or(seconds, |t| t.0), bytes: args.slurm_memory.map_or(bytes, |m| m.bytes() as u64) }
}

/// The need that the user states, or else what the cost model predicts for this machine: seconds and bytes.
///
/// # Errors
/// Neither is there.
pub(in crate::cli) fn stated(args: &SlurmArgs, name: &str, predicted: Option<(f64, f64)>) -> Result<Need> {
    let time = args.slurm_time.map(|t| t.0).or(predicted.map(|(s, _)| START_S + SAFETY * s));
    let memory = args.slurm_memory.map(|m| m.bytes() as u64).or(predicted.map(|(_, b)| MARGIN_BYTES + (MEMORY_SAFETY * b) as u64));
    let (Some(seconds), Some(bytes)) = (time, memory) else {
        let why = "what it will take is not known before";
        return Err(Failure::usage(format!(
            "{name} --slurm needs --slurm-time and --slurm-memory, such as --slurm-time 2h --slurm-memory 16GB: {why}"
        )));
    };
    ensure!(seconds > 0.0, Failure::usage("--slurm-time: expected a time above 0"));
    Ok(Need { seconds, bytes })
}

impl Pilot {
    /// Forget the memory that was held before, so that the largest memory is that of what follows. The program keeps memory that it has freed.
    pub(in crate::cli) fn forget_memory() {
        #[cfg(all(target_os = "linux", target_env = "gnu"))]
        // SAFETY: the function only gives memory that is not in use back to the system.
        unsafe {
            libc::malloc_trim(0);
        }
        // Linux then counts the largest memory anew (proc(5)). Where it does not, what was held before counts as well.
        let _ = std::fs::write("/proc/self/clear_refs", "5");
    }

    /// Memory of this process in bytes: now, and at most so far. 0 where the system does not tell.
    pub(in crate::cli) fn memory() -> (u64, u64) {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let value = |key: &str| {
            let line = status.lines().find_map(|l| l.strip_prefix(key))?;
            line.trim().trim_end_matches("kB").trim().parse::<u64>().ok().map(|kb| kb * 1024)
        };
        (value("VmRSS:").unwrap_or(0), value("VmHWM:").unwrap_or(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Args, FromArgMatches};

    fn args(words: &[&str]) -> SlurmArgs {
        let matches = SlurmArgs::augment_args(clap::Command::new("x")).get_matches_from([&["x", "--slurm"][..], words].concat());
        SlurmArgs::from_arg_matches(&matches).unwrap()
    }

    #[test]
    fn a_study_asks_for_twice_what_it_measured() {
        let pilot = Pilot { setup_s: 5.0, trial_s: 2.0, before_bytes: 100 << 20, peak_bytes: 150 << 20 };
        let need = study(&args(&["--slurm-cpus", "4"]), &pilot, 101);
        assert_eq!(need, Need { seconds: 120.0 + 2.0 * (5.0 + 26.0 * 2.0), bytes: (256 + 150 + 150) << 20 });
        let need = study(&args(&["--slurm-time", "1h", "--slurm-memory", "2GB"]), &pilot, 101);
        assert_eq!(need, Need { seconds: 3600.0, bytes: 2_000_000_000 });
        assert!(Pilot::memory().1 >= Pilot::memory().0.min(1 << 20));
    }

    #[test]
    fn other_commands_are_forecast_or_told() {
        assert!(stated(&args(&["--slurm-time", "1h"]), "run", None).unwrap_err().to_string().contains("--slurm-memory"));
        assert_eq!(stated(&args(&["--slurm-time", "1h", "--slurm-memory", "2GB"]), "run", None).unwrap().bytes, 2_000_000_000);
        let need = stated(&args(&[]), "clean", Some((100.0, 4e9))).unwrap();
        assert_eq!(need, Need { seconds: 320.0, bytes: (256 << 20) + 5_000_000_000 });
        assert_eq!(stated(&args(&["--slurm-time", "1h"]), "clean", Some((100.0, 4e9))).unwrap().seconds, 3600.0);
    }
}

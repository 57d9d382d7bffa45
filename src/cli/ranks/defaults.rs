//! Defaults of what mpirun starts.

use crate::imaging::ImagingOptions;
use clap::Command;

/// Commands whose steps build on one another, so that a difference in the last digit of an image grows.
const IN_STEPS: [&str; 3] = ["clean", "mem", "selfcal"];

/// The `--epsilon` of these: grids are in double precision, and have the kernel of 1e-5.
const DOUBLE: f64 = 9e-6;
const DOUBLE_TYPED: &str = "0.000009";

/// The commands with the defaults of what mpirun starts: images and gains that do not depend on the number of processes. In single precision each process
/// rounds the sums of its own rows, and deconvolution then takes other steps.
pub(in crate::cli) fn for_mpirun(command: Command) -> Command {
    IN_STEPS.iter().fold(command, |all, name| all.mut_subcommand(name, |one| one.mut_arg("epsilon", |arg| arg.default_value(DOUBLE_TYPED))))
}

/// Whether one of these commands has this accuracy where none is given, with mpirun or without it.
pub(in crate::cli) fn is_default_epsilon(epsilon: f64) -> bool {
    epsilon == DOUBLE || epsilon == ImagingOptions::default().epsilon
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The accuracy that a command line asks for.
    fn epsilon(command: Command, words: &[&str]) -> f64 {
        let matches = command.try_get_matches_from(words).unwrap();
        *matches.subcommand().unwrap().1.get_one("epsilon").unwrap()
    }

    #[test]
    fn several_processes_deconvolve_in_double_precision_unless_an_accuracy_is_given() {
        let all = || for_mpirun(crate::cli::command());
        for name in IN_STEPS {
            let words = ["cittert", name, "a.uvh5", "-o", "b"];
            assert_eq!((epsilon(crate::cli::command(), &words), epsilon(all(), &words)), (1e-5, DOUBLE), "{name}");
            assert_eq!(epsilon(all(), &[&words[..], &["--epsilon", "1e-5"]].concat()), 1e-5, "{name}");
        }
        assert_eq!(epsilon(all(), &["cittert", "dirty", "a.uvh5", "-o", "b"]), 1e-5);
    }
}

//! The text of a script of Slurm.

use super::need::Need;
use crate::cli::context::shell_word;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use std::fmt::Write;
use std::path::Path;

/// A job array: its number of tasks.
pub(in crate::cli) struct Array(pub(in crate::cli) usize);

/// A script.
pub(in crate::cli) struct Script<'a> {
    /// Name of the subcommand.
    pub(in crate::cli) name: &'a str,
    pub(in crate::cli) need: Need,
    pub(in crate::cli) cpus: usize,
    /// Further options of `sbatch`.
    pub(in crate::cli) options: &'a [String],
    /// Where Slurm writes what the job prints.
    pub(in crate::cli) log: &'a Path,
    /// What `srun` starts.
    pub(in crate::cli) command: String,
    pub(in crate::cli) array: Option<Array>,
    /// How the script is submitted.
    pub(in crate::cli) submit: String,
}

impl Script<'_> {
    /// The text.
    ///
    /// # Errors
    /// An option of several lines, or a folder without a path.
    pub(in crate::cli) fn text(&self) -> Result<String> {
        let folder = std::env::current_dir().context("the present folder")?;
        let here = folder.to_str().ok_or_else(|| Failure::message("the present folder has a name that is not UTF-8"))?;
        let mut head = vec![
            format!("--job-name=cittert-{}", self.name),
            "--nodes=1".into(),
            "--ntasks=1".into(),
            format!("--cpus-per-task={}", self.cpus),
            format!("--time={}", time_limit(self.need.seconds)),
            format!("--output={}", absolute(&folder, self.log)?),
        ];
        head.extend(self.array.as_ref().map(|Array(n)| format!("--array=1-{n}")));
        let memory = format!("--mem={}M", self.need.bytes.div_ceil(1 << 20));
        let mut text = format!("#!/bin/bash\n# Written by cittert {}. Submit it by: {}\n", env!("CARGO_PKG_VERSION"), self.submit);
        if is_memory_managed() {
            head.push(memory);
        } else {
            text += &format!("# {memory} is left out: no node of this cluster states its memory, and Slurm would refuse the job.\n");
        }
        head.extend(self.options.iter().map(|o| o.strip_prefix("#SBATCH ").unwrap_or(o).to_owned()));
        for option in head {
            ensure!(!option.contains(['\n', '\r']), Failure::usage("--slurm-option: expected one line"));
            ensure!(
                option.starts_with('-'),
                Failure::usage(format!("--slurm-option is {option:?}, expected an option such as --partition=long"))
            );
            // Writing to a String does not fail.
            let _ = writeln!(text, "#SBATCH {option}");
        }
        let _ =
            write!(text, "set -euo pipefail\ncd {}\nsrun --ntasks=1 --cpus-per-task={} {}\n", shell_word(here), self.cpus, self.command);
        Ok(text)
    }
}

/// False on a cluster whose nodes do not state how much memory they have: Slurm then takes it as 1 MB. True where there is no Slurm.
fn is_memory_managed() -> bool {
    let told = std::process::Command::new("sinfo").args(["-h", "-o", "%m"]).output();
    let text = told.ok().filter(|t| t.status.success()).map(|t| String::from_utf8_lossy(&t.stdout).into_owned()).unwrap_or_default();
    let sizes: Vec<u64> = text.lines().filter_map(|l| l.trim().trim_end_matches('+').parse().ok()).collect();
    sizes.is_empty() || sizes.iter().any(|mb| *mb > 1)
}

/// A path for a line of `#SBATCH`, which no shell reads. Slurm puts numbers for `%j`, `%A` and `%a`.
fn absolute(folder: &Path, path: &Path) -> Result<String> {
    let (all, name) = (folder.join(path), path.display());
    let text = all.to_str().filter(|t| !t.contains([' ', '"', '\'', '\\', '#']));
    let what = format!("{name}: Slurm takes no name with spaces or quotes for the file of messages: choose another folder or output");
    text.map(str::to_owned).ok_or_else(|| Failure::message(what))
}

/// Days, hours, minutes and seconds as Slurm reads them, rounded up to a minute.
fn time_limit(seconds: f64) -> String {
    let minutes = (seconds / 60.0).ceil().max(1.0) as u64;
    format!("{}-{:02}:{:02}:00", minutes / 1440, minutes / 60 % 24, minutes % 60)
}

/// A path as a word of a shell.
pub(in crate::cli) fn quoted(path: &Path) -> String {
    shell_word(&path.display().to_string())
}

/// The present program with the words of a command line, without those that ask for a script, with the threads of the job and the memory for data.
///
/// # Errors
/// The program has no path.
pub(super) fn command(line: &str, cpus: usize, memory: Option<u64>) -> Result<String> {
    let program = std::env::current_exe().context("the path of this program")?;
    let words = without_slurm(line);
    let is_given = |name: &str| words.iter().any(|w| w == name || w.starts_with(&format!("{name}=")));
    let mut all = vec![quoted(&program)];
    if !is_given("--threads") {
        all.push(format!("--threads {cpus}"));
    }
    if let Some(bytes) = memory.filter(|_| !is_given("--memory")) {
        all.push(format!("--memory {bytes}B"));
    }
    all.extend(words);
    Ok(all.join(" "))
}

/// The words of a command line but the first, as they are quoted, without `--shards`, `--slurm` and what belongs to it.
fn without_slurm(line: &str) -> Vec<String> {
    let (mut kept, mut skip) = (Vec::new(), false);
    for word in quoted_words(line).into_iter().skip(1) {
        let is_option = word.starts_with("--slurm") || word == "--shards" || word.starts_with("--shards=");
        if is_option {
            skip = word != "--slurm" && !word.contains('=');
        } else if !std::mem::take(&mut skip) {
            kept.push(word);
        }
    }
    kept
}

/// Words that were quoted by [`shell_word`], with their quotes.
fn quoted_words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut is_quoted, mut is_escaped) = (Vec::new(), String::new(), false, false);
    for c in line.chars() {
        match c {
            ' ' if !is_quoted => words.push(std::mem::take(&mut word)),
            _ => {
                is_quoted ^= c == '\'' && !is_escaped;
                is_escaped = c == '\\' && !is_quoted;
                word.push(c);
            }
        }
    }
    words.push(word);
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_for_slurm_are_left_out_and_others_stay_as_they_are() {
        let line = "cittert study 'a b.toml' -o d --slurm --slurm-time 2h --slurm-memory=3GB --shards 20 --slurm-option '--partition=a b' 'it'\\''s x'";
        assert_eq!(without_slurm(line), ["study", "'a b.toml'", "-o", "d", "'it'\\''s x'"]);
        let text = command("cittert --threads 3 clean a.ms --slurm", 8, Some(1 << 30)).unwrap();
        assert!(text.ends_with(" --memory 1073741824B --threads 3 clean a.ms"), "{text}");
        assert!(command("cittert clean", 8, None).unwrap().ends_with(" --threads 8 clean"));
    }

    #[test]
    fn a_script_states_what_the_job_needs() {
        let options = ["--partition=long".to_owned()];
        let script = Script {
            name: "clean",
            need: Need { seconds: 90_061.0, bytes: 3 << 30 },
            cpus: 4,
            options: &options,
            log: Path::new("x-slurm-%j.log"),
            command: "cittert clean a".into(),
            array: Some(Array(7)),
            submit: "sbatch x.sbatch".into(),
        };
        let text = script.text().unwrap();
        for line in [
            "#!/bin/bash",
            "#SBATCH --time=1-01:02:00",
            "#SBATCH --mem=3072M",
            "#SBATCH --cpus-per-task=4",
            "#SBATCH --partition=long",
            "#SBATCH --array=1-7",
            "srun --ntasks=1 --cpus-per-task=4 cittert clean a",
        ] {
            assert!(text.lines().any(|l| l == line), "{line}:\n{text}");
        }
        assert_eq!(time_limit(1.0), "0-00:01:00");
        let wrong = Script { options: &["partition".to_owned()], ..script };
        assert!(wrong.text().is_err());
    }
}

//! The visibilities that a command reads: one file, or several that are one set.

use super::names::expanded;
use super::{ColumnArgs, OutputArgs};
use crate::cli::context::Context;
use crate::cli::failure::Failure;
use crate::cli::failure::{Result, ensure};
use crate::cli::ranks;
use cittert_arrays::{Part, Ranks, VisibilityHeader, VisibilitySource};
use cittert_formats::{JoinedSource, VisColumn};
use clap::Args;
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// The files of a set, as words.
#[derive(Debug, Clone, Args)]
pub struct SetArgs {
    /// Visibilities. Several files are one set: name them, or quote a pattern ('day*.uvh5'), or name a list (@files.txt, one name a line).
    #[arg(value_name = "IN", required = true, num_args = 1..)]
    input: Vec<PathBuf>,
}

impl SetArgs {
    /// The files that are meant.
    ///
    /// # Errors
    /// A pattern that no file has, or a list that cannot be read.
    pub fn files(&self) -> Result<SetFiles> {
        SetFiles::of(&self.input)
    }
}

/// The files of a set. It is shown as its name, or as the first name and how many others there are.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SetFiles(Vec<PathBuf>);

impl SetFiles {
    /// The files that words stand for.
    ///
    /// # Errors
    /// As [`SetArgs::files`].
    pub fn of(words: &[PathBuf]) -> Result<Self> {
        Ok(Self(expanded(words)?))
    }

    /// All files.
    #[must_use]
    pub fn all(&self) -> &[PathBuf] {
        &self.0
    }

    /// True where all files exist. In the forecast of a run, an earlier command would write them.
    #[must_use]
    pub fn exist(&self, context: &Context) -> bool {
        self.0.iter().all(|file| context.ahead.get(file).is_none())
    }

    /// The file, if it is one.
    #[must_use]
    pub fn one(&self) -> Option<&Path> {
        if let [one] = &self.0[..] { Some(one) } else { None }
    }

    /// Open the data; of several processes, each opens its part. What is remarkable about the set goes to the console.
    ///
    /// # Errors
    /// A damaged file, or files that are not parts of one set.
    pub fn open(&self, context: &Context) -> Result<Box<dyn VisibilitySource>> {
        self.open_column(VisColumn::Data, context)
    }

    /// Open the chosen column, as [`SetFiles::open`].
    ///
    /// # Errors
    /// As [`SetFiles::open`]; a file that does not have the column.
    pub fn open_chosen(&self, column: &ColumnArgs, context: &Context) -> Result<Box<dyn VisibilitySource>> {
        self.open_column(column.chosen().unwrap_or_default(), context)
    }

    /// Open the chosen column, all rows in each process. All processes call it.
    ///
    /// # Errors
    /// As [`SetFiles::open_chosen`].
    pub fn open_chosen_whole(&self, column: &ColumnArgs, context: &Context) -> Result<Box<dyn VisibilitySource>> {
        self.whole(column.chosen().unwrap_or_default(), context)
    }

    /// Open the data, all rows in each process. All processes call it.
    ///
    /// # Errors
    /// As [`SetFiles::open`].
    pub fn open_whole(&self, context: &Context) -> Result<Box<dyn VisibilitySource>> {
        self.whole(VisColumn::Data, context)
    }

    fn whole(&self, column: VisColumn, context: &Context) -> Result<Box<dyn VisibilitySource>> {
        if let Some(set) = self.one().and_then(|one| context.ahead.get(one)) {
            return Ok(Box::new(set));
        }
        self.agree(&*ranks::all())?;
        Ok(match self.one() {
            Some(one) => cittert_formats::open_column(one, column)?,
            None => Box::new(self.joined(column, context)?),
        })
    }

    fn open_column(&self, column: VisColumn, context: &Context) -> Result<Box<dyn VisibilitySource>> {
        let all = self.whole(column, context)?;
        Ok(if ranks::size() > 1 { Box::new(Part::new(all, ranks::all())) } else { all })
    }

    /// Refuse a set of which processes see different files: each of them would take its part from other rows. All processes call it.
    fn agree(&self, ranks: &dyn Ranks) -> Result<()> {
        let mut hasher = DefaultHasher::new();
        self.0.hash(&mut hasher);
        // Every whole number of 53 bits is exact.
        let (n, names) = (self.0.len() as f64, (hasher.finish() >> 11) as f64);
        let mut all = [n, -n, names, -names];
        ranks.largest(&mut all);
        let found = if all[0] == -all[1] { "files with other names".into() } else { format!("from {} to {} files", -all[1], all[0]) };
        let text = format!("the processes find {found} for {self}: every machine must see the same files under the same names");
        ensure!(all[0] == -all[1] && all[2] == -all[3], Failure::usage(text));
        Ok(())
    }

    /// Open several files as one set.
    fn joined(&self, column: VisColumn, context: &Context) -> Result<JoinedSource> {
        let set = JoinedSource::open_together(&self.0, column, &*ranks::all())?;
        let (rows, header) = (set.n_rows(), set.header());
        let shape = format!("{rows} rows, {} channels, {} products", header.spectrum.n_chan(), header.polarizations.len());
        context.console.note(&format!("{} files are one set: {shape}", self.0.len()));
        set.notes().iter().for_each(|note| context.console.note(note));
        Ok(set)
    }

    /// The columns beside the data that all files have.
    ///
    /// # Errors
    /// A damaged file.
    pub fn columns(&self) -> Result<Vec<VisColumn>> {
        let mut all: Option<Vec<VisColumn>> = None;
        for file in &self.0 {
            let have = cittert_formats::visibility_format(file)?.columns(file)?;
            all = Some(all.map_or_else(|| have.clone(), |all| all.into_iter().filter(|c| have.contains(c)).collect()));
        }
        Ok(all.unwrap_or_default())
    }

    /// Claim outputs of a command that may change its only input in place. Several files cannot be changed in place.
    ///
    /// # Errors
    /// As [`OutputArgs::claim`] and [`OutputArgs::edit`].
    pub fn claim_or_edit(&self, out: &OutputArgs, others: &[&Path]) -> Result<()> {
        match self.one() {
            Some(one) => {
                out.claim([&out.output], others)?;
                out.edit(one)
            }
            None => out.claim([out.output.as_path()], self.0.iter().map(PathBuf::as_path).chain(others.iter().copied())),
        }
    }

    /// What the set loses in the format of an output, one line each.
    ///
    /// # Errors
    /// An input or an output of no known format.
    pub fn losses(&self, output: &Path, header: &VisibilityHeader) -> Result<Vec<String>> {
        let mut lost = Vec::new();
        for file in &self.0 {
            let lines = cittert_formats::losses(file, output, header)?;
            lost.extend(lines.into_iter().filter(|line| !lost.contains(line)).collect::<Vec<_>>());
        }
        Ok(lost)
    }

    /// As [`SetFiles::losses`], if the output has another format than the input. The lines are printed.
    ///
    /// # Errors
    /// As [`SetFiles::losses`].
    pub fn note_losses(&self, output: &Path, header: &VisibilityHeader, context: &Context) -> Result<Vec<String>> {
        let mut lost = Vec::new();
        for file in &self.0 {
            let same = cittert_formats::visibility_format(file)?.name() == cittert_formats::format_of_output(file, output)?.name();
            let lines = if same { Vec::new() } else { cittert_formats::losses(file, output, header)? };
            lost.extend(lines.into_iter().filter(|line| !lost.contains(line)).collect::<Vec<_>>());
        }
        lost.iter().for_each(|line| context.console.note(line));
        Ok(lost)
    }

    /// The only file, for commands and kinds of files that have no parts.
    ///
    /// # Errors
    /// Several files. `what` says what they are.
    pub fn only(&self, what: &str) -> Result<&Path> {
        ensure!(self.0.len() == 1, Failure::usage(format!("{self}: several files are for visibilities; {what}")));
        Ok(&self.0[0])
    }
}

impl fmt::Display for SetFiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0[..] {
            [] => Ok(()),
            [one] => write!(f, "{}", one.display()),
            [first, second] => write!(f, "{} and {}", first.display(), second.display()),
            [first, others @ ..] => write!(f, "{} and {} other files", first.display(), others.len()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::as_processes;

    #[test]
    fn processes_that_find_other_files_refuse_the_set() {
        let files = |names: &[&str]| SetFiles(names.iter().map(PathBuf::from).collect());
        let errors = |of: [&SetFiles; 3]| as_processes(3, |ranks| of[ranks.rank()].agree(&*ranks).err().map(|e| e.to_string()));
        let (one, two, other) = (files(&["a.uvh5"]), files(&["a.uvh5", "b.uvh5"]), files(&["a.uvh5", "c.uvh5"]));
        assert!(errors([&two, &two, &two]).iter().all(Option::is_none));
        for (of, words) in [([&two, &one, &two], "from 1 to 2 files"), ([&two, &two, &other], "files with other names")] {
            assert!(errors(of).iter().all(|e| e.as_ref().is_some_and(|e| e.contains(words))), "{:?}", errors(of));
        }
    }
}

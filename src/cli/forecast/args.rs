//! The options of `--dry-run`.

use super::rehearsal::MOST_S;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cost::{Cluster, Speeds};
use crate::memory::MemoryBudget;
use cittert_arrays::quantity::Duration;
use clap::Args;
use std::path::PathBuf;
use std::str::FromStr;

/// Options of `--dry-run`.
#[derive(Debug, Clone, Default, Args)]
#[command(next_help_heading = "Forecast")]
pub(in crate::cli) struct ForecastArgs {
    /// Say what the command would take, in seconds and bytes of each stage, and write nothing.
    #[arg(long, global = true)]
    dry_run: bool,
    /// With --dry-run: also on so many machines, with the rows shared among their processes.
    #[arg(long, global = true, value_name = "K")]
    nodes: Option<usize>,
    /// Memory of each of these machines [default: 64GiB].
    #[arg(long, global = true, value_name = "SIZE")]
    node_memory: Option<MemoryBudget>,
    /// Bandwidth of the network of a machine [default: 10Gbit/s].
    #[arg(long, global = true, value_name = "RATE")]
    network: Option<Rate>,
    /// Bandwidth of the file system that all machines share, such as 2GB/s [default: no limit].
    #[arg(long, global = true, value_name = "RATE")]
    storage: Option<Rate>,
    /// Processes on each machine, each with --threads threads [default: 1].
    #[arg(long, global = true, value_name = "R")]
    ranks_per_node: Option<usize>,
    /// With --dry-run: as if the set had so many visibilities (rows times channels), by more rows with the same baselines.
    #[arg(long, global = true, value_name = "N")]
    visibilities: Option<f64>,
    /// With --dry-run: the speeds of another machine, as `make bench-book` writes them.
    #[arg(long, global = true, value_name = "TOML")]
    speeds: Option<PathBuf>,
    /// With --dry-run: rehearse for at most so long, to see how fast this machine is and how many cycles the data ask for; 0s for no rehearsal [default: 10s].
    #[arg(long, global = true, value_name = "TIME")]
    rehearse: Option<Duration>,
}

/// A bandwidth, bytes per second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::cli) struct Rate(pub(in crate::cli) f64);

impl FromStr for Rate {
    type Err = String;

    /// A number with a unit: Mbit/s, Gbit/s, MB/s or GB/s.
    fn from_str(text: &str) -> std::result::Result<Self, String> {
        const UNITS: [(&str, f64); 6] =
            [("Tbit/s", 1.25e11), ("Gbit/s", 1.25e8), ("Mbit/s", 1.25e5), ("TB/s", 1e12), ("GB/s", 1e9), ("MB/s", 1e6)];
        let found = UNITS.iter().find_map(|(unit, factor)| Some((text.trim().strip_suffix(unit)?, factor)));
        let rate = found.and_then(|(number, factor)| Some(number.trim().parse::<f64>().ok()? * factor));
        rate.filter(|r| r.is_finite() && *r > 0.0).map(Self).ok_or_else(|| "expected a rate such as 10Gbit/s or 2GB/s".to_owned())
    }
}

impl ForecastArgs {
    /// True where a forecast is wanted in place of the command.
    pub(in crate::cli) fn is_wanted(&self) -> bool {
        self.dry_run
    }

    /// Refuse options that have no effect.
    ///
    /// # Errors
    /// An option of the forecast without one.
    pub(in crate::cli) fn check(&self) -> Result<()> {
        let of_cluster = [
            ("node-memory", self.node_memory.is_some()),
            ("network", self.network.is_some()),
            ("storage", self.storage.is_some()),
            ("ranks-per-node", self.ranks_per_node.is_some()),
        ];
        let of_all = [
            ("nodes", self.nodes.is_some()),
            ("visibilities", self.visibilities.is_some()),
            ("speeds", self.speeds.is_some()),
            ("rehearse", self.rehearse.is_some()),
        ];
        let idle = |all: &[(&'static str, bool)]| all.iter().find(|(_, given)| *given).map(|(name, _)| *name);
        if let Some(name) = idle(&of_all).or(idle(&of_cluster)).filter(|_| !self.dry_run) {
            return Err(Failure::usage(format!("--{name} belongs to a forecast: add --dry-run, or leave it out")));
        }
        if let Some(name) = idle(&of_cluster).filter(|_| self.nodes.is_none()) {
            return Err(Failure::usage(format!("--{name} describes several machines: say with --nodes how many")));
        }
        Ok(())
    }

    /// The longest time of a rehearsal, s.
    pub(super) fn rehearsal_s(&self) -> f64 {
        self.rehearse.map_or(MOST_S, |time| time.si())
    }

    /// True where the speeds of another machine are given.
    pub(super) fn has_speeds(&self) -> bool {
        self.speeds.is_some()
    }

    /// Visibilities that the set is to have.
    ///
    /// # Errors
    /// A number below 1.
    pub(in crate::cli) fn visibilities(&self) -> Result<Option<f64>> {
        let n = self.visibilities;
        ensure!(
            n.is_none_or(|n| (1.0..1e18).contains(&n)),
            Failure::usage("--visibilities: expected a number of visibilities, such as 1e10")
        );
        Ok(n)
    }

    /// The speeds of a file.
    ///
    /// # Errors
    /// The file cannot be read, or is no table of speeds.
    pub(super) fn speeds(&self) -> Result<Option<Speeds>> {
        let Some(path) = &self.speeds else { return Ok(None) };
        let text = cittert_formats::read_text(path)?;
        Ok(Some(Speeds::parse(&text).context(path.display())?))
    }

    /// The machines that share the work.
    ///
    /// # Errors
    /// A number of machines or processes that cannot be.
    pub(super) fn cluster(&self, threads: usize) -> Result<Option<Cluster>> {
        let Some(nodes) = self.nodes else { return Ok(None) };
        let ranks_per_node = self.ranks_per_node.unwrap_or(1);
        for (name, n) in [("nodes", nodes), ("ranks-per-node", ranks_per_node)] {
            ensure!((1..=1_000_000).contains(&n), Failure::usage(format!("--{name} is {n}, expected 1 to 1000000")));
        }
        Ok(Some(Cluster {
            nodes,
            node_bytes: self.node_memory.map_or(64.0 * f64::from(1 << 30), |m| m.bytes() as f64),
            ranks_per_node,
            threads,
            network: self.network.map_or(1.25e9, |r| r.0),
            storage: self.storage.map(|r| r.0),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_have_units() {
        for (text, bytes) in [("10Gbit/s", 1.25e9), ("2 GB/s", 2e9), ("100Mbit/s", 1.25e7), ("0.5TB/s", 5e11)] {
            assert_eq!(text.parse::<Rate>().unwrap().0, bytes, "{text}");
        }
        for wrong in ["10", "10Gb", "GB/s", "-1GB/s", "nanGB/s", "0GB/s"] {
            assert!(wrong.parse::<Rate>().is_err(), "{wrong}");
        }
    }
}

//! The same work shared by the processes of several machines, and what breaks first.
//!
//! Rows are shared out, images are not: every process has its own grid and images, and sums over all rows travel over the network. A sum of B bytes
//! over K machines takes 2 B (K - 1) / K over the bandwidth of one machine (Rabenseifner 2004, ICCS, 1: reduce-scatter and gather).

use super::speeds::Speeds;
use super::stage::{Forecast, Stage};

/// Images are summed as doubles, whatever their precision.
const AS_SENT: f64 = 2.0;

/// Several machines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cluster {
    /// Number of machines.
    pub nodes: usize,
    /// Memory of each, bytes.
    pub node_bytes: f64,
    /// Processes on each.
    pub ranks_per_node: usize,
    /// Threads of a process.
    pub threads: usize,
    /// Bandwidth of the network of a machine, bytes per second.
    pub network: f64,
    /// Bandwidth of the file system that all machines share, bytes per second; none where it does not limit.
    pub storage: Option<f64>,
}

/// The time of one stage on a cluster, s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Name of the stage.
    pub name: &'static str,
    /// Arithmetic.
    pub computing: f64,
    /// Sums over the network.
    pub network: f64,
    /// Time that files take beyond that.
    pub storage: f64,
    /// Bytes of a process.
    pub bytes: f64,
}

/// What limits the work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// A machine has too little memory for its processes.
    Memory,
    /// The sums over the network take most of the time.
    Network,
    /// The file system takes most of the time.
    Storage,
    /// The planes of the grid do not fit into the memory of a process, which makes them again for every block of rows.
    Planes,
    /// What each process does with whole images takes most of the time: more machines do not help.
    WholeImages,
    /// The work on visibilities takes most of the time: more machines help.
    Visibilities,
}

/// What a command takes on a cluster.
#[derive(Debug, Clone, PartialEq)]
pub struct Shared {
    /// The stages.
    pub spans: Vec<Span>,
    /// Time of all, s.
    pub seconds: f64,
    /// Largest memory of the processes of one machine, bytes.
    pub node_bytes: f64,
    /// Largest memory of one process, bytes.
    pub rank_bytes: f64,
    /// The first limit.
    pub limit: Limit,
    /// Part of the time that it takes; for memory, what is needed over what is there.
    pub part: f64,
}

impl Limit {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Memory => "memory",
            Self::Network => "network",
            Self::Storage => "storage",
            Self::Planes => "planes",
            Self::WholeImages => "whole-images",
            Self::Visibilities => "visibilities",
        }
    }
}

impl Cluster {
    /// Number of processes.
    #[must_use]
    pub fn ranks(&self) -> usize {
        (self.nodes * self.ranks_per_node).max(1)
    }

    /// What a command takes whose `forecast` is that of one process with its share of the rows. `visibilities` are the seconds of it that grow with the
    /// number of rows.
    #[must_use]
    pub fn share(&self, forecast: &Forecast, speeds: &Speeds) -> Shared {
        let several = if self.nodes > 1 { 2.0 * (self.nodes - 1) as f64 / self.nodes as f64 } else { 0.0 };
        let spans: Vec<Span> = forecast
            .stages
            .iter()
            .map(|stage| {
                let computing = stage.seconds(speeds, self.threads);
                let read = self.storage.map_or(0.0, |rate| stage.read_bytes * self.ranks() as f64 / rate);
                Span {
                    name: stage.name,
                    computing,
                    network: AS_SENT * stage.summed_bytes * several / self.network * self.ranks_per_node.max(1) as f64,
                    storage: (read - computing).max(0.0),
                    bytes: stage.memory(speeds),
                }
            })
            .collect();
        let written = self.storage.map_or(0.0, |rate| forecast.output_bytes / rate);
        let sum = |f: fn(&Span) -> f64| spans.iter().map(f).sum::<f64>();
        let (computing, network, storage) = (sum(|s| s.computing), sum(|s| s.network), sum(|s| s.storage) + written);
        let seconds = computing + network + storage;
        let rank_bytes = spans.iter().map(|s| s.bytes).fold(0.0, f64::max);
        let node_bytes = rank_bytes * self.ranks_per_node.max(1) as f64;
        let whole_of = |s: &Stage| {
            let of_images = s.work.iter().filter(|(t, _)| s.whole || t.is_of_images());
            s.pace * of_images.map(|(t, n)| n * speeds.seconds(*t, self.threads)).sum::<f64>()
        };
        let whole: f64 = forecast.stages.iter().map(whole_of).sum();
        let parts = [
            (Limit::Network, network),
            (Limit::Storage, storage),
            (if forecast.groups_of_planes > 1 { Limit::Planes } else { Limit::WholeImages }, whole),
            (Limit::Visibilities, computing - whole),
        ];
        let most = parts.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((Limit::Visibilities, 0.0));
        let (limit, part) =
            if node_bytes > self.node_bytes { (Limit::Memory, node_bytes / self.node_bytes) } else { (most.0, most.1 / seconds) };
        Shared { spans, seconds, node_bytes, rank_bytes, limit, part }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::Term;

    /// A pass of a hundred thousand million visibilities that sums an image of 1 GB.
    fn forecast(values: f64) -> Forecast {
        let pass = Stage { summed_bytes: 1e9, read_bytes: 8.0 * values, ..Stage::new("pass", 3e9) };
        let stages = vec![pass.doing([(Term::ReadUvh5, values), (Term::ToImage, 1e9)])];
        Forecast { stages, output_bytes: 1e9, ..Forecast::default() }
    }

    fn cluster(nodes: usize) -> Cluster {
        Cluster { nodes, node_bytes: 64e9, ranks_per_node: 2, threads: 8, network: 1.25e9, storage: None }
    }

    #[test]
    fn more_machines_share_the_rows_until_something_else_takes_the_time() {
        let speeds = Speeds::built_in().unwrap();
        let few = cluster(2).share(&forecast(1e11 / 4.0), &speeds);
        let many = cluster(64).share(&forecast(1e11 / 128.0), &speeds);
        assert!(many.seconds < few.seconds && few.limit == Limit::Visibilities, "{few:?} {many:?}");
        // Both directions of the sum of two processes on each of two machines.
        assert!((few.spans[0].network - 2.0 * 1e9 * 1.0 / 1.25e9 * 2.0).abs() < 1e-9);
        assert_eq!(Cluster { nodes: 1, ..cluster(1) }.share(&forecast(1e9), &speeds).spans[0].network, 0.0);
        let slow = Cluster { network: 1e6, ..cluster(64) }.share(&forecast(1e6), &speeds);
        assert!(slow.limit == Limit::Network && slow.part > 0.9);
        let disc = Cluster { storage: Some(1e6), ..cluster(2) }.share(&forecast(1e9), &speeds);
        assert!(disc.limit == Limit::Storage);
        // A rehearsal in which images took a thousand times as long as their forecast.
        let mut paced = forecast(1e9);
        let write = Stage { pace: 1e3, ..Stage::new("write", 1e6).doing([(Term::WritePixel, 1e7)]) };
        paced.stages.push(write);
        let shared = cluster(2).share(&paced, &speeds);
        assert!(shared.limit == Limit::WholeImages && shared.part > 0.5, "{shared:?}");
        let small = Cluster { node_bytes: 4e9, ..cluster(2) }.share(&forecast(1e9), &speeds);
        assert!(small.limit == Limit::Memory && small.part > 1.5 && small.node_bytes > 6e9);
    }
}

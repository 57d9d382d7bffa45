//! A forecast as text and as JSON.

use super::told::Told;
use crate::cli::context::Outcome;
use crate::cost::{Cluster, Forecast, Shared, Speeds};
use serde_json::{Map, Value, json};
use std::fmt::Write;

/// A number of bytes for people.
pub(super) fn size(bytes: f64) -> String {
    let units = [(1e15, "PB"), (1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let (unit, name) = units.into_iter().find(|(unit, _)| bytes >= *unit).unwrap_or((1.0, "B"));
    format!("{:.3} {name}", bytes / unit)
}

/// A time for people.
pub(super) fn time(seconds: f64) -> String {
    match seconds {
        s if s < 120.0 => format!("{s:.3} s"),
        s if s < 7200.0 => format!("{:.1} min", s / 60.0),
        s if s < 172_800.0 => format!("{:.1} h", s / 3600.0),
        s => format!("{:.1} d", s / 86_400.0),
    }
}

/// The operations of a stage by name, for fits of the speeds.
fn work(stage: &crate::cost::Stage) -> Value {
    let mut all = Map::new();
    for (term, n) in &stage.work {
        let sum = all.get(term.name()).and_then(Value::as_f64).unwrap_or(0.0) + n;
        all.insert(term.name().to_owned(), sum.into());
    }
    Value::Object(all)
}

/// The forecast of a command here, and on a cluster if one is asked for. `disk` is what is left where the outputs go.
pub(super) fn outcome(told: &Told, (speeds, threads): (&Speeds, usize), shared: Option<(&Cluster, &Shared)>, disk: Option<u64>) -> Outcome {
    let Forecast { stages, output_bytes, assumptions, .. } = &told.forecast;
    let (seconds, peak) = (told.forecast.seconds(speeds, threads), told.forecast.peak_bytes(speeds));
    let list: Vec<Value> = stages
        .iter()
        .map(|s| {
            json!({
                "stage": s.name, "seconds": s.seconds(speeds, threads), "bytes": s.memory(speeds),
                "read_bytes": s.read_bytes, "work": work(s),
            })
        })
        .collect();
    let mut json = json!({
        "dry_run": true, "command": told.command, "threads": threads, "seconds": seconds, "peak_bytes": peak, "output_bytes": output_bytes,
        "disk_free_bytes": disk, "stages": list, "assumptions": assumptions, "speeds_of": speeds.machine, "speeds_date": speeds.date, "gauges": speeds.gauges(),
        "start_bytes": speeds.start_bytes(),
    });
    let facts = json!(told.facts);
    json["facts"] = facts;
    let mut text =
        format!("{}: {} on {threads} threads, {} of memory, {} written\n", told.command, time(seconds), size(peak), size(*output_bytes));
    for (name, value) in &told.facts {
        let shown = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let _ = writeln!(text, "  {name}: {shown}");
    }
    let _ = writeln!(text, "  {:22} {:>12} {:>12}", "stage", "time", "memory");
    for s in stages {
        let bytes = size(s.memory(speeds));
        let _ = writeln!(text, "  {:22} {:>12} {bytes:>12}", s.name, time(s.seconds(speeds, threads)));
    }
    for a in assumptions {
        let _ = writeln!(text, "  assumed: {a}");
    }
    if let Some(free) = disk.filter(|free| output_bytes > &(*free as f64)) {
        let _ = writeln!(text, "  the disk has only {} left", size(free as f64));
    }
    if let Some((cluster, s)) = shared {
        describe((cluster, s), &mut text, &mut json);
    }
    let _ = writeln!(text, "nothing was written. Files are taken to be read from memory; a slow disk adds its own time");
    Outcome::new(json, text)
}

fn describe((cluster, s): (&Cluster, &Shared), text: &mut String, json: &mut Value) {
    let list: Vec<Value> = s
        .spans
        .iter()
        .map(|p| json!({ "stage": p.name, "seconds": p.computing, "network_s": p.network, "storage_s": p.storage, "bytes": p.bytes }))
        .collect();
    json["cluster"] = json!({
        "nodes": cluster.nodes, "ranks_per_node": cluster.ranks_per_node, "threads": cluster.threads, "node_memory_bytes": cluster.node_bytes,
        "network_bytes_s": cluster.network, "storage_bytes_s": cluster.storage, "seconds": s.seconds, "rank_bytes": s.rank_bytes,
        "node_bytes": s.node_bytes, "limit": s.limit.name(), "limit_part": s.part, "stages": list,
    });
    let (nodes, ranks, threads) = (cluster.nodes, cluster.ranks(), cluster.threads);
    let _ = writeln!(
        text,
        "on {nodes} machines ({ranks} processes of {threads} threads): {}, {} of memory a machine",
        time(s.seconds),
        size(s.node_bytes)
    );
    let _ = writeln!(text, "  {:22} {:>12} {:>12} {:>12} {:>12}", "stage", "time", "network", "storage", "a process");
    for p in &s.spans {
        let _ = writeln!(
            text,
            "  {:22} {:>12} {:>12} {:>12} {:>12}",
            p.name,
            time(p.computing),
            time(p.network),
            time(p.storage),
            size(p.bytes)
        );
    }
    let share = format!("{:.0} % of the time", 100.0 * s.part);
    let breaks = match s.limit {
        crate::cost::Limit::Memory => {
            format!(
                "the memory: a machine needs {} and has {}. Fewer processes on each machine, a smaller image or several facets",
                size(s.node_bytes),
                size(cluster.node_bytes)
            )
        }
        crate::cost::Limit::Network => format!("the network: sums of images take {share}"),
        crate::cost::Limit::Storage => format!("the file system: it takes {share}"),
        crate::cost::Limit::Planes => {
            format!(
                "the planes of the grid: they do not fit into the memory of a process, which makes them again for every block of rows ({share}). More memory a process, or a smaller field; where they are in double precision, the default under mpirun, --epsilon 1e-5 halves them"
            )
        }
        crate::cost::Limit::WholeImages => {
            format!("the images, of which every process has its own: they take {share}, and more machines do not help")
        }
        crate::cost::Limit::Visibilities => format!("nothing yet: the visibilities take {share}, and more machines help"),
    };
    let _ = writeln!(text, "  what breaks first: {breaks}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_told_in_units_that_people_read() {
        assert_eq!([12.0, 3.4e9, 5e13].map(size), ["12.000 B", "3.400 GB", "50.000 TB"]);
        assert_eq!([0.25, 600.0, 36_000.0, 864_000.0].map(time), ["0.250 s", "10.0 min", "10.0 h", "10.0 d"]);
    }
}

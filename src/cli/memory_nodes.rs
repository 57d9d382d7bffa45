//! Memory on machines with several NUMA nodes, such as those with two sockets.
//!
//! Linux takes a page from the node of the processor that touches it first. The program keeps the memory that it frees and gives it to the next array, so
//! the first touch says little about which processors use a page later. At worst an array lies on one node, and all threads wait for the memory of that
//! one. So the program asks for pages of all nodes in turn, as `numactl --interleave` does.

use std::collections::BTreeSet;
use std::path::Path;

/// Take new pages from all NUMA nodes in turn that the process may use.
///
/// Nothing changes where the processors of the process belong to one node, and where the process was started with a policy of its own, as by `numactl`.
/// A system that refuses is left as it is. Only the calling thread and those that it starts afterwards follow.
pub fn spread_memory() {
    #[cfg(target_os = "linux")]
    if let Some(nodes) = nodes(Path::new("/sys/devices/system/node"), Path::new("/proc/self/status"))
        && policy() == Some(libc::MPOL_DEFAULT)
    {
        interleave(&nodes);
    }
}

/// The nodes to take pages from: those with memory and processors for this process. `None` for fewer than two, and where the system does not say.
#[cfg(any(target_os = "linux", test))]
fn nodes(folder: &Path, status: &Path) -> Option<BTreeSet<usize>> {
    let status = std::fs::read_to_string(status).ok()?;
    let allowed = |name: &str| list(status.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(':'))?);
    let processors = allowed("Cpus_allowed_list")?;
    let mut nodes = list(&std::fs::read_to_string(folder.join("has_memory")).ok()?)?;
    let memories = allowed("Mems_allowed_list")?;
    nodes.retain(|node| {
        let of_node = std::fs::read_to_string(folder.join(format!("node{node}/cpulist"))).ok().and_then(|text| list(&text));
        memories.contains(node) && of_node.is_some_and(|of_node| !of_node.is_disjoint(&processors))
    });
    (nodes.len() > 1).then_some(nodes)
}

/// The numbers of a list such as `0-3,8`. `None` if it is not one.
#[cfg(any(target_os = "linux", test))]
fn list(text: &str) -> Option<BTreeSet<usize>> {
    let mut numbers = BTreeSet::new();
    for part in text.trim().split(',').filter(|part| !part.is_empty()) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        numbers.extend(first.parse::<usize>().ok()?..=last.parse().ok()?);
    }
    Some(numbers)
}

/// The policy of the calling thread. `None` where the system does not tell.
#[cfg(target_os = "linux")]
fn policy() -> Option<i32> {
    let mut policy = 0;
    let none = std::ptr::null_mut::<libc::c_ulong>();
    // SAFETY: the system writes one integer through the first pointer, and nothing through the null pointers.
    let failed = unsafe { libc::syscall(libc::SYS_get_mempolicy, &raw mut policy, none, 0, none, 0) };
    (failed == 0).then_some(policy)
}

/// Take pages of these nodes in turn. Returns whether the system does.
#[cfg(target_os = "linux")]
fn interleave(nodes: &BTreeSet<usize>) -> bool {
    const BITS: usize = libc::c_ulong::BITS as usize;
    // As many nodes as Linux can be built for.
    const NODES: usize = 1024;
    let mut mask: [libc::c_ulong; NODES / BITS] = [0; NODES / BITS];
    for node in nodes.iter().filter(|&&node| node < NODES) {
        mask[node / BITS] |= 1 << (node % BITS);
    }
    // Linux reads one bit less than it is told.
    let bits = NODES + 1;
    // SAFETY: the system reads the mask, whose length in bits it is told, and writes nothing.
    unsafe { libc::syscall(libc::SYS_set_mempolicy, libc::MPOL_INTERLEAVE, mask.as_ptr(), bits) == 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine with two sockets of four processors, a third node with memory alone, and a process on these processors and nodes.
    fn machine(processors: &str, memories: &str) -> Option<BTreeSet<usize>> {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: String| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        for (name, text) in [("has_memory", "0-2"), ("node0/cpulist", "0-1,4-5"), ("node1/cpulist", "2-3,6-7"), ("node2/cpulist", "")] {
            write(name, format!("{text}\n"));
        }
        write("status", format!("Name:\tcittert\nCpus_allowed:\tff\nCpus_allowed_list:\t{processors}\nMems_allowed_list:\t{memories}\n"));
        nodes(folder.path(), &folder.path().join("status"))
    }

    #[test]
    fn memory_is_spread_over_the_nodes_of_the_process() {
        assert_eq!(machine("0-7", "0-2"), Some(BTreeSet::from([0, 1])));
        assert_eq!(machine("1,6", "0-1"), Some(BTreeSet::from([0, 1])));
        // A process that is bound to one socket, to the memory of one node, or on a system that says nothing.
        assert_eq!(machine("0-1,4", "0-2"), None);
        assert_eq!(machine("0-7", "1"), None);
        assert_eq!(machine("none", "0-2"), None);
        assert_eq!(nodes(Path::new("/does/not/exist"), Path::new("/does/not/exist")), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn the_system_takes_the_policy() {
        // A thread of its own: the policy of the other tests stays as it is.
        let (before, taken, after) = std::thread::spawn(|| (policy(), interleave(&BTreeSet::from([0])), policy())).join().unwrap();
        // A container may refuse both.
        assert_eq!(after, if taken { Some(libc::MPOL_INTERLEAVE) } else { before });
        // A node that no machine has: refused, and nothing is changed.
        assert!(!std::thread::spawn(|| interleave(&BTreeSet::from([900]))).join().unwrap());
    }
}

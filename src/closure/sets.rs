//! The triangles and quadrangles of antennas on which closure quantities are formed.
//!
//! A minimal set holds exactly as many independent quantities as the baselines allow: E - (N - 1) closure phases and
//! E - N closure amplitudes for E connected baselines of N antennas, that is (N - 1)(N - 2)/2 and N(N - 3)/2 when none is
//! missing. It grows baseline by baseline: each new triangle adds one baseline to others that belong to the set already, so
//! no quantity is a combination of earlier ones.
//!
//! # Reference
//! Thompson, Moran & Swenson 2017, section 10.3; Blackburn et al. 2020, ApJ 894, 31.

/// Which of the possible triangles or quadrangles are formed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum ClosureSet {
    /// Independent ones only.
    Minimal,
    /// Every triangle; every quadrangle in its three pairings (of which two are independent).
    All,
}

/// Baselines that have data, for the antennas 0..n.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Links {
    n: usize,
    linked: Vec<bool>,
}

impl Links {
    pub(crate) fn new(n: usize) -> Self {
        Self { n, linked: vec![false; n * n] }
    }

    pub(crate) fn set(&mut self, p: usize, q: usize) {
        self.linked[p * self.n + q] = true;
        self.linked[q * self.n + p] = true;
    }

    pub(crate) fn has(&self, p: usize, q: usize) -> bool {
        self.linked[p * self.n + q]
    }
}

/// Triangles (a, b, c), a < b < c, for the closure phase arg(V_ab V_bc V_ca). `preferred` lists the antennas, the one to
/// build on first.
pub(crate) fn triangles(links: &Links, set: ClosureSet, preferred: &[usize]) -> Vec<[usize; 3]> {
    if set == ClosureSet::Minimal {
        return minimal_triangles(links, preferred);
    }
    let mut out = Vec::new();
    for a in 0..links.n {
        for b in (a + 1..links.n).filter(|b| links.has(a, *b)) {
            for c in (b + 1..links.n).filter(|c| links.has(a, *c) && links.has(b, *c)) {
                out.push([a, b, c]);
            }
        }
    }
    out
}

fn minimal_triangles(links: &Links, preferred: &[usize]) -> Vec<[usize; 3]> {
    let done = spanning_forest(links, preferred);
    let open = remaining(links, &done);
    close_over(done, open, |done, p, q| {
        let mut t = [p, q, preferred.iter().copied().find(|r| done.has(*r, p) && done.has(*r, q))?];
        t.sort_unstable();
        Some(t)
    })
}

/// The quantities that close the open baselines one by one. Each uses only baselines that are closed already, and `find` finds it.
fn close_over<const K: usize>(
    mut done: Links,
    mut open: Vec<(usize, usize)>,
    find: impl Fn(&Links, usize, usize) -> Option<[usize; K]>,
) -> Vec<[usize; K]> {
    let mut out = Vec::new();
    loop {
        let before = out.len();
        open.retain(|&(p, q)| {
            let Some(found) = find(&done, p, q) else { return true };
            out.push(found);
            done.set(p, q);
            false
        });
        if open.is_empty() {
            break;
        }
        if out.len() == before {
            // No combination reaches these baselines yet. One of them is counted as closed, and the search continues from it.
            let (p, q) = open.remove(0);
            done.set(p, q);
        }
    }
    out.sort_unstable();
    out
}

/// Quadrangles (a, b, c, d) for the closure amplitude |V_ab| |V_cd| / (|V_ac| |V_bd|).
pub(crate) fn quadrangles(links: &Links, set: ClosureSet, preferred: &[usize]) -> Vec<[usize; 4]> {
    let complete = |[a, b, c, d]: &[usize; 4]| links.has(*a, *b) && links.has(*c, *d) && links.has(*a, *c) && links.has(*b, *d);
    if set == ClosureSet::All {
        let mut out = Vec::new();
        for i in 0..links.n {
            for j in i + 1..links.n {
                for k in j + 1..links.n {
                    for l in k + 1..links.n {
                        // The three ratios of the pairings ij|kl, ik|jl, il|jk.
                        out.extend([[i, j, k, l], [i, k, l, j], [i, l, j, k]].into_iter().filter(complete));
                    }
                }
            }
        }
        return out;
    }
    let mut done = spanning_forest(links, preferred);
    let mut open = remaining(links, &done);
    // With one odd loop the tree determines single amplitudes, and not only their ratios.
    if let Some(i) = open.iter().position(|(p, q)| preferred.iter().any(|r| done.has(*r, *p) && done.has(*r, *q))) {
        let (p, q) = open.remove(i);
        done.set(p, q);
    }
    close_over(done, open, |done, p, q| {
        let other = |r: usize| {
            let found = preferred.iter().copied().find(|s| *s != r && *s != p && *s != q && done.has(q, *s) && done.has(r, *s));
            found.map(|s| [p, q, r, s])
        };
        preferred.iter().copied().filter(|r| *r != q && done.has(p, *r)).find_map(other)
    })
}

/// A spanning tree of each connected group. As far as possible it consists of stars around the preferred antennas.
fn spanning_forest(links: &Links, preferred: &[usize]) -> Links {
    let mut tree = Links::new(links.n);
    let mut seen = vec![false; links.n];
    for &root in preferred {
        if seen[root] {
            continue;
        }
        seen[root] = true;
        let mut queue = std::collections::VecDeque::from([root]);
        while let Some(p) = queue.pop_front() {
            for &q in preferred {
                if !seen[q] && links.has(p, q) {
                    seen[q] = true;
                    tree.set(p, q);
                    queue.push_back(q);
                }
            }
        }
    }
    tree
}

fn remaining(links: &Links, done: &Links) -> Vec<(usize, usize)> {
    super::baselines::pairs_of(links.n).filter(|(p, q)| links.has(*p, *q) && !done.has(*p, *q)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::baselines::{n_pairs, pair_index, pairs_of};
    use super::*;
    use crate::linalg::{Matrix, numerical_rank, singular_values};

    fn complete(n: usize) -> Links {
        let mut l = Links::new(n);
        pairs_of(n).for_each(|(p, q)| l.set(p, q));
        l
    }

    fn rank(n: usize, rows: &[Vec<((usize, usize), f64)>]) -> usize {
        let mut m = Matrix::zeros(rows.len().max(1), n_pairs(n));
        for (i, row) in rows.iter().enumerate() {
            for ((p, q), s) in row {
                m[(i, pair_index(n, (*p).min(*q), (*p).max(*q)))] += s;
            }
        }
        numerical_rank(&singular_values(m).0, rows.len())
    }

    fn triangle_rank(n: usize, t: &[[usize; 3]]) -> usize {
        rank(n, &t.iter().map(|[a, b, c]| vec![((*a, *b), 1.0), ((*b, *c), 1.0), ((*a, *c), -1.0)]).collect::<Vec<_>>())
    }

    fn quadrangle_rank(n: usize, t: &[[usize; 4]]) -> usize {
        let row = |[a, b, c, d]: &[usize; 4]| vec![((*a, *b), 1.0), ((*c, *d), 1.0), ((*a, *c), -1.0), ((*b, *d), -1.0)];
        rank(n, &t.iter().map(row).collect::<Vec<_>>())
    }

    #[test]
    fn minimal_sets_are_independent_and_span_all_closures() {
        for n in [3, 4, 5, 7, 9] {
            let (links, order) = (complete(n), (0..n).rev().collect::<Vec<_>>());
            let t = triangles(&links, ClosureSet::Minimal, &order);
            assert_eq!(t.len(), (n - 1) * (n - 2) / 2);
            assert_eq!(triangle_rank(n, &t), t.len());
            assert_eq!(triangle_rank(n, &triangles(&links, ClosureSet::All, &order)), t.len());
            let q = quadrangles(&links, ClosureSet::Minimal, &order);
            assert_eq!(q.len(), n * (n - 3) / 2);
            assert_eq!(quadrangle_rank(n, &q), q.len());
            assert_eq!(quadrangle_rank(n, &quadrangles(&links, ClosureSet::All, &order)), q.len());
        }
    }

    #[test]
    fn missing_baselines_leave_independent_sets_of_full_rank() {
        let n = 8;
        for skip in [3, 4, 5] {
            let mut links = Links::new(n);
            pairs_of(n).filter(|(p, q)| (p * 5 + q * 3) % skip != 0).for_each(|(p, q)| links.set(p, q));
            let order: Vec<usize> = (0..n).collect();
            let t = triangles(&links, ClosureSet::Minimal, &order);
            assert_eq!(triangle_rank(n, &t), t.len());
            assert_eq!(triangle_rank(n, &triangles(&links, ClosureSet::All, &order)), t.len(), "skip {skip}");
            let q = quadrangles(&links, ClosureSet::Minimal, &order);
            assert_eq!(quadrangle_rank(n, &q), q.len());
            assert_eq!(quadrangle_rank(n, &quadrangles(&links, ClosureSet::All, &order)), q.len(), "skip {skip}");
        }
    }
}

//! Attempts as lines of text, for a file from which an interrupted search continues.
//!
//! Numbers are the shortest decimals that read back to the same bits, so a search that continues has the same result as one that was not interrupted.

use super::search::Found;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The line of an attempt: its number, its score, and the positions.
#[must_use]
pub fn line(found: &Found) -> String {
    let mut out = format!("{} {:?}", found.attempt, found.score);
    for [x, y] in &found.xy {
        // Writing to a String cannot fail.
        let _ = write!(out, " {x:?} {y:?}");
    }
    out.push('\n');
    out
}

fn parsed(line: &str, elements: usize) -> Option<Found> {
    let mut words = line.strip_suffix('\n')?.split(' ');
    let attempt = words.next()?.parse().ok()?;
    let score = words.next()?.parse().ok()?;
    let numbers: Vec<f64> = words.map(|w| w.parse().ok()).collect::<Option<_>>()?;
    let (xy, rest) = numbers.as_chunks::<2>();
    (xy.len() == elements && rest.is_empty()).then(|| Found { attempt, xy: xy.to_vec(), score })
}

/// The attempts of all whole lines for so many elements, and the number of other lines. The last line of a killed process may be cut off.
#[must_use]
pub fn attempts(text: &str, elements: usize) -> (BTreeMap<u64, Found>, usize) {
    let (mut done, mut damaged) = (BTreeMap::new(), 0);
    for line in text.split_inclusive('\n') {
        match parsed(line, elements) {
            Some(found) => drop(done.insert(found.attempt, found)),
            None => damaged += 1,
        }
    }
    (done, damaged)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_read_back_to_the_same_bits_and_a_cut_line_is_left_out() {
        let found =
            |attempt: u64| Found { attempt, xy: vec![[0.1 + 0.2, -1e-17], [1.0 / 3.0, 0.5]], score: 0.1_f64.powi(3) + attempt as f64 };
        let text = line(&found(3)) + &line(&found(0));
        assert_eq!(attempts(&text, 2), (BTreeMap::from([(0, found(0)), (3, found(3))]), 0));
        let (done, damaged) = attempts(&text[..text.len() - 2], 2);
        assert_eq!((done.len(), damaged), (1, 1));
        assert_eq!(attempts(&text, 3), (BTreeMap::new(), 2));
    }
}

//! Every refusal tells the file, the place in it, what was expected and what was found: damaged files of every kind are refused, and
//! the words of each refusal are looked at.

use crate::harness::{Numbers, Scratch, corpus_files, executions, mutate};
use cittert_formats::{Contents, open_visibilities};
use std::collections::BTreeSet;
use std::path::Path;

/// Damaged copies of each file of the corpus, usually and at most.
const COPIES: (usize, usize) = (30, 3000);
const KINDS: [&str; 6] = ["uvfits", "fits", "uvh5", "calh5", "layouts", "sources"];

/// An error with its causes, as the command line tells it.
fn told(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(c) = cause {
        if !text.contains(&c.to_string()) {
            text = format!("{text}: {c}");
        }
        cause = c.source();
    }
    text
}

/// What is wrong with the words of a refusal of the file `name`.
fn lacks(text: &str, name: &str) -> Option<&'static str> {
    let Some((_, rest)) = text.split_once(name) else { return Some("the file") };
    let rest = rest.trim_start_matches(':').trim();
    if rest.is_empty() {
        return Some("everything but the file");
    }
    // What the system refuses it says in its own words.
    if rest.contains("os error") {
        return None;
    }
    if !["expected", "exceeds", "at most", "only"].iter().any(|w| rest.contains(w)) {
        return Some("what was expected");
    }
    if !["found", " is ", " it is", " has shape", " are ", " found "].iter().any(|w| rest.contains(w)) {
        return Some("what was found");
    }
    None
}

fn refusal(path: &Path) -> Option<String> {
    match Contents::of(path) {
        Err(e) => Some(told(&e)),
        Ok(Contents::Visibilities { .. }) => match open_visibilities(path) {
            Err(e) => Some(told(&e)),
            Ok(mut source) => {
                let n = source.n_rows();
                source.read_rows(0..n.min(8)).err().map(|e| told(&e))
            }
        },
        Ok(_) => None,
    }
}

#[test]
fn every_refusal_names_the_file_the_place_and_both_sides() {
    let mut numbers = Numbers::new(0xbad);
    let (mut refused, mut wrong) = (0, BTreeSet::new());
    for kind in KINDS {
        for (name, content) in corpus_files(kind) {
            let scratch = Scratch::new(&name);
            for _ in 0..executions(COPIES.0).min(COPIES.1) {
                let mut damaged = content.clone();
                mutate(&mut damaged, 6000, &mut numbers);
                if let Some(text) = refusal(scratch.file(&damaged)) {
                    refused += 1;
                    if let Some(what) = lacks(&text, &name) {
                        wrong.insert(format!("without {what}: {text}"));
                    }
                }
            }
        }
    }
    assert!(refused > 300, "{refused} refusals");
    assert!(wrong.is_empty(), "{} of {refused} refusals:\n{}", wrong.len(), wrong.into_iter().take(60).collect::<Vec<_>>().join("\n"));
}

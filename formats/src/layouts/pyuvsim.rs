//! Layout tables of pyuvsim: a head line `Name Number BeamID E N U`, then a line for each antenna, metres.
//!
//! pyuvsim keeps the site in another file. cittert writes the site as comments, which pyuvsim ignores.

use super::error::{LayoutError, ReadContext, Result};
use super::text::{self, Keeps, Line};
use crate::format::{Label, LayoutFormat};
use cittert_arrays::{Antenna, ArrayLayout};
use std::fmt::Write;

pub(crate) struct PyuvsimCsv;

impl LayoutFormat for PyuvsimCsv {
    fn label(&self) -> Label {
        Label { name: "pyuvsim", extensions: &["csv"], description: "pyuvsim layout table: names, numbers, east, north, up" }
    }

    fn sniff(&self, text: &str, _: &str) -> bool {
        text::lines(text).next().is_some_and(|l| column(&l, "name").is_some() && column(&l, "e").is_some())
    }

    fn read(&self, text: &str, context: &ReadContext) -> Result<ArrayLayout> {
        let mut lines = text::lines(text);
        let Some(head) = lines.next() else {
            return Err(LayoutError::Missing("there is no head line: Name Number BeamID E N U".into()));
        };
        let find = |name: &str| column(&head, name).ok_or_else(|| head.expected("a head line Name Number BeamID E N U"));
        let (name, e, n, u) = (find("name")?, find("e")?, find("n")?, find("u")?);
        let number = column(&head, "number");
        let mut antennas = Vec::new();
        for l in lines {
            if l.fields.len() != head.fields.len() {
                return Err(l.expected(&format!("{} fields as in the head line", head.fields.len())));
            }
            let position_m = [l.number(e, "east")?, l.number(n, "north")?, l.number(u, "up")?];
            let number = match number {
                Some(i) => l.fields[i].parse::<u32>().map_err(|_| l.expected("an antenna number from 0 on in the column Number"))?,
                None => antennas.len() as u32,
            };
            antennas.push(Antenna::new(l.fields[name], number, position_m));
        }
        text::local_layout(text, context, antennas)
    }

    fn write(&self, layout: &ArrayLayout) -> Result<String> {
        let mut t = String::from("Name\tNumber\tBeamID\tE\tN\tU\n");
        t.push_str(&text::local_header(layout));
        for a in layout.antennas() {
            let [e, n, u] = a.position_m;
            // Writing to a String cannot fail.
            let _ = writeln!(t, "{}\t{}\t0\t{e:?}\t{n:?}\t{u:?}", text::one_field(&a.name), a.number);
        }
        Ok(t)
    }

    fn loses(&self, layout: &ArrayLayout) -> Vec<String> {
        text::lost(layout, Keeps { names: true, numbers: true, exact_site: true, ..Keeps::default() })
    }
}

fn column(head: &Line<'_>, name: &str) -> Option<usize> {
    head.fields.iter().position(|f| f.eq_ignore_ascii_case(name))
}

//! One self-contained HTML page about a run: pictures, tables, the exact commands.

use base64::Engine;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// A picture with what it shows.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Encoded PNG.
    pub png: Vec<u8>,
    /// One sentence beneath it.
    pub caption: String,
}

/// A table of names and values.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Column titles.
    pub head: Vec<String>,
    /// Rows of cells.
    pub rows: Vec<Vec<String>>,
}

/// One step of the run.
#[derive(Debug, Clone, Default)]
pub struct Section {
    /// Title, such as "Dirty image".
    pub title: String,
    /// A short explanation for the reader, one or two sentences.
    pub text: String,
    /// Commands as a person would type them.
    pub commands: Vec<String>,
    /// Pictures, side by side.
    pub figures: Vec<Figure>,
    /// Numbers.
    pub table: Table,
    /// Notes and warnings.
    pub messages: Vec<String>,
}

/// Everything on the page.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Title of the run.
    pub title: String,
    /// Facts of the run: version, seed, date, input names.
    pub facts: Vec<(String, String)>,
    /// What was found, one sentence each, above the pictures.
    pub answers: Vec<String>,
    /// The pictures to see first.
    pub highlights: Vec<Figure>,
    /// The steps.
    pub sections: Vec<Section>,
}

const STYLE: &str = "
:root { color-scheme: light dark; --fg: #1b1f24; --dim: #59636e; --bg: #ffffff; --card: #f6f8fa; --line: #d1d9e0; }
@media (prefers-color-scheme: dark) { :root { --fg: #e6edf3; --dim: #9198a1; --bg: #0d1117; --card: #151b23; --line: #3d444d; } }
* { box-sizing: border-box; }
body { margin: 0 auto; max-width: 1180px; padding: 2rem 1.25rem 4rem; font: 15px/1.55 system-ui, sans-serif; color: var(--fg); background: var(--bg); }
h1 { font-size: 1.9rem; margin: 0 0 .5rem; } h2 { font-size: 1.25rem; margin: 2.6rem 0 .6rem; border-bottom: 1px solid var(--line); padding-bottom: .3rem; }
.answer { font-size: 1.12rem; margin: 0 0 1rem; }
.facts { color: var(--dim); margin: 0 0 1.5rem; } .facts span { margin-right: 1.4rem; overflow-wrap: anywhere; }
.figures { display: grid; grid-template-columns: repeat(auto-fill, minmax(340px, 1fr)); gap: 1rem; align-items: start; }
figure { margin: 0; background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: .6rem; }
figure img { width: 100%; height: auto; display: block; border-radius: 4px; background: #fff; } figcaption { color: var(--dim); font-size: .88rem; padding: .5rem .2rem 0; }
pre { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: .7rem .9rem; overflow-x: auto; font-size: .85rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; margin: .8rem 0; } th, td { text-align: left; padding: .25rem 1.4rem .25rem 0; border-bottom: 1px solid var(--line); }
th { color: var(--dim); font-weight: 600; } nav a { margin-right: 1rem; } a { color: inherit; } .warn { color: #9a6700; } ul { padding-left: 1.2rem; }
";

fn figure(f: &Figure) -> Markup {
    let data = base64::engine::general_purpose::STANDARD.encode(&f.png);
    html! { figure { img src=(format!("data:image/png;base64,{data}")) alt=(f.caption); figcaption { (f.caption) } } }
}

fn anchor(title: &str) -> String {
    title.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}

fn section(s: &Section) -> Markup {
    html! {
        section id=(anchor(&s.title)) {
            h2 { (s.title) }
            @if !s.text.is_empty() { p { (s.text) } }
            @if !s.figures.is_empty() { div.figures { @for f in &s.figures { (figure(f)) } } }
            @if !s.table.rows.is_empty() {
                table {
                    @if !s.table.head.is_empty() { thead { tr { @for h in &s.table.head { th { (h) } } } } }
                    tbody { @for row in &s.table.rows { tr { @for cell in row { td { (cell) } } } } }
                }
            }
            @if !s.messages.is_empty() { ul.warn { @for m in &s.messages { li { (m) } } } }
            @if !s.commands.is_empty() { pre { (s.commands.join("\n")) } }
        }
    }
}

/// The page as HTML; pictures are embedded, nothing is loaded from elsewhere.
#[must_use]
pub fn page(r: &Report) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (r.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (r.title) }
                p.facts { @for (name, value) in &r.facts { span { (name) ": " (value) } } }
                @for answer in &r.answers { p.answer { (answer) } }
                @if !r.highlights.is_empty() { div.figures { @for f in &r.highlights { (figure(f)) } } }
                nav { p { @for s in &r.sections { a href=(format!("#{}", anchor(&s.title))) { (s.title) } } } }
                @for s in &r.sections { (section(s)) }
            }
        }
    }
    .into_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_holds_its_pictures_and_escapes_its_texts() {
        let report = Report {
            title: "a < b".into(),
            sections: vec![Section {
                title: "Dirty image".into(),
                commands: vec!["cittert dirty x.uvh5 -o 'a b.fits'".into()],
                figures: vec![Figure { png: vec![1, 2, 3], caption: "c".into() }],
                ..Section::default()
            }],
            ..Report::default()
        };
        let page = page(&report);
        assert!(page.contains("a &lt; b") && page.contains("data:image/png;base64,AQID") && page.contains("#dirty-image"));
        assert!(!page.contains("http://") && !page.contains("https://"));
    }
}

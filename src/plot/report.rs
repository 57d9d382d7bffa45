//! One self-contained HTML page about a run: a verdict, pictures, findings, then tables and the exact commands.

use super::thumbnail::thumbnail;
use base64::Engine;
use maud::{DOCTYPE, Markup, PreEscaped, html};

/// A picture with what it shows.
#[derive(Debug, Clone, Default)]
pub struct Figure {
    /// Encoded PNG. The page holds a smaller copy of it.
    pub png: Vec<u8>,
    /// One sentence beneath it.
    pub caption: String,
    /// Name of the file beside the page that holds the picture in full size; empty for none.
    pub file: String,
}

/// A table of names and values.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Column titles.
    pub head: Vec<String>,
    /// Rows of cells.
    pub rows: Vec<Vec<String>>,
}

/// Something that a step noticed, and what to do about it.
#[derive(Debug, Clone, Default)]
pub struct Finding {
    /// The step that noticed it.
    pub step: String,
    /// What it is.
    pub says: String,
    /// What to do next; empty for nothing.
    pub next: String,
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
    /// More tables, each with its title.
    pub tables: Vec<(String, Table)>,
    /// Notes and warnings.
    pub messages: Vec<String>,
}

/// Everything on the page.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Title of the run.
    pub title: String,
    /// What was done and how good it is, in two to five sentences.
    pub verdict: Vec<String>,
    /// The pictures to see first.
    pub highlights: Vec<Figure>,
    /// What needs attention, the most important first.
    pub findings: Vec<Finding>,
    /// Warnings of all steps.
    pub warnings: Vec<String>,
    /// The steps.
    pub sections: Vec<Section>,
    /// Facts of the run: version, seed, date, input names. They stand at the end.
    pub facts: Vec<(String, String)>,
}

/// Width of the copies of pictures in the page, pixels. The text of a picture can be read at this width.
const EMBEDDED_WIDTH: u32 = 640;

const STYLE: &str = include_str!("report.css");
/// Shows a picture in full size when it is clicked: the file beside the page, or the copy in the page where the file is missing.
const SCRIPT: &str = include_str!("report.js");

fn figure(f: &Figure) -> Markup {
    // A picture that cannot be made smaller is shown as it is.
    let small = thumbnail(&f.png, EMBEDDED_WIDTH).unwrap_or_else(|_| f.png.clone());
    let data = base64::engine::general_purpose::STANDARD.encode(&small);
    let image = html! { img src=(format!("data:image/png;base64,{data}")) alt=(f.caption); };
    html! {
        figure {
            @if f.file.is_empty() { (image) } @else { a href=(f.file) title="Show in full size" { (image) } }
            figcaption { (f.caption) }
        }
    }
}

fn anchor(title: &str) -> String {
    title.chars().map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect()
}

fn table(t: &Table) -> Markup {
    html! {
        @if !t.rows.is_empty() {
            div.scroll { table {
                @if !t.head.is_empty() { thead { tr { @for h in &t.head { th { (h) } } } } }
                tbody { @for row in &t.rows { tr { @for cell in row { td { (cell) } } } } }
            } }
        }
    }
}

fn section(s: &Section) -> Markup {
    html! {
        section id=(anchor(&s.title)) {
            h2 { (s.title) }
            @if !s.text.is_empty() { p { (s.text) } }
            @if !s.figures.is_empty() { div.figures { @for f in &s.figures { (figure(f)) } } }
            (table(&s.table))
            @for (title, t) in &s.tables {
                @if !title.is_empty() { h3 { (title) } }
                (table(t))
            }
            @if !s.messages.is_empty() { ul.warn { @for m in &s.messages { li { (m) } } } }
            @if !s.commands.is_empty() {
                details {
                    summary { (if s.commands.len() == 1 { "The command" } else { "The commands" }) }
                    pre { (s.commands.join("\n")) }
                }
            }
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
                @if !r.verdict.is_empty() { div.verdict { @for sentence in &r.verdict { p { (sentence) } } } }
                @if !r.highlights.is_empty() { div.figures.first { @for f in &r.highlights { (figure(f)) } } }
                @if !r.findings.is_empty() {
                    h2 id="findings" { "Findings" }
                    @for f in &r.findings {
                        div.finding {
                            p { strong { (f.says) } @if !f.step.is_empty() { span.dim { " (" (f.step) ")" } } }
                            @if !f.next.is_empty() { p { "What to do: " (f.next) } }
                        }
                    }
                }
                @if !r.warnings.is_empty() {
                    h2 id="warnings" { "Warnings" }
                    ul.warn { @for w in &r.warnings { li { (w) } } }
                }
                nav { p { @for s in &r.sections { a href=(format!("#{}", anchor(&s.title))) { (s.title) } } } }
                @for s in &r.sections { (section(s)) }
                @if !r.facts.is_empty() {
                    h2 { "How this page was made" }
                    div.scroll { table { tbody { @for (name, value) in &r.facts { tr { th { (name) } td { (value) } } } } } }
                }
                dialog id="zoom" { img alt=""; p {} }
                script { (PreEscaped(SCRIPT)) }
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
            verdict: vec!["It is good.".into()],
            findings: vec![Finding { step: "clean".into(), says: "x > y".into(), next: "look".into() }],
            sections: vec![Section {
                title: "Dirty image".into(),
                commands: vec!["cittert dirty x.uvh5 -o 'a b.fits'".into()],
                figures: vec![Figure { png: vec![1, 2, 3], caption: "c".into(), file: "c.png".into() }],
                tables: vec![("Numbers".into(), Table { head: Vec::new(), rows: vec![vec!["a".into(), "1".into()]] })],
                ..Section::default()
            }],
            ..Report::default()
        };
        let page = page(&report);
        assert!(page.contains("a &lt; b") && page.contains("data:image/png;base64,AQID") && page.contains("#dirty-image"));
        assert!(page.contains("x &gt; y") && page.contains("href=\"c.png\"") && page.contains("<h3>Numbers</h3>"));
        let place = |text: &str| page.find(text).unwrap();
        assert!(place("It is good.") < place("What to do: look") && place("What to do: look") < place("<details>"));
        assert!(!page.contains("http://") && !page.contains("https://"));
    }
}

//! The page: figures and tables in one file that needs nothing else.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result};

use crate::figures::{Figure, grouped};

const STYLE: &str = include_str!("page.css");

/// A page as it grows.
pub struct Page<'a> {
    out: &'a Path,
    body: String,
    figures: usize,
}

impl<'a> Page<'a> {
    pub fn new(out: &'a Path) -> Result<Self> {
        std::fs::create_dir_all(out.join("figures"))?;
        Ok(Page { out, body: String::new(), figures: 0 })
    }

    /// Raw HTML.
    pub fn text(&mut self, html: &str) {
        self.body.push_str(html);
        self.body.push('\n');
    }

    pub fn paragraph(&mut self, words: &str) {
        self.text(&format!("<p>{}</p>", escaped(words)));
    }

    pub fn section(&mut self, title: &str, about: &str) {
        let about = escaped(&sentence(about));
        self.text(&format!("<h2>{}</h2>\n<p>{about}</p>", escaped(title)));
    }

    /// Begins figures side by side, as the style's class of this name says.
    pub fn open_gallery(&mut self, class: &str) {
        self.text(&format!("<div class=\"{class}\">"));
    }

    pub fn close_gallery(&mut self) {
        self.text("</div>");
    }

    /// Adds a figure and writes its files.
    pub fn figure(&mut self, figure: Figure) -> Result<()> {
        figure.write(&self.out.join("figures"))?;
        self.figures += 1;
        let (number, caption) = (self.figures, escaped(&figure.caption));
        let svg = scalable(&figure.svg);
        self.text(&format!(
            "<figure id=\"{}\"><div class=\"wide\">{svg}</div><figcaption><b>Figure {number}.</b> {caption} \
             <a href=\"figures/{0}.csv\">numbers</a>, <a href=\"figures/{0}.svg\">picture</a></figcaption></figure>",
            figure.name
        ));
        Ok(())
    }

    /// A table, of which the first line has the names; open by a click.
    pub fn table(&mut self, title: &str, lines: &[Vec<String>]) {
        let cells = |line: &[String], tag: &str| -> String {
            line.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(&grouped(cell)))).collect()
        };
        let Some((head, rest)) = lines.split_first() else { return };
        let mut html = format!(
            "<details open><summary>{}</summary><div class=\"wide\"><table>",
            escaped(title)
        );
        let _ = write!(html, "<thead><tr>{}</tr></thead><tbody>", cells(head, "th"));
        for line in rest {
            let _ = write!(html, "<tr>{}</tr>", cells(line, "td"));
        }
        self.text(&(html + "</tbody></table></div></details>"));
    }

    pub fn finish(self) -> Result<()> {
        let html = format!(
            "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
             content=\"width=device-width, initial-scale=1\">\n<title>raykern: speed against accuracy</title>\n\
             <style>\n{STYLE}</style>\n<main>\n<h1>raykern: speed against accuracy</h1>\n{}</main>\n</html>\n",
            self.body
        );
        let file = self.out.join("index.html");
        std::fs::write(&file, html).with_context(|| file.display().to_string())
    }
}

/// A picture that follows the width of the page.
fn scalable(svg: &str) -> String {
    let svg = svg.find("<svg").map_or(svg, |start| &svg[start..]);
    let side = |name: &str| {
        let rest = svg.split_once(&format!(" {name}=\""))?.1;
        rest.split_once('"').map(|(value, _)| value.to_owned())
    };
    match (side("width"), side("height"), svg.split_once('>')) {
        (Some(width), Some(height), Some((_, inside))) => format!(
            "<svg viewBox=\"0 0 {width} {height}\" style=\"--width: {width}px\" role=\"img\">{inside}"
        ),
        _ => svg.to_owned(),
    }
}

/// With a capital and a full stop.
pub fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}

/// As HTML shows it.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

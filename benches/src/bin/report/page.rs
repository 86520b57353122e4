//! The page: sections of figures and tables in one file that needs nothing else.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::{Context, Result};
use raykern_harness::stress;

use crate::figures::{Figure, blog, cost, failures, growth, tradeoff};
use crate::methods::{self, AGAIN, Group};
use crate::ordinary;
use crate::pictures;
use crate::rows::{self, Build, Fact, Judged, Run, Square};
use crate::structures;
use crate::summary::Summary;

const STYLE: &str = include_str!("page.css");

/// What the page is made from.
pub struct Numbers {
    pub facts: Vec<Fact>,
    pub builds: Vec<Build>,
    pub runs: Vec<Run>,
    pub judged: Vec<Judged>,
    pub squares: Vec<Square>,
}

impl Numbers {
    fn read(folder: &Path) -> Result<Self> {
        Ok(Numbers {
            builds: rows::read(folder)?,
            facts: rows::read(folder)?,
            runs: rows::read(folder)?,
            judged: rows::read(folder)?,
            squares: rows::read(folder)?,
        })
    }

    /// Every method over the families for which `wanted` holds.
    fn summaries(&self, wanted: impl Fn(&str) -> bool) -> Vec<Summary> {
        let methods = methods::all();
        methods.iter().map(|m| Summary::of(m, &self.runs, &self.judged, &wanted)).collect()
    }

    /// How many answers of exact methods are not what they must be.
    fn not_exact(&self) -> u64 {
        let exact: Vec<_> = methods::all()
            .into_iter()
            .filter(|m| m.group == Group::Exact)
            .map(|m| m.name)
            .collect();
        let ours = |row: &&Judged| exact.contains(&row.method.as_str());
        self.judged.iter().filter(ours).map(|row| row.not_exact + row.gave_up).sum()
    }
}

/// Writes the page, its figures and their numbers; returns how many answers of exact methods were wrong.
pub fn write(data: &Path, out: &Path) -> Result<u64> {
    let numbers = Numbers::read(data)?;
    let mut page = Page::new(out)?;
    page.text(&format!("<dl>{}</dl>", facts(&numbers.facts)));
    tradeoffs(&mut page, &numbers)?;
    needs(&mut page, &numbers)?;
    growing(&mut page, &numbers)?;
    page.section(
        "As the blog post measured",
        "ten runs of each structure, one after the other, mean and Student's interval of 95 %",
    );
    page.table("Ten runs", &blog::table(&numbers.runs));
    page.finish()?;
    Ok(numbers.not_exact())
}

fn facts(facts: &[Fact]) -> String {
    let fact = |f: &Fact| format!("<dt>{}</dt><dd>{}</dd>", escaped(&f.key), escaped(&f.value));
    facts.iter().map(fact).collect()
}

/// Speed against accuracy.
fn tradeoffs(page: &mut Page, numbers: &Numbers) -> Result<()> {
    let scenes = numbers.summaries(|family| family == ordinary::FAMILY);
    let stress = numbers.summaries(|family| stress::Family::by_name(family).is_some());
    page.section(
        "Speed against accuracy",
        "rays as a renderer has them, and rays that look for trouble",
    );
    page.figure(tradeoff::wrong(
        "scenes",
        "Ordinary rays: wrong answers over speed",
        &scenes,
        false,
    )?)?;
    page.figure(tradeoff::wrong(
        "stress",
        "All stress families: wrong answers over speed",
        &stress,
        false,
    )?)?;
    page.figure(tradeoff::t_error(
        "t-error",
        "Ordinary rays: the error of t over speed",
        &scenes,
    )?)?;
    page.figure(tradeoff::t_error(
        "t-error-stress",
        "All stress families: the error of t over speed",
        &stress,
    )?)?;
    let all: Vec<&Summary> = scenes.iter().filter(|s| s.name != AGAIN).collect();
    page.table("Ordinary rays", &tradeoff::table(&all));
    let all: Vec<&Summary> = stress.iter().filter(|s| s.name != AGAIN).collect();
    page.table("All stress families", &tradeoff::table(&all));
    page.section("Every run", "nothing is hidden by a mean");
    page.figure(tradeoff::runs("runs", "Every run over Embree's beside it", &scenes)?)?;
    page.section("Each stress family", "where methods fail");
    failure_table(page, numbers);
    page.open_gallery();
    for family in &stress::ALL {
        let summaries = numbers.summaries(|name| name == family.name);
        // Without the reference there is no speed to show.
        if summaries.iter().all(|summary| summary.speed.is_none()) {
            continue;
        }
        let mut figure =
            tradeoff::wrong(&format!("family-{}", family.name), family.name, &summaries, true)?;
        figure.caption = sentence(family.about);
        page.figure(figure)?;
    }
    page.close_gallery();
    page.section("What failures look like", "one ray a square");
    for picture in &pictures::ALL {
        if let Some(figure) = failures::picture(picture, &numbers.squares)? {
            page.figure(figure)?;
        }
    }
    Ok(())
}

/// No more than a scene needs.
fn needs(page: &mut Page, Numbers { builds, runs, .. }: &Numbers) -> Result<()> {
    page.section(
        "No more than a scene needs",
        "what each structure costs, and what the automatic choice takes",
    );
    page.table("Structures by scene", &cost::table(builds, runs));
    let methods: Vec<&str> = methods::all().iter().map(|method| method.name).collect();
    page.table(
        "Builds of all methods, the mean of the scenes",
        &cost::builds_table(builds, &methods),
    );
    page.open_gallery();
    for scene in cost::scenes(builds, structures::COSTS) {
        page.figure(cost::break_even(builds, runs, scene)?)?;
    }
    page.close_gallery();
    page.figure(cost::sizes(builds, runs)?)
}

/// How it grows.
fn growing(page: &mut Page, Numbers { builds, runs, .. }: &Numbers) -> Result<()> {
    page.section("Growth", "build, memory and rays, by triangles and by instances");
    for (family, what) in
        [(crate::growth::TRIANGLES, "triangle"), (crate::growth::INSTANCES, "instance")]
    {
        for measure in growth::MEASURES {
            page.figure(growth::chart(builds, runs, family, what, measure)?)?;
        }
    }
    Ok(())
}

/// A table of families by methods: wrong answers of so many.
fn failure_table(page: &mut Page, numbers: &Numbers) {
    let methods: Vec<_> = methods::all().into_iter().filter(|m| m.name != AGAIN).collect();
    let mut lines = vec![vec!["family".to_owned()]];
    lines[0].extend(methods.iter().map(|method| method.name.to_owned()));
    for family in &stress::ALL {
        let cell = |method: &methods::Method| {
            let summary = Summary::of(method, &[], &numbers.judged, |name| name == family.name);
            let tally = summary.tally;
            match tally.asked + tally.gave_up {
                0 => "-".to_owned(),
                _ => {
                    format!("{} of {}", tally.wrong() + tally.gave_up, tally.asked + tally.gave_up)
                }
            }
        };
        let mut line = vec![family.name.to_owned()];
        line.extend(methods.iter().map(cell));
        lines.push(line);
    }
    page.table("Wrong answers by family", &lines);
}

/// A page as it grows.
pub struct Page<'a> {
    out: &'a Path,
    body: String,
    figures: usize,
}

impl<'a> Page<'a> {
    fn new(out: &'a Path) -> Result<Self> {
        std::fs::create_dir_all(out.join("figures"))?;
        Ok(Page { out, body: String::new(), figures: 0 })
    }

    /// Raw HTML.
    pub fn text(&mut self, html: &str) {
        self.body.push_str(html);
        self.body.push('\n');
    }

    pub fn section(&mut self, title: &str, about: &str) {
        let about = escaped(&sentence(about));
        self.text(&format!("<h2>{}</h2>\n<p>{about}</p>", escaped(title)));
    }

    fn open_gallery(&mut self) {
        self.text("<div class=\"gallery\">");
    }

    fn close_gallery(&mut self) {
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
            line.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect()
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

    fn finish(self) -> Result<()> {
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
fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

//! What the page says: its sections, made from the numbers alone.

use std::path::Path;

use anyhow::{Result, ensure};
use raykern_harness::stress;

use crate::figures::{blog, cost, failures, grouped, growth, number, tradeoff};
use crate::methods::{self, AGAIN, Group};
use crate::ordinary;
use crate::page::{Page, escaped, sentence};
use crate::pictures;
use crate::rows::{self, Build, Fact, Judged, Run, Square};
use crate::structures;
use crate::summary::Summary;

const HOW: &str = "all methods answer the same rays in turns, and another one begins each round; each timed run follows an untimed \
    one of the same method; one thread on one core, and that thread's processor time. So a ratio pairs two runs that were made within \
    a second or two. Nothing is left out";

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
    ensure!(!numbers.judged.is_empty(), "{}: nothing was judged", data.display());
    let mut page = Page::new(out)?;
    verdict(&mut page, &numbers);
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

/// The report in two sentences.
fn verdict(page: &mut Page, numbers: &Numbers) {
    let scenes = numbers.summaries(|family| family == ordinary::FAMILY);
    let stress = numbers.summaries(|family| stress::Family::by_name(family).is_some());
    let say = |of: &[Summary], name: &str| {
        let summary = of.iter().find(|summary| summary.name == name)?;
        let ((speed, _), (wrong, (_, high))) = (summary.speed?, summary.wrong()?);
        let [speed, wrong, high] = [speed, wrong, high].map(|x| grouped(&number(x)));
        Some(format!(
            "{name}: {speed} of the speed of Embree 3, {wrong} wrong answers a million (at most {high})"
        ))
    };
    for (what, of) in [("Ordinary rays", &scenes), ("Stress families", &stress)] {
        let names = ["BVH", methods::REFERENCE, "Embree 3 robust"];
        let words: Vec<String> = names.iter().filter_map(|name| say(of, name)).collect();
        page.paragraph(&format!("{what}. {}.", words.join("; ")));
    }
    let exact = numbers.not_exact();
    page.paragraph(&format!("Answers of exact methods that are not exactly right: {exact}."));
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
    let all: Vec<&Summary> =
        scenes.iter().filter(|s| s.name != AGAIN && s.tally.asked > 0).collect();
    page.table("Ordinary rays", &tradeoff::table(&all));
    let all: Vec<&Summary> =
        stress.iter().filter(|s| s.name != AGAIN && s.tally.asked > 0).collect();
    page.table("All stress families", &tradeoff::table(&all));
    page.section("Every run", HOW);
    page.figure(tradeoff::runs("runs", "Every run over Embree's beside it", &scenes)?)?;
    page.figure(tradeoff::noise(&numbers.runs)?)?;
    page.section("Each stress family", "where methods fail");
    failure_table(page, numbers);
    page.open_gallery("gallery");
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
    page.open_gallery("pairs");
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
    let judged = |m: &methods::Method| {
        numbers.judged.iter().any(|row| row.method == m.name && row.asked > 0)
    };
    let shown = |m: &methods::Method| m.name != AGAIN && judged(m);
    let methods: Vec<_> = methods::all().into_iter().filter(shown).collect();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::Tally;

    fn folder(name: &str) -> std::path::PathBuf {
        let folder = std::env::temp_dir().join(format!("raykern-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    /// Two runs of two methods, and their answers; `not_exact` of ours.
    fn fill(folder: &Path, not_exact: u64) {
        let mut runs = Vec::new();
        for (method, seconds) in [("BVH", 1.0), (methods::REFERENCE, 2.0)] {
            runs.extend((0..2).map(|run| Run {
                family: ordinary::FAMILY.into(),
                scene: "ball <&>".into(),
                kind: "primary".into(),
                method: method.into(),
                run,
                rays: 10,
                seconds,
            }));
        }
        let wrong = Tally { asked: 10, not_exact, ..Tally::default() };
        let judged =
            [("BVH", wrong.clone()), (methods::REFERENCE, Tally { false_hits: 3, ..wrong })].map(
                |(method, tally)| {
                    Judged::new([ordinary::FAMILY, "ball <&>", "primary", method], &tally)
                },
            );
        rows::write(folder, &runs).unwrap();
        rows::write(folder, &judged).unwrap();
    }

    #[test]
    fn a_page_needs_nothing_else_and_says_how_many_are_wrong() {
        let folder = folder("page");
        fill(&folder, 0);
        assert_eq!(write(&folder, &folder).unwrap(), 0);
        let page = std::fs::read_to_string(folder.join("index.html")).unwrap();
        assert!(page.contains("<svg viewBox=") && page.contains("prefers-color-scheme: dark"));
        for outside in ["http://", "https://", "<script", "src=", "@import"] {
            let namespaces = page.replace("http://www.w3.org/2000/svg", "");
            assert!(!namespaces.contains(outside), "{outside}");
        }
        for name in ["scenes", "runs", "t-error"] {
            for ending in ["svg", "csv"] {
                assert!(folder.join(format!("figures/{name}.{ending}")).exists(), "{name}");
            }
        }
        fill(&folder, 4);
        assert_eq!(write(&folder, &folder).unwrap(), 4);
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn without_numbers_there_is_no_page() {
        let folder = folder("nothing");
        assert!(write(&folder, &folder).is_err());
        std::fs::remove_dir_all(folder).unwrap();
    }
}

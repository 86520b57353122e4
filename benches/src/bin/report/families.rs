//! The stress families: every method asked, every answer judged exactly.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, Result};
use raykern::Hit;
use raykern_harness::stress::{ALL, Family};

use crate::case::Case;
use crate::judge::{Judge, Tally};
use crate::methods::{self, Method};
use crate::options::Options;
use crate::rows::{self, Judged, Run};
use crate::timing::Timed;
use crate::worker::{Request, parse_hit};

/// Only so many cases of a family are timed.
const TIMED_CASES: u64 = 6;

/// Measures every family.
pub fn measure(options: &Options) -> Result<()> {
    let methods = methods::all();
    let (mut judged, mut runs) = (Vec::new(), Vec::new());
    let mut worker = None;
    for family in &ALL {
        let mut tallies = vec![Tally::default(); methods.len()];
        for number in 0..options.case_count() as u64 {
            let wanted = if number < TIMED_CASES { options.run_count() } else { 0 };
            let answers = ask(&mut worker, family, number, wanted, methods.len())?;
            judge(&Case::of(family, number), &methods, &answers, &mut tallies);
            let scene = number.to_string();
            let timed = answers.timed.iter();
            runs.extend(timed.map(|t| run(family.name, &scene, methods[t.method].name, t)));
        }
        let row = |(method, tally): (&Method, &Tally)| {
            Judged::new([family.name, "all", "closest", method.name], tally)
        };
        judged.extend(methods.iter().zip(&tallies).map(row));
    }
    let ours = |family: &str| Family::by_name(family).is_some();
    rows::replace(options.data(), judged, |row: &Judged| ours(&row.family))?;
    rows::replace(options.data(), runs, |row: &Run| ours(&row.family))
}

fn run(family: &str, scene: &str, method: &str, timed: &Timed) -> Run {
    Run {
        family: family.to_owned(),
        scene: scene.to_owned(),
        kind: "closest".to_owned(),
        method: method.to_owned(),
        run: timed.run,
        rays: timed.rays,
        seconds: timed.seconds,
    }
}

/// What all methods said about a case.
struct Answers {
    /// Of each method; `None` if it was not asked, or refused.
    hits: Vec<Option<Vec<Hit>>>,
    /// Those that aborted or panicked.
    gave_up: Vec<usize>,
    timed: Vec<Timed>,
}

/// Asks a worker, and another one without the culprit whenever it dies.
fn ask(
    worker: &mut Option<Worker>,
    family: &Family,
    number: u64,
    runs: usize,
    methods: usize,
) -> Result<Answers> {
    let mut request = Request { family: family.name.to_owned(), number, runs, skipped: Vec::new() };
    loop {
        let child = match worker {
            Some(child) => child,
            None => worker.insert(Worker::start()?),
        };
        match child.answer(&request, methods) {
            Ok(mut answers) => {
                answers.gave_up = request.skipped;
                return Ok(answers);
            }
            Err(Some(culprit)) if !request.skipped.contains(&culprit) => {
                request.skipped.push(culprit);
            }
            Err(_) => anyhow::bail!("{} {number}: no answer", family.name),
        }
        *worker = None;
    }
}

struct Worker {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Worker {
    fn start() -> Result<Self> {
        let program = std::env::current_exe()?;
        let mut command = Command::new(program);
        // What it says when it dies is nobody's concern: that it did is counted.
        command.arg("--worker").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().context("the worker")?;
        let input = child.stdin.take().context("its input")?;
        let output = BufReader::new(child.stdout.take().context("its output")?);
        Ok(Worker { child, input, output })
    }

    /// All answers; on failure the number of the method that was at work.
    fn answer(&mut self, request: &Request, methods: usize) -> Result<Answers, Option<usize>> {
        let mut answers =
            Answers { hits: vec![None; methods], gave_up: Vec::new(), timed: Vec::new() };
        let mut at_work = None;
        writeln!(self.input, "{}", request.line()).map_err(|_| None)?;
        for line in self.output.by_ref().lines() {
            let line = line.map_err(|_| at_work)?;
            if let Some(number) = line.strip_prefix("start ").and_then(|n| n.parse().ok()) {
                at_work = Some(number);
            } else if let Some(hit) = parse_hit(&line) {
                let number = at_work.ok_or(None)?;
                answers.hits[number].get_or_insert_default().push(hit);
            } else if line == "end" {
                return Ok(answers);
            } else {
                answers.timed.extend(parse_time(&line));
            }
        }
        Err(at_work)
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // It may wait for another line.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn parse_time(line: &str) -> Option<Timed> {
    let mut words = line.strip_prefix("time ")?.split(' ');
    Some(Timed {
        method: words.next()?.parse().ok()?,
        run: words.next()?.parse().ok()?,
        rays: words.next()?.parse().ok()?,
        seconds: words.next()?.parse().ok()?,
    })
}

/// Judges all answers to a case.
fn judge(case: &Case, methods: &[Method], answers: &Answers, tallies: &mut [Tally]) {
    let judge = Judge::new(&case.model);
    let truths: Vec<_> = case.rays.iter().map(|ray| judge.truth(ray)).collect();
    for (number, (method, tally)) in methods.iter().zip(tallies).enumerate() {
        let asked = case.asked(method);
        if answers.gave_up.contains(&number) {
            tally.gave_up += asked.len() as u64;
        }
        let Some(hits) = &answers.hits[number] else { continue };
        for (i, hit) in asked.into_iter().zip(hits) {
            judge.judge(tally, &case.rays[i], &truths[i], hit, method.names);
        }
    }
}

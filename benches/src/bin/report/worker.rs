//! Asking the methods about one case, in a process of its own, since some abort or panic on what they do not like.
//!
//! The parent writes a line for each case, and the worker answers with lines:
//!
//! ```text
//! FAMILY NUMBER RUNS SKIPPED,SKIPPED ..      asks; the skipped methods are named by their numbers
//! start METHOD                               is about to build and to ask it
//! hit T PRIM GEOMETRY  |  miss               each ray that it is asked, T as bits
//! time METHOD RUN RAYS SECONDS               a timed run
//! end                                        of the case
//! ```

use std::io::{BufRead, Write};
use std::process::ExitCode;
use std::rc::Rc;

use raykern::{Hit, NONE, Ray};
use raykern_bench::lineup::Tracer;
use raykern_bench::watch::Watch;
use raykern_harness::stress::Family;

use crate::case::Case;
use crate::methods::{self, Method};
use crate::timing::{Job, in_turns};

/// Answers until the input ends.
pub fn serve() -> ExitCode {
    let methods = methods::all();
    let mut out = std::io::stdout().lock();
    for line in std::io::stdin().lock().lines().map_while(Result::ok) {
        let Some(request) = Request::parse(&line) else { return ExitCode::FAILURE };
        if answer(&request, &methods, &mut out).is_err() {
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// A case, and what is to be done with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    pub family: String,
    pub number: u64,
    /// How often to time each method; zero for answers alone.
    pub runs: usize,
    /// Methods that gave up on it.
    pub skipped: Vec<usize>,
}

impl Request {
    /// As a line.
    pub fn line(&self) -> String {
        let skipped: Vec<_> = self.skipped.iter().map(usize::to_string).collect();
        format!("{} {} {} {}", self.family, self.number, self.runs, skipped.join(","))
    }

    fn parse(line: &str) -> Option<Self> {
        let mut words = line.split(' ');
        Some(Request {
            family: words.next()?.to_owned(),
            number: words.next()?.parse().ok()?,
            runs: words.next()?.parse().ok()?,
            skipped: words.next()?.split(',').filter_map(|number| number.parse().ok()).collect(),
        })
    }
}

/// Writes all answers to one case.
fn answer(request: &Request, methods: &[Method], out: &mut impl Write) -> std::io::Result<()> {
    let family = Family::by_name(&request.family).ok_or(std::io::ErrorKind::InvalidInput)?;
    let case = Case::of(&family, request.number);
    let mut timed: Vec<(usize, Rc<dyn Tracer>, Vec<Ray>)> = Vec::new();
    for (number, method) in methods.iter().enumerate() {
        let rays: Vec<Ray> = case.asked(method).into_iter().map(|i| case.rays[i]).collect();
        if request.skipped.contains(&number) || rays.is_empty() {
            continue;
        }
        writeln!(out, "start {number}")?;
        // Before it may abort.
        out.flush()?;
        let Ok(built) = method.build(&case.model) else { continue };
        let mut hits = vec![Hit::MISS; rays.len()];
        built.tracer.closest(&rays, &mut hits, false, &mut Watch::new());
        hits.iter().try_for_each(|hit| write_hit(out, hit))?;
        timed.push((number, built.tracer, rays));
    }
    if request.runs > 0 {
        time(&timed, request.runs, out)?;
    }
    writeln!(out, "end")?;
    out.flush()
}

fn write_hit(out: &mut impl Write, hit: &Hit) -> std::io::Result<()> {
    match hit.geometry {
        NONE => writeln!(out, "miss"),
        _ => {
            let Hit { t, u, v, prim, geometry, .. } = hit;
            let [t, u, v] = [t, u, v].map(|x| x.to_bits());
            writeln!(out, "hit {t} {u} {v} {prim} {geometry}")
        }
    }
}

/// A hit as it was written.
pub fn parse_hit(line: &str) -> Option<Hit> {
    if line == "miss" {
        return Some(Hit::MISS);
    }
    let numbers: Vec<u32> =
        line.strip_prefix("hit ")?.split(' ').map_while(|word| word.parse().ok()).collect();
    let [t, u, v, prim, geometry] = numbers.try_into().ok()?;
    let [t, u, v] = [t, u, v].map(f32::from_bits);
    Some(Hit { t, u, v, prim, geometry, instance: NONE })
}

/// Times them on the rays that all of them are asked.
fn time(
    timed: &[(usize, Rc<dyn Tracer>, Vec<Ray>)],
    runs: usize,
    out: &mut impl Write,
) -> std::io::Result<()> {
    let tracers: Vec<&dyn Tracer> = timed.iter().map(|(_, tracer, _)| tracer.as_ref()).collect();
    let Some(rays) = timed.iter().map(|(.., rays)| rays).min_by_key(|rays| rays.len()) else {
        return Ok(());
    };
    let job = Job { rays, any: false, coherent: false };
    for run in in_turns(&tracers, &job, runs) {
        let number = timed[run.method].0;
        writeln!(out, "time {number} {} {} {:e}", run.run, run.rays, run.seconds)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_and_hits_survive_the_way() {
        let request =
            Request { family: "needles".into(), number: 7, runs: 3, skipped: vec![2, 11] };
        assert_eq!(Request::parse(&request.line()), Some(request.clone()));
        let none = Request { skipped: Vec::new(), ..request };
        assert_eq!(Request::parse(&none.line()), Some(none));
        let hit = Hit { t: -0.0, u: 0.5, v: 1e-30, prim: 7, geometry: 1, instance: NONE };
        for hit in [hit, Hit::MISS] {
            let mut line = Vec::new();
            write_hit(&mut line, &hit).unwrap();
            let back = parse_hit(String::from_utf8(line).unwrap().trim()).unwrap();
            assert_eq!((back.t.to_bits(), back.prim), (hit.t.to_bits(), hit.prim));
        }
        assert_eq!(parse_hit("hit 1 2"), None);
    }

    #[test]
    fn every_method_answers_as_many_rays_as_it_is_asked() {
        let methods = methods::all();
        let request = Request { family: "ordinary".into(), number: 0, runs: 2, skipped: vec![0] };
        let mut out = Vec::new();
        answer(&request, &methods, &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let case = Case::of(&Family::by_name("ordinary").unwrap(), 0);
        // Those that are at hand.
        let built = || methods[1..].iter().filter(|method| method.build(&case.model).is_ok());
        let asked: usize = built().map(|method| case.asked(method).len()).sum();
        let answers = text.lines().filter(|line| parse_hit(line).is_some()).count();
        assert_eq!(answers, asked);
        assert!(text.ends_with("end\n") && !text.contains("start 0\n"));
        let timed = text.lines().filter(|line| line.starts_with("time ")).count();
        assert_eq!(timed, 2 * built().count());
    }
}

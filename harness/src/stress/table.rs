//! The results as a table for people and as values for programs.

use std::fmt::Write;

use super::Family;
use super::score::{Row, Score};

/// One row for each family, and one for all.
///
/// Columns of an answerer: false misses, false hits, wrong primitives, another primitive at the same
/// t, and for the exact one t not correctly rounded, weights out of their bound and contradictions
/// between structures, for the others a t more than 64 floats off and the largest error in floats.
pub fn table(families: &[Family], rows: &[Row], embree: bool) -> String {
    let mut out = format!("{:50}  {:38}", "", "exact: list, grid, BVH");
    let others =
        if embree { &["watertight", "Embree", "Embree robust"][..] } else { &["watertight"] };
    others.iter().for_each(|name| {
        let asked = if name.starts_with('E') { "     asked" } else { "" };
        let _ = write!(out, "|{asked} {name:42}");
    });
    let _ = write!(out, "\n{:18} {:>9} {:>9} {:>9}   ", "family", "rays", "hits", "ties");
    out.push_str(" miss   hit  prim   tie     t   u,v differ");
    others.iter().for_each(|name| {
        let rays = if name.starts_with('E') { "      rays" } else { "" };
        let _ = write!(out, " |{rays}   miss    hit   prim    tie  t>64u max ulp");
    });
    out.push('\n');
    let total = total(rows);
    let named = families.iter().map(|family| family.name).zip(rows);
    for (name, row) in named.chain([("all", &total)]) {
        line(&mut out, name, row, embree);
    }
    out.lines().map(|line| line.trim_end().to_owned() + "\n").collect()
}

fn total(rows: &[Row]) -> Row {
    let mut total = Row::default();
    rows.iter().for_each(|row| total.merge(row));
    total
}

fn line(out: &mut String, name: &str, row: &Row, embree: bool) {
    let Score {
        false_misses, false_hits, wrong_prims, wrong_ties, wrong_ts, wrong_weights, ..
    } = row.exact;
    let _ = write!(out, "{name:18} {:9} {:9} {:9}   ", row.rays, row.hits, row.ties);
    for count in [false_misses, false_hits, wrong_prims, wrong_ties, wrong_ts, wrong_weights] {
        let _ = write!(out, "{count:5} ");
    }
    let _ = write!(out, "{:6} |", row.differences);
    score(out, &row.watertight);
    for other in row.embree.iter().filter(|_| embree) {
        let _ = write!(out, " |{:10}", other.rays);
        score(out, other);
    }
    out.push('\n');
}

fn score(out: &mut String, score: &Score) {
    let Score { false_misses, false_hits, wrong_prims, wrong_ties, far_ts, worst_ulps, .. } =
        *score;
    for count in [false_misses, false_hits, wrong_prims, wrong_ties, far_ts] {
        // Whom nobody asked has no zeros to show.
        let shown = if score.rays == 0 { "-".to_owned() } else { count.to_string() };
        let _ = write!(out, "{shown:>7}");
    }
    let shown = match worst_ulps {
        _ if score.rays == 0 => "-".to_owned(),
        0..100_000 => worst_ulps.to_string(),
        _ => format!("{:.0e}", worst_ulps as f64),
    };
    let _ = write!(out, "{shown:>8}");
}

/// The same with all counts, separated by commas.
pub fn csv(families: &[Family], rows: &[Row]) -> String {
    let mut out = "family,rays,hits,ties,differences,seconds".to_owned();
    for who in ["exact", "watertight", "embree", "embree_robust"] {
        for what in ["rays", "false_misses", "false_hits", "wrong_prims", "wrong_ties"] {
            let _ = write!(out, ",{who}_{what}");
        }
        let _ = write!(out, ",{who}_wrong_ts,{who}_far_ts,{who}_wrong_weights,{who}_worst_ulps");
    }
    out.push('\n');
    for (family, row) in families.iter().zip(rows) {
        let Row { rays, hits, ties, differences, seconds, .. } = row;
        let _ = write!(out, "{},{rays},{hits},{ties},{differences},{seconds:.3}", family.name);
        for score in [&row.exact, &row.watertight, &row.embree[0], &row.embree[1]] {
            let counts = [
                score.rays,
                score.false_misses,
                score.false_hits,
                score.wrong_prims,
                score.wrong_ties,
                score.wrong_ts,
                score.far_ts,
                score.wrong_weights,
                score.worst_ulps,
            ];
            counts.iter().for_each(|count| {
                let _ = write!(out, ",{count}");
            });
        }
        out.push('\n');
    }
    out
}

/// The table of docs/ACCURACY.md: with Embree's answers, and ours in one column.
pub fn markdown(families: &[Family], rows: &[Row]) -> String {
    let mut out = "| family | rays | hits | ties | exact: wrong | watertight: miss, hit, prim \
                   | Embree: asked | miss | hit | prim | robust: miss | hit | prim |\n|---"
        .to_owned();
    out += &"|--:".repeat(12);
    out += "|\n";
    let total = total(rows);
    let named = families.iter().map(|family| family.name).zip(rows);
    for (name, row) in named.chain([("all", &total)]) {
        let Row { rays, hits, ties, watertight, embree: [plain, robust], .. } = row;
        let counts = |s: &Score| [s.false_misses, s.false_hits, s.wrong_prims].map(grouped);
        let cells = [*rays, *hits, *ties, row.wrong()].map(grouped).join(" | ");
        let asked = |s: &Score| match s.rays {
            0 => "- | - | -".to_owned(),
            _ => counts(s).join(" | "),
        };
        let _ = writeln!(
            out,
            "| {name} | {cells} | {} | {} | {} | {} |",
            counts(watertight).join(", "),
            grouped(plain.rays),
            asked(plain),
            asked(robust)
        );
    }
    out
}

/// With a comma after each three digits.
fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let groups: Vec<_> = digits.as_bytes().rchunks(3).rev().map(String::from_utf8_lossy).collect();
    groups.join(",")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stress::ALL;

    #[test]
    fn every_line_of_a_table_has_all_columns() {
        let mut rows = vec![Row::default(); ALL.len()];
        rows[0].rays = 1_234_567;
        rows[0].embree[0].rays = 1000;
        let columns = |text: String, mark: char| -> Vec<usize> {
            text.lines().map(|line| line.matches(mark).count()).collect()
        };
        for (text, mark) in [(csv(&ALL, &rows), ','), (markdown(&ALL, &rows), '|')] {
            let columns = columns(text, mark);
            assert!(columns.iter().all(|count| *count == columns[0]), "{columns:?}");
        }
        assert!(
            markdown(&ALL, &rows)
                .contains("| ordinary | 1,234,567 | 0 | 0 | 0 | 0, 0, 0 | 1,000 |")
        );
        assert_eq!(table(&ALL, &rows, true).lines().count(), ALL.len() + 3);
    }
}

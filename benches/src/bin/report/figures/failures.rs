//! Pictures of failures.

use anyhow::Result;
use raykern_harness::chart::tiles::{Panel, Tiles};

use super::{Figure, lines};
use crate::pictures::{Picture, SIDE};
use crate::rows::Square;

/// One of them, as far as it was taken.
pub fn picture(picture: &Picture, squares: &[Square]) -> Result<Option<Figure>> {
    let mine: Vec<&Square> = squares.iter().filter(|s| s.picture == picture.name).collect();
    let parts: Vec<&[&Square]> = mine.chunk_by(|a, b| a.method == b.method).collect();
    if parts.is_empty() {
        return Ok(None);
    }
    let wrong = |part: &[&Square]| part.iter().filter(|square| square.outcome > 1).count();
    let panel = |part: &&[&Square]| Panel {
        name: format!("{}: {} wrong", part[0].method, wrong(part)),
        kinds: part.iter().map(|square| square.outcome).collect(),
    };
    let seen = |outcome: &usize| mine.iter().any(|square| square.outcome == *outcome);
    let named = |i: usize| if seen(&i) { picture.outcomes[i].to_owned() } else { String::new() };
    let legend = (0..picture.outcomes.len()).map(named).collect();
    let tiles = Tiles {
        title: picture.title.to_owned(),
        legend,
        panels: parts.iter().map(panel).collect(),
        columns: SIDE,
    };
    let caption = format!(
        "{} {} rays each, all judged exactly. The test {} takes it again.",
        picture.about,
        SIDE * SIDE,
        picture.name
    );
    let row = |part: &&[&Square]| {
        let count = |outcome| part.iter().filter(|s| s.outcome == outcome).count().to_string();
        let counts = (0..picture.outcomes.len()).map(count);
        std::iter::once(part[0].method.clone()).chain(counts).collect()
    };
    let head: Vec<&str> = std::iter::once("method").chain(picture.outcomes).collect();
    let table = lines(&head, parts.iter().map(row));
    Figure::new(picture.name, tiles.svg(), caption, table).map(Some)
}

//! Small pictures side by side, each of squares of a few kinds.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::draw::{Area, COLORS, DrawError, FAINT, svg, text_width, write_text};

/// A picture.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Above it.
    pub name: String,
    /// The kind of each square, row by row.
    pub kinds: Vec<usize>,
}

/// Pictures side by side.
#[derive(Clone, Debug)]
pub struct Tiles {
    /// Above all.
    pub title: String,
    /// The kinds' names; those without are not explained.
    pub legend: Vec<String>,
    /// The pictures.
    pub panels: Vec<Panel>,
    /// Squares in a row of each.
    pub columns: usize,
}

/// Of each kind: light where all is well, apart for every kind of colour vision where not.
const KINDS: [RGBColor; 5] =
    [RGBColor(200, 200, 200), RGBColor(238, 238, 238), COLORS[0], COLORS[1], COLORS[4]];
const SQUARE: i32 = 5;
const TOP: i32 = 96;
const GAP: i32 = 20;

impl Tiles {
    /// The pictures as SVG text.
    pub fn svg(&self) -> Result<String, String> {
        let side = SQUARE * self.columns as i32;
        let width = (GAP + (side + GAP) * self.panels.len().max(1) as i32).max(560);
        svg((width as u32, (TOP + side + GAP) as u32), |area| self.draw(area, side))
    }

    fn draw(&self, area: &Area, side: i32) -> Result<(), DrawError<'static>> {
        write_text(area, &self.title, (16, 12), 18, HPos::Left, true)?;
        let mut x = 20;
        for (name, color) in self.legend.iter().zip(KINDS).filter(|(name, _)| !name.is_empty()) {
            area.draw(&Rectangle::new([(x, 44), (x + 12, 56)], color.filled()))?;
            write_text(area, name, (x + 18, 42), 14, HPos::Left, false)?;
            x += 36 + text_width(name, 14);
        }
        for (i, panel) in self.panels.iter().enumerate() {
            let left = GAP + (side + GAP) * i as i32;
            write_text(area, &panel.name, (left, TOP - 22), 14, HPos::Left, false)?;
            for (row, kinds) in panel.kinds.chunks(self.columns).enumerate() {
                draw_row(area, kinds, (left, TOP + SQUARE * row as i32))?;
            }
            let frame = [(left - 1, TOP - 1), (left + side, TOP + side)];
            area.draw(&Rectangle::new(frame, FAINT))?;
        }
        Ok(())
    }
}

/// Squares of a kind side by side are one rectangle.
fn draw_row(
    area: &Area,
    kinds: &[usize],
    (left, top): (i32, i32),
) -> Result<(), DrawError<'static>> {
    let mut column = 0;
    for run in kinds.chunk_by(|a, b| a == b) {
        let [from, to] = [column, column + run.len() as i32].map(|c| left + SQUARE * c);
        let color = KINDS[run[0].min(KINDS.len() - 1)];
        area.draw(&Rectangle::new([(from, top), (to, top + SQUARE)], color.filled()))?;
        column += run.len() as i32;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_of_a_kind_are_drawn_as_one() {
        let panel = Panel { name: "one".into(), kinds: vec![0, 0, 2, 0, 0, 0] };
        let legend = vec!["hit".to_owned()];
        let tiles = Tiles { title: "Holes".into(), legend, panels: vec![panel], columns: 3 };
        let text = tiles.svg().unwrap();
        // Paper, one in the legend, two and one, the frame.
        assert_eq!(text.matches("<rect").count(), 6);
    }
}

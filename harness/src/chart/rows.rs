//! A row for each thing, and in it every single value: nothing is hidden by a mean.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::{Axis, Placed};
use super::draw::{Area, COLORS, DrawError, FAINT, INK, digits, svg, text_width, write_text};

/// One row.
#[derive(Clone, Debug)]
pub struct Row {
    /// What it is of.
    pub name: String,
    /// The number of a colour.
    pub style: usize,
    /// Every value.
    pub values: Vec<f64>,
    /// The middle, with its interval; written beside the row.
    pub middle: Option<(f64, (f64, f64))>,
}

/// A chart of rows.
#[derive(Clone, Debug)]
pub struct Rows {
    /// Above it.
    pub title: String,
    /// Across.
    pub axis: Axis,
    /// From the top.
    pub rows: Vec<Row>,
    /// A value with a line of its own, such as one for ratios.
    pub reference: Option<f64>,
    /// In pixels.
    pub width: u32,
}

const TOP: i32 = 48;
const ROW: i32 = 24;
const BOTTOM: i32 = 64;
const WORDS: u32 = 14;
/// For the number at the right.
const NUMBER: i32 = 200;

impl Rows {
    /// The chart as SVG text.
    pub fn svg(&self) -> Result<String, String> {
        let height = TOP + ROW * self.rows.len().max(1) as i32 + BOTTOM;
        svg((self.width, height as u32), |area| self.draw(area, height))
    }

    fn draw(&self, area: &Area, height: i32) -> Result<(), DrawError<'static>> {
        write_text(area, &self.title, (16, 12), 18, HPos::Left, true)?;
        let names = self.rows.iter().map(|row| text_width(&row.name, WORDS)).max();
        let (left, right) = (28 + names.unwrap_or(0), self.width as i32 - NUMBER);
        let bottom = height - BOTTOM;
        let values = self.rows.iter().flat_map(|row| row.values.iter().copied());
        let axis = Placed::over(self.axis.scale, values.chain(self.reference), [left, right]);
        for (tick, words) in axis.ticks() {
            let x = axis.at(tick);
            area.draw(&PathElement::new([(x, TOP - 4), (x, bottom)], FAINT))?;
            write_text(area, &words, (x, bottom + 8), WORDS, HPos::Center, false)?;
        }
        if let Some(x) = self.reference.map(|value| axis.at(value)) {
            area.draw(&PathElement::new([(x, TOP - 4), (x, bottom)], INK))?;
        }
        let middle = (left + right) / 2;
        write_text(area, &self.axis.label, (middle, bottom + 34), 15, HPos::Center, false)?;
        for (i, row) in self.rows.iter().enumerate() {
            let y = TOP + ROW * i as i32 + ROW / 2;
            write_text(area, &row.name, (left - 12, y - 8), WORDS, HPos::Right, false)?;
            draw_row(area, row, &axis, y, right)?;
        }
        Ok(())
    }
}

fn draw_row(
    area: &Area,
    row: &Row,
    axis: &Placed,
    y: i32,
    right: i32,
) -> Result<(), DrawError<'static>> {
    let color = COLORS[row.style % COLORS.len()];
    for value in &row.values {
        area.draw(&Circle::new((axis.at(*value), y), 3, color.mix(0.45).filled()))?;
    }
    let Some((middle, (low, high))) = row.middle else { return Ok(()) };
    let ends = [(axis.at(low), y), (axis.at(high), y)];
    area.draw(&PathElement::new(ends, INK.stroke_width(3)))?;
    let x = axis.at(middle);
    area.draw(&PathElement::new([(x, y - 8), (x, y + 8)], INK.stroke_width(2)))?;
    let number = format!("{} ({}-{})", digits(middle), digits(low), digits(high));
    write_text(area, &number, (right + 10, y - 8), 13, HPos::Left, false)
}

#[cfg(test)]
mod tests {
    use super::super::axis::Scale;
    use super::*;

    #[test]
    fn every_value_is_drawn() {
        let row = Row {
            name: "one".into(),
            style: 0,
            values: vec![0.5, 1.0, 2.5],
            middle: Some((1.0, (0.7, 2.0))),
        };
        let rows = Rows {
            title: "Runs".into(),
            axis: Axis::new("seconds", Scale::Log),
            rows: vec![row],
            reference: Some(1.0),
            width: 700,
        };
        let text = rows.svg().unwrap();
        assert_eq!(text.matches("<circle").count(), 3);
        assert!(text.contains("1.00 (0.700-2.00)") && text.contains("seconds"));
    }
}

//! Charts as SVG: times with error bars here, marks and lines over two axes in [`plot`], rows of single runs in [`rows`], small
//! pictures in [`tiles`].

mod axis;
mod draw;
pub mod plot;
pub mod rows;
pub mod tiles;

use std::path::Path;

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use crate::stats::Summary;
use draw::{Area, COLORS, DrawError, FAINT, digits, label, mark, write_text};

/// One measured series: a name, and for each row a summary or nothing.
pub struct Series {
    /// As in the legend.
    pub name: String,
    /// In the order of [`Chart::rows`].
    pub values: Vec<Option<Summary>>,
}

/// A chart with a row for each thing measured and a logarithmic axis of times.
pub struct Chart {
    /// Above the chart.
    pub title: String,
    /// Below the title.
    pub subtitle: String,
    /// The axis, with its unit.
    pub axis: String,
    /// The rows, from the top.
    pub rows: Vec<String>,
    /// At most three.
    pub series: Vec<Series>,
}

const WIDTH: u32 = 1000;
const LEFT: u32 = 190;
const RIGHT: u32 = 90;
const TOP: u32 = 110;
const ROW: u32 = 54;
const BOTTOM: u32 = 80;

impl Chart {
    /// The chart as SVG text.
    pub fn svg(&self) -> Result<String, String> {
        let height = TOP + ROW * self.rows.len().max(1) as u32 + BOTTOM;
        draw::svg((WIDTH, height), |area| self.draw(area, height))
    }

    /// Writes the chart to a file.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let fail = |e: String| format!("{}: cannot be written: {e}", path.display());
        std::fs::write(path, self.svg().map_err(fail)?).map_err(|e| fail(e.to_string()))
    }

    fn draw(&self, area: &Area, height: u32) -> Result<(), DrawError<'_>> {
        write_text(area, &self.title, (24, 20), 24, HPos::Left, true)?;
        write_text(area, &self.subtitle, (24, 52), 15, HPos::Left, false)?;
        let scale = Scale::over(self.series.iter().flat_map(|s| s.values.iter().flatten()));
        let bottom = (height - BOTTOM) as i32;
        for tick in scale.ticks() {
            let x = scale.x(tick);
            area.draw(&PathElement::new([(x, TOP as i32 - 6), (x, bottom)], FAINT))?;
            write_text(area, &label(tick), (x, bottom + 8), 15, HPos::Center, false)?;
        }
        let middle = ((LEFT + WIDTH - RIGHT) / 2) as i32;
        write_text(area, &self.axis, (middle, bottom + 38), 16, HPos::Center, false)?;
        self.legend(area)?;
        for (row, name) in self.rows.iter().enumerate() {
            let y = (TOP + ROW * row as u32 + ROW / 2) as i32;
            write_text(area, name, (LEFT as i32 - 14, y - 8), 16, HPos::Right, false)?;
            for (i, series) in self.series.iter().enumerate() {
                let y = y + (2 * i as i32 + 1 - self.series.len() as i32) * 8;
                if let Some(value) = series.values.get(row).copied().flatten() {
                    draw_value(area, &scale, value, y, i)?;
                }
            }
        }
        Ok(())
    }

    fn legend(&self, area: &Area) -> Result<(), DrawError<'_>> {
        let mut x = LEFT as i32;
        for (i, series) in self.series.iter().enumerate() {
            mark(area, (x, 88), i)?;
            write_text(area, &series.name, (x + 14, 80), 15, HPos::Left, false)?;
            x += 40 + 9 * series.name.chars().count() as i32;
        }
        Ok(())
    }
}

/// A thin line from least to greatest, a thick one over the interval of confidence, a mark on the
/// mean, and its number.
fn draw_value(
    area: &Area,
    scale: &Scale,
    value: Summary,
    y: i32,
    series: usize,
) -> Result<(), DrawError<'static>> {
    let color = COLORS[series];
    let [min, max] = [value.min, value.max].map(|x| scale.x(x));
    area.draw(&PathElement::new([(min, y), (max, y)], color.stroke_width(1)))?;
    for x in [min, max] {
        area.draw(&PathElement::new([(x, y - 4), (x, y + 4)], color.stroke_width(1)))?;
    }
    let mut end = max;
    if let Some(half) = value.half_width {
        let from = scale.x((value.mean - half).max(scale.low));
        let to = scale.x((value.mean + half).min(scale.high));
        end = end.max(to);
        area.draw(&PathElement::new([(from, y), (to, y)], color.stroke_width(4)))?;
    }
    mark(area, (scale.x(value.mean), y), series)?;
    let number = format!("{} s", digits(value.mean));
    write_text(area, &number, (end.max(scale.x(value.mean)) + 12, y - 7), 13, HPos::Left, false)
}

/// A logarithmic axis over whole powers of ten.
struct Scale {
    low: f64,
    high: f64,
}

impl Scale {
    fn over<'a>(values: impl Iterator<Item = &'a Summary>) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|v| v.min > 0.0 && v.max.is_finite()) {
            low = low.min(value.min);
            high = high.max(value.max);
        }
        if low > high {
            (low, high) = (0.1, 1.0);
        }
        let power = |x: f64| 10f64.powi(x as i32);
        let (low, mut top) = (low.log10().floor(), high.log10().ceil());
        if top <= low {
            top = low + 1.0;
        }
        Scale { low: power(low), high: power(top) }
    }

    fn x(&self, value: f64) -> i32 {
        let share = (value / self.low).ln() / (self.high / self.low).ln();
        let width = f64::from(WIDTH - LEFT - RIGHT);
        LEFT as i32 + (share.clamp(0.0, 1.0) * width).round() as i32
    }

    fn ticks(&self) -> impl Iterator<Item = f64> {
        let [low, high] = [self.low, self.high].map(|x| x.log10().round() as i32);
        (low..=high).map(|power| 10f64.powi(power))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_lies_between_the_ends_of_the_axis() {
        let summary = Summary::of(&[0.3, 0.5, 70.0]).unwrap();
        let scale = Scale::over([&summary].into_iter());
        assert_eq!((scale.low, scale.high), (0.1, 100.0));
        assert!(scale.x(0.3) > LEFT as i32 && scale.x(70.0) < (WIDTH - RIGHT) as i32);
        assert_eq!(scale.ticks().count(), 4);
    }

    #[test]
    fn a_chart_names_its_rows_and_series() {
        let values = vec![Summary::of(&[1.0, 2.0]), None];
        let chart = Chart {
            title: "A & B".into(),
            subtitle: String::new(),
            axis: "seconds".into(),
            rows: vec!["first".into(), "second".into()],
            series: vec![Series { name: "grid".into(), values }],
        };
        let svg = chart.svg().unwrap();
        for word in ["A &amp; B", "first", "second", "grid", "seconds", "</svg>"] {
            assert!(svg.contains(word), "{word}");
        }
    }
}

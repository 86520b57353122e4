//! Marks and lines over two axes.

use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::axis::Placed;
pub use super::axis::{Axis, Scale};
use super::draw::{
    Area, COLORS, DrawError, FAINT, INK, mark, svg, text_width, write_text, write_upwards,
};

/// A mark.
#[derive(Clone, Debug, Default)]
pub struct Point {
    /// Where.
    pub at: (f64, f64),
    /// The interval on the first axis.
    pub x_interval: Option<(f64, f64)>,
    /// The interval on the second.
    pub y_interval: Option<(f64, f64)>,
    /// What stands beside it.
    pub label: String,
}

impl Point {
    /// A mark and nothing else.
    pub fn bare(x: f64, y: f64) -> Self {
        Point { at: (x, y), ..Default::default() }
    }
}

/// Marks of one kind.
#[derive(Clone, Debug)]
pub struct Series {
    /// As in the legend, which leaves out what has no name.
    pub name: String,
    /// The number of a colour and a shape.
    pub style: usize,
    /// The marks.
    pub points: Vec<Point>,
    /// Whether they are joined.
    pub joined: bool,
}

/// A chart over two axes.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Above it.
    pub title: String,
    /// Across.
    pub x: Axis,
    /// Upwards.
    pub y: Axis,
    /// What is shown.
    pub series: Vec<Series>,
    /// A stepped line, such as the front of what nothing beats; without marks.
    pub front: Vec<(f64, f64)>,
    /// Width and height.
    pub size: (u32, u32),
}

const LEFT: i32 = 92;
const RIGHT: i32 = 24;
/// The same where labels need room beside the last marks.
const LABELS: i32 = 120;
const BOTTOM: i32 = 64;
const WORDS: u32 = 14;
/// From one row of the legend to the next.
const LEGEND: i32 = 22;

impl Plot {
    /// The chart as SVG text.
    pub fn svg(&self) -> Result<String, String> {
        svg(self.size, |area| self.draw(area))
    }

    fn draw(&self, area: &Area) -> Result<(), DrawError<'static>> {
        let (width, height) = (self.size.0 as i32, self.size.1 as i32);
        write_text(area, &self.title, (16, 12), 18, HPos::Left, true)?;
        let top = 48 + LEGEND * (self.legend(area, width)? + 1);
        let labels =
            self.series.iter().flat_map(|series| &series.points).any(|p| !p.label.is_empty());
        let right = width - if labels { LABELS } else { RIGHT };
        let bottom = height - BOTTOM;
        let x = Placed::over(self.x.scale, self.values(|p| (p.at.0, p.x_interval)), [LEFT, right]);
        let y = Placed::over(self.y.scale, self.values(|p| (p.at.1, p.y_interval)), [bottom, top]);
        for (tick, words) in x.ticks() {
            let at = x.at(tick);
            area.draw(&PathElement::new([(at, top), (at, bottom)], FAINT))?;
            write_text(area, &words, (at, bottom + 8), WORDS, HPos::Center, false)?;
        }
        for (tick, words) in y.ticks() {
            let at = y.at(tick);
            area.draw(&PathElement::new([(LEFT, at), (right, at)], FAINT))?;
            write_text(area, &words, (LEFT - 8, at - 8), WORDS, HPos::Right, false)?;
        }
        let middle = (LEFT + right) / 2;
        write_text(area, &self.x.label, (middle, bottom + 34), 15, HPos::Center, false)?;
        write_upwards(area, &self.y.label, (20, (top + bottom) / 2), 15)?;
        self.draw_front(area, &x, &y)?;
        for series in &self.series {
            draw_series(area, series, &x, &y)?;
        }
        self.draw_labels(area, &x, &y, [LEFT, top, right, bottom])
    }

    /// All values along one axis.
    fn values(
        &self,
        of: impl Fn(&Point) -> (f64, Option<(f64, f64)>),
    ) -> impl Iterator<Item = f64> {
        let each = self.series.iter().flat_map(|series| &series.points).map(of);
        let all: Vec<f64> = each
            .flat_map(|(at, interval)| {
                [Some(at), interval.map(|i| i.0), interval.map(|i| i.1)].into_iter().flatten()
            })
            .collect();
        all.into_iter()
    }

    /// Returns the number of the last row.
    fn legend(&self, area: &Area, width: i32) -> Result<i32, DrawError<'static>> {
        let (mut x, mut row) = (24, 0);
        for series in self.series.iter().filter(|series| !series.name.is_empty()) {
            let room = 34 + text_width(&series.name, WORDS);
            if x + room > width - 8 && x > 24 {
                (x, row) = (24, row + 1);
            }
            let y = 50 + LEGEND * row;
            mark(area, (x, y), series.style)?;
            write_text(area, &series.name, (x + 12, y - 8), WORDS, HPos::Left, false)?;
            x += room;
        }
        Ok(row)
    }

    /// In steps: nothing lies beyond it.
    fn draw_front(&self, area: &Area, x: &Placed, y: &Placed) -> Result<(), DrawError<'static>> {
        let mut path: Vec<(i32, i32)> = Vec::new();
        for &(a, b) in &self.front {
            let at = (x.at(a), y.at(b));
            if let Some(last) = path.last() {
                path.push((last.0, at.1));
            }
            path.push(at);
        }
        area.draw(&PathElement::new(path, INK.stroke_width(1)))
    }

    /// Each label where it covers nothing else, if there is such a place close by.
    fn draw_labels(
        &self,
        area: &Area,
        x: &Placed,
        y: &Placed,
        frame: [i32; 4],
    ) -> Result<(), DrawError<'static>> {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let spot = |p: &Point| (x.at(p.at.0), y.at(p.at.1));
        let mut taken: Vec<[i32; 4]> =
            points().map(spot).map(|(x, y)| [x - 6, y - 6, x + 6, y + 6]).collect();
        for point in points().filter(|point| !point.label.is_empty()) {
            let (px, py) = spot(point);
            let (place, moved) = free_place((px, py), &point.label, &taken, frame);
            if moved {
                let end = (px.clamp(place[0], place[2]), py.clamp(place[1], place[3]));
                area.draw(&PathElement::new([(px, py), end], INK.mix(0.4)))?;
            }
            write_text(area, &point.label, (place[0], place[1]), WORDS, HPos::Left, false)?;
            taken.push(place);
        }
        Ok(())
    }
}

/// Whiskers, the line that joins, and marks.
fn draw_series(
    area: &Area,
    series: &Series,
    x: &Placed,
    y: &Placed,
) -> Result<(), DrawError<'static>> {
    let color = COLORS[series.style % COLORS.len()];
    let spot = |at: (f64, f64)| (x.at(at.0), y.at(at.1));
    if series.joined {
        let path: Vec<_> = series.points.iter().map(|point| spot(point.at)).collect();
        area.draw(&PathElement::new(path, color.stroke_width(2)))?;
    }
    for point in &series.points {
        let (px, py) = spot(point.at);
        if let Some((low, high)) = point.x_interval {
            let ends = [(x.at(low), py), (x.at(high), py)];
            area.draw(&PathElement::new(ends, color.stroke_width(1)))?;
        }
        if let Some((low, high)) = point.y_interval {
            let ends = [(px, y.at(low)), (px, y.at(high))];
            area.draw(&PathElement::new(ends, color.stroke_width(1)))?;
            for (_, end) in ends {
                area.draw(&PathElement::new([(px - 4, end), (px + 4, end)], color))?;
            }
        }
        mark(area, (px, py), series.style)?;
    }
    Ok(())
}

/// A place for a label beside its mark, and whether it is so far off that a line must lead there.
fn free_place(
    (px, py): (i32, i32),
    label: &str,
    taken: &[[i32; 4]],
    [left, top, right, bottom]: [i32; 4],
) -> ([i32; 4], bool) {
    let (width, height) = (text_width(label, WORDS), WORDS as i32 + 2);
    let at = |x: i32, y: i32| [x, y, x + width, y + height];
    let fits = |p: &[i32; 4]| {
        let inside =
            p[0] >= left && p[2] <= right + LABELS - 4 && p[1] >= top - 10 && p[3] <= bottom;
        let covers = |t: &[i32; 4]| p[0] < t[2] && t[0] < p[2] && p[1] < t[3] && t[1] < p[3];
        inside && !taken.iter().any(covers)
    };
    // Beside it, then above and below, ever further away.
    let shifts = (0..40).flat_map(|k: i32| if k == 0 { vec![0] } else { vec![-7 * k, 7 * k] });
    for dy in shifts {
        let y = py - height / 2 + dy;
        for x in [px + 10, px - 10 - width, px - width / 2, px + 40, px - 40 - width] {
            let centred = x == px - width / 2;
            if !(centred && dy.abs() < 14) && fits(&at(x, y)) {
                return (
                    at(x, y),
                    dy.abs() > 21 || (x - px).abs().min((x + width - px).abs()) > 20,
                );
            }
        }
    }
    (at(px + 10, py - height / 2), false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_of_close_marks_do_not_cover_each_other() {
        let frame = [0, 0, 800, 600];
        let mut taken = Vec::new();
        for i in 0..12 {
            let (place, _) = free_place((400 + i, 300), "a long name", &taken, frame);
            let covers = |t: &[i32; 4]| {
                place[0] < t[2] && t[0] < place[2] && place[1] < t[3] && t[1] < place[3]
            };
            assert!(!taken.iter().any(covers), "{place:?}");
            taken.push(place);
        }
    }

    #[test]
    fn a_plot_has_its_words() {
        let points = vec![
            Point {
                at: (1.0, 0.0),
                y_interval: Some((0.0, 3.0)),
                label: "ours".into(),
                ..Default::default()
            },
            Point::bare(0.5, 200.0),
        ];
        let plot = Plot {
            title: "Speed & errors".into(),
            x: Axis::new("times", Scale::Log),
            y: Axis::new("errors a million", Scale::LogWithZero),
            series: vec![Series { name: "exact".into(), style: 1, points, joined: false }],
            front: vec![(0.5, 200.0), (1.0, 0.0)],
            size: (640, 400),
        };
        let text = plot.svg().unwrap();
        for word in ["Speed &amp; errors", "times", "errors a million", "exact", "ours", "</svg>"] {
            assert!(text.contains(word), "{word}");
        }
    }
}

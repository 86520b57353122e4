//! What all charts draw with: marks, words, numbers.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Colours that remain apart for every kind of colour vision (Okabe and Ito), and a grey.
pub const COLORS: [RGBColor; 7] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(120, 120, 120),
];
pub const INK: RGBColor = RGBColor(40, 40, 40);
pub const FAINT: RGBColor = RGBColor(222, 222, 222);
const FONT: &str = "sans-serif";

pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
pub type DrawError<'a> = DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>;

/// What `draw` draws on white paper of this size.
pub fn svg(
    size: (u32, u32),
    draw: impl for<'a> FnOnce(&Area<'a>) -> Result<(), DrawError<'a>>,
) -> Result<String, String> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        area.fill(&WHITE).map_err(|e| e.to_string())?;
        draw(&area).map_err(|e| e.to_string())?;
        area.present().map_err(|e| e.to_string())?;
    }
    Ok(text)
}

/// A style's mark: also the shapes differ, for print without colours.
pub fn mark(area: &Area, at: (i32, i32), style: usize) -> Result<(), DrawError<'static>> {
    let fill = COLORS[style % COLORS.len()].filled();
    let (x, y) = at;
    match style % COLORS.len() {
        0 => area.draw(&Rectangle::new([(x - 5, y - 5), (x + 5, y + 5)], fill)),
        1 => area.draw(&Circle::new(at, 6, fill)),
        2 => area.draw(&TriangleMarker::new(at, 7, fill)),
        3 => {
            let diamond = vec![(x - 7, y), (x, y - 7), (x + 7, y), (x, y + 7)];
            area.draw(&Polygon::new(diamond, fill))
        }
        4 => {
            let down = vec![(x - 6, y - 5), (x + 6, y - 5), (x, y + 6)];
            area.draw(&Polygon::new(down, fill))
        }
        5 => area.draw(&Circle::new(at, 6, COLORS[5].stroke_width(3))),
        _ => area.draw(&Cross::new(at, 5, COLORS[6].stroke_width(3))),
    }
}

/// Words at a place: their top, and the side that is there.
pub fn write_text(
    area: &Area,
    text: &str,
    at: (i32, i32),
    size: u32,
    side: HPos,
    bold: bool,
) -> Result<(), DrawError<'static>> {
    let weight = if bold { FontStyle::Bold } else { FontStyle::Normal };
    let font = (FONT, size).into_font().style(weight);
    let style = TextStyle::from(font).color(&INK).pos(Pos::new(side, VPos::Top));
    area.draw(&Text::new(text.to_owned(), at, style))
}

/// Words upwards, around a place.
pub fn write_upwards(
    area: &Area,
    text: &str,
    at: (i32, i32),
    size: u32,
) -> Result<(), DrawError<'static>> {
    let font = (FONT, size).into_font().transform(FontTransform::Rotate270);
    let style = TextStyle::from(font).color(&INK).pos(Pos::new(HPos::Center, VPos::Center));
    area.draw(&Text::new(text.to_owned(), at, style))
}

/// About how wide words of this size are.
pub fn text_width(text: &str, size: u32) -> i32 {
    (0.56 * f64::from(size) * text.chars().count() as f64) as i32
}

/// A power of ten as people write it.
pub fn label(tick: f64) -> String {
    let power = tick.log10().round() as i32;
    match power {
        -3..0 => format!("{tick:.*}", -power as usize),
        0..=6 => thousands(tick),
        _ => format!("1e{power}"),
    }
}

/// Three significant digits.
pub fn digits(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let power = x.abs().log10().floor();
    match power as i32 {
        3..=8 => thousands(x.round()),
        p if p.abs() < 7 => format!("{x:.*}", (2 - p).max(0) as usize),
        _ => format!("{x:.2e}"),
    }
}

fn thousands(x: f64) -> String {
    let plain = format!("{x:.0}");
    let mut text = String::new();
    for (i, digit) in plain.chars().enumerate() {
        if i > 0 && digit.is_ascii_digit() && (plain.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_for_people() {
        assert_eq!([0.001, 1.0, 1e6].map(label), ["0.001", "1", "1,000,000"]);
        assert_eq!([0.01234, 1.0, 0.0].map(digits), ["0.0123", "1.00", "0"]);
        assert_eq!(digits(12345.6), "12,346");
    }
}

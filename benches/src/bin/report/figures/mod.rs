//! The figures: each as SVG, with the numbers it shows and a sentence on what it says.

pub mod blog;
pub mod cost;
pub mod failures;
pub mod growth;
pub mod tradeoff;

use std::path::Path;

use anyhow::{Context, Result, anyhow};

/// A figure.
pub struct Figure {
    /// The name of its files.
    pub name: String,
    pub svg: String,
    /// What it shows, and how often it was measured.
    pub caption: String,
    /// Its numbers, the first line their names.
    pub table: Vec<Vec<String>>,
}

impl Figure {
    /// Of a chart that may have failed.
    pub fn new(
        name: impl Into<String>,
        svg: Result<String, String>,
        caption: impl Into<String>,
        table: Vec<Vec<String>>,
    ) -> Result<Self> {
        let name = name.into();
        let svg = svg.map_err(|error| anyhow!("{name}: {error}"))?;
        Ok(Figure { name, svg, caption: caption.into(), table })
    }

    /// Writes the picture and the numbers.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let file = |ending| folder.join(format!("{}.{ending}", self.name));
        std::fs::write(file("svg"), &self.svg).with_context(|| self.name.clone())?;
        let mut out = csv::Writer::from_path(file("csv")).with_context(|| self.name.clone())?;
        self.table.iter().try_for_each(|line| out.write_record(line))?;
        Ok(out.flush()?)
    }
}

/// The number of the colour and shape that a structure has in every figure.
pub fn style(structure: &str) -> usize {
    let known = ["list", "BVH", "nested grid", "binary BVH", "plain grid", "BVH fast"];
    match structure {
        crate::methods::REFERENCE => 0,
        _ => known.iter().position(|name| *name == structure).unwrap_or(6),
    }
}

/// The lines of a table.
pub fn lines(head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> Vec<Vec<String>> {
    let head = head.iter().map(|name| (*name).to_owned()).collect();
    std::iter::once(head).chain(rows).collect()
}

/// A number as people read it: whole ones from ten thousand on in groups of three digits; other words as they are.
pub fn grouped(plain: &str) -> String {
    if plain.len() < 5 || !plain.bytes().all(|byte| byte.is_ascii_digit()) {
        return plain.to_owned();
    }
    let place = |i: usize| i > 0 && (plain.len() - i).is_multiple_of(3);
    let digits = plain.chars().enumerate();
    digits.flat_map(|(i, digit)| place(i).then_some(',').into_iter().chain([digit])).collect()
}

/// A number for a table.
pub fn number(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_owned(),
        size if (0.01..1e6).contains(&size) => {
            let digits = (2 - size.log10().floor() as i32).clamp(0, 4) as usize;
            format!("{x:.digits$}")
        }
        size if size.fract() == 0.0 && size < 1e12 => format!("{x:.0}"),
        _ => format!("{x:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits_and_whole_ones_groups() {
        let numbers = [0.0, 0.001234, 0.2, 1.0, 12.34, 4321.4, 1_234_567.0].map(number);
        assert_eq!(numbers, ["0", "1.23e-3", "0.200", "1.00", "12.3", "4321", "1234567"]);
        let grouped = ["1234567", "9999", "12345.6", "Embree 3"].map(grouped);
        assert_eq!(grouped, ["1,234,567", "9999", "12345.6", "Embree 3"]);
    }
}

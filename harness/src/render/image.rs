//! Pictures of eight bits a colour, and PNG files of them.

use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};

use glam::DVec3;

/// A picture, row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Width and height.
    pub resolution: [u32; 2],
    /// Red, green, blue.
    pub pixels: Vec<[u8; 3]>,
}

/// Why a picture could not be read or written.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct ImageError {
    /// The file.
    pub path: PathBuf,
    /// What went wrong.
    pub problem: String,
}

impl Image {
    /// A black picture.
    pub fn black(resolution: [u32; 2]) -> Self {
        let [width, height] = resolution.map(|n| n as usize);
        Image { resolution, pixels: vec![[0; 3]; width * height] }
    }

    /// Column and row of a pixel.
    pub fn position(&self, pixel: usize) -> [u32; 2] {
        let width = self.resolution[0] as usize;
        [(pixel % width) as u32, (pixel / width) as u32]
    }

    /// Sets a pixel to a colour of 0 to 255, clamped and rounded; NaN becomes black.
    pub fn set(&mut self, pixel: usize, color: DVec3) {
        // `as` sends NaN to zero and clamps what is out of range.
        self.pixels[pixel] = color.to_array().map(|x| x.round() as u8);
    }

    /// How many pixels differ from those of `other`, which has the same size.
    pub fn differing_pixels(&self, other: &Image) -> usize {
        assert_eq!(self.resolution, other.resolution, "pictures of the same size");
        self.pixels.iter().zip(&other.pixels).filter(|(a, b)| a != b).count()
    }

    /// Writes a PNG file.
    pub fn write_png(&self, path: &Path) -> Result<(), ImageError> {
        let error = |problem: String| ImageError { path: path.to_owned(), problem };
        let file = File::create(path).map_err(|e| error(format!("cannot be written: {e}")))?;
        let [width, height] = self.resolution;
        let mut encoder = png::Encoder::new(BufWriter::new(file), width, height);
        encoder.set_color(png::ColorType::Rgb);
        let written = encoder.write_header().and_then(|mut writer| {
            writer.write_image_data(self.pixels.as_flattened())?;
            writer.finish()
        });
        written.map_err(|e| error(format!("cannot be written: {e}")))
    }
}

/// Reads a PNG file of eight bits a colour; alpha is dropped, grey spread over the colours.
pub fn read_png(path: &Path) -> Result<Image, ImageError> {
    let error = |problem: String| ImageError { path: path.to_owned(), problem };
    let file = File::open(path).map_err(|e| error(format!("cannot be read: {e}")))?;
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(|e| error(format!("not a PNG file: {e}")))?;
    let size = reader.output_buffer_size().ok_or_else(|| error("too large".into()))?;
    let mut bytes = vec![0; size];
    let info = reader.next_frame(&mut bytes).map_err(|e| error(format!("broken PNG: {e}")))?;
    let samples = info.color_type.samples();
    let pixel = |p: &[u8]| if samples < 3 { [p[0]; 3] } else { [p[0], p[1], p[2]] };
    let pixels = bytes[..info.buffer_size()].chunks_exact(samples).map(pixel).collect();
    Ok(Image { resolution: [info.width, info.height], pixels })
}

//! Pictures, as pixels.

use std::io::Cursor;

use anyhow::{Context, Result, ensure};

/// A picture of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width [px].
    pub width: usize,
    /// Red, green and blue, row by row, `[height * width]`.
    pub pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// From a PNG of 8 bits a channel.
    pub(crate) fn decode(png: &[u8]) -> Result<Self> {
        let mut reader = png::Decoder::new(Cursor::new(png)).read_info()?;
        let mut data = vec![0; reader.output_buffer_size().context("the picture is too large")?];
        let info = reader.next_frame(&mut data)?;
        let channels = info.color_type.samples();
        let pixels = data[..info.buffer_size()].chunks_exact(channels).map(|p| [p[0], p[1], p[2]]).collect();
        Ok(Self { width: info.width as usize, pixels })
    }

    /// Height [px].
    pub fn height(&self) -> usize {
        self.pixels.len() / self.width
    }

    /// Pictures of the same height side by side.
    ///
    /// # Errors
    /// If there is none, or if their heights differ.
    pub fn beside(pictures: &[Self]) -> Result<Self> {
        let height = pictures.first().context("no picture")?.height();
        ensure!(pictures.iter().all(|picture| picture.height() == height), "pictures of several heights");
        let row = |y: usize| pictures.iter().flat_map(move |p| &p.pixels[y * p.width..(y + 1) * p.width]).copied();
        Ok(Self { width: pictures.iter().map(|p| p.width).sum(), pixels: (0..height).flat_map(row).collect() })
    }

    /// It as PNG.
    ///
    /// # Errors
    /// If it has no pixels.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let mut data = Vec::new();
        let mut encoder = png::Encoder::new(&mut data, self.width as u32, self.height() as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_compression(png::Compression::High);
        encoder.write_header()?.write_image_data(self.pixels.as_flattened())?;
        Ok(data)
    }
}

//! Pixels, and PNG.

use std::path::Path;

use crate::{GeometryError, write_atomically};

/// A picture: `height` rows of `width` pixels from the top, four bytes each, sRGB with straight alpha.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Red, green, blue, alpha of every pixel; length 4 · width · height.
    pub rgba: Vec<u8>,
}

impl Picture {
    /// The picture as a PNG file in memory. Pictures without transparency are stored without alpha.
    ///
    /// # Errors
    /// [`GeometryError::Png`] if `rgba` has another length than `width` and `height` say.
    pub fn to_png(&self) -> Result<Vec<u8>, GeometryError> {
        let opaque = self.rgba.chunks_exact(4).all(|p| p[3] == 255);
        let failed = |e: png::EncodingError| GeometryError::Png(e.to_string());
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, self.width, self.height);
        encoder.set_color(if opaque { png::ColorType::Rgb } else { png::ColorType::Rgba });
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        encoder.set_compression(png::Compression::Balanced);
        let mut writer = encoder.write_header().map_err(failed)?;
        if opaque {
            let rgb: Vec<u8> = self.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
            writer.write_image_data(&rgb).map_err(failed)?;
        } else {
            writer.write_image_data(&self.rgba).map_err(failed)?;
        }
        writer.finish().map_err(failed)?;
        Ok(bytes)
    }

    /// Saves the picture as PNG, atomically.
    ///
    /// # Errors
    /// [`GeometryError::UnknownFormat`] if the path does not end in `.png`, [`GeometryError::Io`] if it cannot be
    /// written (an earlier file is unchanged), [`GeometryError::Png`] as for [`to_png`](Self::to_png).
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), GeometryError> {
        let path = path.as_ref();
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        if ending != "png" {
            return Err(GeometryError::UnknownFormat { path: path.to_owned(), ending, known: ".png" });
        }
        let bytes = self.to_png()?;
        write_atomically(path, |out| out.write_all(&bytes))
    }
}

//! Pictures that follow each other, as one animated PNG.

use std::io::Cursor;

use crate::GeometryError;

/// Frames of one size, each a PNG without a palette, as one animated PNG that repeats for ever and shows each for so many
/// seconds, 0.001 to 60. Programs that do not know animated PNG show the first frame.
///
/// # Errors
/// [`GeometryError::Option`] for no frames or a wrong time, [`GeometryError::Png`] for frames that are not PNG, or not
/// alike in size and colours.
pub fn animate(frames: &[Vec<u8>], seconds: f64) -> Result<Vec<u8>, GeometryError> {
    let wrong = |name, expected, given| Err(GeometryError::Option { name, expected, given });
    if !(0.001..=60.0).contains(&seconds) {
        return wrong("seconds", "a time from 0.001 to 60", seconds.to_string());
    }
    let Some(first) = frames.first() else { return wrong("frames", "at least one", "none".into()) };
    let count = u32::try_from(frames.len()).map_err(|e| GeometryError::Png(e.to_string()))?;
    let failed = |e: png::EncodingError| GeometryError::Png(e.to_string());
    let (size, colors, _) = pixels(first)?;
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size.0, size.1);
    encoder.set_color(colors);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_animated(count, 0).map_err(failed)?;
    encoder.set_frame_delay((1000.0 * seconds) as u16, 1000).map_err(failed)?;
    let mut writer = encoder.write_header().map_err(failed)?;
    for (k, frame) in frames.iter().enumerate() {
        let (s, c, data) = pixels(frame)?;
        if (s, c) != (size, colors) {
            return Err(GeometryError::Png(format!(
                "frame {k}: expected {size:?} {colors:?}, given {s:?} {c:?}"
            )));
        }
        writer.write_image_data(&data).map_err(failed)?;
    }
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// Size, colours and bytes of a PNG.
fn pixels(png: &[u8]) -> Result<((u32, u32), png::ColorType, Vec<u8>), GeometryError> {
    let failed = |e: png::DecodingError| GeometryError::Png(e.to_string());
    let mut reader = png::Decoder::new(Cursor::new(png)).read_info().map_err(failed)?;
    let length = reader.output_buffer_size().ok_or_else(|| GeometryError::Png("too large".into()))?;
    let mut data = vec![0; length];
    let info = reader.next_frame(&mut data).map_err(failed)?;
    data.truncate(info.buffer_size());
    if info.bit_depth != png::BitDepth::Eight || info.color_type == png::ColorType::Indexed {
        return Err(GeometryError::Png(format!("expected 8 bits a channel, given {:?}", info.bit_depth)));
    }
    Ok(((info.width, info.height), info.color_type, data))
}

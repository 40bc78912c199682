//! NumPy's `.npz`: a zip archive of `.npy` arrays, stored without compression.

use std::io::{self, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::PointCloud;

pub(super) fn write(cloud: &PointCloud<'_>, out: &mut dyn Write) -> io::Result<()> {
    let mut archive = ZipWriter::new_stream(out);
    let mut column = |name: &str, values: Option<&[f64]>, width: Option<usize>| -> io::Result<()> {
        let Some(values) = values else { return Ok(()) };
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(values.len() > (u32::MAX as usize) / 16);
        archive.start_file(format!("{name}.npy"), options)?;
        archive.write_all(&npy_header(values.len(), width))?;
        let mut bytes = Vec::with_capacity(8 * 8192);
        for block in values.chunks(8192) {
            bytes.clear();
            bytes.extend(block.iter().flat_map(|v| v.to_le_bytes()));
            archive.write_all(&bytes)?;
        }
        Ok(())
    };
    column("points", Some(cloud.points.as_flattened()), Some(3))?;
    column("normals", cloud.normals.map(<[_]>::as_flattened), Some(3))?;
    column("radii", cloud.radii, None)?;
    column("areas", cloud.areas, None)?;
    column("curvatures", cloud.curvatures.map(<[_]>::as_flattened), Some(2))?;
    column("colors", cloud.colors.map(<[_]>::as_flattened), Some(3))?;
    archive.finish()?.flush()
}

/// Version 1.0 of NumPy's array header for little-endian doubles in C order: magic, length, a Python dictionary padded
/// with spaces so that the data starts at a multiple of 64 bytes.
fn npy_header(len: usize, width: Option<usize>) -> Vec<u8> {
    let shape = match width {
        Some(width) => format!("({}, {width})", len / width),
        None => format!("({len},)"),
    };
    let mut text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((text.len() as u16).to_le_bytes());
    header.extend(text.as_bytes());
    header
}

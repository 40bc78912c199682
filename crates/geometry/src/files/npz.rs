//! NumPy's `.npz`: a zip archive of `.npy` arrays, stored without compression.

use std::io::{self, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::{Mesh, PointCloud};

/// The cloud, and what belongs to a mesh over it where there is one.
pub(super) fn write(cloud: &PointCloud<'_>, mesh: Option<&Mesh>, out: &mut dyn Write) -> io::Result<()> {
    let mut archive = Archive(ZipWriter::new_stream(out));
    archive.floats("points", Some(cloud.points.as_flattened()), Some(3))?;
    archive.floats("normals", cloud.normals.map(<[_]>::as_flattened), Some(3))?;
    archive.floats("radii", cloud.radii, None)?;
    archive.floats("areas", cloud.areas, None)?;
    archive.floats("curvatures", cloud.curvatures.map(<[_]>::as_flattened), Some(2))?;
    archive.floats("colors", cloud.colors.map(<[_]>::as_flattened), Some(3))?;
    if let Some(Mesh { faces, ids, corner_normals, .. }) = mesh {
        let faces = faces.as_flattened();
        archive.array("faces", "<i8", faces, Some(3), |v| i64::from(v).to_le_bytes())?;
        if !ids.is_empty() {
            archive.array("ids", "<u8", ids, None, u64::to_le_bytes)?;
        }
        let corners = corner_normals.as_flattened().as_flattened();
        archive.floats("corner_normals", Some(corners).filter(|c| !c.is_empty()), Some(3))?;
    }
    archive.0.finish()?.flush()
}

struct Archive<W: Write>(ZipWriter<zip::write::StreamWriter<W>>);

impl<W: Write> Archive<W> {
    fn floats(&mut self, name: &str, values: Option<&[f64]>, width: Option<usize>) -> io::Result<()> {
        values.map_or(Ok(()), |values| self.array(name, "<f8", values, width, f64::to_le_bytes))
    }

    /// One array of numbers of eight bytes.
    fn array<T: Copy>(
        &mut self,
        name: &str,
        kind: &str,
        values: &[T],
        width: Option<usize>,
        bytes_of: impl Fn(T) -> [u8; 8],
    ) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(values.len() > (u32::MAX as usize) / 16);
        self.0.start_file(format!("{name}.npy"), options)?;
        self.0.write_all(&npy_header(kind, values.len(), width))?;
        let mut bytes = Vec::with_capacity(8 * 8192);
        for block in values.chunks(8192) {
            bytes.clear();
            bytes.extend(block.iter().flat_map(|v| bytes_of(*v)));
            self.0.write_all(&bytes)?;
        }
        Ok(())
    }
}

/// Version 1.0 of NumPy's array header for numbers of a kind in C order: magic, length, a Python dictionary padded
/// with spaces so that the data starts at a multiple of 64 bytes.
fn npy_header(kind: &str, len: usize, width: Option<usize>) -> Vec<u8> {
    let shape = match width {
        Some(width) => format!("({}, {width})", len / width),
        None => format!("({len},)"),
    };
    let mut text = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}");
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((text.len() as u16).to_le_bytes());
    header.extend(text.as_bytes());
    header
}

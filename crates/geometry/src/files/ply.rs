//! Stanford PLY, binary little endian, double precision.

use std::io::{self, Write};

use super::Columns;
use crate::PointCloud;

/// The cloud, and triangles over it where there are any.
pub(super) fn write(
    cloud: &PointCloud<'_>,
    faces: Option<&[[u32; 3]]>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let columns = Columns { cloud: *cloud };
    let what = if faces.is_some() { "a mesh of" } else { "points on" };
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment isoswarm: {what} an implicit surface")?;
    writeln!(out, "element vertex {}", cloud.len())?;
    for name in columns.names() {
        writeln!(out, "property double {name}")?;
    }
    if cloud.colors.is_some() {
        writeln!(out, "property uchar red\nproperty uchar green\nproperty uchar blue")?;
    }
    if let Some(faces) = faces {
        writeln!(out, "element face {}\nproperty list uchar int vertex_indices", faces.len())?;
    }
    writeln!(out, "end_header")?;

    let mut row = Vec::new();
    for i in 0..cloud.len() {
        columns.row(i, &mut row);
        for value in &row {
            out.write_all(&value.to_le_bytes())?;
        }
        if let Some(colors) = cloud.colors {
            out.write_all(&colors[i].map(|c| (c * 255.0).round() as u8))?;
        }
    }
    for face in faces.unwrap_or_default() {
        out.write_all(&[3])?;
        out.write_all(face.map(u32::to_le_bytes).as_flattened())?;
    }
    Ok(())
}

//! Stanford PLY, binary little endian, double precision.

use std::io::{self, Write};

use super::Columns;
use crate::PointCloud;

pub(super) fn write(cloud: &PointCloud<'_>, out: &mut dyn Write) -> io::Result<()> {
    let columns = Columns { cloud: *cloud };
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment isoswarm: points on an implicit surface")?;
    writeln!(out, "element vertex {}", cloud.len())?;
    for name in columns.names() {
        writeln!(out, "property double {name}")?;
    }
    if cloud.colors.is_some() {
        writeln!(out, "property uchar red\nproperty uchar green\nproperty uchar blue")?;
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
    Ok(())
}

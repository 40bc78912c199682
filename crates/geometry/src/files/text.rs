//! The two text formats. `{:?}` prints the shortest decimal that reads back as the same double.

use std::io::{self, Write};

use super::Columns;
use crate::PointCloud;

pub(super) fn write_obj(cloud: &PointCloud<'_>, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "# isoswarm: points on an implicit surface, one vn for each v in the same order")?;
    for [x, y, z] in cloud.points {
        writeln!(out, "v {x:?} {y:?} {z:?}")?;
    }
    for [x, y, z] in cloud.normals.unwrap_or_default() {
        writeln!(out, "vn {x:?} {y:?} {z:?}")?;
    }
    Ok(())
}

pub(super) fn write_csv(cloud: &PointCloud<'_>, out: &mut dyn Write) -> io::Result<()> {
    let columns = Columns { cloud: *cloud };
    writeln!(out, "{}", columns.names().join(","))?;
    let mut row = Vec::new();
    for i in 0..cloud.len() {
        columns.row(i, &mut row);
        for (k, value) in row.iter().enumerate() {
            write!(out, "{}{value:?}", if k == 0 { "" } else { "," })?;
        }
        writeln!(out)?;
    }
    Ok(())
}

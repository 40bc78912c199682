//! The two text formats. `{:?}` prints the shortest decimal that reads back as the same double.

use std::io::{self, Write};

use super::Columns;
use crate::PointCloud;

/// The cloud, and triangles over its points and over its normals, of which there may be more, where there are any.
pub(super) fn write_obj(
    cloud: &PointCloud<'_>,
    faces: Option<(&[[u32; 3]], &[[u32; 3]])>,
    out: &mut dyn Write,
) -> io::Result<()> {
    let what = if faces.is_some() { "a mesh of" } else { "points on" };
    let more = cloud.normals.is_some_and(|n| n.len() > cloud.points.len());
    let more = if more { ", then those of further sides" } else { "" };
    writeln!(out, "# isoswarm: {what} an implicit surface, one vn for each v in the same order{more}")?;
    for [x, y, z] in cloud.points {
        writeln!(out, "v {x:?} {y:?} {z:?}")?;
    }
    for [x, y, z] in cloud.normals.unwrap_or_default() {
        writeln!(out, "vn {x:?} {y:?} {z:?}")?;
    }
    let (faces, normals) = faces.unwrap_or_default();
    for (face, normals) in faces.iter().zip(normals) {
        let ([a, b, c], [k, l, m]) = (face.map(|v| v + 1), normals.map(|v| v + 1));
        if cloud.normals.is_some() {
            writeln!(out, "f {a}//{k} {b}//{l} {c}//{m}")?;
        } else {
            writeln!(out, "f {a} {b} {c}")?;
        }
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

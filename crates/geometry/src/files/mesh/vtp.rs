//! VTK's XML PolyData with appended raw data: each array is its length in bytes (64 bits) and its numbers.

use std::io::{self, Write};

use crate::Mesh;

/// An array as the file names it.
struct Array<'a> {
    kind: &'static str,
    name: &'static str,
    width: usize,
    count: usize,
    bytes: Box<dyn Fn(usize) -> [u8; 8] + 'a>,
}

impl<'a> Array<'a> {
    fn floats(name: &'static str, width: usize, v: &'a [f64]) -> Self {
        let bytes = Box::new(|i: usize| v[i].to_le_bytes());
        Self { kind: "Float64", name, width, count: v.len(), bytes }
    }

    fn integers(name: &'static str, count: usize, at: impl Fn(usize) -> u64 + 'a) -> Self {
        Self { kind: "Int64", name, width: 1, count, bytes: Box::new(move |i| at(i).to_le_bytes()) }
    }
}

pub(super) fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let corners = mesh.faces.as_flattened();
    let points = vec![Array::floats("Points", 3, mesh.points.as_flattened())];
    let polys = vec![
        Array::integers("connectivity", corners.len(), |i| u64::from(corners[i])),
        Array::integers("offsets", mesh.faces.len(), |i| 3 * (i as u64 + 1)),
    ];
    let mut data = Vec::new();
    if !mesh.normals.is_empty() {
        data.push(Array::floats("Normals", 3, mesh.normals.as_flattened()));
    }
    if !mesh.curvatures.is_empty() {
        data.push(Array::floats("Curvatures", 2, mesh.curvatures.as_flattened()));
    }
    if !mesh.ids.is_empty() {
        data.push(Array::integers("Ids", mesh.ids.len(), |i| mesh.ids[i]));
    }
    writeln!(
        out,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
         <PolyData>\n<Piece NumberOfPoints=\"{}\" NumberOfPolys=\"{}\">",
        mesh.points.len(),
        mesh.faces.len()
    )?;
    let mut offset = 0;
    let normals = if mesh.normals.is_empty() { "" } else { " Normals=\"Normals\"" };
    for (section, more, arrays) in
        [("PointData", normals, &data), ("Points", "", &points), ("Polys", "", &polys)]
    {
        writeln!(out, "<{section}{more}>")?;
        for a in arrays {
            writeln!(
                out,
                "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{offset}\"/>",
                a.kind, a.name, a.width
            )?;
            offset += 8 + 8 * a.count;
        }
        writeln!(out, "</{section}>")?;
    }
    write!(out, "</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_")?;
    for a in data.iter().chain(&points).chain(&polys) {
        out.write_all(&(8 * a.count as u64).to_le_bytes())?;
        for i in 0..a.count {
            out.write_all(&(a.bytes)(i))?;
        }
    }
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}

//! Binary STL: 80 bytes of header, the number of triangles, and 50 bytes each.

use std::io::{self, Write};

use isoswarm_field::vector::unit;

use crate::Mesh;

pub(super) fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let mut header = [b' '; 80];
    let text = b"isoswarm: a mesh of an implicit surface"; // not `solid`, which would say text
    header[..text.len()].copy_from_slice(text);
    out.write_all(&header)?;
    let count = u32::try_from(mesh.faces.len())
        .map_err(|_| io::Error::new(io::ErrorKind::InvalidInput, "STL counts triangles in 32 bits"))?;
    out.write_all(&count.to_le_bytes())?;
    let mut record = [0; 50]; // the last two bytes stay 0
    for f in 0..mesh.faces.len() {
        let corners = mesh.corners(f);
        let numbers = unit(mesh.face_vector(f)).into_iter().chain(corners.into_iter().flatten());
        for (bytes, v) in record.chunks_exact_mut(4).zip(numbers) {
            bytes.copy_from_slice(&(v as f32).to_le_bytes());
        }
        out.write_all(&record)?;
    }
    Ok(())
}

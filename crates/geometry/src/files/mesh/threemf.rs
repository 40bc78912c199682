//! 3MF, core specification: a zip of XML that says millimetres.

use std::io::{self, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::Mesh;

const TYPES: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
</Types>
"#;

const RELATIONS: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
<Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"#;

const MODEL: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<model unit="millimeter" xml:lang="en-US" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<metadata name="Application">isoswarm</metadata>
"#;

pub(super) fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let mut archive = ZipWriter::new_stream(out);
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, text) in [("[Content_Types].xml", TYPES), ("_rels/.rels", RELATIONS)] {
        archive.start_file(name, options)?;
        archive.write_all(text.as_bytes())?;
    }
    archive.start_file("3D/3dmodel.model", options.large_file(mesh.faces.len() > 20_000_000))?;
    model(mesh, &mut archive)?;
    archive.finish()?.flush()
}

fn model(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(MODEL.as_bytes())?;
    if mesh.faces.is_empty() {
        return out.write_all(b"<resources/><build/></model>\n"); // an object has at least one triangle
    }
    // A `model` must be a closed manifold; a `surface` need not.
    let kind = if mesh.topology().is_closed() { "model" } else { "surface" };
    write!(out, "<resources><object id=\"1\" type=\"{kind}\"><mesh>\n<vertices>\n")?;
    for [x, y, z] in &mesh.points {
        writeln!(out, "<vertex x=\"{x:?}\" y=\"{y:?}\" z=\"{z:?}\"/>")?;
    }
    out.write_all(b"</vertices>\n<triangles>\n")?;
    for [a, b, c] in &mesh.faces {
        writeln!(out, "<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>")?;
    }
    out.write_all(
        b"</triangles>\n</mesh></object></resources>\n<build><item objectid=\"1\"/></build>\n</model>\n",
    )
}

//! Binary glTF 2.0: a JSON chunk that describes the mesh and a binary chunk with its numbers.
//!
//! Numbers are single precision; the mesh's middle goes into the node's translation, so that a small mesh far from the
//! origin keeps its shape.

use std::io::{self, Write};

use serde_json::json;

use isoswarm_field::Aabb;
use isoswarm_field::vector::{V3, scale, sub, unit};

use crate::Mesh;

/// What glTF calls its component types and targets.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Y up: x, z, -y.
fn y_up([x, y, z]: V3) -> V3 {
    [x, z, -y]
}

pub(super) fn write(mesh: &Mesh, out: &mut dyn Write) -> io::Result<()> {
    let Some(bounds) = Aabb::around(&mesh.points).filter(|_| !mesh.faces.is_empty()) else {
        return frame(json!({ "asset": asset() }), &[], out);
    };
    let middle: V3 = [0, 1, 2].map(|a| 0.5 * bounds.lo[a] + 0.5 * bounds.hi[a]);
    let position: Vec<[f32; 3]> =
        mesh.points.iter().map(|&p| y_up(sub(p, middle)).map(|v| v as f32)).collect();
    let corner = |pick: fn(f32, f32) -> f32| -> [f32; 3] {
        position[1..].iter().fold(position[0], |m, p| [0, 1, 2].map(|a| pick(m[a], p[a])))
    };
    let mut parts = Parts::default();
    let min_max = (corner(f32::min), corner(f32::max));
    let mut attributes = serde_json::Map::new();
    let at = parts.floats(position.as_flattened(), 3, Some(min_max));
    attributes.insert("POSITION".into(), at.into());
    if !mesh.normals.is_empty() {
        let normal: Vec<[f32; 3]> =
            whole_normals(mesh).into_iter().map(|n| y_up(n).map(|v| v as f32)).collect();
        let at = parts.floats(normal.as_flattened(), 3, None);
        attributes.insert("NORMAL".into(), at.into());
    }
    let curvature: Vec<f32> = mesh.curvatures.as_flattened().iter().map(|&k| k as f32).collect();
    if !curvature.is_empty() && curvature.iter().all(|k| k.is_finite()) {
        let at = parts.floats(&curvature, 2, None);
        attributes.insert("_CURVATURE".into(), at.into());
    }
    let indices = parts.indices(mesh.faces.as_flattened());
    let primitive = json!({ "attributes": attributes, "indices": indices, "material": 0 });
    let description = json!({
        "asset": asset(),
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": y_up(middle) }],
        "meshes": [{ "primitives": [primitive] }],
        "materials": [{ "pbrMetallicRoughness": {
            "baseColorFactor": [0.75, 0.77, 0.8, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.6,
        } }],
        "accessors": parts.accessors,
        "bufferViews": parts.views,
        "buffers": [{ "byteLength": parts.bytes.len() }],
    });
    frame(description, &parts.bytes, out)
}

fn asset() -> serde_json::Value {
    json!({ "version": "2.0", "generator": "isoswarm" })
}

/// Unit normals everywhere: where the surface has none, that of the triangles around the vertex, and if that vanishes too,
/// some direction.
fn whole_normals(mesh: &Mesh) -> Vec<V3> {
    let mut around = vec![[0.0; 3]; mesh.points.len()];
    for f in 0..mesh.faces.len() {
        let n = mesh.face_vector(f);
        for v in mesh.faces[f] {
            around[v as usize] = sub(around[v as usize], scale(n, -1.0));
        }
    }
    let choose = |(n, around): (&V3, &V3)| {
        [unit(*n), unit(*around)].into_iter().find(|n| *n != [0.0; 3]).unwrap_or([0.0, 0.0, 1.0])
    };
    mesh.normals.iter().zip(&around).map(choose).collect()
}

/// The binary chunk and what describes it.
#[derive(Default)]
struct Parts {
    bytes: Vec<u8>,
    views: Vec<serde_json::Value>,
    accessors: Vec<serde_json::Value>,
}

impl Parts {
    /// Adds a view and gives its number.
    fn view(&mut self, bytes: impl Iterator<Item = [u8; 4]>, target: u32) -> usize {
        let start = self.bytes.len();
        bytes.for_each(|b| self.bytes.extend(b));
        let length = self.bytes.len() - start;
        self.views.push(json!({ "buffer": 0, "byteOffset": start, "byteLength": length, "target": target }));
        self.views.len() - 1
    }

    fn floats(&mut self, v: &[f32], width: usize, min_max: Option<([f32; 3], [f32; 3])>) -> usize {
        let view = self.view(v.iter().map(|v| v.to_le_bytes()), ARRAY_BUFFER);
        let mut accessor = json!({
            "bufferView": view, "componentType": FLOAT, "count": v.len() / width, "type": format!("VEC{width}"),
        });
        if let Some((min, max)) = min_max {
            (accessor["min"], accessor["max"]) = (json!(min), json!(max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn indices(&mut self, v: &[u32]) -> usize {
        let view = self.view(v.iter().map(|v| v.to_le_bytes()), ELEMENT_ARRAY_BUFFER);
        self.accessors.push(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": v.len(), "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }
}

/// Header and chunks, each a multiple of four bytes long.
fn frame(description: serde_json::Value, binary: &[u8], out: &mut dyn Write) -> io::Result<()> {
    let mut text = description.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let body = if binary.is_empty() { 0 } else { 8 + binary.len() };
    let total = 12 + 8 + text.len() + body;
    let long = |n: usize| {
        let n = u32::try_from(n);
        n.map_err(|_| io::Error::new(io::ErrorKind::FileTooLarge, "GLB holds up to 4 GiB: save as PLY"))
    };
    for number in [0x4654_6C67, 2, long(total)?, long(text.len())?, 0x4E4F_534A] {
        out.write_all(&u32::to_le_bytes(number))?;
    }
    out.write_all(&text)?;
    if !binary.is_empty() {
        out.write_all(&long(binary.len())?.to_le_bytes())?;
        out.write_all(&0x004E_4942u32.to_le_bytes())?;
        out.write_all(binary)?;
    }
    Ok(())
}

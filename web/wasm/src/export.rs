//! Floaters and samples as the bytes of files.

use isoswarm_geometry::{FileFormat, PointCloud};
use js_sys::Uint8Array;
use wasm_bindgen::prelude::*;

use crate::failure::{Failure, Thrown};
use crate::{Answer, Core};

/// The format of a file ending.
fn format(name: &str) -> Answer<FileFormat> {
    FileFormat::from_path(std::path::Path::new(&format!("points.{name}"))).thrown()
}

fn bytes(cloud: &PointCloud<'_>, name: &str) -> Answer<Uint8Array> {
    cloud.check().thrown()?;
    let mut out = Vec::new();
    format(name)?.write(cloud, &mut out).map_err(|e| Failure::input(e.to_string()))?;
    Ok(Uint8Array::from(&out[..]))
}

/// Points (3 numbers each), unit normals and radii as a file: `ply`, `obj`, `csv` or `npz`.
#[wasm_bindgen]
pub fn points_file(format: &str, points: &[f64], normals: &[f64], radii: &[f64]) -> Answer<Uint8Array> {
    let cloud = PointCloud::new(points.as_chunks().0).with_normals(normals.as_chunks().0).with_radii(radii);
    bytes(&cloud, format)
}

#[wasm_bindgen]
impl Core {
    /// Even samples as a file, started from the floaters: so many, or with the scene's spacing (0).
    pub fn export_samples(&self, format: &str, count: usize) -> Answer<Uint8Array> {
        let s = self.scene.samples((count > 0).then_some(count)).thrown()?;
        let cloud = PointCloud::new(&s.points)
            .with_normals(&s.normals)
            .with_areas(&s.areas)
            .with_curvatures(&s.curvatures);
        bytes(&cloud, format)
    }
}

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

#[wasm_bindgen]
impl Core {
    /// The floaters as a file: `ply`, `obj`, `csv` or `npz`.
    pub fn export_points(&self, format: &str) -> Answer<Uint8Array> {
        let f = self.scene.frame().floaters;
        let cloud = PointCloud::new(&f.points).with_normals(&f.normals).with_radii(&f.sigma);
        bytes(&cloud, format)
    }

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

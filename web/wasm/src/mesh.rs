//! Triangles of the surface: a long job, which the client runs in a worker of its own.

use std::ops::ControlFlow;
use std::path::Path;

use isoswarm_field::Aabb;
use isoswarm_geometry::{LiveMesh, MeshFormat, MeshOptions, Meshed, Resolution, mesh};
use isoswarm_particles::Stop;
use js_sys::{Float32Array, Uint8Array, Uint32Array};
use wasm_bindgen::prelude::*;

use crate::failure::{Failure, Thrown};
use crate::{Answer, Core, to_json};

/// A mesh and the account of how it was made.
#[wasm_bindgen]
pub struct Triangles(Meshed);

#[wasm_bindgen]
impl Triangles {
    /// Positions, 3 a vertex.
    pub fn positions(&self) -> Float32Array {
        crate::frame::short(&self.0.mesh.points)
    }

    /// Unit normals, 3 a vertex.
    pub fn normals(&self) -> Float32Array {
        crate::frame::short(&self.0.mesh.normals)
    }

    /// Numbers of the vertices, 3 a triangle.
    pub fn indices(&self) -> Uint32Array {
        Uint32Array::from(self.0.mesh.faces.as_flattened())
    }

    /// Whether it is closed, and what there is to say.
    pub fn report(&self) -> Answer<String> {
        let r = &self.0.report;
        let closed = r.topology.is_closed();
        let what = format!("{} vertices, {} triangles", self.0.mesh.points.len(), self.0.mesh.faces.len());
        let report = std::iter::once(what).chain(r.warnings.iter().cloned()).collect::<Vec<_>>().join("; ");
        to_json(&serde_json::json!({ "closed": closed, "report": report }))
    }

    /// The bytes of a file: `ply`, `obj`, `stl`, `glb`, `3mf`, `vtp` or `npz`.
    pub fn file(&self, format: &str) -> Answer<Uint8Array> {
        let format = MeshFormat::from_path(Path::new(&format!("mesh.{format}"))).thrown()?;
        self.0.mesh.check().thrown()?;
        let mut out = Vec::new();
        format.write(&self.0.mesh, None, &mut out).map_err(|e| Failure::input(e.to_string()))?;
        Ok(Uint8Array::from(&out[..]))
    }
}

/// Triangles over floaters that follow them from call to call.
#[wasm_bindgen]
#[derive(Default)]
pub struct Live(Option<([f64; 6], LiveMesh)>);

#[wasm_bindgen]
impl Live {
    /// None yet.
    #[wasm_bindgen(constructor)]
    pub fn new() -> Live {
        Live::default()
    }

    /// Triangles over the floaters, 3 numbers of rows each. Their points and normals have 3 numbers each; the surface ends on the box
    /// of which these are the smallest and the largest corner.
    pub fn faces(
        &mut self,
        bounds: &[f64],
        points: &[f64],
        normals: &[f64],
        ids: &[u32],
        spacing: f64,
    ) -> Answer<Uint32Array> {
        let Ok(bounds) = <[f64; 6]>::try_from(bounds) else {
            return Err(Failure::input("expected two corners of a box").into());
        };
        if self.0.as_ref().is_none_or(|(of, _)| *of != bounds) {
            let corner = |k: usize| [bounds[k], bounds[k + 1], bounds[k + 2]];
            self.0 = Some((bounds, LiveMesh::new(Aabb { lo: corner(0), hi: corner(3) })));
        }
        let Some((_, live)) = &mut self.0 else { return Ok(Uint32Array::new_with_length(0)) };
        let ids: Vec<u64> = ids.iter().map(|id| u64::from(*id)).collect();
        live.update(points.as_chunks().0, normals.as_chunks().0, &ids, spacing);
        Ok(Uint32Array::from(live.mesh().faces.as_flattened()))
    }
}

#[wasm_bindgen]
impl Core {
    /// Triangles with this mean distance between vertices (0: the scene's). `tell(done, of, remaining)` is called now and then;
    /// true ends it.
    pub fn mesh(&self, spacing: f64, tell: &js_sys::Function) -> Answer<Triangles> {
        let frame = self.scene.frame();
        let spacing = if spacing > 0.0 { spacing } else { frame.spacing };
        let mut progress = |p: &isoswarm_particles::Progress| {
            let done = JsValue::from(p.fraction);
            let stop =
                tell.call3(&JsValue::NULL, &done, &1.0.into(), &0.0.into()).is_ok_and(|v| v.is_truthy());
            if stop { ControlFlow::Break(Stop::Cancelled) } else { ControlFlow::Continue(()) }
        };
        let options = MeshOptions {
            resolution: Resolution::Spacing(spacing),
            seed: self.scene.settings().seed,
            progress: Some(&mut progress),
            ..MeshOptions::default()
        };
        mesh(self.scene.field(), frame.bounds, options).thrown().map(Triangles)
    }
}

//! What there is to draw: columns of the floaters as typed arrays.

use isoswarm_field::Surface;
use isoswarm_scene::Scene;
use js_sys::{Float32Array, Float64Array, Uint32Array};
use serde_json::json;
use wasm_bindgen::prelude::*;

use crate::failure::Thrown;
use crate::{Answer, Core, report, state, to_json};

/// Births and deaths up to the last frame.
#[derive(Clone, Copy, Default)]
pub struct Since {
    births: u64,
    deaths: u64,
}

impl Since {
    pub fn of(scene: &Scene) -> Self {
        let f = scene.frame();
        Self { births: f.births, deaths: f.deaths }
    }
}

/// Diagonal of the box around the floaters (model units).
pub fn size(scene: &Scene) -> f64 {
    scene.frame().size
}

pub(crate) fn short(rows: &[[f64; 3]]) -> Float32Array {
    let flat: Vec<f32> = rows.iter().flatten().map(|v| *v as f32).collect();
    Float32Array::from(&flat[..])
}

#[wasm_bindgen]
impl Core {
    /// All of a frame but its columns, and what has happened since the last.
    pub fn frame(&mut self) -> Answer<String> {
        let f = self.scene.frame();
        let now = Since::of(&self.scene);
        let then = std::mem::replace(&mut self.since, now);
        let json = json!({
            "clock": f.clock,
            "count": f.floaters.len(),
            "pins": state::pins(&self.scene)?,
            "spacing": f.spacing,
            "size": f.size,
            "bounds": [f.bounds.lo, f.bounds.hi],
            "moving": self.scene.is_moving(),
            "drag": self.scene.dragging().thrown()?.as_ref().map(report::drag),
            "transfer": self.scene.adapting().map(report::transfer),
            "births": now.births.saturating_sub(then.births),
            "deaths": now.deaths.saturating_sub(then.deaths),
            "off": f.floaters.off,
        });
        to_json(&json)
    }

    /// Positions, 3 a floater.
    pub fn positions(&self) -> Float32Array {
        short(&self.scene.frame().floaters.points)
    }

    /// Positions to the last bit.
    pub fn exact(&self) -> Float64Array {
        Float64Array::from(self.scene.frame().floaters.points.as_flattened())
    }

    /// Normals to the last bit.
    pub fn exact_normals(&self) -> Float64Array {
        Float64Array::from(self.scene.frame().floaters.normals.as_flattened())
    }

    /// Repulsion radii to the last bit.
    pub fn exact_radii(&self) -> Float64Array {
        Float64Array::from(&self.scene.frame().floaters.sigma[..])
    }

    /// Mean distance between neighbours (model units).
    pub fn spacing(&self) -> f64 {
        self.scene.frame().spacing
    }

    /// Smallest and largest corner of the box that clips the surface.
    pub fn bounds(&self) -> Float64Array {
        let b = self.scene.frame().bounds;
        Float64Array::from([b.lo, b.hi].as_flattened())
    }

    /// Unit normals, 3 a floater.
    pub fn normals(&self) -> Float32Array {
        short(&self.scene.frame().floaters.normals)
    }

    /// Repulsion radii.
    pub fn radii(&self) -> Float32Array {
        let sigma: Vec<f32> = self.scene.frame().floaters.sigma.iter().map(|v| *v as f32).collect();
        Float32Array::from(&sigma[..])
    }

    /// Identities.
    pub fn ids(&self) -> Uint32Array {
        let ids: Vec<u32> = self.scene.frame().floaters.id.iter().map(|v| *v as u32).collect();
        Uint32Array::from(&ids[..])
    }

    /// Mean curvature of the surface at each floater.
    pub fn curvature(&self) -> Float32Array {
        let points = &self.scene.frame().floaters.points;
        let k = isoswarm_particles::principal_curvatures(self.scene.field(), points);
        let mean: Vec<f32> = k.iter().map(|[a, b]| (0.5 * (a + b)) as f32).collect();
        Float32Array::from(&mean[..])
    }

    /// |F|/|∇F| at each floater.
    pub fn error(&self) -> Answer<Float32Array> {
        let off: Vec<f32> = self.distances()?.iter().map(|d| *d as f32).collect();
        Ok(Float32Array::from(&off[..]))
    }

    /// Values of all parameters.
    pub fn values(&self) -> Float64Array {
        let values: Vec<f64> = self.scene.field().parameters().iter().map(|p| p.value).collect();
        Float64Array::from(&values[..])
    }

    /// How evenly the floaters lie, and how far off the surface.
    pub fn evenness(&self) -> Answer<String> {
        let f = self.scene.frame();
        let axes = self.scene.field().axes();
        let e = isoswarm_particles::metrics::evenness(
            &f.floaters.points,
            &f.floaters.normals,
            Some(f.bounds),
            axes,
        );
        let off = self.distances()?;
        let square: f64 = off.iter().map(|d| d * d).sum();
        to_json(&json!({
            "rho_min": e.rho_min,
            "rho_avg": e.rho_avg,
            "cv": e.cv,
            "six_valent": e.six_valent,
            "coverage": e.coverage,
            "error_rms": (square / off.len().max(1) as f64).sqrt(),
            "error_max": off.iter().copied().fold(0.0, f64::max),
        }))
    }
}

impl Core {
    fn distances(&self) -> Answer<Vec<f64>> {
        let points = &self.scene.frame().floaters.points;
        let (mut f, mut g) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
        self.scene.field().value_gradient(points, &mut f, &mut g).thrown()?;
        let length = |g: &[f64; 3]| isoswarm_field::vector::norm(*g);
        Ok(f.iter().zip(&g).map(|(f, g)| if *f == 0.0 { 0.0 } else { f.abs() / length(g) }).collect())
    }
}

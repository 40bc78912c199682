//! Primary hits and normals of a picture of 512 × 512: fidget's voxel render, 512 voxels deep, beside isoswarm's ray caster, one thread each,
//! the same parallel view.

use std::sync::atomic::AtomicBool;

use fidget::context::Context;
use fidget::jit::JitShape;
use fidget::raster::voxel::{EvalConfig, RenderConfig, RenderSize, render as voxels};
use isoswarm_field::vector::{cross, unit};
use isoswarm_field::{Aabb, Field, Model, text, vm};
use isoswarm_geometry::render::{CastOptions, Caster, Clip, Pose, SIDE, View};
use nalgebra::Matrix4;
use serde_json::{Value, json};

use crate::timing::{Uniform, fastest};

const SIZE: usize = 512;

/// 16 Gaussian blobs, a gyroid in a ball, and the CSG part.
pub fn models(part: &str) -> [(&'static str, Model); 3] {
    let mut u = Uniform(16);
    let mut blobs = "1".to_string();
    for _ in 0..16 {
        let [x, y, z] = [(); 3].map(|()| u.between(-1.0, 1.0));
        let k = 2.0 / u.between(0.45, 0.65).powi(2);
        blobs += &format!(" - exp(2 - {k:.6}*((x - {x:.6})^2 + (y - {y:.6})^2 + (z - {z:.6})^2))");
    }
    let gyroid = "max(sin(6*x)*cos(6*y) + sin(6*y)*cos(6*z) + sin(6*z)*cos(6*x), sqrt(x^2 + y^2 + z^2) - 1)";
    let parsed = |formula: &str| text::parse(formula, &[]).expect("a formula");
    [
        ("16 blobs", parsed(&blobs)),
        ("gyroid in a ball", parsed(gyroid)),
        ("CSG part", vm::parse_vm(part).expect("a .vm model")),
    ]
}

/// Milliseconds of both, and how many pixels each covers.
pub fn compare(name: &str, model: &Model, runs: usize) -> Value {
    let field = Field::new(model).expect("a model");
    let b = field.bounds().expect("bounds");
    let center = [0, 1, 2].map(|a| 0.5 * (b.lo[a] + b.hi[a]));
    let half = 0.5 * b.diagonal();
    let toward = unit([2.0, -3.0, 1.2]);
    let right = unit([3.0, 2.0, 0.0]);
    let up = cross(toward, right);

    let clip = Clip::new(b);
    let eye = [0, 1, 2].map(|a| center[a] + half * toward[a]);
    let view = View::parallel(Pose { eye, axes: [right, up, toward] }, 2.0 * half, SIZE as f64, SIZE as f64);
    let columns = SIZE / SIDE;
    let at = |k: usize| (k * SIDE) as f64 + 0.5;
    let tile = |k: usize| view.tile(at(k % columns), at(k / columns), 1.0, &clip, |_, _| true);
    let (options, stop) = (CastOptions::default(), AtomicBool::new(false));
    let mut ours = 0;
    let seconds = fastest(runs, || {
        let caster = Caster::new(&field, &b).expect("a field in space");
        let tiles = caster.tiles(columns * columns, tile, &options, &stop).expect("nobody stops it");
        ours = tiles.iter().map(Vec::len).sum();
    });

    let text = vm::Program::of(model).expect("operations that both know").to_text();
    let (context, root) = Context::from_text(text.as_bytes()).expect("a .vm model");
    let shape = JitShape::new(&context, root).expect("the node is in the context");
    let column = |v: [f64; 3]| v.map(|v| (half * v) as f32);
    let (r, u, t, c) = (column(right), column(up), column(toward), center.map(|v| v as f32));
    #[rustfmt::skip]
    let world_to_model = Matrix4::new(
        r[0], u[0], t[0], c[0],
        r[1], u[1], t[1], c[1],
        r[2], u[2], t[2], c[2],
        0.0, 0.0, 0.0, 1.0,
    );
    let config = RenderConfig { image_size: RenderSize::from(SIZE as u32), world_to_model };
    let one = EvalConfig { threads: None, ..Default::default() };
    let mut theirs = 0;
    let peer = fastest(runs, || {
        let bound = shape.clone().try_into().expect("no further variables");
        let image = voxels(bound, &config, &one).expect("nobody stops it");
        theirs = image.iter().filter(|p| p.depth > 0).count();
    });
    let bounds: Aabb = b;
    json!({ "model": name, "isoswarm_ms": 1e3 * seconds, "fidget_ms": 1e3 * peer, "isoswarm_pixels": ours, "fidget_pixels": theirs, "lo": bounds.lo, "hi": bounds.hi })
}

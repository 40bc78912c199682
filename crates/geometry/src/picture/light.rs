//! How much light reaches each disc: the scene is looked at from many directions of the sky and from the key light, and
//! each disc counts from where it is seen. Smooth, the same from every camera, and the ground gets its shadow from it.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::progress::{LIGHT, Stage, Told};
use super::scene::Scene;
use super::vector::{V3, add, dot, frame, scaled, unit};
use crate::GeometryError;

/// Light that reaches the two sides of a disc.
#[derive(Clone, Copy, Default, Debug)]
pub(super) struct Light {
    /// Sky light, cosine-weighted; 1 under an open, evenly bright sky.
    pub sky: [f32; 2],
    /// The part of the (soft) key light that is not in a shadow, 0 to 1.
    pub key: [f32; 2],
}

/// Light on a square of ground around the origin.
pub(super) struct Ground {
    /// Height along `up`.
    pub height: f32,
    frame: (V3, V3),
    light: Vec<Light>,
}

/// Direction to the key light, in view space: from above the camera's left shoulder.
pub(super) const KEY: V3 = [-0.42, 0.68, 0.60];
/// Half the ground's side, in radii of the scene's ball.
pub(super) const GROUND_REACH: f32 = 2.4;
const GROUND_CELLS: usize = 160;
const GROUND_BLUR: isize = 2;
/// Cells along a depth map's side, least and most, and how many a disc's radius should have.
const MAP: [f32; 2] = [96.0, 400.0];
const CELLS_A_RADIUS: f32 = 2.5;
const BATCH: usize = 16;
const KEY_RAYS: usize = 16;
/// Tangent of the key light's angular radius: a lamp the size of a fist at arm's length.
const KEY_SPREAD: f32 = 0.13;

/// Farthest surface towards the light, on a square grid over the unit ball.
struct DepthMap {
    toward: V3,
    u: V3,
    v: V3,
    /// Cells along a side.
    side: usize,
    depth: Vec<f32>,
}

/// A place where light arrives.
pub(super) struct Receiver {
    pub position: V3,
    pub normal: V3,
    /// Of the discs that stand for the surface here: nothing so near throws a shadow on it.
    pub radius: f32,
}

/// Light on the scene's discs that are drawn, then on the others; and on the ground.
pub(super) fn gather(
    scene: &Scene,
    others: Vec<Receiver>,
    ground: bool,
    stop: &AtomicBool,
    told: Told,
) -> Result<(Vec<Light>, Option<Ground>), GeometryError> {
    let ground = ground.then(|| GroundPlane::new(scene));
    let mut receivers: Vec<Receiver> = (0..scene.drawn)
        .map(|i| Receiver { position: scene.position[i], normal: scene.normal[i], radius: scene.radius[i] })
        .collect();
    receivers.extend(others);
    let wanted = receivers.len();
    if let Some(ground) = &ground {
        receivers.extend(ground.receivers(scene.up));
    }
    let mut light = vec![Light::default(); receivers.len()];

    let mean = scene.radius.iter().map(|r| f64::from(*r)).sum::<f64>() / scene.len().max(1) as f64;
    let side = (2.0 * CELLS_A_RADIUS / (mean as f32).max(1e-6)).clamp(MAP[0], MAP[1]) as usize;

    // Fewer directions for very many points: their number times the points is what costs.
    let skies = (12_000_000 / scene.len().max(1)).clamp(32, 112);
    let sky: Vec<V3> = sphere(skies);
    let key = cone(unit(KEY), KEY_RAYS);
    let stage = Stage::new(told, LIGHT.0, LIGHT.1, sky.len().div_ceil(BATCH) + key.len().div_ceil(BATCH));
    for (directions, is_sky) in [(&sky, true), (&key, false)] {
        for batch in directions.chunks(BATCH) {
            if stop.load(Ordering::Relaxed) {
                return Err(GeometryError::Cancelled);
            }
            let maps: Vec<DepthMap> = batch.par_iter().map(|d| DepthMap::new(scene, *d, side)).collect();
            light.par_iter_mut().zip(&receivers).with_min_len(256).for_each(|(light, receiver)| {
                for map in &maps {
                    let cosine = dot(map.toward, receiver.normal);
                    let side = usize::from(cosine < 0.0);
                    let seen = map.sees(receiver, cosine);
                    if is_sky {
                        // The sky is brighter above. The mean of a cosine over the sphere of directions is 1/4.
                        let sky = 0.72 + 0.28 * dot(map.toward, scene.up);
                        light.sky[side] += seen * cosine.abs() * sky * 4.0 / skies as f32;
                    } else {
                        light.key[side] += seen / KEY_RAYS as f32;
                    }
                }
            });
            stage.tick();
        }
    }
    let ground = ground.map(|plane| plane.lit(light.split_off(wanted)));
    Ok((light, ground))
}

impl DepthMap {
    fn new(scene: &Scene, toward: V3, side: usize) -> Self {
        let (u, v) = frame(toward);
        let mut depth = vec![f32::NEG_INFINITY; side * side];
        let texel = 2.0 / side as f32;
        for i in 0..scene.len() {
            let (p, n) = (scene.position[i], scene.normal[i]);
            // No smaller than a texel, or small discs would fall through the grid.
            let r = scene.radius[i].max(0.8 * texel);
            let (x, y, z) = (dot(p, u), dot(p, v), dot(p, toward));
            let (nu, nv, nw) = (dot(n, u), dot(n, v), dot(n, toward));
            if nw.abs() < 0.03 {
                continue;
            }
            let (slope_u, slope_v) = (-nu / nw, -nv / nw);
            let reach_u = r * (1.0 - nu * nu).max(0.0).sqrt();
            let reach_v = r * (1.0 - nv * nv).max(0.0).sqrt();
            let cells = |x: f32, reach: f32| {
                let low = ((x - reach + 1.0) / texel - 0.5).ceil().max(0.0) as usize;
                let high = ((x + reach + 1.0) / texel - 0.5).floor().min(side as f32 - 1.0);
                low..(high + 1.0).max(0.0) as usize
            };
            for row in cells(y, reach_v) {
                let b = (row as f32 + 0.5) * texel - 1.0 - y;
                for column in cells(x, reach_u) {
                    let a = (column as f32 + 0.5) * texel - 1.0 - x;
                    let h = slope_u * a + slope_v * b;
                    if a * a + b * b + h * h <= r * r {
                        let cell = &mut depth[row * side + column];
                        *cell = cell.max(z + h);
                    }
                }
            }
        }
        Self { toward, u, v, side, depth }
    }

    /// How much of the light from this direction reaches a receiver, 0 to 1: four nearest cells, weighted.
    fn sees(&self, receiver: &Receiver, cosine: f32) -> f32 {
        let texel = 2.0 / self.side as f32;
        // Off the surface, on the side that is lit, by more than a disc of the neighbourhood can stick out.
        let lift = (1.2 * texel + 0.6 * receiver.radius).copysign(cosine);
        let p = add(receiver.position, scaled(receiver.normal, lift));
        let x = (dot(p, self.u) + 1.0) / texel - 0.5;
        let y = (dot(p, self.v) + 1.0) / texel - 0.5;
        let z = dot(p, self.toward) + texel;
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let open = |dx: i32, dy: i32| {
            let (column, row) = (x0 as i32 + dx, y0 as i32 + dy);
            let inside = (0..self.side as i32).contains(&column) && (0..self.side as i32).contains(&row);
            f32::from(!inside || self.depth[row as usize * self.side + column as usize] <= z)
        };
        (open(0, 0) * (1.0 - fx) + open(1, 0) * fx) * (1.0 - fy)
            + (open(0, 1) * (1.0 - fx) + open(1, 1) * fx) * fy
    }
}

struct GroundPlane {
    height: f32,
    frame: (V3, V3),
}

impl GroundPlane {
    fn new(scene: &Scene) -> Self {
        let lowest = (0..scene.len())
            .map(|i| {
                let tilt = dot(scene.normal[i], scene.up);
                dot(scene.position[i], scene.up) - scene.radius[i] * (1.0 - tilt * tilt).max(0.0).sqrt()
            })
            .fold(1.0, f32::min);
        Self { height: lowest - 0.004, frame: frame(scene.up) }
    }

    fn receivers(&self, up: V3) -> impl Iterator<Item = Receiver> {
        let (u, v) = self.frame;
        let base = scaled(up, self.height);
        (0..GROUND_CELLS * GROUND_CELLS).map(move |k| {
            let at = |k: usize| ((k as f32 + 0.5) / GROUND_CELLS as f32 * 2.0 - 1.0) * GROUND_REACH;
            let position = add(base, add(scaled(u, at(k % GROUND_CELLS)), scaled(v, at(k / GROUND_CELLS))));
            Receiver { position, normal: up, radius: 0.0 }
        })
    }

    fn lit(self, mut light: Vec<Light>) -> Ground {
        // Three box filters are nearly a Gaussian: hides that the sky has a finite number of directions.
        for _ in 0..3 {
            light = blurred(&light, 1);
            light = blurred(&light, GROUND_CELLS);
        }
        Ground { height: self.height, frame: self.frame, light }
    }
}

/// Box filter along one axis of the ground's grid; `step` is the distance between neighbours in memory.
fn blurred(light: &[Light], step: usize) -> Vec<Light> {
    let clamped = |k: isize| k.clamp(0, GROUND_CELLS as isize - 1) as usize;
    (0..light.len())
        .map(|i| {
            let along = i / step % GROUND_CELLS;
            let mut sum = Light::default();
            for d in -GROUND_BLUR..=GROUND_BLUR {
                let other = light[i - along * step + clamped(along as isize + d) * step];
                let share = 1.0 / (2 * GROUND_BLUR + 1) as f32;
                sum.sky[0] += share * other.sky[0];
                sum.key[0] += share * other.key[0];
            }
            sum
        })
        .collect()
}

impl Ground {
    /// (sky light, key light, distance from the middle in `GROUND_REACH`) at a point of the plane; open light outside.
    pub fn at(&self, p: V3) -> (f32, f32, f32) {
        let (a, b) = (dot(p, self.frame.0) / GROUND_REACH, dot(p, self.frame.1) / GROUND_REACH);
        let away = (a * a + b * b).sqrt();
        if away >= 1.0 || away.is_nan() {
            return (1.0, 1.0, 1.0);
        }
        let cell =
            |a: f32| (((a + 1.0) * 0.5 * GROUND_CELLS as f32) - 0.5).clamp(0.0, GROUND_CELLS as f32 - 1.001);
        let (x, y) = (cell(a), cell(b));
        let (column, row) = (x as usize, y as usize);
        let (fx, fy) = (x - column as f32, y - row as f32);
        let mut sum = [0.0; 2];
        for (dx, dy, w) in [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ] {
            let light = self.light[(row + dy) * GROUND_CELLS + column + dx];
            sum[0] += w * light.sky[0];
            sum[1] += w * light.key[0];
        }
        (sum[0], sum[1], away)
    }
}

/// Directions spread evenly over the sphere: a Fibonacci spiral.
fn sphere(n: usize) -> Vec<V3> {
    (0..n)
        .map(|k| {
            let z = 1.0 - (2 * k + 1) as f64 / n as f64;
            let r = (1.0 - z * z).sqrt();
            let (s, c) = libm::sincos(2.399_963_229_728_653 * k as f64);
            [(r * c) as f32, (r * s) as f32, z as f32]
        })
        .collect()
}

/// Directions spread evenly over a cone about `axis`: a sunflower.
fn cone(axis: V3, n: usize) -> Vec<V3> {
    let (u, v) = frame(axis);
    (0..n)
        .map(|k| {
            let r = KEY_SPREAD * (((k as f64 + 0.5) / n as f64).sqrt() as f32);
            let (s, c) = libm::sincos(2.399_963_229_728_653 * k as f64);
            unit(add(axis, add(scaled(u, r * c as f32), scaled(v, r * s as f32))))
        })
        .collect()
}

//! Discs to samples to pixels, tile by tile. Tiles are independent and each draws its discs in their order, so that the
//! number of threads never shows.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::camera::Camera;
use super::color::{byte, linear};
use super::light::Light;
use super::options::{PictureOptions, Style};
use super::scene::Scene;
use super::shade::{Spot, Studio};
use super::vector::{V3, add, dot, mixed, scaled, unit};
use crate::GeometryError;

/// Side of a tile in pixels.
const TILE: usize = 32;
/// Radius of the discs that decide what is visible in a surface, over the disc's radius: closes the gaps.
const SEEN: f32 = 1.6;
/// How far discs seen from behind step back, in radii: at the horizon of a closed surface those seen from the front win.
const STEP_BACK: f32 = 1.5;
/// Weight of a disc seen from behind: it counts only where there is none seen from the front.
const WEIGHT_BEHIND: f32 = 0.01;
/// Radius of the kernel that blends a surface, over the disc's radius.
const BLEND: f32 = 2.2;
const NOTHING: u32 = u32::MAX;

/// One disc relative to the eye.
#[derive(Clone, Copy)]
struct Disc {
    center: V3,
    normal: V3,
    radius: f32,
}

/// Everything that tiles share.
pub(super) struct Raster<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub light: &'a [Light],
    pub studio: &'a Studio<'a>,
    pub width: usize,
    pub height: usize,
    /// Samples a pixel and direction.
    pub samples: usize,
    pub mode: Mode,
    pub outline: f32,
}

/// What is drawn.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Mode {
    /// Every disc by itself; one sees through the gaps.
    Separate,
    /// Splats that blend into a surface.
    Smooth,
    /// Discs drawn onto that surface, which has this linear colour.
    Painted(V3),
}

/// Weighted sums of what the splats at a sample say.
#[derive(Clone, Copy)]
struct Blend {
    weight: f32,
    normal: V3,
    color: V3,
    sky: f32,
    key: f32,
    /// The disc whose centre is nearest, in units of its radius, and that (distance / `BLEND`)² over the
    /// disc's weight.
    owner: u32,
    rho: f32,
}

const EMPTY: Blend = Blend {
    weight: 0.0,
    normal: [0.0; 3],
    color: [0.0; 3],
    sky: 0.0,
    key: 0.0,
    owner: NOTHING,
    rho: f32::INFINITY,
};

/// The samples of a tile.
struct Tile {
    /// First pixel.
    x: usize,
    y: usize,
    /// Depth and disc of the nearest hit.
    depth: Vec<f32>,
    disc: Vec<u32>,
    blend: Vec<Blend>,
}

impl<'a> Raster<'a> {
    pub fn new(
        scene: &'a Scene,
        camera: &'a Camera,
        light: &'a [Light],
        studio: &'a Studio<'a>,
        options: &PictureOptions,
    ) -> Self {
        Self {
            scene,
            camera,
            light,
            studio,
            width: options.width as usize,
            height: options.height as usize,
            samples: options.supersampling as usize,
            mode: match (options.style, options.body) {
                // Balls have nothing to blend.
                _ if scene.round => Mode::Separate,
                (Style::Surface, _) => Mode::Smooth,
                (Style::Discs, Some(body)) => Mode::Painted(linear(body)),
                (Style::Discs, None) => Mode::Separate,
            },
            outline: options.outline as f32,
        }
    }

    /// The picture's bytes.
    pub fn draw(&self, stop: &AtomicBool) -> Result<Vec<u8>, GeometryError> {
        let columns = self.width.div_ceil(TILE);
        let bins = self.bins(columns, self.height.div_ceil(TILE));
        let mut rgba = vec![0; 4 * self.width * self.height];
        rgba.par_chunks_mut(4 * self.width * TILE).enumerate().for_each_init(
            || self.blank_tile(),
            |tile, (row, strip)| {
                for column in 0..columns {
                    if stop.load(Ordering::Relaxed) {
                        return;
                    }
                    (tile.x, tile.y) = (column * TILE, row * TILE);
                    self.draw_tile(tile, bins.of(row * columns + column), strip);
                }
            },
        );
        if stop.load(Ordering::Relaxed) { Err(GeometryError::Cancelled) } else { Ok(rgba) }
    }

    fn disc(&self, i: usize) -> Disc {
        let (p, eye) = (self.scene.position[i], self.camera.eye);
        Disc {
            center: [p[0] - eye[0], p[1] - eye[1], p[2] - eye[2]],
            normal: self.scene.normal[i],
            radius: self.scene.radius[i],
        }
    }

    /// Which discs may touch which tile, each tile's in ascending order.
    fn bins(&self, columns: usize, rows: usize) -> Bins {
        let grow = if self.mode == Mode::Separate { self.scene.shown } else { BLEND };
        let spans: Vec<[u32; 4]> = (0..self.scene.len())
            .into_par_iter()
            .map(|i| {
                let d = self.disc(i);
                let Some([left, top, right, bottom]) =
                    self.camera.bounds(d.center, d.normal, d.radius * grow)
                else {
                    return [0; 4];
                };
                let cell = |v: f32, most: usize| ((v / TILE as f32).max(0.0) as usize).min(most) as u32;
                let end = |v: f32, most: usize| if v < 0.0 { 0 } else { cell(v, most - 1) + 1 };
                [cell(left, columns), end(right, columns), cell(top, rows), end(bottom, rows)]
            })
            .collect();
        let mut start = vec![0usize; columns * rows + 1];
        let each = |span: &[u32; 4], f: &mut dyn FnMut(usize)| {
            for row in span[2]..span[3] {
                for column in span[0]..span[1] {
                    f(row as usize * columns + column as usize);
                }
            }
        };
        for span in &spans {
            each(span, &mut |tile| start[tile + 1] += 1);
        }
        for tile in 0..columns * rows {
            start[tile + 1] += start[tile];
        }
        let mut next = start.clone();
        let mut discs = vec![0u32; start[columns * rows]];
        for (i, span) in spans.iter().enumerate() {
            each(span, &mut |tile| {
                discs[next[tile]] = i as u32;
                next[tile] += 1;
            });
        }
        Bins { start, discs }
    }

    fn blank_tile(&self) -> Tile {
        let n = (TILE * self.samples).pow(2);
        let blends = if self.mode == Mode::Separate { 0 } else { n };
        Tile { x: 0, y: 0, depth: vec![0.0; n], disc: vec![0; n], blend: vec![EMPTY; blends] }
    }

    fn draw_tile(&self, tile: &mut Tile, discs: &[u32], strip: &mut [u8]) {
        if !discs.is_empty() {
            tile.depth.fill(f32::INFINITY);
            tile.disc.fill(NOTHING);
            for &i in discs {
                let disc = self.disc(i as usize);
                let behind = dot(disc.normal, disc.center) > 0.0;
                let (grow, step) = match (self.mode, behind) {
                    (Mode::Separate, _) => (self.scene.shown, 0.0),
                    (_, false) => (SEEN, 0.0),
                    (_, true) => (SEEN, STEP_BACK * disc.radius),
                };
                let (depth, ids) = (&mut tile.depth, &mut tile.disc);
                self.cover(tile.x, tile.y, &disc, disc.radius * grow, |k, t, _| {
                    if t + step < depth[k] {
                        depth[k] = t + step;
                        ids[k] = i;
                    }
                });
            }
            if self.mode != Mode::Separate {
                self.blend_tile(tile, discs);
            }
        }
        let side = TILE * self.samples;
        let columns = TILE.min(self.width - tile.x);
        let rows = strip.len() / (4 * self.width);
        let share = 1.0 / (self.samples * self.samples) as f32;
        for y in 0..rows {
            for x in 0..columns {
                let (back, back_alpha) =
                    self.studio.behind((tile.x + x) as f32 + 0.5, (tile.y + y) as f32 + 0.5);
                let (mut sum, mut hits) = ([0.0; 3], 0);
                if !discs.is_empty() {
                    for sy in y * self.samples..(y + 1) * self.samples {
                        for sx in x * self.samples..(x + 1) * self.samples {
                            if let Some(color) = self.sample(tile, sy * side + sx, sx, sy) {
                                sum = add(sum, color);
                                hits += 1;
                            }
                        }
                    }
                }
                let cover = hits as f32 * share;
                let behind = (1.0 - cover) * back_alpha;
                let alpha = cover + behind;
                let color = add(scaled(sum, share), scaled(back, behind));
                let color = if alpha > 0.0 { scaled(color, 1.0 / alpha) } else { [0.0; 3] };
                let noise = if cover < 1.0 { dither(tile.x + x, tile.y + y) } else { 0.0 };
                let pixel = &mut strip[4 * (y * self.width + tile.x + x)..][..4];
                pixel.copy_from_slice(&[
                    byte(color[0], noise),
                    byte(color[1], noise),
                    byte(color[2], noise),
                    (alpha * 255.0 + 0.5) as u8,
                ]);
            }
        }
    }

    fn position(&self, first: usize, k: usize) -> f32 {
        first as f32 + (k as f32 + 0.5) / self.samples as f32
    }

    /// Calls `hit(sample, depth, (distance from the centre / radius)²)` for the samples of a tile that see the disc.
    fn cover(&self, x: usize, y: usize, disc: &Disc, radius: f32, mut hit: impl FnMut(usize, f32, f32)) {
        let Some([left, top, right, bottom]) = self.camera.bounds(disc.center, disc.normal, radius) else {
            return;
        };
        let side = TILE * self.samples;
        let span = |low: f32, high: f32, first: usize| -> Range<usize> {
            let at = |v: f32| (v - first as f32) * self.samples as f32 - 0.5;
            let low = at(low).ceil().max(0.0) as usize;
            low..((at(high).floor() + 1.0).max(0.0) as usize).min(side)
        };
        let (columns, rows) = (span(left, right, x), span(top, bottom, y));
        let (c, n) = (disc.center, disc.normal);
        let plane = dot(n, c);
        let per_square = 1.0 / (radius * radius);
        for row in rows {
            let dy = (self.camera.center[1] - self.position(y, row)) / self.camera.focal;
            let fixed = n[1] * dy - n[2];
            for column in columns.clone() {
                let dx = (self.position(x, column) - self.camera.center[0]) / self.camera.focal;
                let t = plane / (n[0] * dx + fixed);
                let (a, b, e) = (dx * t - c[0], dy * t - c[1], -t - c[2]);
                let rho = (a * a + b * b + e * e) * per_square;
                if rho <= 1.0 {
                    hit(row * side + column, t, rho);
                }
            }
        }
    }

    /// Blends all splats near the visible layer that face the same way: normals, colours and light become smooth.
    fn blend_tile(&self, tile: &mut Tile, discs: &[u32]) {
        tile.blend.fill(EMPTY);
        for &i in discs {
            let i = i as usize;
            let disc = self.disc(i);
            let (normal, color, side) = self.visible_side(i, &disc);
            let trust = if side == 0 { 1.0 } else { WEIGHT_BEHIND };
            let (sky, key) = (self.light[i].sky[side], self.light[i].key[side]);
            let (depth, seen, blend) = (&tile.depth, &tile.disc, &mut tile.blend);
            self.cover(tile.x, tile.y, &disc, disc.radius * BLEND, |k, t, rho| {
                if seen[k] == NOTHING || t > depth[k] + 1.5 * disc.radius {
                    return;
                }
                let w = (1.0 - rho) * (1.0 - rho) * trust;
                let sum = &mut blend[k];
                sum.weight += w;
                sum.normal = add(sum.normal, scaled(normal, w));
                sum.color = add(sum.color, scaled(color, w));
                sum.sky += w * sky;
                sum.key += w * key;
                if rho / trust < sum.rho {
                    (sum.rho, sum.owner) = (rho / trust, i as u32);
                }
            });
        }
    }

    /// Linear colour of a sample, or nothing where the background shows.
    fn sample(&self, tile: &Tile, k: usize, sx: usize, sy: usize) -> Option<V3> {
        let i = tile.disc[k];
        if i == NOTHING {
            return None;
        }
        let i = i as usize;
        let ray = self.camera.ray(self.position(tile.x, sx), self.position(tile.y, sy));
        if self.mode != Mode::Separate && tile.blend[k].weight > 1e-6 {
            let sum = &tile.blend[k];
            let share = 1.0 / sum.weight;
            let mut spot = Spot {
                color: scaled(sum.color, share),
                normal: unit(sum.normal),
                sky: sum.sky * share,
                key: sum.key * share,
            };
            if let Mode::Painted(body) = self.mode {
                self.paint(&mut spot, sum, body);
            }
            return Some(self.studio.shade(&spot, ray));
        }
        let disc = self.disc(i);
        let (mut normal, mut color, side) = self.visible_side(i, &disc);
        let hit = scaled(ray, tile.depth[k]);
        let radius = disc.radius * self.scene.shown;
        let off: V3 = std::array::from_fn(|k| (hit[k] - disc.center[k]) / radius);
        let rho = dot(off, off).min(1.0);
        if self.scene.round {
            normal = unit(add(off, scaled(normal, (1.0 - rho).sqrt())));
        } else {
            color = scaled(color, self.rim(&disc, rho.sqrt()));
        }
        let light = self.light[i];
        Some(self.studio.shade(&Spot { color, normal, sky: light.sky[side], key: light.key[side] }, ray))
    }

    /// Normal and colour of the side that the camera sees, and which side that is.
    fn visible_side(&self, i: usize, disc: &Disc) -> (V3, V3, usize) {
        if dot(disc.normal, disc.center) <= 0.0 {
            (disc.normal, self.scene.front[i], 0)
        } else {
            (scaled(disc.normal, -1.0), self.scene.back[i], 1)
        }
    }

    /// Turns a spot of the smooth surface into one of the nearest disc, or of the body between the discs.
    fn paint(&self, spot: &mut Spot, sum: &Blend, body: V3) {
        let i = sum.owner as usize;
        let disc = self.disc(i);
        let (normal, color, side) = self.visible_side(i, &disc);
        let rho = sum.rho * if side == 0 { 1.0 } else { WEIGHT_BEHIND };
        let distance = rho.sqrt() * BLEND / self.scene.shown;
        if distance > 1.0 {
            spot.color = body;
            return;
        }
        spot.color = scaled(color, self.rim(&disc, distance));
        // Mostly flat: each disc catches the light by itself.
        spot.normal = unit(mixed(spot.normal, normal, 0.7));
    }

    /// Factor on the colour at a distance from the centre, in radii: dark at the rim, unless the disc is too small to show one.
    fn rim(&self, disc: &Disc, distance: f32) -> f32 {
        if distance <= 1.0 - self.outline {
            return 1.0;
        }
        let pixels = disc.radius * self.camera.focal / -disc.center[2];
        1.0 - 0.5 * ((pixels - 1.0) / 4.0).clamp(0.0, 1.0)
    }
}

/// Ordered noise, -½ to ½, that keeps the background's gradients free of bands.
fn dither(x: usize, y: usize) -> f32 {
    const BAYER: [[u8; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];
    (f32::from(BAYER[y % 4][x % 4]) - 7.5) / 16.0
}

/// Disc numbers by tile.
struct Bins {
    start: Vec<usize>,
    discs: Vec<u32>,
}

impl Bins {
    fn of(&self, tile: usize) -> &[u32] {
        &self.discs[self.start[tile]..self.start[tile + 1]]
    }
}

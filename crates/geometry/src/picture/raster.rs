//! Discs to samples to pixels, tile by tile. Tiles are independent and each draws its discs in their order, so that the
//! number of threads never shows.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::buffer::{Buffer, Fragment};
use super::camera::Camera;
use super::color::{byte, linear};
use super::light::Light;
use super::options::{PictureOptions, Style};
use super::progress::Stage;
use super::scene::Scene;
use super::shade::{Spot, Studio};
use super::vector::{V3, add, dot, mixed, scaled, unit};
use crate::GeometryError;

/// Side of a tile in pixels.
pub(super) const TILE: usize = 32;
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
    /// Surfaces that are drawn with the discs.
    pub buffers: &'a [Buffer],
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
    /// Depth of the nearest opaque surface; empty where there is none in the picture.
    surface: Vec<f32>,
}

impl<'a> Raster<'a> {
    pub fn new(
        scene: &'a Scene,
        camera: &'a Camera,
        light: &'a [Light],
        studio: &'a Studio<'a>,
        buffers: &'a [Buffer],
        options: &PictureOptions,
    ) -> Self {
        Self {
            scene,
            camera,
            light,
            studio,
            buffers,
            width: options.width as usize,
            height: options.height as usize,
            samples: options.supersampling as usize,
            mode: match (options.style, options.body) {
                // Balls have nothing to blend.
                _ if scene.round => Mode::Separate,
                (Style::Surface, _) => Mode::Smooth,
                // On surfaces of their own discs need no body.
                (Style::Discs, Some(body)) if buffers.is_empty() => Mode::Painted(linear(body)),
                (Style::Discs | Style::Points, _) => Mode::Separate,
            },
            outline: options.outline as f32,
        }
    }

    /// The picture's bytes.
    pub fn draw(&self, stop: &AtomicBool, stage: &Stage) -> Result<Vec<u8>, GeometryError> {
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
                stage.tick();
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
        let spans: Vec<[u32; 4]> = (0..self.scene.drawn)
            .into_par_iter()
            .map(|i| {
                let d = self.disc(i);
                let Some([left, top, right, bottom]) =
                    self.camera.bounds(d.center, d.normal, d.radius * grow)
                else {
                    return [0; 4];
                };
                Bins::span([left, top, right, bottom], columns, rows)
            })
            .collect();
        Bins::new(&spans, columns, rows)
    }

    fn blank_tile(&self) -> Tile {
        let n = (TILE * self.samples).pow(2);
        let blends = if self.mode == Mode::Separate { 0 } else { n };
        let surface = vec![f32::INFINITY; if self.buffers.is_empty() { 0 } else { n }];
        Tile { x: 0, y: 0, depth: vec![0.0; n], disc: vec![0; n], blend: vec![EMPTY; blends], surface }
    }

    fn draw_tile(&self, tile: &mut Tile, discs: &[u32], strip: &mut [u8]) {
        if !discs.is_empty() {
            tile.depth.fill(f32::INFINITY);
            tile.disc.fill(NOTHING);
            if !self.buffers.is_empty() {
                self.find_surface(tile);
            }
            for &i in discs {
                let disc = self.disc(i as usize);
                let behind = !self.camera.faces(disc.normal, disc.center);
                let (grow, step) = match (self.mode, behind) {
                    (Mode::Separate, _) => (self.scene.shown, 0.0),
                    (_, false) => (SEEN, 0.0),
                    (_, true) => (SEEN, STEP_BACK * disc.radius),
                };
                let (depth, ids, surface) = (&mut tile.depth, &mut tile.disc, &tile.surface);
                let radius = disc.radius * grow;
                self.cover(tile.x, tile.y, &disc, radius, |k, t, _| {
                    let Some(t) = self.laid_on((tile.x, tile.y), &disc, radius, k, t, surface) else {
                        return;
                    };
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
                let (sum, hits) = self.pixel(tile, (x, y), side, discs.is_empty());
                let cover = hits * share;
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

    /// Sum of a pixel's samples: colours times opacities, and opacities.
    fn pixel(&self, tile: &Tile, (x, y): (usize, usize), side: usize, bare: bool) -> (V3, f32) {
        let spans = self.buffers.iter().map(|b| b.pixel(tile.x + x, tile.y + y));
        let mut filled = spans.zip(self.buffers).filter(|(s, _)| s.count > 0);
        if bare {
            match (filled.next(), filled.next()) {
                (None, _) => return ([0.0; 3], 0.0),
                // One surface without edges: one sample stands for all.
                (Some((span, buffer)), None) if !span.split => {
                    let at = [(tile.x + x) as f32 + 0.5, (tile.y + y) as f32 + 0.5];
                    let (color, alpha) = self.through(buffer.run(span).iter(), at, None);
                    let all = (self.samples * self.samples) as f32;
                    return (scaled(color, all), alpha * all);
                }
                _ => {}
            }
        }
        let (mut sum, mut hits) = ([0.0; 3], 0.0);
        for sy in y * self.samples..(y + 1) * self.samples {
            for sx in x * self.samples..(x + 1) * self.samples {
                let k = sy * side + sx;
                let disc = if bare { None } else { self.sample(tile, k, sx, sy) };
                if self.buffers.is_empty() {
                    if let Some(color) = disc {
                        sum = add(sum, color);
                        hits += 1.0;
                    }
                    continue;
                }
                let disc = disc.map(|color| (tile.depth[k], color));
                let (color, alpha) = self.layers(tile, (sx, sy), disc);
                sum = add(sum, color);
                hits += alpha;
            }
        }
        (sum, hits)
    }

    /// A sample of all surfaces and a disc: colour times opacity, and opacity.
    fn layers(&self, tile: &Tile, (sx, sy): (usize, usize), disc: Option<(f32, V3)>) -> (V3, f32) {
        let at = [self.position(tile.x, sx), self.position(tile.y, sy)];
        let (start, ray) = (self.camera.start(at[0], at[1]), self.camera.ray(at[0], at[1]));
        let mut all: Vec<(f32, &Fragment)> = Vec::new();
        for buffer in self.buffers {
            let span = buffer.pixel(tile.x + sx / self.samples, tile.y + sy / self.samples);
            for f in buffer.sample(span, sx % self.samples, sy % self.samples) {
                all.push((if span.split { f.depth } else { f.depth_along(start, ray) }, f));
            }
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let nearer = all.iter().filter(|(t, _)| disc.is_none_or(|(depth, _)| *t < depth)).map(|(_, f)| *f);
        self.through(nearer, at, disc.map(|(_, color)| color))
    }

    /// Layers from front to back, then something opaque: colour times opacity, and opacity.
    fn through<'f>(
        &self,
        layers: impl Iterator<Item = &'f Fragment>,
        at: [f32; 2],
        last: Option<V3>,
    ) -> (V3, f32) {
        let ray = self.camera.ray(at[0], at[1]);
        let (mut color, mut open) = ([0.0; 3], 1.0);
        for f in layers {
            let spot = Spot { color: f.color, normal: f.normal, sky: f.sky, key: f.key };
            color = add(color, scaled(self.studio.shade(&spot, ray), open * f.alpha));
            open *= 1.0 - f.alpha;
            if open < 1e-3 {
                return (color, 1.0);
            }
        }
        match last {
            Some(last) => (add(color, scaled(last, open)), 1.0),
            None => (color, 1.0 - open),
        }
    }

    /// Depth of the nearest opaque surface at each sample of a tile.
    fn find_surface(&self, tile: &mut Tile) {
        let side = TILE * self.samples;
        let height = self.height;
        for (k, depth) in tile.surface.iter_mut().enumerate() {
            *depth = f32::INFINITY;
            let (sx, sy) = (k % side, k / side);
            let (x, y) = (tile.x + sx / self.samples, tile.y + sy / self.samples);
            if x >= self.width || y >= height {
                continue;
            }
            for buffer in self.buffers {
                let span = buffer.pixel(x, y);
                let run = buffer.sample(span, sx % self.samples, sy % self.samples);
                if let Some(f) = run.iter().find(|f| f.alpha >= 1.0) {
                    let at = [self.position(tile.x, sx), self.position(tile.y, sy)];
                    let along =
                        || f.depth_along(self.camera.start(at[0], at[1]), self.camera.ray(at[0], at[1]));
                    *depth = depth.min(if span.split { f.depth } else { along() });
                }
            }
        }
    }

    /// The depth at which sample `k` sees a disc whose plane it meets at `t`: discs that touch a surface are laid on it.
    fn laid_on(
        &self,
        tile: (usize, usize),
        disc: &Disc,
        radius: f32,
        k: usize,
        t: f32,
        surface: &[f32],
    ) -> Option<f32> {
        let Some(&depth) = surface.get(k).filter(|d| (**d - t).abs() <= 1.5 * radius) else { return Some(t) };
        let side = TILE * self.samples;
        let at = [self.position(tile.0, k % side), self.position(tile.1, k / side)];
        let (p, eye) = (self.camera.at(at[0], at[1], depth), self.camera.eye);
        let off: V3 = std::array::from_fn(|a| p[a] - eye[a] - disc.center[a]);
        let rho = dot(off, off) / (radius * radius);
        // A little before the surface, the nearest centre first.
        (rho <= 1.0).then_some(depth * (1.0 - 1e-5 * (2.0 - rho)))
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
        if self.camera.parallel {
            for row in rows {
                let b = (self.camera.center[1] - self.position(y, row)) / self.camera.focal - c[1];
                for column in columns.clone() {
                    let a = (self.position(x, column) - self.camera.center[0]) / self.camera.focal - c[0];
                    let e = -(n[0] * a + n[1] * b) / n[2];
                    let rho = (a * a + b * b + e * e) * per_square;
                    if rho <= 1.0 {
                        hit(row * side + column, -(c[2] + e), rho);
                    }
                }
            }
            return;
        }
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
        let at = [self.position(tile.x, sx), self.position(tile.y, sy)];
        let (p, eye) = (self.camera.at(at[0], at[1], tile.depth[k]), self.camera.eye);
        let hit: V3 = std::array::from_fn(|a| p[a] - eye[a]);
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
        if self.camera.faces(disc.normal, disc.center) {
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
        let pixels = disc.radius * self.camera.pixels(disc.center);
        1.0 - 0.5 * ((pixels - 1.0) / 4.0).clamp(0.0, 1.0)
    }
}

/// Ordered noise, -½ to ½, that keeps the background's gradients free of bands.
fn dither(x: usize, y: usize) -> f32 {
    const BAYER: [[u8; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];
    (f32::from(BAYER[y % 4][x % 4]) - 7.5) / 16.0
}

/// Numbers of discs, or of triangles, by tile.
pub(super) struct Bins {
    start: Vec<usize>,
    discs: Vec<u32>,
}

impl Bins {
    /// The tiles that an image rectangle (left, top, right, bottom) touches: columns from, to; rows from, to.
    pub(super) fn span([left, top, right, bottom]: [f32; 4], columns: usize, rows: usize) -> [u32; 4] {
        let cell = |v: f32, most: usize| ((v / TILE as f32).max(0.0) as usize).min(most) as u32;
        let end = |v: f32, most: usize| if v < 0.0 { 0 } else { cell(v, most - 1) + 1 };
        [cell(left, columns), end(right, columns), cell(top, rows), end(bottom, rows)]
    }

    /// Sorts things by the tiles that they touch, each tile's in ascending order.
    pub(super) fn new(spans: &[[u32; 4]], columns: usize, rows: usize) -> Self {
        let mut start = vec![0usize; columns * rows + 1];
        let each = |span: &[u32; 4], f: &mut dyn FnMut(usize)| {
            for row in span[2]..span[3] {
                for column in span[0]..span[1] {
                    f(row as usize * columns + column as usize);
                }
            }
        };
        for span in spans {
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
        Self { start, discs }
    }

    pub(super) fn of(&self, tile: usize) -> &[u32] {
        &self.discs[self.start[tile]..self.start[tile + 1]]
    }
}

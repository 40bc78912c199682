//! Solids F < 0 in a picture: rays are cast through the pixels, and where neighbours differ through more samples.

use std::sync::atomic::AtomicBool;

use isoswarm_field::vector::{V3 as Point, dot, unit};
use isoswarm_field::{Field, Surface};

use super::buffer::{Buffer, Fragment, Span};
use super::camera::Camera;
use super::color::{Colormap, bend, colors, linear};
use super::options::{Coloring, PictureOptions};
use super::progress::Stage;
use super::scene::Scene;
use super::vector::{V3, scaled, smoothstep};
use crate::GeometryError;
use crate::render::{CastOptions, Caster, Clip, Hit, SIDE, View};

/// How the face is drawn on which planes cut a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Section {
    /// In one tone.
    #[default]
    Flat,
    /// Hatched, as in drawings of machines.
    Hatched,
    /// By the distance to the surface, F/|∇F|, with lines where it is a multiple of a round number.
    Distance,
    /// The same, outside the solid too.
    Slice,
}

impl std::str::FromStr for Section {
    type Err = GeometryError;

    /// `flat`, `hatched`, `distance` or `slice`.
    fn from_str(name: &str) -> Result<Self, GeometryError> {
        match name {
            "flat" => Ok(Self::Flat),
            "hatched" => Ok(Self::Hatched),
            "distance" => Ok(Self::Distance),
            "slice" => Ok(Self::Slice),
            _ => Err(GeometryError::Option {
                name: "section",
                expected: "`flat`, `hatched`, `distance` or `slice`",
                given: format!("`{name}`"),
            }),
        }
    }
}

/// A solid F < 0 in a picture.
#[derive(Clone, Debug)]
pub struct Solid<'a> {
    /// F: one equation in space.
    pub field: &'a Field,
    /// The box in which it is drawn, and planes that cut it open.
    pub clip: Clip,
    /// Whether faces of the box that cut the solid are closed. Planes always are.
    pub capped: bool,
    /// Opacity of each layer, more than 0 up to 1.
    pub opacity: f64,
    /// How cut faces are drawn.
    pub section: Section,
    /// What the colouring `given` shows: its values on the surface, on a sequential map. `None`: the default colours.
    pub values: Option<&'a Field>,
}

impl<'a> Solid<'a> {
    /// An opaque solid, closed where the box cuts it.
    pub fn new(field: &'a Field, clip: Clip) -> Self {
        Self { field, clip, capped: true, opacity: 1.0, section: Section::default(), values: None }
    }

    fn options(&self, layers: u16) -> CastOptions {
        CastOptions {
            layers,
            cap_box: self.capped,
            cap_planes: true,
            slices: self.section == Section::Slice && layers != SOLID_LAYERS,
        }
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// [`GeometryError::Option`] for a box or planes that make no sense, or an opacity out of range.
    pub fn check(&self) -> Result<(), GeometryError> {
        let wrong = |name, expected, given: String| Err(GeometryError::Option { name, expected, given });
        let b = &self.clip.bounds;
        if !(0..3).all(|a| b.lo[a] < b.hi[a] && (b.hi[a] - b.lo[a]).is_finite()) {
            return wrong("bounds", "a finite box with lo < hi on each axis", format!("{b:?}"));
        }
        if !(self.opacity > 0.0 && self.opacity <= 1.0) {
            return wrong("opacity", "a number above 0, up to 1", self.opacity.to_string());
        }
        for p in &self.clip.planes {
            let finite = p.offset.is_finite() && p.normal.iter().all(|v| v.is_finite());
            if !finite || p.normal == [0.0; 3] {
                return wrong("planes", "finite planes with normals that are not zero", format!("{p:?}"));
            }
        }
        Ok(())
    }
}

/// Rays along an axis from which the discs come that stand for a solid in the light.
const SURFELS: usize = 2 * SIDE;

/// Most crossings of such a ray.
const SOLID_LAYERS: u16 = 255;

/// Layers of a solid that lets light through.
const LAYERS: u16 = 12;

/// Neighbours whose normals differ by more than this cosine get more samples.
const BENT: f64 = 0.93;

/// Neighbours whose depths differ by more than this many pixels from a plane do too.
const STEP: f64 = 3.0;

/// Discs that stand for a surface in the light.
#[derive(Default)]
pub(super) struct Surfels {
    pub points: Vec<Point>,
    pub normals: Vec<Point>,
    pub radii: Vec<f64>,
}

impl Surfels {
    /// Crossings of a lattice of rays along each axis; each crossing counts for the axis that its normal is nearest to.
    pub fn of(solid: &Solid, caster: &Caster, stop: &AtomicBool) -> Result<Self, GeometryError> {
        let mut all = Self::default();
        let b = &solid.clip.bounds;
        let side = [0, 1, 2].map(|a| b.hi[a] - b.lo[a]);
        let step = side.iter().copied().fold(0.0, f64::max) / SURFELS as f64;
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let along = |a: usize, by: f64| [0, 1, 2].map(|k| if k == a { by } else { 0.0 });
            let mut origin = b.lo;
            origin[axis] -= 0.1 * side[axis];
            let view = View {
                origin,
                steps: [along(u, step), along(v, step)],
                direction: along(axis, 1.0),
                turns: [[0.0; 3]; 2],
                near: 0.0,
            };
            let count = [u, v].map(|a| ((side[a] / step) as usize).div_ceil(SIDE).max(1));
            let corner = |k: usize| [(k % count[0]) * SIDE, (k / count[0]) * SIDE].map(|c| c as f64 + 0.5);
            let tile = |k: usize| {
                let [x, y] = corner(k);
                view.tile(x, y, 1.0, &solid.clip, |_, _| true)
            };
            let options = solid.options(SOLID_LAYERS);
            let tiles = caster.tiles(count[0] * count[1], tile, &options, stop)?;
            for (k, hits) in tiles.iter().enumerate() {
                let [x, y] = corner(k);
                for h in hits {
                    let (column, row) = (usize::from(h.ray) % SIDE, usize::from(h.ray) / SIDE);
                    let ray = view.ray(x + column as f64, y + row as f64, &solid.clip);
                    let n = outward(h, &solid.clip);
                    let cosine = n[axis].abs();
                    let nearest = (0..3).all(|a| n[a].abs() < cosine || (n[a].abs() == cosine && a >= axis));
                    if nearest {
                        all.points.push(ray.at(h.t));
                        all.normals.push(n);
                        all.radii.push(0.53 * step * (1.0 + 1.0 / (cosine * cosine)).sqrt());
                    }
                }
            }
        }
        Ok(all)
    }
}

/// Unit normal out of the solid.
fn outward(h: &Hit, clip: &Clip) -> Point {
    let n = h.cut.map_or(h.gradient, |face| clip.normal(face));
    let length = n.iter().map(|v| v.abs()).fold(0.0, f64::max);
    if length > 0.0 { unit(n.map(|v| v / length)) } else { [0.0; 3] }
}

/// Hits by pixel or sample.
struct Hits {
    width: usize,
    /// Where each pixel's hits begin; one more at the end.
    first: Vec<u32>,
    hits: Vec<Hit>,
}

impl Hits {
    fn of(&self, x: usize, y: usize) -> &[Hit] {
        let k = y * self.width + x;
        &self.hits[self.first[k] as usize..self.first[k + 1] as usize]
    }
}

/// A solid being drawn.
pub(super) struct Draw<'a> {
    pub solid: &'a Solid<'a>,
    pub caster: &'a Caster<'a>,
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub options: &'a PictureOptions,
    pub stop: &'a AtomicBool,
    /// Ticks for each tile.
    pub stage: &'a Stage<'a>,
}

impl Draw<'_> {
    /// Tiles that are cast for a picture.
    pub fn tiles(options: &PictureOptions) -> usize {
        let of = |samples: u32| {
            [options.width, options.height].map(|s| (s * samples) as usize).map(|s| s.div_ceil(SIDE))
        };
        let [coarse, fine] = [of(1), of(options.supersampling)].map(|[x, y]| x * y);
        coarse + fine
    }
}

/// A fragment in the world, before it has a colour.
struct Spot {
    point: Point,
    /// Out of the solid.
    normal: Point,
    cut: bool,
}

impl Draw<'_> {
    /// All fragments, without their light.
    pub fn buffer(&self, radius: f64) -> Result<Buffer, GeometryError> {
        let (width, height) = (self.options.width as usize, self.options.height as usize);
        let samples = self.options.supersampling as usize;
        let view = self.camera.view(self.scene);
        let coarse = self.cast(&view, 1, |_, _| true)?;
        let split =
            if samples > 1 { self.edges(&view, &coarse, height) } else { vec![false; width * height] };
        let fine = self.cast(&view, samples, |x, y| split[y * width + x])?;
        let mut buffer = Buffer::new(width, height, samples);
        buffer.radius = (radius / self.scene.place.unit) as f32;
        let mut spots = Vec::with_capacity(coarse.hits.len() + fine.hits.len());
        for y in 0..height {
            for x in 0..width {
                if !split[y * width + x] {
                    let at = [x as f64 + 0.5, y as f64 + 0.5];
                    let span = self.push(&mut buffer, &mut spots, &view, at, coarse.of(x, y));
                    buffer.pixels[y * width + x] = span;
                    continue;
                }
                let first = buffer.splits.len();
                for k in 0..samples * samples {
                    let (sx, sy) = (x * samples + k % samples, y * samples + k / samples);
                    let at = [sx, sy].map(|s| (s as f64 + 0.5) / samples as f64);
                    let span = self.push(&mut buffer, &mut spots, &view, at, fine.of(sx, sy));
                    buffer.splits.push(span);
                }
                buffer.pixels[y * width + x] =
                    Span { first: first as u32, count: (samples * samples) as u16, split: true };
            }
        }
        self.paint(&mut buffer, &spots)?;
        Ok(buffer)
    }

    /// Hits through the centres of all samples, `samples` a pixel and direction, of the pixels that are wanted.
    fn cast(
        &self,
        view: &View,
        samples: usize,
        wanted: impl Fn(usize, usize) -> bool + Sync,
    ) -> Result<Hits, GeometryError> {
        let [width, height] = [self.options.width, self.options.height].map(|s| s as usize * samples);
        let columns = width.div_ceil(SIDE);
        let corner = |k: usize| [(k % columns) * SIDE, (k / columns) * SIDE];
        let is_wanted = |x: usize, y: usize| x < width && y < height && wanted(x / samples, y / samples);
        let step = 1.0 / samples as f64;
        let tile = |k: usize| {
            self.stage.tick();
            let [x, y] = corner(k);
            let inside = |column, row| is_wanted(x + column, y + row);
            if !(0..SIDE * SIDE).any(|i| inside(i % SIDE, i / SIDE)) {
                return Vec::new();
            }
            let at = |v: usize| (v as f64 + 0.5) * step;
            view.tile(at(x), at(y), step, &self.solid.clip, inside)
        };
        let layers = if self.solid.opacity < 1.0 { LAYERS } else { 1 };
        let count = columns * height.div_ceil(SIDE);
        let tiles = self.caster.tiles(count, tile, &self.solid.options(layers), self.stop)?;
        let mut first = vec![0u32; width * height + 1];
        let place = |k: usize, h: &Hit| {
            let [x, y] = corner(k);
            (y + usize::from(h.ray) / SIDE) * width + x + usize::from(h.ray) % SIDE
        };
        for (k, hits) in tiles.iter().enumerate() {
            hits.iter().for_each(|h| first[place(k, h) + 1] += 1);
        }
        for k in 0..width * height {
            first[k + 1] += first[k];
        }
        let mut next = first.clone();
        let nothing = Hit { ray: 0, t: 0.0, gradient: [0.0; 3], cut: None };
        let mut hits = vec![nothing; first[width * height] as usize];
        for (k, tile) in tiles.iter().enumerate() {
            for h in tile {
                let at = &mut next[place(k, h)];
                hits[*at as usize] = *h;
                *at += 1;
            }
        }
        Ok(Hits { width, first, hits })
    }

    /// The pixels that differ from a neighbour.
    fn edges(&self, view: &View, hits: &Hits, height: usize) -> Vec<bool> {
        let width = hits.width;
        let mut split = vec![false; width * height];
        for y in 0..height {
            for x in 0..width {
                for (i, j) in [(x + 1, y), (x, y + 1)] {
                    if i < width && j < height && self.differ(view, hits, (x, y), (i, j)) {
                        split[y * width + x] = true;
                        split[j * width + i] = true;
                    }
                }
            }
        }
        split
    }

    fn differ(&self, view: &View, hits: &Hits, p: (usize, usize), q: (usize, usize)) -> bool {
        let (a, b) = (hits.of(p.0, p.1), hits.of(q.0, q.1));
        if a.is_empty() && b.is_empty() {
            return false;
        }
        if a.len() != b.len() {
            return true;
        }
        let center = |(x, y): (usize, usize)| view.ray(x as f64 + 0.5, y as f64 + 0.5, &self.solid.clip);
        let (ra, rb) = (center(p), center(q));
        a.iter().zip(b).any(|(a, b)| {
            if a.cut != b.cut {
                return true;
            }
            let (na, nb) = (outward(a, &self.solid.clip), outward(b, &self.solid.clip));
            if dot(na, nb) < BENT {
                return true;
            }
            let off = isoswarm_field::vector::sub(ra.at(a.t), rb.origin);
            let expected = dot(na, off) / dot(na, rb.direction);
            let pixel = 1.0 / f64::from(self.camera.pixels([0.0, 0.0, -a.t as f32]));
            let step = (expected - b.t).abs();
            // Towards a horizon the plane leaves the surface.
            step > STEP * pixel && step > 0.5 * (a.t - b.t).abs()
        })
    }

    /// Adds the hits of one ray.
    fn push(
        &self,
        buffer: &mut Buffer,
        spots: &mut Vec<Spot>,
        view: &View,
        [x, y]: [f64; 2],
        hits: &[Hit],
    ) -> Span {
        if hits.is_empty() {
            return Span::default();
        }
        let ray = view.ray(x, y, &self.solid.clip);
        let place = &self.scene.place;
        let fragment = |h: &Hit| {
            let point = ray.at(h.t);
            let normal = outward(h, &self.solid.clip);
            spots.push(Spot { point, normal, cut: h.cut.is_some() });
            let back = dot(normal, ray.direction) > 0.0;
            Fragment {
                depth: h.t as f32,
                position: place.seen(point),
                normal: scaled(place.turned(normal), if back { -1.0 } else { 1.0 }),
                back,
                color: [0.5; 3],
                alpha: if h.cut.is_some() { 1.0 } else { self.solid.opacity as f32 },
                sky: 0.0,
                key: 0.0,
            }
        };
        let run: Vec<Fragment> = hits.iter().map(fragment).collect();
        buffer.push(run)
    }

    /// Colours all fragments.
    fn paint(&self, buffer: &mut Buffer, spots: &[Spot]) -> Result<(), GeometryError> {
        let surface: Vec<usize> = (0..spots.len()).filter(|&k| !spots[k].cut).collect();
        let points: Vec<Point> = surface.iter().map(|&k| spots[k].point).collect();
        let sides = self.surface_colors(&points, surface.iter().map(|&k| spots[k].normal))?;
        for (&k, [front, back]) in surface.iter().zip(sides) {
            let f = &mut buffer.fragments[k];
            f.color = if f.back { back } else { front };
        }
        let cut: Vec<usize> = (0..spots.len()).filter(|&k| spots[k].cut).collect();
        if cut.is_empty() {
            return Ok(());
        }
        let points: Vec<Point> = cut.iter().map(|&k| spots[k].point).collect();
        let distance = self.distances(&points)?;
        for ((&k, p), d) in cut.iter().zip(points).zip(distance) {
            let f = &mut buffer.fragments[k];
            let off: V3 = std::array::from_fn(|a| f.position[a] - self.camera.eye[a]);
            let pixel = self.scene.place.unit / f64::from(self.camera.pixels(off));
            f.color = self.cut_color(p, spots[k].normal, d, pixel);
        }
        Ok(())
    }

    /// Linear colours of the outside and the inside.
    fn surface_colors(
        &self,
        points: &[Point],
        normals: impl Iterator<Item = Point>,
    ) -> Result<Vec<[V3; 2]>, GeometryError> {
        let srgb = match self.options.coloring {
            Coloring::Uniform { front, back } => {
                return Ok(vec![[linear(front), linear(back)]; points.len()]);
            }
            Coloring::Given => {
                let needed_for = "the colouring `given` of a solid";
                let field =
                    self.solid.values.ok_or(GeometryError::MissingColumn { column: "values", needed_for })?;
                let mut value = vec![0.0; points.len()];
                field.value(points.as_flattened(), &mut value)?;
                colors(&value, Colormap::Sequential)
            }
            Coloring::Curvature => bend(&self.mean_curvatures(points)?),
            Coloring::Height => {
                let up = unit(self.options.up);
                let heights: Vec<f64> = points.iter().map(|p| 0.25 * dot(*p, up)).collect();
                colors(&heights, Colormap::Sequential)
            }
            Coloring::Normal => normals.map(|n| n.map(|v| 0.5 + 0.5 * v)).collect(),
        };
        Ok(srgb.iter().map(|c| linear(*c)).map(|c| [c, super::color::inside(c)]).collect())
    }

    /// (k1 + k2)/2 = (tr H |g|² − gᵀHg) / (2 |g|³): Goldman, "Curvature formulas for implicit curves and surfaces", 2005.
    fn mean_curvatures(&self, points: &[Point]) -> Result<Vec<f64>, GeometryError> {
        let n = points.len();
        let (mut value, mut gradient, mut hessian) = (vec![0.0; n], vec![[0.0; 3]; n], vec![[0.0; 6]; n]);
        Surface::value_gradient(self.solid.field, points, &mut value, &mut gradient)?;
        Surface::hessian(self.solid.field, points, &mut hessian)?;
        let one = |(g, h): (&Point, &[f64; 6])| {
            let [xx, xy, xz, yy, yz, zz] = *h;
            let g2 = dot(*g, *g);
            let hg = [
                xx * g[0] + xy * g[1] + xz * g[2],
                xy * g[0] + yy * g[1] + yz * g[2],
                xz * g[0] + yz * g[1] + zz * g[2],
            ];
            ((xx + yy + zz) * g2 - dot(*g, hg)) / (2.0 * g2 * g2.sqrt())
        };
        Ok(gradient.iter().zip(&hessian).map(one).collect())
    }

    /// F/|∇F|, where a cut shows it.
    fn distances(&self, points: &[Point]) -> Result<Vec<f64>, GeometryError> {
        let n = points.len();
        if !matches!(self.solid.section, Section::Distance | Section::Slice) {
            return Ok(vec![0.0; n]);
        }
        let (mut value, mut gradient) = (vec![0.0; n], vec![[0.0; 3]; n]);
        Surface::value_gradient(self.solid.field, points, &mut value, &mut gradient)?;
        Ok(value.iter().zip(&gradient).map(|(f, g)| f / dot(*g, *g).sqrt().max(f64::MIN_POSITIVE)).collect())
    }

    /// Linear colour of a cut face, `pixel` world units wide there.
    fn cut_color(&self, p: Point, normal: Point, distance: f64, pixel: f64) -> V3 {
        const TONE: [f64; 3] = [0.93, 0.64, 0.38];
        const DARK: f32 = 0.45;
        let scale = self.scene.place.unit;
        let line = |value: f64, step: f64, half: f64| {
            let off = (value / step - (value / step).round()).abs() * step;
            1.0 - smoothstep((half - 0.7 * pixel) as f32, (half + 0.7 * pixel) as f32, off as f32)
        };
        match self.solid.section {
            Section::Flat => linear(TONE),
            Section::Hatched => {
                // Lines at 45° to whatever axis lies flattest in the plane.
                let helper = if normal[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
                let u = unit(isoswarm_field::vector::cross(helper, normal));
                let v = isoswarm_field::vector::cross(normal, u);
                let along = (dot(p, u) + dot(p, v)) * std::f64::consts::FRAC_1_SQRT_2;
                let dark = DARK * line(along, 0.05 * scale, 0.006 * scale);
                scaled(linear(TONE), 1.0 - dark)
            }
            Section::Distance | Section::Slice => {
                let step = round_number(0.08 * scale);
                let t = distance / (5.0 * step);
                let base = linear(Colormap::Diverging.at(0.5 + 0.5 * t / (1.0 + t * t).sqrt()));
                let thin = DARK * line(distance, step, 0.0025 * scale);
                let bold =
                    0.85 * (1.0 - smoothstep(0.0, 1.0, ((distance.abs() - 0.005 * scale) / pixel) as f32));
                scaled(base, 1.0 - thin.max(bold))
            }
        }
    }
}

/// 1, 2 or 5 times a power of ten, not above `v`.
fn round_number(v: f64) -> f64 {
    let ten = libm::pow(10.0, libm::floor(libm::log10(v)));
    [5.0, 2.0, 1.0].into_iter().map(|m| m * ten).find(|m| *m <= v).unwrap_or(ten)
}

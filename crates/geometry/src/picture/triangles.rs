//! Meshes in a picture: triangles to samples, tile by tile, with a depth buffer.

use std::sync::atomic::{AtomicBool, Ordering};

use isoswarm_field::vector::{self, V3 as Point, norm, scale, sub};
use rayon::prelude::*;

use super::buffer::{Buffer, Fragment, Span};
use super::camera::Camera;
use super::color::linear;
use super::options::PictureOptions;
use super::raster::{Bins, TILE};
use super::scene::{Scene, side_colors};
use super::solid::Surfels;
use super::vector::{V3, add, dot, mixed, scaled, unit};
use crate::{GeometryError, Mesh, PointCloud};

/// How triangles are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum MeshStyle {
    /// Normals blend across triangles.
    #[default]
    Smooth,
    /// Each triangle is flat.
    Flat,
    /// Each triangle is flat and has dark edges; hidden ones do not show.
    Wireframe,
}

impl std::str::FromStr for MeshStyle {
    type Err = GeometryError;

    /// `smooth`, `flat` or `wireframe`.
    fn from_str(name: &str) -> Result<Self, GeometryError> {
        match name {
            "smooth" => Ok(Self::Smooth),
            "flat" => Ok(Self::Flat),
            "wireframe" => Ok(Self::Wireframe),
            _ => Err(GeometryError::Option {
                name: "mesh style",
                expected: "`smooth`, `flat` or `wireframe`",
                given: format!("`{name}`"),
            }),
        }
    }
}

/// A mesh in a picture.
#[derive(Clone, Copy, Debug)]
pub struct MeshLook<'a> {
    /// The triangles; normals that are missing come from them.
    pub mesh: &'a Mesh,
    /// How they are drawn.
    pub style: MeshStyle,
    /// What the colouring `given` shows: sRGB colours, one a vertex.
    pub colors: Option<&'a [[f64; 3]]>,
}

/// Linear colour and half width in pixels of the edges.
const EDGE: [f64; 3] = [0.13, 0.17, 0.22];
const EDGE_WIDTH: f32 = 0.55;

/// A pixel whose samples' normals differ by more than this cosine is not one.
const BENT: f32 = 0.985;

/// Along the longest side of a box around the mesh, discs that stand for it in the light.
const SURFELS: f64 = 96.0;

impl MeshLook<'_> {
    /// Checks that faces name vertices, and that columns fit.
    ///
    /// # Errors
    /// [`GeometryError::Option`], and what [`PointCloud::check`] says of the columns.
    pub fn check(&self) -> Result<(), GeometryError> {
        let n = self.mesh.points.len();
        if let Some(f) = self.mesh.faces.iter().find(|f| f.iter().any(|v| *v as usize >= n)) {
            let expected = "numbers of vertices, below the number of points";
            return Err(GeometryError::Option { name: "faces", expected, given: format!("{f:?} of {n}") });
        }
        self.cloud(&[]).check()
    }

    fn cloud<'a>(&'a self, normals: &'a [Point]) -> PointCloud<'a> {
        let some = |c: &'a [[f64; 2]]| (!c.is_empty()).then_some(c);
        PointCloud {
            points: &self.mesh.points,
            normals: (!normals.is_empty()).then_some(normals),
            curvatures: some(&self.mesh.curvatures),
            colors: self.colors,
            ..PointCloud::default()
        }
    }

    /// The mesh's normals, or the sums of the triangles' around each vertex.
    fn normals(&self) -> Vec<Point> {
        let mesh = self.mesh;
        let mut sums = vec![[0.0; 3]; mesh.points.len()];
        for f in 0..mesh.faces.len() {
            let n = mesh.face_vector(f);
            mesh.faces[f].iter().for_each(|v| sums[*v as usize] = vector::add(sums[*v as usize], n));
        }
        for (k, n) in mesh.normals.iter().enumerate().take(sums.len()) {
            if n.iter().all(|v| v.is_finite()) && *n != [0.0; 3] {
                sums[k] = *n;
            }
        }
        sums
    }

    /// Discs that stand for the mesh in the light: on each triangle a lattice of them.
    pub(super) fn surfels(&self) -> Surfels {
        let mut all = Surfels::default();
        let Some((lo, hi)) = PointCloud::new(&self.mesh.points).bounds() else { return all };
        let size = (0..3).map(|a| hi[a] - lo[a]).fold(0.0, f64::max) / SURFELS;
        for f in 0..self.mesh.faces.len() {
            let corners = self.mesh.corners(f);
            let n = self.mesh.face_vector(f);
            let longest = (0..3).map(|k| norm(sub(corners[(k + 1) % 3], corners[k]))).fold(0.0, f64::max);
            let parts = if size > 0.0 { (longest / size).ceil().clamp(1.0, 64.0) as usize } else { 1 };
            // The circle through the corners of an even triangle of a part's area, a little larger.
            let radius = 0.95 * (0.5 * norm(n)).sqrt() / parts as f64;
            for i in 0..parts {
                for j in 0..2 * (parts - i) - 1 {
                    let third = if j % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
                    let u = (i as f64 + third) / parts as f64;
                    let v = ((j / 2) as f64 + third) / parts as f64;
                    let at = |k: usize, w: f64| scale(corners[k], w);
                    all.points.push(vector::add(vector::add(at(0, 1.0 - u - v), at(1, u)), at(2, v)));
                    all.normals.push(n);
                    all.radii.push(radius);
                }
            }
        }
        all
    }
}

/// A triangle on the picture.
#[derive(Clone, Copy)]
struct Facet {
    /// Image points of the corners.
    image: [[f32; 2]; 3],
    /// Its plane in view space: normal · (p − eye) = offset.
    normal: V3,
    offset: f32,
    /// Twice its area on the picture, with its sign.
    area: f32,
}

/// A mesh being drawn.
pub(super) struct DrawMesh<'a> {
    look: &'a MeshLook<'a>,
    camera: &'a Camera,
    options: &'a PictureOptions,
    position: Vec<V3>,
    normal: Vec<V3>,
    front: Vec<V3>,
    back: Vec<V3>,
    facets: Vec<Option<Facet>>,
}

/// What a sample sees: depth and triangle.
type Seen = (f32, u32);

const NOTHING: Seen = (f32::INFINITY, u32::MAX);

impl<'a> DrawMesh<'a> {
    pub fn new(
        look: &'a MeshLook<'a>,
        scene: &Scene,
        camera: &'a Camera,
        options: &'a PictureOptions,
    ) -> Result<Self, GeometryError> {
        let normals = look.normals();
        let (front, back) = side_colors(&look.cloud(&normals), options)?;
        let turned = |n: &Point| {
            let size = n.iter().map(|v| v.abs()).fold(0.0, f64::max);
            if size > 0.0 { unit(scene.place.turned(n.map(|v| v / size))) } else { [0.0; 3] }
        };
        let mut draw = Self {
            look,
            camera,
            options,
            position: look.mesh.points.iter().map(|p| scene.place.seen(*p)).collect(),
            normal: normals.iter().map(turned).collect(),
            front,
            back,
            facets: Vec::new(),
        };
        draw.facets = (0..look.mesh.faces.len()).map(|f| draw.facet(f)).collect();
        Ok(draw)
    }

    fn facet(&self, f: usize) -> Option<Facet> {
        let eye = self.camera.eye;
        let p = self.look.mesh.faces[f].map(|v| {
            let p = self.position[v as usize];
            [p[0] - eye[0], p[1] - eye[1], p[2] - eye[2]]
        });
        if p.iter().any(|p| p[2] > -1e-6) {
            return None;
        }
        let image = p.map(|p| {
            let s = self.camera.pixels(p);
            [self.camera.center[0] + s * p[0], self.camera.center[1] - s * p[1]]
        });
        let edge = |i: usize| -> V3 { std::array::from_fn(|k| p[i][k] - p[0][k]) };
        let normal = unit(super::vector::cross(edge(1), edge(2)));
        let [a, b, c] = image;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        (area.is_finite() && area != 0.0).then(|| Facet { image, normal, offset: dot(normal, p[0]), area })
    }

    /// All fragments, without their light.
    pub fn buffer(&self, radius: f32, stop: &AtomicBool) -> Result<Buffer, GeometryError> {
        let (width, height) = (self.options.width as usize, self.options.height as usize);
        let samples = self.options.supersampling as usize;
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        let span = |f: &Option<Facet>| {
            let Some(f) = f else { return [0; 4] };
            let low = |k: usize| f.image.iter().map(|p| p[k]).fold(f32::MAX, f32::min);
            let high = |k: usize| f.image.iter().map(|p| p[k]).fold(f32::MIN, f32::max);
            Bins::span([low(0), low(1), high(0), high(1)], columns, rows)
        };
        let spans: Vec<[u32; 4]> = self.facets.iter().map(span).collect();
        let bins = Bins::new(&spans, columns, rows);
        let tiles: Vec<(Vec<Span>, Buffer)> = (0..columns * rows)
            .into_par_iter()
            .map(|k| {
                if stop.load(Ordering::Relaxed) || bins.of(k).is_empty() {
                    return (Vec::new(), Buffer::default());
                }
                self.tile([(k % columns) * TILE, (k / columns) * TILE], bins.of(k), samples)
            })
            .collect();
        if stop.load(Ordering::Relaxed) {
            return Err(GeometryError::Cancelled);
        }
        let mut all = Buffer::new(width, height, samples);
        all.radius = radius;
        for (k, (pixels, part)) in tiles.into_iter().enumerate() {
            let (splits, fragments) = (all.splits.len() as u32, all.fragments.len() as u32);
            all.fragments.extend(part.fragments);
            all.splits.extend(part.splits.iter().map(|s| Span { first: s.first + fragments, ..*s }));
            for (i, span) in pixels.iter().enumerate().filter(|(_, s)| s.count > 0) {
                let (x, y) = ((k % columns) * TILE + i % TILE, (k / columns) * TILE + i / TILE);
                if x < width && y < height {
                    let base = if span.split { splits } else { fragments };
                    all.pixels[y * width + x] = Span { first: span.first + base, ..*span };
                }
            }
        }
        Ok(all)
    }

    /// The pixels of a tile.
    fn tile(&self, corner: [usize; 2], facets: &[u32], samples: usize) -> (Vec<Span>, Buffer) {
        let side = TILE * samples;
        let mut seen = vec![NOTHING; side * side];
        let at = |k: usize, a: usize| corner[a] as f32 + (k as f32 + 0.5) / samples as f32;
        for &f in facets {
            let Some(facet) = &self.facets[f as usize] else { continue };
            let range = |a: usize| {
                let low = facet.image.iter().map(|p| p[a]).fold(f32::MAX, f32::min);
                let high = facet.image.iter().map(|p| p[a]).fold(f32::MIN, f32::max);
                let k = |v: f32| (v - corner[a] as f32) * samples as f32 - 0.5;
                k(low).ceil().max(0.0) as usize..((k(high).floor() + 1.0).max(0.0) as usize).min(side)
            };
            for row in range(1) {
                for column in range(0) {
                    let p = [at(column, 0), at(row, 1)];
                    if facet.weights(p).iter().any(|w| *w < 0.0) {
                        continue;
                    }
                    let t = self.depth(facet, p);
                    let sample = &mut seen[row * side + column];
                    if (t, f) < *sample {
                        *sample = (t, f);
                    }
                }
            }
        }
        let mut part = Buffer::default();
        let mut pixels = vec![Span::default(); TILE * TILE];
        for (i, pixel) in pixels.iter_mut().enumerate() {
            let (x, y) = (i % TILE * samples, i / TILE * samples);
            let number = |k: usize| (x + k % samples, y + k / samples);
            let all: Vec<Option<Fragment>> = (0..samples * samples)
                .map(|k| {
                    let (column, row) = number(k);
                    let (t, f) = seen[row * side + column];
                    (f != NOTHING.1).then(|| self.fragment(f as usize, [at(column, 0), at(row, 1)], t))
                })
                .collect();
            if let Some(one) = whole(&all) {
                *pixel = part.push([one]);
            } else if all.iter().any(Option::is_some) {
                let first = part.splits.len() as u32;
                for f in all {
                    let run = part.push(f);
                    part.splits.push(run);
                }
                *pixel = Span { first, count: (samples * samples) as u16, split: true };
            }
        }
        (pixels, part)
    }

    /// Depth of a triangle's plane on the ray through an image point.
    fn depth(&self, f: &Facet, p: [f32; 2]) -> f32 {
        let (start, ray, eye) = (self.camera.start(p[0], p[1]), self.camera.ray(p[0], p[1]), self.camera.eye);
        let off: V3 = std::array::from_fn(|k| start[k] - eye[k]);
        (f.offset - dot(f.normal, off)) / dot(f.normal, ray)
    }

    fn fragment(&self, number: usize, p: [f32; 2], depth: f32) -> Fragment {
        let corners = self.look.mesh.faces[number].map(|v| v as usize);
        let Some(f) = self.facets[number] else { unreachable!("only facets are seen") };
        // From the picture to space: weights over distances, in perspective.
        let mut w = f.weights(p);
        if !self.camera.parallel {
            for k in 0..3 {
                w[k] /= self.camera.eye[2] - self.position[corners[k]][2];
            }
        }
        let sum = w[0] + w[1] + w[2];
        let blend =
            |column: &[V3]| (0..3).fold([0.0; 3], |s, k| add(s, scaled(column[corners[k]], w[k] / sum)));
        let (start, ray) = (self.camera.start(p[0], p[1]), self.camera.ray(p[0], p[1]));
        let back = dot(f.normal, ray) > 0.0;
        let normal = match self.look.style {
            MeshStyle::Smooth => unit(blend(&self.normal)),
            _ => f.normal,
        };
        let mut normal = scaled(normal, if back { -1.0 } else { 1.0 });
        if dot(normal, ray) > 0.0 {
            // A blended normal that looks away, at a horizon.
            normal = unit(add(normal, scaled(ray, -1.02 * dot(normal, ray) / dot(ray, ray))));
        }
        let mut color = blend(if back { &self.back } else { &self.front });
        if self.look.style == MeshStyle::Wireframe && f.edge_distance(p) < EDGE_WIDTH {
            color = mixed(color, linear(EDGE), 0.9);
        }
        Fragment {
            depth,
            position: add(start, scaled(ray, depth)),
            normal,
            back,
            color,
            alpha: 1.0,
            sky: 0.0,
            key: 0.0,
        }
    }
}

impl Facet {
    /// Weights of the corners at an image point; all are positive inside.
    fn weights(&self, p: [f32; 2]) -> [f32; 3] {
        [0, 1, 2].map(|k| {
            let (a, b) = (self.image[(k + 1) % 3], self.image[(k + 2) % 3]);
            ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])) / self.area
        })
    }

    /// Distance to the nearest edge, in pixels.
    fn edge_distance(&self, p: [f32; 2]) -> f32 {
        let w = self.weights(p);
        (0..3)
            .map(|k| {
                let (a, b) = (self.image[(k + 1) % 3], self.image[(k + 2) % 3]);
                let length = ((b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2)).sqrt();
                w[k].abs() * self.area.abs() / length.max(1e-6)
            })
            .fold(f32::MAX, f32::min)
    }
}

/// The fragment that stands for all samples of a pixel, if they are alike.
fn whole(all: &[Option<Fragment>]) -> Option<Fragment> {
    let middle = all[all.len() / 2]?;
    let like = |f: &Option<Fragment>| {
        f.is_some_and(|f| {
            let off: V3 = std::array::from_fn(|k| f.position[k] - middle.position[k]);
            let near = dot(off, middle.normal).abs() <= 0.3 * dot(off, off).sqrt() + 1e-4;
            let color = (0..3).all(|k| (f.color[k] - middle.color[k]).abs() < 0.02);
            near && color && f.back == middle.back && dot(f.normal, middle.normal) > BENT
        })
    };
    all.iter().all(like).then_some(middle)
}

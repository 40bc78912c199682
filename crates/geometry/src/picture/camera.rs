//! A camera, perspective or parallel, that frames the scene by itself.

use super::options::{PictureOptions, Projection};
use super::scene::Scene;
use super::vector::{V3, add, dot, scaled};
use crate::render::View;

/// Looks along -z of view space. Image coordinates are pixels from the top left corner.
pub(super) struct Camera {
    pub eye: V3,
    /// Pixels per unit at distance one; at any distance where rays are parallel.
    pub focal: f32,
    pub center: [f32; 2],
    pub parallel: bool,
}

impl Camera {
    /// The nearest camera of the given opening angle that sees every disc, with the margin around them. For a camera at
    /// (cx, cy, cz) a ball at (x, y, z) of radius r fits the right edge, of slope s, if x + r ≤ cx + s (cz - z), and alike for the other
    /// edges: the largest x + r + s z over the discs bounds cx + s cz. Two opposite edges give cx and cz.
    pub fn new(scene: &Scene, options: &PictureOptions) -> Self {
        let (width, height) = (f64::from(options.width), f64::from(options.height));
        let slope = libm::tan(0.5 * options.field_of_view);
        let inner = 1.0 - options.margin;
        let slopes = [slope * inner * width / height, slope * inner];
        let mut far = [[f64::MIN; 2]; 2];
        let mut nearest = f64::MIN;
        let framed = scene.frame.as_deref().unwrap_or(&scene.position);
        let radii = if scene.frame.is_some() { &[] } else { &scene.radius[..] };
        for (p, r) in framed.iter().zip(radii.iter().chain(std::iter::repeat(&0.0))) {
            let (z, r) = (f64::from(p[2]), f64::from(*r));
            nearest = nearest.max(z + r);
            for k in 0..2 {
                let x = f64::from(p[k]);
                far[k][0] = far[k][0].max(x + r + slopes[k] * z);
                far[k][1] = far[k][1].max(-x + r + slopes[k] * z);
            }
        }
        let focal = (0.5 * height / slope) as f32;
        let center = [0.5 * width as f32, 0.5 * height as f32];
        let parallel = options.projection == Projection::Parallel;
        if framed.is_empty() {
            let focal = if parallel { 0.5 * height as f32 } else { focal };
            return Self { eye: [0.0, 0.0, 1.0 / slope as f32], focal, center, parallel };
        }
        if parallel {
            return Self::across(scene, framed, radii, inner, [width, height]);
        }
        let distance = |k: usize| (far[k][0] + far[k][1]) / (2.0 * slopes[k]);
        let z = distance(0).max(distance(1)).max(nearest + 1e-3);
        let middle = |k: usize| 0.5 * (far[k][0] - far[k][1]);
        Self { eye: [middle(0) as f32, middle(1) as f32, z as f32], focal, center, parallel }
    }

    /// The parallel camera that just sees every disc.
    fn across(scene: &Scene, framed: &[V3], radii: &[f32], inner: f64, size: [f64; 2]) -> Self {
        let mut box_ = [[f32::MAX, f32::MIN]; 3];
        for (p, r) in framed.iter().zip(radii.iter().chain(std::iter::repeat(&0.0))) {
            for k in 0..3 {
                box_[k] = [box_[k][0].min(p[k] - r), box_[k][1].max(p[k] + r)];
            }
        }
        let half = |k: usize| f64::from(0.5 * (box_[k][1] - box_[k][0]).max(1e-6));
        let focal = (0.5 * inner * (size[0] / half(0)).min(size[1] / half(1))) as f32;
        let middle = |k: usize| 0.5 * (box_[k][0] + box_[k][1]);
        // Before everything, whether it is framed or not.
        let ball = scene.position.iter().zip(&scene.radius).map(|(p, r)| p[2] + r).fold(box_[2][1], f32::max);
        let center = [0.5 * size[0] as f32, 0.5 * size[1] as f32];
        Self { eye: [middle(0), middle(1), ball + 0.5], focal, center, parallel: true }
    }

    /// Image point (x, y) on the plane at distance one.
    fn on_plane(&self, x: f32, y: f32) -> [f32; 2] {
        [(x - self.center[0]) / self.focal, (self.center[1] - y) / self.focal]
    }

    /// Direction of the ray through image point (x, y); its z is -1, so that a ray's parameter is the depth.
    pub fn ray(&self, x: f32, y: f32) -> V3 {
        let [a, b] = self.on_plane(x, y);
        if self.parallel { [0.0, 0.0, -1.0] } else { [a, b, -1.0] }
    }

    /// Where that ray begins.
    pub fn start(&self, x: f32, y: f32) -> V3 {
        let [a, b] = self.on_plane(x, y);
        if self.parallel { add(self.eye, [a, b, 0.0]) } else { self.eye }
    }

    /// The point at this depth on the ray through image point (x, y).
    pub fn at(&self, x: f32, y: f32, depth: f32) -> V3 {
        add(self.start(x, y), scaled(self.ray(x, y), depth))
    }

    /// Whether a side with this normal at `c`, relative to the eye, is seen.
    pub fn faces(&self, normal: V3, c: V3) -> bool {
        if self.parallel { normal[2] >= 0.0 } else { dot(normal, c) <= 0.0 }
    }

    /// Pixels that a unit takes at `c`, relative to the eye.
    pub fn pixels(&self, c: V3) -> f32 {
        if self.parallel { self.focal } else { self.focal / -c[2] }
    }

    /// The same rays in the world; their t is the depth in view space.
    pub fn view(&self, scene: &Scene) -> View {
        let place = &scene.place;
        let pixel = 1.0 / f64::from(self.focal);
        let [cx, cy] = self.center.map(f64::from);
        let corner = [-cx * pixel, cy * pixel];
        let eye = self.eye.map(f64::from);
        let nothing = [[0.0; 3]; 2];
        let grid = [place.direction([pixel, 0.0, 0.0]), place.direction([0.0, -pixel, 0.0])];
        if self.parallel {
            let origin = place.point([eye[0] + corner[0], eye[1] + corner[1], eye[2]]);
            let direction = place.direction([0.0, 0.0, -1.0]);
            return View { origin, steps: grid, direction, turns: nothing, near: 0.0 };
        }
        let direction = place.direction([corner[0], corner[1], -1.0]);
        View { origin: place.point(eye), steps: nothing, direction, turns: grid, near: 0.0 }
    }

    /// Image rectangle (left, top, right, bottom) that contains a disc, or nothing if it reaches behind the camera.
    /// `c` is the centre relative to the eye.
    pub fn bounds(&self, c: V3, n: V3, r: f32) -> Option<[f32; 4]> {
        let reach = n.map(|n| r * (1.0 - n * n).max(0.0).sqrt());
        let (near, far) = (-c[2] - reach[2], -c[2] + reach[2]);
        if near <= 0.0 || near.is_nan() {
            return None;
        }
        if self.parallel {
            let [x, y] = [self.center[0] + self.focal * c[0], self.center[1] - self.focal * c[1]];
            let [w, h] = [self.focal * reach[0], self.focal * reach[1]];
            return Some([x - w, y - h, x + w, y + h]);
        }
        // The box around the disc, seen in perspective: each edge at the depth at which it is farthest out.
        let most = |v: f32| self.focal * v / if v > 0.0 { near } else { far };
        let [right, left] = [most(c[0] + reach[0]), -most(-c[0] + reach[0])];
        let [top, bottom] = [most(c[1] + reach[1]), -most(-c[1] + reach[1])];
        Some([self.center[0] + left, self.center[1] - top, self.center[0] + right, self.center[1] - bottom])
    }
}

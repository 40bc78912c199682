//! A perspective camera that frames the scene by itself.

use super::options::PictureOptions;
use super::scene::Scene;
use super::vector::V3;

/// Looks along -z of view space. Image coordinates are pixels from the top left corner.
pub(super) struct Camera {
    pub eye: V3,
    /// Pixels per unit at distance one.
    pub focal: f32,
    pub center: [f32; 2],
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
        if framed.is_empty() {
            return Self { eye: [0.0, 0.0, 1.0 / slope as f32], focal, center };
        }
        let distance = |k: usize| (far[k][0] + far[k][1]) / (2.0 * slopes[k]);
        let z = distance(0).max(distance(1)).max(nearest + 1e-3);
        let middle = |k: usize| 0.5 * (far[k][0] - far[k][1]);
        Self { eye: [middle(0) as f32, middle(1) as f32, z as f32], focal, center }
    }

    /// Direction of the ray through image point (x, y); its z is -1, so that a ray's parameter is the depth.
    pub fn ray(&self, x: f32, y: f32) -> V3 {
        [(x - self.center[0]) / self.focal, (self.center[1] - y) / self.focal, -1.0]
    }

    /// Image rectangle (left, top, right, bottom) that contains a disc, or nothing if it reaches behind the camera.
    /// `c` is the centre relative to the eye.
    pub fn bounds(&self, c: V3, n: V3, r: f32) -> Option<[f32; 4]> {
        let reach = n.map(|n| r * (1.0 - n * n).max(0.0).sqrt());
        let (near, far) = (-c[2] - reach[2], -c[2] + reach[2]);
        if near <= 0.0 || near.is_nan() {
            return None;
        }
        // The box around the disc, seen in perspective: each edge at the depth at which it is farthest out.
        let most = |v: f32| self.focal * v / if v > 0.0 { near } else { far };
        let [right, left] = [most(c[0] + reach[0]), -most(-c[0] + reach[0])];
        let [top, bottom] = [most(c[1] + reach[1]), -most(-c[1] + reach[1])];
        Some([self.center[0] + left, self.center[1] - top, self.center[0] + right, self.center[1] - bottom])
    }
}

//! A camera as rays: which ray belongs to which point of the picture.

use isoswarm_field::vector::{V3, add, scale};

use super::{Clip, Ray, SIDE};

/// Rays of a picture: the ray through image point (x, y), pixels from the top left corner, begins at
/// origin + x · across + y · down and goes along direction + x · turn_across + y · turn_down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Beginning of the ray through (0, 0).
    pub origin: V3,
    /// How the beginning moves with x and with y: zero for a perspective view.
    pub steps: [V3; 2],
    /// Direction of the ray through (0, 0).
    pub direction: V3,
    /// How the direction changes with x and with y: zero for a parallel view.
    pub turns: [V3; 2],
    /// Least t.
    pub near: f64,
}

/// Which way a camera looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Where it stands.
    pub eye: V3,
    /// Unit vectors, at right angles: to the right, up, and towards the viewer.
    pub axes: [V3; 3],
}

impl View {
    /// A perspective view with an opening angle (radians, of the height) and a picture of so many pixels. A ray's t is the depth.
    pub fn perspective(pose: Pose, angle: f64, width: f64, height: f64) -> Self {
        let [right, up, toward] = pose.axes;
        let pixel = 2.0 * libm::tan(0.5 * angle) / height;
        let corner = add(scale(right, -0.5 * width * pixel), scale(up, 0.5 * height * pixel));
        Self {
            origin: pose.eye,
            steps: [[0.0; 3]; 2],
            direction: add(corner, scale(toward, -1.0)),
            turns: [scale(right, pixel), scale(up, -pixel)],
            near: 0.0,
        }
    }

    /// A parallel view of so many units of height, from the plane through the eye on.
    pub fn parallel(pose: Pose, units: f64, width: f64, height: f64) -> Self {
        let [right, up, toward] = pose.axes;
        let pixel = units / height;
        let corner = add(scale(right, -0.5 * width * pixel), scale(up, 0.5 * height * pixel));
        Self {
            origin: add(pose.eye, corner),
            steps: [scale(right, pixel), scale(up, -pixel)],
            direction: scale(toward, -1.0),
            turns: [[0.0; 3]; 2],
            near: 0.0,
        }
    }

    /// The ray through an image point, inside a clip region.
    pub fn ray(&self, x: f64, y: f64, clip: &Clip) -> Ray {
        let at = |base: V3, [u, v]: [V3; 2]| [0, 1, 2].map(|a| base[a] + x * u[a] + y * v[a]);
        clip.ray(at(self.origin, self.steps), at(self.direction, self.turns), self.near)
    }

    /// The rays of a tile: through points `step` apart (in pixels) from (x, y) on, where `wanted(column, row)`.
    pub fn tile(
        &self,
        x: f64,
        y: f64,
        step: f64,
        clip: &Clip,
        wanted: impl Fn(usize, usize) -> bool,
    ) -> Vec<Ray> {
        let nothing = Ray { origin: [0.0; 3], direction: [0.0; 3], near: 0.0, far: -1.0, face: None };
        let one = |k: usize| {
            let (column, row) = (k % SIDE, k / SIDE);
            if !wanted(column, row) {
                return nothing;
            }
            self.ray(x + column as f64 * step, y + row as f64 * step, clip)
        };
        (0..SIDE * SIDE).map(one).collect()
    }
}

//! Light and material to a colour, and what lies behind everything.

use super::camera::Camera;
use super::color::linear;
use super::light::{Ground, KEY};
use super::options::{Background, PictureOptions};
use super::vector::{V3, add, dot, mixed, scaled, smoothstep, unit};

/// Sky light of open ground, under a sky of brightness 0.72 + 0.28 sin(elevation).
const OPEN_GROUND: f32 = 0.907;

/// The lights and the backdrop of one picture.
pub(super) struct Studio<'a> {
    camera: &'a Camera,
    ground: Option<&'a Ground>,
    up: V3,
    key: V3,
    fill: V3,
    occlusion: f32,
    shadow: f32,
    backdrop: Option<[V3; 2]>,
    height: f32,
}

/// One visible point of the surface.
pub(super) struct Spot {
    /// Linear colour of the material.
    pub color: V3,
    /// Unit normal on the visible side.
    pub normal: V3,
    pub sky: f32,
    pub key: f32,
}

impl<'a> Studio<'a> {
    pub fn new(camera: &'a Camera, ground: Option<&'a Ground>, up: V3, options: &PictureOptions) -> Self {
        Self {
            camera,
            ground,
            up,
            key: unit(KEY),
            fill: unit([0.85, 0.10, 0.52]),
            occlusion: options.ambient_occlusion as f32,
            shadow: options.shadow as f32,
            backdrop: match options.background {
                Background::Gradient { top, bottom } => Some([linear(top), linear(bottom)]),
                Background::Transparent => None,
            },
            height: options.height as f32,
        }
    }

    /// Linear colour of a spot seen along `ray`, channels in 0..=1.
    pub fn shade(&self, spot: &Spot, ray: V3) -> V3 {
        let n = spot.normal;
        let toward = unit(scaled(ray, -1.0));
        let facing = dot(n, toward).max(0.0);
        let open = 0.72 + 0.28 * 0.667 * dot(n, self.up);
        let sky = open + (spot.sky - open).min(0.0) * self.occlusion;
        let hidden = (1.0 - spot.sky / open).clamp(0.0, 1.0) * self.occlusion;
        let key = 1.0 + (spot.key - 1.0) * self.shadow;

        // Diffuse: a warm key, a cool fill from the right, the sky, and what neighbours reflect into hollows.
        let lambert = dot(n, self.key).max(0.0) * key;
        let fill = dot(n, self.fill).max(0.0) * (1.0 - 0.7 * hidden);
        let mut light = scaled([1.06, 1.0, 0.92], 1.16 * lambert);
        light = add(light, scaled([0.80, 0.90, 1.06], 0.16 * fill));
        light = add(light, scaled([0.93, 0.98, 1.06], 0.54 * sky));
        let bounce = scaled(spot.color, 0.22 * hidden);
        light = add(light, bounce);
        let mut c = [spot.color[0] * light[0], spot.color[1] * light[1], spot.color[2] * light[2]];

        // Gloss: a soft highlight of the key, and the sky at grazing angles.
        let half = unit(add(self.key, toward));
        let shine = dot(n, half).max(0.0);
        let s2 = shine * shine;
        let s8 = s2 * s2 * s2 * s2;
        let s32 = s8 * s8 * s8 * s8;
        c = add(c, scaled([1.0, 0.98, 0.94], (0.16 * s32 + 0.05 * s8) * key * lambert.min(1.0)));
        let graze = 1.0 - facing;
        let rim = graze * graze * graze * graze;
        c = add(
            c,
            scaled([0.80, 0.90, 1.0], 0.22 * rim * (spot.sky * self.occlusion + 1.0 - self.occlusion)),
        );
        c.map(filmic)
    }

    /// Linear colour and opacity behind everything at image point (x, y).
    pub fn behind(&self, x: f32, y: f32) -> (V3, f32) {
        let dark = self.ground_shadow(x, y);
        match self.backdrop {
            Some([top, bottom]) => {
                let c = mixed(top, bottom, smoothstep(0.0, 1.0, y / self.height));
                // Shadows are a little blue: the sky still shines into them.
                (mixed(c, [c[0] * 0.10, c[1] * 0.12, c[2] * 0.17], dark), 1.0)
            }
            None => ([0.01, 0.012, 0.016], dark),
        }
    }

    fn ground_shadow(&self, x: f32, y: f32) -> f32 {
        let Some(ground) = self.ground else { return 0.0 };
        let ray = self.camera.ray(x, y);
        let fall = dot(ray, self.up);
        let start = self.camera.start(x, y);
        let above = dot(start, self.up) - ground.height;
        if fall >= -1e-4 || above <= 0.0 {
            return 0.0;
        }
        let p = add(start, scaled(ray, above / -fall));
        let (sky, key, away) = ground.at(p);
        let sky = (1.0 - sky / OPEN_GROUND).max(0.0) * self.occlusion;
        let key = (1.0 - key) * self.shadow;
        let fade = (1.0 - smoothstep(0.45, 1.0, away)) * smoothstep(0.03, 0.25, self.up[2]);
        (0.75 * sky + 0.30 * key).min(1.0) * fade
    }
}

/// Straight up to 0.6, then a shoulder that reaches 1 at infinity, so that highlights do not clip.
fn filmic(c: f32) -> f32 {
    const KNEE: f32 = 0.6;
    if c <= KNEE { c.max(0.0) } else { 1.0 - (1.0 - KNEE) * (1.0 - KNEE) / (c - KNEE + 1.0 - KNEE) }
}
